"""Settings of Sphinx for the manual; `build.py` runs it on a copy of this folder."""

from __future__ import annotations

from typing import Any

import upd

project = "upd"
author = "the upd developers"
release = version = upd.__version__
html_title = f"upd {release}"

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["gallery/*", "_examples/*", "reference/command_table.md"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3
html_theme = "furo"
html_show_sourcelink = False
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
    "min_reported_time": 3600,
}


def _bars(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Absolute values in docstrings are no substitutions."""
    lines[:] = [one if ">>>" in one else one.replace("|", r"\|") for one in lines]


def setup(app: Any) -> None:
    """After numpydoc has made its lines."""
    app.connect("autodoc-process-docstring", _bars, priority=900)
