"""Frequency response, peaks and tuned damping against closed forms of one and two masses, and
routes against each other.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.sparse import csr_array, issparse

from upd.dynamics import (
    find_peaks,
    frequency_response,
    modal_system,
    peak_response,
    tune_damping,
)
from upd.errors import ConvergenceError, InputError
from upd.fem import Material, box_mesh, mass, modal_damping, stiffness
from upd.linalg import factorise, modes
from upd.reduction import craig_bampton

STEEL = Material(200e3, 0.3)


class Direct(NamedTuple):
    """M u'' + C u' + K u = f, solved at every frequency: the independent way."""

    K: Any
    M: Any
    C: Any

    @property
    def n(self):
        return self.K.shape[0]

    def receptance(self, force, rows, omega):
        Z = (self.K - w**2 * self.M + 1j * w * self.C for w in omega)
        dense = (A.toarray() if issparse(A) else A for A in Z)
        return np.array([rows @ np.linalg.solve(A, force) for A in dense])


def one_mass(zeta, f0=300.0, m=2e-4):
    """k, m, c of one mass."""
    omega = 2 * np.pi * f0
    return np.array([[m * omega**2]]), np.array([[m]]), np.array([[2 * zeta * m * omega]])


def beam():
    """K, M of a clamped beam and two dofs at its end: force and output."""
    mesh = box_mesh(np.linspace(0, 100, 9), np.linspace(0, 12, 3), np.linspace(0, 9, 3))
    free = np.setdiff1d(
        np.arange(3 * mesh.n_node), (3 * mesh.nodes["x0"][:, None] + np.arange(3)).ravel()
    )
    K, M = (csr_array(A[free][:, free]) for A in (stiffness(mesh, STEEL), mass(mesh, STEEL)))
    end = mesh.nodes["x1"][[0, -1]]
    return K, M, *np.searchsorted(free, 3 * end + 2)


@pytest.mark.parametrize(
    ("quantity", "power", "scale"),
    [("receptance", 0, 1.0), ("mobility", 1, 1.0), ("accelerance", 2, 1e-3)],
)
def test_one_mass(quantity, power, scale):
    K, M, C = one_mass(0.01)
    f = np.array([0.0, 10.0, 299.0, 300.0, 301.0, 5000.0])
    w = 2 * np.pi * f
    exact = scale * (1j * w) ** power / (K[0, 0] - w**2 * M[0, 0] + 1j * w * C[0, 0])
    direct = frequency_response(Direct(K, M, C), 0, [0], f, quantity)
    np.testing.assert_allclose(direct.H[:, 0], exact, rtol=1e-11)
    modal = frequency_response(modal_system(modes(K, M, count=1), 0.01), 0, [0], f, quantity)
    np.testing.assert_allclose(modal.H[:, 0], exact, rtol=1e-11)
    assert direct.unit == modal.unit
    np.testing.assert_array_equal(direct.magnitude, np.abs(direct.H))


def test_direct_modal_and_reduced_agree_under_rayleigh_damping():
    K, M, force, output = beam()
    alpha, beta = 20.0, 2e-7
    found = modes(K, M, count=K.shape[0])
    f, omega = np.linspace(100, 4000, 25), 2 * np.pi * found.frequency
    modal = frequency_response(
        modal_system(found, 0.5 * alpha / omega + 0.5 * beta * omega), force, [output, force], f
    )
    direct = frequency_response(Direct(K, M, alpha * M + beta * K), force, [output, force], f)
    np.testing.assert_allclose(direct.H, modal.H, rtol=0, atol=1e-8 * abs(modal.H).max())
    reduced = craig_bampton(K, M, np.array([force, output]), n_modes=25)
    C = alpha * reduced.M + beta * reduced.K
    small = frequency_response(
        Direct(reduced.K, reduced.M, C),
        int(np.flatnonzero(reduced.boundary == force)[0]),
        reduced.at([output, force]),
        f,
    )
    # The frequencies differ by less than 1e-4, the width of a peak is 1e-2.
    np.testing.assert_allclose(small.H, direct.H, rtol=0, atol=1e-2 * abs(direct.H).max())
    load = np.zeros(K.shape[0])
    load[force] = 2.0
    np.testing.assert_allclose(
        frequency_response(Direct(K, M, alpha * M + beta * K), load, [output], f[:2]).H,
        2 * direct.H[:2, :1],
    )


def test_modal_damping_matrix_is_modal_damping():
    K, M, force, output = beam()
    reduced = craig_bampton(K, M, np.array([force, output]), n_modes=10)
    found = reduced.modes(count=reduced.n)
    f = np.linspace(100, 9000, 40)
    C = modal_damping(reduced.M, found.shapes, found.frequency, 0.01)
    direct = frequency_response(Direct(reduced.K, reduced.M, C), 0, [1], f)
    modal = frequency_response(modal_system(found, 0.01), 0, [1], f)
    np.testing.assert_allclose(direct.H, modal.H, rtol=1e-7)


def test_static_correction_of_few_modes():
    K, M, force, _ = beam()
    found, whole = modes(K, M, count=3), modes(K, M, count=K.shape[0])
    f = np.array([0.0, 0.4 * found.frequency[0]])
    exact = frequency_response(modal_system(whole, 0.0), force, [force], f, "receptance").H
    plain = frequency_response(modal_system(found, 0.0), force, [force], f, "receptance").H
    corrected = frequency_response(
        modal_system(found, 0.0, static=factorise(K)), force, [force], f, "receptance"
    ).H
    np.testing.assert_allclose(corrected[0], exact[0], rtol=1e-9)
    rest = abs(plain - exact)
    # What is left of the modes above is (omega / omega_4)^2 of it.
    above = (f[1] / whole.frequency[3]) ** 2
    assert abs(corrected - exact)[1, 0] <= 1.01 * above * rest[1, 0]
    assert rest[1, 0] > 0


