"""Errors of a response's numbers by source: each bounds what a level far finer shows, and is not
made of nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from upd.analyses import forced, make_plan
from upd.analyses.forced import levels, marches_again, peaks_again
from upd.analyses.forced.companions import AXES, ModelMaker, OtherModel
from upd.analyses.forced.effects import HARMONICS, MODES, SAMPLES
from upd.analyses.forced.estimates import bound, estimate
from upd.analyses.forced.level_values import ForcedLevels, LevelValue
from upd.analyses.forced.marches_again import SweptPeakAt
from upd.analyses.forced.merged_points import Axis, merged, transfer
from upd.analyses.forced.peaks_again import ClimbedPeak, PathPeakAt, maxima_about
from upd.analyses.forced.solution import ForcedSolution
from upd.hbm import climb, contacts, frequency_response
from upd.hbm.interface_march import InterfaceMarch
from upd.hbm.interface_settle import SteadyPoint
from upd.progress import Stages, silent
from upd.results import ErrorPart, Estimates, Result
from upd.results.number import with_estimates
from upd.scene import load_scene
from upd.scene.base import LeftOut
from upd.scene.forced_contact import SIDES

pytestmark = pytest.mark.estimated

SCENE = [
    'want=["response"]',
    'balance.method="balance"',
    "balance.harmonics=1",
    "balance.samples=32",
    "excitation.start=432 Hz",
    "excitation.stop=452 Hz",
    "excitation.points=30",
    "left_out.solve=no",
]
SLIPS, STICKS = "excitation.centrifugal_to_force=[90.0]", "excitation.centrifugal_to_force=[1e5]"
MARCH = [
    "balance.method=march",
    "balance.samples=64",
    "excitation.start=440 Hz",
    "excitation.stop=446 Hz",
    "excitation.points=10",
    "excitation.centrifugal_to_force=[130.0]",
    'want=["response"]',
    "left_out.solve=no",
]


def solved(overrides: Sequence[str]) -> tuple[ForcedSolution, list[Result], Estimates]:
    plan = make_plan(load_scene("symmetric-response", overrides))
    solution: Any = forced.ANALYSIS.solve(plan, Stages(silent))
    assert isinstance(solution, ForcedSolution)
    numbers = forced.ANALYSIS.make_results(solution)
    return solution, numbers, estimate(solution, numbers, Stages(silent))


@pytest.fixture(scope="module")
def slipping(few_points: Sequence[str]) -> tuple[ForcedSolution, list[Result], Estimates]:
    return solved([*few_points, *SCENE, SLIPS])


def parts_of(found: tuple[ForcedSolution, list[Result], Estimates], name: str) -> Any:
    """Source -> part of the number of a curve with friction."""
    _, numbers, estimates = found
    one = next(r for r in numbers if r.name == name and not r.case.kind)
    return {part.source: part for part in estimates[one.name, one.case]}


def peak_at(solution: ForcedSolution) -> PathPeakAt:
    curve = solution.curves[0]
    peak = max(solution.numbered_peaks(curve), key=lambda one: one.height)
    return PathPeakAt(solution.plan, solution.models["thesis"], curve, "right", peak)


def bounded(part: ErrorPart, true: float, most: float) -> bool:
    """Whether the estimate bounds the error, and is no more than so many times it."""
    return true <= part.error <= most * true


def test_one_harmonic_tells_what_it_misses(few_points: Sequence[str]) -> None:
    """Against the highest maximum of a run with seven; the one that is climbed to from that of one
    harmonic is lower by a tenth.
    """
    scene = [*few_points, *SCENE, "excitation.centrifugal_to_force=[130.0]"]
    found, seven = solved(scene), solved([*scene, "balance.harmonics=7", "accuracy=unknown"])
    run, fine = peak_at(found[0]).top, peak_at(seven[0]).top
    true = abs(fine.height / run.height - 1.0)
    assert true > 0.01
    part = parts_of(found, "peak_2_accelerance")["harmonics"]
    assert bounded(part, true, 10.0)
    assert "5 harmonics" in part.basis
    moved = abs(fine.frequency / run.frequency - 1.0)
    assert bounded(parts_of(found, "peak_2_frequency")["harmonics"], moved, 10.0)


def test_few_samples_tell_what_they_miss(
    slipping: tuple[ForcedSolution, list[Result], Estimates],
) -> None:
    at = peak_at(slipping[0])
    run, fine = at.top, at.with_samples(32)
    true = abs(fine.height / run.height - 1.0)
    assert true > 1e-5
    part = parts_of(slipping, f"peak_{at.peak.number}_accelerance")["samples"]
    assert bounded(part, true, 10.0)


def test_few_modes_tell_what_they_miss(
    few_points: Sequence[str], slipping: tuple[ForcedSolution, list[Result], Estimates]
) -> None:
    """Against a run with forty modes, where four are kept."""
    _, numbers, _ = solved([*few_points, *SCENE, SLIPS, "reduction.modes=40", "accuracy=unknown"])
    for name in ("stuck_out_of_phase", f"peak_{peak_at(slipping[0]).peak.number}_frequency"):
        fine = next(r for r in numbers if r.name == name and not r.case.kind)
        run = next(r for r in slipping[1] if r.name == name and not r.case.kind)
        part = parts_of(slipping, name)["modes kept"]
        assert abs(fine.value / run.value - 1.0) <= part.error < 0.01


def test_the_top_is_the_highest_of_maxima_side_by_side(
    slipping: tuple[ForcedSolution, list[Result], Estimates], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of what the points of the path lead to, and climbed from again with short steps."""
    at = peak_at(slipping[0])
    i, answer = at.peak.sample, at.curve.answer
    size = float(np.abs(at.curve.accelerance["right"])[i])
    names = {float(answer.frequency[i + k]): 440.0 + k for k in (-1, 0, 1)} | {441.0: 450.0}
    heights = {439.0: 0.9, 440.0: 1.0, 441.0: 1.01, 450.0: 1.02}
    tried = []

    def climbed(self: PathPeakAt, b: Any, model: Any, start: Any) -> Any:
        tried.append((start.frequency, start.step))
        f = names.get(start.frequency, start.frequency)
        return [ClimbedPeak(f, heights[f] * size, 1.0, answer.x[i])]

    monkeypatch.setattr(PathPeakAt, "_climbed_from", climbed)
    for name in ("top", "_side_by_side"):
        at.__dict__.pop(name, None)
    assert at.top.frequency == 450.0
    close = peaks_again._CLOSE
    assert tried[3:] == [(441.0, close), (450.0, close)]
    left, _ = at.between_points("frequency")
    assert left == pytest.approx(abs(at.peak.frequency / 450.0 - 1.0))


