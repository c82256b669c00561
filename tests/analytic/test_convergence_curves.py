"""Convergence curves of made-up ladders: what an error is taken against, and what scatter says."""

from dataclasses import replace

import numpy as np
import pytest

from upd.results import Case, Result
from upd.vary.curves import ConvergenceCurve, enough, make_curves
from upd.vary.outcome import Outcome, SolvedPoint
from upd.vary.variation import Variation

CASE = Case(load=200.0)
H = (1.0, 0.7, 0.5, 0.35)


def ladder(curve: str, numbers: dict[str, list[float]], n_dof: int, **closed: float):
    """A point per level; ``closed`` are closed forms of numbers."""
    return [
        SolvedPoint(
            Variation(curve, f"level {k}", (), H[k]),
            Outcome(
                results=tuple(
                    Result(name, CASE, v[k], "", closed.get(name)) for name, v in numbers.items()
                ),
                n_dof=n_dof * (k + 1),
            ),
        )
        for k in range(len(H))
    ]


def only(points: list[SolvedPoint], name: str, curve: str = "fine") -> ConvergenceCurve:
    (found,) = [c for c in make_curves(points, [name]) if c.curve == curve]
    return found


def power(limit: float, order: float) -> list[float]:
    return [limit + 0.1 * h**order for h in H]


def test_raw_approach_is_compared_with_closed_form_and_bodies() -> None:
    share = 0.07
    raw = [v + share for v in power(7.0, 1.0)]
    numbers = {"approach": raw, "approach_contact": power(7.0, 1.0)}
    points = ladder("fine", numbers, 100, approach=6.9, approach_contact=6.9)
    found = only(points, "approach")
    assert found.against == "reference, same bodies"
    assert found.reference == pytest.approx(6.9 + share)
    assert found.error[-1] == pytest.approx(raw[-1] / 6.97 - 1.0)


def test_finer_level_of_another_ladder_comes_before_the_own_extrapolation() -> None:
    points = ladder("coarse", {"K": power(3.0, 1.0)}, 10) + ladder(
        "fine", {"K": power(3.1, 2.0)}, 100
    )
    coarse, fine = only(points, "K", "coarse"), only(points, "K")
    assert coarse.against == "finer level, fine level 3"
    assert coarse.reference == power(3.1, 2.0)[-1]
    assert fine.against == "its own extrapolation"
    assert fine.reference == pytest.approx(3.1, rel=1e-3)


def test_closed_form_comes_first() -> None:
    points = ladder("coarse", {"p": power(3.0, 1.0)}, 10, p=2.9) + ladder(
        "fine", {"p": power(3.0, 1.0)}, 100, p=2.9
    )
    assert only(points, "p", "coarse").against == only(points, "p").against == "reference"
    assert only(points, "p", "coarse").reference == pytest.approx(2.9)


def test_a_level_whose_number_is_zero_leaves_no_closed_form() -> None:
    """The radius where one node touches is zero: its error does not tell what it should be."""
    found = only(ladder("fine", {"a": [0.0, *power(3.0, 1.0)[1:]]}, 100, a=2.9), "a")
    assert found.against == "finest level, no clear order"
    assert np.isfinite(found.error).all()


def test_a_ladder_that_scatters_says_so() -> None:
    found = only(ladder("fine", {"K": [3.1, 2.9, 3.05, 3.0]}, 100), "K")
    assert found.verdict.startswith("no clear order")
    assert np.isnan(found.order)
    assert found.against == "finest level, no clear order"
    assert found.estimate is not None
    assert np.isnan(found.estimate.order)
    # An error that changes sign scatters too, closed form or not.
    signs = only(ladder("fine", {"p": [3.1, 2.9, 3.05, 2.99]}, 100, p=3.0), "p")
    assert np.isnan(signs.order)
    assert signs.verdict.startswith("no clear order")


def test_a_clean_ladder_has_its_order_and_estimate() -> None:
    found = only(ladder("fine", {"K": power(3.0, 1.5)}, 100), "K")
    assert found.order == pytest.approx(1.5, abs=0.1)
    assert found.verdict == "converges, order 1.5"
    assert found.estimate is not None
    assert found.estimate.error == pytest.approx(
        1.25 * abs(power(3.0, 1.5)[-1] - 3.0) / power(3.0, 1.5)[-1], rel=1e-6
    )


def test_no_estimate_without_a_limit() -> None:
    found = only(ladder("fine", {"p": [h**-0.6 for h in H]}, 100), "p")
    assert "no limit" in found.verdict
    assert found.estimate is None


def test_the_level_that_is_enough_is_the_cheapest_that_stays_within() -> None:
    # the second level is within 1 % by chance, the third is not
    curve = only(
        ladder("fine", {"max_pressure": [3.3, 3.003, 3.06, 3.0015]}, 100, max_pressure=3.0),
        "max_pressure",
    )
    (sentence,) = enough([curve])
    words = "Maximum pressure F=200 N against reference: level 3 is enough for 0.1 %: 0.05 %"
    assert sentence.startswith(words)
    assert sentence.endswith("Order of convergence: none is clear.")
    slow = replace(curve, seconds=(1.0,) * 4)
    cheap = replace(slow, curve="cheap", error=(0.02, 0.009, 0.008, 0.007), seconds=(0.2,) * 4)
    (sentence,) = enough([slow, cheap])
    assert "cheap level 1 is enough for 1 %: 0.9 % in 0.2 s; fine level 3 is enough" in sentence
    (sentence,) = enough([only(ladder("fine", {"p": [3.3, 3.2, 3.1, 3.06]}, 100, p=3.0), "p")])
    assert "no level stays within 1 %, the finest has 2 %" in sentence
    assert enough([]) == ()
