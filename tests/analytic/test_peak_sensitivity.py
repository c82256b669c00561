"""Derivatives of forced responses and followed peaks by parameters: against the closed form of the
Jenkins oscillator, and central differences of balances solved again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from upd.errors import InputError
from upd.hbm import climb, contacts, frequency_response
from upd.hbm.core.fourier import harmonics
from upd.hbm.peaks.parameter_change import ParameterChange
from upd.hbm.peaks.sensitivity import _slopes, peak_derivatives
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.checks import loop_area
from upd.hbm.springs.coulomb import LIFT, SLIP, STICK
from upd.hbm.springs.modal import modal
from upd.hbm.springs.starts import first_point, newton
from upd.reference.friction import jenkins_peak, jenkins_peak_frequency

FloatArray = np.ndarray
#: relative steps of central differences, each half of the one before, no contact changing its state
#: at a sample between them
STEPS = (2e-4, 1e-4, 5e-5)


def test_jenkins_oscillator_in_closed_form() -> None:
    """Height and frequency of its peak over the limit, the spring and the force."""
    k_t, force, limit = 0.6, 0.2, 0.5
    slider = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=k_t, mu=1.0, preload=limit)
    w = jenkins_peak_frequency(limit, force, 1.0, 1.0, k_t)
    answer = frequency_response(
        [[1.0]],
        [[0.0]],
        [[1.0]],
        slider,
        harmonic_force=[force],
        frequencies=np.linspace(0.97, 1.03, 31) * w / (2 * np.pi),
        harmonics=(1,),
        samples=2048,
    )
    i = int(answer.amplitude([1.0]).argmax())
    top = climb(answer.balance, [1.0], answer.x[i], answer.frequency[i])
    one = np.ones(1)
    changes = [
        ParameterChange(preload=one),
        ParameterChange(mu=one),
        ParameterChange(k_t=one),
        ParameterChange(dynamic=np.ones((1, 1), complex)),
        ParameterChange(M=np.eye(1)),
    ]
    found = peak_derivatives(answer.balance, [1.0], top.x, top.frequency, changes)

    def exact(p: FloatArray) -> FloatArray:
        N, mu, k, F, m = p
        return np.array(
            [jenkins_peak(mu * N, F, k), jenkins_peak_frequency(mu * N, F, m, 1.0, k) / (2 * np.pi)]
        )

    at, h = np.array([limit, 1.0, k_t, force, 1.0]), 1e-5
    slopes = [(exact(at + h * e) - exact(at - h * e)) / (2 * h) for e in np.eye(5)]
    assert found.height == pytest.approx(exact(at)[0], rel=1e-5)
    for k, (by_height, by_frequency) in enumerate(slopes):
        assert found.by_height[k] == pytest.approx(by_height, rel=1e-3, abs=1e-4)
        assert found.by_frequency[k] == pytest.approx(by_frequency, rel=2e-3, abs=1e-6)


# -- two points with normal and tangential springs on four dofs ------------------------------------

HARMONICS = harmonics(range(4))
ROW = np.array([0.0, 1.0, 0.0, 0.0])
#: parameters of the toy: their size, and the relative change that is one
Toy = dict[str, float]
USUAL: Toy = {
    "k_n": 4.0,
    "k_t": 2.0,
    "mu": 0.4,
    "preload": 1.0,
    "gap": 0.02,
    "traction": 0.05,
    "static": 0.3,
    "force": 0.35,
    "damping": 0.08,
    "K": 1.0,
    "M": 1.0,
}
#: what slips, what lifts off as well, and what slips beside a point that sticks: the force, the
#: preload of the second point, and a frequency near a peak [Hz]
STATES = {"slip": (0.2, 1.0, 0.335), "lift-off": (0.7, 1.0, 0.332), "one sticks": (0.5, 9.0, 0.36)}


def matrices(p: Toy) -> tuple[FloatArray, FloatArray, FloatArray]:
    rng = np.random.default_rng(3)
    A, B = rng.normal(size=(2, 4, 4))
    M = p["M"] * (np.eye(4) + 0.1 * A @ A.T)
    K = p["K"] * (np.diag([1.0, 2.0, 3.0, 5.0]) + 0.1 * B @ B.T)
    return M, p["damping"] * (np.eye(4) + 0.1 * B @ B.T), K


def balance(p: Toy, start: str = "zero", samples: int = 64, tangents: int = 2) -> Balance:
    """The toy; `traction` at rest in the sliders, half of it along the second tangent."""
    rng = np.random.default_rng(5)
    rows = rng.normal(size=(3, 2, 4))
    points = contacts(
        rows[0],
        rows[1 : 1 + tangents],
        k_n=np.array([1.0, 0.7]) * p["k_n"],
        k_t=np.array([1.0, 1.3]) * p["k_t"],
        mu=p["mu"],
        preload=np.array([1.0, 0.8 * p["second"]]) * p["preload"],
        gap=p["gap"],
    )
    slider = -p["traction"] * np.array([[1.0, 0.5]]) / points.law.k_t[:, None]
    dynamic = np.zeros((3, 4), complex)
    dynamic[0] = p["force"] * np.array([1.0, 0.5, 0.0, 0.2j])
    static = p["static"] * np.array([0.2, -0.1, 0.3, 0.0])
    given = slider if start in ("zero", "static") else None
    return Balance(modal(*matrices(p)), points, HARMONICS, samples, static, dynamic, start, given)


def change(p: Toy, name: str) -> ParameterChange:
    """The derivative of the toy's data by the relative change of a parameter."""
    b, (M, C, K) = balance(p), matrices(p)
    law = b.contacts.law
    if name in ("k_n", "k_t", "mu", "preload", "gap"):
        return ParameterChange(**{name: getattr(law, name)})
    return {
        "traction": ParameterChange(traction=p["traction"] * np.array([[1.0, 0.5]] * 2)),
        "static": ParameterChange(static=b.static),
        "force": ParameterChange(dynamic=b.dynamic),
        "damping": ParameterChange(C=C),
        "K": ParameterChange(K=K),
        "M": ParameterChange(M=M),
    }[name]


