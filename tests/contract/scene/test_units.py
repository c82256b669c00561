"""Quantities at the door."""

import pytest

from upd.errors import InputError
from upd.units import UNITS, parse_quantity


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("200 GPa", "stress", 2e5),
        ("5 mm", "length", 5.0),
        ("0.005 m", "length", 5.0),
        ("5000um", "length", 5.0),
        ("1e-6 N", "force", 1e-6),
        ("7800 kg/m3", "density", 7.8e-9),
        ("1 %", "fraction", 0.01),
        (0.25, "fraction", 0.25),
        ("2 GiB", "memory", 2.0**31),
    ],
)
def test_known(text: object, kind: str, value: float) -> None:
    assert parse_quantity(text, kind) == pytest.approx(value, rel=1e-15)


def test_the_same_length_in_m_and_mm_is_the_same_float() -> None:
    for mm in (5.0, 10.0, 1.0, 0.025, 0.3):
        assert parse_quantity(f"{mm * 1000:.12g} um", "length") == pytest.approx(mm, rel=2e-16)


@pytest.mark.parametrize(
    ("text", "kind", "told"),
    [
        (5, "length", "no unit"),
        ("5", "length", "no unit"),
        ("5 kN", "length", "is a unit of force"),
        ("5 furlong", "length", "not known"),
        ("five mm", "length", "not a number"),
        ("1e999 mm", "length", "not finite"),
        (True, "fraction", "not a fraction"),
        (None, "length", "not a length"),
        ("nan mm", "length", "not a number"),
    ],
)
def test_refused_with_the_remedy(text: object, kind: str, told: str) -> None:
    with pytest.raises(InputError, match=told) as caught:
        parse_quantity(text, kind)
    if kind != "fraction":
        assert next(iter(UNITS[kind])) in str(caught.value)
