"""A scene over a grid of parameters, or a sample of its inputs: plan, points, then table, arrays
and figures.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from upd.batch.engine import Batch, Watcher, run_points
from upd.batch.output import SweepResult, draw, write_outputs
from upd.batch.plan import SweepPlan, plan_sweep
from upd.batch.sample import sampled_numbers
from upd.batch.store import PointStore
from upd.batch.table import check_follow, make_columns, patterns
from upd.errors import one_line
from upd.scene import load_scene
from upd.vary.outcome import Outcome

log = logging.getLogger(__name__)


def sweep(
    scene: str | Path | Mapping[str, Any],
    vary: Sequence[str] = (),
    *,
    sample: int | None = None,
    seed: int | None = None,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    out: str | Path,
    workers: int | None = None,
    threads: int = 1,
    cluster: str = "",
    follow: Sequence[str] = (),
    watch: Watcher | None = None,
) -> SweepResult:
    """Run ``scene`` over the full factorial of ``vary``, or over a sample of its uncertain inputs.

    Parameters
    ----------
    vary
        For example ["contact.friction=0.1:0.6:6", "mesh.element=hex8i,hex20"].
    sample
        Points drawn evenly from the limits that half-widths give ("0.6 +- 0.1"), in place of
        ``vary``: a check of the first-order bands, `SweepResult.sampled`.
    seed
        Of the draw; None: that of the sample in ``out``, else 0.
    out
        Folder; called again with the same one, only missing points run.
    workers
        Processes (0: this process; None: as many as cores and memory allow). A script that has any
        needs ``if __name__ == "__main__":``.
    threads
        Threads of each process.
    cluster
        "local:4" or "tcp://host:port" for Dask.
    follow
        Names of the numbers for table and figures (shell patterns).
    watch
        Called with an `upd.batch.engine.Progress`.

    Raises
    ------
    InputError, UpdError
        As `plan_sweep` and `run_sweep` do.

    Examples
    --------
    >>> import upd
    >>> found = upd.sweep("hertz", ["contact.friction=0.2,0.4"], out="f")  # doctest: +SKIP
    >>> found.column("max_pressure").values  # doctest: +SKIP
    """
    folder = Path(out)
    loaded = load_scene(scene, overrides)
    PointStore(folder, "sweep").check()
    plan = plan_sweep(
        loaded,
        vary,
        folder,
        sample=sample,
        seed=seed,
        workers=workers,
        threads=threads,
        cluster=cluster,
    )
    return run_sweep(plan, folder, follow=follow, watch=watch)


def run_sweep(
    plan: SweepPlan, folder: Path, *, follow: Sequence[str] = (), watch: Watcher | None = None
) -> SweepResult:
    """Solve what is missing of ``plan`` and write table.csv, sweep.nc, sweep.json, figures and
    report.html into ``folder``; of a sample sample.csv too.

    A point that fails is a row with its reason. Kill it at any moment: finished points are kept and
    not run again.

    Parameters
    ----------
    follow
        Names of numbers (shell patterns) for table and figures; the usual ones of the analysis when
        empty. points/ holds them all.

    Raises
    ------
    InputError
        Folder (also one with the results of another grid), cluster, follow.
    UpdError
        Disk full, cluster gone: what was there stays.
    """
    begin = time.perf_counter()
    store = PointStore(folder, "sweep")

    def check(outcome: Outcome) -> None:
        check_follow(outcome, follow)

    with store.sole():
        store.sole_grid(
            {
                "scene": plan.scene.name,
                "given": sha256(plan.scene.text.encode()).hexdigest(),
                "axes": [{"path": a.path, "values": list(a.values)} for a in plan.axes],
            }
            | ({} if plan.sample is None else {"sample": plan.sample.as_dict()})
        )
        solved = next((outcome for outcome in plan.kept.values() if not outcome.failure), None)
        if solved is not None:
            check(solved)
        known = plan.kept | plan.refused
        batch = Batch(plan.tasks, plan.workers, known, plan.label, plan.groups, plan.seconds)
        found = run_points(batch, store, check=check, watch=watch)
        columns = tuple(make_columns(found, patterns(plan.scene, follow)))
        sampled = () if plan.sample is None else sampled_numbers(plan.sample, columns)
        seconds = time.perf_counter() - begin
        result = SweepResult(plan, found, columns, seconds, folder, sampled=sampled)
        with store.writing():
            files = write_outputs(store, result)
            # Of an earlier call, perhaps.
            (folder / "report.html").unlink(missing_ok=True)
        pictures: dict[str, Callable[[], list[Path]]] = {
            "figures": lambda: draw(folder, plan.axes, columns, sampled),
            "report.html": lambda: _write_page(folder),
        }
        faults = []
        for what, make in pictures.items():
            # The numbers are on disk: what goes wrong with pictures is a warning.
            try:
                files += make()
            except Exception as error:
                log.exception("%s not written", what)
                faults.append(f"{what} not written ({one_line(error)})")
    return replace(result, files=tuple(files), faults=tuple(faults))


def _write_page(folder: Path) -> list[Path]:
    # Templates and charts are slow to import: only when a page is made.
    from upd.report import write_report

    return [write_report(folder)]
