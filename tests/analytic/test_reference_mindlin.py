"""Mindlin & Deresiewicz: integrals, limits, the loop and its memory, scaling."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

import upd.reference as ref
from upd.errors import InputError

E, NU = 2e5, 0.3
MU, N, A = 0.6, 50.0, 0.12
C = ref.tangential_compliance_modulus(E, NU, E, NU)
EPS = np.finfo(float).eps
ratios = st.floats(0.0, 1.0)


@pytest.mark.parametrize("q", [0.1, 0.5, 0.95, 1.0])
def test_traction_integrates_to_the_load(q):
    T = q * MU * N
    c = ref.stick_radius(T, MU, N, A)

    def ring(r):
        return 2 * np.pi * r * ref.mindlin_traction(r, A, c, MU, N)

    total = sum(
        quad(ring, *span, epsabs=0, epsrel=1e-9)[0]
        for span in ((0, c), (c, A))
        if span[0] < span[1]
    )
    assert total == pytest.approx(T, rel=1e-7)


@pytest.mark.parametrize("T", [-20.0, -5.0, 10.0, 20.0])
def test_unloading_traction_integrates_to_the_load(T):
    edges = sorted(
        {0.0, A, ref.stick_radius(20.0, MU, N, A), ref.stick_radius((20.0 - T) / 2, MU, N, A)}
    )

    def ring(r):
        return 2 * np.pi * r * ref.mindlin_unloading_traction(r, T, 20.0, MU, N, A)

    total = sum(quad(ring, *span, epsabs=1e-9, epsrel=1e-9)[0] for span in pairwise(edges))
    assert total == pytest.approx(T, abs=1e-6)


@given(share=st.floats(0, 1), q=ratios, q_now=st.floats(-1, 1))
@settings(max_examples=50, deadline=None)
def test_traction_keeps_the_friction_law(share, q, q_now):
    T_max = q * MU * N
    p0 = 1.5 * N / (np.pi * A**2)
    limit = MU * ref.hertz_pressure(share * A, A, p0)
    tractions = (
        ref.mindlin_traction(share * A, A, ref.stick_radius(T_max, MU, N, A), MU, N),
        ref.mindlin_unloading_traction(share * A, q_now * T_max, T_max, MU, N, A),
    )
    # the root at the rim turns a rounding of r into its square root
    assert all(abs(t) <= limit + 4 * np.sqrt(EPS) * MU * p0 for t in tractions)


def test_initial_stiffness_is_the_slope_at_the_origin():
    T = 1e-6 * MU * N
    slope = T / ref.mindlin_displacement(T, MU, N, A, C)
    # next term of the series: T/(6 mu N)
    assert ref.initial_tangential_stiffness(A, C) == pytest.approx(slope, rel=1e-6 / 6 * 1.01)
    G = E / (2 * (1 + NU))
    assert ref.initial_tangential_stiffness(A, C) == pytest.approx(
        4 * G * A / (2 - NU), rel=8 * EPS
    )


@given(nu=st.floats(0.0, 0.5))
@settings(max_examples=30, deadline=None)
def test_stiffness_ratio_of_like_materials(nu):
    like = ref.tangential_compliance_modulus(E, nu, E, nu)
    normal = 2 * A * ref.contact_modulus(E, nu, E, nu)
    assert ref.initial_tangential_stiffness(A, like) / normal == pytest.approx(
        2 * (1 - nu) / (2 - nu), rel=20 * EPS
    )


def test_displacement_limits():
    full = 3 * MU * N * C / (16 * A)
    assert ref.mindlin_displacement(MU * N, MU, N, A, C) == pytest.approx(full, rel=4 * EPS)
    assert ref.mindlin_displacement(0.0, MU, N, A, C) == 0
    T = np.array([-12.0, 12.0])
    d = ref.mindlin_displacement(T, MU, N, A, C)
    assert d[0] == -d[1]
    c = ref.stick_radius(T, MU, N, A)
    assert np.abs(d) == pytest.approx(full * (1 - (c / A) ** 2), rel=20 * EPS)


def test_branches_join():
    T = 24.0
    top = ref.mindlin_displacement(T, MU, N, A, C)
    assert ref.mindlin_unloading(T, T, MU, N, A, C) == pytest.approx(top, rel=8 * EPS)
    assert ref.mindlin_unloading(-T, T, MU, N, A, C) == pytest.approx(-top, rel=8 * EPS)
    assert ref.mindlin_reloading(T, T, MU, N, A, C) == pytest.approx(top, rel=8 * EPS)


@pytest.mark.parametrize("q", [0.05, 0.2, 0.3, 0.7, 1.0])
def test_loop_area_is_the_cycle_energy(q):
    T_max = q * MU * N

    def width(T):
        return ref.mindlin_unloading(T, T_max, MU, N, A, C) - ref.mindlin_reloading(
            T, T_max, MU, N, A, C
        )

    area, _ = quad(width, -T_max, T_max, epsabs=0, epsrel=1e-9)
    # the width is a difference of displacements q times larger
    assert ref.mindlin_cycle_energy(q, MU, N, A, C) == pytest.approx(area, rel=1e-8)


def test_energy_limits():
    T = 1e-4 * MU * N
    cube = T**3 * C / (36 * A * MU * N)
    assert ref.mindlin_cycle_energy(1e-4, MU, N, A, C) == pytest.approx(cube, rel=1e-3)
    assert ref.mindlin_cycle_energy(0.0, MU, N, A, C) == 0
    assert ref.mindlin_cycle_energy(1.0, MU, N, A, C) == pytest.approx(
        9 * (MU * N) ** 2 * C / (10 * A) / 6, rel=8 * EPS
    )
    below, above = ref.mindlin_cycle_energy(0.25 * np.array([1 - 1e-13, 1.0]), MU, N, A, C)
    # the closed form loses eps/q^3, both sides differ by 3e-13
    assert below == pytest.approx(above, rel=1e-11)


def test_loop_draws_the_branches():
    T_max = 24.0
    up, down = np.linspace(0, T_max, 11), np.linspace(T_max, -T_max, 21)
    d = ref.mindlin_loop(np.concatenate([up, down, -down]), MU, N, A, C)
    scale = d.max()
    assert d[:11] == pytest.approx(ref.mindlin_displacement(up, MU, N, A, C), abs=20 * EPS * scale)
    assert d[11:32] == pytest.approx(
        ref.mindlin_unloading(down, T_max, MU, N, A, C), abs=20 * EPS * scale
    )
    assert d[32:] == pytest.approx(
        ref.mindlin_reloading(-down, T_max, MU, N, A, C), abs=20 * EPS * scale
    )


@given(steps=st.lists(st.integers(-50, 50), min_size=1, max_size=20))
@settings(max_examples=100, deadline=None)
def test_loop_is_a_chain_of_play_elements(steps):
    """Any history: the same backbone by play operators in series (Prandtl and Ishlinskii), exact at
    loads on their grid.
    """
    n = 100
    grid = MU * N * np.arange(n + 1) / n
    slopes = np.diff(ref.mindlin_displacement(grid, MU, N, A, C)) / np.diff(grid)
    weights = np.diff(slopes, prepend=0.0)
    play = np.zeros(n)
    history = grid[-1] * np.array(steps) / 50
    expected = []
    for T in history:
        play = np.clip(play, T - grid[:-1], T + grid[:-1])
        expected.append(weights @ play)
    scale = 3 * MU * N * C / (16 * A)
    assert ref.mindlin_loop(history, MU, N, A, C) == pytest.approx(
        np.array(expected), abs=1e3 * EPS * n * scale
    )


@given(s=st.floats(0.1, 10.0), q=ratios)
@settings(max_examples=50, deadline=None)
def test_similar_bodies(s, q):
    one = ref.mindlin_displacement(q * MU * N, MU, N, A, C)
    other = ref.mindlin_displacement(q * MU * N * s**2, MU, N * s**2, A * s, C)
    # the root (1 - q)^(2/3) amplifies a rounding of q close to gross slip by (1 - q)^(-1/3) at
    # most: eps^(2/3)
    assert other == pytest.approx(
        s * one, rel=1e-12, abs=s * 4 * EPS ** (2 / 3) * 3 * MU * N * C / (16 * A)
    )
    energy = ref.mindlin_cycle_energy(q, MU, N, A, C)
    assert ref.mindlin_cycle_energy(q, MU, N * s**2, A * s, C) == pytest.approx(
        s**3 * energy, rel=40 * EPS
    )


@pytest.mark.parametrize(
    ("call", "names"),
    [
        (lambda: ref.mindlin_displacement(31.0, MU, N, A, C), "gross slip.*0.6 x 50 = 30 N"),
        (lambda: ref.stick_radius(-31.0, MU, N, A), "gross slip"),
        (lambda: ref.mindlin_loop(np.array([1.0, -31.0]), MU, N, A, C), "gross slip"),
        (lambda: ref.mindlin_loop(np.zeros((2, 2)), MU, N, A, C), "shape"),
        (lambda: ref.mindlin_cycle_energy(1.1, MU, N, A, C), "q = 1.1"),
        (lambda: ref.mindlin_unloading(11.0, 10.0, MU, N, A, C), "T_max"),
        (lambda: ref.mindlin_traction(0.0, A, 2 * A, MU, N), "stick radius"),
        (lambda: ref.mindlin_displacement(1.0, 0.0, N, A, C), "mu ="),
        (lambda: ref.tangential_compliance_modulus(np.inf, NU, np.inf, NU), "rigid"),
    ],
)
def test_refuses(call, names):
    with pytest.raises(InputError, match=names):
        call()
