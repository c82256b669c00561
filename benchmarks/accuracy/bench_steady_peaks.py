"""Which maxima of a path by harmonic balance are steady motions, with more and more harmonics.

Both ready rigs at F_C/F_E 194 on twelve rows of Gauss points. Of every highest maximum of a mode:
its height, where the run's march goes from there, and what another march keeps of it (HHT, all
modes implicit, other steps); the peak that is told. Beside it the peaks of sweeps up and down, with
more and more steps. A name or two (``asymmetric``) runs these alone, ``own`` behind with that
contact stiffness of the scene.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curves import ForcedCurve
from upd.analyses.forced.mode_peaks import ModePeak, numbered_peaks
from upd.analyses.forced.model import Model, make_model
from upd.analyses.forced.paths import grid, respond
from upd.analyses.forced.plan import ForcedPlan, make_plan
from upd.analyses.forced.statics import static_state
from upd.analyses.forced.steady_peaks import with_steady_peaks
from upd.analyses.forced.stiffness import face_laws
from upd.analyses.forced.sweeps import SweepJob, both_ways, make_springs, spread
from upd.analyses.seated.bodies import make_bodies
from upd.hbm.march import steady_state
from upd.progress import Stages
from upd.scene import load_scene
from upd.scene.forced_contact import SIDES

Row = dict[str, Any]
RATIO, ROWS = 194.0, 12
AT: Mapping[str, Any] = {
    "want": ["response"],
    "left_out.solve": "no",
    "accuracy": "unknown",
    "balance.method": "balance",
    "contact.rule": "gauss",
    "contact.rows": ROWS,
    "contact.columns": 2,
    "excitation.centrifugal_to_force": [RATIO],
}
STIFFNESSES = ("thesis", "own")
#: highest harmonics, steps in a period of the sweeps, and where these begin and end
HARMONICS = {"symmetric": (1, 3, 5, 7), "asymmetric": (1, 3, 5, 7, 9)}
STEPS, SWEPT = (128, 256), (280.0, 460.0)
#: steps in a period and periods of the other march
OTHER, PERIODS = 512, 600


def run() -> Iterator[Row]:
    """Rows of both rigs."""
    for name in HARMONICS:
        yield from _rig(name)


def _rig(name: str, stiffness: str = STIFFNESSES[0]) -> Iterator[Row]:
    stages = Stages()
    plan = make_plan(load_scene(f"{name}-response", {**AT, "contact.stiffness": [stiffness]}))
    laws = face_laws(plan.scene.stiffnesses[stiffness], stages)
    bodies = make_bodies(plan)
    model = make_model(plan, bodies, laws, static_state(plan, bodies, stages=stages))
    for highest in HARMONICS[name]:
        yield from _curve(name, plan, model, stiffness, highest)
    for steps in STEPS:
        yield from _sweeps(name, plan, model, stiffness, steps)


def _curve(
    name: str, plan: ForcedPlan, model: Model, stiffness: str, highest: int
) -> Iterator[Row]:
    begin, force = time.process_time(), plan.scene.damper.centrifugal / RATIO
    answer = respond(plan, model, force, grid(plan), harmonics=range(highest + 1))
    blades = {side: measures.accelerance(answer, model.row(side), force) for side in SIDES}
    followed = time.process_time() - begin
    curve = ForcedCurve(stiffness, RATIO, force, answer, blades, followed)
    curve = with_steady_peaks(plan, model, curve)
    marched = time.process_time() - begin - followed
    size, stop = np.abs(blades["right"]), plan.scene.excitation.stop
    case = f"{name}, harmonics to {highest}"
    took = f"{followed:.0f} s of processor for the path, {marched:.1f} s for marches"
    gone = {one.peak.sample: one.marched for one in curve.left if one.blade == "right"}
    for top in numbered_peaks(model, answer, size, stop):
        goes = f"left for {gone[top.sample]:.3g}" if top.sample in gone else "not left"
        kept = 100.0 * _other_march(model, curve, top)
        yield _row(
            f"highest maximum, {top.mode}",
            f"{case}, {top.frequency:.2f} Hz",
            top.height,
            f"{goes}; another march keeps {kept:.0f} %; {answer.status}, {took}",
        )
    told = numbered_peaks(model, answer, size, stop, curve.left_points)
    for one in told:
        yield _row(f"peak told, {one.mode}", f"{case}, {one.frequency:.2f} Hz", one.height, "")


def _row(name: str, case: str, height: float, note: str) -> Row:
    return {"name": name, "case": case, "value": height, "unit": "(m/s2)/N", "note": note}


def _other_march(model: Model, curve: ForcedCurve, top: ModePeak) -> float:
    """What it keeps of the height."""
    i, b = top.sample, curve.answer.balance
    f = float(curve.frequency[i])
    found = steady_state(b, f, curve.answer.x[i], steps=OTHER, tolerance=1e-5, most_periods=PERIODS)
    place = b.harmonics.place(model.excitation.lowest)
    height = 1e-3 * (2.0 * np.pi * f) ** 2 * found.amplitude(model.row("right"), place)
    return height / curve.force / float(np.abs(curve.accelerance["right"][i]))


def _sweeps(name: str, plan: ForcedPlan, model: Model, stiffness: str, steps: int) -> Iterator[Row]:
    balance = replace(plan.scene.balance, samples=steps)
    plan = replace(plan, scene=replace(plan.scene, balance=balance))
    springs = make_springs(plan, model)
    job = SweepJob(stiffness, RATIO, springs.march, spread(*SWEPT), springs.at_rest())
    begin = time.process_time()
    found = both_ways(plan, job)
    took = time.process_time() - begin
    for one in found:
        unsettled = one.frequency[~one.found.settled]
        range_ = f" ({unsettled.min():.0f} to {unsettled.max():.0f} Hz)" if len(unsettled) else ""
        for peak in one.peaks["right"]:
            yield _row(
                f"sweep {one.way}, {peak.mode}",
                f"{name}, {steps} steps, {peak.frequency:.2f} Hz",
                peak.height,
                f"{len(unsettled)} of {len(one.frequency)} frequencies do not settle{range_}; "
                f"both {took:.0f} s of processor",
            )


if __name__ == "__main__":
    names = [word for word in sys.argv[1:] if word in HARMONICS]
    own = next((word for word in sys.argv[1:] if word in STIFFNESSES), STIFFNESSES[0])
    for name in names or HARMONICS:
        for row in _rig(name, own):
            print(row, flush=True)
