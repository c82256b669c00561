"""A run of an analysis that is not known here: numbers, and no charts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from upd.plot.chart import Arrays, Chart, Entry

_MOST_HEADLINES = 8


def headline(rows: list[Entry]) -> list[Entry]:
    """Numbers with a reference first, in the order of the run."""
    with_reference = [r for r in rows if r["reference"] is not None]
    return (with_reference + [r for r in rows if r["reference"] is None])[:_MOST_HEADLINES]


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """None."""
    del arrays, summary
    return []
