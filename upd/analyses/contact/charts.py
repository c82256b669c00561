"""Charts of a contact, from the run folder's content alone: pressure, stick and slip, force over
approach and displacement, contact points, each with its closed form where there is one.

A curved contact is drawn about its middle, in um; flat faces whole, in report axes, mm.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from upd.analyses.face_charts import face_chart, face_pressure, values
from upd.plot.chart import Axis, Band, Chart, Map, Scatter, Trace
from upd.plot.common import (
    UM,
    case_of,
    circle,
    cut,
    pressure_map,
    scalar,
    state_map,
    with_content,
)
from upd.results import Arrays, Case, Group

_X_UM, _Y_UM = Axis("x", "µm"), Axis("y", "µm")
_PRESSURE, _FORCE = Axis("pressure", "MPa", low=0.0), Axis("normal force F", "N", low=0.0)
# Normal loads whose pressure is on the sheet: of a curved contact the largest, of flat faces the
# first, whose other maps are there for the first load alone.
_SHOWN = 2
# Points of a closed form across a contact, whose ends are steep.
_ACROSS = 401
# Closed forms of radii, drawn around a curved contact: name, label, whether dashed.
_RADII = (("hertz_radius", "a, Hertz", False), ("mindlin_stick_radius", "c, Mindlin", True))

#: case -> its groups, one per contact face
Faces = dict[Case, list[Group]]


def contact_charts(arrays: Arrays, summary: Mapping[str, Any], *, curved: bool) -> list[Chart]:
    """Pressure, stick and slip, force over approach and over displacement; tractions of a curved
    contact, contact points of flat faces.

    The largest load comes first of a curved contact, the scene's first of flat faces.
    """
    del summary
    normal, sheared = _loaded(arrays), _by_case(arrays, "tangential")
    order = list(reversed(normal)) if curved else list(normal)
    pressure = _pressure if curved else face_pressure
    ratios = len({case.ratio for case in sheared})
    return [
        *(pressure(case.label, normal[case], sheet=k < _SHOWN) for k, case in enumerate(order)),
        *(_middle(group) for case in order if curved for group in normal[case]),
        *(
            _states(
                case,
                groups,
                normal[load],
                curved=curved,
                sheet=curved or load == order[0],
                columns=ratios,
            )
            for case, groups in reversed(sheared.items())
            if (load := Case(load=case.load)) in normal
        ),
        *(
            _tractions(normal[load][0], mine)
            for load in order
            if curved and (mine := [g for c, (g,) in sheared.items() if c.load == load.load])
        ),
        *(_approach(group) for group in with_content(arrays, "force-approach")),
        *_paths(arrays, curved=curved),
        *(
            _law(group, normal.get(case_of(group), []), sheet=case_of(group) == order[0])
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


def _loaded(arrays: Arrays) -> Faces:
    """The normal loads under which a node carries a force.

    Of contact faces without a lattice none: maps and sections are drawn on lattice lines.
    """
    return {
        case: groups
        for case, groups in _by_case(arrays, "normal").items()
        if any((values(group, "normal_force") > 0.0).any() for group in groups)
        and all(values(group, "normal_force").ndim == 2 for group in groups)
    }


def _states(
    case: Case, groups: list[Group], normal: list[Group], *, curved: bool, **more: Any
) -> Chart:
    scale = UM if curved else 1.0
    pairs = zip(groups, [values(under, "normal_force") > 0.0 for under in normal], strict=True)
    maps = tuple(state_map(group, closed, scale) for group, closed in pairs)
    more |= {"maps": maps, "size": (5.4, 4.0), "note": "Blue sticks, orange slips."}
    if curved:
        more |= {"size": (4.6, 4.0), **_about_middle(groups[0], normal[0], maps[0])}
    return face_chart("Stick and slip", groups, case.label, "stick_slip", **more)


def _approach(group: Group) -> Chart:
    """Force over approach, beside the closed form."""
    F, d = values(group, "normal_force"), values(group, "approach", UM)
    traces = [Trace("computed, distant set to distant set", d, F, "both", 0)]
    if "hertz_approach" in group:
        closed = values(group, "hertz_approach", UM), values(group, "hertz_normal_force")
        traces.append(Trace("Hertz", *closed, closed=True))
    if "approach_contact" in group:
        d = values(group, "approach_contact", UM)
        traces.append(Trace("computed, bulk compliance removed", d, F, "crosses", 1))
    axes = Axis("approach δ", "µm", low=0.0), _FORCE
    return Chart("Force over approach", *axes, tuple(traces), figure="force_approach")


def _paths(arrays: Arrays, *, curved: bool) -> list[Chart]:
    """Tangential force over displacement, then cycles: one chart per direction of flat faces, one
    per load of a curved contact.
    """
    out: list[Chart] = []
    for content in ("path", "cycle"):
        found: dict[str, list[Group]] = {}
        for group in with_content(arrays, content)[:: -1 if curved else 1]:
            case = case_of(group)
            key = case.label if curved else f"along {case.direction}"
            found.setdefault(key, []).append(group)
        out += [_path_chart(case, groups, content == "cycle") for case, groups in found.items()]
    return out


def _path_chart(case: str, groups: list[Group], cycle: bool) -> Chart:
    traces, bands = [], []
    for k, group in enumerate(groups):
        T, bodies = values(group, "tangential_force"), scalar(group, "finite_body_compliance")
        d = values(group, "displacement", UM) - UM * (bodies or 0.0) * T
        label = Case(load=case_of(group).load).label
        label += ", bulk compliance removed" if bodies is not None else ""
        traces.append(Trace(label, d, T, "line" if cycle else "both", k))
        limit = scalar(group, "friction_limit")
        if limit is not None and not cycle:
            bands.append(Band("µ F_N", "y", limit, limit, k, dashed=True))
        if "mindlin_force" in group:
            d, T = values(group, "mindlin_displacement", UM), values(group, "mindlin_force")
            traces.append(Trace("Mindlin-Deresiewicz", d, T, "dashed", closed=True))
    return Chart(
        "Hysteresis" if cycle else "Tangential force over displacement",
        Axis("displacement", "µm"),
        Axis("tangential force F_T", "N"),
        tuple(traces),
        case=case,
        figure="hysteresis" if cycle else "force_displacement",
        bands=tuple(bands),
    )


# -- of a curved contact ---------------------------------------------------------------------------


def _window(normal: Group) -> float:
    """Half width in um of the window around a curved contact."""
    x, y = values(normal, "x", UM), values(normal, "y", UM)
    distance = np.hypot(*np.meshgrid(x, y, indexing="ij"))
    reach = distance[values(normal, "normal_force") > 0.0].max(initial=0.0)
    return max(1.3 * float(reach), 3.0 * float(max(np.diff(x).max(), np.diff(y).max())))


def _about_middle(group: Group, normal: Group, whole: Map) -> dict[str, Any]:
    """Fields of a chart of the window around the contact, with the radii of closed forms."""
    half = _window(normal)
    radii = [(scalar(group, name), label, dashed) for name, label, dashed in _RADII]
    rims = (
        circle(r * UM, f"{label}: {r * UM:.1f} µm", dashed=dashed)
        for r, label, dashed in radii
        if r
    )
    return {"x": _X_UM, "y": _Y_UM, "traces": tuple(rims), "maps": (cut(whole, half, half),)}


def _pressure(case: str, groups: list[Group], *, sheet: bool) -> Chart:
    (group,) = groups
    more = {"sheet": sheet, "columns": 3, "size": (5.6, 4.4)}
    more |= _about_middle(group, group, pressure_map(group, UM))
    return face_chart("Contact pressure", groups, case, "pressure", **more)


def _middle(group: Group) -> Chart:
    """Pressure along the middle."""
    x, p = values(group, "x", UM), values(group, "pressure")[:, len(group["y"].data) // 2]
    a, p0 = scalar(group, "hertz_radius"), scalar(group, "hertz_max_pressure")
    inside = np.abs(x) <= _window(group)
    traces = [Trace("computed", x[inside], p[inside], "points")]
    if a and p0:
        along = np.linspace(-1.0, 1.0, _ACROSS)
        closed = p0 * np.sqrt(1.0 - along**2)
        traces.append(Trace("Hertz", a * UM * along, closed, closed=True))
    title, case = "Pressure along y = 0", case_of(group).label
    return Chart(title, _X_UM, _PRESSURE, tuple(traces), case=case, figure="pressure_sections")


def _tractions(normal: Group, tangential: Sequence[Group]) -> Chart:
    computed: list[Trace] = []
    closed: list[Trace] = []
    half, lines = _window(normal), "lines: Cattaneo-Mindlin"
    for k, group in enumerate(tangential):
        x, q = values(group, "x", UM), values(group, "traction")
        inside, name = np.abs(x) <= half, f"T/µN={case_of(group).ratio:g}"
        along = q[inside, q.shape[1] // 2, 0]
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


# -- of flat faces ---------------------------------------------------------------------------------


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
