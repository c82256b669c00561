"""Charts of a seated damper, from the run folder's content alone. Lengths in mm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from upd.analyses.face_charts import face_chart, face_pressure, values
from upd.analyses.seated.output import FACE, HISTORY, MOVED, SEATING
from upd.analyses.seated.plan import RAISED, SMOOTH, WAYS
from upd.plot.chart import STATES, Axis, Chart, Map, Style, Trace
from upd.plot.common import UM, case_of, lattice, with_content
from upd.results import Arrays, Group
from upd.scene.forced_contact import SIDES

_STYLES: dict[str, Style] = dict(zip(SEATING, ("line", "dashed", "dotted"), strict=True))
_F_C, _FORCE = Axis("centrifugal force F_C", "N", low=0.0), Axis("force on the face", "N")
#: open, stick, slip of the solver -> open, slip, stick of maps
_ORDER = np.array([0.0, 2.0, 1.0])


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Forces while F_C is raised and lowered, pressure, stick and slip, hysteresis of a blade
    moved.
    """
    histories = {case_of(g).name: g for g in with_content(arrays, HISTORY, MOVED)}
    faces: dict[tuple[str, str], list[Group]] = {}
    for group in with_content(arrays, FACE):
        case = case_of(group)
        faces.setdefault((case.name, case.side), []).append(group)
    moved = with_content(arrays, MOVED)
    return [
        *(_seating(histories, summary, side) for side in SIDES if set(SEATING) <= set(histories)),
        *(
            face_pressure(f"{name}, {side} face", groups, sheet=name == RAISED)
            for (name, side), groups in faces.items()
        ),
        *(_states(name, side, groups) for (name, side), groups in faces.items()),
        # what the scene moves first, then the vibration of a way of loading
        *(_moved(group) for group in sorted(moved, key=lambda one: case_of(one).name in WAYS)),
    ]


def _seating(histories: Mapping[str, Group], summary: Mapping[str, Any], side: str) -> Chart:
    """Normal and tangential force of a face over F_C, and the balance of a rigid damper."""
    traces: list[Trace] = []
    for j, (name, words) in enumerate((("normal", "N"), ("tangential", "T"))):
        F, force = np.zeros(1), np.zeros(1)
        for phase, style in _STYLES.items():
            group = histories[phase]
            # from where the phase before ended
            F = np.concatenate([F[-1:], values(group, "centrifugal")])
            force = np.concatenate([force[-1:], values(group, f"{name}_{side}")])
            traces.append(Trace(f"{words}, {phase}", F, force, style, j))
    return Chart(
        "Forces while F_C is raised and lowered",
        _F_C,
        _FORCE,
        (*traces, *_rigid(summary, side, histories)),
        case=f"{side} face",
        figure="seating",
        note="T is positive up the slope, where friction holds the damper back.",
    )


def _rigid(summary: Mapping[str, Any], side: str, histories: Mapping[str, Group]) -> list[Trace]:
    """Normal force of a rigid damper that slips on both faces, over F_C."""
    known = {
        one["case_fields"].get("name"): one
        for one in reversed(summary["results"])
        if one["name"] == "face_N"
        and one["case_fields"].get("side") == side
        and one.get("reference") is not None
    }
    out = []
    for phase in (RAISED, "lowered", SMOOTH):
        if phase in known and phase in histories:
            end = values(histories[phase], "centrifugal")[-1]
            top = values(histories[RAISED], "centrifugal").max()
            F, slope = np.array([0.0, top]), known[phase]["reference"] / end
            words = known[phase]["source"].removeprefix("rigid damper").strip(", ")
            out.append(Trace(f"N, rigid damper, {words}", F, slope * F, "dashdot", closed=True))
    return out


def _states(name: str, side: str, groups: list[Group]) -> Chart:
    maps = tuple(
        Map(*lattice(g, 1.0), _ORDER[values(g, "state").astype(int)], Axis("state"), STATES)
        for g in groups
    )
    note = "In the last load step: blue sticks, orange slips, grey is open."
    more: dict[str, Any] = {"maps": maps, "note": note, "sheet": name in (RAISED, "lowered")}
    return face_chart("Stick and slip", groups, f"{name}, {side} face", "stick_slip", **more)


def _moved(group: Group) -> Chart:
    """Force on the moved blade over its shift."""
    name = case_of(group).name
    axis = group["shift"].attributes.get("long_name", "").removeprefix("along ")
    shift, force = values(group, "shift", UM), values(group, "platform_force")
    return Chart(
        "Hysteresis of the moved blade",
        Axis(f"shift of the right blade along {axis}", "µm"),
        Axis(f"its force on the damper along {axis}", "N"),
        (Trace(f"force along {axis}", shift, force, "both", 0),),
        case=name,
        figure="hysteresis",
        sheet=name not in WAYS,
    )
