"""Scenes: what is simulated, read from TOML with every problem reported at once and by its path in
the file.
"""

from __future__ import annotations

from upd.scene.bladed_disk import BLADED_DISK_WANTS, BladedDiskScene
from upd.scene.contact import FRICTION_WANTS, WANTS, Scene, friction_on
from upd.scene.forced import FORCED_WANTS, ForcedScene
from upd.scene.modal import MODAL_WANTS, ModalScene
from upd.scene.read import AnyScene, as_scene, geometry_parameters, load_scene, ready_scenes
from upd.scene.seated import SEATED_WANTS, SeatedScene

#: names that scripts know
RIG_WANTS = MODAL_WANTS
RigScene = ModalScene

__all__ = [
    "BLADED_DISK_WANTS",
    "FORCED_WANTS",
    "FRICTION_WANTS",
    "MODAL_WANTS",
    "RIG_WANTS",
    "SEATED_WANTS",
    "WANTS",
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
