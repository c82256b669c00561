"""Charts of a contact, from the run folder's content alone: pressure, opening, stick and slip,
force over approach and displacement, contact points, each with its closed form where there is one.

A curved contact is drawn about its middle, in um; flat faces whole, in report axes, mm.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.plot.chart import Array, Arrays, Axis, Band, Chart, Group, Map, Scatter, Style, Trace
from upd.plot.common import UM, case_of, circle, cut, pressure_map, scalar, state_map, with_content
from upd.results import Case

FACE_X, FACE_Y = Axis("x, along the damper", "mm"), Axis("y, up the slope", "mm")
#: size of a face
FACE_SIZE = (7.2, 4.2)
#: percentile of the pressure where the colours end: beyond it the pressure is the edge's
TOP_PERCENTILE = 99.0
X_UM, Y_UM = Axis("x", "µm"), Axis("y", "µm")
_APPROACH, _FORCE = Axis("approach δ", "µm", low=0.0), Axis("normal force F", "N", low=0.0)
# Normal loads whose pressure is on the sheet; of flat faces' other maps, those of the first load.
_SHOWN = 2

#: case -> its groups, one per contact face
Faces = dict[Case, list[Group]]


def by_case(arrays: Arrays, content: str) -> Faces:
    """Case -> its groups, one per contact face."""
    out: Faces = {}
    for group in with_content(arrays, content):
        out.setdefault(case_of(group), []).append(group)
    return out


def loaded_cases(arrays: Arrays) -> Faces:
    """The normal loads under which a node carries a force.

    Of contact faces without a lattice none: maps and sections are drawn on lattice lines.
    """
    return {
        case: groups
        for case, groups in by_case(arrays, "normal").items()
        if any(closed_nodes(group).any() for group in groups)
        and all(closed_nodes(group).ndim == 2 for group in groups)
    }


def closed_nodes(group: Group) -> NDArray[np.bool_]:
    """(n_x, n_y) nodes that carry a normal force."""
    return np.asarray(group["normal_force"].data > 0.0)


def values(group: Group, name: str, scale: float = 1.0) -> Array:
    """A variable times ``scale``."""
    return np.asarray(group[name].data, float) * scale


def window(normal: Group) -> float:
    """Half width in um of the window around a curved contact."""
    x, y = values(normal, "x", UM), values(normal, "y", UM)
    reach = np.hypot(*np.meshgrid(x, y, indexing="ij"))[closed_nodes(normal)].max(initial=0.0)
    return max(1.3 * float(reach), 3.0 * float(max(np.diff(x).max(), np.diff(y).max())))


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
    more = {"traces": _frames(groups), "size": FACE_SIZE, **more}
    return Chart(title, FACE_X, FACE_Y, case=case, figure=figure, equal=True, **more)


# -- of every contact ------------------------------------------------------------------------------


def state_charts(arrays: Arrays, normal: Faces, *, curved: bool) -> list[Chart]:
    """Stick and slip under every tangential load, the last one first."""
    tangential = by_case(arrays, "tangential")
    columns, first = len({case.ratio for case in tangential}), next(iter(normal), None)
    out = []
    for case, groups in reversed(tangential.items()):
        load = Case(load=case.load)
        pairs = list(zip(groups, normal[load], strict=True)) if load in normal else []
        if curved and pairs:
            out.append(_states_about_middle(case, *pairs[0], columns))
        elif pairs:
            maps = tuple(state_map(group, closed_nodes(under), 1.0) for group, under in pairs)
            more: dict[str, Any] = {"sheet": load == first, "columns": max(1, columns)}
            more |= {"maps": maps, "size": (5.4, 4.0), "note": "Blue sticks, orange slips."}
            out.append(face_chart("Stick and slip", groups, case.label, "stick_slip", **more))
    return out


def _states_about_middle(case: Case, group: Group, normal: Group, columns: int) -> Chart:
    whole, half = state_map(group, closed_nodes(normal), UM), window(normal)
    a, c = scalar(group, "hertz_radius"), scalar(group, "mindlin_stick_radius")
    rims = [circle(a * UM, f"a, Hertz: {a * UM:.1f} µm")] if a else []
    rims += [circle(c * UM, f"c, Mindlin: {c * UM:.1f} µm", dashed=True)] if c else []
    note = "Blue sticks, orange slips"
    if rims:
        note += "; the lines are Hertz's contact radius and Cattaneo and Mindlin's stick radius"
    return Chart(
        "Stick and slip",
        X_UM,
        Y_UM,
        tuple(rims),
        (cut(whole, half, half),),
        case.label,
        "stick_slip",
        equal=True,
        note=f"{note}.",
        columns=columns,
        size=(4.6, 4.0),
    )


def approach_charts(arrays: Arrays) -> list[Chart]:
    """Force over approach, beside the closed form or the printed stiffness."""
    return [_approach(group) for group in with_content(arrays, "force-approach")]


def _approach(group: Group) -> Chart:
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
    title = "Force over approach"
    return Chart(title, _APPROACH, _FORCE, tuple(traces), figure="force_approach")


def _printed_slope(group: Group, top: float) -> list[Trace]:
    """The printed stiffness as a line from zero up to ``top`` N."""
    slope = scalar(group, "printed_stiffness")
    if not slope:
        return []
    label = f"{group['printed_stiffness'].attributes.get('source', 'printed')}: {slope:.3g} N/mm"
    d, F = np.array([0.0, UM * top / slope]), np.array([0.0, top])
    return [Trace(label, d, F, "dashed", closed=True)]


def path_trace(
    label: str, group: Group, colour: int, style: Style = "line", compliance: float = 0.0
) -> Trace:
    """Tangential force in N over displacement in um, less ``compliance`` (mm/N) times it."""
    T = values(group, "tangential_force")
    d = values(group, "displacement", UM) - UM * compliance * T
    return Trace(label, d, T, style, colour)


# -- of flat faces ---------------------------------------------------------------------------------


def flat_charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Pressure, opening, deformed surface, stick and slip, force over approach and over
    displacement, contact points.
    """
    del summary
    normal = loaded_cases(arrays)
    first = next(iter(normal), None)
    return [
        *(_pressure(c, g, sheet=k < _SHOWN) for k, (c, g) in enumerate(normal.items())),
        *([_per_length(normal)] if normal else []),
        *(_opening(case, groups, sheet=case == first) for case, groups in normal.items()),
        *(
            _surface(case, groups, sheet=case == first)
            for case, groups in normal.items()
            if all("surface_displacement" in group for group in groups)
        ),
        *state_charts(arrays, normal, curved=False),
        *approach_charts(arrays),
        *_pressure_over_force(arrays),
        *_paths(arrays, "path"),
        *_paths(arrays, "cycle"),
        *_laws(arrays, normal, first),
    ]


