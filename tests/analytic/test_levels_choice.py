"""The cheapest combination of levels: against all of them, and on sources with known errors."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest

from upd.analyses.levels_choice import (
    Knob,
    LevelForecast,
    Levels,
    Round,
    require_named,
    shares_of,
)
from upd.errors import InputError
from upd.results import Case, ErrorPart, Result

CASE = Case()
MESH = Knob(("mesh",), "mesh", ("1", "2", "4", "8"), (1.0, 1 / 4, 1 / 16, 1 / 64))
MODES = Knob(("modes",), "modes", ("5", "10", "20"), (1.0, 1 / 4, 1 / 16))
STEPS = Knob(("samples", "steps"), "steps", ("1", "2", "4"), (1.0, 1 / 4, 1 / 16))
KNOBS = (MESH, MODES, STEPS)
PRICE = ((1.0, 8.0, 64.0, 512.0), (1.0, 1.5, 2.0), (3.0, 6.0, 12.0))


def seconds(levels: Levels) -> float:
    """Mesh and modes multiply, steps come on top."""
    mesh, modes, steps = (PRICE[k][level] for k, level in enumerate(levels))
    return mesh * modes + steps


def parts(mesh: float, modes: float, steps: float) -> dict[str, float]:
    return {"mesh": mesh, "modes": modes, "steps": steps}


def all_levels() -> list[Levels]:
    return list(product(*(range(len(knob.labels)) for knob in KNOBS)))


@pytest.mark.parametrize("seed", range(20))
def test_the_choice_is_the_cheapest_of_all_combinations(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shares = {
        (name, CASE): parts(*10.0 ** rng.uniform(-2.0, 1.5, 3)) for name in ("frequency", "height")
    }
    now, forecast = Round((0, 0, 0), shares), LevelForecast(KNOBS)
    good = [one for one in all_levels() if forecast.reaches(now, one)]
    found = forecast.cheapest(now, seconds)
    if not good:
        assert found is None
        return
    assert found is not None
    assert seconds(found) == min(map(seconds, good))


def test_what_does_not_fit_is_never_chosen() -> None:
    now = Round((0, 0, 0), {("frequency", CASE): parts(8.0, 0.1, 0.1)})
    forecast = LevelForecast(KNOBS)
    assert forecast.cheapest(now, seconds) == (2, 0, 0)
    assert forecast.cheapest(now, lambda one: math.inf if one[0] > 1 else 1.0) is None


def test_levels_never_fall() -> None:
    """However small an error is found: rounds end because levels only rise."""
    now = Round((1, 2, 1), {("frequency", CASE): parts(1e-3, 1e-3, 2.0)})
    found = LevelForecast(KNOBS).cheapest(now, seconds)
    assert found == (1, 2, 2)


def test_rounds_find_the_cheapest_of_what_they_learn() -> None:
    """Errors that fall slower than expected, as (expected fall)^(1/2): the rounds end at the levels
    that all combinations, with their true errors, show to be the cheapest.
    """
    first = {"frequency": parts(1.5, 0.2, 0.3), "height": parts(0.2, 0.1, 2.2)}

    def true(levels: Levels) -> dict[tuple[str, Case], dict[str, float]]:
        falls = {
            source: knob.falls[level] ** 0.5
            for knob, level in zip(KNOBS, levels, strict=True)
            for source in knob.sources
        }
        return {
            (name, CASE): {source: error * falls[source] for source, error in mine.items()}
            for name, mine in first.items()
        }

    forecast, levels, rounds = LevelForecast(KNOBS), (0, 0, 0), list[Round]()
    while True:
        now = Round(levels, true(levels))
        if rounds:
            forecast.learn(rounds[-1], now)
        rounds.append(now)
        if now.miss[0] <= 1.0:
            break
        raised = forecast.cheapest(now, seconds)
        assert raised is not None
        assert sum(raised) > sum(levels)
        levels = raised
    assert len(rounds) > 2  # the first forecast was too good
    assert forecast.powers == pytest.approx(dict.fromkeys(forecast.powers, 0.5))
    reached = [one for one in all_levels() if Round(one, true(one)).miss[0] <= 1.0]
    assert seconds(levels) == min(map(seconds, reached))
    alike = forecast.alike(rounds[-1])
    assert alike is not None
    assert len(set(alike[1:])) == 1
    assert seconds(alike) > seconds(levels)


def test_an_error_that_does_not_fall_is_given_up() -> None:
    """A motion that other levels lose: after a second step no level is expected to help, and the
    reason is named. One step alone may show the estimates more than the error.
    """
    key = ("height", CASE)
    first = Round((0, 0, 0), {key: parts(5.0, 0.1, 0.1)})
    second = Round((2, 0, 0), {key: parts(6.0, 0.1, 0.1)})
    third = Round((3, 0, 0), {key: parts(6.0, 0.1, 0.1)})
    forecast = LevelForecast(KNOBS)
    assert forecast.cheapest(first, seconds) == (2, 0, 0)
    forecast.learn(first, second)
    assert forecast.powers == {0: 0.5}
    forecast.learn(second, third)
    assert forecast.powers == {0: 0.0}
    assert forecast.cheapest(third, seconds) is None
    assert forecast.obstacle(third) == "height: most of it by mesh"


def test_what_scatters_is_tried_on_one_level_more() -> None:
    """Estimates in no order may be low on the next level; each knob is raised for that once, and
    only as far as the memory goes.
    """
    key = ("height", CASE)
    forecast = LevelForecast(KNOBS)
    first, second, third = (
        Round((k, 0, 0), {key: parts(error, 0.1, 0.1)}) for k, error in enumerate((5.0, 6.0, 5.0))
    )
    assert forecast.one_more(first, [key], first.levels, seconds) is None  # its fall is not known
    forecast.learn(first, second)
    forecast.learn(second, third)
    assert forecast.cheapest(third, seconds) is None
    assert forecast.one_more(third, [key], third.levels, lambda _: math.inf) is None
    assert forecast.one_more(third, [key], (2, 1, 0), seconds) == (3, 1, 0)
    assert forecast.one_more(third, [key], third.levels, seconds) is None
    top = Round((3, 0, 0), {key: parts(5.0, 0.1, 0.1)})
    again = LevelForecast(KNOBS, powers={0: 0.5})
    assert again.one_more(top, [key], top.levels, seconds) is None
    lost = Round((2, 0, 0), {key: parts(5.0, math.nan, 0.1)})
    assert again.one_more(lost, [key], lost.levels, seconds) is None


def test_an_error_without_an_estimate_is_no_small_one() -> None:
    now = Round((0, 0, 0), {("height", CASE): parts(math.nan, 0.1, 0.1)})
    assert now.miss == (math.inf, ("height", CASE))
    assert LevelForecast(KNOBS).cheapest(now, seconds) is None
    assert "no estimate of what mesh leave" in LevelForecast(KNOBS).obstacle(now)
    assert Round((0, 0, 0), {}).miss == (math.inf, None)


def test_shares_are_errors_over_what_is_wanted_of_the_number() -> None:
    found = shares_of(
        {
            ("peak_1_frequency", CASE): (
                ErrorPart("mesh", 0.004, ""),
                ErrorPart("mesh", 0.002, ""),
            ),
            ("peak_1_accelerance", CASE): (ErrorPart("modes", 0.05, ""),),
            ("static_N", CASE): (ErrorPart("mesh", 0.5, ""),),
        },
        {"peak_?_frequency": 0.002, "peak_?_accelerance": 0.05},
    )
    assert found == {
        ("peak_1_frequency", CASE): {"mesh": pytest.approx(3.0)},
        ("peak_1_accelerance", CASE): {"modes": pytest.approx(1.0)},
    }


def test_names_that_no_number_has_are_refused() -> None:
    numbers = [Result("K_N", CASE, 1.0, "N/mm")]
    require_named({"K_*": 0.01}, numbers)
    with pytest.raises(InputError, match=r"accuracy: K_X, K_Y: this run has no number .* K_N"):
        require_named({"K_X": 0.01, "K_Y": 0.01, "K_N": 0.1}, numbers)
