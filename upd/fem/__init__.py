"""Mesh -> K, M: elements, materials, assembly, surface integrals."""

from upd.fem.assembly import mass, modal_damping, stiffness
from upd.fem.box import box_mesh
from upd.fem.elements import ELEMENTS
from upd.fem.inertia import MassProperties, mass_properties, rigid_body_modes
from upd.fem.material import Material
from upd.fem.surface import face_mass, traction_weights

__all__ = [
    "ELEMENTS",
    "MassProperties",
    "Material",
    "box_mesh",
    "face_mass",
    "mass",
    "mass_properties",
    "modal_damping",
    "rigid_body_modes",
    "stiffness",
    "traction_weights",
]
