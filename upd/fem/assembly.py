"""Stiffness, mass and damping matrices.

One batched product per block of elements, then one scatter into a fixed CSR pattern. Dof
numbering: 3 * node + component, nodes as in the mesh.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array

from upd.errors import InputError
from upd.fem.elements import CENTRE, BasisMaker, Material, hex_element
from upd.mesh import FloatArray, IntArray, Mesh

#: bytes of element matrices handled at a time: large enough to hide Python's overhead, small enough
#: for the last cache level
_BLOCK_BYTES = 2 * 2**20


def stiffness(
    mesh: Mesh,
    material: Material | Sequence[Material],
    element: str = "hex8i",
    regions: IntArray | None = None,
) -> csr_array:
    """Stiffness matrix of a mesh, full and exactly symmetric, its rows sorted.

    Parameters
    ----------
    mesh : Mesh
        The body; 8, 20 or 27 nodes per hexahedron, as the element asks.
    material : Material or sequence of Material
        One material, or several with `regions`.
    element : {"hex8i", "hex8", "hex20", "hex20r", "hex27"}, default "hex8i"
        "hex8i" has 8 nodes with nine incompatible modes condensed; "hex20r" has 2 x 2 x 2 points
        and does not lock in thin bodies.
    regions : (n_hex,) array of int, optional
        Material number of each hexahedron.

    Returns
    -------
    (3 n_node, 3 n_node) csr_array
        K in N/mm; dof 3 * node + component.

    Raises
    ------
    InputError
        For an unknown or unfitting element, or materials and regions that do not fit.
    MeshError
        For inverted or collapsed hexahedra, nodes out of range or without a hexahedron.

    Notes
    -----
    Assembled as

        K[ai, bj] = lam H[ai, bj] + mu H[aj, bi] + mu delta_ij sum_k H[ak, bk]

    with H[ai, bj] = int d_i phi_a d_j phi_b dV.

    References
    ----------
    .. [1] T. J. R. Hughes, The Finite Element Method (isotropic elasticity).
    .. [2] R. L. Taylor, P. J. Beresford, E. L. Wilson, Int. J. Numer. Meth. Engng 10 (1976) 1211
       (hex8i).

    Examples
    --------
    A bar stretched by 1e-3 of its length: the force at its end is E A times that.

    >>> import numpy as np
    >>> from upd.fem import Material, box_mesh, stiffness
    >>> bar = box_mesh(np.linspace(0, 10, 6), [0, 1], [0, 1])
    >>> K = stiffness(bar, Material(E=200e3, nu=0.0))
    >>> K.shape
    (72, 72)
    >>> u = np.zeros((bar.n_node, 3))
    >>> u[:, 0] = 1e-3 * bar.points[:, 0]
    >>> force = (K @ u.ravel()).reshape(-1, 3)
    >>> print(f"{force[bar.nodes['x1'], 0].sum():.6f} N")
    200.000000 N
    """
    chosen = hex_element(element, mesh)
    lam, mu = _per_hex(mesh, material, regions, "lam"), _per_hex(mesh, material, regions, "mu")
    maker = BasisMaker(mesh, chosen)
    pattern = _Pattern.of(maker.nodes, mesh.n_node)
    data = np.zeros(9 * pattern.nodes.nnz)
    for block in _blocks(mesh.n_hex, 3 * chosen.n_node):
        K = _element_stiffness(maker, block, lam[block], mu[block])
        np.add.at(data, pattern.positions(block, 3).ravel(), K.ravel())
    return pattern.matrix(data, 3)


def mass(
    mesh: Mesh,
    material: Material | Sequence[Material],
    element: str | None = None,
    regions: IntArray | None = None,
) -> csr_array:
    """Consistent mass matrix of a mesh, full and exactly symmetric, its rows sorted.

    Parameters
    ----------
    mesh : Mesh
        The body.
    material : Material or sequence of Material
        One material, or several with `regions`.
    element : str, optional
        Checked against the mesh; its mass is that of the plain element of the mesh (the
        incompatible modes carry none).
    regions : (n_hex,) array of int, optional
        Material number of each hexahedron.

    Returns
    -------
    (3 n_node, 3 n_node) csr_array
        M in t; dof 3 * node + component.

    Raises
    ------
    InputError, MeshError
        As for `stiffness`.

    Examples
    --------
    A translation of 1 mm/s has the momentum of the whole mass, rho V.

    >>> import numpy as np
    >>> from upd.fem import Material, box_mesh, mass
    >>> mesh = box_mesh([0, 5, 10], [0, 1], [0, 1])
    >>> M = mass(mesh, Material(E=200e3, nu=0.3, rho=7.8e-9))
    >>> along_x = np.tile([1.0, 0.0, 0.0], mesh.n_node)
    >>> print(f"{along_x @ (M @ along_x):.3e} t")
    7.800e-08 t
    """
    if element is not None:
        hex_element(element, mesh)
    chosen = hex_element(None, mesh)
    rho = _per_hex(mesh, material, regions, "rho")
    maker = BasisMaker(mesh, chosen)
    pattern = _Pattern.of(maker.nodes, mesh.n_node)
    data = np.zeros(pattern.nodes.nnz)
    phi = chosen.shapes_at(chosen.quadrature[0])[0].T
    pairs = (phi[:, :, None] * phi[:, None, :]).reshape(len(phi), -1)
    for block in _blocks(mesh.n_hex, chosen.n_node):
        M = (rho[block, None] * maker.basis(block).dx) @ pairs
        np.add.at(data, pattern.positions(block, 1).ravel(), M.ravel())
    return _three_components(pattern.matrix(data, 1))


def _element_stiffness(
    maker: BasisMaker, block: slice, lam: FloatArray, mu: FloatArray
) -> FloatArray:
    """(n, 3 n_node, 3 n_node) element matrices of a block of hexahedra, exactly symmetric."""
    element = maker.element
    G = _weighted_gradients(maker, block)
    n, _, n_function, _ = G.shape
    flat = G.reshape(n, -1, 3 * n_function)
    # One operand and its own transpose: numpy calls syrk, so H is symmetric to the last bit.
    H = np.matmul(flat.transpose(0, 2, 1), flat).reshape(n, n_function, 3, n_function, 3)
    lam, mu = lam[:, None, None, None, None], mu[:, None, None, None, None]
    K = lam * H
    K += mu * H.transpose(0, 1, 4, 3, 2)
    trace = mu[:, :, 0, :, 0] * (H[:, :, 0, :, 0] + H[:, :, 1, :, 1] + H[:, :, 2, :, 2])
    for i in range(3):
        K[:, :, i, :, i] += trace
    K = K.reshape(n, 3 * n_function, 3 * n_function)
    return _condense(K, 3 * element.n_node) if element.incompatible else K


def _weighted_gradients(maker: BasisMaker, block: slice) -> FloatArray:
    """(n, n_quad, n_function, 3) gradients times sqrt(w det J); the modes of hex8i come last."""
    element = maker.element
    basis = maker.basis(block)
    n, n_quad = basis.dx.shape
    n_function = element.n_node + (3 if element.incompatible else 0)
    root = np.sqrt(basis.dx)
    G = np.empty((n, n_quad, n_function, 3))
    for a in range(element.n_node):
        np.multiply(basis.basis[a][0].grad.transpose(1, 2, 0), root[:, :, None], out=G[:, :, a])
    if element.incompatible:
        # Gradients by the Jacobian J0 at the centre, times |J0| / |J|: their integral vanishes, so
        # constant stress is met exactly.
        cofactors = basis.mapping.jacobian(CENTRE).cofactors[..., 0]
        # of 1 - xi^2, 1 - eta^2, 1 - zeta^2 on the unit cube, (xi, eta, zeta) = 2 X - 1
        modes = -4.0 * np.eye(3)[:, :, None] * (2.0 * element.quadrature[0] - 1.0)
        G[:, :, element.n_node :] = (
            np.einsum("jin,mjq->nqmi", cofactors, modes) * (basis.W / root)[:, :, None, None]
        )
    return G


def _condense(K: FloatArray, n_kept: int) -> FloatArray:
    """(n, n_kept, n_kept) Schur complements of the leading rows, exactly symmetric."""
    L = np.linalg.cholesky(K[:, n_kept:, n_kept:])
    Y = np.linalg.solve(L, K[:, n_kept:, :n_kept])
    condensed: FloatArray = K[:, :n_kept, :n_kept] - np.matmul(Y.transpose(0, 2, 1), Y)
    return condensed


@dataclass(frozen=True)
class _Pattern:
    """Node-to-node sparsity of a mesh and the place of each element's node pairs in it.

    Attributes
    ----------
    nodes : (n_node, n_node) csr_array
        Sorted pattern.
    slots : (n_hex, n, n) array of int
        Place of a pair of local nodes in it.
    hexes : (n_hex, n) array of int
    """

    nodes: csr_array
    slots: IntArray
    hexes: IntArray

    @classmethod
    def of(cls, hexes: IntArray, n_node: int) -> _Pattern:
        """The pattern of hexahedra (n_hex, n) over n_node nodes."""
        n_hex, n = hexes.shape
        incidence = csr_array(
            (np.ones(hexes.size, np.int32), hexes.ravel(), np.arange(0, hexes.size + 1, n)),
            shape=(n_hex, n_node),
        )
        nodes = csr_array(incidence.T @ incidence)
        nodes.sort_indices()
        # Numbering the stored entries turns scipy's element lookup into the table of places; from 1
        # because 0 means "not stored".
        nodes = csr_array(
            (np.arange(1, nodes.nnz + 1), nodes.indices, nodes.indptr), shape=nodes.shape
        )
        slots = (
            np.asarray(nodes[np.repeat(hexes, n, axis=1).ravel(), np.tile(hexes, (1, n)).ravel()])
            - 1
        )
        return cls(nodes, slots.astype(np.int64, copy=False).reshape(n_hex, n, n), hexes)

    def positions(self, block: slice, size: int) -> IntArray:
        """(n, nodes, size, nodes, size) places of element matrices in the CSR data.

        With `size` components per node.
        """
        indptr: IntArray = self.nodes.indptr.astype(np.int64)
        rows = self.hexes[block][:, :, None]
        start, length = indptr[rows], indptr[rows + 1] - indptr[rows]
        # Node row a begins after size^2 entries per earlier block; each of its `size` matrix rows
        # holds `size` entries per block.
        first = size * (size * start + self.slots[block] - start)
        component: IntArray = np.arange(size)
        row_start = (
            first[:, :, None, :, None]
            + (size * length)[:, :, None, :, None] * component[:, None, None]
        )
        return row_start + component

    def matrix(self, data: FloatArray, size: int) -> csr_array:
        """CSR matrix of the scattered data, `size` rows and columns per node."""
        n = self.nodes.shape[0]
        # what scipy and the direct solvers expect: 32 bits as long as they suffice
        dtype: Any = np.int32 if len(data) <= np.iinfo(np.int32).max else np.int64
        columns = (
            size * self.nodes.indices.astype(dtype)[:, None] + np.arange(size, dtype=dtype)
        ).ravel()
        rows = csr_array(
            (np.zeros(len(columns), np.int8), columns, size * self.nodes.indptr.astype(dtype)),
            shape=(n, size * n),
        )
        repeated = rows[np.repeat(np.arange(n, dtype=dtype), size)]
        return csr_array((data, repeated.indices, repeated.indptr), shape=(size * n, size * n))


def _three_components(A: csr_array) -> csr_array:
    """A (n, n) applied to each of three components per node: (3 n, 3 n)."""
    n = A.shape[0]
    repeated = A[np.repeat(np.arange(n), 3)]
    component = np.repeat(
        np.tile(np.arange(3, dtype=repeated.indices.dtype), n), np.diff(repeated.indptr)
    )
    return csr_array(
        (repeated.data, 3 * repeated.indices + component, repeated.indptr), shape=(3 * n, 3 * n)
    )


def _blocks(n_hex: int, n_dof: int) -> Iterator[slice]:
    """Slices of hexahedra whose n_dof x n_dof element matrices fill a block."""
    step = max(1, _BLOCK_BYTES // (8 * n_dof**2))
    return (slice(k, min(k + step, n_hex)) for k in range(0, n_hex, step))


def _per_hex(
    mesh: Mesh, material: Material | Sequence[Material], regions: IntArray | None, name: str
) -> FloatArray:
    """(n_hex,) one material property of each hexahedron.

    Raises InputError when regions and materials do not fit.
    """
    materials = [material] if isinstance(material, Material) else list(material)
    values = np.array([getattr(m, name) for m in materials], dtype=np.float64)
    if regions is None:
        if len(values) != 1:
            raise InputError(
                f"{len(values)} materials are given without regions: pass regions, one "
                "material number per hexahedron."
            )
        return np.full(mesh.n_hex, values[0])
    regions = np.asarray(regions)
    if regions.shape != (mesh.n_hex,) or not np.issubdtype(regions.dtype, np.integer):
        raise InputError(
            f"regions has shape {regions.shape} and type {regions.dtype}: give "
            f"{mesh.n_hex} integers, one material number per hexahedron."
        )
    wrong = np.flatnonzero((regions < 0) | (regions >= len(values)))
    if wrong.size:
        raise InputError(
            f"regions names {wrong.size} times a material that is not there (first: number "
            f"{regions[wrong[0]]} at hexahedron {wrong[0]}, "
            f"{len(values)} materials given): use 0 to {len(values) - 1}."
        )
    return values[regions]


# -- damping ---------------------------------------------------------------------------------------


def modal_damping(M: Any, shapes: ArrayLike, frequency: ArrayLike, zeta: ArrayLike) -> FloatArray:
    """Damping matrix C = M Phi diag(2 zeta omega) Phi' M of given modal ratios, dense.

    What the modes leave out stays undamped. Meant for reduced models: it takes n^2 doubles.

    Parameters
    ----------
    M : (n, n) sparse array or ndarray
        t.
    shapes : (n, m) array_like
        Mass-normalised shapes Phi, t^-1/2.
    frequency : (m,) array_like
        Hz.
    zeta : float or (m,) array_like
        One damping ratio, or one per mode.

    Returns
    -------
    (n, n) ndarray
        N s/mm, symmetric.

    Raises
    ------
    InputError
        For shapes that do not fit, or negative ratios.

    References
    ----------
    .. [1] R. W. Clough, J. Penzien, Dynamics of Structures, ch. 12.
    """
    Phi, f = np.asarray(shapes, dtype=np.float64), np.asarray(frequency, dtype=np.float64)
    if Phi.ndim != 2 or f.shape != Phi.shape[1:] or np.shape(M) != (len(Phi), len(Phi)):
        raise InputError(
            f"Shapes {Phi.shape}, frequencies {f.shape} and M {np.shape(M)} do not fit: "
            "give (n, m), (m,), (n, n)."
        )
    ratio = checked_ratio(zeta, len(f))
    MPhi = M @ Phi
    C: FloatArray = (MPhi * (4.0 * np.pi * ratio * f)) @ MPhi.T
    return 0.5 * (C + C.T)


def checked_ratio(zeta: ArrayLike, m: int) -> FloatArray:
    """Damping ratios, one per mode, checked.

    Parameters
    ----------
    zeta : float or (m,) array_like
    m : int
        Number of modes.

    Returns
    -------
    (m,) ndarray

    Raises
    ------
    InputError
        For another number of ratios, negative ones, or ones that are not finite.
    """
    ratio = np.asarray(zeta, dtype=np.float64)
    if ratio.shape not in ((), (m,)):
        raise InputError(f"{ratio.shape} damping ratios for {m} modes: give one, or one per mode.")
    if not (np.isfinite(ratio).all() and (ratio >= 0.0).all()):
        raise InputError("Damping ratios are finite and not negative (0.005 is half a per cent).")
    return np.broadcast_to(ratio, (m,)).copy()
