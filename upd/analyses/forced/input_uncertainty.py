"""What inputs known within limits do to the numbers of a forced response.

Peaks of every curve by implicit differentiation of the balance at the peak itself, free and stuck
peaks by that of the linear answer, stuck frequencies by Rayleigh's quotient. Friction, totals of
the contact stiffness, F_C and F_E, damping, Young's modulus and densities move data that are known
in closed form: none needs the mesh again. In step with them the static state is that of both ends.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from upd.analyses.forced.curves import PointCurve
from upd.analyses.forced.linear_sensitivity import limit_peak, stuck_frequencies
from upd.analyses.forced.measures import CurvePeak
from upd.analyses.forced.mode_peaks import CANDIDATES, unmoved
from upd.analyses.forced.model import Array, Model, preloaded
from upd.analyses.forced.plan import ForcedPlan, newton_seconds
from upd.analyses.forced.solution import ForcedSolution
from upd.analyses.forced.statics import StaticState, static_state
from upd.analyses.seated.bodies import Bodies
from upd.errors import ConvergenceError, UpdError, one_line
from upd.hbm.peaks.parameter_change import ParameterChange
from upd.hbm.peaks.sensitivity import peak_derivatives
from upd.hbm.springs.starts import newton
from upd.linalg.parallel import threads_for
from upd.progress import Stages
from upd.results import Case, Result
from upd.results import quantities as q
from upd.scene import ForcedScene
from upd.scene.forced_contact import SIDES, Side, StiffnessChoice
from upd.vary.inputs import InputChange, InputEnds

log = logging.getLogger(__name__)
#: peaks of a curve, of both blades
_PEAKS = 4.0
#: timed on the ready scenes: Newton steps of a peak that is differentiated (15 symmetric, 22
#: asymmetric), and seconds of a seating at one end of an interval
_CLIMB, _SEATING_S = 20.0, 0.2
Key = tuple[str, Case]
PEAK = "implicit derivative of the balance at the peak"
LINEAR = "derivative of the linear answer"
RAYLEIGH = "Rayleigh's quotient of the stuck mode"
STATE = "static states at both ends"
#: a number, its relative change by every input, how it was found
Derivative = tuple[Key, Array, str]


@dataclass(frozen=True)
class PeakChange:
    """Relative changes of a peak by every input, (n,) each, and its height in (m/s2)/N; those of
    the loss there are None of a linear answer and where nothing is lost.
    """

    frequency: Array
    height: Array
    size: float
    loss: Array | None = None


def input_changes(
    solution: ForcedSolution, numbers: Sequence[Result], ends: Sequence[InputEnds]
) -> dict[str, dict[Key, InputChange]]:
    """What half an interval does to peaks, stuck frequencies, and forces at rest.

    Parameters
    ----------
    solution
        Of contact points on springs; whole faces have no such derivatives.
    numbers
        Of the run.
    ends
        Of all inputs known within limits; those that move the mesh are left to others.

    Returns
    -------
    dict
        Path of an input -> name and case of a number -> its relative change.
    """
    plan, bodies = solution.plan, solution.bodies
    known = [end for end in ends if is_known(end)]
    if not known or not solution.models or bodies is None:
        return {}
    found: dict[str, dict[Key, InputChange]] = {end.of.path: {} for end in known}
    for name, model in solution.models.items():
        data = [data_change(plan, bodies, name, model, end, Stages()) for end in known]
        with threads_for(len(model.M)):
            for key, change, basis in _of_model(solution, name, data, numbers):
                for end, value in zip(known, change, strict=True):
                    found[end.of.path][key] = InputChange(float(value), basis)
    return found


def _of_model(
    solution: ForcedSolution, name: str, data: Sequence[DataChange], numbers: Sequence[Result]
) -> Iterator[Derivative]:
    """Forces of the faces at rest, stuck frequencies, peaks of the limits and of the curves."""
    model, linear = solution.models[name], solution.linear[name]
    whole = [one.whole(model) for one in data]
    if model.state is not None:
        for (letter, quantity), of in product(
            (("N", q.STATIC_N), ("T", q.STATIC_T)), range(len(SIDES))
        ):
            size = getattr(model.state, letter)[of]
            if size:
                case = Case(stiffness=name, side=SIDES[of], choice=model.state.name)
                change = np.array([getattr(one, f"state_{letter}")[of] for one in data])
                yield (quantity.name, case), change / size, STATE
    below = CANDIDATES * solution.plan.scene.excitation.stop
    for number, (_, change) in stuck_frequencies(model, below, whole).items():
        yield (number, Case(stiffness=name)), change, RAYLEIGH
    free: dict[Side, PeakChange] = {}
    for side in SIDES:
        for peak in unmoved(linear.free_peaks[side]):
            moved = _linear_change(model, whole, side, peak, False)
            if side not in free or moved.size > free[side].size:
                free[side] = moved
            yield from _named(side, peak.number, Case(stiffness=name, kind="free"), moved, LINEAR)
        for peak in solution.stuck_peaks(name, side):
            moved = _linear_change(model, whole, side, peak, True)
            case = Case(stiffness=name, kind="stuck", mode=peak.mode)
            yield from _named(side, peak.number, case, moved, LINEAR)
    for curve in solution.curves:
        if curve.stiffness == name and not curve.empty:
            yield from _of_curve(solution, curve, data, free, numbers)


def _linear_change(
    model: Model, whole: Sequence[ParameterChange], side: Side, peak: CurvePeak, stuck: bool
) -> PeakChange:
    found = limit_peak(model, side, stuck, peak.frequency, whole)
    by_frequency, by_height = found.by_frequency / found.frequency, found.by_height / found.height
    return PeakChange(by_frequency, by_height, peak.height)


def _named(
    side: Side, number: int, case: Case, change: PeakChange, basis: str
) -> Iterator[Derivative]:
    yield (q.PEAK_FREQUENCY.on(side).named(number), case), change.frequency, basis
    yield (q.PEAK_ACCELERANCE.on(side).named(number), case), change.height, basis


def _of_curve(
    solution: ForcedSolution,
    curve: PointCurve,
    data: Sequence[DataChange],
    free: Mapping[Side, PeakChange],
    numbers: Sequence[Result],
) -> Iterator[Derivative]:
    """Peaks of both blades of one curve, and how far the highest is below the free one."""
    for side in SIDES:
        highest: PeakChange | None = None
        for peak in curve.peaks[side]:
            try:
                change = _at_top(solution, curve, data, side, peak)
            except UpdError as error:
                log.info("%s, peak %d: no derivative: %s", curve.case, peak.number, one_line(error))
                continue
            if highest is None or change.size > highest.size:
                highest = change
            case = replace(curve.case, mode=peak.mode)
            yield from _named(side, peak.number, case, change, PEAK)
            if side == "right" and change.loss is not None:
                at = replace(case, peak=peak.number)
                yield (q.FRICTION_ENERGY.name, at), change.loss, PEAK
        name = q.REDUCTION.on(side).name
        value = next((r.value for r in numbers if (r.name, r.case) == (name, curve.case)), 0.0)
        if highest is not None and side in free and value:
            left = 100.0 - value
            yield (name, curve.case), left / value * (free[side].height - highest.height), PEAK


def _at_top(
    solution: ForcedSolution,
    curve: PointCurve,
    data: Sequence[DataChange],
    side: Side,
    peak: CurvePeak,
) -> PeakChange:
    """The derivatives of a peak of a curve, per newton of F_E: those of its top, also where this is
    unstable and the peak is the highest stable motion beside it.

    Raises
    ------
    ConvergenceError
        Where its top is not known.
    """
    model, b = solution.models[curve.stiffness], curve.answer.balance
    top, row, k = curve.tops.get((side, peak.number)), model.row(side), model.excitation.lowest
    x = None if top is None else newton(b, top.x, top.frequency)
    if top is None or x is None:
        raise ConvergenceError(f"the top of the peak at {peak.frequency:.6g} Hz was not found")
    place = solution.plan.scene.excitation.centrifugal_to_force.index(curve.ratio)
    forces = np.array([one.forces[place] for one in data])
    changes = [
        one.whole(model) + ParameterChange(dynamic=each * b.dynamic)
        for one, each in zip(data, forces, strict=True)
    ]
    found = peak_derivatives(b, row, x, top.frequency, changes, harmonic=k, power=2.0)
    return PeakChange(
        found.by_frequency / found.frequency,
        found.by_height / found.height - forces,
        peak.height,
        found.by_loss / found.loss if found.loss else None,
    )


# -- what an input changes of the data of the models -----------------------------------------------


def is_known(end: InputEnds) -> bool:
    """Whether an input moves nothing but data that are known here."""
    return all(_alike(other, end.given) == end.given for other in (end.low, end.high))


def _alike(other: ForcedScene, scene: ForcedScene) -> ForcedScene:
    """A scene with the data that are known here as another scene has them."""
    m, d, e = scene.material, scene.damper, scene.excitation
    return replace(
        other,
        text=scene.text,
        uncertain=scene.uncertain,
        accuracy=scene.accuracy,
        left_out=scene.left_out,
        material=replace(other.material, E=m.E, density=m.density),
        damper=d,
        contact=replace(other.contact, friction=scene.contact.friction),
        excitation=replace(
            other.excitation,
            damping=e.damping,
            force=e.force,
            centrifugal_to_force=e.centrifugal_to_force,
        ),
        stiffness={
            name: _with_totals(choice, scene.stiffness.get(name))
            for name, choice in other.stiffness.items()
        },
    )


def _with_totals(choice: StiffnessChoice, like: StiffnessChoice | None) -> StiffnessChoice:
    if like is None or choice.from_contact:
        return choice
    return replace(choice, K_N=like.K_N, K_T=like.K_T, left=like.left, right=like.right)


@dataclass(frozen=True)
class DataChange:
    """What half an interval of an input does to one model.

    Attributes
    ----------
    contacts
        Of the contact points and the static loads.
    blades
        Of mass, damping and stiffness of the blades alone, (n, n).
    damper
        Relative change of the damper's mass and inertia.
    forces
        Relative change of F_E of every curve, by the place of its F_C/F_E.
    state_N, state_T
        (2,) N, of the faces' forces at rest.
    """

    contacts: ParameterChange
    blades: ParameterChange
    damper: float
    forces: Array
    state_N: Array
    state_T: Array

    def whole(self, model: Model) -> ParameterChange:
        """All of it but the forces, on the dofs of blades and damper."""
        m, n = model.n, model.damper.n_dof
        M, C, K = (
            np.zeros((m + n, m + n))
            if (value := getattr(self.blades, name)) is None
            else np.pad(value, (0, n))
            for name in ("M", "C", "K")
        )
        M[m:, m:] += self.damper * model.damper.M
        return self.contacts + ParameterChange(M=M, C=C, K=K)


def data_change(
    plan: ForcedPlan, bodies: Bodies, name: str, model: Model, end: InputEnds, stages: Stages
) -> DataChange:
    """What half an interval of a known input does to the model of one contact stiffness.

    Raises
    ------
    InputError
        Where the static state does not exist at an end.
    """
    scene = plan.scene

    def relative(value: Any) -> float:
        """Half of the change between both ends, over the scene's."""
        low, now, high = (float(value(one)) for one in (end.low, scene, end.high))
        return 0.5 * (high - low) / now if now else 0.0

    law = model.contacts.law
    parts = ParameterChange()
    mu = relative(lambda s: s.contact.friction)
    if mu and np.any(law.mu):
        parts += ParameterChange(mu=mu * law.mu)
    for k, side in enumerate(SIDES):
        for total, of in (("K_N", "k_n"), ("K_T", "k_t")):
            given = scene.stiffness[name].face(side)
            if given is None:
                continue
            share = relative(lambda s, a=side, b=total: getattr(s.stiffness[name].face(a), b))
            if share:
                values = share * np.where(model.face == k, getattr(law, of), 0.0)
                mine = ParameterChange(k_n=values) if of == "k_n" else ParameterChange(k_t=values)
                parts += mine
    N, T = np.zeros(2), np.zeros(2)
    F_C = relative(lambda s: s.damper.centrifugal)
    if F_C:
        load = np.concatenate([model.static, model.damper.force])
        parts += ParameterChange(
            preload=F_C * law.preload, traction=F_C * model.traction, static=F_C * load
        )
        if model.state is not None:
            N, T = N + F_C * model.state.N, T + F_C * model.state.T
    if mu and model.state is not None:
        states = [
            static_state(replace(plan, scene=_rubbed(scene, one)), bodies, stages=stages)
            for one in (end.low, end.high)
        ]
        parts += _by_state(model, states)
        N, T = (
            total + 0.5 * (getattr(states[1], of) - getattr(states[0], of))
            for total, of in ((N, "N"), (T, "T"))
        )
    E = relative(lambda s: s.material.E)
    density = relative(lambda s: s.material.density)
    damping = relative(lambda s: s.excitation.damping)
    # C = M Phi diag(2 zeta omega) Phi' M of the blades: as zeta, and as the root of E rho
    blades = ParameterChange(
        M=density * model.M, C=(damping + 0.5 * (E + density)) * model.C, K=E * model.K
    )
    forces = [
        relative(lambda s, k=k: s.damper.centrifugal / s.excitation.centrifugal_to_force[k])
        for k in range(len(scene.excitation.centrifugal_to_force))
    ]
    rigid = relative(lambda s: s.damper.density or s.material.density)
    return DataChange(parts, blades, rigid, np.array(forces), N, T)


