"""Charts of a contact, from the run folder's content alone: pressure, stick and slip, force over
approach and displacement, contact points, each with its closed form where there is one.

A curved contact is drawn about its middle, in um; flat faces whole, in report axes, mm.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.plot.chart import Array, Axis, Band, Chart, Map, Scatter, Style, Trace
from upd.plot.common import UM, case_of, circle, cut, pressure_map, scalar, state_map, with_content
from upd.results import Arrays, Case, Group

#: axes and size of flat faces
FACE: dict[str, Any] = {
    "x": Axis("x, along the damper", "mm"),
    "y": Axis("y, up the slope", "mm"),
    "size": (7.2, 4.2),
}
#: percentile of the pressure where the colours end: beyond it the pressure is the edge's
TOP_PERCENTILE = 99.0
_X_UM, _Y_UM = Axis("x", "µm"), Axis("y", "µm")
_PRESSURE, _FORCE = Axis("pressure", "MPa", low=0.0), Axis("normal force F", "N", low=0.0)
# Normal loads whose pressure is on the sheet: of a curved contact the largest, of flat faces the
# first, whose other maps are there for the first load alone.
_SHOWN = 2
# Points of a closed form across a contact, whose ends are steep.
_ACROSS = 401
# Lattice lines of the sections, in half radii from the middle.
_SECTIONS: tuple[tuple[float, int, Style], ...] = (
    (0.0, 0, "points"),
    (1.0, 1, "open points"),
    (-1.0, 1, "crosses"),
)

#: case -> its groups, one per contact face
Faces = dict[Case, list[Group]]


def curved_charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Pressure, stick and slip, traction, force over approach, hysteresis of a curved contact."""
    del summary
    normal, sheared = _loaded(arrays), _by_case(arrays, "tangential")
    loaded = [group for (group,) in reversed(normal.values())]
    curves = [group for group in with_content(arrays, "force-approach") if "load" in group]
    return [
        *(
            _about_middle("Contact pressure", g, g, pressure_map(g, UM), sheet=k < _SHOWN)
            for k, g in enumerate(loaded)
        ),
        *(_three_sections(group) for group in loaded),
        *(
            _states_about_middle(group, normal[Case(load=case.load)][0], _ratios(sheared))
            for case, (group,) in reversed(sheared.items())
            if Case(load=case.load) in normal
        ),
        *(
            _tractions(group, mine)
            for group in loaded
            if (mine := [g for c, (g,) in sheared.items() if c.load == case_of(group).load])
        ),
        *(_approach(group) for group in with_content(arrays, "force-approach")),
        *(_over_load(group, *quantity) for group in curves for quantity in _OVER_LOAD),
        *(_loop(group) for group in reversed(with_content(arrays, "cycle"))),
    ]


