"""The gallery of upd/scenes/README.md: every example is short, runs, and prints what stands there.

The longer ones run as they are in the full suite, and made smaller here.
"""

from __future__ import annotations

import re
import runpy
import sys
from pathlib import Path

import pytest

import upd

SCENES = Path(upd.__file__).parent / "scenes"
EXAMPLES = SCENES / "examples"
TEXT = (SCENES / "README.md").read_text("utf-8")
#: file -> the cell of what it prints
ROWS = {
    row[1]: row[2]
    for row in re.finditer(
        r"^\| \[(\w+\.(?:toml|py))\]\(examples/\1\) \|[^|]*\| ([^|]*) \| [\d.]+ \|$",
        TEXT,
        re.MULTILINE,
    )
}
NUMBER = re.compile(r"`(\w+)`(?: \(([^)]+)\))? (-?[\d.]+(?:e[+-]?\d+)?)")
#: scene -> what makes it small enough for every day
SMALLER = {
    "own_sphere.toml": {"accuracy": "10 %"},
}
WITHOUT_SECOND_SOLVES = {"left_out.solve": "no"}


def promised(name: str) -> dict[tuple[str, str], float]:
    """Number and case -> value, as the table has it."""
    found = {(m[1], m[2] or ""): float(m[3]) for m in NUMBER.finditer(ROWS[name])}
    assert found, name
    return found


def same(result: upd.RunResult, name: str) -> None:
    for (number, case), value in promised(name).items():
        assert result.value(number, case or None) == pytest.approx(value, rel=2e-3), (number, case)


def test_six_examples_with_a_figure_each() -> None:
    assert len(ROWS) == 6
    for name in ROWS:
        assert len((EXAMPLES / name).read_text("utf-8").splitlines()) <= 40, name
        assert f"(examples/figures/{Path(name).stem}.png)" in TEXT, name


@pytest.mark.parametrize("name", ["own_wedge.toml", "own_pads.toml", "damped_response.toml"])
def test_scene_prints_what_the_gallery_says(name: str) -> None:
    """Numbers solved a second time, with the effects left out, are not those of the table."""
    same(upd.run(EXAMPLES / name, overrides=WITHOUT_SECOND_SOLVES), name)


@pytest.mark.parametrize("name", SMALLER)
def test_longer_scene_made_smaller_runs(name: str) -> None:
    result = upd.run(EXAMPLES / name, overrides=SMALLER[name])
    assert result.outcome != "failed"
    for number, case in promised(name):
        assert result.value(number, case or None) > 0.0


def test_script_with_matrices_prints_what_the_gallery_says(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(sys, "argv", ["other_program.py"])
    runpy.run_path(str(EXAMPLES / "other_program.py"), run_name="__main__")
    told = " ".join(capsys.readouterr().out.split())
    for number in re.findall(r"[\d.]+ (?:um|Hz)", ROWS["other_program.py"]):
        assert number in told


@pytest.mark.full
@pytest.mark.parametrize("name", SMALLER)
def test_longer_scene_prints_what_the_gallery_says(name: str) -> None:
    result = upd.run(EXAMPLES / name)
    same(result, name)
    if name == "own_sphere.toml":
        assert all(abs(r.error) < 0.01 for r in result.results if r.error is not None)


@pytest.mark.full
def test_sweep_prints_what_the_gallery_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["own_sweep.py", str(tmp_path / "sweep")])
    runpy.run_path(str(EXAMPLES / "own_sweep.py"), run_name="__main__")
    told = " ".join(capsys.readouterr().out.split())
    for number in re.findall(r"\d\.\d+e\+\d+|\d points", ROWS["own_sweep.py"]):
        assert number in told
    assert (tmp_path / "sweep" / "table.csv").is_file()
