"""Measured responses in text files: comma, semicolon or tab between the cells of a line.

Lines that begin with # are comments. The first other line may name the columns, with their units
in brackets, as the files that a run leaves in its folder ``curves`` do:

    frequency [Hz], accelerance real [(m/s2)/N], accelerance imaginary [(m/s2)/N]

A response is one column of magnitudes or of complex numbers (``1.2-0.3j``), two of real and
imaginary part, or two of magnitude and phase; a column in deg or rad is a phase. Without names the
columns are frequency in Hz and magnitudes, or frequency, real and imaginary part. Where semicolons
or tabs part the cells, a decimal comma is understood.

Columns "blade" (left, right), "state" (free, stuck) and "F_C/F_E" say which curve a line is of, so
that one file may hold several.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from upd.errors import InputError
from upd.measured.curve import (
    LEAST_POINTS,
    QUANTITIES,
    ComplexArray,
    checked_curve,
    response_unit,
    the_one,
)
from upd.measured.label import ANY, LABELS, AskedCurve, CurveLabel, read_label, the_curve
from upd.mesh import FloatArray
from upd.units import UNITS, unit_factor

_SEPARATORS = ";\t,"
_UNIT = re.compile(r"(?P<name>.*?)\s*(?:\[(?P<square>[^\]]*)\]|\((?P<round>\S+)\))?\s*")
_DECIBEL = re.compile(r"(?<![^\W_])db(?![^\W_])", re.IGNORECASE)
_COMMA = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?")
#: last words of a column's name -> what of the response it holds
_PARTS = {
    "real": "real",
    "re": "real",
    "imaginary": "imaginary",
    "imag": "imaginary",
    "im": "imaginary",
    "phase": "phase",
    "phi": "phase",
    "arg": "phase",
    "angle": "phase",
    "amplitude": "magnitude",
    "magnitude": "magnitude",
    "mag": "magnitude",
    "modulus": "magnitude",
    "abs": "magnitude",
}
_WORDS = "|".join(_PARTS)
#: "Phase angle of x", "Abs(x)"; "x_real", "x imaginary part"
_PART = re.compile(
    rf"(?P<first>{_WORDS})\b\.?(?:\s+(?:part|angle))?(?:\s+of)?\s*(?:\((?P<inner>.*)\)|(?P<after>.*))"
    rf"|(?P<before>.*(?<![^\W_]))(?P<last>{_WORDS})\.?(?:\s+(?:part|angle))?",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class FileColumn:
    """A column of a text file: its place from 0, the response it belongs to ("" of the frequency
    and of labels), what of it, and its unit as written.
    """

    place: int
    name: str
    part: str
    unit: str


@dataclass
class Faults:
    """What is wrong with a file, each with its place; no more than a person reads."""

    found: list[str] = field(default_factory=list)

    def add(self, words: str, line: int, column: int = 0, name: str = "") -> None:
        """A fault of a line, of a cell of it where the column counts from 1."""
        at = f"line {line}" + (f", column {column}" if column else "")
        self.found.append(f"{at}{f' ({name})' if name else ''}: {words}")


@dataclass(frozen=True)
class TextCurve:
    """Frequency (n,) in Hz, rising, and the response (n,), complex or magnitudes, in ``unit``;
    ``label`` is what the file gives of it.
    """

    frequency: FloatArray
    values: ComplexArray | FloatArray
    unit: str
    label: CurveLabel = ANY


def read_text(path: Path, asked: AskedCurve) -> tuple[TextCurve | None, list[str]]:
    """A response of a text file, and all that is wrong with the file.

    Parameters
    ----------
    path
        The file.
    asked
        Which response.

    Returns
    -------
    TextCurve or None
        None where something is wrong.
    list of str
        Faults with line and column.
    """
    faults = Faults()
    lines = _lines(path, faults)
    if [text.strip() for _, text in lines[:2]] == ["-1", "58"]:
        faults.add(
            "is a universal file (data set 58); export it as CSV with the columns frequency, real "
            "and imaginary, each with its unit",
            lines[0][0],
        )
        return None, faults.found
    if not lines:
        if not faults.found:
            faults.add("no values; give lines of frequency and response", 1)
        return None, faults.found
    separator = _separator(lines)
    split = [(n, [cell.strip().strip('"') for cell in text.split(separator)]) for n, text in lines]
    columns, body, head = _columns(split, separator)
    chosen = _chosen(columns, asked.column, asked.unit, head, faults)
    if chosen is None:
        return None, faults.found
    parts, scale, own_unit = chosen
    label, body = _labelled(columns, body, asked.label, separator, head, faults)
    rows = _numbers(body, parts, separator, faults, max(c.place for c in columns) + 1)
    if faults.found:
        return None, faults.found
    at = [n for n, _ in body]
    if len(at) < LEAST_POINTS:
        last = at[-1] if at else head
        faults.add(f"ends with {len(at)} points; a curve has {LEAST_POINTS} or more", last)
        return None, faults.found
    f = scale * rows["frequency"]
    place = parts["frequency"].place + 1
    for k, words in checked_curve(f):
        faults.add(words, at[k], place, "frequency")
    values = _response(rows, parts)
    if not np.iscomplexobj(values):
        mine = next(c for kind, c in parts.items() if kind == "magnitude")
        for k in np.flatnonzero(values < 0.0).tolist():
            faults.add(
                f"the magnitude {values[k]:g} is negative; give linear magnitudes, or name the "
                "columns real and imaginary",
                at[k],
                mine.place + 1,
                mine.name,
            )
    if faults.found:
        return None, faults.found
    way = slice(None) if f[-1] > f[0] else slice(None, None, -1)
    return TextCurve(f[way], values[way], own_unit, label), []


def _lines(path: Path, faults: Faults) -> list[tuple[int, str]]:
    """Lines with something in them and their numbers from 1, without comments."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        line = path.read_bytes()[: error.start].count(b"\n") + 1
        faults.add("is no text in UTF-8; save the file as CSV in UTF-8", line)
        return []
    if "\0" in text:
        faults.add("holds NUL, so it is no text; save the file as CSV in UTF-8", 1)
        return []
    numbered = enumerate(text.splitlines(), 1)
    return [(n, line) for n, line in numbered if line.strip() and not line.lstrip().startswith("#")]


