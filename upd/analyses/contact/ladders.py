"""What a convergence study of a contact varies: meshes, elements, solvers, load steps, accuracies.

Shared by curved and flat contacts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from upd.analyses import analysis_of
from upd.analyses.base import Plan
from upd.analyses.contact.plan import refined_growth
from upd.linalg import select
from upd.scene import Scene
from upd.vary.ladder import (
    Asked,
    Ladder,
    accuracy_report,
    chosen_levels,
    counts,
    finest_report,
    whole_levels,
)
from upd.vary.variation import Overrides, Variation

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
_ELEMENTS = ("hex8", "hex8i", "hex20", "hex27")
#: element -> finest divisions: quadratic elements cost several times as much for the same patch
_FINEST = {"hex20": 28, "hex27": 20}
#: solver -> how many of the levels it can afford
_AFFORDABLE: Mapping[str, int | None] = {"pardiso": None, "superlu": 4, "amg": 3}
#: names a recipe gives to the edge that is divided
_EDGES = ("patch", "patch_length", "pad_length")
_ACCURACY_NOTES = (
    "estimated: by the run itself, a bound; true: against the closed form, where a number has one",
    "the accuracy is asked of these numbers alone; where one mesh reaches two accuracies, both "
    "levels are that mesh",
)

#: plan, divisions across the patch -> variations
Maker = Callable[[Plan[Any], Sequence[int]], Iterable[Variation]]
#: plan -> the usual divisions across the patch
Usual = Callable[[Plan[Any]], Sequence[int]]


def ladders(
    usual: Usual, governing: Sequence[str], accuracies: Sequence[float]
) -> dict[str, Ladder]:
    """What every contact can vary.

    Parameters
    ----------
    governing
        Numbers an accuracy is asked of.
    accuracies
        The usual ones, in per cent.
    """
    return {
        "mesh": on_meshes(usual, _meshes),
        "element": on_meshes(usual, _elements),
        "solver": on_meshes(usual, _solvers),
        "steps": Ladder(_STEPS, _NUMBERS, finest_report, applies=lambda scene: scene.coupled),
        "accuracy": Ladder(
            partial(_accuracies, usual=accuracies),
            report=lambda scene, solved, names: accuracy_report(scene, solved, governing),
            notes=lambda scene: _ACCURACY_NOTES,
        ),
    }


def on_meshes(usual: Usual, make: Maker) -> Ladder:
    """Variations on meshes of so many divisions across the patch: even numbers."""

    def variations(scene: Scene, asked: Asked) -> Iterable[Variation]:
        plan = analysis_of(scene).make_plan(scene)
        divisions = whole_levels(asked, 4, "even numbers of divisions", step=2) or usual(plan)
        return dict.fromkeys(make(plan, divisions))

    return Ladder(variations, _NUMBERS)


def _meshes(plan: Plan[Any], levels: Sequence[int]) -> list[Variation]:
    element = plan.scene.mesh.element
    return [_on_mesh(element, element, n, plan) for n in levels]


def _elements(plan: Plan[Any], levels: Sequence[int]) -> list[Variation]:
    chosen = [(e, max(4, 2 * (n // 4)) if e == "hex27" else n) for e in _ELEMENTS for n in levels]
    return [_on_mesh(e, e, n, plan) for e, n in chosen if n <= _FINEST.get(e, n)]


def _solvers(plan: Plan[Any], levels: Sequence[int]) -> list[Variation]:
    known = [s for s in _AFFORDABLE if s != "pardiso" or select.has_pardiso()]
    return [
        _on_mesh(s, plan.scene.mesh.element, n, plan, ("solver.name", s))
        for s in known
        for n in levels[: _AFFORDABLE[s]]
    ]


def _on_mesh(
    source: str, element: str, divisions: int, plan: Plan[Any], *extra: tuple[str, Any]
) -> Variation:
    given = plan.parameters
    patch, usual = float(next(given[e] for e in _EDGES if e in given)), int(given["divisions"])
    nodes = 2 * divisions if element in ("hex20", "hex27") else divisions
    overrides: Overrides = (("geometry.divisions", divisions), ("mesh.element", element), *extra)
    long = divisions
    if "divisions_long" in given:
        long = 2 * max(1, round(divisions * int(given["divisions_long"]) / (2 * usual)))
        overrides += (("geometry.divisions_long", long),)
    if "growth" in given:
        growth = refined_growth(float(given["growth"]), usual / nodes)
        overrides += (("geometry.growth", round(growth, 4)),)
    return Variation(source, f"{long} x {divisions}", overrides, patch / divisions)


def _accuracies(scene: Scene, asked: Asked, *, usual: Sequence[float]) -> list[Variation]:
    """The scene at one accuracy after the other."""
    del scene
    words = "errors in per cent, between 0 and 100, for example --levels 5 2 1"
    wanted = (
        usual if asked is None else chosen_levels(asked, lambda p: 0.0 < p < 100.0, words)[::-1]
    )
    return [
        Variation("accuracy", f"{p:g} %", (("accuracy", p / 100.0),), p / 100.0) for p in wanted
    ]


#: without coupling not even the cycle's energy depends on its load steps
_STEPS = counts(
    "steps",
    "{} load steps",
    "loads.cycle_steps",
    (10, 20, 40, 80, 160),
    8,
    (("want", ["cycle"]), ("left_out.solve", "no")),
)
