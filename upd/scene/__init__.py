"""Scenes: what is simulated, read from TOML with every problem reported at once and by its path in
the file.
"""

from __future__ import annotations

from upd.scene.bladed_disk import BladedDiskScene
from upd.scene.contact import FRICTION_WANTS, Scene, friction_on
from upd.scene.forced import ForcedScene
from upd.scene.modal import ModalScene
from upd.scene.read import AnyScene, as_scene, geometry_parameters, load_scene, ready_scenes
from upd.scene.seated import SeatedScene

#: the name that scripts know
RigScene = ModalScene

__all__ = [
    "FRICTION_WANTS",
    "AnyScene",
    "BladedDiskScene",
    "ForcedScene",
    "ModalScene",
    "RigScene",
    "Scene",
    "SeatedScene",
    "as_scene",
    "friction_on",
    "geometry_parameters",
    "load_scene",
    "ready_scenes",
]
