"""Companions of a forced response: its models with one source of error changed.

Blades on another mesh, with more modes, contact points merged or split. The linear limits of each
tell its stuck and free numbers; the peaks with friction are followed or marched again on it.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from upd.analyses.convergence import ASSUMED
from upd.analyses.cost import NODES
from upd.analyses.forced.curves import LinearCurves
from upd.analyses.forced.effects import MORE_MODES
from upd.analyses.forced.linear_limits import linear_limits_of
from upd.analyses.forced.measures import Unsolved
from upd.analyses.forced.merged_points import (
    Axis,
    fewer_gauss,
    finer_columns,
    merged,
    transfer,
)
from upd.analyses.forced.mesh_counts import OFF_CONTACT, RECIPE, times, up_slope
from upd.analyses.forced.model import Array, Model, make_model
from upd.analyses.forced.paths import balance_of
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.solution import ForcedSolution
from upd.analyses.forced.stiffness import FaceLaw
from upd.analyses.seated.bodies import Bodies, make_bodies
from upd.errors import UpdError, one_line
from upd.scene.forced_contact import GAUSS, SIDES, Side

log = logging.getLogger(__name__)
Laws = Mapping[Side, FaceLaw]

MESH, MODES, POINTS = "mesh", "modes kept", "contact points"
#: spacing of the nodes of linear elements over that of quadratic ones on the same lattice
_LINEAR = 2.0
#: order of the rule that spreads a face's stiffness over points, of trapezoids or of middles
_RULE = 2.0
#: Gauss points up the slope of the coarser levels, over those of the run
_FEWER_ROWS = (2.0 / 3.0, 0.5)
AXES: tuple[Axis, Axis] = ("rows", "columns")


class _Made(NamedTuple):
    """A companion's ladder, label, size and model, order of its ladder, and what its points take
    over from the run's, found by their places when None.
    """

    ladder: str
    label: str
    size: float
    model: Model
    order: float = ASSUMED
    carried: tuple[Array, Array] | None = None


@dataclass(frozen=True)
class OtherModel:
    """A model that differs from the run's in one source of error.

    Attributes
    ----------
    source, ladder, label
        Of the error; the ladder of levels it belongs to; what the model is, in words.
    size
        Of its level over that of the run: above 1 coarser, below 1 finer.
    model
        With as many tangents a point as the run's.
    move, share
        (n, n_run) displacements and forces of its points from those of the run's.
    order
        Of its ladder.
    linear
        Its linear limits.
    seconds
        Of the processor that it took.
    """

    source: str
    ladder: str
    label: str
    size: float
    model: Model
    move: Array
    share: Array
    order: float
    linear: LinearCurves
    seconds: float


@dataclass(frozen=True)
class NoModel:
    """A source whose companion could not be made, and why."""

    source: str
    why: str


@dataclass
class ModelMaker:
    """Makes the companions of all contact stiffnesses of a run.

    Blades on another mesh or with more modes are shared by the stiffnesses.
    """

    solution: ForcedSolution
    _meshed: list[tuple[ForcedPlan, Bodies, str, float]] | None = None
    _coarse_rows: tuple[ForcedPlan, Bodies] | None = None

    def make(
        self, name: str, laws: Laws, wanted: Sequence[str] | None = None
    ) -> list[OtherModel | NoModel]:
        """The companions of one contact stiffness.

        Parameters
        ----------
        name
            Of the stiffness.
        laws
            Of its faces.
        wanted
            Sources; all when None.
        """
        model = self.solution.models[name]
        makers: list[tuple[str, Callable[[], list[_Made]]]] = [
            (MESH, lambda: self._mesh(model, laws)),
            (MODES, lambda: self._modes(model, laws)),
            (POINTS, lambda: self._points(model, laws)),
        ]
        return [
            one
            for source, make in makers
            if wanted is None or source in wanted
            for one in self._made(source, make, model)
        ]

    def _made(
        self, source: str, make: Callable[[], list[_Made]], base: Model
    ) -> list[OtherModel | NoModel]:
        begin, plan = time.thread_time(), self.solution.plan
        out: list[OtherModel | NoModel] = []
        try:
            for one in make():
                model = one.model
                if model.halved != base.halved or model.contacts.tangents != base.contacts.tangents:
                    why = f"{one.label}: another kind of contact points"
                    out.append(NoModel(source, why))
                    continue
                move, share = one.carried or transfer(base, model)
                linear, took = _linear(plan, model), time.thread_time() - begin
                out.append(
                    OtherModel(
                        source,
                        one.ladder,
                        one.label,
                        one.size,
                        model,
                        move,
                        share,
                        one.order,
                        linear,
                        took,
                    )
                )
                begin = time.thread_time()
        except UpdError as error:
            log.info("no companion for %s: %s", source, error)
            out.append(NoModel(source, one_line(error)))
        return out or [NoModel(source, "the model has no coarser level")]

    def _mesh(self, model: Model, laws: Laws) -> list[_Made]:
        if self._meshed is None:
            self._meshed = []
            for plan, label, size in _coarser(self.solution.plan):
                bodies = make_bodies(plan)
                at = size or _spacing(self.solution.bodies, bodies)
                self._meshed.append((plan, bodies, label, at))
        return [
            _Made(MESH, label, at, make_model(_fixed(plan, model), bodies, laws, model.state))
            for plan, bodies, label, at in self._meshed
        ]

    def _modes(self, model: Model, laws: Laws) -> list[_Made]:
        solution = self.solution
        assert solution.bodies is not None
        count = solution.plan.scene.reduction.modes
        plan = with_values(solution.plan, "reduction", modes=count + MORE_MODES)
        made = make_model(_fixed(plan, model), solution.bodies, laws, model.state)
        size = max(count, 1) / (count + MORE_MODES)
        return [_Made(MODES, f"{count + MORE_MODES} modes a blade", size, made)]

    def _points(self, model: Model, laws: Laws) -> list[_Made]:
        """Half the rows; half the columns, or twice as many where there is one of them.

        Rows of lattice nodes are made anew on a lattice of half of them: half the rows of the same
        one would press it along fewer lines, which yield more, and so hide what they are too stiff
        in tilt, and what the elements on the contact leave.
        """
        solution = self.solution
        assert solution.bodies is not None
        scene, columns = solution.plan.scene, None
        if scene.contact.rule == GAUSS:
            out = self._fewer_gauss(model)
        else:
            columns = self._fewer(model, laws, "columns")
            rows = self._coarser_rows(model, laws) or self._fewer(model, laws, "rows")
            out = [one for one in (rows, columns) if one is not None]
        finer = finer_columns(scene)
        if columns is None and finer is not None:
            plan = _fixed(replace(solution.plan, scene=finer), model)
            made = make_model(plan, solution.bodies, laws, model.state)
            out.append(_Made("columns", "twice the columns of contact points", 0.5, made, _RULE))
        return out

    def _coarser_rows(self, model: Model, laws: Laws) -> _Made | None:
        """The model on a lattice with half the rows, where its points are all of them.

        Of first order: a row presses along a line with p h per length, p the pressure and h its
        distance from the next; elements of that size give way under it by c p h / E*, c the same on
        every lattice.
        """
        plan = self.solution.plan
        scene = plan.scene
        every = all(scene.contact.lines(side)[0] == "all" for side in SIDES)
        if scene.recipe != RECIPE or not every or any(law.law for law in laws.values()):
            return None
        keys = up_slope(scene)
        own, fewer = times(scene, keys, 1.0), times(scene, keys, 0.5)
        if own == fewer:
            return None
        if self._coarse_rows is None:
            changed = replace(plan, parameters={**plan.parameters, **fewer}, workers=1)
            self._coarse_rows = changed, make_bodies(changed)
        changed, bodies = self._coarse_rows
        made = make_model(_fixed(changed, model), bodies, laws, model.state)
        size = sum(own[key] / fewer[key] for key in keys) / len(keys)
        return _Made("rows", "half the rows of the lattice on the contact", size, made)

    def _fewer_gauss(self, model: Model) -> list[_Made]:
        """Models with fewer rows of Gauss points, of the same blades, which have part of the
        motions.
        """
        out: dict[float, _Made] = {}
        for factor in _FEWER_ROWS:
            found = fewer_gauss(model, factor)
            if found is not None:
                carried = found.move, found.share
                label = f"1/{found.size:.2g} of the rows of contact points"
                out[found.size] = _Made("rows", label, found.size, found.model, ASSUMED, carried)
        return list(out.values())

    def _fewer(self, model: Model, laws: Laws, axis: Axis) -> _Made | None:
        """The model with half the lines."""
        contact, place = self.solution.plan.scene.contact, AXES.index(axis)
        chosen = [contact.lines(side)[place] for side in SIDES]
        groups = any(isinstance(one, int) for one in chosen) or any(
            law.law is not None for law in laws.values()
        )
        found = merged(model, axis, groups=groups)
        if found is None:
            return None
        label, carried = f"half the {axis} of contact points", (found.move, found.share)
        return _Made(axis, label, found.size, found.model, _RULE, carried)


def with_values(plan: ForcedPlan, table: str, **values: Any) -> ForcedPlan:
    """The plan with other values in a table of its scene, one blade after the other: others work
    beside, and memory is theirs too.
    """
    scene = plan.scene
    changed = replace(scene, **{table: replace(getattr(scene, table), **values)})
    return replace(plan, scene=changed, workers=1)


def _fixed(plan: ForcedPlan, model: Model) -> ForcedPlan:
    """The plan with the sliding directions of a model."""
    return with_values(plan, "contact", directions="one" if model.contacts.tangents < 2 else "two")


def _coarser(plan: ForcedPlan) -> list[tuple[ForcedPlan, str, float]]:
    """Coarser meshes on the same lattice of contact nodes; the ratio of spacings, 0 where only its
    mesh tells it.

    Those of the levels before, where the mesh was chosen by an accuracy. Else of quadratic elements
    linear ones with incompatible modes on the same lattice: their nodes stand twice as far apart.
    Of linear ones half the elements off the contact.
    """
    if plan.coarser:
        own = plan.parameters
        return [
            (replace(plan, parameters={**own, **one.counts}, workers=1), one.label, one.size)
            for one in plan.coarser
        ]
    if NODES[plan.scene.mesh.element] > 8:
        made = with_values(plan, "mesh", element="hex8i")
        parameters = {**plan.parameters, "element_nodes": NODES["hex8i"]}
        label = "hex8i elements on the same lattice"
        return [(replace(made, parameters=parameters), label, _LINEAR)]
    if plan.scene.recipe != RECIPE:
        return []
    fewer = times(plan.scene, OFF_CONTACT, 0.5)
    if fewer == times(plan.scene, OFF_CONTACT, 1.0):
        return []
    made = replace(plan, parameters={**plan.parameters, **fewer}, workers=1)
    return [(made, "half the elements off the contact", 0.0)]


def _spacing(fine: Bodies | None, coarse: Bodies) -> float:
    """Ratio of the elements' sizes, the cube root of that of their numbers."""
    assert fine is not None
    counts = [
        sum(blade.mesh.n_hex for blade in bodies.blades.values()) for bodies in (fine, coarse)
    ]
    return float((counts[0] / counts[1]) ** (1.0 / 3.0))


def _linear(plan: ForcedPlan, model: Model) -> LinearCurves:
    force = plan.scene.damper.centrifugal
    problem = balance_of(plan, model, force, (0, *model.excitation.harmonics))
    return linear_limits_of(plan, model, Unsolved(problem), force)
