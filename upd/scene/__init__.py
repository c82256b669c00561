"""Scenes: what is simulated, read from TOML with every fault reported at once and by its path in the file."""

from __future__ import annotations

from upd.scene.forced import FORCED_WANTS, ForcedScene
from upd.scene.model import FRICTION_WANTS, STATIC_WANTS, WANTS, Scene, friction_on
from upd.scene.read import AnyScene, geometry_parameters, load_scene, ready_scenes
from upd.scene.rig import RIG_WANTS, RigScene

__all__ = [
    "FORCED_WANTS",
    "FRICTION_WANTS",
    "RIG_WANTS",
    "STATIC_WANTS",
    "WANTS",
    "AnyScene",
    "ForcedScene",
    "RigScene",
    "Scene",
    "friction_on",
    "geometry_parameters",
    "load_scene",
    "ready_scenes",
]
