"""Figure of a study: error against seconds and against memory, one curve per element and solver."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from upd.batch.curves import ConvergenceCurve


def work_precision(curves: list[ConvergenceCurve], cost: str = "seconds", ax: Axes | None = None) -> Axes:
    """|error| against ``cost`` ("seconds" or "memory_mb") of curves that share name and case, the thesis's error as a line."""
    if ax is None:
        figure = Figure(figsize=(6, 4.5), layout="constrained")
        FigureCanvasAgg(figure)
        ax = figure.add_subplot()
    for k, c in enumerate(curves):
        # In the order of the ladder, coarse to fine.
        rate = f" (order {c.order:.1f})" if np.isfinite(c.order) else ""
        ax.loglog(getattr(c, cost), np.abs(c.error), "o-", ms=4, color=f"C{k}", label=f"{c.curve}{rate}")
    printed = curves[0].thesis_error
    if printed:
        ax.axhline(abs(printed), color="k", ls="--", lw=1, label=f"thesis ({100 * abs(printed):.1f} %)")
    ax.set(
        title=f"{curves[0].name.replace('_', ' ')}, {curves[0].case}",
        xlabel="seconds" if cost == "seconds" else "peak memory, MB",
        ylabel=f"|error| against {curves[0].against}",
    )
    ax.grid(which="both", alpha=0.25)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_minor_formatter(NullFormatter())
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100.0 * value:g} %"))
    ax.legend(fontsize=7)
    return ax


def write_figure(folder: Path, curves: Sequence[ConvergenceCurve]) -> list[Path]:
    """Write work_precision.png into ``folder``; returns its path, or nothing when there is no curve."""
    groups: dict[tuple[str, str], list[ConvergenceCurve]] = {}
    for c in curves:
        groups.setdefault((c.name, c.case), []).append(c)
    # A number that no level moves has no error to show.
    groups = {key: group for key, group in groups.items() if any(any(c.error) for c in group)}
    if not groups:
        return []
    shown = _shown(groups)
    columns = 2 * max(len(cases) for cases in shown)
    figure = Figure(figsize=(4.6 * columns, 3.5 * len(shown)), layout="constrained")
    FigureCanvasAgg(figure)
    for row, cases in enumerate(shown):
        for k, group in enumerate(cases):
            for j, cost in enumerate(("seconds", "memory_mb")):
                work_precision(group, cost, figure.add_subplot(len(shown), columns, row * columns + 2 * k + j + 1))
    figure.savefig(folder / ".work_precision.part", format="png", dpi=110)
    (folder / ".work_precision.part").replace(folder / "work_precision.png")
    return [folder / "work_precision.png"]


def _shown(groups: Mapping[tuple[str, str], list[ConvergenceCurve]]) -> list[list[list[ConvergenceCurve]]]:
    """Rows of the figure: the first four numbers, each with its first and last case (smallest and largest load)."""
    names = list(dict.fromkeys(name for name, _ in groups))[:4]
    rows = []
    for name in names:
        cases = [group for (n, _), group in groups.items() if n == name]
        rows.append(cases if len(cases) < 3 else [cases[0], cases[-1]])
    return rows
