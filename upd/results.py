"""What a run leaves behind: cases, numbers, checks, and arrays in one netCDF file."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np

from upd.cache.files import whole_bytes
from upd.labels import check_words, number, number_label


@dataclass(frozen=True, eq=False)
class Case:
    """What a number, a check or a group of arrays belongs to.

    Only what applies is given; the label is derived, never parsed.

    A case equals its label, so that scripts may write it: ``row.case == "F=50 N"``.

    Attributes
    ----------
    name
        Words for a case that no number tells: "Craig-Bampton", "equilibrium", "performance".
    stiffness
        Name of the contact stiffness, a table of the scene.
    body
        A body of the model.
    load
        Normal force, N.
    direction
        Direction of a tangential load: "x", "y" or "45deg".
    ratio
        Tangential load over mu times the normal load.
    friction
        State of the damper's equilibrium: "opposing", "frictionless", "reversed".
    force_ratio
        F_C/F_E, centrifugal over excitation force.
    reversed
        The path was followed from the highest frequency downwards.
    kind
        Kind of linear curve or of modes: "free", "stuck", "glued".
    arrangement
        Which sides of the platforms face each other: "symmetric", "asymmetric".
    peak
        Number of the peak from 1; 0 is the highest point of a curve without a peak.
    branch
        Name of a peak that is followed over F_C/F_E.
    mode
        How the blades move at a peak: "in phase", "out of phase".
    frequency
        Hz.
    part
        Share of the first natural frequency.
    blade
        Blade whose motion it is: "left", "right".
    side
        Face: "left", "right".
    choice
        What was chosen differently: "start mid", "3 harmonics".
    """

    name: str = ""
    stiffness: str = ""
    body: str = ""
    load: float | None = None
    direction: str = ""
    ratio: float | None = None
    friction: str = ""
    force_ratio: float | None = None
    reversed: bool = False
    kind: str = ""
    arrangement: str = ""
    peak: int | None = None
    branch: str = ""
    mode: str = ""
    frequency: float | None = None
    part: float | None = None
    blade: str = ""
    side: str = ""
    choice: str = ""

    @property
    def label(self) -> str:
        """The case in words, as terminal, page and files show it."""
        return self._label(frozenset())

    def _label(self, varying: frozenset[str]) -> str:
        """The label with * for the values of ``varying`` attributes."""

        def shown(name: str, form: str = "{}") -> str:
            """An attribute in words; nothing where it does not apply."""
            value = getattr(self, name)
            if value is None or value == "":
                return ""
            number = f"{value:.6g}" if isinstance(value, float) else str(value)
            return form.format("*" if name in varying else number)

        load = shown("load", "F={} N")
        shear = shown("direction", "_{}") + shown("ratio", "/muN={}")
        parts = [
            shown("stiffness"),
            f"{load} T{shear}" if load and shear else load,
            shown("kind"),
            shown("blade", "{} blade"),
            shown("name"),
            shown("friction", "friction {}"),
            shown("arrangement"),
            shown("body"),
            shown("force_ratio", "F_C/F_E {}"),
            "downwards" * self.reversed,
            "at the highest point" if self.peak == 0 else shown("peak", "at peak {}"),
            shown("branch"),
            shown("mode"),
            shown("choice"),
            shown("part", "{} f1"),
            shown("frequency", "{} Hz"),
            shown("side"),
        ]
        return ", ".join(part for part in parts if part)

    def matches(self, other: Case | str) -> bool:
        """Whether ``other`` means this case: itself or its label, with or without the mode."""
        return self == other or (bool(self.mode) and replace(self, mode="") == other)

    def __str__(self) -> str:
        return self.label

    def __eq__(self, other: object) -> bool:
        return self.label == (other.label if isinstance(other, Case) else other)

    def __hash__(self) -> int:
        return hash(self.label)

    def given(self) -> dict[str, Any]:
        """The attributes that apply, by name: for files."""
        return {
            f.name: value for f in fields(self) if (value := getattr(self, f.name)) != f.default
        }


NO_CASE = Case()


def shared_label(cases: Iterable[Case], varying: Iterable[str] = ()) -> str:
    """The label that cases share, with * for the values that differ and for those ``varying``.

    Only * is left when not the same attributes apply to all of them.
    """
    different = list(dict.fromkeys(cases))
    given = [case.given() for case in different]
    if any(set(one) != set(given[0]) for one in given):
        return "*"
    differ = (name for name in given[0] if len({one[name] for one in given}) > 1)
    return different[0]._label(frozenset((*differ, *varying)))


@dataclass(frozen=True)
class Result:
    """One number of a run.

    Attributes
    ----------
    reference
        Value it is compared with, in the same unit; ``source`` says where that comes from.
    printed_error
        Relative difference of a published value from the reference.
    estimated_error, half_error_cost_s
        Estimated relative error, and predicted seconds of a run with half of it.
    exact
        Whether the reference is what the number should converge to; another's measured or computed
        value is not.
    withheld
        Why the number was not reached; ``value`` is then NaN, and no smaller one stands in its
        place.
    low, high
        Ends of a number that is a range, as of a peak that several steady motions have; ``value``
        is then one of the two. None for a single number.
    why
        Why it is a range.
    """

    name: str
    case: Case
    value: float
    unit: str
    reference: float | None = None
    source: str = ""
    printed_error: float | None = None
    estimated_error: float | None = None
    half_error_cost_s: float | None = None
    exact: bool = True
    withheld: str = ""
    low: float | None = None
    high: float | None = None
    why: str = ""

    @property
    def error(self) -> float | None:
        """Relative difference from the reference."""
        return (
            None
            if self.reference is None or self.reference == 0.0 or self.withheld
            else self.value / self.reference - 1.0
        )

    @property
    def thesis_error(self) -> float | None:
        """`printed_error` under its former name."""
        return self.printed_error

    def as_dict(self) -> dict[str, Any]:
        """The number as it stands in summary.json.

        ``case`` in words, its attributes under ``case_fields``; the value of a withheld number is
        null.
        """
        out: dict[str, Any] = {
            "name": self.name,
            "case": self.case.label,
            "value": None if self.withheld else self.value,
            "unit": self.unit,
        }
        out |= {
            "reference": self.reference,
            "source": self.source,
            "error": self.error,
            "thesis_error": self.printed_error,
        }
        estimates = {
            "estimated_error": self.estimated_error,
            "half_error_cost_s": self.half_error_cost_s,
        }
        return (
            out
            | {k: v for k, v in estimates.items() if v is not None}
            | ({"withheld": self.withheld} if self.withheld else {})
            | (
                {"low": self.low, "high": self.high, "why": self.why}
                if self.low is not None
                else {}
            )
            | {"case_fields": self.case.given()}
        )


def withheld(name: str, case: Case, unit: str, reason: str) -> Result:
    """A number that was asked for and not reached: no value, and the reason."""
    return Result(name, case, float("nan"), unit, withheld=reason)


#: name that scripts know
Row = Result


@dataclass(frozen=True)
class Check:
    """A self-check: passed when ``value <= limit``; a value that is not a number does not pass.

    ``fatal`` checks that fail end the run with ``remedy``; others warn.

    Attributes
    ----------
    quantity
        Of an effect left out: the name of the result that was solved again with the effect, of the
        same case.
    without, included
        That result without the effect and with it, at the level of the second solve.
    """

    name: str
    case: Case
    value: float
    limit: float
    says: str
    remedy: str = ""
    fatal: bool = True
    quantity: str = ""
    without: float | None = None
    included: float | None = None

    @property
    def passed(self) -> bool:
        """Whether the value is within its limit."""
        return bool(self.value <= self.limit)

    @property
    def verdict(self) -> str:
        """passed, warning or failed."""
        return "passed" if self.passed else ("failed" if self.fatal else "warning")

    def as_dict(self) -> dict[str, Any]:
        """The check as it stands in summary.json."""
        data = asdict(self) | {"case": self.case.label, "verdict": self.verdict}
        # JSON has no NaN and no infinity.
        for name in ("value", "without", "included"):
            if data[name] is not None and not math.isfinite(data[name]):
                data[name] = None
        if not self.quantity:
            for name in ("quantity", "without", "included"):
                del data[name]
        return data | {"case_fields": self.case.given()}

    @property
    def sentence(self) -> str:
        """Name, case, value and limit, and the remedy."""
        case = f" ({self.case.label})" if self.case.label else ""
        return f"{self.name}{case}: {check_words(self.as_dict())}; {self.remedy}"


def left_out_check(
    name: str,
    case: Case,
    quantity: str,
    *,
    without: float,
    included: float,
    unit: str,
    limit: float,
    remedy: str,
    note: str = "",
    over: tuple[float, str] | None = None,
) -> Check:
    """An effect left out, verified on the number itself: solved again with the effect.

    Parameters
    ----------
    name
        Of the check, as the effect of the plan gives it.
    case, quantity
        The result that was solved again.
    without, included
        Its value without the effect and with it, both at the level of the second solve (which may
        be coarser than the run).
    unit
        Of both.
    limit
        Largest relative change before the run warns; the scene may set it.
    note
        What the change does not cover, in words.
    over
        What the change is a part of, and its name, for a number that may vanish: an area in stick.
    """
    change = abs(included / without - 1.0) if without else math.inf
    if over is not None:
        change = abs(included - without) / over[0] if over[0] else math.inf
        note = note or f"part of the {over[1]}"
    after = number(included, unit) if math.isfinite(included) else "a value not found"
    says = f"change of {number_label(quantity)}, {number(without)} to {after}"
    says += f" ({note})" if note else ""
    return Check(
        name, case, change, limit, says, remedy, False, quantity, float(without), float(included)
    )


_RANK = {"passed": 0, "warning": 1, "failed": 2}


def worst_check(checks: Iterable[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The worst of ``checks`` of one name, as they stand in summary.json.

    By verdict, then by value.
    """

    def badness(check: Mapping[str, Any]) -> tuple[int, float]:
        value = check["value"]
        return _RANK.get(check["verdict"], 2), math.inf if value is None else float(value)

    return max(checks, key=badness)


