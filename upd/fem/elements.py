"""Hexahedral elements: node order, quadrature, mapping, and scikit-fem bases over blocks of them;
the material that they have.

Reference cell of scikit-fem: the unit cube [0, 1]^3. Its local node order is found from the
element's own table of node positions, so nothing here repeats scikit-fem's numbering.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import Any

import numpy as np
from skfem import CellBasis, ElementHex1, ElementHex2, ElementHexS2, MeshHex
from skfem.mapping import MappingIsoparametric

from upd.errors import InputError, MeshError
from upd.mesh import FloatArray, IntArray, Mesh
from upd.mesh.hexmesh import free_sides

#: names accepted wherever an element is asked for
ELEMENTS = ("hex8", "hex8i", "hex20", "hex20r", "hex27")

#: (3, 1) centre of the unit cube
CENTRE: FloatArray = np.full((3, 1), 0.5)

#: opposite sides of a hexahedron, S1 ... S6 from 0
_OPPOSITE = ((0, 1), (2, 4), (3, 5))

#: VTK node positions on the unit cube: corners, mid-edges, face centres (-x, +x, -y, +y, -z, +z),
#: centre
VTK_NODES: FloatArray = (
    np.array(
        [
            *[
                (0, 0, 0),
                (2, 0, 0),
                (2, 2, 0),
                (0, 2, 0),
                (0, 0, 2),
                (2, 0, 2),
                (2, 2, 2),
                (0, 2, 2),
            ],
            *[
                (1, 0, 0),
                (2, 1, 0),
                (1, 2, 0),
                (0, 1, 0),
                (1, 0, 2),
                (2, 1, 2),
                (1, 2, 2),
                (0, 1, 2),
            ],
            *[(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)],
            *[(0, 1, 1), (2, 1, 1), (1, 0, 1), (1, 2, 1), (1, 1, 0), (1, 1, 2)],
            (1, 1, 1),
        ]
    )
    / 2.0
)


def gauss(n: int, dim: int) -> tuple[FloatArray, FloatArray]:
    """Gauss-Legendre rule on the unit square or cube.

    Parameters
    ----------
    n : int
        Points per direction.
    dim : int
        Number of directions.

    Returns
    -------
    points : (dim, n^dim) ndarray
        In [0, 1]^dim.
    weights : (n^dim,) ndarray
    """
    x, w = np.polynomial.legendre.leggauss(n)
    points = np.stack(np.meshgrid(*[(x + 1.0) / 2.0] * dim, indexing="ij")).reshape(dim, -1)
    weights = np.prod(np.stack(np.meshgrid(*[w / 2.0] * dim, indexing="ij")), axis=0).ravel()
    return points, weights


def match_nodes(wanted: FloatArray, given: FloatArray) -> IntArray:
    """Index of each wanted reference node in the given ones; every match is exact.

    Parameters
    ----------
    wanted : (n, dim) ndarray
    given : (m, dim) ndarray

    Returns
    -------
    (n,) array of int
    """
    distance = np.abs(wanted[:, None, :] - given[None, :, :]).sum(axis=2)
    order: IntArray = distance.argmin(axis=1)
    if distance[np.arange(len(wanted)), order].any():
        raise AssertionError("reference nodes do not coincide")
    return order


@dataclass(frozen=True)
class HexElement:
    """One row of the element table.

    Attributes
    ----------
    name : str
    n_node : int
        Nodes per hexahedron.
    family : type
        The scikit-fem element.
    n_gauss : int
        Gauss points per direction.
    incompatible : bool
        With the nine bending modes.
    """

    name: str
    n_node: int
    family: type
    n_gauss: int
    incompatible: bool = False

    @cached_property
    def scalar(self) -> Any:
        """The scalar scikit-fem element.

        Its shape functions are tabulated at the quadrature points: they are asked for once per
        block.
        """
        element, X = self.family(), self.quadrature[0]
        plain = element.lbasis
        table = [plain(X, a) for a in range(self.n_node)]
        element.lbasis = lambda at, a: table[a] if at is X else plain(at, a)
        return element

    @cached_property
    def quadrature(self) -> tuple[FloatArray, FloatArray]:
        """Points (3, n_quad) and weights (n_quad,).

        Explicit because `intorder` does not give the rule one expects on hexahedra.
        """
        return gauss(self.n_gauss, 3)

    def shapes_at(self, X: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Shape functions and their gradients at reference points.

        Parameters
        ----------
        X : (3, n) ndarray
            On the unit cube.

        Returns
        -------
        values : (n_node, n) ndarray
            In scikit-fem node order.
        gradients : (n_node, 3, n) ndarray
        """
        pairs = [self.scalar.lbasis(X, a) for a in range(self.n_node)]
        shapes = X.shape[1:], (3, X.shape[1])
        values, gradients = (
            np.stack([np.broadcast_to(one, shape) for one in part])
            for part, shape in zip(zip(*pairs, strict=True), shapes, strict=True)
        )
        return values, gradients


