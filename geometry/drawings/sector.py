"""Sections of the sector of a bladed disk with its dimensions."""

from __future__ import annotations

import math
from dataclasses import replace

from geometry.sector import BladedSector
from upd.mesh.section import Length, Opening, SectionView

ACROSS, UP = (1.0, 0.0), (0.0, 1.0)


def coarse(params: BladedSector) -> BladedSector:
    """The same geometry with few elements."""
    few = dict.fromkeys(("disk_layers", "blade_layers", "axial"), 4)
    return replace(params, **few, shank_layers=2, platform_layers=1, element_nodes=8)


def views(params: BladedSector) -> list[SectionView]:
    """Across the axis, and along it through the bore and through the shank."""
    p = params
    across = SectionView("section z = 0, across the axis", (0.0, 0.0, 0.0), (0, 1), _across(p))
    bore = Length("bore_width", (0.0, -p.bore_width / 2.0), (0.0, p.bore_width / 2.0), UP, 0.0)
    end = (0.0, p.chord / 2.0)
    lean = (end[1] * math.tan(math.radians(p.stagger)), end[1])
    shank: list[Length | Opening] = [
        Length("chord", (0.0, -end[1]), end, UP, 1.5 * p.blade_thickness),
        Opening("stagger", (0.0, 0.0), lean, end, (0.0, -0.5)),
    ]
    inside, middle = 1.01 * p.bore, p.rim + 0.5 * p.shank_length
    return [
        across,
        SectionView("section near the bore, along the axis", (inside, 0.0, 0.0), (1, 2), [bore]),
        SectionView("section through the shank", (middle, 0.0, 0.0), (1, 2), shank),
    ]


def _across(p: BladedSector) -> list[Length | Opening]:
    bore, rim, under, top, tip = p.radii
    low = -1.1 * rim * math.sin(p.pitch / 2.0)
    marks: list[Length | Opening] = [
        Length("bore", (0.0, 0.0), (bore, 0.0), ACROSS, low),
        Length("rim", (0.0, 0.0), (rim, 0.0), ACROSS, 1.4 * low),
        Length("shank_length", (rim, 0.0), (under, 0.0), ACROSS, 1.8 * low),
        Length("platform_thickness", (under, 0.0), (top, 0.0), ACROSS, 1.4 * low),
        Length("blade_length", (top, 0.0), (tip, 0.0), ACROSS, -low),
    ]
    half, face = p.blade_thickness / 2.0, p.pitch / 2.0
    marks.append(Length("blade_thickness", (top, -half), (top, half), UP, -0.4 * p.blade_length))
    # along the normal of the sector's face, at the platform's top end
    normal = (-math.sin(face), math.cos(face))
    on_face = (top * math.cos(face), top * math.sin(face))
    end = (on_face[0] - p.half_gap * normal[0], on_face[1] - p.half_gap * normal[1])
    marks.append(Length("half_gap", end, on_face, normal, -0.1 * p.blade_length))
    turn = math.radians(p.face_angle)
    corner = (under * math.cos(half / under), under * math.sin(half / under))
    rising = (corner[0] + math.sin(turn), corner[1] + math.cos(turn))
    level = (corner[0], corner[1] + 1.0)
    marks.append(Opening("face_angle", corner, rising, level, (-0.5, 0.35)))
    return marks
