"""Figures of a page: the run's PNG files beside the charts that show the same, each with a picture
that needs no script.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, cast

from upd.analyses import analysis_named
from upd.plot.chart import Chart, Charts
from upd.plot.matplotlib import chart_png
from upd.plot.plotly import figure
from upd.plot.png import png_size, png_uri, small_png
from upd.report import generic
from upd.report.error_budget import budget_charts
from upd.report.folder import RunFolder

#: PNG file -> heading, for those that have no chart
_HEADINGS = {
    "contact_map": "Contact points at the peak",
    "contact_law": "Contact points of the dynamic model",
    "contact_open": "Nodes in contact",
    "surface": "Deformed contact surface",
    "modes_free": "Mode shapes, free",
    "modes_glued": "Mode shapes, damper glued",
    "work_precision": "What accuracy costs",
    "dimensions": "Geometry and its dimensions",
}
#: bytes the PNG files may take before they are made smaller, and the widths in pixels they are then
#: given, one after the other
_ROOM_BYTES = 1_000_000
_WIDTHS = (2400, 1600, 1100, 800)


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
        Title, note and the charts of that title, in the order of the page.
    """

    name: str
    heading: str
    image: str
    sheet: bool
    charts: tuple[tuple[str, str, tuple[Chart, ...]], ...]

    @property
    def alt(self) -> str:
        """Words for those who do not see the picture."""
        return self.heading


def charts_of(run: RunFolder) -> Charts:
    """The analysis that knows the charts of the run; the generic one when it is not known."""
    return analysis_named(str(run.summary["size"].get("analysis", ""))) or cast(Charts, generic)


def run_panels(run: RunFolder) -> list[Panel]:
    """All figures of a run, in the order of its charts; PNG files without a chart last."""
    of, results = charts_of(run), run.summary["results"]
    charts = of.charts(run.arrays, run.summary)
    budget = budget_charts(of.headline(results) or generic.headline(results))
    return make_panels([*charts, *budget], run.figures)


def make_panels(charts: Iterable[Chart], figures: Mapping[str, Path]) -> list[Panel]:
    """Charts with the PNG files that show the same, then the other PNG files."""
    groups: dict[str, list[Chart]] = {}
    for chart in charts:
        groups.setdefault(chart.figure or chart.title, []).append(chart)
    images = _images(figures)
    panels = [
        _panel(name, group[0].heading or group[0].title, images.get(name) or _drawn(group), group)
        for name, group in groups.items()
    ]
    return panels + [
        _panel(name, _heading(name), image, [])
        for name, image in images.items()
        if name not in groups
    ]


def _images(figures: Mapping[str, Path]) -> dict[str, bytes]:
    """The PNG files, with a palette and smaller where the page would not hold them as they are."""
    images = {name: f.read_bytes() for name, f in figures.items()}
    with ThreadPoolExecutor() as pool:
        for width in _WIDTHS:
            if sum(map(len, images.values())) <= _ROOM_BYTES:
                break
            smaller = pool.map(partial(small_png, width=width), figures.values())
            images = dict(zip(figures, smaller, strict=True))
    return images


def _panel(name: str, heading: str, png: bytes, group: list[Chart]) -> Panel:
    width, _ = png_size(png)
    return Panel(name, heading, png_uri(png), width > _SHEET_PIXELS, _titled(group))


def _heading(name: str) -> str:
    return _HEADINGS.get(name, name.replace("_", " ").capitalize())


def _drawn(group: list[Chart]) -> bytes:
    """At most six charts: a sheet of more is not read."""
    return chart_png([chart for chart in group if chart.sheet][:6] or group[:6])


def _titled(group: list[Chart]) -> tuple[tuple[str, str, tuple[Chart, ...]], ...]:
    titles = dict.fromkeys(chart.title for chart in group)
    found = {title: tuple(c for c in group if c.title == title) for title in titles}
    return tuple((title, mine[0].note, mine) for title, mine in found.items())


def _note(chart: Chart) -> str:
    """What stands under a chart: its detail as a sentence, and what to see."""
    detail = f"{chart.detail[:1].upper()}{chart.detail[1:]}." if chart.detail else ""
    return " ".join(part for part in (detail, chart.note) if part)


def data(panels: Iterable[Panel]) -> dict[str, Any]:
    """What the page's script draws: panel -> list of {title, note, charts}."""
    return {
        p.name: [
            {
                "title": t,
                "charts": [
                    {"case": c.case.replace("muN", "µN"), "note": _note(c), "figure": figure(c)}
                    for c in charts
                ],
            }
            for t, _, charts in p.charts
        ]
        for p in panels
        if p.charts
    }
