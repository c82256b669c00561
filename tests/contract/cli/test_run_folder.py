"""A run owns its folder: written beside its place, moved in whole, never over what is not ours."""

import errno
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import upd
from upd import cli, run
from upd.cache.folders import own_folder, plain_name
from upd.errors import InputError, UpdError
from upd.report import write_report

TINY: dict[str, Any] = {
    "geometry.divisions": 4,
    "geometry.patch": "auto",
    "loads.normal": ["200 N"],
    "want": ["normal"],
    "left_out.solve": "no",
}
ENOSPC = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def anything(_: Path) -> bool:
    return True


def allowed(_: Path) -> None:
    """No folder has to stay."""


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as end:
        cli.main(list(arguments))
    return int(end.value.code or 0)


@pytest.fixture
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without figures, which take longer than the run."""
    monkeypatch.setattr("upd.runner.write_figures", lambda *_: [])


@pytest.mark.usefixtures("plain")
def test_a_second_run_into_a_folder_in_use_is_refused_or_numbered(tmp_path: Path) -> None:
    place, seen = tmp_path / "run", []

    def meanwhile(stage: str, _: str, seconds: float | None) -> None:
        if stage == "condensation" and seconds is None and not seen:
            seen.append(stage)
            assert not place.exists(), "seen before it is whole"
            with pytest.raises(InputError, match=r"another run.*--out"):
                run("hertz", overrides=TINY, out=place, report=False)
            second = run("hertz", overrides=TINY, out=place, numbered=True, report=False)
            assert second.folder == tmp_path / "run-2"

    first = run("hertz", overrides=TINY, out=place, report=False, progress=meanwhile)
    assert seen
    assert first.folder == place
    assert sorted(p.name for p in tmp_path.iterdir()) == ["run", "run-2"]
    assert run("hertz", overrides=TINY, out=place, numbered=True, report=False).folder == (
        tmp_path / "run-3"
    )


@pytest.mark.usefixtures("plain")
def test_an_earlier_run_is_replaced_whole_and_that_is_said(tmp_path: Path) -> None:
    place, told = tmp_path / "run", []
    run("hertz", overrides={**TINY, "want": ["normal", "fields"]}, out=place)
    (place / "traction.png").write_bytes(b"of the earlier run")
    run(
        "hertz",
        overrides=TINY,
        out=place,
        report=False,
        progress=lambda stage, detail, _: told.append(f"{stage}: {detail}"),
    )
    assert f"folder: replaces the earlier run in {place}" in told
    left = {p.name for p in place.iterdir()}
    assert not left & {"fields.vtu", "traction.png", "report.html"}
    assert {"scene.toml", "summary.json", "result.nc", "run.log"} <= left
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


@pytest.mark.usefixtures("plain")
def test_a_stopped_run_leaves_the_earlier_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place, stops = tmp_path / "run", []
    run("hertz", overrides=TINY, out=place, report=False)
    before = {p.name: p.read_bytes() for p in place.iterdir() if p.is_file()}

    def stop(stage: str, detail: str, seconds: float | None) -> None:
        stops.append(f"{stage}: {detail}")
        if stage == "condensation":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run("hertz", overrides=TINY, out=place, report=False, progress=stop)
    assert {p.name: p.read_bytes() for p in place.iterdir() if p.is_file()} == before
    part = tmp_path / "run-2"
    assert f"folder: the earlier run in {place} stays; this one: {part}" in stops
    assert json.loads((part / "summary.json").read_text())["status"].startswith("stopped")
    # the command says that it replaces, also without its stages
    settings = [f"{k}={v if isinstance(v, (str, int)) else json.dumps(v)}" for k, v in TINY.items()]
    sets = [word for text in settings for word in ("--set", text)]
    assert call("run", "hertz", *sets, "--out", str(place)) == 0
    assert "replaces the earlier run" in " ".join(capsys.readouterr().out.split())


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("beside_a_run", [False, True])
def test_what_is_not_ours_is_never_removed(tmp_path: Path, beside_a_run: bool) -> None:
    place = tmp_path / "run"
    if beside_a_run:
        run("hertz", overrides=TINY, out=place, report=False)
    place.mkdir(exist_ok=True)
    (place / "scene.toml").touch()
    (place / "notes.txt").write_text("mine", encoding="utf-8")
    before = {p: p.read_bytes() for p in place.rglob("*") if p.is_file()}
    with pytest.raises(InputError, match=r"holds what no run wrote \(notes\.txt\).*--out"):
        run("hertz", overrides=TINY, out=place, report=False)
    assert {p: p.read_bytes() for p in place.rglob("*") if p.is_file()} == before
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_a_folder_with_a_scene_alone_is_no_run(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").touch()
    with pytest.raises(InputError, match="holds no run"):
        run("hertz", overrides=TINY, out=tmp_path, report=False)
    assert (tmp_path / "scene.toml").exists()


@pytest.mark.usefixtures("plain")
def test_what_comes_while_a_run_is_going_stays(tmp_path: Path) -> None:
    place = tmp_path / "run"

    def meanwhile(stage: str, _: str, seconds: float | None) -> None:
        if stage == "condensation" and seconds is None:
            place.mkdir()
            (place / "notes.txt").write_text("mine", encoding="utf-8")

    run("hertz", overrides=TINY, out=place, report=False, progress=meanwhile)
    assert (place / "notes.txt").read_text(encoding="utf-8") == "mine"
    assert (place / "summary.json").exists()


def test_what_a_killed_process_left_is_removed(tmp_path: Path) -> None:
    code = (
        "import sys, time; from pathlib import Path; from upd.cache.folders import own_folder\n"
        "own = own_folder(Path(sys.argv[1]), check=print, ours=bool)\n"
        "print('taken', flush=True); time.sleep(60)"
    )
    place = tmp_path / "run"
    with subprocess.Popen(
        [sys.executable, "-c", code, str(place)], stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "taken\n"
        with pytest.raises(InputError, match=f"process {other.pid}"):
            own_folder(place, check=allowed, ours=anything)
        other.send_signal(signal.SIGKILL)
    begin = time.monotonic()
    assert len(list(tmp_path.iterdir())) == 1
    own = own_folder(place, check=allowed, ours=anything)
    assert list(tmp_path.iterdir()) == [own.path]
    assert plain_name(own.path) == "run"
    (own.path / "file").touch()
    own.move_in()
    assert [p.name for p in place.iterdir()] == ["file"]
    assert time.monotonic() - begin < 10


def test_the_folder_one_stands_in_stays_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    before = tmp_path.stat().st_ino
    for name in ("one", "two"):
        own = own_folder(Path(), check=allowed, ours=anything)
        (own.path / name).touch()
        own.move_in()
        assert [p.name for p in tmp_path.iterdir()] == [name]
    assert tmp_path.stat().st_ino == before
    assert not list(tmp_path.parent.glob(f".{tmp_path.name}.part-*"))


def test_a_place_that_was_taken_by_a_file_costs_no_results(tmp_path: Path) -> None:
    own = own_folder(tmp_path / "run", check=allowed, ours=anything)
    (own.path / "numbers").touch()
    (tmp_path / "run").write_text("mine", encoding="utf-8")
    assert own.move_in() == tmp_path / "run-2"
    assert (tmp_path / "run-2" / "numbers").exists()
    assert (tmp_path / "run").read_text(encoding="utf-8") == "mine"


def full(*_: object) -> None:
    raise ENOSPC


def test_a_disk_full_at_the_figures_leaves_the_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("upd.runner.write_figures", full)
    monkeypatch.setattr("upd.runner.write_report", full)
    settings = [x for k, v in TINY.items() for x in ("--set", f"{k}={json.dumps(v)}")]
    assert call("run", "hertz", *settings, "--out", str(tmp_path / "run")) == 0
    told = capsys.readouterr()
    assert told.err.splitlines() == [
        "upd: figures not written (No space left on device)",
        "upd: report.html not written (No space left on device)",
    ]
    assert "ok with warnings" in told.out
    assert "not written" not in told.out, "once"
    summary = json.loads((tmp_path / "run" / "summary.json").read_text("utf-8"))
    assert summary["status"].startswith("ok with warnings: ")
    assert "figures not written (No space left on device)" in summary["status"]
    assert summary["results"]


@pytest.mark.parametrize("command", [["--help"], None])
def test_help_and_manual_say_what_a_full_disk_is(
    command: list[str] | None, capsys: pytest.CaptureFixture[str]
) -> None:
    if command is None:
        manual = Path(upd.__file__).parent / "manual"
        text = (manual / "reference" / "commands.md").read_text("utf-8")
    else:
        call(*command)
        text = re.sub("[^ -~]", " ", capsys.readouterr().out)
    text = " ".join(text.split())
    assert "the disk is too full for the numbers" in text
    assert "figures or page of a run or sweep that it does not take are a warning" in text


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("what", ["write_netcdf", "_write_summary"])
def test_a_disk_full_before_the_figures_is_one_error(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    what: str,
) -> None:
    monkeypatch.setattr(f"upd.runner.{what}", full)
    settings = [x for k, v in TINY.items() for x in ("--set", f"{k}={json.dumps(v)}")]
    assert call("run", "hertz", *settings, "--out", str(tmp_path / "run")) == 1
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 1
    assert "cannot be written to the end (No space left on device): make room" in told[0]
    assert (tmp_path / "run" / "summary.json").exists() == (what == "write_netcdf")


def test_arrays_that_the_disk_does_not_take_end_no_process(tmp_path: Path) -> None:
    """HDF5, writing to the file itself, takes the process with it."""
    code = (
        "import resource, signal, sys; from pathlib import Path; import numpy as np\n"
        "from upd.results import Group, variable, write_netcdf\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192))\n"
        "group = Group({'x': variable('n', np.arange(1e5))})\n"
        "try: write_netcdf(Path(sys.argv[1]), {'': group})\n"
        "except OSError as error: print(error.strerror)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "result.nc")],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "File too large\n", "")
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("plain")
def test_numbers_that_are_none_are_withheld_and_null(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from dataclasses import replace

    from upd.analyses.contact.analysis import ANALYSES

    hertz = ANALYSES["hertz"]
    real = hertz.problem.make_results

    def infinite(solution: Any) -> list[Any]:
        first, *rest = real(solution)
        return [replace(first, value=float("inf")), *rest]

    problem = replace(hertz.problem, make_results=infinite)
    monkeypatch.setitem(ANALYSES, "hertz", replace(hertz, problem=problem))
    found = run("hertz", overrides=TINY, out=tmp_path / "run", report=False)
    assert found.results[0].withheld
    assert found.status.startswith("ok with warnings")
    text = (tmp_path / "run" / "summary.json").read_text("utf-8")
    assert "Infinity" not in text
    assert "NaN" not in text
    assert json.loads(text)["results"][0]["value"] is None


@pytest.mark.parametrize(
    ("raised", "code"),
    [
        (None, 0),
        (UpdError("a solver"), 1),
        (InputError("a key"), 2),
        (KeyboardInterrupt(), 3),
    ],
)
@pytest.mark.parametrize(
    ("command", "function"),
    [
        (["run", "hertz"], "upd.runner.run"),
        (["plan", "hertz"], "upd.analyses.make_plan"),
        (["sweep", "hertz", "--vary", "contact.friction=0.2"], "upd.batch.sweeps.run_sweep"),
        (["study", "hertz"], "upd.batch.studies.run_study"),
        (["report", "x"], "upd.report.write_report"),
    ],
)
def test_exit_codes_are_the_same_for_every_command(
    raised: BaseException | None,
    code: int,
    command: list[str],
    function: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if raised is None:
        command, raised = ["scenes"], AssertionError()
    error = raised

    def ends(*_: object, **__: object) -> None:
        raise error

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(function, ends)
    assert call(*command) == code


@pytest.mark.parametrize("arguments", [["run"], ["run", "hertz", "--nothing"], ["nothing"]])
def test_a_command_line_that_is_none_is_bad_input(arguments: list[str]) -> None:
    assert call(*arguments) == 2


def test_exit_codes_are_documented(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("--help") == 0
    told = " ".join(capsys.readouterr().out.split())
    for words in ("0 done", "1 a solver or a self-check failed", "2 bad input", "3 interrupted"):
        assert words in told


@pytest.mark.usefixtures("plain")
def test_the_page_has_the_name_of_the_place(tmp_path: Path) -> None:
    run("hertz", overrides=TINY, out=tmp_path / "my-run")
    page = (tmp_path / "my-run" / "report.html").read_text("utf-8")
    assert ".part-" not in page
    again: Callable[[Path], Path] = write_report
    assert again(tmp_path / "my-run") == tmp_path / "my-run" / "report.html"
