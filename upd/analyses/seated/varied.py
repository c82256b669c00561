"""What varies in a seated damper: coarser lattices of its faces, and on one of them finer bodies
and shorter load steps.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

from upd.analyses.base import require_memory
from upd.analyses.seated.estimates import NODES, corrected
from upd.analyses.seated.plan import SeatedPlan, make_plan, solve_seconds
from upd.analyses.seated.results import make_results
from upd.analyses.seated.solve import solve
from upd.errors import InputError, one_line
from upd.mesh import recipes
from upd.mesh.fields import Bounds
from upd.mesh.recipe_modules import is_mesh
from upd.scene import SeatedScene
from upd.vary.solve import varied_plan
from upd.vary.variation import ALONE, COARSER, RUN, Levels, Overrides, Problem, Variation

#: sources of error beside the nodes of the faces
MESH, STEPS = "mesh", "load steps"
#: arrangement -> elements up a patch, and those that go with them, along it first
PATCH = {
    "symmetric": ("patch_along_slope", ("patch_along_y",)),
    "asymmetric": ("pad_along_slope", ("pad_along_y", "face_along_z")),
}
#: elements along an edge, or load steps, of a finer level over those of its base
_FINER = 2
_NOT = "not estimated:"
#: nodes that finer bodies may have where the run has fewer
_FEW_NODES = 20_000
_Counts = Mapping[str, int]


def plan_with_estimates(scene: SeatedScene) -> SeatedPlan:
    """The plan of ``scene`` with what its variations cost. Raises InputError as `make_plan`."""
    plan, again = make_plan(scene), 0.0
    for one in levels(plan).variations:
        # what the recipe does not take is the reason that the run gives
        with suppress(InputError):
            again += solve_seconds(varied_plan(PROBLEM, scene, one))
    return replace(plan, seconds=plan.seconds + again, estimate_seconds=again)


def levels(plan: SeatedPlan) -> Levels:
    """The variations of a plan: lattices first, the coarsest before the others.

    Coarser lattices of the faces show what the contact's nodes leave. On the coarsest, where a
    seating costs a few hundredths, all bodies get twice the elements along every edge and the
    faces' nodes stay; and every load step is halved. What these change there is taken for what they
    change in the run. Bodies that would have more nodes than the run, and many, are not refined.
    """
    scene, made = plan.scene, dict[float, Variation]()
    if not scene.estimates:
        return Levels(())
    own = lattice_counts(scene)
    coarsest, keeps = _coarsest(scene, own)
    if coarsest != own:
        between = [_coarser(scene, own, ratio) for ratio in COARSER[1::-1]]
        for counts in (coarsest, *(one for one in between if one != own)):
            lattice = _on_lattice(own, counts)
            made.setdefault(lattice.size, lattice)
    lattices = list(made.values())
    base = lattices[0] if lattices else RUN
    steps, bodies = _shorter_steps(scene, coarsest, base), list[Variation]()
    why = "the bodies cannot be refined with the lattice of the faces kept"
    if keeps:
        finer, most = _finer_bodies(scene, coarsest, base), max(_FEW_NODES, _nodes(plan))
        try:
            count = _nodes(varied_plan(PROBLEM, scene, finer))
            bodies = [finer] if count <= most else []
            why = f"{finer.label}: {count} nodes, above {most}"
        except InputError as error:
            why = one_line(error)
    reasons = {NODES: "the lattice of the faces cannot be made coarser", MESH: f"{_NOT} {why}"}
    return Levels([*lattices, *bodies, steps], reasons)


def _nodes(plan: SeatedPlan) -> int:
    return sum(count["nodes"] for count in plan.size.values())


# -- lattices --------------------------------------------------------------------------------------


def lattice_counts(scene: SeatedScene) -> dict[str, int]:
    """Elements of the lattices of both faces by their parameters, empty of a recipe without."""
    if is_mesh(scene.recipe):
        return {}
    slope, others = PATCH[scene.arrangement]
    names = (slope, *others)
    if not all(recipes.has_parameter(scene.recipe, name) for name in names):
        return {}
    return {name: int(_parameter(scene, name)) for name in names}


def _parameter(scene: SeatedScene, name: str) -> Any:
    """Of the recipe, as the scene has it or by default."""
    if name in scene.geometry:
        return scene.geometry[name]
    return _field(scene, name).default


def _field(scene: SeatedScene, name: str) -> dataclasses.Field[Any]:
    known = dataclasses.fields(recipes.parameters(scene.recipe))
    return next(one for one in known if one.name == name)


def _allowed(scene: SeatedScene, name: str, count: float) -> int:
    """The number of elements that the recipe takes nearest to one."""
    bounds: Bounds = _field(scene, name).metadata.get("bounds", Bounds())
    step = 2 if bounds.even else 1
    return max(int(bounds.least or 1), step * round(count / step))


def _coarser(scene: SeatedScene, own: _Counts, ratio: float) -> dict[str, int]:
    """Counts of a lattice so many times coarser; none is finer than the run's."""
    return {name: min(n, _allowed(scene, name, n / ratio)) for name, n in own.items()}


