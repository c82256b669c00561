"""The F_C whose worst peak is lowest: the Jenkins oscillator in closed form.

One dof with a spring k_t and a slider of limit mu N, one harmonic, no damping: the peak is
A = (mu N/k_t) / (1 - pi F/(4 mu N)), least where mu N = pi F/2, A = pi F/k_t.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from upd.cache.arrays import Journal
from upd.hbm import FrequencyResponse, contacts, frequency_response
from upd.hbm.peaks.over import AGREES, JUMP_STEP, Deciding, PeakPoint, PeaksOver, peak_point
from upd.reference.friction import jenkins_peak
from upd.sizing import LowestWorst, WorstPeak, lowest_worst, worst_peak
from upd.sizing.choice import STILL_AT, how_far, how_far_force

#: limit of the slider per unit of "F_C", spring, and F_C/F_E between which peaks are asked for
MU, K_T = 0.5, 1.3
LOW, HIGH = 2.0, 9.0


def closed(ratio: float) -> float:
    """Peak per unit of F_E."""
    return float(jenkins_peak(MU * ratio, 1.0, K_T))


@pytest.fixture(scope="module")
def peaks() -> PeaksOver:
    slider = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=K_T, mu=MU, preload=1.0)
    # peaks are between the frequencies of the free and of the stuck mass
    f = np.linspace(0.98, 1.02 * math.sqrt(1.0 + K_T), 60) / (2.0 * math.pi)

    def curve(force: float) -> FrequencyResponse:
        return frequency_response(
            [[1.0]],
            [[0.0]],
            [[1.0]],
            slider,
            harmonic_force=[force],
            frequencies=f,
            harmonics=(1,),
            samples=2048,
        )

    def curve_at(s: float) -> dict[str, PeakPoint]:
        ratio = math.exp(s)
        answer = curve(1.0 / ratio)
        height = ratio * np.abs(answer.amplitude([1.0]))
        k = int(height.argmax())
        seen = k, float(answer.frequency[k]), float(height[k])
        return {"peak": peak_point(answer, [1.0], seen, unit=ratio, power=0.0)}

    return PeaksOver(curve_at, math.log(LOW), math.log(HIGH))


def test_heights_and_slopes(peaks: PeaksOver) -> None:
    """Every solved point and its derivative by ln(F_C/F_E), of the closed form."""
    points = peaks.points
    assert len(points) >= 4
    for s, told in points.items():
        point = told["peak"]
        r, h = math.exp(s), 1e-5
        slope = math.log(closed(r * math.exp(h)) / closed(r * math.exp(-h))) / (2 * h)
        assert math.exp(point.log_height) == pytest.approx(closed(r), rel=1e-4)
        assert point.slope == pytest.approx(slope, abs=2e-3)


def test_the_best_damper_of_one_force(peaks: PeaksOver) -> None:
    """mu N = pi F/2 and A = pi F/k_t, to 1e-3."""
    found = lowest_worst(WorstPeak([peaks], (0.7, 0.7)), 1.6, 6.0)
    assert found.status == "found"
    assert not found.at_jump
    assert MU * math.exp(found.log_centrifugal) == pytest.approx(math.pi * 0.7 / 2.0, rel=1e-3)
    amplitude = 0.7 * math.exp(found.log_worst)
    assert amplitude == pytest.approx(math.pi * 0.7 / K_T, rel=1e-3)


def test_the_best_damper_over_a_range_of_forces(peaks: PeaksOver) -> None:
    """The F_C at which the peaks of the least and of the largest force are alike; how the shares of
    both make its slope none.
    """
    forces = (0.6, 1.1)
    exact = minimize_scalar(
        lambda F_C: max(closed(F_C / F) for F in forces), bounds=(2.2, 5.0), method="bounded"
    )
    worst = WorstPeak([peaks], forces)
    found = lowest_worst(worst, 2.2, 5.0)
    assert math.exp(found.log_centrifugal) == pytest.approx(exact.x, rel=1e-3)
    assert math.exp(found.log_worst) == pytest.approx(exact.fun, rel=1e-3)
    told = sorted(math.exp(found.log_centrifugal - p.s) for p in found.deciding)
    assert told == pytest.approx(forces, rel=1e-5)
    assert sum(p.share for p in found.deciding) == pytest.approx(1.0)
    assert sum(p.share * p.slope for p in found.deciding) == pytest.approx(0.0, abs=1e-9)
    for bound in (2.2, 5.0):
        reach = how_far(worst, found, 1.05, bound)
        assert reach.why == ""
        top = max(closed(reach.end / F) for F in forces)
        assert top == pytest.approx(1.05 * exact.fun, rel=3e-3)
    for way, bound in ((-1.0, 0.3), (1.0, 1.8)):
        end = how_far_force(worst, found, 1.05, way, bound).end
        assert closed(math.exp(found.log_centrifugal) / end) == pytest.approx(
            1.05 * exact.fun, rel=3e-3
        )


class _Jumps:
    """Curves with a falling peak, ln h = 1 - 2 s, and a rising one, ln h = s - 2, that drops by 0.6
    where s reaches 2.5 and rises half as fast from there.
    """

    def __init__(self, known_slopes: bool) -> None:
        self.known_slopes = known_slopes

    @staticmethod
    def heights(s: np.ndarray) -> np.ndarray:
        return np.where(s < 2.5, s - 2.0, 0.5 * s - 1.35)

    def at(self, s: float) -> dict[str, PeakPoint]:
        y = float(self.heights(np.array(s)))
        slope = (1.0 if s < 2.5 else 0.5) if self.known_slopes else math.nan
        none = np.zeros(0)
        return {
            "low": PeakPoint(300.0, 1.0 - 2.0 * s, -2.0, none),
            "high": PeakPoint(440.0, y, slope, none),
        }


@pytest.mark.parametrize("known_slopes", [True, False])
def test_ranges_end_at_a_higher_peak_on_the_way(known_slopes: bool) -> None:
    """F_E over a range of e^2: both peaks meet where 1 - 2 (c - 2) = c - 2, at c = 7/3 with
    ln h = 1/3. The rising peak is 1/2 at most before it drops and is 1/3 again at 3.37 only: the
    worst peak, in whose window the maximum stays, is above 1/3 + ln(1.1) up to there.
    """
    peaks = PeaksOver(_Jumps(known_slopes).at, -2.0, 5.0, step=1.0)
    worst = WorstPeak([peaks], (1.0, math.exp(2.0)))
    best = lowest_worst(worst, math.exp(0.5), math.exp(5.0))
    assert best.log_centrifugal == pytest.approx(7.0 / 3.0, abs=2e-3)
    assert best.log_worst == pytest.approx(1.0 / 3.0, abs=3e-3)
    reach = how_far(worst, best, 1.1, math.exp(5.0))
    assert math.log(reach.end) == pytest.approx(7.0 / 3.0 + math.log(1.1), abs=JUMP_STEP)
    # a growth that the jump hides: the highest before it, 1/2, is told to the step of a jump
    c = math.log(reach.end)
    assert worst.solved_worst(c) == pytest.approx(1.0 / 3.0 + math.log(1.1), abs=JUMP_STEP)
    far = worst.solved_worst(4.0)
    assert far == pytest.approx(max(0.65, 0.5), abs=2e-2)
    # no more whole curves than an even grid as fine as a jump is told has by far
    assert len(peaks.points) < 40


def losing(lost: Callable[[float], bool]) -> Callable[[float], dict[str, PeakPoint] | None]:
    """The same with curves that are not followed through."""
    whole = _Jumps(True).at
    return lambda s: None if lost(s) else whole(s)


@pytest.mark.parametrize(("high", "told"), [(2.405, True), (2.44, False)])
def test_a_curve_that_fails(high: float, told: bool) -> None:
    """One next to it does as well; else what rests on it is withheld."""
    found = losing(lambda s: 2.395 < s < high or (2.36 < s < high and not told))
    worst = WorstPeak([PeaksOver(found, -2.0, 5.0, step=1.0)], (1.0, math.exp(2.0)))
    worst.peaks[0].look(2.4)
    assert worst.peaks[0].missed
    best = lowest_worst(worst, math.exp(0.5), math.exp(5.0))
    reach = how_far(worst, best, 1.1, math.exp(5.0))
    assert math.isfinite(reach.end) == told
    assert ("no whole curve" in reach.why) == (not told)


def test_beside_a_curve_that_fails_the_one_next_to_it_tells() -> None:
    """Also a little beside the place that was asked for first."""
    peaks = PeaksOver(losing(lambda s: 2.495 < s < 2.505), -2.0, 5.0, step=1.0)
    assert peaks.solve(2.5).node == pytest.approx(2.51)
    for s in (2.4997, 2.5003):
        told = peaks.solve(s)
        assert told.node == pytest.approx(2.51)
        assert told.y == pytest.approx(0.5 * s - 1.35)


def test_curves_are_kept_for_a_search_that_is_begun_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also those that were not followed through."""
    monkeypatch.setenv("UPD_CACHE", str(tmp_path))
    found = losing(lambda s: 0.4 < s < 0.6)
    first = PeaksOver(found, 0.0, 2.0, step=1.0, kept=Journal("kept"))
    first.look(0.5)

    def none(_: float) -> None:
        raise AssertionError

    again = PeaksOver(none, 0.0, 2.0, step=1.0, kept=Journal("kept"))
    assert again.resumed == len(first.points) == 3
    assert again.missed == first.missed and len(first.missed) == 3
    for s, peaks in first.points.items():
        for name, p in peaks.items():
            assert again.points[s][name][:3] == p[:3]


