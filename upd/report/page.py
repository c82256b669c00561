"""One page of sections that needs nothing beside it: tables, notes, figures, files."""

from __future__ import annotations

import base64
import gzip
import io
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from markupsafe import Markup, escape

from upd.cache.files import placed_file
from upd.labels import sentence
from upd.plot.chart import Chart
from upd.plot.plotly import figure
from upd.report.tables import MOST_NOTES
from upd.results.answer_table import AnswerTable

if TYPE_CHECKING:
    from jinja2 import Environment

#: letters of the surfaces of a page at most, before they are packed
MOST_LETTERS = 4_000_000
_MU = re.compile(r"\bmu(?=N?\b)")
_INDEX = re.compile(r"\b([KFTkh])_([A-Za-z]{1,2})\b")
_PARTS = Path(__file__).parent / "parts"
#: what a script element would change or end at, moved by 256: its last seven bits stay
_SAFE = {code: code + 256 for code in (0, ord("\r"), 27, ord("<"))}
#: pixels of the width of a picture on a page at most
_WIDTH = 1600
#: PNG file -> heading, for those that have no chart
_HEADINGS = {
    "modes_free": "Mode shapes, free",
    "modes_glued": "Mode shapes, damper glued",
    "dimensions": "Geometry and its dimensions",
}
#: figures beside the first tables
_OPENED = 2


class Verdict(NamedTuple):
    """How it ended: passed, warning or failed, the word for it, and a sentence."""

    kind: str
    word: str
    text: str


@dataclass(frozen=True)
class Panel:
    """One figure of the page.

    Attributes
    ----------
    image
        Data URI of the picture that needs no script.
    charts
        In the order of the page; those of one title share a place.
    """

    name: str
    heading: str
    image: str
    charts: tuple[Chart, ...]


class Section(NamedTuple):
    """A part of a page.

    Attributes
    ----------
    tables, notes, panels, texts, file
        In this order below the heading; of more than three notes the others are folded.
    surfaces
        Whether the view in three dimensions belongs to it.
    kind
        Of its tables: rows that become lists on a phone, or a grid, which may scroll.
    folded, each_folded
        The section, or each of its tables and figures, opens when asked.
    opening
        The page opens on it: tables beside figures.
    """

    heading: str
    tables: Sequence[AnswerTable] = ()
    notes: Sequence[str] = ()
    panels: Sequence[Panel] = ()
    texts: Sequence[str] = ()
    file: str = ""
    surfaces: bool = False
    kind: Literal["stack", "grid", "tall"] = "stack"
    folded: bool = False
    each_folded: bool = False
    opening: bool = False

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to show."""
        has_rows = any(table.rows for table in self.tables)
        shown = self.notes or self.panels or self.texts or self.file or self.surfaces
        return not (has_rows or shown)


def write_page(path: Path, html: str) -> Path:
    """Write a page, whole or not at all; returns its path.

    Raises InputError when the place cannot be written.
    """
    with placed_file(path) as temporary:
        temporary.write_text(html, encoding="utf-8")
    return path


def page_text(
    title: str,
    sections: Sequence[Section],
    *,
    verdict: Verdict | None = None,
    footer: str = "",
    surfaces: Sequence[dict[str, Any]] = (),
) -> str:
    """The page as HTML, with the surfaces that are not too large. Where its first
    section has tables, it opens on them beside the first figures, and all else but notes is folded.
    Sections without content are omitted.
    """
    found = [
        section._replace(tables=[table for table in section.tables if table.rows])
        for section in sections
        if not section.is_empty
    ]
    panels = [panel for section in found for panel in section.panels]
    if found and found[0].tables:
        shown = panels[:_OPENED]
        first = found[0]._replace(panels=shown, opening=True)
        found = [first, *(_folded(s, shown) for s in found[1:])]
        found = [section for section in found if not section.is_empty]
    bodies, left_out = fitting(surfaces)
    page = _environment().get_template("page.html.j2")
    return page.render(
        title=title,
        verdict=verdict,
        sections=found,
        footer=footer,
        most_notes=MOST_NOTES,
        surfaces=bodies,
        surfaces_left_out=left_out,
        style=(_PARTS / "page.css").read_text("utf-8"),
        plotly=_packed_plotly(),
        script=(_PARTS / "page.js").read_text("utf-8"),
        page_data=_packed(_json({"panels": _data(panels), "surfaces": bodies})),
    )


def _folded(section: Section, shown: Sequence[Panel]) -> Section:
    """A section, or each of its figures, that opens when asked; without figures shown before."""
    panels = [panel for panel in section.panels if panel not in shown]
    each = bool(panels or section.surfaces)
    folded = not (each or section.notes)
    return section._replace(panels=panels, folded=folded, each_folded=each or section.each_folded)


@cache
def _environment() -> Environment:
    """Of the templates in the folder parts; every text is escaped."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    made = Environment(
        loader=FileSystemLoader(_PARTS),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["symbols"] = symbols
    return made


