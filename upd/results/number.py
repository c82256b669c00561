"""A number of a run, with its reference and what its error is made of."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import Any, TypeVar

from upd.results.case import Case

Kept = TypeVar("Kept")
#: fields of a number that have other names in summary.json
_INSIDE = ("parts", "inputs", "printed_error")


def as_json(one: Any, **others: Any) -> dict[str, Any]:
    """The fields of a number, a part or a check as summary.json has them, with some of its own:
    what is not finite is null.
    """
    found = {f.name: getattr(one, f.name) for f in fields(one)} | others
    return {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in found.items()
    }


def from_json(kind: type[Kept], data: Mapping[str, Any], **others: Any) -> Kept:
    """What `as_json` wrote, with some fields of its own; null is NaN where a number must be, and
    what is no field is omitted.
    """
    known: Any = fields(kind)  # type: ignore[arg-type]
    found = {
        f.name: math.nan if data[f.name] is None and f.type == "float" else data[f.name]
        for f in known
        if f.name in data
    }
    return kind(**found | others)


@dataclass(frozen=True)
class ErrorPart:
    """What one source adds to the error of a number.

    Attributes
    ----------
    source
        Where the error comes from, in the field's words: "mesh", "contact points", "modes kept",
        "harmonics", "samples", "load steps".
    error
        Estimated bound of it, relative to the number; NaN where it was not found.
    basis
        How it was estimated, or why it was not.
    half_cost_s
        Predicted seconds that half of it adds to the run; None where they are not known.
    half_why
        Why half of it is out of reach, where it is: "needs 26 GB, there are 12".
    """

    source: str
    error: float
    basis: str
    half_cost_s: float | None = None
    half_why: str = ""

    @property
    def half_words(self) -> str:
        """What half of it adds, in words; "" where that is not known or there is no error."""
        if not self.known or not self.error:
            return ""
        return self.half_why if self.half_cost_s is None else f"{self.half_cost_s:+.3g} s"

    @property
    def known(self) -> bool:
        """Whether it was found."""
        return math.isfinite(self.error)


@dataclass(frozen=True)
class InputPart:
    """What the half-width of one input does to a number, to first order.

    Attributes
    ----------
    path
        Of the input in the scene: "contact.friction".
    half_width
        Of the input, relative to its value.
    change
        dq/dp times the half-width, relative to the number q, with its sign; NaN where it was not
        found.
    basis
        How it was found, or why it was not.
    """

    path: str
    half_width: float
    change: float
    basis: str

    @property
    def known(self) -> bool:
        """Whether it was found."""
        return math.isfinite(self.change)


#: name and case of a number -> what the inputs known within limits do to it
InputParts = Mapping[tuple[str, Case], tuple[InputPart, ...]]
#: name and case of a number -> the parts of its error
Estimates = Mapping[tuple[str, Case], tuple[ErrorPart, ...]]


@dataclass(frozen=True)
class Result:
    """One number of a run.

    Attributes
    ----------
    reference
        Value it is compared with, in the same unit; ``source`` is where that comes from.
    printed_error
        Relative difference of a published value from the reference.
    estimated_error
        Relative; of a number with ``parts`` their sum, None where one of them was not found.
    exact
        Whether the reference is what the number should converge to; another's measured or computed
        value is not.
    withheld
        Why the number was not reached; ``value`` is then NaN, and no smaller one stands in its
        place.
    parts
        Of the estimated error, by source.
    inputs
        What the inputs known within limits do to it.
    """

    name: str
    case: Case
    value: float
    unit: str
    reference: float | None = None
    source: str = ""
    printed_error: float | None = None
    estimated_error: float | None = None
    exact: bool = True
    withheld: str = ""
    parts: tuple[ErrorPart, ...] = ()
    inputs: tuple[InputPart, ...] = ()

    @property
    def input_error(self) -> float | None:
        """Relative band by the inputs, as wide as their half-widths are: independent inputs add as
        squares. None without any, and where a part was not found.

        References
        ----------
        JCGM 100:2008, Guide to the expression of uncertainty in measurement, eq. (10).
        """
        known = self.inputs and all(part.known for part in self.inputs)
        return math.hypot(*(part.change for part in self.inputs)) if known else None

    @property
    def error(self) -> float | None:
        """Relative difference from the reference."""
        return (
            None
            if self.reference is None or self.reference == 0.0 or self.withheld
            else self.value / self.reference - 1.0
        )

    def as_dict(self) -> dict[str, Any]:
        """The number as it stands in summary.json.

        ``case`` in words, its attributes under ``case_fields``; the value of a withheld number is
        null.
        """
        found = as_json(
            self,
            case=self.case.label,
            error=self.error,
            thesis_error=self.printed_error,
            error_parts=list(map(as_json, self.parts)),
            input_error=self.input_error,
            input_parts=[as_json(one, share=abs(one.change)) for one in self.inputs],
            case_fields=self.case.given(),
        )
        return {name: found[name] for name in found if name not in _INSIDE}


def with_parts(result: Result, parts: Iterable[ErrorPart]) -> Result:
    """The number with the parts of its error: their sum bounds it whatever their signs."""
    mine = () if result.withheld else tuple(parts)
    known = bool(mine) and all(part.known for part in mine)
    total = math.fsum(part.error for part in mine) if known else None
    return replace(result, parts=mine, estimated_error=total) if mine else result


def read_result(data: Mapping[str, Any]) -> Result:
    """The number that `Result.as_dict` wrote."""
    return from_json(
        Result,
        data,
        case=from_json(Case, data["case_fields"]),
        printed_error=data.get("thesis_error"),
        parts=tuple(from_json(ErrorPart, one) for one in data.get("error_parts", ())),
        inputs=tuple(from_json(InputPart, one) for one in data.get("input_parts", ())),
    )


def with_estimates(
    results: Iterable[Result], estimates: Estimates, inputs: InputParts = MappingProxyType({})
) -> tuple[Result, ...]:
    """The numbers with the parts of their errors, those that have some with their own, and with
    what the inputs known within limits do to them.
    """
    out = []
    for one in results:
        key = one.name, one.case
        found = one if one.parts else with_parts(one, estimates.get(key, ()))
        out.append(found if one.withheld else replace(found, inputs=inputs.get(key, one.inputs)))
    return tuple(out)
