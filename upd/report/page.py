"""One run folder -> report.html.

Numbers, figures, checks, cost and the scene file on one page that needs nothing beside it.
"""

from __future__ import annotations

import base64
import gzip
import json
import re
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup, escape

from upd.cache.files import write_text
from upd.errors import InputError
from upd.labels import check_number, effect_word, number, percent, plus_minus, unit_label
from upd.plot.chart import Entry
from upd.plot.png import png_uri
from upd.report import generic
from upd.report.answer import answer_tables
from upd.report.error_budget import budget_rows
from upd.report.folder import RunFolder, read_run
from upd.report.notes import MOST_NOTES, short_notes
from upd.report.panels import Panel, charts_of, data, run_panels
from upd.report.scene_sentences import sentences
from upd.report.surfaces import Surface, fitting, packed, picture, run_surfaces
from upd.report.told import warnings
from upd.results import FAILED, outcome_of, worst_checks
from upd.results.quantities import number_label

if TYPE_CHECKING:
    from jinja2 import Environment

#: figures beside the tables of an answer; the others are folded
_OPENED = 2
#: a page stays below this
LIMIT_BYTES = 6_000_000
#: markup, tables and rounding of the estimate of what is packed
_MARGIN_BYTES = 150_000
_MU = re.compile(r"\bmu(?=N?\b)")
_INDEX = re.compile(r"\b([KFTkh])_([A-Za-z]{1,2})\b")
_PARTS = Path(__file__).parent / "parts"


def write_report(folder: str | Path) -> Path:
    """Write report.html into a run folder, from what lies in it. Returns its path.

    Raises InputError when ``folder`` is no run folder or cannot be written.
    """
    run = read_run(Path(folder))
    path = run.path / "report.html"
    save(path, render("run.html.j2", run_panels(run), run_surfaces(run), run_context(run)))
    return path


def save(path: Path, html: str) -> None:
    """Write a page whole or not at all. Raises InputError when the place cannot be written."""
    try:
        write_text(path, html)
    except OSError as problem:
        raise InputError(
            f"{path}: cannot be written ({problem.strerror}); make room there or choose "
            "another place"
        ) from None


def render(
    template: str, panels: list[Panel], surfaces: list[Surface], context: Mapping[str, Any]
) -> str:
    """The page as text: figures first, and as much of the surfaces as the limit leaves room for."""
    script = _packed_plotly()
    charts = data(panels)
    used = (
        len(script)
        + len(_packed(_json({"panels": charts})))
        + sum(len(p.image) for p in panels)
        + _MARGIN_BYTES
    )
    shown, left_out = fitting(surfaces, LIMIT_BYTES - used)
    return (
        _environment()
        .get_template(template)
        .render(
            **context,
            panels=panels,
            surfaces=shown,
            surfaces_left_out=left_out,
            surface_image=png_uri(picture(shown[0])) if shown else "",
            style=(_PARTS / "page.css").read_text("utf-8"),
            plotly=script,
            script=(_PARTS / "page.js").read_text("utf-8"),
            page_data=_packed(_json({"panels": charts, "surfaces": [packed(s) for s in shown]})),
        )
    )


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
    made.filters |= {
        "number": number,
        "percent": percent,
        "plus_minus": plus_minus,
        "label": number_label,
        "unit": unit_label,
        "check_number": check_number,
        "effect_word": effect_word,
        "symbols": symbols,
    }
    return made


def plotly_script() -> str:
    """plotly.min.js of the installed package.

    The package itself is slow to import and not needed.
    """
    spec = find_spec("plotly")
    places = list(spec.submodule_search_locations or ()) if spec else []
    for place in places:
        path = Path(place) / "package_data" / "plotly.min.js"
        if path.exists():
            return path.read_text("utf-8")
    raise InputError(
        "plotly.min.js is missing: the report needs the package plotly; pip install plotly"
    )


@cache
def _packed_plotly() -> str:
    """The script as it stands on every page: 2 MB of base64 instead of 5 MB."""
    return _packed(plotly_script())


def _packed(text: str) -> str:
    """Text as the page's script unpacks it: gzip in base64, the same bytes each time."""
    return base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode("ascii")


def symbols(text: str) -> Markup:
    """Text with the signs of the field.

    Μ for mu, and what follows the underscore of a symbol as its index.
    """
    spelled = _MU.sub("µ", text)
    return Markup(_INDEX.sub(r"\1<sub>\2</sub>", str(escape(spelled))))


def _json(content: Any) -> str:
    return json.dumps(content, separators=(",", ":"), allow_nan=False)


def run_context(run: RunFolder) -> dict[str, Any]:
    """What the template of one run shows beside its figures."""
    rows: list[Entry] = list(run.summary["results"])
    main = charts_of(run).headline(rows) or generic.headline(rows)
    return {
        "run": run,
        "title": run.summary["title"] or run.summary["scene"],
        "verdict": verdict(run),
        "sentences": sentences(run.summary),
        "answer": answer_tables(run.summary["size"], rows),
        "opened": _OPENED,
        "notes": [*short_notes(run.summary["checks"], rows), *run.missing],
        "most_notes": MOST_NOTES,
        "headline": main,
        "budget": budget_rows(main),
        "cases": _by_case(rows),
        "filled": filled,
        "effects": run.summary["effects"],
        "checks": worst_checks(run.summary["checks"]),
        "warnings": warnings(run),
        "stages": stages(run.summary["cost"]),
        "cost": run.summary["cost"],
    }


def filled(rows: Iterable[Entry]) -> dict[str, bool]:
    """Which columns of a table of numbers have something in them."""
    told = list(rows)
    return {
        "case": any(row.get("case") for row in told),
        "estimate": any(row.get("estimated_error") is not None for row in told),
        "reference": any(row.get("reference") is not None for row in told),
        "source": any(row.get("source") for row in told),
    }


def verdict(run: RunFolder) -> dict[str, str]:
    """Class of the mark, its word, and a sentence."""
    status, checks = str(run.summary["status"]), run.summary["checks"]
    told = sum(1 for c in checks if c["verdict"] == "warning")
    if outcome_of(status) == FAILED:
        return {"kind": "failed", "word": "Failed", "says": status.removeprefix("failed: ")}
    passed = sum(1 for c in checks if c["verdict"] == "passed")
    missing = sum(1 for r in run.summary["results"] if r.get("withheld"))
    # A folder from before that is "ok" may have checks that warn.
    if told or missing:
        says = f"{passed} of {len(checks)} self-checks passed"
        if told:
            says += f", {told} {'warns' if told == 1 else 'warn'}"
        if missing:
            says += f"; {missing} {'number was' if missing == 1 else 'numbers were'} not reached"
        return {"kind": "warning", "word": "Done, with warnings", "says": f"{says}."}
    return {"kind": "passed", "word": "Passed", "says": f"All {passed} self-checks passed."}


def _by_case(rows: Iterable[Entry]) -> dict[str, list[Entry]]:
    out: dict[str, list[Entry]] = {}
    for row in rows:
        out.setdefault(str(row["case"]), []).append(row)
    return out


def stages(cost: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Stage, seconds and share of the longest stage in per cent."""
    seconds: Mapping[str, float] = cost.get("stages", {})
    longest = max(seconds.values(), default=0.0) or 1.0
    return [
        {"name": name, "seconds": s, "share": round(100.0 * s / longest, 1)}
        for name, s in seconds.items()
    ]
