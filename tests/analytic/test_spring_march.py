"""Sweeps of the spring model by time march, against linear answers, the balance, another march."""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from upd.analyses import forced, make_plan
from upd.analyses.forced import sweeps
from upd.analyses.forced.march_modes import stuck_modes_of
from upd.analyses.forced.mode_peaks import ModePeak, stuck_motion
from upd.analyses.forced.ranges import alike, peak_ranges
from upd.analyses.forced.read_points import ends, read_points, settle_read, wanders
from upd.analyses.forced.solution import ForcedSolution
from upd.analyses.forced.spring_march import spring_march, state_of
from upd.analyses.forced.sweeps import (
    SweepJob,
    both_ways,
    make_springs,
    march_sweep,
    sweep_maxima,
)
from upd.errors import ConvergenceError, InputError
from upd.hbm import refined_sweep as refined_sweep_module
from upd.hbm.interface_march import InterfaceMarch
from upd.hbm.interface_settle import settle
from upd.hbm.march import steady_state
from upd.hbm.refined_sweep import LOOK, WATCHED, march_on, refined_sweep
from upd.progress import Stages, silent
from upd.scene import load_scene
from upd.scene.forced_contact import SIDES

#: the pads' response at F_C/F_E 194 around its out-of-phase peak, which bends back
SCENE = [
    "mesh.element=hex8i",
    "contact.static=frictionless",
    'contact.stiffness=["thesis"]',
    "contact.columns=1",
    "reduction.modes=4",
    "balance.harmonics=3",
    "balance.method=auto",
    "excitation.points=30",
    "excitation.start=415 Hz",
    "excitation.stop=445 Hz",
    "excitation.centrifugal_to_force=[194.0]",
    'want=["response"]',
    "left_out.solve=no",
]
RIGHT = SIDES.index("right")


@pytest.fixture(scope="module")
def solution() -> ForcedSolution:
    found: Any = forced.ANALYSIS.solve(
        make_plan(load_scene("asymmetric-response", SCENE)), Stages(silent)
    )
    assert isinstance(found, ForcedSolution)
    return found


def test_the_stuck_march_is_the_stuck_blades(solution: ForcedSolution) -> None:
    model = solution.models["thesis"]
    springs = spring_march(model, 0.005, model.n, 4)
    f = np.linspace(300.0, 500.0, 41)
    found = springs.march.linear_response(f, [1.0], stuck=True)[:, :2]
    moved = stuck_motion(model, f)
    wanted = np.array([[model.row(side) @ z for side in SIDES] for z in moved])
    assert np.abs(found - wanted).max() < 1e-6 * np.abs(wanted).max()


def test_stuck_modes_are_those_of_the_whole_model(solution: ForcedSolution) -> None:
    march = make_springs(solution.plan, solution.models["thesis"]).march
    told = stuck_modes_of(march, 1000.0)
    assert told.number[:2] == (1, 2)
    assert told.words[:2] == ("in phase", "out of phase")


def test_nothing_moves_without_a_force(solution: ForcedSolution) -> None:
    springs = make_springs(solution.plan, solution.models["thesis"])
    at = springs.at_rest()
    before = at.q.copy()
    found = InterfaceMarch(springs.march, 430.0, [0.0], 64).period(at)
    assert found.counts == pytest.approx([0.0, 1.0, 0.0])
    assert np.abs(found.output - found.output[0]).max() < 1e-9 * np.abs(found.output).max()
    assert np.abs(at.q - before).max() < 1e-9 * np.abs(before).max()


def test_rest_needs_forces_that_carry_the_damper(solution: ForcedSolution) -> None:
    springs = make_springs(solution.plan, solution.models["thesis"])
    with pytest.raises(InputError, match="static state"):
        replace(springs, rest=0.5 * springs.rest).at_rest()


