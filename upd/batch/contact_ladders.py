"""Ladders of a contact.

Meshes, elements, solvers, the edge of the patch where that is chosen, load steps, accuracies.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from upd.analyses import analysis_of
from upd.analyses.base import Plan
from upd.analyses.contact.plan import refined_growth
from upd.analyses.contact.varied import CURVED_GOVERNING, FLAT_GOVERNING
from upd.batch.curves import accuracy_curves, true_errors
from upd.batch.ladder import Counts, Ladder, Levels, StudyReport, even, shown
from upd.batch.study_point import Key, Settings, SolvedPoint, StudyPoint, matching
from upd.batch.study_tables import TextTable, cost_columns, make_table
from upd.errors import InputError
from upd.linalg import select
from upd.results.quantities import number_label
from upd.scene import Scene

#: numbers a ladder follows beside those the analysis names first
_NUMBERS = (
    "mean_pressure",
    "approach",
    "tangential_displacement",
    "K_N_secant_raw",
    "K_Tx_initial_raw",
    "K_Ty_initial_raw",
    "approach_damper",
    "approach_platform",
    "law_k_n",
    "cycle_energy",
)
#: divisions across the patch of a curved contact
_DIVISIONS = (12, 16, 20, 28, 40, 56)
#: shares of the scene's divisions for a flat contact: spacing from twice to half of it
_SHARES = (0.5, 0.67, 1.0, 1.34, 1.67)
_ELEMENTS = ("hex8", "hex8i", "hex20", "hex27")
#: element -> finest divisions: quadratic elements cost several times as much for the same patch
_FINEST = {"hex20": 28, "hex27": 20}
#: solver -> how many of the levels it can afford
_AFFORDABLE: Mapping[str, int | None] = {"pardiso": None, "superlu": 4, "amg": 3}
#: names a recipe gives to the edge that is divided
_EDGES = ("patch", "patch_length", "pad_length")


#: analysis -> numbers an accuracy is asked of, and the usual ones in per cent: 3 % takes 7 GB on
#: the ready sphere, 2 % 24 GB
_ASKED: Mapping[str, tuple[tuple[str, ...], tuple[float, ...]]] = {
    "hertz": (CURVED_GOVERNING, (40.0, 10.0, 3.0)),
    "flat": (FLAT_GOVERNING, (20.0, 10.0, 5.0)),
}
_ACCURACY_NOTES = (
    "estimated: by the run itself, a bound; true: against the closed form, where a number has one",
    "the accuracy is asked of these numbers alone; where one mesh reaches two accuracies, both "
    "levels are that mesh",
)


def _on_meshes(
    scene: Scene,
    levels: Levels,
    *,
    make: Callable[[Plan[Any], tuple[int, ...]], Iterable[StudyPoint]],
) -> Iterable[StudyPoint]:
    """Points on meshes of so many divisions across the patch: even numbers."""
    plan = analysis_of(scene).make_plan(scene)
    usual = _flat_levels(plan) if scene.analysis == "flat contact" else _DIVISIONS
    divisions = tuple(int(n) for n in levels or usual if n >= 4 and n % 2 == 0)
    if levels is not None and len(divisions) < max(2, len(levels)):
        raise InputError(
            f"--levels {shown(levels)}: give at least two even numbers of divisions, 4 or more"
        )
    return dict.fromkeys(make(plan, divisions))


def _flat_levels(plan: Plan[Any]) -> tuple[int, ...]:
    usual = int(plan.parameters["divisions"])
    return tuple(dict.fromkeys(even(share * usual) for share in _SHARES))


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
        n = even(factor * divisions)
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


def _accuracies(scene: Scene, levels: Levels) -> list[StudyPoint]:
    """The scene at one accuracy after the other, in per cent."""
    _, usual = _ASKED[analysis_of(scene).name]
    wanted = sorted(set(levels or usual), reverse=True)
    if levels is not None and (len(wanted) < 2 or not all(0.0 < p < 100.0 for p in wanted)):
        raise InputError(
            f"--levels {shown(levels)}: give at least two different errors in per cent, between 0 "
            "and 100, for example --levels 5 2 1"
        )
    return [
        StudyPoint("accuracy", f"{p:g} %", (("accuracy", p / 100.0),), p / 100.0, estimates=True)
        for p in wanted
    ]


def _accuracy_report(scene: Scene, solved: Sequence[SolvedPoint]) -> StudyReport:
    """What every accuracy costs, then the error of every number as estimated and in truth."""
    names, _ = _ASKED[analysis_of(scene).name]
    known = {key for one in solved for key in one.estimates}
    keys = [key for key in matching(solved, names) if key in known]
    wanted = ("wanted", "r", lambda one: str(one.point.label))
    tables = (
        make_table("What every accuracy costs", (wanted, *cost_columns()), solved),
        *_error_tables(solved, keys),
    )
    curves = tuple(accuracy_curves(solved, keys))
    return StudyReport(tables, bool(known), _ACCURACY_NOTES, curves)


def _error_tables(solved: Sequence[SolvedPoint], keys: Sequence[Key]) -> Iterable[TextTable]:
    """A table for the estimated errors and one for the true ones, a column per wanted accuracy."""
    kinds = {
        "Estimated error": [one.estimates for one in solved],
        "True error": [true_errors(one) for one in solved],
    }
    for title, errors in kinds.items():
        rows = [key for key in keys if any(key in at for at in errors)]
        levels = (
            (one.point.label, "r", partial(_percent, at))
            for one, at in zip(solved, errors, strict=True)
        )
        if rows:
            yield make_table(
                title,
                (
                    ("number", "l", lambda key: number_label(key[0])),
                    ("case", "l", lambda key: str(key[1].label)),
                    *levels,
                ),
                rows,
                whole=True,
            )


def _percent(errors: Mapping[Key, float], key: Key) -> str:
    return f"{100.0 * abs(errors[key]):.2g} %" if key in errors else ""


#: without coupling not even the cycle's energy depends on its load steps, and
#: `upd.batch.studies.variations` does not offer them
_STEPS = Counts(
    "steps",
    "{} load steps",
    "loads.cycle_steps",
    (10, 20, 40, 80, 160),
    8,
    lambda scene: (("want", ["cycle"]), ("left_out.solve", "no")),
)
#: variations of a contact whose patch a recipe's own faces decide, and of one where the scene
#: chooses it
FLAT: Mapping[str, Ladder] = {
    "mesh": Ladder(partial(_on_meshes, make=_meshes), _NUMBERS),
    "element": Ladder(partial(_on_meshes, make=_elements), _NUMBERS),
    "solver": Ladder(partial(_on_meshes, make=_solvers), _NUMBERS),
    "steps": Ladder(_STEPS, _NUMBERS, against="finest"),
    "accuracy": Ladder(_accuracies, report=_accuracy_report),
}
CURVED: Mapping[str, Ladder] = {
    "mesh": FLAT["mesh"],
    "element": FLAT["element"],
    "solver": FLAT["solver"],
    # the edge of the patch at constant node spacing
    "patch": Ladder(partial(_on_meshes, make=_patches), _NUMBERS),
    "steps": FLAT["steps"],
    "accuracy": FLAT["accuracy"],
}
