"""Quasi-static contact of two bodies.

Mesh, stiffness, condensation, every normal load with the force-approach curve; after each normal
load stiffness, tangential loads and cycles, with the normal forces frozen, or with normal and
tangential contact at once, where the pressure follows the shear. Arrays in, arrays out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from upd.analyses.base import Resolved, keeping
from upd.analyses.contact import plan as planned
from upd.analyses.contact.bodies import prepare, solve_inside
from upd.analyses.contact.plan import NORMAL, ContactPlan
from upd.analyses.contact.results import make_results
from upd.analyses.contact.solution import (
    LOAD_STEP,
    ContactSolution,
    LoadPath,
    NormalCase,
    Sheared,
    TangentialCase,
    as_normal,
    cycle_shares,
    loads_along,
    measured,
    raised,
    shear_nodes,
    sheared,
    tangential_compliance,
    tilt_arms,
)
from upd.contact import tangential_contact, tangential_path
from upd.contact.checks import few_threads
from upd.contact.coupled import CoupledContact
from upd.contact.model import Body, ContactModel
from upd.contact.normal import NormalContact, normal_contact, normal_curve
from upd.contact.products import KNOWN, KNOWN_STIFFNESS, learners, settled
from upd.contact.tangential import TangentialPath
from upd.contact.tilt import tilted_contact
from upd.errors import ConvergenceError, InputError, UpdError
from upd.progress import Stages
from upd.results import Case, Result
from upd.results import quantities as q
from upd.vary.solve import changed
from upd.vary.variation import Key

Array = NDArray[np.float64]
#: loads in N of the whole contact and displacements in mm along them, from zero on; what the k-th
#: load leaves, for a case with its ratio
Marched = tuple[Array, Array, Callable[[int, float], TangentialCase]]

#: Shares of mu N of the force-displacement curve: even steps, then closer to gross slip.
PATH_SHARES = np.concatenate(
    [np.arange(1, 19) / 20.0, [0.93, 0.95, 0.97, 0.98, 0.99, 0.995, 0.999]]
)
#: tangential load of an initial stiffness of coupled contact, as a part of mu N
SMALL_SHEAR = 1e-3


def solve_plan(
    plan: ContactPlan,
    stages: Stages,
    model: ContactModel | None = None,
) -> ContactSolution:
    """Run everything the plan calls for, but for the effects it leaves out.

    An error raised on the way carries what converged so far as ``partial``.

    Parameters
    ----------
    model
        None: the plan's own.
    """
    solution = ContactSolution(plan, prepare(plan, stages) if model is None else model)
    with keeping(solution):
        solve_normal(solution, stages)
        if plan.effect("friction"):
            solve_tangential(solution, stages)
        if plan.effect("internal displacement"):
            with stages("internal displacement", "back-substitution"):
                solve_inside(solution)
    return solution


def solve_normal(solution: ContactSolution, stages: Stages) -> None:
    """Every normal load and the force-approach curve."""
    scene, curved = solution.plan.scene, solution.curved
    wanted, curve = list(planned.normal_loads(scene)), list[float]()
    top = max(wanted) if scene.loads.curve_to is None else scene.loads.curve_to
    if scene.wants("curve") and top > 0.0:
        shares = np.linspace(0.0, 1.0, scene.loads.curve_points + 1)[1:]
        # of a curved contact evenly spaced in approach by Hertz's F ~ d^1.5
        curve = [float(top * s) for s in (shares**1.5 if curved else shares)]
    # Stiffnesses are slopes of the curve between loads a little below and above: with a curved gap
    # a stiffness at one contact set moves in steps as nodes come into contact.
    sloped = scene.wants("stiffness") if curved else scene.coupled
    steps = (-LOAD_STEP, 0.0, LOAD_STEP) if sloped else ()
    around = [F * (1.0 + s) for F in wanted for s in steps]
    with stages("normal contact", f"{len({*wanted, *curve, *around})} loads"):
        found = press(solution, [*wanted, *curve, *around])
        solution.curve = [(F, found[F].solution.approach) for F in curve]
        solution.normal = [found[F] for F in wanted]
        for body in _bodies_alone(solution):
            alone = press(solution, [*wanted, *around], body)
            for case in solution.normal:
                case.alone[body.name] = alone[case.force]


def press(
    solution: ContactSolution, forces: Iterable[float], body: Body | None = None
) -> dict[float, NormalCase]:
    """Answers of the forces in N on the whole contact, by force.

    Parameters
    ----------
    body
        Against a rigid counterpart: it adds no compliance, so the contact is solved with the body's
        own alone: f >= 0, h + C_b f - d e >= 0, e'f = F. The forces of the pair would not do: of
        all that carry F over touching faces its own have the least energy f'C_b f, so a stiffness
        F^2 / f'C_b f by any others is too soft. None: both bodies.
    """
    plan, model = solution.plan, solution.model
    distinct = sorted(set(forces))
    if plan.scene.coupled:
        return _coupled(solution, distinct, body)
    loads, arms = [F / plan.copies for F in distinct], tilt_arms(plan, model)
    compliance = partial(model.compliance, NORMAL, body=body)
    if arms.size:
        free = (0 not in plan.mirrors, 1 not in plan.mirrors)
        tilted = [tilted_contact(compliance(), model.gap, arms, load=F, free=free) for F in loads]
        found: list[tuple[NormalContact, float, Array | None]] = [
            (t.normal, t.free_stiffness, t.tilt) for t in tilted
        ]
    else:
        answers = settled(
            model,
            (NORMAL,),
            lambda: normal_curve(compliance(), model.gap, loads),
            _known,
        )
        found = [(one, one.stiffness, None) for one in answers]
    out = {
        F: NormalCase(F, one, plan.copies * K, measured(solution, one, F), tilt=tilt)
        for F, (one, K, tilt) in zip(distinct, found, strict=True)
    }
    if solution.curved:
        for F, K in _slopes({F: one.solution.approach for F, one in out.items()}).items():
            out[F].stiffness = K
    return out


def _slopes(approach: Mapping[float, float]) -> dict[float, float]:
    """dF/d approach in N/mm at the loads in N that have one a little below and one above."""
    out = {}
    for F in (F for F in approach if F > 0.0):
        low, high = (approach.get(F * (1.0 + s)) for s in (-LOAD_STEP, LOAD_STEP))
        if low is not None and high is not None:
            out[F] = 2.0 * LOAD_STEP * F / (high - low)
    return out


def _known(found: Sequence[NormalContact]) -> Iterator[tuple[Array, float]]:
    """Forces and their rates, and the largest share of them that may be unknown."""
    for one in found:
        yield one.force, KNOWN
        if one.rates is not None:
            yield one.rates, KNOWN_STIFFNESS


def _coupled(
    solution: ContactSolution, forces: Sequence[float], body: Body | None
) -> dict[float, NormalCase]:
    """The same with normal and tangential contact at once, the slope of the curve as the stiffness
    where it is known.
    """
    model, mu = solution.model, solution.plan.scene.contact.friction
    arms = tilt_arms(solution.plan, model)
    states = raised(model, mu, forces, arms, body=body)
    slopes = _slopes({F: float(found.displacement[-1, 0]) for F, found in states.items()})
    # no load: friction has nothing to hold
    out = {}
    for F in (F for F in forces if not F > 0.0):
        none = normal_contact(model.compliance(NORMAL), model.gap, load=0.0)
        out[F] = NormalCase(F, none, 0.0, measured(solution, none, F))
    for F, found in states.items():
        free = held = slopes.get(F, float("nan"))
        if arms.size and F in slopes and body is None:
            # dF/d approach with the tilts held and the states kept, shifts following
            held = float(1.0 / np.linalg.inv(found.stiffness()[:3, :3])[0, 0])
        tilt = found.displacement[-1, 3:] if arms.size else None
        answer = as_normal(found, held)
        out[F] = NormalCase(F, answer, free, measured(solution, answer, F), found, tilt)
    return out


def _bodies_alone(solution: ContactSolution) -> tuple[Body, ...]:
    """Bodies whose stiffness against a rigid counterpart is asked for."""
    scene, model = solution.plan.scene, solution.model
    if solution.curved:
        return ()
    if scene.wants("stiffness"):
        return model.upper, model.lower
    return (model.upper,) if scene.wants("contact_law") and scene.law.bodies == "upper" else ()


# -- tangential loads ------------------------------------------------------------------------------


def solve_tangential(solution: ContactSolution, stages: Stages) -> None:
    """Stiffness, tangential loads, curve and cycle of every direction after every normal load."""
    scene = solution.plan.scene
    with stages("tangential contact", f"{len(solution.normal)} normal loads"):
        loaded = [case for case in solution.normal if case.solution.force.any()]
        # Twice: what one load teaches changes the answers of the others within the tolerance.
        # Nothing is learned afterwards, so that every result and check sees one compliance.
        model, families = solution.model, solution.model.upper.condensed
        learns = any(learners(model, components) for components in families)
        for case in 2 * loaded if learns else ():
            way = Shear(solution, case, 0.0)
            settled(model, way.components, way.tractions, lambda found: found)
        for case in loaded:
            for direction in scene.loads.directions:
                _sheared(solution, case, direction)


def _sheared(solution: ContactSolution, case: NormalCase, direction: float) -> None:
    """Stiffness, loads on one way, cycle of one direction after one normal load."""
    scene, curved = solution.plan.scene, solution.curved
    way = Shear(solution, case, direction)
    # Flat faces share their law by the stuck contact.
    if not curved or scene.wants("stiffness"):
        case.stuck[direction] = way.stuck()
    loads = scene.loads.tangential if scene.wants("tangential") else ()
    shares = PATH_SHARES
    if curved:
        # Only where the pressure follows the shear does the way to a load matter.
        shares = shares[max(loads, default=0.0) > shares] if case.coupled else shares[:0]
    if scene.wants("tangential") and (loads or not curved):
        ratios = np.unique(np.concatenate([shares, loads]))
        load, moved, at = way.march(ratios)
        if not curved:
            solution.paths.append(LoadPath(solution.sheared_case(case, direction), load, moved))
        solution.tangential += [at(int(np.searchsorted(ratios, r)), r) for r in loads]
    if scene.wants("cycle"):
        amplitude = scene.loads.cycle_amplitude if curved else None
        solution.paths.append(way.cycle(solution.sheared_case(case, direction, amplitude)))


class Shear:
    """Tangential loads along a direction, which leave the normal forces as they are, or with normal
    and tangential contact at once, where the pressure follows the shear.
    """

    def __init__(self, solution: ContactSolution, case: NormalCase, direction: float) -> None:
        scene, force = solution.plan.scene, case.solution.force
        self.solution, self.case, self.direction = solution, case, direction
        self.components = planned.slip_components(scene, direction)
        angle, axes = np.radians(direction), list(self.components)
        self.unit = np.array([np.cos(angle), np.sin(angle)])[axes]
        self.friction, self.loads = scene.contact.friction, scene.loads
        self.copies = solution.plan.copies
        self.loaded = np.flatnonzero(force > 0.0)
        self.limit = self.friction * force[self.loaded]
        #: mu N on the model
        self.total = self.friction * case.force / self.copies
        #: of a cycle; the first of coupled contact does not close: shear settles what the pressure
        #: left, and the approach with it
        self.loops = 1 if case.coupled is None else 2

    @property
    def compliance(self) -> Array:
        """Of the loaded nodes; it changes while bodies learn."""
        return tangential_compliance(self.solution.model, self.components, self.loaded)

    def _moved(self, compliance: Array) -> tuple[Array, float]:
        """Tractions of stuck nodes that move by one along the direction, T = e' C^-1 e."""
        e = np.repeat(self.unit, len(compliance) // len(self.unit))
        t = cho_solve(cho_factor(compliance), e)
        return t, self.copies * float(e @ t)

    def _secant(self, base: CoupledContact) -> float:
        """Of a small tangential load of coupled contact, N/mm."""
        size = SMALL_SHEAR * self.friction * float(base.load[-1, 0])
        return size / float(sheared(base, np.array([size]), self.unit, size)[1][0])

    def stuck(self) -> tuple[float, dict[str, float]]:
        """Stiffness of the stuck contact set, of both bodies and of each on a rigid counterpart."""
        model, of = self.solution.model, {}
        for body in (model.upper, model.lower):
            alone = self.case.alone.get(body.name)
            if alone is not None and alone.coupled is not None:
                of[body.name] = self._secant(alone.coupled)
            elif alone is not None:
                on = np.flatnonzero(alone.solution.force > 0.0)
                C = tangential_compliance(model, self.components, on, body)
                of[body.name] = self._moved(C)[1]
        both = self.case.coupled
        return self._moved(self.compliance)[1] if both is None else self._secant(both), of

    def _path(self, shares: Array) -> tuple[Array, Array, TangentialPath]:
        """Shares of mu N one after the other, from no slip, under frozen normal forces: load of the
        whole contact in N and displacement in mm along the direction, from zero on.
        """
        values, k = shares * self.total, len(self.unit)
        loads = np.outer(values, self.unit) if k == 2 else values
        path = tangential_path(self.compliance, self.limit, loads=loads)
        load, moved = (v.reshape(-1, k) @ self.unit for v in (path.load, path.displacement))
        return np.insert(self.copies * load, 0, 0.0), np.insert(moved, 0, 0.0), path

    def march(self, ratios: Array) -> Marched:
        """Shares of mu N one after the other; coupled contact remembers the normal load."""
        if self.case.coupled is None:
            load, moved, path = self._path(ratios)
            return load, moved, partial(self._frozen_case, path)
        needed = max(self.loads.tangential, default=0.0) * self.total
        values = ratios * self.total
        states, moved = sheared(self.case.coupled, values, self.unit, needed)
        load, moved = (np.insert(v, 0, 0.0) for v in (values[: len(states)], moved))
        return load, moved, partial(self._coupled_case, states, moved)

    def _frozen_case(self, path: TangentialPath, k: int, ratio: float) -> TangentialCase:
        before = path.slip[k - 1] if k else np.zeros(len(self.compliance))
        d, stick = np.atleast_1d(path.displacement[k]), path.state[k] == 0
        load, force = ratio * self.total * self.unit, path.unclipped[k]
        nodes = Sheared(self.components, self.loaded, self.limit, force, before, d, load, stick)
        fields = np.zeros((2, len(self.solution.model.gap), len(self.unit)))
        for field, values in zip(fields, (path.force[k], path.slip[k]), strict=True):
            field[self.loaded] = values.reshape(len(self.unit), -1).T
        K = np.atleast_2d(path.stiffness[k])
        return self._found(ratio, float(d @ self.unit), K, (fields[0], fields[1]), nodes)

    def _coupled_case(
        self, states: list[CoupledContact], moved: Array, k: int, ratio: float
    ) -> TangentialCase:
        found = states[k]
        nodes = shear_nodes(self.solution.model, self.friction, found)
        slip = np.zeros((len(found.force[-1]), 2))
        slip[nodes.loaded] = found.slip[-1][nodes.loaded]
        K = np.zeros((2, 2))
        # nothing holds where there is no inverse
        with suppress(ConvergenceError, np.linalg.LinAlgError):
            # with the normal load and the states kept
            K = np.linalg.inv(np.linalg.inv(found.stiffness())[1:3, 1:3])
        fields = found.force[-1, :, 1:], slip
        return self._found(ratio, float(moved[k + 1]), K, fields, nodes, found)

    def _found(
        self,
        ratio: float,
        displacement: float,
        K: Array,
        fields: tuple[Array, Array],
        nodes: Sheared,
        coupled: CoupledContact | None = None,
    ) -> TangentialCase:
        """The load, with the tangent K (1, 1) or (2, 2) of the model, forces and slip."""
        # with the motion across the load free to follow; 0 where nothing holds
        free = np.linalg.pinv(K, hermitian=True)
        tangent = 1.0 / float(self.unit @ free @ self.unit) if K.any() else 0.0
        case = self.solution.sheared_case(self.case, self.direction, ratio)
        load = ratio * self.friction * self.case.force
        return TangentialCase(
            self.case, case, load, displacement, self.copies * tangent, *fields, nodes, coupled
        )

    def cycle(self, case: Case) -> LoadPath:
        """First loading to +T*, then closed loops +T* -> -T* -> +T*, of which the last counts."""
        shares, first, steps = cycle_shares(self.loads.cycle_steps, self.loops)
        shares, base = self.loads.cycle_amplitude * shares, self.case.coupled
        if base is None:
            T, d, path = self._path(shares)
            work = self.copies * path.slip_work
        else:
            values = shares * self.total
            found = base.go_on(load=loads_along(base, values, self.unit))
            moved = (found.displacement[:, 1:3] - base.displacement[-1, 1:3]) @ self.unit
            T, d = np.insert(values, 0, 0.0), np.insert(moved, 0, 0.0)
            work = found.friction_loss(base.history)
        area = abs(float(np.trapezoid(T[-steps - 1 :], d[-steps - 1 :])))
        slip_work = work[first:].reshape(self.loops, steps).sum(axis=1)
        return LoadPath(case, T, d, True, float(slip_work[-1]), area, float(slip_work.max()))

    def tractions(self) -> list[tuple[Array, float]]:
        """Tractions of every tangential load and of the cycle, which bodies learn: on all nodes,
        column by column, and the largest share of them that may be unknown: stuck, in gross slip,
        of every load with its rates, of the cycle.
        """
        scene, C = self.solution.plan.scene, self.compliance
        gross = np.zeros(len(C))
        gross[: len(self.limit)] = self.limit
        found = [(self._moved(C)[0], KNOWN_STIFFNESS), (gross, KNOWN)]
        history = None
        for ratio in sorted(scene.loads.tangential) if scene.wants("tangential") else ():
            target = ratio * self.total * (self.unit if len(self.unit) == 2 else self.unit[0])
            one = tangential_contact(C, self.limit, load=target, history=history)
            history = one.history
            found.append((one.force, KNOWN))
            found += [(one.rates, KNOWN_STIFFNESS)] if one.rates is not None else []
        if scene.wants("cycle"):
            shares, *_ = cycle_shares(self.loads.cycle_steps, self.loops)
            found.append((self._path(self.loads.cycle_amplitude * shares)[2].force.T, KNOWN))
        n = len(self.solution.model.gap)
        at = np.concatenate([self.loaded + k * n for k in range(len(self.components))])
        out = []
        for tractions, limit in found:
            whole = np.zeros((n * len(self.components), *tractions.shape[1:]))
            whole[at] = tractions
            out.append((whole, limit))
        return out


# -- effects left out ------------------------------------------------------------------------------
#
# Each is verified on a number of the run, solved again with it on the plan's companion, a coarser
# whole model with all three directions condensed together: once without the effect and once with it
# switched on.

_NORMAL = ("K_N_tangent_raw",), ("approach",)
_SHEAR = ("K_T_initial_raw", "K_Tx_initial_raw", "K_Ty_initial_raw")
_AREAS = ("contact_area", "stick_area")
#: effect -> numbers that show what it changes: the first row of which a run has some; coupling also
#: changes areas
_SHOWN: Mapping[str, tuple[tuple[str, ...], ...]] = {
    planned.TILT: _NORMAL,
    planned.COUPLING: (
        (*_NORMAL[0], *_SHEAR),
        ("approach", "K_T_secant_raw", "cycle_energy"),
    ),
    planned.DIRECTIONS: ((*_SHEAR, "K_T_secant_raw", "cycle_energy"), ("K_T_tangent_raw",)),
}
_SWITCHES: Mapping[str, tuple[str, object]] = {
    planned.TILT: ("contact.tilt", "free"),
    planned.COUPLING: ("contact.coupling", "coupled"),
    planned.DIRECTIONS: ("contact.directions", 2),
}


def solve_left_out(solution: ContactSolution, stages: Stages) -> None:
    """Every number that shows what an effect left out changes, again with it."""
    companion, model = solution.plan.companion, None
    if companion is None:
        return
    with stages("effects left out", "on a coarser whole model"):
        without = _under_load(make_results(solution))
        with suppress(UpdError):
            model = prepare(companion, Stages(), "companion")
            without = _numbers(companion, model)
        for effect in solution.plan.shown:
            included, tips = dict[Key, float](), False
            try:
                if model is not None:
                    found = _numbers(companion, model, _SWITCHES[effect])
                    included = {(r.name, r.case): r.value for r in found}
            except (UpdError, np.linalg.LinAlgError) as error:
                tips = isinstance(error, InputError)
            solution.left_out += _changes(effect, without, included, tips=tips)


def _changes(
    effect: str, without: Sequence[Result], included: Mapping[Key, float], *, tips: bool
) -> Iterator[Resolved]:
    """The numbers that an effect changes; NaN where none was found with it, and no stiffness where
    the body tips over.
    """
    areas = {r.case.load: r.value for r in without if r.name == q.CONTACT_AREA.name}
    known = [r for r in without if (r.name, r.case) in included or not included]
    had = {r.name for r in known}
    names = next((row for row in _SHOWN[effect] if had.intersection(row)), ())
    names += _AREAS if effect == planned.COUPLING else ()
    for r in (one for one in known if one.name in names):
        none = 0.0 if tips and r.unit == "N/mm" else float("nan")
        value, area = included.get((r.name, r.case), none), areas.get(r.case.load, 0.0)
        over = (area, q.STICK_AREA.part_of) if r.name == q.STICK_AREA.name and area else None
        yield Resolved(effect, r.name, r.case, r.value, value, r.unit, over=over)


def _under_load(found: Sequence[Result]) -> list[Result]:
    """Numbers of the loads that press: an effect changes nothing else."""
    return [one for one in found if one.case.load and not one.withheld]


def _numbers(plan: ContactPlan, model: ContactModel, *switch: tuple[str, object]) -> list[Result]:
    """Of the companion, with an effect switched on."""
    switched = replace(plan, scene=changed(plan.scene, switch))
    with few_threads(model.gap):
        return _under_load(make_results(solve_plan(switched, Stages(), model)))
