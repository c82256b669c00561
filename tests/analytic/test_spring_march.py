"""The spring model by time integration: linear answers, the balance, another integration."""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from rigs import LINES, state_of, stuck_motion

from upd.analyses import forced, make_plan
from upd.analyses.forced.curves import both_ways, stuck_modes_of
from upd.analyses.forced.interface_model import by_coulomb, make_springs, spring_march
from upd.analyses.forced.measures import path_maxima
from upd.analyses.forced.peaks import folds_of
from upd.analyses.forced.solve import ForcedSolution
from upd.errors import InputError
from upd.hbm.faces.march import InterfaceMarch
from upd.hbm.faces.sweep import settle, stepped_sine
from upd.hbm.springs.time_integration import steady_state
from upd.progress import Stages, silent
from upd.scene import load_scene
from upd.scene.forced_contact import SIDES

#: the pads' response at F_C/F_E 194 around its out-of-phase peak, which bends back
SCENE = LINES | {
    "mesh.element": "hex8i",
    "contact.stiffness": ["thesis"],
    "contact.columns": 1,
    "reduction.modes": 4,
    "balance.harmonics": 3,
    "excitation.points": 30,
    "excitation.start": "415 Hz",
    "excitation.stop": "445 Hz",
    "excitation.centrifugal_to_force": [194.0],
    "want": ["response"],
    "left_out.solve": "no",
}
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
    springs = spring_march(model, 0.005, len(model.K), 4)
    f = np.linspace(300.0, 500.0, 41)
    found = springs.march.linear_response(f, [1.0], stuck=True)[:, :2]
    moved = stuck_motion(model, f)
    wanted = np.array([[model.row(side) @ z for side in SIDES] for z in moved])
    assert np.abs(found - wanted).max() < 1e-6 * np.abs(wanted).max()


def test_stuck_modes_are_those_of_the_whole_model(solution: ForcedSolution) -> None:
    march = make_springs(solution.plan, solution.models["thesis"]).march
    told = stuck_modes_of(march, 1000.0).modes
    assert [one.number for one in told[:2]] == [1, 2]
    assert [one.words for one in told[:2]] == ["in phase", "out of phase"]


def test_nothing_moves_without_a_force(solution: ForcedSolution) -> None:
    springs = make_springs(solution.plan, solution.models["thesis"])
    at = springs.at_rest()
    before = at.q.copy()
    found = InterfaceMarch(springs.march, 430.0, [0.0], 64).period(at)
    assert found.counts == pytest.approx([0.0, 1.0, 0.0])
    assert np.abs(found.output - found.output[0]).max() < 1e-9 * np.abs(found.output).max()
    assert np.abs(at.q - before).max() < 1e-9 * np.abs(before).max()


@pytest.mark.parametrize("mu", [0.0, 0.6])
def test_faces_that_fit_without_load_carry_the_damper_at_rest(
    solution: ForcedSolution, mu: float
) -> None:
    worn = make_springs(solution.plan, solution.models["thesis"])
    model = replace(worn.march, gap=np.zeros(worn.march.n), friction=np.full(worn.march.n, mu))
    at = replace(worn, march=model, rest=np.zeros_like(worn.rest)).at_rest()
    f = at.f.reshape(3, -1)
    assert model.columns.T @ at.f == pytest.approx(model.load, abs=1e-9 * np.abs(f).max())
    assert (np.hypot(*f[1:]) <= mu * f[0] + 1e-9 * f[0].max()).all()
    before = at.q.copy()
    InterfaceMarch(model, 430.0, [0.0], 64).period(at)
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


@pytest.fixture(scope="module")
def swept() -> ForcedSolution:
    """The same by sweeps."""
    plan = make_plan(load_scene("asymmetric-response", SCENE | {"balance.method": "march"}))
    found: Any = forced.ANALYSIS.solve(plan, Stages(silent))
    return found  # type: ignore[no-any-return]


