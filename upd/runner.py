"""Run a scene: plan, solve, check, and leave a run folder behind."""

from __future__ import annotations

import logging
import threading
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from upd.errors import ConvergenceError, InputError, UpdError
from upd.linalg.select import memory_left
from upd.plan import Plan, make_plan
from upd.progress import Listener, Stages, silent
from upd.quasi_static import Solution, solve
from upd.results import Check, Row, RunResult, write_netcdf, write_summary, write_text
from upd.rows import make_rows
from upd.scene import Scene, load_scene
from upd.study.accuracy import Estimates, choose, predicted_plan
from upd.verdict import check_solution

log = logging.getLogger("upd")


def run(
    scene: Scene | str | Path | Mapping[str, Any],
    *,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    out: str | Path | None = None,
    progress: Listener = silent,
) -> RunResult:
    """Run ``scene`` (a Scene, a ready name, a .toml path or a mapping) and return its result.

    out      : run folder to write (made when missing); None writes nothing.
    progress : called at the beginning and the end of every stage.

    Raises InputError for a bad scene (nothing is written) and ConvergenceError when a solver or a self-check fails: the run folder then
    holds the log and what converged.
    """
    if not isinstance(scene, Scene):
        scene = load_scene(scene, overrides)
    elif overrides:
        raise InputError("overrides: the scene is loaded already; give them to load_scene")
    plan = make_plan(scene) if scene.mesh.accuracy is None else predicted_plan(scene)
    refuse_oversize(plan)
    folder = None if out is None else _make_folder(Path(out), scene)
    handler = _log_to(folder)
    stages = Stages(progress)
    if folder is not None:
        # matplotlib takes a while to import: meanwhile the solver computes.
        threading.Thread(target=import_module, args=("upd.plots",), daemon=True).start()
    try:
        return _run(scene, plan, stages, folder)
    finally:
        if handler is not None:
            log.removeHandler(handler)
            handler.close()


def _run(scene: Scene, plan: Plan, stages: Stages, folder: Path | None) -> RunResult:
    estimates: Estimates = {}
    try:
        if scene.mesh.accuracy is not None:
            level, estimates = choose(scene, lambda p: _level(p, stages))
            plan, solution = level.plan, level.solved
        else:
            solution = solve(plan, stages)
    except UpdError as error:
        log.error("failed: %s", error)
        if folder is not None:
            _leave(plan, error.partial, stages, folder, f"failed: {error}")
        raise
    except BaseException as error:
        log.exception("stopped")
        if folder is not None:
            _leave(plan, getattr(error, "partial", None), stages, folder, f"stopped: {type(error).__name__}")
        raise
    checks = check_solution(solution)
    failed = [c for c in checks if not c.passed and c.fatal]
    status = "ok" if not failed else "failed: " + "; ".join(_complaint(c) for c in failed)
    result = _leave(plan, solution, stages, folder, status, checks, estimates)
    if failed:
        log.error(status)
        failure = _failure(failed)
        failure.result = result
        raise failure
    return result


def refuse_oversize(plan: Plan) -> None:
    """Raise InputError when the plan needs far more memory than there is: better now than after an hour."""
    limit = plan.scene.solver.memory or memory_left()
    if plan.memory_bytes > 2.0 * limit:
        raise InputError(
            f"the mesh needs about {plan.memory_bytes / 1e9:.3g} GB ({plan.parameters.get('divisions')} divisions), there are "
            f"{limit / 1e9:.3g} GB: use fewer divisions, a patch sized from the load, loads nearer to each other, or ask for less accuracy"
        )


def _level(plan: Plan, stages: Stages) -> tuple[Solution, tuple[Row, ...], float]:
    """One level of the accuracy ladder: solution, rows and seconds."""
    before = stages.elapsed()
    refuse_oversize(plan)
    with stages("accuracy ladder", f"{plan.parameters['divisions']} divisions on {plan.parameters['patch']:.3g} mm"):
        solution = solve(plan, Stages())
    return solution, tuple(make_rows(solution)), stages.elapsed() - before


def _failure(failed: list[Check]) -> UpdError:
    text = "\n".join(_complaint(c) for c in failed)
    kind = (
        InputError
        if all(c.name in ("patch rim", "Dundurs beta", "contact radius against sphere", "transverse slip") for c in failed)
        else ConvergenceError
    )
    return kind(f"self-check failed\n{text}")


def _complaint(check: Check) -> str:
    case = f" ({check.case})" if check.case else ""
    return f"{check.name}{case}: {check.says} = {check.value:.3g}, limit {check.limit:.3g}; {check.remedy}"


def _leave(
    plan: Plan,
    solution: Solution | None,
    stages: Stages,
    folder: Path | None,
    status: str,
    checks: Sequence[Check] = (),
    estimates: Estimates | None = None,
) -> RunResult:
    """Collect the result and write the run folder."""
    rows = [_with_estimate(r, estimates or {}) for r in (make_rows(solution) if solution is not None else [])]
    arrays = _arrays(solution) if solution is not None else {}
    if folder is not None and solution is not None:
        with stages("files", str(folder)):
            _write_files(plan, solution, arrays, folder)
    result = RunResult(
        scene=plan.scene.name,
        title=plan.scene.title,
        status=status,
        rows=tuple(rows),
        effects=tuple(_effects(plan, checks)),
        checks=tuple(checks),
        size=_size(plan, solution) | {"mesh": dict(plan.parameters), "solver": dict(plan.solver)},
        cost=stages.cost(),
        arrays=arrays,
        folder=folder,
    )
    if folder is not None:
        write_summary(result, folder)
    return result


