"""Models of a forced response as a fit moves its inputs: what an input leaves alone is kept.

What changes contact springs, friction, damping or loads re-uses the reduced blades.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import fields, replace
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from upd.analyses import make_plan
from upd.analyses.forced.model import Model, make_model
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.statics import face_laws
from upd.analyses.seated.bodies import Bodies, bodies_key, make_bodies
from upd.cache.arrays import cache_folder
from upd.cache.files import write_text
from upd.cache.sources import key_of
from upd.fitting.parameters import VariedInput, fitted_scene
from upd.linalg.parallel import threads_for
from upd.mesh import recipes
from upd.progress import Stages
from upd.scene import ForcedScene, load_scene
from upd.scene.forced_contact import SIDES, FaceStiffness, Side
from upd.scene.ranges import one_model, stiffness_of
from upd.scene.toml import toml_key, toml_value

Array = NDArray[np.float64]
T = TypeVar("T")
#: of differences of ln(factor)
STEP = 2e-3
#: the same where a contact analysis is solved again: its set of nodes moves from node to node
CONTACT_STEP = 0.02
#: sets of bodies that are kept
_KEPT = 3
#: inputs that leave the reduced blades as they are
_CHEAP = ("stiffness.", "contact.friction", "excitation.", "damper.centrifugal")
_FRICTIONLESS = "frictionless"


class ModelSource:
    """Models of a scene with its inputs moved.

    Parameters
    ----------
    scene
        Of contact points on springs.
    parameters
        Of the fit.
    ratios
        F_C/F_E of what is followed with friction; without any the static state is omitted (a
        stuck point is as stiff under any preload).
    like
        Of the same scene: its blades are taken.

    Raises
    ------
    InputError
        For a scene of whole faces, one that chooses its levels by an accuracy, parameters of
        several contact stiffnesses, and harmonics that are no number.
    """

    def __init__(
        self,
        scene: ForcedScene,
        parameters: Sequence[VariedInput],
        ratios: Sequence[float] = (),
        like: ModelSource | None = None,
    ) -> None:
        self.scene, self.parameters, self.ratios = scene, tuple(parameters), tuple(ratios)
        paths = [path for one in parameters for path in one.paths]
        self.stiffness = stiffness_of(scene, paths)
        one_model(scene, self.stiffness, "a fit")
        #: models made
        self.made = 0
        self._stages = Stages()
        self._plans: dict[str, ForcedPlan] = {}
        self._bodies: dict[str, Bodies] = {} if like is None else like._bodies
        self._models: dict[str, Model] = {}
        self._tangents: int | None = None
        seated = bool(ratios) and is_seated(scene)
        #: inputs that make new blades, or a new static state, with every evaluation
        self.dear = [
            p for p in paths if not p.startswith(_CHEAP) or (seated and p == "contact.friction")
        ]
        contact = scene.stiffness[self.stiffness].scene
        self._contact = contact if any(p.startswith("geometry.") for p in paths) else None
        #: of the differences of every parameter
        self.steps = [
            CONTACT_STEP
            if self._contact and any(p.startswith("geometry.") for p in one.paths)
            else STEP
            for one in self.parameters
        ]

    @property
    def cheap(self) -> bool:
        """Whether every evaluation re-uses the same reduced blades."""
        return not self.dear

    @property
    def cost(self) -> str:
        """Which inputs make an evaluation slow; "" where none does."""
        why = "every value makes new blades or a new static state"
        return f"{', '.join(self.dear)}: {why}" if self.dear else ""

    def at(self, z: Array) -> tuple[ForcedPlan, Model]:
        """The model with moved inputs, and its plan.

        Parameters
        ----------
        z
            (n,) logarithms of the parameters' factors.

        Raises
        ------
        InputError
            Where the scene refuses the parameters.
        """
        return self._model(self.bare(fitted_scene(self.scene, self.parameters, z)))

    def totals(self, z: Array) -> dict[Side, FaceStiffness]:
        """Contact stiffness of both faces."""
        scene = self.bare(fitted_scene(self.scene, self.parameters, z))
        return face_laws(scene.stiffnesses[self.stiffness], self._stages)

    def directions(self, z: Array) -> str:
        """What contact.directions has to say in the scene with these parameters to give these
        numbers; "" where its own word does.
        """
        scene = fitted_scene(self.scene, self.parameters, z)
        if scene.contact.directions != "auto":
            return ""
        used = self.at(z)[1].contacts.tangents
        kept, self._tangents = self._tangents, None
        self._models.clear()
        chosen = self.at(z)[1].contacts.tangents
        self._tangents = kept
        self._models.clear()
        return "" if used == chosen else _DIRECTIONS[used]

    def bare(self, scene: ForcedScene) -> ForcedScene:
        """What is needed alone: one stiffness, the F_C/F_E that are followed, nothing estimated or
        solved again; a contact scene with the rig's geometry.
        """
        one = one_model(scene, self.stiffness, "a fit")
        contact, excitation, stiffness = one.contact, one.excitation, dict(one.stiffness)
        if self._tangents is not None:
            contact = replace(contact, directions=_DIRECTIONS[self._tangents])
        if self.ratios:
            excitation = replace(excitation, centrifugal_to_force=self.ratios, force=())
        else:
            contact = replace(contact, fit="unloaded")
        if self._contact:
            stiffness[self.stiffness] = replace(
                stiffness[self.stiffness], scene=contact_scene(scene, self._contact)
            )
        return replace(one, contact=contact, excitation=excitation, stiffness=stiffness)

    def _model(self, scene: ForcedScene) -> tuple[ForcedPlan, Model]:
        self.made += 1
        plan = replace(self._plan(scene), scene=scene)
        bodies = _remembered(self._bodies, bodies_key(plan), lambda: make_bodies(plan))
        laws = face_laws(scene.stiffnesses[self.stiffness], self._stages)
        frame = self._frame(scene)
        if frame in self._models:
            return plan, _with_contact(self._models[frame], laws, scene.contact.friction)
        # small matrices once the blades are reduced
        with threads_for(1) if bodies.reduced else nullcontext():
            model = make_model(plan, bodies, laws)
        model = _remembered(self._models, frame, lambda: model)
        if self._tangents is None and scene.contact.directions == "auto":
            # once chosen they stay: numbers would jump
            self._tangents = model.contacts.tangents if model.halved else None
        return plan, model

    def _frame(self, scene: ForcedScene) -> str:
        contact = replace(scene.contact, directions="auto")
        if not self.ratios or contact.static == _FRICTIONLESS:
            # what the points carry at rest does not depend on it
            contact = replace(contact, friction=self.scene.contact.friction)
        return repr(replace(scene, stiffness={}, text="", contact=contact))

    def _plan(self, scene: ForcedScene) -> ForcedPlan:
        return _remembered(self._plans, self._frame(scene), lambda: make_plan(scene))


def is_seated(scene: ForcedScene) -> bool:
    """Whether friction changes the state at rest."""
    return scene.contact.loaded and scene.contact.static == "seated"


_DIRECTIONS: dict[int, Literal["one", "two"]] = {1: "one", 2: "two"}


def contact_scene(scene: ForcedScene, name: str) -> str:
    """A contact scene with the rig's geometry, as far as both recipes have it: the file it is
    written to, one for each.

    Parameters
    ----------
    scene
        The rig, moved.
    name
        Of the contact scene.

    Raises
    ------
    InputError
        Where the contact refuses it.
    """
    given = load_scene(name)
    shared = {f.name for f in fields(recipes.parameters(given.recipe))}
    data = tomllib.loads(given.text)
    own = tomllib.loads(scene.text)["geometry"]
    more = {k: v for k, v in own.items() if k in shared and k in _OF_CONTACT}
    data["geometry"] = {**data["geometry"], **more}
    text = "".join(f"{toml_key(key)} = {toml_value(value)}\n" for key, value in data.items())
    path = cache_folder() / f"contact-{key_of(data)[:32]}.toml"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, text)
    return str(path)


#: parameters of a contact that a rig's recipe has under the same name
_OF_CONTACT = ("patch_length", "patch_width", "patch_offset")


def _with_contact(model: Model, laws: Mapping[Side, FaceStiffness], friction: float) -> Model:
    """The model with other totals of its faces and another friction: those of its points grow
    alike, and the directions in which friction resists stay.
    """
    old = model.contacts.law

    def grown(values: Array, of: Literal["K_N", "K_T"]) -> Array:
        by = [getattr(laws[side], of) / getattr(model.laws[side], of) for side in SIDES]
        return np.asarray(values * np.array(by)[model.face])

    law = replace(
        old,
        k_n=grown(old.k_n, "K_N"),
        k_t=grown(old.k_t, "K_T"),
        mu=np.full_like(old.mu, friction),
    )
    return replace(model, laws=laws, contacts=replace(model.contacts, law=law))


def _remembered(kept: dict[str, T], key: str, make: Callable[[], T]) -> T:
    """What was made for a key; of all keys the last few."""
    if key not in kept:
        while len(kept) >= _KEPT:
            del kept[next(iter(kept))]
        kept[key] = make()
    return kept[key]
