"""How natural frequencies depend on dimensions.

d ln f / d ln p by central differences, one pair of runs per dimension.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from upd.batch.ladder import (
    Levels,
    Settings,
    SolvedPoint,
    Study,
    StudyMaker,
    StudyPoint,
    StudyReport,
    TextTable,
    markdown_table,
    no_levels,
)
from upd.batch.modal_ladder import MODES_ONLY
from upd.cache.files import write_text
from upd.errors import InputError
from upd.scene import ModalScene

#: dimension -> parameters that move together
DIMENSIONS = {
    **{
        name: (name,)
        for name in (
            "shank_length",
            "shank_tx",
            "core_length",
            "core_tx",
            "core_wy",
            "platform_height",
        )
    },
    "width of shank and platform": ("shank_wy", "platform_wy"),
}
#: relative step to both sides: far above the rounding of a frequency, far below its curvature
STEP = 0.01

#: dimension, frequency -> d ln f / d ln p
Table = list[tuple[str, dict[str, float]]]


def sensitivity_points(scene: ModalScene) -> list[StudyPoint]:
    """Two points per dimension, ``STEP`` below and above.

    Raises InputError when the recipe has other dimensions.
    """
    missing = [
        name for names in DIMENSIONS.values() for name in names if name not in scene.geometry
    ]
    if missing:
        raise InputError(f"--vary dimensions: the recipe has no parameter {', '.join(missing)}")
    return [
        StudyPoint(dimension, f"{sign:+.0%}", (*MODES_ONLY, *_settings(scene, names, 1.0 + sign)))
        for dimension, names in DIMENSIONS.items()
        for sign in (-STEP, STEP)
    ]


def _settings(scene: ModalScene, names: tuple[str, ...], factor: float) -> Settings:
    return tuple(
        (f"geometry.{name}", f"{factor * float(scene.geometry[name])!r} mm") for name in names
    )


def sensitivity_table(solved: Iterable[SolvedPoint]) -> Table:
    """(dimension, frequency -> d ln f / d ln p) of every dimension whose two runs succeeded."""
    pairs: dict[str, list[SolvedPoint]] = {}
    for one in solved:
        if not one.outcome.failure:
            pairs.setdefault(one.point.curve, []).append(one)
    width = float(np.log((1.0 + STEP) / (1.0 - STEP)))
    return [
        (
            dimension,
            {
                key[0]: float(np.log(up.values[key] / low.values[key])) / width
                for key in low.values
                if key in up.values
            },
        )
        for dimension, (low, up) in ((d, pair) for d, pair in pairs.items() if len(pair) == 2)
    ]


@dataclass(frozen=True)
class SensitivityStudy:
    """Frequencies over the dimensions of the rig."""

    points: tuple[StudyPoint, ...]

    def present(self, solved: Sequence[SolvedPoint]) -> StudyReport:
        names, rows = _cells(sensitivity_table(solved))
        heads = ("dimension", *(name.replace("_", " ") for name in names))
        return StudyReport(
            (TextTable("d ln f / d ln p", heads, "l" + "r" * len(names), rows, 27),), bool(rows)
        )

    def write(self, folder: Path, solved: Sequence[SolvedPoint]) -> list[Path]:
        names, rows = _cells(sensitivity_table(solved))
        lines = [
            "# d ln f / d ln p",
            "",
            *markdown_table(("dimension", *names), "l" + "r" * len(names), rows),
        ]
        write_text(folder / "study.md", "\n".join(lines) + "\n")
        return [folder / "study.md"]


def _cells(table: Table) -> tuple[list[str], tuple[tuple[str, ...], ...]]:
    """Names of the frequencies, and a row of text per dimension."""
    names = list(dict.fromkeys(name for _, values in table for name in values))
    return names, tuple(
        (d, *(f"{values[n]:+.2f}" if n in values else "" for n in names)) for d, values in table
    )


def sensitivity_study(scene: ModalScene, vary: str, levels: Levels = None) -> Study:
    """d ln f / d ln p. Raises InputError for levels, and when the recipe has other dimensions."""
    no_levels(levels, "the dimensions are stepped by one percent to both sides")
    return SensitivityStudy(tuple(sensitivity_points(scene)))


SENSITIVITIES: Mapping[str, StudyMaker] = {"dimensions": sensitivity_study}