@cache
def _packed_plotly() -> str:
    """The script of the installed package as every page holds it: 1.7 MB instead of 5 MB.

    The package itself is slow to import and not needed.
    """
    spec = find_spec("plotly")
    assert spec is not None and spec.origin is not None, "plotly comes with upd"
    return _packed((Path(spec.origin).parent / "package_data" / "plotly.min.js").read_text("utf-8"))


def _packed(text: str) -> str:
    """Text as the page's script unpacks it: gzip, seven bits a letter, the same each time.

    Base64 holds six. The letters cannot end the element they stand in.
    """
    bits = np.unpackbits(np.frombuffer(gzip.compress(text.encode(), mtime=0), np.uint8))
    letters = np.packbits(np.pad(bits, (0, -bits.size % 7)).reshape(-1, 7), axis=1) >> 1
    return letters.tobytes().decode("ascii").translate(_SAFE)


def symbols(text: str) -> Markup:
    """Text with the signs of the field.

    Μ for mu, and what follows the underscore of a symbol as its index.
    """
    spelled = _MU.sub("µ", text)
    return Markup(_INDEX.sub(r"\1<sub>\2</sub>", str(escape(spelled))))


def _json(content: Any) -> str:
    return json.dumps(content, separators=(",", ":"), allow_nan=False)


def versions_text(versions: Mapping[str, str]) -> str:
    """Packages with their versions, as a page ends."""
    return f"Versions: {', '.join(f'{k} {v}' for k, v in versions.items())}." if versions else ""


# ---------------------------------------------------------------- figures


def make_panels(charts: Iterable[Chart], figures: Mapping[str, Path]) -> list[Panel]:
    """Charts with the PNG files that show the same, then the other PNG files."""
    # matplotlib is slow to import
    from upd.plot.matplotlib import chart_png

    groups: dict[str, list[Chart]] = {}
    for chart in charts:
        groups.setdefault(chart.figure or chart.title, []).append(chart)
    panels = []
    for name in dict.fromkeys([*groups, *figures]):
        group = groups.get(name, [])
        heading = _HEADINGS.get(name, name.replace("_", " ").capitalize())
        if group:
            heading = group[0].heading or group[0].title
        # at most six charts: a sheet of more is not read
        drawn = [chart for chart in group if chart.sheet][:6] or group[:6]
        png = figures[name].read_bytes() if name in figures else chart_png(drawn)
        panels.append(Panel(name, heading, image_uri(png), tuple(group)))
    return panels


def _data(panels: Iterable[Panel]) -> dict[str, Any]:
    """What the page's script draws: panel -> list of {title, note, charts}."""
    found: dict[str, list[dict[str, Any]]] = {}
    for panel in panels:
        for title in dict.fromkeys(chart.title for chart in panel.charts):
            charts = [
                {
                    "case": c.case.replace("muN", "µN"),
                    "note": " ".join(filter(None, (sentence(c.detail), c.note))),
                    "figure": figure(c),
                }
                for c in panel.charts
                if c.title == title
            ]
            found.setdefault(panel.name, []).append({"title": title, "charts": charts})
    return found


def fitting(surfaces: Iterable[dict[str, Any]]) -> tuple[list[dict[str, Any]], list[str]]:
    """Surfaces with as many of their fields as a page holds, and what had to be left out, in
    words.
    """
    shown, left_out, room = list[dict[str, Any]](), list[str](), MOST_LETTERS
    for surface in surfaces:
        fields, made = list(surface["fields"]), surface
        while (size := len(_json(made))) > room and fields:
            fields.pop()
            made = surface | {"fields": [*fields]} | ({} if fields else {"motions": []})
        lost = surface["fields"][len(fields) :] if size <= room else [surface]
        left_out += [f"{one['label']}: too large for this page" for one in lost]
        if size <= room:
            shown.append(made)
            room -= size
    return shown, left_out


def image_uri(png: bytes) -> str:
    """A PNG as the data URI of a picture that a page holds: WebP, a third of the bytes."""
    from PIL import Image

    out = io.BytesIO()
    try:
        with Image.open(io.BytesIO(png)) as image:
            image.thumbnail((_WIDTH, image.height))
            image.save(out, "WEBP", quality=80)
        kind, data = "webp", out.getvalue()
    except (OSError, SyntaxError):
        # Damaged: the browser shows what there is of it.
        kind, data = "png", png
    return f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}"
