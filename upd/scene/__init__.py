"""Scenes: what is simulated, read from TOML with every problem reported at once and by its path in
the file.
"""

from upd.scene.bladed_disk import BladedDiskScene as BladedDiskScene
from upd.scene.contact import FRICTION_WANTS as FRICTION_WANTS
from upd.scene.contact import Scene as Scene
from upd.scene.contact import friction_on as friction_on
from upd.scene.forced import ForcedScene as ForcedScene
from upd.scene.modal import ModalScene as ModalScene
from upd.scene.read import AnyScene as AnyScene
from upd.scene.read import as_scene as as_scene
from upd.scene.read import geometry_parameters as geometry_parameters
from upd.scene.read import load_scene as load_scene
from upd.scene.read import ready_scenes as ready_scenes
from upd.scene.seated import SeatedScene as SeatedScene

#: the name that scripts know
RigScene = ModalScene
