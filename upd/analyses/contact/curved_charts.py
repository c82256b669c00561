"""Charts of a curved contact, from the run folder's content alone.

Computed fields beside the closed forms that lie there too.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from upd.analyses.contact.charts import (
    APPROACH,
    FORCE,
    closed_nodes,
    from_zero,
    is_loaded,
    normal_of,
    path_trace,
    values,
)
from upd.plot.chart import Array, Arrays, Axis, Bars, Chart, Group, Style, Trace
from upd.plot.common import UM, case_of, circle, cut, pressure_map, scalar, state_map, with_content

_X, _Y = Axis("x", "µm"), Axis("y", "µm")
# Maps of the pressure on the sheet: those of the largest loads.
_SHOWN = 2
# Points of a closed form across a contact, whose ends are steep.
_ACROSS = 401


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Pressure, stick and slip, traction, force over approach, hysteresis.

    Each with its closed form where there is one.
    """
    del summary
    loaded = [group for group in with_content(arrays, "normal") if is_loaded(group)]
    tangential = [
        group
        for group in with_content(arrays, "tangential")
        if normal_of(arrays, group) is not None
    ]
    by_load = {
        case_of(n).label: [t for t in tangential if normal_of(arrays, t) is n] for n in loaded
    }
    return [
        *(_pressure(group, sheet=k < _SHOWN) for k, group in enumerate(reversed(loaded))),
        *([_pressure_section(loaded)] if loaded else []),
        *(_three_sections(group) for group in reversed(loaded)),
        *(
            _states(arrays, group, max(map(len, by_load.values())))
            for group in reversed(tangential)
        ),
        *(
            _tractions(n, by_load[case_of(n).label])
            for n in reversed(loaded)
            if by_load[case_of(n).label]
        ),
        *_approach(arrays),
        *_split(loaded),
        *_over_load(arrays),
        *(_loop(group) for group in reversed(with_content(arrays, "cycle"))),
    ]


def _window(normal: Group) -> float:
    """Half width in um of the window around a contact."""
    x, y = values(normal, "x", UM), values(normal, "y", UM)
    reach = np.hypot(*np.meshgrid(x, y, indexing="ij"))[closed_nodes(normal)].max(initial=0.0)
    return max(1.3 * float(reach), 3.0 * float(max(np.diff(x).max(), np.diff(y).max())))


