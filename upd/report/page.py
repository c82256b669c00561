"""One page of sections that needs nothing beside it: tables, notes, figures, files."""

from __future__ import annotations

import gzip
import json
import re
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from markupsafe import Markup, escape

from upd.cache.files import write_text
from upd.errors import InputError
from upd.plot.png import image_uri
from upd.plot.surface import Surface, packed
from upd.report.notes import MOST_NOTES
from upd.report.panels import Panel, data, fitting
from upd.results.answer_table import AnswerTable

if TYPE_CHECKING:
    from jinja2 import Environment

#: a page stays below this
LIMIT_BYTES = 6_000_000
#: markup, tables and rounding of the estimate of what is packed
_MARGIN_BYTES = 150_000
_MU = re.compile(r"\bmu(?=N?\b)")
_INDEX = re.compile(r"\b([KFTkh])_([A-Za-z]{1,2})\b")
_PARTS = Path(__file__).parent / "parts"
#: what a script element would change or end at, moved by 256: its last seven bits stay
_SAFE = {code: code + 256 for code in (0, ord("\r"), 27, ord("<"))}


class Verdict(NamedTuple):
    """How it ended: passed, warning or failed, the word for it, and a sentence."""

    kind: str
    word: str
    text: str


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
        return not (has_rows or self.notes or self.panels or self.texts or self.file)


def write_page(path: Path, html: str) -> Path:
    """Write a page, whole or not at all; returns its path.

    Raises InputError when the place cannot be written.
    """
    try:
        write_text(path, html)
    except OSError as problem:
        raise InputError(
            f"{path}: cannot be written ({problem.strerror}); make room there or choose "
            "another place"
        ) from None
    return path


def page_text(
    title: str,
    sections: Sequence[Section],
    *,
    verdict: Verdict | None = None,
    lead: str = "",
    footer: str = "",
    surfaces: Sequence[Surface] = (),
) -> str:
    """The page as HTML: figures first, and as much of the surfaces as the limit leaves room for.
    Sections without content are omitted.
    """
    found = [
        section._replace(tables=[table for table in section.tables if table.rows])
        for section in sections
        if not section.is_empty
    ]
    panels = [panel for section in found for panel in section.panels]
    script, charts = _packed_plotly(), data(panels)
    used = (
        len(script.encode())
        + len(_packed(_json({"panels": charts})).encode())
        + sum(len(p.image) for p in panels)
        + _MARGIN_BYTES
    )
    shown, left_out = fitting(surfaces, LIMIT_BYTES - used)
    return (
        _environment()
        .get_template("page.html.j2")
        .render(
            title=title,
            verdict=verdict,
            lead=lead,
            sections=found,
            footer=footer,
            most_notes=MOST_NOTES,
            surfaces=shown,
            surfaces_left_out=left_out,
            surface_image=_picture(shown[0]) if shown else "",
            style=(_PARTS / "page.css").read_text("utf-8"),
            plotly=script,
            script=(_PARTS / "page.js").read_text("utf-8"),
            page_data=_packed(_json({"panels": charts, "surfaces": [packed(s) for s in shown]})),
        )
    )


def _picture(surface: Surface) -> str:
    # matplotlib is slow to import
    from upd.plot.pictures import picture

    return image_uri(picture(surface))


@cache
def _environment() -> Environment:
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
    for place in (spec.submodule_search_locations or ()) if spec else ():
        path = Path(place) / "package_data" / "plotly.min.js"
        if path.exists():
            return _packed(path.read_text("utf-8"))
    raise InputError(
        "plotly.min.js is missing: the report needs the package plotly; pip install plotly"
    )


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
