"""The numbers of a response's linear limits, and their derivatives by what a fit varies.

What changes contact springs alone re-uses the reduced blades. Derivatives by data that are known in
closed form (stiffness, Young's modulus, density, damping) are exact; others are central
differences of the logarithm of the factor, with `STEP`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from upd.analyses import make_plan
from upd.analyses.base import InputEnds
from upd.analyses.forced.input_data import data_change, is_known
from upd.analyses.forced.linear_peaks import linear_peaks
from upd.analyses.forced.linear_sensitivity import limit_peak, stuck_frequencies
from upd.analyses.forced.measures import Unsolved
from upd.analyses.forced.mode_peaks import ModePeak, unmoved
from upd.analyses.forced.model import Model, make_model
from upd.analyses.forced.paths import balance_of, grid
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.solution import CANDIDATES, tell_stuck_peaks
from upd.analyses.forced.stiffness import FaceLaw, face_laws
from upd.analyses.seated.bodies import Bodies, make_bodies
from upd.errors import ConvergenceError, InputError
from upd.fitting.parameters import VariedInput, scene_with
from upd.fitting.targets import PEAK_NUMBERS, STUCK_MODES, FitTarget
from upd.hbm.parameter_change import ParameterChange
from upd.linalg.parallel import threads_for
from upd.progress import Stages
from upd.scene import ForcedScene
from upd.scene.forced import SIDES, Side
from upd.scene.quantities import UNKNOWN, Uncertainty

Array = NDArray[np.float64]
#: of central differences of ln(factor): their error is of its square
STEP = 1e-3
#: sets of bodies that are kept
_KEPT = 3


class LinearResponses:
    """Targets of a fit as functions of its parameters.

    Parameters
    ----------
    scene
        Of contact points on springs.
    targets, parameters
        Of the fit.

    Raises
    ------
    InputError
        For a scene of whole faces, one that chooses its levels by an accuracy, and parameters of
        several contact stiffnesses.
    """

    def __init__(
        self, scene: ForcedScene, targets: Sequence[FitTarget], parameters: Sequence[VariedInput]
    ) -> None:
        if scene.contact.model == "interface":
            raise InputError(
                'contact.model: fits take contact points on springs; set contact.model="springs"'
            )
        if scene.wanted_accuracy is not None:
            raise InputError(
                "accuracy: a fit keeps one mesh; leave it out or set it to "
                f'"{UNKNOWN}", and choose the levels in the scene'
            )
        self.scene, self.targets, self.parameters = scene, tuple(targets), tuple(parameters)
        self.stiffness = _stiffness(scene, parameters)
        self.evaluations = 0
        self._stages = Stages()
        self._plans: dict[str, ForcedPlan] = {}
        self._bodies: dict[str, Bodies] = {}
        self._models: dict[str, Model] = {}
        self._kept: tuple[bytes, Array, Array] | None = None
        at = np.zeros(len(self.parameters))
        self.exact = [is_known(self._ends(at, k)) for k in range(len(self.parameters))]
        paths = [path for one in parameters for path in one.paths]
        #: whether every evaluation re-uses the same reduced blades
        self.cheap = all(p.startswith(("stiffness.", "contact.friction")) for p in paths)

    def at(self, z: Array) -> tuple[Array, Array]:
        """The numbers and their derivatives.

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
            Where a target is not among the numbers.
        """
        key = np.asarray(z, float).tobytes()
        if self._kept is not None and self._kept[0] == key:
            return self._kept[1], self._kept[2]
        plan, bodies, model = self._model(scene_with(self.scene, self.parameters, z))
        known = [k for k, exact in enumerate(self.exact) if exact]
        changes = [
            data_change(plan, bodies, self.stiffness, model, self._ends(z, k), self._stages).whole(
                model
            )
            for k in known
        ]
        with threads_for(len(model.M)):
            value, some = self._numbers(plan, model, changes)
        slope = np.zeros((len(value), len(self.parameters)))
        # of half an interval of STEP each way
        slope[:, known] = some / np.sinh(STEP)
        for k in (k for k, exact in enumerate(self.exact) if not exact):
            low, high = (self._value(z, k, side * STEP) for side in (-1.0, 1.0))
            slope[:, k] = (high - low) / (2.0 * STEP)
        self._kept = (key, value, slope)
        return value, slope

    def directions(self, z: Array) -> str:
        """What contact.directions has to say in the scene with these parameters to give these
        numbers; "" where its own word does.
        """
        scene = scene_with(self.scene, self.parameters, z)
        if scene.contact.directions != "auto":
            return ""
        used = self._model(scene)[2].contacts.tangents
        self._models.clear()
        chosen = self._model(scene)[2].contacts.tangents
        return "" if used == chosen else {1: "one", 2: "two"}[used]

    def _value(self, z: Array, k: int, shift: float) -> Array:
        moved = np.array(z, float)
        moved[k] += shift
        plan, _, model = self._model(scene_with(self.scene, self.parameters, moved))
        with threads_for(len(model.M)):
            return self._numbers(plan, model, [])[0]

    def _ends(self, z: Array, k: int) -> InputEnds:
        """One parameter a step down and up from its place."""
        scenes = []
        for shift in (0.0, -STEP, STEP):
            moved = np.array(z, float)
            moved[k] += shift
            scenes.append(self._bare(scene_with(self.scene, self.parameters, moved)))
        one = self.parameters[k]
        value = one.value(float(z[k]))
        known = Uncertainty(one.paths[0], value, STEP * value, "", one.kind, ())
        return InputEnds(known, *scenes)

    def _bare(self, scene: ForcedScene) -> ForcedScene:
        """What the linear limits need: one stiffness, nothing estimated or solved again, no static
        state (a stuck point is as stiff under any preload).
        """
        return replace(
            scene,
            accuracy=UNKNOWN,
            uncertain={},
            left_out=replace(scene.left_out, solve="no"),
            contact=replace(scene.contact, fit="unloaded", stiffness=(self.stiffness,)),
        )

    def _model(self, scene: ForcedScene) -> tuple[ForcedPlan, Bodies, Model]:
        self.evaluations += 1
        scene = self._bare(scene)
        plan = replace(self._plan(scene), scene=scene)
        blades = repr(
            (
                plan.parameters,
                scene.material,
                scene.mesh,
                scene.damper.density,
                scene.reduction,
                scene.solver,
            )
        )
        bodies = _remembered(self._bodies, blades, lambda: make_bodies(plan))
        laws = face_laws(scene.stiffnesses[self.stiffness], self._stages)
        frame = repr(replace(scene, stiffness={}, text=""))
        if frame in self._models and not any(law.law for law in laws.values()):
            return plan, bodies, _stiffened(self._models[frame], laws)
        # small matrices once the blades are reduced
        with threads_for(1) if bodies.reduced else nullcontext():
            model = make_model(plan, bodies, laws)
        return plan, bodies, _remembered(self._models, frame, lambda: model)

    def _plan(self, scene: ForcedScene) -> ForcedPlan:
        frame = repr(replace(scene, stiffness={}, text=""))
        return _remembered(self._plans, frame, lambda: make_plan(scene))  # type: ignore[no-any-return]

    def _numbers(
        self, plan: ForcedPlan, model: Model, changes: Sequence[ParameterChange]
    ) -> tuple[Array, Array]:
        """The targets' numbers, and what the changes do to them."""
        stop = plan.scene.excitation.stop
        modes: dict[str, tuple[float, Array]] = {}
        if any(one.name in STUCK_MODES for one in self.targets):
            modes = stuck_frequencies(model, CANDIDATES * stop, changes)
        peaks: dict[tuple[str, Side], list[ModePeak]] = {}
        value, slope = [], []
        for one in self.targets:
            if one.name in STUCK_MODES:
                if one.name not in modes:
                    raise ConvergenceError(
                        f"{one.name}: no such mode below {CANDIDATES * stop:g} Hz, "
                        f"{CANDIDATES:g} times excitation.stop"
                    )
                f, change = modes[one.name]
                value.append(f)
                slope.append(f * change)
                continue
            kind, side, number, what = PEAK_NUMBERS[one.name]
            if (kind, side) not in peaks:
                peaks[kind, side] = _peaks(plan, model, kind == "stuck", side)
            peak = next((p for p in peaks[kind, side] if p.number == number), None)
            if peak is None:
                e = plan.scene.excitation
                raise ConvergenceError(
                    f"{one.name}: no such peak between {e.start:g} and {e.stop:g} Hz, the ends of "
                    "the sweep"
                )
            found = limit_peak(model, side, kind == "stuck", peak.frequency, changes)
            if what == "frequency":
                value.append(peak.frequency)
                slope.append(found.by_frequency)
            else:
                value.append(peak.height)
                slope.append(peak.height * found.by_height / found.height)
        return np.array(value), np.array(slope).reshape(len(value), len(changes))


