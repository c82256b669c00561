"""What varies in a seated damper: coarser lattices of its faces, and on one of them finer bodies
and shorter load steps.

Before them the errors that are known from the run: what the contact's solver and the edges of the
contact leave, and what has no relative error.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import require_memory
from upd.analyses.seated.checks import ROUNDING, WORK_ROUNDING
from upd.analyses.seated.plan import RAISED, SeatedPlan, make_plan
from upd.analyses.seated.results import make_results
from upd.analyses.seated.solve import SeatedSolution, solve
from upd.contact.coulomb_conditions import OPEN, SLIP
from upd.errors import InputError, one_line
from upd.mesh import IntArray, recipes
from upd.mesh.fields import Bounds
from upd.mesh.recipe_modules import is_mesh
from upd.results import Case, ErrorPart, Estimates, Result
from upd.scene import SeatedScene
from upd.scene.forced_contact import SIDES
from upd.vary.errors import merged
from upd.vary.solve import varied_plan
from upd.vary.variation import (
    ALONE,
    COARSER,
    RUN,
    Key,
    Levels,
    Overrides,
    Problem,
    SolvedVariation,
    Variation,
)

#: sources of error: the nodes of the faces, and one that no variation shows
NODES, SOLVER = "contact nodes", "contact solver"
_EDGE = "edges of the contact and of its stick are known to one spacing of nodes"
_ZERO = "the number is zero: its error is not relative to it"


def corrected(
    solution: SeatedSolution,
    run: SolvedVariation,
    solved: Sequence[SolvedVariation],
    found: Estimates,
) -> Estimates:
    """The parts by variations with those known from the run.

    A number that is zero, or that a variation has with the other sign, has no error relative to it,
    for that reason.
    """
    known = dict(merged(found, _by_solver(solution, run.numbers)))
    for key, parts in by_edges(solution).items():
        known[key] = _larger(known.get(key, ()), parts[0])
    return {
        key: _rounding(parts) or of_one_sign(run.values[key], key, solved) or parts
        for key, parts in known.items()
    }


def _larger(parts: Sequence[ErrorPart], other: ErrorPart) -> tuple[ErrorPart, ...]:
    """The parts with another of a source in place of its own where that is smaller."""
    return tuple(
        replace(p, error=other.error, basis=other.basis)
        if p.source == other.source and p.known and p.error < other.error
        else p
        for p in parts
    )


def _rounding(parts: Iterable[ErrorPart]) -> tuple[ErrorPart, ...] | None:
    """Why a number has no error, where it is below what self-checks hold it to."""
    lost = next((p for p in parts if p.source == SOLVER and p.error >= 1.0), None)
    if lost is None:
        return None
    return (ErrorPart(SOLVER, float("nan"), f"not estimated: zero but for rounding, {lost.basis}"),)


def of_one_sign(
    value: float, key: Key, levels: Iterable[SolvedVariation]
) -> tuple[ErrorPart, ...] | None:
    """Why a number has no error relative to it, where its sign is not the same on all levels."""
    if value == 0.0:
        return (ErrorPart(NODES, float("nan"), _ZERO),)
    other = [o for o in levels if key in o.values and np.sign(o.values[key]) != np.sign(value)]
    if not other:
        return None
    names = ", ".join(f"{one.values[key]:.3g} with {one.variation.label}" for one in other)
    why = f"not estimated: zero or of the other sign on companions ({names})"
    return (ErrorPart(NODES, float("nan"), why),)


def _by_solver(solution: SeatedSolution, numbers: Iterable[Result]) -> Estimates:
    """Of forces, losses and the stiffness of a motion, what the self-checks hold them to: parts of
    F_C, of its work along the motion, and of F_C over it.
    """
    plan, out = solution.plan.scene, dict[Key, tuple[ErrorPart, ...]]()
    force, way = plan.damper.centrifugal, plan.moved.amplitude
    lift = float(np.abs(solution.interface.motions(solution.phases[RAISED].found)[-1, :3]).max())
    held = {
        "friction_energy": WORK_ROUNDING * force * way,
        "seating_loss": WORK_ROUNDING * force * lift,
        "moved_stiffness": ROUNDING * force / way,
    }
    for one in numbers:
        size = held.get(one.name, ROUNDING * force if one.unit == "N" else 0.0)
        if size and one.value and not one.withheld:
            basis = f"a self-check holds it to {size:.2g} {one.unit}"
            out[one.name, one.case] = (ErrorPart(SOLVER, size / abs(one.value), basis),)
    return out


def by_edges(solution: SeatedSolution) -> Estimates:
    """Of shares of the faces, what a lattice leaves open: their edges are known to one spacing.

    A share counts whole nodes, and levels may agree by chance.
    """
    of, state = solution.interface, solution.phases[RAISED].found.state[-1]
    out: dict[Key, tuple[ErrorPart, ...]] = {}
    for k, side in enumerate(SIDES):
        quads = solution.bodies.blades[side].mesh.faces["patch"][:, :4]
        quads, here = np.unique(quads, return_inverse=True)[1], of.face == k
        area, closed, slips = of.area[here], state[here] != OPEN, state[here] == SLIP
        if not closed.any():
            continue
        quads = quads.reshape(-1, 4)
        edge = _edge(closed, quads, area)
        case = Case(name=RAISED, side=side)
        part = (ErrorPart(NODES, edge, _EDGE),)
        out |= {(name, case): part for name in ("closed_share", "contact_area", "mean_pressure")}
        if slips.any():
            slip = edge + _edge(slips, quads[closed[quads].all(axis=1)], area)
            out["slip_share", case] = (ErrorPart(NODES, slip, _EDGE),)
    return out


def _edge(inside: NDArray[np.bool_], quads: IntArray, area: NDArray[np.float64]) -> float:
    """Area of the nodes inside that share an element with others outside, over all inside."""
    cut = quads[inside[quads].any(axis=1) & ~inside[quads].all(axis=1)]
    at_edge = np.zeros_like(inside)
    at_edge[cut] = True
    return float(area[at_edge & inside].sum() / area[inside].sum())


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
            again += varied_plan(PROBLEM, scene, one).solve_seconds
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
    own: float = plan.solve_seconds - plan.estimate_seconds
    return max(0.0, seconds * (float(more.solve_seconds) / own - 1.0))


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
