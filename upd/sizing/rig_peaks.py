"""Peaks of a rig over F_C/F_E: followed by harmonic balance, elsewhere by whole paths or sweeps.

Points are kept on disk as they are solved: called again, a choice goes on where it was.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upd.analyses import make_plan
from upd.analyses.base import InputEnds
from upd.analyses.forced import measures
from upd.analyses.forced.input_data import data_change, is_known
from upd.analyses.forced.linear_peaks import QUARTER, linear_modes, linear_peaks
from upd.analyses.forced.measures import Unsolved
from upd.analyses.forced.mode_peaks import numbered_peaks
from upd.analyses.forced.model import Model, make_model
from upd.analyses.forced.paths import balance_of, grid, path_settings, respond
from upd.analyses.forced.performance import sweep_peak
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.solution import tell_stuck_peaks
from upd.analyses.forced.statics import static_state
from upd.analyses.forced.stiffness import face_laws
from upd.analyses.forced.sweeps import make_springs
from upd.analyses.seated.bodies import Bodies, bodies_key, make_bodies
from upd.cache.arrays import cache_folder, load_arrays, save_arrays
from upd.cache.sources import key_of, source_digest
from upd.errors import InputError
from upd.hbm.followed_peaks import FollowedPeak, FollowedPeaks, PeakPoint, PeakStart, SeenPeak
from upd.hbm.parameter_change import ParameterChange
from upd.hbm.peaks import Peak
from upd.linalg.parallel import threads_for
from upd.progress import Stages
from upd.scene import ForcedScene
from upd.scene.quantities import UNKNOWN, Uncertainty
from upd.sizing.ranges import InputRange, with_values
from upd.sizing.ratio_curves import SWEEPS, PeaksOverRatio, SweptPeak

log = logging.getLogger(__name__)
Array = NDArray[np.float64]
#: half of the relative interval of central differences of data that are known in closed form
STEP = 1e-3
#: frequencies of a whole curve before it is refined where it bends: enough to see its peaks
CURVE_POINTS = 100
#: name of the points that were not followed, in what is kept
_SWEPT = "swept"


def bare(scene: ForcedScene, stiffness: str) -> ForcedScene:
    """What followed peaks need of a scene: one stiffness, nothing estimated or solved again.

    Raises
    ------
    InputError
        With everything for which peaks over F_C/F_E are not told.
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
        problems.append('balance.method: peaks are followed by the balance; set "auto"')
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
    low, high
        F_C/F_E that may be asked for.
    parameters
        Inputs whose derivatives are wanted, with their values here: nan of those that are not
        known in closed form.
    bodies
        Text of what blades and damper are -> them: re-used.
    stages
        Of the whole.
    told
        Called with words before every solution.
    """

    def __init__(
        self,
        scene: ForcedScene,
        stiffness: str,
        low: float,
        high: float,
        parameters: tuple[tuple[InputRange, float], ...],
        bodies: dict[str, Bodies],
        stages: Stages,
        told: Callable[[str], None],
    ) -> None:
        self.scene, self.stiffness, self._told = scene, stiffness, told
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
            self.peaks = self._peaks(low, high, parameters, stages)

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
        low: float,
        high: float,
        parameters: tuple[tuple[InputRange, float], ...],
        stages: Stages,
    ) -> PeaksOverRatio:
        scene, model = self.scene, self.model
        force = scene.damper.centrifugal / high
        problem = balance_of(self.plan, model, force, range(scene.balance.harmonics + 1))
        stop = scene.excitation.stop
        stuck = linear_peaks(Unsolved(problem), model.row("right"), force, grid(self.plan), True)
        told = tell_stuck_peaks(model, stuck, stop)
        if not told:
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
        followed = FollowedPeaks(
            problem,
            model.row("right"),
            high,
            [PeakStart(one.mode or f"peak {one.number}", one.frequency) for one in told],
            highest=high,
            unit=1e-3 / force,
            harmonic=model.excitation.lowest,
            changes=known,
            search=self._whole_curve,
            told=lambda name, r: self._told(f"{name}, F_C/F_E {r:.4g}"),
            kept=self._save,
        )
        self.followed, self.swept = followed, dict[float, SweptPeak]()
        self._load()
        self._springs = (
            None if scene.balance.method == "balance" else make_springs(self.plan, model)
        )
        return PeaksOverRatio(followed, math.log(low), math.log(high), self._elsewhere, self.swept)

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

    @property
    def fine_points(self) -> int:
        """Frequencies of a sweep that are a quarter of the narrowest stuck peak's width apart."""
        e, k = self.scene.excitation, self.model.excitation.lowest
        modes, width = (v / k for v in linear_modes(self.followed.balance, True))
        inside = width[(modes > e.start) & (modes < e.stop) & (width > 0.0)]
        if not inside.size:
            return int(e.points)
        return max(
            int(e.points), math.ceil((e.stop - e.start) / (QUARTER * float(inside.min()))) + 1
        )

    # -- where no peak can be followed -------------------------------------------------------------

    def _elsewhere(self, s: float) -> SweptPeak | None:
        found = self.by_sweeps(s)
        if found is not None:
            self.swept[s] = found
            self._save()
        return found

    def _whole_curve(self, ratio: float) -> list[SeenPeak] | None:
        """Peaks of the whole curve by harmonic balance, up or down; None where neither arrives."""
        force = self.scene.damper.centrifugal / ratio
        for down in (False, True):
            self._told(f"whole curve, F_C/F_E {ratio:.4g}")
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
            return [
                SeenPeak(
                    one.mode or f"peak {one.number}",
                    float(answer.frequency[one.sample]),
                    answer.x[one.sample],
                )
                for one in numbered_peaks(self.model, answer, height, stop)
            ]
        return None

    def by_sweeps(self, s: float) -> SweptPeak | None:
        """The highest point of sweeps up and down by time march.

        Parameters
        ----------
        s
            ln(F_C/F_E).
        """
        if self._springs is None:
            return None
        ratio = math.exp(s)
        self._told(f"sweeps up and down, F_C/F_E {ratio:.4g}")
        found = sweep_peak(self.plan, self._springs, self.stiffness, ratio)
        if found is None:
            return None
        f, height, low = found
        return SweptPeak(math.log(height), math.log(low), f, SWEEPS)

    # -- what is kept ------------------------------------------------------------------------------

    def _save(self) -> None:
        arrays: dict[str, NDArray[np.generic]] = {}
        peaks = [one for one in self.followed.peaks if one.points]
        arrays["names"] = np.array([one.name for one in peaks])
        scanned = self.followed.scanned
        if scanned:
            arrays["scanned"] = np.array([(s, float(done)) for s, done in scanned.items()])
        for k, one in enumerate(peaks):
            points = list(one.points.values())
            if points:
                arrays[f"{k}.absent"] = np.array(sorted(one.absent))
                arrays[f"{k}.failed"] = np.array(sorted(one.failed))
                arrays[f"{k}.x"] = np.array([p.peak.x for p in points])
                arrays[f"{k}.by"] = np.array([p.by for p in points])
                arrays[f"{k}.rest"] = np.array(
                    [
                        (p.log_ratio, p.frequency, p.log_height, p.slope, p.peak.amplitude)
                        for p in points
                    ]
                )
        if self.swept:
            arrays[_SWEPT] = np.array([(s, *one[:3]) for s, one in self.swept.items()])
        save_arrays(self._file, arrays)

    def _load(self) -> None:
        """Points of an earlier call."""
        kept = load_arrays(self._file) or {}
        names = [str(name) for name in kept.get("names", ())]
        for k, name in enumerate(names):
            x, by, rest = (kept.get(f"{k}.{part}") for part in ("x", "by", "rest"))
            if x is None or by is None or rest is None:
                continue
            if x.shape[1] != self.followed.balance.size or by.shape[1] != sum(self.known):
                continue
            one = next((p for p in self.followed.peaks if p.name == name), None)
            if one is None:
                one = FollowedPeak(name, PeakStart(name, float(rest[0, 1])), math.inf)
                self.followed.peaks.append(one)
            for unknowns, slopes, (s, f, y, slope, a) in zip(x, by, rest, strict=True):
                # a factor on the loads of this call
                q = self.followed.ratio / math.exp(s)
                one.points[s] = PeakPoint(s, f, y, slope, slopes, Peak(f, a, unknowns, "found"), q)
            one.absent.update(kept.get(f"{k}.absent", ()))
            one.failed.update(kept.get(f"{k}.failed", ()))
            self.resumed += len(rest)
        for s, through in kept.get("scanned", np.zeros((0, 2))):
            self.followed.scanned[s] = bool(through)
        for s, y, low, f in kept.get(_SWEPT, np.zeros((0, 4))):
            self.swept[s] = SweptPeak(y, low, f, SWEEPS)
            self.resumed += 1
