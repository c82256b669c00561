"""Figures, units and names as they are printed: in the terminal, in the report, in notebooks."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any


def percent(value: float | None) -> str:
    """A fraction as a signed percentage."""
    return "" if value is None else f"{100.0 * value:+.2f} %"


def percent_of(error: float | None) -> str:
    """A bound of an error as a percentage of two digits, "not found" where there is none."""
    if error is None:
        return "not found"
    return f"{100.0 * error:.2g} %" if error < 1.0 else f"{100.0 * error:.0f} %"


def plus_minus(entry: Mapping[str, Any]) -> str:
    """The estimated error of a result of summary.json beside its value, "" where not known."""
    error = entry.get("estimated_error")
    known = error is not None and not entry.get("withheld")
    return f"±{percent_of(error)}" if known else ""


def number(value: float | None, unit: str = "") -> str:
    """Four or five significant digits with the unit."""
    if value is None:
        return ""
    text = f"{value:.5g}" if 1e-3 <= abs(value) < 1e6 or value == 0.0 else f"{value:.4e}"
    return f"{text} {unit}".rstrip()


def shown(entry: Mapping[str, Any], *, unit: bool = True) -> str:
    """The value of a result of summary.json with its unit, or that it was not reached."""
    if entry.get("withheld"):
        return "not reached"
    text = number(entry["value"])
    return f"{text} {unit_label(entry['unit'])}".rstrip() if unit else text


def check_number(check: Mapping[str, Any], key: str, digits: int = 2) -> str:
    """Value or limit of a check of summary.json; in per cent where it is a change of a result."""
    value = check[key]
    if value is None:
        return "not found"
    return f"{100.0 * value:.{digits}g} %" if check.get("quantity") else f"{value:.{digits}g}"


def check_words(check: Mapping[str, Any]) -> str:
    """The statement of a check of summary.json, its value and its limit."""
    value, limit = (check_number(check, key, 3) for key in ("value", "limit"))
    return f"{check['says']} = {value} (limit {limit})"


def sentence(words: str, end: str = ".") -> str:
    """Words as a sentence: a capital first; nothing of none."""
    return f"{words[:1].upper()}{words[1:]}{end}" if words else ""


def counted(count: int, what: str) -> str:
    """1 point, 2 points, 3 meshes."""
    return f"{count} {what}{'' if count == 1 else 'es' if what.endswith('sh') else 's'}"


def listed(items: Iterable[str], most: int | None, form: str = "{}") -> str:
    """Items, each once, the first ``most`` by name, in a text; nothing of none."""
    found = [item for item in dict.fromkeys(items) if item]
    more = [f"and {len(found) - most} more"] if most and len(found) > most else []
    return form.format("; ".join([*found[:most], *more])) if found else ""


def file_name(title: str) -> str:
    """A title as the name of a file or variable."""
    return re.sub(r"\W+", "_", title).strip("_")


#: unit in the files -> the same in print
_UNITS = {"um": "µm", "um2": "µm²", "mm2": "mm²", "(m/s2)/N": "(m/s²)/N"}


def unit_label(unit: str) -> str:
    """A unit as it is printed."""
    return _UNITS.get(unit, unit)


class Shown:
    """Base of results with arrays: they print as shapes and ranges, on ten lines at most."""

    def __repr__(self) -> str:
        known: Any = self
        parts = [f"{one.name} {_shown_field(getattr(self, one.name))}" for one in fields(known)]
        lines = textwrap.wrap(f"{type(self).__name__}: {', '.join(parts)}", 100)
        return "\n  ".join(lines if len(lines) <= 10 else [*lines[:9], "..."])


def _shown_field(value: Any) -> str:
    """A value in few characters: an array by its shape and range."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, (str, int)) or value is None:
        return str(value)
    shape = getattr(value, "shape", None)
    if shape is None:
        return type(value).__name__
    if not shape or 0 in shape or not hasattr(value, "ravel"):
        return str(shape or value)
    flat = abs(value.ravel()) if value.dtype.kind == "c" else value.ravel()
    ranges = f" {flat.min():.4g} to {flat.max():.4g}" if flat.dtype.kind in "fiu" else ""
    return f"{shape}{ranges}"