def _separator(lines: Sequence[tuple[int, str]]) -> str:
    """What parts the cells of most lines."""
    for mark in _SEPARATORS:
        if 2 * sum(mark in line for _, line in lines) > len(lines):
            return mark
    return ","


def _number(cell: str, separator: str) -> float | None:
    if separator != "," and _COMMA.fullmatch(cell):
        cell = cell.replace(",", ".")
    try:
        # float() understands more than a file should say: "1_000", "infinity"
        return float(cell) if "_" not in cell else None
    except ValueError:
        return None


def _complex(cell: str) -> complex | None:
    """``1.2-0.3j``, also in parentheses, with i, or with blanks."""
    try:
        return complex("".join(cell.split()).strip("()").replace("i", "j"))
    except ValueError:
        return None


def _columns(
    split: Sequence[tuple[int, list[str]]], separator: str
) -> tuple[list[FileColumn], list[tuple[int, list[str]]], int]:
    """The columns, the lines below their names, and the line of the names."""
    line, first = split[0]
    named = all(_number(cell, separator) is None for cell in first)
    if named:
        columns = _paired([_column(k, cell) for k, cell in enumerate(first)])
        return columns, list(split[1:]), line
    usual = ("magnitude",) if len(first) <= 2 else ("real", "imaginary")
    columns = [FileColumn(0, "", "frequency", "Hz")]
    return (
        [*columns, *(FileColumn(k, "response", part, "") for k, part in enumerate(usual, 1))],
        list(split),
        line,
    )