@pytest.mark.parametrize("zeta", [0.001, 0.01, 0.05])
def test_peak_of_one_mass(zeta):
    K, M, C = one_mass(zeta)
    # Samples a third of the width apart, none on the peak.
    f = np.arange(200.0, 400.0, 200.0 * zeta) + 0.037
    H = frequency_response(Direct(K, M, C), 0, [0], f, "receptance").magnitude[:, 0]
    peaks = find_peaks(f, H)
    # 1 / |H|^2 is a parabola of f^2, so three samples give the peak exactly.
    np.testing.assert_allclose(peaks.frequency, [300 * np.sqrt(1 - 2 * zeta**2)], rtol=1e-9)
    np.testing.assert_allclose(
        peaks.height, [1 / (2 * zeta * np.sqrt(1 - zeta**2) * K[0, 0])], rtol=1e-9
    )
    # Crossings are interpolated along that parabola's chords; the formula itself is good to zeta^2.
    np.testing.assert_allclose(peaks.zeta, [zeta], rtol=0.02)


def test_two_peaks_and_none():
    f = np.linspace(1, 100, 2000)
    H = sum(a / (f0**2 - f**2 + 2j * 0.01 * f0 * f) for a, f0 in ((1.0, 20.0), (0.3, 70.0)))
    both = find_peaks(f, np.abs(H))
    np.testing.assert_allclose(both.frequency, [20, 70], rtol=1e-3)
    np.testing.assert_allclose(both.zeta, [0.01, 0.01], rtol=0.05)
    assert (np.diff(both.height) < 0).all()
    assert len(find_peaks(f, np.abs(H), above=0.5).frequency) == 1
    assert len(find_peaks(f, np.linspace(0, 1, 2000)).frequency) == 0
    # One side leads into the next peak before it has fallen far enough.
    close = abs(sum(1.0 / (f0**2 - f**2 + 2j * 0.02 * f0 * f) for f0 in (50.0, 51.5)))
    assert np.isnan(find_peaks(f, close).zeta).any()
    with pytest.raises(InputError, match="rising"):
        find_peaks(f[::-1], abs(H))


def test_damping_tuned_to_a_peak_of_one_mass():
    K, M, _ = one_mass(0.01)
    system = modal_system(modes(K, M, count=1), 0.01)
    band = (200.0, 400.0)
    zeta = tune_damping(system, 0, 0, 1e5, band=band)
    where, height = peak_response(modal_system(modes(K, M, count=1), zeta), 0, 0, band)
    # Accelerance of one mass peaks at 1 / (2 zeta sqrt(1 - zeta^2) m), in (m/s2)/N.
    m = 2e-4
    exact = 1e-3 / (2 * 1e5 * m)
    np.testing.assert_allclose(zeta * np.sqrt(1 - zeta**2), exact, rtol=1e-6)
    np.testing.assert_allclose(height, 1e5, rtol=1e-9)
    np.testing.assert_allclose(where, 300 / np.sqrt(1 - 2 * zeta**2), rtol=1e-6)


def test_damping_tuned_on_a_beam_with_its_neighbours():
    K, M, force, output = beam()
    known = modes(K, M, count=8)
    band = (0.8 * known.frequency[0], 1.2 * known.frequency[0])
    where, height = peak_response(modal_system(known, 0.004), force, output, band)
    alone = abs(known.shapes[force, 0] * known.shapes[output, 0]) / (2 * 0.004) * 1e-3
    np.testing.assert_allclose(height, alone, rtol=0.01)
    np.testing.assert_allclose(where, known.frequency[0], rtol=1e-4)
    found = tune_damping(modal_system(known, 0.02), force, output, height, band=band)
    np.testing.assert_allclose(found, 0.004, rtol=1e-6)


def test_faults_are_told():
    K, M, C = one_mass(0.01)
    system, found = Direct(K, M, C), modes(K, M, count=1)
    with pytest.raises(InputError, match="dof 3"):
        frequency_response(system, 0, [3], [1.0])
    with pytest.raises(InputError, match="Unknown quantity"):
        frequency_response(system, 0, [0], [1.0], "impedance")
    with pytest.raises(InputError, match="none negative"):
        frequency_response(system, 0, [0], [-1.0])
    with pytest.raises(InputError, match="dof number"):
        frequency_response(system, 0, [0.5], [1.0])
    with pytest.raises(InputError, match="rows"):
        frequency_response(system, 0, np.ones((1, 2)), [1.0])
    with pytest.raises(InputError, match="damping ratios for 1 modes"):
        modal_system(found, [0.1, 0.1])
    undamped = modal_system(found, 0.0)
    with pytest.raises(ConvergenceError, match="natural frequency"):
        frequency_response(undamped, 0, [0], [undamped.frequency[0]])
    with pytest.raises(ConvergenceError, match="No damping ratio"):
        tune_damping(modal_system(found, 0.1), 0, 0, 1e-6, band=(200.0, 400.0))
    with pytest.raises(InputError, match="target_peak"):
        tune_damping(modal_system(found, 0.1), 0, 0, -1.0, band=(200.0, 400.0))
    with pytest.raises(InputError, match="band"):
        peak_response(modal_system(found, 0.1), 0, 0, (400.0, 200.0))
    free = np.array([[1.0, -1.0], [-1.0, 1.0]])
    with pytest.raises(InputError, match="floats"):
        modal_system(modes(free, np.eye(2), count=2), 0.0, static=lambda f: f)
