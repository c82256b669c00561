"""Closed forms to compare with: pure functions on floats and arrays, in mm, N, MPa, t, s.

hertz, mindlin, yielding, half_space, half_space_stress: elastic contact; friction, den_hartog:
oscillators with dry friction;
printed: printed values of the source, by scene and number.
"""

from upd.reference.den_hartog import (
    den_hartog_amplitude,
    den_hartog_functions,
    den_hartog_phase,
    den_hartog_stop_limit,
)
from upd.reference.friction import (
    critical_amplitude,
    jenkins_force,
    jenkins_frequencies,
    jenkins_harmonic,
    jenkins_loop_area,
    jenkins_optimum,
    jenkins_optimum_frequency,
    jenkins_peak,
    jenkins_peak_frequency,
)
from upd.reference.half_space import (
    boussinesq,
    boussinesq_stress,
    cerruti,
    cerruti_rectangle,
    cerruti_stress,
    half_space_compliance,
    love_rectangle,
    pressure_shift_rectangle,
)
from upd.reference.half_space_stress import (
    cerruti_rectangle_stress,
    love_rectangle_stress,
    von_mises,
)
from upd.reference.hertz import (
    HertzPoint,
    contact_modulus,
    dundurs_alpha,
    dundurs_beta,
    effective_radius,
    hertz_axial_displacement,
    hertz_load,
    hertz_pressure,
    hertz_sphere,
    hertz_surface_displacement,
    punch_load,
    punch_pressure,
    sphere_gap,
)
from upd.reference.mindlin import cycle_energy as mindlin_cycle_energy
from upd.reference.mindlin import displacement as mindlin_displacement
from upd.reference.mindlin import (
    initial_tangential_stiffness,
    shear_modulus,
    stick_radius,
    stiffness_ratio,
    tangential_compliance_modulus,
)
from upd.reference.mindlin import loop as mindlin_loop
from upd.reference.mindlin import reloading as mindlin_reloading
from upd.reference.mindlin import traction as mindlin_traction
from upd.reference.mindlin import unloading as mindlin_unloading
from upd.reference.mindlin import unloading_traction as mindlin_unloading_traction
from upd.reference.printed import (
    THESIS_COMPRESSION,
    THESIS_CONTACT_STIFFNESS,
    THESIS_FREQUENCIES,
    THESIS_HERTZ,
    THESIS_STEEL,
    THESIS_STIFFNESS,
    Printed,
    printed_values,
)
from upd.reference.spence import sticking_part
from upd.reference.yielding import (
    YieldPoint,
    hertz_axis_stress,
    hertz_yield_load,
    hertz_yield_point,
)

__all__ = [
    "THESIS_COMPRESSION",
    "THESIS_CONTACT_STIFFNESS",
    "THESIS_FREQUENCIES",
    "THESIS_HERTZ",
    "THESIS_STEEL",
    "THESIS_STIFFNESS",
    "HertzPoint",
    "Printed",
    "YieldPoint",
    "boussinesq",
    "boussinesq_stress",
    "cerruti",
    "cerruti_rectangle",
    "cerruti_rectangle_stress",
    "cerruti_stress",
    "contact_modulus",
    "critical_amplitude",
    "den_hartog_amplitude",
    "den_hartog_functions",
    "den_hartog_phase",
    "den_hartog_stop_limit",
    "dundurs_alpha",
    "dundurs_beta",
    "effective_radius",
    "half_space_compliance",
    "hertz_axial_displacement",
    "hertz_axis_stress",
    "hertz_load",
    "hertz_pressure",
    "hertz_sphere",
    "hertz_surface_displacement",
    "hertz_yield_load",
    "hertz_yield_point",
    "initial_tangential_stiffness",
    "jenkins_force",
    "jenkins_frequencies",
    "jenkins_harmonic",
    "jenkins_loop_area",
    "jenkins_optimum",
    "jenkins_optimum_frequency",
    "jenkins_peak",
    "jenkins_peak_frequency",
    "love_rectangle",
    "love_rectangle_stress",
    "mindlin_cycle_energy",
    "mindlin_displacement",
    "mindlin_loop",
    "mindlin_reloading",
    "mindlin_traction",
    "mindlin_unloading",
    "mindlin_unloading_traction",
    "pressure_shift_rectangle",
    "printed_values",
    "punch_load",
    "punch_pressure",
    "shear_modulus",
    "sphere_gap",
    "stick_radius",
    "sticking_part",
    "stiffness_ratio",
    "tangential_compliance_modulus",
    "von_mises",
]
