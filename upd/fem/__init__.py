"""Mesh -> K, M: elements, materials, assembly, surface integrals."""

from upd.fem.assembly import mass as mass
from upd.fem.assembly import modal_damping as modal_damping
from upd.fem.assembly import stiffness as stiffness
from upd.fem.box import box_mesh as box_mesh
from upd.fem.elements import ELEMENTS as ELEMENTS
from upd.fem.elements import Material as Material
from upd.fem.inertia import MassProperties as MassProperties
from upd.fem.inertia import mass_properties as mass_properties
from upd.fem.inertia import rigid_body_modes as rigid_body_modes
from upd.fem.surface import face_mass as face_mass
from upd.fem.surface import traction_weights as traction_weights
