"""A recipe of your own: a damper with a crowned face on a flat platform.

Copy it together with own_damper.toml.

A recipe is one frozen dataclass of parameters (lengths in mm) and one function ``build(params)``
that returns a mesh per body. Bodies are named like the scene's materials, the upper one first; the
contact plane is z = 0. Each body has the faces "contact" and the node sets "contact" (the k-th
nodes of both bodies lie on one normal) and "distant" (held below, loaded above).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from geometry.blocks import Blocks, require, session
from upd.mesh import Mesh

LENGTH = {"quantity": "length"}  # scenes give it with a unit, "20 mm"


@dataclass(frozen=True)
class OwnDamper:
    """Width, height and radius of the crown in mm; elements along an edge of the contact."""

    width: float = field(default=4.0, metadata=LENGTH)
    height: float = field(default=4.0, metadata=LENGTH)
    crown: float = field(default=200.0, metadata=LENGTH)
    divisions: int = 16
    element_nodes: int = 8  # set by mesh.element

    def __post_init__(self) -> None:
        require(
            [
                f"{n}: {getattr(self, n)!r} is not positive"
                for n in ("width", "height", "crown")
                if not getattr(self, n) > 0.0
            ]
        )


def build(params: OwnDamper) -> dict[str, Mesh]:
    """Two boxes of hexahedra; the upper one's lower face is bent up by r^2 / (2 crown)."""
    return {"damper": box(params, 1.0), "platform": box(params, -1.0)}


def box(p: OwnDamper, side: float) -> Mesh:
    """One body, above (side 1) or below (side -1) the contact plane."""
    a, low, high = p.width / 2.0, *sorted((0.0, side * p.height))
    square = [(-a, -a), (a, -a), (a, a), (-a, a)]
    with session("box") as gmsh:
        blocks = Blocks(gmsh)
        for k, (x, y) in enumerate(square):
            blocks.point(f"b{k}", (x, y, low))
            blocks.point(f"t{k}", (x, y, high))
        for k in range(4):
            blocks.curve(f"b{k}", f"b{(k + 1) % 4}", p.divisions)
            blocks.curve(f"t{k}", f"t{(k + 1) % 4}", p.divisions)
            blocks.curve(f"b{k}", f"t{k}", p.divisions // 2)
        blocks.volume("box", [f"b{k}" for k in range(4)] + [f"t{k}" for k in range(4)])
        points, grids = blocks.mesh(p.element_nodes)
    grid, contact, far = grids["box"], int(side < 0.0), int(side > 0.0)
    if side > 0.0:
        points[:, 2] += (
            (1.0 - points[:, 2] / p.height)
            * (points[:, 0] ** 2 + points[:, 1] ** 2)
            / (2.0 * p.crown)
        )
    return Mesh(
        points,
        grid.hexes(),
        faces={"contact": grid.faces(2, contact)},
        nodes={"contact": named(grid.layer(2, contact)), "distant": named(grid.layer(2, far))},
    )


def named(layer: NDArray[np.int64]) -> NDArray[np.int64]:
    """Nodes of a lattice; hexahedra of 20 nodes leave places (-1) without one."""
    return layer[layer >= 0]
