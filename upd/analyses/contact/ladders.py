"""What a convergence study of a contact varies: meshes, elements, solvers, load steps, accuracies,
the patch of a curved contact, and what moves the stiffness of a flat one: one parameter of the
scene at a time, each beside the scene as given.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from upd.analyses.base import Plan
from upd.analyses.contact.bodies import held_sets
from upd.analyses.contact.plan import is_curved
from upd.analyses.contact.varied import PROBLEM, edge_of, governing, level_geometry
from upd.analyses.cost import NODES
from upd.linalg import select
from upd.mesh import recipes
from upd.scene import Scene
from upd.vary.curves import points_table
from upd.vary.ladder import (
    Asked,
    Ladder,
    StudyReport,
    accuracy_report,
    chosen_levels,
    counts,
    even,
    finest_report,
    no_levels,
    whole_levels,
)
from upd.vary.outcome import SolvedPoint, matching, without_failed
from upd.vary.variation import Key, Overrides, Variation, of_geometry
from upd.vary.wanted import plan_wanted

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
#: element -> finest divisions: quadratic elements cost several times as much for the same patch
_FINEST = {"hex8": math.inf, "hex8i": math.inf, "hex20": 28, "hex27": 20}
#: solver -> how many of the levels it can afford
_AFFORDABLE: Mapping[str, int | None] = {"pardiso": None, "superlu": 4, "amg": 3}
_ACCURACY_NOTES = (
    "estimated: by the run itself, a bound; true: against the closed form, where a number has one",
    "the accuracy is asked of these numbers alone; where one mesh reaches two accuracies, both "
    "levels are that mesh",
)
#: usual divisions across the patch of a curved contact; shares of a flat scene's own: spacing from
#: twice to half of it
_DIVISIONS, _SHARES = (12, 16, 20, 28, 40, 56), (0.5, 0.67, 1.0, 1.34, 1.67)
#: usual accuracies in per cent, of a curved contact (3 % takes 7 GB on the ready sphere, 2 % 24 GB)
#: and of a flat one
_ACCURACIES, _FLAT_ACCURACIES = (40.0, 10.0, 3.0), (20.0, 10.0, 5.0)
#: numbers of the table of what moves the stiffness, of one pad where the contact is two
_STIFFNESSES = ("K_N_secant_raw", "K_N_*_alone", "K_Tx_initial_raw", "K_Ty_initial_raw")
_PER_PAD = ("K_N_per_pad", "K_N_*_alone", "K_Tx_per_pad", "K_Ty_per_pad")
#: lengths of a recipe, and times of them that are tried
_FACTORS = {
    **dict.fromkeys(("margin", "thickness"), (0.25, 0.5, 1.5)),
    **dict.fromkeys(("patch_length", "patch_width", "pad_length"), (0.8, 0.6, 0.4)),
    "band": (0.2,),
}

#: plan, divisions across the patch -> variations
Maker = Callable[[Plan[Any], Sequence[int]], Iterable[Variation]]


def _on_meshes(make: Maker, applies: Callable[[Scene], bool] = lambda scene: True) -> Ladder:
    """Variations on meshes of so many divisions across the patch: even numbers."""

    def variations(scene: Scene, asked: Asked) -> Iterable[Variation]:
        plan = plan_wanted(PROBLEM, scene)
        divisions = whole_levels(asked, 4, "even numbers of divisions", step=2) or _usual(plan)
        return dict.fromkeys(make(plan, divisions))

    return Ladder(variations, _NUMBERS, applies=applies)


def _usual(plan: Plan[Any]) -> Sequence[int]:
    if is_curved(plan.scene):
        return _DIVISIONS
    usual = int(plan.parameters["divisions"])
    return tuple(dict.fromkeys(even(share * usual) for share in _SHARES))


def _meshes(plan: Plan[Any], levels: Sequence[int]) -> list[Variation]:
    element = plan.scene.mesh.element
    return [_on_mesh(element, element, n, plan) for n in levels]


def _elements(plan: Plan[Any], levels: Sequence[int]) -> list[Variation]:
    chosen = ((e, max(4, 2 * (n // 4)) if e == "hex27" else n) for e in _FINEST for n in levels)
    return [_on_mesh(e, e, n, plan) for e, n in chosen if n <= _FINEST[e]]


def _solvers(plan: Plan[Any], levels: Sequence[int]) -> list[Variation]:
    return [
        _on_mesh(solver, plan.scene.mesh.element, n, plan, ("solver.name", solver))
        for solver, most in _AFFORDABLE.items()
        if solver != "pardiso" or select.has_pardiso()
        for n in levels[:most]
    ]


def _on_mesh(
    source: str, element: str, divisions: int, plan: Plan[Any], *extra: tuple[str, Any]
) -> Variation:
    per_edge = 2 if NODES[element] > 8 else 1
    own = level_geometry(plan.parameters, divisions, per_edge=per_edge)
    label = f"{own.get('divisions_long', divisions)} x {divisions}"
    overrides = (*of_geometry(own), ("mesh.element", element), *extra)
    return Variation(source, label, overrides, edge_of(plan.parameters) / divisions)


def _patches(plan: Plan[Any], levels: Sequence[int]) -> Iterator[Variation]:
    """The edge of the patch at constant node spacing."""
    del levels
    patch, divisions = float(plan.parameters["patch"]), int(plan.parameters["divisions"])
    for factor in (0.6, 0.8, 1.0, 1.3, 1.6):
        n = even(factor * divisions)
        edge = patch * n / divisions
        overrides = (*_lengths({"patch": edge}), ("geometry.divisions", n))
        yield Variation("patch", f"{edge:.3g} mm", overrides, patch / divisions)


def _accuracies(scene: Scene, asked: Asked) -> list[Variation]:
    """The scene at one accuracy after the other."""
    wanted: Sequence[float] = _ACCURACIES if is_curved(scene) else _FLAT_ACCURACIES
    if asked is not None:
        words = "errors in per cent, between 0 and 100, for example --levels 5 2 1"
        wanted = chosen_levels(asked, lambda p: 0.0 < p < 100.0, words)[::-1]
    return [
        Variation("accuracy", f"{p:g} %", (("accuracy", p / 100.0),), p / 100.0) for p in wanted
    ]


def parameter_points(scene: Scene, asked: Asked = None) -> list[Variation]:
    """The scene as given, then with one parameter changed at a time.

    Lengths of block and patch, distant sets, tilt, friction. Raises InputError for levels, and when
    the scene leaves the mesh to an accuracy.
    """
    no_levels(asked, "a parameter study changes one parameter at a time")
    plan = plan_wanted(PROBLEM, scene)
    return [
        Variation("parameters", label, overrides, 1.0) for label, overrides in _setups(scene, plan)
    ]


def _setups(scene: Scene, plan: Plan[Any]) -> Iterable[tuple[str, Overrides]]:
    yield "as given", ()
    for name, factors in _FACTORS.items():
        length = plan.parameters.get(name)
        for value in (factor * length for factor in factors if isinstance(length, float)):
            yield f"{name} {value:g} mm", _lengths({name: value})
    for body, mesh in recipes.build_mesh(scene.recipe, plan.parameters)[0].items():
        for name in held_sets(mesh):
            if scene.contact.distant.get(body) != name:
                yield f"{body} held at {name}", ((f"contact.distant.{body}", name),)
    other = "free" if scene.contact.tilt == "held" else "held"
    yield f"tilt {other}", (("contact.tilt", other),)
    # The normal force goes with the friction when it comes from an equilibrium.
    for mu in (m for m in (0.3, 1.0) if m != scene.contact.friction):
        yield f"mu = {mu:g}", (("contact.friction", mu),)


def _lengths(values: Mapping[str, float]) -> Overrides:
    return of_geometry({name: f"{value!r} mm" for name, value in values.items()})


def _stiffnesses(scene: object, solved: Sequence[SolvedPoint], names: Sequence[str]) -> StudyReport:
    """Stiffnesses of every point at its first normal load."""
    del scene, names
    first: dict[str, Key] = {}
    for key in matching(solved, _PER_PAD if matching(solved, _PER_PAD[:1]) else _STIFFNESSES):
        first.setdefault(key[0], key)
    table = points_table(solved, list(first.values()))
    return StudyReport((table,), bool(without_failed(solved)))


#: without coupling not even the cycle's energy depends on its load steps
_STEPS = counts(
    "steps",
    "{} load steps",
    "loads.cycle_steps",
    (10, 20, 40, 80, 160),
    8,
    (("want", ["cycle"]), ("left_out.solve", "no")),
)

LADDERS: Mapping[str, Ladder] = {
    "mesh": _on_meshes(_meshes),
    "element": _on_meshes(_elements),
    "solver": _on_meshes(_solvers),
    "steps": Ladder(_STEPS, _NUMBERS, finest_report, applies=lambda scene: scene.coupled),
    "accuracy": Ladder(
        _accuracies,
        report=lambda scene, solved, names: accuracy_report(scene, solved, governing(scene)),
        notes=lambda scene: _ACCURACY_NOTES,
    ),
    "patch": _on_meshes(_patches, is_curved),
    "parameters": Ladder(
        parameter_points,
        report=_stiffnesses,
        title=lambda scene, vary: "what moves the stiffness",
        applies=lambda scene: not is_curved(scene),
    ),
}
