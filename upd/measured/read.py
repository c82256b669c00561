"""The one door to files of measured responses."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from upd.errors import InputError
from upd.measured.curve import Blade, MeasuredCurve, State, as_accelerance
from upd.measured.label import AskedCurve, CurveLabel
from upd.measured.netcdf import read_variables
from upd.measured.text import TextCurve, read_text

_NETCDF = (".nc", ".nc4", ".cdf", ".h5")
#: faults of one file that are reported
MOST_TOLD = 20


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
        A text file, see `upd.measured.text`, or a netCDF-4 file (.nc), see `upd.measured.netcdf`.
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
    asked = AskedCurve(column, unit, CurveLabel(blade, state, force_ratio))
    found, faults = found_in(place, asked)
    if found is None:
        more = len(faults) - MOST_TOLD
        shown = faults[:MOST_TOLD] + ([f"and {more} more"] if more > 0 else [])
        raise InputError(
            f"{place}: {len(faults)} problem{'s' * (len(faults) != 1)}\n"
            + "\n".join(f"  {one}" for one in shown)
        )
    H, quantity = as_accelerance(found.frequency, found.values, found.unit)
    label = found.label
    return MeasuredCurve(
        found.frequency,
        H,
        blade or label.blade or "right",
        state or label.state,
        label.force_ratio if force_ratio is None else force_ratio,
        quantity,
        found.unit,
        place,
    )


def found_in(path: Path, asked: AskedCurve) -> tuple[TextCurve | None, list[str]]:
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
        return None, [f"cannot be read ({error.strerror}); give the file of a measured curve"]


@lru_cache(maxsize=64)
def _found(
    path: Path, changed: int, size: int, asked: AskedCurve
) -> tuple[TextCurve | None, list[str]]:
    del changed, size
    read = read_variables if path.suffix.lower() in _NETCDF else read_text
    return read(path, asked)
