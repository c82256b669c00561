"""Peaks over F_C/F_E from whole curves: against linear limits and the run's own curves, and by
hand.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from rigs import LINES

from upd.analyses import forced, make_plan
from upd.analyses.forced import performance
from upd.analyses.forced.performance import (
    Performance,
    RatioPoint,
    of_curve,
    peaks_at,
    performance_of,
)
from upd.analyses.forced.solve import ForcedSolution
from upd.analyses.measured import CurvePeak
from upd.progress import Stages, silent
from upd.scene import load_scene

RIG: dict[str, Any] = LINES | {
    "mesh.element": "hex8i",
    "contact.rows": [1, 2],
    "contact.columns": 2,
    "contact.directions": "one",
    "reduction.modes": 4,
    "balance.harmonics": 3,
    "excitation.start": "400 Hz",
    "excitation.stop": "460 Hz",
    "excitation.points": 40,
    "want": ["response"],
    "left_out.solve": "no",
}


@cache
def solved(ratio: float) -> ForcedSolution:
    scene = RIG | {"excitation.centrifugal_to_force": [ratio]}
    found: Any = forced.ANALYSIS.solve(
        make_plan(load_scene("symmetric-response", scene)), Stages(silent)
    )
    return found  # type: ignore[no-any-return]


def at(ratio: float) -> RatioPoint:
    s = solved(1e5)
    return peaks_at(s.plan, s.models["thesis"], ratio)


def test_where_all_sticks_the_peaks_are_the_stuck_ones() -> None:
    solution, found = solved(1e5), at(1e6)
    assert found.arrived
    for side in ("left", "right"):
        wanted = {p.number: p for p in solution.linear["thesis"].stuck_peaks[side]}  # type: ignore[index]
        mine = {p.number: p for p in found.peaks if p.blade == side}
        assert set(mine) == set(wanted) == {2}
        for number, one in mine.items():
            assert one.frequency == pytest.approx(wanted[number].frequency, rel=2e-4)
            assert one.height == pytest.approx(wanted[number].height, rel=5e-3)
    worst = max(
        p.height for side in ("left", "right") for p in solution.linear["thesis"].stuck_peaks[side]
    )  # type: ignore[arg-type]
    assert found.worst.height == pytest.approx(worst, rel=5e-3)


def test_with_slip_the_peaks_are_those_of_a_run() -> None:
    """The run climbs to the tops between the points of its path."""
    (curve,), found = solved(250.0).curves, at(250.0)
    assert found.arrived
    for side in ("left", "right"):
        (top,) = (curve.tops[key] for key in curve.tops if key == (side, 2))
        (one,) = (p for p in found.peaks if (p.blade, p.number) == (side, 2))
        assert top.slips
        assert one.height == pytest.approx(top.height, rel=2e-2)
    told = of_curve(curve)
    assert {(p.blade, p.number) for p in told.peaks} == {(p.blade, p.number) for p in found.peaks}
    assert told.arrived and told.ratio == 250.0


def test_a_curve_that_ends_early_is_taken_from_its_other_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Together they are whole where they meet; what neither reaches is told."""
    made = performance.response_of
    asked: list[bool] = []

    def cut(share: float) -> Any:
        def response_of(b: Any, f: Any, sweep_down: bool, *more: Any) -> Any:
            asked.append(sweep_down)
            answer = made(b, f, sweep_down, *more)
            names = ("frequency", "x", "contact_displacement", "contact_force", "state")
            names += ("energy", "linear", "truncation", "aliasing", "periodic")
            n = int(share * len(answer.frequency))
            return replace(
                answer, status="stopped", **{name: getattr(answer, name)[:n] for name in names}
            )

        return response_of

    whole = at(1e6)
    for share, arrived in ((0.7, True), (0.3, False)):
        asked.clear()
        monkeypatch.setattr(performance, "response_of", cut(share))
        found = at(1e6)
        assert asked == [False, True]
        assert found.arrived == arrived
    monkeypatch.setattr(performance, "response_of", cut(0.7))
    both = at(1e6)
    assert {(p.blade, p.number) for p in both.peaks} == {(p.blade, p.number) for p in whole.peaks}


# -- by hand ---------------------------------------------------------------------------------------


def peak(height: float, blade: Any = "right", number: int = 1) -> CurvePeak:
    return CurvePeak(400.0 + number, height, 0, number, f"mode {number}", blade=blade)


def point(ratio: float, *heights: float, arrived: bool = True) -> RatioPoint:
    peaks = tuple(peak(h, number=k) for k, h in enumerate(heights, 1))
    return RatioPoint(ratio, peaks, arrived)


