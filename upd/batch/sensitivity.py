"""How the rig's frequencies depend on its dimensions: d ln f / d ln p by central differences, one pair of runs per dimension."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from upd.batch.ladder import Outcome, Point
from upd.batch.modal_ladder import MODES_ONLY
from upd.cache.files import write_text
from upd.errors import InputError
from upd.scene import RigScene

#: dimension -> parameters that move together
DIMENSIONS = {
    **{name: (name,) for name in ("shank_length", "shank_tx", "core_length", "core_tx", "core_wy", "platform_height")},
    "width of shank and platform": ("shank_wy", "platform_wy"),
}
#: relative step to both sides: far above the rounding of a frequency, far below its curvature
STEP = 0.01

Table = list[tuple[str, dict[str, float]]]


def sensitivity_points(scene: RigScene) -> list[Point]:
    """Two points per dimension, ``STEP`` below and above. Raises InputError when the recipe has other dimensions."""
    missing = [name for names in DIMENSIONS.values() for name in names if name not in scene.geometry]
    if missing:
        raise InputError(f"--vary dimensions: the recipe has no parameter {', '.join(missing)}")
    return [
        Point(dimension, f"{sign:+.0%}", (*MODES_ONLY, *_settings(scene, names, 1.0 + sign)), 1.0)
        for dimension, names in DIMENSIONS.items()
        for sign in (-STEP, STEP)
    ]


def _settings(scene: RigScene, names: tuple[str, ...], factor: float) -> tuple[tuple[str, Any], ...]:
    return tuple((f"geometry.{name}", f"{factor * float(scene.geometry[name])!r} mm") for name in names)


def sensitivity_table(outcomes: Iterable[Outcome]) -> Table:
    """(dimension, frequency -> d ln f / d ln p) of every dimension whose two runs succeeded."""
    pairs: dict[str, list[Outcome]] = {}
    for o in outcomes:
        if not o.failure:
            pairs.setdefault(o.curve, []).append(o)
    width = float(np.log((1.0 + STEP) / (1.0 - STEP)))
    return [
        (dimension, {k.split("|")[0]: float(np.log(up.values[k] / low.values[k])) / width for k in low.values if k in up.values})
        for dimension, (low, up) in ((d, pair) for d, pair in pairs.items() if len(pair) == 2)
    ]


def write_sensitivities(folder: Path, table: Table) -> Path:
    """Write the table as study.md into ``folder``; returns its path."""
    names = list(dict.fromkeys(name for _, values in table for name in values))
    lines = ["# d ln f / d ln p", "", f"| dimension | {' | '.join(names)} |", f"|---|{'---:|' * len(names)}"]
    lines += [f"| {dimension} | {' | '.join(f'{values[n]:+.2f}' for n in names)} |" for dimension, values in table]
    write_text(folder / "study.md", "\n".join(lines) + "\n")
    return folder / "study.md"
