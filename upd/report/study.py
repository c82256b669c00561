"""Figures of a study folder: error against seconds and against memory."""

from __future__ import annotations

import json
from pathlib import Path

from upd.errors import InputError
from upd.plot.work_precision import work_precision_charts
from upd.report.panels import Panel, make_panels


def study_panels(folder: Path) -> list[Panel]:
    """The work-precision figure of a study.

    Raises InputError when ``folder`` is no study folder.
    """
    try:
        charts = work_precision_charts(
            json.loads((folder / "study.json").read_text("utf-8"))["curves"]
        )
    except FileNotFoundError:
        raise InputError(
            f"{folder}: is no study folder (it has no study.json); give the folder `upd "
            "study` wrote"
        ) from None
    except (OSError, ValueError, KeyError, TypeError) as problem:
        raise InputError(
            f"{folder / 'study.json'}: cannot be read ({problem}); run the study again"
        ) from None
    figure = folder / "work_precision.png"
    return make_panels(charts, {"work_precision": figure} if figure.exists() else {})
