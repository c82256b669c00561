"""Contact states, loops and the damper's motion at peaks of the sweeps: against the march's own
energy, the law of friction, the balance where both are one motion, and the damper's momentum.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from upd.analyses import forced, make_plan
from upd.analyses.forced import measures
from upd.analyses.forced.interface_model import by_coulomb
from upd.analyses.forced.marched_peaks import marched_damper, marched_loops, marched_peak
from upd.analyses.forced.ranges import peak_ranges
from upd.analyses.forced.solution import ForcedSolution, MarchedPeak
from upd.hbm.interface_march import InterfaceMarch
from upd.hbm.interface_record import recorded_period
from upd.progress import Stages, silent
from upd.scene import load_scene
from upd.scene.forced import SIDES

#: the pads' response around its out-of-phase peak, which bends back
SCENE = [
    "mesh.element=hex8i",
    'contact.stiffness=["thesis"]',
    "contact.columns=1",
    "reduction.modes=4",
    "balance.harmonics=3",
    "balance.method=auto",
    "excitation.points=20",
    "excitation.start=415 Hz",
    "excitation.stop=440 Hz",
    "excitation.centrifugal_to_force=[194.0]",
    'want=["response", "contact_state", "hysteresis", "damper_motion"]',
    "left_out.solve=no",
]


def solve(*changes: str) -> ForcedSolution:
    plan = make_plan(load_scene("asymmetric-response", [*SCENE, *changes]))
    found: Any = forced.ANALYSIS.solve(plan, Stages(silent))
    assert isinstance(found, ForcedSolution)
    return found


@pytest.fixture(scope="module")
def solution() -> ForcedSolution:
    return solve()


@pytest.fixture(scope="module")
def one(solution: ForcedSolution) -> MarchedPeak:
    return solution.marched[0]


def test_a(solution: ForcedSolution, one: MarchedPeak) -> None:
    for o in solution.marched:
        print(o.case, o.frequency, o.off, o.sweep.way, o.period.energy)
    print(marched_damper(solution, one))
    for l in marched_loops(one, 4):
        print(l.point, l.energy, np.ptp(l.displacement), np.ptp(l.traction), l.limit.max())
    curve = solution.curves[0]
    for p in solution.numbered_peaks(curve):
        print(p, measures.damper_motion(curve.answer, solution.models["thesis"], p.sample))
        for l in measures.loops(curve.answer, p.sample, 4):
            print(l.point, l.energy, np.ptp(l.displacement), np.ptp(l.traction), l.limit.max())
    import upd.analyses.forced.charts

    for c in forced.ANALYSIS.checks(solution) if hasattr(forced.ANALYSIS, "checks") else []:
        print(c)
    assert 0
