"""Maxima of a path that no steady motion has, against an independent march."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from upd.analyses import forced, make_plan
from upd.analyses.forced import steady_peaks
from upd.analyses.forced.checks import check_solution
from upd.analyses.forced.curves import ForcedCurve
from upd.analyses.forced.measures import path_maxima
from upd.analyses.forced.mode_peaks import numbered_peaks
from upd.analyses.forced.paths import balance_with
from upd.analyses.forced.peaks_again import PathPeakAt
from upd.analyses.forced.results import make_results
from upd.analyses.forced.solution import ForcedSolution
from upd.analyses.forced.steady_peaks import HALF_POWER, LITTLE, with_steady_peaks
from upd.errors import ConvergenceError
from upd.hbm.march import steady_state
from upd.progress import Stages, silent
from upd.scene import load_scene

#: the pads' response at F_C/F_E 194 around its out-of-phase peak
SCENE = (
    "mesh.element=hex8i",
    'contact.stiffness=["thesis"]',
    "contact.columns=1",
    "reduction.modes=4",
    "balance.method=balance",
    "excitation.centrifugal_to_force=[194.0]",
    'want=["response"]',
    "left_out.solve=no",
    "accuracy=unknown",
)
OUT_OF_PHASE = (
    "balance.harmonics=5",
    "excitation.start=360 Hz",
    "excitation.stop=440 Hz",
    "excitation.points=40",
)
IN_PHASE = (
    "balance.harmonics=3",
    "excitation.start=285 Hz",
    "excitation.stop=305 Hz",
    "excitation.points=30",
)
#: the wedge's around its in-phase one, with a single harmonic
WEDGE = (
    "contact.columns=3",
    "balance.harmonics=1",
    "excitation.start=340 Hz",
    "excitation.stop=400 Hz",
    "excitation.points=40",
)


def _solved(*more: str) -> ForcedSolution:
    plan = make_plan(load_scene("asymmetric-response", [*SCENE, *more]))
    found: Any = forced.ANALYSIS.solve(plan, Stages(silent))
    assert isinstance(found, ForcedSolution)
    return found


@pytest.fixture(scope="module")
def out_of_phase() -> ForcedSolution:
    return _solved(*OUT_OF_PHASE)


@pytest.fixture(scope="module")
def in_phase() -> ForcedSolution:
    return _solved(*IN_PHASE)


def _marched(solution: ForcedSolution, curve: ForcedCurve, i: int) -> float:
    """Of another march, all modes implicit, what it keeps of the amplitude of both blades."""
    b, model = curve.answer.balance, solution.models["thesis"]
    found = steady_state(
        b, float(curve.frequency[i]), curve.answer.x[i], steps=256, most_periods=700, tolerance=1e-5
    )
    rows = [model.row(side) for side in curve.accelerance]
    scale = 1e-3 * (2.0 * np.pi * curve.frequency[i]) ** 2 / curve.force
    now = scale * np.array([found.amplitude(row) for row in rows])
    was = np.array([np.abs(H[i]) for H in curve.accelerance.values()])
    return float(np.linalg.norm(now) / np.linalg.norm(was))


def test_another_march_leaves_them_too(out_of_phase: ForcedSolution) -> None:
    (curve,) = out_of_phase.curves
    assert curve.left
    for one in curve.left:
        assert _marched(out_of_phase, curve, one.peak.sample) < HALF_POWER


def test_the_next_lower_steady_maximum_is_the_peak(out_of_phase: ForcedSolution) -> None:
    (curve,) = out_of_phase.curves
    model, size = out_of_phase.models["thesis"], np.abs(curve.accelerance["right"])
    by_height = numbered_peaks(model, curve.answer, size, 440.0)
    (highest,) = (one for one in by_height if one.number == 2)
    (told,) = (one for one in out_of_phase.numbered_peaks(curve) if one.number == 2)
    assert highest.sample in curve.left_points
    assert told.height < highest.height
    assert told.frequency == pytest.approx(421.4, abs=0.5)
    # its own top ends at a fold: a little below it on a flank both marches stay
    flank = np.flatnonzero((size > 0.9 * LITTLE * told.height) & (size < told.height))
    flank = flank[np.abs(curve.frequency[flank] - told.frequency) < 8.0]
    assert (
        max(_marched(out_of_phase, curve, int(i)) for i in flank[:: len(flank) // 6]) > HALF_POWER
    )


def test_a_peak_without_a_steady_motion_is_withheld(in_phase: ForcedSolution) -> None:
    (curve,) = in_phase.curves
    (one,) = {left.peak.number: left for left in curve.left if left.blade == "right"}.values()
    assert one.peak.number == 1
    assert not [p for p in in_phase.numbered_peaks(curve) if p.number == 1]
    results = {(r.name, r.case.mode): r for r in make_results(in_phase)}
    told = results["peak_1_frequency", "in phase"]
    assert "a march goes from 9" in told.withheld
    assert "reduction_of_free_peak" in {r.name for r in results.values() if r.withheld}
    (check,) = (c for c in check_solution(in_phase) if c.name == "maxima steady")
    assert not check.passed
    assert one.words in check.remedy


def test_the_reduction_is_that_of_the_steady_peak(out_of_phase: ForcedSolution) -> None:
    (curve,) = out_of_phase.curves
    free = replace(
        out_of_phase.linear["thesis"],
        free_peaks={
            s: [
                p._replace(height=400.0)
                for p in path_maxima(curve.frequency, np.abs(curve.accelerance[s]))[:1]
            ]
            for s in curve.accelerance
        },
    )
    solution = replace(out_of_phase, linear={"thesis": free})
    (told,) = (r for r in make_results(solution) if r.name == "reduction_of_free_peak")
    top = max(p.height for p in solution.numbered_peaks(curve))
    assert told.value == pytest.approx(100.0 * (1.0 - top / 400.0))
    bare = replace(solution, curves=[replace(curve, left=())])
    (other,) = (r for r in make_results(bare) if r.name == "reduction_of_free_peak")
    assert other.value < told.value
    # a path from the other end without a peak takes none from this one
    none = tuple(
        replace(curve.left[0], blade="right", peak=curve.left[0].peak._replace(sample=i))
        for i in range(len(curve.frequency))
    )
    both = replace(solution, curves=[curve, replace(curve, reversed=True, left=none)])
    (again,) = (r for r in make_results(both) if r.name == "reduction_of_free_peak")
    assert again.value == told.value


def test_a_peak_that_is_steady_with_more_harmonics_is_kept(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With one, the in-phase peak of the wedge is too far off for a march to stay at it."""
    plan = make_plan(load_scene("symmetric-response", [*SCENE, *WEDGE]))
    found: Any = forced.ANALYSIS.solve(plan, Stages(silent))
    (curve,), model = found.curves, found.models["thesis"]
    (told,) = (one for one in found.numbered_peaks(curve) if one.number == 1)
    assert not curve.left
    assert _marched(found, curve, told.sample) < HALF_POWER
    monkeypatch.setattr(steady_peaks, "MORE_HARMONICS", 0)
    alone = with_steady_peaks(plan, model, curve)
    assert told.sample in alone.left_points


