"""Newton's linear systems against their equations."""

import numpy as np
import pytest

from upd.contact.bordered import Bordered
from upd.contact.coulomb import Coulomb
from upd.contact.coulomb_conditions import AskedStep, Iterate
from upd.contact.coupled_systems import ClosedSystem, Stuck


def contact(seed: int, c: int) -> tuple[Coulomb, np.random.Generator]:
    rng = np.random.default_rng(seed)
    m = 8 * c
    Q = np.linalg.qr(rng.standard_normal((m, m)))[0]
    C = 1e-6 * Q @ np.diag(np.logspace(0.0, -3.0, m)) @ Q.T
    B = np.column_stack((np.kron(np.eye(c), np.ones((8, 1))), rng.standard_normal(m)))
    return Coulomb(0.5 * (C + C.T), B, rng.random(8)), rng


@pytest.mark.parametrize("by_load", [False, True])
@pytest.mark.parametrize("c", [2, 3])
@pytest.mark.parametrize("seed", range(6))
def test_the_closed_system_solves_the_rows(seed: int, c: int, by_load: bool) -> None:
    """P f + Q y = rhs with y = C f - B s - b and B'f = p, one column and many."""
    solver, rng = contact(seed, c)
    C, B, m = solver.C, solver.B, 8 * c
    at = Iterate(rng.standard_normal(m), np.zeros(c + 1), 1e-6 * rng.standard_normal(m))
    rows = solver.rows_at(at)
    while int(rows.is_open.sum()) > 4 or not rows.is_open.any():
        at = Iterate(rng.standard_normal(m), np.zeros(c + 1), 1e-6 * rng.standard_normal(m))
        rows = solver.rows_at(at)
    p, s = rng.standard_normal(c + 1), 1e-6 * rng.standard_normal(c + 1)
    for columns in ((), (3,)):
        b = 1e-6 * rng.standard_normal((m, *columns))
        target = AskedStep(
            b,
            np.add.outer(p, np.zeros(columns)) if by_load else None,
            None if by_load else np.add.outer(s, np.zeros(columns)),
        )
        rhs = np.add.outer(rows.rhs.T.ravel(), np.zeros(columns))
        system = ClosedSystem(solver, rows, by_load)
        solved = (system.solve,) if columns else (system.solve, system.refined)
        for f, motion, y in (way(rhs, target) for way in solved):
            size = np.abs(f).max()
            there = C @ f - B @ motion - b
            np.testing.assert_allclose(y, there, atol=1e-9 * size * C.max())
            shape = (c, 8, *columns)
            left = np.einsum("nij,jn...->in...", rows.P, f.reshape(shape))
            left += np.einsum("nij,jn...->in...", rows.Q, there.reshape(shape))
            row = np.abs(rows.P).max(axis=2) * size
            row += np.abs(rows.Q).max(axis=2) * np.abs(there).max() + np.abs(rows.rhs)
            off = np.abs(left.reshape(m, -1) - rhs.reshape(m, -1)).max(axis=1)
            assert (off <= 1e-8 * row.T.ravel()).all()
            if target.load is not None:
                np.testing.assert_allclose((B.T @ f).T, target.load.T, atol=1e-8 * size)


