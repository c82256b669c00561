"""Charts of a flat contact, from the run folder's content alone. Lengths in report axes, mm."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.charts import (
    APPROACH,
    FACE_SIZE,
    FACE_X,
    FACE_Y,
    FORCE,
    TOP_PERCENTILE,
    closed_nodes,
    face_chart,
    frames,
    from_zero,
    is_loaded,
    normal_of,
    path_trace,
    values,
)
from upd.plot.chart import Array, Arrays, Axis, Band, Chart, Group, Map, Scatter, Style, Trace
from upd.plot.common import UM, case_of, pressure_map, scalar, state_map, with_content
from upd.results import Case

# Normal loads whose pressure is on the sheet; of the other maps, those of the first load.
_SHOWN = 2

Faces = dict[Case, list[Group]]


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Pressure, opening, deformed surface, stick and slip, force over approach and over
    displacement, contact points.
    """
    del summary
    normal = {
        case: groups
        for case, groups in _by_case(arrays, "normal").items()
        if any(map(is_loaded, groups))
    }
    tangential = {
        case: groups
        for case, groups in _by_case(arrays, "tangential").items()
        if _with_load(normal, case) in normal
    }
    first = next(iter(normal), None)
    ratios = len({case.ratio for case in tangential})
    return [
        *(
            _pressure(case, groups, sheet=k < _SHOWN)
            for k, (case, groups) in enumerate(normal.items())
        ),
        *([_per_length(normal)] if normal else []),
        *(_opening(case, groups, sheet=case == first) for case, groups in normal.items()),
        *(
            _surface(c, g, sheet=c == first)
            for c, g in normal.items()
            if all("surface_displacement" in group for group in g)
        ),
        *(
            _states(arrays, case, groups, ratios, sheet=_with_load(normal, case) == first)
            for case, groups in reversed(tangential.items())
        ),
        *_approach(arrays),
        *_pressure_over_force(arrays),
        *_paths(arrays, "path"),
        *_paths(arrays, "cycle"),
        *_laws(arrays, normal, first),
    ]


def _by_case(arrays: Arrays, content: str) -> Faces:
    """Case -> its groups, one per contact face."""
    out: Faces = {}
    for group in with_content(arrays, content):
        out.setdefault(case_of(group), []).append(group)
    return out


def _with_load(normal: Faces, case: Case) -> Case | None:
    """The normal load a tangential case goes with."""
    return next((one for one in normal if one == Case(load=case.load)), None)


def _joined(groups: list[Group], name: str) -> Array:
    """A field of all faces as one row."""
    return np.concatenate([values(group, name).ravel() for group in groups])


def _pressure(case: Case, groups: list[Group], sheet: bool) -> Chart:
    p = _joined(groups, "pressure")
    maps = tuple(
        pressure_map(group, 1.0, top=float(np.percentile(p, TOP_PERCENTILE))) for group in groups
    )
    note = (
        f"The largest pressure, {p.max():.3g} MPa, is an edge's; the colours end at the 99th "
        "percentile. Open nodes are white."
    )
    detail, more = f"largest {p.max():.3g} MPa", {"sheet": sheet, "columns": 3}
    return face_chart(
        "Contact pressure",
        groups,
        case.label,
        "pressure",
        maps=maps,
        note=note,
        detail=detail,
        **more,
    )


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
    ordinate = Axis("force per length", "N/mm", low=0.0)
    return Chart(
        "Normal force per length",
        FACE_X,
        ordinate,
        tuple(traces),
        figure="pressure",
        bands=tuple(bands),
        columns=3,
        size=FACE_SIZE,
    )


def _opening(case: Case, groups: list[Group], sheet: bool) -> Chart:
    closed = [np.asarray(group["contact"].data) > 0 for group in groups]
    lattices = [
        np.meshgrid(values(group, "x"), values(group, "y"), indexing="ij") for group in groups
    ]
    n, whole = sum(int(c.sum()) for c in closed), sum(c.size for c in closed)
    traces = list(frames(groups))
    exact = "; nothing opens: the linear answer is exact" * (n == whole)
    kinds: list[tuple[Style, str, list[NDArray[np.bool_]]]] = [
        ("points", f"in contact: {n} of {whole} nodes{exact}", closed),
        ("crosses", "open", [~mine for mine in closed]),
    ]
    for colour, (style, label, nodes) in enumerate(kinds):
        x, y = (
            np.concatenate([xy[k][mine] for xy, mine in zip(lattices, nodes, strict=True)])
            for k in range(2)
        )
        if x.size:
            traces.append(Trace(label, x, y, style, colour))
    # Room for the legend above the nodes.
    upwards = replace(
        FACE_Y,
        high=float(
            max(values(g, "y")[-1] for g in groups)
            + 0.1 * np.ptp(np.concatenate([t.x for t in traces]))
        ),
    )
    note = f"{n} of {whole} nodes are in contact; crosses are open."
    found = face_chart(
        "Nodes in contact", groups, case.label, "contact_open", note=note, sheet=sheet, columns=1
    )
    return replace(found, y=upwards, traces=tuple(traces))


