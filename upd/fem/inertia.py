"""Mass properties of a meshed body, exact for the geometry the hexahedra describe."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from upd.errors import MeshError
from upd.fem.assembly import _blocks, _per_hex
from upd.fem.elements import BasisMaker, gauss, hex_element
from upd.fem.material import Material
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
        _refuse_inverted(det, block.start)
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


def _refuse_inverted(det: FloatArray, first: int) -> None:
    worst = det.min(axis=1)
    if not (worst > 0.0).all():
        k = int(worst.argmin())
        raise MeshError(
            f"{int((worst <= 0.0).sum())} hexahedra are inverted or collapsed (worst: "
            f"number {first + k}, Jacobian {worst[k]:.3g} mm3): "
            "list the nodes in VTK order, or move the nodes that tangle it."
        )
