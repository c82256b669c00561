"""Errors of a response's numbers by source: each bounds what a level far finer shows, and is not
made of nothing.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rigs import LINES

from upd.analyses import forced, make_plan
from upd.analyses.forced import peaks_again
from upd.analyses.forced import solve as solving
from upd.analyses.forced.accuracy import bound, estimate
from upd.analyses.forced.curves import PointCurve, Top
from upd.analyses.forced.levels import HARMONICS, MESH, MODES, POINTS, SAMPLES
from upd.analyses.forced.model import make_model
from upd.analyses.forced.peaks import climbed
from upd.analyses.forced.peaks_again import (
    FoundPeaks,
    Variant,
    carried,
    moved_points,
    peak_on,
    run_peaks,
    solve_again,
)
from upd.analyses.forced.solution import ForcedSolution
from upd.analyses.forced.stiffness import face_laws
from upd.analyses.seated.bodies import make_bodies
from upd.errors import ConvergenceError
from upd.hbm import climb, contacts, frequency_response
from upd.progress import Stages, silent
from upd.results import ErrorPart, Estimates, Result
from upd.results.number import with_estimates
from upd.scene import load_scene
from upd.scene.forced_contact import SIDES
from upd.vary.variation import Variation

pytestmark = pytest.mark.estimated

#: three rows of Gauss points, one tangent a point
RIG: dict[str, Any] = {
    **LINES,
    "contact.rule": "gauss",
    "contact.rows": 3,
    "contact.columns": 2,
    "contact.directions": "one",
    "mesh.element": "hex8i",
    "reduction.modes": 4,
    "balance.harmonics": 3,
    "balance.samples": 64,
    "excitation.start": "435 Hz",
    "excitation.stop": "460 Hz",
    "excitation.points": 30,
    "want": ["response"],
    "left_out.solve": "no",
}
#: F_C/F_E at which some points slip, and at which all stick
SLIPS, STICKS = 240.0, 1e5
Found = tuple[ForcedSolution, list[Result], Estimates]


def solved(ratio: float, **more: Any) -> Found:
    changes = {key.replace("__", "."): value for key, value in more.items()}
    scene = RIG | {"excitation.centrifugal_to_force": [ratio]} | changes
    plan = make_plan(load_scene("symmetric-response", scene))
    solution: Any = forced.ANALYSIS.solve(plan, Stages(silent))
    assert isinstance(solution, ForcedSolution)
    numbers = forced.ANALYSIS.make_results(solution)
    return solution, numbers, estimate(solution, numbers, Stages(silent))


@pytest.fixture(scope="module")
def slipping() -> Found:
    return solved(SLIPS)


@pytest.fixture(scope="module")
def sticking() -> Found:
    return solved(STICKS)


def searched(solution: ForcedSolution) -> FoundPeaks:
    """What is looked for again."""
    found = tuple(peak for curve in solution.curves for peak in run_peaks(curve))
    return FoundPeaks(solution.plan, solution.models["thesis"], solution.linear["thesis"], found)


def parts_of(found: Found, name: str) -> dict[str, ErrorPart]:
    """Source -> part of the number of a curve with friction."""
    one = number(found, name)
    return {part.source: part for part in found[2][one.name, one.case]}


def number(found: Found, name: str) -> Result:
    return next(r for r in found[1] if r.name == name and not r.case.kind)


def top_of(found: Found) -> Top:
    return found[0].curves[0].tops["right", 2]


def bounded(part: ErrorPart, true: float, most: float) -> bool:
    """Whether the estimate bounds the error, and is no more than so many times it."""
    return true <= part.error <= most * true


# -- bounds ----------------------------------------------------------------------------------------


def level(source: str, size: float) -> Variation:
    return Variation(source, f"size {size:g}", size=size)


def meshes(q: Any) -> tuple[float, str]:
    """The bound of a mesh from coarser ones, on which a number is q(size)."""
    return bound(MESH, [(level(MESH, h), q(h) / q(1.0)) for h in (4.0 / 3.0, 2.0)])


@pytest.mark.parametrize("order", [1.0, 1.2, 1.5, 2.0])
@pytest.mark.parametrize("C", [0.02, -0.02])
def test_levels_that_show_an_order_bound_the_error(order: float, C: float) -> None:
    """q(h) = q0 (1 + C h^p): C of q0 is the error of the run."""
    error, words = meshes(lambda h: 1.0 + C * h**order)
    true = abs(C / (1.0 + C))
    assert true <= error < 3.0 * true
    assert f"order {order:.1f}" in words


def test_an_order_of_coarse_meshes_is_taken_as_that_of_edges() -> None:
    """Of h^4 a change says less than of h^1.09."""
    error, words = meshes(lambda h: 1.0 + 0.01 * h**4)
    assert "taken as 1.1 of re-entrant edges" in words
    assert error > 1.25 * 0.01 / 1.01
    change = 0.01 * ((4.0 / 3.0) ** 4 - 1.0) / 1.01
    assert error == pytest.approx(1.25 * change / ((4.0 / 3.0) ** 1.089 - 1.0), rel=1e-9)


def test_levels_in_no_order_tell_their_range() -> None:
    values = {1.0: 1.0, 4.0 / 3.0: 1.02, 2.0: 0.99}
    error, words = meshes(values.__getitem__)
    assert error == pytest.approx(1.25 * 0.03)
    assert "range" in words


def test_two_meshes_are_taken_as_of_the_order_of_edges() -> None:
    error, words = bound(MESH, [(level(MESH, 2.0), 1.03)])
    assert error == pytest.approx(1.25 * 0.03 / (2.0**1.089 - 1.0))
    assert "order 1.1 of re-entrant edges, two levels" in words


def test_other_sources_tell_the_change_of_their_levels() -> None:
    points = [(level(POINTS, 2.0 / 3.0), 1.1), (level(POINTS, 0.5), 0.95)]
    assert bound(POINTS, points)[0] == pytest.approx(2.0 * 0.15)
    assert bound(HARMONICS, [(level(HARMONICS, 0.6), 0.96)])[0] == pytest.approx(1.25 * 0.04)
    assert bound(MODES, [(level(MODES, 2.0), 1.001)])[0] == pytest.approx(0.001)
    # q(h) = 1 + C h^2, of the run h = 1 and of the level 1/2
    error, _ = bound(SAMPLES, [(level(SAMPLES, 0.5), 1.0025 / 1.01)])
    assert error == pytest.approx(0.01 / 1.01)


@pytest.mark.parametrize("order", [1.0, 1.3, 2.0, 3.0])
def test_more_contact_points_bound_an_error_of_any_order(order: float) -> None:
    """q(h) = 1 + C h^p, of the run h = 1, 8 and 10 rows for 5."""
    sizes = (5.0 / 8.0, 0.5)
    found = [(level(POINTS, s), (1.0 + 0.03 * s**order) / 1.03) for s in sizes]
    error, _ = bound(POINTS, found)
    assert (1.0 - 1e-12) * 0.03 / 1.03 <= error <= 2.0 * 0.03


# -- against far finer levels ----------------------------------------------------------------------


def test_every_source_is_told_and_finite(slipping: Found) -> None:
    _, numbers, estimates = slipping
    sources = [MESH, MODES, POINTS, HARMONICS, SAMPLES]
    peaks = [r for r in numbers if "peak_" in r.name and not r.case.kind]
    named = [r for r in peaks if r.name.endswith(("_frequency", "_accelerance")) and not r.withheld]
    assert len(named) >= 4
    for one in named:
        parts = estimates[one.name, one.case]
        assert [part.source for part in parts] == sources
        assert all(math.isfinite(part.error) and part.error >= 0.0 for part in parts), parts
        assert all(part.basis for part in parts)
    told = with_estimates(numbers, estimates)
    known = {r.name for r in told if r.estimated_error is not None}
    assert {"stuck_in_phase", "stuck_out_of_phase", *(one.name for one in named)} <= known


def test_a_mesh_tells_what_a_far_finer_one_shows() -> None:
    """The ready scene's, against twice the elements along every edge."""
    ready = load_scene("symmetric-response").geometry
    own = {f"geometry__{key}": ready[key] for key in ready if f"geometry.{key}" in LINES}
    run = solved(STICKS, **own)
    fine = solved(STICKS, **own, geometry__refine=2, accuracy="unknown")
    for name in ("stuck_out_of_phase", "stuck_in_phase", "peak_2_frequency"):
        true = abs(number(fine, name).value / number(run, name).value - 1.0)
        assert true > 1e-3
        # the finer mesh leaves an error too: a quarter of this one's to a half
        assert bounded(parts_of(run, name)[MESH], true, 4.0)


