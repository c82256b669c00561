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
from dataclasses import dataclass
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


@dataclass(frozen=True)
class GivenBand:
    """A quantity of a scene's data with what stands after its +-."""

    steps: Steps
    given: str
    value: Any
    unit: str
    band: str
    rest: str


def taken_out(data: Mapping[str, Any]) -> tuple[dict[str, Any], list[GivenBand]]:
    """A scene's data with the values alone, and what stood after their +-.

    Only what begins with a number is read so: a title may say +- too.
    """
    found: list[GivenBand] = []
    return _without(data, (), found), found


def _without(node: Any, steps: Steps, found: list[GivenBand]) -> Any:
    if isinstance(node, Mapping):
        return {key: _without(value, (*steps, str(key)), found) for key, value in node.items()}
    if isinstance(node, list):
        return [_without(value, (*steps, k), found) for k, value in enumerate(node)]
    match = _BAND.fullmatch(node) if isinstance(node, str) else None
    if match is None or len(steps) < 2:
        return node
    text, unit = match["value"], match["unit"]
    number = int(text) if text.isdigit() else float(text)
    value: Any = f"{text} {unit}" if unit else number
    found.append(GivenBand(steps, node.strip(), value, unit, match["band"] or "", match["rest"]))
    return value


def uncertainties(
    scene: Any,
    data: dict[str, Any],
    bands: list[GivenBand],
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
    for one in bands:
        path = path_of(one.steps)
        try:
            kind = input_kind(scene, recipe, one.steps)
            if not kind:
                raise InputError(
                    "is no physical quantity known within limits, but chosen; to fix it: write it "
                    "without +-"
                )
            value = parse_quantity(one.value, kind)
            half = _half_width(one, kind, value)
            found = Uncertainty(path, value, half, one.given, kind, one.steps)
            _check_ends(found, data, problems_of)
            out[path] = found
        except InputError as error:
            problems.append(f"{path}: {one.given!r}: {error}")
    return out, problems


def _half_width(one: GivenBand, kind: str, value: float) -> float:
    """What stands after +-, in the unit inside."""
    example = f'"{one.given.partition("+")[0].partition(chr(0xB1))[0].strip()} +- 10 %"'
    if not one.band:
        raise InputError(f"no number stands after +-; to fix it: write for example {example}")
    number = float(one.band)
    if not number > 0.0:
        raise InputError(
            f"the half-width {number:g} is not above 0; to fix it: write for example {example}"
        )
    if one.rest == "%" and one.unit != "%":
        # of the value
        half = 0.01 * number * abs(value)
        if not value:
            raise InputError("a share of 0 is 0; to fix it: write the half-width with its unit")
    elif not one.rest and one.unit:
        raise InputError(
            f"the half-width {number:g} has no unit; to fix it: write +- {number:g} {one.unit}, or "
            f"a share of the value, +- {number:g} %"
        )
    else:
        try:
            half = parse_quantity(f"{one.band} {one.rest}".strip(), kind)
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
    data, bands = taken_out({"": {"": text}})
    value = parse_quantity(data[""][""], kind)
    return value, _half_width(bands[0], kind, value) if bands else None


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
