"""Measured curves against sums of modes in closed form: damping, peaks, FRAC."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from upd.errors import InputError
from upd.measured import (
    MeasuredCurve,
    fit_damping,
    frac,
    noisy_peaks,
)
from upd.measured.compare import on_path, paired

#: Hz, damping ratio, modal constant: below, in and above the band
ONE = ((80.0, 0.005, 0.5), (340.0, 0.004, 1.0), (1150.0, 0.005, -1.2), (2100.0, 0.005, 0.8))
TWO = ((80.0, 0.005, 0.5), (330.0, 0.004, 1.0), (352.0, 0.006, -0.7), (1150.0, 0.005, -1.2))
MODES = {"one": (ONE, ONE[1:2]), "two": (TWO, TWO[1:3])}
F = np.arange(280.0, 420.0, 0.05)


def accelerance(modes: tuple[tuple[float, float, float], ...], f: NDArray[np.float64] = F):
    """-f^2 A / (f_r^2 - f^2 + 2 i zeta f_r f), summed."""
    return sum(-A * f**2 / (fr**2 - f**2 + 2j * z * fr * f) for fr, z, A in modes)


def noisy(H, noise: float, seed: int, *, phase: bool) -> MeasuredCurve:
    """Errors that are a part of the value, of each part or of the magnitude."""
    e = noise * np.random.default_rng(seed).standard_normal((2, len(H)))
    size = np.abs(H)
    return MeasuredCurve(F, H + size * (e[0] + 1j * e[1]) if phase else size * (1.0 + e[0]))


@pytest.mark.parametrize("phase", [True, False], ids=["complex", "magnitudes"])
@pytest.mark.parametrize("noise", [0.004, 0.02])
@pytest.mark.parametrize("name", MODES)
def test_damping_within_one_per_cent_and_frequency_within_a_hundredth(
    name: str, noise: float, phase: bool
) -> None:
    modes, inside = MODES[name]
    H = accelerance(modes)
    for seed in range(5):
        fit = fit_damping(noisy(H, noise, seed, phase=phase))
        assert fit.zeta == pytest.approx([z for _, z, _ in inside], rel=0.01)
        # a mode's frequency is known to its half-width times the share that its damping is known to
        off = np.abs(fit.frequency - [f for f, _, _ in inside])
        assert (off < np.maximum(0.01, 4.0 * fit.frequency_error)).all()
        assert (off[0] < 0.01) or not phase
        assert abs(fit.correlation) <= fit.correlation_limit
        assert fit.noise.relative == pytest.approx(noise, rel=0.1)


def test_without_noise_only_the_modes_outside_are_left() -> None:
    """Residual terms leave (f / f_s)^6 of a mode at f_s above the band."""
    fit = fit_damping(MeasuredCurve(F, accelerance(TWO)))
    assert fit.zeta == pytest.approx([0.004, 0.006], rel=1e-4)
    assert fit.frequency == pytest.approx([330.0, 352.0], abs=1e-4)
    assert fit.constant == pytest.approx([1.0, -0.7], rel=1e-3)
    assert np.abs(fit.response(F) / accelerance(TWO) - 1.0).max() < 1e-2


def test_standard_errors_hold_what_they_say() -> None:
    """Of 100 repeats 95 % within 1.96 standard errors, binomially 89 to 100."""
    H, held = accelerance(ONE), 0
    for seed in range(100):
        fit = fit_damping(noisy(H, 0.02, seed, phase=True))
        held += bool(abs(fit.zeta[0] - 0.004) < 1.96 * fit.zeta_error[0])
    assert held >= 89


def test_constant_noise_is_told_from_relative() -> None:
    H, e = accelerance(ONE), np.random.default_rng(3).standard_normal((2, len(F)))
    fit = fit_damping(MeasuredCurve(F, H + 1.5 * (e[0] + 1j * e[1])))
    assert fit.noise.constant == pytest.approx(1.5, rel=0.05)
    assert fit.noise.relative < 2e-3
    assert abs(fit.zeta[0] - 0.004) < 4.0 * fit.zeta_error[0]


def test_neither_sensitivity_nor_shift_passes_into_damping() -> None:
    """A wrong transducer factor, of either sign, leaves frequency and damping."""
    H = noisy(accelerance(ONE), 0.02, 1, phase=True).accelerance
    one, other = (fit_damping(MeasuredCurve(F, k * H)) for k in (1.0, -3.7))
    assert other.zeta == pytest.approx(one.zeta, rel=1e-6)
    assert other.constant == pytest.approx(-3.7 * one.constant, rel=1e-6)


def test_a_mode_left_out_is_seen_in_the_residuals() -> None:
    curve = noisy(accelerance(TWO), 0.02, 0, phase=True)
    fit = fit_damping(curve, modes=[330.0])
    assert abs(fit.correlation) > fit.correlation_limit


def test_faults() -> None:
    H = accelerance(ONE)
    with pytest.raises(InputError, match=r"no peak between 280 and 329\.95 Hz"):
        fit_damping(MeasuredCurve(F[:1000], H[:1000]))
    on = slice(1196, 1204, 2)
    with pytest.raises(InputError, match="measure more points"):
        fit_damping(MeasuredCurve(F[on], np.abs(H[on])), modes=[340.0])


def test_peaks_of_receptance_are_exact_without_noise() -> None:
    f0, z = 340.0, 0.005
    f = np.linspace(330.0, 350.0, 801)
    (peak,) = noisy_peaks(f, np.abs(1.0 / (f0**2 - f**2 + 2j * z * f0 * f)))
    assert peak.frequency == pytest.approx(f0 * np.sqrt(1.0 - 2.0 * z**2), rel=1e-9)
    assert peak.height == pytest.approx(1.0 / (2.0 * z * f0**2 * np.sqrt(1.0 - z**2)), rel=1e-9)
    assert peak.zeta == pytest.approx(z, rel=1e-3)


@pytest.mark.parametrize("seed", range(5))
def test_noise_makes_no_peaks(seed: int) -> None:
    """Errors of 2 % of the highest point, whose tails they cover."""
    H, e = accelerance(ONE), np.random.default_rng(seed).standard_normal((2, len(F)))
    size = np.abs(H + 0.02 * np.abs(H).max() * (e[0] + 1j * e[1]))
    (peak,) = noisy_peaks(F, size)
    assert peak.frequency == pytest.approx(340.0, abs=0.1)


def test_frac_is_blind_to_factors_alone() -> None:
    H = accelerance(ONE)
    assert frac(H, (2.0 - 3j) * H) == pytest.approx(1.0, abs=1e-14)
    assert frac([1.0, 1.0], [1.0, -1.0]) == 0.0
    assert frac(np.abs(H), np.abs(H.conj())) == pytest.approx(1.0)
    assert frac(H, H.conj()) < 1.0
    for wrong in ([1.0], [0.0, 0.0]):
        with pytest.raises(InputError):
            frac([1.0, 2.0], wrong)


def test_peaks_are_paired_one_to_one() -> None:
    assert paired([330.0, 352.0], [351.0, 331.0]) == {0: 1, 1: 0}
    assert paired([340.0], [300.0, 341.0]) == {1: 0}
    assert paired([], [1.0]) == {}


def test_a_path_is_read_where_it_has_one_value() -> None:
    f, H = np.array([1.0, 3.0, 2.0, 4.0]), np.array([0.0, 2.0, 5.0, 7.0]) + 0j
    found = on_path(np.array([1.0, 1.5, 2.5, 3.5, 4.0, 4.5]), f, H)
    assert np.isnan(found[[2, 5]]).all()
    assert found[[0, 1, 3, 4]].real == pytest.approx([0.0, 0.5, 6.5, 7.0])
