"""Peaks of a rig over F_C/F_E, of whole curves by harmonic balance.

They are kept on disk as they are solved: called again, a choice continues.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upd.analyses import make_plan
from upd.analyses.forced import measures
from upd.analyses.forced.input_uncertainty import data_change, is_known
from upd.analyses.forced.linear_limits import linear_peaks
from upd.analyses.forced.measures import CurvePeak, Unsolved
from upd.analyses.forced.mode_peaks import numbered_peaks, tell_stuck_peaks
from upd.analyses.forced.model import Model, make_model
from upd.analyses.forced.paths import balance_of, path_settings, respond
from upd.analyses.forced.plan import ForcedPlan, grid
from upd.analyses.forced.statics import static_state
from upd.analyses.forced.stiffness import face_laws
from upd.analyses.seated.bodies import Bodies, bodies_key, make_bodies
from upd.cache.arrays import cache_folder, load_arrays, save_arrays
from upd.cache.sources import key_of, source_digest
from upd.errors import InputError
from upd.hbm import FrequencyResponse
from upd.hbm.curve_peaks import CurvePeaks, PeakPoint, SeenPeak
from upd.hbm.parameter_change import ParameterChange
from upd.linalg.parallel import threads_for
from upd.progress import Stages
from upd.scene import ForcedScene
from upd.scene.quantities import UNKNOWN, Uncertainty
from upd.sizing.ranges import InputRange, with_values
from upd.sizing.ratio_curves import PeaksOverRatio
from upd.vary.inputs import InputEnds

log = logging.getLogger(__name__)
Array = NDArray[np.float64]
#: half of the relative interval of central differences of data that are known in closed form
STEP = 1e-3
#: frequencies of a whole curve before it is refined where it bends: enough to see its peaks
CURVE_POINTS = 100
#: points of a path on either side of one of its peaks beside which the top is
_BESIDE = 2


def bare(scene: ForcedScene, stiffness: str) -> ForcedScene:
    """What peaks over F_C/F_E need of a scene: one stiffness, nothing estimated or solved again.

    Raises
    ------
    InputError
        With everything for which peaks are no functions of F_C/F_E.
    """
    problems = []
    if scene.contact.model == "interface":
        problems.append(
            'contact.model: peaks are followed of contact points; set contact.model="springs"'
        )
    if not scene.contact.loaded:
        problems.append(
            "contact.fit: with gaps at rest peaks do not depend on F_C/F_E alone; set "
            'contact.fit="loaded"'
        )
    if scene.balance.harmonics == "adaptive":
        problems.append("balance.harmonics: a followed peak keeps its harmonics; give a number")
    if scene.balance.method == "march":
        problems.append('balance.method: peaks are those of harmonic balance; set "balance"')
    if scene.wanted_accuracy is not None:
        problems.append(
            f'accuracy: a choice keeps one mesh; leave it out or set it to "{UNKNOWN}", and choose '
            "the levels in the scene"
        )
    if problems:
        raise InputError("scene:\n" + "\n".join(f"  {problem}" for problem in problems))
    return replace(
        scene,
        want=("response",),
        accuracy=UNKNOWN,
        uncertain={},
        measured={},
        left_out=replace(scene.left_out, solve="no"),
        contact=replace(scene.contact, stiffness=(stiffness,)),
    )


class RigPeaks:
    """The peaks of one rig.

    Parameters
    ----------
    scene
        As `bare` makes it.
    stiffness
        Name of its contact stiffness.
    ends
        F_C/F_E that may be asked for.
    step
        ln(F_C/F_E) between the first whole curves.
    parameters
        Inputs whose derivatives are wanted, with their values here: nan of those that are not
        known in closed form.
    bodies
        Text of what blades and damper are -> them: re-used.
    stages
        Of the whole.
    report
        Called with words before every solution.
    """

    def __init__(
        self,
        scene: ForcedScene,
        stiffness: str,
        ends: tuple[float, float],
        step: float,
        parameters: tuple[tuple[InputRange, float], ...],
        bodies: dict[str, Bodies],
        stages: Stages,
        report: Callable[[str], None],
    ) -> None:
        self.scene, self.stiffness, self._report = scene, stiffness, report
        self.resumed = self.curves = 0
        e = scene.excitation
        self._sweep = np.linspace(e.start, e.stop, min(e.points, CURVE_POINTS))
        plan = make_plan(scene)
        assert isinstance(plan, ForcedPlan)
        self.plan = plan
        key = bodies_key(plan)
        if key not in bodies:
            with stages("blades", "mesh and assembly"):
                bodies[key] = make_bodies(self.plan)
        self.bodies = bodies[key]
        with stages("blades", "static state and reduction"):
            laws = face_laws(scene.stiffnesses[stiffness], stages)
            state = static_state(self.plan, self.bodies, stages=stages)
            self.model: Model = make_model(self.plan, self.bodies, laws, state)
        self._file = cache_folder() / f"choice-{self._key(parameters)[:32]}.npz"
        with threads_for(len(self.model.M)):
            self.peaks = self._peaks(ends, step, parameters, stages)

    def _key(self, parameters: tuple[tuple[InputRange, float], ...]) -> str:
        one = replace(
            self.scene,
            text="",
            name="",
            title="",
            excitation=replace(self.scene.excitation, force=(), centrifugal_to_force=()),
        )
        return key_of(
            {
                "scene": repr(one),
                "derivatives": [of.path for of, _ in parameters],
                "sources": source_digest(self.scene.recipe),
            }
        )

    def _peaks(
        self,
        ends: tuple[float, float],
        step: float,
        parameters: tuple[tuple[InputRange, float], ...],
        stages: Stages,
    ) -> PeaksOverRatio:
        scene, model = self.scene, self.model
        force = scene.damper.centrifugal / ends[1]
        problem = balance_of(self.plan, model, force, range(scene.balance.harmonics + 1))
        stop = scene.excitation.stop
        stuck = linear_peaks(Unsolved(problem), model.row("right"), force, grid(self.plan), True)
        if not tell_stuck_peaks(model, stuck, stop):
            raise InputError(
                f"no stuck peak of the right blade between {scene.excitation.start:g} and {stop:g} "
                "Hz; to fix it: widen excitation.start and stop"
            )
        changes = []
        for one, value in parameters:
            with stages("derivatives", one.path):
                changes.append(self._change(one, value, stages))
        known = [change for change in changes if change is not None]
        self.known = tuple(change is not None for change in changes)
        self.found = CurvePeaks(
            problem,
            model.row("right"),
            ends[1],
            self._whole_curve,
            unit=1e-3 / force,
            harmonic=model.excitation.lowest,
            changes=known,
            kept=self._save,
        )
        self._load()
        low, high = map(math.log, ends)
        return PeaksOverRatio(self.found, low, high, step)

    def _change(self, one: InputRange, value: float, stages: Stages) -> ParameterChange | None:
        """What the logarithm of an input changes at the same F_C/F_E; None where it is not known in
        closed form.
        """
        scenes = [
            bare(with_values(self.scene, {one.path: one.text(value * factor)}), self.stiffness)
            for factor in (1.0, 1.0 - STEP, 1.0 + STEP)
        ]
        ends = InputEnds(Uncertainty(one.path, value, STEP * value, "", one.kind, ()), *scenes)
        if not is_known(ends):
            return None
        found = data_change(self.plan, self.bodies, self.stiffness, self.model, ends, stages)
        return found.whole(self.model) * (1.0 / STEP)

    # -- curves ------------------------------------------------------------------------------------

    def _whole_curve(self, ratio: float) -> list[SeenPeak] | None:
        """Peaks of the whole curve by harmonic balance, up or down; None where neither arrives."""
        force = self.scene.damper.centrifugal / ratio
        for down in (False, True):
            self._report(f"whole curve, F_C/F_E {ratio:.4g}")
            self.curves += 1
            answer = respond(
                self.plan,
                self.model,
                force,
                self._sweep,
                sweep_down=down,
                settings=path_settings(self.scene.excitation.points),
            )
            if not answer.arrived:
                continue
            height = np.abs(measures.accelerance(answer, self.model.row("right"), force))
            stop = self.scene.excitation.stop
            return [_seen(answer, one) for one in numbered_peaks(self.model, answer, height, stop)]
        return None

    # -- what is kept ------------------------------------------------------------------------------

    def _save(self) -> None:
        found, arrays = self.found, dict[str, NDArray[np.generic]]()
        each = [(s, name, p) for s, peaks in found.points.items() for name, p in peaks.items()]
        arrays["curves"] = np.array(sorted(found.points))
        arrays["failed"] = np.array(sorted(found.failed))
        arrays["names"] = np.array([name for _, name, _ in each], str)
        arrays["peaks"] = np.array(
            [(s, p.frequency, p.log_height, p.slope, *p.by) for s, _, p in each]
        ).reshape(len(each), 4 + len(found.changes))
        save_arrays(self._file, arrays)

    def _load(self) -> None:
        """What an earlier call solved."""
        kept = load_arrays(self._file) or {}
        if not {"curves", "failed", "names", "peaks"} <= set(kept):
            return
        points = self.found.points
        points |= {float(s): {} for s in kept["curves"]}
        for name, (s, f, y, slope, *by) in zip(kept["names"], kept["peaks"], strict=True):
            points[float(s)][str(name)] = PeakPoint(f, y, slope, np.array(by))
        self.found.failed.update(map(float, kept["failed"]))
        self.resumed = len(points)


def _seen(answer: FrequencyResponse, peak: CurvePeak) -> SeenPeak:
    """A peak of a curve, whose top is not beyond the points of the path beside it."""
    k = peak.sample
    beside = answer.frequency[max(k - _BESIDE, 0) : k + _BESIDE + 1]
    name = peak.mode or f"peak {peak.number}"
    between = float(beside.min()), float(beside.max())
    at = float(answer.frequency[k])
    return SeenPeak(name, peak.frequency, peak.height, between, answer.x[k], at)
