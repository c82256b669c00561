"""Harmonics stretch by stretch.

More of them where the truncation measure asks, through folds, past a path that ends early; never
more than the limit, and never silent about what is left.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from upd.hbm import FrequencyResponse, contacts, frequency_response
from upd.hbm.springs import harmonics as adaptive
from upd.hbm.springs.harmonics import TRUNCATION, Whole

HZ = 1 / (2 * np.pi)
BAND = np.linspace(0.8, 1.5, 71)


def pressed(**options: Any) -> FrequencyResponse:
    """A mass pressed on a stiff unilateral spring: it lifts off near resonance, and the peak leans.

    Its second harmonic matters only where the contact opens.
    """
    given: dict[str, Any] = {"frequencies": BAND * HZ, "harmonics": "adaptive"} | options
    points = contacts([[1.0]], k_n=1.0, mu=0.0, preload=1.0)
    return frequency_response([[1.0]], [[0.03]], [[0.5]], points, harmonic_force=[0.12], **given)


def at_band(answer: FrequencyResponse, once: np.ndarray) -> np.ndarray:
    """Amplitudes at the frequencies of the band that the path passes once."""
    where = np.argmin(np.abs(answer.frequency[:, None] - BAND[once] * HZ), axis=0)
    return answer.amplitude([1.0])[where]


def passed_once(answer: FrequencyResponse) -> np.ndarray:
    """Frequencies of the band outside the folds."""
    f = answer.frequency
    top, low = np.maximum.accumulate(f), np.minimum.accumulate(f[::-1])[::-1]
    folded = [(a, b) for a, b in zip(low, top, strict=True) if a < b]
    return np.array([not any(a <= w * HZ <= b for a, b in folded) for w in BAND])


@pytest.fixture(scope="module")
def fine() -> FrequencyResponse:
    return pressed(harmonics=range(16), samples=512)


@pytest.mark.parametrize("sweep_down", [False, True])
def test_more_harmonics_only_where_they_matter(fine: FrequencyResponse, sweep_down: bool) -> None:
    answer = pressed(sweep_down=sweep_down)
    assert answer.status == "complete", answer.message
    assert answer.truncation.max() <= TRUNCATION
    used = answer.highest_harmonic
    assert used.min() == 1
    assert used.max() == answer.harmonics.highest > 1
    # what is open somewhere in the cycle has more, what never opens has one
    opens = answer.state[:, 0, 2] > 0
    assert used[opens].min() > 1
    assert used[0] == used[-1] == 1
    for top in np.unique(used):
        assert f"to {top} at {int((used == top).sum())} point" in answer.message
    # unused coefficients are zero
    W = answer.contact_displacement[:, 0, 0]
    for n, top in zip(W, used, strict=True):
        assert not n[1 + 2 * top :].any()
    assert np.abs(answer.energy_balance).max() < 1e-6
    # one path, the fold passed as with all harmonics
    once = passed_once(fine)
    assert (~once).any()
    np.testing.assert_allclose(at_band(answer, once), at_band(fine, once), rtol=5 * TRUNCATION)
    assert answer.peak([1.0]) == pytest.approx(fine.peak([1.0]), rel=5 * TRUNCATION)
    assert np.any(np.diff(answer.frequency) * (-1) ** sweep_down < 0), "the fold is kept"


def _cut_short(solve: Callable[..., Whole], highest: int) -> Callable[..., Whole]:
    """The solver, but its paths with few harmonics end half way."""

    def cut(b: Any, f: Any, *rest: Any) -> Whole:
        found = solve(b, f, *rest)
        if b.harmonics.highest > highest:
            return found
        kept = found.cut(0, len(found.frequency) // 2)
        return replace(found, pieces=kept, status="stopped", message="stopped: cut short")

    return cut


def test_path_that_ends_early_goes_on_with_more(
    fine: FrequencyResponse, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(adaptive, "solve_curve", _cut_short(adaptive.solve_curve, 3))
    answer = pressed()
    assert answer.status == "complete", answer.message
    assert answer.truncation.max() <= TRUNCATION
    assert answer.highest_harmonic[0] == 1
    assert answer.highest_harmonic[-1] > 3
    once = passed_once(fine)
    np.testing.assert_allclose(at_band(answer, once), at_band(fine, once), rtol=5 * TRUNCATION)


def test_path_that_never_arrives_keeps_the_farthest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(adaptive, "solve_curve", _cut_short(adaptive.solve_curve, 99))
    monkeypatch.setattr(adaptive, "MOST_HARMONICS", 5)
    answer = pressed()
    assert answer.status == "stopped"
    assert "cut short" in answer.message
    first = _half_a_path()
    assert answer.frequency.max() > first


def _half_a_path() -> float:
    """How far half the path with one harmonic comes."""
    f = pressed(harmonics=(0, 1)).frequency
    return float(f[: len(f) // 2].max())


def test_too_few_harmonics_allowed_is_a_status(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(adaptive, "MOST_HARMONICS", 2)
    answer = pressed()
    assert answer.status == "harmonic limit"
    assert answer.arrived
    assert answer.truncation.max() > TRUNCATION
    bad = int((answer.truncation > TRUNCATION).sum())
    assert f"at {bad} points up to 2 harmonics are not enough" in answer.message


def test_excitation_of_the_third_harmonic_begins_with_it() -> None:
    answer = pressed(frequencies=BAND[:10] * HZ)
    assert answer.harmonics.highest == 1
    points = contacts([[1.0]], k_n=1.0, mu=0.0, preload=1.0)
    third = frequency_response(
        [[1.0]],
        [[0.03]],
        [[0.5]],
        points,
        harmonic_force={1: [0.01], 3: [0.01]},
        frequencies=BAND[:10] * HZ,
        harmonics="adaptive",
    )
    assert third.status == "complete"
    assert third.harmonics.highest == 3