def _surface(case: Case, groups: list[Group], sheet: bool) -> Chart:
    u = UM * _joined(groups, "surface_displacement")
    low, top, axis = float(u.min()), float(u.max()), Axis("displacement along the normal", "µm")
    maps = tuple(
        Map(
            values(g, "x"),
            values(g, "y"),
            values(g, "surface_displacement", UM),
            axis,
            top=top,
            low=low,
            smooth=True,
        )
        for g in groups
    )
    body = groups[0]["surface_displacement"].attributes.get("body", "upper body")
    note = f"How far the contact nodes of the {body} stay behind its distant set."
    return face_chart(
        f"Deformed surface of the {body}",
        groups,
        case.label,
        "surface",
        maps=maps,
        note=note,
        sheet=sheet,
        columns=1,
    )


def _states(arrays: Arrays, case: Case, groups: list[Group], ratios: int, sheet: bool) -> Chart:
    pairs = [
        (group, normal) for group in groups if (normal := normal_of(arrays, group)) is not None
    ]
    maps = tuple(state_map(group, closed_nodes(normal), 1.0) for group, normal in pairs)
    note, more = "Blue sticks, orange slips.", {"sheet": sheet, "columns": max(1, ratios)}
    return face_chart(
        "Stick and slip",
        groups,
        case.label,
        "stick_slip",
        maps=maps,
        note=note,
        size=(5.4, 4.0),
        **more,
    )


def _printed_slope(group: Group, top: float) -> list[Trace]:
    """The printed stiffness as a line from zero up to ``top`` N."""
    slope = scalar(group, "printed_stiffness")
    if not slope:
        return []
    label = f"{group['printed_stiffness'].attributes.get('source', 'printed')}: {slope:.3g} N/mm"
    return [
        Trace(label, np.array([0.0, UM * top / slope]), np.array([0.0, top]), "dashed", closed=True)
    ]


def _approach(arrays: Arrays) -> list[Chart]:
    out = []
    for group in with_content(arrays, "force-approach"):
        F, stiffness = from_zero(group, "normal_force"), scalar(group, "stiffness")
        label = "computed" if stiffness is None else f"computed, K_N = {stiffness:.3g} N/mm"
        traces = [
            Trace(label, from_zero(group, "approach", UM), F, "both", 0),
            *_printed_slope(group, float(F[-1])),
        ]
        out.append(
            Chart(
                "Force over approach",
                APPROACH,
                FORCE,
                tuple(traces),
                figure="force_approach",
            )
        )
    return out


def _pressure_over_force(arrays: Arrays) -> list[Chart]:
    out = []
    for group in (
        g
        for g in with_content(arrays, "force-approach")
        if {"max_pressure", "mean_pressure"} <= set(g)
    ):
        F = values(group, "normal_force")
        traces = (
            Trace("maximum (at an edge)", F, values(group, "max_pressure"), "both", 0),
            Trace("mean over the contact", F, values(group, "mean_pressure"), "both", 1),
        )
        axes = Axis("normal force F", "N", low=0.0), Axis("pressure", "MPa", low=0.0)
        out.append(Chart("Pressure over normal force", *axes, traces, figure="force_approach"))
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
    title = "Hysteresis" if cycle else "Tangential force over displacement"
    axes, case = (
        (Axis("displacement", "µm"), Axis("tangential force F_T", "N")),
        f"along {direction}" if direction else "",
    )
    return Chart(
        title,
        *axes,
        tuple(traces),
        case=case,
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
    size = k_n / k_n.max()
    points = Scatter(
        values(group, "report_x"),
        values(group, "report_y"),
        values(group, "law_preload"),
        size,
        Axis("preload", "N"),
    )
    detail = f"{len(k_n)} points, k_n {k_n.sum():.3g} N/mm in all"
    return face_chart(
        "Contact points of the dynamic model",
        faces,
        case_of(group).label,
        "contact_law",
        note="The area of a mark is its share of the normal stiffness.",
        scatters=(points,),
        sheet=sheet,
        columns=1,
        detail=detail,
    )
