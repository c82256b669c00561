"""What accuracy costs: table and figure of a study, error against seconds and against memory, one curve per element and solver."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from upd.analyses.convergence import Extrapolation, change_order, extrapolate, fit_rate
from upd.batch.ladder import Outcome
from upd.cache.files import write_text
from upd.plot.matplotlib import write_sheets
from upd.plot.work_precision import work_precision_charts

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


def rate_text(order: float) -> str:
    """The fitted order, or that there is none."""
    return f"{order:.1f}" if np.isfinite(order) else "none clear"


def write_study(folder: Path, title: str, outcomes: list[Outcome], curves: list[Curve]) -> Path:
    """Write study.json, study.md and work_precision.png into ``folder``; returns the table's path."""
    data: dict[str, Any] = {"title": title, "points": [asdict(o) for o in outcomes], "curves": [asdict(c) for c in curves]}
    write_text(folder / "study.json", json.dumps(data, indent=1) + "\n")
    write_text(folder / "study.md", markdown(title, outcomes, curves))
    write_sheets(work_precision_charts(data["curves"]), folder)
    return folder / "study.md"


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
