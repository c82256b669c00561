"""Figures of a contact run: axes in, axes out; `save_figures` writes the PNG files of a run folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Circle

from upd.analyses.hertz.results import closed_form_traction, hertz_of, shear_compliance
from upd.analyses.hertz.solve import Cycle, HertzSolution, NormalCase, TangentialCase
from upd.plot.sheet import CLOSED, OPEN, OURS, SLIP, STICK, THESIS, Drawing, own_axes, state_legend, write_sheet
from upd.reference import hertz_pressure, mindlin

UM = 1e3


def _lattice(solution: HertzSolution, half_width: float) -> tuple[Any, Any, tuple[slice, slice]]:
    """Lattice lines in um around the contact, and the slices that cut them out of whole-patch arrays."""
    patch = solution.model.patch
    cut = []
    for lines in (patch.X, patch.Y):
        inside = np.flatnonzero(np.abs(lines) <= half_width)
        cut.append(slice(int(inside[0]), int(inside[-1]) + 1))
    return patch.X[cut[0]] * UM, patch.Y[cut[1]] * UM, (cut[0], cut[1])


def _view(solution: HertzSolution, case: NormalCase) -> float:
    """Half width in mm of the window around a contact."""
    return max(1.3 * case.measures.radius_outermost, 3.0 * solution.model.patch.spacing)


def _circle(ax: Axes, radius: float, label: str, style: str = "-") -> None:
    ax.add_patch(Circle((0.0, 0.0), radius * UM, fill=False, color="k", lw=1.2, ls=style, label=label))


def pressure_map(solution: HertzSolution, case: NormalCase, ax: Axes | None = None) -> Axes:
    """Contact pressure on the patch with Hertz's circle."""
    ax = own_axes(ax)
    x, y, cut = _lattice(solution, _view(solution, case))
    p = np.where(case.force[cut] > 0.0, case.pressure[cut], np.nan)
    image = ax.pcolormesh(x, y, p.T, cmap="viridis", shading="nearest", vmin=0.0)
    ax.figure.colorbar(image, ax=ax, label="pressure p, MPa", shrink=0.85)
    hertz = hertz_of(solution, case.load)
    if hertz is not None:
        _circle(ax, hertz.radius, f"Hertz, a = {hertz.radius * UM:.1f} µm")
        ax.legend(loc="upper right", fontsize=8)
    ax.set(title=f"{case.label}: pressure", xlabel="x, µm", ylabel="y, µm", aspect="equal")
    return ax


def pressure_section(solution: HertzSolution, cases: list[NormalCase], ax: Axes | None = None) -> Axes:
    """Pressure along y = 0 beside Hertz's."""
    ax = own_axes(ax)
    patch = solution.model.patch
    j = len(patch.Y) // 2
    widest = max(_view(solution, c) for c in cases)
    for k, case in enumerate(cases):
        colour = f"C{k}"
        inside = np.abs(patch.X) <= widest
        ax.plot(patch.X[inside] * UM, case.pressure[inside, j], "o", ms=4, color=colour, label=f"{case.label}, computed")
        hertz = hertz_of(solution, case.load)
        if hertz is not None:
            r = np.linspace(-hertz.radius, hertz.radius, 401)
            ax.plot(
                r * UM, hertz_pressure(np.abs(r), hertz.radius, hertz.max_pressure), "-", lw=1.2, color=colour, label=f"{case.label}, Hertz"
            )
    ax.set(title="Pressure along y = 0", xlabel="x, µm", ylabel="pressure p, MPa", ylim=(0.0, None))
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8)
    return ax


def stick_slip_map(solution: HertzSolution, case: TangentialCase, ax: Axes | None = None) -> Axes:
    """Sticking, slipping and open nodes with the closed form's circles."""
    ax = own_axes(ax)
    x, y, cut = _lattice(solution, _view(solution, case.normal))
    state = np.where(case.normal.force[cut] > 0.0, np.where(case.stick[cut], 2, 1), 0)
    ax.pcolormesh(x, y, state.T, cmap=ListedColormap([OPEN, SLIP, STICK]), vmin=0, vmax=2, shading="nearest", edgecolors="white", lw=0.2)
    hertz = hertz_of(solution, case.normal.load)
    if hertz is not None:
        mu = solution.plan.scene.contact.friction
        _circle(ax, hertz.radius, "a")
        _circle(ax, float(mindlin.stick_radius(case.load, mu, case.normal.load, hertz.radius)), "c", "--")
    ax.set(title=f"{case.normal.label}, T/µN = {case.ratio:g}", xlabel="x, µm", ylabel="y, µm", aspect="equal")
    return ax


def traction_section(solution: HertzSolution, cases: list[TangentialCase], ax: Axes | None = None) -> Axes:
    """Tangential traction along y = 0 beside Cattaneo and Mindlin's."""
    ax = own_axes(ax)
    patch = solution.model.patch
    j = len(patch.Y) // 2
    for k, case in enumerate(cases):
        inside = np.abs(patch.X) <= _view(solution, case.normal)
        ours = case.traction[..., 0] if case.traction.ndim == 3 else case.traction
        ax.plot(patch.X[inside] * UM, ours[inside, j], "o", ms=3.5, color=f"C{k}", label=f"T/µN = {case.ratio:g}")
        closed = closed_form_traction(solution, case)
        if closed is not None:
            r = np.linspace(patch.X[inside][0], patch.X[inside][-1], 801)
            ax.plot(r * UM, closed(np.abs(r)), "-", lw=1.2, color=f"C{k}")
    ax.set(title=f"{cases[0].normal.label}: traction along y = 0 (lines: Cattaneo-Mindlin)", xlabel="x, µm", ylabel="traction, MPa")
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8)
    return ax


