"""Which curve of a file: blade, linear limit or F_C/F_E that the file itself gives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, get_args

from upd.errors import InputError
from upd.measured.curve import Blade, State

#: names of a column, or of an attribute, that gives what a curve is -> what it gives
LABELS = {
    "blade": "blade",
    "state": "state",
    "f_c/f_e": "force_ratio",
    "fc/fe": "force_ratio",
    "centrifugal_to_force": "force_ratio",
    "force_ratio": "force_ratio",
}
_SHOWN = {"blade": "blade", "state": "state", "force_ratio": "F_C/F_E"}
_WORDS = {"blade": get_args(Blade), "state": get_args(State)}


@dataclass(frozen=True)
class CurveLabel:
    """What a curve is, each None where it is not given.

    Attributes
    ----------
    blade : {"right", "left"} or None
    state : {"free", "stuck"} or None
    force_ratio : float or None
        F_C/F_E.
    """

    blade: Blade | None = None
    state: State | None = None
    force_ratio: float | None = None

    @property
    def words(self) -> str:
        """As messages show it."""
        given = [(name, getattr(self, name)) for name in _SHOWN]
        return ", ".join(f"{_SHOWN[k]} {_shown(v)}" for k, v in given if v is not None)

    @property
    def condition(self) -> str | None:
        """A linear limit or F_C/F_E: the one excludes the other."""
        given = self.state if self.force_ratio is None else self.force_ratio
        return None if given is None else _shown(given)

    def agrees(self, wanted: CurveLabel) -> bool:
        """Whether nothing it gives is other than what is wanted."""
        pairs = ((self.blade, wanted.blade), (self.condition, wanted.condition))
        return all(None in pair or pair[0] == pair[1] for pair in pairs)


class AskedCurve(NamedTuple):
    """Which response of a file is asked for.

    Attributes
    ----------
    column : str or None
        Name of the response without its unit, where the file holds several; of a netCDF file the
        variable, its groups in front of it with a slash.
    unit : str or None
        Of the response, where the file names none.
    label : CurveLabel
        Which curve, where the file gives it.
    """

    column: str | None = None
    unit: str | None = None
    label: CurveLabel = CurveLabel()


#: nothing given, nothing wanted
ANY = CurveLabel()


def _shown(value: Any) -> str:
    # as the labels of computed curves tell ratios apart
    return str(value) if isinstance(value, str) else f"{value:.6g}"


def read_label(name: str, given: Any) -> Any:
    """What a cell or an attribute gives of a curve.

    Parameters
    ----------
    name
        "blade", "state" or "force_ratio".
    given
        Words or a number; nothing given is None.

    Raises
    ------
    InputError
        Where it gives something else.
    """
    if given is None or not str(given).strip():
        return None
    if name in _WORDS:
        word = str(given).strip().casefold()
        if word not in _WORDS[name]:
            raise InputError(f"{given!r} is no {name}; write {' or '.join(_WORDS[name])}")
        return word
    try:
        ratio = float(given)
    except (TypeError, ValueError):
        ratio = math.nan
    if not (math.isfinite(ratio) and ratio > 0.0):
        raise InputError(f"{given!r} is no F_C/F_E; give a number above 0, or leave it empty")
    return ratio


def label_of(given: Mapping[str, Any]) -> CurveLabel:
    """A curve's label from what is given under names of `LABELS`.

    Raises
    ------
    InputError
        As `read_label` does.
    """
    known = {LABELS[key]: value for key, value in given.items() if key in LABELS}
    return CurveLabel(**{name: read_label(name, value) for name, value in known.items()})


def the_curve(found: Sequence[CurveLabel], wanted: CurveLabel) -> CurveLabel:
    """The one curve of a file that is wanted.

    Parameters
    ----------
    found
        Labels of the curves there are, each once.
    wanted
        What is asked for.

    Raises
    ------
    InputError
        Where none is it, or several are.
    """
    fitting = [one for one in found if one.agrees(wanted)]
    if len(fitting) == 1:
        return fitting[0]
    there = "; ".join(one.words for one in fitting or found)
    if not fitting:
        raise InputError(f"no curve of {wanted.words}; the file has {there}")
    raise InputError(
        f"{len(fitting)} curves, {there}; choose one by blade, state or centrifugal_to_force"
    )
