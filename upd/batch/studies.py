"""Studies of a scene: its variations, solved, and their report."""

from __future__ import annotations

import json
import time
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from upd.analyses import analysis_of, ladders_of
from upd.batch.engine import (
    Batch,
    Watcher,
    Workers,
    WorkersAsked,
    check_who,
    fitting,
    run_points,
)
from upd.batch.plan import point_needs
from upd.batch.point import Task
from upd.batch.store import PointStore
from upd.cache.files import write_text
from upd.cache.sources import source_digest
from upd.errors import InputError, did_you_mean
from upd.linalg import select
from upd.plot.work_precision import work_precision_charts
from upd.scene import AnyScene, load_scene
from upd.scene.quantities import UNKNOWN
from upd.scene.ranges import bare_quantity
from upd.vary.curves import markdown_table
from upd.vary.ladder import Asked, StudyReport
from upd.vary.outcome import SolvedPoint
from upd.vary.variation import Variation

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: numbers the loads alone decide: no level changes them
_OF_LOADS = ("F_N", "F_T")
#: analysis -> what --at sets in the scene, and what it chooses; a force where it has a unit
_NORMAL = ("loads.normal", "N", "the normal force of a contact")
_LOADS = {
    "forced": ("excitation.centrifugal_to_force", "", "one F_C/F_E"),
    "seated": ("damper.centrifugal", "N", "F_C of a seated damper"),
    "hertz": _NORMAL,
    "flat": _NORMAL,
}


@dataclass(frozen=True)
class Study:
    """Points in the order they are solved in, and what is made of them once they are.

    Attributes
    ----------
    present
        Makes the report; points that failed are in it.
    """

    title: str
    points: tuple[Variation, ...]
    present: Callable[[Sequence[SolvedPoint]], StudyReport]

    def write(self, folder: Path, solved: Sequence[SolvedPoint], report: StudyReport) -> list[Path]:
        """Write study.md, study.json, figures and page into ``folder``.

        Returns the paths, the table first.
        """
        curves = [asdict(one) for one in report.curves]
        table, data = folder / "study.md", folder / "study.json"
        lines = [f"# {self.title}", ""]
        tables = (*report.tables, *report.details)
        for part in tables:
            lines += [f"## {part.heading}", "", *markdown_table(part), ""]
        write_text(table, "\n".join([*lines, *(f"- {note}" for note in report.notes)]) + "\n")
        content = {
            "title": self.title,
            "points": [one.as_dict() for one in solved],
            "curves": curves,
            "notes": list(report.notes),
        }
        write_text(data, json.dumps(content, indent=1) + "\n")
        charts = work_precision_charts(curves)
        # slow to import: only where a page is made
        from upd.plot.matplotlib import write_sheets
        from upd.report.page import Section, page_text, write_page

        failed = sum(bool(one.outcome.failure) for one in solved)
        how = ("warning", f"Done, {failed} failed") if failed else ("passed", "Done")
        sections = [Section("Answer", tables), Section("Figures", charts=charts)]
        html = page_text(self.title, sections, verdict=(*how, " ".join(report.notes)))
        page = write_page(folder / "report.html", html)
        return [table, data, *write_sheets(charts, folder), page]


@dataclass(frozen=True, repr=False)
class StudyResult:
    """A finished study.

    Attributes
    ----------
    solved
        Its points with what they gave.
    kept
        Numbers of the points an earlier call had solved.
    seconds
        Of this call.
    """

    study: Study
    solved: tuple[SolvedPoint, ...]
    report: StudyReport
    files: tuple[Path, ...]
    kept: tuple[int, ...]
    seconds: float

    def __repr__(self) -> str:
        solved = sum(not one.outcome.failure for one in self.solved)
        counts = f"{solved} of {len(self.solved)} levels solved in {self.seconds:.1f} s"
        return "\n".join([f"{self.study.title}: {counts}", *self.report.notes[:6]])

    def table(self) -> str:
        """Its first table in Markdown: the levels with their cost and main numbers."""
        return "\n".join(markdown_table(self.report.tables[0]))

    def plot(self) -> list[Axes]:
        """Draw error against seconds with matplotlib, and return the axes."""
        from upd.plot.matplotlib import draw_all

        charts = work_precision_charts([asdict(one) for one in self.report.curves])
        return draw_all([one for one in charts if one.x.name == charts[0].x.name][:6])


def study(
    scene: str | Path | Mapping[str, Any],
    vary: str = "mesh",
    *,
    levels: Sequence[float] | None = None,
    at: float | str | None = None,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    out: str | Path,
    watch: Watcher | None = None,
    **who: Unpack[WorkersAsked],
) -> StudyResult:
    """Run a study of ``scene``: a ladder of meshes or models, a parameter study, or sensitivities.

    Parameters
    ----------
    vary
        What is varied, one of `upd.analyses.ladders_of`.
    levels
        Levels of a ladder, coarse to fine; None for the usual ones.
    at
        The load that is studied: F_C/F_E of a forced response (None: the scene's lowest), the
        normal force of a contact (None: all of the scene's) or F_C of a seated damper, in N or as
        text with a unit.
    out
        Folder; called again with the same one, only missing points run.
    watch
        Called with an `upd.batch.engine.Progress`.
    who
        workers: points side by side, each in a fresh process, 1 by default; 0: one after the other
        in this process. With more than one, seconds and memory bandwidth are shared: fine for
        numbers, not for what accuracy costs. A script that has any needs
        ``if __name__ == "__main__":``. threads: of each; None: all there are, divided by the
        workers; 1 on a cluster. cluster: "tcp://host:port" for Dask.

    Raises
    ------
    InputError, UpdError
        As `scene_at`, `plan_study` and `run_study` do.

    Examples
    --------
    >>> import upd
    >>> found = upd.study("hertz", "mesh", levels=[8, 12, 16], out="runs/study")    # doctest: +SKIP
    >>> found.solved[0].values["max_pressure", "F=50 N"]                            # doctest: +SKIP
    """
    loaded = scene_at(load_scene(scene, overrides), at)
    planned = plan_study(loaded, vary, None if levels is None else tuple(levels))
    workers = study_workers(loaded, planned, **who)
    return run_study(loaded, planned, Path(out), workers=workers, watch=watch)


