"""The analyses a scene can call for: packages that answer as `upd.analyses.base.Analysis` says. The scene names the one it needs."""

from __future__ import annotations

from importlib import import_module
from typing import Any, cast

from upd.analyses.base import Analysis, Plan
from upd.scene import AnyScene

#: what a scene or its recipe names as its analysis -> package
_PACKAGES = {"curved contact": "hertz", "flat contact": "flat", "rig": "modal", "forced response": "forced"}
#: packages by the names that older run folders have
_FORMER_NAMES = {"curved": "hertz", "rig": "modal"}


def analysis_of(scene: AnyScene) -> Analysis:
    """The analysis that the scene names, or its recipe declares."""
    return _package(_PACKAGES[scene.analysis])


def analysis_named(name: str) -> Analysis | None:
    """The analysis of a run folder, by what the folder or its scene calls it; None for another name."""
    package = _PACKAGES.get(name, _FORMER_NAMES.get(name, name))
    return _package(package) if package in _PACKAGES.values() else None


def name_of(analysis: Analysis) -> str:
    """The name a run folder gives the analysis."""
    return analysis.__name__.rpartition(".")[2]


def _package(name: str) -> Analysis:
    return cast(Analysis, import_module(f"upd.analyses.{name}"))


def make_plan(scene: AnyScene) -> Plan[Any]:
    """Derive the plan of ``scene``: what will be simulated, what is left out and why, size and cost. Raises InputError."""
    return analysis_of(scene).make_plan(scene)
