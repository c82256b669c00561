"""Closed forms to compare with: pure functions on floats and arrays, in mm, N, MPa, t, s.

hertz, mindlin, half_space: elastic contact; friction: oscillators with dry friction;
printed: printed values of the source, by scene and number.
"""

from upd.reference import mindlin as mindlin
from upd.reference.friction import critical_amplitude as critical_amplitude
from upd.reference.friction import den_hartog_amplitude as den_hartog_amplitude
from upd.reference.friction import den_hartog_functions as den_hartog_functions
from upd.reference.friction import den_hartog_phase as den_hartog_phase
from upd.reference.friction import den_hartog_stop_limit as den_hartog_stop_limit
from upd.reference.friction import jenkins_force as jenkins_force
from upd.reference.friction import jenkins_frequencies as jenkins_frequencies
from upd.reference.friction import jenkins_harmonic as jenkins_harmonic
from upd.reference.friction import jenkins_loop_area as jenkins_loop_area
from upd.reference.friction import jenkins_optimum as jenkins_optimum
from upd.reference.friction import jenkins_optimum_frequency as jenkins_optimum_frequency
from upd.reference.friction import jenkins_peak as jenkins_peak
from upd.reference.friction import jenkins_peak_frequency as jenkins_peak_frequency
from upd.reference.half_space import boussinesq as boussinesq
from upd.reference.half_space import boussinesq_stress as boussinesq_stress
from upd.reference.half_space import cerruti as cerruti
from upd.reference.half_space import cerruti_rectangle as cerruti_rectangle
from upd.reference.half_space import cerruti_rectangle_stress as cerruti_rectangle_stress
from upd.reference.half_space import cerruti_stress as cerruti_stress
from upd.reference.half_space import half_space_compliance as half_space_compliance
from upd.reference.half_space import love_rectangle as love_rectangle
from upd.reference.half_space import love_rectangle_stress as love_rectangle_stress
from upd.reference.half_space import pressure_shift_rectangle as pressure_shift_rectangle
from upd.reference.half_space import von_mises as von_mises
from upd.reference.hertz import HertzPoint as HertzPoint
from upd.reference.hertz import contact_modulus as contact_modulus
from upd.reference.hertz import dundurs_beta as dundurs_beta
from upd.reference.hertz import hertz_axial_displacement as hertz_axial_displacement
from upd.reference.hertz import hertz_axis_stress as hertz_axis_stress
from upd.reference.hertz import hertz_load as hertz_load
from upd.reference.hertz import hertz_pressure as hertz_pressure
from upd.reference.hertz import hertz_sphere as hertz_sphere
from upd.reference.hertz import hertz_surface_displacement as hertz_surface_displacement
from upd.reference.hertz import hertz_yield_load as hertz_yield_load
from upd.reference.hertz import hertz_yield_point as hertz_yield_point
from upd.reference.hertz import punch_load as punch_load
from upd.reference.hertz import punch_pressure as punch_pressure
from upd.reference.hertz import sphere_gap as sphere_gap
from upd.reference.hertz import sticking_part as sticking_part
from upd.reference.mindlin import initial_tangential_stiffness as initial_tangential_stiffness
from upd.reference.mindlin import stick_radius as stick_radius
from upd.reference.mindlin import tangential_compliance_modulus as tangential_compliance_modulus
from upd.reference.printed import THESIS_COMPRESSION as THESIS_COMPRESSION
from upd.reference.printed import THESIS_CONTACT_STIFFNESS as THESIS_CONTACT_STIFFNESS
from upd.reference.printed import THESIS_FREQUENCIES as THESIS_FREQUENCIES
from upd.reference.printed import THESIS_HERTZ as THESIS_HERTZ
from upd.reference.printed import THESIS_STEEL as THESIS_STEEL
from upd.reference.printed import THESIS_STIFFNESS as THESIS_STIFFNESS
from upd.reference.printed import printed_values as printed_values

mindlin_cycle_energy = mindlin.cycle_energy
mindlin_displacement = mindlin.displacement
mindlin_loop = mindlin.loop
mindlin_reloading = mindlin.reloading
mindlin_traction = mindlin.traction
mindlin_unloading = mindlin.unloading
mindlin_unloading_traction = mindlin.unloading_traction
