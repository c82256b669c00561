"""Performance curves by sweeps: alike with the balance where its peaks are unique, ranges where
sweeps differ, the neighbours of the optimum swept.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from upd.analyses import forced, make_plan
from upd.analyses.forced.curves import SweptCurve
from upd.analyses.forced.estimates import estimate
from upd.analyses.forced.level_values import ForcedLevels
from upd.analyses.forced.levels import _OfStiffness
from upd.analyses.forced.march_queue import MarchQueue
from upd.analyses.forced.optimum_levels import between_ratios, optimum_at, optimum_keys
from upd.analyses.forced.performance import (
    PerformanceSweeps,
    _joined,
    _top,
    follow_peaks,
    stuck_peaks,
)
from upd.analyses.forced.performance_curve import Performance
from upd.analyses.forced.performance_results import performance_results
from upd.analyses.forced.plan import EVERY
from upd.analyses.forced.read_points import WANDERS
from upd.analyses.forced.reduction_results import NOT_ALIKE
from upd.analyses.forced.solution import ForcedSolution
from upd.hbm.contact_points import stuck_stiffness
from upd.hbm.damper import attach
from upd.progress import Stages, silent
from upd.scene import load_scene

SCENE = [
    "balance.method=balance",
    "balance.harmonics=3",
    "excitation.points=40",
    "excitation.start=435 Hz",
    "excitation.stop=460 Hz",
    "excitation.centrifugal_to_force=[1000.0]",
    'want=["response"]',
    "left_out.solve=no",
    "performance.lowest=130",
    "performance.highest=1000",
    "performance.points=6",
]


@pytest.fixture(scope="module")
def solution(few_points: Sequence[str]) -> ForcedSolution:
    found = forced.ANALYSIS.solve(
        make_plan(load_scene("symmetric-response", [*few_points, *SCENE])), Stages(silent)
    )
    assert isinstance(found, ForcedSolution)
    return found


@pytest.fixture(scope="module")
def swept(solution: ForcedSolution) -> Performance:
    curve = solution.curves[0]
    with MarchQueue(curve.answer.balance.contacts.n_point) as queue:
        sweeps = PerformanceSweeps(solution, curve, solution.linear["thesis"], queue)
        return sweeps.finish(Stages(silent))


def test_sweeps_tell_what_the_balance_tells(solution: ForcedSolution, swept: Performance) -> None:
    """Above F_C/F_E 200 one steady motion: the balance's peak to the steps of the sweeps."""
    linear, model = solution.linear["thesis"], solution.models["thesis"]
    by_balance = follow_peaks(solution.plan, model, solution.curves[0], linear).branches[0]
    mine = next(b for b in swept.branches if b.mode == by_balance.mode)
    assert mine.complete
    above = mine.ratio > 200.0
    assert above.sum() >= 2
    expected = np.interp(mine.ratio, by_balance.ratio, by_balance.height)
    assert mine.height[above] == pytest.approx(expected[above], rel=1e-2)
    assert mine.ratio[0] == pytest.approx(130.0)
    assert (mine.least <= mine.height).all()
    # at the lowest F_C/F_E points slip, and the peak is another than the stuck one
    assert mine.height[0] < 0.98 * swept.stuck_peak


def test_the_highest_point_is_joined_from_sweeps_and_stuck_peaks(swept: Performance) -> None:
    ratio, _, height, low = swept.highest
    assert (np.diff(ratio) > 0.0).all()
    assert (low <= height).all()
    top = swept.swept[2]
    assert top == pytest.approx(
        [
            max(_top(one)[2] for one in swept.sweeps if one.ratio == pytest.approx(r))
            for r in swept.swept[0]
        ]
    )


def _scaled(one: SweptCurve, ratio: float, factor: float) -> SweptCurve:
    blades = {side: factor * H for side, H in one.accelerance.items()}
    peaks = {
        side: tuple(p._replace(height=factor * p.height) for p in found)
        for side, found in one.peaks.items()
    }
    return replace(one, ratio=ratio, accelerance=blades, peaks=peaks)


