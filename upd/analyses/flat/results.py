"""FlatSolution of a flat contact -> the flat list of numbers, beside the thesis's printed values."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from upd.analyses.flat.maps import contact_law, lattices, pressure_peaks, tilt_stiffness
from upd.analyses.flat.solve import FlatSolution, NormalCase, Path, TangentialCase, direction_name
from upd.reference import THESIS_CONTACT_STIFFNESS
from upd.results import Result

UM = 1e3
#: recipe -> the thesis's damper and the table of its contact stiffness
THESIS_OF = {"wedge_platform": ("symmetric", "thesis, Table XI"), "pads_platform": ("asymmetric", "thesis, Table XII")}


#: the numbers that matter, most important first (shell patterns)
HEADLINE = ("F_N", "max_pressure", "K_N_tangent_raw", "K_Tx_initial_raw", "K_Ty_initial_raw")


def make_results(solution: FlatSolution) -> list[Result]:
    """All rows of a run, case by case."""
    rows = _equilibrium_rows(solution)
    for case in solution.normal:
        rows += _normal_rows(solution, case)
        rows += _stiffness_rows(solution, case)
        if solution.plan.scene.wants("worn_zones"):
            rows += _worn_rows(solution, case)
        if solution.plan.scene.wants("contact_law"):
            rows += _law_rows(solution, case)
        rows += [row for t in solution.tangential if t.normal is case for row in _tangential_rows(t)]
        rows += [_cycle_row(path) for path in solution.paths if path.normal is case and path.cycle]
    return rows + _curve_rows(solution)


def thesis_value(solution: FlatSolution, name: str) -> tuple[float | None, str]:
    """The thesis's K_N or K_T in N/mm for the scene's recipe, and its table; nothing for other geometries."""
    damper, table = THESIS_OF.get(solution.plan.scene.recipe, ("", ""))
    return (THESIS_CONTACT_STIFFNESS[damper][name], table) if damper else (None, "")


def _equilibrium_rows(solution: FlatSolution) -> list[Result]:
    rows = []
    for case in solution.normal:
        faces = case.load.faces
        if faces is not None:
            label = f"equilibrium, friction {case.load.state}"
            rows += [
                Result("F_N", label, faces.normal_right, "N"),
                Result("F_T", label, faces.tangential_right, "N"),
                Result("F_N_other_face", label, faces.normal_left, "N"),
            ]
    return rows


def _normal_rows(solution: FlatSolution, case: NormalCase) -> list[Result]:
    force = case.solution.force
    weights = solution.model.multipliers.weights
    closed = sum(float(k.area()[k.field(force) > 0.0].sum()) for k in lattices(solution))
    whole = sum(float(k.area().sum()) for k in lattices(solution))
    rows = [
        Result("max_pressure", case.label, float((force / weights).max()), "MPa"),
        Result("mean_pressure", case.label, case.force / closed if closed else 0.0, "MPa"),
        Result("closed_share", case.label, 100.0 * closed / whole, "%"),
        Result("approach", case.label, case.solution.approach * UM, "um"),
    ]
    rows += [Result(f"approach_{body}", case.label, value * UM, "um") for body, value in case.approach_of.items()]
    if case.tilted is not None:
        rows += [
            Result("tilt_about_y", case.label, float(case.tilted.tilt[0]) * 1e6, "urad"),
            Result("tilt_about_x", case.label, float(case.tilted.tilt[1]) * 1e6, "urad"),
        ]
    return rows


def _stiffness_rows(solution: FlatSolution, case: NormalCase) -> list[Result]:
    if not solution.plan.scene.wants("stiffness") or case.force <= 0.0:
        return []
    reference, source = thesis_value(solution, "K_N")
    rows = [
        Result("K_N_secant_raw", case.label, case.force / case.solution.approach, "N/mm", reference, source, exact=False),
        Result("K_N_tangent_raw", case.label, case.stiffness, "N/mm", reference, source, exact=False),
        Result("K_N_bonded", case.label, solution.bonded, "N/mm"),
        *(Result(f"K_N_{body}_alone", case.label, case.force / value, "N/mm") for body, value in case.approach_of.items()),
    ]
    reference, source = thesis_value(solution, "K_T")
    for (label, direction), stuck in solution.stuck.items():
        if label == case.label:
            name = f"K_T{direction_name(direction)}"
            rows.append(Result(f"{name}_initial_raw", label, stuck.total, "N/mm", reference, source, exact=False))
            rows += [Result(f"{name}_{body}_alone", label, value, "N/mm") for body, value in stuck.of.items()]
    return rows


def band_centres(solution: FlatSolution) -> list[float]:
    """Middles along x (contact axes, mm) of the parts of the damper's distant set, which the loads come from, both sides of a mirror."""
    upper = solution.model.upper.mesh
    x = np.unique(upper.points[upper.nodes["distant"], 0])
    if 0 in solution.plan.mirrors:
        x = np.unique(np.concatenate([-x, x]))
    lines = np.unique(upper.points[upper.nodes["contact"], 0])
    # A part ends where a line of the contact's lattice is missing from it.
    gaps = np.flatnonzero([np.any((lines > a) & (lines < b)) for a, b in pairwise(x)]) + 1
    return [0.5 * float(part[0] + part[-1]) for part in np.split(x, gaps)]