def flat_charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Pressure, opening, deformed surface, stick and slip, force over approach and over
    displacement, contact points of flat faces.
    """
    del summary
    normal, sheared = _loaded(arrays), _by_case(arrays, "tangential")
    first = next(iter(normal), None)
    return [
        *(
            face_pressure(case.label, groups, sheet=k < _SHOWN)
            for k, (case, groups) in enumerate(normal.items())
        ),
        *([_per_length(normal)] if normal else []),
        *(
            _states(case, groups, normal[load], sheet=load == first, columns=_ratios(sheared))
            for case, groups in reversed(sheared.items())
            if (load := Case(load=case.load)) in normal
        ),
        *(_approach(group) for group in with_content(arrays, "force-approach")),
        *_paths(arrays, "path"),
        *_paths(arrays, "cycle"),
        *(
            _law(group, normal.get(case_of(group), []), sheet=case_of(group) == first)
            for group in with_content(arrays, "contact law")
            if "report_x" in group
        ),
    ]


# -- of every contact ------------------------------------------------------------------------------


def _by_case(arrays: Arrays, content: str) -> Faces:
    """Case -> its groups, one per contact face."""
    out: Faces = {}
    for group in with_content(arrays, content):
        out.setdefault(case_of(group), []).append(group)
    return out


def _ratios(sheared: Faces) -> int:
    """How many loads there are in each direction."""
    return len({case.ratio for case in sheared})


def _loaded(arrays: Arrays) -> Faces:
    """The normal loads under which a node carries a force.

    Of contact faces without a lattice none: maps and sections are drawn on lattice lines.
    """
    return {
        case: groups
        for case, groups in _by_case(arrays, "normal").items()
        if any(_closed(group).any() for group in groups)
        and all(_closed(group).ndim == 2 for group in groups)
    }


def _closed(group: Group) -> NDArray[np.bool_]:
    """(n_x, n_y) nodes that carry a normal force."""
    return np.asarray(group["normal_force"].data > 0.0)


def values(group: Group, name: str, scale: float = 1.0) -> Array:
    """A variable times ``scale``."""
    return np.asarray(group[name].data, float) * scale


def _approach(group: Group) -> Chart:
    """Force over approach, beside the closed form or the printed stiffness."""
    F, d = values(group, "normal_force"), values(group, "approach", UM)
    # The curve of flat faces starts unloaded.
    flat, stiffness = F[0] != 0.0, scalar(group, "stiffness")
    F, d = (np.concatenate([[0.0], v]) if flat else v for v in (F, d))
    label = "computed" if flat else "computed, distant set to distant set"
    if stiffness is not None:
        label += f", K_N = {stiffness:.3g} N/mm"
    traces = [Trace(label, d, F, "both", 0), *_printed_slope(group, float(F[-1]))]
    if "hertz_approach" in group:
        closed = values(group, "hertz_approach", UM), values(group, "hertz_normal_force")
        traces.append(Trace("Hertz", *closed, closed=True))
    if "approach_contact" in group:
        d = values(group, "approach_contact", UM)
        traces.append(Trace("computed, bulk compliance removed", d, F, "crosses", 1))
    axes = Axis("approach δ", "µm", low=0.0), _FORCE
    return Chart("Force over approach", *axes, tuple(traces), figure="force_approach")


def _printed_slope(group: Group, top: float) -> list[Trace]:
    """The printed stiffness as a line from zero up to ``top`` N."""
    slope = scalar(group, "printed_stiffness")
    if not slope:
        return []
    label = f"{group['printed_stiffness'].attributes.get('source', 'printed')}: {slope:.3g} N/mm"
    d, F = np.array([0.0, UM * top / slope]), np.array([0.0, top])
    return [Trace(label, d, F, "dashed", closed=True)]


def _path(
    label: str, group: Group, colour: int, style: Style = "line", compliance: float = 0.0
) -> Trace:
    """Tangential force in N over displacement in um, less ``compliance`` (mm/N) times it."""
    T = values(group, "tangential_force")
    d = values(group, "displacement", UM) - UM * compliance * T
    return Trace(label, d, T, style, colour)


# -- of a curved contact ---------------------------------------------------------------------------


def _window(normal: Group) -> float:
    """Half width in um of the window around a curved contact."""
    x, y = values(normal, "x", UM), values(normal, "y", UM)
    reach = np.hypot(*np.meshgrid(x, y, indexing="ij"))[_closed(normal)].max(initial=0.0)
    return max(1.3 * float(reach), 3.0 * float(max(np.diff(x).max(), np.diff(y).max())))


def _about_middle(title: str, group: Group, normal: Group, whole: Map, **more: Any) -> Chart:
    """A map of the window around the contact, with Hertz's rim."""
    half, a = _window(normal), scalar(group, "hertz_radius")
    rim = (circle(a * UM, f"Hertz, a = {a * UM:.1f} µm"),) if a else ()
    more = {"traces": rim, "columns": 3, "figure": "pressure", **more}
    maps = (cut(whole, half, half),)
    return Chart(title, _X_UM, _Y_UM, maps=maps, case=case_of(group).label, equal=True, **more)


def _states_about_middle(group: Group, normal: Group, columns: int) -> Chart:
    a, c = scalar(group, "hertz_radius"), scalar(group, "mindlin_stick_radius")
    rims = [circle(a * UM, f"a, Hertz: {a * UM:.1f} µm")] if a else []
    rims += [circle(c * UM, f"c, Mindlin: {c * UM:.1f} µm", dashed=True)] if c else []
    note = "Blue sticks, orange slips"
    if rims:
        note += "; the lines are Hertz's contact radius and Cattaneo and Mindlin's stick radius"
    more: dict[str, Any] = {"traces": tuple(rims), "note": f"{note}.", "figure": "stick_slip"}
    more |= {"size": (4.6, 4.0), "columns": columns}
    states = state_map(group, _closed(normal), UM)
    return _about_middle("Stick and slip", group, normal, states, **more)