def test_the_optimum_is_a_range_where_sweeps_differ(swept: Performance) -> None:
    """The higher sweep is least at F_C/F_E 2, the lower one as low at 3."""
    one = swept.sweeps[0]
    one = replace(one, found=replace(one.found, settled=one.found.settled | True))
    unit = 1.0 / _top(one)[2]
    heights = {1.0: (9.0, 10.0), 2.0: (5.0, 6.0), 3.0: (5.5, 7.0), 4.0: (8.0, 8.0), 5.0: (9, 9)}
    ratios = np.array(sorted(heights, reverse=True))
    found = {
        k: [_scaled(one, r, h * unit) for h in heights[r]] for k, r in enumerate(ratios.tolist())
    }
    joined = _joined(replace(swept, branches=(), sweeps=()), found, ratios)
    assert joined.optimum is not None
    assert (joined.optimum[0], joined.optimum[2]) == pytest.approx((2.0, 6.0))
    assert joined.optimum_heights == pytest.approx((5.0, 6.0))
    assert joined.optimum_between == (1.0, 3.0)
    wider = _joined(
        replace(swept, branches=(), sweeps=()),
        found | {1: [_scaled(one, 4.0, h * unit) for h in (6.0, 8.0)]},
        ratios,
    )
    assert wider.optimum_between == (1.0, 4.0)


def test_a_range_says_whether_sweeps_differ_or_a_motion_wanders(swept: Performance) -> None:
    one = swept.sweeps[0]
    one = replace(one, found=replace(one.found, settled=one.found.settled | True))
    at = int(np.abs(one.accelerance["right"]).argmax())
    low = one.found.lowest.copy()
    low[at] = 0.8 * np.abs(one.found.amplitude[at])
    settled = one.found.settled.copy()
    settled[at] = False
    lost = replace(one, found=replace(one.found, settled=settled, lowest=low))
    unit, ratios = 1.0 / _top(one)[2], np.array([3.0, 2.0, 1.0])

    def why(*ways: SweptCurve) -> str:
        found = {k: [_scaled(one, r, 2.0 * unit)] for k, r in enumerate(ratios.tolist())}
        found[1] = [
            _scaled(each, 2.0, factor * unit) for each, factor in zip(ways, (1.0, 0.9), strict=True)
        ]
        joined = _joined(replace(swept, branches=(), sweeps=()), found, ratios)
        results = {r.name: r for r in performance_results("thesis", joined)}
        peak = results["optimum_peak"]
        assert peak.low is not None
        assert peak.high == pytest.approx(1.0)
        return peak.why

    assert why(one, one) == NOT_ALIKE
    assert why(lost, one) == WANDERS


def test_the_optimum_is_marched_again_at_its_own_ratio(
    solution: ForcedSolution, swept: Performance
) -> None:
    """By the envelope theorem its height changes with a level as it does there."""
    lowest = min(one.ratio for one in swept.sweeps)
    real = [one for one in swept.sweeps if one.ratio == lowest]
    height = max(p.height for one in real for p in one.peaks["right"])
    factors = {0.5: 4.0, 0.75: 2.0, 1.0: 1.0, 1.5: 2.0, 2.0: 4.0}
    made = {
        k: [_scaled(one, r * lowest, f) for one in real]
        for k, (r, f) in enumerate(sorted(factors.items(), reverse=True))
    }
    ratios = lowest * np.array(sorted(factors, reverse=True))
    joined = _joined(replace(swept, branches=(), sweeps=()), made, ratios)
    assert joined.optimum is not None
    assert joined.optimum[0] == pytest.approx(lowest)
    solution.performances["thesis"] = joined
    at = optimum_at(solution, "thesis")
    assert at is not None
    assert at.peak.height == height
    out = ForcedLevels()
    with MarchQueue(1) as queue:
        for take in _OfStiffness(solution, "thesis", [], out)._optimum(at, {}, queue):
            take()
    fine = at.read(at.with_steps(2))
    for (key, _), ratio in zip(optimum_keys("thesis"), (fine.frequency, fine.height), strict=True):
        (value,) = out.values[key]
        assert (value.source, value.ratio) == ("steps", pytest.approx(ratio, rel=1e-9))
    numbers = performance_results("thesis", joined)
    del solution.performances["thesis"]
    solution.levels, before = out, solution.levels
    found = estimate(solution, numbers, Stages(silent))
    solution.levels = before
    errors = {name: parts for (name, _), parts in found.items()}
    assert {p.source for p in errors["optimum_peak"]} == {"steps", "continuation"}
    assert "a range tells it" in errors["optimum_ratio"][0].basis
    # 4, 2, 1, 2, 4 over log r: chords from both sides cross below the optimum
    told = " ".join(p.basis for p in errors["optimum_peak"])
    assert "no lower between the F_C/F_E if convex there" in told


