"""Section of the half-sphere on the block with its dimensions."""

from __future__ import annotations

from dataclasses import replace

from geometry.sphere_block import SphereBlock
from upd.mesh.section import Length, SectionView

ACROSS, UP = (1.0, 0.0), (0.0, 1.0)


def coarse(params: SphereBlock) -> SphereBlock:
    """The same geometry with few elements."""
    divisions = min(params.divisions, 10)
    return replace(params, divisions=divisions, growth=1.15, element_nodes=8, symmetry="full")


def views(params: SphereBlock) -> list[SectionView]:
    """The section y = 0."""
    p, room = params, 0.12 * max(params.radius, params.block)
    a, half = p.patch / 2.0, p.block / 2.0
    marks = [
        Length("radius", (0.0, p.radius), (p.radius, p.radius), ACROSS, room),
        Length("block", (-half, -p.block), (half, -p.block), ACROSS, -room),
        Length("block", (half, -p.block), (half, 0.0), UP, -room),
        Length("patch", (-a, 0.0), (a, 0.0), ACROSS, -2.0 * room),
    ]
    return [SectionView("section y = 0", (0.0, 0.0, 0.0), (0, 2), marks)]
