"""Time integration from a peak's own motion: what stays is confirmed, what leaves is no peak."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rigs import LINES

from upd.analyses import forced, make_plan
from upd.analyses.forced import peaks
from upd.analyses.forced.curves import ForcedCurve, TimeCheck, Top, rising
from upd.analyses.forced.interface_model import make_springs
from upd.analyses.forced.solve import ForcedSolution
from upd.analyses.measured import CurvePeak
from upd.errors import ConvergenceError
from upd.hbm.faces.march import InterfaceMarch
from upd.hbm.springs.time_integration import steady_state
from upd.progress import Stages, silent
from upd.scene import load_scene
from upd.scene.forced_contact import SIDES

#: the wedge around its out-of-phase peak: some points slip, and the path folds
RIG: dict[str, Any] = LINES | {
    "mesh.element": "hex8i",
    "contact.rows": [1, 2],
    "contact.columns": 2,
    "contact.directions": "one",
    "reduction.modes": 4,
    "balance.harmonics": 3,
    "excitation.start": "430 Hz",
    "excitation.stop": "460 Hz",
    "excitation.points": 40,
    "excitation.centrifugal_to_force": [200.0],
    "want": ["response"],
    "left_out.solve": "no",
}
AT = "right", 2


def solved(**more: Any) -> ForcedSolution:
    changes = {key.replace("__", "."): value for key, value in more.items()}
    found: Any = forced.ANALYSIS.solve(
        make_plan(load_scene("symmetric-response", RIG | changes)), Stages(silent)
    )
    return found  # type: ignore[no-any-return]


@pytest.fixture(scope="module")
def slipping() -> ForcedSolution:
    return solved()


def stays(
    solution: ForcedSolution, x: np.ndarray, f: float, steps: int = peaks.STEPS
) -> np.ndarray | None:
    model, curve = solution.models["thesis"], solution.curves[0]
    springs = make_springs(solution.plan, model)
    found = peaks.stays(springs, model, curve, steps, x, f)
    return None if found is None else found[0]


def test_the_motion_of_a_slipping_peak_stays(slipping: ForcedSolution) -> None:
    """Where another integration, with all modes and the law of the balance, ends too."""
    (curve,) = slipping.curves
    top = curve.tops[AT]
    assert top.slips
    found = stays(slipping, top.x, top.frequency)
    assert found is not None
    balance, integrated = found[:, SIDES.index("right")]
    assert balance == pytest.approx(top.height, rel=1e-9)
    assert integrated == pytest.approx(top.height, rel=peaks.STAYS)
    b = curve.answer.balance
    other = steady_state(b, top.frequency, top.x, steps=512, tolerance=1e-5)
    row = slipping.models["thesis"].row("right")
    height = 1e-3 * (2.0 * np.pi * top.frequency) ** 2 * other.amplitude(row) / curve.force
    # what 256 steps damp, and modes that follow statically
    assert integrated == pytest.approx(height, rel=1e-2)


def test_the_motion_of_a_stuck_peak_stays() -> None:
    solution = solved(excitation__centrifugal_to_force=[1e5])
    (curve,) = solution.curves
    top = curve.tops[AT]
    assert not top.slips
    assert not curve.checked, "the linear answer needs no confirmation"
    i = curve.peaks["right"][0].sample
    found = stays(solution, curve.answer.x[i], float(curve.frequency[i]))
    assert found is not None
    assert found[1] == pytest.approx(found[0], rel=5e-3)


@pytest.mark.parametrize("factor", [1.5, 0.5])
def test_a_motion_that_is_none_leaves(slipping: ForcedSolution, factor: float) -> None:
    top = slipping.curves[0].tops[AT]
    assert stays(slipping, factor * top.x, top.frequency) is None


def test_unstable_motions_between_folds_leave(slipping: ForcedSolution) -> None:
    (curve,) = slipping.curves
    size = np.abs(curve.accelerance["right"])
    inside = np.flatnonzero(~rising(curve.frequency) & (size > 0.5 * size.max()))
    inside = inside[1:-1][:: max(1, len(inside) // 6)]
    assert len(inside) >= 3
    left = [stays(slipping, curve.answer.x[i], float(curve.frequency[i])) is None for i in inside]
    assert np.mean(left) > 0.5


def test_the_run_confirms_its_peaks(slipping: ForcedSolution) -> None:
    (curve,) = slipping.curves
    assert {(one.blade, one.number) for one in curve.checked} == set(curve.tops)
    for one in curve.checked:
        assert one.stays
        (told,) = (p for p in curve.peaks[one.blade] if p.number == one.number)
        assert told.height == pytest.approx(one.balance if one.at_top else one.integrated)


def test_a_spoiled_top_is_replaced_by_a_motion_down_the_path(slipping: ForcedSolution) -> None:
    """The highest that stays, and the next towards the top, which leaves."""
    plan, model, (curve,) = slipping.plan, slipping.models["thesis"], slipping.curves
    spoiled = {key: top._replace(x=1.5 * top.x) for key, top in curve.tops.items()}
    size = np.abs(curve.accelerance["right"])
    top = curve.tops[AT]
    first = peaks.numbered_peaks(model, curve.answer, size, plan.scene.excitation.stop)
    own = next(one for one in first if one.number == 2)
    bare = replace(
        curve,
        tops={AT: spoiled[AT]},
        checked=(),
        peaks={
            "left": (),
            "right": (own._replace(frequency=top.frequency, height=top.height),),
        },
    )
    found = peaks.confirmed(plan, model, bare)
    (check,) = found.checked
    assert check.stays and not check.at_top
    (told,) = found.peaks["right"]
    assert (told.height, told.frequency) == (check.integrated, check.frequency)
    assert told.sample == check.sample
    assert curve.frequency[check.sample] == check.frequency
    assert peaks.LEAST * size.max() * (1.0 - peaks.STAYS) <= told.height <= 1.05 * top.height
    assert check.balance == pytest.approx(size[check.sample], rel=1e-9)
    assert stays(slipping, curve.answer.x[check.sample], check.frequency) is not None


# -- bisection, by hand ----------------------------------------------------------------------------


def confirm(
    good: Callable[[int], bool],
    size: np.ndarray,
    followed: Callable[[int], bool] | None = None,
) -> tuple[TimeCheck, list[int]]:
    """The check of a peak at the middle of a path whose motions stay or leave by their place, and
    those that time integration reaches from the one before.
    """
    f, tried = 100.0 + np.arange(len(size)) / 10.0, list[int]()
    answer: Any = SimpleNamespace(
        frequency=f, x=np.arange(len(size), dtype=float)[:, None], balance=None
    )
    curve = ForcedCurve(
        "own", 1.0, 1.0, dict.fromkeys(SIDES, size.astype(complex)), {}, {}, answer, 0.0
    )
    top = int(size.argmax())

    def motion(x: np.ndarray, _: float, before: Any = None) -> Any:
        (i,) = x
        tried.append(int(i))
        height = float(size[min(int(i), len(size) - 1)]) if i >= 0 else float(size[top])
        stay = (followed or good) if before is not None else good
        heights = np.array([[height, height], [height, 0.99 * height]])
        return (heights, None) if stay(int(i)) else None

    peak = CurvePeak(float(f[top]), float(size[top]), top, 1)
    very_top = Top(float(f[top]), float(size[top]), np.array([-1.0]), True)
    motions: dict[int, Any] = {}
    found = peaks.confirmed_top(motion, curve, "right", peak, very_top, motions)
    count = len(tried)
    if not found.at_top:
        left = peaks.confirmed_top(motion, curve, "left", peak, very_top, motions)
        assert (left.sample, left.integrated) == (found.sample, found.balance) or not left.stays
        assert len(tried) == count + 1, "no more than the other blade's own top"
    return found, tried[:count]


#: a peak of 2 with slopes of 0.02 a point
SLOPES = 2.0 - 0.02 * np.abs(np.arange(81) - 40.0)


def test_a_top_that_stays_is_the_peak() -> None:
    found, tried = confirm(lambda i: True, SLOPES)
    assert found.at_top and found.stays
    assert tried == [-1]
    assert (found.balance, found.integrated) == (2.0, pytest.approx(1.98))
    assert found.difference == pytest.approx(0.01)
    assert (found.step, found.apart) == (0.0, 0.0)


@pytest.mark.parametrize("last", [41, 45, 50, 54])
def test_bisection_ends_at_the_last_motion_that_leaves(last: int) -> None:
    """Up to it all leave on the right, and everything on the left."""
    found, tried = confirm(lambda i: i > last, SLOPES)
    assert found.stays and not found.at_top
    assert found.sample == last + 1
    assert found.balance == SLOPES[last + 1]
    assert found.step == pytest.approx(SLOPES[last] / SLOPES[last + 1] - 1.0)
    assert found.apart == pytest.approx(0.1 / (100.0 + (last + 1) / 10.0))
    assert len(tried) <= 10


def test_from_the_border_time_integration_follows_its_own_motion_up() -> None:
    """Further than harmonic balance tells, as long as the motion grows."""
    found, _ = confirm(lambda i: i > 50, SLOPES, followed=lambda i: i > 44)
    assert (found.sample, found.balance) == (45, SLOPES[45])
    assert found.step == pytest.approx(SLOPES[44] / SLOPES[45] - 1.0)
    found, _ = confirm(lambda i: i > 50, SLOPES, followed=lambda i: True)
    assert (found.sample, found.step, found.apart) == (40, 0.0, 0.0)
    dip = SLOPES - 0.1 * (np.arange(81) == 46)
    found, _ = confirm(lambda i: i > 50, dip, followed=lambda i: True)
    assert found.sample == 47


def test_a_motion_is_followed_to_where_it_stays_too(slipping: ForcedSolution) -> None:
    """From the next place of the path, at a height of its own."""
    (curve,), model = slipping.curves, slipping.models["thesis"]
    springs, size = make_springs(slipping.plan, model), np.abs(curve.accelerance["right"])
    # before the first fold
    i = int(np.flatnonzero(size > 0.6 * size.max())[8])
    x, f = curve.answer.x, curve.frequency
    given = springs, model, curve, peaks.STEPS
    first = peaks.stays(*given, x[i], float(f[i]))
    assert first is not None
    # whatever the path has there
    again = peaks.stays(*given, 3.0 * x[i + 1], float(f[i + 1]), first)
    own = peaks.stays(*given, x[i + 1], float(f[i + 1]))
    assert again is not None and own is not None
    assert again[0][1] == pytest.approx(own[0][1], rel=5e-3)
    far = first[0] * [[1.0], [1.3]], first[1]
    assert peaks.stays(*given, x[i + 1], float(f[i + 1]), far) is None, "a jump is no growth"


def test_the_higher_of_both_flanks_is_taken() -> None:
    found, _ = confirm(lambda i: i > 52 or 0 <= i < 35, SLOPES)
    assert found.sample == 34
    found, _ = confirm(lambda i: i > 42 or 0 <= i < 30, SLOPES)
    assert found.sample == 43


def test_a_peak_that_nothing_confirms_is_told() -> None:
    found, tried = confirm(lambda i: False, SLOPES)
    assert not found.stays
    assert found.difference == float("inf")
    # the top, and the end of either flank at half the power
    assert tried[0] == -1
    assert sorted(tried[1:]) == [10, 70]
    assert SLOPES[[10, 11, 69, 70]] == pytest.approx([1.4, 1.42, 1.42, 1.4])


def test_an_integration_that_finds_no_step_confirms_nothing(
    slipping: ForcedSolution, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*args: Any, **named: Any) -> Any:
        raise ConvergenceError("no answer")

    monkeypatch.setattr(peaks, "settle", fails)
    top = slipping.curves[0].tops[AT]
    assert stays(slipping, top.x, top.frequency) is None


def test_time_steps_of_a_scene_are_those_of_the_confirmation(
    slipping: ForcedSolution, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As many as the balance takes, and never few."""
    counted: list[int] = []
    made = InterfaceMarch.__init__

    def counting(self: Any, model: Any, f: float, drive: Any, samples: int, *more: Any) -> None:
        counted.append(samples)
        made(self, model, f, drive, samples, *more)

    monkeypatch.setattr(InterfaceMarch, "__init__", counting)
    plan, model, (curve,) = slipping.plan, slipping.models["thesis"], slipping.curves
    alone = replace(curve, tops={AT: curve.tops[AT]})
    for given, steps in (("auto", peaks.STEPS), (1024, 1024), (64, peaks.STEPS)):
        balance = replace(plan.scene.balance, samples=given)
        peaks.confirmed(replace(plan, scene=replace(plan.scene, balance=balance)), model, alone)
        assert set(counted) == {steps}
        counted.clear()