def test_sweeps_jump_where_the_curve_folds(solution: ForcedSolution, swept: ForcedSolution) -> None:
    up, down = swept.curves
    assert (up.way, down.way) == ("up", "down")
    assert up.answer.status != "stopped" != down.answer.status
    # the peak bends back: falling, the high motion lasts to lower frequencies
    tops = [s.peaks["right"][-1] for s in (up, down)]
    assert tops[1].height > 1.1 * tops[0].height
    assert tops[1].frequency < tops[0].frequency - 1.0
    size = np.abs(down.accelerance["right"])
    fold = down.frequency[np.flatnonzero(size[1:] < 0.5 * size[:-1])]
    assert (np.abs(fold - tops[1].frequency) < 1.1).any()
    # the balance tells where, and a sweep of 1 Hz steps stops short of it
    (curve,) = solution.curves
    size = np.abs(curve.accelerance["right"])
    ends = [end.frequency for end, _ in folds_of(-curve.frequency[::-1], size[::-1])]
    assert min(abs(-f - fold[0]) for f in ends) < 1.1


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
    at = state_of(springs, model, a, i, curve.force)
    march = InterfaceMarch(springs.march, f, [curve.force], 128, by_coulomb)
    mine = settle(march, at, 1e-3, 700)
    assert abs(mine.harmonics[0, RIGHT]) == pytest.approx(
        other.amplitude(model.row("right")), rel=2e-3
    )
    assert mine.last.counts[1] < 1.0


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
    mine = settle(InterfaceMarch(springs.march, f, [force], 256), at, 1e-4, 1000)
    assert mine.settled
    assert (mine.last.counts > 0.05).all()
    full = explicit.explicit_march(model, 0.005)
    found, _, change = full.steady(f, force, full.at(springs, at, force), most=64)
    assert change < 1e-3
    assert abs(mine.harmonics[0, RIGHT]) == pytest.approx(abs(found[RIGHT]), rel=2e-3)


def test_a_sweep_without_slip_is_the_linear_answer(solution: ForcedSolution) -> None:
    springs = make_springs(solution.plan, solution.models["thesis"])
    f = np.linspace(415.0, 425.0, 4)
    flat = stepped_sine(springs.march, f, [1e-3], springs.at_rest(), tolerance=1e-4)
    assert flat.status == "settled"
    wanted = springs.march.linear_response(flat.frequency, [1e-3], stuck=True)
    assert np.abs(flat.amplitude[:, :2]) == pytest.approx(np.abs(wanted[:, :2]), rel=2e-3)
    # what a period is marched again from
    assert flat.harmonics.shape == (4, 1, flat.amplitude.shape[1])
    assert flat.harmonics[:, 0] == pytest.approx(flat.amplitude)
    again = flat.points[2].start.copy()
    out = InterfaceMarch(flat.model, f[2], flat.drive, flat.samples).period(again).output
    n = flat.samples
    z = 2.0 / n * np.exp(-2j * np.pi * np.arange(1, n + 1) / n) @ out
    assert z[:2] == pytest.approx(flat.amplitude[2, :2], rel=1e-3)


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
        balance = replace(scene.balance, samples=given)
        excitation = replace(scene.excitation, points=10, stop=416.0)
        plan = replace(solution.plan, scene=replace(scene, balance=balance, excitation=excitation))
        springs = make_springs(plan, solution.models["thesis"])
        # a step in a period of the fastest mode that swings
        assert springs.march.frequency.max() < steps * scene.excitation.start
        counted.clear()
        up, _ = both_ways(plan, "thesis", curve.ratio, springs.march, springs.at_rest())
        assert set(counted) == {steps}
        assert up.answer.settled.all()


def test_maxima_of_a_sweep_are_its_own_points() -> None:
    """Beside a jump from 3 to 10 the motion at the jump's far end is one, without a parabola."""
    f = np.arange(8.0)
    size = np.array([1.0, 2.0, 3.0, 10.0, 8.0, 7.0, 9.0, 4.0])
    for way in (1, -1):
        found = path_maxima(f[::way], size[::way], between=False)
        told = [(one.frequency, one.height) for one in found]
        assert told == [(3.0, 10.0), (6.0, 9.0)][::way]
        assert [f[::way][one.sample] for one in found] == [one.frequency for one in found]
    # small ones beside the highest are none
    lone = np.array([1e-9, 2e-9, 1e-9, 3.0, 9.0, 7.0, 5.0, 4.0])
    assert len(path_maxima(f, lone, between=False)) == 1
    assert path_maxima(f[:2], size[:2], between=False) == []
