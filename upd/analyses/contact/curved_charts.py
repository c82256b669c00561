"""Charts of a curved contact, from the run folder's content alone.

Computed fields beside the closed forms that lie there too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from upd.analyses.contact.charts import (
    X_UM,
    Y_UM,
    approach_charts,
    by_case,
    loaded_cases,
    path_trace,
    state_charts,
    values,
    window,
)
from upd.plot.chart import Array, Arrays, Axis, Bars, Chart, Group, Style, Trace
from upd.plot.common import UM, case_of, circle, cut, pressure_map, scalar, with_content

# Maps of the pressure on the sheet: those of the largest loads.
_SHOWN = 2
# Points of a closed form across a contact, whose ends are steep.
_ACROSS = 401
_PRESSURE = Axis("pressure", "MPa", low=0.0)
# Lattice lines of the sections, in half radii from the middle.
_SECTIONS: tuple[tuple[float, int, Style], ...] = (
    (0.0, 0, "points"),
    (1.0, 1, "open points"),
    (-1.0, 1, "crosses"),
)


def curved_charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Pressure, stick and slip, traction, force over approach, hysteresis.

    Each with its closed form where there is one.
    """
    del summary
    normal = loaded_cases(arrays)
    loaded = [group for (group,) in normal.values()]
    tangential = [group for (group,) in by_case(arrays, "tangential").values()]
    by_load = [[t for t in tangential if case_of(t).load == case_of(n).load] for n in loaded]
    return [
        *(_pressure(group, sheet=k < _SHOWN) for k, group in enumerate(reversed(loaded))),
        *([_pressure_section(loaded)] if loaded else []),
        *(_three_sections(group) for group in reversed(loaded)),
        *state_charts(arrays, normal, curved=True),
        *(
            _tractions(n, sheared)
            for n, sheared in zip(reversed(loaded), reversed(by_load), strict=True)
            if sheared
        ),
        *approach_charts(arrays),
        *_split(loaded),
        *_over_load(arrays),
        *(_loop(group) for group in reversed(with_content(arrays, "cycle"))),
    ]


