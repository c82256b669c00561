"""What stands around the drawing of a chart, or between its curves: legend, words beside marks.

The legend stands below the axes, where it covers nothing; labels stand apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.transforms import ScaledTranslation

from upd.plot.chart import Array, Chart, Mark
from upd.plot.labels import Box, is_far, labelled, placed
from upd.plot.matplotlib_parts import BAR_PAD, BAR_TALL, is_wide, plain, state_colours
from upd.plot.style import SHARE_COLOURS, colour_of

#: points from the axes to the legend, where ticks and the name of x stand, and those a colour bar
#: with its ticks and name adds
_BELOW, _BAR_TEXT = 38.0, 34.0
#: inches a legend may reach beyond its axes on both sides together
_OVER = 0.45
#: points between a label and its mark, and above the highest label
_GAP, _AIR = 4.0, 2.0
#: points between two labels
_APART = 2.0
#: part of the height labels may take: the rest is left to the curves
_MOST_ROOM = 0.5
#: by which part of itself the ordinate grows until the labels find room
_STEP = 0.04
_LETTER = 7.0


def draw_legend(chart: Chart, names: Sequence[str], ax: Axes, bars: Sequence[Axes]) -> None:
    """One entry per name below the axes, in the order of the names, and the states of maps.

    Where they are so many that the curves would lose more than half of their room, in small print.

    Parameters
    ----------
    bars
        Axes of the chart's colour bars, which move with it.
    """
    handles = _handles(chart, names, ax)
    if not handles:
        return
    figure = _figure(ax)
    size = 7.0 if len(handles) > 4 else 8.0
    wide = 72.0 * figure.get_figwidth() * ax.get_position(original=True).width + 72.0 * _OVER
    room = wide * figure.dpi / 72.0
    columns = len(handles)
    legend = _legend(chart, handles, ax, size, columns)
    if legend.get_window_extent().width > room:
        least = _legend(chart, handles, ax, size, 1).get_window_extent().width
        columns = max(int(room / least), 1)
        size *= min(room / least, 1.0)
        legend = _legend(chart, handles, ax, size, columns)
    # An engine for layouts makes room itself.
    if figure.get_layout_engine() is None:
        most = _MOST_ROOM * ax.get_position(original=True).height * figure.bbox.height
        tall = legend.get_window_extent().height
        if tall > most:
            legend = _legend(chart, handles, ax, size * most / tall, columns)
        _lift(ax, bars, legend.get_window_extent().height / figure.bbox.height)


def _handles(chart: Chart, names: Sequence[str], ax: Axes) -> dict[str, Any]:
    """What stands before each entry."""
    drawn, labels = ax.get_legend_handles_labels()
    handles: dict[str, Any] = {
        name: drawn[labels.index(plain(name))] for name in names if plain(name) in labels
    }
    for pies in chart.pies:
        for state in pies.states:
            circle = Line2D([], [], marker="o", ls="", color=SHARE_COLOURS.get(state))
            handles.setdefault(state, circle)
    if not is_wide(chart):
        for m in chart.maps:
            for state, colour in zip(m.states, state_colours(m), strict=False):
                handles.setdefault(state, Patch(facecolor=colour, edgecolor="#999999", lw=0.4))
    return handles


def _legend(chart: Chart, handles: dict[str, Any], ax: Axes, size: float, columns: int) -> Legend:
    figure = _figure(ax)
    below = _BELOW
    if is_wide(chart) and len(figure.axes) > 1:
        below = 72.0 * (BAR_PAD + BAR_TALL) + _BAR_TEXT
    style: dict[str, Any] = {"fontsize": size, "ncols": columns, "frameon": False}
    if chart.pies:
        what = ["sector: share of the cycle"] + [f"size: {p.what}" for p in chart.pies if p.what]
        style |= {"title": plain(", ".join(dict.fromkeys(what))), "title_fontsize": 7.0}
    if chart.bars or any(m.states for m in chart.maps):
        style |= {"handlelength": 1.2}
    return ax.legend(
        list(handles.values()),
        [plain(name) for name in handles],
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        bbox_transform=ax.transAxes + ScaledTranslation(0.0, -below / 72.0, figure.dpi_scale_trans),
        borderaxespad=0.0,
        columnspacing=1.2,
        **style,
    )


def _lift(ax: Axes, bars: Sequence[Axes], part: float) -> None:
    """Make axes lower from below by a part of the figure's height; bars beside them too.

    Bars below them move up.
    """
    box = ax.get_position(original=True)
    part = min(part, _MOST_ROOM * box.height)
    scale = (box.height - part) / box.height
    for mine in (ax, *bars):
        at = mine.get_position(original=True)
        is_below = at.y1 <= box.y0
        mine.set_position(
            (
                at.x0,
                at.y0 + part if is_below else box.y0 + part + (at.y0 - box.y0) * scale,
                at.width,
                at.height if is_below else at.height * scale,
            )
        )


def draw_labels(chart: Chart, ax: Axes) -> None:
    """Words beside the marks that have them, apart from each other and below the end of y.

    Called when everything else stands: it depends on the size of the axes and the ends of x.
    """
    shown = [
        m
        for m, told in zip(chart.marks, labelled(chart.marks), strict=True)
        if told and _is_seen(m, ax)
    ]
    if not shown:
        return
    figure = _figure(ax)
    if figure.get_layout_engine() is not None:
        figure.draw_without_rendering()
    # Ends are found when they are asked for.
    ax.get_ylim()
    ax.apply_aspect()
    points = 72.0 / figure.dpi
    texts = [
        ax.text(0.0, 0.0, plain(m.text), fontsize=_LETTER, transform=ax.transAxes) for m in shown
    ]
    extents = [text.get_window_extent() for text in texts]
    size = np.array([[e.width, e.height] for e in extents]) * points + _APART
    for text in texts:
        text.remove()
    frame = ax.get_window_extent()
    for end in _ends(chart, ax):
        ax.set_ylim(top=end)
        at, dots = (_places(ax, marks) * points for marks in (shown, chart.marks))
        boxes = placed(at, size, dots, frame.width * points, _GAP)
        if max(box.top for box in boxes) <= frame.height * points - _AIR:
            break
    for mark, box, point in zip(shown, boxes, at, strict=True):
        _write(mark, box, point, ax)


def _is_seen(mark: Mark, ax: Axes) -> bool:
    """Whether a mark lies between the ends of x, and has a place on the ordinate."""
    low, high = sorted(ax.get_xlim())
    return low <= mark.x <= high and (mark.y > 0.0 or ax.get_yscale() != "log")


def _places(ax: Axes, marks: Sequence[Mark]) -> Array:
    """Marks in pixels from the lower left corner of the axes, (n, 2)."""
    frame = ax.get_window_extent()
    at = ax.transData.transform([(m.x, m.y) for m in marks])
    return np.asarray(at - [frame.x0, frame.y0], float)


def _ends(chart: Chart, ax: Axes) -> list[float]:
    """Ends of the ordinate to try: its own, then ever higher ones until half of it is free.

    Only its own where the chart asks for it.
    """
    if chart.y.high is not None:
        return [ax.get_ylim()[1]]
    scale = ax.yaxis.get_transform()
    low, high = scale.transform(np.array(ax.get_ylim()))
    more = np.arange(1.0, 1.0 / (1.0 - _MOST_ROOM) + _STEP, _STEP)
    return [float(end) for end in scale.inverted().transform(low + (high - low) * more)]


def _write(mark: Mark, box: Box, point: Array, ax: Axes) -> None:
    """The words of a mark, with a thin line to it where they do not stand at it."""
    style: dict[str, Any] = {"fontsize": _LETTER, "color": colour_of(mark), "ha": "left"}
    if is_far(box, point, _GAP):
        style["arrowprops"] = {
            "arrowstyle": "-",
            "lw": 0.5,
            "color": colour_of(mark),
            "shrinkA": 0.0,
            "shrinkB": 1.5,
            # From the lower edge where it is nearest to the mark.
            "relpos": (float(np.clip((point[0] - box.left) / (box.right - box.left), 0, 1)), 0.0),
        }
    ax.annotate(
        plain(mark.text),
        (mark.x, mark.y),
        (box.left - point[0], box.bottom - point[1]),
        textcoords="offset points",
        va="bottom",
        multialignment="center",
        annotation_clip=True,
        **style,
    )


def _figure(ax: Axes) -> Figure:
    figure = ax.figure.get_figure(root=True)
    assert figure is not None
    return figure
