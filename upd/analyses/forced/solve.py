"""Forced responses: for every contact stiffness the reduced model, for every F_C/F_E the curve with
friction; what was asked for beside.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.bands import solve_band
from upd.analyses.forced.curves import ForcedCurve
from upd.analyses.forced.faces_curve import solve_faces
from upd.analyses.forced.left_out import solve_again
from upd.analyses.forced.levels import solve_levels
from upd.analyses.forced.linear_limits import linear_limits_of
from upd.analyses.forced.march_queue import MarchQueue
from upd.analyses.forced.marched_peaks import march_peaks
from upd.analyses.forced.marching import Marching
from upd.analyses.forced.model import make_model
from upd.analyses.forced.paths import STARTS, grid, peak_again, respond
from upd.analyses.forced.performance import beside_branches, follow_peaks
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.solution import ForcedSolution, PeakAgain, TimeMarch
from upd.analyses.forced.statics import StaticState, static_state
from upd.analyses.forced.steady_peaks import with_steady_peaks
from upd.analyses.forced.stiffness import face_laws
from upd.analyses.forced.sweeps import run_sweeps
from upd.analyses.forced.whole_faces import INTERFACE, linear_limits, make_whole_faces
from upd.analyses.seated.bodies import Bodies, make_bodies
from upd.hbm.march import steady_state
from upd.linalg.parallel import threads_for
from upd.progress import Stages
from upd.scene.forced_contact import SIDES

HARMONICS = (1, 3, 5)


def solve(plan: ForcedPlan, stages: Stages) -> ForcedSolution:
    """Run everything the plan calls for.

    An error raised on the way carries what converged so far as ``partial``.
    """
    solution = ForcedSolution(plan)
    try:
        scene = plan.scene
        if scene.contact.model == INTERFACE:
            _whole_faces(solution, stages)
            return solution
        laws = {name: face_laws(choice, stages) for name, choice in scene.stiffnesses.items()}
        with stages("mesh and assembly", f"both blades and the {scene.arrangement} damper"):
            solution.bodies = make_bodies(plan)
        for name, law in laws.items():
            with stages("reduction", f"{name}: {scene.reduction.modes} modes a blade"):
                state = _static(plan, solution.bodies, stages)
                solution.models[name] = make_model(plan, solution.bodies, law, state)
        nodes = max(one.contacts.n_point for one in solution.models.values())
        with MarchQueue(nodes) as queue:
            marching = Marching(solution, queue)
            for name in laws:
                for ratio in scene.excitation.centrifugal_to_force:
                    _curve(solution, name, ratio, stages)
                    if scene.balance.method != "balance":
                        _begin_marches(marching, name, ratio, stages)
            if scene.left_out.solves:
                solution.omissions = solve_again(solution, laws, stages)
            marching.finish(stages)
            # What is asked for beside the curves: for the first stiffness.
            _more(solution, next(iter(laws)), marching, stages)
        solution.levels = solve_levels(solution, laws, stages)
    except BaseException as error:
        error.partial = solution  # type: ignore[attr-defined]
        raise
    return solution


def _whole_faces(solution: ForcedSolution, stages: Stages) -> None:
    """Free and stuck curves, balance and sweeps of both faces node by node."""
    plan = solution.plan
    with stages("mesh and assembly", f"both blades and the {plan.scene.arrangement} damper"):
        solution.bodies = make_bodies(plan)
    faces = make_whole_faces(plan, solution.bodies, stages)
    solution.faces[INTERFACE] = faces
    with stages("free and stuck", f"{faces.of.n} nodes"):
        solution.linear[INTERFACE] = linear_limits(plan, faces, grid(plan))
    run_sweeps(solution, solve_faces(solution, INTERFACE, stages), stages)
    march_peaks(solution, stages)


def _begin_marches(marching: Marching, name: str, ratio: float, stages: Stages) -> None:
    """Sweeps of the curves where points move, and of the first stiffness those from every other
    static state and those of the performance curve where they are asked for.
    """
    solution = marching.solution
    scene, first = solution.plan.scene, next(iter(solution.models))
    marching.begin(name, ratio, stages, band=name == first and scene.wants("band"))
    curve = _first_curve(solution, first)
    begun = marching.performance is not None or curve is None
    if not begun and scene.wants("performance") and _swept_performance(solution.plan):
        assert curve is not None
        marching.begin_performance(curve)


def _first_curve(solution: ForcedSolution, name: str) -> ForcedCurve | None:
    """The longest of a stiffness at the first F_C/F_E, where one has a point."""
    ratio = solution.plan.scene.excitation.centrifugal_to_force[0]
    first = [c for c in solution.curves if (c.stiffness, c.ratio) == (name, ratio) and not c.empty]
    return max(first, key=lambda c: float(np.ptp(c.answer.frequency)), default=None)


def _static(plan: ForcedPlan, bodies: Bodies, stages: Stages) -> StaticState | None:
    """The scene's static state, where the faces fit under it."""
    if not plan.scene.contact.loaded:
        return None
    return static_state(plan, bodies, stages=stages)


