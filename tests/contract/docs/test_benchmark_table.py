"""`benchmarks/run.py --write`.

Rows of what ran go into a file of their own, all other files stay to the last letter.
"""

from __future__ import annotations

import csv
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
    """A copy of the results beside one quick benchmark."""
    shutil.copytree(BENCHMARKS / "results", tmp_path / "results")
    (tmp_path / "speed").mkdir()
    quick(
        tmp_path,
        "return [{'name': 'time_nothing', 'case': 'a, b', 'value': 0.123456, 'unit': 's', "
        "'reference': 1}]",
    )
    return tmp_path


def quick(folder: Path, what: str) -> None:
    (folder / "speed" / "bench_quick.py").write_text(QUICK.format(what=what), encoding="utf-8")


def texts(folder: Path) -> dict[str, str]:
    """File -> its text."""
    return {path.name: path.read_text("utf-8") for path in sorted((folder / "results").iterdir())}


def test_files_are_the_benchmarks(runner: Any) -> None:
    """Every file belongs to a benchmark that exists and has its columns; every row a machine."""
    names = [runner.title(path) for path in BENCHMARKS.glob("*/bench_*.py")]
    found = set((BENCHMARKS / "results").iterdir())
    assert found <= {runner.kept_in(BENCHMARKS, name) for name in names}
    for name in ("accuracy/hertz", "accuracy/response", "peers/calculix", "speed/condensation"):
        assert runner.kept_in(BENCHMARKS, name) in found
    for path in found:
        with path.open(newline="", encoding="utf-8") as file:
            head, *rows = csv.reader(file)
        assert tuple(head) == runner.COLUMNS
        assert rows
        assert all(len(row) == len(head) and row[0] and row[-1] for row in rows), path


def test_prints_without_writing(
    runner: Any, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runner.main(["quick"], folder)
    assert 'time_nothing,"a, b",0.1235,s,1,\n' in capsys.readouterr().out
    assert texts(folder) == texts(BENCHMARKS)


def test_writes_its_rows_and_keeps_the_others(runner: Any, folder: Path) -> None:
    runner.main(["quick", "--write"], folder)
    first = texts(folder)
    with (folder / "results" / "speed-quick.csv").open(newline="", encoding="utf-8") as file:
        (row,) = csv.DictReader(file)
    assert list(row.values()) == [
        "time_nothing",
        "a, b",
        "0.1235",
        "s",
        "1",
        "",
        runner.machine(),
    ]
    del first["speed-quick.csv"]
    assert first == texts(BENCHMARKS)
    quick(
        folder,
        "return [{'name': 'time_nothing', 'value': 2.0}, {'name': 'time_more', 'value': 3.0}]",
    )
    runner.main(["--write"], folder)
    rows = texts(folder)["speed-quick.csv"].splitlines()[1:]
    assert [row.partition(",,,")[0] for row in rows] == ["time_nothing,,2", "time_more,,3"]


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
    before = texts(folder)
    quick(folder, what)
    runner.main(["speed/quick", "--write"], folder)
    assert texts(folder) == before
    assert "its file in results/ stays" in capsys.readouterr().err


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
