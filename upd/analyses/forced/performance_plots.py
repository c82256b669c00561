"""Figure of the performance curve."""

from __future__ import annotations

from matplotlib.axes import Axes

from upd.analyses.forced.performance import Performance
from upd.plot.sheet import CLOSED, own_axes

_COLORS = ("#1f5fa8", "#c0392b")


def performance_figure(name: str, curve: Performance, ax: Axes | None = None) -> Axes:
    """Peak accelerance over F_C/F_E of each peak, open marks where points lift off, the optimum of the highest peak marked."""
    ax = own_axes(ax)
    for color, branch in zip(_COLORS, curve.branches, strict=False):
        ax.loglog(branch.ratio, branch.height, color=color, lw=1.3, label=branch.name)
        for lifts in (False, True):
            on = (branch.lift > 0.0) == lifts
            face = "white" if lifts else color
            label = f"{branch.name}, points lift off" if lifts and on.any() else None
            ax.plot(branch.ratio[on], branch.height[on], "o", ms=4, color=color, markerfacecolor=face, label=label)
    ax.axhline(curve.free_peak, ls="--", lw=1.0, color=CLOSED, label="free")
    ax.axhline(curve.stuck_peak, ls="-.", lw=1.0, color=CLOSED, label="stuck")
    if curve.optimum is not None:
        ratio, frequency, height = curve.optimum
        ax.plot(ratio, height, "*", ms=13, color="#d98200", label=f"optimum {ratio:.3g}, {frequency:.1f} Hz")
    ax.set(xlabel="F_C/F_E", ylabel="peak accelerance, (m/s²)/N", title=f"right blade, {name}")
    ax.grid(which="both", alpha=0.25)
    ax.legend(fontsize=7)
    return ax
