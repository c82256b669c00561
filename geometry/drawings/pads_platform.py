"""Sections of the damper with two pads on its platform with their dimensions."""

from __future__ import annotations

import math
from dataclasses import replace

from geometry.pads_platform import PadsPlatform, section_corners
from upd.mesh.section import Length, Opening, Point, SectionView

ACROSS, UP = (1.0, 0.0), (0.0, 1.0)


def coarse(params: PadsPlatform) -> PadsPlatform:
    """The same geometry with few elements."""
    return replace(params, divisions=4, divisions_long=6, element_nodes=8, symmetry="full")


def views(params: PadsPlatform) -> list[SectionView]:
    """Across the damper through the middle of a pad, and along it."""
    return [_across(params), _along(params)]


def _across(p: PadsPlatform) -> SectionView:
    at = section_corners(p)
    half, room = p.pad_length / 2.0, 0.12 * p.ab
    # the damper's vertical and horizontal, in the contact's axes
    vertical = _unit(at["bottom"], at["top"])
    level = (-vertical[1], vertical[0])
    side, deep = half + p.margin, -p.thickness
    # beyond the line of the cut, on the side of the bottom
    over = math.dist(at["top"], at["bottom"]) + 5.0 * room
    marks: list[Length | Opening] = [
        Length("ab", at["bottom"], at["top"], vertical, room),
        Length("cut", at["top"], at["cut_bottom"], level, 2.0 * room),
        Opening("angle_a", at["top"], at["cut_top"], at["bottom"], (0.1, 0.0)),
        Opening("angle_b", at["bottom"], at["top"], at["cut_bottom"]),
        Length("pad_centre", at["top"], (0.0, 0.0), level, over),
        Length("pad_length", (-half, 0.0), (half, 0.0), ACROSS, -room, "start"),
        Length("step", (-half, 0.0), (-half, p.step), UP, room),
        Length("margin", (half, 0.0), (side, 0.0), ACROSS, -room),
        Length("thickness", (side, deep), (side, 0.0), UP, -room),
    ]
    x = p.pad_gap / 2.0 + p.pad_width / 2.0
    return SectionView("section across the damper, through a pad", (x, 0.0, 0.0), (1, 2), marks)


def _unit(start: Point, end: Point) -> Point:
    long = math.dist(start, end)
    return (end[0] - start[0]) / long, (end[1] - start[1]) / long


def _along(p: PadsPlatform) -> SectionView:
    gap, end, room = p.pad_gap / 2.0, p.length / 2.0, 0.09 * p.length
    at = section_corners(p)
    (y0, z0), (y1, z1) = at["cut_bottom"], at["bottom"]
    top = z0 + (z1 - z0) * (0.0 - y0) / (y1 - y0)
    place, reach = p.wire_position, p.wire_width / 2.0
    side = end + p.margin
    marks: list[Length | Opening] = [
        Length("pad_width", (gap, 0.0), (end, 0.0), ACROSS, -room),
        Length("pad_gap", (-gap, 0.0), (gap, 0.0), ACROSS, -room, "start"),
        Length("wire_position", (0.0, top), (place, top), ACROSS, 2.0 * room),
        Length("wire_width", (place - reach, top), (place + reach, top), ACROSS, room),
        Length("margin", (end, 0.0), (side, 0.0), ACROSS, room),
    ]
    if p.pad_offset > 0.0:
        marks.append(Length("pad_offset", (-end, 0.0), (-end, p.pad_offset), UP, room))
    strips = [
        ("wire", (sign * place - reach, top), (sign * place + reach, top)) for sign in (-1.0, 1.0)
    ]
    title = "section y = 0, along the damper, with the wires on its bottom"
    return SectionView(title, (0.0, 0.0, 0.0), (0, 2), marks, strips)