@pytest.mark.parametrize("by_load", [False, True])
@pytest.mark.parametrize("c", [2, 3])
@pytest.mark.parametrize("seed", range(6))
def test_a_factor_with_a_border_solves_other_rows(seed: int, c: int, by_load: bool) -> None:
    """P df + Q (C df - B ds) = left and B'df = p with the factor of rows of which one node has
    opened since, one closed, one slips that stuck, one sticks that slipped, and others turned.
    """
    rng = np.random.default_rng(seed)
    n = 40
    m = c * n
    V = np.linalg.qr(rng.standard_normal((m, m)))[0]
    C = 1e-6 * V @ np.diag(np.logspace(0.0, -2.0, m)) @ V.T
    B = np.column_stack((np.kron(np.eye(c), np.ones((n, 1))), rng.standard_normal(m)))
    solver = Coulomb(0.5 * (C + C.T), B, np.full(n, 0.5))
    # open: pulled; slipping: pushed along the face beyond friction
    f = 1.0 + 0.1 * rng.random((c, n))
    f[1:] *= 0.1
    f[0, :6], f[1:, 6:20] = -1.0, 1.0 + rng.random((c - 1, 14))
    y = np.zeros((c, n))
    before = solver.rows_at(Iterate(f.ravel(), np.zeros(c + 1), y.ravel()))
    f[0, 0], f[0, 20] = 1.0, -1.0
    f[1:, 6], f[1:, 21] = 0.1, 2.0
    f[1:, 7:20] *= 1.0 + 0.01 * rng.random((c - 1, 13))
    y[1:, 7:20] = 1e-9 * rng.random((c - 1, 13))
    rows = solver.rows_at(Iterate(f.ravel(), np.zeros(c + 1), y.ravel()))
    opened = before.is_open != rows.is_open
    assert np.flatnonzero(opened).tolist() == [0, 20]
    assert (before.relaxed != rows.relaxed).any(axis=1)[[0, 6, 20, 21]].all()
    bordered = Bordered(ClosedSystem(solver, before, by_load))
    assert bordered.changed(rows) == 2 * c + 2 * (c - 1)
    rho = np.column_stack((solver.rho_n, *[solver.rho_t] * (c - 1)))
    weight = np.where(rows.relaxed, 1.0, rho)
    left = rng.standard_normal((n, c)) / weight
    left[rows.is_open & before.is_open] = 0.0
    missing = rng.standard_normal(c + 1) if by_load else None
    off, p = left, missing
    f, s = np.zeros(m), np.zeros(c + 1)
    for _ in range(4):
        # each gains the digits that an inexact step takes away
        found = bordered.step(rows, off, p, rho)
        assert found is not None
        f, s = f + found[0], s + found[1]
        there = (C @ f - B @ s).reshape(c, n)
        off = left - np.einsum("nij,jn->ni", rows.P, f.reshape(c, n))
        off = off - np.einsum("nij,jn->ni", rows.Q, there)
        p = None if missing is None else missing - B.T @ f
        size = np.abs(weight * left).max() + np.abs(f).max()
    np.testing.assert_allclose(weight * off, 0.0, atol=1e-9 * size)
    if p is not None:
        np.testing.assert_allclose(p, 0.0, atol=1e-9 * size)


@pytest.mark.parametrize("by_load", [False, True])
def test_everything_stuck(by_load: bool) -> None:
    solver, rng = contact(0, 3)
    b, p = 1e-6 * rng.standard_normal(24), rng.standard_normal(4)
    target = AskedStep(b, p if by_load else None, None if by_load else 1e-6 * p)
    system = solver.system_of(solver.all_stuck(), by_load)
    assert isinstance(system, Stuck)
    f, s, _ = system.refined(np.zeros(24), target)
    np.testing.assert_allclose(solver.C @ f, solver.B @ s + b, atol=1e-12 * solver.C.max())
    if by_load:
        np.testing.assert_allclose(solver.B.T @ f, p, atol=1e-11)


def test_what_carries_nothing_is_refused() -> None:
    """All but one node open: the motions are free; under a given motion there is an answer."""
    solver, rng = contact(1, 3)
    f = -np.ones(24)
    f[[0, 8, 16]] = 1.0, 0.0, 0.0
    rows = solver.rows_at(Iterate(f, np.zeros(4), np.zeros(24)))
    assert rows.is_open.sum() == 7
    with pytest.raises(np.linalg.LinAlgError, match="carries the load"):
        solver.system_of(rows, True)
    # two nodes that slip freely cannot hold the shifts either
    free = Coulomb(solver.C, np.kron(np.eye(3), np.ones((8, 1))), np.zeros(8))
    f = np.concatenate((np.ones(8), 1e3 * rng.standard_normal(16)))
    rows = free.rows_at(Iterate(f, np.zeros(3), np.zeros(24)))
    assert rows.relaxed[:, 1:].all()
    with pytest.raises(np.linalg.LinAlgError):
        ClosedSystem(free, rows, True)
