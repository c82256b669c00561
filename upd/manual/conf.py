"""Settings of Sphinx for the manual; `build.py` runs it on a copy of this folder."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert

import upd

project = "upd"
author = "the upd developers"
release = version = upd.__version__
html_title = f"upd {release}"

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["gallery/*", "_examples/*", "reference/command_table.md"]
myst_enable_extensions = ["dollarmath", "colon_fence", "substitution"]
myst_heading_anchors = 3
html_theme = "furo"
html_math_renderer = "mathml"
html_show_sourcelink = False
html_show_copyright = False
suppress_warnings = ["config.cache"]

autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

sphinx_gallery_conf: dict[str, Any] = {
    "examples_dirs": "gallery",
    "gallery_dirs": "examples",
    "filename_pattern": r"\.py$",
    "download_all_examples": False,
    "show_memory": False,
    "abort_on_example_error": True,
    "within_subsection_order": "FileNameSortKey",
    "reset_modules": ("matplotlib",),
    "parallel": 2,
    "image_scrapers": ("matplotlib",),
    "capture_repr": (),
    "min_reported_time": 3600,
}


def _measured() -> dict[str, dict[str, dict[str, str]]]:
    """What the benchmarks kept: benchmark -> name -> case -> number with its unit; over all cases
    of a name the "worst", their "count", and how many "hold".
    """
    found: dict[str, dict[str, dict[str, str]]] = {}
    for path in (Path(upd.__file__).parents[1] / "benchmarks" / "results").glob("*.csv"):
        mine = found.setdefault(path.stem, {})
        with path.open(encoding="utf-8", newline="") as table:
            rows = [row for row in csv.DictReader(table) if row["value"]]
        for row in sorted(rows, key=lambda row: abs(float(row["value"]))):
            cases = mine.setdefault(row["name"], {"count": "0", "holds": "0"})
            value = row["value"].replace("-", "−")
            cases[row["case"]] = cases["worst"] = f"{value} {row['unit']}".strip()
            cases["count"] = str(int(cases["count"]) + 1)
            cases["holds"] = str(int(cases["holds"]) + row["note"].count(": holds"))
    return found


myst_substitutions = {"measured": _measured()}


def _bars(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Absolute values in docstrings are no substitutions."""
    lines[:] = [one if ">>>" in one else one.replace("|", r"\|") for one in lines]


def _formula(translator: Any, node: Any) -> None:
    """An equation as the browser's own MathML: it needs no script and no network."""
    translator.body.append(convert(node.astext()))
    raise nodes.SkipNode


def _equation(translator: Any, node: Any) -> None:
    """One on a line of its own, which scrolls where the page is narrow."""
    shown = convert(rf"\displaystyle {node.astext()}", display="block")
    translator.body.append(f'<div style="overflow-x: auto; padding: 0.5em 0">{shown}</div>')
    raise nodes.SkipNode


def setup(app: Any) -> None:
    """Equations, and docstrings after numpydoc has made their lines."""
    app.add_html_math_renderer("mathml", (_formula, None), (_equation, None))
    app.connect("autodoc-process-docstring", _bars, priority=900)
