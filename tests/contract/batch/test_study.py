"""Studies: ladders that resume, curves with rates, parameter studies, and the mesh for a wanted
accuracy.
"""

import json
import re
import weakref
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from upd import load_scene, make_plan, run
from upd.analyses import ladders_of
from upd.analyses.base import Plan
from upd.analyses.contact.varied import PROBLEM, parameter_points
from upd.batch.engine import Progress, Workers
from upd.batch.store import PointStore
from upd.batch.studies import plan_study, point_task, run_study, study, study_workers
from upd.cli import main
from upd.errors import ConvergenceError, InputError
from upd.linalg import select
from upd.progress import Stages
from upd.results import Case, Result
from upd.vary.curves import make_curves
from upd.vary.wanted import plan_wanted, solve_wanted

pytestmark = pytest.mark.estimated

LIGHT = {"want": ["normal"], "loads.normal": ["200 N"], "geometry.patch": "auto"}
#: levels of made-up numbers, which have no neighbouring loads
#: one after the other, in this process, as a single run would
HERE = Workers(0, 0)


def files(folder: Path) -> dict[str, int]:
    return {p.name: p.stat().st_mtime_ns for p in (folder / "points").iterdir()}


def test_ladder_runs_resumes_and_reports(tmp_path: Path) -> None:
    scene = load_scene("hertz", LIGHT)
    first = run_study(scene, plan_study(scene, "mesh", (8, 12)), tmp_path, workers=HERE)
    stamps = files(tmp_path)
    assert len(stamps) == 2
    seen: list[Progress] = []
    again = run_study(
        scene, plan_study(scene, "mesh", (8, 12, 16)), tmp_path, workers=HERE, watch=seen.append
    )
    assert again.solved[:2] == first.solved
    assert again.kept == (0, 1)
    assert {name: files(tmp_path)[name] for name in stamps} == stamps, (
        "a finished point was run again"
    )
    assert [progress.label for progress in seen if progress.label] == ["hex8i 16 divisions"]
    curves = make_curves(again.solved, ["max_pressure", "radius_moment", "approach"])
    assert {c.name for c in curves} == {"max_pressure", "radius_moment", "approach"}
    approach = next(c for c in curves if c.name == "approach")
    # Without the bodies' share nothing but the ladder itself says where it leads.
    assert approach.against in ("its own extrapolation", "finest level, no clear order")
    table, data, figure, page = again.files
    html = page.read_text(encoding="utf-8")
    assert again.report.notes[-1].startswith("Maximum pressure F=200 N against reference: ")
    assert again.report.notes[-1] in html
    value = again.solved[0].values["max_pressure", "F=200 N"]
    assert f"{value:.5g}" in html, "every level has its number"
    assert "maximum pressure" in table.read_text(encoding="utf-8")
    assert figure.name == "work_precision.png"
    assert figure.stat().st_size > 10_000
    written = json.loads(data.read_text(encoding="utf-8"))
    assert len(written["points"]) == 3
    keys = [
        "curve",
        "label",
        "h",
        "values",
        "errors",
        "thesis",
        "stages",
        "seconds",
        "memory_mb",
        "n_dof",
        "failure",
    ]
    assert list(written["points"][0]) == keys
    assert "max_pressure|F=200 N" in written["points"][0]["errors"]
    # What an engineer looks at first is followed, and what the loads alone decide is not.
    assert {"max_pressure", "radius_moment", "approach", "mean_pressure"} == {
        c["name"] for c in written["curves"]
    }


@pytest.mark.usefixtures("without_pictures")
def test_half_written_point_is_run_again(tmp_path: Path) -> None:
    scene = load_scene("hertz", LIGHT)
    planned = plan_study(scene, "mesh", (8, 12))
    first = run_study(scene, planned, tmp_path, workers=HERE)
    file = sorted((tmp_path / "points").iterdir())[0]
    file.write_text('{"results": [{"na', encoding="utf-8")
    again = run_study(scene, planned, tmp_path, workers=HERE)
    assert len(again.kept) == 1
    assert [one.values for one in again.solved] == [one.values for one in first.solved]