def worst_checks(checks: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """One check per name, in the order of the names: the worst of its cases."""
    found: dict[str, list[Mapping[str, Any]]] = {}
    for check in checks:
        found.setdefault(check["name"], []).append(check)
    return [worst_check(mine) for mine in found.values()]


OK, WARNED, FAILED = "ok", "ok with warnings", "failed"


def status_of(checks: Sequence[Check], results: Sequence[Result]) -> str:
    """How a run that was solved ended.

    Returns
    -------
    str
        "ok": every check passed and every number was reached. "ok with warnings: ..." names what
        warns and the numbers withheld. "failed: ..." when a fatal check failed, or when no number
        was reached.
    """
    fatal = [c for c in checks if not c.passed and c.fatal]
    if fatal:
        return f"{FAILED}: " + "; ".join(c.sentence for c in fatal)
    missing = [r for r in results if r.withheld]
    if missing and len(missing) == len(results):
        return f"{FAILED}: no number was reached; {missing[0].withheld}"
    told = warnings_of(checks, results)
    return f"{WARNED}: " + "; ".join(told) if told else OK


def with_fault(status: str, fault: str) -> str:
    """A status that also tells what went wrong with the pictures of a run."""
    return f"{WARNED}: {fault}" if status == OK else f"{status}; {fault}"


def warned(
    checks: Sequence[Check], results: Sequence[Result]
) -> dict[str, tuple[list[Check] | list[Result], list[str]]]:
    """What did not pass and what was not reached: name -> the checks or numbers, their cases."""
    found: dict[str, list[Any]] = {}
    for check in checks:
        if not check.passed:
            found.setdefault(check.name, []).append(check)
    for one in results:
        if one.withheld:
            found.setdefault(f"{number_label(one.name)} not reached", []).append(one)
    return {
        name: (mine, list(dict.fromkeys(one.case.label for one in mine)))
        for name, mine in found.items()
    }


def warnings_of(checks: Sequence[Check], results: Sequence[Result]) -> list[str]:
    """What did not pass and what was not reached, one sentence per name with its cases."""
    return [_named(name, labels) for name, (_, labels) in warned(checks, results).items()]


def warning_details(checks: Sequence[Check], results: Sequence[Result]) -> list[str]:
    """As `warnings_of`, each with the worst of its values, its limit and remedy, or the reason.

    What matters less stands later.
    """
    told = []
    for name, (mine, labels) in warned(checks, results).items():
        first = mine[0]
        if isinstance(first, Result):
            told.append(f"{_named(name, labels)}: {first.withheld}")
            continue
        worst = worst_check(c.as_dict() for c in mine if isinstance(c, Check))
        remedy = f"; {worst['remedy']}" if worst["remedy"] else ""
        told.append(f"{_named(f'{name}: {check_words(worst)}', labels)}{remedy}")
    return told


def _named(name: str, labels: Sequence[str]) -> str:
    """A name with its cases."""
    return name + (f" ({_some(labels)})" if any(labels) else "")


def _some(labels: Sequence[str], most: int = 2) -> str:
    """The first labels, and how many more there are."""
    shown = "; ".join(label for label in labels[:most] if label)
    return shown + (f"; and {len(labels) - most} more" if len(labels) > most else "")


def outcome_of(status: str) -> str:
    """ "ok", "ok with warnings" or "failed" (a run that was stopped failed) of a run's status."""
    word = status.partition(":")[0]
    return word if word in (OK, WARNED) else FAILED


class ArrayGroup(dict[str, Any]):
    """Variables of one group of result.nc: name -> (dimension names, array, attributes) or array.

    ``attributes`` are the group's own.

    The attributes say what the group holds (``content``: "normal", "tangential", "cycle", ...) and
    carry the case's.
    """

    def __init__(
        self,
        variables: Mapping[str, Any] | None = None,
        /,
        *,
        content: str = "",
        case: Case = NO_CASE,
        **attributes: Any,
    ) -> None:
        super().__init__(variables or {})
        self.attributes: dict[str, Any] = (
            ({"content": content} if content else {}) | case.given() | attributes
        )


def write_netcdf(path: Path, arrays: Mapping[str, Mapping[str, Any]]) -> None:
    """Write arrays as one netCDF-4 file, whole or not at all.

    Parameters
    ----------
    arrays
        Group -> name -> array or (dimension names, array, attributes); an `ArrayGroup` leaves its
        attributes on its group.

    Raises
    ------
    OSError
        As the file system does.
    """
    with whole_bytes(path) as content, h5netcdf.File(content, "w") as file:
        for name, variables in arrays.items():
            group = file.create_group(name.replace("/", " per ")) if name else file
            for key, value in getattr(variables, "attributes", {}).items():
                group.attrs[key] = np.int8(value) if isinstance(value, bool) else value
            for key, value in variables.items():
                dims, data, attributes = value if isinstance(value, tuple) else (None, value, {})
                _write_variable(group, key, np.asarray(data), dims, attributes)


def _write_variable(
    group: Any,
    name: str,
    data: np.ndarray[Any, Any],
    dims: Iterable[str] | None,
    attributes: Mapping[str, Any],
) -> None:
    if data.dtype == bool:
        data = data.astype(np.int8)
    dims = tuple(dims) if dims is not None else tuple(f"{name}_{i}" for i in range(data.ndim))
    for dim, length in zip(dims, data.shape, strict=True):
        if dim not in group.dimensions:
            group.dimensions[dim] = length
    variable = group.create_variable(name, dims, data.dtype, data=data)
    for key, text in attributes.items():
        variable.attrs[key] = text


def read_netcdf(path: Path) -> dict[str, ArrayGroup]:
    """Arrays of a result.nc: group -> variable -> array, with the groups' attributes."""

    def read(group: Any) -> ArrayGroup:
        found = ArrayGroup({name: variable[...] for name, variable in group.variables.items()})
        found.attributes.update(group.attrs)
        return found

    with h5netcdf.File(path, "r") as file:
        root = {"": read(file)} if file.variables else {}
        return root | {name: read(group) for name, group in file.groups.items()}