def _three_sections(group: Group) -> Chart:
    """Pressure along the middle and along the lattice lines nearest to half a radius from it, as
    the thesis cuts it (its Figures 41 and 42).
    """
    x, y, p = values(group, "x", UM), values(group, "y", UM), values(group, "pressure")
    a, p0, half = scalar(group, "hertz_radius"), scalar(group, "hertz_max_pressure"), _window(group)
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
    return Chart(title, _X_UM, _PRESSURE, tuple(traces), case=case, figure="pressure_sections")


#: title, name of the closed form, name, unit and its scale (thesis, Figures 43 and 44)
_OVER_LOAD = (
    ("Contact area", "hertz_area", "contact_area", "µm²", UM**2),
    ("Largest pressure", "hertz_max_pressure", "max_pressure", "MPa", 1.0),
)


def _over_load(group: Group, title: str, closed: str, name: str, unit: str, scale: float) -> Chart:
    traces = [Trace("computed", values(group, "load"), values(group, name, scale), "points", 0)]
    if closed in group:
        line = values(group, "hertz_normal_force"), values(group, closed, scale)
        traces.append(Trace("Hertz", *line, closed=True))
    axes, more = (_FORCE, Axis(title.lower(), unit, low=0.0)), {"figure": "over_load", "columns": 3}
    return Chart(f"{title} over load", *axes, tuple(traces), **more)  # type: ignore[arg-type]


