"""Ladders of runs: one scene on a sequence of meshes, elements, solvers or patches. Finished points are kept: a killed study resumes."""

from __future__ import annotations

import hashlib
import json
import multiprocessing
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

from upd import recipes
from upd.analyses import make_plan
from upd.errors import InputError, UpdError
from upd.plan import Plan
from upd.results import write_text
from upd.scene import AnyScene, Scene, load_scene

#: Called with (point number, points in all, curve, label, seconds or None while it runs, note).
Watcher = Callable[[int, int, str, str, float | None, str], None]

_KILLED = "the process was killed"
VARIATIONS = ("mesh", "element", "solver", "patch", "setup")


@dataclass(frozen=True)
class Point:
    """One run of a study: the curve it belongs to, its label, what is set in the scene, and the node spacing in the patch in mm."""

    curve: str
    label: str
    settings: tuple[tuple[str, Any], ...]
    h: float

    def key(self, scene: AnyScene) -> str:
        """Name of the point's file: depends on the scene, on what is set, and on the code that solves it."""
        text = json.dumps([scene.text, self.settings, _code(scene.recipe)], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


@cache
def _code(recipe: str) -> str:
    """Digest of our sources and of a user's recipe file."""
    package = Path(__file__).resolve().parents[1]
    files = [*sorted(package.rglob("*.py")), *sorted((package.parent / "geometry").rglob("*.py"))]
    files += [Path(recipe)] if recipe.endswith(".py") else []
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.read_bytes())
    return digest.hexdigest()


@dataclass(frozen=True)
class Outcome:
    """What a point gave: numbers by (name, case), seconds and memory, or the reason it failed."""

    curve: str
    label: str
    h: float
    values: Mapping[str, float]
    errors: Mapping[str, float]
    thesis: Mapping[str, float]
    stages: Mapping[str, float]
    seconds: float
    memory_mb: float
    n_dof: int
    failure: str = ""


