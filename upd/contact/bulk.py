"""What a finite, held body adds to the displacement at its contact, compared with a half-space: the
approach split between the contact and the bodies.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upd.contact.model import Body
from upd.contact.patch import Patch
from upd.errors import MeshError
from upd.fem.elements import gauss
from upd.mesh.hexmesh import boundary_faces
from upd.reference import boussinesq, boussinesq_stress, cerruti, cerruti_stress, love_rectangle

Array = NDArray[np.float64]

# Coordinates that should agree do so to this part of the body's size: the rounding of a mesher.
_ROUNDING = 1e-9
# Where the field of the finite body is compared with the half-space, in depths of the body: nearer
# the mesh of the contact is felt, deeper the comparison has left the region the contact sees. Never
# nearer than 2a.
_NEAR, _FAR = 0.1, 0.35


def finite_body_share(
    body: Body,
    displacement: Array,
    forces: Array,
    patch: Patch,
    radius: float,
    E: float,
    nu: float,
    *,
    tangential: bool,
) -> float:
    """Mean displacement at the contact that the finite, held body adds to the half-space's.

    The difference w of the two fields under the same contact forces carries no contact force: it
    has minus the half-space's tractions t_B on the free faces, and minus its displacement u_B
    where the body is held. Betti's theorem with the body's own displacement v, which is known, and
    its reactions R gives the mean of w weighted by the contact forces f of the sum F,

        F w = sum(f w) = - int_free v . t_B dA + sum_held R . u_B,

    exactly the answer of a solve for w on this mesh, without one. A body held in the weighted mean
    moves there, but sum(R . v) = 0 all the same: the formula stands with these faces as free ones.
    w is smooth and small, so its error on a coarse mesh is a small part of a small number; the
    error of v near the contact and far from it is not in it.

    Parameters
    ----------
    body : Body
    displacement : (n_node, 3) ndarray
        v [mm], of the model, which mirror symmetry may make a part of the whole.
    forces : (len(X), len(Y)) ndarray
        Forces [N] of the whole contact. Outside the contact circle the half-space carries their
        resultant: for Hertz's pressure exact on the surface, else to the order of (a / distance)^2.
    patch : Patch
    radius : float
        Contact radius a [mm]; faces within it belong to the contact.
    E, nu : float
        Young's modulus [MPa] and Poisson's ratio.
    tangential : bool
        Whether the forces act along x or normal to the contact.

    Returns
    -------
    float
        mm, positive along the force on the body.

    Raises
    ------
    MeshError
        When the body reaches beyond its contact plane: no half-space covers it.

    References
    ----------
    K. L. Johnson, Contact Mechanics (1985), sections 3.2 and 3.6; Betti's theorem: S. P.
    Timoshenko, J. N. Goodier, Theory of Elasticity (1970), section 93.
    """
    total = float(forces.sum())
    centre = (*(forces.ravel() @ patch.points() / total), 0.0)
    into = np.array([1.0, 1.0, body.side])
    x, v = body.mesh.points * into - centre, displacement * into
    size = _ROUNDING * float(np.ptp(x, axis=0).max())
    if x[:, 2].min() < -size:
        raise MeshError("the body reaches beyond the plane of its contact")
    x[:, 2] = np.maximum(x[:, 2], 0.0)
    stress, field = (cerruti_stress, cerruti) if tangential else (boussinesq_stress, boussinesq)
    free = _free_faces(body, x, patch, radius, size)
    points, outward, moved = _at_quadrature(x[free], v[free], body.side)
    x1, x2, x3 = points.T
    sigma = stress(x1, x2, x3, total, nu)
    work = -float(np.einsum("qi,qij,qj->", moved, sigma, outward))
    distant = body.mesh.nodes["distant"]
    reaction = (body.K @ displacement.ravel()).reshape(-1, 3)[distant] * into
    x1, x2, x3 = x[distant].T
    half_space = np.stack(np.broadcast_arrays(*field(x1, x2, x3, total, E, nu)), axis=1)
    copies = (1 + patch.mirrored[0]) * (1 + patch.mirrored[1])
    return copies * (work + float((reaction * half_space).sum())) / total


def _free_faces(
    body: Body, x: Array, patch: Patch, radius: float, size: float
) -> NDArray[np.int64]:
    """Corners (n, 4) of the faces that are neither held, nor cuts, nor inside the contact."""
    quads = boundary_faces(body.mesh)[:, :4]
    held = np.zeros(body.mesh.n_node, bool)
    if "distant" not in body.mesh.weights:
        held[body.mesh.nodes["distant"]] = True
    corners = body.mesh.points[quads]
    cut = np.zeros(len(quads), bool)
    for axis, mirrored in enumerate(patch.mirrored):
        if mirrored:
            cut |= (np.abs(corners[:, :, axis]) <= size).all(axis=1)
    middle = x[quads].mean(axis=1)
    inside = np.linalg.norm(middle, axis=1) <= radius
    return np.asarray(quads[~(held[quads].all(axis=1) | cut | inside)])


def _at_quadrature(x: Array, v: Array, side: int) -> tuple[Array, Array, Array]:
    """Points, outward normals times area, and displacements at 2 x 2 Gauss points of quadrilaterals
    (n, 4, 3), in coordinates that point into the half-space.
    """
    places, weights = gauss(2, 2)
    s, t = places
    values = np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t])
    along = np.stack([t - 1, 1 - t, t, -t])
    across = np.stack([s - 1, -s, s, 1 - s])
    normal = np.cross(np.einsum("aq,fai->fqi", along, x), np.einsum("aq,fai->fqi", across, x)) * (
        side * weights[:, None]
    )
    points, moved = (np.einsum("aq,fai->fqi", values, field) for field in (x, v))
    return points.reshape(-1, 3), normal.reshape(-1, 3), moved.reshape(-1, 3)


def half_space_mean(patch: Patch, forces: Array, E: float, nu: float) -> float:
    """Mean displacement of a half-space under normal forces spread over their lattice cells.

    Parameters
    ----------
    patch : Patch
        With evenly spaced lines.
    forces : (len(X), len(Y)) ndarray
        N.
    E, nu : float
        Young's modulus [MPa] and Poisson's ratio.

    Returns
    -------
    float
        sum(f u) / sum(f) [mm].

    References
    ----------
    K. L. Johnson, Contact Mechanics (1985), eq. (3.25).
    """
    # slow to import: only where it is called
    from scipy.signal import fftconvolve

    nx, ny = forces.shape
    dx, dy = (float(np.diff(lines).mean()) for lines in (patch.X, patch.Y))
    x, y = np.meshgrid(np.arange(1 - nx, nx) * dx, np.arange(1 - ny, ny) * dy, indexing="ij")
    influence = love_rectangle(x, y, dx / 2, dy / 2, 1.0 / (dx * dy), E, nu)
    u = fftconvolve(forces, influence)[nx - 1 : 2 * nx - 1, ny - 1 : 2 * ny - 1]
    return float((forces * u).sum() / forces.sum())


@dataclass(frozen=True)
class BodyShare:
    """What one body adds to the approach.

    Attributes
    ----------
    compression : float
        Displacement at depth 3a relative to the far-field support [mm], positive into the body: the
        thesis's phi (section 6.5).
    finite_body : float
        Displacement of the finite, held body minus that of the half-space held at infinity, at the
        surface [mm], positive into the body (`finite_body_share`).
    fitted : float
        The same read off the computed displacement along the axis [mm]: less `finite_body` it is
        what the mesh far from the contact adds by its coarseness.
    """

    compression: float
    finite_body: float
    fitted: float

    def over(self, load: float) -> BodyShare:
        """The same per load [mm/N]."""
        return BodyShare(self.compression / load, self.finite_body / load, self.fitted / load)


def body_share(
    body: Body, displacement: Array, forces: Array, patch: Patch, radius: float, E: float, nu: float
) -> BodyShare:
    """What a body with an axis adds to the approach, from its displacement under normal forces.

    Parameters
    ----------
    body, displacement, forces, patch, radius, E, nu
        As `finite_body_share` takes them.

    Raises
    ------
    MeshError
        As `finite_body_share`, and with fewer than two nodes between a tenth and a third of the
        body's depth and below 2a.

    Notes
    -----
    The difference of its field and a half-space's, relative to the far-field support and to
    infinity, solves the equations of elasticity without the concentrated load: it is smooth at the
    contact, so a parabola through a tenth to a third of the body's depth gives it at the surface,
    free of the mesh near the contact, but not of the mesh beyond. At depth 3a, 23 % of a
    half-space's displacement is still to come, so ``compression`` alone cannot be compared with
    Hertz's approach.

    References
    ----------
    K. L. Johnson, Contact Mechanics (1985), sections 3.2 and 3.4.
    """
    axis, loaded = body.mesh.nodes["axis"], forces.ravel() != 0.0
    depth, along = np.abs(body.mesh.points[axis, 2]), body.side * displacement[axis, 2]
    deepest = float(depth.max())
    chosen = (depth >= max(_NEAR * deepest, 2.0 * radius)) & (depth <= _FAR * deepest)
    if chosen.sum() < 2:
        raise MeshError(
            f"{int(chosen.sum())} nodes on the axis between a tenth and a third of the "
            f"body's depth {deepest:.4g} mm and below 2a "
            f"(a = {radius:.4g} mm): the body is too small or too coarse to separate its "
            "own compression; "
            "lower geometry.growth or leave out body_compression and stiffness"
        )
    x, y = -patch.points()[loaded].T
    z = depth[chosen]
    half_space = boussinesq(x, y, z[:, None], 1.0, E, nu)[2] @ forces.ravel()[loaded]
    # A straight line when a coarse mesh has only two nodes there.
    curve = np.polyfit(z, along[chosen] - half_space, min(2, len(z) - 1))
    return BodyShare(
        float(np.interp(3.0 * radius, depth, along)),
        finite_body_share(body, displacement, forces, patch, radius, E, nu, tangential=False),
        float(curve[-1]),
    )