def _column(place: int, head: str) -> FileColumn:
    match = _UNIT.fullmatch(head)
    assert match is not None
    name, unit = match["name"].strip(), (match["square"] or match["round"] or "").strip()
    if name.casefold() in ("frequency", "freq", "freq.", "f"):
        return FileColumn(place, "", "frequency", unit)
    if _DECIBEL.search(head):
        unit = "dB"
    if name.casefold() in LABELS:
        return FileColumn(place, "", LABELS[name.casefold()], unit)
    part, rest = "magnitude", name
    if match := _PART.fullmatch(name):
        part = _PARTS[(match["first"] or match["last"]).casefold()]
        given = match["inner"] or match["after"] or match["before"] or ""
        rest = given.strip(" _") or "response"
    elif unit in UNITS["angle"]:
        part = "phase"
    return FileColumn(place, rest, part, unit)


def _paired(columns: list[FileColumn]) -> list[FileColumn]:
    """The only phase of a file belongs to its only magnitudes, however they are named."""
    phases = [c for c in columns if c.part == "phase"]
    others = [c for c in columns if c.name and c.part != "phase"]
    names = {c.name for c in others if _is_response(c, None)} or {c.name for c in others}
    if len(phases) != 1 or len(names) != 1:
        return columns
    return [replace(c, name=min(names)) if c in phases else c for c in columns]


def _chosen(
    columns: Sequence[FileColumn], wanted: str | None, unit: str | None, line: int, faults: Faults
) -> tuple[dict[str, FileColumn], float, str] | None:
    """The columns of frequency and of the response by their parts, factor to Hz, unit."""
    axis = [c for c in columns if c.part == "frequency"]
    if len(axis) != 1:
        faults.add(
            f"{len(axis) or 'no'} column{'s' * (len(axis) > 1)} of frequency; name one "
            '"frequency [Hz]"',
            line,
        )
        return None
    scale = 1.0
    try:
        scale = unit_factor(axis[0].unit, ["frequency"])[1]
    except InputError as error:
        faults.add(_without_unit(axis[0].unit, error), line, axis[0].place + 1, "frequency")
    names = list(dict.fromkeys(c.name for c in columns if c.name and _is_response(c, unit)))
    if not names and wanted is None:
        # its unit is what is wrong: reported below
        names = list(dict.fromkeys(c.name for c in columns if c.name))[:1]
    try:
        name = the_one(names, wanted, "columns")
    except InputError as error:
        faults.add(str(error), line)
        return None
    parts = _parts([c for c in columns if c.name == name], name, line, faults)
    responses = [c for kind, c in parts.items() if kind not in ("frequency", "phase")]
    units = {unit or c.unit for c in responses}
    for c in responses:
        try:
            response_unit(c.unit, unit)
        except InputError as error:
            faults.add(_without_unit(unit or c.unit, error), line, c.place + 1, c.name)
    if len(units) > 1:
        faults.add(f"the parts of {name} have different units, {' and '.join(units)}", line)
    magnitudes = {c.name for c in columns if c.part == "magnitude"}
    for c in columns:
        if c.part == "phase" and c.name not in magnitudes and "phase" not in parts:
            words = f'a phase of no response; name it "{name} phase", or remove it'
            faults.add(words, line, c.place + 1, c.name)
    if "phase" in parts:
        try:
            unit_factor(parts["phase"].unit, ["angle"])
        except InputError as error:
            c = parts["phase"]
            faults.add(_without_unit(c.unit, error), line, c.place + 1, f"{c.name} phase")
    if faults.found:
        return None
    return {"frequency": axis[0], **parts}, scale, unit or responses[0].unit


def _is_response(c: FileColumn, unit: str | None) -> bool:
    """Whether a column's unit is that of a response, or is given beside the file."""
    if unit is not None or c.part == "phase":
        return True
    try:
        unit_factor(c.unit, QUANTITIES)
    except InputError:
        return False
    return True


