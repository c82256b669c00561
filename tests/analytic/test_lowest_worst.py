"""The F_C whose worst peak is lowest: the Jenkins oscillator in closed form, and peaks that jump.

One dof with a spring k_t and a slider of limit mu N, one harmonic, no damping: the peak is
A = (mu N/k_t) / (1 - pi F/(4 mu N)), least where mu N = pi F/2, A = pi F/k_t.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from upd.cache.arrays import Journal
from upd.errors import ConvergenceError
from upd.hbm import System, contacts, frequency_response
from upd.reference.friction import jenkins_peak
from upd.sizing import WorstPeak, lowest_worst
from upd.sizing.worst_peak import BRANCH_STEP, CLOSE, Peaks, PeaksOver, reached

#: limit of the slider per unit of "F_C", spring, and F_C/F_E between which peaks are asked for
MU, K_T = 0.5, 1.3
LOW, HIGH = 2.0, 9.0


def closed(ratio: float) -> float:
    """Peak per unit of F_E."""
    return float(jenkins_peak(MU * ratio, 1.0, K_T))


def solved_curve(s: float) -> Peaks:
    ratio = math.exp(s)
    answer = frequency_response(
        System(
            ([[1.0]], [[0.0]], [[1.0]]),
            contacts([[0.0]], [[1.0]], k_n=0.0, k_t=K_T, mu=MU, preload=1.0),
            harmonics=(1,),
            samples=512,
        ),
        harmonic_force=[1.0 / ratio],
        frequencies=np.linspace(0.98, 1.02 * math.sqrt(1.0 + K_T), 2000) / (2.0 * math.pi),
    )
    height = ratio * np.abs(answer.amplitude([1.0]))
    k = int(height.argmax())
    return {"peak": (float(answer.frequency[k]), math.log(height[k]))}


@pytest.fixture(scope="module")
def solved() -> PeaksOver:
    return PeaksOver(solved_curve, math.log(LOW), math.log(HIGH))


def jenkins() -> PeaksOver:
    """Of the closed form: no curve need be solved."""
    return PeaksOver(lambda s: {"peak": (0.2, math.log(closed(math.exp(s))))}, *np.log([LOW, HIGH]))


def test_the_best_damper_of_one_force(solved: PeaksOver) -> None:
    """mu N = pi F/2 and A = pi F/k_t of whole curves."""
    found = lowest_worst(WorstPeak([solved], (0.7, 0.7)), 1.6, 6.0)
    assert found.status == "found"
    assert 0.7 * math.exp(found.log_worst) == pytest.approx(math.pi * 0.7 / K_T, rel=1e-3)
    # heights are flat there: F_C is known to the root of their accuracy
    assert MU * math.exp(found.log_centrifugal) == pytest.approx(math.pi * 0.7 / 2.0, rel=2e-2)


def test_the_best_damper_over_a_range_of_forces() -> None:
    """The F_C at which the peaks of the least and of the largest force are alike."""
    forces, peaks = (0.6, 1.1), jenkins()
    exact = minimize_scalar(
        lambda F_C: max(closed(F_C / F) for F in forces), bounds=(2.2, 5.0), method="bounded"
    )
    worst = WorstPeak([peaks], forces)
    found = lowest_worst(worst, 2.2, 5.0)
    assert math.exp(found.log_centrifugal) == pytest.approx(exact.x, rel=2e-3)
    assert math.exp(found.log_worst) == pytest.approx(exact.fun, rel=2e-3)
    told = sorted(math.exp(found.log_centrifugal - s) for s, *_ in found.deciding)
    assert told == pytest.approx(forces, rel=1e-5)
    c, limit = found.log_centrifugal, found.log_worst + math.log(1.05)
    for bound in (2.2, 5.0):
        end = math.exp(reached(lambda at: (worst, at), c, math.log(bound), limit))
        assert max(closed(end / F) for F in forces) == pytest.approx(1.05 * exact.fun, rel=2e-3)
    low, high = worst.f
    more = reached(lambda at: (worst.with_forces(low, at), c), high, high + 1.0, limit)
    less = reached(lambda at: (worst.with_forces(at, high), c), low, low - 1.0, limit)
    for end in (less, more):
        assert closed(math.exp(c - end)) == pytest.approx(1.05 * exact.fun, rel=2e-3)


def test_the_worst_over_f_c_at_once_is_that_at_each() -> None:
    worst = WorstPeak([jenkins()], (0.6, 1.1), weight=1.0)
    c, y = worst.over(math.log(2.2), math.log(5.0))
    assert y[::40] == pytest.approx([worst.read(float(one)) for one in c[::40]], abs=1e-5)


def test_the_most_acceleration_is_that_of_the_largest_force() -> None:
    """Its peak alone is the worst: its own optimum."""
    found = lowest_worst(WorstPeak([jenkins()], (0.6, 1.1), weight=1.0), 2.2, 5.0)
    assert math.exp(found.log_worst) == pytest.approx(math.pi * 1.1 / K_T, rel=1e-3)
    assert MU * math.exp(found.log_centrifugal) == pytest.approx(math.pi * 1.1 / 2.0, rel=2e-2)


@pytest.mark.parametrize(
    ("low", "high", "status"), [(1.6, 2.0, "at the upper bound"), (3.0, 5.0, "at the lower bound")]
)
def test_an_optimum_at_its_bound(low: float, high: float, status: str) -> None:
    found = lowest_worst(WorstPeak([jenkins()], (0.7, 0.7)), low, high)
    assert found.status == status
    bound = low if status == "at the lower bound" else high
    assert math.exp(found.log_centrifugal) == pytest.approx(bound, rel=1e-9)
    assert math.exp(found.log_worst) == pytest.approx(closed(bound / 0.7), rel=1e-3)


def test_a_fixed_f_c_is_judged_where_it_is() -> None:
    found = lowest_worst(WorstPeak([jenkins()], (0.6, 1.1)), 3.0, 3.0)
    assert found.status == "found"
    top = max(closed(3.0 / F) for F in (0.6, 1.1))
    assert math.exp(found.log_worst) == pytest.approx(top, rel=1e-3)


def test_scaled_forces_need_no_new_peaks() -> None:
    """All loads scaled by s scale the answer by s: the same curves, F_C times s."""
    peaks = jenkins()
    one = lowest_worst(WorstPeak([peaks], (0.6, 1.1)), 2.2, 5.0)
    count = len(peaks.points)
    other = lowest_worst(WorstPeak([peaks], (6.0, 11.0)), 22.0, 50.0)
    assert len(peaks.points) == count
    assert other.log_centrifugal - one.log_centrifugal == pytest.approx(math.log(10.0), abs=1e-9)
    assert other.log_worst == pytest.approx(one.log_worst, abs=1e-9)


# -- jumps -----------------------------------------------------------------------------------------


def jumps(s: float) -> Peaks:
    """A falling peak, ln h = 1 - 2 s, and a rising one, ln h = s - 2, that drops by 0.6 where s
    reaches 2.5 and rises half as fast from there.
    """
    high = s - 2.0 if s < 2.5 else 0.5 * s - 1.35
    return {"low": (300.0, 1.0 - 2.0 * s), "high": (440.0, high)}


@pytest.mark.parametrize("step", [0.7, 1.0, 1.3])
def test_an_optimum_before_a_jump(step: float) -> None:
    """F_E over a range of e^2: both peaks meet where 1 - 2 (c - 2) = c - 2, at c = 7/3 with
    ln h = 1/3; the rising peak is 1/2 at most before it drops.
    """
    peaks = PeaksOver(jumps, -2.0, 5.0, step=step)
    worst = WorstPeak([peaks], (1.0, math.exp(2.0)))
    best = lowest_worst(worst, math.exp(0.5), math.exp(5.0))
    assert best.log_centrifugal == pytest.approx(7.0 / 3.0, abs=BRANCH_STEP)
    assert best.log_worst == pytest.approx(1.0 / 3.0, abs=BRANCH_STEP)
    assert worst.solved(4.0) == pytest.approx(0.65, abs=BRANCH_STEP)
    assert len(peaks.points) < 60


def losing(lost: Callable[[float], bool]) -> Callable[[float], Peaks | None]:
    """The same with curves that are not followed through."""
    return lambda s: None if lost(s) else jumps(s)


def test_beside_a_curve_that_fails_nothing_is_known() -> None:
    """The optimum at c = 7/3 has the ends s = 1/3 and 7/3; nothing is told from there on."""
    peaks = PeaksOver(losing(lambda s: 2.36 < s < 2.44), -2.0, 5.0, step=1.0)
    worst = WorstPeak([peaks], (1.0, math.exp(2.0)))
    peaks.look(2.4)
    best = lowest_worst(worst, math.exp(0.5), math.exp(5.0))
    assert best.status == "beside what is not known"
    assert math.isnan(worst.read(2.4)) and worst.missed == "11.02"
    limit = best.log_worst + math.log(1.1)
    assert math.isnan(reached(lambda c: (worst, c), best.log_centrifugal, 5.0, limit))


def test_where_no_curve_is_followed_through_nothing_is_chosen() -> None:
    worst = WorstPeak([PeaksOver(lambda s: None, 0.0, 1.0)], (1.0, 1.0))
    with pytest.raises(ConvergenceError, match=r"F_C/F_E 1, 1\.649, 2\.718; to fix it: larger F_C"):
        lowest_worst(worst, 1.0, 2.0)


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
    assert again.resumed == len(first.points) == 4
    for s, peaks in first.points.items():
        assert (again.points[s] or {}).keys() == (peaks or {}).keys()
    places = np.linspace(0.6, 2.0, 9)
    np.testing.assert_array_equal(again.read(places), first.read(places))


def test_a_curve_so_near_that_it_is_one_is_not_solved() -> None:
    peaks = jenkins()
    s = max(peaks.points)
    assert not peaks.look(s - 0.9 * CLOSE)
    assert peaks.look(s - 1.1 * CLOSE)
