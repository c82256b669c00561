"""Figures of a forced response; `save_figures` writes the PNG files of a run folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.path import Path as Outline
from matplotlib.ticker import FixedLocator, FuncFormatter

from upd.analyses.forced import measures
from upd.analyses.forced.model import SIDES
from upd.analyses.forced.output import N_LOOPS
from upd.analyses.forced.results import measured_peaks
from upd.analyses.forced.solve import Case, ForcedSolution, Local
from upd.plot.sheet import CLOSED, SLIP, STICK, Drawing, own_axes, write_sheet

#: colours of the curves with friction, and of the share lifted off
_CURVES = ("#1f5fa8", "#c0392b", "#2e8b57", "#8e44ad", "#d98200", "#16808a")
LIFT = "#b9b9b9"
_GREY, _MEASURED = "#555555", "#d98200"
#: relative distance of frequencies below which only the higher peak is labelled
_LABELS_APART = 0.03


def response_figure(solution: ForcedSolution, side: Any, name: str, ax: Axes | None = None) -> Axes:
    """Accelerance of one blade over frequency for one stiffness: free, stuck, and every curve with friction; measured peaks as lines."""
    ax = own_axes(ax)
    ax.set_yscale("log")
    linear, marked = solution.linear[name], []
    for label, curve, style, color in (("free", linear.free[side], "--", CLOSED), ("stuck", linear.stuck[side], "-.", _GREY)):
        height = np.abs(curve)
        if height.max() > 0.0:
            ax.plot(linear.frequency, height, style, color=color, lw=1.2, label=label, zorder=3)
            marked += [(f, h, color) for f, h, _ in measures.path_peaks(linear.frequency, height)]
    ratios = list(dict.fromkeys(c.ratio for c in solution.cases))
    for case in (c for c in solution.cases if not c.empty and c.stiffness == name):
        H, color = np.abs(case.accelerance[side]), _CURVES[ratios.index(case.ratio) % len(_CURVES)]
        label = f"F_C/F_E {case.ratio:g}{', downwards' * case.down}"
        ax.plot(case.answer.frequency, H, ":" if case.down else "-", color=color, lw=1.3, label=label)
        marked += [(f, h, color) for f, h, _ in measures.path_peaks(case.answer.frequency, H)]
    for f in measured_peaks(solution.plan.scene.arrangement):
        ax.axvline(f, color=_MEASURED, lw=4.0, alpha=0.25, zorder=0)
    _label_peaks(ax, marked)
    ax.set(xlabel="frequency, Hz", ylabel="accelerance, (m/s²)/N", title=f"{side} blade, stiffness {name}, damping {_damping(solution)}")
    ax.margins(y=0.12)
    ax.set_xlim(solution.plan.scene.excitation.start, solution.plan.scene.excitation.stop)
    ax.grid(True, which="major", color="#cccccc", lw=0.6)
    ax.plot([], [], color=_MEASURED, lw=4.0, alpha=0.25, label="measured (thesis)")
    ax.legend(fontsize=7)
    return ax


def _label_peaks(ax: Axes, marked: list[tuple[float, float, str]]) -> None:
    """A dot at every peak; a label where no higher peak has one near."""
    apart: list[float] = []
    for f, height, color in sorted(marked, key=lambda mark: -mark[1]):
        ax.plot(f, height, "o", ms=3.5, color=color, zorder=4)
        if all(abs(f / other - 1.0) > _LABELS_APART for other in apart):
            apart.append(f)
            ax.annotate(f"{f:.1f} Hz", (f, height), (0, 5), textcoords="offset points", fontsize=7, color=color, ha="center")


def _title(ax: Axes, first: str, case: Case) -> None:
    """Two lines, small enough for the sheet's margin."""
    ax.set_title(f"{first}\n{case.label}", fontsize=9)


def _damping(solution: ForcedSolution) -> str:
    return f"{100.0 * solution.plan.scene.excitation.damping:g} %"