def _stiffened(model: Model, laws: Mapping[Side, FaceLaw]) -> Model:
    """The model with other totals of its faces: those of its points grow alike, and the directions
    in which friction resists stay.
    """
    old = model.contacts.law

    def grown(values: Array, of: Literal["K_N", "K_T"]) -> Array:
        by = [getattr(laws[side], of) / getattr(model.laws[side], of) for side in SIDES]
        return np.asarray(values * np.array(by)[model.face])

    law = replace(old, k_n=grown(old.k_n, "K_N"), k_t=grown(old.k_t, "K_T"))
    return replace(model, laws=laws, contacts=replace(model.contacts, law=law))


def _peaks(plan: ForcedPlan, model: Model, stuck: bool, side: Side) -> list[ModePeak]:
    if not stuck and side not in model.excitation.free_blades:
        return []
    force = plan.scene.damper.centrifugal
    problem = balance_of(plan, model, force, (0, *model.excitation.harmonics))
    found = linear_peaks(Unsolved(problem), model.row(side), force, grid(plan), stuck)
    stop = plan.scene.excitation.stop
    return tell_stuck_peaks(model, found, stop) if stuck else unmoved(found)


def _stiffness(scene: ForcedScene, parameters: Sequence[VariedInput]) -> str:
    """Name of the contact stiffness that the numbers are read for."""
    paths = [path.split(".") for one in parameters for path in one.paths]
    named = list(dict.fromkeys(steps[1] for steps in paths if steps[0] == "stiffness"))
    if len(named) > 1:
        raise InputError(
            f"parameters of several contact stiffnesses ({', '.join(named)}): a fit has one; to "
            "fix it: vary those of one"
        )
    return named[0] if named else next(iter(scene.stiffnesses))


def _remembered(kept: dict[str, Any], key: str, make: Any) -> Any:
    """What was made for a key; of all keys the last few."""
    if key not in kept:
        while len(kept) >= _KEPT:
            del kept[next(iter(kept))]
        kept[key] = make()
    return kept[key]
