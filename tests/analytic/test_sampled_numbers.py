"""First-order bands beside samples of inputs: against powers of the inputs in closed form."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import qmc

from upd.results import InputPart
from upd.results.sampled import AGREES, DIFFERS, LIMITS, UNKNOWN_BAND, SampledNumber, sampled_number

Draw = Callable[[int, int, int], np.ndarray]


def shifts(n: int, inputs: int, seed: int) -> np.ndarray:
    """A Latin hypercube between the limits, zeros first."""
    drawn = qmc.LatinHypercube(inputs, rng=np.random.default_rng(seed)).random(n)
    return np.vstack([np.zeros(inputs), 2.0 * drawn - 1.0])


def independent(n: int, inputs: int, seed: int) -> np.ndarray:
    """Independent draws between the limits, zeros first."""
    drawn = np.random.default_rng(seed).uniform(-1.0, 1.0, (n, inputs))
    return np.vstack([np.zeros(inputs), drawn])


def sampled(
    powers: dict[str, float],
    half: float,
    n: int,
    seed: int,
    wrong: float = 1.0,
    draw: Draw = shifts,
) -> SampledNumber:
    """The product of the inputs to their powers, all known within ``half`` of their values."""
    z = draw(n, len(powers), seed)
    values = 3.0 * np.prod((1.0 + half * z) ** np.array(list(powers.values())), axis=1)
    parts = [InputPart(path, half, wrong * p * half, "exact") for path, p in powers.items()]
    return sampled_number("q", "", "N", values, z, list(powers), parts)


def true_ratio(power: float, half: float) -> float:
    """Deviation of (1 + half z)^power over that to first order, z even between -1 and 1."""

    def moment(p: float) -> float:
        return ((1.0 + half) ** (p + 1.0) - (1.0 - half) ** (p + 1.0)) / (2.0 * half * (p + 1.0))

    deviation = math.sqrt(moment(2.0 * power) - moment(power) ** 2)
    return deviation / (abs(power) * half / LIMITS)


HERTZ = {"F": 1 / 3, "E": 2 / 3}


@pytest.mark.parametrize("n", [4, 12, 60])
def test_a_linear_number_agrees_on_every_sample(n: int) -> None:
    """The first order is exact: so is the ratio, however few the points."""
    for seed in range(20):
        one = sampled({"F": 1.0}, 0.3, n, seed)
        assert one.outcome == AGREES
        assert one.band == pytest.approx(one.first_order, rel=1e-12)
        assert one.band_high == pytest.approx(one.band_low, rel=1e-9)


def test_hertz_within_five_per_cent_agrees() -> None:
    """p_0 ~ F^(1/3) E^(2/3): the deviation of 40 points is known to a tenth, the ratio far better;
    95 of 100 samples are to agree, and more do, for a Latin hypercube errs less than it is told.
    """
    found = [sampled(HERTZ, 0.05, 40, seed) for seed in range(100)]
    assert sum(one.outcome == AGREES for one in found) >= 95
    one = found[0]
    assert one.first_order == pytest.approx(0.05 * math.hypot(*HERTZ.values()))
    assert one.band == pytest.approx(one.first_order, rel=0.01)
    assert one.deviation == pytest.approx(3.0 * one.first_order / LIMITS, rel=0.2)


@pytest.mark.parametrize(("power", "half"), [(1 / 3, 0.9), (-2.0, 0.5), (4.0, 0.6)])
def test_what_wide_intervals_make_of_a_power_is_told(power: float, half: float) -> None:
    """The interval of the sampled band holds the band in closed form in 95 % of the samples of
    independent draws, give or take a binomial spread of 1.5 %; a Latin hypercube errs less. The
    first-order band is told to differ.
    """
    for draw, low, high in ((independent, 180, 199), (shifts, 190, 200)):
        assert low <= _held(power, half, draw) <= high


def _held(power: float, half: float, draw: Draw) -> int:
    """Samples of 200 whose interval holds the band in closed form."""
    found = [sampled({"F": power}, half, 60, seed, draw=draw) for seed in range(200)]
    exact = true_ratio(power, half)
    held = sum(
        one.band_low <= exact * one.first_order <= one.band_high
        for one in found
        if one.band_low is not None
    )
    assert sum(one.outcome == DIFFERS for one in found) >= 195
    word = "wider" if exact > 1.0 else "narrower"
    assert sum(word in one.verdict for one in found) >= 0.5 * len(found)
    return held


def test_a_wrong_derivative_is_told() -> None:
    """Twice too large a derivative: the band is told as half as wide."""
    one = sampled(HERTZ, 0.05, 40, 0, wrong=2.0)
    assert one.outcome == DIFFERS
    assert one.verdict.startswith("50 % narrower")


def test_signs_of_changes_count() -> None:
    """q = F / E with the same sign for both would still have the right band, and none of its
    points.
    """
    z = shifts(60, 2, 1)
    values = (1.0 + 0.1 * z[:, 0]) / (1.0 + 0.1 * z[:, 1])
    right = [InputPart("F", 0.1, 0.1, "x"), InputPart("E", 0.1, -0.1, "x")]
    wrong = [InputPart("F", 0.1, 0.1, "x"), InputPart("E", 0.1, 0.1, "x")]
    found = [sampled_number("q", "", "", values, z, ["F", "E"], parts) for parts in (right, wrong)]
    assert found[0].first_order == found[1].first_order
    widths = [one.band_high - one.band_low for one in found]
    assert widths[0] < 0.2 * widths[1]


def test_what_cannot_be_compared_says_why() -> None:
    """No band, a number that is zero, points without it."""
    z = shifts(6, 1, 0)
    parts = [InputPart("F", 0.1, 0.1, "x")]
    lost = [InputPart("F", 0.1, math.nan, "no such peak")]
    values = 2.0 + 0.2 * z[:, 0]

    def told(values: np.ndarray, parts: list[InputPart]) -> SampledNumber:
        return sampled_number("q", "", "N", values, z, ["F"], parts)

    for values_, parts_, why in (
        (values, [], "none of the run's main numbers"),
        (values, lost, "F: no such peak"),
        (0.0 * values, parts, "is 0"),
        (np.full(7, np.nan), parts, "no number"),
        (np.r_[values[:3], np.full(4, np.nan)], parts, "too few points"),
    ):
        one = told(values_, parts_)
        assert one.outcome == UNKNOWN_BAND
        if why.startswith("none of"):
            assert one.band == pytest.approx(math.sqrt(3.0) * np.std(values[1:], ddof=1) / 2.0)
        assert why in one.verdict
    some = told(np.r_[values[:5], math.nan, math.nan], parts)
    assert some.count == 4
    assert some.verdict == "agrees; 2 of 6 points have no such number"
    assert told(np.full(7, 2.0), [InputPart("F", 0.1, 0.0, "x")]).outcome == AGREES


def test_ends_are_quantiles_only_of_enough_points() -> None:
    """2.5 % of 40 points is one of them."""
    for n in (39, 40):
        z = shifts(n, 1, 0)
        values = 1.0 + z[:, 0]
        one = sampled_number("q", "", "", values, z, ["F"], [InputPart("F", 1.0, 1.0, "x")])
        assert one.resolved == (n == 40)
        assert (one.high == values[1:].max()) == (n < 40)
