"""Sweeps under faults: killed workers, killed sweeps, full disks, lost clusters.

No point lost, none recorded twice, the same table.
"""

import csv
import errno
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor, Future
from contextlib import contextmanager
from multiprocessing import active_children
from pathlib import Path
from typing import Any

import pytest

from upd import load_scene
from upd.batch import engine
from upd.batch import store as point_store
from upd.batch.engine import ATTEMPTS, Progress, dispatch
from upd.batch.point import OTHER_CODE, Task, solve_task
from upd.batch.sweeps import sweep
from upd.errors import InputError, UpdError
from upd.vary.outcome import Outcome, read_outcome

pytestmark = pytest.mark.usefixtures("without_pictures")

TINY = {
    "geometry.divisions": 8,
    "want": ["normal", "tangential"],
    "loads.tangential": [0.5],
    "geometry.core_depth": 0.2,
    "left_out.solve": "no",
}
VARY = ["contact.friction=0.2,0.4", "loads.normal=40 N:60 N:3"]

RECIPE = """
import os, signal
from pathlib import Path
from geometry import sphere_block

CLOSED_FORM = sphere_block.CLOSED_FORM
count = sphere_block.count


def build(params: sphere_block.SphereBlock):
    if params.radius > 5.5 and not Path({mended!r}).exists():
        os.kill(os.getpid(), signal.SIGKILL)
    return sphere_block.build(params)
"""


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("UPD_CACHE", str(tmp_path / "cache"))


def table(folder: Path) -> list[list[str]]:
    with (folder / "table.csv").open(encoding="utf-8") as file:
        return [row[:-1] for row in csv.reader(file)]


@pytest.fixture(scope="module")
def quiet(tmp_path_factory: pytest.TempPathFactory) -> list[list[str]]:
    """The table when nothing happens, solved in this process."""
    folder = tmp_path_factory.mktemp("quiet")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("UPD_CACHE", str(folder / "cache"))
        sweep("hertz", VARY, overrides=TINY, out=folder, workers=0)
    return table(folder)


def deadly(tmp_path: Path) -> dict[str, Any]:
    """A scene whose recipe kills its process above 5.5 mm radius until the file "mended" is
    there.
    """
    recipe = tmp_path / "deadly.py"
    recipe.write_text(RECIPE.format(mended=str(tmp_path / "mended")), encoding="utf-8")
    return {**TINY, "geometry.recipe": str(recipe)}


def test_worker_killed_in_mid_sweep_loses_nothing(tmp_path: Path, quiet: list[list[str]]) -> None:
    labels, killed = [], []

    def kill_one(progress: Progress) -> None:
        labels.extend([progress.label] if progress.label else [])
        if progress.label and not killed:
            worker = active_children()[0]
            worker.kill()
            killed.append(worker.pid)

    found = sweep("hertz", VARY, overrides=TINY, out=tmp_path / "killed", workers=2, watch=kill_one)
    assert killed
    assert len(labels) == len(set(labels)) == len(found.outcomes) == 6
    # to the last digit what this process finds, with no more threads than there are
    assert table(tmp_path / "killed") == quiet
    assert os.getpid() not in {int(one.where.rpartition(":")[2]) for one in found.outcomes}
    workers = found.plan.workers
    assert workers.count * workers.threads <= 2 or len(found.plan.groups) >= workers.count
    assert not active_children()