def plan_study(scene: AnyScene, vary: str, asked: Asked = None) -> Study:
    """The study of one variation.

    Raises InputError when the scene's analysis has none of that name, and for levels that are none.
    """
    offered = ladders_of(scene)
    if vary not in offered:
        known = f"choose one of {', '.join(offered) or 'none: sweep it'}"
        raise InputError(f"--vary {vary}: no such study{did_you_mean(vary, offered, known)}")
    ladder = offered[vary]
    analysis = analysis_of(scene)
    wanted = dict.fromkeys((*analysis.verdict_names, *analysis.headline_names, *ladder.follow))
    names = [n for n in wanted if n not in _OF_LOADS]

    def present(solved: Sequence[SolvedPoint]) -> StudyReport:
        report = ladder.report(scene, solved, names)
        return replace(report, notes=(*ladder.notes(scene), *report.notes))

    title = f"{scene.title or scene.name}: {ladder.title(scene, vary)}"
    return Study(title, tuple(ladder.variations(scene, asked)), present)


def point_task(one: Variation, scene: AnyScene, threads: int, code: str) -> Task:
    """A point for a worker. It shares nothing with others: its seconds and memory count.

    It estimates no errors, unless it asks for an accuracy: the seconds are those of the level
    alone.
    """
    settings = {"accuracy": UNKNOWN} | dict(one.overrides)
    return Task(scene.text, settings, threads, recipe=scene.recipe, code=code, alone=True)


def study_workers(
    scene: AnyScene,
    planned: Study,
    workers: int | None = None,
    threads: int | None = None,
    cluster: str = "",
) -> Workers:
    """Who solves the points.

    By default one fresh process after the other with all threads, so that seconds and memory can be
    compared.

    Parameters
    ----------
    workers, threads, cluster
        As for `study`.

    Raises
    ------
    InputError
        For numbers this machine cannot have, and an address that is none.
    """
    workers = 1 if workers is None else workers
    each = 1 if cluster else max(1, select.threads() // max(workers, 1))
    check_who(workers, each if threads is None else threads, cluster)
    if workers < 2 or cluster:
        # Alone it has what a single run takes.
        default = each if cluster else 0
        return Workers(workers, default if threads is None else threads, cluster, fresh=True)
    each = each if threads is None else threads
    needs, _ = point_needs([point_task(one, scene, each, "") for one in planned.points])
    largest = max((one.memory_bytes for _, one in needs.values()), default=0.0)
    many, _ = fitting(workers, each, len(planned.points), largest)
    return Workers(many, each, cluster, fresh=True)


def run_study(
    scene: AnyScene,
    planned: Study,
    folder: Path,
    *,
    workers: Workers,
    watch: Watcher | None = None,
) -> StudyResult:
    """Solve the points that ``folder`` does not hold yet, and leave the study's tables and figures
    there.

    A point that fails is a point with its reason. Kill the study at any moment: finished points are
    kept.

    Parameters
    ----------
    workers
        From `study_workers`.

    Raises
    ------
    InputError
        Folder, cluster.
    UpdError
        Disk full, cluster gone: what was there stays.
    """
    begin = time.perf_counter()
    store = PointStore(folder, "study")
    code = source_digest(scene.recipe)
    points = planned.points
    tasks = [point_task(point, scene, workers.threads, code) for point in points]
    with store.sole():
        known = store.finished(tasks)
        batch = Batch(tasks, workers, known, lambda k: f"{points[k].source} {points[k].label}")
        outcomes = run_points(batch, store, watch=watch)
        solved = tuple(
            SolvedPoint(point, outcome) for point, outcome in zip(points, outcomes, strict=True)
        )
        report = planned.present(solved)
        with store.writing():
            files = planned.write(folder, solved, report)
    return StudyResult(
        planned, solved, report, tuple(files), tuple(sorted(known)), time.perf_counter() - begin
    )


def scene_at(scene: Any, at: float | str | None) -> AnyScene:
    """The scene at one load.

    Parameters
    ----------
    at
        F_C/F_E of a forced response; the normal force of a contact, or F_C of a seated damper: N
        as a number, or text with a unit. None: the scene as it is.

    Raises
    ------
    InputError
        For what is no such load, a scene without one, and one that does not take it.
    """
    if at is None:
        given: AnyScene = scene
        return given
    analysis = analysis_of(scene).name
    if analysis not in _LOADS:
        raise InputError(
            f"--at {at}: the scene has no load to choose; leave it out, or study a forced response"
        )
    path, unit, chosen = _LOADS[analysis]
    try:
        load = bare_quantity(str(at), "force" if unit else "fraction")
    except InputError:
        load = 0.0
    if not load > 0.0:
        form = 'force, for example --at "200 N"' if unit else "number without a unit, as --at 194"
        raise InputError(f"--at {at}: chooses {chosen}; write a positive {form}")
    value: Any = f"{load!r} {unit}" if unit else load
    settings = {path: value if analysis == "seated" else [value]}
    if analysis == "forced" and scene.excitation.force:
        settings["excitation.force"] = []
    try:
        changed: AnyScene = load_scene(tomllib.loads(scene.text), settings)
    except InputError as problem:
        raise InputError(f"--at {at}: the scene does not take it: {problem}") from None
    return changed
