"""Measured responses in text files: comma, semicolon or tab between the cells of a line.

Lines that begin with # are comments. The first other line may name the columns, with their units
in brackets, as the files that a run leaves in its folder ``curves`` do:

    frequency [Hz], accelerance real [(m/s2)/N], accelerance imaginary [(m/s2)/N]

A response is one column of magnitudes, two of real and imaginary part, or two of magnitude and
phase; a column in deg or rad is a phase. Without names the
columns are frequency in Hz and magnitudes, or frequency, real and imaginary part. Where semicolons
or tabs part the cells, a decimal comma is understood.

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
    ComplexArray,
    CurveLabel,
    Faults,
    MeasuredCurve,
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
    """Where a cell is, as faults say it."""
    return f"line {line}, column {place + 1} ({name})"


def read_text(path: Path, asked: CurveLabel, faults: Faults) -> MeasuredCurve:
    """A response of a text file.

    Parameters
    ----------
    path
        The file.
    asked
        Which response.
    faults
        Gets what is wrong with the file, with line and column.

    Raises
    ------
    InputError
        Where something is wrong.
    """
    lines = _lines(path)
    # what parts the cells of most lines
    most = (m for m in _SEPARATORS if 2 * sum(m in line for _, line in lines) > len(lines))
    separator = next(most, ",")
    split = [(n, [cell.strip().strip('"') for cell in text.split(separator)]) for n, text in lines]
    columns, body, head = _columns(split, separator)
    parts, scale, unit = _chosen(columns, asked, head, faults)
    label, body = _labelled(columns, body, asked, separator, head, faults)
    rows = _numbers(body, parts, separator, faults, max(c.place for c in columns) + 1)
    faults.check()
    at = [n for n, _ in body]
    if len(at) < LEAST_POINTS:
        last = at[-1] if at else head
        raise InputError(
            f"line {last}: ends with {len(at)} points; a curve has {LEAST_POINTS} or more"
        )

    return checked_curve(
        scale * rows["frequency"],
        _response(rows, parts),
        unit,
        label,
        faults,
        lambda what, k: _cell(at[k], parts[what].place, parts[what].name or what),
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


def _number(cell: str, separator: str) -> float | None:
    if separator != "," and _COMMA.fullmatch(cell):
        cell = cell.replace(",", ".")
    try:
        # float() understands more than a file should say: "1_000", "infinity"
        return float(cell) if "_" not in cell else None
    except ValueError:
        return None


def _columns(
    split: Sequence[tuple[int, list[str]]], separator: str
) -> tuple[list[FileColumn], list[tuple[int, list[str]]], int]:
    """The columns, the lines below their names, and the line of the names."""
    line, first = split[0]
    named = all(_number(cell, separator) is None for cell in first)
    if named:
        return [_column(k, cell) for k, cell in enumerate(first)], list(split[1:]), line
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


def _chosen(
    columns: Sequence[FileColumn], asked: CurveLabel, line: int, faults: Faults
) -> tuple[dict[str, FileColumn], float, str]:
    """The columns of frequency and of the response by their parts, factor to Hz, unit."""
    axis, unit = [c for c in columns if c.part == "frequency"], asked.unit
    if len(axis) != 1:
        many = f"{len(axis) or 'no'} column{'s' * (len(axis) > 1)}"
        raise InputError(f'line {line}: {many} of frequency; name one "frequency [Hz]"')
    scale = 1.0
    with faults.at(_cell(line, axis[0].place, "frequency")):
        scale = _factor(axis[0].unit, ["frequency"])
    # a response by its unit, or by one given beside the file
    known = [
        c for c in columns if unit is not None or c.part == "phase" or c.unit in RESPONSE_UNITS
    ]
    names = list(dict.fromkeys(c.name for c in known if c.name))
    if not names and asked.column is None:
        # its unit is what is wrong: reported below
        names = list(dict.fromkeys(c.name for c in columns if c.name))[:1]
    name = ""
    with faults.at(f"line {line}"):
        name = the_one(names, asked.column, "columns")
    if not name:
        faults.check()
    parts = _parts([c for c in columns if c.name == name], name, line, faults)
    responses = [c for kind, c in parts.items() if kind != "phase"]
    for c in responses:
        with faults.at(_cell(line, c.place, c.name)):
            if not (c.unit or unit):
                _factor("", QUANTITIES)
            response_unit(c.unit, unit)
    units = {unit or c.unit for c in responses}
    if len(units) > 1:
        words = f"the parts of {name} have different units, {' and '.join(units)}"
        faults.add(f"line {line}", words)
    magnitudes = {c.name for c in columns if c.part == "magnitude"}
    for c in columns:
        if c.part == "phase" and c.name not in magnitudes and "phase" not in parts:
            words = f'a phase of no response; name it "{name} phase", or remove it'
            faults.add(_cell(line, c.place, c.name), words)
    if "phase" in parts:
        c = parts["phase"]
        with faults.at(_cell(line, c.place, f"{c.name} phase")):
            _factor(c.unit, ["angle"])
    faults.check()
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


def _parts(
    mine: Sequence[FileColumn], name: str, line: int, faults: Faults
) -> dict[str, FileColumn]:
    """Real and imaginary part, or magnitude and phase, or magnitude alone."""
    found = {c.part: c for c in mine}
    if len(found) < len(mine):
        faults.add(f"line {line}", f"several columns {name}; give each its own name")
    if {"real", "imaginary"} <= set(found):
        return {part: found[part] for part in ("real", "imaginary")}
    if "magnitude" in found:
        return {part: found[part] for part in ("magnitude", "phase") if part in found}
    (have,) = list(found)[:1]
    lacks = {"real": "imaginary", "imaginary": "real", "phase": "magnitude"}[have]
    faults.add(f"line {line}", f"{name} has a column {have} but none {lacks}; add it")
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
            with faults.at(_cell(at, c.place, c.part)):
                given[c.part] = read_label(c.part, cell)
        labels.append(CurveLabel(**given))
    faults.check()
    label = ANY
    with faults.at(f"line {line}"):
        label = the_curve(list(dict.fromkeys(labels)), wanted)
    faults.check()
    return label, [row for row, one in zip(body, labels, strict=True) if one == label]


def _numbers(
    body: Sequence[tuple[int, list[str]]],
    parts: Mapping[str, FileColumn],
    separator: str,
    faults: Faults,
    width: int,
) -> dict[str, FloatArray]:
    """The cells of the columns that count, as numbers."""
    out: dict[str, list[float]] = {kind: [] for kind in parts}
    for line, cells in body:
        if len(cells) > width and any(cells[width:]):
            faults.add(f"line {line}", f"{len(cells)} cells where there are {width} columns")
        for kind, c in parts.items():
            cell = cells[c.place] if c.place < len(cells) else ""
            value = _number(cell, separator)
            if value is not None and np.isfinite(value):
                out[kind].append(value)
                continue
            words = (
                f"{cell!r} is no finite number; correct it, or remove the line"
                if cell
                else "nothing there; give a number, or remove the line"
            )
            faults.add(_cell(line, c.place, c.name or kind), words)
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
