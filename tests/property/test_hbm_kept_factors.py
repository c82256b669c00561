"""Newton's corrections from the factors of an earlier point against those of the matrix itself."""

from __future__ import annotations

import pickle
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.literature.test_hbm_blade_damper_blade import Y2, response
from tests.property.test_hbm_condensed import MOVES, OPEN, STICKS, problem
from tests.stability.test_hbm_hard_cases import gap_oscillator
from tests.whole_balance import Whole, evaluate
from upd.hbm.core import factors
from upd.hbm.core.factors import (
    LEFT,
    LEFT_OF_TANGENT,
    Border,
    Factors,
    FactorsOf,
    KeptFactors,
    Product,
)
from upd.hbm.springs import jacobian


def parts(A: np.ndarray) -> tuple[Product, FactorsOf, Border]:
    """A bordered matrix: product, factors, border; all unknowns of size one."""
    n = len(A) - 1
    J = A[:n, :n]
    return partial(np.matmul, J), partial(Factors, J), Border(A[:n, n], np.ones(n), 1.0, A[n])


def whole_matrix(whole: Whole, D: np.ndarray, p_scale: float, normal: np.ndarray) -> np.ndarray:
    """Jacobian of scaled unknowns with its border."""
    top = np.column_stack([whole.jacobian * D, whole.by_frequency * p_scale])
    return np.vstack([top, normal[None]])


@pytest.fixture
def always(monkeypatch: pytest.MonkeyPatch) -> None:
    """Factors are kept of small matrices, and solutions are cheap beside them."""
    monkeypatch.setattr(jacobian, "WORTH_KEEPING", 0)
    monkeypatch.setattr(factors, "SOLUTIONS", 0.01)


def kept(of: np.ndarray) -> KeptFactors:
    """Kept factors of a matrix."""
    out = KeptFactors()
    out.near(*parts(of), len(of))
    return out


def near_identity(rng: np.random.Generator, n: int) -> np.ndarray:
    return np.eye(n) + 0.3 * rng.normal(size=(n, n)) / n**0.5


@pytest.mark.parametrize(
    ("n", "kinds"),
    [
        (12, [MOVES, MOVES, MOVES]),
        (14, [MOVES, STICKS, OPEN, MOVES]),
        (3, [MOVES, MOVES, STICKS, MOVES, OPEN]),
    ],
)
@settings(max_examples=8, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    tangents=st.integers(1, 2),
    static=st.booleans(),
    proportional=st.booleans(),
)
def test_corrections_from_an_earlier_point_are_those_of_the_matrix(
    n: int, kinds: list[int], seed: int, tangents: int, static: bool, proportional: bool
) -> None:
    b, x = problem(seed, n, kinds, tangents, static, proportional)
    rng = np.random.default_rng(seed + 1)
    other = x * rng.uniform(0.97, 1.03, b.size)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jacobian, "WORTH_KEEPING", 0)
        patch.setattr(factors, "SOLUTIONS", 0.01)
        patch.setattr(factors, "LEFT", LEFT_OF_TANGENT)
        _, J, slope = b.linearised(x, 1.3)
        assert J is not None
        D, normal = rng.uniform(0.5, 2, b.size), rng.normal(size=b.size + 1)
        J.bordered(Border(slope, D, 0.8, normal))
        P, sizes = whole_matrix(evaluate(b, x, 1.3), D, 0.8, normal), np.append(D, 0.8)
        _, J, slope = b.linearised(other, 1.31)
        assert J is not None
        D, normal, right = rng.uniform(0.5, 2, b.size), rng.normal(size=b.size + 1), rng.normal()
        r, p_scale = rng.normal(size=b.size), 1.7
        found = J.bordered(Border(slope, D, p_scale, normal))
        assert type(found).__name__ == "_Near"
        correction, tangent = found.solve(r, right), found.tangent()
        sign = found.sign
    whole = evaluate(b, other, 1.31)
    A = whole_matrix(whole, D, p_scale, normal)
    wanted = np.linalg.solve(A, np.append(r, right))
    size = np.linalg.norm(wanted)
    # GMRES measures what is left after the earlier factors, in the unknowns of now
    preconditioned = np.linalg.solve(P * (np.append(D, p_scale) / sizes), A)
    rounding = 1e-13 * np.linalg.cond(A)
    limit = 2 * LEFT_OF_TANGENT * np.linalg.cond(preconditioned) + rounding
    assert np.linalg.norm(correction - wanted) <= limit * size
    along = np.linalg.solve(A, np.append(np.zeros(b.size), 1.0))
    along /= np.linalg.norm(along)
    assert np.linalg.norm(tangent - along) <= limit
    assert sign == np.linalg.slogdet(A)[0]


