"""Estimated errors of levels that converge and that scatter, and what they are made of."""

from __future__ import annotations

import math
import re
import weakref
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from upd.analyses.contact.plan import make_plan
from upd.analyses.contact.varied import PROBLEM
from upd.errors import InputError
from upd.progress import Stages
from upd.results import Case, ErrorPart, Result, with_parts
from upd.results.number import with_estimates
from upd.scene import load_scene
from upd.vary.errors import half_cost, merged, source_estimates
from upd.vary.orders import estimate_error, fitted_error
from upd.vary.solve import solve as solve_variations
from upd.vary.variation import RUN, Problem, SolvedVariation, Variation

#: sizes of a run and its companions, ratio sqrt 2
SIZES = np.array([1.0, 2.0**0.5, 2.0, 2.0**1.5])


@pytest.mark.parametrize("order", [0.5, 1.0, 1.3, 2.0])
def test_levels_without_scatter_get_roaches_factor(order: float) -> None:
    """q = 1 + 0.05 h^p: the error of the finest is 0.05 of 1.05, the bound 1.25 times it."""
    found = fitted_error(SIZES, 1.0 + 0.05 * SIZES**order)
    # the order is looked for in steps of 1/20
    assert found.error == pytest.approx(1.25 * 0.05 / 1.05, rel=0.02)
    assert found.order == pytest.approx(order, abs=0.026)


def test_scatter_is_bounded_as_often_as_the_interval_says() -> None:
    """Noise with the deviation 0.01 h^1.5 on a number that has converged: the 95 % interval of
    Student's t bounds it in 95 % of draws at least, and is no cry of alarm.
    """
    g = np.random.default_rng(7)
    noise = 0.01 * SIZES**1.5 * g.standard_normal((400, 4))
    error = np.array([fitted_error(SIZES, 1.0 + one).error for one in noise])
    true = np.abs(noise[:, 0] / (1.0 + noise[:, 0]))
    assert np.mean(error >= true) >= 0.95
    assert np.median(error) < 0.1
    assert np.mean([np.isfinite(fitted_error(SIZES, 1.0 + one).order) for one in noise]) < 0.2


def test_few_levels_are_judged_by_their_differences() -> None:
    values = 1.0 + 0.05 * SIZES
    assert fitted_error(SIZES[:3], values[:3]) == estimate_error(SIZES[:3], values[:3])
    assert fitted_error(SIZES, np.ones(4)).error == 0.0
    assert math.isinf(fitted_error(SIZES, SIZES - 1.0).error)


@pytest.mark.parametrize(("first", "second"), [(1.2, 0.9), (0.9, 1.2)])
def test_orders_that_change_are_taken_on_to_the_next(first: float, second: float) -> None:
    """Sizes 1, 2, 4, 8 with the differences d, d 2^p, d 2^(p + q): orders q and p, coarse and fine;
    as far below the lower comes 1.25 d / (2^r - 1).
    """
    size = np.array([1.0, 2.0, 4.0, 8.0])
    steps = np.array([1.0, 2.0**second, 2.0 ** (second + first)])
    q = np.concatenate([[1.0], 1.0 + 0.001 * np.cumsum(steps)])
    found = estimate_error(size, q)
    assert found.error == pytest.approx(1.25 * 0.001 / (2.0**0.6 - 1.0))
    assert f"{first:.1f} and {second:.1f} of four levels, 0.6 to come" in found.basis


def test_orders_that_change_too_much_are_not_taken_on() -> None:
    size, steps = np.array([1.0, 2.0, 4.0, 8.0]), np.array([1.0, 2.0, 2.0 * 2.0**1.8])
    found = estimate_error(size, np.concatenate([[1.0], 1.0 + 0.001 * np.cumsum(steps)]))
    # orders 1.8 and 1.0: 0.2 to come is no convergence
    assert found.basis == "order 1.0 of three levels, factor 3"
    assert found.error == pytest.approx(3.0 * 0.001)


NUMBER = Result("K_N", Case(load=50.0), 105.0, "N/mm")
SOLVED = SolvedVariation(RUN, [NUMBER])


def solved(*values: float) -> list[SolvedVariation]:
    return [
        SolvedVariation(
            Variation("mesh", f"{h:.3g}", size=float(h)), [replace(NUMBER, value=v)], 2.0
        )
        for h, v in zip(SIZES[1:], values, strict=False)
    ]


