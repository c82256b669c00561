"""Charts of a forced response for the report, from the run folder's content alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from upd.plot.chart import Array, Arrays, Axis, Chart, Entry, Group, Trace, label_of
from upd.plot.common import UM, magnitude

_SIDES = ("right", "left")
_STATES = ("stick", "slip", "lift-off")
_F = Axis("frequency", "Hz")
_H = Axis("accelerance", "(m/s²)/N", log=True)
_MOTIONS = (("translation", "µm", 1e3, ("across the blades", "along the damper", "radial")), ("rotation", "mrad", 1e3, ("x", "y", "z")))
#: (number, end of its case) an engineer asks for; "" is the first nonlinear curve
_HEADLINE = (
    ("peak_1_frequency", ", free"),
    ("peak_1_accelerance", ", free"),
    ("stuck_in_phase", ""),
    ("stuck_out_of_phase", ""),
    ("peak_1_frequency", "F_C/F_E"),
    ("peak_1_accelerance", "F_C/F_E"),
    ("reduction_of_free_peak", "F_C/F_E"),
    ("friction_energy", ", at "),
)


def headline(rows: list[Entry]) -> list[Entry]:
    """Peaks free and with friction, the stuck frequencies, the reduction of the peak and the loss."""
    found = (next((r for r in rows if r["name"] == name and part in r["case"]), None) for name, part in _HEADLINE)
    return [r for r in found if r is not None]


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Responses free, stuck and with friction; contact states, loops, loss, damper motion and performance."""
    del summary
    cases = {label_of(name.removeprefix("friction ")): group for name, group in arrays.items() if name.startswith("friction ")}
    return [
        *(_response(arrays, cases, side) for side in _SIDES),
        *(_states(case, group) for case, group in cases.items()),
        *(_loops(case, group) for case, group in cases.items() if "loop_displacement" in group),
        *([_loss(cases)] if cases else []),
        *(_motion(case, group, k) for k in range(2) for case, group in cases.items() if "damper" in group),
        *_performance(arrays),
    ]


def _frequency(group: Group) -> Array:
    return np.asarray(group["frequency"].data, float)


def _response(arrays: Arrays, cases: Mapping[str, Group], side: str) -> Chart:
    traces: list[Trace] = []
    linear = {name.removeprefix("linear "): group for name, group in arrays.items() if name.startswith("linear ")}
    for k, (name, group) in enumerate(linear.items()):
        if k == 0:
            # The free blades do not know the contact's stiffness.
            traces.append(_curve("free", group, f"accelerance_free_{side}", "dashed", 4))
        traces.append(_curve(f"stuck, {name}", group, f"accelerance_stuck_{side}", "dotted", k))
    traces += [_curve(case, group, f"accelerance_{side}", "line", k) for k, (case, group) in enumerate(cases.items())]
    shown = tuple(t for t in traces if np.isfinite(t.y).any())
    return Chart("Frequency response", _F, _H, shown, case=f"{side} blade", figure="response")


def _curve(label: str, group: Group, name: str, style: Any, colour: int) -> Trace:
    H = magnitude(group[name])
    return Trace(label, _frequency(group), np.where(H > 0.0, H, np.nan), style, colour)


def _states(case: str, group: Group) -> Chart:
    shares = 100.0 * np.asarray(group["state"].data).mean(axis=1)
    traces = tuple(Trace(state, _frequency(group), shares[:, k], "line", k) for k, state in enumerate(_STATES))
    ordinate = Axis("share of contact points and cycle", "%")
    return Chart("Contact state", _F, ordinate, traces, case=case, figure="contact_state")


def _loops(case: str, group: Group) -> Chart:
    d, T, point = (np.asarray(group[name].data) for name in ("loop_displacement", "loop_traction", "loop_point"))
    closed = [np.append(a, a[:, :1], axis=1) for a in (d * UM, T)]
    traces = tuple(Trace(f"contact point {int(p) + 1}", x, y, "line", k) for k, (p, x, y) in enumerate(zip(point, *closed, strict=True)))
    axes = (Axis("sliding displacement", "µm"), Axis("friction force", "N"))
    return Chart("Hysteresis", *axes, traces, case=f"{case}, at the peak", figure="hysteresis")


def _loss(cases: Mapping[str, Group]) -> Chart:
    found = enumerate(cases.items())
    traces = tuple(Trace(case, _frequency(g), 1e3 * np.asarray(g["power"].data).sum(axis=1), "line", k) for k, (case, g) in found)
    return Chart("Friction loss", _F, Axis("power of all contact points", "mW"), traces)


def _motion(case: str, group: Group, kind: int) -> Chart:
    name, unit, scale, axes = _MOTIONS[kind]
    # Coefficients of each degree of freedom: mean, then cosine and sine of every harmonic.
    first = np.asarray(group["damper"].data)[:, 3 * kind : 3 * kind + 3, 1:3]
    amplitude = scale * np.hypot(first[..., 0], first[..., 1])
    traces = tuple(Trace(axis, _frequency(group), amplitude[:, k], "line", k) for k, axis in enumerate(axes))
    return Chart(f"Damper motion: {name}", _F, Axis(f"{name}, first harmonic", unit), traces, case=case, figure="damper_motion")


def _performance(arrays: Arrays) -> list[Chart]:
    traces: list[Trace] = []
    for name, group in arrays.items():
        if name.startswith("performance ") and group["ratio"].data.size:
            x, y = (np.asarray(group[key].data, float) for key in ("ratio", "peak_accelerance"))
            traces.append(Trace(name.removeprefix("performance "), x, y, "both", len(traces)))
    axes = (Axis("F_C/F_E", log=True), Axis("peak accelerance", "(m/s²)/N", log=True))
    return [Chart("Performance", *axes, tuple(traces), figure="performance")] if traces else []