def _joined(groups: list[Group], name: str) -> Array:
    """A field of all faces as one row."""
    return np.concatenate([values(group, name).ravel() for group in groups])


def _pressure(case: Case, groups: list[Group], sheet: bool) -> Chart:
    p = _joined(groups, "pressure")
    top = float(np.percentile(p, TOP_PERCENTILE))
    note = (
        f"The largest pressure, {p.max():.3g} MPa, is an edge's; the colours end at the 99th "
        "percentile. Open nodes are white."
    )
    more: dict[str, Any] = {"sheet": sheet, "columns": 3, "detail": f"largest {p.max():.3g} MPa"}
    maps = tuple(pressure_map(group, 1.0, top=top) for group in groups)
    title = "Contact pressure"
    return face_chart(title, groups, case.label, "pressure", maps=maps, note=note, **more)


def _per_length(normal: Faces) -> Chart:
    traces, bands = [], []
    for k, (case, groups) in enumerate(normal.items()):
        for group in groups:
            x, F = values(group, "x"), values(group, "normal_force").sum(axis=1)
            # Length a lattice line stands for: half way to its neighbours.
            edges = np.concatenate([[x[0]], 0.5 * (x[1:] + x[:-1]), [x[-1]]])
            traces.append(Trace(case.label, x, F / np.diff(edges), "both", k))
    group = next(iter(normal.values()))[0]
    if "worn_zone_middle" in group:
        bands = [
            Band("middle of our loaded bands", "x", at, at, dashed=True)
            for at in values(group, "worn_zone_middle").tolist()
        ]
    return Chart(
        "Normal force per length",
        FACE_X,
        Axis("force per length", "N/mm", low=0.0),
        tuple(traces),
        figure="pressure",
        bands=tuple(bands),
        columns=3,
        size=FACE_SIZE,
    )


