"""Words and figures of the numbers a run leaves.

The same in the terminal, in the report and in notebooks.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

# name in the list of numbers -> words for the table
_LABELS = {
    "radius_moment": "radius, second moment",
    "radius_area": "radius, node count",
    "radius_outermost": "radius, outermost node",
    "approach": "approach, raw",
    "approach_contact": "approach, bulk compliance removed",
    "approach_finite_body": "finite bodies in the approach",
    "approach_far_mesh": "error of the far mesh in the approach",
    "K_N_tangent_3a": "K_N tangent, approach within 3a (thesis 6.5)",
    "compression_3a_sphere": "sphere beyond 3a",
    "compression_3a_block": "block beyond 3a",
    "approach_within_3a": "approach within 3a (thesis 6.5)",
    "contact_area": "contact area",
    "contact_area_resolution": "contact area known to +-",
    "contact_area_nodes": "area, node count",
    "max_pressure": "maximum pressure",
    "mean_pressure": "mean pressure",
    "K_N_tangent_raw": "K_N tangent, raw",
    "K_N_secant_raw": "K_N secant, raw",
    "K_T_initial_raw": "K_T initial, raw",
    "K_T_initial": "K_T initial, bulk compliance removed",
    "K_T_over_K_N": "K_T / K_N",
    "K_T_tangent_raw": "K_T tangent, raw",
    "K_T_secant_raw": "K_T secant, raw",
    "stick_radius": "stick radius",
    "stick_area": "area in stick",
    "tangential_displacement_raw": "displacement, raw",
    "tangential_displacement": "displacement, bulk compliance removed",
    "traction_misfit_L2": "traction misfit (L2)",
    "traction_misfit_of_limit_L2": "traction misfit (L2) over mu p",
    "cycle_energy": "energy per cycle",
    "closed_share": "share of the patch in contact",
    "approach_damper": "approach, damper's share",
    "approach_platform": "approach, platform's share",
    "tilt_about_y": "tilt along x",
    "tilt_about_x": "tilt along y",
    "K_N_tangent": "K_N tangent, bulk compliance removed",
    "K_N_secant": "K_N secant, bulk compliance removed",
    "K_N_bonded": "K_N if nothing could open",
    "K_N_damper_alone": "K_N, platform rigid",
    "K_N_platform_alone": "K_N, damper rigid",
    "K_N_per_pad": "K_N of one pad",
    "K_Tx_per_pad": "K_T along x of one pad, all stuck",
    "K_Ty_per_pad": "K_T along y of one pad, all stuck",
    "K_Tx_initial_raw": "K_T along x, all stuck",
    "K_Ty_initial_raw": "K_T along y, all stuck",
    "K_Tx_damper_alone": "K_T along x, platform rigid",
    "K_Ty_damper_alone": "K_T along y, platform rigid",
    "K_Tx_platform_alone": "K_T along x, damper rigid",
    "K_Ty_platform_alone": "K_T along y, damper rigid",
    "reduction_modes": "fixed-interface modes, both blades",
    "reduction_boundary": "boundary dofs, both blades",
    "response_below": "accelerance at 0.5 f1, reduced",
    "response_above": "accelerance at 1.2 f1, reduced",
    "participation": "participation phi_force phi_output",
    "damping": "damping ratio",
    "frac": "FRAC with the measured curve",
    "magnitude_correlation": "correlation of magnitudes with the measured curve",
    "computed_peak_frequency": "computed peak beside the measured, frequency",
    "computed_peak_accelerance": "computed peak beside the measured, accelerance",
    "peak_frequency_difference": "computed less measured peak, frequency",
    "half_power_damping": "damping ratio by half power",
    "fitted_damping": "damping ratio fitted to the measured curve",
    "fitted_damping_error": "its standard error",
    "fitted_frequency": "natural frequency fitted to the measured curve",
    "fitted_frequency_error": "its standard error",
    "fitted_scale": "modal constant, measured over computed",
    "fitted_noise": "noise of the measured curve, part of the value",
    "fitted_noise_constant": "noise of the measured curve, constant",
    "F_N": "normal force F_N",
    "F_T": "tangential force F_T",
    "F_N_other_face": "normal force on the other face",
    "slope_spread": "spread of the slope F_N / approach",
    "law_points": "contact points",
    "law_k_n": "contact points, sum of k_n",
    "law_k_tx": "contact points, sum of k_t along x",
    "law_k_ty": "contact points, sum of k_t along y",
    "law_preload": "contact points, sum of preloads",
    "law_lumping_x": "contact points, spread along x lost by lumping",
    "law_lumping_y": "contact points, spread along y lost by lumping",
    "law_tilt_x": "contact points, tilt stiffness along x",
    "law_tilt_y": "contact points, tilt stiffness along y",
    "best_ratio": "best F_C/F_E",
    "best_peak": "worst peak at the best F_C/F_E",
    "best_frequency": "frequency of that peak",
    "best_reduction": "of the free peak",
    "best_inside": "best F_C/F_E lies within the curve",
    "half_of_best_ratio": "worst peak at half of the best F_C/F_E",
    "twice_the_best_ratio": "worst peak at twice the best F_C/F_E",
    "highest_ratio_reached": "highest F_C/F_E reached",
    "lowest_ratio_reached": "lowest F_C/F_E reached",
    "contact_slip": "slipping share of the contact",
    "contact_lift": "open share of the contact",
    "reduction_of_free_peak": "reduction of the free peak",
    "stuck_in_phase": "stuck, blades in phase",
    "stuck_out_of_phase": "stuck, blades out of phase",
    "friction_energy": "friction loss per cycle",
    "friction_power": "friction power",
    "face_K_N": "K_N of a face",
    "face_K_T": "K_T of a face",
    "face_K_T_along": "K_T of a face along the damper",
    "face_N": "normal force of the face",
    "face_T": "friction up the slope",
    "face_T_along": "friction along the damper",
    "lowest_face_N": "lowest normal force",
    "highest_face_N": "highest normal force",
    "lowest_face_T": "lowest friction",
    "highest_face_T": "highest friction",
    "slip_share": "slipping share of the contact",
    "leg_K_N": "K_N from platform to platform, x",
    "leg_K_T": "K_T from platform to platform, z",
    "leg_K_T_along": "K_T from platform to platform, y",
    "seating_loss": "friction loss of the seating loop",
    "moved_stiffness": "force over shift, largest to largest",
    "excitation_force": "excitation force F_E",
    "path_points": "points on the path",
    "curve_seconds": "time for the curve",
    "static_N": "static normal force of a face",
    "static_T": "static friction of a face",
    **{
        f"{end}_peak_{k}_{kind}": f"peak {k}, {end} {kind}"
        for k in range(1, 6)
        for end in ("lowest", "highest")
        for kind in ("frequency", "accelerance")
    },
    "static_normal": "static normal force",
    "share_stick": "sticking share of the cycle",
    "share_slip": "slipping share of the cycle",
    "share_lift": "lifted share of the cycle",
    "points_always_stuck": "points that always stick",
    "time_march_accelerance": "accelerance by time march",
    "damper_mass": "mass of the damper",
    "contact_points": "contact points",
    **{
        f"{blade}peak_{k}_{name}": f"{words}peak {k}, {said}"
        for blade, words in (("", ""), ("left_", "left blade, "))
        for k in range(1, 6)
        for name, said in (
            ("frequency", "frequency"),
            ("accelerance", "accelerance"),
            ("frequency_change", "change of the frequency by an input"),
            ("accelerance_change", "change of the accelerance by an input"),
            ("sweep_up_frequency", "frequency that a sweep up reaches"),
            ("sweep_up_accelerance", "accelerance that a sweep up reaches"),
            ("mac", "MAC with its stuck mode"),
        )
    },
    "left_reduction_of_free_peak": "left blade, reduction of the free peak",
    "damper_ux": "damper, ux",
    "damper_rx": "damper, rotation about x",
    "damper_ux_static": "damper, ux, static",
    "damper_rx_static": "damper, rotation about x, static",
    "damper_uy": "damper, uy",
    "damper_ry": "damper, rotation about y",
    "damper_uy_static": "damper, uy, static",
    "damper_ry_static": "damper, rotation about y, static",
    "damper_uz": "damper, uz",
    "damper_rz": "damper, rotation about z",
    "damper_uz_static": "damper, uz, static",
    "damper_rz_static": "damper, rotation about z, static",
}


def number_label(name: str) -> str:
    """Words for the name of a number."""
    return _LABELS.get(name, name.replace("_", " "))


def percent(value: float | None) -> str:
    """A fraction as a signed percentage."""
    return "" if value is None else f"{100.0 * value:+.2f} %"


def percent_of(error: float | None) -> str:
    """A bound of an error as a percentage of two digits, "not found" where there is none."""
    if error is None:
        return "not found"
    return f"{100.0 * error:.2g} %" if error < 1.0 else f"{100.0 * error:.0f} %"


def plus_minus(entry: Mapping[str, Any]) -> str:
    """The estimated error of a result of summary.json beside its value, "" where not known."""
    error = entry.get("estimated_error")
    known = error is not None and not entry.get("withheld")
    return f"±{percent_of(error)}" if known else ""


def number(value: float | None, unit: str = "") -> str:
    """Four or five significant digits with the unit."""
    if value is None:
        return ""
    text = f"{value:.5g}" if 1e-3 <= abs(value) < 1e6 or value == 0.0 else f"{value:.4e}"
    return f"{text} {unit}".rstrip()


def shown(entry: Mapping[str, Any], *, unit: bool = True) -> str:
    """The value of a result of summary.json with its unit, the ends of one that is a range, or that
    it was not reached.
    """
    if entry.get("withheld"):
        return "not reached"
    text = number(entry["value"])
    if entry.get("low") is not None:
        text = f"{number(entry['low'])} to {number(entry['high'])}"
    return f"{text} {unit_label(entry['unit'])}".rstrip() if unit else text


def check_number(check: Mapping[str, Any], key: str, digits: int = 2) -> str:
    """Value or limit of a check of summary.json; in per cent where it is a change of a result."""
    value = check[key]
    if value is None:
        return "not found"
    return f"{100.0 * value:.{digits}g} %" if check.get("quantity") else f"{value:.{digits}g}"


def check_words(check: Mapping[str, Any]) -> str:
    """What a check of summary.json says, its value and its limit."""
    value, limit = (check_number(check, key, 3) for key in ("value", "limit"))
    return f"{check['says']} = {value} (limit {limit})"


def effect_word(effect: Mapping[str, Any]) -> str:
    """Whether an effect of summary.json was simulated: yes, no, or n/a where the scene has none."""
    return "yes" if effect["on"] else "no" if effect.get("applies", True) else "n/a"


def file_name(title: str) -> str:
    """A title as the name of a file or variable."""
    return re.sub(r"\W+", "_", title).strip("_")


#: unit in the files -> the same in print
_UNITS = {
    "um": "µm",
    "um2": "µm²",
    "mm2": "mm²",
    "(m/s2)/N": "(m/s²)/N",
    "N mm": "N mm",
    "mJ": "mJ",
}


def unit_label(unit: str) -> str:
    """A unit as it is printed."""
    return _UNITS.get(unit, unit)