@pytest.mark.usefixtures("without_pictures")
def test_failing_point_is_a_row_with_its_reason(tmp_path: Path) -> None:
    scene = load_scene("hertz", {**LIGHT, "geometry.patch": "0.2 mm"})
    found = run_study(scene, plan_study(scene, "mesh", (8, 12)), tmp_path, workers=HERE)
    assert all("patch rim" in one.outcome.failure for one in found.solved)
    assert not found.report.found
    assert "patch rim" in (tmp_path / "study.md").read_text(encoding="utf-8")


@pytest.mark.usefixtures("without_pictures")
def test_study_is_a_function_of_the_package(tmp_path: Path) -> None:
    import upd

    assert upd.study is study
    found = upd.study("hertz", "mesh", levels=[8, 12], overrides=LIGHT, out=tmp_path, workers=0)
    assert found.report.found
    assert found.solved[1].values["max_pressure", "F=200 N"] > 0.0


def test_who_solves_a_study(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(select, "threads", lambda: 4)
    scene = load_scene("hertz", LIGHT)
    planned = plan_study(scene, "mesh", (8, 12, 16))
    assert study_workers(scene, planned) == Workers(1, 0, fresh=True), (
        "as a single run: one at a time, all threads"
    )
    assert study_workers(scene, planned, 2) == Workers(2, 2, fresh=True)
    assert study_workers(scene, planned, 64, 2).count == 2
    assert study_workers(scene, planned, 1, 3) == Workers(1, 3, fresh=True)
    assert study_workers(scene, planned, cluster="tcp://host:1").threads == 1
    monkeypatch.setattr(select, "memory_left", lambda: 1.0)
    assert study_workers(scene, planned, 3).count == 1
    for bad in ({"workers": -1}, {"threads": 5}, {"threads": 0}, {"cluster": "nowhere"}):
        with pytest.raises(InputError):
            study_workers(scene, planned, **bad)


@pytest.mark.parametrize(
    ("vary", "curves"), [("mesh", 1), ("element", 4), ("patch", 1), ("solver", 3)]
)
def test_variations(vary: str, curves: int) -> None:
    points = plan_study(load_scene("hertz"), vary).points
    assert len({p.source for p in points}) == curves
    assert len({p.overrides for p in points}) == len(points)
    for p in points:
        make_plan(load_scene("hertz", dict(p.overrides)))


#: what one analysis or another can vary
SOME = {
    "mesh", "element", "solver", "patch", "accuracy", "parameters", "modes", "dimensions", "steps",
    "harmonics", "samples", "contacts", "contact",
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "offered"),
    [
        ("hertz", {"mesh", "element", "solver", "patch", "accuracy"}),
        ("symmetric", {"mesh", "element", "solver", "accuracy", "parameters"}),
        ("rig", {"mesh", "element", "modes", "dimensions"}),
        (
            "symmetric-response",
            {"mesh", "element", "steps", "harmonics", "samples", "modes", "contacts", "contact"},
        ),
        ("symmetric-seated", {"mesh", "element", "steps"}),
    ],
)
def test_every_analysis_offers_its_studies(name: str, offered: set[str]) -> None:
    scene = load_scene(name)
    assert ladders_of(scene).keys() == offered
    for vary in offered:
        assert len(plan_study(scene, vary).points) > 1
    for strange in SOME - offered:
        with pytest.raises(InputError, match=f"--vary {strange}: no such study"):
            plan_study(scene, strange)


def test_bad_study_arguments() -> None:
    scene = load_scene("hertz")
    with pytest.raises(InputError, match="choose one of"):
        plan_study(scene, "colour")
    with pytest.raises(InputError, match="--vary meshes: no such study, did you mean 'mesh'"):
        plan_study(scene, "meshes")
    with pytest.raises(InputError, match="even numbers"):
        plan_study(scene, "mesh", (9, 12))
    for name, vary in (
        ("symmetric", "parameters"),
        ("rig", "dimensions"),
    ):
        with pytest.raises(InputError, match="leave it out"):
            plan_study(load_scene(name), vary, (2, 4))


