"""What a run leaves behind: cases, numbers, checks, and arrays in one netCDF file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np

from upd.cache.files import whole_file


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
            shown("choice"),
            shown("part", "{} f1"),
            shown("frequency", "{} Hz"),
            shown("side"),
        ]
        return ", ".join(part for part in parts if part)

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


def shared_label(cases: Iterable[Case]) -> str:
    """The label that cases share, with * for the values that differ.

    Only * is left when not the same attributes apply to all of them.
    """
    different = list(dict.fromkeys(cases))
    given = [case.given() for case in different]
    if any(set(one) != set(given[0]) for one in given):
        return "*"
    varying = frozenset(name for name in given[0] if len({one[name] for one in given}) > 1)
    return different[0]._label(varying)


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

    @property
    def error(self) -> float | None:
        """Relative difference from the reference."""
        return (
            None
            if self.reference is None or self.reference == 0.0
            else self.value / self.reference - 1.0
        )

    @property
    def thesis_error(self) -> float | None:
        """`printed_error` under its former name."""
        return self.printed_error

    def as_dict(self) -> dict[str, Any]:
        """The number as it stands in summary.json.

        ``case`` in words, its attributes under ``case_fields``.
        """
        out: dict[str, Any] = {
            "name": self.name,
            "case": self.case.label,
            "value": self.value,
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
            | {"case_fields": self.case.given()}
        )


#: name that scripts know
Row = Result


@dataclass(frozen=True)
class Check:
    """A self-check: passed when ``value <= limit``.

    ``fatal`` checks that fail end the run with ``remedy``; others warn.
    """

    name: str
    case: Case
    value: float
    limit: float
    says: str
    remedy: str = ""
    fatal: bool = True

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
        return data | {"case_fields": self.case.given()}

    @property
    def sentence(self) -> str:
        """Name, case, value and limit, and the remedy."""
        case = f" ({self.case.label})" if self.case.label else ""
        return (
            f"{self.name}{case}: {self.says} = {self.value:.3g}, limit {self.limit:.3g}; "
            f"{self.remedy}"
        )


_RANK = {"passed": 0, "warning": 1, "failed": 2}


def worst_check(checks: Iterable[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The worst of ``checks`` of one name, as they stand in summary.json.

    By verdict, then by value.
    """
    return max(checks, key=lambda c: (_RANK.get(c["verdict"], 2), c["value"]))


def worst_checks(checks: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """One check per name, in the order of the names: the worst of its cases."""
    found: dict[str, list[Mapping[str, Any]]] = {}
    for check in checks:
        found.setdefault(check["name"], []).append(check)
    return [worst_check(mine) for mine in found.values()]


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
    OSError, RuntimeError
        As the file system and HDF5 do.
    """
    with whole_file(path) as temporary, h5netcdf.File(temporary, "w") as file:
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
