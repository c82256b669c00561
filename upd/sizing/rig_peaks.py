"""Peaks of a rig over F_C/F_E, of whole curves by harmonic balance.

They are kept on disk as they are solved: called again, a choice continues.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from upd.analyses import make_plan
from upd.analyses.forced import measures
from upd.analyses.forced.linear_limits import linear_peaks
from upd.analyses.forced.measures import numbered_peaks, tell_stuck_peaks
from upd.analyses.forced.model import Model, balance_of, make_model, path_settings, respond
from upd.analyses.forced.plan import ForcedPlan, grid
from upd.analyses.forced.sensitivity import data_change, is_known
from upd.analyses.forced.statics import static_state
from upd.analyses.forced.stiffness import face_laws
from upd.analyses.seated.bodies import Bodies, bodies_key, make_bodies
from upd.cache.arrays import Journal
from upd.cache.sources import key_of, source_digest
from upd.errors import InputError
from upd.hbm.peaks.over import Peaks, PeaksOver, peak_point
from upd.hbm.peaks.parameter_change import ParameterChange
from upd.linalg.parallel import threads_for
from upd.progress import Stages
from upd.scene import ForcedScene
from upd.scene.quantities import Uncertainty
from upd.scene.ranges import one_model, with_values
from upd.sizing.ranges import InputRange
from upd.vary.inputs import InputEnds

#: half of the relative interval of central differences of data that are known in closed form
STEP = 1e-3
#: frequencies of a whole curve before it is refined where it bends: enough to see its peaks
CURVE_POINTS = 100


def bare(scene: ForcedScene, stiffness: str) -> ForcedScene:
    """What peaks over F_C/F_E need of a scene: one stiffness, nothing estimated or solved again.

    Raises
    ------
    InputError
        With everything for which peaks are no functions of F_C/F_E.
    """
    more = []
    if not scene.contact.loaded:
        more.append(
            "contact.fit: with gaps at rest peaks do not depend on F_C/F_E alone; set "
            'contact.fit="loaded"'
        )
    if scene.balance.method == "march":
        more.append('balance.method: peaks are those of harmonic balance; set "balance"')
    return replace(one_model(scene, stiffness, "a choice", more=more), want=("response",))


class RigPeaks:
    """The peaks of one rig.

    Parameters
    ----------
    scene
        As `bare` makes it.
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
        ends: tuple[float, float],
        step: float,
        parameters: tuple[tuple[InputRange, float], ...],
        bodies: dict[str, Bodies],
        stages: Stages,
        report: Callable[[str], None],
    ) -> None:
        self.scene, self._report, self.curves = scene, report, 0
        (self.stiffness,) = scene.contact.stiffness
        plan = make_plan(scene)
        assert isinstance(plan, ForcedPlan)
        self.plan = plan
        key = bodies_key(plan)
        if key not in bodies:
            with stages("blades", "mesh and assembly"):
                bodies[key] = make_bodies(self.plan)
        self.bodies = bodies[key]
        with stages("blades", "static state and reduction"):
            laws = face_laws(scene.stiffnesses[self.stiffness], stages)
            state = static_state(self.plan, self.bodies, stages=stages)
            self.model: Model = make_model(self.plan, self.bodies, laws, state)
        e, force = scene.excitation, scene.damper.centrifugal / ends[1]
        self.balance = balance_of(plan, self.model, force, range(scene.balance.harmonics + 1))
        changes = []
        for one, value in parameters:
            with stages("derivatives", one.path):
                changes.append(self._change(one, value, stages))
        self._changes = [change for change in changes if change is not None]
        self.known = tuple(change is not None for change in changes)
        kept = Journal(f"choice-{self._key(parameters)[:32]}")
        low, high = map(math.log, ends)
        with threads_for(len(self.model.M)):
            stuck = linear_peaks(self.balance, self.model.row("right"), force, grid(plan), True)
            if not tell_stuck_peaks(self.model, stuck, e.stop):
                raise InputError(
                    f"no stuck peak of the right blade between {e.start:g} and {e.stop:g} Hz; to "
                    "fix it: widen excitation.start and stop"
                )
            self.peaks = PeaksOver(self._curve_at, low, high, step, kept)

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

    def _curve_at(self, s: float) -> Peaks | None:
        """Peaks of the whole curve by harmonic balance, up or down; None where neither arrives."""
        e, row = self.scene.excitation, self.model.row("right")
        ratio = math.exp(s)
        force = self.scene.damper.centrifugal / ratio
        sweep = np.linspace(e.start, e.stop, min(e.points, CURVE_POINTS))
        for down in (False, True):
            self._report(f"whole curve, F_C/F_E {ratio:.4g}")
            self.curves += 1
            answer = respond(
                self.plan,
                self.model,
                force,
                sweep,
                sweep_down=down,
                settings=path_settings(e.points),
            )
            if answer.arrived:
                break
        else:
            return None
        height = np.abs(measures.accelerance(answer, row, force))
        return {
            peak.mode or f"peak {peak.number}": peak_point(
                answer,
                row,
                (peak.sample, peak.frequency, peak.height),
                self._changes,
                unit=1e-3 / force,
                harmonic=self.model.excitation.lowest,
            )
            for peak in numbered_peaks(self.model, answer, height, e.stop)
        }
