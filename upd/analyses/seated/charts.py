"""Charts of a seated damper, from the run folder's content alone. Lengths in mm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from upd.analyses.contact.charts import TOP_PERCENTILE, face_chart, values
from upd.analyses.seated.output import FACE, HISTORY, MOVED, SEATING
from upd.analyses.seated.solve import RAISED, SMOOTH, WAYS
from upd.plot.chart import STATES, Arrays, Axis, Chart, Group, Map, Style, Trace
from upd.plot.common import UM, case_of, lattice, pressure_map, with_content
from upd.scene.forced_contact import SIDES

_STYLES: dict[str, Style] = dict(zip(SEATING, ("line", "dashed", "dotted"), strict=True))
_MARKS: tuple[tuple[Style, str, str], ...] = (
    ("points", "normal", "N"),
    ("open points", "tangential", "T"),
)
#: open, stick, slip of the solver -> open, slip, stick of maps
_ORDER = np.array([0.0, 2.0, 1.0])


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Forces while F_C is raised and lowered, ways of loading, pressure, stick and slip, hysteresis
    of a blade moved, motion of the damper.
    """
    histories = {case_of(g).name: g for g in with_content(arrays, HISTORY, MOVED)}
    return [
        *_seating(histories, summary),
        *_ways(histories),
        *_maps(arrays),
        *_moved(arrays),
        *_damper(histories),
    ]


def _seating(histories: Mapping[str, Group], summary: Mapping[str, Any]) -> list[Chart]:
    """Normal and tangential force of each face over F_C, and the balance of a rigid damper."""
    if not set(SEATING) <= set(histories):
        return []
    out = []
    for side in SIDES:
        traces: list[Trace] = []
        for j, (name, words) in enumerate((("normal", "N"), ("tangential", "T"))):
            F, force = np.zeros(1), np.zeros(1)
            for phase, style in _STYLES.items():
                group = histories[phase]
                # from where the phase before ended
                F = np.concatenate([F[-1:], values(group, "centrifugal")])
                force = np.concatenate([force[-1:], values(group, f"{name}_{side}")])
                traces.append(Trace(f"{words}, {phase}", F, force, style, j))
        out.append(
            Chart(
                "Forces while F_C is raised and lowered",
                Axis("centrifugal force F_C", "N", low=0.0),
                Axis("force on the face", "N"),
                (*traces, *_rigid(summary, side, histories)),
                case=f"{side} face",
                figure="seating",
                note="T is positive up the slope, where friction holds the damper back.",
            )
        )
    return out


def _rigid(summary: Mapping[str, Any], side: str, histories: Mapping[str, Group]) -> list[Trace]:
    """Normal force of a rigid damper that slips on both faces, over F_C."""
    out = []
    for phase in (RAISED, "lowered", SMOOTH):
        found = next(
            (
                one
                for one in summary["results"]
                if one["name"] == "face_N"
                and one["case_fields"].get("name") == phase
                and one["case_fields"].get("side") == side
                and one.get("reference") is not None
            ),
            None,
        )
        if found is None or phase not in histories:
            continue
        end = values(histories[phase], "centrifugal")[-1]
        top = values(histories[RAISED], "centrifugal").max()
        slope = found["reference"] / end
        words = found["source"].removeprefix("rigid damper").strip(", ")
        out.append(
            Trace(
                f"N, rigid damper, {words}",
                np.array([0.0, top]),
                np.array([0.0, slope * top]),
                "dashdot",
                closed=True,
            )
        )
    return out