def test_what_sticks_is_not_marched(
    out_of_phase: ForcedSolution, monkeypatch: pytest.MonkeyPatch
) -> None:
    (curve,) = out_of_phase.curves
    stuck = replace(curve.answer, state=np.zeros_like(curve.answer.state))
    stuck.state[:, :, 0] = 1.0

    def fail(*args: Any, **named: Any) -> Any:
        raise AssertionError("marched")

    monkeypatch.setattr(steady_peaks, "marched_on", fail)
    model = out_of_phase.models["thesis"]
    assert not with_steady_peaks(out_of_phase.plan, model, replace(curve, answer=stuck)).left


def test_a_march_that_fails_takes_no_peak_away(
    out_of_phase: ForcedSolution, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*args: Any, **named: Any) -> Any:
        raise ConvergenceError("no answer")

    monkeypatch.setattr(steady_peaks, "marched_on", fail)
    (curve,) = out_of_phase.curves
    model = out_of_phase.models["thesis"]
    assert not with_steady_peaks(out_of_phase.plan, model, replace(curve, left=())).left


def test_few_samples_carry_no_more_harmonics() -> None:
    """More of them are taken for the harmonics above, which errors are estimated with as well."""
    found = _solved(*OUT_OF_PHASE, "balance.harmonics=3", "balance.samples=8")
    model, curve = found.models["thesis"], found.curves[0]
    old = curve.answer.balance
    assert old.samples == 8
    assert balance_with(found.plan, model, curve.force, old, 5).samples == 128
    assert balance_with(found.plan, model, curve.force, old, 3).samples == 8
    peak = numbered_peaks(model, curve.answer, np.abs(curve.accelerance["right"]), 440.0)[-1]
    climbed = PathPeakAt(found.plan, model, curve, "right", peak).with_harmonics(5)
    assert climbed.found
    assert climbed.frequency == pytest.approx(peak.frequency, rel=0.03)