V_SHAPE = tuple(point(r, h) for r, h in ((1.0, 9.0), (10.0, 4.0), (100.0, 1.0), (1000.0, 8.0)))


def test_the_best_is_where_the_highest_of_all_peaks_is_lowest() -> None:
    two = [point(1.0, 5.0, 2.0), point(2.0, 3.0, 4.0), point(4.0, 1.0, 6.0)]
    found = Performance(tuple(two), 300.0, 190.0)
    assert found.best is two[1] and found.inside
    assert found.best.worst.height == 4.0
    left = point(3.0, 1.0)._replace(peaks=(peak(1.0), peak(7.0, "left")))
    assert left.worst.blade == "left"


def test_a_best_at_an_end_is_not_inside() -> None:
    falls = Performance(tuple(point(r, 10.0 / r) for r in (1.0, 2.0, 4.0)), 300.0, 190.0)
    assert falls.best is falls.points[-1] and not falls.inside


def test_lost_curves_and_curves_without_a_peak_are_left_out() -> None:
    lost = point(30.0, 0.1, arrived=False)
    found = Performance((*V_SHAPE, lost, point(50.0)), 300.0, 190.0)
    assert lost not in found.known and len(found.known) == 4
    assert found.best is V_SHAPE[2]
    assert Performance((lost,), 300.0, 190.0).best is None
    assert Performance((lost,), 300.0, 190.0).factor_two() is None


def test_a_factor_of_two_is_read_on_logarithmic_axes() -> None:
    """From 1 at 100: to 4 at 10 and to 8 at 1000, by straight lines."""
    found = Performance(V_SHAPE, 300.0, 190.0)
    half, twice = found.factor_two() or (math.nan, math.nan)
    assert half == pytest.approx(4.0 ** math.log10(2.0))
    assert twice == pytest.approx(8.0 ** math.log10(2.0))
    alone = Performance((point(100.0, 1.0),), 300.0, 190.0).factor_two()
    assert alone is not None and all(map(math.isnan, alone))


def test_two_more_lie_between_the_best_and_its_neighbours() -> None:
    def beside(*points: RatioPoint) -> list[float]:
        return Performance(points, 300.0, 190.0).beside_best()

    assert beside(*V_SHAPE) == pytest.approx([math.sqrt(1000.0), math.sqrt(1e5)])
    assert beside(*V_SHAPE[:3]) == pytest.approx([math.sqrt(1000.0)])
    assert beside(*V_SHAPE[:2]) == []
    lost = point(30.0, 0.1, arrived=False)
    assert beside(*V_SHAPE[:2], lost, *V_SHAPE[2:]) == beside(*V_SHAPE)


def test_the_curve_has_the_runs_own_points_once() -> None:
    solution = solved(250.0)
    (curve,) = solution.curves
    points = [point(2500.0, 310.0), point(25.0, 300.0), point(250.0 * (1.0 + 1e-9), 1.0)]
    linear = solution.linear["thesis"]
    found = performance_of(linear, points, [curve])
    assert [one.ratio for one in found.points] == pytest.approx([25.0, 250.0, 2500.0])
    assert found.points[1].peaks == of_curve(curve).peaks, "its own point stands"
    early = replace(curve, answer=replace(curve.answer, status="stopped"))
    assert performance_of(linear, points, [early]).points[1] is points[2], "unless it ends early"
    assert len(performance_of(linear, points[:2], [early]).points) == 3
    assert found.stuck == max(p.height for s in linear.stuck_peaks.values() for p in s)
    assert math.isnan(found.free), "no free peak between 400 and 460 Hz"


def test_a_run_finds_the_best_ratio_and_tells_it() -> None:
    scene = RIG | {
        "want": ["response", "performance"],
        "excitation.centrifugal_to_force": [1000.0],
        "performance.lowest": 60,
        "performance.highest": 1000,
        "performance.points": 4,
    }
    plan = make_plan(load_scene("symmetric-response", scene))
    solution: Any = forced.ANALYSIS.solve(plan, Stages(silent))
    found = solution.performances["thesis"]
    # one of the four is the run's own; two beside the best, or one at an end
    assert len(found.points) == 4 + (2 if found.inside else 1)
    assert (np.diff([one.ratio for one in found.points]) > 0.0).all()
    results = {r.name: r for r in forced.ANALYSIS.make_results(solution)}
    assert found.best is not None
    assert results["best_ratio"].value == found.best.ratio
    assert results["best_peak"].value == found.best.worst.height
    assert results["best_peak"].case.blade == found.best.worst.blade
    assert results["best_inside"].value == float(found.inside)
    arrays = forced.ANALYSIS.arrays(solution)["performance thesis"]
    assert arrays["highest_accelerance"][1].tolist() == [one.worst.height for one in found.known]
