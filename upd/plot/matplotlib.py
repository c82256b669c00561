"""Pictures that need no script: the run's PNG files and charts drawn by matplotlib, as data URIs."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from upd.plot.chart import Axis, Chart, Map, Trace
from upd.plot.plotly import COLOURS, STATE_COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_STYLE: dict[str, dict[str, Any]] = {
    "line": {"ls": "-"},
    "dashed": {"ls": "--"},
    "dotted": {"ls": ":"},
    "points": {"ls": "", "marker": "o", "ms": 4},
    "both": {"ls": "-", "marker": "o", "ms": 4},
}
_SIZE = (6.4, 4.2)
_DPI = 110


def png_uri(png: bytes) -> str:
    """A PNG as a data URI."""
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")


def png_size(png: bytes) -> tuple[int, int]:
    """Width and height in pixels, from the header every PNG begins with."""
    return int.from_bytes(png[16:20], "big"), int.from_bytes(png[20:24], "big")


def small_png(path: Path, width: int) -> bytes:
    """The PNG with a palette of 256 colours, at most ``width`` pixels wide: about a third of the bytes, as good for a figure."""
    from PIL import Image

    whole, out = path.read_bytes(), io.BytesIO()
    try:
        with Image.open(io.BytesIO(whole)) as image:
            flat = Image.new("RGB", image.size, "white")
            flat.paste(image, mask=image.getchannel("A") if image.mode == "RGBA" else None)
    except (OSError, SyntaxError):
        # Damaged: the browser shows what there is of it.
        return whole
    if flat.width > width:
        flat = flat.resize((width, round(flat.height * width / flat.width)), Image.Resampling.LANCZOS)
    flat.quantize(256, dither=Image.Dither.NONE).save(out, "PNG", optimize=True)
    small = out.getvalue()
    return small if len(small) < len(whole) else whole


def chart_png(charts: list[Chart]) -> bytes:
    """Charts side by side, two in a row."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = min(2, len(charts))
    rows = -(-len(charts) // columns)
    w, h = _SIZE[0] * columns, _SIZE[1] * rows
    sheet = Figure(figsize=(w, h))
    FigureCanvasAgg(sheet)
    # Fixed margins in inches: matplotlib's own layout engines draw everything twice.
    sheet.subplots_adjust(0.85 / w, 0.6 / h, 1.0 - 0.25 / w, 1.0 - 0.4 / h, wspace=1.1 / _SIZE[0], hspace=1.1 / _SIZE[1])
    for k, chart in enumerate(charts):
        draw(chart, sheet.add_subplot(rows, columns, k + 1))
    out = io.BytesIO()
    sheet.savefig(out, format="png", dpi=_DPI)
    return out.getvalue()


def draw(chart: Chart, ax: Axes) -> Axes:
    """Draw a chart on matplotlib axes."""
    for m in chart.maps:
        _draw_map(m, ax, bar=m is chart.maps[0])
    told: set[str] = set()
    for t in chart.traces:
        entry = t.entry or t.label
        _draw_trace(t, ax, "_nolegend_" if entry in told else entry)
        told.add(entry)
    _scales(chart, ax)
    title = f"{chart.title}: {chart.case}" if chart.case else chart.title
    ax.set(title=_plain(title.replace("muN", "µN")), xlabel=_plain(chart.x.label), ylabel=_plain(chart.y.label))
    if not chart.maps:
        ax.grid(alpha=0.3)
    if len(told) > 1:
        ax.legend(fontsize=8)
    return ax


def _scales(chart: Chart, ax: Axes) -> None:
    for axis, name in ((chart.x, "x"), (chart.y, "y")):
        values = np.concatenate([getattr(t, name) for t in chart.traces]) if chart.traces else np.zeros(0)
        if _is_log(axis, values):
            getattr(ax, f"set_{name}scale")("log")
    if chart.equal:
        ax.set_aspect("equal")


def _is_log(axis: Axis, values: Any) -> bool:
    return axis.log and bool((values > 0.0).any())


def _plain(text: str) -> str:
    """Text matplotlib does not take for mathematics."""
    return text.replace("$", r"\$")


def _draw_trace(t: Trace, ax: Axes, entry: str) -> None:
    colour = "#222222" if t.outline else COLOURS[t.colour % len(COLOURS)]
    ax.plot(t.x, t.y, color=colour, lw=1.2, label=_plain(entry), **_STYLE[t.style])


def _draw_map(m: Map, ax: Axes, *, bar: bool) -> None:
    from matplotlib.colors import ListedColormap

    if m.states:
        image = ax.pcolormesh(
            m.x,
            m.y,
            m.z.T,
            cmap=ListedColormap(STATE_COLOURS),
            vmin=-0.5,
            vmax=len(m.states) - 0.5,
            shading="nearest",
            edgecolors="w",
            lw=0.2,
        )
    else:
        image = ax.pcolormesh(m.x, m.y, m.z.T, cmap="viridis", vmin=0.0, vmax=m.top, shading="nearest")
    if bar:
        scale = ax.figure.colorbar(image, ax=ax, shrink=0.85)
        if m.states:
            scale.set_ticks(list(range(len(m.states))), labels=list(m.states))
        else:
            scale.set_label(_plain(m.value.label))
