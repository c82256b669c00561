"""Words beside marks: which marks have them, and where they stand so that none covers another.

The page does the same in the browser, where alone the width of a chart is known (``placed`` in
page.js).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upd.plot.chart import Array, Mark

#: part of the abscissa within which marks are close to each other: of those with the same words
#: only the highest has them, of the others the highest three
CLOSE, MOST_CLOSE = 0.03, 3


@dataclass(frozen=True)
class Box:
    """A rectangle that text covers: its ends along x and y, y upwards."""

    left: float
    bottom: float
    right: float
    top: float

    def covers(self, other: Box) -> bool:
        """Whether the two have an area in common."""
        return (
            self.left < other.right
            and other.left < self.right
            and self.bottom < other.top
            and other.bottom < self.top
        )


def labelled(marks: Sequence[Mark]) -> NDArray[np.bool_]:
    """Which marks have words beside them, (n,).

    From the highest down: not again the words of a higher mark close by, and not more than three
    close to each other, for more are not read.
    """
    out = np.zeros(len(marks), bool)
    taken: list[Mark] = []
    for k in sorted(range(len(marks)), key=lambda k: -marks[k].y):
        mark = marks[k]
        near = [other for other in taken if abs(mark.x - other.x) <= CLOSE * abs(other.x)]
        words = {other.text for other in near}
        if mark.text and mark.text not in words and len(near) < MOST_CLOSE:
            taken.append(mark)
            out[k] = True
    return out


def placed(at: Array, size: Array, dots: Array, width: float, gap: float) -> list[Box]:
    """Places of labels that cover neither each other nor a dot.

    Parameters
    ----------
    at
        Points they belong to, (n, 2), from the lower left corner of the drawing.
    size
        Width and height of each label, (n, 2).
    dots
        Points of all marks, (m, 2), which stay free within half of ``gap``.
    width
        Of the drawing: labels stay between its sides where they are not wider than it.
    gap
        Between a label and its point.

    Returns
    -------
    list of Box
        One per label. The highest point is served first: above its point, else with an end there,
        else beside the labels that are in the way, else above them. Labels may reach beyond the
        upper end of the drawing.
    """
    points = [Box(x - gap / 2, y - gap / 2, x + gap / 2, y + gap / 2) for x, y in dots]
    found: dict[int, Box] = {}
    for k in sorted(range(len(at)), key=lambda k: -at[k][1]):
        taken = [*found.values(), *points]
        found[k] = next(
            box
            for box in _places(at[k], size[k], width, gap, list(found.values()), taken)
            if not any(box.covers(other) for other in taken)
        )
    return [found[k] for k in range(len(at))]


def _places(
    point: Array,
    size: Array,
    width: float,
    gap: float,
    labels: Sequence[Box],
    taken: Sequence[Box],
) -> Iterator[Box]:
    """Above a point, with an end of the label at it, beside what is there, then ever higher.

    The last one is free.
    """
    (x, y), (wide, tall) = point, size
    for left in (x - wide / 2, x - wide + gap / 2, x - gap / 2):
        yield _box(left, y + gap, wide, tall, width)
    box = _box(x - wide / 2, y + gap, wide, tall, width)
    for other in sorted(labels, key=lambda o: abs(o.left + o.right - 2.0 * x)):
        # On the side where the point lies; within the width of a label a line to it is short.
        is_left = 2.0 * x < other.left + other.right
        left = other.left - wide - gap / 4 if is_left else other.right + gap / 4
        if other.covers(box) and x - 2.0 * wide <= left <= x + wide:
            yield _box(left, y + gap, wide, tall, width)
    while in_way := [other for other in taken if other.covers(box)]:
        box = _box(x - wide / 2, max(other.top for other in in_way), wide, tall, width)
        yield box


def is_far(box: Box, point: Array, gap: float) -> bool:
    """Whether a label needs a line to its point: it stands higher, or beside it."""
    return bool(
        box.bottom > point[1] + 1.5 * gap or not box.left - gap <= point[0] <= box.right + gap
    )


def _box(left: float, bottom: float, wide: float, tall: float, width: float) -> Box:
    """The box between the sides of the drawing."""
    left = max(min(left, width - wide), 0.0)
    return Box(float(left), float(bottom), float(left + wide), float(bottom + tall))
