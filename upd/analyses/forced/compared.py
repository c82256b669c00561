"""The computed curves of a forced response that stand beside a measured one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from upd.analyses import measured
from upd.analyses.forced import measures
from upd.analyses.forced.curves import FrictionCurve
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.march_modes import linear_curves
from upd.analyses.forced.mode_peaks import unmoved
from upd.analyses.forced.model import Array, ComplexArray
from upd.analyses.forced.paths import balance_of
from upd.analyses.forced.solution import ForcedSolution
from upd.analyses.measured import FREE, STUCK, Computed
from upd.measured.compare import on_path
from upd.measured.curve import LEAST_POINTS
from upd.results import Case, Result
from upd.scene.forced_contact import Side
from upd.scene.measured import MeasuredChoice


def measured_results(solution: ForcedSolution) -> list[Result]:
    """Every measured curve beside the computed ones of its blade and state."""
    scene = solution.plan.scene
    return measured.measured_results(
        scene.measured,
        lambda choice: list(_computed(solution, choice)),
        lambda choice: _nothing(solution, choice),
        scene.excitation.damping,
    )


def _nothing(solution: ForcedSolution, choice: MeasuredChoice) -> str:
    """Why nothing stands beside a measured curve."""
    if choice.state is not None:
        return (
            f"the {choice.blade} blade is at rest without the damper"
            if choice.state == FREE
            else "the run has no stuck curve"
        )
    ratios = ", ".join(f"{r:g}" for r in solution.plan.scene.excitation.centrifugal_to_force)
    return (
        f"the run has no curve at F_C/F_E {choice.centrifugal_to_force:g}, it has {ratios}; add it "
        "to excitation.centrifugal_to_force"
    )


def _computed(solution: ForcedSolution, choice: MeasuredChoice) -> Iterator[Computed]:
    """The computed curves of the blade and state of a measured one."""
    side, scene = choice.blade, solution.plan.scene
    if choice.state is not None:
        stuck = choice.state == STUCK
        if not stuck and side not in excitation_of(scene.excitation).free_blades:
            return
        for name, linear in solution.linear.items():
            told = solution.stuck_peaks(name, side) if stuck else unmoved(linear.free_peaks[side])
            case = Case(stiffness=name, kind=choice.state, blade=side)
            band = (scene.excitation.start, scene.excitation.stop)
            yield Computed(case, band, _linear_at(solution, name, side, stuck), told)
        return
    curves: list[FrictionCurve] = [*solution.curves, *solution.balanced, *solution.sweeps]
    # as the labels of curves tell them apart
    wanted = f"{choice.centrifugal_to_force:.6g}"
    for c in curves:
        if f"{c.ratio:.6g}" == wanted and len(c.frequency) >= LEAST_POINTS:
            yield _with_friction(c, side)


def _linear_at(
    solution: ForcedSolution, name: str, side: Side, stuck: bool
) -> Callable[[Array], ComplexArray]:
    """Accelerance of a blade free or stuck, exact at any frequency."""
    if name in solution.faces:
        excitation = excitation_of(solution.plan.scene.excitation)
        march = solution.faces[name].march
        return lambda f: np.asarray(linear_curves(march, f, excitation, stuck=stuck)[0][side])
    model, plan = solution.models[name], solution.plan
    force = plan.scene.damper.centrifugal
    numbers = (0, *model.excitation.harmonics)
    problem, row = measures.Unsolved(balance_of(plan, model, force, numbers)), model.row(side)
    return lambda f: measures.linear_accelerance(problem, row, force, f, stuck)


def _with_friction(c: FrictionCurve, side: Side) -> Computed:
    """A curve with friction, between its points by straight lines."""
    f, H = c.frequency, c.accelerance[side]  # type: ignore[attr-defined]
    way = slice(None) if f[-1] > f[0] else slice(None, None, -1)
    f, H = f[way], H[way]
    peaks = c.peaks.get(side, ())  # type: ignore[attr-defined]
    return Computed(
        replace(c.case, blade=side),  # type: ignore[attr-defined]
        (float(f.min()), float(f.max())),
        lambda at: on_path(at, f, H),
        list(peaks),
    )