def test_a_point_that_kills_its_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A row, tried again by the next call; the others as if nothing had happened.

    One that is killed once: `test_worker_killed_in_mid_sweep_loses_nothing`.
    """
    # every attempt starts a process
    monkeypatch.setattr(engine, "ATTEMPTS", 2)
    vary = ["geometry.radius=5 mm,6 mm"]
    scene = deadly(tmp_path)
    found = sweep("hertz", vary, overrides=scene, out=tmp_path / "s", workers=1)
    assert found.failed == [1]
    assert "killed 2 times" in found.outcomes[1].failure
    assert "--workers" in table(tmp_path / "s")[2][-2]
    assert len(list((tmp_path / "s" / "points").iterdir())) == 1
    (tmp_path / "mended").touch()
    again = sweep("hertz", vary, overrides=scene, out=tmp_path / "s", workers=0)
    assert sorted(again.plan.kept) == [0]
    assert not again.failed


def command(folder: Path, *more: str) -> list[str]:
    words = [
        sys.executable,
        "-c",
        "from upd.cli import main; main()",
        "sweep",
        "hertz",
        "--out",
        str(folder),
        *more,
    ]
    for text in VARY:
        words += ["--vary", text]
    return words + [
        word for key, value in TINY.items() for word in ("--set", f"{key}={json.dumps(value)}")
    ]


def wait_for(there: Any, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not there():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


def alive(pid: int) -> bool:
    try:
        return (
            Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0]
            not in "ZX"
        )
    except (OSError, IndexError):
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads /proc")
def test_sweep_killed_as_a_whole_takes_up_where_it_stood(
    tmp_path: Path, quiet: list[list[str]]
) -> None:
    folder = tmp_path / "killed"
    with (tmp_path / "log").open("w") as log:
        process = subprocess.Popen(command(folder, "--workers", "2"), stdout=log, stderr=log)
        done = "points/[!.]*.json"
        wait_for(lambda: len(list(folder.glob(done))) >= 2 or process.poll() is not None)
        workers = [
            int(pid)
            for pid in Path(f"/proc/{process.pid}/task/{process.pid}/children")
            .read_text(encoding="ascii")
            .split()
        ]
        process.kill()
        process.wait()
    stamps = {path: path.stat().st_mtime_ns for path in folder.glob(done)}
    assert 2 <= len(stamps) < 6, "killed too late to show anything"
    assert not (folder / "table.csv").exists()
    # Nobody goes on computing for a sweep that is dead.
    wait_for(lambda: not any(map(alive, workers)), 20.0)
    found = sweep("hertz", VARY, overrides=TINY, out=folder, workers=0)
    assert len(found.plan.kept) == len(stamps)
    assert {path: path.stat().st_mtime_ns for path in stamps} == stamps
    assert table(folder) == quiet


@contextmanager
def cluster(tmp_path: Path, workers: int) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A real scheduler and real workers on the loopback: its address and the workers' processes."""
    file = tmp_path / "scheduler.json"
    begin = [
        sys.executable,
        "-m",
        "distributed.cli.dask_scheduler",
        "--host",
        "127.0.0.1",
        "--port",
        "0",
        "--no-dashboard",
    ]
    helper = [
        sys.executable,
        "-m",
        "distributed.cli.dask_worker",
        "--scheduler-file",
        str(file),
        "--nthreads",
        "1",
        "--no-nanny",
        "--no-dashboard",
    ]
    with (tmp_path / "cluster.log").open("w") as log:
        started = [
            subprocess.Popen([*begin, "--scheduler-file", str(file)], stdout=log, stderr=log)
        ]
        try:
            wait_for(file.exists)
            started += [
                subprocess.Popen(
                    [*helper, "--name", f"w{k}", "--local-directory", str(tmp_path)],
                    stdout=log,
                    stderr=log,
                )
                for k in range(workers)
            ]
            wait_for(lambda: _address(file))
            yield _address(file), started[1:]
        finally:
            for process in started:
                process.kill()
            for process in started:
                process.wait()


def _address(file: Path) -> str:
    try:
        return str(json.loads(file.read_text(encoding="utf-8"))["address"])
    except (OSError, ValueError, KeyError):
        return ""


def test_cluster_with_a_worker_killed_gives_the_same_table(
    tmp_path: Path, quiet: list[list[str]]
) -> None:
    labels: list[str] = []
    with cluster(tmp_path, 2) as (address, workers):

        def kill_one(progress: Progress) -> None:
            labels.extend([progress.label] if progress.label else [])
            if progress.label and len(labels) == 1:
                workers[0].send_signal(signal.SIGKILL)

        found = sweep(
            "hertz", VARY, overrides=TINY, out=tmp_path / "cluster", cluster=address, watch=kill_one
        )
        assert workers[0].wait(10) == -signal.SIGKILL
    assert len(labels) == len(set(labels)) == len(found.outcomes) == 6
    assert table(tmp_path / "cluster") == quiet
    pids = {int(outcome.where.rpartition(":")[2]) for outcome in found.outcomes}
    assert os.getpid() not in pids
    assert pids <= {worker.pid for worker in workers}


@pytest.mark.full
def test_cluster_that_goes_away_is_told_and_what_was_solved_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine, "PATIENCE_S", 1.0)
    with cluster(tmp_path, 1) as (address, workers):

        def kill(progress: Progress) -> None:
            if progress.label:
                workers[0].kill()

        with pytest.raises(UpdError, match=r"no worker for 1 s.*takes up where it stood"):
            sweep("hertz", VARY, overrides=TINY, out=tmp_path / "s", cluster=address, watch=kill)
    kept = len(list((tmp_path / "s" / "points").glob("*.json")))
    assert kept >= 1
    again = sweep("hertz", VARY, overrides=TINY, out=tmp_path / "s", workers=0)
    assert len(again.plan.kept) == kept
    assert not again.failed


