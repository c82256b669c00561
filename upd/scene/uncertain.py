"""Quantities of a scene that are known within limits: "0.6 +- 0.1", "4.9e5 N/mm +- 30 %".

The value stays the number it is everywhere; what stands after +- is kept beside the scene as the
half-width of the input. All half-widths of a scene are read alike: as the same multiple of the
standard deviation of an input that depends on no other, one deviation or the two of a 95 %
interval. Bands of results are then the same multiple of theirs, to first order,

    delta q = [sum_i (dq/dp_i)^2 (delta p_i)^2]^(1/2),

eq. (10) of the reference, which holds for any common factor of all deviations.

References
----------
JCGM 100:2008, Evaluation of measurement data - Guide to the expression of uncertainty in
measurement, 5.1.2.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

from upd.errors import InputError
from upd.scene.keys import input_kind
from upd.scene.quantities import Steps, Uncertainty, path_of
from upd.scene.toml import put_back
from upd.units import parse_quantity

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_SIGN = r"(?:\+\s?/?\s?[-\u2212]|\u00b1)"
_BAND = re.compile(
    rf"\s*(?P<value>{_NUMBER})\s*(?P<unit>\S*?)\s*{_SIGN}\s*(?P<band>{_NUMBER})?\s*(?P<rest>.*?)\s*"
)


#: place of a quantity in a scene's data, its value alone, and the parts of its text
Band = tuple[Steps, Any, re.Match[str]]


def taken_out(node: Any, found: list[Band], steps: Steps = ()) -> Any:
    """A scene's data with the values alone; what stood after their +- is added to ``found``.

    Only what begins with a number is read so: a title may say +- too.
    """
    if isinstance(node, Mapping):
        return {key: taken_out(value, found, (*steps, str(key))) for key, value in node.items()}
    if isinstance(node, list):
        return [taken_out(value, found, (*steps, k)) for k, value in enumerate(node)]
    match = _BAND.fullmatch(node) if isinstance(node, str) else None
    if match is None or len(steps) < 2:
        return node
    text, unit = match["value"], match["unit"]
    number = int(text) if text.isdigit() else float(text)
    value: Any = f"{text} {unit}" if unit else number
    found.append((steps, value, match))
    return value


def uncertainties(
    scene: Any,
    data: dict[str, Any],
    bands: list[Band],
    recipe: str,
    problems_of: Callable[[dict[str, Any]], list[str]],
) -> tuple[dict[str, Uncertainty], list[str]]:
    """The uncertain inputs of the scene, by path, and what is wrong with it.

    Parameters
    ----------
    scene
        Its class.
    data
        With the values alone.
    bands
        Of `taken_out`.
    recipe
        Name or path of the recipe.
    problems_of
        Data of a scene -> its problems: both ends of every interval are a scene.
    """
    out: dict[str, Uncertainty] = {}
    problems: list[str] = []
    for steps, given, parts in bands:
        path, text = path_of(steps), parts.string.strip()
        try:
            kind = input_kind(scene, recipe, steps)
            if not kind:
                raise InputError(
                    "is no physical quantity known within limits, but chosen; to fix it: write it "
                    "without +-"
                )
            value = parse_quantity(given, kind)
            found = Uncertainty(path, value, _half_width(parts, kind, value), text, kind, steps)
            _check_ends(found, data, problems_of)
            out[path] = found
        except InputError as error:
            problems.append(f"{path}: {text!r}: {error}")
    return out, problems


def _half_width(parts: re.Match[str], kind: str, value: float) -> float:
    """What stands after +-, in the unit inside."""
    given, unit, rest = f"{parts['value']} {parts['unit']}".strip(), parts["unit"], parts["rest"]
    example = f'"{given} +- 10 %"'
    if not parts["band"]:
        raise InputError(f"no number stands after +-; to fix it: write for example {example}")
    number = float(parts["band"])
    if not number > 0.0:
        raise InputError(
            f"the half-width {number:g} is not above 0; to fix it: write for example {example}"
        )
    if rest == "%" and unit != "%":
        # of the value
        half = 0.01 * number * abs(value)
        if not value:
            raise InputError("a share of 0 is 0; to fix it: write the half-width with its unit")
    elif not rest and unit:
        raise InputError(
            f"the half-width {number:g} has no unit; to fix it: write +- {number:g} {unit}, or "
            f"a share of the value, +- {number:g} %"
        )
    else:
        try:
            half = parse_quantity(f"{parts['band']} {rest}".strip(), kind)
        except InputError as error:
            raise InputError(f"the half-width: {error}") from None
    return half


def read_band(text: str, kind: str) -> tuple[float, float | None]:
    """A quantity that may carry limits, "377 Hz +- 0.5 Hz", outside of a scene.

    Parameters
    ----------
    text : str
        As in a scene.
    kind : str
        Of quantity, as in `upd.units.UNITS`.

    Returns
    -------
    tuple
        Value and half-width in the unit inside; None for the half-width of a value alone.

    Raises
    ------
    InputError
        When it cannot be read.
    """
    # the first step stands for the table that every quantity of a scene has
    bands: list[Band] = []
    data = taken_out({"": {"": text}}, bands)
    value = parse_quantity(data[""][""], kind)
    return value, _half_width(bands[0][2], kind, value) if bands else None


def _check_ends(
    one: Uncertainty, data: dict[str, Any], problems_of: Callable[[dict[str, Any]], list[str]]
) -> None:
    for shift in (-1.0, 1.0):
        end = one.at(shift)
        problems = problems_of(put_back(data, one.steps, end))
        if problems:
            reason = problems[0].removeprefix(f"{one.path}: ").removeprefix("geometry: ")
            shown = f"{end:.6g}" if isinstance(end, float) else end
            raise InputError(
                f"reaches {shown}, which the scene does not allow ({reason}); to fix it: give a "
                "smaller half-width"
            )
