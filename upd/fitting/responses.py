"""What a fit aims at as functions of what it varies, with derivatives.

What an input leaves alone of a model is kept: what changes contact springs, friction, damping or
loads re-uses the reduced blades.

Derivatives are differences forward, of the logarithm of each factor. With friction every evaluation
solves the whole curve over frequency, from its lowest end upwards, so that a fit does not depend on
the way it came. Values are those of the harmonic balance alone.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import fields, replace
from functools import cache, partial
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from upd.analyses import make_plan
from upd.analyses.forced import measures
from upd.analyses.forced.curves import Limit, Top, fine_grid, point_limit, stuck_frequency
from upd.analyses.forced.measures import CANDIDATES, numbered_peaks
from upd.analyses.forced.model import Model, make_model, quiet, respond
from upd.analyses.forced.peaks import climbed
from upd.analyses.forced.plan import ForcedPlan, grid
from upd.analyses.forced.statics import face_laws
from upd.analyses.measured import CurvePeak
from upd.analyses.seated.bodies import Bodies, bodies_key, make_bodies
from upd.cache.arrays import Journal, cache_folder
from upd.cache.files import write_text
from upd.cache.sources import key_of
from upd.errors import ConvergenceError
from upd.fitting.targets import (
    CONTACT_TOTALS,
    PEAK_NUMBERS,
    STUCK_MODES,
    CurveTarget,
    Targets,
    VariedInput,
    fitted_scene,
)
from upd.hbm import FrequencyResponse
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.sweep import first_point, newton
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


# -- models as a fit moves its inputs --------------------------------------------------------------


ComplexArray = NDArray[np.complex128]
#: which peak: the blade and the number of its mode
PeakKey = tuple[Side, int]
#: difference of both one-sided slopes, over the larger, beyond which a number has none
JUMPS = 0.5
#: relative distance of a frequency asked for from a point of a path that is it
_SAME = 1e-9


def _told(peak: Top | CurvePeak, what: str) -> float:
    """Frequency or height of a peak."""
    return float(peak.frequency if what == "frequency" else peak.height)


def _of_limits(
    plan: ForcedPlan,
    of: str,
    limit: Callable[[bool], Limit],
    peaks: Callable[[bool, Side], list[CurvePeak]],
) -> float:
    """A number of one model's linear limits.

    Parameters
    ----------
    of
        Its name.
    limit, peaks
        Whether stuck -> the limit; whether stuck and blade -> its peaks.

    Raises
    ------
    ConvergenceError
        Where it is not among the numbers.
    """
    e = plan.scene.excitation
    if of in STUCK_MODES:
        shapes = limit(True).shapes
        found = stuck_frequency(shapes.modes if shapes else (), of == "stuck_in_phase")
        if math.isnan(found):
            raise ConvergenceError(
                f"{of}: no such mode below {CANDIDATES * e.stop:g} Hz, {CANDIDATES:g} times "
                "excitation.stop"
            )
        return found
    kind, side, number, what = PEAK_NUMBERS[of]
    peak = next((p for p in peaks(kind == "stuck", side) if p.number == number), None)
    if peak is None:
        raise ConvergenceError(
            f"{of}: no such peak between {e.start:g} and {e.stop:g} Hz, the ends of the sweep"
        )
    return _told(peak, what)


def _with_friction(
    plan: ForcedPlan, model: Model, ratio: float, keys: Sequence[PeakKey], over: Array
) -> tuple[dict[PeakKey, Top | ConvergenceError], dict[Side, ComplexArray]]:
    """What targets need at one F_C/F_E: peaks, or why they were not found, and the accelerance of
    both blades at frequencies (k,) in Hz.

    Raises
    ------
    ConvergenceError
        Where a point of the curve is not found.
    """
    force, tops = plan.scene.damper.centrifugal / ratio, dict[PeakKey, Top | ConvergenceError]()
    # as fine as its peaks need
    fine = np.unique(np.concatenate([fine_grid(plan, model), over])) if keys else over
    answer = respond(plan, model, force, fine)
    b = answer.balance
    for side, number in keys:
        height = np.abs(measures.accelerance(answer, model.row(side), force))
        peaks = numbered_peaks(model, answer, height, plan.scene.excitation.stop)
        peak, top = next((one for one in peaks if one.number == number), None), None
        why = f"no such peak on the curve ({answer.message})"
        if peak is not None:
            x, f = answer.x[peak.sample], float(answer.frequency[peak.sample])
            top, why = climbed(model, b, x, f, side, force), f"its top near {f:.6g} Hz not reached"
        name = f"{'left_' * (side == 'left')}peak_{number}@{ratio:g}"
        tops[side, number] = top or ConvergenceError(f"{name}: {why}")
    if not len(over):
        return tops, {}
    x = np.array([_point(b, answer, ratio, float(f)) for f in over])
    return tops, measures.accelerance_at(model, b, x, over, force)


def _point(b: Balance, answer: FrequencyResponse, ratio: float, f: float) -> Array:
    """The unknowns at one frequency."""
    here = np.flatnonzero(np.abs(answer.frequency / f - 1.0) <= _SAME)
    x = newton(b, answer.x[here[0]], f) if len(here) else first_point(b, f)
    if x is None:
        raise ConvergenceError(f"F_C/F_E {ratio:g}: no motion at {f:.6g} Hz ({answer.message})")
    return x


class FitResponses:
    """Targets of a fit as functions of its parameters, and the models of the scene with its inputs
    moved. Without targets with friction the static state is omitted: a stuck point is as stiff
    under any preload.

    Parameters
    ----------
    scene
        Of contact points on springs.
    targets, parameters
        Of the fit.
    journal
        Keeps what was found, for a fit that is begun again.
    needed
        Whether every target has to be there; else those that are not are nan.
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
        targets: Targets,
        parameters: Sequence[VariedInput],
        journal: Journal | None = None,
        *,
        needed: bool = True,
        like: FitResponses | None = None,
    ) -> None:
        self.scene, self.targets, self.parameters = scene, targets, tuple(parameters)
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
        #: whether friction changes the state at rest
        self.seated = scene.contact.loaded and scene.contact.static == "seated"
        seated = bool(targets.ratios) and self.seated
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
        self._journal, self._needed = journal, needed
        self._solved_once = False
        self._found: dict[bytes, tuple[Array, Array]] = {}
        for line in () if journal is None else journal.lines:
            z, value, slope = (np.array(one, float) for one in line)
            self._found[z.tobytes()] = value, slope.reshape(len(value), len(z))
        #: F_C/F_E -> peaks, and Hz at which the accelerance is asked for
        self.friction = {ratio: _asked(ratio, targets) for ratio in targets.ratios}

    @property
    def cheap(self) -> bool:
        """Whether every evaluation re-uses the same reduced blades."""
        return not self.dear

    def model(self, z: Array) -> tuple[ForcedPlan, Model]:
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
        self.made += 1
        scene = self.bare(fitted_scene(self.scene, self.parameters, z))
        contact = replace(scene.contact, directions="auto")
        if not self.targets.ratios or contact.static == _FRICTIONLESS:
            # what the points carry at rest does not depend on it
            contact = replace(contact, friction=self.scene.contact.friction)
        frame = repr(replace(scene, stiffness={}, text="", contact=contact))
        plan = _remembered(self._plans, frame, lambda: make_plan(scene))
        plan = replace(plan, scene=scene)
        bodies = _remembered(self._bodies, bodies_key(plan), lambda: make_bodies(plan))
        laws = face_laws(scene.stiffnesses[self.stiffness], self._stages)
        if frame in self._models:
            return plan, _with_contact(self._models[frame], laws, scene.contact.friction)
        # small matrices once the blades are reduced
        with threads_for(1) if bodies.reduced else nullcontext():
            model = make_model(plan, bodies, laws)
        model = _remembered(self._models, frame, lambda: model)
        if self._tangents is None and scene.contact.directions == "auto":
            # once chosen they stay: numbers would jump
            self._tangents = model.contacts.tangents if bodies.half else None
        return plan, model

    @property
    def directions(self) -> str:
        """What contact.directions has to say in a fitted scene to give its numbers: those chosen
        first; "" where the scene's own word does.
        """
        auto = self.scene.contact.directions == "auto"
        return _DIRECTIONS[self._tangents] if auto and self._tangents is not None else ""

    def bare(self, scene: ForcedScene) -> ForcedScene:
        """What is needed alone: one stiffness, the F_C/F_E that are followed, nothing estimated or
        solved again; a contact scene with the rig's geometry.
        """
        one = one_model(scene, self.stiffness, "a fit")
        contact, excitation, stiffness = one.contact, one.excitation, dict(one.stiffness)
        if self._tangents is not None:
            contact = replace(contact, directions=_DIRECTIONS[self._tangents])
        if self.targets.ratios:
            excitation = replace(excitation, centrifugal_to_force=self.targets.ratios, force=())
        else:
            contact = replace(contact, fit="unloaded")
        if self._contact:
            stiffness[self.stiffness] = replace(
                stiffness[self.stiffness], scene=contact_scene(scene, self._contact)
            )
        return replace(one, contact=contact, excitation=excitation, stiffness=stiffness)

    def at(self, z: Array) -> tuple[Array, Array]:
        """The numbers, then the points of the curves, and their derivatives.

        Parameters
        ----------
        z
            (n,) logarithms of the parameters' factors.

        Returns
        -------
        value, slope
            (m,) in the targets' units; (m, n) derivatives by z.

        Raises
        ------
        InputError
            Where the scene refuses the parameters.
        ConvergenceError
            Where a target is not among the numbers, or a curve is not found.
        """
        z = np.asarray(z, float)
        key = z.tobytes()
        if key not in self._found:
            self._found[key] = found = self.solved_at(z)
            if self._journal is not None:
                self._journal.keep([z.tolist(), *(one.tolist() for one in found)])
        return self._found[key]

    def value(self, z: Array) -> Array:
        """(m,) without derivatives."""
        return self._evaluate(*self.model(np.asarray(z, float)))

    def solved_at(self, z: Array) -> tuple[Array, Array]:
        value = self.value(z)
        slope = np.zeros((len(value), len(self.parameters)))
        for k, step in enumerate(self.steps):
            move = step * np.eye(len(z))[k]
            slope[:, k] = (self.value(z + move) - value) / step
            if not self._needed:
                below = (value - self.value(z - move)) / step
                # a number that jumps has no slope
                largest = np.fmax(np.abs(slope[:, k]), np.abs(below))
                jumps = np.abs(slope[:, k] - below) > JUMPS * largest
                slope[jumps, k] = np.nan
        return value, slope

    def _evaluate(self, plan: ForcedPlan, model: Model) -> Array:
        parts: list[Array] = []
        with threads_for(len(model.M)):
            # what the balance leaves out is alike on every curve of a fit
            with quiet() if self._solved_once else nullcontext():
                friction = {
                    ratio: _with_friction(plan, model, ratio, *asked)
                    for ratio, asked in self.friction.items()
                }
            self._solved_once = True
            limit = cache(partial(point_limit, plan, model))
            peaks = cache(lambda stuck, side: limit(stuck).peaks(side, grid(plan)))
            for one in self.targets.numbers:
                try:
                    if one.of in CONTACT_TOTALS:
                        side, which = CONTACT_TOTALS[one.of]
                        v = float(getattr(model.laws[side], which))
                    elif one.ratio is None:
                        v = _of_limits(plan, one.of, limit, peaks)
                    else:
                        _, side, number, what = PEAK_NUMBERS[one.of]
                        peak = friction[one.ratio][0][side, number]
                        if isinstance(peak, ConvergenceError):
                            raise peak
                        v = _told(peak, what)
                except ConvergenceError:
                    if self._needed:
                        raise
                    v = np.nan
                parts.append(np.array([v]))
            for curve in self.targets.curves:
                of = curve.curve
                if of.force_ratio is None:
                    H = limit(of.state == "stuck").accelerance(of.blade, of.frequency)
                else:
                    at = np.searchsorted(self.friction[of.force_ratio][1], of.frequency)
                    H = friction[of.force_ratio][1][of.blade][at]
                parts.append(_in_parts(curve, H))
        return np.concatenate(parts)


def _asked(ratio: float, targets: Targets) -> tuple[list[PeakKey], Array]:
    """Peaks and frequencies (k,), rising, that targets need of one F_C/F_E."""
    keys = dict.fromkeys(PEAK_NUMBERS[one.of][1:3] for one in targets.numbers if one.ratio == ratio)
    over = [one.curve.frequency for one in targets.curves if one.curve.force_ratio == ratio]
    return list(keys), np.unique(np.concatenate(over)) if over else np.zeros(0)


def _in_parts(target: CurveTarget, H: ComplexArray) -> Array:
    """Real and imaginary parts, or magnitudes."""
    if target.curve.is_complex:
        return np.concatenate([H.real, H.imag])
    return np.maximum(np.abs(H), np.finfo(float).tiny)
