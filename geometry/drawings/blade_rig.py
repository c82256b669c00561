"""Sections of the two-blade rig with their dimensions."""

from __future__ import annotations

import math
from dataclasses import replace

from geometry.blade_rig_params import BladeRig
from upd.mesh.section import Length, Opening, Point, SectionView

ACROSS, UP = (1.0, 0.0), (0.0, 1.0)


def coarse(params: BladeRig) -> BladeRig:
    """The same geometry with few elements, the damper a body of its own."""
    return replace(params, refine=1, element_nodes=8, symmetry="full", damper="free")


def views(params: BladeRig) -> list[SectionView]:
    """Across the blades, the damper between the platforms, and along the damper."""
    return [_whole(params), _damper(params), _side(params)]


def _whole(p: BladeRig) -> SectionView:
    axis, room = p.pitch / 2.0, 0.12 * p.pitch
    right = axis + p.base_x / 2.0
    shank, core = p.shank_tx / 2.0, p.core_tx / 2.0
    # the side of the right blade's platform that faces the other blade
    inner = p.front_halfwidth if p.arrangement == "symmetric" else p.rear_halfwidth
    names = ["front_halfwidth", "rear_halfwidth"]
    inside, outside = names if p.arrangement == "symmetric" else names[::-1]
    outer = p.rear_halfwidth if p.arrangement == "symmetric" else p.front_halfwidth
    neck, top, low = p.shank_length, p.platform_top, -p.base_height

    def up(name: str, x: float, one: float, two: float, column: float) -> Length:
        return Length(name, (x, one), (x, two), UP, x - column)

    edge = max(right, axis + outer) + room
    marks: list[Length | Opening] = [
        Length("pitch", (-axis, p.top), (axis, p.top), ACROSS, 2.0 * room),
        Length("core_tx", (axis - core, p.top), (axis + core, p.top), ACROSS, room, "start"),
        Length("base_x", (-right, low), (p.base_x - right, low), ACROSS, -room),
        up("base_height", right, low, 0.0, edge),
        up("shank_length", axis + shank, 0.0, neck, edge),
        up("platform_height", axis + shank, neck, top, edge),
        up("core_length", axis + core, top, p.top, edge),
        Length(
            "accelerometer_depth",
            (-axis - core, p.top - p.accelerometer_depth),
            (-axis - core, p.top),
            UP,
            room,
        ),
        Length("shank_tx", (-axis - shank, 0.0), (shank - axis, 0.0), ACROSS, room, "start"),
        Length(inside, (axis - inner, top), (axis, top), ACROSS, 2.0 * room, "start"),
        Length(outside, (-axis - outer, top), (-axis, top), ACROSS, 3.5 * room, "start"),
    ]
    return SectionView("section y = 0, across the blades", (0.0, 0.0, 0.0), (0, 2), marks)


def _damper(p: BladeRig) -> SectionView:
    """Around the damper, through a pad where there are two."""
    x, y = _symmetric(p) if p.arrangement == "symmetric" else _asymmetric(p)
    marks, lowest = x, y
    reach = 0.56 * p.pitch
    low, high = lowest - 0.25 * p.pitch, p.platform_top + 0.2 * p.pitch
    at = 0.0 if p.arrangement == "symmetric" else p.pad_gap / 2.0 + p.pad_length / 2.0
    return SectionView(
        "the damper between the platforms",
        (0.0, at, 0.0),
        (0, 2),
        marks,
        window=((-reach, low), (reach, high)),
    )


def _on_slope(p: BladeRig, stop: float, angle: float, *, sign: float = 1.0) -> Point:
    """A point of the right (or left) blade's inner underside, ``stop`` mm from its shank."""
    slope = math.radians(angle)
    out = p.pitch / 2.0 - p.shank_tx / 2.0 - stop * math.cos(slope)
    return sign * out, p.shank_length + stop * math.sin(slope)


