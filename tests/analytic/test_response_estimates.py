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
from upd.analyses.forced import again as solved_again
from upd.analyses.forced.again import (
    HARMONICS,
    MESH,
    MODES,
    POINTS,
    SAMPLES,
    TIME,
    Run,
    Variant,
    peak_again,
    run_curve,
    solve_again,
)
from upd.analyses.forced.curves import Top
from upd.analyses.forced.peaks import climbed
from upd.analyses.forced.performance import peaks_at
from upd.analyses.forced.solve import ForcedSolution
from upd.analyses.forced.varied import bound, estimate
from upd.errors import ConvergenceError
from upd.hbm import System, climb, contacts, frequency_response
from upd.progress import Stages, silent
from upd.results import ErrorPart, Estimates, Result
from upd.results.number import with_estimates
from upd.scene import load_scene
from upd.vary.solve import changed
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
    return solution, numbers, estimate(solution, numbers)


@pytest.fixture(scope="module")
def slipping() -> Found:
    return solved(SLIPS)


@pytest.fixture(scope="module")
def sticking() -> Found:
    return solved(STICKS)


def searched(solution: ForcedSolution) -> Run:
    """What is looked for again."""
    model, linear = solution.models["thesis"], solution.linear["thesis"]
    curves = tuple(run_curve(curve) for curve in solution.curves)
    return Run(solution.plan, "thesis", model, linear, curves)


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
    assert error == pytest.approx(1.25 * 0.01 / 1.01)


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


def test_harmonics_are_told_where_the_best_damper_is() -> None:
    """The run's own curve sticks; at the best F_C/F_E one harmonic misses a lot."""
    choice = {
        "want": ["response", "performance"],
        "performance__lowest": 40.0,
        "performance__highest": 400.0,
        "performance__points": 3,
    }
    found = solved(STICKS, balance__harmonics=1, **choice)
    part = parts_of(found, "best_peak")[HARMONICS]
    best = number(found, "best_ratio").value
    solution, overrides = found[0], (("balance.harmonics", 9), ("balance.samples", 128))
    finer = replace(solution.plan, scene=changed(solution.plan.scene, overrides))
    truth = peaks_at(finer, solution.models["thesis"], best).worst.height
    true = abs(truth / number(found, "best_peak").value - 1.0)
    assert 0.01 < true < part.error
    assert f"at F_C/F_E {best:.3g}" in part.basis
    assert HARMONICS not in parts_of(found, "peak_2_accelerance"), "nothing slips there"


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
        assert true > 1e-6
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


def test_where_a_top_leaves_the_next_motion_stands_for_harmonics(slipping: Found) -> None:
    """The highest motion that stays, 2 % below the next towards the top, has all harmonics."""
    solution, numbers, _ = slipping
    (curve,) = solution.curves
    checked = tuple(
        replace(one, integrated=0.9 * one.balance, sample=3, step=0.02, apart=0.001)
        for one in curve.checked
    )
    leaves = replace(solution, curves=[replace(curve, checked=checked)])
    run = searched(leaves)
    more = solve_again(run, Variant(Variation(HARMONICS, "more", size=0.6), run.plan))
    assert not more.numbers
    levels = [one for one in solution.levels if one.variation.source not in (HARMONICS, SAMPLES)]
    found = estimate(replace(leaves, levels=levels), numbers)
    for name, error in (("peak_2_accelerance", 0.02), ("peak_2_frequency", 0.001)):
        one = number(slipping, name)
        parts = {part.source: part for part in found[one.name, one.case]}
        assert set(parts) == {MESH, MODES, POINTS, TIME}
        assert parts[TIME].error == pytest.approx(error)
        assert parts[MODES] == parts_of(slipping, name)[MODES]
    reduction = [r for r in numbers if r.name == "reduction_of_free_peak"]
    assert all(r.withheld for r in reduction)


def test_a_peak_is_found_again_on_its_own_model(
    slipping: Found, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a climb from its top; in a band about it; in the sweep where the band misses it."""
    run, top = searched(slipping[0]), top_of(slipping)

    def again() -> tuple[float, float]:
        (curve,) = run.curves
        return peak_again(run, run, curve, "right", 2, far=False)

    assert again() == pytest.approx((top.frequency, top.height), rel=1e-3)
    monkeypatch.setattr(solved_again, "climbed", lambda *_: None)
    assert again() == pytest.approx((top.frequency, top.height), rel=1e-2)
    monkeypatch.setattr(solved_again, "BAND", 1e-4)
    assert again() == pytest.approx((top.frequency, top.height), rel=1e-2)


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
    run = searched(solution)
    monkeypatch.setattr(solved_again, "peak_again", fails)
    variants = (
        Variant(Variation(HARMONICS, "2 harmonics more", size=0.6), run.plan),
        Variant(Variation(MODES, "2 modes a blade", size=2.0), run.plan, run.model),
    )
    failed = {one.of.source: solve_again(run, one) for one in variants}
    mixed = [failed.get(one.variation.source, one) for one in solution.levels]
    again = estimate(replace(solution, levels=mixed), numbers)
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
        monkeypatch.setattr(solved_again, name, never)
    plan = make_plan(load_scene("symmetric-response", RIG))
    assert plan.estimate_seconds > 0.0
    plan = make_plan(load_scene("symmetric-response", RIG | {"accuracy": "unknown"}))
    assert plan.estimate_seconds == 0.0
    _, _, estimates = solved(STICKS, accuracy="unknown")
    assert not estimates


# -- peaks again -----------------------------------------------------------------------------------


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
        System(([[1.0]], [[2.0 * zeta]], [[1.0]]), stuck, harmonics=(1,)),
        harmonic_force=[1.0],
        frequencies=np.array([0.16]),
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
