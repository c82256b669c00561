"""Figures of a flat contact: axes in, axes out; `save_figures` writes the PNG files of a run folder. Lengths in report axes, mm."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Rectangle

from upd.analyses.flat.maps import contact_law, corner, lattices, line_pressure
from upd.analyses.flat.results import band_centres, thesis_value
from upd.analyses.flat.solve import FlatSolution, NormalCase, TangentialCase, direction_name
from upd.contact.law import ContactLaw
from upd.plot.sheet import CLOSED, OPEN, OURS, SLIP, STICK, THESIS, Drawing, own_axes, state_legend, write_sheet

UM = 1e3


def _frame(solution: FlatSolution, ax: Axes, title: str) -> Axes:
    origin = corner(solution)
    for k in lattices(solution):
        place = (float(k.X[0] - origin[0]), float(k.Y[0] - origin[1]))
        ax.add_patch(Rectangle(place, float(np.ptp(k.X)), float(np.ptp(k.Y)), fill=False, color="#555555", lw=0.8))
    ax.set(title=title, xlabel="x, along the damper, mm", ylabel="y, up the slope, mm", aspect="equal")
    return ax


def pressure_map(solution: FlatSolution, case: NormalCase, ax: Axes | None = None) -> Axes:
    """Contact pressure on all patches; the scale ends at the 99th percentile, beyond which it is the edge's."""
    ax = own_axes(ax)
    origin, weights = corner(solution), solution.model.multipliers.weights
    p = case.solution.force / weights
    top = float(np.percentile(p, 99.0))
    for k in lattices(solution):
        shown = k.field(p)
        image = ax.pcolormesh(
            k.X - origin[0], k.Y - origin[1], np.where(shown > 0.0, shown, np.nan).T, cmap="viridis", shading="nearest", vmin=0.0, vmax=top
        )
    ax.figure.colorbar(image, ax=ax, label="pressure p, MPa", location="bottom", pad=0.22, aspect=40, extend="max")
    return _frame(solution, ax, f"{case.label}: pressure (largest {p.max():.3g} MPa)")


def line_pressure_plot(solution: FlatSolution, cases: list[NormalCase], ax: Axes | None = None) -> Axes:
    """Force per length along the damper, with the middles of the zones the load comes from."""
    ax = own_axes(ax)
    left = corner(solution)[0]
    for i, case in enumerate(cases):
        for k in lattices(solution):
            label = case.label if k is lattices(solution)[0] or k.name == lattices(solution)[0].name else None
            ax.plot(k.X - left, line_pressure(k, case.solution.force), "o-", ms=3, color=f"C{i}", label=label)
    for j, centre in enumerate(band_centres(solution)):
        ax.axvline(centre - left, color=THESIS, ls="--", lw=1, label="middle of the loaded zones" if j == 0 else None)
    ax.set(title="Normal force per length", xlabel="x, along the damper, mm", ylabel="N/mm", ylim=(0.0, None))
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8)
    return ax


def contact_open_map(solution: FlatSolution, case: NormalCase, ax: Axes | None = None) -> Axes:
    """Nodes inside and outside the contact."""
    ax = own_axes(ax)
    origin = corner(solution)
    for k in lattices(solution):
        closed = k.field(case.solution.contact) > 0.0
        x, y = np.meshgrid(k.X - origin[0], k.Y - origin[1], indexing="ij")
        ax.plot(x[closed], y[closed], "o", ms=2.5, color=STICK, label="in contact" if k is lattices(solution)[0] else None)
        ax.plot(x[~closed], y[~closed], "x", ms=4, color=THESIS)
    n = sum(int((k.field(case.solution.contact) > 0.0).sum()) for k in lattices(solution))
    whole = sum(k.X.size * k.Y.size for k in lattices(solution))
    told = "nothing opens: the linear answer is exact" if n == whole else "x: open"
    return _frame(solution, ax, f"{case.label}: {n} of {whole} nodes in contact ({told})")


def surface_map(solution: FlatSolution, case: NormalCase, ax: Axes | None = None) -> Axes:
    """Deformed contact surface of the damper: how far its nodes stay behind its distant set."""
    ax = own_axes(ax)
    origin, model = corner(solution), solution.model
    u = model.multipliers.spread.T @ case.displacement[model.upper.name][model.upper.contact, 2]
    for k in lattices(solution):
        shown = UM * k.field(u)
        image = ax.pcolormesh(
            k.X - origin[0], k.Y - origin[1], shown.T, cmap="magma", shading="gouraud", vmin=UM * float(u.min()), vmax=UM * float(u.max())
        )
    ax.figure.colorbar(image, ax=ax, label="displacement along the normal, µm", location="bottom", pad=0.22, aspect=40)
    return _frame(solution, ax, f"{case.label}: deformed surface of the {model.upper.name}")


def force_approach(solution: FlatSolution, ax: Axes | None = None) -> Axes:
    """F_N over approach, with the thesis's slope."""
    ax = own_axes(ax)
    F = np.array([0.0, *(F for F, _ in solution.curve)])
    d = UM * np.array([0.0, *(s.approach for _, s in solution.curve)])
    ax.plot(d, F, "o-", ms=4, color=OURS, label=f"computed, K_N = {solution.normal[0].stiffness:.3g} N/mm")
    reference, source = thesis_value(solution, "K_N")
    if reference:
        ax.plot(UM * F / reference, F, "--", color=THESIS, label=f"{source}: {reference:.3g} N/mm")
    ax.set(title="Normal force over approach", xlabel="approach δ, µm", ylabel="F_N, N", xlim=(0, None), ylim=(0, None))
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8)
    return ax


