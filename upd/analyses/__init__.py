"""The analyses a scene can call for: modules with an ``ANALYSIS``, or two,
see `upd.analyses.base`.

The scene names the one it needs.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upd.analyses.base import Analysis, Plan
from upd.scene import AnyScene, as_scene
from upd.vary.inputs import with_input_cost

if TYPE_CHECKING:
    from upd.vary.ladder import Ladder

#: what a scene or its recipe names as its analysis -> name that run folders have of it
_NAMES = {
    "curved contact": "hertz",
    "flat contact": "flat",
    "rig": "modal",
    "bladed disk": "bladed_disk",
    "forced response": "forced",
    "seated damper": "seated",
}
#: modules that are not the package of that name
_MODULES = {"hertz": "contact.analysis", "flat": "contact.analysis"}


def analysis_of(scene: AnyScene) -> Analysis:
    """The analysis that the scene names, or its recipe declares."""
    found = analysis_named(_NAMES[scene.analysis])
    assert found is not None
    return found


def analysis_named(name: str) -> Analysis | None:
    """The analysis of a run folder, by the name that the folder has of it; None for another."""
    if name not in _NAMES.values():
        return None
    module = import_module(f"upd.analyses.{_MODULES.get(name, name)}")
    found: Analysis = module.ANALYSIS if hasattr(module, "ANALYSIS") else module.ANALYSES[name]
    return found


def ladders_of(scene: AnyScene) -> Mapping[str, Ladder]:
    """What a convergence study of the scene can vary, by name."""
    offered = analysis_of(scene).ladders
    return {vary: ladder for vary, ladder in offered.items() if ladder.applies(scene)}


def make_plan(scene: AnyScene | str | Path | Mapping[str, Any]) -> Plan[Any]:
    """Derive the plan of ``scene``: loaded, a ready name, a .toml path or a mapping.

    What will be simulated, what not and why, size and cost. Raises InputError.
    """
    loaded = as_scene(scene)
    analysis = analysis_of(loaded)
    plan: Plan[Any] = with_input_cost(analysis, analysis.make_plan(loaded))
    return plan
