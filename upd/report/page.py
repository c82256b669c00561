"""One page of sections that needs nothing beside it: tables, notes, figures, files."""

from __future__ import annotations

import base64
import gzip
import io
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from markupsafe import Markup, escape

from upd.cache.files import placed_file
from upd.labels import sentence
from upd.plot.answer_table import AnswerTable
from upd.plot.chart import Chart
from upd.plot.plotly import figure
from upd.report.tables import MOST_NOTES, filled

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
#: parts of sections, of which one without any is omitted
_PARTS_OF_SECTIONS = ("tables", "notes", "panels", "texts", "file", "surfaces")
#: figures beside the first tables
_OPENED = 2
_json = partial(json.dumps, separators=(",", ":"), allow_nan=False)


#: how it ended: passed, warning or failed, the word for it, and a sentence
Verdict = tuple[str, str, str]


class Section(NamedTuple):
    """A part of a page.

    Attributes
    ----------
    tables, notes, charts, texts, file
        In this order below the heading; of more than three notes the others are folded.
    pictures
        Name of a figure -> PNG file: drawings of its charts, or without any.
    surfaces
        Drawn in three dimensions.
    folded, each_folded
        The section, or each of its tables and figures, opens when asked.
    """

    heading: str
    tables: Sequence[AnswerTable] = ()
    notes: Sequence[str] = ()
    charts: Sequence[Chart] = ()
    texts: Sequence[str] = ()
    file: str = ""
    pictures: Mapping[str, Path] = MappingProxyType({})
    surfaces: Sequence[dict[str, Any]] = ()
    folded: bool = False
    each_folded: bool = False


def write_page(path: Path, html: str) -> Path:
    """Write a page, whole or not at all; returns its path.

    Raises InputError when the place cannot be written.
    """
    with placed_file(path) as temporary:
        temporary.write_text(html, encoding="utf-8")
    return path


def page_text(
    title: str, sections: Sequence[Section], *, verdict: Verdict | None = None, footer: str = ""
) -> str:
    """The page as HTML, with the surfaces that are not too large. Where its first
    section has tables, it opens on them beside the first figures, and all else but notes is folded.
    Sections without content are omitted.
    """
    found = [_content(one) for one in sections]
    panels = [panel for one in found for panel in one["panels"]]
    if found and found[0]["tables"]:
        shown = found[0]["panels"] = panels[:_OPENED]
        for one in found[1:]:
            one["panels"] = [panel for panel in one["panels"] if panel not in shown]
            one["each_folded"] |= bool(one["panels"] or one["surfaces"])
            one["folded"] = not (one["each_folded"] or one["notes"])
    found = [one for one in found if any(one[part] for part in _PARTS_OF_SECTIONS)]
    bodies, left_out = fitting(surface for one in found for surface in one["surfaces"])
    data = {panel["name"]: panel["groups"] for panel in panels if panel["groups"]}
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
        page_data=_packed(_json({"panels": data, "surfaces": bodies})),
    )


def _content(section: Section) -> dict[str, Any]:
    """A section for the template: tables with rows, and panels."""
    tables = []
    for one in section.tables:
        cells = dict(zip(one.columns, zip(*one.rows, strict=True), strict=False))
        tables += [filled(one.heading, cells, one.note)] if cells else []
    panels = _panels(section.charts, section.pictures)
    return {**section._asdict(), "tables": tables, "charts": (), "pictures": (), "panels": panels}


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


def versions_text(versions: Mapping[str, str]) -> str:
    """Packages with their versions, as a page ends."""
    return f"Versions: {', '.join(f'{k} {v}' for k, v in versions.items())}." if versions else ""


# ---------------------------------------------------------------- figures


def _panels(charts: Iterable[Chart], pictures: Mapping[str, Path]) -> list[dict[str, Any]]:
    """Charts with the PNG files that show the same, then the other PNG files: name, heading, data
    URI of the picture, and groups of one title, which share a place, for the page's script.
    """
    # matplotlib is slow to import
    from upd.plot.matplotlib import chart_png

    figures: dict[str, list[Chart]] = {name: [] for name in (c.figure or c.title for c in charts)}
    for chart in charts:
        figures[chart.figure or chart.title].append(chart)
    panels = []
    for name, mine in (figures | {name: [] for name in pictures if name not in figures}).items():
        heading = _HEADINGS.get(name, name.replace("_", " ").capitalize())
        if mine:
            heading = mine[0].heading or mine[0].title
        # at most six charts: a sheet of more is not read
        drawn = [chart for chart in mine if chart.sheet][:6] or mine[:6]
        png = pictures[name].read_bytes() if name in pictures else chart_png(drawn)
        titles: dict[str, list[dict[str, Any]]] = {}
        for chart in mine:
            note = " ".join(filter(None, (sentence(chart.detail), chart.note)))
            case = chart.case.replace("muN", "µN")
            one = {"case": case, "note": note, "figure": figure(chart)}
            titles.setdefault(chart.title, []).append(one)
        groups = [{"title": title, "charts": found} for title, found in titles.items()]
        panels.append({"name": name, "heading": heading, "image": image_uri(png), "groups": groups})
    return panels


def fitting(surfaces: Iterable[dict[str, Any]]) -> tuple[list[dict[str, Any]], list[str]]:
    """Surfaces with as many of their fields as a page holds, and what had to be left out."""
    shown, left_out, room = list[dict[str, Any]](), list[str](), MOST_LETTERS
    for surface in surfaces:
        fields = surface["fields"]
        counts = range(len(fields), -1, -1)
        tried = (surface | {"fields": fields[:k]} | ({} if k else {"motions": []}) for k in counts)
        fit = next((made for made in tried if len(_json(made)) <= room), None)
        lost = [surface] if fit is None else fields[len(fit["fields"]) :]
        left_out += [f"{one['label']}: too large for this page" for one in lost]
        if fit is not None:
            shown.append(fit)
            room -= len(_json(fit))
    return shown, left_out


def image_uri(png: bytes) -> str:
    """A PNG as the data URI of a picture that a page holds: WebP, a third of the bytes."""
    from PIL import Image

    out = io.BytesIO()
    with Image.open(io.BytesIO(png)) as image:
        image.thumbnail((_WIDTH, image.height))
        image.save(out, "WEBP", quality=80)
    return f"data:image/webp;base64,{base64.b64encode(out.getvalue()).decode('ascii')}"
