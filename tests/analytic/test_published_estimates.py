"""The published set of synthetic sequences: how often the estimate bounds the error."""

import importlib.util
import sys
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from upd.vary.orders import estimate_error

FILE = Path(__file__).parents[2] / "benchmarks" / "accuracy" / "bench_estimates.py"
#: short enough for a test; the benchmark has ten times as many
COUNT = 400


@pytest.fixture(scope="module")
def bench():
    spec = importlib.util.spec_from_file_location("bench_estimates", FILE)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_estimate_bounds_95_per_cent_of_the_published_set(bench) -> None:
    found = bench.shares(bench.synthetic(count=COUNT))
    assert bench.bounded(found["all"]) >= bench.WANTED
    # Not by being useless: half of the estimates are within six times the error.
    assert np.median(found["all"]) < 6.0


def test_set_holds_what_it_says(bench) -> None:
    sequences = list(bench.synthetic(count=COUNT))
    assert {len(one.h) for one in sequences} == {2, 3, 4, 5, 6}
    orders = [one.order for one in sequences]
    assert 0.7 <= min(orders) < 0.75 and 2.95 < max(orders) <= 3.0
    again = list(islice(bench.synthetic(), 3))
    assert [one.values.tolist() for one in again] == [one.values.tolist() for one in sequences[:3]]


def test_no_factor_of_safety_misses_the_share(bench) -> None:
    """Richardson's plain error of an assumed order, judged by the same measure."""
    below = [
        estimate_error(one.h[-2:], one.values[-2:]).error / 3.0
        < abs(one.values[-1] - one.limit) / abs(one.values[-1])
        for one in bench.synthetic(count=COUNT)
    ]
    assert np.mean(below) > 0.05


def test_a_real_ladder_with_a_closed_form_is_bounded(bench) -> None:
    ratios = bench.jenkins((32, 64, 128, 256)).ratios()
    assert bench.bounded(ratios) >= bench.WANTED
