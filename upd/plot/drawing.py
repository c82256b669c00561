"""A labelled drawing: sections through meshes with the dimensions of their recipe."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Arc
from matplotlib.text import Text

from upd.mesh import FloatArray, Mesh
from upd.mesh.section import CutBody, Length, Opening, SectionView, cut
from upd.plot.matplotlib import draw_sheet
from upd.plot.style import COLOURS, OUTLINE

#: white mixed to the colours of the bodies
_PALE = 0.65
_INK, _STRIPS = "#333333", ("#c1561a", "#5a3d8a")
#: inches of one axes, and of one with a section much higher than wide, from this ratio on
_SIZE, _TALL, _SLENDER = (5.6, 5.2), (6.6, 7.6), 1.6
#: inches of margins that the axes do not fill, and of room around what is drawn
_AROUND, _ROOM = 1.2, 0.08
#: points of the letters' height and inches of their mean width
_LETTERS, _LETTER = 8.5, 0.068
#: inches of an arrow outside its length, of an arc
_REACH, _RADIUS = 0.16, 0.4
_HEAD = ",head_length=0.35,head_width=0.13"
#: rounds of scale and room for names; they settle in two or three
_ROUNDS = 6


def draw_sections(meshes: Mapping[str, Mesh], views: Sequence[SectionView]) -> Figure:
    """The sections side by side, each body in a colour, dimensions with their parameter's name."""
    bodies = [cut(meshes, view) for view in views]
    limits = [_section(view, body)[1] for view, body in zip(views, bodies, strict=True)]
    slenderest = max(float(high[1] - low[1]) / float(high[0] - low[0]) for low, high in limits)
    size = _SIZE if slenderest < _SLENDER else _TALL
    drawings = [
        partial(_draw, view=view, bodies=body, size=size)
        for view, body in zip(views, bodies, strict=True)
    ]
    return draw_sheet(drawings, len(views), size=size)


def _section(
    view: SectionView, bodies: Mapping[str, CutBody]
) -> tuple[list[FloatArray], tuple[FloatArray, FloatArray]]:
    """Points of what is shown, and their least and largest coordinates."""
    points = [outline.reshape(-1, 2) for _, outline in bodies.values()]
    if view.window is not None:
        points = [np.array(view.window)]
    every = np.vstack(points)
    return points, (every.min(axis=0), every.max(axis=0))


def _draw(
    ax: Axes, *, view: SectionView, bodies: Mapping[str, CutBody], size: tuple[float, float]
) -> None:
    for k, (name, (cells, outline)) in enumerate(bodies.items()):
        if not cells:
            continue
        pale = tuple(_PALE + (1.0 - _PALE) * c for c in to_rgb(COLOURS[k % len(COLOURS)]))
        ax.add_collection(
            PolyCollection(cells, facecolors=[pale], edgecolors="white", linewidths=0.3)
        )
        ax.add_collection(LineCollection(list(outline), colors=OUTLINE, linewidths=0.9))
        ax.plot([], [], "s", color=pale, label=name)
    for k, name in enumerate(dict.fromkeys(name for name, *_ in view.strips)):
        style: dict[str, Any] = {"color": _STRIPS[k % 2], "linewidth": 3, "solid_capstyle": "butt"}
        for _, start, end in (strip for strip in view.strips if strip[0] == name):
            ax.plot(*zip(start, end, strict=True), **style)
        ax.plot([], [], label=name, **style)
    scale = _frame(ax, view, bodies, size)
    for mark in view.marks:
        if isinstance(mark, Length):
            _length(ax, mark, scale)
        else:
            (low, high), wide = _turns(mark), 2.0 * _RADIUS * scale
            arc = Arc(mark.vertex, wide, wide, theta1=low, theta2=high, color=_INK, linewidth=0.7)
            ax.add_patch(arc)
        ax.add_artist(_label(mark, scale))
    ax.set_aspect("equal")
    ax.set_axis_off()
    ax.set_title(view.title, fontsize=10)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=5, frameon=False, fontsize=9)


def _frame(
    ax: Axes, view: SectionView, bodies: Mapping[str, CutBody], size: tuple[float, float]
) -> float:
    """Limits that hold the section and every dimension with its name; mm per inch.

    The names take room in inches, so the scale they are placed by is found in a few rounds.
    """
    points, (low, high) = _section(view, bodies)
    wide, tall = size[0] - _AROUND, size[1] - _AROUND
    scale = 0.0
    for _ in range(_ROUNDS):
        scale = max(scale, float(max((high[0] - low[0]) / wide, (high[1] - low[1]) / tall)))
        marks = [_box(_label(mark, scale), scale) for mark in view.marks]
        lines = [np.array(_line(mark)) for mark in view.marks if isinstance(mark, Length)]
        every = np.vstack([*points, *marks, *lines])
        low, high = every.min(axis=0) - _ROOM * scale, every.max(axis=0) + _ROOM * scale
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    return scale


def _text(
    text: str, at: FloatArray, side: Literal["left", "center", "right"], turn: float, above: bool
) -> Text:
    """The name of a dimension with its value.

    Parameters
    ----------
    at
        (2,) the end of its line of letters that ``side`` names.
    turn
        Its angle in degrees.
    """
    about: dict[str, Any] = {"rotation": turn, "rotation_mode": "anchor", "fontsize": _LETTERS}
    level: Literal["bottom", "center"] = "bottom" if above else "center"
    return Text(float(at[0]), float(at[1]), text, color=_INK, ha=side, va=level, **about)


