"""Cheap companions of scenes of the rig, to solve inputs' changes on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from upd.analyses.base import Plan
from upd.scene.quantities import UNKNOWN

#: part of the run's refinement, and the smallest that the ready rig takes
COARSER, LEAST = 0.7, 0.5


def coarsened_rig(
    plan: Plan[Any], wanted: tuple[str, ...], tables: Mapping[str, Mapping[str, Any]] | None = None
) -> Callable[[Any], Any]:
    """What makes scenes of a rig cheap: a coarser mesh, few outputs, nothing solved twice.

    Parameters
    ----------
    plan
        As run.
    wanted
        Outputs that are kept where the run has them; all when none of them is.
    tables
        Tables of the scene -> their keys that change.
    """
    refine = plan.parameters.get("refine")

    def made(scene: Any) -> Any:
        geometry = dict(scene.geometry)
        if isinstance(refine, float) and COARSER * refine >= LEAST:
            geometry["refine"] = COARSER * refine
        return replace(
            scene,
            geometry=geometry,
            want=tuple(w for w in scene.want if w in wanted) or scene.want,
            left_out=replace(scene.left_out, solve="no"),
            accuracy=UNKNOWN,
            uncertain={},
            **{
                name: replace(getattr(scene, name), **values)
                for name, values in (tables or {}).items()
            },
        )

    return made