def test_a_period_from_the_balances_motion_repeats_it(solution: ForcedSolution) -> None:
    """To the steps of the march, or what harmonics above the third would move the contacts."""
    model, curve = solution.models["thesis"], solution.curves[0]
    springs = make_springs(solution.plan, model)
    moving = np.flatnonzero((curve.answer.state[:, :, 1:] > 0.0).any(axis=(1, 2)))
    for i in moving[:: max(1, len(moving) // 6)]:
        f = float(curve.answer.frequency[i])
        at = state_of(springs, model, curve.answer, int(i), curve.force)
        march = InterfaceMarch(springs.march, f, [curve.force], 128)
        out = march.period(at).output[:, RIGHT]
        n = march.samples
        z = 2.0 / n * np.exp(-2j * np.pi * np.arange(1, n + 1) / n) @ out
        H = -((2.0 * np.pi * f) ** 2) * 1e-3 * z / curve.force
        off = abs(H - curve.accelerance["right"][i]) / abs(H)
        assert off < max(1e-3, curve.answer.truncation[i])


def test_sweeps_jump_where_the_curve_folds(solution: ForcedSolution) -> None:
    up, down = solution.sweeps
    assert (up.way, down.way) == ("up", "down")
    assert up.found.status != "stopped" != down.found.status
    # the peak bends back: falling, the high motion lasts to lower frequencies
    tops = [s.peaks["right"][-1] for s in (up, down)]
    assert tops[1].height > 1.1 * tops[0].height
    assert tops[1].frequency < tops[0].frequency - 1.0
    fold = down.found.frequency[list(down.found.jumps)]
    assert (np.abs(fold - tops[1].frequency) < 1.0).any()
    told = peak_ranges(solution, "thesis", 194.0)[2]
    assert not told.single
    assert told.ends("height") == pytest.approx((tops[0].height, tops[1].height))


def test_another_march_settles_at_the_same_motion(solution: ForcedSolution) -> None:
    """Newmark's method with all dofs and the law of the balance, where points slip or open and the
    balance's residual slips are those of a steady motion.
    """
    model, curve = solution.models["thesis"], solution.curves[0]
    springs, a = make_springs(solution.plan, model), curve.answer
    moving = (a.state[:, :, 1:] > 0.0).any(axis=(1, 2)) & (a.truncation < 5e-2)
    i = int(np.argmax(np.where(moving, np.abs(curve.accelerance["right"]), 0.0)))
    f = float(a.frequency[i])
    other = steady_state(a.balance, f, a.x[i], steps=512, tolerance=1e-5)
    assert other.status == "periodic"
    start = state_of(springs, model, a, i, curve.force)
    mine = march_sweep(springs.march, np.array([f]), curve.force, start)
    assert abs(mine.amplitude[0, RIGHT]) == pytest.approx(
        other.amplitude(model.row("right")), rel=2e-3
    )
    assert mine.share[0, 1] < 1.0


@pytest.fixture(scope="module")
def explicit() -> ModuleType:
    """The benchmarks' explicit integration: sliders, lift-off and time steps of its own."""
    path = Path(__file__).parents[2] / "benchmarks" / "explicit_march.py"
    spec = importlib.util.spec_from_file_location("explicit_march", path)
    assert spec is not None and spec.loader is not None
    module = sys.modules["explicit_march"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_an_explicit_march_of_all_modes_stays_at_the_motion(
    solution: ForcedSolution, explicit: ModuleType
) -> None:
    """Where points slip and open: what the march settles at, to what the modes that follow
    statically and the step leave.
    """
    f, force, model = 405.0, 2.0, solution.models["thesis"]
    springs = make_springs(solution.plan, model)
    at = springs.at_rest()
    mine = settle(InterfaceMarch(springs.march, f, [force], 128), at, 1e-4, 1000)
    assert mine.settled
    assert (mine.last.counts > 0.05).all()
    full = explicit.explicit_march(model, 0.005)
    found, _, change = full.steady(f, force, full.at(springs, at, force), most=64)
    assert change < 1e-3
    assert abs(mine.first_harmonic[RIGHT]) == pytest.approx(abs(found[RIGHT]), rel=2e-3)


def test_a_sweep_looks_closer_only_where_it_changes(solution: ForcedSolution) -> None:
    springs = make_springs(solution.plan, solution.models["thesis"])
    f = np.linspace(415.0, 425.0, 4)
    flat = refined_sweep(
        springs.march, f, [1e-3], springs.at_rest(), watched=[RIGHT], least_step=0.2
    )
    # nothing slips at so small a force: the linear answer, at what was asked for and between
    assert flat.status == "settled"
    assert set(f) <= set(flat.frequency)
    wanted = springs.march.linear_response(flat.frequency, [1e-3], stuck=True)
    assert np.abs(flat.amplitude[:, :2]) == pytest.approx(np.abs(wanted[:, :2]), rel=2e-3)
    change = np.abs(np.diff(flat.amplitude[:, RIGHT]))
    assert (change <= 0.15 * np.abs(flat.amplitude[:, RIGHT]).max()).all()
    assert flat.jumps == ()


def test_a_point_marched_on_is_the_steady_one(solution: ForcedSolution) -> None:
    springs = make_springs(solution.plan, solution.models["thesis"])
    f, watched = np.linspace(425.0, 435.0, 3), {"watched": [RIGHT], "least_step": 1.0}
    short = refined_sweep(springs.march, f, [1e-3], springs.at_rest(), most_periods=24, **watched)
    at = int(np.abs(short.amplitude[:, RIGHT]).argmax())
    assert not short.settled[at]
    found = march_on(short, at, **watched)
    wanted = springs.march.linear_response(short.frequency[[at]], [1e-3], stuck=True)
    assert found.settled[at]
    assert np.abs(found.amplitude[at, :2]) == pytest.approx(np.abs(wanted[0, :2]), rel=2e-3)
    assert np.abs(short.amplitude[at, RIGHT]) < 0.9 * np.abs(wanted[0, RIGHT])
    others = np.arange(len(short.frequency)) != at
    assert (found.amplitude[others] == short.amplitude[others]).all()
    missed = (~short.settled).sum() - 1
    assert found.message == f"{missed} of {len(short.frequency)} frequencies did not settle"


def test_a_motion_that_does_not_settle_is_told_by_its_range(
    solution: ForcedSolution, monkeypatch: pytest.MonkeyPatch
) -> None:
    springs = make_springs(solution.plan, solution.models["thesis"])
    watched = {"watched": [RIGHT], "least_step": 1.0}
    short = refined_sweep(
        springs.march, [430.0], [1e-3], springs.at_rest(), most_periods=24, **watched
    )
    # so short that the motion still beats, which is the range it is seen to wander in
    found = march_on(short, 0, most_periods=24, accelerate=False, **watched)
    assert not found.settled[0]
    assert found.periods[0] == short.periods[0] + 24 + WATCHED // LOOK * LOOK
    monkeypatch.setattr(refined_sweep_module, "WATCHED", 2 * LOOK)
    first = march_on(short, 0, most_periods=24, accelerate=False, **watched)
    # of every one of its periods
    march = InterfaceMarch(springs.march, 430.0, [1e-3], short.samples)
    state = short.starts[0].copy()
    settle(march, state, 1e-3, 24)
    heights = [abs(settle(march, state, 1e-3, 1).first_harmonic[RIGHT]) for _ in range(2 * LOOK)]
    assert first.lowest[0, RIGHT] == pytest.approx(min(heights), rel=1e-9)
    assert first.highest[0, RIGHT] == pytest.approx(max(heights), rel=1e-9)
    assert found.lowest[0, RIGHT] <= first.lowest[0, RIGHT]
    assert found.highest[0, RIGHT] >= first.highest[0, RIGHT]
    assert found.lowest[0, RIGHT] < 0.9 * found.highest[0, RIGHT]
    assert found.lowest[0, RIGHT] <= abs(found.amplitude[0, RIGHT]) <= found.highest[0, RIGHT]


def test_what_is_read_from_a_sweep_settles(solution: ForcedSolution) -> None:
    """Of a sweep that goes on after too few periods, its highest point is one that lasts."""
    springs, plan = make_springs(solution.plan, solution.models["thesis"]), solution.plan
    f = np.linspace(420.0, 440.0, 5)
    job = SweepJob("thesis", 194.0, springs.march, f, springs.at_rest(), least=0.1, most_periods=24)
    short, _ = both_ways(plan, job)
    assert wanders(short)
    found = settle_read(plan, job, short)
    assert not wanders(found)
    for at in read_points(found):
        assert found.found.settled[at]
        truth = march_sweep(
            springs.march, found.frequency[[at]], found.force, short.found.starts[at]
        )
        height = abs(found.accelerance["right"][at])
        assert abs(found.found.amplitude[at, RIGHT]) == pytest.approx(
            abs(truth.amplitude[0, RIGHT]), rel=2e-3
        )
        assert ends(found, at, height) == (height, height)
    lost = [abs(one.accelerance["right"]).max() for one in (short, found)]
    assert lost[0] != pytest.approx(lost[1], rel=1e-2)


@pytest.mark.parametrize("f", [[], [430.0, 420.0, 440.0], [-1.0, 2.0]])
def test_frequencies_have_one_direction(solution: ForcedSolution, f: list[float]) -> None:
    springs = make_springs(solution.plan, solution.models["thesis"])
    with pytest.raises(InputError, match="rise, or fall"):
        refined_sweep(springs.march, f, [1.0], springs.at_rest(), watched=[0], least_step=0.2)


def test_a_peak_whose_march_fails_is_not_confirmed(
    solution: ForcedSolution, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*args: Any, **named: Any) -> Any:
        raise ConvergenceError("no answer")

    monkeypatch.setattr(sweeps, "settle", fail)
    model, curve = solution.models["thesis"], solution.curves[0]
    springs, peak = make_springs(solution.plan, model), solution.numbered_peaks(curve)[0]
    one = sweeps.confirm(springs, model, curve, peak)
    assert not one.settled
    assert one.difference == float("inf")


def test_samples_of_the_scene_are_the_steps_of_its_marches(
    solution: ForcedSolution, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted: list[int] = []
    made = InterfaceMarch.__init__

    def counting(self: Any, model: Any, f: float, drive: Any, samples: int, *more: Any) -> None:
        counted.append(samples)
        made(self, model, f, drive, samples, *more)

    monkeypatch.setattr(InterfaceMarch, "__init__", counting)
    curve = solution.curves[0]
    for given, steps in (("auto", 128), (64, 64), (200, 200)):
        scene = solution.plan.scene
        plan = replace(
            solution.plan, scene=replace(scene, balance=replace(scene.balance, samples=given))
        )
        springs = make_springs(plan, solution.models["thesis"])
        # a step in a period of the fastest mode that swings
        assert springs.march.frequency.max() < steps * scene.excitation.start
        job = sweeps.SweepJob(
            "thesis", curve.ratio, springs.march, np.array([415.0]), springs.at_rest()
        )
        counted.clear()
        up, _ = sweeps.both_ways(plan, job)
        assert set(counted) == {steps}
        assert up.found.settled.all()


def test_no_maximum_is_read_across_a_jump() -> None:
    f = np.arange(8.0)
    size = np.array([1.0, 2.0, 3.0, 10.0, 8.0, 7.0, 9.0, 4.0])
    found = sweep_maxima(f, size, [2])
    # the ends of the jump, the one below with what it leaves; the other by a parabola
    assert [round(one.sample) for one in found] == [2, 6, 3]
    assert found[0].height == 3.0
    assert found[2].height == 10.0
    assert 9.0 < found[1].height < 10.1


def test_peaks_are_one_within_the_stated_differences() -> None:
    one = ModePeak(1, 400.0, 100.0, 3, "in phase", 0.9)
    assert alike(one, one._replace(frequency=400.3, height=100.9))
    assert not alike(one, one._replace(frequency=400.5))
    assert not alike(one, one._replace(height=102.0))
