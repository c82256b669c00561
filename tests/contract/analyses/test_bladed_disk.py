"""The scene of a bladed disk: crossings, checks, what it refuses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import upd
import upd.hbm.springs.checks as marches
from upd.analyses import make_plan
from upd.analyses.bladed_disk import ANALYSIS, charts, output, solve
from upd.analyses.bladed_disk.plan import computed
from upd.errors import ConvergenceError, InputError
from upd.progress import Stages
from upd.scene import load_scene

SMALL: dict[str, Any] = {
    "name": "small",
    "want": ["modes", "campbell", "interference"],
    "geometry": {"recipe": "sector", "disk_layers": 3, "blade_layers": 5, "axial": 2},
    "mesh": {"element": "hex20"},
    "material": {"E": "200 GPa", "nu": 0.3},
    "modes": {"count": 3},
    "rotation": {"speed": "6000 rpm", "engine_orders": [4, 5, 20], "points": 7},
}


def solved(**changed: Any) -> solve.BladedDiskSolution:
    return solve.solve(make_plan(load_scene(SMALL, changed)), Stages(lambda *_: None))


@pytest.fixture(scope="module")
def disk() -> solve.BladedDiskSolution:
    return solved()


def test_crossings_lie_on_both_lines(disk: solve.BladedDiskSolution) -> None:
    assert disk.crossings
    for c in disk.crossings:
        assert c.frequency == pytest.approx(c.engine_order * c.speed / (2.0 * np.pi))
        on_mode = np.interp(c.speed, disk.speeds, disk.campbell[c.nodal_diameter, :, c.mode - 1])
        assert on_mode == pytest.approx(c.frequency, rel=3e-3)
    # EO 20 of 24 blades travels backwards on 4 nodal diameters
    by_order = {c.engine_order: c.nodal_diameter for c in disk.crossings}
    assert by_order[20] == by_order[4] == 4
    margins = [abs(c.speed - 200.0 * np.pi) for c in disk.crossings]
    assert margins == sorted(margins)


def test_checks_pass_and_fail(disk: solve.BladedDiskSolution) -> None:
    checks = {check.name: check for check in output.check_solution(disk)}
    assert set(checks) == {
        "nodal diameters in between",
        "initial displacements",
        "Coriolis force",
    }
    assert all(check.value <= check.limit for check in checks.values())
    few = output.check_solution(solved(**{"modes.computed": 2, "want": ["campbell"]}))[0]
    assert few.value > few.limit


def test_rotation_stiffens(disk: solve.BladedDiskSolution) -> None:
    assert disk.at_rest.shape == (13, 3)
    assert (disk.at_speed[:, 0] > 1.01 * disk.at_rest[:, 0]).all()
    np.testing.assert_allclose(disk.campbell[:, 0], disk.at_rest)


def test_reduced_integration_is_nearer_to_a_finer_mesh(disk: solve.BladedDiskSolution) -> None:
    quick = {"want": ["modes"], "modes.computed": 2}
    reduced = solved(**{"mesh.element": "hex20r", **quick})
    finer = {"geometry.disk_layers": 6, "geometry.blade_layers": 10, "geometry.axial": 3}
    fine = solved(**{**finer, **quick})
    full, few = (abs(d.at_rest[0] / fine.at_rest[0] - 1.0).max() for d in (disk, reduced))
    assert few < full / 3.0


def test_numbers_and_arrays(disk: solve.BladedDiskSolution) -> None:
    names = {result.name for result in output.make_results(disk)}
    assert {"crossing_speed", "f1", "f3_at_speed"} <= names
    assert set(output.arrays(disk)) == {"at rest", "at speed", "campbell", "crossings"}
    assert computed(disk.plan.scene) == (0, 2, 6, 12)


def test_damped_response_lies_below_the_free_one(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[str, Any] = {
        "response.ratios": [20, 60],
        "response.points": 7,
        "geometry.overhang_columns": 2,
        "geometry.axial": 1,
    }
    whole = solved(**{"want": ["response", "performance"], **asked})
    found = whole.wave
    assert found is not None
    assert found.peak[1] < found.free.max()
    assert found.f_c == pytest.approx(
        1e-5 * np.hypot(*found.sectors[0].high[:, :2].T).mean() * found.crossing.speed**2, rel=1e-3
    )
    # under a high load as well, where all points of a wedge slip and only its guide holds it
    curve = found.performance
    assert curve is not None and np.isfinite(curve.height).all() and curve.inside
    assert curve.height.argmin() == 1 and 20.0 < curve.best[0] < 500.0
    assert curve.best[1] <= curve.height.min()
    results = output.make_results(whole)
    parts = output.estimate(whole, results)
    ((part,),) = parts.values()
    assert part.source == "harmonics" and 0.0 < part.error < 0.2
    shown = ANALYSIS.headline([one.as_dict() for one in results])
    assert [entry["name"] for entry in shown] == [n for n in output.HEADLINE if n != "f1"]
    # the stuck blade is stiffer than the free one
    assert found.frequency[found.stuck.argmax()] > found.frequency[found.free.argmax()]
    checks = {check.name: check for check in output.check_solution(whole)}
    assert checks["energy balance"].passed
    assert checks["path complete"].passed and checks["contact settled"].passed
    assert 0.0 < checks["contact settled"].value < 0.01
    assert checks["omitted harmonics"].passed
    spoiled = found._replace(answer=replace(found.answer, status="stopped"))
    few = replace(whole.plan.scene, response=replace(whole.plan.scene.response, harmonics=2))
    plan = replace(whole.plan, scene=few)
    monkeypatch.setattr(marches, "MOST_PERIODS", 1)
    checks = {c.name: c for c in output.check_solution(replace(whole, plan=plan, wave=spoiled))}
    for name in ("omitted harmonics", "path complete", "contact settled"):
        assert not checks[name].passed


def test_a_run_replaces_an_earlier_one(tmp_path: Path) -> None:
    geometry = {**SMALL["geometry"], "disk_layers": 1, "blade_layers": 2, "axial": 1}
    quick = {**SMALL, "left_out": {"solve": "no"}, "geometry": geometry}
    for _ in range(2):
        upd.run(quick, out=tmp_path / "run")
    written = {path.name for path in (tmp_path / "run").iterdir()}
    assert {"mesh.vtu", "nodal_diameters.png", "campbell.png", "interference.png"} <= written


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"mesh.element": "hex8i"}, "hex8i has no stress stiffness"),
        ({"mesh.symmetry": "half"}, "a sector has no mirror plane"),
        ({"solver.name": "amg"}, "modes need a direct solver"),
        ({"accuracy": 0.01}, "accuracy: a bladed disk"),
        ({"rotation.speed": "0 rpm"}, "rotation.speed"),
        ({"geometry.n_sectors": 2}, "n_sectors"),
    ],
)
def test_bad_input(changed: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_scene(SMALL, changed)


def test_no_crossing_to_damp() -> None:
    with pytest.raises(InputError, match="none crosses a mode up to the largest speed"):
        solved(**{"want": ["response"], "rotation.engine_orders": [1]})


def test_a_speed_beyond_static_stability() -> None:
    """Against the stiffening of the stresses it takes a soft disk and a speed out of this world."""
    with pytest.raises(ConvergenceError, match="static stability"):
        solved(**{"rotation.speed": "900000 rpm"})


def test_lines_of_engine_orders_fold_at_half_an_odd_number_of_blades() -> None:
    """EO 13 of 25 blades is on 12 nodal diameters, as EO 12 is."""
    found = solved(
        **{"want": ["interference"], "geometry.n_sectors": 25, "rotation.engine_orders": [12, 13]}
    )
    groups = output.arrays(found)
    assert len(groups["at speed"]["nodal_diameter"].data) == 13
    (chart,) = charts.charts(groups, {})
    assert [mark.x for mark in chart.marks] == [12.0, 12.0]
    assert [place for place, _ in chart.x.ticks] == [*map(float, range(13))]
