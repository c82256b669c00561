"""The damper of a scene as a rigid body between two faces, measured on the scene's mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from upd.analyses.seated.balance import face_angles
from upd.analyses.seated.lattice import patch_frame
from upd.contact.damper_section import DamperSection, FaceSection
from upd.errors import InputError
from upd.fem import Material, mass_properties
from upd.mesh import FloatArray, Mesh, recipes
from upd.scene import AnyScene
from upd.scene.forced import FORCED
from upd.scene.forced_contact import SIDES
from upd.scene.rig import rig_parameters
from upd.scene.seated import SEATED

_ACROSS = [0, 2]


@dataclass(frozen=True)
class SceneDamper:
    """The damper of a scene.

    Attributes
    ----------
    section : DamperSection
        Its faces, seen from its centre of mass.
    mass : float
        t.
    """

    section: DamperSection
    mass: float


def scene_damper(scene: AnyScene) -> SceneDamper:
    """Faces, centre of mass and mass of the damper between two blades.

    Parameters
    ----------
    scene
        A forced response or a seated damper.

    Raises
    ------
    InputError
        For a scene without a damper between two blades.
    """
    if scene.analysis not in (FORCED, SEATED):
        raise InputError(
            f"scene {scene.name}: has no damper between two blades (it is a {scene.analysis}); "
            f'to fix it: take one with analysis = "{FORCED}" or "{SEATED}", for example '
            "symmetric-response"
        )
    meshes, _ = recipes.build_mesh(scene.recipe, rig_parameters(scene, "full", 8))
    of: Any = scene
    material = Material(of.material.E, of.material.nu, of.damper.density or of.material.density)
    body = mass_properties(meshes["damper"], material)
    return SceneDamper(section_of(meshes, body.centre), body.mass)


def section_of(meshes: Mapping[str, Mesh], centre: FloatArray) -> DamperSection:
    """Faces of a damper from the patches of the blades' meshes.

    Parameters
    ----------
    meshes
        "left" and "right" with their faces "patch".
    centre : (3,) ndarray
        The damper's centre of mass, mm.
    """
    frames = np.stack([patch_frame(meshes[side]) for side in SIDES])
    faces = []
    for side, frame, angle in zip(SIDES, frames, face_angles(frames), strict=True):
        mesh = meshes[side]
        points = mesh.points[np.unique(mesh.faces["patch"][:, :4])] @ frame.T
        low, high = points[:, 2].min(), points[:, 2].max()
        middle = (0.5 * (low + high) * frame[2] + points[:, 0].mean() * frame[0])[_ACROSS]
        x, z = middle - np.asarray(centre)[_ACROSS]
        faces.append(FaceSection(angle, (float(x), float(z)), 0.5 * float(high - low)))
    return DamperSection(*faces)
