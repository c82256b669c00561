"""Performance curves by sweeps: alike with the balance where its peaks are unique, ranges where
sweeps differ, the neighbours of the optimum swept.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from upd.analyses import forced, make_plan
from upd.analyses.forced.performance import EVERY, _joined, _top, follow_peaks, sweep_peaks
from upd.analyses.forced.solution import ForcedSolution, Performance, SweptCurve
from upd.hbm import contacts, frequency_response, performance_curve
from upd.progress import Stages, silent
from upd.scene import load_scene

SCENE = [
    "mesh.element=hex8i",
    'contact.stiffness=["thesis"]',
    "contact.rows=[1, 2]",
    "contact.columns=2",
    'contact.directions="one"',
    "reduction.modes=4",
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
def solution() -> ForcedSolution:
    found = forced.ANALYSIS.solve(
        make_plan(load_scene("symmetric-response", SCENE)), Stages(silent)
    )
    assert isinstance(found, ForcedSolution)
    return found


@pytest.fixture(scope="module")
def swept(solution: ForcedSolution) -> Performance:
    return sweep_peaks(solution, solution.curves[0], solution.linear["thesis"], Stages(silent))


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


def test_a_branch_ends_before_a_point_moves() -> None:
    """An oscillator with a Jenkins element slips at the resonance from F / (c w) k_t = mu N on."""
    jenkins = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=1.0, mu=1.0, preload=1.0)
    c, w = 0.1, np.sqrt(2.0)
    f0 = w / (2.0 * np.pi)
    b = frequency_response(
        [[1.0]], [[c]], [[1.0]], jenkins,
        harmonic_force=[1.0], frequencies=[f0], harmonics=(1,), samples=256,
    ).balance  # fmt: skip
    # the amplitude at the peak is s / (c w_d), w_d^2 = k/m - c^2 / (4 m^2)
    limit = c * np.sqrt(2.0 - c**2 / 4.0)
    factors = limit * np.array([0.5, 0.9, 0.99, 1.01, 1.1])
    stuck = performance_curve(b, [1.0], factors, f0, while_stuck=True)
    assert stuck.status == "complete"
    assert stuck.factor == pytest.approx(factors[:3])
    assert len(performance_curve(b, [1.0], factors, f0).factor) == 5