_TABLE = {
    "hex8": HexElement("hex8", 8, ElementHex1, 2),
    "hex8i": HexElement("hex8i", 8, ElementHex1, 2, incompatible=True),
    "hex20": HexElement("hex20", 20, ElementHexS2, 3),
    "hex20r": HexElement("hex20r", 20, ElementHexS2, 2),
    "hex27": HexElement("hex27", 27, ElementHex2, 3),
}


def hex_element(name: str | None, mesh: Mesh) -> HexElement:
    """The element of that name, checked against the mesh.

    Parameters
    ----------
    name : str or None
        One of `ELEMENTS`; None takes the plain element with as many nodes as the hexahedra.
    mesh : Mesh

    Returns
    -------
    HexElement

    Raises
    ------
    InputError
        When the name is unknown or the mesh has another number of nodes per hexahedron.
    MeshError
        When hexahedra name nodes that are not there, or nodes belong to no hexahedron; when one of
        hex20r hangs on a neighbour, or on two opposite ones, alone.
    """
    width = mesh.hexes.shape[1]
    if name is None:
        name = f"hex{width}"
    if name not in _TABLE:
        raise InputError(f"element {name!r} is unknown: use one of {', '.join(ELEMENTS)}.")
    element = _TABLE[name]
    if element.n_node != width:
        fitting = (
            " or ".join(e.name for e in _TABLE.values() if e.n_node == width) or "another mesh"
        )
        raise InputError(
            f"element {name} needs {element.n_node} nodes per hexahedron, the mesh has "
            f"{width}: use {fitting}."
        )
    _check_nodes(mesh)
    if name != "hex20r":
        return element
    # One hexahedron has six motions without stiffness at 2 x 2 x 2 points; neighbours in two
    # directions suppress them, a row of single hexahedra passes one on, even from a clamped end.
    shared = ~free_sides(mesh)
    directions = sum(shared[:, pair].any(axis=1).astype(int) for pair in _OPPOSITE)
    weak = np.flatnonzero(directions < 2)
    if weak.size:
        raise MeshError(
            f"{weak.size} hexahedra have neighbours in one direction at most (first: hexahedron "
            f"{weak[0]}), where hex20r has motions without stiffness: take hex20, or two elements "
            "across."
        )
    return element


def _check_nodes(mesh: Mesh) -> None:
    """Raises MeshError for nodes that are not there, or in no hexahedron (K would be singular)."""
    if mesh.n_hex == 0:
        raise MeshError("the mesh has no hexahedra: mesh the body first.")
    low, high = mesh.hexes.min(), mesh.hexes.max()
    if low < 0 or high >= mesh.n_node:
        raise MeshError(
            f"hexahedra name nodes {low} to {high}, the mesh has nodes 0 to "
            f"{mesh.n_node - 1}: number them from 0 without gaps."
        )
    unused = np.flatnonzero(np.bincount(mesh.hexes.ravel(), minlength=mesh.n_node) == 0)
    if unused.size:
        raise MeshError(
            f"{unused.size} of {mesh.n_node} nodes belong to no hexahedron (first: node "
            f"{unused[0]}): drop them and renumber."
        )