@pytest.mark.parametrize(
    ("address", "told"),
    [
        ("local:2", "tcp://host:port; on this machine alone use --workers"),
        ("elsewhere", "write the address of a Dask scheduler"),
        ("tcp://127.0.0.1:9", "no scheduler answers"),
    ],
)
def test_bad_cluster_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, address: str, told: str
) -> None:
    monkeypatch.setattr(engine, "PATIENCE_S", 1.0)
    with pytest.raises(InputError, match=told):
        sweep("hertz", VARY, overrides=TINY, out=tmp_path, cluster=address)


def test_missing_dask_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"updampers\[cluster\]"):
        sweep("hertz", VARY, overrides=TINY, out=tmp_path, cluster="tcp://127.0.0.1:9")


def test_disk_full_in_mid_sweep_is_one_clear_error_and_keeps_what_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[str] = []
    real = point_store.write_text

    def full(path: Path, text: str) -> None:
        is_point = path.parent.name == "points"
        if is_point and len(written) == 2:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(path, text)
        written.extend([path.name] if is_point else [])

    with monkeypatch.context() as patch:
        patch.setattr(point_store, "write_text", full)
        with pytest.raises(
            UpdError, match=r"No space left on device.*finished points are kept"
        ) as caught:
            sweep("hertz", VARY, overrides=TINY, out=tmp_path, workers=0)
    assert not isinstance(caught.value, InputError)
    assert sorted(path.name for path in (tmp_path / "points").iterdir()) == sorted(written)
    again = sweep("hertz", VARY, overrides=TINY, out=tmp_path, workers=0)
    assert len(again.plan.kept) == 2
    assert not again.failed