def test_few_harmonics_tell_what_they_miss(slipping: Found) -> None:
    """Against the highest maximum of a run with nine."""
    fine = solved(SLIPS, balance__harmonics=9, accuracy="unknown")
    true = abs(top_of(fine).height / top_of(slipping).height - 1.0)
    assert true > 1e-4
    assert bounded(parts_of(slipping, "peak_2_accelerance")[HARMONICS], true, 10.0)


def test_few_samples_tell_what_they_miss(slipping: Found) -> None:
    fine = solved(SLIPS, balance__samples=1024, accuracy="unknown")
    true = abs(top_of(fine).height / top_of(slipping).height - 1.0)
    assert true > 1e-6
    assert bounded(parts_of(slipping, "peak_2_accelerance")[SAMPLES], true, 10.0)


def test_few_modes_tell_what_they_miss() -> None:
    """Against forty modes a blade, on lines of nodes: loads of Gauss points leave modes nothing."""
    run = solved(STICKS, contact__rule="lines", reduction__modes=10)
    fine = solved(STICKS, contact__rule="lines", reduction__modes=40, accuracy="unknown")
    for name in ("stuck_out_of_phase", "stuck_in_phase"):
        true = abs(number(fine, name).value / number(run, name).value - 1.0)
        assert true > 1e-5
        assert bounded(parts_of(run, name)[MODES], true, 20.0)