@pytest.mark.usefixtures("always")
def test_a_correction_leaves_its_share() -> None:
    rng = np.random.default_rng(3)
    P = near_identity(rng, 60)
    M = P + 0.2 * near_identity(rng, 60)
    r = rng.normal(size=60)
    z = kept(P).near(*parts(M), 60).solve(r[:-1], r[-1])
    left, whole = (np.linalg.norm(np.linalg.solve(P, x)) for x in (r - M @ z, r))
    assert LEFT / 100 < left / whole <= LEFT * 1.001


@pytest.mark.usefixtures("always")
@pytest.mark.parametrize("seed", range(20))
def test_a_determinant_of_the_other_sign_is_seen(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 30
    P = near_identity(rng, n)
    u, v = rng.normal(size=n), rng.normal(size=n)
    # det(P + s u v') = det P (1 + s v' P^-1 u): of the other sign by this s
    s = -1.5 / (v @ np.linalg.solve(P, u))
    M = P + s * np.outer(u, v)
    found = kept(P).near(*parts(M), n)
    found.tangent()
    assert found.sign == np.linalg.slogdet(M)[0] == -np.linalg.slogdet(P)[0]


@pytest.mark.usefixtures("always")
def test_a_matrix_too_far_is_factored() -> None:
    rng = np.random.default_rng(1)
    M = rng.normal(size=(40, 40))
    of = kept(rng.normal(size=(40, 40)))
    with pytest.MonkeyPatch.context() as patch:
        # ten solutions at most
        patch.setattr(factors, "SOLUTIONS", 2.0)
        found = of.near(*parts(M), 40)
        r = rng.normal(size=40)
        np.testing.assert_allclose(found.solve(r[:-1], r[-1]), np.linalg.solve(M, r), rtol=1e-9)
    _, factored, border = parts(M)
    own = factored(border)
    assert (found.sign, found.ratio) == (own.sign, own.ratio)
    # and kept for the next one: one product
    of.near(*parts(M), 40).solve(r[:-1], r[-1])
    assert of.newest == 2


@pytest.mark.usefixtures("always")
def test_a_singular_matrix_has_no_finite_correction() -> None:
    """A path shortens its step then."""
    M = np.eye(6)
    M[2] = 0.0
    found = kept(np.eye(6)).near(*parts(M), 6)
    with np.errstate(all="ignore"):
        assert not np.isfinite(found.solve(np.ones(5), 1.0)).all()


@pytest.mark.usefixtures("always")
def test_factors_are_renewed_when_waiting_costs_more() -> None:
    """Costs of a correction rise by one each time: the best is where the average is least."""
    of, A = KeptFactors(), np.eye(1)
    dear, costs = 0.5 / factors.SOLUTIONS, list[int]()
    of.near(*parts(np.eye(1)), 0)
    of.spent = dear
    first = of.factors
    for cost in range(1, 100):
        of.near(*parts(A), 0)
        if of.factors is not first:
            break
        of.note(cost)
        costs.append(cost)
    average = [(dear + sum(costs[:k])) / (1 + k) for k in range(len(costs) + 1)]
    # one beyond the least average: a cost is known afterwards
    assert len(costs) == int(np.argmin(average)) + 1


def test_another_size_of_problem_is_factored() -> None:
    of = kept(np.eye(5))
    assert type(of.near(*parts(np.eye(7)), 7)).__name__ == "Factors"


def test_curves_are_those_of_new_factors_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Through slip and lift-off of two contacts, and round a fold."""
    frequency, ways = np.arange(155.0, 170.0, 0.5), np.linspace(0.8, 1.5, 71)

    def curves():
        return response(frequency), gap_oscillator(ways, harmonics=range(6))

    usual = curves()
    used: list[int] = []
    found = factors.gmres

    def counted(*args, **options):
        used.append(1)
        return found(*args, **options)

    monkeypatch.setattr(factors, "gmres", counted)
    monkeypatch.setattr(jacobian, "WORTH_KEEPING", 0)
    monkeypatch.setattr(factors, "SOLUTIONS", 0.5)
    near = curves()
    assert all(one.balance.linear.kept.factors is None for one in near)
    assert len(used) > 500
    for row, one, other in zip((Y2, [1.0]), usual, near, strict=True):
        assert (one.status, other.status) == ("complete", "complete")
        met = np.intersect1d(one.frequency, other.frequency)
        assert len(met) >= 28
        for w in met:
            mine, its = (np.sort(c.amplitude(row)[c.frequency == w]) for c in (one, other))
            np.testing.assert_allclose(its, mine, rtol=1e-8)
        assert other.peak(row)[1] == pytest.approx(one.peak(row)[1], rel=1e-4)


def test_files_hold_no_factors() -> None:
    of = kept(np.eye(5))
    assert of.factors is not None
    assert pickle.loads(pickle.dumps(of)).factors is None
