"""Contact states, loops and the damper's motion at peaks of the sweeps: against the march's own
energy, the law of friction, the balance's motion, and the damper's equilibrium.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pytest
from rigs import state_of

from upd.analyses import forced, make_plan
from upd.analyses.forced import measures
from upd.analyses.forced.curves import SweptCurve
from upd.analyses.forced.interface_model import by_coulomb, make_springs
from upd.analyses.forced.model import respond
from upd.analyses.forced.results import arrays, make_results
from upd.analyses.forced.solve import ForcedSolution, marched_damper, marched_loops
from upd.analyses.measured import CurvePeak
from upd.hbm.faces.march import InterfaceMarch
from upd.hbm.faces.step import OPEN, SLIP, STICK
from upd.hbm.faces.sweep import RecordedPeriod, period_of_sweep, recorded_period
from upd.progress import Stages, silent
from upd.scene import load_scene

#: the wedge at F_C/F_E 130 around its out-of-phase peak, which bends back; one tangent a point
SCENE = [
    "balance.method=march",
    "balance.harmonics=3",
    "balance.samples=64",
    "excitation.points=10",
    "excitation.start=440 Hz",
    "excitation.stop=446 Hz",
    "excitation.centrifugal_to_force=[130.0]",
    'want=["response", "contact_state", "hysteresis", "damper_motion"]',
    "left_out.solve=no",
]


class Marched(NamedTuple):
    """A peak of a sweep and its last period."""

    sweep: SweptCurve
    peak: CurvePeak
    period: RecordedPeriod

    @property
    def frequency(self) -> float:
        return float(self.sweep.frequency[self.peak.sample])


def all_marched(solution: ForcedSolution) -> list[Marched]:
    return [
        Marched(sweep, peak, sweep.periods[peak.number])
        for sweep in solution.curves
        for peak in sweep.peaks["right"]
    ]


def loops_of(solution: ForcedSolution, one: Marched, count: int) -> list[measures.Loop]:
    return marched_loops(solution, one.sweep, one.period, count)


def damper_of(solution: ForcedSolution, one: Marched) -> tuple[np.ndarray, np.ndarray]:
    return marched_damper(solution, one.sweep, one.period)


def shares_of(solution: ForcedSolution, one: Marched) -> np.ndarray:
    """(2, 3) of the cycle that each face sticks, slips, is open."""
    places = solution.places("thesis")
    return measures.face_shares(one.period.share, places.face, places.weight)


@pytest.fixture(scope="module")
def solution(few_points: Sequence[str]) -> ForcedSolution:
    found: Any = forced.ANALYSIS.solve(
        make_plan(load_scene("symmetric-response", [*few_points, *SCENE])), Stages(silent)
    )
    assert isinstance(found, ForcedSolution)
    return found


@pytest.fixture(scope="module")
def one(solution: ForcedSolution) -> Marched:
    """The peak of the sweep that is higher."""
    return max(all_marched(solution), key=lambda m: m.peak.height)


def test_every_sweep_tells_the_contact(solution: ForcedSolution, one: Marched) -> None:
    """Losses and states of all nodes are those of the sweep at its peak."""
    assert [m.sweep.way for m in all_marched(solution)] == ["up", "down"]
    assert one.peak in one.sweep.peaks["right"]
    loss = one.sweep.answer.energy[one.peak.sample, 2]
    assert loss > 0.0
    assert one.period.energy == pytest.approx(loss, rel=1e-9)
    lift, stick, slip = one.sweep.answer.share[one.peak.sample]
    assert one.period.share.mean(axis=0) == pytest.approx([stick, slip, lift])
    assert slip > 0.0 < lift
    # every face has as many points, and springs alike
    assert shares_of(solution, one).mean(axis=0) == pytest.approx([stick, slip, lift])


def test_loops_are_closed_and_obey_coulomb(solution: ForcedSolution, one: Marched) -> None:
    """The area of each is what the point loses: springs store, and lose nothing. While a point
    sticks its spring alone gives; in a step in which it closes it slips until it touches.
    """
    k_t = solution.models["thesis"].contacts.law.k_t
    loops = loops_of(solution, one, 4)
    start = one.sweep.answer.points[one.peak.sample].start.slip.reshape(2, -1)
    assert [loop.point for loop in loops] == list(np.argsort(-one.period.loss))
    for loop in loops:
        d, T = loop.displacement, loop.traction
        area = 0.5 * float((T + np.roll(T, 1)) @ (d - np.roll(d, 1)))
        # what the settling march still creeps in a period
        crept = (one.period.slip[-1] - start)[:, loop.point]
        area += one.period.force[[0, -1], 1:, loop.point].mean(axis=0) @ crept
        assert area == pytest.approx(loop.energy, abs=1e-3 * loops[0].energy)
        assert (np.abs(T) <= loop.limit * (1.0 + 1e-9) + 1e-9).all()
        slips = one.period.state[:, loop.point] == SLIP
        assert np.abs(T)[slips] == pytest.approx(loop.limit[slips])
        sticks = (one.period.state[1:, loop.point] == STICK) & (
            one.period.state[:-1, loop.point] != OPEN
        )
        gives = np.diff(T)[sticks] / k_t[loop.point]
        assert np.diff(d)[sticks] == pytest.approx(gives, abs=1e-9 * np.ptp(d))


def test_the_damper_follows_its_contact_forces(one: Marched) -> None:
    """Its motion ends where the march's own does; the mean of the forces on it is F_C."""
    found = one.sweep.answer
    march = InterfaceMarch(found.model, one.frequency, found.drive, found.samples, by_coulomb)
    at = found.points[one.peak.sample].start.copy()
    march.period(at)
    period = period_of_sweep(found, one.peak.sample, by_coulomb)
    assert period.motion[-1] == pytest.approx(at.s, rel=1e-12)
    assert period.slip[-1].ravel() == pytest.approx(at.slip, rel=1e-12)
    pull = period.force.reshape(found.samples, -1).mean(axis=0) @ found.model.columns
    assert pull == pytest.approx(found.model.load, abs=1e-5 * np.abs(found.model.load).max())