def test_contact_points_tell_what_many_more_show(slipping: Found) -> None:
    fine = solved(SLIPS, contact__rows=12, accuracy="unknown")
    true = abs(top_of(fine).height / top_of(slipping).height - 1.0)
    assert true > 1e-4
    assert bounded(parts_of(slipping, "peak_2_accelerance")[POINTS], true, 10.0)


def test_a_height_is_known_no_better_than_its_frequency(sticking: Found) -> None:
    """By its meshes: heights of few meshes may agree by chance."""
    for blade in ("", "left_"):
        f, height = (
            parts_of(sticking, f"{blade}peak_2_{word}")[MESH]
            for word in ("frequency", "accelerance")
        )
        assert height.error >= f.error > 0.0


def test_where_a_top_leaves_levels_are_taken_to_the_border(
    slipping: Found, monkeypatch: pytest.MonkeyPatch
) -> None:
    solution = slipping[0]
    (curve,), peaks = solution.curves, searched(solution)
    top, key = top_of(slipping), ("right", 2)
    assert top.slips and curve.stayed("right", 2) is None
    assert curve.compared("right", 2) == (top.frequency, top.height)
    check = replace(
        next(c for c in curve.checked if (c.blade, c.number) == key),
        frequency=0.998 * top.frequency,
        integrated=0.9 * top.height,
        sample=3,
    )
    leaves = replace(curve, checked=(check,))
    assert leaves.compared("right", 2) == (check.frequency, check.integrated)
    seen: list[PointCurve] = []

    def confirmed(plan: Any, model: Any, path: PointCurve, like: Any) -> PointCurve:
        """Half of every height."""
        seen.append(path)
        lower = {s: tuple(p._replace(height=0.5 * p.height) for p in path.peaks[s]) for s in SIDES}
        return replace(path, peaks=lower)

    monkeypatch.setattr(peaks_again, "confirmed", confirmed)
    run, off = (next(p for p in run_peaks(c) if p.number == 2) for c in (curve, leaves))
    found = peak_on(peaks, peaks.model, peaks.linear, off, None)
    assert found.frequency == pytest.approx(top.frequency, rel=1e-3)
    assert found.height == pytest.approx(0.5 * top.height, rel=1e-3)
    assert len(seen) == 1
    found = peak_on(peaks, peaks.model, peaks.linear, run, None)
    assert found.height == pytest.approx(top.height, rel=1e-3)
    assert len(seen) == 1
    # a band that misses the top by ten times its width: the whole sweep has it, at one of the
    # maxima side by side of this flat top
    assert top.crowded
    monkeypatch.setattr(peaks_again, "BAND", 1e-4)
    found = peak_on(peaks, peaks.model, peaks.linear, off, None)
    assert found.height == pytest.approx(0.5 * top.height, rel=1e-2)


def test_where_all_sticks_the_peak_is_that_of_the_linear_answer(sticking: Found) -> None:
    solution = sticking[0]
    exact = next(p for p in solution.linear["thesis"].stuck_peaks["right"] if p.number == 2)
    assert (top_of(sticking).frequency, top_of(sticking).height) == (exact.frequency, exact.height)
    assert not top_of(sticking).slips
    # nothing slips: neither harmonics nor samples leave anything
    assert set(parts_of(sticking, "peak_2_accelerance")) == {MESH, MODES, POINTS}