def _ways(histories: Mapping[str, Group]) -> list[Chart]:
    """Forces of both faces after each way of loading."""
    found = [name for name in (*WAYS, SMOOTH) if name in histories]
    if len(found) < 3:
        return []
    place = np.arange(len(found), dtype=float)
    traces = []
    for k, side in enumerate(SIDES):
        for style, name, words in _MARKS:
            force = np.array([values(histories[one], f"{name}_{side}")[-1] for one in found])
            traces.append(Trace(f"{words}, {side} face", place + 0.12 * (k - 0.5), force, style, k))
    ticks = tuple((float(k), name) for k, name in enumerate(found))
    return [
        Chart(
            "Forces after each way of loading",
            Axis("way of loading", low=-0.5, high=len(found) - 0.5, ticks=ticks),
            Axis("force on the face", "N"),
            tuple(traces),
            figure="seating",
            note="All hold the same F_C: friction leaves open which, and the way of loading "
            "decides.",
        )
    ]


def _maps(arrays: Arrays) -> list[Chart]:
    """Pressure and state of each face after each way of loading."""
    found: dict[tuple[str, str], list[Group]] = {}
    for group in with_content(arrays, FACE):
        case = case_of(group)
        found.setdefault((case.name, case.side), []).append(group)
    out = []
    for (name, side), groups in found.items():
        p = np.concatenate([values(g, "pressure").ravel() for g in groups])
        top = float(np.percentile(p[p > 0.0], TOP_PERCENTILE)) if (p > 0.0).any() else None
        out.append(
            face_chart(
                "Contact pressure",
                groups,
                f"{name}, {side} face",
                "pressure",
                maps=tuple(pressure_map(g, 1.0, top=top) for g in groups),
                note="Open nodes are white; the colours end at the 99th percentile, where only "
                "edges go on.",
                sheet=name == RAISED,
                detail=f"largest {p.max():.3g} MPa",
            )
        )
    for (name, side), groups in found.items():
        out.append(
            face_chart(
                "Stick and slip",
                groups,
                f"{name}, {side} face",
                "stick_slip",
                maps=tuple(_state(g) for g in groups),
                note="In the last load step: blue sticks, orange slips, grey is open.",
                sheet=name in (RAISED, "lowered"),
            )
        )
    return out


def _state(group: Group) -> Map:
    x, y = lattice(group, 1.0)
    return Map(x, y, _ORDER[values(group, "state").astype(int)], Axis("state"), STATES)


def _moved(arrays: Arrays) -> list[Chart]:
    """Force on the moved blade over its shift."""
    out = []
    groups = with_content(arrays, MOVED)
    # what the scene moves first, then the vibration of a way of loading
    for group in sorted(groups, key=lambda one: case_of(one).name in WAYS):
        name = case_of(group).name
        axis = group["shift"].attributes.get("long_name", "").removeprefix("along ")
        shift, force = values(group, "shift", UM), values(group, "platform_force")
        traces = [Trace(f"force along {axis}", shift, force, "both", 0)]
        out.append(
            Chart(
                "Hysteresis of the moved blade",
                Axis(f"shift of the right blade along {axis}", "µm"),
                Axis(f"its force on the damper along {axis}", "N"),
                tuple(traces),
                case=name,
                figure="hysteresis",
                sheet=name not in WAYS,
            )
        )
    return out


def _damper(histories: Mapping[str, Group]) -> list[Chart]:
    """Shifts and turns of the damper while F_C is raised and lowered."""
    groups = [histories[name] for name in SEATING if name in histories]
    if not groups:
        return []
    F = np.concatenate([[0.0], *(values(g, "centrifugal") for g in groups)])
    out = []
    for kind, title, unit, scale in (
        ("u", "Shift of the damper", "µm", UM),
        ("r", "Turn of the damper", "µrad", 1e6),
    ):
        names = [n for n in groups[0] if n.startswith(f"damper_{kind}")]
        traces = tuple(
            Trace(
                f"{'along' if kind == 'u' else 'about'} {name[-1]}",
                F,
                np.concatenate([[0.0], *(values(g, name, scale) for g in groups)]),
                "line",
                k,
            )
            for k, name in enumerate(names)
        )
        out.append(
            Chart(
                title,
                Axis("centrifugal force F_C", "N", low=0.0),
                Axis(title.split(" ")[0].lower(), unit),
                traces,
                figure="damper_motion",
            )
        )
    return out
