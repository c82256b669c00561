"""The READMEs' commands.

Every scene and option they name is understood (nothing is solved), and the response table is that
of a run.
"""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

import upd
from upd.cli import main
from upd.cli.app import app, command_table

ROOT = Path(__file__).resolve().parents[3]
NAMES = ("README.md", "benchmarks/README.md", "geometry/README.md", "upd/scenes/README.md")
TEXT = {name: (ROOT / name).read_text(encoding="utf-8") for name in NAMES}
#: commands with a scene that a reader can paste: after ./run.sh or between backticks
PATTERN = re.compile(
    r"(?:^\./run\.sh |`(?:\./run\.sh )?)(upd (?:run|sweep|study|plan) [a-z][^`\n]*)", re.MULTILINE
)
COMMANDS = {name: sorted(set(PATTERN.findall(text))) for name, text in TEXT.items()}
ALL = sorted({command for commands in COMMANDS.values() for command in commands})


def planned(command: str) -> list[str]:
    """Arguments that check the command without solving.

    a run and a study are planned, a sweep says what it would do.
    """
    _, verb, scene, *rest = shlex.split(command)
    if verb == "sweep":
        return [verb, scene, *rest, "--plan-only"]
    return [
        "plan",
        scene,
        *[word for k, word in enumerate(rest) if word == "--set" or (k and rest[k - 1] == "--set")],
    ]


@pytest.mark.parametrize("command", [c for c in ALL if "..." not in c])
def test_command_is_understood(
    command: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    with pytest.raises(SystemExit) as end:
        main(planned(command))
    assert end.value.code == 0, capsys.readouterr().err


def test_there_are_commands_of_every_kind() -> None:
    assert {c.split()[1] for c in ALL} >= {"run", "study", "sweep", "plan"}
    assert "upd run hertz" in COMMANDS["README.md"]
    assert all(COMMANDS.values()), "every document has commands"


def test_the_table_of_commands_is_that_of_the_program() -> None:
    """The README's ten rows have the arguments and words of --help; their options exist. The README
    names the other commands too, and no document one that is none.
    """
    rows = re.findall(r"^\| `(upd [^`]+)` \| (.+) \|$", TEXT["README.md"], re.MULTILINE)
    table = command_table()
    others = {"upd scenes", "upd doctor"}
    assert all(f"`{usage}`" in TEXT["README.md"] for usage in others)
    in_rows = [row for row in table if row[0] not in others]
    assert [text for _, text in rows] == [text for _, text in in_rows]
    assert len(rows) <= 10
    for (shown, _), (usage, _) in zip(rows, in_rows, strict=True):
        command, *arguments = usage.partition(" --")[0].removeprefix("upd ").split()
        assert shown.startswith(" ".join(["upd", command, *arguments]))
        known = {
            name
            for argument in app[command].assemble_argument_collection()
            for name in argument.names
        }
        assert set(re.findall(r"(?<=[ [])--?[a-z]+", shown)) <= known
    named = {
        word
        for text in TEXT.values()
        for word in re.findall(r"`(?:\./run\.sh )?upd ([a-z]+)", text)
    }
    assert named == {usage.split()[1] for usage, _ in table}


@pytest.mark.full
@pytest.mark.parametrize("arrangement", ["symmetric", "asymmetric"])
def test_stuck_peaks_are_those_of_a_run(arrangement: str) -> None:
    overrides = {"want": ["response"], "excitation.centrifugal_to_force": [2000.0]}
    result = upd.run(f"{arrangement}-response", overrides=overrides)
    (line,) = [
        line
        for line in TEXT["benchmarks/README.md"].splitlines()
        if line.startswith(f"| {arrangement} | 2000 |")
    ]
    printed = [float(cell.split(",")[0]) for cell in line.split("|")[3:5]]
    computed = [
        result.value(f"peak_{k}_frequency", f"thesis, F_C/F_E 2000, {mode}")
        for k, mode in ((1, "in phase"), (2, "out of phase"))
    ]
    assert printed == pytest.approx(computed, abs=0.051)
