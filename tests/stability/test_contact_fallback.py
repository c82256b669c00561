"""The methods behind the fast ones, made to work alone.

The same answers, without any help from Newton or the primal-dual set.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from upd.contact import TangentialHistory, normal_contact, tangential_contact
from upd.contact.coulomb import Coulomb
from upd.contact.coulomb_conditions import AskedStep, CoupledStep

FloatArray = NDArray[np.float64]


def spd(rng: np.random.Generator, n: int, condition: float) -> FloatArray:
    Q, _ = np.linalg.qr(rng.normal(size=(n, n)))
    C = (Q * np.geomspace(1, condition, n)) @ Q.T
    return np.asarray((C + C.T) / 2)


@pytest.mark.parametrize("seed", range(8))
def test_primal_active_set_alone(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(seed)
    n = 9
    C, h, s = spd(rng, n, 1e3), rng.normal(size=n), rng.uniform(0.1, 1, n)
    h[:2] = h.min()
    calls: list[Any] = [
        lambda: normal_contact(C, h, load=0.05).force,
        lambda: normal_contact(C, h, approach=1.0).force,
        lambda: tangential_contact(C, s, load=0.95 * s.sum()).force,
        lambda: tangential_contact(C, s, load=(1 - 1e-9) * s.sum()).force,
        lambda: tangential_contact(C, s, displacement=-5.0).force,
    ]
    fast = [call() for call in calls]
    monkeypatch.setattr("upd.contact.qp.ACTIVE_SET_STEPS", 0)
    assert normal_contact(C, h, load=0.05).method == "fallback"
    for call, expected in zip(calls, fast, strict=True):
        assert np.abs(call() - expected).max() <= 1e-10 * np.abs(expected).max()


@pytest.mark.parametrize("alone", [False, True])
@pytest.mark.parametrize("lag", [10.0, 1.0])
def test_no_node_free_under_a_given_load(
    lag: float, alone: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two springs of compliance 1 and limit 1 with slips lag/2 and -lag/2.

    At zero load t = -+lag/2, or both at the limit.
    """
    if alone:
        monkeypatch.setattr("upd.contact.qp.ACTIVE_SET_STEPS", 0)
    before = TangentialHistory(
        np.array([lag, -lag]) / 2, np.array([1.0, -1.0]), np.array([1, -1], dtype=np.int8)
    )
    answer = tangential_contact(np.eye(2), [1.0, 1.0], load=0.0, history=before)
    t = min(1.0, lag / 2)
    assert answer.force == pytest.approx([-t, t])
    # With both at the limit the shift is free between the two springs.
    assert abs(float(answer.displacement)) <= lag / 2 - t + 1e-12


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("level", [0.3, 0.9, 0.999])
def test_convex_search_alone(seed: int, level: float, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(seed)
    C, s = spd(rng, 10, 1e2), rng.uniform(0.1, 1, 5)
    pull = rng.normal(size=2)
    load = level * s.sum() * pull / np.hypot(*pull)
    by_load = tangential_contact(C, s, load=load)

    def lost(solver: Coulomb, step: AskedStep, *_: object) -> CoupledStep:
        at = solver.linear_step(step, solver.all_stuck())
        return replace(solver.judged(step, at, 0), residual=np.inf, converged=False)

    monkeypatch.setattr(Coulomb, "_newton", lost)
    given = tangential_contact(C, s, displacement=by_load.displacement)
    assert (
        given.method == "fallback" and np.abs(given.force - by_load.force).max() <= 1e-9 * s.max()
    )
    found = tangential_contact(C, s, load=load)
    assert (
        found.method == "fallback" and np.abs(found.force - by_load.force).max() <= 1e-9 * s.max()
    )
