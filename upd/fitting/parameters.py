"""What a fit varies: scalar inputs of a scene, each by a factor, some of them tied together."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.errors import InputError, one_line
from upd.scene import ForcedScene, load_scene
from upd.scene.keys import SceneKey, scalar_input, scene_keys
from upd.scene.uncertain import put_back
from upd.units import parse_quantity, quantity_text, unit_inside

Array = NDArray[np.float64]
#: factors between which an input is sought without bounds of its own: stiffnesses, all others
_WIDE, _NARROW = 100.0, 2.0
_STIFFNESS, FRICTION = "stiffness", "contact.friction"


@dataclass(frozen=True)
class VariedInput:
    """One unknown: inputs that are multiplied by the same factor.

    Attributes
    ----------
    paths : tuple of str
        Of the inputs in the scene.
    values : tuple of float
        What the scene has, in the units inside.
    kind : str
        Of their quantity, as in `upd.units.UNITS`.
    low, high : float
        Bounds of the factor.
    """

    paths: tuple[str, ...]
    values: tuple[float, ...]
    kind: str
    low: float
    high: float

    @property
    def name(self) -> str:
        """All its paths."""
        return " + ".join(self.paths)

    @property
    def unit(self) -> str:
        """Inside."""
        return unit_inside(self.kind)

    @property
    def bounds(self) -> tuple[float, float]:
        """Of the logarithm of the factor."""
        return math.log(self.low), math.log(self.high)

    def value(self, z: float) -> float:
        """Of the first input, with the logarithm of the factor."""
        return self.values[0] * math.exp(z)


def read_parameters(scene: ForcedScene, vary: Sequence[str]) -> tuple[VariedInput, ...]:
    """Parameters from "path", "path=low:high", "path+path=x0.1:x10".

    Parameters
    ----------
    scene
        Whose inputs they are.
    vary
        One text a parameter. Bounds are quantities (of the first path), or factors of the scene's
        values with an x in front.

    Raises
    ------
    InputError
        With everything that is wrong with them.
    """
    found: list[VariedInput] = []
    problems = [] if vary else ["nothing to vary; write for example --vary damper.density"]
    keys = {key.path: key for key in scene_keys(scene)}
    for text in vary:
        name, _, bounds = text.partition("=")
        try:
            one = _parameter(scene, keys, name, bounds.strip())
            _check_ends(scene, one, own=bool(bounds))
            found.append(one)
        except InputError as error:
            problems.append(f"{name.strip()}: {error}")
    paths = [path for one in found for path in one.paths]
    problems += [f"{p}: varied twice" for p in dict.fromkeys(paths) if paths.count(p) > 1]
    if problems:
        raise InputError(
            "parameters of the fit:\n" + "\n".join(f"  {problem}" for problem in problems)
        )
    return tuple(found)


def _parameter(
    scene: ForcedScene, keys: Mapping[str, SceneKey], name: str, bounds: str
) -> VariedInput:
    paths = tuple(path.strip() for path in name.split("+"))
    kinds, values = zip(*(_input(scene, keys, path) for path in paths), strict=True)
    wide = _WIDE if set(kinds) == {_STIFFNESS} else _NARROW
    low, high = 1.0 / wide, wide
    if bounds:
        ends = [end.strip() for end in bounds.split(":")]
        if len(ends) != 2:
            raise InputError(f"{bounds!r} are no bounds; write low:high, quantities or x0.1:x10")
        low, high = (_factor(end, kinds[0], values[0]) for end in ends)
    if not 0.0 < low < high:
        raise InputError(f"{bounds!r}: write two bounds above 0, the lower one first")
    return VariedInput(paths, tuple(values), kinds[0], low, high)


def _factor(end: str, kind: str, value: float) -> float:
    if end.startswith("x"):
        return parse_quantity(_plain(end[1:]), "fraction")
    return parse_quantity(_plain(end) if kind == "fraction" else end, kind) / value


def _plain(text: str) -> Any:
    """A bare number as one: fractions may be without unit."""
    try:
        return float(text)
    except ValueError:
        return text


def _input(scene: ForcedScene, keys: Mapping[str, SceneKey], path: str) -> tuple[str, float]:
    """Kind and value of a scalar input."""
    kind, value = scalar_input(scene, keys, path)
    if not value > 0.0:
        raise InputError(f"is {value:g}; a fit varies inputs by factors: begin above 0")
    return kind, value


def _check_ends(scene: ForcedScene, one: VariedInput, *, own: bool) -> None:
    """Raise InputError where the scene refuses an end of the bounds."""
    for factor in (one.low, one.high):
        try:
            # a positive stiffness is all it takes
            read = scene_with if all(map(is_stiffness, one.paths)) else fitted_scene
            read(scene, [one], np.log([factor]))
        except InputError as error:
            shown = quantity_text(factor * one.values[0], one.kind)
            raise InputError(
                f"the scene refuses {shown} ({one_line(error)}); to fix it: give "
                f"{'other' if own else 'your own'} bounds, {one.paths[0]}=low:high"
            ) from None


def scene_with(scene: ForcedScene, parameters: Sequence[VariedInput], z: Array) -> ForcedScene:
    """The scene with parameters moved.

    Parameters
    ----------
    parameters
        (n,) of the fit.
    z
        (n,) logarithms of their factors.

    Raises
    ------
    InputError
        Where the scene refuses them.
    """
    if all(p == FRICTION or is_stiffness(p) for one in parameters for p in one.paths):
        return _with_contact(scene, parameters, z)
    return fitted_scene(scene, parameters, z)


def is_stiffness(path: str) -> bool:
    """Whether an input is a contact stiffness."""
    return path.split(".")[0] == _STIFFNESS


def _with_contact(scene: ForcedScene, parameters: Sequence[VariedInput], z: Array) -> ForcedScene:
    """Without reading the scene again: the ends of their bounds were."""
    tables, contact = dict(scene.stiffness), scene.contact
    for one, factor in zip(parameters, np.exp(z), strict=True):
        for path, value in zip(one.paths, one.values, strict=True):
            moved = float(value * factor)
            if path == FRICTION:
                contact = replace(contact, friction=moved)
            else:
                _, name, *steps = path.split(".")
                tables[name] = _put(tables[name], steps, moved)
    return replace(scene, stiffness=tables, contact=contact)


def _put(table: Any, steps: Sequence[str], value: float) -> Any:
    head, *rest = steps
    return replace(table, **{head: _put(getattr(table, head), rest, value) if rest else value})


def fitted_scene(
    scene: ForcedScene, parameters: Sequence[VariedInput], z: Array, **more: Any
) -> ForcedScene:
    """The scene read again from its text with parameters moved; inputs that are not keep what the
    scene knows of their limits.

    Parameters
    ----------
    parameters, z
        As of `scene_with`.
    **more
        Other keys of the scene.

    Raises
    ------
    InputError
        Where the scene refuses them.
    """
    data = tomllib.loads(scene.text)
    changed: dict[str, Any] = dict(more)
    for one, factor in zip(parameters, np.exp(z), strict=True):
        for path, value in zip(one.paths, one.values, strict=True):
            moved = float(value * factor)
            changed[path] = moved if one.kind == "fraction" else quantity_text(moved, one.kind)
    for known in scene.uncertain.values():
        if known.path not in changed:
            data = put_back(data, known.steps, known.given)
    return load_scene(data, changed)  # type: ignore[no-any-return]