def test_a_period_from_the_balances_motion_is_the_balances(
    solution: ForcedSolution, one: Marched
) -> None:
    """The damper's motion, to what the harmonics leave out; the point that loses most.

    The balance's means are those of its harmonics alone, so that the march leaves them from the
    first sample on: here by a quarter of a percent of the mean in the period, with 256 to 16384
    steps and 7 to 35 harmonics alike. The rotation's amplitude is 1/28 of its mean, and what does
    not repeat has a first harmonic: 2 D / pi at most where it goes by D one way.
    """
    plan, model, N = solution.plan, solution.models["thesis"], 256
    force = plan.scene.damper.centrifugal / 150.0
    answer = respond(plan, model, force, np.array([447.5, 449.0]), harmonics=range(8), samples=N)
    i = int(answer.energy.sum(axis=1).argmax())
    springs, f = make_springs(plan, model), float(answer.frequency[i])
    march = InterfaceMarch(springs.march, f, force * model.excitation.drive, N, by_coulomb)
    at = state_of(springs, model, answer, i, force)
    period = recorded_period(march, at)
    mine = one._replace(period=period)
    left_out = float(answer.truncation[i])
    (mean, amplitude), (wanted_mean, wanted) = (
        damper_of(solution, mine),
        (of[i] for of in measures.damper_motion(answer, model)),
    )
    gone = np.zeros(6)
    gone[list(model.damper.kept)] = period.motion[-1] - at.s
    assert (np.abs(gone) <= left_out * np.abs(wanted_mean)).all()
    assert (np.abs(mean - wanted_mean) <= left_out * np.abs(wanted_mean)).all()
    most = left_out * wanted + 2.0 / np.pi * np.abs(gone)
    assert (np.abs(amplitude - wanted) <= most).all()
    assert loops_of(solution, mine, 1)[0].point == measures.loops(answer, i, 1)[0].point


def test_charts_are_of_the_march(solution: ForcedSolution, one: Marched) -> None:
    """Drawn from the arrays alone, titled with the sweep, none from the balance's one point."""
    drawn = forced.ANALYSIS.charts(arrays(solution), {})
    at = {
        f"time integration, sweep {m.sweep.way}, {m.frequency:.1f} Hz"
        for m in all_marched(solution)
    }
    figures = {"contact_map", "hysteresis"}
    mine = [chart for chart in drawn if chart.figure in figures]
    assert {chart.figure for chart in mine} == figures
    assert {chart.detail for chart in mine} == at
    assert "contact_state" not in {chart.figure for chart in drawn}
    own = [c for c in mine if c.figure == "hysteresis" and one.sweep.way in c.detail]
    loop = own[0].traces[0]
    assert loop.y[:-1] == pytest.approx(loops_of(solution, one, 1)[0].traction)


def test_results_tell_the_contact(solution: ForcedSolution, one: Marched) -> None:
    of = [
        r
        for r in make_results(solution)
        if (r.case.peak, r.case.choice) == (2, one.sweep.case.choice)
    ]
    told = {r.name: r.value for r in of}
    assert told["contact_slip"] == pytest.approx(100.0 * one.period.share[:, 1].mean())
    assert told["friction_energy"] == pytest.approx(one.period.energy)
    assert told["damper_uz"] == pytest.approx(1e3 * damper_of(solution, one)[1][2])
