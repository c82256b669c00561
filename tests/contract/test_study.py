"""Studies: ladders that resume, curves with rates, and the mesh for a wanted accuracy."""

import json
from pathlib import Path

import pytest

from upd import load_scene, make_plan, run
from upd.analyses.base import Plan
from upd.analyses.hertz import accuracy
from upd.batch.ladder import make_points, run_points
from upd.batch.parameter_study import setup_table
from upd.batch.work_precision import make_curves, write_study
from upd.errors import ConvergenceError, InputError
from upd.results import Result

LIGHT = {"want": ["normal"], "loads.normal": ["200 N"], "geometry.patch": "auto"}


def test_ladder_runs_resumes_and_reports(tmp_path: Path) -> None:
    scene = load_scene("hertz", LIGHT)
    points = make_points(scene, "mesh", (8, 12, 16))
    first = run_points(scene, points[:2], tmp_path, in_process=True)
    stamps = {p.name: p.stat().st_mtime_ns for p in tmp_path.glob("point-*.json")}
    seen: list[str] = []
    again = run_points(scene, points, tmp_path, in_process=True, watch=lambda *a: seen.append(a[5]))
    assert again[:2] == first
    assert {name: (tmp_path / name).stat().st_mtime_ns for name in stamps} == stamps, "a finished point was run again"
    assert sum("kept" in note for note in seen) == 2
    curves = make_curves(again, ["max_pressure", "radius_moment", "approach"])
    assert {c.name for c in curves} == {"max_pressure", "radius_moment", "approach"}
    approach = next(c for c in curves if c.name == "approach")
    assert approach.against == "converged value, same bodies"
    table = write_study(tmp_path, "test", again, curves)
    assert "max_pressure" in table.read_text(encoding="utf-8")
    assert (tmp_path / "work_precision.png").stat().st_size > 10_000
    assert len(json.loads((tmp_path / "study.json").read_text(encoding="utf-8"))["points"]) == 3


def test_half_written_point_is_run_again(tmp_path: Path) -> None:
    scene = load_scene("hertz", LIGHT)
    points = make_points(scene, "mesh", (8, 12))[:1]
    path = tmp_path / f"point-{points[0].key(scene)}.json"
    path.write_text('{"curve": "he', encoding="utf-8")
    assert run_points(scene, points, tmp_path, in_process=True)[0].failure == ""


def test_failing_point_is_a_row_with_its_reason(tmp_path: Path) -> None:
    scene = load_scene("hertz", {**LIGHT, "geometry.patch": "0.2 mm"})
    outcome = run_points(scene, make_points(scene, "mesh", (8, 12))[:1], tmp_path, in_process=True)[0]
    assert "patch rim" in outcome.failure


def test_point_in_a_process_of_its_own_gives_the_same(tmp_path: Path) -> None:
    scene = load_scene("hertz", LIGHT)
    points = make_points(scene, "mesh", (8, 12))[:1]
    inside = run_points(scene, points, tmp_path / "a", in_process=True)[0]
    outside = run_points(scene, points, tmp_path / "b")[0]
    assert outside.values == pytest.approx(inside.values, rel=1e-9)
    assert outside.memory_mb > 50.0


@pytest.mark.parametrize(("vary", "curves"), [("mesh", 1), ("element", 4), ("patch", 1), ("solver", 3)])
def test_variations(vary: str, curves: int) -> None:
    points = make_points(load_scene("hertz"), vary)
    assert len({p.curve for p in points}) == curves
    assert len({p.settings for p in points}) == len(points)
    for p in points:
        make_plan(load_scene("hertz", dict(p.settings)))


def test_bad_study_arguments() -> None:
    scene = load_scene("hertz")
    with pytest.raises(InputError, match="choose one of"):
        make_points(scene, "colour")
    with pytest.raises(InputError, match="even numbers"):
        make_points(scene, "mesh", (9, 12))


def synthetic(order: float, amount: float):
    """A solver whose error is amount (h / a)^order."""

    def solve(plan: Plan) -> tuple[str, tuple[Result, ...], float]:
        h = float(plan.parameters["patch"]) / float(plan.parameters["divisions"])
        value = 1000.0 * (1.0 + amount * (h / 0.189686) ** order)
        return "solved", (Result("max_pressure", "F=200 N", value, "MPa"),), 1.0

    return solve


@pytest.mark.parametrize(("target", "amount"), [(0.05, 0.5), (0.01, 0.2), (0.02, -0.4)])
def test_accuracy_is_reached_and_no_finer_than_needed(target: float, amount: float) -> None:
    scene = load_scene("hertz", {**LIGHT, "geometry.divisions": "auto", "mesh.accuracy": target})
    level, estimates = accuracy.choose(scene, synthetic(1.5, amount))
    true = abs(level.results[0].value / 1000.0 - 1.0)
    estimated, _ = estimates["max_pressure", "F=200 N"]
    assert true <= target * 1.05
    assert estimated == pytest.approx(true, rel=0.1)
    # One level coarser would have missed it.
    assert 2.0**0.75 * true > 0.9 * target


def test_accuracy_out_of_reach_is_said() -> None:
    scene = load_scene("hertz", {**LIGHT, "geometry.divisions": "auto", "mesh.accuracy": 1e-6})
    with pytest.raises(ConvergenceError, match="ask for less"):
        accuracy.choose(scene, synthetic(1.0, 0.3))


def test_accuracy_of_the_real_scene() -> None:
    result = run("hertz", overrides={**LIGHT, "geometry.divisions": "auto", "mesh.accuracy": "4 %"})
    rows = {r.name: r for r in result.rows}
    for name in ("radius_moment", "max_pressure", "mean_pressure"):
        row = rows[name]
        assert row.estimated_error is not None
        assert row.estimated_error <= 0.04
        assert abs(row.error or 0.0) < 0.04
        assert (row.half_error_cost_s or 0.0) > 0.0


FLAT = {"want": ["normal", "stiffness"], "loads.normal": ["100 N"], "contact.distant.damper": "base"}


def test_flat_contact_stiffness_converges_and_edge_pressure_does_not(tmp_path: Path) -> None:
    scene = load_scene("symmetric", FLAT)
    outcomes = run_points(scene, make_points(scene, "mesh", (4, 6, 8, 12)), tmp_path, in_process=True)
    curves = {c.name: c for c in make_curves(outcomes)}
    assert "no limit" in curves["max_pressure"].verdict
    assert curves["K_N_secant_raw"].verdict.startswith("converges, order")
    assert 0.7 < curves["K_N_secant_raw"].change < 2.0
    assert "no limit" in write_study(tmp_path, "test", outcomes, list(curves.values())).read_text(encoding="utf-8")


def test_setups_change_one_parameter_at_a_time(tmp_path: Path) -> None:
    scene = load_scene("symmetric", {**FLAT, "geometry.divisions": 4, "geometry.divisions_long": 12})
    points = {p.label: p for p in make_points(scene, "setup")}
    assert {"as given", "damper held at wires", "tilt free", "mu = 0.3"} <= points.keys()
    assert not any("point" in label for label in points)
    chosen = [points[label] for label in ("as given", "block margin 3.75 mm", "damper held at wires")]
    rows = setup_table(scene, run_points(scene, chosen, tmp_path, in_process=True))
    given, margin, wires, thesis = (values["K_N_secant_raw"] for _, values, _ in rows)
    assert margin < given
    assert wires < given
    assert thesis == 1.56e6
