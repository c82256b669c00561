"""Peaks told apart by mode, against oscillators whose modes cross as a parameter changes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from upd.analyses.forced.measures import (
    CurvePeak,
    ModeShapes,
    StuckMode,
    in_quadrature,
    motion_shares,
    numbered,
    path_maxima,
    tell_apart,
)

Array = NDArray[np.float64]
M = np.diag([1.0, 4.0])
#: in phase and out of phase, orthonormal in M
SHAPE = np.array([[1.0, 1.0], [0.5, -0.5]]) / np.sqrt(2.0)
MODES = ModeShapes(
    M, SHAPE, [StuckMode(95.0, True, 1, "in phase"), StuckMode(105.0, False, 2, "out of phase")]
)


def peaks(in_phase: float, out_of_phase: float) -> list[CurvePeak]:
    """Peaks of the driven mass; the natural frequencies in Hz, with 0.5 % modal damping."""
    f = np.linspace(80.0, 120.0, 4001)
    w, own = 2 * np.pi * f[:, None], 2 * np.pi * np.array([in_phase, out_of_phase])
    # excited at the first mass
    modal = SHAPE[0] / (own**2 - w**2 + 2j * 0.005 * own * w)
    motion = modal @ SHAPE.T
    maxima = path_maxima(f, np.abs(motion[:, 0]) * f**2)
    return numbered(MODES, maxima, motion[[one.sample for one in maxima]])


@pytest.mark.parametrize(("first", "second"), [(95.0, 105.0), (105.0, 95.0), (98.0, 102.0)])
def test_a_number_stays_with_its_mode_where_the_modes_cross(first: float, second: float) -> None:
    found = {one.number: one for one in peaks(first, second)}
    assert sorted(found) == [1, 2]
    # a tenth of the half-power width of 1 Hz, by which the other mode shifts a peak
    assert found[1].frequency == pytest.approx(first, abs=0.1)
    assert found[2].frequency == pytest.approx(second, abs=0.1)
    assert [found[k].mode for k in (1, 2)] == ["in phase", "out of phase"]
    assert min(one.mac for one in found.values()) > 0.95


def test_a_maximum_far_from_resonance_is_not_in_quadrature() -> None:
    model: Any = SimpleNamespace(force=np.array([1.0, 0.0]))
    own, zeta = 100.0, 0.005
    # half power at w_r (1 -+ zeta)
    f = own * np.array([0.9, 1.0 - 2.0 * zeta, 1.0 - 0.5 * zeta, 1.0, 1.0 + 0.5 * zeta, 1.1])
    eta = 1.0 / (own**2 - f**2 + 2j * zeta * own * f)
    found = in_quadrature(model, eta[:, None] * SHAPE[:, 0])
    assert found.tolist() == [False, False, True, True, True, False]


def test_shares_are_those_of_the_kinetic_energy() -> None:
    motion = np.array([[1.0, 0.5], [1.0, 0.0], [1.0 + 1.0j, 0.5 - 0.5j]])
    share = motion_shares(M, motion, SHAPE)
    # a mass alone moves half in each; the third is in phase with 1 and out of phase with 1j
    assert share == pytest.approx(np.array([[1.0, 0.0], [0.5, 0.5], [0.5, 0.5]]), abs=1e-14)
    assert share.sum(axis=1) == pytest.approx(np.ones(3))


def test_two_maxima_of_one_mode_are_not_the_peaks_of_two() -> None:
    # as the symmetric damper at F_C/F_E 194: the lowest of three is the other mode's peak
    share = np.array([[0.98, 0.01], [0.002, 0.997], [0.006, 0.99]])
    assert tell_apart(share, np.array([60.0, 187.0, 101.0])) == {0: 0, 1: 1}


def test_what_no_mode_has_more_than_half_of_goes_to_the_mode_left_over() -> None:
    assert tell_apart(np.array([[0.45, 0.40], [0.3, 0.6]]), np.ones(2)) == {1: 1, 0: 0}
    # optimal: 0.40 + 0.35 is more than 0.45 + 0.1
    assert tell_apart(np.array([[0.45, 0.40], [0.35, 0.1]]), np.ones(2)) == {0: 1, 1: 0}
    assert tell_apart(np.array([[0.4, 0.45]]), np.ones(1)) == {1: 0}
    assert tell_apart(np.zeros((1, 0)), np.ones(1)) == {}