def _without_unit(unit: str, error: InputError) -> str:
    if unit:
        return str(error)
    return f"no unit; write it in brackets behind the name ({str(error).partition('; ')[2]})"


def _parts(
    mine: Sequence[FileColumn], name: str, line: int, faults: Faults
) -> dict[str, FileColumn]:
    """Real and imaginary part, or magnitude and phase, or magnitude alone."""
    found = {c.part: c for c in mine}
    if len(found) < len(mine):
        faults.add(f"several columns {name}; give each its own name", line)
    if {"real", "imaginary"} <= set(found):
        return {part: found[part] for part in ("real", "imaginary")}
    if "magnitude" in found:
        return {part: found[part] for part in ("magnitude", "phase") if part in found}
    (have,) = list(found)[:1]
    lacks = {"real": "imaginary", "imaginary": "real", "phase": "magnitude"}[have]
    faults.add(f"{name} has a column {have} but none {lacks}; add it", line)
    return {}


def _labelled(
    columns: Sequence[FileColumn],
    body: list[tuple[int, list[str]]],
    wanted: CurveLabel,
    separator: str,
    line: int,
    faults: Faults,
) -> tuple[CurveLabel, list[tuple[int, list[str]]]]:
    """The label of the wanted curve and its lines; all lines where no column gives it."""
    mine = [c for c in columns if c.part in LABELS.values()]
    if not mine:
        return ANY, body
    labels = []
    for at, cells in body:
        given = {}
        for c in mine:
            cell = cells[c.place] if c.place < len(cells) else ""
            if c.part == "force_ratio":
                cell = cell.replace(",", ".") if separator != "," else cell
            try:
                given[c.part] = read_label(c.part, cell)
            except InputError as error:
                faults.add(str(error), at, c.place + 1, c.part)
        labels.append(CurveLabel(**given))
    if faults.found:
        return ANY, body
    try:
        label = the_curve(list(dict.fromkeys(labels)), wanted)
    except InputError as error:
        faults.add(str(error), line)
        return ANY, body
    return label, [row for row, one in zip(body, labels, strict=True) if one == label]


def _numbers(
    body: Sequence[tuple[int, list[str]]],
    parts: Mapping[str, FileColumn],
    separator: str,
    faults: Faults,
    width: int,
) -> dict[str, FloatArray]:
    """The cells of the columns that count, as numbers."""
    out: dict[str, list[complex]] = {kind: [] for kind in parts}
    for line, cells in body:
        if len(cells) > width and any(cells[width:]):
            faults.add(f"{len(cells)} cells where there are {width} columns", line)
        for kind, c in parts.items():
            name = kind if kind == "frequency" else c.name
            if c.place >= len(cells) or not cells[c.place]:
                faults.add(
                    "nothing there; give a number, or remove the line", line, c.place + 1, name
                )
                continue
            value: complex | None = _number(cells[c.place], separator)
            if value is None and kind == "magnitude" and "phase" not in parts:
                value = _complex(cells[c.place])
            if value is None or not np.isfinite(value):
                faults.add(
                    f"{cells[c.place]!r} is no finite number; correct it, or remove the line",
                    line,
                    c.place + 1,
                    name,
                )
                continue
            out[kind].append(value)
    return {kind: np.array(values) for kind, values in out.items()}


def _response(
    rows: Mapping[str, FloatArray], parts: Mapping[str, FileColumn]
) -> ComplexArray | FloatArray:
    """(n,) complex where real and imaginary part or the phase are given, else magnitudes."""
    if "real" in parts:
        return np.asarray(rows["real"] + 1j * rows["imaginary"])
    if "phase" not in parts:
        return rows["magnitude"]
    # the inner unit of angles is the degree
    degrees = unit_factor(parts["phase"].unit, ["angle"])[1] * rows["phase"]
    return np.asarray(rows["magnitude"] * np.exp(1j * np.deg2rad(degrees)))
