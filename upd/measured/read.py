"""The one door to files of measured responses; of these netCDF-4 files are read here.

A variable ``frequency`` in Hz and the response along its dimension, each with its attribute
``units``: real numbers are magnitudes, a last dimension of two holds real and imaginary part. The
result.nc of a run is such a file: its variables stand in groups,
"linear own/accelerance_free_right".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, get_args

import numpy as np

from upd.errors import InputError, one_line
from upd.measured.curve import (
    LEAST_POINTS,
    RESPONSE_UNITS,
    Blade,
    CurveLabel,
    Faults,
    MeasuredCurve,
    State,
    checked_curve,
    label_of,
    response_unit,
    the_curve,
    the_one,
)
from upd.measured.text import read_text
from upd.results.netcdf import open_netcdf
from upd.units import unit_factor

_AXIS = "frequency"
_NETCDF = (".nc", ".nc4", ".cdf", ".h5")
#: faults of one file that are reported
MOST_TOLD = 20


def read_variables(file: Any, asked: CurveLabel, faults: Faults) -> MeasuredCurve:
    """A response of an open netCDF file.

    Parameters
    ----------
    file
        The file.
    asked
        Which response.
    faults
        Gets what is wrong with the file, with variable and place.

    Raises
    ------
    InputError
        Where something is wrong.
    """
    found = dict(_responses(file, "", asked.unit))
    labels = {name: label_of(_said(*one)) for name, one in found.items()}
    fitting = [name for name, label in labels.items() if label.agrees(asked)]
    names = fitting if asked.column is None and fitting else list(found)
    name = the_one(names, asked.column, "variables")
    label = the_curve([labels[name]], asked)
    group, variable = found[name]
    axis, scale, unit = group.variables[_AXIS], 1.0, ""
    with faults.at(f"variable {_AXIS}, attribute units"):
        scale = unit_factor(_units(axis), ["frequency"])[1]
    with faults.at(f"variable {name}, attribute units"):
        unit = response_unit(_units(variable), asked.unit)
    f, data = scale * np.asarray(axis[...], float), np.asarray(variable[...], float)
    for which, values in ((_AXIS, f), (name, data)):
        for k in np.argwhere(~np.isfinite(values)):
            at = ", ".join(map(str, k))
            faults.add(f"variable {which}, place [{at}]", "no finite number; leave it out")
    if len(f) < LEAST_POINTS:
        faults.add(f"variable {_AXIS}", f"{len(f)} points; a curve has {LEAST_POINTS} or more")
    faults.check()
    values = data[:, 0] + 1j * data[:, 1] if data.ndim == 2 else data
    return checked_curve(
        f,
        values,
        unit,
        label,
        faults,
        lambda what, k: f"variable {_AXIS if what == 'frequency' else name}, place [{k}]",
        "magnitudes, or a last dimension of real and imaginary part",
    )


def _said(group: Any, variable: Any) -> dict[str, Any]:
    """What the attributes say of a curve, the variable's own before its group's."""
    given = {str(key).casefold(): value for key, value in group.attrs.items()}
    if given.get("kind") in get_args(State):
        # as a run writes its own groups
        given.setdefault("state", given["kind"])
    return given | {str(key).casefold(): value for key, value in variable.attrs.items()}


def _units(variable: Any) -> str:
    """The attribute ``units``, "" without."""
    return str(variable.attrs.get("units", ""))


def _responses(group: Any, path: str, unit: str | None) -> Iterator[tuple[str, tuple[Any, Any]]]:
    """Name -> group and variable of everything over frequency that may be a response."""
    if _AXIS in group.variables:
        (along,) = group.variables[_AXIS].dimensions[:1] or ("",)
        for name, variable in group.variables.items():
            dims, shape = variable.dimensions, variable.shape
            over = dims == (along,) or (len(dims) == 2 and dims[0] == along and shape[1] == 2)
            known = unit is not None or _units(variable) in RESPONSE_UNITS
            if name != _AXIS and over and known:
                yield f"{path}{name}", (group, variable)
    for name, inner in group.groups.items():
        yield from _responses(inner, f"{path}{name}/", unit)


def read_measured(
    path: str | Path,
    *,
    blade: Blade | None = None,
    state: State | None = None,
    force_ratio: float | None = None,
    column: str | None = None,
    unit: str | None = None,
) -> MeasuredCurve:
    """Read a measured frequency response from a CSV or netCDF file.

    Accelerance, mobility or receptance, known by the unit, becomes an accelerance in (m/s2)/N:
    complex, or magnitudes where no phase was measured.

    Parameters
    ----------
    path : str or Path
        A text file, see `upd.measured.text`, or a netCDF-4 file (.nc).
    blade : {"right", "left"}, optional
        Whose acceleration along x it is; where neither this nor the file gives it, the right one's.
    state : {"free", "stuck"}, optional
        Without the damper, or with every contact point sticking.
    force_ratio : float, optional
        F_C/F_E of a curve with friction. Like blade and state it chooses a curve of a file that
        gives the curves it has.
    column : str, optional
        Name of the response where the file holds several.
    unit : str, optional
        Of the response where the file does not say it: "g/N", "(mm/s)/N", "um/N".

    Returns
    -------
    MeasuredCurve

    Raises
    ------
    InputError
        When the file is not there or damaged: one message with every fault, its line and column.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> from upd.measured import read_measured
    >>> path = Path(mkdtemp()) / "free.csv"
    >>> _ = path.write_text("frequency [Hz], mobility [(mm/s)/N]" + chr(10)
    ...     + "340, 5.0" + chr(10) + "341, 7.0" + chr(10) + "342, 4.0")
    >>> curve = read_measured(path, state="free")
    >>> curve.quantity, curve.magnitude.round(2).tolist()
    ('mobility', [10.68, 15.0, 8.6])
    """
    place = Path(path)
    asked = CurveLabel(blade, state, force_ratio, column, unit)
    found, faults = found_in(place, asked)
    if found is None:
        more = len(faults) - MOST_TOLD
        shown = faults[:MOST_TOLD] + ([f"and {more} more"] if more > 0 else [])
        raise InputError(
            f"{place}: {len(faults)} problem{'s' * (len(faults) != 1)}\n"
            + "\n".join(f"  {one}" for one in shown)
        )
    return found


def found_in(path: Path, asked: CurveLabel) -> tuple[MeasuredCurve | None, list[str]]:
    """What a file holds, or its faults; files that did not change are read once.

    Parameters
    ----------
    path
        The file.
    asked
        Which response.
    """
    try:
        file = path.stat()
        return _found(path, file.st_mtime_ns, file.st_size, asked)
    except OSError as error:
        reason = error.strerror or one_line(error)
        return None, [f"cannot be read ({reason}); give a measured curve as CSV or netCDF-4"]


@lru_cache(maxsize=64)
def _found(
    path: Path, changed: int, size: int, asked: CurveLabel
) -> tuple[MeasuredCurve | None, list[str]]:
    del changed, size
    faults = Faults()
    try:
        if path.suffix.lower() in _NETCDF:
            with open_netcdf(path) as file:
                curve = read_variables(file, asked, faults)
        else:
            curve = read_text(path, asked, faults)
    except InputError as error:
        return None, faults.found or [str(error)]
    ratio = curve.force_ratio if asked.force_ratio is None else asked.force_ratio
    blade, state = asked.blade or curve.blade, asked.state or curve.state
    return replace(curve, blade=blade, state=state, force_ratio=ratio, source=path), []