@cache
def solved(state: str) -> tuple[Toy, float, FloatArray]:
    """The toy with a solution near a peak; it does what it is named after."""
    force, second, f = STATES[state]
    p = USUAL | {"force": force, "second": second}
    b = balance(p)
    x = first_point(b, f)
    assert x is not None
    marched = b.force(x).march.state
    assert np.any(marched == SLIP)
    assert np.any(marched == LIFT) == (state == "lift-off")
    assert np.any(np.all(marched == STICK, axis=1)) == (state == "one sticks")
    return p, f, x


def errors(difference: Callable[[float], float], exact: float) -> FloatArray:
    return np.array([abs(difference(h) - exact) for h in STEPS])


def second_order(error: FloatArray, size: float, floor: float) -> None:
    """A quarter of the error for half the step, as far as rounding lets it."""
    assert error[-1] < 2e-4 * size + floor
    steady = error[1:] > floor
    assert np.all(error[:-1][steady] / error[1:][steady] > 3.0)


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("name", ["mu", "k_n", "k_t", "preload", "force", "K"])
def test_loss_at_fixed_frequency(name: str, state: str) -> None:
    """The loss of all points, with what the parameter itself does to the forces."""
    p, f, x = solved(state)
    exact = float(_slopes(balance(p), ROW, x, f, [change(p, name)], None, 0.0).loss_by[1])

    def loss(value: float) -> float:
        b = balance(p | {name: p[name] * value})
        again = newton(b, x, f)
        assert again is not None
        F, W = b.force(again).force, b.split(again)[0]
        return float(loop_area(F[None], W[None], 1, HARMONICS.dynamic, b.samples).sum())

    found = errors(lambda h: (loss(1 + h) - loss(1 - h)) / (2 * h), exact)
    second_order(found, abs(exact), 1e-9)


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("name", USUAL)
def test_height_at_fixed_frequency(name: str, state: str) -> None:
    """Central differences converge to the derivative with order 2."""
    p, f, x = solved(state)
    (exact,) = _slopes(balance(p), ROW, x, f, [change(p, name)], None, 0.0).by_parameter

    def height(value: float) -> float:
        b = balance(p | {name: p[name] * value})
        again = newton(b, x, f)
        assert again is not None
        return _slopes(b, ROW, again, f, [], None, 0.0).height

    found = errors(lambda h: (height(1 + h) - height(1 - h)) / (2 * h), float(exact))
    second_order(found, abs(float(exact)), 1e-9)


