"""Run a sweep: points to workers, outcomes to files as they come, then table, arrays and figures."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from upd.batch.executors import Crew, Here
from upd.batch.output import write_outputs
from upd.batch.plan import SweepPlan
from upd.batch.points import Outcome
from upd.batch.schedule import Job, dispatch
from upd.batch.table import Column, check_follow, make_columns, patterns
from upd.cache.files import write_text
from upd.errors import InputError, UpdError

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Progress:
    """How far a sweep is. rate in points per s and left_s in s, from the points of this call; label, seconds, failure of the last one."""

    done: int
    total: int
    failed: int
    running: int
    rate: float
    left_s: float
    label: str = ""
    seconds: float = 0.0
    failure: str = ""


Watcher = Callable[[Progress], None]


@dataclass(frozen=True)
class SweepResult:
    """A finished sweep: its plan, the outcome of every point in the grid's order, the followed numbers, seconds of this call."""

    plan: SweepPlan
    outcomes: tuple[Outcome, ...]
    columns: tuple[Column, ...]
    seconds: float
    folder: Path
    files: tuple[Path, ...]

    @property
    def failed(self) -> list[int]:
        """Numbers of the points that failed."""
        return [k for k, outcome in enumerate(self.outcomes) if outcome.failure]

    def column(self, name: str, case: str | None = None) -> Column:
        """The followed number `name` of `case` (the first when None). Raises InputError when there is none."""
        for column in self.columns:
            if column.name == name and case in (None, column.case):
                return column
        raise InputError(f"no followed number {name!r} of case {case!r}; there are {', '.join(c.title for c in self.columns)}")


def run_sweep(plan: SweepPlan, folder: Path, *, follow: Sequence[str] = (), cluster: str = "", watch: Watcher | None = None) -> SweepResult:
    """Solve what is missing of `plan` and write table.csv, sweep.nc, sweep.json and figures into `folder`.

    follow  : names of numbers (shell patterns) for table and figures; the usual ones of the analysis when empty. points/ holds them all.
    cluster : "local:N" or "tcp://host:port" for Dask; "" for processes of this machine (in this process when plan.workers is 0).
    A point that fails is a row with its reason. Kill it at any moment: finished points are kept and not run again.
    Raises InputError (folder, cluster, follow) and UpdError (disk full, cluster gone): what was there stays.
    """
    begin = time.perf_counter()
    with _sole(folder):
        outcomes = plan.kept | plan.refused
        _check_kept(plan, follow)
        if plan.groups:
            _solve(plan, folder, outcomes, follow, cluster, watch)
        found = tuple(outcomes[k] for k in range(len(plan.places)))
        columns = tuple(make_columns(found, patterns(plan.scene, follow)))
        seconds = time.perf_counter() - begin
        with _writing(folder):
            files = [*write_outputs(folder, plan, found, columns, seconds, cluster), *_write_page(folder)]
    return SweepResult(plan, found, columns, seconds, folder, tuple(files))


def _solve(plan: SweepPlan, folder: Path, outcomes: dict[int, Outcome], follow: Sequence[str], cluster: str, watch: Watcher | None) -> None:
    begin, before = time.perf_counter(), len(outcomes)
    running = 0

    def tell(label: str = "", seconds: float = 0.0, failure: str = "") -> None:
        if watch is not None:
            done = len(outcomes)
            rate = (done - before) / max(time.perf_counter() - begin, 1e-9)
            left = (len(plan.places) - done) / rate if rate else float("inf")
            failed = sum(bool(outcome.failure) for outcome in outcomes.values())
            watch(Progress(done, len(plan.places), failed, running, rate, left, label, seconds, failure))

    def record(number: int, outcome: Outcome) -> None:
        if outcome.final:
            with _writing(folder):
                write_text(folder / "points" / plan.files[number], outcome.text() + "\n")
        if not outcome.failure:
            check_follow(outcome, follow)
        outcomes[number] = outcome
        tell(label_of(plan, number), outcome.seconds, outcome.failure)

    def idle(now: int) -> None:
        nonlocal running
        running = now
        tell()

    jobs = [Job(number, plan.tasks[number].text(), plan.groups[number]) for number in plan.missing]
    crew = _crew(plan, cluster)
    try:
        dispatch(jobs, crew, record, idle)
    finally:
        crew.close()


def _write_page(folder: Path) -> list[Path]:
    """report.html, or nothing when it cannot be made: the numbers are on disk already."""
    try:
        # Of an earlier grid, perhaps.
        (folder / "report.html").unlink(missing_ok=True)
        # Templates and charts are slow to import: only when a page is made.
        from upd.report import write_report

        return [write_report(folder)]
    except Exception:
        log.exception("report.html was not written")
        return []


def label_of(plan: SweepPlan, number: int) -> str:
    """Values of a point in words: friction 0.3, centrifugal 350 N."""
    index = plan.places[number].index
    return ", ".join(f"{axis.path.rpartition('.')[2]} {axis.values[k]}" for axis, k in zip(plan.axes, index, strict=True))


def _crew(plan: SweepPlan, cluster: str) -> Crew:
    if cluster:
        from upd.batch.dask import Cluster

        return Cluster(cluster)
    if plan.workers == 0:
        return Here()
    from upd.batch.pool import Pool

    return Pool(plan.workers, plan.threads)


def _check_kept(plan: SweepPlan, follow: Sequence[str]) -> None:
    solved = next((outcome for outcome in plan.kept.values() if not outcome.failure), None)
    if solved is not None:
        check_follow(solved, follow)


def check_folder(folder: Path) -> None:
    """Try to write into the sweep folder; new ones, it and its parents, are not left behind. Raises InputError before the first point."""
    new = [place for place in (folder, *folder.parents) if not place.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / ".try", "")
        (folder / ".try").unlink()
        for place in new:
            place.rmdir()
    except OSError as error:
        raise InputError(f"the sweep folder {folder} cannot be written ({error.strerror}): choose another with --out") from None


@contextmanager
def _writing(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise UpdError(
            f"the sweep folder {folder} cannot be written any more ({error.strerror or error}): finished points are kept there. "
            "Make room or give write permission, then start the same sweep: only what is missing runs"
        ) from None


@contextmanager
def _sole(folder: Path) -> Iterator[None]:
    """The folder, made and locked: two sweeps at once would solve everything twice. Raises InputError."""
    check_folder(folder)
    try:
        (folder / "points").mkdir(parents=True, exist_ok=True)
        handle = os.open(folder / ".lock", os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise InputError(f"the sweep folder {folder} cannot be written ({error.strerror}): choose another with --out") from None
    try:
        try:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(f"another sweep is running in {folder}: wait for it, or choose another folder with --out") from None
        except (ImportError, OSError):
            # No locks on this system or disk.
            pass
        yield
    finally:
        os.close(handle)