def force_approach(solution: HertzSolution, ax: Axes | None = None) -> Axes:
    """Normal force over approach: computed, Hertz, and computed with the finite bodies taken off."""
    ax = own_axes(ax)
    d, F = np.array(solution.curve).T
    ax.plot(d * UM, F, "o-", ms=4, color=OURS, label="computed, distant set to distant set")
    hertz = [hertz_of(solution, load) for load in F[1:]]
    if all(h is not None for h in hertz):
        ax.plot([0.0, *(h.approach * UM for h in hertz if h)], F, "-", color=CLOSED, lw=1.2, label="Hertz")
    shares = [(c.load, sum(s.finite_body for s in c.shares.values())) for c in solution.normal if c.shares]
    if shares:
        per_newton = shares[-1][1] / shares[-1][0]
        ax.plot((d - per_newton * F) * UM, F, "x", ms=5, color=THESIS, label="computed, finite bodies taken off")
    ax.set(title="Force over approach", xlabel="approach δ, µm", ylabel="normal force F, N", xlim=(0, None), ylim=(0, None))
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8)
    return ax


def hysteresis(solution: HertzSolution, cycle: Cycle, ax: Axes | None = None) -> Axes:
    """Hysteresis loop beside Mindlin and Deresiewicz's, body shear taken off."""
    ax = own_axes(ax)
    N = cycle.normal.load
    mu = solution.plan.scene.contact.friction
    shares = solution.tangential_shares.get(N, {})
    bodies = sum(s.finite_body for s in shares.values())
    ax.plot(
        (cycle.displacement - bodies * cycle.load) * UM,
        cycle.load,
        ".",
        ms=3,
        color=OURS,
        label="computed, body shear taken off" if shares else "computed, with the bodies",
    )
    hertz = hertz_of(solution, N)
    if hertz is not None:
        C = shear_compliance(solution)
        peak = cycle.ratio * mu * N
        T = np.linspace(-peak, peak, 201)
        unloading = mindlin.unloading(T, peak, mu, N, hertz.radius, C)
        for sign, label in ((1.0, "Mindlin-Deresiewicz"), (-1.0, None)):
            ax.plot(sign * unloading * UM, sign * T, "-", lw=1.2, color=CLOSED, label=label)
    ax.set(
        title=f"{cycle.normal.label}: cycle to T*/µN = {cycle.ratio:g}",
        xlabel="tangential displacement, µm",
        ylabel="tangential force T, N",
    )
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8)
    return ax


def approach_split(solution: HertzSolution, ax: Axes | None = None) -> Axes:
    """Share of the approach near the contact and in each body beyond depth 3a, in per cent (thesis, figure 50)."""
    ax = own_axes(ax)
    cases = [c for c in solution.normal if c.shares]
    for k, case in enumerate(cases):
        bodies = {f"{body} beyond 3a": s.compression for body, s in case.shares.items()}
        parts = {"within 3a of the contact": case.approach - sum(bodies.values()), **bodies}
        left = 0.0
        for colour, (label, value) in zip(("#2b6cb0", "#d98032", "#5a8f4a"), parts.items(), strict=True):
            width = 100.0 * value / case.approach
            ax.barh(k, width, left=left, height=0.55, color=colour, label=label if k == 0 else None)
            ax.text(left + width / 2, k, f"{value * UM:.3g} µm", ha="center", va="center", color="white", fontsize=8)
            left += width
    ax.set(yticks=range(len(cases)), yticklabels=[c.label for c in cases], xlabel="share of the approach, %", ylim=(-0.5, len(cases) + 0.3))
    ax.set_title("Approach: near the contact and in the bodies")
    ax.legend(fontsize=8, loc="upper center", ncols=3, frameon=False)
    return ax


def save_figures(solution: HertzSolution, folder: Path) -> list[Path]:
    """Write the figures the solution has data for as PNG. Returns their paths."""
    loaded = [c for c in solution.normal if c.load > 0.0]
    made: list[Path] = []

    def sheet(name: str, drawings: list[Drawing], columns: int, size: tuple[float, float] = (5.6, 4.4)) -> None:
        made.extend(write_sheet(folder / f"{name}.png", drawings, columns, size))

    if loaded:
        maps: list[Drawing] = [lambda ax, c=c: pressure_map(solution, c, ax) for c in loaded[-2:]]  # type: ignore[misc]
        sheet("pressure", [*maps, lambda ax: pressure_section(solution, loaded, ax)], 3)
    if solution.curve:
        split = [lambda ax: approach_split(solution, ax)] if any(c.shares for c in loaded) else []
        sheet("force_approach", [lambda ax: force_approach(solution, ax), *split], 2)
    if solution.tangential:
        states: list[Drawing] = [lambda ax, t=t: stick_slip_map(solution, t, ax) for t in solution.tangential]  # type: ignore[misc]
        first = states[0]
        states[0] = lambda ax: state_legend(first(ax))
        sheet("stick_slip", states, max(1, len(solution.plan.scene.loads.tangential)), (3.6, 3.6))
        by_load = [[t for t in solution.tangential if t.normal is c] for c in loaded]
        sheet("traction", [lambda ax, ts=ts: traction_section(solution, ts, ax) for ts in by_load if ts], 2)  # type: ignore[misc]
    sheet("hysteresis", [lambda ax, c=c: hysteresis(solution, c, ax) for c in solution.cycles], 2)  # type: ignore[misc]
    return made