#: one tangent: a peak at which a point lifts off (what is lost there, 8e-6, begins within the step
#: beside the peak: it has no derivative to that step), one where one slips beside one that sticks
#: (1.5e-3 is lost), and one where much is lost (1.5e-2)
PEAKS = {
    "lift-off": (0.25, 1.0, 0.26),
    "one sticks": (0.5, 9.0, 0.26),
    "lossy": (0.7, 9.0, 0.26),
}


@pytest.mark.parametrize("state", PEAKS)
@pytest.mark.parametrize("name", ["mu", "k_n", "k_t", "preload", "force", "damping", "K"])
def test_followed_peak(name: str, state: str) -> None:
    """Height and frequency of a peak of accelerations that is climbed to again.

    The kinks by the samples move the peak: heights agree to a few thousandths with 2048 of them.
    """
    force, second, near = PEAKS[state]
    p = USUAL | {"force": force, "second": second}

    def made(value: float) -> Balance:
        return balance(p | {name: p[name] * value}, samples=2048, tangents=1)

    def climbed(b: Balance, x: FloatArray, f: float) -> tuple[FloatArray, FloatArray]:
        top = climb(b, ROW, x, f, power=2.0)
        assert top.found
        height = (2 * np.pi * top.frequency) ** 2 * top.amplitude
        F, W = b.force(top.x).force, b.split(top.x)[0]
        loss = loop_area(F[None], W[None], 1, HARMONICS.dynamic, b.samples).sum()
        return np.array([height, top.frequency, loss]), top.x

    b = made(1.0)
    x = first_point(b, near)
    assert x is not None
    (height, f, loss), x = climbed(b, x, near)
    marched = b.force(x).march.state
    assert np.any(marched == SLIP)
    assert np.any(marched == LIFT) == (state != "one sticks")
    found = peak_derivatives(b, ROW, x, f, [change(p, name)], power=2.0)
    h, ends = 1e-2, []
    for sign in (-1, 1):
        other = made(1.0 + sign * h)
        start = newton(other, x, f)
        assert start is not None
        ends.append(climbed(other, start, f)[0])
    by_height, by_frequency, by_loss = (ends[1] - ends[0]) / (2 * h)
    assert found.height == pytest.approx(height, rel=1e-12)
    assert found.loss == pytest.approx(loss, rel=1e-12)
    if state == "lossy":
        assert found.by_loss[0] == pytest.approx(by_loss, abs=0.25 * loss)
    if state != "lift-off":
        # the loss falls by 850 (lossy) and 5700 times itself per Hz: a fiftieth of the frequency's
        # derivative is up to nine times the loss. Told apart, a tenth is left to kinks and steps.
        steep = 2 * np.pi * _slopes(b, ROW, x, f, [], None, 2.0).loss_by[0]
        along = found.by_loss[0] + steep * (by_frequency - found.by_frequency[0])
        assert along == pytest.approx(by_loss, abs=0.1 * loss)
    assert found.by_height[0] == pytest.approx(by_height, rel=5e-3)
    assert found.by_frequency[0] == pytest.approx(by_frequency, rel=2e-2)


@pytest.mark.parametrize("start", ["mid", "upper"])
def test_other_starts_of_the_sliders(start: str) -> None:
    """Sliders that the motion itself places."""
    p, f, x = solved("slip")

    def height(value: float) -> float:
        b = balance(p | {name: p[name] * value for name in ("mu", "k_t")}, start)
        again = newton(b, x, f)
        assert again is not None
        return _slopes(b, ROW, again, f, [], None, 0.0).height

    b = balance(p, start)
    at = newton(b, x, f)
    assert at is not None
    law = b.contacts.law
    both = ParameterChange(mu=law.mu) + ParameterChange(k_t=law.k_t)
    (exact,) = _slopes(b, ROW, at, f, [both], None, 0.0).by_parameter
    found = errors(lambda h: (height(1 + h) - height(1 - h)) / (2 * h), float(exact))
    second_order(found, abs(float(exact)), 1e-9)


def test_no_derivative_where_there_is_none() -> None:
    """Friction may only rise from 0."""
    p, f, x = solved("slip")
    b = balance(p)
    law = replace(b.contacts.law, mu=np.zeros(2))
    none = Balance(b.modal, replace(b.contacts, law=law), HARMONICS, 64, b.static, b.dynamic)
    with pytest.raises(InputError, match="mu is 0 at a point"):
        _slopes(none, ROW, x, f, [ParameterChange(mu=np.ones(2))], None, 0.0)