def _middle(field: Array) -> Array:
    """The field along y = 0."""
    return field[:, field.shape[1] // 2]


def _pressure(group: Group, sheet: bool) -> Chart:
    whole, half, a = pressure_map(group, UM), window(group), scalar(group, "hertz_radius")
    return Chart(
        "Contact pressure",
        X_UM,
        Y_UM,
        (circle(a * UM, f"Hertz, a = {a * UM:.1f} µm"),) if a else (),
        (cut(whole, half, half),),
        case_of(group).label,
        "pressure",
        equal=True,
        sheet=sheet,
        columns=3,
    )


def _pressure_section(loaded: Sequence[Group]) -> Chart:
    traces: list[Trace] = []
    widest = max(window(group) for group in loaded)
    for k, group in enumerate(loaded):
        x, p, case = values(group, "x", UM), values(group, "pressure"), case_of(group).label
        inside = np.abs(x) <= widest
        traces.append(Trace(f"{case}, computed", x[inside], _middle(p)[inside], "points", k))
        if "hertz_pressure" in group:
            closed = values(group, "hertz_x", UM), values(group, "hertz_pressure")
            traces.append(Trace(f"{case}, Hertz", *closed, "line", k))
    title = "Pressure along y = 0"
    return Chart(title, X_UM, _PRESSURE, tuple(traces), figure="pressure", columns=3)


def _three_sections(group: Group) -> Chart:
    """Pressure along the middle and along the lattice lines nearest to half a radius from it, as
    the thesis cuts it (its Figures 41 and 42).
    """
    x, y, p = values(group, "x", UM), values(group, "y", UM), values(group, "pressure")
    a, p0, half = scalar(group, "hertz_radius"), scalar(group, "hertz_max_pressure"), window(group)
    inside = np.abs(x) <= half
    off = 0.5 * (a * UM if a else half / 1.3)
    traces: list[Trace] = []
    for at, colour, style in _SECTIONS:
        j = int(np.abs(y - at * off).argmin())
        label = f"y = {y[j]:.0f} µm"
        traces.append(Trace(f"{label}, computed", x[inside], p[inside, j], style, colour))
        # The closed form is even in y.
        if a and p0 and at >= 0.0:
            reach = np.sqrt(max(0.0, (a * UM) ** 2 - y[j] ** 2))
            along = np.linspace(-reach, reach, _ACROSS)
            squared = np.maximum(0.0, 1.0 - (along**2 + y[j] ** 2) / (a * UM) ** 2)
            closed, entry = p0 * np.sqrt(squared), "lines: Hertz"
            traces.append(Trace(f"{label}, Hertz", along, closed, "line", colour, entry=entry))
    title, case = "Pressure at three sections", case_of(group).label
    return Chart(title, X_UM, _PRESSURE, tuple(traces), case=case, figure="pressure_sections")


def _over_load(arrays: Arrays) -> list[Chart]:
    """Contact area, largest pressure and the bodies' compression over the load (thesis, Figures 43,
    44 and 50).
    """
    out = []
    axis = Axis("normal force F", "N", low=0.0)
    more: dict[str, Any] = {"figure": "over_load", "columns": 3}
    for group in (g for g in with_content(arrays, "force-approach") if "load" in g):
        F = values(group, "load")
        for title, name, mine, unit, scale in (
            ("Contact area", "area", "contact_area", "µm²", UM**2),
            ("Largest pressure", "max_pressure", "max_pressure", "MPa", 1.0),
        ):
            traces = [Trace("computed", F, values(group, mine, scale), "points", 0)]
            if f"hertz_{name}" in group:
                closed = values(group, "hertz_normal_force"), values(group, f"hertz_{name}", scale)
                traces.append(Trace("Hertz", *closed, closed=True))
            ordinate = Axis(title.lower(), unit, low=0.0)
            out.append(Chart(f"{title} over load", axis, ordinate, tuple(traces), **more))
        bodies = _compressions(group, F)
        if bodies:
            top = 1.4 * max(float(t.y.max()) for t in bodies)
            ordinate = Axis("share of the approach beyond 3a", "%", low=0.0, high=top)
            out.append(Chart("Compression of the bodies over load", axis, ordinate, bodies, **more))
    return out


def _compressions(group: Group, F: Array) -> tuple[Trace, ...]:
    """What lies beyond depth 3a in each body, per cent of the approach; half-spaces have it too."""
    approach = values(group, "loaded_approach")
    traces: list[Trace] = []
    for colour, (name, v) in enumerate(n for n in group.items() if "body" in n[1].attributes):
        share = 100.0 * values(group, name) / approach
        traces.append(Trace(str(v.attributes["body"]), F, share, "both", colour))
        if f"hertz_{name}" in group:
            # Hertz's approach goes with F^(2/3): straight in it, so interpolation is exact.
            points = values(group, "hertz_normal_force") ** (2.0 / 3.0)
            total = np.interp(F ** (2.0 / 3.0), points, values(group, "hertz_approach"))
            closed = 100.0 * values(group, f"hertz_{name}") / total
            label = f"{v.attributes['body']}, half-space"
            traces.append(Trace(label, F, closed, closed=True, entry="half-space"))
    return tuple(traces)


def _tractions(normal: Group, tangential: Sequence[Group]) -> Chart:
    computed: list[Trace] = []
    closed: list[Trace] = []
    half, lines = window(normal), "lines: Cattaneo-Mindlin"
    for k, group in enumerate(tangential):
        x, q = values(group, "x", UM), values(group, "traction")
        inside, name = np.abs(x) <= half, f"T/µN={case_of(group).ratio:g}"
        along = _middle(q[..., 0] if q.ndim == 3 else q)[inside]
        computed.append(Trace(f"{name}, computed", x[inside], along, "points", k, entry=name))
        if "mindlin_traction" in group:
            at, y = values(group, "mindlin_x", UM), values(group, "mindlin_traction")
            near, label = np.abs(at) <= half, f"{name}, Cattaneo-Mindlin"
            closed.append(Trace(label, at[near], y[near], "line", k, entry=lines))
    traces, case = (*computed, *closed), case_of(normal).label
    # Room for the legend above the curves.
    ordinate = Axis("traction", "MPa", high=1.45 * float(max(t.y.max() for t in traces)) or None)
    title = "Tangential traction along y = 0"
    return Chart(title, X_UM, ordinate, traces, case=case, figure="traction")


def _split(loaded: Sequence[Group]) -> list[Chart]:
    """Share of the approach near the contact and in each body beyond depth 3a."""
    groups = [group for group in loaded if "finite_body" in group]
    if not groups:
        return []
    approach = np.array([float(group["approach"].data) for group in groups])
    beyond = {
        f"{v.attributes['body']} beyond 3a": np.array([float(g[name].data) for g in groups])
        for name, v in groups[0].items()
        if "body" in v.attributes
    }
    lengths = {"within 3a of the contact": approach - sum(beyond.values())} | beyond
    bars = Bars(
        tuple(case_of(group).label for group in groups),
        {label: 100.0 * v / approach for label, v in lengths.items()},
        {label: tuple(f"{one * UM:.3g} µm" for one in v) for label, v in lengths.items()},
    )
    title = "Approach: near the contact and in the bodies"
    axes = Axis("share of the approach", "%"), Axis("")
    return [Chart(title, *axes, bars=(bars,), figure="force_approach")]


def _loop(group: Group) -> Chart:
    bodies = scalar(group, "finite_body_compliance")
    label = "computed, with the bodies" if bodies is None else "computed, bulk compliance removed"
    traces = [path_trace(label, group, 0, compliance=bodies or 0.0)]
    if "mindlin_force" in group:
        d, T = values(group, "mindlin_displacement", UM), values(group, "mindlin_force")
        traces.append(Trace("Mindlin-Deresiewicz", d, T, "dashed", closed=True))
    axes = Axis("tangential displacement", "µm"), Axis("tangential force T", "N")
    return Chart("Hysteresis", *axes, tuple(traces), case=case_of(group).label, figure="hysteresis")
