"""Measured responses in text files: comma, semicolon or tab between the cells of a line.

Lines that begin with # are comments. The first other line names the columns, with their units in
brackets, as the files that a run leaves in its folder ``curves`` do:

    frequency [Hz], accelerance real [(m/s2)/N], accelerance imaginary [(m/s2)/N]

A response is one column of magnitudes, two of real and imaginary part, or two of magnitude and
phase; a column in deg or rad is a phase. A decimal comma is understood where semicolons or tabs
part the cells.

Columns "blade" (left, right), "state" (free, stuck) and "F_C/F_E" say which curve a line is of, so
that one file may hold several.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from upd.errors import InputError
from upd.measured.curve import (
    ANY,
    LABELS,
    LEAST_POINTS,
    QUANTITIES,
    RESPONSE_UNITS,
    AskedCurve,
    ComplexArray,
    CurveLabel,
    ReadCurve,
    at,
    checked_curve,
    read_label,
    response_unit,
    the_curve,
    the_one,
)
from upd.mesh import FloatArray
from upd.units import UNITS, unit_factor

_SEPARATORS = ";\t,"
_UNIT = re.compile(r"(?P<name>.*?)\s*(?:\[(?P<square>[^\]]*)\]|\((?P<round>\S+)\))?\s*")
_DECIBEL = re.compile(r"(?<![^\W_])db(?![^\W_])", re.IGNORECASE)
_COMMA = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?")
#: last words of a column's name -> what of the response it holds
_PARTS = {
    word: part
    for part, words in {
        "real": "real re",
        "imaginary": "imaginary imag im",
        "phase": "phase phi arg angle",
        "magnitude": "amplitude magnitude mag modulus abs",
    }.items()
    for word in words.split()
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


def _cell(line: int, place: int, name: str) -> str:
    """Where a cell is, as messages say it."""
    return f"line {line}, column {place + 1} ({name})"


def read_text(path: Path, asked: AskedCurve) -> ReadCurve:
    """A response of a text file.

    Parameters
    ----------
    path
        The file.
    asked
        Which response.

    Raises
    ------
    InputError
        What is wrong with the file first, with line and column.
    """
    lines = _lines(path)
    separator = _separator(lines)
    split = [(n, [cell.strip().strip('"') for cell in text.split(separator)]) for n, text in lines]
    (head, names), *body = split
    columns = [_column(k, name) for k, name in enumerate(names)]
    parts, scale, unit = _chosen(columns, asked, head)
    label, body = _labelled(columns, body, asked.label, separator, head)
    rows = _numbers(body, parts, separator, max(c.place for c in columns) + 1)
    numbers = [n for n, _ in body]
    if len(numbers) < LEAST_POINTS:
        last = numbers[-1] if numbers else head
        raise InputError(
            f"line {last}: ends with {len(numbers)} points; a curve has {LEAST_POINTS} or more"
        )

    def place(what: str, k: int) -> str:
        return _cell(numbers[k], parts[what].place, parts[what].name or what)

    return checked_curve(
        ReadCurve(scale * rows["frequency"], _response(rows, parts), unit, label),
        place,
        "linear magnitudes, or name the columns real and imaginary",
    )


def _lines(path: Path) -> list[tuple[int, str]]:
    """Lines with something in them and their numbers from 1, without comments."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        line = path.read_bytes()[: error.start].count(b"\n") + 1
        raise InputError(
            f"line {line}: is no text in UTF-8; save the file as CSV in UTF-8"
        ) from None
    numbered = enumerate(text.splitlines(), 1)
    lines = [(n, one) for n, one in numbered if one.strip() and not one.lstrip().startswith("#")]
    if not lines:
        raise InputError("line 1: no values; give lines of frequency and response")
    return lines


def _separator(lines: Sequence[tuple[int, str]]) -> str:
    """What parts the cells of most lines."""
    most = (m for m in _SEPARATORS if 2 * sum(m in line for _, line in lines) > len(lines))
    return next(most, ",")


def _number(cell: str, separator: str) -> float | None:
    if separator != "," and _COMMA.fullmatch(cell):
        cell = cell.replace(",", ".")
    try:
        # float() understands more than a file should say: "1_000", "infinity"
        return float(cell) if "_" not in cell else None
    except ValueError:
        return None


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