def _curve(solution: ForcedSolution, name: str, ratio: float, stages: Stages) -> None:
    plan, model = solution.plan, solution.models[name]
    force = plan.scene.damper.centrifugal / ratio
    frequencies = grid(plan)
    if plan.scene.balance.method == "march":
        # the sweeps begin from it; the linear limits need no more
        frequencies = frequencies[:1]
    detail = (
        f"{name}, F_C/F_E {ratio:g}: {model.contacts.n_point} points, "
        f"{len(frequencies)} frequencies"
    )
    for down in (False, True):
        with stages("friction", f"{detail}{', downwards' * down}"):
            begin = time.perf_counter()
            answer = respond(plan, model, force, frequencies, sweep_down=down)
            took = time.perf_counter() - begin
            blades = {side: measures.accelerance(answer, model.row(side), force) for side in SIDES}
        curve = ForcedCurve(name, ratio, force, answer, blades, took, down)
        if (answer.state[:, :, 1:] > 0.0).any():
            with stages("steady peaks", f"{name}, F_C/F_E {ratio:g}: marches from the maxima"):
                curve = with_steady_peaks(plan, model, curve)
        solution.curves.append(curve)
        # What a path that stopped leaves unknown is swept, or may be reached from the other end.
        if answer.arrived or plan.scene.balance.method != "balance":
            break
    if name not in solution.linear:
        with stages("free and stuck", name), threads_for(len(model.M)):
            solution.linear[name] = linear_limits_of(plan, model, answer, force)


def _more(solution: ForcedSolution, name: str, marching: Marching, stages: Stages) -> None:
    """Time march, spread over slider starts, convergence in harmonics, performance.

    What was asked for, at the first F_C/F_E; the band of every curve.
    """
    plan, curve = solution.plan, _first_curve(solution, name)
    if curve is None:
        return
    for f in plan.scene.balance.time_march:
        with stages("time march", f"{curve.case}, {f:g} Hz"):
            solution.marches += _march(curve, f)
    if plan.scene.wants("band"):
        for one in (c for c in solution.curves if c.stiffness == name and not c.reversed):
            with stages("band", one.case.label):
                solution.bands.append(solve_band(solution, one, stages))
    if plan.scene.wants("spread"):
        with stages("spread", curve.case.label):
            solution.spreads[name] = _followed(solution, curve, ((s, {"start": s}) for s in STARTS))
    if plan.scene.wants("harmonics"):
        with stages("harmonics", curve.case.label):
            solution.harmonics[name] = _followed(
                solution, curve, ((f"{h}", {"harmonics": range(h + 1)}) for h in HARMONICS)
            )
    if marching.performance is not None:
        solution.performances[name] = marching.performance.finish(stages)
    elif plan.scene.wants("performance"):
        linear = solution.linear[name]
        with stages("performance", curve.stiffness):
            found = follow_peaks(plan, solution.models[name], curve, linear)
        mine = [one for one in solution.curves if one.stiffness == name]
        solution.performances[name] = beside_branches(found, mine)


def _swept_performance(plan: ForcedPlan) -> bool:
    """Whether points that move are marched; faces that fit without load are not at rest before."""
    return plan.scene.balance.method != "balance" and plan.scene.contact.loaded


def _march(curve: ForcedCurve, f: float) -> list[TimeMarch]:
    """Time integration from the answer at f, when the path reached it."""
    a = curve.answer
    i = int(np.argmin(np.abs(a.frequency - f)))
    if abs(a.frequency[i] - f) > np.sqrt(np.finfo(float).eps) * f:
        return []
    return [
        TimeMarch(
            curve, f, float(abs(curve.accelerance["right"][i])), steady_state(a.balance, f, a.x[i])
        )
    ]


def _followed(
    solution: ForcedSolution, curve: ForcedCurve, choices: Iterable[tuple[str, dict[str, Any]]]
) -> list[PeakAgain]:
    """The right blade's peak again in a band around it, with each choice."""
    model = solution.models[curve.stiffness]
    at = curve.answer.frequency[measures.peak_index(curve.answer, model.row("right"))]
    return [
        peak_again(solution.plan, model, curve.force, at, choice, **change)
        for choice, change in choices
    ]
