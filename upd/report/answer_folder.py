"""Answers of one figure and a few numbers: their folder, and what a notebook shows."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from upd.cache.files import whole_files
from upd.errors import InputError, one_line
from upd.plot.chart import Chart
from upd.plot.matplotlib import chart_png, write_sheet
from upd.plot.png import png_uri


def write_answer(
    out: str | Path,
    name: str,
    numbers: Mapping[str, Any],
    charts: Sequence[Chart],
    texts: Mapping[str, str] | None = None,
) -> Path:
    """Write NAME.json, NAME.png and other texts into a folder, all of them or none.

    Parameters
    ----------
    out
        The folder, made where there is none.
    name
        Of the figure and of the numbers.
    numbers
        As JSON takes them.
    charts
        Of the figure.
    texts
        Name of a file -> its text.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        When it cannot be written.
    """
    folder = Path(out)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with whole_files(folder) as stage:
            text = json.dumps(numbers, indent=1, allow_nan=False) + "\n"
            (stage / f"{name}.json").write_text(text, encoding="utf-8")
            for file, told in (texts or {}).items():
                (stage / file).write_text(told, encoding="utf-8")
            write_sheet(charts, stage / f"{name}.png")
    except OSError as error:
        raise InputError(
            f"{folder}: cannot be written ({one_line(error)}); choose another with --out"
        ) from None
    return folder


def answer_html(text: str, charts: Sequence[Chart]) -> str:
    """The answer as a notebook shows it: its text and its figure."""
    return f'<pre>{escape(text)}</pre><img src="{png_uri(chart_png(charts))}">'
