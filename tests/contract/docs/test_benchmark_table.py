"""`benchmarks/run.py --write`.

Rows of what ran go into the table, everything else stays to the last letter.
"""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path
from typing import Any

import pytest

BENCHMARKS = Path(__file__).resolve().parents[3] / "benchmarks"

QUICK = """
from upd.errors import InputError

def run():
    {what}
"""


@pytest.fixture(scope="module")
def runner() -> Any:
    spec = importlib.util.spec_from_file_location("benchmarks_run", BENCHMARKS / "run.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the README beside one quick benchmark."""
    shutil.copy(BENCHMARKS / "README.md", tmp_path)
    (tmp_path / "speed").mkdir()
    quick(
        tmp_path,
        "return [{'name': 'time_nothing', 'case': 'a | b', 'value': 0.123456, 'unit': 's', "
        "'reference': 1}]",
    )
    return tmp_path


def quick(folder: Path, what: str) -> None:
    (folder / "speed" / "bench_quick.py").write_text(QUICK.format(what=what), encoding="utf-8")


def text(folder: Path) -> str:
    return (folder / "README.md").read_text(encoding="utf-8")


def test_sections_are_the_benchmarks(runner: Any) -> None:
    """Every section of the table is a benchmark that exists, with rows as the writer makes them."""
    inside = text(BENCHMARKS).split(runner.BEGIN)[1].split(runner.END)[0]
    found = runner.sections(inside)
    assert set(found) <= {runner.title(path) for path in BENCHMARKS.glob("*/bench_*.py")}
    assert {"accuracy/hertz", "accuracy/response", "peers/calculix", "speed/condensation"} <= set(
        found
    )
    for body in found.values():
        machine, empty, *rows = body.splitlines()
        assert machine.endswith(":")
        assert empty == ""
        assert rows[:2] == list(runner.HEAD)
        assert all(row.replace(r"\|", "").count("|") == len(runner.COLUMNS) + 1 for row in rows[2:])


def test_nothing_run_changes_nothing(runner: Any) -> None:
    assert runner.replaced(text(BENCHMARKS), {}) == text(BENCHMARKS)


def test_prints_without_writing(
    runner: Any, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runner.main(["quick"], folder)
    assert r"| time_nothing | a \| b | 0.1235 | s | 1 |  |" in capsys.readouterr().out
    assert text(folder) == text(BENCHMARKS)


def test_writes_its_rows_and_keeps_the_others(
    runner: Any, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = text(folder)
    runner.main(["quick", "--write"], folder)
    first = text(folder)
    capsys.readouterr()
    heading = f"\n### speed/quick\n\n{runner.machine()}:\n\n"
    row = r"| time_nothing | a \| b | 0.1235 | s | 1 |  |"
    added = heading + "\n".join([*runner.HEAD, row]) + "\n"
    assert first.replace(added, "") == before, "only the new section was added"
    assert (
        first.index("### speed/contact") < first.index("### speed/quick") < first.index(runner.END)
    )
    quick(
        folder,
        "return [{'name': 'time_nothing', 'value': 2.0}, {'name': 'time_more', 'value': 3.0}]",
    )
    runner.main(["--write"], folder)
    second = text(folder)
    assert row not in second
    assert "| time_nothing |  | 2 |  |  |  |\n| time_more |  | 3 |  |  |  |\n" in second
    assert [path.name for path in sorted(folder.iterdir())] == ["README.md", "speed"]


@pytest.mark.parametrize(
    "what",
    [
        "raise InputError('no licence; get one')",
        "return [{'name': 'peer', 'case': 'skipped'}]",
        "return []",
    ],
)
def test_failed_or_skipped_keeps_the_old_rows(
    what: str, runner: Any, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runner.main(["quick", "--write"], folder)
    before = text(folder)
    quick(folder, what)
    runner.main(["speed/quick", "--write"], folder)
    assert text(folder) == before
    assert "rows in README.md stay" in capsys.readouterr().err


def test_words_choose(runner: Any, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runner.main(["hertz"], folder)
    assert "time_nothing" not in capsys.readouterr().out
    runner.main(["speed/"], folder)
    assert "time_nothing" in capsys.readouterr().out
    names = ["accuracy/estimates", "accuracy/estimates_runs", "accuracy/hertz", "speed/hertz"]
    assert runner.chosen_by([], names) == names
    assert runner.chosen_by(["estimates", "speed/"], names) == [*names[:2], names[3]]
    assert runner.chosen_by(["accuracy/estimates"], names) == names[:1], "the whole name"
    assert runner.chosen_by(["accuracy/estimates", "hertz"], names) == [names[0], *names[2:]]


def test_a_readme_without_the_comments_is_refused_before_anything_runs(
    runner: Any, folder: Path
) -> None:
    (folder / "README.md").write_text("# Nothing\n", encoding="utf-8")
    quick(folder, "raise SystemExit('ran')")
    with pytest.raises(ValueError, match="table:begin"):
        runner.main(["--write"], folder)
    assert text(folder) == "# Nothing\n"