def test_command_prints_points_and_errors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["study", "hertz", "--levels", "8", "12", "--out", str(tmp_path), "--workers", "0"]
    arguments += [
        word for key, value in LIGHT.items() for word in ("--set", f"{key}={json.dumps(value)}")
    ]
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 0
    printed = capsys.readouterr().out
    for part in (
        "2 points",
        "2/2 points",
        "pressure",
        "Table: ",
        "Figure: ",
        "2 of 2 points ok",
    ):
        assert part in printed
    with pytest.raises(SystemExit):
        main(arguments)
    assert "2 points kept from an earlier call" in capsys.readouterr().out


@dataclass(frozen=True)
class Solved:
    """What a made-up solver leaves: its plan, its numbers, what takes the memory."""

    plan: Plan
    value: float
    factors: Any = None


def synthetic(order: float, amount: float, more: float = 0.0):
    """A solver whose error is amount (h / a)^order, and more of one order higher."""

    def solve(plan: Plan, stages: Stages) -> Solved:
        h = float(plan.parameters["patch"]) / float(plan.parameters["divisions"])
        size = h / 0.189686
        return Solved(plan, 1000.0 * (1.0 + amount * size**order * (1.0 + more * size)))

    return solve


def choose(target: float, solve: Any) -> tuple[Any, Any]:
    """The level of the ready sphere that reaches the accuracy with a made-up solver."""
    scene = load_scene("hertz", {**LIGHT, "geometry.divisions": "auto", "accuracy": target})

    def numbers(solved: Solved) -> list[Result]:
        return [Result("max_pressure", Case(load=200.0), solved.value, "MPa")]

    problem = replace(PROBLEM, sample=None, solve=solve, make_results=numbers)
    return solve_wanted(problem, plan_wanted(problem, scene), Stages())