def pressure_over_force(solution: FlatSolution, ax: Axes | None = None) -> Axes:
    """Maximum and mean pressure over the normal force."""
    ax = own_axes(ax)
    weights = solution.model.multipliers.weights
    F = [F for F, _ in solution.curve]
    ax.plot(
        F,
        [float((s.force / weights).max()) for _, s in solution.curve],
        "o-",
        ms=4,
        color=OURS,
        label="maximum (at an edge)",
    )
    mean = [float(s.force.sum() / weights[s.contact].sum()) for _, s in solution.curve]
    ax.plot(F, mean, "s-", ms=4, color=CLOSED, label="mean over the contact")
    ax.set(title="Pressure over normal force", xlabel="F_N, N", ylabel="pressure, MPa", xlim=(0, None), ylim=(0, None))
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8)
    return ax


def stick_slip_map(solution: FlatSolution, t: TangentialCase, ax: Axes | None = None) -> Axes:
    """Sticking, slipping and open nodes."""
    ax = own_axes(ax)
    origin = corner(solution)
    closed = t.normal.solution.force > 0.0
    state = np.where(closed, np.where(t.stick, 2, 1), 0)
    colours = ListedColormap([OPEN, SLIP, STICK])
    for k in lattices(solution):
        x, y = k.X - origin[0], k.Y - origin[1]
        ax.pcolormesh(x, y, k.field(state).T, cmap=colours, vmin=0, vmax=2, shading="nearest", edgecolors="w", lw=0.1)
    return _frame(solution, ax, f"{t.normal.label}, along {direction_name(t.direction)}, T/µN = {t.ratio:g}")


def force_displacement(solution: FlatSolution, direction: float, cycle: bool, ax: Axes | None = None) -> Axes:
    """F_T over displacement for every normal load along one direction."""
    ax = own_axes(ax)
    paths = [p for p in solution.paths if p.direction == direction and p.cycle == cycle]
    for i, p in enumerate(paths):
        ax.plot(UM * p.displacement, p.load, "o-" if not cycle else "-", ms=3, color=f"C{i}", label=p.normal.label)
        if not cycle:
            ax.axhline(solution.plan.scene.contact.friction * p.normal.force, color=f"C{i}", ls=":", lw=1)
    reference, source = thesis_value(solution, "K_T")
    if reference and not cycle and paths:
        top = 0.6 * max(float(p.load.max()) for p in paths)
        ax.plot([0.0, UM * top / reference], [0.0, top], "--", color=THESIS, label=f"{source}: {reference:.3g} N/mm")
    title = f"Tangential force along {direction_name(direction)}" + (" (cycle)" if cycle else " (dotted: µ F_N)")
    ax.set(title=title, xlabel="displacement, µm", ylabel="F_T, N")
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8)
    return ax


def law_map(solution: FlatSolution, case: NormalCase, law: ContactLaw, ax: Axes | None = None) -> Axes:
    """Contact points of the dynamic model; the area of a mark is its share of the normal stiffness."""
    ax = own_axes(ax)
    origin = corner(solution)
    share = law.k_n / law.k_n.max()
    marks = ax.scatter(law.position[:, 0] - origin[0], law.position[:, 1] - origin[1], s=20 + 160 * share, c=law.preload, cmap="viridis")
    ax.figure.colorbar(marks, ax=ax, label="preload, N", location="bottom", pad=0.22, aspect=40)
    return _frame(solution, ax, f"{case.label}: {law.n_point} contact points, k_n {law.k_n.sum():.3g} N/mm in all")


def save_figures(solution: FlatSolution, folder: Path) -> list[Path]:
    """Write the figures the solution has data for as PNG. Returns their paths."""
    loaded = [c for c in solution.normal if c.force > 0.0]
    made: list[Path] = []

    def sheet(name: str, drawings: list[Drawing], columns: int, size: tuple[float, float] = (7.2, 4.2)) -> None:
        made.extend(write_sheet(folder / f"{name}.png", drawings, columns, size))

    maps: list[Drawing] = [lambda ax, c=c: pressure_map(solution, c, ax) for c in loaded[:2]]  # type: ignore[misc]
    sheet("pressure", [*maps, lambda ax: line_pressure_plot(solution, loaded, ax)] if loaded else [], 3)
    sheet("contact_open", [lambda ax, c=c: contact_open_map(solution, c, ax) for c in loaded[:1]], 1)  # type: ignore[misc]
    sheet("surface", [lambda ax, c=c: surface_map(solution, c, ax) for c in loaded[:1] if c.displacement], 1)  # type: ignore[misc]
    if solution.curve:
        sheet("force_approach", [partial(force_approach, solution), partial(pressure_over_force, solution)], 2, (5.6, 4.4))
    first = [t for t in solution.tangential if loaded and t.normal is loaded[0]]
    states: list[Drawing] = [lambda ax, t=t: stick_slip_map(solution, t, ax) for t in first]  # type: ignore[misc]
    if states:
        plain = states[0]
        states[0] = lambda ax: state_legend(plain(ax))
    sheet("stick_slip", states, max(1, len(solution.plan.scene.loads.tangential)), (5.4, 3.0))
    kinds = dict.fromkeys((p.direction, p.cycle) for p in solution.paths)
    sheet("force_displacement", [lambda ax, d=d, c=c: force_displacement(solution, d, c, ax) for d, c in kinds], 2, (5.6, 4.4))  # type: ignore[misc]
    laws = [(c, contact_law(solution, c)) for c in loaded[:1]] if solution.plan.scene.wants("contact_law") else []
    sheet("contact_law", [lambda ax, c=c, law=law: law_map(solution, c, law, ax) for c, law in laws if law is not None], 1)  # type: ignore[misc]
    return made