def state_figure(solution: ForcedSolution, case: Case, side: Any, ax: Axes | None = None) -> Axes:
    """Share of the cycle that one face sticks, slips and is lifted off, stacked over frequency."""
    ax = own_axes(ax)
    share = 100.0 * measures.shares(case.answer, solution.models[case.stiffness])[side]
    f = case.answer.frequency
    turns = len(f) > 1 and not ((np.diff(f) > 0.0).all() or (np.diff(f) < 0.0).all())
    # A path that turns back has several states at one frequency: they are drawn one after the other.
    x = np.arange(len(f)) if turns else f
    ax.stackplot(x, share.T, colors=(STICK, SLIP, LIFT), labels=("stick", "slip", "lift-off"))
    ax.set(xlabel="frequency along the path, Hz" if turns else "frequency, Hz", ylabel="share of the cycle, %", ylim=(0, 100))
    ax.set_xlim(min(x[0], x[-1]), max(x[0], x[-1]))
    if turns:
        ax.xaxis.set_major_locator(FixedLocator(np.linspace(0, len(f) - 1, 6).tolist()))
        ax.xaxis.set_major_formatter(FuncFormatter(lambda place, _: f"{np.interp(place, x, f):.1f}"))
    _title(ax, f"{side} face", case)
    ax.legend(fontsize=7, loc="lower right")
    return ax


def map_figure(solution: ForcedSolution, case: Case, side: Any, i: int, ax: Axes | None = None) -> Axes:
    """Contact points of one face at the peak: sectors of stick, slip and lift-off, size by the friction loss."""
    ax = own_axes(ax)
    model, answer = solution.models[case.stiffness], case.answer
    k = SIDES.index(side)
    on = np.flatnonzero(model.face == k)
    local = model.position[on] @ model.faces[side].frame.T
    y, up = local[:, 1], local[:, 2] - local[:, 2].min()
    # of all points, so that rounding on a face that sticks does not show
    most = float(answer.energy[i].max())
    size = 40.0 + 220.0 * np.maximum(answer.energy[i, on], 0.0) / most if most > 0.0 else np.full(len(on), 40.0)
    for p, (a, b, s) in enumerate(zip(y, up, size, strict=True)):
        _sectors(ax, a, b, s, answer.state[i, on[p]])
    ax.margins(0.12, 0.45)
    ax.set(xlabel="along the damper y, mm", ylabel="up the slope, mm")
    _title(ax, f"{side} face at {answer.frequency[i]:.1f} Hz", case)
    marks = [Line2D([], [], marker="o", ls="", color=c, label=t) for c, t in ((STICK, "stick"), (SLIP, "slip"), (LIFT, "lift-off"))]
    ax.legend(
        handles=marks, fontsize=7, title="sector: share of the cycle\nsize: friction loss", title_fontsize=7, loc="upper right", ncols=3
    )
    return ax


def _sectors(ax: Axes, x: float, y: float, size: float, share: Any) -> None:
    """A pie of shares drawn as markers, so that it stays round on any axes."""
    begin = 0.25
    for part, color in zip(share, (STICK, SLIP, LIFT), strict=True):
        if part > 0.0:
            angle = 2 * np.pi * np.linspace(begin, begin - part, 40)
            rim = np.column_stack([np.cos(angle), np.sin(angle)])
            marker = rim if part == 1.0 else np.vstack([[0.0, 0.0], rim])
            ax.scatter(x, y, s=size * float(np.abs(marker).max()) ** 2, marker=Outline(marker), facecolor=color, lw=0)
        begin -= float(part)


def loops_figure(solution: ForcedSolution, case: Case, i: int, ax: Axes | None = None) -> Axes:
    """Hysteresis loops of the points that lose most, at the peak."""
    ax = own_axes(ax)
    model, answer = solution.models[case.stiffness], case.answer
    for k, loop in enumerate(measures.loops(answer, i, N_LOOPS)):
        closed = np.append(np.arange(len(loop.displacement)), 0)
        side = SIDES[model.face[loop.point]]
        heights = model.position @ model.faces[side].frame[2]
        up = heights[loop.point] - heights[model.face == model.face[loop.point]].min()
        label = f"{side}, y {model.position[loop.point, 1] + 0.0:.1f}, up {up:.1f} mm: {loop.energy:.3g} N mm"
        ax.plot(1e3 * loop.displacement[closed], loop.traction[closed], color=_CURVES[k], lw=1.3, label=label)
    ax.set(xlabel="sliding displacement, µm", ylabel="friction force, N")
    _title(ax, f"loops at {answer.frequency[i]:.1f} Hz", case)
    ax.grid(alpha=0.3)
    if ax.get_lines():
        ax.legend(fontsize=7, loc="upper left")
    else:
        ax.text(0.5, 0.5, "no point slides", transform=ax.transAxes, ha="center", color=_GREY)
    ax.margins(y=0.25)
    return ax