def _chosen(
    columns: Sequence[FileColumn], asked: AskedCurve, line: int
) -> tuple[dict[str, FileColumn], float, str]:
    """The columns of frequency and of the response by their parts, factor to Hz, unit."""
    axis, unit = [c for c in columns if c.part == "frequency"], asked.unit
    if len(axis) != 1:
        many = f"{len(axis) or 'no'} column{'s' * (len(axis) > 1)}"
        raise InputError(f'line {line}: {many} of frequency; name one "frequency [Hz]"')
    with at(_cell(line, axis[0].place, "frequency")):
        scale = _factor(axis[0].unit, ["frequency"])
    named = [c for c in columns if c.name]
    good = [c for c in named if unit or c.part == "phase" or c.unit in RESPONSE_UNITS]
    # of none the unit is what is wrong: reported below
    names = list(dict.fromkeys(c.name for c in good or named[: asked.column is None]))
    with at(f"line {line}"):
        name = the_one(names, asked.column, "columns")
        parts = _parts([c for c in columns if c.name == name], name)
    responses = [c for kind, c in parts.items() if kind != "phase"]
    for c in responses:
        with at(_cell(line, c.place, c.name)):
            if not (c.unit or unit):
                _factor("", QUANTITIES)
            response_unit(c.unit, unit)
    units = {unit or c.unit for c in responses}
    if len(units) > 1:
        raise InputError(
            f"line {line}: the parts of {name} have different units, {' and '.join(units)}"
        )
    magnitudes = {c.name for c in columns if c.part == "magnitude"}
    for c in columns:
        if c.part == "phase" and c.name not in magnitudes and "phase" not in parts:
            words = f'a phase of no response; name it "{name} phase", or remove it'
            raise InputError(f"{_cell(line, c.place, c.name)}: {words}")
    if "phase" in parts:
        c = parts["phase"]
        with at(_cell(line, c.place, f"{c.name} phase")):
            _factor(c.unit, ["angle"])
    return {"frequency": axis[0], **parts}, scale, unit or responses[0].unit


def _factor(unit: str, kinds: Sequence[str]) -> float:
    """From a column's unit to the inner one; InputError with a remedy where it has none."""
    try:
        return unit_factor(unit, kinds)[1]
    except InputError as error:
        if unit:
            raise
        known = str(error).partition("; ")[2]
        raise InputError(f"no unit; write it in brackets behind the name ({known})") from None


def _parts(mine: Sequence[FileColumn], name: str) -> dict[str, FileColumn]:
    """Real and imaginary part, or magnitude and phase, or magnitude alone."""
    found = {c.part: c for c in mine}
    if len(found) < len(mine):
        raise InputError(f"several columns {name}; give each its own name")
    if {"real", "imaginary"} <= set(found):
        return {part: found[part] for part in ("real", "imaginary")}
    if "magnitude" in found:
        return {part: found[part] for part in ("magnitude", "phase") if part in found}
    (have,) = list(found)[:1]
    lacks = {"real": "imaginary", "imaginary": "real", "phase": "magnitude"}[have]
    raise InputError(f"{name} has a column {have} but none {lacks}; add it")


def _labelled(
    columns: Sequence[FileColumn],
    body: list[tuple[int, list[str]]],
    wanted: CurveLabel,
    separator: str,
    line: int,
) -> tuple[CurveLabel, list[tuple[int, list[str]]]]:
    """The label of the wanted curve and its lines; all lines where no column gives it."""
    mine = [c for c in columns if c.part in LABELS.values()]
    if not mine:
        return ANY, body
    labels = []
    for number, cells in body:
        given = {}
        for c in mine:
            cell = cells[c.place] if c.place < len(cells) else ""
            if c.part == "force_ratio":
                cell = cell.replace(",", ".") if separator != "," else cell
            with at(_cell(number, c.place, c.part)):
                given[c.part] = read_label(c.part, cell)
        labels.append(CurveLabel(**given))
    with at(f"line {line}"):
        label = the_curve(list(dict.fromkeys(labels)), wanted)
    return label, [row for row, one in zip(body, labels, strict=True) if one == label]


def _numbers(
    body: Sequence[tuple[int, list[str]]],
    parts: Mapping[str, FileColumn],
    separator: str,
    width: int,
) -> dict[str, FloatArray]:
    """The cells of the columns that count, as numbers."""
    out: dict[str, list[float]] = {kind: [] for kind in parts}
    for line, cells in body:
        if len(cells) > width and any(cells[width:]):
            raise InputError(f"line {line}: {len(cells)} cells where there are {width} columns")
        for kind, c in parts.items():
            cell = cells[c.place] if c.place < len(cells) else ""
            value = _number(cell, separator)
            if value is None or not np.isfinite(value):
                words = f"{cell!r} is no finite number; correct" if cell else "nothing there; fill"
                raise InputError(
                    f"{_cell(line, c.place, c.name or kind)}: {words} it, or remove the line"
                )
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