def _worn_rows(solution: FlatSolution, case: NormalCase) -> list[Result]:
    if case.force <= 0.0:
        return []
    peaks = pressure_peaks(solution, case)
    left = min(float(k.X[0]) for k in lattices(solution))
    bands = [c - left for c in band_centres(solution)]
    rows = [Result("pressure_peaks", case.label, float(len(peaks)), "")]
    for i, (x, y) in enumerate(peaks):
        nearest = min(bands, key=lambda c: abs(c - x)) if len(bands) == len(peaks) else None
        rows.append(Result(f"peak_{i + 1}_x", case.label, x, "mm", nearest, "middle of the worn zone" if nearest else "", exact=False))
        rows.append(Result(f"peak_{i + 1}_y", case.label, y, "mm"))
    return rows


def _law_rows(solution: FlatSolution, case: NormalCase) -> list[Result]:
    law = contact_law(solution, case)
    if law is None:
        return []
    rows = [
        Result("law_points", case.label, float(law.n_point), ""),
        Result("law_k_n", case.label, float(law.k_n.sum()), "N/mm"),
        Result("law_preload", case.label, float(law.preload.sum()), "N"),
        Result("law_lumping_x", case.label, 100.0 * float(law.tilt_error()[0]), "%"),
        Result("law_lumping_y", case.label, 100.0 * float(law.tilt_error()[1]), "%"),
    ]
    rows[2:2] = [Result(f"law_k_t{a}", case.label, float(law.k_t[:, i].sum()), "N/mm") for i, a in enumerate("xy")]
    own = dict(zip("xy", law.tilt_stiffness(), strict=True))
    if solution.plan.scene.law.bodies == "both":
        for axis, true in tilt_stiffness(solution, case).items():
            rows.append(Result(f"law_tilt_{axis}", case.label, float(own[axis]), "N mm", true, "contact's own"))
    return rows


def _tangential_rows(t: TangentialCase) -> list[Result]:
    loaded = t.normal.solution.force > 0.0
    rows = [
        Result("tangential_load", t.label, t.load, "N"),
        Result("displacement", t.label, t.displacement * UM, "um"),
        Result("stick_share", t.label, 100.0 * float(t.stick.sum() / max(1, loaded.sum())), "%"),
        Result("K_T_tangent_raw", t.label, t.stiffness, "N/mm"),
    ]
    if t.load > 0.0:
        rows.append(Result("K_T_secant_raw", t.label, t.load / t.displacement, "N/mm"))
    return rows


def _cycle_row(path: Path) -> Result:
    return Result("cycle_energy", path.label, path.slip_work, "mJ")


def _curve_rows(solution: FlatSolution) -> list[Result]:
    """Spread of the slope of the F_N-approach curve between 50 and 300 N (where the thesis's Figure 59 is straight), (max - min)/mean."""
    inside = [(F, s.approach) for F, s in solution.curve if 50.0 <= F <= 300.0]
    if len(inside) < 2:
        return []
    F, d = np.array(inside).T
    slope = np.diff(F) / np.diff(d)
    return [Result("slope_spread", "F_N from 50 to 300 N", 100.0 * float(np.ptp(slope) / slope.mean()), "%")]
