"""Terminals that take no line, or not every letter, end no command; links in a circle are refused
before a run.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from upd import run
from upd.batch.sweeps import sweep
from upd.errors import InputError
from upd.report.columns import text_width

CALL = f"{sys.executable} -c 'from upd.cli import main; main()' describe hertz contact"


def shell(command: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", "-c", f"set -o pipefail; {command}"],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )


@pytest.mark.parametrize(
    "command",
    [
        f"{CALL} >&-",
        f"{CALL} >&- 2>&-",
        f"{CALL} > /dev/full",
        f"{CALL} > /dev/full 2> /dev/full",
        f"({CALL}; echo $? > code) | true; exit $(cat code)",
    ],
    ids=["closed", "both closed", "full", "both full", "no reader"],
)
def test_lines_that_nobody_takes_are_lost(tmp_path: Path, command: str) -> None:
    done = shell(command, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


def test_letters_that_the_terminal_lacks_become_question_marks(tmp_path: Path) -> None:
    command = CALL.replace("describe hertz contact", "plan hertz --set title=5µm")
    done = shell(command, tmp_path, PYTHONIOENCODING="ascii")
    assert (done.returncode, done.stderr) == (0, "")
    assert "5?m" in done.stdout


def test_figures_need_no_backend_of_a_notebook(tmp_path: Path) -> None:
    named = {"MPLBACKEND": "nonsense"}
    done = shell(f"{CALL} --drawing a.png", tmp_path, **named)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.png").exists()


def test_a_terminal_of_one_column_still_has_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "1")
    assert text_width() == 40


def test_links_in_a_circle_are_refused_before_a_run(tmp_path: Path) -> None:
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    for out in (loop, loop / "inner"):
        with pytest.raises(InputError, match=r"links lead in a circle.*--out"):
            run("hertz", out=out, progress=lambda *_: pytest.fail("begun"))
        with pytest.raises(InputError, match=r"links lead in a circle.*--out"):
            sweep("hertz", ["contact.friction=0.1,0.2"], out=out, workers=0)
