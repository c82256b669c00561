"""FlatSolution of a flat contact -> the flat list of numbers, beside what was printed of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from upd.analyses.contact.plan import direction_name
from upd.analyses.contact.results import (
    UM,
    cycle_energy,
    located_results,
    pick,
    shear_stiffness,
    stick_area,
)
from upd.analyses.contact.solution import FlatNormalCase, FlatSolution, FlatTangentialCase
from upd.analyses.flat.maps import (
    contact_law,
    corner,
    lattices,
    pressure_peaks,
    tilt_stiffness,
    whole_area,
)
from upd.analyses.flat.printed import printed_of
from upd.analyses.printed import with_printed
from upd.mesh import IntArray, Mesh
from upd.plot.chart import Entry
from upd.results import Case, Result

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


def headline(results: Sequence[Entry]) -> list[Entry]:
    """The numbers an engineer asks for first, at the first load."""
    return pick(results, HEADLINE)


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
            cycle_energy(path) for path in solution.paths if path.normal == case.case and path.cycle
        ]
    return with_printed(out + _curve(solution), printed_of(scene))


def _equilibrium(solution: FlatSolution) -> list[Result]:
    out = []
    for load in (case.load for case in solution.normal):
        if load.faces is not None:
            case = Case(name="equilibrium", friction=load.state)
            out += [
                Result("F_N", case, load.faces.normal_right, "N"),
                Result("F_T", case, load.faces.tangential_right, "N"),
                Result("F_N_other_face", case, load.faces.normal_left, "N"),
            ]
    return out


def _normal(solution: FlatSolution, case: FlatNormalCase) -> list[Result]:
    force = case.solution.force
    pressure = solution.model.multipliers.pressure(force)
    closed = sum(float(k.area()[k.field(force) > 0.0].sum()) for k in lattices(solution))
    whole = sum(float(k.area().sum()) for k in lattices(solution))
    located = whole_area(solution, case.solution)
    mean = case.force / located.area if located.area else 0.0
    out = [
        Result("max_pressure", case.case, float(pressure.max()), "MPa"),
        Result("mean_pressure", case.case, mean, "MPa"),
        Result("contact_area", case.case, located.area, "mm2"),
        Result("contact_area_nodes", case.case, closed, "mm2"),
        Result("closed_share", case.case, 100.0 * closed / whole, "%"),
        Result("approach", case.case, case.solution.approach * UM, "um"),
    ]
    out = located_results(out, case.case, located.resolution, "mm2")
    out += [
        Result(f"approach_{body}", case.case, value * UM, "um")
        for body, value in case.approach_of.items()
    ]
    if case.tilt is not None:
        out += [
            Result("tilt_about_y", case.case, float(case.tilt[0]) * 1e6, "urad"),
            Result("tilt_about_x", case.case, float(case.tilt[1]) * 1e6, "urad"),
        ]
    if solution.plan.effect("friction"):
        out.append(stick_area(case.case, _area(solution, case.stick), "mm2"))
    return out


def _stiffness(solution: FlatSolution, case: FlatNormalCase) -> list[Result]:
    if not solution.plan.scene.wants("stiffness") or case.force <= 0.0:
        return []
    out = [
        Result("K_N_secant_raw", case.case, case.force / case.solution.approach, "N/mm"),
        Result("K_N_tangent_raw", case.case, case.stiffness, "N/mm"),
        Result("K_N_bonded", case.case, solution.bonded, "N/mm"),
        *(
            Result(f"K_N_{body}_alone", case.case, case.force / alone.approach, "N/mm")
            for body, alone in case.alone.items()
        ),
    ]
    for stuck in (s for s in solution.stuck if s.normal == case.case):
        name = f"K_T{direction_name(stuck.direction)}"
        out.append(Result(f"{name}_initial_raw", case.case, stuck.total, "N/mm"))
        out += [
            Result(f"{name}_{body}_alone", case.case, value, "N/mm")
            for body, value in stuck.of.items()
        ]
    return out + _per_pad(solution, case)


def _per_pad(solution: FlatSolution, case: FlatNormalCase) -> list[Result]:
    """Stiffness of one pad where several share the contact: the total over their number.

    That is each pad's own when they carry equal forces; otherwise their mean.
    """
    n = len(lattices(solution))
    if n < 2:
        return []
    found = {"N": case.force / case.solution.approach} | {
        f"T{direction_name(s.direction)}": s.total for s in solution.stuck if s.normal == case.case
    }
    return [Result(f"K_{k}_per_pad", case.case, value / n, "N/mm") for k, value in found.items()]


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
    out = [Result("pressure_peaks", case.case, float(len(peaks)), "")]
    for i, (x, y) in enumerate(peaks):
        nearest = min(bands, key=lambda c: abs(c - x)) if len(bands) == len(peaks) else None
        out.append(
            Result(
                f"peak_{i + 1}_x",
                case.case,
                x,
                "mm",
                nearest,
                "middle of the scene's loaded band" if nearest else "",
                exact=False,
            )
        )
        out.append(Result(f"peak_{i + 1}_y", case.case, y, "mm"))
    return out


def _law(solution: FlatSolution, case: FlatNormalCase) -> list[Result]:
    law = contact_law(solution, case)
    if law is None:
        return []
    out = [
        Result("law_points", case.case, float(law.n_point), ""),
        Result("law_k_n", case.case, float(law.k_n.sum()), "N/mm"),
        *(
            Result(f"law_k_t{a}", case.case, float(law.k_t[:, i].sum()), "N/mm")
            for i, a in enumerate("xy")
        ),
        Result("law_preload", case.case, float(law.preload.sum()), "N"),
        *(
            Result(f"law_lumping_{a}", case.case, 100.0 * float(law.tilt_error()[i]), "%")
            for i, a in enumerate("xy")
        ),
    ]
    own = dict(zip("xy", law.tilt_stiffness(), strict=True))
    if solution.plan.scene.law.bodies == "both":
        for axis, true in tilt_stiffness(solution, case).items():
            out.append(
                Result(
                    f"law_tilt_{axis}", case.case, float(own[axis]), "N mm", true, "contact's own"
                )
            )
    return out


def _area(solution: FlatSolution, nodes: NDArray[np.bool_]) -> float:
    """Tributary area of nodes (n,) on the whole contact, mm2."""
    found = lattices(solution)
    return sum(float(k.area()[k.field(nodes.astype(float)) > 0.0].sum()) for k in found)


def _tangential(solution: FlatSolution, t: FlatTangentialCase) -> list[Result]:
    loaded = t.pressed > 0.0
    return [
        Result("tangential_load", t.case, t.load, "N"),
        Result("displacement", t.case, t.displacement * UM, "um"),
        Result("stick_share", t.case, 100.0 * float(t.stick.sum() / max(1, loaded.sum())), "%"),
        stick_area(t.case, _area(solution, t.stick), "mm2"),
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
    return [Result("slope_spread", case, 100.0 * float(np.ptp(slope) / slope.mean()), "%")]