def test_disk_full_at_the_end_keeps_the_earlier_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from upd.batch import sweeps as output

    sweep("hertz", ["contact.friction=0.2,0.4"], overrides=TINY, out=tmp_path, workers=0)
    before = {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}

    def full(path: Path, data: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(output, "write_text", full)
    with pytest.raises(UpdError, match="No space left"):
        sweep(
            "hertz",
            ["contact.friction=0.2,0.4"],
            overrides=TINY,
            out=tmp_path,
            workers=0,
            follow=["approach"],
        )
    assert {path: path.read_bytes() for path in before} == before
    assert len(list((tmp_path / "points").iterdir())) == 2


def test_another_grid_in_the_folder_of_a_sweep_is_refused(tmp_path: Path) -> None:
    quick = {**TINY, "want": ["normal"]}
    sweep("hertz", ["contact.friction=0.2,0.4"], overrides=quick, out=tmp_path / "s", workers=0)
    before = {p: p.read_bytes() for p in (tmp_path / "s").rglob("*") if p.is_file()}
    for grid in (["contact.friction=0.2,0.5"], ["geometry.radius=4 mm,5 mm"]):
        with pytest.raises(InputError, match=r"another sweep.*friction=0\.2,0\.4.*--out"):
            sweep("hertz", grid, overrides=quick, out=tmp_path / "s", workers=0)
    with pytest.raises(InputError, match=r"another sweep.*of a scene with other values"):
        other = {**quick, "loads.normal": ["77 N"]}
        sweep("hertz", ["contact.friction=0.2,0.4"], overrides=other, out=tmp_path / "s", workers=0)
    assert {p: p.read_bytes() for p in before} == before


def test_a_folder_with_other_things_is_refused(tmp_path: Path) -> None:
    mine = tmp_path / "mine" / "table.csv"
    mine.parent.mkdir()
    mine.write_text("of mine", encoding="utf-8")
    with pytest.raises(InputError, match=r"holds no sweep.*--out"):
        sweep("hertz", VARY, overrides=TINY, out=mine.parent, workers=0)
    assert [p.name for p in mine.parent.iterdir()] == ["table.csv"]
    assert mine.read_text(encoding="utf-8") == "of mine"
    # nor is a folder called points a sweep's beside other files
    (mine.parent / "points").mkdir()
    with pytest.raises(InputError, match=r"holds no sweep.*--out"):
        sweep("hertz", VARY, overrides=TINY, out=mine.parent, workers=0)
    assert mine.read_text(encoding="utf-8") == "of mine"


def test_folder_that_cannot_be_written_is_refused_before_anything_is_solved(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=r"cannot be written.*--out"):
        sweep("hertz", VARY, overrides=TINY, out=tmp_path / "file", workers=0)
    assert (tmp_path / "file").read_text(encoding="utf-8") == "mine"


def test_cache_that_cannot_be_written_is_done_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    monkeypatch.setenv("UPD_CACHE", str(tmp_path / "file"))
    found = sweep(
        "hertz",
        ["contact.friction=0.2,0.4"],
        overrides={**TINY, "want": ["normal"]},
        out=tmp_path / "s",
        workers=0,
    )
    assert not found.failed


def test_two_sweeps_in_one_folder_are_refused(tmp_path: Path) -> None:
    pytest.importorskip("fcntl")

    def second(progress: Progress) -> None:
        with pytest.raises(InputError, match="another sweep is running"):
            sweep("hertz", VARY, overrides=TINY, out=tmp_path, workers=0)

    sweep("hertz", ["contact.friction=0.2"], overrides=TINY, out=tmp_path, workers=0, watch=second)


class Script:
    """An executor that answers as written: text, or None for a death."""

    deaths = (BrokenExecutor,)

    def __init__(
        self, answers: dict[str, list[str | None]], names: Sequence[str] = ("a", "b")
    ) -> None:
        self.answers, self.names = answers, names
        self.log: list[tuple[str, str]] = []

    def workers(self) -> Sequence[str]:
        return self.names

    def submit(self, worker: str, task: str) -> Future[str]:
        self.log.append((worker, task))
        answer, future = self.answers[task].pop(0), Future[str]()
        if answer is None:
            future.set_exception(BrokenExecutor())
        else:
            future.set_result(answer)
        return future

    def close(self) -> None:
        pass


def test_workers_stay_with_their_group_then_open_another_then_help() -> None:
    fine = Outcome().text()
    groups = dict(enumerate("xyxyxyzzz"))
    executor = Script({group: [fine] * 3 for group in "xyz"})
    dispatch(groups, groups, executor, lambda number, outcome: None, lambda: None)
    a, b = ("".join(task for worker, task in executor.log if worker == name) for name in "ab")
    assert len(a + b) == 9
    # One change of group each; the last group is shared.
    assert a.startswith("xxxz")
    assert b.startswith("yyyz")


def test_each_point_is_recorded_once_whoever_dies() -> None:
    fine = Outcome().text()
    recorded: list[tuple[int, str]] = []
    executor = Script({"0": [None, fine], "1": [None] * ATTEMPTS, "2": [fine]})
    dispatch(
        {k: str(k) for k in range(3)},
        {},
        executor,
        lambda k, outcome: recorded.append((k, outcome.failure)),
        lambda: None,
    )
    assert sorted(k for k, _ in recorded) == [0, 1, 2]
    assert {k for k, failure in recorded if failure} == {1}


def test_a_worker_that_goes_away_loses_its_point_to_another() -> None:
    """Its future never ends: nobody is there who could end it."""

    class Leaving(Script):
        def workers(self) -> Sequence[str]:
            return self.names if not self.log else self.names[1:]

        def submit(self, worker: str, task: str) -> Future[str]:
            future = super().submit(worker, task)
            return Future[str]() if worker == "a" else future

    fine, recorded = Outcome().text(), list[int]()
    executor = Leaving({"0": [fine, fine], "1": [fine]})
    dispatch(
        {0: "0", 1: "1"}, {}, executor, lambda number, _: recorded.append(number), lambda: None
    )
    assert sorted(recorded) == [0, 1]
    assert ("a", "0") in executor.log
    assert ("b", "0") in executor.log


def test_a_worker_that_cannot_run_points_ends_the_sweep() -> None:
    class Lacking(Script):
        def submit(self, worker: str, task: str) -> Future[str]:
            future = Future[str]()
            future.set_exception(ModuleNotFoundError("No module named 'upd'"))
            return future

    with pytest.raises(UpdError, match=r"cannot run points \(ModuleNotFoundError: No module"):
        dispatch({0: ""}, {}, Lacking({}), lambda *_: None, lambda: None)


def test_worker_with_other_sources_ends_the_sweep() -> None:
    task = Task(load_scene("hertz", TINY).text, {}, recipe="sphere_block", code="0" * 64)
    outcome = read_outcome(solve_task(task.text()))
    assert outcome.failure.startswith(OTHER_CODE)
    assert not outcome.final
    with pytest.raises(InputError, match="different codes"):
        dispatch(
            {0: ""},
            {},
            Script({"": [outcome.text()]}),
            lambda number, found: None,
            lambda: None,
        )