@dataclass(frozen=True)
class Jacobian:
    """Jacobian d x_i / d X_j, (3, 3, n_hex, n), of a block of hexahedra at n reference points."""

    DF: FloatArray

    @cached_property
    def cofactors(self) -> FloatArray:
        """|J| d X_j / d x, (3, 3, n_hex, n).

        Row j is the cross product of the two other columns of DF.
        """
        rows = []
        for j in range(3):
            u, v = self.DF[:, (j + 1) % 3], self.DF[:, (j + 2) % 3]
            rows += [
                u[1] * v[2] - u[2] * v[1],
                u[2] * v[0] - u[0] * v[2],
                u[0] * v[1] - u[1] * v[0],
            ]
        return np.stack(rows).reshape(self.DF.shape)

    @cached_property
    def det(self) -> FloatArray:
        """(n_hex, n) signed determinant."""
        return _dot(self.DF[:, 0], self.cofactors[0])

    @cached_property
    def inverse(self) -> FloatArray:
        """(3, 3, n_hex, n) d X_j / d x_i."""
        inverse: FloatArray = self.cofactors / self.det
        return inverse

    @cached_property
    def scaled(self) -> FloatArray:
        """(n_hex, n) determinant over the product of the column lengths, in [-1, 1].

        0 when a column vanishes.
        """
        squares = [_dot(self.DF[:, j], self.DF[:, j]) for j in range(3)]
        lengths: FloatArray = np.sqrt(squares[0]) * np.sqrt(squares[1]) * np.sqrt(squares[2])
        return np.divide(self.det, lengths, out=np.zeros_like(lengths), where=lengths > 0.0)


def _dot(u: FloatArray, v: FloatArray) -> FloatArray:
    """Scalar product over the first axis, written out: faster than einsum over an axis of three."""
    product: FloatArray = u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
    return product


class HexMapping(MappingIsoparametric):  # type: ignore[misc]
    """Isoparametric mapping given by all nodes of each hexahedron.

    One product for the Jacobians of a whole block. For 20 nodes this is the serendipity map, the
    same as completing the 27 nodes by serendipity interpolation first.

    Parameters
    ----------
    mesh : skfem.MeshHex
    element : HexElement
    nodes : (n_hex, n_node, 3) ndarray
        Coordinates in mm, in scikit-fem local order.
    """

    def __init__(self, mesh: MeshHex, element: HexElement, nodes: FloatArray) -> None:
        super().__init__(mesh, element.scalar)
        self._element = element
        self._nodes = nodes
        self._last: tuple[FloatArray, Jacobian] | None = None

    def jacobian(self, X: FloatArray) -> Jacobian:
        """The Jacobian at reference points X (3, n).

        Kept, because scikit-fem asks for it once per shape function.
        """
        if self._last is None or self._last[0] is not X:
            n_hex, n_node, _ = self._nodes.shape
            gradients = self._element.shapes_at(X)[1].reshape(n_node, -1)
            flat = self._nodes.transpose(2, 0, 1).reshape(-1, n_node) @ gradients
            DF = np.ascontiguousarray(flat.reshape(3, n_hex, 3, -1).transpose(0, 2, 1, 3))
            self._last = X, Jacobian(DF)
        return self._last[1]

    def detDF(self, X: FloatArray, tind: None = None) -> FloatArray:
        """(n_hex, n) signed determinant of the Jacobian."""
        return self.jacobian(X).det

    def invDF(self, X: FloatArray, tind: None = None) -> FloatArray:
        """(3, 3, n_hex, n) d X_j / d x_i."""
        return self.jacobian(X).inverse

    def Fmap(self, i: int, X: FloatArray, tind: None = None) -> FloatArray:
        """(n_hex, n) coordinate i of the reference points X (3, n)."""
        return self._nodes[:, :, i] @ self._element.shapes_at(X)[0]