def test_a_number_gets_the_part_of_its_companions() -> None:
    levels = solved(*(100.0 + 5.0 * SIZES[1:] ** 2))
    found = source_estimates("mesh", SOLVED, levels, lambda order: (10.0 * order, ""))
    (part,) = found["K_N", NUMBER.case]
    assert part.source == "mesh"
    assert part.error == pytest.approx(1.25 * 5.0 / 105.0, rel=1e-6)
    assert part.half_cost_s == pytest.approx(20.0)
    assert "1.41, 2, 2.83" in part.basis


def test_a_half_out_of_reach_says_why() -> None:
    """No seconds of a mesh that this machine cannot hold: what it needs."""
    plan = make_plan(load_scene("hertz", {"solver.memory": "6 GB"}))
    levels = solved(*(100.0 + 5.0 * SIZES[1:] ** 0.5))
    found = source_estimates("mesh", SOLVED, levels, partial(half_cost, PROBLEM, plan, "mesh", 2.0))
    (part,) = found["K_N", NUMBER.case]
    assert part.half_cost_s is None
    assert re.fullmatch(r"needs \S+ GB, there are 6", part.half_words)
    levels = solved(*(100.0 + 5.0 * SIZES[1:] ** 2))
    near = source_estimates("mesh", SOLVED, levels, partial(half_cost, PROBLEM, plan, "mesh", 2.0))
    assert re.fullmatch(r"\+\S+ s", near["K_N", NUMBER.case][0].half_words)


def test_what_no_companion_shows_is_not_called_small() -> None:
    """Rule: a number whose error was not found has no error, and says why."""
    lost = SolvedVariation(Variation("mesh", "8 x 8"), reason="8 x 8: too coarse")
    found = source_estimates("mesh", SOLVED, [lost], lambda order: (1.0, ""))
    (part,) = found["K_N", NUMBER.case]
    assert not part.known
    assert part.basis == "8 x 8: too coarse"
    told = with_parts(NUMBER, (part, ErrorPart("samples", 0.01, "twice as many")))
    assert told.estimated_error is None
    assert told.as_dict()["error_parts"][0]["error"] is None


def test_parts_add_up_and_the_largest_tells_the_cost() -> None:
    parts = {
        source: {("K_N", NUMBER.case): (ErrorPart(source, error, "made up", cost),)}
        for source, error, cost in (("mesh", 0.01, 5.0), ("harmonics", 0.02, 7.0))
    }
    (told,) = with_estimates([NUMBER], merged(*parts.values()))
    assert told.estimated_error == pytest.approx(0.03)
    # A number keeps the parts it has.
    own = with_parts(NUMBER, (ErrorPart("Betti", 0.5, "own"),))
    assert with_estimates([own], merged(*parts.values())) == (own,)


@pytest.mark.parametrize(
    ("value", "other", "why"),
    [(0.0, 0.0, "the number is zero"), (2.0, -1.0, "the other sign"), (2.0, 0.0, "zero or")],
)
def test_what_has_no_sign_has_no_relative_error(value: float, other: float, why: str) -> None:
    run = SolvedVariation(RUN, [replace(NUMBER, value=value)])
    levels = solved(other)
    (part,) = source_estimates("mesh", run, levels, lambda _: (7.0, ""))["K_N", NUMBER.case]
    assert not part.known
    assert why in part.basis


def test_a_variation_is_let_go_before_the_next_is_solved() -> None:
    """Its factors are the memory of the next. A fault is a reason."""

    class Factors:
        pass

    held = list[weakref.ref[Factors]]()

    def solve(refine: int, stages: Stages) -> Factors:
        assert [one for one in held if one() is not None] == []
        if refine == 3:
            raise InputError("too fine")
        factors = Factors()
        held.append(weakref.ref(factors))
        return factors

    problem = Problem(
        make_plan=lambda scene: scene.geometry["refine"],
        solve=solve,
        make_results=lambda _: [NUMBER],
        bare=lambda _: (),
        levels=lambda _: {},
        finer=lambda *_: (),
    )
    finer = [Variation("mesh", f"{n}", (("geometry.refine", n),)) for n in (1, 2, 3)]
    found = solve_variations(problem, load_scene("rig"), finer, Stages())
    assert len(held) == 2
    assert [one.reason for one in found] == ["", "", "3: too fine"]
    assert found[1].values == SOLVED.values