def _coarsest(scene: SeatedScene, own: _Counts) -> tuple[_Counts, bool]:
    """The coarsest lattice, and whether the bodies can be refined with it kept: it is then that of
    half its elements, refined.
    """
    ratio = COARSER[-1]
    if own and recipes.has_parameter(scene.recipe, "refine"):
        kept = {n: _FINER * _allowed(scene, n, k / ratio / _FINER) for n, k in own.items()}
        if all(kept[name] <= n for name, n in own.items()):
            return kept, True
    return _coarser(scene, own, ratio), False


def _spacing(counts: _Counts) -> float:
    """Of the nodes on the inclined faces, but for a factor of their size."""
    up, along = tuple(counts.values())[:2]
    return float((up * along) ** -0.5)


def _label(counts: _Counts) -> str:
    up, along = tuple(counts.values())[:2]
    return f"{along} x {up} elements of a patch"


def _geometry(counts: Mapping[str, float]) -> Overrides:
    return tuple((f"geometry.{name}", value) for name, value in counts.items())


def _on_lattice(own: _Counts, counts: _Counts) -> Variation:
    size = _spacing(counts) / _spacing(own)
    return Variation(NODES, _label(counts), _geometry(counts), size)


def _finer_bodies(scene: SeatedScene, counts: _Counts, base: Variation) -> Variation:
    """The base's faces on bodies with twice the elements along every edge."""
    kept = _geometry({name: round(n / _FINER) for name, n in counts.items()})
    label = f"twice the elements along every edge, {_label(counts)} kept"
    return Variation(MESH, label, (*kept, *_refined(scene, _FINER)), 1.0 / _FINER, base)


def _shorter_steps(scene: SeatedScene, counts: _Counts, base: Variation) -> Variation:
    label = "twice the load steps" + (f", {_label(counts)}" if counts else "")
    return Variation(STEPS, label, (*_geometry(counts), *_half_steps(scene)), 1.0 / _FINER, base)


def _refined(scene: SeatedScene, factor: float) -> Overrides:
    """So many times the elements along all edges, the faces' included."""
    return (("geometry.refine", factor * _parameter(scene, "refine")),)


def _half_steps(scene: SeatedScene) -> Overrides:
    """Every load step in two."""
    return (
        ("seating.steps", _FINER * scene.seating.steps),
        ("seating.cycle_steps", _FINER * scene.seating.cycle_steps),
        ("moved.steps", _FINER * scene.moved.steps),
    )


def _other_lattice(scene: SeatedScene, ratio: float) -> Overrides:
    """So many times larger elements on the faces."""
    own = lattice_counts(scene)
    return _geometry({name: _allowed(scene, name, n / ratio) for name, n in own.items()})


def _half_cost(plan: SeatedPlan, source: str, seconds: float, order: float) -> float:
    """Seconds that half of a source's error adds, the error of an order; ``seconds``: of the run.

    InputError where the recipe takes no such level, or the memory does not.
    """
    scene, finer = plan.scene, 2.0 ** (1.0 / order)
    if source == NODES:
        overrides = _other_lattice(scene, 1.0 / finer)
    elif source == MESH:
        # the nodes of the faces where they are
        overrides = (*_other_lattice(scene, finer), *_refined(scene, finer))
    else:
        overrides = _half_steps(scene)
    more = varied_plan(PROBLEM, scene, Variation(source, "half the error", overrides))
    require_memory(more.scene, more.memory_bytes)
    own = solve_seconds(plan) - plan.estimate_seconds
    return max(0.0, seconds * (solve_seconds(more) / own - 1.0))


PROBLEM = Problem(
    make_plan,
    solve,
    make_results,
    lambda _: ALONE,
    (NODES, MESH, STEPS),
    levels,
    _half_cost,
    corrected=corrected,
)