def test_how_far_a_convex_curve_may_fall_between_its_points() -> None:
    """1 - (x - 2) and 2 + 2 (x - 3) cross at x = 7/3, at 2/3."""
    heights = np.array([4.0, 2.0, 1.0, 2.0, 4.0])
    rows = np.vstack([np.exp(np.arange(5.0)), np.ones(5), heights, heights])
    assert between_ratios(Performance((), 5.0, 5.0, rows)) == pytest.approx(1.0 / 3.0)
    rows[2, 0] = 2.5
    assert math.isnan(between_ratios(Performance((), 5.0, 5.0, rows)))
    assert math.isnan(between_ratios(Performance((), 5.0, 5.0, rows[:, 1:4])))


def test_every_so_many_and_the_neighbours_of_the_optimum(swept: Performance) -> None:
    at = swept.swept[0]
    assert EVERY > 1
    best = at[swept.swept[2].argmin()]
    grid = np.geomspace(1000.0, 130.0, 6)
    k = int(np.abs(grid - best).argmin())
    known = swept.highest[0]
    for beside in (k - 1, k + 1):
        if 0 <= beside < len(grid):
            assert np.isclose(known, grid[beside]).any()


def test_a_peak_is_the_stuck_one_while_every_point_sticks(
    solution: ForcedSolution, swept: Performance
) -> None:
    """Until the first F_C/F_E whose stuck motion at the peak leaves Coulomb's cone, sample by
    sample of the forces of all points, which the balance then tells too.
    """
    curve, linear, model = solution.curves[0], solution.linear["thesis"], solution.models["thesis"]
    stuck = stuck_peaks(solution.plan, model, curve, linear).branches[0]
    followed = follow_peaks(solution.plan, model, curve, linear).branches[0]
    assert 0 < len(stuck.ratio) < len(followed.ratio)
    assert stuck.ratio.min() > swept.swept[0].max()
    M, C, K, points = attach(
        model.M, model.C, model.K, model.contacts, model.damper, model.damper_rows
    )
    k = np.diag(stuck_stiffness(points).ravel())
    w = 2.0 * np.pi * stuck.frequency[0]
    force = np.append(model.force, np.zeros(len(M) - len(model.force)))
    z = np.linalg.solve(K + points.B.T @ k @ points.B + 1j * w * C - w**2 * M, force)
    pull = (k @ points.B @ z).reshape(points.rows.shape[:2])
    wave = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 720))
    for ratio in np.geomspace(1000.0, 130.0, 6):
        moved = (curve.force * curve.ratio / ratio * pull[..., None] * wave).real
        N = points.law.preload[:, None] + moved[:, 0]
        T = np.linalg.norm(model.traction[:, :, None] + moved[:, 1:], axis=1)
        sticks = bool((points.law.mu[:, None] * N >= T).all() and (N > 0.0).all())
        assert sticks == bool(np.isclose(stuck.ratio, ratio).any())