def _middle(field: Array) -> Array:
    """The field along y = 0."""
    return field[:, field.shape[1] // 2]


def _pressure(group: Group, sheet: bool) -> Chart:
    whole, half, a = pressure_map(group, UM), _window(group), scalar(group, "hertz_radius")
    rim = (circle(a * UM, f"Hertz, a = {a * UM:.1f} µm"),) if a else ()
    return Chart(
        "Contact pressure",
        _X,
        _Y,
        rim,
        (cut(whole, half, half),),
        case_of(group).label,
        "pressure",
        equal=True,
        sheet=sheet,
        columns=3,
    )


def _pressure_section(loaded: list[Group]) -> Chart:
    traces: list[Trace] = []
    widest = max(_window(group) for group in loaded)
    for k, group in enumerate(loaded):
        x, case = values(group, "x", UM), case_of(group).label
        inside = np.abs(x) <= widest
        traces.append(
            Trace(
                f"{case}, computed",
                x[inside],
                _middle(values(group, "pressure"))[inside],
                "points",
                k,
            )
        )
        if "hertz_pressure" in group:
            traces.append(
                Trace(
                    f"{case}, Hertz",
                    values(group, "hertz_x", UM),
                    values(group, "hertz_pressure"),
                    "line",
                    k,
                )
            )
    ordinate = Axis("pressure", "MPa", low=0.0)
    return Chart("Pressure along y = 0", _X, ordinate, tuple(traces), figure="pressure", columns=3)


def _three_sections(group: Group) -> Chart:
    """Pressure along the middle and along the lattice lines nearest to half a radius from it, as
    the thesis cuts it (its Figures 41 and 42).
    """
    x, y, p = values(group, "x", UM), values(group, "y", UM), values(group, "pressure")
    a, p0 = scalar(group, "hertz_radius"), scalar(group, "hertz_max_pressure")
    half = _window(group)
    inside = np.abs(x) <= half
    off = 0.5 * (a * UM if a else half / 1.3)
    traces: list[Trace] = []
    styles: tuple[tuple[float, int, Style], ...] = (
        (0.0, 0, "points"),
        (off, 1, "open points"),
        (-off, 1, "crosses"),
    )
    for at, colour, style in styles:
        j = int(np.abs(y - at).argmin())
        label = f"y = {y[j]:.0f} µm"
        traces.append(Trace(f"{label}, computed", x[inside], p[inside, j], style, colour))
        # The closed form is even in y.
        if a and p0 and at >= 0.0:
            reach = np.sqrt(max(0.0, (a * UM) ** 2 - y[j] ** 2))
            along = np.linspace(-reach, reach, _ACROSS)
            squared = np.maximum(0.0, 1.0 - (along**2 + y[j] ** 2) / (a * UM) ** 2)
            closed = p0 * np.sqrt(squared)
            traces.append(
                Trace(f"{label}, Hertz", along, closed, "line", colour, entry="lines: Hertz")
            )
    return Chart(
        "Pressure at three sections",
        _X,
        Axis("pressure", "MPa", low=0.0),
        tuple(traces),
        case=case_of(group).label,
        figure="pressure_sections",
    )


def _over_load(arrays: Arrays) -> list[Chart]:
    """Contact area, largest pressure and the bodies' compression over the load (thesis, Figures 43,
    44 and 50).
    """
    out = []
    axis, um2 = Axis("normal force F", "N", low=0.0), UM**2
    for group in with_content(arrays, "force-approach"):
        if "load" not in group:
            continue
        F = values(group, "load")
        for title, name, unit, scale in (
            ("Contact area over load", "area", "µm²", um2),
            ("Largest pressure over load", "max_pressure", "MPa", 1.0),
        ):
            mine = values(group, "contact_area" if name == "area" else name, scale)
            traces = [Trace("computed", F, mine, "points", 0)]
            if f"hertz_{name}" in group:
                at = values(group, "hertz_normal_force")
                closed = values(group, f"hertz_{name}", scale)
                traces.append(Trace("Hertz", at, closed, closed=True))
            ordinate = Axis(title.removesuffix(" over load").lower(), unit, low=0.0)
            out.append(Chart(title, axis, ordinate, tuple(traces), figure="over_load", columns=3))
        bodies = _compressions(group, F)
        if bodies:
            top = 1.4 * max(float(t.y.max()) for t in bodies)
            ordinate = Axis("share of the approach beyond 3a", "%", low=0.0, high=top)
            title = "Compression of the bodies over load"
            out.append(Chart(title, axis, ordinate, bodies, figure="over_load", columns=3))
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


def _states(arrays: Arrays, group: Group, columns: int) -> Chart:
    normal = normal_of(arrays, group)
    assert normal is not None
    whole, half = state_map(group, closed_nodes(normal), UM), _window(normal)
    a, c = scalar(group, "hertz_radius"), scalar(group, "mindlin_stick_radius")
    rims = [circle(a * UM, f"a, Hertz: {a * UM:.1f} µm")] if a else []
    rims += [circle(c * UM, f"c, Mindlin: {c * UM:.1f} µm", dashed=True)] if c else []
    note = (
        "Blue sticks, orange slips; the lines are Hertz's contact radius and Cattaneo and "
        "Mindlin's stick radius."
        if rims
        else "Blue sticks, orange slips."
    )
    return Chart(
        "Stick and slip",
        _X,
        _Y,
        tuple(rims),
        (cut(whole, half, half),),
        case_of(group).label,
        "stick_slip",
        equal=True,
        note=note,
        columns=columns,
        size=(4.6, 4.0),
    )


def _tractions(normal: Group, tangential: list[Group]) -> Chart:
    computed: list[Trace] = []
    closed: list[Trace] = []
    half = _window(normal)
    for k, group in enumerate(tangential):
        x, q = values(group, "x", UM), values(group, "traction")
        inside = np.abs(x) <= half
        along = _middle(q[..., 0] if q.ndim == 3 else q)
        ratio = f"T/µN={case_of(group).ratio:g}"
        computed.append(
            Trace(f"{ratio}, computed", x[inside], along[inside], "points", k, entry=ratio)
        )
        if "mindlin_traction" in group:
            at = values(group, "mindlin_x", UM)
            near = np.abs(at) <= half
            y = values(group, "mindlin_traction")[near]
            closed.append(
                Trace(
                    f"{ratio}, Cattaneo-Mindlin",
                    at[near],
                    y,
                    "line",
                    k,
                    entry="lines: Cattaneo-Mindlin",
                )
            )
    # Room for the legend above the curves.
    ordinate = Axis(
        "traction", "MPa", high=1.45 * float(max(t.y.max() for t in (*computed, *closed))) or None
    )
    traces, case = (*computed, *closed), case_of(normal).label
    return Chart(
        "Tangential traction along y = 0", _X, ordinate, traces, case=case, figure="traction"
    )


def _approach(arrays: Arrays) -> list[Chart]:
    out = []
    for group in with_content(arrays, "force-approach"):
        F = from_zero(group, "normal_force")
        traces = [
            Trace(
                "computed, distant set to distant set",
                from_zero(group, "approach", UM),
                F,
                "both",
                0,
            )
        ]
        if "hertz_approach" in group:
            traces.append(
                Trace(
                    "Hertz",
                    values(group, "hertz_approach", UM),
                    values(group, "hertz_normal_force"),
                    closed=True,
                )
            )
        if "approach_contact" in group:
            d = from_zero(group, "approach_contact", UM)
            traces.append(Trace("computed, bulk compliance removed", d, F, "crosses", 1))
        out.append(
            Chart("Force over approach", APPROACH, FORCE, tuple(traces), figure="force_approach")
        )
    return out


def _split(loaded: list[Group]) -> list[Chart]:
    """Share of the approach near the contact and in each body beyond depth 3a."""
    groups = [group for group in loaded if "finite_body" in group]
    if not groups:
        return []
    bodies = {
        str(v.attributes["body"]): name for name, v in groups[0].items() if "body" in v.attributes
    }
    beyond = {
        body: np.array([float(group[name].data) for group in groups])
        for body, name in bodies.items()
    }
    approach = np.array([float(group["approach"].data) for group in groups])
    lengths = {"within 3a of the contact": approach - sum(beyond.values())} | {
        f"{body} beyond 3a": v for body, v in beyond.items()
    }
    bars = Bars(
        tuple(case_of(group).label for group in groups),
        {label: 100.0 * v / approach for label, v in lengths.items()},
        {label: tuple(f"{one * UM:.3g} µm" for one in v) for label, v in lengths.items()},
    )
    axes = Axis("share of the approach", "%"), Axis("")
    return [
        Chart(
            "Approach: near the contact and in the bodies",
            *axes,
            bars=(bars,),
            figure="force_approach",
        )
    ]


def _loop(group: Group) -> Chart:
    bodies = scalar(group, "finite_body_compliance")
    label = "computed, with the bodies" if bodies is None else "computed, bulk compliance removed"
    traces = [path_trace(label, group, 0, compliance=bodies or 0.0)]
    if "mindlin_force" in group:
        d, T = values(group, "mindlin_displacement", UM), values(group, "mindlin_force")
        traces.append(Trace("Mindlin-Deresiewicz", d, T, "dashed", closed=True))
    axes = Axis("tangential displacement", "µm"), Axis("tangential force T", "N")
    return Chart("Hysteresis", *axes, tuple(traces), case=case_of(group).label, figure="hysteresis")
