"""What plans and runs say of the force that presses a damper between two blades."""

from __future__ import annotations

from typing import Any

from upd.analyses.base import Effect
from upd.labels import number
from upd.scene.rotation import damper_mass
from upd.units import UNITS


def centrifugal_words(scene: Any, mass: float | None) -> str:
    """F_C, where it comes from, and the damper's mass.

    Parameters
    ----------
    scene
        A forced response or a seated damper.
    mass
        Of the damper, t; None where it is not known.
    """
    damper = scene.damper
    force, grams = number(damper.centrifugal, "N"), "" if mass is None else number(1e6 * mass, "g")
    if damper.speed is None or damper.radius is None:
        return f"{force}, damper {grams}" if grams else force
    rpm = damper.speed / UNITS["speed"]["rpm"]
    return f"{force} = m r w^2: damper {grams}, {damper.radius:.6g} mm, {rpm:.6g} rpm"


def centrifugal_effects(scene: Any) -> list[Effect]:
    """F_C and the damper's mass, and that nothing else of the rotation counts.

    Parameters
    ----------
    scene
        A forced response or a seated damper.
    """
    pulled = "the rig does not turn: wires pull the damper with F_C"
    turns = "F_C on the damper alone: the blades are those at rest"
    return [
        Effect("centrifugal force", True, centrifugal_words(scene, damper_mass(scene))),
        Effect("rotation", False, pulled if scene.damper.speed is None else turns, applies=False),
    ]