def make_points(scene: Scene, vary: str, levels: tuple[int, ...] | None = None) -> list[Point]:
    """The ladder of a variation.

    mesh    : divisions of the patch, the scene's element.
    element : the same for all four elements; hex27 with half the divisions (the same spacing of nodes that carry contact forces).
    solver  : direct (MKL and SuperLU) and multigrid, on the meshes each can afford.
    patch   : edge of the potential patch at constant node spacing.
    setup   : one parameter at a time of what the stiffness of a flat contact depends on (`upd.study.setups`).
    """
    if vary not in VARIATIONS:
        raise InputError(f"--vary {vary}: choose one of {', '.join(VARIATIONS)}")
    if levels is not None and (len(levels) < 2 or any(n < 4 or n % 2 for n in levels)):
        raise InputError(f"--levels {levels}: give at least two even numbers of divisions, 4 or more")
    if scene.mesh.accuracy is not None:
        raise InputError("study: the scene chooses its mesh by mesh.accuracy; give geometry.divisions instead")
    plan = make_plan(scene)
    element = scene.mesh.element
    flat = recipes.analysis(scene.recipe) == "flat contact"
    if vary == "setup":
        from upd.study.setups import setup_points

        return setup_points(scene, plan)
    if flat and vary == "patch":
        raise InputError("--vary patch: the patch of a flat contact is the damper's face; vary mesh, element, solver or setup")
    usual = levels or (_flat_levels(plan) if flat else (12, 16, 20, 28, 40, 56))
    if vary == "mesh":
        return [_mesh_point(element, element, n, plan) for n in usual]
    if vary == "element":
        out = []
        for e in ("hex8", "hex8i", "hex20", "hex27"):
            for n in usual:
                divisions = max(4, 2 * (n // 4)) if e == "hex27" else n
                # Quadratic elements cost several times as much for the same patch.
                if divisions <= {"hex20": 28, "hex27": 20}.get(e, n):
                    out.append(_mesh_point(e, e, divisions, plan))
        return list(dict.fromkeys(out))
    if vary == "solver":
        from upd.linalg import select

        affordable = {"pardiso": usual, "superlu": usual[:4], "amg": usual[:3]}
        known = [s for s in affordable if s != "pardiso" or select.has_pardiso()]
        return [_mesh_point(s, element, n, plan, ("solver.name", s)) for s in known for n in affordable[s]]
    patch, divisions = float(plan.parameters["patch"]), int(plan.parameters["divisions"])
    out = []
    for factor in (0.6, 0.8, 1.0, 1.3, 1.6):
        n = max(4, 2 * round(factor * divisions / 2))
        edge = patch * n / divisions
        settings = (("geometry.patch", f"{edge!r} mm"), ("geometry.divisions", n))
        out.append(Point("patch", f"{edge:.3g} mm", settings, patch / divisions))
    return out


def refined_growth(growth: float, ratio: float) -> float:
    """Growth of a mesh whose spacing is ``ratio`` times that of a mesh with ``growth``, so that the far mesh is refined with the patch.

    Sizes grow by the same factor over 1 / ratio as many elements; within what the recipes accept.
    """
    return float(min(1.9, max(1.06, growth**ratio)))


def _flat_levels(plan: Plan) -> tuple[int, ...]:
    """Divisions across the patch around those of the scene: spacing from twice to half of it."""
    usual = int(plan.parameters["divisions"])
    return tuple(dict.fromkeys(max(4, 2 * round(f * usual / 2)) for f in (0.5, 0.67, 1.0, 1.34, 1.67)))


def _mesh_point(curve: str, element: str, divisions: int, plan: Plan, *extra: tuple[str, Any]) -> Point:
    edge = next(name for name in ("patch", "patch_length", "pad_length") if name in plan.parameters)
    patch, usual = float(plan.parameters[edge]), int(plan.parameters["divisions"])
    nodes = 2 * divisions if element in ("hex20", "hex27") else divisions
    settings: list[tuple[str, Any]] = [("geometry.divisions", divisions), ("mesh.element", element), *extra]
    label = f"{divisions} x {divisions}"
    if "divisions_long" in plan.parameters:
        long = 2 * max(1, round(divisions * int(plan.parameters["divisions_long"]) / (2 * usual)))
        settings.append(("geometry.divisions_long", long))
        label = f"{long} x {divisions}"
    if "growth" in plan.parameters:
        settings.append(("geometry.growth", round(refined_growth(float(plan.parameters["growth"]), usual / nodes), 4)))
    return Point(curve, label, tuple(settings), patch / divisions)


def run_points(
    scene: AnyScene, points: list[Point], folder: Path, *, watch: Watcher | None = None, in_process: bool = False
) -> list[Outcome]:
    """Run the points that ``folder`` does not hold yet, each in a process of its own (clean memory figures), and return all outcomes.

    A point that fails is an outcome with its reason. Kill the study at any moment: finished points are kept.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"the study folder {folder} cannot be written ({error.strerror}): choose another with --out") from None
    outcomes = []
    for k, point in enumerate(points):
        path = folder / f"point-{point.key(scene)}.json"
        done = _read(path)
        if done is None:
            if watch:
                watch(k + 1, len(points), point.curve, point.label, None, "")
            done = _solve(scene, point, in_process)
            if not done.failure.startswith(_KILLED):
                # A killed point is run again the next time.
                write_text(path, json.dumps(asdict(done), indent=1) + "\n")
            note = done.failure
        else:
            note = done.failure or "kept from an earlier run"
        if watch:
            watch(k + 1, len(points), point.curve, point.label, done.seconds, note)
        outcomes.append(done)
    return outcomes


def _read(path: Path) -> Outcome | None:
    try:
        return Outcome(**json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None


def _solve(scene: AnyScene, point: Point, in_process: bool) -> Outcome:
    if in_process:
        return solve_point(scene.text, point)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        try:
            return pool.submit(solve_point, scene.text, point).result()
        except BrokenProcessPool:
            failure = f'{_KILLED}, most likely for lack of memory: use a coarser level or solver.name = "amg"'
            return Outcome(point.curve, point.label, point.h, {}, {}, {}, {}, 0.0, 0.0, 0, failure)


def solve_point(text: str, point: Point) -> Outcome:
    """Run one point; a failure becomes its reason."""
    import tomllib

    from upd.runner import run

    data = tomllib.loads(text)
    try:
        scene = load_scene(data, dict(point.settings))
        result = run(scene)
    except (UpdError, MemoryError, ArithmeticError) as error:
        return Outcome(
            point.curve, point.label, point.h, {}, {}, {}, {}, 0.0, 0.0, 0, f"{type(error).__name__}: {error}".replace("\n", " ")
        )
    key = "{0.name}|{0.case}".format
    return Outcome(
        point.curve,
        point.label,
        point.h,
        {key(r): r.value for r in result.rows},
        {key(r): r.error for r in result.rows if r.error is not None and r.exact},
        {key(r): r.thesis_error for r in result.rows if r.thesis_error is not None},
        dict(result.cost["stages"]),
        float(result.cost["total_s"]),
        float(result.cost["peak_rss_mb"]),
        int(sum(result.size["n_dof"].values())),
    )
