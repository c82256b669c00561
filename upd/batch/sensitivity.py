"""How natural frequencies depend on dimensions.

d ln f / d ln p from the modes of the rig as given and the matrices of slightly changed ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from upd.analyses.modal.sensitivity import free_and_glued, log_derivatives
from upd.batch.ladder import Ladder, Levels, StudyReport, no_levels
from upd.batch.study_point import SolvedPoint, StudyPoint
from upd.batch.text_table import TextTable
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


def frequency_derivatives(
    scene: ModalScene,
) -> tuple[dict[str, float], dict[str, dict[str, float] | str]]:
    """Natural frequencies in Hz, and d ln f / d ln p of each of them for every dimension.

    A dimension without derivatives has the reason in their place. Raises UpdError when the rig as
    given has no modes.
    """
    sets = free_and_glued(scene)
    frequencies = {
        f"f{k + 1}_{one.kind}": mode.frequency for one in sets for k, mode in enumerate(one.modes)
    }
    table: dict[str, dict[str, float] | str] = {}
    for dimension, names in DIMENSIONS.items():
        try:
            found = log_derivatives(scene, sets, names)
        except UpdError as error:
            table[dimension] = str(error)
        else:
            table[dimension] = {name: value for (name, _), value in found.items()}
    return frequencies, table


def _no_points(scene: ModalScene, levels: Levels) -> tuple[StudyPoint, ...]:
    """One set of modes is enough for all dimensions.

    Raises InputError for levels, and when the recipe has other dimensions.
    """
    no_levels(levels, "the dimensions are those of the rig, each by itself")
    missing = [
        name for names in DIMENSIONS.values() for name in names if name not in scene.geometry
    ]
    if missing:
        raise InputError(f"--vary dimensions: the recipe has no parameter {', '.join(missing)}")
    return ()


def _report(scene: ModalScene, solved: Sequence[SolvedPoint]) -> StudyReport:
    """A row for the frequencies in Hz, then one for each dimension."""
    frequencies, derivatives = frequency_derivatives(scene)
    rows = [("as given, Hz", *(f"{f:.2f}" for f in frequencies.values()))]
    for dimension, found in derivatives.items():
        cells = (
            [found, *[""] * (len(frequencies) - 1)]
            if isinstance(found, str)
            else [f"{found[name]:+.3f}" for name in frequencies]
        )
        rows.append((dimension, *cells))
    align = "l" + "r" * len(frequencies)
    page = TextTable("d ln f / d ln p", ("dimension", *frequencies), align, tuple(rows), 27)
    short = replace(page, columns=tuple(name.replace("_", " ") for name in page.columns))
    any_found = any(not isinstance(found, str) for found in derivatives.values())
    return StudyReport((short,), any_found, page=(page,))


SENSITIVITIES: Mapping[str, Ladder] = {
    "dimensions": Ladder(_no_points, subject=lambda scene, vary: "d ln f / d ln p", report=_report)
}