def _box(label: Text, scale: float) -> FloatArray:
    """Corners of a text, (4, 2) in mm."""
    long, tall = len(label.get_text()) * _LETTER * scale, 1.5 * _LETTERS / 72.0 * scale
    begin = {"left": 0.0, "center": -0.5, "right": -1.0}[label.get_horizontalalignment()] * long
    low = 0.0 if label.get_verticalalignment() == "bottom" else -0.5 * tall
    flat = np.array([(x, y) for x in (begin, begin + long) for y in (low, low + tall)])
    turn = math.radians(label.get_rotation())
    across = np.array([math.cos(turn), math.sin(turn)])
    up = np.array([-across[1], across[0]])
    corners: FloatArray = label.get_position() + flat[:, :1] * across + flat[:, 1:] * up
    return corners


def _label(mark: Length | Opening, scale: float) -> Text:
    if isinstance(mark, Opening):
        return _label_of_angle(mark, scale)
    one, two, direction, turn, turned = _written(mark)
    text = f"{mark.name} {mark.value:.4g}"
    if len(text) * _LETTER * scale < 0.96 * float(np.linalg.norm(two - one)):
        return _text(text, (one + two) / 2.0, "center", turn, True)
    if abs(abs(turn) - 90.0) < 1.0:
        # beside an upright length, away from what it measures
        out = -1.0 if mark.offset * mark.along[1] > 0.0 else 1.0
        at = (one + two) / 2.0 + np.array([0.08 * scale * out, 0.0])
        return _text(text, at, "left" if out > 0.0 else "right", 0.0, False)
    # beyond the arrows, which stand outside a short length
    short = float(np.linalg.norm(two - one)) <= 3.0 * _REACH * scale
    reach = (1.15 * _REACH if short else 0.06) * scale * direction
    at_two = (mark.beyond == "end") != turned
    at = two + reach if at_two else one - reach
    return _text(text, at, "left" if at_two else "right", turn, False)


def _label_of_angle(mark: Opening, scale: float) -> Text:
    text = f"{mark.name} {mark.value:.4g}°"
    vertex, radius = np.array(mark.vertex), _RADIUS * scale
    if mark.label_at is not None:
        place = np.array(mark.label_at)
        side: Literal["left", "right"] = "left" if place[0] > 0.0 else "right"
        return _text(text, vertex + scale * place, side, 0.0, False)
    middle = math.radians(sum(_turns(mark)) / 2.0)
    at = vertex + 1.15 * radius * np.array([math.cos(middle), math.sin(middle)])
    return _text(text, at, "left" if math.cos(middle) > 0.0 else "right", 0.0, False)


def _line(mark: Length) -> tuple[FloatArray, FloatArray]:
    """Ends of the line a length is written on."""
    along = np.array(mark.along)
    left = np.array([-along[1], along[0]])
    start, end = np.array(mark.start), np.array(mark.end)
    outermost = (max if mark.offset > 0.0 else min)(start @ left, end @ left)
    level = (outermost + mark.offset) * left
    return (start @ along) * along + level, (end @ along) * along + level


def _written(mark: Length) -> tuple[FloatArray, FloatArray, FloatArray, float, bool]:
    """The line's ends as one reads its name, its direction and angle, and whether it was turned."""
    one, two = _line(mark)
    direction = (two - one) / np.linalg.norm(two - one)
    turn = math.degrees(math.atan2(direction[1], direction[0]))
    if -90.0 < turn <= 90.0 + 1e-9:
        return one, two, direction, turn, False
    return two, one, -direction, turn % 360.0 - 180.0, True


def _length(ax: Axes, mark: Length, scale: float) -> None:
    for point, foot in zip((mark.start, mark.end), _line(mark), strict=True):
        ax.plot(*zip(point, foot, strict=True), color=_INK, linewidth=0.4)
    one, two, direction, _, _ = _written(mark)
    if float(np.linalg.norm(two - one)) > 3.0 * _REACH * scale:
        _arrow(ax, one, two, f"<|-|>{_HEAD}")
        return
    # no room for two arrows between the ends
    reach = _REACH * scale * direction
    _arrow(ax, one - reach, one, f"-|>{_HEAD}")
    _arrow(ax, two + reach, two, f"-|>{_HEAD}")
    ax.plot(*zip(one, two, strict=True), color=_INK, linewidth=0.6)


def _arrow(ax: Axes, start: FloatArray, end: FloatArray, style: str) -> None:
    look = {"arrowstyle": style, "color": _INK, "linewidth": 0.6, "shrinkA": 0.0, "shrinkB": 0.0}
    ax.annotate("", xy=tuple(end), xytext=tuple(start), arrowprops=look)


def _turns(mark: Opening) -> tuple[float, float]:
    """Angles of the two sides, degrees, counter-clockwise."""
    vertex = np.array(mark.vertex)
    low, high = sorted(
        math.degrees(math.atan2(*(np.array(p) - vertex)[::-1])) for p in (mark.one, mark.two)
    )
    return (high, low + 360.0) if high - low > 180.0 else (low, high)