def _symmetric(p: BladeRig) -> tuple[list[Length | Opening], float]:
    (low, high), (start, end), room = p.leg_span, p.patch_span, 0.07 * p.pitch
    tip = p.underside(True)
    foot, head = _on_slope(p, low, p.front_angle), _on_slope(p, high, p.front_angle)
    left = _on_slope(p, low, p.front_angle, sign=-1.0)
    slope = math.radians(p.front_angle)
    upwards = (-math.cos(slope), math.sin(slope))
    neck = _on_slope(p, 0.0, p.front_angle)
    marks: list[Length | Opening] = [
        Length("damper_base", left, foot, ACROSS, -room),
        Length("damper_height", left, (-head[0], head[1]), UP, -head[0]),
        Length(
            "patch_length",
            _on_slope(p, start, p.front_angle),
            _on_slope(p, end, p.front_angle),
            upwards,
            -1.5 * room,
            "start",
        ),
        Length(
            "patch_offset",
            _on_slope(p, end, p.front_angle),
            _on_slope(p, tip, p.front_angle),
            upwards,
            -1.5 * room,
        ),
        Opening(
            "front_angle", neck, _on_slope(p, tip, p.front_angle), (head[0], neck[1]), (-0.1, -0.3)
        ),
    ]
    return marks, foot[1]


def _asymmetric(p: BladeRig) -> tuple[list[Length | Opening], float]:
    (start, end), (low, high), room = p.patch_span, p.left_face, 0.07 * p.pitch
    angle = p.rear_angle_right
    slope = math.radians(angle)
    upwards = (-math.cos(slope), math.sin(slope))
    x = p.rear_halfwidth - p.pitch / 2.0
    fall = math.tan(math.radians(p.damper_angle_left - 90.0))
    cut_low = (x + p.damper_cut, low - p.damper_cut * fall)
    one, two = _on_slope(p, start, angle), _on_slope(p, end, angle)
    middle = ((one[0] + two[0]) / 2.0, (one[1] + two[1]) / 2.0)
    # the pads' outward normal points up to the right; their feet lie below
    foot = (one[0] - p.pad_step * math.sin(slope), one[1] - p.pad_step * math.cos(slope))
    neck = _on_slope(p, 0.0, angle)
    marks: list[Length | Opening] = [
        Length("damper_left", (x, low), (x, high), UP, room),
        Length("damper_cut", (x, low), cut_low, ACROSS, -3.0 * room),
        Opening("damper_angle_left", (x, low), (x, high), cut_low, (-0.1, -0.15)),
        Length("pad_width", one, two, upwards, -2.0 * room, "start"),
        Length("pad_step", foot, one, (math.sin(slope), math.cos(slope)), 1.5 * room),
        Length("pad_centre", (x, high), middle, ACROSS, 4.0 * room),
        Opening("rear_angle_right", neck, two, (two[0], neck[1]), (-0.1, -0.5)),
    ]
    return marks, cut_low[1]


def _side(p: BladeRig) -> SectionView:
    """Through the right blade, along the damper."""
    room, half = 0.12 * p.base_y, p.platform_wy / 2.0
    top, base = p.platform_top, p.base_y / 2.0
    shank, core = p.shank_wy / 2.0, p.core_wy / 2.0
    marks: list[Length | Opening] = [
        Length("base_y", (-base, -p.base_height), (base, -p.base_height), ACROSS, -room),
        Length("shank_wy", (-shank, 0.0), (shank, 0.0), ACROSS, room),
        Length("platform_wy", (-half, top), (half, top), ACROSS, room),
        Length("core_wy", (-core, p.top), (core, p.top), ACROSS, room),
    ]
    strips: list[tuple[str, Point, Point]] = []
    if p.arrangement == "asymmetric":
        level, gap = p.shank_length, p.pad_gap / 2.0
        marks.append(Length("pad_gap", (-gap, level), (gap, level), ACROSS, -room))
        strips = [("pad", (s * gap, level), (s * half, level)) for s in (-1.0, 1.0)]
    elif p.patch_width is not None:
        level, wide = p.shank_length, p.patch_width / 2.0
        marks.append(Length("patch_width", (-wide, level), (wide, level), ACROSS, -room))
        strips = [("patch", (-wide, level), (wide, level))]
    title = "section through the right blade, along the damper"
    return SectionView(title, (p.pitch / 2.0, 0.0, 0.0), (1, 2), marks, strips)