def _opening(case: Case, groups: list[Group], sheet: bool) -> Chart:
    closed = np.concatenate([np.asarray(g["contact"].data).ravel() > 0 for g in groups])
    lattices = [np.meshgrid(values(g, "x"), values(g, "y"), indexing="ij") for g in groups]
    x, y = (np.concatenate([xy[k].ravel() for xy in lattices]) for k in range(2))
    n = int(closed.sum())
    exact = "; nothing opens: the linear answer is exact" * (n == x.size)
    traces = list(_frames(groups))
    kinds: tuple[tuple[Style, str, NDArray[np.bool_]], ...] = (
        ("points", f"in contact: {n} of {x.size} nodes{exact}", closed),
        ("crosses", "open", ~closed),
    )
    for colour, (style, label, nodes) in enumerate(kinds):
        if nodes.any():
            traces.append(Trace(label, x[nodes], y[nodes], style, colour))
    # Room for the legend above the nodes.
    width = np.ptp(np.concatenate([trace.x for trace in traces]))
    upwards = replace(FACE_Y, high=float(max(values(g, "y")[-1] for g in groups) + 0.1 * width))
    note = f"{n} of {x.size} nodes are in contact; crosses are open."
    more: dict[str, Any] = {"note": note, "sheet": sheet, "columns": 1, "traces": tuple(traces)}
    found = face_chart("Nodes in contact", groups, case.label, "contact_open", **more)
    return replace(found, y=upwards)


def _surface(case: Case, groups: list[Group], sheet: bool) -> Chart:
    name, axis = "surface_displacement", Axis("displacement along the normal", "µm")
    u = UM * _joined(groups, name)
    low, top = float(u.min()), float(u.max())
    maps = tuple(
        Map(values(g, "x"), values(g, "y"), values(g, name, UM), axis, (), top, low, smooth=True)
        for g in groups
    )
    body = groups[0][name].attributes.get("body", "upper body")
    title = f"Deformed surface of the {body}"
    note = f"How far the contact nodes of the {body} stay behind its distant set."
    more: dict[str, Any] = {"maps": maps, "note": note, "sheet": sheet, "columns": 1}
    return face_chart(title, groups, case.label, "surface", **more)


def _pressure_over_force(arrays: Arrays) -> list[Chart]:
    labels = {"max_pressure": "maximum (at an edge)", "mean_pressure": "mean over the contact"}
    axes = Axis("normal force F", "N", low=0.0), Axis("pressure", "MPa", low=0.0)
    out = []
    for group in with_content(arrays, "force-approach"):
        if labels.keys() <= set(group):
            F = values(group, "normal_force")
            traces = tuple(
                Trace(label, F, values(group, name), "both", k)
                for k, (name, label) in enumerate(labels.items())
            )
            title = "Pressure over normal force"
            out.append(Chart(title, *axes, traces, figure="force_approach"))
    return out


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
        traces.append(path_trace(load, group, k, "line" if cycle else "both"))
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


def _laws(arrays: Arrays, normal: Faces, first: Case | None) -> list[Chart]:
    return [
        _law(group, normal.get(case_of(group), []), sheet=case_of(group) == first)
        for group in with_content(arrays, "contact law")
        if "report_x" in group
    ]


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
