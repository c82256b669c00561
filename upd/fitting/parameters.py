"""What a fit varies: scalar inputs of a scene, each by a factor, some of them tied together."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.errors import InputError
from upd.scene import ForcedScene
from upd.scene.keys import SceneKey, scalar_input, scene_keys
from upd.scene.ranges import InputProblems, check_ends, input_text, read_range, with_values
from upd.units import unit_inside

Array = NDArray[np.float64]
#: factors between which an input is sought without bounds of its own: stiffnesses, all others
_WIDE, _NARROW = 100.0, 2.0
_STIFFNESS = "stiffness"


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
    problems = InputProblems("parameters of the fit")
    if not vary:
        problems.lines.append("nothing to vary; write for example --vary damper.density")
    keys = {key.path: key for key in scene_keys(scene)}
    for text in vary:
        name, _, bounds = (part.strip() for part in text.partition("="))
        with problems.of(name):
            one = _parameter(scene, keys, name, bounds)
            _check_ends(scene, one, own=bool(bounds))
            found.append(one)
    problems.twice([path for one in found for path in one.paths], "varied twice")
    problems.check()
    return tuple(found)


def _parameter(
    scene: ForcedScene, keys: Mapping[str, SceneKey], name: str, bounds: str
) -> VariedInput:
    paths = tuple(path.strip() for path in name.split("+"))
    kinds, values = zip(*(_input(scene, keys, path) for path in paths), strict=True)
    wide = _WIDE if set(kinds) == {_STIFFNESS} else _NARROW
    low, high = 1.0 / wide, wide
    if bounds:
        low, high = (end.factor for end in read_range(bounds, kinds[0], values[0]))
    return VariedInput(paths, tuple(values), kinds[0], low, high)


def _input(scene: ForcedScene, keys: Mapping[str, SceneKey], path: str) -> tuple[str, float]:
    """Kind and value of a scalar input."""
    kind, value = scalar_input(scene, keys, path)
    if not value > 0.0:
        raise InputError(f"is {value:g}; a fit varies inputs by factors: begin above 0")
    return kind, value


def _check_ends(scene: ForcedScene, one: VariedInput, *, own: bool) -> None:
    """Raise InputError where the scene refuses an end of the bounds."""
    check_ends(
        lambda value: fitted_scene(scene, [one], np.log([value / one.values[0]])),
        (one.low * one.values[0], one.high * one.values[0]),
        one.kind,
        f"give {'other' if own else 'your own'} bounds, {one.paths[0]}=low:high",
    )


def fitted_scene(
    scene: ForcedScene, parameters: Sequence[VariedInput], z: Array, **more: Any
) -> ForcedScene:
    """The scene read again from its text with parameters moved; inputs that are not keep what the
    scene knows of their limits.

    Parameters
    ----------
    parameters
        (n,) of the fit.
    z
        (n,) logarithms of their factors.
    **more
        Other keys of the scene.

    Raises
    ------
    InputError
        Where the scene refuses them.
    """
    changed: dict[str, Any] = dict(more)
    for one, factor in zip(parameters, np.exp(z), strict=True):
        for path, value in zip(one.paths, one.values, strict=True):
            changed[path] = input_text(float(value * factor), one.kind)
    return with_values(scene, changed)
