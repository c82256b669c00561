"""Peaks of a rig over F_C/F_E, of whole curves by harmonic balance.

They are kept on disk as they are solved: called again, a choice continues.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from upd.analyses import make_plan
from upd.analyses.forced.curves import linear_peaks
from upd.analyses.forced.measures import tell_stuck_peaks
from upd.analyses.forced.model import Model, balance_of, make_model
from upd.analyses.forced.performance import peaks_at
from upd.analyses.forced.plan import ForcedPlan, grid
from upd.analyses.forced.statics import face_laws, static_state
from upd.analyses.seated.bodies import Bodies, bodies_key, make_bodies
from upd.cache.arrays import Journal
from upd.cache.sources import key_of, source_digest
from upd.errors import InputError
from upd.linalg.parallel import threads_for
from upd.progress import Stages
from upd.scene import ForcedScene
from upd.scene.ranges import one_model
from upd.sizing.worst_peak import Peaks, PeaksOver


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
        bodies: dict[str, Bodies],
        stages: Stages,
        report: Callable[[str], None],
    ) -> None:
        self.scene, self._report, self.curves = scene, report, 0
        (self.stiffness,) = scene.contact.stiffness
        plan: ForcedPlan = make_plan(scene)
        self.plan = plan
        key = bodies_key(plan)
        if key not in bodies:
            with stages("blades", "mesh and assembly"):
                bodies[key] = make_bodies(self.plan)
        with stages("blades", "static state and reduction"):
            laws = face_laws(scene.stiffnesses[self.stiffness], stages)
            state = static_state(self.plan, bodies[key], stages=stages)
            self.model: Model = make_model(self.plan, bodies[key], laws, state)
        e, force = scene.excitation, scene.damper.centrifugal / ends[1]
        self.balance = balance_of(plan, self.model, force, range(scene.balance.harmonics + 1))
        with threads_for(len(self.model.M)):
            stuck = linear_peaks(self.balance, self.model.row("right"), force, grid(plan), True)
        if not tell_stuck_peaks(self.model, stuck, e.stop):
            raise InputError(
                f"no stuck peak of the right blade between {e.start:g} and {e.stop:g} Hz; to "
                "fix it: widen excitation.start and stop"
            )
        kept = Journal(f"choice-{self._key()[:32]}")
        low, high = map(math.log, ends)
        self.peaks = PeaksOver(self._curve_at, low, high, kept=kept)

    def _key(self) -> str:
        one = replace(
            self.scene,
            text="",
            name="",
            title="",
            excitation=replace(self.scene.excitation, force=(), centrifugal_to_force=()),
        )
        return key_of({"scene": repr(one), "sources": source_digest(self.scene.recipe)})

    def _curve_at(self, s: float) -> Peaks | None:
        """Peaks of the right blade at one F_C/F_E; None where no curve arrives."""
        ratio = math.exp(s)
        self._report(f"whole curve, F_C/F_E {ratio:.4g}")
        self.curves += 1
        found = peaks_at(self.plan, self.model, ratio, self.scene.balance.harmonics)
        if not found.arrived:
            return None
        return {
            one.mode or f"peak {one.number}": (one.frequency, math.log(one.height))
            for one in found.peaks
            if one.blade == "right"
        }