def _rubbed(scene: ForcedScene, other: ForcedScene) -> ForcedScene:
    return replace(scene, contact=replace(scene.contact, friction=other.contact.friction))


def _by_state(model: Model, states: list[StaticState]) -> ParameterChange:
    """Half of the change of preload, traction and static loads between two static states."""
    low, high = (preloaded(model, state) for state in states)
    return ParameterChange(
        preload=0.5 * (high.contacts.law.preload - low.contacts.law.preload),
        traction=0.5 * (high.traction - low.traction),
        static=np.pad(0.5 * (high.static - low.static), (0, model.damper.n_dof)),
    )


# -- seconds ---------------------------------------------------------------------------------------


def known_inputs(plan: ForcedPlan, ends: Sequence[InputEnds]) -> tuple[set[str], float]:
    """Inputs whose derivatives are known, and the seconds that all of them take together.

    Parameters
    ----------
    plan
        Of contact points on springs; whole faces have no such derivatives.
    ends
        Of all inputs known within limits.
    """
    scene = plan.scene
    known = {end.of.path for end in ends if is_known(end)}
    if not known or scene.contact.model == "interface":
        return set(), 0.0
    curves = len(scene.stiffnesses) * len(scene.excitation.centrifugal_to_force)
    rubbed = "contact.friction" in known and scene.contact.static == "seated"
    return known, _PEAKS * _CLIMB * curves * newton_seconds(plan) + 2 * rubbed * _SEATING_S