def motion_figure(solution: ForcedSolution, case: Case, rotation: bool, ax: Axes | None = None) -> Axes:
    """The damper's six degrees of freedom over frequency: amplitudes of the first harmonic."""
    ax = own_axes(ax)
    q, f = solution.models[case.stiffness].damper_dofs(case.answer.coefficients), case.answer.frequency
    o = case.answer.harmonics.offset
    amplitude = 1e3 * np.hypot(q[:, :, o], q[:, :, o + 1])
    names = ("about x", "about y", "about z") if rotation else ("x, across the blades", "y, along the damper", "z, radial")
    part = amplitude[:, 3:] if rotation else amplitude[:, :3]
    for k, name in enumerate(names):
        # motions that symmetry forbids are rounding
        if part[:, k].max() > np.sqrt(np.finfo(float).eps) * part.max():
            ax.plot(f, part[:, k], color=_CURVES[k], lw=1.3, label=name)
    ax.set(xlabel="frequency, Hz", ylabel="rotation, mrad" if rotation else "translation, µm")
    _title(ax, "damper", case)
    ax.grid(alpha=0.3)
    ax.legend(fontsize=7)
    return ax


def local_figure(found: list[Local], title: str, ax: Axes | None = None) -> Axes:
    """Peaks followed again with one choice changed."""
    ax = own_axes(ax)
    good = [one for one in found if np.isfinite(one.height)]
    ax.plot([one.choice for one in good], [one.height for one in good], "o-", color=_CURVES[0])
    for one in good:
        ax.annotate(f"{one.frequency:.2f} Hz", (one.choice, one.height), (5, 5), textcoords="offset points", fontsize=7)
    ax.set(ylabel="peak accelerance, (m/s²)/N", title=title)
    ax.margins(0.15, 0.25)
    ax.grid(alpha=0.3)
    return ax


def save_figures(solution: ForcedSolution, folder: Path) -> list[Path]:
    """Write the figures the solution has data for as PNG. Returns their paths."""
    scene, cases = solution.plan.scene, [c for c in solution.cases if not c.empty]
    at = [(c, i) for c in cases for _, i in measures.at_peaks(c.answer, c.accelerance["right"])]
    # where every point sticks over the whole cycle there is nothing to see
    moving = [c for c in cases if c.answer.state[..., 0].min() < 1.0] or cases[:1]
    sliding = [(c, i) for c, i in at if c.answer.state[i, :, 1].max() > 0.0] or at[:1]
    sheets: dict[str, list[Drawing]] = {}
    if solution.linear:
        both = [(name, side) for name in solution.linear for side in ("right", "left")]
        sheets["response"] = [lambda ax, n=n, s=s: response_figure(solution, s, n, ax) for n, s in both]  # type: ignore[misc]
    if scene.wants("contact_state"):
        faces = [(c, side) for c in moving for side in SIDES]
        sheets["contact_state"] = [lambda ax, c=c, s=s: state_figure(solution, c, s, ax) for c, s in faces]  # type: ignore[misc]
        sheets["contact_map"] = [lambda ax, c=c, s=s, i=i: map_figure(solution, c, s, i, ax) for c, i in sliding for s in SIDES]  # type: ignore[misc]
    if scene.wants("hysteresis") and scene.contact.friction > 0.0:
        sheets["hysteresis"] = [lambda ax, c=c, i=i: loops_figure(solution, c, i, ax) for c, i in sliding]  # type: ignore[misc]
    if scene.wants("damper_motion"):
        sheets["damper_motion"] = [lambda ax, c=c, r=r: motion_figure(solution, c, r, ax) for c in cases for r in (False, True)]  # type: ignore[misc]
    if solution.spreads:
        sheets["spread"] = [lambda ax, n=n, v=v: local_figure(v, f"slider starts, {n}", ax) for n, v in solution.spreads.items()]  # type: ignore[misc]
    if solution.harmonics:
        sheets["harmonics"] = [lambda ax, n=n, v=v: local_figure(v, f"harmonics kept, {n}", ax) for n, v in solution.harmonics.items()]  # type: ignore[misc]
    curves = [(n, c) for n, c in solution.performances.items() if any(len(b.ratio) for b in c.branches)]
    if curves:
        from upd.analyses.forced.performance_plots import performance_figure

        sheets["performance"] = [lambda ax, n=n, c=c: performance_figure(n, c, ax) for n, c in curves]  # type: ignore[misc]
    return [path for name, drawings in sheets.items() for path in write_sheet(folder / f"{name}.png", drawings, 2, (6.4, 4.4))]