@pytest.mark.parametrize("known_slopes", [True, False])
def test_a_search_that_ends_early_tells_no_less_than_its_curves(
    known_slopes: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was solved before others showed a higher peak there is not told."""
    early = 0
    for rounds, step in itertools.product((4, 6), (0.8, 1.0, 1.3, 3.0)):
        monkeypatch.setattr(worst_peak, "ROUNDS", rounds)
        peaks = PeaksOver(_Jumps(known_slopes).at, -2.0, 5.0, step=step)
        best = lowest_worst(WorstPeak([peaks], (1.0, math.exp(2.5))), math.exp(0.5), math.exp(5.0))
        early += best.status == "bracketed"
        c = best.log_centrifugal
        known = [peaks.top(s) for s in peaks.nodes if c - 2.5 <= s <= c]
        assert best.log_worst >= max(known) - 2.0 * AGREES
    assert early


def test_accelerations_count_the_strongest_force(peaks: PeaksOver) -> None:
    """Of amplitudes themselves the largest force has the worst: its own optimum."""
    found = lowest_worst(WorstPeak([peaks], (0.6, 1.1), weight=1.0), 2.2, 5.0)
    assert MU * math.exp(found.log_centrifugal) == pytest.approx(math.pi * 1.1 / 2.0, rel=1e-3)
    assert math.exp(found.log_worst) == pytest.approx(math.pi * 1.1 / K_T, rel=1e-3)


def test_scaled_forces_need_no_new_peaks(peaks: PeaksOver) -> None:
    """All loads scaled by s scale the answer by s: the same points, F_C times s."""
    one = lowest_worst(WorstPeak([peaks], (0.6, 1.1)), 2.2, 5.0)
    solved = len(peaks.points)
    other = lowest_worst(WorstPeak([peaks], (6.0, 11.0)), 22.0, 50.0)
    # but for those between which both searches stop
    assert len(peaks.points) - solved <= 4
    shift = other.log_centrifugal - one.log_centrifugal
    assert shift == pytest.approx(math.log(10.0), abs=1e-3)
    assert other.log_worst == pytest.approx(one.log_worst, abs=1e-3)


def test_an_optimum_at_a_jump() -> None:
    """One peak alone that rises, within its bounds: below it another one decides."""
    by = np.zeros(0)
    alone = Deciding(0.0, 1.0, 0.7, by, 100.0, "peak", 1.0)
    assert LowestWorst(0.0, 1.0, (alone,), "found", (-1.0, 1.0)).at_jump
    assert not LowestWorst(0.0, 1.0, (alone,), "at the lower bound", (0.0, 1.0)).at_jump
    both = (alone._replace(share=0.4), alone._replace(slope=-1.05, share=0.6))
    assert not LowestWorst(0.0, 1.0, both, "found", (-1.0, 1.0)).at_jump


@pytest.mark.parametrize(
    ("low", "high", "status"), [(1.6, 2.0, "at the upper bound"), (3.0, 5.0, "at the lower bound")]
)
def test_an_optimum_at_its_bound(peaks: PeaksOver, low: float, high: float, status: str) -> None:
    found = lowest_worst(WorstPeak([peaks], (0.7, 0.7)), low, high)
    assert found.status == status
    bound = low if status == "at the lower bound" else high
    assert math.exp(found.log_centrifugal) == pytest.approx(bound, rel=1e-3)
    assert math.exp(found.log_worst) == pytest.approx(closed(bound / 0.7), rel=1e-3)
    assert np.sign(found.deciding[0].slope) == (1.0 if bound == low else -1.0)


def test_what_is_told_is_no_lower_than_whole_curves_in_the_window() -> None:
    """Also where the curve solved at the highest place that was read has a lower peak, beyond a
    jump.
    """
    for step in (0.6, 0.8, 1.0, 1.3):
        for c in np.linspace(2.9, 3.1, 41):
            peaks = PeaksOver(_Jumps(True).at, -2.0, 5.0, step=step)
            told = WorstPeak([peaks], (1.0, math.exp(0.7))).solved_worst(c)
            known = [peaks.top(s) for s in peaks.nodes if c - 0.7 <= s <= c]
            assert told >= max(known) - AGREES


def smooth(s: float) -> dict[str, PeakPoint]:
    """Curves with one peak, ln h = sinh s."""
    return {"peak": PeakPoint(300.0, math.sinh(s), math.cosh(s), np.zeros(0))}


def test_a_whole_curve_tells_what_is_beside_it_where_a_neighbour_confirms_its_slope() -> None:
    peaks = PeaksOver(smooth, 0.0, 1.0, step=0.2)
    known = len(peaks.nodes)
    read = peaks.solve(0.41)
    assert len(peaks.nodes) == known
    assert (read.y, read.slope) == pytest.approx((math.sinh(0.41), math.cosh(0.41)), abs=1e-3)
    assert read.node == pytest.approx(0.4)
    # not where a jump may lie between
    assert peaks.solve(0.44).node == pytest.approx(0.44)
    at = read.node
    kinked = peaks.points[at]["peak"]
    peaks.points[at] = {"peak": kinked._replace(slope=kinked.slope - 1.0)}
    peaks.look(0.8 + 1e-3)
    assert peaks.solve(0.39).node == pytest.approx(0.39)


def test_neighbours_of_one_branch_tell_a_place_between_and_others_do_not() -> None:
    known = PeaksOver(smooth, 0.0, 1.0, step=0.2)
    assert not known.look_unless_known(0.5, 1e-3)
    jumps = PeaksOver(_Jumps(True).at, 2.0, 3.0, step=0.25)
    assert jumps.look_unless_known(2.4, 1e-3)


def test_places_of_new_curves() -> None:
    """A third of an interval of three steps, on the side of the higher peak; none beyond what is
    asked for, and none where a window ends next to a curve.
    """
    peaks = PeaksOver(smooth, -0.2, 1.0, step=2.0)
    worst = WorstPeak([peaks], (1.0, math.exp(1.2)))
    assert worst.settle((1.0, 1.0), 0.0)
    assert peaks.nodes == pytest.approx([-0.2, 0.6, 1.0])
    peaks = PeaksOver(smooth, -1.0, 1.0, step=2.0)
    worst = WorstPeak([peaks], (1.0, math.exp(0.3)))
    assert worst.settle((1.0, 1.0), 0.0)
    assert peaks.nodes == pytest.approx([-1.0, 0.7, 1.0])
    peaks = PeaksOver(smooth, -1.0, 1.0, step=2.0)
    peaks.look(0.71)
    assert not WorstPeak([peaks], (1.0, math.exp(0.3))).settle((1.0, 1.0), 0.0)


def test_a_lower_worst_peak_is_not_sought_where_all_that_is_read_is_below_it() -> None:
    peaks = PeaksOver(_Jumps(True).at, 2.0, 3.0, step=1.0)
    worst = WorstPeak([peaks], (1.0, math.exp(0.5)))
    # ln h of both ends: 0 and 0.15
    assert not worst.explore((2.5, 3.0), 0.2)
    assert worst.explore((2.5, 3.0), 0.1)


class _Hump(_Jumps):
    """As the other one, but that the rising peak is lost where s reaches 2.5: from a peak lower by
    0.05 it falls steeply and ever less so, and rises again from 2.5475 on.
    """

    @staticmethod
    def heights(s: np.ndarray) -> np.ndarray:
        x = s - 2.5
        fallen = 0.45 - 3.8 * x + 40.0 * x**2
        after = 0.45 - 0.09025 + 0.5 * (x - 0.0475)
        return np.where(x < 0.0, s - 2.0, np.where(x < 0.0475, fallen, after))

    def at(self, s: float) -> dict[str, PeakPoint]:
        told = super().at(s)
        beside = self.heights(np.array([s, s + 1e-7]))
        slope = float(np.diff(beside)[0]) / 1e-7 if self.known_slopes else math.nan
        told["high"] = told["high"]._replace(slope=slope)
        return told


@pytest.mark.parametrize("known_slopes", [True, False])
@pytest.mark.parametrize("limit", [0.47, 0.485])
@pytest.mark.parametrize("scan", [0.7, 1.0])
def test_a_range_ends_at_a_hump_between_curves(
    known_slopes: bool, limit: float, scan: float
) -> None:
    """The hump is 1/2 at s = 2.5 and passes a limit at limit + 2: curves on both sides of it, whose
    tangents meet below the limit and that miss a parabola by little, hide it.
    """
    for left in np.linspace(2.41, 2.0 + limit - 0.005, 6):
        for right in (2.51, 2.52, 2.54):
            peaks = PeaksOver(_Hump(known_slopes).at, -2.0, 5.0, step=scan)
            worst = WorstPeak([peaks], (1.0, math.exp(2.0)))
            best = lowest_worst(worst, math.exp(0.5), math.exp(5.0))
            for s in (left, right):
                peaks.look(float(s))
            before = len(peaks.points)
            reach = how_far(worst, best, math.exp(limit - best.log_worst), math.exp(5.0))
            assert math.log(reach.end) == pytest.approx(2.0 + limit, abs=STILL_AT)
            assert len(peaks.points) - before <= (8 if known_slopes else 12)


def test_a_hump_below_a_growth_ends_no_range() -> None:
    """One curve tells that the rising peak is lost before it passes a limit above the hump."""
    peaks = PeaksOver(_Hump(True).at, -2.0, 5.0, step=1.0)
    worst = WorstPeak([peaks], (1.0, math.exp(2.0)))
    best = lowest_worst(worst, math.exp(0.5), math.exp(5.0))
    for s in (2.49, 2.54):
        peaks.look(s)
    limit, before = 0.52, len(peaks.points)
    ends = best.log_centrifugal, 2.6
    assert worst.clear(ends, limit)
    assert not worst.clear(ends, limit)
    assert len(peaks.points) == before + 1
    reach = how_far(worst, best, math.exp(limit - best.log_worst), math.exp(5.0))
    assert math.log(reach.end) == pytest.approx(2.5475 + 2.0 * (limit - 0.35975), abs=STILL_AT)
