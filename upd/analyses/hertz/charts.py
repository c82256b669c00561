"""Charts of a curved contact for the report, from the run folder's content alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from upd.plot.chart import Array, Arrays, Axis, Chart, Entry, Map, Trace, label_of, picked, value_of
from upd.plot.common import UM, circle, cut, force_approach, force_paths, pressure_map, state_map
from upd.reference import hertz_pressure, mindlin

_X, _Y = Axis("x", "µm"), Axis("y", "µm")
_HEADLINE = (
    "max_pressure",
    "radius_moment",
    "approach_contact",
    "K_N_tangent",
    "K_T_initial",
    "tangential_displacement",
    "stick_radius",
    "cycle_energy",
)
_RAW = ("max_pressure", "radius_moment", "approach", "K_N_tangent_raw", "K_T_initial_raw", "tangential_displacement_raw", "cycle_energy")


def headline(rows: list[Entry]) -> list[Entry]:
    """Pressure, radius, approach, stiffness, slip and loss at the largest load."""
    found = picked(rows, _HEADLINE, last=True)
    return found if len(found) >= 5 else picked(rows, _RAW, last=True)


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Pressure, stick and slip, traction, force over approach, hysteresis; each with its closed form where there is one."""
    normal = [name for name, group in arrays.items() if "pressure" in group]
    loaded = [name for name in normal if float(arrays[name]["normal_force"].data.max()) > 0.0]
    tangential = [name for name, group in arrays.items() if "stick" in group]
    sections = [_pressure_section(arrays, loaded, summary)] if loaded else []
    return [
        *(_pressure(arrays, name, summary) for name in reversed(loaded)),
        *sections,
        *(_states(arrays, name, summary) for name in reversed(tangential)),
        *(_tractions(arrays, name, tangential, summary) for name in reversed(loaded) if any(_of(t, name) for t in tangential)),
        *_approach(arrays, summary),
        *_loops(arrays, summary),
    ]


def _of(tangential: str, normal: str) -> bool:
    return tangential.startswith(f"{normal} ")


def _normal_of(arrays: Arrays, tangential: str) -> str:
    return next(name for name, group in arrays.items() if "pressure" in group and _of(tangential, name))


def _radius(summary: Mapping[str, Any], case: str, *, computed: bool = False) -> float | None:
    """Hertz's contact radius in um (or the computed outermost one)."""
    name, key = ("radius_outermost", "value") if computed else ("radius_moment", "reference")
    return value_of(summary, name, case, key)


def _window(summary: Mapping[str, Any], case: str, x: Array) -> float:
    """Half width in um of the window around a contact."""
    outer = _radius(summary, case, computed=True) or 0.0
    return max(1.3 * outer, 3.0 * float(np.diff(x).min()))


def _pressure(arrays: Arrays, case: str, summary: Mapping[str, Any]) -> Chart:
    whole = pressure_map(arrays[case], UM)
    half = _window(summary, case, whole.x)
    a = _radius(summary, case)
    rim = (circle(a, f"Hertz, a = {a:.1f} µm"),) if a else ()
    return Chart("Contact pressure", _X, _Y, rim, (cut(whole, half, half),), case, "pressure", equal=True)