def test_what_points_of_the_path_leave_is_the_peak_between_them(
    few_points: Sequence[str],
) -> None:
    """Where all sticks, against the peak of the linear answer, which is sought exactly."""
    wide = ["excitation.start=432 Hz", "excitation.stop=470 Hz", "excitation.points=16"]
    found = solved([*few_points, *SCENE, STICKS, *wide])
    solution = found[0]
    at = peak_at(solution)
    exact = next(p for p in solution.stuck_peaks("thesis") if p.number == at.peak.number)
    climbed = at.top
    assert climbed.frequency == pytest.approx(exact.frequency, rel=1e-5)
    assert climbed.height == pytest.approx(exact.height, rel=1e-6)
    part = parts_of(found, f"peak_{at.peak.number}_accelerance")["continuation"]
    true = abs(at.peak.height / exact.height - 1.0)
    assert true > 1e-6
    assert part.error == pytest.approx(true, rel=1e-3)
    parts = parts_of(found, "peak_2_accelerance")
    assert parts["harmonics"].error == 0.0 == parts["samples"].error
    assert "nothing slips" in parts["harmonics"].basis
    assert 0.0 < parts["mesh"].error < 0.5


def test_every_source_is_told_and_finite(
    slipping: tuple[ForcedSolution, list[Result], Estimates],
) -> None:
    _, numbers, estimates = slipping
    sources = ["mesh", "modes kept", "contact points", "harmonics", "samples", "continuation"]
    peaks = [r for r in numbers if "peak_" in r.name and not r.case.kind]
    named = [r for r in peaks if r.name.endswith(("_frequency", "_accelerance")) and not r.withheld]
    assert len(named) >= 4
    for one in named:
        parts = estimates[one.name, one.case]
        assert [part.source for part in parts] == sources
        assert all(math.isfinite(part.error) and part.error >= 0.0 for part in parts), parts
        assert all(part.basis and (part.half_cost_s or 0.0) >= 0.0 for part in parts)
    told = with_estimates(numbers, estimates)
    known = {r.name for r in told if r.estimated_error is not None}
    assert {"stuck_in_phase", "stuck_out_of_phase", *(one.name for one in named)} <= known


