"""Sweeps: one scene over a grid of parameters, on one machine or many."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from upd.batch.run import SweepResult, Watcher

__all__ = ["sweep"]


def sweep(
    scene: str | Path | Mapping[str, Any],
    vary: Sequence[str],
    *,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    out: str | Path,
    workers: int | None = None,
    threads: int = 1,
    cluster: str = "",
    follow: Sequence[str] = (),
    watch: Watcher | None = None,
) -> SweepResult:
    """Run ``scene`` over the full factorial of ``vary``, for example ["contact.friction=0.1:0.6:6", "mesh.element=hex8i,hex20"].

    out     : folder; called again with the same one, only missing points run.
    workers : processes (0: this process; None: as many as cores and memory allow), with `threads` threads each.
    cluster : "local:N" or "tcp://host:port" for Dask. follow : names of the numbers for table and figures.
    Raises InputError and UpdError as `plan_sweep` and `run_sweep` do. A script that calls this with workers needs
    ``if __name__ == "__main__":``.
    """
    from upd.batch.plan import plan_sweep
    from upd.batch.run import check_folder, run_sweep
    from upd.scene import load_scene

    folder = Path(out)
    loaded = load_scene(scene, overrides)
    check_folder(folder)
    plan = plan_sweep(loaded, vary, folder, workers=workers, threads=threads, cluster=cluster)
    return run_sweep(plan, folder, follow=follow, cluster=cluster, watch=watch)
