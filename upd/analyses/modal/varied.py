"""What varies in a rig: its mesh, for the errors of its numbers; the modes kept are judged by the
full model.
"""

from __future__ import annotations

from collections.abc import Sequence

from upd.analyses.modal.plan import MODES_ABOVE, ModalPlan, make_plan
from upd.analyses.modal.results import REDUCED, make_results
from upd.analyses.modal.solve import ModalSolution, solve
from upd.results import ErrorPart, Estimates, Result
from upd.results.quantities import quantity_of
from upd.scene import RigScene
from upd.vary.errors import merged
from upd.vary.solve import MESH, changed, coarser_rigs, refined
from upd.vary.variation import ALONE, LevelChoice, Levels, Overrides, Problem, Variation

#: source of error beside the mesh
KEPT = "modes kept"
#: times the elements along an edge, and numbers of modes kept, of an accuracy
_FINER, _MODES = (1, 2, 3), (5, 10, 20, 40)
#: elements with nodes between the corners, and the spacing of nodes without these over that with
_QUADRATIC, _BETWEEN = ("hex20", "hex27"), 2.0
#: outputs a companion has, where the run has them: the reduced model has the mesh of the full one
_WANTED = ("free", "glued", "response")


def bare(scene: RigScene) -> Overrides:
    """Overrides without what costs and shows no number."""
    return (("want", tuple(w for w in scene.want if w in _WANTED) or ("free",)), *ALONE)


def levels(plan: ModalPlan) -> Levels:
    """Variations of the rig's mesh.

    Of quadratic elements the linear ones with incompatible modes on the same hexahedra, with twice
    the spacing of nodes: corners and clamped edges let the frequencies of both fall with the same
    order, below the formal one of either. Of linear elements coarser rigs.
    """
    scene = plan.scene
    if not scene.estimates:
        return {}
    if scene.mesh.element in _QUADRATIC:
        label = "elements hex8i on the same hexahedra"
        return {MESH: [Variation(MESH, label, (("mesh.element", "hex8i"),), _BETWEEN)]}
    return {MESH: coarser_rigs(PROBLEM, plan)}


def _corrected(solution: ModalSolution, numbers: Sequence[Result], found: Estimates) -> Estimates:
    """The errors by the mesh, and of the reduced model by the modes it keeps."""
    # The reduced model has the mesh of the full one.
    of_full = {
        (r.name, r.case): found[full.name, full.case]
        for r in numbers
        if r.case == REDUCED and (full := _full(r, numbers)) is not None
    }
    return merged({**found, **of_full}, _by_modes(solution, numbers))


def _full(reduced: Result, numbers: Sequence[Result]) -> Result | None:
    """The frequency of the full model that a reduced one stands for."""
    quantity, n = quantity_of(reduced.name)
    wanted = quantity.full.format(n=n)
    return next((r for r in numbers if r.name == wanted), None)


def _by_modes(solution: ModalSolution, numbers: Sequence[Result]) -> Estimates:
    """What the modes left out change: known against the full model, or solved again."""
    out = {}
    for one in numbers:
        full = _full(one, numbers) if one.case == REDUCED else None
        if full is not None:
            error = abs(one.value / full.value - 1.0)
            out[one.name, one.case] = (ErrorPart(KEPT, error, "against the full model"),)
    for again in (one for one in solution.left_out if one.effect == MODES_ABOVE):
        error = abs(again.included / again.without - 1.0)
        basis = "solved again with the modes up to twice the limit"
        out[again.quantity, again.case] = (ErrorPart(KEPT, error, basis),)
    return out


# -- an accuracy that is wanted --------------------------------------------------------------------


def choices(scene: RigScene) -> list[LevelChoice]:
    """What may be chosen of a rig: its refinement from its own up, and the number of modes kept."""
    found, reduction = [], scene.reduction
    if isinstance(scene.geometry.get("refine"), (int, float)):
        found.append(LevelChoice(MESH, "elements along an edge", "x {}", _FINER, refined))
    if scene.wants("reduction") and reduction.below is None and reduction.error is None:
        found.append(
            LevelChoice(
                KEPT, "modes kept", "{} a blade", _MODES, lambda _, n: (("reduction.modes", n),)
            )
        )
    return found


def level_of(plan: ModalPlan) -> Variation:
    refine = float(plan.scene.geometry.get("refine", 1.0))
    return Variation(MESH, f"geometry.refine = {refine:.2g}", size=1.0 / refine)


PROBLEM = Problem(
    make_plan,
    solve,
    make_results,
    bare,
    levels,
    lambda plan, source, factor: refined(plan.scene, factor),
    corrected=_corrected,
    choices=choices,
    governing=lambda scene: {name: name for name in ("f*_free", "f*_glued", "f*_reduced")},
    level_of=level_of,
    varies_lowest=True,
    trial=lambda scene: changed(scene, (("left_out.solve", "no"),)),
)
