"""The grid of a sweep: axes from texts like ``contact.friction=0.1:0.6:6`` and the full factorial
of their values.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from upd.errors import InputError
from upd.scene.toml import value_of

#: More points than this are refused: their files alone would fill a disk.
MOST_POINTS = 200_000
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\s\d].*?)?\s*")
_FORMS = "write path=first:last:count, path=first:last:count:log or path=value,value,..."


@dataclass(frozen=True)
class GridAxis:
    """One parameter of the scene and its values, as the scene takes them.

    Attributes
    ----------
    numbers
        The values in `unit`, or None when they are words.
    wrapped
        The scene's entry is a list; a value stands there alone in it.
    """

    path: str
    values: tuple[Any, ...]
    numbers: tuple[float, ...] | None
    unit: str = ""
    wrapped: bool = False

    @property
    def header(self) -> str:
        """Path with the unit."""
        return f"{self.path} [{self.unit}]" if self.unit else self.path

    def setting(self, k: int) -> Any:
        """What the scene is given for value `k`."""
        return [self.values[k]] if self.wrapped else self.values[k]

    def shown(self, k: int) -> float | str:
        """Value `k` for tables."""
        return str(self.values[k]) if self.numbers is None else self.numbers[k]


#: one point of a grid: its place along every axis
Place = tuple[int, ...]


def parse_axes(texts: Sequence[str], scene: Mapping[str, Any]) -> tuple[GridAxis, ...]:
    """Axes of ``--vary`` texts; numbers without a unit take that of the scene's own value.

    Raises InputError with all problems.
    """
    axes, problems = [], []
    for text in texts:
        try:
            axes.append(_axis(text, scene))
        except InputError as error:
            problems.append(str(error))
    paths = [axis.path for axis in axes]
    problems += [
        f"--vary {path}: is duplicated" for path in sorted({p for p in paths if paths.count(p) > 1})
    ]
    if not texts:
        problems.append(f"--vary: is missing; {_FORMS}")
    if problems:
        raise InputError("\n".join(problems))
    count = math.prod(len(axis.values) for axis in axes)
    if count > MOST_POINTS:
        raise InputError(
            f"--vary: the grid has {count} points, more than {MOST_POINTS}: give fewer values"
        )
    return tuple(axes)


def places(axes: Sequence[GridAxis]) -> list[Place]:
    """Full factorial of the axes, the last one fastest."""
    return list(itertools.product(*(range(len(axis.values)) for axis in axes)))


def values_at(axes: Sequence[GridAxis], place: Place) -> dict[str, Any]:
    """Path -> value of one point, as tables have it."""
    return {axis.path: axis.values[k] for axis, k in zip(axes, place, strict=True)}


def settings(axes: Sequence[GridAxis], place: Place) -> dict[str, Any]:
    """Path -> value of one point."""
    return {axis.path: axis.setting(k) for axis, k in zip(axes, place, strict=True)}


def _axis(text: str, scene: Mapping[str, Any]) -> GridAxis:
    path, sep, given = text.partition("=")
    path, given = path.strip(), given.strip()
    if not sep or not path or not given:
        raise InputError(f"--vary {text!r}: {_FORMS}")
    parts = [part.strip() for part in given.split(":")]
    ends = [end for end in map(_quantity, parts[:2]) if end is not None]
    now = _entry(scene, path)
    wrapped = isinstance(now, list)
    mine = _quantity(now[0] if wrapped and now else now)
    own = "" if mine is None else mine[1]
    if len(ends) == 2:
        values = _range(path, parts, ends, own)
    else:
        values = [_with_unit(value_of(part), own) for part in _listed(given)]
    if len(set(map(str, values))) < len(values):
        raise InputError(f"--vary {path}: a value is duplicated")
    numbers, unit = _numbers(values)
    return GridAxis(path, tuple(values), numbers, unit, wrapped)


def _listed(given: str) -> list[str]:
    parts = [part.strip() for part in given.split(",")]
    if not all(parts):
        raise InputError(f"--vary {given!r}: a value between the commas is missing")
    return parts


def _range(
    path: str, parts: Sequence[str], ends: Sequence[tuple[float, str]], own: str
) -> list[Any]:
    """Evenly spaced values, or in equal ratios with a fourth part "log"."""
    if not re.fullmatch(r"0*[1-9]\d*(:log)?", ":".join(parts[2:])):
        raise InputError(f"--vary {path}={':'.join(parts)}: {_FORMS}")
    logarithmic = len(parts) == 4
    (first, unit_a), (last, unit_b) = ends
    if unit_a and unit_b and unit_a != unit_b:
        raise InputError(
            f"--vary {path}: the range begins in {unit_a} and ends in {unit_b}; give both "
            "in one unit"
        )
    count, unit = int(parts[2]), unit_a or unit_b or own
    if logarithmic and not (first > 0.0 and last > 0.0):
        raise InputError(
            f"--vary {path}: equal ratios need positive ends, {first:g} and {last:g} are given"
        )
    if count > MOST_POINTS:
        raise InputError(f"--vary {path}: {count} values are more than {MOST_POINTS}")
    spaced = np.geomspace(first, last, count) if logarithmic else np.linspace(first, last, count)
    # 0.30000000000000004 is no value a user meant.
    numbers = [float(f"{v:.12g}") for v in spaced]
    whole = "." not in parts[0] + parts[1] and all(v.is_integer() for v in numbers)
    return [_with_unit(int(v) if whole else v, unit) for v in numbers]


def _with_unit(value: Any, unit: str) -> Any:
    plain = isinstance(value, (int, float)) and not isinstance(value, bool)
    return f"{value!r} {unit}" if plain and unit else value


def _entry(scene: Mapping[str, Any], path: str) -> Any:
    node: Any = scene
    for key in path.split("."):
        node = node.get(key) if isinstance(node, Mapping) else None
    return node


def _numbers(values: Sequence[Any]) -> tuple[tuple[float, ...] | None, str]:
    """The values as numbers in their common unit, when they are."""
    if any(isinstance(v, bool) for v in values):
        return None, ""
    numbers = [(float(v), "") if isinstance(v, (int, float)) else _quantity(v) for v in values]
    found = [one for one in numbers if one is not None]
    units = {unit for _, unit in found}
    if len(found) < len(numbers) or len(units) != 1:
        return None, ""
    return tuple(number for number, _ in found), units.pop()


def _quantity(value: Any) -> tuple[float, str] | None:
    """The number and the unit of a text; None where it is none."""
    match = _QUANTITY.fullmatch(value) if isinstance(value, str) else None
    return None if match is None else (float(match[1]), match[2] or "")
