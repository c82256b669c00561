"""Contact forces of one point against closed forms.

Jenkins loops, circular sliding, a contact that opens, slider starts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from upd.errors import InputError
from upd.hbm.core.fourier import analysis, harmonics, sample_count, synthesis
from upd.hbm.springs.coulomb import LIFT, SLIP, STICK
from upd.hbm.springs.points import Law, March, Start, contacts, march
from upd.reference.friction import jenkins_harmonic, jenkins_loop_area

FloatArray = NDArray[np.float64]


def law(k_n: float, k_t: float, mu: float, preload: float, gap: float = 0.0) -> Law:
    return contacts([[1.0]], [[1.0]], k_n=k_n, k_t=k_t, mu=mu, preload=preload, gap=gap).law


class Found(NamedTuple):
    """Coefficients of the force, and the period they are from."""

    force: FloatArray
    march: March


def force(
    parameters: Law, X: FloatArray, samples: int, highest: int = 1, start: Start = "zero"
) -> Found:
    h = harmonics(range(highest + 1))
    E, Q = synthesis(h, samples), analysis(h, samples)
    found = march(parameters, np.ascontiguousarray(X @ E.T), E, start=start)
    return Found(found.coefficients(Q), found)


@pytest.mark.parametrize("amplitude", [0.5, 1.0001, 1.2, 3.0, 20.0])
def test_jenkins(amplitude: float) -> None:
    # mu N / k_t = 1; the sampled loop misses the exact one by the square of a sample
    samples, k_t = 8192, 2.5
    X = np.zeros((1, 2, 3))
    X[0, 1, 1] = amplitude
    found = force(law(0.0, k_t, 0.5, 5.0), X, samples).force[0, 1]
    a1, b1 = jenkins_harmonic(amplitude, k_t, 0.5, 5.0)
    scale = k_t * amplitude
    np.testing.assert_allclose(found[1:], [a1, b1], rtol=0, atol=1e-6 * scale)
    assert -np.pi * amplitude * found[2] == pytest.approx(
        jenkins_loop_area(amplitude, k_t, 0.5, 5.0), abs=1e-6 * scale * amplitude * np.pi
    )


def test_jenkins_error_falls_with_the_square_of_the_sample() -> None:
    X = np.zeros((1, 2, 3))
    X[0, 1, 1] = 1.7
    exact = np.array(jenkins_harmonic(1.7, 1.0, 1.0, 1.0))
    counts = 2 ** np.arange(5, 13)
    errors = [
        np.linalg.norm(force(law(0.0, 1.0, 1.0, 1.0), X, int(n)).force[0, 1, 1:] - exact)
        for n in counts
    ]
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] > 1.7


def test_circular_sliding_is_isotropic() -> None:
    # w = A (cos, sin): steady slip with |T| = mu N at the angle acos(x_c/A) ahead of the
    # displacement, x_c = mu N/k_t
    A, k_t, limit, n = 4.0, 1.0, 1.0, 4096
    X = np.zeros((1, 3, 3))
    X[0, 1, 1], X[0, 2, 2] = A, A
    found = force(law(0.0, k_t, 1.0, limit), X, n)
    T = found.march.force[0, 1:]
    np.testing.assert_allclose(np.hypot(*T), limit, rtol=1e-12)
    assert found.march.periodic.all()
    phasor = found.force[0, 1, 1] - 1j * found.force[0, 1, 2]
    lead = np.arccos(limit / (k_t * A))
    assert phasor == pytest.approx(limit * np.exp(1j * lead), rel=(2 * np.pi / n) ** 2)


def test_opening_contact_is_a_clipped_cosine() -> None:
    # N = k_n max(0, cos): mean k_n/pi, first cosine k_n/2, second 2 k_n/(3 pi)
    X = np.zeros((1, 2, 5))
    X[0, 0, 1] = 1.0
    found = force(law(3.0, 1.0, 0.3, 0.0), X, 4096, highest=2)
    np.testing.assert_allclose(
        found.force[0, 0, [0, 1, 3]], 3 * np.array([1 / np.pi, 0.5, 2 / (3 * np.pi)]), rtol=1e-6
    )
    assert (found.march.state == LIFT).mean() == pytest.approx(0.5, abs=1e-3)


def point(tangents: int, preload: float) -> Law:
    rows = np.ones((tangents, 1, 1))
    return contacts([[1.0]], rows, k_n=2.0, k_t=1.5, mu=0.5, preload=preload).law


@pytest.mark.parametrize("tangents", [1, 2])
@pytest.mark.parametrize(
    ("preload", "states"), [(2.0, {STICK, SLIP}), (0.0, {STICK, SLIP, LIFT}), (-0.6, {LIFT})]
)
def test_a_motion_straight_between_its_samples_is_marched_exactly(
    tangents: int, preload: float, states: set[int]
) -> None:
    # the same polygon with seven times the samples: events fall anywhere within the long intervals
    rng = np.random.default_rng(4)
    corners, parts = 24, 7
    w = rng.uniform(-1, 1, size=(40, 1 + tangents, corners))
    share = np.arange(corners * parts) / parts
    fine = np.array(
        [[np.interp(share, np.arange(corners), row, period=corners) for row in p] for p in w]
    )
    parameters = point(tangents, preload).tiled(len(w))
    coarse, exact = (march(parameters, m, np.zeros((m.shape[-1], 1))) for m in (w, fine))
    assert states <= set(np.unique(coarse.state))
    forgets = coarse.periodic & exact.periodic & (coarse.state != STICK).any(axis=1)
    assert forgets.sum() >= 20
    np.testing.assert_allclose(
        coarse.force[forgets], exact.force[forgets][..., ::parts], rtol=0, atol=1e-11
    )
    if tangents == 1:
        # so is the force a polygon, and its mean is the area below
        np.testing.assert_allclose(
            coarse.weighed.mean(axis=-1)[forgets], exact.weighed.mean(axis=-1)[forgets], atol=1e-11
        )


@pytest.mark.parametrize("tangents", [1, 2])
@pytest.mark.parametrize("preload", [2.0, 0.3])
def test_error_falls_with_the_square_of_the_sample(tangents: int, preload: float) -> None:
    # at every sample and in the coefficients, with lift-off (preload 0.3) and slip in the plane
    h, fine, counts = harmonics(range(6)), 2**15, 2 ** np.arange(6, 12)
    decay = (1 + np.array([0, *np.repeat(np.arange(1, 6), 2)])) ** 2
    X = np.random.default_rng(2).normal(size=(20, 1 + tangents, h.size)) / decay
    parameters = point(tangents, preload).tiled(len(X))

    def found(n: int) -> Found:
        return force(parameters, X, n, h.highest)

    exact = found(fine)
    at_samples, of_coefficients = [], []
    for n in counts:
        one = found(int(n))
        at_samples.append(
            np.abs(one.march.force - exact.march.force[..., :: fine // n]).max(axis=(1, 2)).mean()
        )
        of_coefficients.append(np.abs(one.force - exact.force).max(axis=(1, 2)).mean())
    for errors in (at_samples, of_coefficients):
        assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] > 1.8


def test_gap_and_preload_are_one_shift() -> None:
    X = np.random.default_rng(1).normal(size=(1, 2, 3))
    one, other = (
        force(law(2.0, 1.0, 0.3, 1.0), X, 128),
        force(law(2.0, 1.0, 0.3, 0.0, gap=-0.5), X, 128),
    )
    np.testing.assert_allclose(one.force, other.force, rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize(
    ("start", "mean"), [("zero", 0.2), ("mid", 0.0), ("upper", 0.7), ("lower", -0.7)]
)
def test_start_decides_the_residual_traction_of_a_stuck_point(start: Start, mean: float) -> None:
    # traction 0.3 cos + mean stays inside +-1: any mean within +-0.7 is admissible
    X = np.zeros((1, 2, 3))
    X[0, 1, :2] = 0.2, 0.3
    found = force(law(0.0, 1.0, 1.0, 1.0), X, 64, start=start)
    np.testing.assert_allclose(found.force[0, 1], [mean, 0.3, 0.0], atol=1e-14)


def test_slipping_point_forgets_its_start() -> None:
    X = np.zeros((1, 2, 3))
    X[0, 1, :2] = 0.2, 3.0
    answers = [
        force(law(0.0, 1.0, 1.0, 1.0), X, 64, start=s).force
        for s in ("zero", "mid", "upper", "lower")
    ]
    for other in answers[1:]:
        np.testing.assert_allclose(other, answers[0], atol=1e-13)
    assert set(np.unique(force(law(0.0, 1.0, 1.0, 1.0), X, 64).march.state)) == {STICK, SLIP}


def test_samples_by_rule_and_refused_when_they_alias() -> None:
    assert sample_count(harmonics((0, 1))) == 128
    assert sample_count(harmonics(range(16))) == 256
    with pytest.raises(InputError, match="more than 62"):
        sample_count(harmonics(range(32)), 62)


def test_analysis_inverts_synthesis() -> None:
    h = harmonics((0, 1, 4, 31))
    np.testing.assert_allclose(analysis(h, 63) @ synthesis(h, 63), np.eye(h.size), atol=1e-13)


def test_faults_come_together() -> None:
    with pytest.raises(InputError, match=r"k_n must be >= 0; mu must be >= 0; k_t must be above 0"):
        contacts([[1.0]], [[1.0]], k_n=-1.0, k_t=0.0, mu=-0.1)
