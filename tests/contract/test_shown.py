"""Public results print on ten lines at most, whatever the size of their arrays."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
from typing import Any

import numpy as np
import pytest

from upd.contact import normal_contact, tangential_contact, tilted_contact
from upd.hbm import System, contacts, frequency_response
from upd.labels import Shown
from upd.reference import half_space_compliance

ROOMS = ("contact", "hbm", "reduction", "fem", "linalg", "dynamics", "matrices", "measured")


def public() -> list[type[Any]]:
    found = []
    for room in ROOMS:
        module = importlib.import_module(f"upd.{room}")
        found += [one for one in vars(module).values() if inspect.isclass(one)]
    return [one for one in found if dataclasses.is_dataclass(one)]


@pytest.mark.parametrize("kind", public(), ids=lambda kind: kind.__name__)
def test_a_result_with_arrays_prints_them_as_shapes(kind: type[Any]) -> None:
    arrays = [f.name for f in dataclasses.fields(kind) if f.repr and "Array" in str(f.type)]
    assert not arrays or kind.__name__ == "FrequencyResponse" or issubclass(kind, Shown)


def test_what_is_printed() -> None:
    C = 2 * half_space_compliance(20, 20, 0.5, 0.5, 2e5, 0.3)
    k = np.arange(400)
    arms = np.column_stack([k % 20, k // 20]) * 0.5 - 4.75
    slider = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=1.0, mu=1.0, preload=0.5)
    results = (
        normal_contact(C, np.zeros(400), load=100.0),
        tangential_contact(C, np.full(400, 0.1), load=10.0),
        tilted_contact(C, np.zeros(400), arms, load=100.0),
        slider,
        frequency_response(
            System((np.eye(1), 0.02 * np.eye(1), np.eye(1)), slider, harmonics=(1, 3)),
            harmonic_force=[0.3],
            frequencies=np.linspace(0.15, 0.3, 16),
        ),
    )
    for one in results:
        assert len(repr(one).splitlines()) <= 10
        assert len(repr(one)) < 1000
    assert repr(results[0]).startswith("NormalContact: force (400,) ")
    assert "status converged" in repr(results[0])
