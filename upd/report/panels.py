"""Figures of a page: the PNG files of a folder beside the charts that show the same, each with a
picture that needs no script, and as many surfaces as the page has room for.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from upd.plot.chart import Chart
from upd.plot.matplotlib import chart_png
from upd.plot.plotly import figure
from upd.plot.png import image_uri, png_size
from upd.plot.surface import Surface, n_bytes, with_fields

#: PNG file -> heading, for those that have no chart
_HEADINGS = {
    "modes_free": "Mode shapes, free",
    "modes_glued": "Mode shapes, damper glued",
    "dimensions": "Geometry and its dimensions",
}
#: a picture wider than this has drawings side by side
_SHEET_PIXELS = 1300


@dataclass(frozen=True)
class Panel:
    """One figure of the page.

    Attributes
    ----------
    image
        Data URI of the picture that needs no script.
    sheet
        Whether that picture has drawings side by side, which need the width of the page.
    charts
        In the order of the page; those of one title share a place.
    """

    name: str
    heading: str
    image: str
    sheet: bool
    charts: tuple[Chart, ...]


def make_panels(charts: Iterable[Chart], figures: Mapping[str, Path]) -> list[Panel]:
    """Charts with the PNG files that show the same, then the other PNG files."""
    groups: dict[str, list[Chart]] = {}
    for chart in charts:
        groups.setdefault(chart.figure or chart.title, []).append(chart)
    images = {name: path.read_bytes() for name, path in figures.items()}
    panels = [
        _panel(name, group[0].heading or group[0].title, images.get(name) or _drawn(group), group)
        for name, group in groups.items()
    ]
    return panels + [
        _panel(name, _heading(name), image, [])
        for name, image in images.items()
        if name not in groups
    ]


def _panel(name: str, heading: str, png: bytes, group: list[Chart]) -> Panel:
    width, _ = png_size(png)
    return Panel(name, heading, image_uri(png), width > _SHEET_PIXELS, tuple(group))


def _heading(name: str) -> str:
    return _HEADINGS.get(name, name.replace("_", " ").capitalize())


def _drawn(group: list[Chart]) -> bytes:
    """At most six charts: a sheet of more is not read."""
    return chart_png([chart for chart in group if chart.sheet][:6] or group[:6])


def _note(chart: Chart) -> str:
    """What stands under a chart: its detail as a sentence, and what to see."""
    detail = f"{chart.detail[:1].upper()}{chart.detail[1:]}." if chart.detail else ""
    return " ".join(part for part in (detail, chart.note) if part)


def data(panels: Iterable[Panel]) -> dict[str, Any]:
    """What the page's script draws: panel -> list of {title, note, charts}."""
    found: dict[str, list[dict[str, Any]]] = {}
    for panel in panels:
        for title in dict.fromkeys(chart.title for chart in panel.charts):
            charts = [
                {"case": c.case.replace("muN", "µN"), "note": _note(c), "figure": figure(c)}
                for c in panel.charts
                if c.title == title
            ]
            found.setdefault(panel.name, []).append({"title": title, "charts": charts})
    return found


def fitting(surfaces: Iterable[Surface], room: int) -> tuple[list[Surface], list[str]]:
    """Surfaces that fit into ``room`` bytes, with as many of their fields as fit, and what had to
    be left out, in words.
    """
    shown, left_out = [], []
    for surface in surfaces:
        n = len(surface.fields)
        while n > 0 and n_bytes(with_fields(surface, n)) > room:
            n -= 1
        part = with_fields(surface, n)
        if n_bytes(part) > room:
            left_out.append(f"{surface.label}: too large for this page")
            continue
        left_out += [f"{f.label}: too large for this page" for f in surface.fields[n:]]
        room -= n_bytes(part)
        shown.append(part)
    return shown, left_out