def test_a_level_that_fails_leaves_only_its_part(
    slipping: Found, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The run goes on, and says why this part of the error is not known."""

    def fails(*_: Any, **__: Any) -> Any:
        raise ConvergenceError("no motion was found")

    solution, numbers, estimates = slipping
    (name, known), peaks = next(iter(solution.levels.items())), searched(solution)
    for function in ("found_again", "peak_on"):
        monkeypatch.setattr(peaks_again, function, fails)
    variants = (
        Variant(Variation(HARMONICS, "2 harmonics more"), plan=peaks.plan),
        Variant(Variation(MODES, "2 modes a blade", size=2.0), peaks.model),
    )
    failed = {one.of.source: solve_again(peaks, one) for one in variants}
    mixed = [failed.get(one.of.source, one) for one in known]
    again = estimate(replace(solution, levels={name: mixed}), numbers, Stages(silent))
    one = number(slipping, "peak_2_accelerance")
    was, now = ({p.source: p for p in found[one.name, one.case]} for found in (estimates, again))
    for source, part in now.items():
        if source in failed:
            assert math.isnan(part.error)
            assert part.basis == "not estimated: no motion was found"
        else:
            assert part == was[source]
    assert set(now) == set(was)


def test_a_wanted_accuracy_unknown_solves_no_level(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*args: Any) -> Any:
        raise AssertionError("solved")

    for name in ("level_variations", "make_variant", "solve_again"):
        monkeypatch.setattr(solving, name, never)
    plan = make_plan(load_scene("symmetric-response", RIG))
    assert plan.estimate_seconds > 0.0
    plan = make_plan(load_scene("symmetric-response", RIG | {"accuracy": "unknown"}))
    assert plan.estimate_seconds == 0.0
    _, _, estimates = solved(STICKS, accuracy="unknown")
    assert not estimates


# -- peaks again -----------------------------------------------------------------------------------


def test_motions_on_other_points_are_carried_over() -> None:
    """From three rows to five: a motion by straight lines up the slope is the same motion."""
    found = []
    for rows in (3, 5):
        plan: Any = make_plan(load_scene("symmetric-response", RIG | {"contact.rows": rows}))
        laws = face_laws(plan.scene.stiffnesses["thesis"], Stages())
        found.append(make_model(plan, make_bodies(plan), laws))
    few, many = found
    assert moved_points(few, few) is None
    move = moved_points(few, many)
    assert move is not None
    assert move.sum(axis=1) == pytest.approx(np.ones(len(move)))
    for k in range(2):
        rows, new = ([m.face == k for m in found][j] for j in (0, 1))
        up = [m.position[on] @ m.faces["left" if k == 0 else "right"].frame[2]
              for m, on in zip(found, (rows, new), strict=True)]  # fmt: skip
        assert move[np.ix_(new, rows)] @ up[0] == pytest.approx(up[1], rel=1e-9)


def test_carried_unknowns_are_the_same_motion_on_the_same_points(slipping: Found) -> None:
    b, top = slipping[0].curves[0].answer.balance, top_of(slipping)
    x = carried(b, b, top.x, np.eye(len(b.Psi) // (1 + b.contacts.tangents)))
    assert x == pytest.approx(top.x, abs=1e-6 * np.abs(top.x).max())


def test_a_peak_far_from_where_it_is_expected_is_another(slipping: Found) -> None:
    solution, top = slipping[0], top_of(slipping)
    model, curve = solution.models["thesis"], solution.curves[0]
    for moved, higher, found in (
        (1.0, 1.0, True),
        (1.02, 1.0, True),
        (1.05, 1.0, False),
        (0.95, 1.0, False),
        (1.0, 10.0, False),
    ):
        about = top._replace(frequency=moved * top.frequency, height=higher * top.height)
        args = (model, curve.answer.balance, top.x, top.frequency, "right", curve.force, about)
        assert (climbed(*args) is not None) == found


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


def test_a_reduction_has_the_errors_of_both_peaks() -> None:
    """R = 100 (1 - h / free): dR / R = (h / free) / (1 - h / free) (dh / h + dfree / free)."""
    found = solved(STICKS, excitation__start="285 Hz", excitation__stop="470 Hz")
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
