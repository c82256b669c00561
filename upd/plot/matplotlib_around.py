"""What stands around the drawing of a chart, or at its curves: legend, words beside marks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.transforms import ScaledTranslation

from upd.plot.chart import Chart
from upd.plot.labels import labelled, sides
from upd.plot.matplotlib_parts import is_wide, plain, state_colours
from upd.plot.style import SHARE_COLOURS, colour_of

#: points from the axes to the legend: ticks and the name of x stand between
_BELOW = 34.0
#: part of the height of the axes that a legend may take
_MOST_ROOM = 0.25
#: points of the letters of a legend and of the words beside a mark
_LETTER = 7.0
#: width of a letter, of what stands before an entry and height of a line, as parts of a letter's
#: height: rough, for how many entries fit
_WIDE, _HANDLE, _LINE = 0.52, 4.5, 1.5


def draw_legend(chart: Chart, names: Sequence[str], ax: Axes) -> None:
    """One entry per name in the order of the names, and the states of maps.

    Below the axes where matplotlib makes room there, else where it covers least. The last entry
    tells how many more there are where they would take more than a quarter of the drawing.
    """
    handles = _handles(chart, names, ax)
    if not handles:
        return
    figure = ax.figure.get_figure(root=True)
    assert figure is not None
    wide, tall = 72.0 * figure.get_size_inches() * ax.get_position(original=True).size
    entry = _LETTER * (_WIDE * max(map(len, handles)) + _HANDLE)
    columns = min(max(int(wide / entry), 1), len(handles))
    most = columns * max(int(_MOST_ROOM * tall / (_LINE * _LETTER)), 1)
    shown = dict(list(handles.items())[: most - (len(handles) > most)])
    if len(handles) > most:
        shown[f"and {len(handles) - len(shown)} more"] = Line2D([], [], ls="")
    style: dict[str, Any] = {"fontsize": _LETTER}
    if chart.pies:
        what = ["sector: share of the cycle"] + [f"size: {p.what}" for p in chart.pies if p.what]
        style |= {"title": plain(", ".join(dict.fromkeys(what))), "title_fontsize": _LETTER}
    if figure.get_layout_engine() is not None:
        below = ax.transAxes + ScaledTranslation(0.0, -_BELOW / 72.0, figure.dpi_scale_trans)
        style |= {"loc": "upper center", "bbox_to_anchor": (0.5, 0.0), "bbox_transform": below}
        style |= {"ncols": columns, "frameon": False, "borderaxespad": 0.0}
    ax.legend(list(shown.values()), [plain(name) for name in shown], **style)


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


def draw_labels(chart: Chart, ax: Axes) -> None:
    """Words above the marks that have room for them."""
    align = {"right": "left", "center": "center", "left": "right"}
    for mark, told, side in zip(chart.marks, labelled(chart), sides(chart), strict=True):
        if told:
            ax.annotate(
                plain(mark.text),
                (mark.x, mark.y),
                (0.0, 3.0),
                textcoords="offset points",
                ha=align[side],
                va="bottom",
                fontsize=_LETTER,
                color=colour_of(mark),
                bbox={"fc": "white", "ec": "none", "alpha": 0.7, "pad": 0.5},
            )
