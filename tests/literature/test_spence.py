"""Spence's indentation with friction: unlike half-spaces under a growing normal load."""

import numpy as np
import pytest

from upd.contact import coupled_contact
from upd.reference import dundurs_beta, half_space_compliance, sticking_part

E, RADIUS = 1e3, 20.0


def quarter(cells: int, nu: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compliance (2m, 2m), normal and radial, gaps (m,) and node counts (m,) of a rigid sphere on a
    half-space.

    Nodes that mirrors and the diagonal carry into each other have one force; forces around the axis
    vanish.
    """
    x = (np.arange(cells) - 0.5 * (cells - 1)) * 2.0 / (cells - 1)
    d = x[1] - x[0]
    X, Y = (v.ravel() for v in np.meshgrid(x, x))
    n, r = len(X), np.hypot(X, Y)
    C = half_space_compliance(cells, cells, d, d, E, nu, "all")
    key = np.round(2.0 * np.sort(np.abs(np.column_stack((X, Y))), axis=1) / d).astype(int)
    _, first, orbit, count = np.unique(
        key, axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    share = np.zeros((n, len(first)))
    share[np.arange(n), orbit.ravel()] = 1.0 / count[orbit.ravel()]
    T = np.zeros((3 * n, 2 * len(first)))
    T[:n, : len(first)] = share
    T[n : 2 * n, len(first) :] = (X / r)[:, None] * share
    T[2 * n :, len(first) :] = (Y / r)[:, None] * share
    reduced = T.T @ (C @ T)
    return 0.5 * (reduced + reduced.T), r[first] ** 2 / (2.0 * RADIUS), count


def stuck_part(cells: int, steps: int, nu: float, mu: float) -> float:
    """c/a by the areas of sticking and closed nodes, after as many steps of equal radius."""
    C, gap, count = quarter(cells, nu)
    load = 4.0 / 3.0 * E / (1.0 - nu**2) * 0.9**3 / RADIUS
    found = coupled_contact(
        C,
        gap,
        mu,
        load=load * (np.arange(1, steps + 1)[:, None] / steps) ** 3,
        columns=np.repeat([1.0, 0.0], len(gap))[:, None],
    )
    assert found.status == "converged"
    state = found.state[-1]
    return float(np.sqrt(count[state == 1].sum() / count[state > 0].sum()))


#: nu and mu/beta: beta is small, because the closed form leaves out what the shear does to the
#: pressure.
PAIRS = [(0.48, 0.5), (0.48, 0.8), (0.48, 1.2), (0.49, 0.6)]


@pytest.mark.parametrize(("nu", "ratio"), PAIRS[1:3])
def test_sticking_part(nu: float, ratio: float) -> None:
    """K. L. Johnson, Contact Mechanics (1985), section 5.4, page 122, after D. A. Spence (1975)."""
    beta = abs(float(dundurs_beta(E, nu, 1e9 * E, 0.3)))
    mu = ratio * beta
    # steps of a twentieth of the radius leave 3 %
    coarse, fine = (stuck_part(40, k, nu, mu) / sticking_part(beta, mu) - 1.0 for k in (20, 160))
    assert abs(fine) < 0.01
    assert abs(fine) < abs(coarse)


@pytest.mark.full
@pytest.mark.parametrize(("nu", "ratio"), PAIRS)
def test_sticking_part_on_a_fine_lattice(nu: float, ratio: float) -> None:
    """K. L. Johnson, Contact Mechanics (1985), section 5.4, page 122, after D. A. Spence (1975)."""
    beta = abs(float(dundurs_beta(E, nu, 1e9 * E, 0.3)))
    mu = ratio * beta
    assert stuck_part(72, 160, nu, mu) == pytest.approx(sticking_part(beta, mu), rel=0.01)