def _pressure_section(arrays: Arrays, cases: list[str], summary: Mapping[str, Any]) -> Chart:
    traces: list[Trace] = []
    for k, case in enumerate(cases):
        m = pressure_map(arrays[case], UM)
        inside = np.abs(m.x) <= max(_window(summary, c, m.x) for c in cases)
        p = np.asarray(arrays[case]["pressure"].data)[:, len(m.y) // 2]
        traces.append(Trace(f"{case}, computed", m.x[inside], p[inside], "points", k))
        a, p0 = _radius(summary, case), value_of(summary, "max_pressure", case, "reference")
        if a and p0:
            r = np.linspace(-a, a, 201)
            traces.append(Trace(f"{case}, Hertz", r, hertz_pressure(np.abs(r), a, p0), "line", k))
    return Chart("Pressure along y = 0", _X, Axis("pressure", "MPa"), tuple(traces), figure="pressure")


def _stick_circle(summary: Mapping[str, Any], case: str) -> float | None:
    return value_of(summary, "stick_radius", case, "reference")


def _states(arrays: Arrays, name: str, summary: Mapping[str, Any]) -> Chart:
    normal, case = _normal_of(arrays, name), label_of(name)
    whole: Map = state_map(arrays[name], arrays[normal]["normal_force"].data > 0.0, UM)
    half = _window(summary, normal, whole.x)
    a, c = _radius(summary, normal), _stick_circle(summary, case)
    rims = [circle(a, f"contact, a = {a:.1f} µm (Hertz)")] if a else []
    rims += [circle(c, f"stick, c = {c:.1f} µm (Cattaneo-Mindlin)", dashed=True)] if c else []
    note = "Blue sticks, orange slips; the lines are the closed form's." if rims else "Blue sticks, orange slips."
    return Chart("Stick and slip", _X, _Y, tuple(rims), (cut(whole, half, half),), case, "stick_slip", equal=True, note=note)


def _friction(summary: Mapping[str, Any]) -> float:
    return float(summary["scene_file"].get("contact", {}).get("friction", 0.0))


def _tractions(arrays: Arrays, normal: str, tangential: list[str], summary: Mapping[str, Any]) -> Chart:
    a, p0 = _radius(summary, normal), value_of(summary, "max_pressure", normal, "reference")
    traces: list[Trace] = []
    for k, name in enumerate(t for t in tangential if _of(t, normal)):
        group, case = arrays[name], label_of(name)
        x = np.asarray(group["x"].data) * UM
        inside = np.abs(x) <= _window(summary, normal, x)
        q = np.asarray(group["traction"].data)
        q = (q[..., 0] if q.ndim == 3 else q)[:, q.shape[1] // 2]
        ratio = case.removeprefix(f"{normal} ").replace("muN", "µN")
        traces.append(Trace(f"{ratio}, computed", x[inside], q[inside], "points", k))
        c = _stick_circle(summary, case)
        if a and p0 and c is not None:
            r = np.linspace(x[inside][0], x[inside][-1], 401)
            mu_p0 = _friction(summary) * p0
            closed = hertz_pressure(np.abs(r), a, mu_p0) - (hertz_pressure(np.abs(r), c, mu_p0 * c / a) if c > 0.0 else 0.0)
            traces.append(Trace(f"{ratio}, Cattaneo-Mindlin", r, closed, "line", k))
    return Chart("Tangential traction along y = 0", _X, Axis("traction", "MPa"), tuple(traces), case=normal, figure="traction")


def _approach(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    curve = force_approach(arrays)
    if curve is None:
        return []
    d, F = curve
    traces = [Trace("computed, distant set to distant set", d, F, "both", 0)]
    rows = [r for r in summary["results"] if r["name"] == "approach" and r["reference"]]
    if rows:
        last = rows[-1]
        load = float(arrays[last["case"]]["normal_force"].data.sum())
        # Hertz: the approach goes with F^(2/3).
        f = np.linspace(0.0, F[-1], 101)
        traces.append(Trace("Hertz", float(last["reference"]) * (f / load) ** (2.0 / 3.0), f, "line", 1))
        bodies = value_of(summary, "approach_finite_body", last["case"])
        if bodies is not None:
            traces.append(Trace("computed, finite bodies taken off", d - bodies / load * F, F, "points", 2))
    return [Chart("Force over approach", Axis("approach", "µm"), Axis("normal force", "N"), tuple(traces), figure="force_approach")]


def _loops(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    out = []
    for case, (d, T) in force_paths(arrays, "cycle ").items():
        normal = next((n for n, g in arrays.items() if "pressure" in g and _of(case, n)), "")
        raw, K = (value_of(summary, name, normal) for name in ("K_T_initial_raw", "K_T_initial"))
        bodies = UM * (1.0 / raw - 1.0 / K) if raw and K else 0.0
        label = "computed, body shear taken off" if bodies else "computed, with the bodies"
        traces = [Trace(label, d - bodies * T, T, "line", 0), *_closed_loop(arrays, summary, normal, float(np.abs(T).max()))]
        axes = (Axis("tangential displacement", "µm"), Axis("tangential force", "N"))
        out.append(Chart("Hysteresis", *axes, tuple(traces), case=label_of(case), figure="hysteresis"))
    return list(reversed(out))


def _closed_loop(arrays: Arrays, summary: Mapping[str, Any], normal: str, peak: float) -> list[Trace]:
    a, K = _radius(summary, normal), value_of(summary, "K_T_initial_raw", normal, "reference")
    mu = _friction(summary)
    if not (a and K and mu):
        return []
    N = float(arrays[normal]["normal_force"].data.sum())
    # The compliance from the slope of the unloaded contact: Johnson, section 7.2.
    C = 8.0 * (a / UM) / K
    T = np.linspace(-peak, peak, 151)
    down = UM * mindlin.unloading(T, peak, mu, N, a / UM, C)
    gap = np.array([np.nan])
    x, y = np.concatenate([down, gap, -down]), np.concatenate([T, gap, -T])
    return [Trace("Mindlin-Deresiewicz", x, y, "dashed", 1)]