def _with_estimate(row: Row, estimates: Estimates) -> Row:
    found = estimates.get((row.name, row.case))
    return row if found is None else replace(row, estimated_error=found[0], half_error_cost_s=found[1])


def _effects(plan: Plan, checks: Sequence[Check]) -> list[dict[str, Any]]:
    out = []
    for effect in plan.effects:
        mine = [c for c in checks if effect.check and c.name == effect.check]
        verdict = "" if effect.on or not effect.check else ("not reached" if not mine else "")
        if mine:
            worst = max(mine, key=lambda c: (not c.passed, c.value))
            verdict = f"{worst.verdict}: {worst.says} = {worst.value:.3g} (limit {worst.limit:.3g})"
        out.append({"name": effect.name, "on": effect.on, "why": effect.why, "check": effect.check, "verdict": verdict})
    return out


def _size(plan: Plan, solution: Solution | None) -> dict[str, Any]:
    size: dict[str, Any] = {"symmetry": plan.symmetry, "n_dof": {}, "n_hex": {}, "n_pairs": None}
    for body, count in plan.size.items():
        size["n_dof"][body] = 3 * count["nodes"]
        size["n_hex"][body] = count["hexes"]
    if solution is not None:
        size["n_pairs"] = len(solution.model.gap)
        size["n_pairs_whole_patch"] = len(solution.model.patch.X) * len(solution.model.patch.Y)
    return size


def _arrays(solution: Solution) -> dict[str, dict[str, Any]]:
    patch = solution.model.patch
    lattice = {"x": (("x",), patch.X, {"units": "mm"}), "y": (("y",), patch.Y, {"units": "mm"})}
    arrays: dict[str, dict[str, Any]] = {}
    xy = ("x", "y")
    for case in solution.normal:
        arrays[case.label] = lattice | {
            "pressure": (xy, case.pressure, {"units": "MPa"}),
            "normal_force": (xy, case.force, {"units": "N"}),
            "gap": (xy, case.gap, {"units": "mm"}),
            "contact": (xy, case.force > 0.0, {"flag_meanings": "open contact"}),
        }
    for t in solution.tangential:
        dims = (*xy, "direction") if t.traction.ndim == 3 else xy
        arrays[t.label] = lattice | {
            "traction": (dims, t.traction, {"units": "MPa"}),
            "slip": (dims, t.slip, {"units": "mm"}),
            "stick": (xy, t.stick, {"flag_meanings": "slip_or_open stick"}),
        }
    for c in solution.cycles:
        arrays[f"cycle {c.label}"] = {
            "displacement": (("step",), c.displacement, {"units": "mm"}),
            "tangential_force": (("step",), c.load, {"units": "N"}),
        }
    if solution.curve:
        d, F = np.array(solution.curve).T
        arrays["force-approach"] = {"approach": (("point",), d, {"units": "mm"}), "normal_force": (("point",), F, {"units": "N"})}
    return arrays


def _write_files(plan: Plan, solution: Solution, arrays: Mapping[str, Mapping[str, Any]], folder: Path) -> None:
    # matplotlib and meshio are slow to import: only when files are wanted.
    from upd.export import write_fields, write_mesh
    from upd.plots import save_figures

    write_netcdf(folder / "result.nc", arrays)
    save_figures(solution, folder)
    bodies = (solution.model.upper, solution.model.lower)
    meshes = {b.name: b.mesh for b in bodies}
    write_mesh(meshes, folder / "mesh.vtu")
    if plan.scene.wants("fields"):
        data = {}
        for body in bodies:
            fields = {f"displacement_{c.load:g}N": c.displacement[body.name] for c in solution.normal if body.name in c.displacement}
            contact = body.contact[solution.model.multipliers.nodes]
            for c in solution.normal:
                pressure = np.zeros(body.mesh.n_node)
                pressure[contact] = c.solution.force / solution.model.multipliers.weights
                fields[f"pressure_{c.load:g}N"] = pressure
            data[body.name] = fields
        write_fields(folder / "fields.vtu", meshes, data)


def _make_folder(folder: Path, scene: Scene) -> Path:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for old in _OUTPUTS:
            (folder / old).unlink(missing_ok=True)
        write_text(folder / "scene.toml", scene.text)
    except OSError as error:
        raise InputError(f"the run folder {folder} cannot be written ({error.strerror}): choose another with --out") from None
    return folder


#: What a run may write: removed at its start, so that nothing of an earlier run in the same folder is taken for this one's.
_OUTPUTS = (
    *("summary.json", "result.nc", "mesh.vtu", "fields.vtu"),
    *(f"{name}.png" for name in ("pressure", "force_approach", "stick_slip", "traction", "hysteresis")),
)


def _log_to(folder: Path | None) -> logging.Handler | None:
    if folder is None:
        return None
    handler = logging.FileHandler(folder / "run.log", mode="w", encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)-7s %(name)s: %(message)s"))
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    return handler
