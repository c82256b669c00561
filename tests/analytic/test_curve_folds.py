"""Folds of a path: in closed form, on paths by hand, and against time integration."""

from __future__ import annotations

import numpy as np
import pytest

from upd.analyses.forced.curves import rising
from upd.analyses.forced.peaks import folds_of
from upd.hbm import FrequencyResponse, System, contacts, frequency_response
from upd.hbm.springs.time_integration import steady_state


def duffing(beta: float, n: int = 4001) -> tuple[np.ndarray, np.ndarray]:
    """Frequency and height along the path of u'' + 2 z u' + u + beta u^3 = F cos(w t), first
    harmonic.

    (1 + 3/4 beta A^2 - w^2)^2 + (2 z w)^2 = (F / A)^2 solved for w^2, below the top and beyond.
    """
    z, F = 0.02, 0.05
    top = F / (2.0 * z) / np.sqrt(1.0 + 0.75 * beta * (F / (2.0 * z)) ** 2)
    for _ in range(200):
        top = F / (2.0 * z * np.sqrt(1.0 + 0.75 * beta * top**2 - 2.0 * z**2 + z**2))
    A = np.linspace(0.05 * top, top, n)
    k = 1.0 + 0.75 * beta * A**2
    root = np.sqrt(np.maximum((F / A) ** 2 - 4.0 * z**2 * (k - z**2), 0.0))
    low, high = k - 2.0 * z**2 - root, k - 2.0 * z**2 + root
    on = low > 0.0
    # both meet at the top
    w2 = np.concatenate([low[on], high[-2::-1]])
    return np.sqrt(w2), np.concatenate([A[on], A[-2::-1]])


def test_a_linear_peak_has_no_fold() -> None:
    w, A = duffing(0.0)
    assert w[A.argmax()] == pytest.approx(np.sqrt(1.0 - 2.0 * 0.02**2), rel=1e-4)
    assert rising(w).all()
    assert not list(folds_of(w, A))


@pytest.mark.parametrize("beta", [-0.08, 0.08])
def test_folds_of_a_duffing_oscillator(beta: float) -> None:
    """Between them the motion is unstable; a sweep lands on the other branch."""
    w, A = duffing(beta)
    ((one, reached),) = folds_of(w, A)
    # of a sweep down
    ((other, lowest),) = folds_of(-w[::-1], A[::-1])
    other, lowest = (f._replace(frequency=-f.frequency) for f in (other, lowest))
    assert other.frequency < one.frequency
    between = ~rising(w)
    at = [one.sample, len(w) - 1 - other.sample]
    assert between[at[0] + 1 : at[1]].all()
    # the points at which it turns back belong to neither part
    assert between.sum() == at[1] - at[0] + 1

    def others(f: float) -> list[float]:
        """Heights at a frequency, from neighbours on the path."""
        k = np.flatnonzero((np.minimum(w[:-1], w[1:]) <= f) & (f <= np.maximum(w[:-1], w[1:])))
        return [float(A[i] + (f - w[i]) / (w[i + 1] - w[i]) * (A[i + 1] - A[i])) for i in k]

    lands = (max, min) if beta < 0.0 else (min, max)
    assert reached.height == pytest.approx(lands[0](others(one.frequency)), rel=1e-3)
    assert lowest.height == pytest.approx(lands[1](others(other.frequency)), rel=1e-3)
    if beta < 0.0:
        # a sweep up meets the resonance behind its top
        assert reached.frequency == one.frequency
        assert one.height < reached.height < A.max()
        assert other.height > 0.9 * A.max()
    else:
        assert one.height > 0.9 * A.max()


def test_a_sweep_that_lands_below_a_peak_goes_on_to_it() -> None:
    """Up from 4 Hz: it lands at 5.5 and climbs to 8 at 6 Hz; a later rise is another peak's."""
    f = np.array([1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])
    height = np.array([1.0, 1.2, 1.5, 2.0, 3.0, 3.5, 4.5, 5.5, 7.0, 8.0, 2.0, 9.0])
    ((end, top),) = folds_of(f, height)
    assert (end.frequency, end.height, end.sample) == (4.0, 2.0, 3)
    assert (top.frequency, top.height, top.sample) == (6.0, 8.0, 9)
    ((end, top),) = folds_of(-f[::-1], height[::-1])
    assert (end.frequency, end.height) == (-2.0, 3.5)
    # down the lower branch falls: what it lands on is what it reaches
    assert (top.frequency, top.height) == (-2.0, 1.2)


def test_where_no_other_motion_is_known_there_is_no_landing() -> None:
    """A path that ended before it came back."""
    f, height = np.array([1.0, 2.0, 3.0, 2.5, 2.2]), np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    assert not list(folds_of(f, height))
    assert rising(np.array([5.0])).tolist() == [True]
    assert rising(np.zeros(0)).tolist() == []


@pytest.fixture(scope="module")
def softening() -> FrequencyResponse:
    """m = k = 1 on a contact that opens, k_n = 1 under 0.5 N, and a Jenkins element."""
    points = contacts(
        [[1.0], [0.0]],
        [[0.0], [1.0]],
        k_n=[1.0, 0.0],
        k_t=[1.0, 0.1],
        mu=[0.0, 1.0],
        preload=[0.5, 0.02],
    )
    return frequency_response(
        System(
            ([[1.0]], [[0.02]], [[1.0]]),
            points,
            static_force=[0.5],
            harmonics=range(8),
            samples=512,
        ),
        harmonic_force=[0.15],
        frequencies=np.linspace(1.2, 1.5, 40) / (2.0 * np.pi),
    )


def test_a_sweep_up_jumps_at_the_fold_of_a_contact_that_opens(
    softening: FrequencyResponse,
) -> None:
    """Time integration from the end of the branch: below the fold it stays, beyond it ends where
    the fold says.
    """
    size = softening.amplitude([1.0])
    ((end, top),) = folds_of(softening.frequency, size)
    assert top.height > 2.5 * end.height
    x = softening.x[end.sample]
    for beside, height in ((0.999, end.height), (1.001, top.height)):
        march = steady_state(
            softening.balance, beside * end.frequency, x, steps=512, tolerance=1e-5
        )
        assert march.status == "periodic"
        found = march.amplitude(np.array([1.0]))
        # the branch ends with a vertical tangent: a thousandth in frequency is much in height
        assert found == pytest.approx(height, rel=0.07 if beside < 1.0 else 0.015)
