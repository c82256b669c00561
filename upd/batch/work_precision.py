"""What accuracy costs: table and figure of a study, error against seconds and against memory, one curve per element and solver."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from upd.analyses.convergence import Extrapolation, change_order, extrapolate, fit_rate
from upd.batch.ladder import Outcome
from upd.cache.files import write_text

#: Numbers a study follows, in the order of its figures.
FOLLOWED = (
    "max_pressure",
    "mean_pressure",
    "radius_moment",
    "approach",
    "K_N_tangent",
    "K_T_initial",
    "tangential_displacement",
    "cycle_energy",
    "K_N_secant_raw",
    "K_Tx_initial_raw",
    "K_Ty_initial_raw",
    "approach_damper",
    "approach_platform",
    "law_k_n",
)
#: Numbers of the raw bodies: their error is taken against the converged value on the same bodies, not against the half-space.
_SAME_BODIES = re.compile(r"approach|f\d+_(free|glued)")
#: order of change below which a number is said not to converge: a logarithm has 0, the edge of a punch less
_CONVERGES = 0.2
#: spread in % of the last three levels up to which a number without a clear order counts as settled
_SETTLED = 5.0


@dataclass(frozen=True)
class Curve:
    """One number of one case along one ladder. ``error`` (n,) are fractions of ``reference``; ``order`` is the fitted rate."""

    curve: str
    name: str
    case: str
    labels: tuple[str, ...]
    h: tuple[float, ...]
    error: tuple[float, ...]
    seconds: tuple[float, ...]
    memory_mb: tuple[float, ...]
    reference: float
    against: str
    order: float
    thesis_error: float | None
    limit: Extrapolation | None
    change: float = float("nan")

    @property
    def verdict(self) -> str:
        """Whether the number converges under refinement, in words."""
        if len(self.error) < 3:
            return "too few levels"
        if "no limit" in self.against:
            return f"grows like h^{self.change:.2f}: no limit"
        if np.isfinite(self.change) and self.change >= _CONVERGES:
            return f"converges, order {self.change:.1f}"
        last = [1.0 + e for e in self.error[-3:]]
        spread = 100.0 * (max(last) / min(last) - 1.0) if min(last) > 0.0 else float("inf")
        return f"{'settled' if spread <= _SETTLED else 'not settled'}: last three within {spread:.2g} %"


def make_curves(outcomes: Iterable[Outcome], names: Iterable[str] = FOLLOWED) -> list[Curve]:
    """Curves of a study's outcomes; failed points are left out."""
    good = [o for o in outcomes if not o.failure]
    followed = tuple(names)
    keys = list(dict.fromkeys(k for name in followed for o in good for k in o.values if k.split("|")[0] == name))
    ladders: dict[str, list[Outcome]] = {}
    for o in good:
        ladders.setdefault(o.curve, []).append(o)
    curves = []
    for key in keys:
        name, case = key.split("|")
        finest = _common_limit(ladders, key) if _SAME_BODIES.fullmatch(name) else None
        for curve, points in ladders.items():
            mine = [p for p in points if key in p.values]
            if mine:
                curves.append(_curve(curve, name, case, key, mine, finest))
    return curves


def _common_limit(ladders: Mapping[str, list[Outcome]], key: str) -> Extrapolation | None:
    """Converged value on the same bodies: extrapolated from the ladder with the finest mesh."""
    fits = []
    for points in ladders.values():
        mine = [p for p in points if key in p.values]
        if len({p.h for p in mine}) >= 3:
            fit = extrapolate([p.h for p in mine], [p.values[key] for p in mine], orders=(1.0, 3.0))
            finest = min(mine, key=lambda p: p.h)
            # The finest ladder; among equals the one nearest to its own extrapolation.
            fits.append((-finest.n_dof, abs(finest.values[key] / fit.limit - 1.0) + fit.scatter, fit))
    return min(fits, key=lambda found: found[:2])[2] if fits else None


