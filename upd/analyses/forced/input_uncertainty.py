"""What inputs known within limits do to the numbers of a forced response.

Peaks of every curve by implicit differentiation of the balance at the peak itself, free and stuck
peaks by that of the linear answer, stuck frequencies by Rayleigh's quotient.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from upd.analyses.base import InputChange, InputEnds
from upd.analyses.forced.curves import ForcedCurve
from upd.analyses.forced.input_data import DataChange, data_change, is_known
from upd.analyses.forced.linear_sensitivity import limit_peak, stuck_frequencies
from upd.analyses.forced.mode_peaks import CANDIDATES, ModePeak, unmoved
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.peak_results import LEFT, reduction_name
from upd.analyses.forced.solution import ForcedSolution
from upd.errors import ConvergenceError, UpdError, one_line
from upd.hbm import climb
from upd.hbm.parameter_change import ParameterChange
from upd.hbm.peak_sensitivity import peak_derivatives
from upd.hbm.starts import newton
from upd.linalg.parallel import threads_for
from upd.progress import Stages
from upd.results import Case, Result
from upd.scene.forced_contact import SIDES, Side

log = logging.getLogger(__name__)
Key = tuple[str, Case]
#: relative distance from a curve's peak within which the one climbed to is the same
SAME = 5e-3
PEAK = "implicit derivative of the balance at the peak"
LINEAR = "derivative of the linear answer"
RAYLEIGH = "Rayleigh's quotient of the stuck mode"
STATE = "static states at both ends"


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


#: a number, its relative change by every input, how it was found
Told = tuple[Key, Array, str]


def _of_model(
    solution: ForcedSolution, name: str, data: Sequence[DataChange], numbers: Sequence[Result]
) -> Iterator[Told]:
    model = solution.models[name]
    yield from _at_rest(name, model, data)
    yield from _stuck_frequencies(solution, name, data)
    free: dict[Side, PeakChange] = {}
    for kind in ("free", "stuck"):
        for side, peak in _linear_peaks(solution, name, kind):
            change = _linear_change(model, data, kind, side, peak)
            if kind == "free" and (side not in free or change.size > free[side].size):
                free[side] = change
            case = Case(stiffness=name, kind=kind, mode=peak.mode)
            yield from _named(side, peak.number, case, change, LINEAR)
    for curve in solution.curves:
        if curve.stiffness == name and not curve.empty:
            yield from _of_curve(solution, curve, data, free, numbers)


def _named(side: Side, number: int, case: Case, change: PeakChange, basis: str) -> Iterator[Told]:
    name = f"{LEFT * (side == 'left')}peak_{number}"
    yield (f"{name}_frequency", case), change.frequency, basis
    yield (f"{name}_accelerance", case), change.height, basis


def _at_rest(name: str, model: Model, data: Sequence[DataChange]) -> Iterator[Told]:
    """Forces of the faces before vibration."""
    state = model.state
    for k, side in enumerate(SIDES) if state is not None else ():
        assert state is not None
        case = Case(stiffness=name, side=side, choice=state.name)
        for number, size, of in (
            ("static_N", state.N[k], "state_N"),
            ("static_T", state.T[k], "state_T"),
        ):
            if size:
                change = np.array([getattr(one, of)[k] for one in data]) / size
                yield (number, case), change, STATE


def _stuck_frequencies(
    solution: ForcedSolution, name: str, data: Sequence[DataChange]
) -> Iterator[Told]:
    """The lowest stuck modes along x, in and out of phase."""
    model = solution.models[name]
    below = CANDIDATES * solution.plan.scene.excitation.stop
    found = stuck_frequencies(model, below, [one.whole(model) for one in data])
    for number, (_, change) in found.items():
        yield (number, Case(stiffness=name)), change, RAYLEIGH


def _linear_peaks(
    solution: ForcedSolution, name: str, kind: str
) -> Iterator[tuple[Side, ModePeak]]:
    linear = solution.linear.get(name)
    for side in SIDES if linear is not None else ():
        assert linear is not None
        if kind == "free":
            told = unmoved(linear.free_peaks[side])
        else:
            told = solution.stuck_peaks(name, side)
        for peak in told:
            yield side, peak


def _linear_change(
    model: Model, data: Sequence[DataChange], kind: str, side: Side, peak: ModePeak
) -> PeakChange:
    changes = [one.whole(model) for one in data]
    found = limit_peak(model, side, kind == "stuck", peak.frequency, changes)
    return PeakChange(
        found.by_frequency / found.frequency, found.by_height / found.height, peak.height
    )


def _of_curve(
    solution: ForcedSolution,
    curve: ForcedCurve,
    data: Sequence[DataChange],
    free: Mapping[Side, PeakChange],
    numbers: Sequence[Result],
) -> Iterator[Told]:
    """Peaks of both blades of one curve, and how far the highest is below the free one."""
    for side in SIDES:
        highest: PeakChange | None = None
        for peak in curve.peaks[side]:
            try:
                change = _followed(solution, curve, data, side, peak)
            except UpdError as error:
                log.info("%s, peak %d: no derivative: %s", curve.case, peak.number, one_line(error))
                continue
            if highest is None or change.size > highest.size:
                highest = change
            case = replace(curve.case, mode=peak.mode)
            yield from _named(side, peak.number, case, change, PEAK)
            if side == "right" and change.loss is not None:
                at = replace(case, peak=peak.number)
                yield ("friction_energy", at), change.loss, PEAK
        name = reduction_name(side)
        value = next((r.value for r in numbers if (r.name, r.case) == (name, curve.case)), 0.0)
        if highest is not None and side in free and value:
            left = 100.0 - value
            yield (name, curve.case), left / value * (free[side].height - highest.height), PEAK


def _followed(
    solution: ForcedSolution,
    curve: ForcedCurve,
    data: Sequence[DataChange],
    side: Side,
    peak: ModePeak,
) -> PeakChange:
    """The derivatives of a peak of a curve, per newton of F_E.

    Raises
    ------
    ConvergenceError
        Where no such peak is found from its point of the path.
    """
    model, answer = solution.models[curve.stiffness], curve.answer
    b, row, i = answer.balance, model.row(side), peak.sample
    k, f = model.excitation.lowest, float(answer.frequency[i])
    x: Array | None = answer.x[i]
    if answer.highest_harmonic[i] < answer.harmonics.highest:
        x = newton(b, answer.x[i], f)
    top = None if x is None else climb(b, row, x, f, harmonic=k, power=2.0)
    if top is None or not top.found or abs(top.frequency / peak.frequency - 1.0) > SAME:
        raise ConvergenceError(f"the peak at {peak.frequency:.6g} Hz was not found again")
    place = solution.plan.scene.excitation.centrifugal_to_force.index(curve.ratio)
    forces = np.array([one.forces[place] for one in data])
    changes = [
        one.whole(model) + ParameterChange(dynamic=each * b.dynamic)
        for one, each in zip(data, forces, strict=True)
    ]
    found = peak_derivatives(b, row, top.x, top.frequency, changes, harmonic=k, power=2.0)
    return PeakChange(
        found.by_frequency / found.frequency,
        found.by_height / found.height - forces,
        peak.height,
        found.by_loss / found.loss if found.loss else None,
    )
