"""Contact stiffness, and the approach split between the contact and the finite bodies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upd.errors import MeshError
from upd.reference import boussinesq, cerruti

Array = NDArray[np.float64]

# Where the field of the finite body is compared with the half-space, in depths of the body: nearer
# the mesh of the contact is felt, deeper the comparison has left the region the contact sees. Never
# nearer than 2a.
_NEAR, _FAR = 0.1, 0.35


@dataclass(frozen=True)
class BodyShare:
    """What one body adds to the approach (or to the tangential displacement).

    Attributes
    ----------
    compression : float
        Displacement at depth 3a relative to the far-field support [mm], positive into the body: the
        thesis's phi (section 6.5).
    finite_body : float
        Displacement of the finite, held body minus that of the half-space held at infinity, at the
        surface [mm], positive into the body (`upd.contact.bulk.finite_body_share`).
    fitted : float
        The same read off the computed displacement along the axis [mm]: with the error of the mesh
        far from the contact.
    """

    compression: float
    finite_body: float
    fitted: float

    @property
    def far_mesh(self) -> float:
        """What the mesh far from the contact adds by its coarseness [mm]."""
        return self.fitted - self.finite_body

    def over(self, load: float) -> BodyShare:
        """The same per load [mm/N]."""
        return BodyShare(self.compression / load, self.finite_body / load, self.fitted / load)


def axis_share(
    depth: Array, displacement: Array, half_space: Array, radius: float
) -> tuple[float, float]:
    """Displacement at depth 3a, and share of one body read off the displacement along its axis.

    Parameters
    ----------
    depth : (k,) ndarray
        Increasing depths on the axis [mm].
    displacement : (k,) ndarray
        Displacements of the body there, relative to the far-field support [mm].
    half_space : (k,) ndarray
        Displacements of the half-space there, relative to infinity [mm].
    radius : float
        Contact radius a [mm].

    Returns
    -------
    compression, fitted : float
        As `BodyShare` has them [mm].

    Raises
    ------
    MeshError
        With fewer than two nodes between a tenth and a third of the body's depth and below 2a.

    Notes
    -----
    The difference of the two fields solves the equations of elasticity without the concentrated
    load: it is smooth at the contact, so a parabola through a tenth to a third of the body's depth
    gives it at the surface, free of the mesh near the contact, but not of the mesh beyond. At depth
    3a, 23 % of a half-space's displacement is still to come, so ``compression`` alone cannot be
    compared with Hertz's approach.

    References
    ----------
    K. L. Johnson, Contact Mechanics (1985), section 3.4.
    """
    body = float(depth.max())
    chosen = (depth >= max(_NEAR * body, 2.0 * radius)) & (depth <= _FAR * body)
    if chosen.sum() < 2:
        raise MeshError(
            f"{int(chosen.sum())} nodes on the axis between a tenth and a third of the "
            f"body's depth {body:.4g} mm and below 2a "
            f"(a = {radius:.4g} mm): the body is too small or too coarse to separate its "
            "own compression; "
            "lower geometry.growth or leave out body_compression and stiffness"
        )
    # A straight line when a coarse mesh has only two nodes there.
    curve = np.polyfit(
        depth[chosen], (displacement - half_space)[chosen], min(2, int(chosen.sum()) - 1)
    )
    return float(np.interp(3.0 * radius, depth, displacement)), float(curve[-1])


def axis_half_space(
    depth: Array, positions: Array, forces: Array, E: float, nu: float, *, tangential: bool
) -> Array:
    """Displacement of a half-space along the load, on the axis below the origin.

    Parameters
    ----------
    depth : (k,) ndarray
        Depths below the origin [mm].
    positions : (n, 2) ndarray
        Places of the forces on the surface [mm].
    forces : (n,) ndarray
        Forces [N].
    E, nu : float
        Young's modulus [MPa] and Poisson's ratio.
    tangential : bool
        Whether the forces act along x (Cerruti) or normal to the surface (Boussinesq).

    Returns
    -------
    (k,) ndarray
        Displacement along the load [mm].

    References
    ----------
    K. L. Johnson, Contact Mechanics (1985), sections 3.2 and 3.6.
    """
    loaded = forces != 0.0
    x, y, f = -positions[loaded, 0], -positions[loaded, 1], forces[loaded]
    z = depth[:, None]
    if tangential:
        return np.asarray(cerruti(x, y, z, 1.0, E, nu)[0] @ f)
    return np.asarray(boussinesq(x, y, z, 1.0, E, nu)[2] @ f)


def without_body(stiffness: float, body_compliance: float) -> float:
    """Stiffness of the contact alone, bulk compliance removed.

    Parameters
    ----------
    stiffness : float
        Stiffness of contact and bodies in series [N/mm].
    body_compliance : float
        Compliance that the bodies add in series [mm/N].

    Returns
    -------
    float
        Stiffness [N/mm].
    """
    return 1.0 / (1.0 / stiffness - body_compliance)
