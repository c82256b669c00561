"""What a run prints: the answer first, on one screen, whole numbers, and the rest when asked."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import rigs
from rich.console import Console

import upd
from tests.pictures import no_figures
from upd import cli
from upd.cli.tables import print_lines, print_table
from upd.plot.answer_table import AnswerTable
from upd.report.answer import LINES
from upd.report.columns import folded_head, whole_table
from upd.report.notebook import RunResult
from upd.report.tables import MOST_NOTES, main_numbers, warnings
from upd.results import NO_CASE, Case, Check, Result
from upd.results.check import outcome_of, status_of
from upd.results.quantities import Quantity
from upd.scene import ready_scenes

_RESPONSE: Mapping[str, Any] = {
    **rigs.LINES,
    "mesh.element": "hex8i",
    "contact.stiffness": ["thesis"],
    "contact.columns": 1,
    "contact.static": "frictionless",
    "reduction.modes": 4,
    "balance.harmonics": 1,
    "excitation.points": 30,
    "excitation.start": "300 Hz",
    "excitation.centrifugal_to_force": [2000.0, 600.0],
    "want": ["response", "contact_state", "hysteresis", "damper_motion"],
    "left_out.solve": "no",
}
_FEW_STEPS = {"seating.steps": 4, "moved.steps": 4}
#: Ready scenes beside the small ones that all tests share.
TOYS: Mapping[str, Mapping[str, Any]] = {
    "asymmetric": {
        "geometry.divisions": 4,
        "geometry.divisions_long": 9,
        "loads.tangential": [0.5],
        "law.rows": 2,
        "law.columns": 3,
        "left_out.solve": "no",
    },
    "symmetric-response": _RESPONSE,
    "asymmetric-response": _RESPONSE,
    "symmetric-seated": {
        "geometry.patch_along_y": 4,
        "geometry.patch_along_slope": 2,
        **_FEW_STEPS,
    },
    "asymmetric-seated": {"geometry.pad_along_y": 4, "geometry.pad_along_slope": 2, **_FEW_STEPS},
    "bladed-disk": {
        "geometry.disk_layers": 3,
        "geometry.blade_layers": 5,
        "geometry.blade_columns": 1,
        "geometry.axial": 2,
        "want": ["modes", "campbell", "interference"],
    },
}
SCENES = (
    *("hertz", "symmetric", "asymmetric", "rig", "symmetric-response", "asymmetric-response"),
    *("symmetric-seated", "asymmetric-seated", "bladed-disk"),
)
#: whose answer is tables of its own
TABLES = ("symmetric-response", "asymmetric-response")


@pytest.fixture(scope="module")
def toy(
    small_run: Callable[[str], RunResult], tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], RunResult]:
    """A quick run of a ready scene, solved once."""

    @cache
    def solved(scene: str) -> RunResult:
        if scene not in TOYS:
            return small_run(scene)
        out = tmp_path_factory.mktemp("toys") / scene
        with no_figures():
            return upd.run(scene, overrides=dict(TOYS[scene]), out=out, report=False)

    return solved


def printed(result: RunResult, width: int, *, full: bool = False) -> list[str]:
    """The lines the terminal shows."""
    sheet = io.StringIO()
    print_lines(Console(file=sheet, width=width, highlight=False), result.answer(width, full=full))
    return sheet.getvalue().splitlines()


def short(lines: list[str]) -> list[str]:
    """Lines without those that name a file."""
    return [line for line in lines if not line.startswith(("Run folder: ", "Report: "))]


def test_all_ready_scenes_are_looked_at() -> None:
    assert set(SCENES) == set(ready_scenes())


@pytest.mark.parametrize("width", [80, 120])
@pytest.mark.parametrize("scene", SCENES)
def test_a_ready_scene_fits_on_a_screen(
    scene: str, width: int, toy: Callable[[str], RunResult], monkeypatch: pytest.MonkeyPatch
) -> None:
    result = toy(scene)
    lines = printed(result, width)
    assert len(lines) < LINES
    assert max(map(len, short(lines))) <= width
    # the outcome and its number first, where it is kept, and what warns last
    main = r" - .+ [-\d.]+(e[+-]\d+)?\b"
    assert re.match(rf"{scene}: {result.outcome}{main}", " ".join(lines[:2]))
    assert any(line.startswith("Self-checks: ") for line in lines)
    assert any(line.startswith("Cost: ") for line in lines)
    assert f"Run folder: {result.folder}" in lines
    assert lines[-1].startswith(("Run folder", "Warning", "  "))
    assert (result.outcome == "ok with warnings") == any(x.startswith("Warning") for x in lines)
    # every warning has its whole remedy
    text = " ".join(" ".join(lines).split())
    entries = [r.as_dict() for r in result.results]
    for told in warnings([c.as_dict() for c in result.checks], entries, 2)[:MOST_NOTES]:
        assert f"Warning: {' '.join(told.split())}" in text
    # Python opens alike, and prints ten lines
    monkeypatch.setenv("COLUMNS", str(width))
    assert str(result) == repr(result)
    assert str(result).splitlines()[0] == lines[0]
    assert len(str(result).splitlines()) <= 10


@pytest.mark.parametrize("scene", [one for one in SCENES if one not in TABLES])
def test_main_numbers_stand_in_it_whole(scene: str, toy: Callable[[str], RunResult]) -> None:
    result = toy(scene)
    text = str(result.answer(120))
    for entry in main_numbers(result.size, result.summary()["results"]):
        if not entry.get("withheld"):
            assert f"{entry['value']:.5g}".rstrip("0") in text or f"{entry['value']:.4e}" in text


@pytest.mark.parametrize("width", [80, 120])
@pytest.mark.parametrize("scene", SCENES)
def test_full_tables_keep_every_digit_of_what_they_show(
    scene: str, width: int, toy: Callable[[str], RunResult]
) -> None:
    result = toy(scene)
    lines = printed(result, width, full=True)
    assert max(map(len, short(lines))) <= width
    text = "\n".join(lines)
    assert "…" not in text
    numbers = [r for r in result.results if not r.withheld and abs(r.value) >= 1e6]
    for row in numbers:
        assert f"{row.value:.4e}" in text or "not shown" in text
    assert all(str(effect["name"]).split()[0] in text for effect in result.effects)
    assert "What was simulated" in text
    entries = [r.as_dict() for r in result.results]
    for told in warnings([c.as_dict() for c in result.checks], entries):
        assert f"Warning: {told}" in " ".join(text.split())


def test_many_warnings_leave_room_for_the_numbers(toy: Callable[[str], RunResult]) -> None:
    result = toy("hertz")
    many = [
        Check(f"check {k}", Case(force_ratio=float(k)), 2.0, 1.0, "word " * 40, "do " * 60, False)
        for k in range(30)
    ]
    why = "the path stopped " * 20
    lost = [Quantity(f"number_{k}", "Hz").withheld(NO_CASE, why) for k in range(9)]
    results = (*result.results, *lost)
    bad = replace(
        result, checks=tuple(many), results=results, status=status_of(many, results), title="t"
    )
    for width in (60, 80, 120):
        lines = printed(bad, width)
        text = " ".join(" ".join(lines).split())
        assert text.count("Warning: ") == MOST_NOTES
        assert text.index("maximum pressure") < text.index("Warning: Check 0 ")
        assert "Warnings besides: 28, printed by --full." in text


def test_long_remedies_are_whole(toy: Callable[[str], RunResult]) -> None:
    result = toy("hertz")
    remedy = "take another " + "word " * 60 + "at the end"
    told = [Check(f"check {k}", NO_CASE, 2.0, 1.0, "says", remedy, False) for k in range(3)]

    def lines_of(count: int) -> list[str]:
        checks = tuple(told[:count])
        bad = replace(result, checks=checks, status=status_of(checks, result.results))
        return printed(bad, 80)

    for count, whole in ((1, 1), (3, 3)):
        lines = lines_of(count)
        assert len(lines) < LINES
        assert " ".join(" ".join(lines).split()).count("word at the end") == whole
    assert "maximum pressure" in "\n".join(lines_of(3))
    checks = (replace(told[0], fatal=True),)
    failed = replace(result, checks=checks, status=status_of(checks, result.results))
    assert "word at the end" in " ".join(" ".join(printed(failed, 80)).split())


def test_failed_run_says_why_first(toy: Callable[[str], RunResult]) -> None:
    result = toy("hertz")
    check = Check("patch rim", Case(load=200.0), 3.0, 0.0, "rim nodes in contact", "enlarge it")
    bad = replace(result, checks=(check,), status=status_of([check], result.results))
    lines = printed(bad, 120)
    assert lines[0].startswith("hertz: failed: patch rim (F=200 N): rim nodes in contact = 3")
    assert "enlarge it" in lines[0]
    assert outcome_of(bad.status) == "failed"


def test_result_of_many_loads_is_cut_and_says_so(toy: Callable[[str], RunResult]) -> None:
    result = toy("hertz")
    loads = [Case(load=float(k)) for k in range(1, 200)]
    many = tuple(
        Result(name, case, 1.0, "MPa") for case in loads for name in ("max_pressure", "approach")
    )
    lines = printed(replace(result, results=many), 80)
    assert len(lines) < LINES
    (rest,) = [line for line in lines if "more cases" in line]
    shown = sum(line.startswith("F=") and len(line.split()) > 2 for line in lines)
    assert shown + int(rest.split()[0]) == len(loads)


def test_command_prints_the_answer_and_nothing_else(
    tmp_path: Path,
    small_scenes: Mapping[str, Mapping[str, Any]],
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("upd.cli.terminal.console", Console(width=80, highlight=False))
    scene = upd.load_scene("hertz", dict(small_scenes["hertz"]))
    (tmp_path / "own.toml").write_text(scene.text, encoding="utf-8")
    with pytest.raises(SystemExit) as end:
        cli.main(["run", str(tmp_path / "own.toml"), "--out", str(tmp_path / "run")])
    assert end.value.code == 0
    told = capfd.readouterr()
    assert told.out.splitlines() == str(answer_text(tmp_path / "run", 80)).splitlines()
    assert told.err == ""
    assert f"Report: {tmp_path / 'run' / 'report.html'}" in told.out


def answer_text(folder: Path, width: int) -> str:
    return "\n".join(text for text, _ in upd.load(folder).answer(width))


TABLE = AnswerTable(
    "",
    ("number", "#value", "#reference", "source"),
    (("a", "1.2345e+06", "1.2e+06", "somebody"), ("b", "7", "", "else")),
)


def test_last_columns_are_left_out_and_no_number_is_cut() -> None:
    assert whole_table(TABLE, 80, cut=True) == whole_table(TABLE, 80)
    # what identifies a row and its number stay whatever the width
    assert whole_table(TABLE, 20, cut=True)[0] == "number       value"
    heads, *rows = whole_table(TABLE, 30, cut=True)
    assert heads == "number       value  reference"
    assert rows == ["a       1.2345e+06    1.2e+06", "b                7"]


def test_a_narrow_table_shows_the_rest_below() -> None:
    sheet = io.StringIO()
    print_table(Console(file=sheet, width=30), TABLE)
    assert "1.2345e+06" in sheet.getvalue() and "somebody" in sheet.getvalue()
    assert max(map(len, sheet.getvalue().splitlines())) <= 30


def test_heads_fold_at_words() -> None:
    assert folded_head("K_N tangent, bulk compliance removed, N/mm").count("\n") <= 2
    assert folded_head("stick radius, um") == "stick\nradius,\num"
