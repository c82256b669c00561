"""What a number is: its name, unit and words, declared once for results, terminal, page, tables.

Every number that runs give, by what it belongs to; each analysis lists its main ones.

Names are those of summary.json and of `result.value`; no unit: a count or a ratio.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from upd.results.case import Case
from upd.results.number import Result

#: how names of numbers of the left blade begin
LEFT = "left_"
#: unit -> of N, mm, t, s, rad, N mm or parts of one
_SCALES = {"um": 1e3, "um2": 1e6, "%": 1e2, "g": 1e6, "mrad": 1e3, "urad": 1e6}


@dataclass(frozen=True)
class Quantity:
    """A number that runs give, or several numbered alike: "peak_{n}_frequency".

    Attributes
    ----------
    name
        As files and scripts have it; {n} is a number, an axis or a body.
    unit
        Of its values in files.
    words
        As it is printed; the name without underscores where nothing is given.
    full
        The number it stands for: of the full model, of the contact without the finite bodies.
    same_bodies
        Whether it converges on the bodies there are, not to a closed form of half-spaces.
    is_error
        Whether it is an error itself and has none.
    in_percent
        Whether its values are given in %, not as parts of one.
    part_of
        What its changes are parts of, where it may vanish itself.
    """

    name: str
    unit: str = ""
    words: str = ""
    full: str = ""
    same_bodies: bool = False
    is_error: bool = False
    in_percent: bool = False
    part_of: str = ""

    @property
    def scale(self) -> float:
        """Its unit over N, mm, t, s, rad, N mm or parts of one, in which its values are given."""
        return 1.0 if self.in_percent else _SCALES.get(self.unit, 1.0)

    def of(
        self,
        value: float,
        case: Case,
        reference: float | None = None,
        source: str = "",
        *,
        n: object = "",
        **more: Any,
    ) -> Result:
        """The number of a case, with a reference and its source; both values in mm, N, t, rad."""
        if reference is not None:
            reference *= self.scale
        value = self.scale * float(value)
        return Result(self.named(n), case, value, self.unit, reference, source, **more)

    def withheld(self, case: Case, reason: str, *, n: object = "") -> Result:
        """The number that was asked for and not reached: no value, and the reason."""
        return self.of(math.nan, case, n=n, withheld=reason)

    def named(self, n: object) -> str:
        """Its name with a number, an axis or a body."""
        return self.name.format(n=n)

    def label(self, n: object = "") -> str:
        """It in words, with a number, an axis or a body."""
        return self.words.format(n=n) if self.words else self.named(n).replace("_", " ")

    def on(self, blade: str) -> Quantity:
        """The same number of the right blade, which needs no name, or the left one."""
        if blade != "left":
            return self
        words = f"left blade, {self.words}" if self.words else ""
        return replace(self, name=LEFT + self.name, words=words)

    def in_unit(self, unit: str) -> Quantity:
        """The same number of an analysis that gives it in another unit."""
        return replace(self, unit=unit)

    def number_of(self, name: str) -> str | None:
        """What {n} is in a name; None for the name of another number."""
        found = re.fullmatch(re.escape(self.name).replace(r"\{n\}", "([^_]+)"), name)
        return None if found is None else "".join(found.groups())


# -- contact of two bodies -------------------------------------------------------------------------

MAX_PRESSURE = Quantity("max_pressure", "MPa", "maximum pressure")
MEAN_PRESSURE = Quantity("mean_pressure", "MPa", "mean pressure")
CONTACT_AREA = Quantity("contact_area", "mm2")
CONTACT_AREA_NODES = Quantity("contact_area_nodes", "mm2", "area, node count")
CONTACT_AREA_RESOLUTION = Quantity("contact_area_resolution", "mm2", "contact area known to +-")
STICK_AREA = Quantity("stick_area", "mm2", "area in stick", part_of="contact area")
CLOSED_SHARE = Quantity("closed_share", "%", "share of the patch in contact", in_percent=True)
APPROACH = Quantity("approach", "um", "approach, raw", full="approach_contact", same_bodies=True)
CYCLE_ENERGY = Quantity("cycle_energy", "mJ", "energy per cycle")
K_N_TANGENT_RAW = Quantity("K_N_tangent_raw", "N/mm", "K_N tangent, raw")
K_N_SECANT_RAW = Quantity("K_N_secant_raw", "N/mm", "K_N secant, raw")
K_T_TANGENT_RAW = Quantity("K_T_tangent_raw", "N/mm", "K_T tangent, raw")
K_T_SECANT_RAW = Quantity("K_T_secant_raw", "N/mm", "K_T secant, raw")

# -- curved contact --------------------------------------------------------------------------------

RADIUS_MOMENT = Quantity("radius_moment", "um", "radius, second moment")
RADIUS_AREA = Quantity("radius_area", "um", "radius, node count")
RADIUS_OUTERMOST = Quantity("radius_outermost", "um", "radius, outermost node")
APPROACH_CONTACT = Quantity("approach_contact", "um", "approach, bulk compliance removed")
APPROACH_FINITE_BODY = Quantity("approach_finite_body", "um", "finite bodies in the approach")
APPROACH_WITHIN_3A = Quantity("approach_within_3a", "um", "approach within 3a (thesis 6.5)")
K_N_TANGENT = Quantity("K_N_tangent", "N/mm", "K_N tangent, bulk compliance removed")
K_N_SECANT = Quantity("K_N_secant", "N/mm", "K_N secant, bulk compliance removed")
K_N_TANGENT_3A = Quantity("K_N_tangent_3a", "N/mm", "K_N tangent, approach within 3a (thesis 6.5)")
K_T_INITIAL_RAW = Quantity("K_T_initial_raw", "N/mm", "K_T initial, raw")
K_T_INITIAL = Quantity("K_T_initial", "N/mm", "K_T initial, bulk compliance removed")
K_T_OVER_K_N = Quantity("K_T_over_K_N", words="K_T / K_N")
#: what a paraboloid on a half-space lacks of a sphere, to the order
CLOSED_FORM_ERROR = Quantity("closed_form_error", "%", "order (a/R)² of Hertz", is_error=True)
STICK_RADIUS = Quantity("stick_radius", "um", "stick radius")
SHEAR_RAW = Quantity("tangential_displacement_raw", "um", "displacement, raw")
SHEAR = Quantity("tangential_displacement", "um", "displacement, bulk compliance removed")
MISFIT = Quantity("traction_misfit_L2", words="traction misfit (L2)", is_error=True)

# -- flat contact ----------------------------------------------------------------------------------

F_N = Quantity("F_N", "N", "normal force F_N")
F_T = Quantity("F_T", "N", "tangential force F_T")
F_N_OTHER_FACE = Quantity("F_N_other_face", "N", "normal force on the other face")
TILT_ABOUT_Y = Quantity("tilt_about_y", "urad", "tilt along x")
TILT_ABOUT_X = Quantity("tilt_about_x", "urad", "tilt along y")
K_T_ALL_STUCK = Quantity("K_T{n}_initial_raw", "N/mm", "K_T along {n}, all stuck")
K_N_ALONE = Quantity("K_N_{n}_alone", "N/mm", "K_N of the {n} alone")
K_T_ALONE = Quantity("K_T{n}_alone", "N/mm")
K_T_DAMPER_ALONE = Quantity("K_T{n}_damper_alone", "N/mm", "K_T along {n}, platform rigid")
K_T_PLATFORM_ALONE = Quantity("K_T{n}_platform_alone", "N/mm", "K_T along {n}, damper rigid")
K_N_PER_PAD = Quantity("K_N_per_pad", "N/mm", "K_N of one pad")
K_T_PER_PAD = Quantity("K_T{n}_per_pad", "N/mm", "K_T along {n} of one pad, all stuck")
PRESSURE_PEAKS = Quantity("pressure_peaks")
PRESSURE_PEAK_X = Quantity("peak_{n}_x", "mm")
PRESSURE_PEAK_Y = Quantity("peak_{n}_y", "mm")
LAW_POINTS = Quantity("law_points", words="contact points")
LAW_K_N = Quantity("law_k_n", "N/mm", "contact points, sum of k_n")
LAW_K_T = Quantity("law_k_t{n}", "N/mm", "contact points, sum of k_t along {n}")
LAW_PRELOAD = Quantity("law_preload", "N", "contact points, sum of preloads")
TANGENTIAL_LOAD = Quantity("tangential_load", "N")
DISPLACEMENT = Quantity("displacement", "um")
STICK_SHARE = Quantity("stick_share", "%")

# -- rig of two blades, free and glued -------------------------------------------------------------

F_FREE = Quantity("f{n}_free", "Hz", same_bodies=True)
F_GLUED = Quantity("f{n}_glued", "Hz", same_bodies=True)
#: by the kind of the modes
NATURAL = {"free": F_FREE, "glued": F_GLUED}
F_REDUCED = Quantity("f{n}_reduced", "Hz", full="f{n}_free")
REDUCTION_MODES = Quantity("reduction_modes", words="fixed-interface modes, both blades")
REDUCTION_BOUNDARY = Quantity("reduction_boundary", "dofs", "boundary dofs, both blades")
DAMPING = Quantity("damping", "%", "damping ratio")
FREE_PEAK_FREQUENCY = Quantity("peak_frequency", "Hz")
FREE_PEAK_ACCELERANCE = Quantity("peak_accelerance", "(m/s2)/N")
PARTICIPATION = Quantity("participation", "1/kg", "participation phi_force phi_output")

# -- bladed disk ---------------------------------------------------------------------------------

F_SECTOR = Quantity("f{n}", "Hz", same_bodies=True)
F_SPINNING = Quantity("f{n}_at_speed", "Hz", same_bodies=True)
CROSSING_SPEED = Quantity("crossing_speed", "rpm", "speed of the crossing")
CROSSING_FREQUENCY = Quantity("crossing_frequency", "Hz", "frequency of the crossing")
CROSSING_MARGIN = Quantity("crossing_margin", "%", "distance from the operating speed")
WAVE_FREE = Quantity("free_amplitude", "um", "free peak")
WAVE_STUCK = Quantity("stuck_amplitude", "um", "stuck peak")
WAVE_DAMPED = Quantity("damped_amplitude", "um", "damped peak")
WAVE_FREQUENCY = Quantity("damped_frequency", "Hz", "frequency of the damped peak")
WAVE_REDUCTION = Quantity("amplitude_reduction", "%", "reduction of the free peak")
WAVE_CENTRIFUGAL = Quantity("wedge_centrifugal", "N", "F_C of the wedge")
WAVE_START = Quantity("start_change", "%", "change of the damped peak by another slider start")
WAVE_CREEP = Quantity("force_creep", "%", "change of contact forces in 40 more periods")
WAVE_AXIAL = Quantity("wedge_axial", "N", "mean axial force on the guide of the wedge")
BEST_MASS = Quantity("best_damper_mass", "g", "mass with the lowest peak")
BEST_MASS_PEAK = Quantity("best_mass_amplitude", "um", "damped peak with it")

# -- damper between two blades ---------------------------------------------------------------------

DAMPER_MASS = Quantity("damper_mass", "g", "mass of the damper")
CONTACT_POINTS = Quantity("contact_points")
FACE_K_N = Quantity("face_K_N", "N/mm", "K_N of a face")
FACE_K_T = Quantity("face_K_T", "N/mm", "K_T of a face")
FACE_K_T_ALONG = Quantity("face_K_T_along", "N/mm", "K_T of a face along the damper")
FACE_N = Quantity("face_N", "N", "normal force of the face")
FACE_T = Quantity("face_T", "N", "friction up the slope")
FACE_T_ALONG = Quantity("face_T_along", "N", "friction along the damper")
LOWEST_FACE_N = Quantity("lowest_face_N", "N", "lowest normal force")
HIGHEST_FACE_N = Quantity("highest_face_N", "N", "highest normal force")
LOWEST_FACE_T = Quantity("lowest_face_T", "N", "lowest friction")
HIGHEST_FACE_T = Quantity("highest_face_T", "N", "highest friction")
LEG_K_N = Quantity("leg_K_N", "N/mm", "K_N from platform to platform, x")
LEG_K_T = Quantity("leg_K_T", "N/mm", "K_T from platform to platform, z")
LEG_K_T_ALONG = Quantity("leg_K_T_along", "N/mm", "K_T from platform to platform, y")
SLIP_SHARE = Quantity("slip_share", "%", "slipping share of the contact", in_percent=True)
DAMPER_SHIFT = Quantity("damper_u{n}", "um", "damper, u{n}")
DAMPER_TURN = Quantity("damper_r{n}", "mrad", "damper, rotation about {n}")
SHIFT_STATIC = Quantity("damper_u{n}_static", "um", "damper, u{n}, static")
TURN_STATIC = Quantity("damper_r{n}_static", "mrad", "damper, rotation about {n}, static")
SEATING_LOSS = Quantity("seating_loss", "N mm", "friction loss of the seating loop")
FRICTION_ENERGY = Quantity("friction_energy", "N mm", "friction loss per cycle")
MOVED_STIFFNESS = Quantity("moved_stiffness", "N/mm", "force over shift, largest to largest")

# -- forced response -------------------------------------------------------------------------------

STATIC_N = Quantity("static_N", "N", "static normal force of a face")
STATIC_T = Quantity("static_T", "N", "static friction of a face")
STUCK_IN_PHASE = Quantity("stuck_in_phase", "Hz", "stuck, blades in phase")
STUCK_OUT_OF_PHASE = Quantity("stuck_out_of_phase", "Hz", "stuck, blades out of phase")
EXCITATION_FORCE = Quantity("excitation_force", "N", "excitation force F_E")
PATH_POINTS = Quantity("path_points", words="points on the path")
CURVE_SECONDS = Quantity("curve_seconds", "s", "time for the curve")
PEAK_FREQUENCY = Quantity("peak_{n}_frequency", "Hz", "peak {n}, frequency")
PEAK_ACCELERANCE = Quantity("peak_{n}_accelerance", "(m/s2)/N", "peak {n}, accelerance")
PEAK_MAC = Quantity("peak_{n}_mac", words="peak {n}, MAC with its stuck mode", is_error=True)
SWEEP_UP_FREQUENCY = Quantity("peak_{n}_sweep_up_frequency", "Hz", "peak {n}, sweep up, frequency")
SWEEP_UP_ACCELERANCE = Quantity(
    "peak_{n}_sweep_up_accelerance", "(m/s2)/N", "peak {n}, sweep up, accelerance"
)
FREQUENCY_CHANGE = Quantity("peak_{n}_frequency_change", "%", "peak {n}, change of frequency")
ACCELERANCE_CHANGE = Quantity("peak_{n}_accelerance_change", "%", "peak {n}, change of accelerance")
BAND_FREQUENCY = Quantity("band_peak_{n}_frequency", "Hz")
BAND_ACCELERANCE = Quantity("band_peak_{n}_accelerance", "(m/s2)/N")
HARMONIC_FREQUENCY = Quantity("harmonic_{n}_frequency", "Hz")
HARMONIC_ACCELERANCE = Quantity("harmonic_{n}_accelerance", "(m/s2)/N")
REDUCTION = Quantity("reduction_of_free_peak", "%", "reduction of the free peak")
CONTACT_SLIP = Quantity("contact_slip", "%", "slipping share of the contact")
CONTACT_LIFT = Quantity("contact_lift", "%", "open share of the contact")
LOWEST_RATIO = Quantity("lowest_ratio_reached", words="lowest F_C/F_E reached")
HIGHEST_RATIO = Quantity("highest_ratio_reached", words="highest F_C/F_E reached")
BEST_RATIO = Quantity("best_ratio", words="best F_C/F_E")
BEST_PEAK = Quantity("best_peak", "(m/s2)/N", "worst peak at the best F_C/F_E")
BEST_FREQUENCY = Quantity("best_frequency", "Hz", "frequency of that peak")
BEST_REDUCTION = Quantity("best_reduction", "%", "of the free peak")
BEST_INSIDE = Quantity("best_inside", words="best F_C/F_E lies within the curve")
HALF_OF_BEST = Quantity("half_of_best_ratio", "%", "worst peak at half of the best F_C/F_E")
TWICE_THE_BEST = Quantity("twice_the_best_ratio", "%", "worst peak at twice the best F_C/F_E")
#: of the performance curve
BEST = (BEST_RATIO, BEST_PEAK, BEST_FREQUENCY, BEST_REDUCTION, HALF_OF_BEST, TWICE_THE_BEST)

LARGEST_DAMPING = Quantity("largest_damping", "%", "largest damping ratio over the amplitude")
DAMPING_ACCELERATION = Quantity("damping_acceleration", "m/s2", "amplitude of the largest damping")
DAMPING_FREQUENCY = Quantity("damping_frequency", "Hz", "frequency at the largest damping")
DAMPING_SHIFT = Quantity("damping_shift", "%", "its change from the stuck mode")
FORCE_FOR_DAMPING = Quantity("force_for_damping", "N/(m/s2)", "F_C per amplitude damped most")

# -- beside measured curves ------------------------------------------------------------------------

FRAC = Quantity("frac", words="FRAC with the measured curve")
MAGNITUDE_CORRELATION = Quantity("magnitude_correlation", words="correlation of magnitudes")
COMPUTED_FREQUENCY = Quantity("computed_peak_frequency", "Hz", "computed peak frequency")
COMPUTED_ACCELERANCE = Quantity("computed_peak_accelerance", "(m/s2)/N", "computed accelerance")
FREQUENCY_DIFFERENCE = Quantity("peak_frequency_difference", "Hz", "less measured", is_error=True)
HALF_POWER_DAMPING = Quantity("half_power_damping", "%", "damping ratio by half power")
FITTED_DAMPING = Quantity("fitted_damping", "%", "damping ratio fitted to the measured curve")
FITTED_FREQUENCY = Quantity("fitted_frequency", "Hz", "natural frequency fitted to the curve")
FITTED_NOISE = Quantity("fitted_noise", "%", "noise of the measured curve, part of the value")
NOISE_CONSTANT = Quantity("fitted_noise_constant", "(m/s2)/N", "noise of the curve, constant")

DECLARED = {one.name: one for one in list(vars().values()) if isinstance(one, Quantity)}


@cache
def quantity_of(name: str) -> tuple[Quantity, str]:
    """What a name declares, and its {n}; a quantity without words for a name of no declaration."""
    if name in DECLARED:
        return DECLARED[name], ""
    for one in DECLARED.values():
        if (n := one.number_of(name)) is not None:
            return one, n
    if name.startswith(LEFT):
        found, n = quantity_of(name.removeprefix(LEFT))
        return found.on("left"), n
    return Quantity(name), ""


def number_label(name: str) -> str:
    """Words for the name of a number."""
    quantity, n = quantity_of(name)
    return quantity.label(n)


def number_title(name: str, case: str) -> str:
    """Words for a number of a case."""
    return f"{number_label(name)} ({case})" if case else number_label(name)
