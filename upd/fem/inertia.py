"""Mass properties of a meshed body, exact for the geometry the hexahedra describe.

A body that rotates about the z axis: load, stresses and the stiffness they add.

Steady speed Omega, small vibration about the static state, in axes that rotate with the body [1]_:

    M u'' + 2 Omega M (e_z x u') + (K + K_sigma - Omega^2 M_P) u = f

with M_P the mass of the motion in the plane across the axis (spin softening) and K_sigma the
stiffness of the centrifugal stresses, which come from K u_0 = Omega^2 M_P X. Both grow with
Omega^2. The stiffness of the displaced body, K(F = I + grad u_0) in place of K, and the Coriolis
force may be added.

References
----------
.. [1] O. C. Zienkiewicz, R. L. Taylor, The Finite Element Method, vol. 2 (initial stress).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, diags_array, eye_array, kron

from upd.errors import InputError, MeshError
from upd.fem.assembly import _blocks, _Pattern, _per_hex, _three_components, _weighted_gradients
from upd.fem.elements import BasisMaker, Material, gauss, hex_element
from upd.labels import Shown
from upd.mesh import FloatArray, IntArray, Mesh

# Gauss points per direction that integrate rho x_i x_j |J| exactly: |J| has degree 2 (8 nodes) or 5
# per direction, x_i x_j 2 or 4.
_POINTS = {1: 3, 2: 5}


@dataclass(frozen=True, repr=False)
class MassProperties(Shown):
    """Mass properties of a body.

    Attributes
    ----------
    mass : float
        t.
    volume : float
        mm3.
    centre : (3,) ndarray
        Centre of mass, mm.
    inertia : (3, 3) ndarray
        Inertia tensor about the centre, t mm2 (= 1 kg m2 / 1000); products carry the minus sign,
        I_xy = - int rho x y dV.
    """

    mass: float
    volume: float
    centre: FloatArray
    inertia: FloatArray

    def about(self, point: FloatArray) -> FloatArray:
        """Inertia tensor about another point, by the parallel axes.

        Parameters
        ----------
        point : (3,) array_like
            mm.

        Returns
        -------
        (3, 3) ndarray
            t mm2.
        """
        arm = np.asarray(point, dtype=np.float64) - self.centre
        moved: FloatArray = self.inertia + self.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        return moved

    def with_mirror_image(self, axis: int) -> MassProperties:
        """Those of the body together with its mirror image in the plane of the other two axes.

        The centres lie d to either side of the plane: the whole's lies on it, first moments along
        the axis and the products with it cancel, and m d^2 comes to the moments about axes in the
        plane.

        Parameters
        ----------
        axis : {0, 1, 2}
            Normal of the plane, which holds the origin.

        Returns
        -------
        MassProperties
        """
        sign = np.where(np.arange(3) == axis, -1.0, 1.0)
        centre = np.where(np.arange(3) == axis, 0.0, self.centre)
        moved = self.about(centre)
        return MassProperties(
            2.0 * self.mass, 2.0 * self.volume, centre, moved + np.outer(sign, sign) * moved
        )


def mass_properties(
    mesh: Mesh, material: Material | Sequence[Material], regions: IntArray | None = None
) -> MassProperties:
    """Mass, volume, centre and inertia tensor of a mesh.

    The quadrature is exact for trilinear and triquadratic hexahedra, hence equal to the closed form
    where these fill the body.

    Parameters
    ----------
    mesh : Mesh
        The body.
    material : Material or sequence of Material
        One material, or several with `regions`; only the density counts.
    regions : (n_hex,) array of int, optional
        Material number of each hexahedron.

    Returns
    -------
    MassProperties
        In t, mm3, mm and t mm2.

    Raises
    ------
    InputError
        For materials and regions that do not fit.
    MeshError
        For inverted hexahedra.

    Examples
    --------
    A steel box of 10 x 20 x 30 mm; the first inertia is m (20^2 + 30^2) / 12.

    >>> from upd.fem import Material, box_mesh, mass_properties
    >>> box = box_mesh([0, 10], [0, 20], [0, 30])
    >>> found = mass_properties(box, Material(E=200e3, nu=0.3, rho=7.8e-9))
    >>> print(f"{found.volume:.1f} mm3, {found.mass:.3e} t")
    6000.0 mm3, 4.680e-05 t
    >>> found.centre.round(9).tolist()
    [5.0, 10.0, 15.0]
    >>> print(f"{found.inertia[0, 0] / found.mass:.4f} mm2")
    108.3333 mm2
    """
    element = hex_element(None, mesh)
    rho = _per_hex(mesh, material, regions, "rho")
    maker = BasisMaker(mesh, element)
    X, weights = gauss(_POINTS[mesh.order], 3)
    # Coordinates from a point of the body: far from the origin the parallel axes would cancel
    # digits.
    origin = mesh.points.mean(axis=0)
    volume, mass, first, second = 0.0, 0.0, np.zeros(3), np.zeros((3, 3))
    for block in _blocks(mesh.n_hex, 3 * element.n_node):
        mapping = maker.mapping(block)
        det = mapping.detDF(X)
        worst = det.min(axis=1)
        if not (worst > 0.0).all():
            k = int(worst.argmin())
            raise MeshError(
                f"{int((worst <= 0.0).sum())} hexahedra are inverted or collapsed (worst: "
                f"number {block.start + k}, Jacobian {worst[k]:.3g} mm3): "
                "list the nodes in VTK order, or move the nodes that tangle it."
            )
        dV = det * weights
        dm = rho[block, None] * dV
        x = np.stack([mapping.Fmap(i, X) for i in range(3)]) - origin[:, None, None]
        volume += float(dV.sum())
        mass += float(dm.sum())
        first += np.einsum("ihq,hq->i", x, dm)
        second += np.einsum("ihq,jhq,hq->ij", x, x, dm, optimize=True)
    centre = first / mass
    about = second - mass * np.outer(centre, centre)
    return MassProperties(mass, volume, origin + centre, np.trace(about) * np.eye(3) - about)


def rigid_body_modes(points: FloatArray) -> FloatArray:
    """Orthonormal rigid-body modes of a body: the near null space for algebraic multigrid.

    Parameters
    ----------
    points : (n_node, 3) ndarray
        mm.

    Returns
    -------
    (3 n_node, 6) ndarray
        Columns with unit norm; they span the three translations and three rotations.

    Raises
    ------
    InputError
        When the points lie on one line (a rotation about it moves nothing).
    """
    arms = points - points.mean(axis=0)
    size = np.linalg.norm(arms, axis=1).max(initial=0.0)
    spread = np.linalg.svd(arms, compute_uv=False) if len(points) >= 3 else np.zeros(3)
    if not spread[1] > len(points) * np.finfo(float).eps * spread[0]:
        raise InputError(
            f"{len(points)} points on one line have fewer than six rigid-body modes: give "
            "the points of a solid body."
        )
    # displacements e_k x r of unit rotations about x, y, z
    turned = np.stack([np.cross(axis, arms / size).ravel() for axis in np.eye(3)], axis=1)
    Q, _ = np.linalg.qr(np.hstack([np.tile(np.eye(3), (len(points), 1)), turned]))
    return Q


# -- rotation --------------------------------------------------------------------------------------


#: weighted gradients (n, n_quad, n_node, 3) and the gradient of the displacement
#: (n, n_quad, 3, 3) -> element matrices (n, size n_node, size n_node)
_Element = Callable[[FloatArray, FloatArray], FloatArray]


def plane_mass(M: csr_array) -> csr_array:
    """M restricted to the plane across the axis, M_P.

    Parameters
    ----------
    M : (3 n, 3 n) csr_array
        t.

    Returns
    -------
    (3 n, 3 n) csr_array
    """
    across = diags_array(np.tile([1.0, 1.0, 0.0], M.shape[0] // 3))
    return csr_array(across @ M @ across)


def centrifugal_load(mesh: Mesh, M: csr_array) -> FloatArray:
    """M_P X, the load at a speed of 1 rad/s.

    Parameters
    ----------
    mesh : Mesh
    M : (3 n, 3 n) csr_array
        t.

    Returns
    -------
    (3 n,) ndarray
        N.
    """
    load: FloatArray = plane_mass(M) @ mesh.points.ravel()
    return load


def coriolis(M: csr_array) -> csr_array:
    """2 M (e_z x), the skew matrix of the Coriolis force at a speed of 1 rad/s.

    Parameters
    ----------
    M : (3 n, 3 n) csr_array
        t.

    Returns
    -------
    (3 n, 3 n) csr_array
        Times the speed and the velocities it is the force on the left-hand side.
    """
    turn = csr_array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    return csr_array(2.0 * M @ kron(eye_array(M.shape[0] // 3), turn))


def stress_stiffness(mesh: Mesh, material: Material, u: FloatArray, element: str) -> csr_array:
    """Geometric stiffness int grad phi_a' sigma grad phi_b dV times the unit matrix.

    Parameters
    ----------
    mesh : Mesh
    material : Material
    u : (3 n,) ndarray
        Displacements that the linear stresses sigma come from, mm.
    element : {"hex8", "hex20", "hex20r", "hex27"}

    Returns
    -------
    (3 n, 3 n) csr_array
        N/mm, symmetric.

    Raises
    ------
    InputError
        For hex8i, whose incompatible modes have stresses of their own.
    """

    def of(G: FloatArray, slope: FloatArray) -> FloatArray:
        strain = 0.5 * (slope + slope.swapaxes(2, 3))
        sigma = 2.0 * material.mu * strain
        sigma += material.lam * np.trace(strain, axis1=2, axis2=3)[..., None, None] * np.eye(3)
        return _products(G @ sigma, G)

    return _three_components(_assembled(mesh, u, element, 1, of))


def displaced_stiffness(mesh: Mesh, material: Material, u: FloatArray, element: str) -> csr_array:
    """Material stiffness about a displaced state, K(F = I + grad u).

    Parameters
    ----------
    mesh : Mesh
    material : Material
    u : (3 n,) ndarray
        Static displacements, mm.
    element : {"hex8", "hex20", "hex20r", "hex27"}

    Returns
    -------
    (3 n, 3 n) csr_array
        N/mm, symmetric; K for u = 0.

    Raises
    ------
    InputError
        For hex8i.
    """
    lam, mu = material.lam, material.mu

    def of(G: FloatArray, slope: FloatArray) -> FloatArray:
        F = np.eye(3) + slope
        n, n_quad, n_node, _ = G.shape
        FG = (G @ F.swapaxes(2, 3)).reshape(n, n_quad, 3 * n_node)
        H = np.matmul(FG.swapaxes(1, 2), FG).reshape(n, n_node, 3, n_node, 3)
        K = lam * H + mu * H.transpose(0, 1, 4, 3, 2)
        metric = F @ F.swapaxes(2, 3)
        for i in range(3):
            for j in range(3):
                K[:, :, i, :, j] += mu * _products(G * metric[:, :, i, j, None, None], G)
        return np.asarray(K).reshape(n, 3 * n_node, 3 * n_node)

    return _assembled(mesh, u, element, 3, of)


def _products(A: FloatArray, B: FloatArray) -> FloatArray:
    """(n, n_node, n_node) sums of A_a . B_b over the points of (n, n_quad, n_node, 3)."""
    n, _, n_node, _ = A.shape
    rows, columns = (X.swapaxes(1, 2).reshape(n, n_node, -1) for X in (A, B))
    out: FloatArray = np.matmul(rows, columns.transpose(0, 2, 1))
    return out


def _assembled(mesh: Mesh, u: FloatArray, name: str, size: int, of: _Element) -> csr_array:
    """Matrix of element matrices that depend on the gradient of a displacement."""
    element = hex_element(name, mesh)
    if element.incompatible:
        raise InputError(
            "rotation: element hex8i is not available: use hex8, hex20, hex20r or hex27."
        )
    maker = BasisMaker(mesh, element)
    pattern = _Pattern.of(maker.nodes, mesh.n_node)
    data = np.zeros(size**2 * pattern.nodes.nnz)
    for block in _blocks(mesh.n_hex, size * element.n_node):
        G = _weighted_gradients(maker, block)
        plain = G / np.sqrt(maker.basis(block).dx)[:, :, None, None]
        slope = np.einsum("nai,nqaj->nqij", u.reshape(-1, 3)[maker.nodes[block]], plain)
        np.add.at(data, pattern.positions(block, size).ravel(), of(G, slope).ravel())
    return pattern.matrix(data, size)
