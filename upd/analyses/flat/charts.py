"""Charts of a flat contact for the report, from the run folder's content alone. Lengths in report axes, mm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from upd.plot.chart import Arrays, Axis, Chart, Entry, Trace, label_of, picked
from upd.plot.common import UM, force_approach, force_paths, pressure_map, state_map

_X, _Y = Axis("x, along the damper", "mm"), Axis("y, up the slope", "mm")
_HEADLINE = ("F_N", "mean_pressure", "max_pressure", "closed_share", "approach", "K_N_secant_raw", "K_Tx_initial_raw", "K_Ty_initial_raw")


def headline(rows: list[Entry]) -> list[Entry]:
    """Force, pressure, contact, approach and stiffness at the first load."""
    return picked(rows, _HEADLINE)


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Pressure, force per length, stick and slip, force over approach and over displacement."""
    patches = _patches(arrays)
    normal = _cases(arrays, "pressure", patches)
    tangential = _cases(arrays, "stick", patches)
    lines = [_per_length(arrays, normal)] if normal else []
    return [
        *(_pressure(arrays, case, groups) for case, groups in normal.items()),
        *lines,
        *(_states(arrays, case, groups, normal) for case, groups in reversed(tangential.items())),
        *_approach(arrays, summary),
        *_paths(arrays, "path ", "Tangential force over displacement"),
        *_paths(arrays, "cycle ", "Hysteresis"),
    ]


def _patches(arrays: Arrays) -> tuple[str, ...]:
    """Names at the end of the groups when there are several contact faces: a load's group has "F=... N" and then the name."""
    normal = [name for name, group in arrays.items() if "pressure" in group]
    return tuple(dict.fromkeys(rest for _, _, rest in (name.partition(" N ") for name in normal) if rest))


def _cases(arrays: Arrays, variable: str, patches: tuple[str, ...]) -> dict[str, list[str]]:
    """Case -> its groups, one per contact face."""
    out: dict[str, list[str]] = {}
    for name, group in arrays.items():
        if variable in group:
            patch = next((p for p in patches if name.endswith(f" {p}")), "")
            out.setdefault(name.removesuffix(f" {patch}") if patch else name, []).append(name)
    return out


def _pressure(arrays: Arrays, case: str, groups: list[str]) -> Chart:
    maps = tuple(pressure_map(arrays[g], 1.0, capped=True) for g in groups)
    largest = max(float(arrays[g]["pressure"].data.max()) for g in groups)
    note = f"The largest pressure, {largest:.3g} MPa, is an edge's; the colours end at the 99th percentile. Open nodes are white."
    return Chart("Contact pressure", _X, _Y, (), maps, case, "pressure", equal=True, note=note)


def _per_length(arrays: Arrays, normal: Mapping[str, list[str]]) -> Chart:
    traces = []
    for k, (case, groups) in enumerate(normal.items()):
        for group in (arrays[g] for g in groups):
            x, F = np.asarray(group["x"].data), np.asarray(group["normal_force"].data).sum(axis=1)
            # Length a lattice line stands for: half way to its neighbours.
            edges = np.concatenate([[x[0]], 0.5 * (x[1:] + x[:-1]), [x[-1]]])
            traces.append(Trace(case, x, F / np.diff(edges), "both", k))
    return Chart("Normal force per length", _X, Axis("force per length", "N/mm"), tuple(traces), figure="pressure")


def _states(arrays: Arrays, case: str, groups: list[str], normal: Mapping[str, list[str]]) -> Chart:
    load = next(n for n in normal if case.startswith(f"{n} "))
    pairs = zip(groups, normal[load], strict=True)
    maps = tuple(state_map(arrays[t], arrays[n]["normal_force"].data > 0.0, 1.0) for t, n in pairs)
    return Chart("Stick and slip", _X, _Y, (), maps, label_of(case), "stick_slip", equal=True, note="Blue sticks, orange slips.")


def _approach(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    curve = force_approach(arrays)
    if curve is None:
        return []
    d, F = curve
    traces = [Trace("computed", d, F, "both", 0)]
    row = next((r for r in summary["results"] if r["name"] == "K_N_secant_raw" and r["reference"]), None)
    if row is not None:
        slope = float(row["reference"])
        traces.append(Trace(f"{row['source']}: {slope:.3g} N/mm", UM * F / slope, F, "dashed", 1))
    return [Chart("Force over approach", Axis("approach", "µm"), Axis("normal force", "N"), tuple(traces), figure="force_approach")]


def _paths(arrays: Arrays, prefix: str, title: str) -> list[Chart]:
    """One chart per direction, one curve per normal load."""
    found: dict[str, list[Trace]] = {}
    for case, (d, T) in force_paths(arrays, prefix).items():
        load, _, direction = label_of(case).rpartition(" T")
        direction = direction.partition("/")[0].lstrip("_")
        mine = found.setdefault(direction, [])
        mine.append(Trace(load, d, T, "both" if prefix == "path " else "line", len(mine)))
    axes = (Axis("displacement", "µm"), Axis("tangential force", "N"))
    return [Chart(title, *axes, tuple(traces), case=f"along {d}" if d else "", figure="force_displacement") for d, traces in found.items()]
