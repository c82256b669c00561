"""Ladders of a seated damper: mesh of the contact patches, element, load steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

from upd.analyses.seated.varied import PATCH
from upd.batch.convergence import ConvergenceStudy
from upd.batch.curves import make_curves
from upd.batch.ladder import (
    Levels,
    Settings,
    Study,
    StudyMaker,
    StudyPoint,
    followed,
    whole_levels,
)
from upd.scene import SeatedScene

#: numbers a ladder follows beside those the analysis names first
_MORE = ("closed_share", "max_pressure", "damper_u?", "seating_loss")
#: elements up a patch, and load steps from nothing to F_C
_SLOPE, _STEPS = (4, 8, 12, 16), (2, 5, 10, 20, 40)
_ELEMENTS = ("hex8", "hex8i")
_QUICK: Settings = (("want", ["seating", "stiffness"]), ("left_out.solve", "no"))


def seated_study(scene: SeatedScene, vary: str, levels: Levels = None) -> Study:
    """The ladder of a variation.

    Parameters
    ----------
    vary
        "mesh": elements up the patch, those along it in proportion. "element": the same for hex8
        and hex8i. "steps": load steps from nothing to F_C.
    levels
        Elements up the patch, or load steps; None for the usual ones.

    Raises
    ------
    InputError
        For levels that are none.
    """
    return ConvergenceStudy(
        f"{scene.title or scene.name}: what accuracy costs, {vary}",
        tuple(seated_points(scene, vary, levels)),
        partial(make_curves, names=followed(scene, *_MORE)),
    )


def seated_points(scene: SeatedScene, vary: str, levels: Levels = None) -> list[StudyPoint]:
    """Points of `seated_study`."""
    chosen = whole_levels(levels, 2)
    if vary == "steps":
        return [
            StudyPoint("steps", f"{n} load steps", (*_QUICK, ("seating.steps", n)), 1.0 / n)
            for n in chosen or _STEPS
        ]
    elements = (scene.mesh.element,) if vary == "mesh" else _ELEMENTS
    return list(_mesh_points(scene, elements, chosen))


def _mesh_points(
    scene: SeatedScene, elements: tuple[str, ...], levels: tuple[int, ...] | None
) -> Iterator[StudyPoint]:
    slope, others = PATCH[scene.arrangement]
    usual = int(scene.geometry[slope])
    for element in elements:
        for n in levels or _SLOPE:
            counts = {slope: n} | {key: _even(scene.geometry[key] * n / usual) for key in others}
            settings = tuple((f"geometry.{key}", value) for key, value in counts.items())
            yield StudyPoint(
                element,
                f"{n} elements up the patch",
                (*_QUICK, *settings, ("mesh.element", element)),
                1.0 / n,
            )


def _even(count: float) -> int:
    """An even number of elements, at least 4: the plane y = 0 and the core's side need lines."""
    return max(4, 2 * round(count / 2.0))


LADDERS: Mapping[str, StudyMaker] = dict.fromkeys(("mesh", "element", "steps"), seated_study)
