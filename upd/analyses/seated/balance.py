"""Balance of a rigid damper on the faces of a mesh, in closed form."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from upd.contact.equilibrium import FaceForces, equilibrium
from upd.errors import InputError

Array = NDArray[np.float64]
#: state of the damper -> the rigid one beside it; of the seated one friction opposes all it can
RIGID = {
    "seated": "rigid damper, full friction against F_C",
    "opposing": "rigid damper, full friction against F_C",
    "reversed": "rigid damper, full friction along F_C",
    "frictionless": "rigid damper without friction",
}


def face_angles(frames: Array) -> tuple[float, float]:
    """Inclination of left and right face to the horizontal, deg.

    Parameters
    ----------
    frames
        (2, 3, 3) of each face, unit rows: normal into the blade, along the damper, up the slope.
    """
    x, _, z = frames[:, 0].T
    left, right = np.degrees(np.arctan2(np.abs(x), np.maximum(z, 0.0)))
    return float(left), float(right)


def rigid_balance(
    frames: Array, centrifugal: float, friction: float, state: str
) -> FaceForces | None:
    """Forces of a rigid damper that slips on both faces; None where it jams before.

    Parameters
    ----------
    state
        "opposing", "frictionless" or "reversed".
    """
    try:
        return equilibrium(*face_angles(frames), centrifugal, friction, state)
    except InputError:
        return None