def _tractions(normal: Group, tangential: Sequence[Group]) -> Chart:
    computed: list[Trace] = []
    closed: list[Trace] = []
    half, lines = _window(normal), "lines: Cattaneo-Mindlin"
    for k, group in enumerate(tangential):
        x, q = values(group, "x", UM), values(group, "traction")
        inside, name = np.abs(x) <= half, f"T/µN={case_of(group).ratio:g}"
        along = (q[..., 0] if q.ndim == 3 else q)[:, q.shape[1] // 2][inside]
        computed.append(Trace(f"{name}, computed", x[inside], along, "points", k, entry=name))
        if "mindlin_traction" in group:
            at, y = values(group, "mindlin_x", UM), values(group, "mindlin_traction")
            near, label = np.abs(at) <= half, f"{name}, Cattaneo-Mindlin"
            closed.append(Trace(label, at[near], y[near], "line", k, entry=lines))
    traces, case = (*computed, *closed), case_of(normal).label
    # Room for the legend above the curves.
    ordinate = Axis("traction", "MPa", high=1.45 * float(max(t.y.max() for t in traces)) or None)
    title = "Tangential traction along y = 0"
    return Chart(title, _X_UM, ordinate, traces, case=case, figure="traction")


def _loop(group: Group) -> Chart:
    bodies = scalar(group, "finite_body_compliance")
    label = "computed, with the bodies" if bodies is None else "computed, bulk compliance removed"
    traces = [_path(label, group, 0, compliance=bodies or 0.0)]
    if "mindlin_force" in group:
        d, T = values(group, "mindlin_displacement", UM), values(group, "mindlin_force")
        traces.append(Trace("Mindlin-Deresiewicz", d, T, "dashed", closed=True))
    axes = Axis("tangential displacement", "µm"), Axis("tangential force T", "N")
    return Chart("Hysteresis", *axes, tuple(traces), case=case_of(group).label, figure="hysteresis")


# -- of flat faces ---------------------------------------------------------------------------------


def _frames(groups: Iterable[Group]) -> tuple[Trace, ...]:
    """Edges of the faces."""
    out = []
    for group in groups:
        (left, right), (low, high) = (values(group, axis)[[0, -1]] for axis in "xy")
        x, y = np.array([left, right, right, left, left]), np.array([low, low, high, high, low])
        out.append(Trace("", x, y, outline=True))
    return tuple(out)


def face_chart(title: str, groups: list[Group], case: str, figure: str, **more: Any) -> Chart:
    """A chart of faces with their edges, lengths in mm alike; ``more`` are fields of it."""
    more = FACE | {"traces": _frames(groups)} | more
    return Chart(title, case=case, figure=figure, equal=True, **more)


def _states(case: Case, groups: list[Group], normal: list[Group], **more: Any) -> Chart:
    pairs = zip(groups, normal, strict=True)
    maps = tuple(state_map(group, _closed(under), 1.0) for group, under in pairs)
    more |= {"maps": maps, "size": (5.4, 4.0), "note": "Blue sticks, orange slips."}
    return face_chart("Stick and slip", groups, case.label, "stick_slip", **more)


def face_pressure(case: str, groups: list[Group], *, sheet: bool) -> Chart:
    """Pressure of faces; the colours end where only edges go on."""
    p = np.concatenate([values(group, "pressure").ravel() for group in groups])
    top = float(np.percentile(p[p > 0.0], TOP_PERCENTILE)) if (p > 0.0).any() else None
    more: dict[str, Any] = {
        "maps": tuple(pressure_map(group, 1.0, top=top) for group in groups),
        "note": "Open nodes are white; the colours end at the 99th percentile, where only edges "
        "go on.",
        "sheet": sheet,
        "columns": 3,
        "detail": f"largest {p.max():.3g} MPa",
    }
    return face_chart("Contact pressure", groups, case, "pressure", **more)


def _per_length(normal: Faces) -> Chart:
    traces = []
    for k, (case, groups) in enumerate(normal.items()):
        for group in groups:
            x, F = values(group, "x"), values(group, "normal_force").sum(axis=1)
            # Length a lattice line stands for: half way to its neighbours.
            edges = np.concatenate([[x[0]], 0.5 * (x[1:] + x[:-1]), [x[-1]]])
            traces.append(Trace(case.label, x, F / np.diff(edges), "both", k))
    more = FACE | {"y": Axis("force per length", "N/mm", low=0.0)}
    more |= {"figure": "pressure", "columns": 3}
    return Chart("Normal force per length", traces=tuple(traces), **more)


def _paths(arrays: Arrays, content: str) -> list[Chart]:
    """One chart per direction, one curve per normal load."""
    found: dict[str, list[Group]] = {}
    for group in with_content(arrays, content):
        found.setdefault(case_of(group).direction, []).append(group)
    return [
        _path_chart(direction, groups, content == "cycle") for direction, groups in found.items()
    ]


def _path_chart(direction: str, groups: list[Group], cycle: bool) -> Chart:
    traces, bands = [], []
    for k, group in enumerate(groups):
        load, limit = Case(load=case_of(group).load).label, scalar(group, "friction_limit")
        traces.append(_path(load, group, k, "line" if cycle else "both"))
        if limit is not None and not cycle:
            bands.append(Band("µ F_N", "y", limit, limit, k, dashed=True))
    if not cycle:
        # As far as it can be compared: beyond, the contact slips.
        traces += _printed_slope(groups[0], 0.6 * max(float(t.y.max()) for t in traces))
    return Chart(
        "Hysteresis" if cycle else "Tangential force over displacement",
        Axis("displacement", "µm"),
        Axis("tangential force F_T", "N"),
        tuple(traces),
        case=f"along {direction}" if direction else "",
        figure="force_displacement",
        bands=tuple(bands),
    )


def _law(group: Group, faces: list[Group], sheet: bool) -> Chart:
    k_n = values(group, "law_k_n")
    x, y, preload = (values(group, name) for name in ("report_x", "report_y", "law_preload"))
    more: dict[str, Any] = {
        "note": "The area of a mark is its share of the normal stiffness.",
        "scatters": (Scatter(x, y, preload, k_n / k_n.max(), Axis("preload", "N")),),
        "sheet": sheet,
        "columns": 1,
        "detail": f"{len(k_n)} points, k_n {k_n.sum():.3g} N/mm in all",
    }
    title = "Contact points of the dynamic model"
    return face_chart(title, faces, case_of(group).label, "contact_law", **more)
