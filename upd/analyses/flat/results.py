"""FlatSolution of a flat contact -> the flat list of numbers, beside what was printed of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from upd.analyses import printed
from upd.analyses.contact.plan import direction_name
from upd.analyses.contact.results import LOCATED, shear_stiffness
from upd.analyses.contact.scene_plan import normal_loads
from upd.analyses.contact.solution import FlatNormalCase, FlatSolution, FlatTangentialCase
from upd.analyses.flat.maps import (
    contact_law,
    corner,
    lattices,
    pressure_peaks,
    tilt_stiffness,
    whole_area,
)
from upd.mesh import IntArray, Mesh
from upd.reference.printed import Lookup, Printed
from upd.results import Case, Result
from upd.results import quantities as q
from upd.scene import Scene

#: the numbers that matter, most important first
HEADLINE = (
    "F_N",
    "mean_pressure",
    "max_pressure",
    "closed_share",
    "approach",
    "K_N_per_pad",
    "K_Tx_per_pad",
    "K_Ty_per_pad",
    "K_N_secant_raw",
    "K_Tx_initial_raw",
    "K_Ty_initial_raw",
    "K_N_tangent_raw",
    "approach_damper",
    "approach_platform",
    "law_k_n",
    "cycle_energy",
)
# Forces in N between which the slope of the force-approach curve should not change: dampers work
# there.
_WORKING = (50.0, 300.0)


def make_results(solution: FlatSolution) -> list[Result]:
    """All numbers of a run, case by case."""
    out, scene = _equilibrium(solution), solution.plan.scene
    for case in solution.normal:
        out += _normal(solution, case)
        out += _stiffness(solution, case)
        if scene.wants("worn_zones"):
            out += _worn_zones(solution, case)
        if scene.wants("contact_law"):
            out += _law(solution, case)
        out += [
            r for t in solution.tangential if t.normal is case for r in _tangential(solution, t)
        ]
        out += [
            q.CYCLE_ENERGY.of(path.slip_work, path.case)
            for path in solution.paths
            if path.normal == case.case and path.cycle
        ]
    return printed.with_printed(out + _curve(solution), printed_of(scene))


def printed_of(scene: Scene) -> Lookup:
    """What was printed of the scene's bodies.

    Of a case with a normal load only where that is, to the newton it is printed with, a load of the
    ready scene.
    """
    look_up, ready = printed.printed_of(scene), printed.ready_scene(scene)
    if ready is None:
        return look_up
    loads = {round(load.force) for load in normal_loads(ready)}

    def under_load(name: str, case: Mapping[str, Any]) -> tuple[Printed, ...]:
        load = case.get("load")
        return look_up(name, case) if load is None or round(load) in loads else ()

    return under_load


def _equilibrium(solution: FlatSolution) -> list[Result]:
    out = []
    for load in (case.load for case in solution.normal):
        if load.faces is not None:
            case = Case(name="equilibrium", friction=load.state)
            out += [
                q.F_N.of(load.faces.normal_right, case),
                q.F_T.of(load.faces.tangential_right, case),
                q.F_N_OTHER_FACE.of(load.faces.normal_left, case),
            ]
    return out


def _normal(solution: FlatSolution, case: FlatNormalCase) -> list[Result]:
    force, at = case.solution.force, case.case
    pressure = solution.model.multipliers.pressure(force)
    closed = sum(float(k.area()[k.field(force) > 0.0].sum()) for k in lattices(solution))
    whole = sum(float(k.area().sum()) for k in lattices(solution))
    located = whole_area(solution, case.solution)
    mean = case.force / located.area if located.area else 0.0
    out = [
        q.MAX_PRESSURE.of(pressure.max(), at),
        *(
            quantity.of(value, at, source=LOCATED[quantity.name])
            for quantity, value in (
                (q.MEAN_PRESSURE, mean),
                (q.CONTACT_AREA, located.area),
                (q.CONTACT_AREA_NODES, closed),
            )
        ),
        q.CLOSED_SHARE.of(100.0 * closed / whole, at),
        q.APPROACH.of(case.solution.approach, at),
        q.CONTACT_AREA_RESOLUTION.of(located.resolution, at),
        *(q.APPROACH_OF.of(value, at, n=body) for body, value in case.approach_of.items()),
    ]
    if case.tilt is not None:
        out += [q.TILT_ABOUT_Y.of(case.tilt[0], at), q.TILT_ABOUT_X.of(case.tilt[1], at)]
    if solution.plan.effect("friction"):
        out.append(q.STICK_AREA.of(_area(solution, case.stick), at))
    return out


def _stiffness(solution: FlatSolution, case: FlatNormalCase) -> list[Result]:
    if not solution.plan.scene.wants("stiffness") or case.force <= 0.0:
        return []
    at, touch = case.case, solution.model.first_touch
    out = [
        q.K_N_SECANT_RAW.of(case.force / (case.solution.approach - touch), at),
        q.K_N_TANGENT_RAW.of(case.stiffness, at),
        q.K_N_BONDED.of(solution.bonded, at),
        *(
            q.K_N_ALONE.of(case.force / (one.approach - touch), at, n=body)
            for body, one in case.alone.items()
        ),
    ]
    for stuck in (s for s in solution.stuck if s.normal == at):
        way = direction_name(stuck.direction)
        out.append(q.K_T_ALL_STUCK.of(stuck.total, at, n=way))
        out += [q.K_T_ALONE.of(value, at, n=f"{way}_{body}") for body, value in stuck.of.items()]
    return out + _per_pad(solution, case)


def _per_pad(solution: FlatSolution, case: FlatNormalCase) -> list[Result]:
    """Stiffness of one pad where several share the contact: the total over their number.

    That is each pad's own when they carry equal forces; otherwise their mean.
    """
    n, at = len(lattices(solution)), case.case
    if n < 2:
        return []
    return [
        q.K_N_PER_PAD.of(
            case.force / (case.solution.approach - solution.model.first_touch) / n, at
        ),
        *(
            q.K_T_PER_PAD.of(s.total / n, at, n=direction_name(s.direction))
            for s in solution.stuck
            if s.normal == at
        ),
    ]


def band_centres(solution: FlatSolution) -> list[float]:
    """Middles along x (contact axes, mm) of the parts of the damper's distant set, which the loads
    come from, both sides of a mirror.
    """
    upper = solution.model.upper.mesh
    nodes = upper.nodes["distant"]
    x, weights = upper.points[nodes, 0], upper.weights.get("distant")
    found = []  # lower and upper end, middle
    for part in _joined(upper, nodes):
        # A set without weights is as wide as its nodes lie apart.
        low, high = float(x[part].min()), float(x[part].max())
        middle = 0.5 * (low + high)
        if weights is not None:
            middle = float(weights[part] @ x[part] / weights[part].sum())
        if 0 not in solution.plan.mirrors:
            found.append((low, high, middle))
        elif low > 0.0:
            found += [(low, high, middle), (-high, -low, -middle)]
        else:
            found.append((-high, high, 0.0))
    return [middle for _, _, middle in sorted(found)]


def _joined(mesh: Mesh, nodes: IntArray) -> list[IntArray]:
    """Positions in ``nodes`` of those that elements join, part by part."""
    number = np.full(mesh.n_node, -1)
    number[nodes] = np.arange(len(nodes))
    at = number[mesh.hexes]
    first = np.broadcast_to(at.max(axis=1, keepdims=True), at.shape)
    both = at >= 0
    links = coo_array((np.ones(both.sum()), (first[both], at[both])), shape=(len(nodes),) * 2)
    count, part = connected_components(links, directed=False)
    return [np.flatnonzero(part == k) for k in range(count)]


def band_middles(solution: FlatSolution) -> list[float]:
    """The same in report axes, mm."""
    return [float(c - corner(solution)[0]) for c in band_centres(solution)]


def _worn_zones(solution: FlatSolution, case: FlatNormalCase) -> list[Result]:
    """Where the pressure peaks, beside the bands of the damper that the load comes from.

    The worn areas themselves are printed nowhere; the bands are the scene's own.
    """
    if case.force <= 0.0:
        return []
    peaks, bands = pressure_peaks(solution, case), band_middles(solution)
    out = [q.PRESSURE_PEAKS.of(len(peaks), case.case)]
    for i, (x, y) in enumerate(peaks):
        nearest = min(bands, key=lambda c: abs(c - x)) if len(bands) == len(peaks) else None
        source = "middle of the scene's loaded band" if nearest else ""
        out.append(q.PRESSURE_PEAK_X.of(x, case.case, nearest, source, n=i + 1, exact=False))
        out.append(q.PRESSURE_PEAK_Y.of(y, case.case, n=i + 1))
    return out


def _law(solution: FlatSolution, case: FlatNormalCase) -> list[Result]:
    law, at = contact_law(solution, case), case.case
    if law is None:
        return []
    out = [
        q.LAW_POINTS.of(law.n_point, at),
        q.LAW_K_N.of(law.k_n.sum(), at),
        *(q.LAW_K_T.of(law.k_t[:, i].sum(), at, n=axis) for i, axis in enumerate("xy")),
        q.LAW_PRELOAD.of(law.preload.sum(), at),
        *(q.LAW_LUMPING.of(law.tilt_error()[i], at, n=axis) for i, axis in enumerate("xy")),
    ]
    own = dict(zip("xy", law.tilt_stiffness(), strict=True))
    if solution.plan.scene.law.bodies == "both":
        for axis, true in tilt_stiffness(solution, case).items():
            out.append(q.LAW_TILT.of(own[axis], at, true, "contact's own", n=axis))
    return out


def _area(solution: FlatSolution, nodes: NDArray[np.bool_]) -> float:
    """Tributary area of nodes (n,) on the whole contact, mm2."""
    found = lattices(solution)
    return sum(float(k.area()[k.field(nodes.astype(float)) > 0.0].sum()) for k in found)


def _tangential(solution: FlatSolution, t: FlatTangentialCase) -> list[Result]:
    loaded = t.pressed > 0.0
    return [
        q.TANGENTIAL_LOAD.of(t.load, t.case),
        q.DISPLACEMENT.of(t.displacement, t.case),
        q.STICK_SHARE.of(t.stick.sum() / max(1, loaded.sum()), t.case),
        q.STICK_AREA.of(_area(solution, t.stick), t.case),
        *shear_stiffness(t.case, t.load, t.displacement, t.stiffness),
    ]


def _curve(solution: FlatSolution) -> list[Result]:
    """Spread of the slope of the force-approach curve, (max - min) / mean."""
    low, high = _WORKING
    inside = [(F, s.approach) for F, s in solution.curve if low <= F <= high]
    if len(inside) < 2:
        return []
    F, d = np.array(inside).T
    slope = np.diff(F) / np.diff(d)
    case = Case(name=f"F_N from {low:g} to {high:g} N")
    return [q.SLOPE_SPREAD.of(np.ptp(slope) / slope.mean(), case)]
