"""Ladders of a contact.

Meshes, elements, solvers, and the edge of the patch where that is chosen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from upd.analyses import analysis_of
from upd.analyses.base import Plan
from upd.analyses.contact.plan import refined_growth
from upd.batch.convergence import ConvergenceStudy
from upd.batch.curves import ConvergenceCurve, finest_curves, make_curves
from upd.batch.ladder import (
    Levels,
    Settings,
    SolvedPoint,
    Study,
    StudyMaker,
    StudyPoint,
    followed,
    matching,
    told,
    whole_levels,
)
from upd.errors import InputError
from upd.linalg import select
from upd.scene import Scene

#: numbers a ladder follows beside those the analysis names first
_MORE = (
    *(
        "mean_pressure",
        "approach",
        "tangential_displacement",
        "K_N_secant_raw",
        "K_Tx_initial_raw",
        "K_Ty_initial_raw",
    ),
    *("approach_damper", "approach_platform", "law_k_n", "cycle_energy"),
)
#: numbers the loads alone decide: no mesh moves them
_OF_LOADS = ("F_N", "F_T")
#: divisions across the patch of a curved contact
_DIVISIONS = (12, 16, 20, 28, 40, 56)
#: shares of the scene's divisions for a flat contact: spacing from twice to half of it
_SHARES = (0.5, 0.67, 1.0, 1.34, 1.67)
#: load steps of the full cycle
_STEPS = (10, 20, 40, 80, 160)
_ELEMENTS = ("hex8", "hex8i", "hex20", "hex27")
#: element -> finest divisions: quadratic elements cost several times as much for the same patch
_FINEST = {"hex20": 28, "hex27": 20}
#: solver -> how many of the levels it can afford
_AFFORDABLE: Mapping[str, int | None] = {"pardiso": None, "superlu": 4, "amg": 3}
#: names a recipe gives to the edge that is divided
_EDGES = ("patch", "patch_length", "pad_length")


def contact_study(scene: Scene, vary: str, levels: Levels = None) -> Study:
    """The ladder of a variation.

    Parameters
    ----------
    vary
        "mesh": divisions of the patch, the scene's element. "element": the same for all four
        elements; hex27 with half the divisions (the same spacing of nodes that carry contact
        forces). "solver": direct (MKL and SuperLU) and multigrid, on the meshes each can afford.
        "patch": edge of the potential patch at constant node spacing. "steps": load steps of the
        full cycle, with coupled contact.
    levels
        Divisions across the patch, even numbers, or load steps; None for the usual ones.

    Raises
    ------
    InputError
        For levels that are none, and when the scene leaves the mesh to an accuracy.
    """
    points = contact_points(scene, vary, levels)
    names = [name for name in followed(scene, *_MORE) if name not in _OF_LOADS]
    title = f"{scene.title or scene.name}: what accuracy costs, {vary}"
    curves = _step_curves if vary == "steps" else make_curves
    return ConvergenceStudy(title, tuple(points), partial(curves, names=names))


def _step_curves(solved: Sequence[SolvedPoint], names: Sequence[str]) -> list[ConvergenceCurve]:
    """Numbers against those of the finest level: the closed form has no part of the mesh's error,
    which no load step takes away.
    """
    good = [one for one in solved if not one.outcome.failure]
    return finest_curves(good, matching(good, names), lambda one: one.outcome.seconds)


def contact_points(scene: Scene, vary: str, levels: Levels = None) -> list[StudyPoint]:
    """Points of `contact_study`."""
    if vary == "steps":
        return _steps(levels)
    plan = analysis_of(scene).make_plan(scene)
    usual = _flat_levels(plan) if scene.analysis == "flat contact" else _DIVISIONS
    return list(dict.fromkeys(_MAKERS[vary](plan, _divisions(levels) or usual)))


def _divisions(levels: Levels) -> tuple[int, ...] | None:
    if levels is None:
        return None
    even = tuple(int(n) for n in levels if n >= 4 and n % 2 == 0)
    if len(even) < max(2, len(levels)):
        raise InputError(
            f"--levels {told(levels)}: give at least two even numbers of divisions, 4 or more"
        )
    return even


def _steps(levels: Levels) -> list[StudyPoint]:
    """Load steps of the full cycle, the only ones: without coupling not even its energy depends on
    them, and `upd.batch.studies.variations` does not offer the ladder.
    """
    return [
        StudyPoint(
            "steps",
            f"{n} load steps",
            (("want", ["cycle"]), ("left_out.solve", "no"), ("loads.cycle_steps", n)),
            1.0 / n,
        )
        for n in sorted(whole_levels(levels, 8) or _STEPS)
    ]


def _flat_levels(plan: Plan[Any]) -> tuple[int, ...]:
    usual = int(plan.parameters["divisions"])
    return tuple(dict.fromkeys(max(4, 2 * round(share * usual / 2)) for share in _SHARES))


def _meshes(plan: Plan[Any], levels: tuple[int, ...]) -> list[StudyPoint]:
    element = plan.scene.mesh.element
    return [_mesh_point(element, element, n, plan) for n in levels]


def _elements(plan: Plan[Any], levels: tuple[int, ...]) -> list[StudyPoint]:
    chosen = [(e, max(4, 2 * (n // 4)) if e == "hex27" else n) for e in _ELEMENTS for n in levels]
    return [_mesh_point(e, e, n, plan) for e, n in chosen if n <= _FINEST.get(e, n)]


def _solvers(plan: Plan[Any], levels: tuple[int, ...]) -> list[StudyPoint]:
    known = [s for s in _AFFORDABLE if s != "pardiso" or select.has_pardiso()]
    return [
        _mesh_point(s, plan.scene.mesh.element, n, plan, ("solver.name", s))
        for s in known
        for n in levels[: _AFFORDABLE[s]]
    ]


def _patches(plan: Plan[Any], levels: tuple[int, ...]) -> list[StudyPoint]:
    patch, divisions = float(plan.parameters["patch"]), int(plan.parameters["divisions"])
    out = []
    for factor in (0.6, 0.8, 1.0, 1.3, 1.6):
        n = max(4, 2 * round(factor * divisions / 2))
        edge = patch * n / divisions
        settings = (("geometry.patch", f"{edge!r} mm"), ("geometry.divisions", n))
        out.append(StudyPoint("patch", f"{edge:.3g} mm", settings, patch / divisions))
    return out


def _mesh_point(
    curve: str, element: str, divisions: int, plan: Plan[Any], *extra: tuple[str, Any]
) -> StudyPoint:
    edge = next(name for name in _EDGES if name in plan.parameters)
    patch, usual = float(plan.parameters[edge]), int(plan.parameters["divisions"])
    nodes = 2 * divisions if element in ("hex20", "hex27") else divisions
    settings: Settings = (("geometry.divisions", divisions), ("mesh.element", element), *extra)
    label = f"{divisions} x {divisions}"
    if "divisions_long" in plan.parameters:
        long = 2 * max(1, round(divisions * int(plan.parameters["divisions_long"]) / (2 * usual)))
        settings += (("geometry.divisions_long", long),)
        label = f"{long} x {divisions}"
    if "growth" in plan.parameters:
        settings += (
            (
                "geometry.growth",
                round(refined_growth(float(plan.parameters["growth"]), usual / nodes), 4),
            ),
        )
    return StudyPoint(curve, label, settings, patch / divisions)


_MAKERS = {"mesh": _meshes, "element": _elements, "solver": _solvers, "patch": _patches}
#: variations of a contact whose patch a recipe's own faces decide, and of one where the scene
#: chooses it
FLAT: Mapping[str, StudyMaker] = dict.fromkeys(
    ("mesh", "element", "solver", "steps"), contact_study
)
CURVED: Mapping[str, StudyMaker] = dict.fromkeys((*_MAKERS, "steps"), contact_study)