def _curve(curve: str, name: str, case: str, key: str, points: list[Outcome], common: Extrapolation | None) -> Curve:
    values = np.array([p.values[key] for p in points])
    h = [p.h for p in points]
    own = extrapolate(h, values) if len(set(h)) >= 3 else None
    change = change_order(h, values)
    order = None
    if common is not None:
        error, reference, against = values / common.limit - 1.0, common.limit, "converged value, same bodies"
    elif all(key in p.errors for p in points):
        error = np.array([p.errors[key] for p in points])
        reference, against = float(values[-1] / (1.0 + error[-1])), "reference"
    elif change < _CONVERGES:
        # No limit to extrapolate to.
        reference, against, order = float(values[-1]), "finest level, no limit", float("nan")
        error = values / reference - 1.0
    else:
        reference = own.limit if own else float(values[-1])
        error, against = values / reference - 1.0, "converged value"
    order = fit_rate(h, error) if order is None else order
    thesis = next((p.thesis[key] for p in points if key in p.thesis), None)
    return Curve(
        curve, name, case, tuple(p.label for p in points), tuple(h), tuple(map(float, error)), tuple(p.seconds for p in points),
        tuple(p.memory_mb for p in points), float(reference), against, order, thesis, own, change,
    )  # fmt: skip


def work_precision(curves: list[Curve], cost: str = "seconds", ax: Axes | None = None) -> Axes:
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


def rate_text(order: float) -> str:
    """The fitted order, or that there is none."""
    return f"{order:.1f}" if np.isfinite(order) else "none clear"


def write_study(folder: Path, title: str, outcomes: list[Outcome], curves: list[Curve]) -> Path:
    """Write study.json, study.md and work_precision.png into ``folder``; returns the table's path."""
    data = {"title": title, "points": [asdict(o) for o in outcomes], "curves": [asdict(c) for c in curves]}
    write_text(folder / "study.json", json.dumps(data, indent=1) + "\n")
    write_text(folder / "study.md", markdown(title, outcomes, curves))
    groups: dict[tuple[str, str], list[Curve]] = {}
    for c in curves:
        groups.setdefault((c.name, c.case), []).append(c)
    if groups:
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
    return folder / "study.md"


def _shown(groups: Mapping[tuple[str, str], list[Curve]]) -> list[list[list[Curve]]]:
    """Rows of the figure: the first four numbers, each with its first and last case (smallest and largest load)."""
    names = list(dict.fromkeys(name for name, _ in groups))[:4]
    rows = []
    for name in names:
        cases = [group for (n, _), group in groups.items() if n == name]
        rows.append(cases if len(cases) < 3 else [cases[0], cases[-1]])
    return rows


def markdown(title: str, outcomes: list[Outcome], curves: list[Curve]) -> str:
    """The study as Markdown: points, then error and rate of every followed number."""
    lines = [f"# {title}", "", "| curve | level | dofs | seconds | peak MB | " + "note |", "|---|---|---:|---:|---:|---|"]
    lines += [f"| {o.curve} | {o.label} | {o.n_dof} | {o.seconds:.2f} | {o.memory_mb:.0f} | {o.failure} |" for o in outcomes]
    lines += [
        "",
        "| number | case | curve | order | error on each level | against | thesis | verdict |",
        "|---|---|---|---:|---|---|---:|---|",
    ]
    for c in curves:
        errors = ", ".join(f"{label.split(' ')[0]}: {100 * e:+.2f} %" for label, e in zip(c.labels, c.error, strict=True))
        thesis = "" if c.thesis_error is None else f"{100 * c.thesis_error:+.1f} %"
        lines.append(f"| {c.name} | {c.case} | {c.curve} | {rate_text(c.order)} | {errors} | {c.against} | {thesis} | {c.verdict} |")
    return "\n".join(lines) + "\n"
