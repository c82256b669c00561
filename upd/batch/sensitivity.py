"""How natural frequencies depend on dimensions.

d ln f / d ln p from the modes of the rig as given and the matrices of slightly changed ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from upd.analyses.modal.sensitivity import free_and_glued, log_derivatives
from upd.batch.ladder import (
    Levels,
    SolvedPoint,
    Study,
    StudyMaker,
    StudyPoint,
    StudyReport,
    TextTable,
    markdown_table,
    no_levels,
)
from upd.cache.files import write_text
from upd.errors import InputError, UpdError
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
#: dimension, frequency -> d ln f / d ln p
Table = list[tuple[str, dict[str, float]]]


def _has_dimensions(scene: ModalScene) -> None:
    missing = [
        name for names in DIMENSIONS.values() for name in names if name not in scene.geometry
    ]
    if missing:
        raise InputError(f"--vary dimensions: the recipe has no parameter {', '.join(missing)}")


@dataclass(frozen=True)
class SensitivityStudy:
    """Frequencies over the dimensions of the rig.

    It has no points: one set of modes is enough for all dimensions.
    """

    scene: ModalScene
    points: tuple[StudyPoint, ...] = ()

    @cached_property
    def _found(self) -> tuple[dict[str, float], Table, dict[str, str]]:
        """Frequencies in Hz, derivatives, and dimension -> why it has none."""
        sets = free_and_glued(self.scene)
        frequencies = {
            f"f{k + 1}_{one.kind}": mode.frequency
            for one in sets
            for k, mode in enumerate(one.modes)
        }
        table: Table = []
        failed = {}
        for dimension, names in DIMENSIONS.items():
            try:
                found = log_derivatives(self.scene, sets, names)
            except UpdError as error:
                failed[dimension] = str(error)
                continue
            table.append((dimension, {name: value for (name, _), value in found.items()}))
        return frequencies, table, failed

    @property
    def table(self) -> Table:
        """(dimension, frequency -> d ln f / d ln p) of every dimension that has them.

        Raises UpdError when the rig as given has no modes.
        """
        return self._found[1]

    def present(self, solved: Sequence[SolvedPoint]) -> StudyReport:
        names, rows = self._cells()
        heads = ("dimension", *(name.replace("_", " ") for name in names))
        return StudyReport(
            (TextTable("d ln f / d ln p", heads, "l" + "r" * len(names), rows, 27),),
            bool(self.table),
        )

    def write(self, folder: Path, solved: Sequence[SolvedPoint]) -> list[Path]:
        names, rows = self._cells()
        lines = [
            "# d ln f / d ln p",
            "",
            *markdown_table(("dimension", *names), "l" + "r" * len(names), rows),
        ]
        write_text(folder / "study.md", "\n".join(lines) + "\n")
        return [folder / "study.md"]

    def _cells(self) -> tuple[list[str], tuple[tuple[str, ...], ...]]:
        """Names of the frequencies, and a row of text per dimension below that of the frequencies
        in Hz.
        """
        frequencies, table, failed = self._found
        names = list(frequencies)
        rows = [("as given, Hz", *(f"{f:.2f}" for f in frequencies.values()))]
        rows += [(d, *(f"{values[n]:+.3f}" for n in names)) for d, values in table]
        rows += [(d, why, *[""] * (len(names) - 1)) for d, why in failed.items()]
        return names, tuple(rows)


def sensitivity_study(scene: ModalScene, vary: str, levels: Levels = None) -> Study:
    """d ln f / d ln p. Raises InputError for levels, and when the recipe has other dimensions."""
    no_levels(levels, "the dimensions are those of the rig, each by itself")
    _has_dimensions(scene)
    return SensitivityStudy(scene)


SENSITIVITIES: Mapping[str, StudyMaker] = {"dimensions": sensitivity_study}