class BasisMaker:
    """Makes scikit-fem bases of the scalar shape functions over blocks of hexahedra.

    They are numbered as the mesh's nodes.

    Attributes
    ----------
    mesh : Mesh
    element : HexElement
    nodes : (n_hex, n_node) array of int
        Node numbers in scikit-fem local order.
    """

    def __init__(self, mesh: Mesh, element: HexElement) -> None:
        self.mesh, self.element = mesh, element
        local: Any = element.family
        order = match_nodes(np.asarray(local.doflocs), VTK_NODES[: element.n_node])
        self.nodes: IntArray = np.ascontiguousarray(mesh.hexes[:, order])
        self._points = np.ascontiguousarray(mesh.points.T)

    def mapping(self, block: slice = slice(None)) -> HexMapping:
        """The mapping of a block of hexahedra."""
        nodes = self.nodes[block]
        corners = np.ascontiguousarray(nodes[:, :8].T, dtype=np.int32)
        return HexMapping(
            MeshHex(self._points, corners, validate=False), self.element, self.mesh.points[nodes]
        )

    def basis(self, block: slice = slice(None)) -> CellBasis:
        """Scalar basis of a block of hexahedra; `basis.element_dofs` are node numbers.

        Raises
        ------
        MeshError
            When a hexahedron is inverted or collapsed (scikit-fem itself takes the absolute value).
        """
        mapping = self.mapping(block)
        # Below rounding of the scaled Jacobian a hexahedron counts as collapsed.
        least = self.element.n_node * float(np.finfo(float).eps)
        if (self._worst(mapping) <= least).any():
            worst = self._worst(self.mapping())
            count, k = int((worst <= least).sum()), int(worst.argmin())
            raise MeshError(
                f"{count} of {self.mesh.n_hex} hexahedra are inverted or collapsed: the "
                "Jacobian determinant is not positive "
                f"(worst: hexahedron {k}, scaled Jacobian {worst[k]:.3g}, corner nodes "
                f"{self.mesh.hexes[k, :8].tolist()}). "
                "List the nodes in VTK order (the top ring on the side the bottom ring's "
                "normal points to), or move the nodes that tangle it."
            )
        return CellBasis(
            mapping.mesh,
            self.element.scalar,
            mapping=mapping,
            quadrature=self.element.quadrature,
            # our node numbers: no edge or face tables needed
            dofs=SimpleNamespace(element_dofs=self.nodes[block].T, N=self.mesh.n_node),
            disable_doflocs=True,
        )

    def _worst(self, mapping: HexMapping) -> FloatArray:
        """(n_hex,) smallest scaled Jacobian at the integration points (hex8i: and the centre)."""
        places = [CENTRE] if self.element.incompatible else []
        scaled = [mapping.jacobian(X).scaled for X in (*places, self.element.quadrature[0])]
        worst: FloatArray = np.hstack(scaled).min(axis=1)
        return worst


# -- material --------------------------------------------------------------------------------------

#: density of steel, t/mm3
STEEL_DENSITY = 7.8e-9


@dataclass(frozen=True)
class Material:
    """Isotropic linear elasticity.

    Parameters
    ----------
    E : float
        Young's modulus, MPa.
    nu : float
        Poisson ratio, between -1 and 0.5, both excluded.
    rho : float, default 7.8e-9
        Density, t/mm3; steel by default.

    Raises
    ------
    InputError
        That lists every value out of range.
    """

    E: float
    nu: float
    rho: float = STEEL_DENSITY

    def __post_init__(self) -> None:
        checks = (
            (
                self.E > 0.0 and math.isfinite(self.E),
                f"E = {self.E!r} MPa: give a positive Young's modulus, e.g. 200e3 for steel",
            ),
            (
                -1.0 < self.nu < 0.5,
                f"nu = {self.nu!r}: give a Poisson ratio between -1 and 0.5, both excluded "
                "(0.499 for a nearly incompressible solid)",
            ),
            (
                self.rho > 0.0 and math.isfinite(self.rho),
                f"rho = {self.rho!r} t/mm3: give a positive density, e.g. 7.8e-9 for steel",
            ),
        )
        problems = [message for ok, message in checks if not ok]
        if problems:
            raise InputError("Material: " + "; ".join(problems) + ".")

    @property
    def mu(self) -> float:
        """Second Lamé parameter E / (2 (1 + nu)), MPa: the shear modulus."""
        return self.E / (2.0 * (1.0 + self.nu))

    G = mu

    @property
    def lam(self) -> float:
        """First Lamé parameter E nu / ((1 + nu) (1 - 2 nu)), MPa."""
        return self.E * self.nu / ((1.0 + self.nu) * (1.0 - 2.0 * self.nu))