@pytest.mark.parametrize("more", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize(
    ("order", "target", "amount"),
    [(0.7, 0.1, 0.1), (1.0, 0.02, 0.1), (1.5, 0.02, -0.4), (2.0, 0.01, 0.5), (3.0, 0.02, 0.5)],
)
def test_accuracy_is_reached_whatever_the_order(
    order: float, target: float, amount: float, more: float
) -> None:
    """The solver's order is none the code could assume."""
    solved, estimates = choose(target, synthetic(order, amount, more))
    true = abs(solved.value / 1000.0 - 1.0)
    estimated = estimates["max_pressure", "F=200 N"][0].error
    assert true <= estimated <= target


def test_accuracy_of_an_order_that_levels_confirm_costs_no_more_than_needed() -> None:
    solved, estimates = choose(0.005, synthetic(1.5, 0.2))
    true = abs(solved.value / 1000.0 - 1.0)
    estimated = estimates["max_pressure", "F=200 N"][0].error
    # Roache's 1.25, and the rounding of divisions to even numbers, which moves the ratios.
    assert 1.2 * true < estimated < 1.35 * true


def test_accuracy_out_of_reach_is_said() -> None:
    with pytest.raises(ConvergenceError, match="ask for less"):
        choose(1e-6, synthetic(1.0, 0.3))


def test_a_level_is_let_go_before_the_next_is_solved() -> None:
    """Its factors are the memory of the next."""
    made_up, held = synthetic(1.5, 0.2), list[weakref.ref[Any]]()

    class Factors:
        pass

    def solve(plan: Plan, stages: Stages) -> Solved:
        assert [one for one in held if one() is not None] == []
        factors = Factors()
        held.append(weakref.ref(factors))
        return replace(made_up(plan, stages), factors=factors)

    solved, _ = choose(0.005, solve)
    assert len(held) > 2
    assert held[-1]() is solved.factors


def test_a_refused_later_level_ends_as_out_of_reach() -> None:
    made_up, solved = synthetic(1.0, 0.3), []

    def solve(plan: Plan, stages: Stages) -> Solved:
        if solved:
            raise InputError("the contact reaches the rim")
        solved.append(plan)
        return made_up(plan, stages)

    with pytest.raises(ConvergenceError, match=r"reaches the rim.*ask for less"):
        choose(1e-6, solve)


def test_accuracy_of_the_real_scene() -> None:
    result = run("hertz", overrides={**LIGHT, "geometry.divisions": "auto", "accuracy": "4 %"})
    rows = {r.name: r for r in result.rows}
    for name in ("radius_moment", "max_pressure", "mean_pressure"):
        row = rows[name]
        assert row.estimated_error is not None
        assert row.estimated_error <= 0.04
        assert abs(row.error or 0.0) < 0.04


FLAT = {
    "want": ["normal", "stiffness"],
    "loads.normal": ["100 N"],
    "contact.distant.damper": "base",
}


@pytest.mark.usefixtures("without_pictures")
def test_flat_contact_stiffness_converges_and_edge_pressure_is_none_of_it(tmp_path: Path) -> None:
    found = study("symmetric", "mesh", levels=(4, 6, 8), overrides=FLAT, out=tmp_path, workers=0)
    curves = {c.name: c for c in found.report.curves}
    assert "max_pressure" not in curves, "it has no limit"
    assert curves["K_N_secant_raw"].verdict.startswith("converges, order")
    assert 0.7 < curves["K_N_secant_raw"].change < 2.0
    assert not curves.keys() & {"F_N", "F_T"}, "no mesh moves what the loads decide"


@pytest.mark.usefixtures("without_pictures")
def test_parameters_are_changed_one_at_a_time(tmp_path: Path) -> None:
    scene = load_scene(
        "symmetric", {**FLAT, "geometry.divisions": 4, "geometry.divisions_long": 12}
    )
    points = {p.label: p for p in parameter_points(scene)}
    assert {"as given", "damper held at wires", "tilt free", "mu = 0.3"} <= points.keys()
    assert not any("point" in label for label in points)
    assert dict(points["patch_length 6 mm"].overrides) == {"geometry.patch_length": "6.0 mm"}
    for point in points.values():
        load_scene("symmetric", dict(point.overrides))
    chosen = replace(
        plan_study(scene, "parameters"),
        points=tuple(
            points[label]
            for label in (
                "as given",
                "margin 3.75 mm",
                "patch_length 6 mm",
                "damper held at wires",
            )
        ),
    )
    found = run_study(scene, chosen, tmp_path, workers=HERE)
    key = "K_N_secant_raw", Case(load=100.0)
    given, margin, patch, wires = (one.values[key] for one in found.solved)
    assert margin < given
    assert patch < margin
    assert wires < given
    (table,) = found.report.tables
    assert [row[1] for row in table.rows] == [point.label for point in chosen.points]
    text = re.sub(" +", " ", found.files[0].read_text(encoding="utf-8"))
    assert f"| as given | {given:.5g} |" in text


@pytest.mark.usefixtures("without_pictures")
def test_two_pads_are_compared_one_by_one(tmp_path: Path) -> None:
    coarse = {"geometry.divisions": 4, "geometry.divisions_long": 8}
    scene = load_scene("asymmetric", {**FLAT, "contact.distant.damper": "wires", **coarse})
    points = {p.label: p for p in parameter_points(scene)}
    assert dict(points["pad_length 3.2 mm"].overrides) == {"geometry.pad_length": "3.2 mm"}
    chosen = replace(plan_study(scene, "parameters"), points=(points["as given"],))
    found = run_study(scene, chosen, tmp_path, workers=HERE)
    values = {name: value for (name, _), value in found.solved[0].values.items()}
    assert values["K_N_per_pad"] == pytest.approx(values["K_N_secant_raw"] / 2.0, rel=1e-12)
    (table,) = found.report.tables
    assert table.columns[2].startswith("# K_N of one pad")
    assert not any("secant" in head for head in table.columns)


def test_settings_and_threads_name_a_point(tmp_path: Path) -> None:
    scene = load_scene("hertz", LIGHT)
    points = plan_study(scene, "mesh", (8, 12)).points
    store = PointStore(tmp_path, "study")
    tasks: list[Any] = [
        point_task(point, scene, threads, code)
        for point in points
        for threads in (0, 1)
        for code in ("a", "b")
    ]
    assert len({store.path(task) for task in tasks}) == len(tasks)
