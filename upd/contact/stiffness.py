"""Contact stiffness, and the approach split into what the contact does and what the finite bodies do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upd.errors import MeshError
from upd.reference import boussinesq, cerruti

Array = NDArray[np.float64]

# Where the field of the finite body is compared with the half-space, in depths of the body: nearer the mesh of the contact is felt,
# deeper the comparison has left the region the contact sees. Never nearer than 2a.
_NEAR, _FAR = 0.1, 0.35


@dataclass(frozen=True)
class BodyShare:
    """What one body adds to the approach (or to the tangential displacement). Lengths in mm, positive into the body.

    compression : displacement at depth 3a relative to the distant set, the thesis's phi (section 6.5).
    finite_body : displacement of the finite, held body minus that of the half-space held at infinity, at the surface.
    """

    compression: float
    finite_body: float


def body_share(depth: Array, displacement: Array, half_space: Array, radius: float) -> BodyShare:
    """Share of one body from the displacement along its axis.

    depth, displacement, half_space : (k,) in mm, increasing depth; displacements relative to the distant set and to infinity.
    radius : contact radius a in mm.

    The difference of the two fields solves the equations of elasticity without the concentrated load: it is smooth at the contact, so a
    parabola through a tenth to a third of the body's depth gives it at the surface, free of the mesh near the contact. At depth 3a,
    23 % of a half-space's displacement is still to come (K. L. Johnson, Contact Mechanics, 1985, section 3.4), so ``compression`` alone
    cannot be compared with Hertz's approach.
    """
    body = float(depth.max())
    chosen = (depth >= max(_NEAR * body, 2.0 * radius)) & (depth <= _FAR * body)
    if chosen.sum() < 2:
        raise MeshError(
            f"{int(chosen.sum())} nodes on the axis between a tenth and a third of the body's depth {body:.4g} mm and below 2a "
            f"(a = {radius:.4g} mm): the body is too small or too coarse to separate its own compression; "
            "lower geometry.growth or leave out body_compression and stiffness"
        )
    # A straight line when a coarse mesh has only two nodes there.
    curve = np.polyfit(depth[chosen], (displacement - half_space)[chosen], min(2, int(chosen.sum()) - 1))
    return BodyShare(float(np.interp(3.0 * radius, depth, displacement)), float(curve[-1]))


def axis_half_space(depth: Array, positions: Array, forces: Array, E: float, nu: float, *, tangential: bool) -> Array:
    """Displacement (k,) in mm along the load at depths (k,) below the origin of a half-space loaded by ``forces`` (n,) at (n, 2).

    Boussinesq's and Cerruti's solutions (K. L. Johnson, Contact Mechanics, 1985, sections 3.2 and 3.6).
    """
    loaded = forces != 0.0
    x, y, f = -positions[loaded, 0], -positions[loaded, 1], forces[loaded]
    z = depth[:, None]
    if tangential:
        return np.asarray(cerruti(x, y, z, 1.0, E, nu)[0] @ f)
    return np.asarray(boussinesq(x, y, z, 1.0, E, nu)[2] @ f)


def without_body(stiffness: float, body_compliance: float) -> float:
    """Stiffness in N/mm of the contact alone from that of the chain and the compliance in mm/N that the bodies add in series."""
    return 1.0 / (1.0 / stiffness - body_compliance)
