"""Sections of the wedge on its platform with their dimensions."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

from geometry.wedge_platform import WedgePlatform, section_corners
from upd.mesh.section import Length, Opening, Point, SectionView

ACROSS, UP = (1.0, 0.0), (0.0, 1.0)


def coarse(params: WedgePlatform) -> WedgePlatform:
    """The same geometry with few elements."""
    return replace(params, divisions=4, divisions_long=8, element_nodes=8, symmetry="full")


def views(params: WedgePlatform) -> list[SectionView]:
    """Across the damper, and along it."""
    return [_across(params), _along(params)]


def _across(p: WedgePlatform) -> SectionView:
    at = section_corners(p)
    half, room = p.patch_length / 2.0, 0.1 * p.base
    slope = math.radians(p.angle)
    base, height = (math.cos(slope), math.sin(slope)), (math.sin(slope), -math.cos(slope))
    side, deep = half + p.margin, -p.thickness
    low, tip = at["low"], at["high"]
    marks: list[Length | Opening] = [
        Length("base", low, at["other_low"], base, room),
        Length("height", at["other_low"], at["other_high"], height, room),
        Opening("angle", low, tip, at["other_low"]),
        Length("patch_length", (-half, 0.0), (half, 0.0), ACROSS, -room, "start"),
        Length("patch_offset", (half, 0.0), tip, ACROSS, -2.0 * room),
        Length("margin", (half, 0.0), (side, 0.0), ACROSS, -3.5 * room),
        Length("margin", (-side, 0.0), (-half, 0.0), ACROSS, -3.5 * room),
        Length("thickness", (side, deep), (side, 0.0), UP, -room),
    ]
    return SectionView("section x = 0, across the damper", (0.0, 0.0, 0.0), (1, 2), marks)


def _along(p: WedgePlatform) -> SectionView:
    top = _height(section_corners(p))
    half, wide, room = p.length / 2.0, p.width / 2.0, 0.09 * p.length
    side = wide + p.margin
    band, wire = p.band / 2.0, p.wire_width / 2.0
    quarter, at = p.width / 4.0, p.wire_position
    marks: list[Length | Opening] = [
        Length("band", (-quarter - band, top), (-quarter + band, top), ACROSS, room),
        Length("wire_position", (0.0, top), (at, top), ACROSS, 2.0 * room),
        Length("wire_width", (at - wire, top), (at + wire, top), ACROSS, room),
        Length("length", (-half, top), (half, top), ACROSS, 3.0 * room),
        Length("margin", (wide, 0.0), (side, 0.0), ACROSS, room),
    ]
    if p.patch_width is not None:
        marks.append(Length("patch_width", (-wide, 0.0), (wide, 0.0), ACROSS, -room))
    strips: list[tuple[str, Point, Point]] = []
    for name, place, reach in (("band", quarter, band), ("wire", at, wire)):
        for sign in (-1.0, 1.0):
            strips.append((name, (sign * place - reach, top), (sign * place + reach, top)))
    title = "section y = 0, along the damper with bands and wires on its base"
    return SectionView(title, (0.0, 0.0, 0.0), (0, 2), marks, strips)


def _height(corners: dict[str, Point]) -> float:
    """Height of the section above the middle of the contact, mm."""
    ring = [corners[name] for name in ("low", "other_low", "other_high", "high")]
    return max(
        z0 + (z1 - z0) * (0.0 - y0) / (y1 - y0)
        for (y0, z0), (y1, z1) in pairwise([*ring, ring[0]])
        if min(y0, y1) <= 0.0 <= max(y0, y1) and y0 != y1
    )
