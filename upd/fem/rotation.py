"""A body that rotates about the z axis: load, stresses and the stiffness they add.

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

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_array, diags_array, eye_array, kron

from upd.errors import InputError
from upd.fem.assembly import _blocks, _Pattern, _three_components, _weighted_gradients
from upd.fem.elements import BasisMaker, hex_element
from upd.fem.material import Material
from upd.mesh import FloatArray, Mesh

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
    element : {"hex8", "hex20", "hex27"}

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
    element : {"hex8", "hex20", "hex27"}

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
        raise InputError("rotation: element hex8i is not available: use hex8, hex20 or hex27.")
    maker = BasisMaker(mesh, element)
    pattern = _Pattern.of(maker.nodes, mesh.n_node)
    data = np.zeros(size**2 * pattern.nodes.nnz)
    for block in _blocks(mesh.n_hex, size * element.n_node):
        G = _weighted_gradients(maker, block)
        plain = G / np.sqrt(maker.basis(block).dx)[:, :, None, None]
        slope = np.einsum("nai,nqaj->nqij", u.reshape(-1, 3)[maker.nodes[block]], plain)
        np.add.at(data, pattern.positions(block, size).ravel(), of(G, slope).ravel())
    return pattern.matrix(data, size)