#: a second contact stiffness beside the thesis's, half of it
SOFT = [
    'contact.stiffness=["thesis", "soft"]',
    "stiffness.soft.K_N=0.78e6 N/mm",
    "stiffness.soft.K_T=2.45e5 N/mm",
]


def test_unknown_accuracy_solves_no_companion(
    few_points: Sequence[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """None without checks, which need one with more modes for the stiffness that they look at."""
    made: list[tuple[str, Any]] = []
    usual = ModelMaker.make

    def counted(self: ModelMaker, name: str, laws: Any, wanted: Any = None) -> Any:
        made.append((name, wanted))
        return usual(self, name, laws, wanted)

    monkeypatch.setattr(ModelMaker, "make", counted)
    scene = [*few_points, *SCENE, *SOFT, STICKS]
    assert make_plan(load_scene("symmetric-response", scene)).estimate_seconds > 0.0
    scene.append("accuracy=unknown")
    assert make_plan(load_scene("symmetric-response", scene)).estimate_seconds == 0.0
    solution, _, estimates = solved(scene)
    assert {curve.stiffness for curve in solution.curves} == {"thesis", "soft"}
    assert not made
    assert not estimates
    laws = {name: model.laws for name, model in solution.models.items()}
    with monkeypatch.context() as patch:
        # nothing is got ready for marches that nobody asks for
        patch.setattr(levels, "MarchQueue", None)
        assert levels.solve_levels(solution, laws, Stages(silent)) == ForcedLevels()
    checked = replace(solution.plan.scene, left_out=LeftOut(solve="yes"))
    found = levels.solve_levels(
        replace(solution, plan=replace(solution.plan, scene=checked)), laws, Stages(silent)
    )
    assert made == [("thesis", ("modes kept",))]
    assert {one.effect for one in found.checked} == {HARMONICS, SAMPLES, MODES}
    assert not found.values
    assert not found.told


def test_steps_of_a_march_tell_what_they_miss(few_points: Sequence[str]) -> None:
    """Against eight times the steps, at the frequency of the peak."""
    found = solved([*few_points, *MARCH])
    solution, numbers, _ = found
    told = [r for r in numbers if r.name.endswith("peak_2_accelerance") and not r.case.kind]
    assert {r.name for r in told} == {"peak_2_accelerance", "left_peak_2_accelerance"}
    sweep = max(solution.sweeps, key=lambda s: max(p.height for p in s.peaks["right"]))
    top = max(sweep.peaks["right"], key=lambda p: p.height)
    at = SweptPeakAt(solution.plan, sweep, "right", top)
    fine = at.read(at.with_steps(8))
    assert fine.settled
    parts = parts_of(found, "peak_2_accelerance")
    assert set(parts) == {"mesh", "modes kept", "contact points", "steps", "continuation"}
    # a motion is steady to a thousandth
    assert abs(fine.height - 1.0) <= parts["steps"].error + 1e-3
    assert parts["steps"].error < 0.2
    frequency = parts_of(found, "peak_2_frequency")
    assert abs(fine.frequency - 1.0) <= frequency["steps"].error + 1e-5


@pytest.mark.parametrize("left_branch", [0.25, -1.0])
def test_peaks_of_both_blades_are_read_from_one_march(
    few_points: Sequence[str], monkeypatch: pytest.MonkeyPatch, left_branch: float
) -> None:
    """At the point itself, and, where the motion left its branch, along the short sweep."""
    solution, _, _ = solved([*few_points, *MARCH])
    sweep = max(solution.sweeps, key=lambda s: max(p.height for p in s.peaks["right"]))
    top = max(sweep.peaks["right"], key=lambda p: p.height)
    right = SweptPeakAt(solution.plan, sweep, "right", top)
    height = float(np.abs(sweep.accelerance["left"][top.sample]))
    left = replace(right, side="left", peak=top._replace(height=height))
    monkeypatch.setattr(marches_again, "_LEFT_BRANCH", left_branch)
    alone = [at.read(at.with_steps(2)) for at in (right, left)]
    marches, settle = list[float](), marches_again.settle

    def counted(march: InterfaceMarch, *args: Any, **named: Any) -> SteadyPoint:
        marches.append(march.frequency)
        return settle(march, *args, **named)

    monkeypatch.setattr(marches_again, "settle", counted)
    again = right.with_steps(2)
    both = [at.read(again) for at in (right, left)]
    for one, other in zip(both, alone, strict=True):
        assert (one.frequency, one.height) == (other.frequency, other.height)
    # the short sweep goes over the frequency of the point once more
    assert len(set(marches[1:])) == len(marches[1:])
    assert (len(marches) > 1) == (left_branch < 0.0)


def level(size: float, ratio: float, order: float = 1.0) -> LevelValue:
    return LevelValue("x", "x", f"size {size:g}", size, ratio, 1.0, order)


def test_bounds_are_those_of_richardson() -> None:
    """q(h) = 1 + c h^p: coarser levels 3 c, a finer one c (1 - r^p) and three times the rest."""
    c = 0.01
    for order in (1.0, 2.0):
        q = {h: 1.0 + c * h**order for h in (0.5, 1.0, 2.0)}
        ratio = {h: value / q[1.0] for h, value in q.items()}
        error, _ = bound([level(2.0, ratio[2.0], order)])
        assert error == pytest.approx(3.0 * c / q[1.0])
        error, _ = bound([level(0.5, ratio[0.5], order)])
        rest = c * 0.5**order
        assert error == pytest.approx((c - rest + 3.0 * rest) / q[1.0])
    error, words = bound([level(0.5, math.nan)])
    assert math.isnan(error)
    assert "not found again" in words
    error, _ = bound([level(0.3, 1.1), level(0.2, 0.95)])
    assert error == pytest.approx(3.0 * 0.15)


@pytest.fixture(scope="module")
def stuck(few_points: Sequence[str]) -> ForcedSolution:
    """Every row of nodes, six columns of groups, three of half the rig; nothing slips."""
    rest = [o for o in few_points if not o.startswith(("contact.rows", "contact.columns"))]
    lines = ['contact.rows="all"', "contact.columns=6"]
    return solved([*rest, *lines, *SCENE, STICKS, "accuracy=unknown"])[0]


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("groups", [False, True], ids=["every second", "pairs"])
def test_fewer_lines_keep_totals_and_straight_motions(
    stuck: ForcedSolution, axis: Axis, groups: bool
) -> None:
    """Total stiffness and forces of a face stay, a rigid motion of the damper moves the points that
    are left as it moves their places, and forces and motions are carried over without loss.
    """
    model = stuck.models["thesis"]
    found = merged(model, axis, groups=groups)
    assert found is not None
    law, few = model.contacts.law, found.model.contacts.law
    for k, side in enumerate(SIDES):
        on, of = found.model.face == k, model.face == k
        assert 0 < on.sum() < of.sum()
        for name in ("k_n", "k_t", "preload"):
            assert getattr(few, name)[on].sum() == pytest.approx(getattr(law, name)[of].sum())
        face = found.model.faces[side]
        assert face.weight.sum() == pytest.approx(1.0)
        # along the normal and up the slope
        moved = np.einsum("fc,pcn->pfn", face.frame[[0, 2]], model.damper.motion(face.position))
        rows = found.model.damper_rows[on]
        np.testing.assert_allclose(rows, moved, atol=1e-12 * np.abs(rows).max())
    assert found.move.sum(axis=1) == pytest.approx(np.ones(len(found.move)))
    assert found.share.sum(axis=0) == pytest.approx(np.ones(found.share.shape[1]))
    if groups:
        move, share = transfer(found.model, model)
        assert found.share @ share == pytest.approx(np.eye(len(found.move)))
        assert found.move @ move == pytest.approx(np.eye(len(found.move)))


def test_every_second_row_shows_the_order_of_the_rule(stuck: ForcedSolution) -> None:
    """Turning stiffness of n rows by tributary areas exceeds that of a face by 1 + 2 / (n - 1)^2:
    second order.
    """
    model = stuck.models["thesis"]
    stiff, one = [], model
    for _ in range(3):
        face, k = one.faces["right"], one.contacts.law.k_n[one.face == 1]
        up = (face.position @ face.frame.T)[:, 2]
        up = up - k @ up / k.sum()
        stiff.append(float(k @ up**2 / k.sum()) * 12.0 / float(np.ptp(up)) ** 2)
        found = merged(one, "rows", groups=False)
        one = one if found is None else found.model
    assert stiff == pytest.approx([1.0 + 2.0 / n**2 for n in (4, 2, 1)], rel=1e-6)
    made = ModelMaker(stuck).make("thesis", model.laws, ("contact points",))
    told = {one.ladder: one for one in made if isinstance(one, OtherModel)}
    # what the elements on the contact give way falls slower
    assert (told["rows"].size, told["rows"].order) == pytest.approx((2.0, 1.0))


def test_rows_of_a_coarser_lattice_tell_what_finer_ones_show() -> None:
    """Stiff contacts: on one lattice half the rows are stiffer in tilt and yield more below each
    row, which hide each other.
    """
    rig = {
        "mesh.element": "hex8i",
        "geometry.refine": 0.5,
        "geometry.patch_along_y": 12,
        "contact.static": "frictionless",
        "contact.directions": "one",
        "stiffness.thesis.K_N": "1.12e7 N/mm",
        "stiffness.thesis.K_T": "4.4e6 N/mm",
        "contact.stiffness": ["thesis"],
        "balance.method": "balance",
        "excitation.centrifugal_to_force": [1e6],
        "excitation.points": 10,
        "want": ["response"],
        "left_out.solve": "no",
    }

    def of(**more: Any) -> ForcedSolution:
        plan = make_plan(load_scene("symmetric-response", rig | more))
        solution: Any = forced.ANALYSIS.solve(plan, Stages(silent))
        return solution  # type: ignore[no-any-return]

    def frequency(solution: ForcedSolution) -> float:
        modes = solution.linear["thesis"].modes
        return next(m.frequency for m in modes if m.axis == "x" and m.in_phase)

    run = of(**{"geometry.patch_along_slope": 8})
    fine = of(**{"geometry.patch_along_slope": 32, "accuracy": "unknown"})
    true = abs(frequency(fine) / frequency(run) - 1.0)
    numbers = forced.ANALYSIS.make_results(run)
    found = estimate(run, numbers, Stages(silent))
    key = next(k for k in found if k[0] == "stuck_in_phase")
    (part,) = (p for p in found[key] if p.source == "contact points")
    assert true <= part.error <= 5.0 * true


def test_the_highest_of_several_maxima_is_climbed_to(
    slipping: tuple[ForcedSolution, list[Result], Estimates], monkeypatch: pytest.MonkeyPatch
) -> None:
    """From all those of the run's path about its peak on other rows of points; on the same points
    from the very top, and from others that were higher than what is found. Further starts only
    where none gets anywhere.
    """
    solution = slipping[0]
    at, tried = peak_at(solution), list[tuple[float, float]]()
    assert at.top.x is not None
    first, f = at.top.frequency, at.curve.answer.frequency
    size = np.abs(at.curve.accelerance["right"])
    top = at.peak.sample
    beside = [top - 1, top + 1]
    heights = dict(zip((first, *f[beside]), (0.999 * size[top - 1], 160.0, 150.0), strict=True))

    def climbed(self: PathPeakAt, b: Any, model: Any, start: Any) -> Any:
        tried.append((start.frequency, start.step))
        height = heights.get(start.frequency)
        return [] if height is None else [ClimbedPeak(start.frequency, height, 0.0)]

    monkeypatch.setattr(PathPeakAt, "_climbed_from", climbed)
    at.__dict__["maxima"] = [top, *beside]
    made = ModelMaker(solution).make("thesis", solution.models["thesis"].laws)
    points, modes = (
        next(m for m in made if isinstance(m, OtherModel) and m.source == source)
        for source in ("contact points", "modes kept")
    )
    rows = replace(points, ladder=AXES[0])
    close = peaks_again._CLOSE
    assert close < 1.0
    every = [(first, close), *((one, 1.0) for one in f[beside])]
    assert at.on(rows, 1.0).height == 160.0
    assert tried == every
    tried.clear()
    # the one before was higher than what the top leads to
    assert at.on(modes, 1.0).height == 160.0
    assert tried == every[:2]
    tried.clear()
    heights[first] = 1.001 * size[top - 1]
    assert at.on(modes, 1.0).height == heights[first]
    assert tried == every[:1]
    tried.clear()
    heights.clear()
    heights[f[top + 2]] = 130.0
    further = peaks_again.ClimbStart(at.curve.answer.x[0], float(f[top + 2]), float(first))
    monkeypatch.setattr(PathPeakAt, "_band", lambda *_: iter([further]))
    assert at.on(rows, 1.0).height == 130.0
    assert len(tried) > len(every)


def test_a_peak_far_from_where_it_is_expected_is_another(
    slipping: tuple[ForcedSolution, list[Result], Estimates],
) -> None:
    at = peak_at(slipping[0])
    i, answer = at.peak.sample, at.curve.answer
    f = float(answer.frequency[i])
    for about, found in ((f, 1), (1.02 * f, 1), (1.05 * f, 0), (0.95 * f, 0)):
        start = peaks_again.ClimbStart(answer.x[i], f, about)
        assert len(at._climbed_from(answer.balance, at.model, start)) == found


def test_maxima_side_by_side_are_told_of_a_frequency(
    slipping: tuple[ForcedSolution, list[Result], Estimates], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is climbed to from the points beside the peak's own counts where it is no lower."""
    at = peak_at(slipping[0])
    top, f = at.peak.sample, at.curve.answer.frequency
    size = float(np.abs(at.curve.accelerance["right"])[top])
    usual, why = at.between_points("frequency")
    assert "side by side" not in why
    found = {
        float(f[top - 1]): ClimbedPeak(0.99 * at.top.frequency, 0.999 * size, 0.0),
        float(f[top + 1]): ClimbedPeak(1.002 * at.top.frequency, size, 0.0),
    }
    own = at.top
    monkeypatch.setattr(
        PathPeakAt, "_climbed_from", lambda self, b, model, at: [found.get(at.frequency, own)]
    )
    del at.__dict__["_side_by_side"]
    left, why = at.between_points("frequency")
    assert left == pytest.approx(abs(at.peak.frequency / (1.002 * at.top.frequency) - 1.0))
    assert left > 5.0 * usual
    assert "maxima side by side at" in why


def test_maxima_about_a_peak_are_those_nearly_as_high() -> None:
    """Maxima of 1, 3/4, 8/10 and half the height, and one far in frequency."""
    f, size = np.linspace(400.0, 404.0, 60), np.full(60, 0.1)
    size[[20, 30, 36, 45]] = 1.0, 0.75, 0.8, 0.5
    size[55], f[52:] = 0.9, np.linspace(420.0, 421.0, 8)
    assert maxima_about(f, size, 20) == [20, 36, 30]
    assert maxima_about(f, size, 45) == [45, 20, 36, 30]


def test_the_peak_of_an_acceleration_is_climbed_to() -> None:
    """|w^2 u| of a damped oscillator is highest at w0 / sqrt(1 - 2 zeta^2), |u| at
    w0 sqrt(1 - 2 zeta^2).
    """
    zeta = 0.1
    stuck = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=1e-9, mu=1.0, preload=1.0)
    answer = frequency_response(
        [[1.0]],
        [[2.0 * zeta]],
        [[1.0]],
        stuck,
        harmonic_force=[1.0],
        frequencies=np.array([0.16]),
        harmonics=(1,),
    )
    w = math.sqrt(1.0 - 2.0 * zeta**2)
    for power, expected in ((0, w), (2, 1.0 / w)):
        top = climb(answer.balance, [1.0], answer.x[0], 0.16, power=power)
        assert top.found
        assert 2.0 * math.pi * top.frequency == pytest.approx(expected, rel=1e-5)
        assert top.amplitude == pytest.approx(
            1.0 / math.hypot(1 - expected**2, 2 * zeta * expected)
        )


def test_a_reduction_has_the_errors_of_both_peaks(few_points: Sequence[str]) -> None:
    """R = 100 (1 - h / free): dR / R = (h / free) / (1 - h / free) (dh / h + dfree / free)."""
    found = solved(
        [*few_points, *SCENE, STICKS, "excitation.start=285 Hz", "excitation.stop=470 Hz"]
    )
    _, numbers, estimates = found
    one = next(r for r in numbers if r.name == "reduction_of_free_peak")
    heights = [r for r in numbers if r.name.endswith("_accelerance") and "left" not in r.name]
    top = max((r for r in heights if r.case.force_ratio), key=lambda r: r.value)
    free = next(r for r in heights if r.case.kind == "free")
    mesh = [
        next(p.error for p in estimates[r.name, r.case] if p.source == "mesh")
        for r in (one, top, free)
    ]
    share = top.value / free.value
    assert one.value == pytest.approx(100.0 * (1.0 - share))
    assert mesh[0] == pytest.approx(share / (1.0 - share) * (mesh[1] + mesh[2]))
