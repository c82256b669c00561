"""Answers over the size of a load.

Closed form of one dof with a Jenkins element, homogeneity, input faults.
"""

from __future__ import annotations

import numpy as np
import pytest

from upd.errors import InputError
from upd.hbm import contacts, frequency_response, load_curve

HZ = 1 / (2 * np.pi)
K_T, LIMIT, W = 1.0, 0.5, 1.15


def jenkins() -> object:
    slider = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=K_T, mu=1.0, preload=LIMIT)
    return frequency_response(
        [[1.0]],
        [[0.02]],
        [[1.0]],
        slider,
        harmonic_force=[1.0],
        frequencies=[W * HZ],
        harmonics=(1,),
        samples=4096,
    ).balance


def force_for(A: float) -> float:
    """|F| that moves the oscillator by A at W: dynamic stiffness and the first harmonic of the
    slider's loop.
    """
    x_c = LIMIT / K_T
    th = np.arccos(1 - 2 * x_c / A)
    a1 = K_T * A / np.pi * (th - np.sin(2 * th) / 2)
    b1 = -4 * LIMIT / np.pi * (1 - x_c / A)
    # x = A cos: the slider's force is a1 cos + b1 sin
    return float(np.hypot((1 - W**2) * A + a1, -0.02 * W * A + b1))


def test_amplitude_over_the_load() -> None:
    curve = load_curve(jenkins(), W * HZ, np.linspace(0.05, 3.0, 30))  # type: ignore[arg-type]
    assert curve.status == "complete"
    A = curve.amplitude([1.0])
    slides = A > 1.01 * LIMIT / K_T
    assert slides.sum() > 10
    np.testing.assert_allclose([force_for(a) for a in A[slides]], curve.factor[slides], rtol=1e-5)
    # below the limit the answer is the stuck one, proportional to the load
    np.testing.assert_allclose(
        A[~slides] / curve.factor[~slides], A[0] / curve.factor[0], rtol=1e-2
    )


def test_more_static_load_and_less_dynamic_load_are_one() -> None:
    points = contacts([[1.0]], [[0.3]], k_n=2.0, k_t=1.0, mu=0.5)
    b = frequency_response(
        [[1.0]],
        [[0.05]],
        [[1.0]],
        points,
        static_force=[1.0],
        harmonic_force=[0.2],
        frequencies=[0.9 * HZ],
        harmonics=range(4),
    ).balance
    more, less = (
        load_curve(b, 0.9 * HZ, [1.0, 2.0], static=True),
        load_curve(b, 0.9 * HZ, [1.0, 0.5]),
    )
    assert (more.status, less.status) == ("complete", "complete")
    assert more.amplitude([1.0])[-1] == pytest.approx(2 * less.amplitude([1.0])[-1], rel=1e-7)


@pytest.mark.parametrize("factors", [[1.0], [1.0, 2.0, 1.5], [1.0, 1.0]])
def test_factors_must_go_one_way(factors: list[float]) -> None:
    with pytest.raises(InputError, match="rise, or fall"):
        load_curve(jenkins(), W * HZ, factors)  # type: ignore[arg-type]
