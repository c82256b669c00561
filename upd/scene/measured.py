"""Measured responses of a scene: which files, of which blade and state, and damping from them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from upd.errors import InputError
from upd.measured.curve import RESPONSE_UNITS, CurveLabel, MeasuredCurve, label_of
from upd.measured.damping import DampingFit, fit_damping
from upd.measured.read import MOST_TOLD, found_in, read_measured
from upd.scene import quantities as q

#: excitation.damping where the measured free curves give it, and its value until they are read
FROM_MEASURED, UNTIL_READ = "measured", "0.5 %"
#: blade, frequency in Hz and damping ratio of a mode of a blade without damper
FittedMode = tuple[str, float, float]
ResponseUnit = Annotated[str, q.one_of(RESPONSE_UNITS), q.Example('"(m/s2)/N"')]


@dataclass(frozen=True)
class MeasuredChoice:
    """A measured frequency response, drawn over the computed ones and compared with them.

    Attributes
    ----------
    file
        A CSV file (comma, semicolon or tab; the first line names the columns with their units,
        "frequency [Hz]", "accelerance real [(m/s2)/N]"; lines of # are comments) or netCDF-4 (.nc),
        relative to the scene's.
    blade
        Whose acceleration along x it is, per newton of F_E. This, state and centrifugal_to_force
        choose a curve of a file that has such columns (or attributes, in netCDF), and may be left
        out where it holds one.
    state
        "free", without the damper, or "stuck", when it is a linear limit.
    centrifugal_to_force
        F_C/F_E it was measured at, instead of a state.
    column
        Name of the response without its unit where the file holds several; in netCDF the variable,
        its groups in front: "linear own/accelerance_free_right".
    unit
        Of the response where the file does not give it; distinguishes accelerance, mobility and
        receptance.
    digest
        SHA-256 of the file, which a run writes into its own scene: another file is then refused.
    """

    file: Annotated[str, q.Example('"free.csv"', bounds="a .csv, text or .nc file")]
    blade: Literal["right", "left"] = "right"
    state: Literal["free", "stuck"] | None = None
    centrifugal_to_force: q.Ratio | None = None
    column: str | None = None
    unit: ResponseUnit | None = None
    digest: str | None = None

    @property
    def label(self) -> CurveLabel:
        """Which curve of the file."""
        return CurveLabel(self.blade, self.state, self.centrifugal_to_force, self.column, self.unit)

    def read(self) -> MeasuredCurve:
        """The curve.

        Raises
        ------
        InputError
            With all that is wrong with the file.
        """
        return read_measured(
            self.file,
            blade=self.blade,
            state=self.state,
            force_ratio=self.centrifugal_to_force,
            column=self.column,
            unit=self.unit,
        )


def note_files(data: Mapping[str, Any]) -> None:
    """Put in the digests of the files of measured curves, and what a file of one curve gives of it:
    blade, state, F_C/F_E.

    A table that is wrong stays as it is: its faults are found later, all at once.
    """
    keys = {"blade": "blade", "state": "state", "force_ratio": "centrifugal_to_force"}
    tables = data.get("measured")
    for table in tables.values() if isinstance(tables, dict) else ():
        file = table.get("file") if isinstance(table, dict) else None
        path = Path(file) if isinstance(file, str) else Path()
        digest = digest_of_file(path)
        if not digest:
            continue
        table.setdefault("digest", digest)
        column, unit = (
            text if isinstance(text := table.get(key), str) else None for key in ("column", "unit")
        )
        try:
            wanted = label_of({key: table[key] for key in keys.values() if key in table})
            found, _ = found_in(path, replace(wanted, column=column, unit=unit))
        except InputError:
            continue
        for name, key in keys.items():
            if found is not None and (given := getattr(found, name)) is not None:
                table.setdefault(key, given)


def digest_of_file(path: Path) -> str:
    """SHA-256 of a file, "" where it cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except (OSError, ValueError):
        return ""


def measured_problems(measured: Mapping[str, MeasuredChoice]) -> Iterator[str]:
    """What is wrong with measured curves and their files, every fault with line and column."""
    for name, one in measured.items():
        where, path = f"measured.{name}", Path(one.file)
        if (one.state is None) == (one.centrifugal_to_force is None):
            given = "are both given" if one.state is not None else "are both missing"
            yield (
                f"{where}: state and centrifugal_to_force {given}; give one: state = "
                '"free" or "stuck", or F_C/F_E'
            )
        now = digest_of_file(path)
        if one.digest is not None and now and one.digest != now:
            yield (
                f"{where}.file: {path} is not the file that the scene was run with (digest); "
                "give that file, or remove digest to take this one"
            )
            continue
        _, faults = found_in(path, one.label)
        yield from [f"{where}.file: {path.name}, {fault}" for fault in faults[:MOST_TOLD]]
        if len(faults) > MOST_TOLD:
            yield f"{where}.file: {path.name}: and {len(faults) - MOST_TOLD} more"


def fitted_modes(
    measured: Mapping[str, MeasuredChoice], data: Mapping[str, Any], table: str
) -> tuple[tuple[FittedMode, ...], float]:
    """Modes of both blades without damper from the measured free curves, where the scene asks for
    them, and the damping ratio that stands for all: of the highest peak; none, and 0 else.

    Parameters
    ----------
    measured
        Name -> choice.
    data
        The scene's tables.
    table
        Of the scene that may ask for them.

    Raises
    ------
    InputError
        Without a free curve, or where one cannot be fitted.
    """
    # damaged files are found with the other problems
    if data.get(table, {}).get("damping") != FROM_MEASURED or any(measured_problems(measured)):
        return (), 0.0
    out: list[FittedMode] = []
    heights: list[float] = []
    for name, one in measured.items():
        if one.state != "free":
            continue
        try:
            fit = fit_of(one)
        except InputError as error:
            raise InputError(f"measured.{name}: {error}") from None
        out += [
            (one.blade, float(f), float(z)) for f, z in zip(fit.frequency, fit.zeta, strict=True)
        ]
        # of its peak by itself
        heights += (np.abs(fit.constant) / (2.0 * fit.zeta)).tolist()
    if not out:
        raise InputError(
            f'{table}.damping: "{FROM_MEASURED}" needs a measured free curve; add a table '
            '[measured.NAME] with state = "free", or give a damping ratio'
        )
    return tuple(out), out[int(np.argmax(heights))][2]


@cache
def fit_of(choice: MeasuredChoice) -> DampingFit:
    """Damping fitted to a measured curve; one that did not change, by its digest, is fitted once.

    Raises
    ------
    InputError
        As `upd.measured.fit_damping` does.
    """
    return fit_damping(choice.read())
