"""What a fit aims at: named numbers of a forced response and measured curves, with how well each is
known; and what it varies: scalar inputs, each by a factor, some of them tied together.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.errors import InputError
from upd.measured import MeasuredCurve, read_measured
from upd.results.quantities import LEFT
from upd.scene import ForcedScene
from upd.scene.forced_contact import SIDES, Side
from upd.scene.keys import SceneKey, scalar_input, scene_keys
from upd.scene.ranges import InputProblems, check_ends, input_text, read_range, with_values
from upd.scene.uncertain import read_band
from upd.units import parse_quantity, unit_inside

Array = NDArray[np.float64]
STUCK_MODES = ("stuck_in_phase", "stuck_out_of_phase")
#: totals of a face, of the damper's contact alone where a contact analysis gives them: its blade
#: and which
CONTACT_TOTALS: dict[str, tuple[Side, str]] = {
    f"{LEFT * (side == 'left')}{total}": (side, total) for side in SIDES for total in ("K_N", "K_T")
}
#: peaks of a blade that have names
_PEAKS = (1, 2)
#: what a peak has: kinds of quantities
_OF_PEAK = ("frequency", "accelerance")
#: name of a peak's number -> free, stuck or with friction, its blade, number, and what of it
PEAK_NUMBERS: dict[str, tuple[str, Side, int, str]] = {
    f"{kind}{'_' * bool(kind)}{LEFT * (side == 'left')}peak_{k}_{what}": (kind, side, k, what)
    for kind in ("free", "stuck", "")
    for side in SIDES
    for k in _PEAKS
    for what in _OF_PEAK
}
KNOWN = (*STUCK_MODES, *PEAK_NUMBERS, *CONTACT_TOTALS)
#: the state of a measured curve as its target names it
_CURVE = re.compile(r"(?:(left|right)_)?(?:(free|stuck)|(\d[\d.eE+]*))")
_MEASURED = "measured"


@dataclass(frozen=True)
class FitTarget:
    """A number that is to come out.

    Attributes
    ----------
    of : str
        What it is, one of `KNOWN`.
    value : float
        In its unit.
    half_width : float, optional
        What stood after +-; None where nothing did.
    unit : str
        Hz, (m/s2)/N or N/mm.
    ratio : float, optional
        F_C/F_E of a peak with friction.
    """

    of: str
    value: float
    half_width: float | None
    unit: str
    ratio: float | None = None

    @property
    def name(self) -> str:
        """With its F_C/F_E."""
        return self.of if self.ratio is None else f"{self.of}@{self.ratio:g}"

    @property
    def scale(self) -> float:
        """By what residuals are divided: the half-width, or the value itself."""
        return self.value if self.half_width is None else self.half_width


@dataclass(frozen=True)
class CurveTarget:
    """A measured curve that is to come out.

    Attributes
    ----------
    name : str
        As the target names it.
    curve : MeasuredCurve
        Free, stuck or at an F_C/F_E.
    relative, constant : float, optional
        Half-width of every real and imaginary part, or magnitude: as a part of the value,
        (m/s2)/N; both None: estimated from what the fit leaves.
    """

    name: str
    curve: MeasuredCurve
    relative: float | None = None
    constant: float | None = None

    @property
    def stated(self) -> bool:
        """Whether its half-width was given."""
        return self.relative is not None or self.constant is not None

    @property
    def parts(self) -> int:
        """Of a point: real and imaginary, or the magnitude alone."""
        return 2 if self.curve.is_complex else 1

    @cached_property
    def values(self) -> Array:
        """(parts n,) real parts, then imaginary ones; or magnitudes, (m/s2)/N."""
        H = self.curve.accelerance
        return np.concatenate([H.real, H.imag]) if self.curve.is_complex else np.asarray(H)

    @property
    def state(self) -> str:
        """In words."""
        of = self.curve
        return of.state if of.state is not None else f"F_C/F_E {of.force_ratio:g}"


@dataclass(frozen=True)
class Targets:
    """All that a fit aims at: numbers, then curves."""

    numbers: tuple[FitTarget, ...]
    curves: tuple[CurveTarget, ...] = ()

    @property
    def ratios(self) -> tuple[float, ...]:
        """F_C/F_E of those with friction, each once."""
        found = [one.ratio for one in self.numbers]
        found += [one.curve.force_ratio for one in self.curves if one.curve.state is None]
        return tuple(sorted({one for one in found if one is not None}))


def read_targets(
    to: str | Mapping[str, str] | Sequence[str | MeasuredCurve | CurveTarget],
    scene: ForcedScene | None = None,
) -> Targets:
    """Targets from "name=377 Hz +- 0.5 Hz,peak_1_frequency@194=335 Hz,stuck=measured.csv +- 2 %".

    Parameters
    ----------
    to
        One text, texts of one target each, a mapping name -> quantity or file, or curves that are
        read already. "measured" is all curves of the scene's [measured], "measured.NAME" one.
    scene
        Whose [measured] counts.

    Raises
    ------
    InputError
        With everything that is wrong with them.
    """
    if isinstance(to, Mapping):
        items: list[str | CurveTarget] = [f"{name}={text}" for name, text in to.items()]
    elif isinstance(to, str):
        items = [one for one in to.split(",") if one.strip()]
    else:
        items = [_as_item(one) for one in to]
    numbers: list[FitTarget] = []
    curves: list[CurveTarget] = []
    problems = InputProblems("targets of the fit")
    if not items:
        problems.lines.append('none given; write for example "stuck_in_phase=377 Hz"')
    for item in items:
        if isinstance(item, CurveTarget):
            curves.append(item)
            continue
        name, _, text = (part.strip() for part in item.partition("="))
        with problems.of(name):
            found = _curves(name, text, item.strip(), scene)
            if found is None:
                numbers.append(_number(name, text))
            else:
                curves += found
    problems.twice([*(one.name for one in numbers), *(one.name for one in curves)])
    bare = [one.name for one in numbers if one.half_width is None]
    if bare and (len(bare) < len(numbers) or curves):
        problems.lines.append(
            f"{', '.join(bare)}: no half-width, though others have one or are curves; to fix it: "
            "write +- for all numbers, or for none and no curve"
        )
    problems.check()
    return Targets(tuple(numbers), tuple(curves))


def _as_item(one: str | MeasuredCurve | CurveTarget) -> str | CurveTarget:
    if not isinstance(one, MeasuredCurve):
        return one
    side = f"{one.blade}_" if one.blade != "right" else ""
    return CurveTarget(f"{side}{one.state or f'{one.force_ratio:g}'}", one)


def _number(name: str, text: str) -> FitTarget:
    of, _, at = (part.strip() for part in name.partition("@"))
    if of not in KNOWN:
        near = difflib.get_close_matches(of, KNOWN, 2)
        raise InputError(
            "is no number that can be fitted"
            + (f"; did you mean {' or '.join(near)}?" if near else ".")
            + f" Known: {', '.join(KNOWN)}; peaks without free or stuck with @F_C/F_E; files of "
            "measured curves as free=, stuck= or F_C/F_E=FILE"
        )
    friction = of in PEAK_NUMBERS and not PEAK_NUMBERS[of][0]
    if friction != bool(at):
        right = f"{of}@194" if friction else of
        raise InputError(f"{'needs its' if friction else 'has no'} F_C/F_E; write {right}")
    kind = kind_of(of)
    if not text:
        raise InputError(f'has no value; write {name}="377 {unit_inside(kind)}"')
    value, half = read_band(text, kind)
    if not value > 0.0:
        raise InputError(f"{text!r} is not above 0")
    return FitTarget(of, value, half, unit_inside(kind), _ratio(at) if friction else None)


def kind_of(of: str) -> str:
    """Kind of quantity of a number, as in `upd.units.UNITS`."""
    if of in PEAK_NUMBERS:
        return PEAK_NUMBERS[of][3]
    return "frequency" if of in STUCK_MODES else "stiffness"


def _ratio(text: str) -> float:
    try:
        found = float(text)
    except ValueError:
        found = 0.0
    if not found > 0.0:
        raise InputError(f"{text!r} is no F_C/F_E above 0; write 194 for example")
    return found


def _curves(
    name: str, text: str, whole: str, scene: ForcedScene | None
) -> list[CurveTarget] | None:
    """The curves that a target names; None where it names a number."""
    bare, _, half = (part.strip() for part in whole.partition("+-"))
    tables = {} if scene is None else dict(scene.measured)
    if bare == _MEASURED or bare.startswith(f"{_MEASURED}."):
        wanted = list(tables) if bare == _MEASURED else [bare.partition(".")[2]]
        missing = [one for one in wanted if one not in tables]
        if missing or not wanted:
            there = ", ".join(tables) or "none"
            raise InputError(f"the scene's [measured] has no such curve; it has: {there}")
        made = [CurveTarget(f"{_MEASURED}.{one}", tables[one].read()) for one in wanted]
        return [_with_half(one, half) for one in made]
    found = _CURVE.fullmatch(name)
    if found is None:
        return None
    file, _, half = (part.strip() for part in text.partition("+-"))
    if not file:
        raise InputError(f"names no file; write {name}=measured.csv")
    blade, state, at = found.groups()
    curve = read_measured(
        file,
        blade="left" if blade == "left" else "right",
        state=None if state is None else "free" if state == "free" else "stuck",
        force_ratio=None if at is None else _ratio(at),
    )
    return [_with_half(CurveTarget(name, curve), half)]


def _with_half(target: CurveTarget, half: str) -> CurveTarget:
    if not half:
        return target
    kind = "fraction" if half.endswith("%") else "accelerance"
    size = float(parse_quantity(half, kind))
    if not size > 0.0:
        raise InputError(f"{half!r} is no half-width above 0; write +- 2 % or +- 0.5 (m/s2)/N")
    if kind == "fraction":
        return replace(target, relative=size)
    return replace(target, constant=size)


# -- what a fit varies -----------------------------------------------------------------------------


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
            found.append(_parameter(scene, keys, name, bounds))
    problems.twice([path for one in found for path in one.paths], "varied twice")
    problems.check()
    return tuple(found)


def _parameter(
    scene: ForcedScene, keys: Mapping[str, SceneKey], name: str, bounds: str
) -> VariedInput:
    paths = tuple(path.strip() for path in name.split("+"))
    kinds, values = zip(*(scalar_input(scene, keys, path) for path in paths), strict=True)
    for value in values:
        if not value > 0.0:
            raise InputError(f"is {value:g}; a fit varies inputs by factors: begin above 0")
    wide = _WIDE if set(kinds) == {_STIFFNESS} else _NARROW
    low, high = 1.0 / wide, wide
    if bounds:
        low, high = (end / values[0] for end in read_range(bounds, kinds[0], values[0]))
    found = VariedInput(paths, tuple(values), kinds[0], low, high)
    check_ends(
        lambda value: fitted_scene(scene, [found], np.log([value / values[0]])),
        (low * values[0], high * values[0]),
        kinds[0],
        f"give {'other' if bounds else 'your own'} bounds, {paths[0]}=low:high",
    )
    return found


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
