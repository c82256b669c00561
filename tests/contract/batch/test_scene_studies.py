"""Studies that every kind of scene offers, the load they look at, and the ladders of a response."""

import io
import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from rigs import LINES

from upd import load_scene, make_plan, run
from upd.analyses import ladders_of
from upd.analyses.forced.varied import response_meshes
from upd.batch.engine import Workers
from upd.batch.studies import plan_study, point_task, run_study, scene_at
from upd.cli import main
from upd.cli.tables import print_table
from upd.errors import InputError, did_you_mean
from upd.plot.work_precision import work_precision_charts
from upd.results import Case, Result
from upd.vary.curves import (
    ESTIMATED,
    TRUE,
    finest_curves,
    make_curves,
    markdown_table,
)
from upd.vary.ladder import accuracy_report, convergence_report
from upd.vary.outcome import Outcome, SolvedPoint, read_outcome
from upd.vary.variation import Variation

pytestmark = pytest.mark.estimated

#: at this F_C/F_E every point sticks: a response takes seconds
STUCK: Mapping[str, Any] = {
    **LINES,
    "mesh.element": "hex8i",
    "contact.stiffness": ["thesis"],
    "contact.columns": 1,
    "contact.static": "frictionless",
    "reduction.modes": 4,
    "balance.harmonics": 1,
    "excitation.start": "440 Hz",
    "excitation.stop": "500 Hz",
    "excitation.points": 30,
    "excitation.centrifugal_to_force": [2e6, 1e6],
}
LIGHT = {"want": ["normal"], "loads.normal": ["200 N"], "geometry.patch": "auto"}
SCENES = (
    "hertz",
    "symmetric",
    "asymmetric",
    "rig",
    "symmetric-response",
    "asymmetric-response",
    "symmetric-seated",
    "asymmetric-seated",
    "bladed-disk",
)
#: of the scenes above: what they do not offer
REFUSED = [
    ("hertz", "harmonics"),
    ("rig", "accuracy"),
    ("rig", "steps"),
    ("symmetric", "steps"),
    ("symmetric-seated", "modes"),
    ("symmetric-response", "solver"),
]


@pytest.mark.parametrize("name", SCENES)
def test_every_point_of_every_ladder_is_a_scene_that_can_be_planned(name: str) -> None:
    scene = load_scene(name)
    for vary in ladders_of(scene):
        planned = plan_study(scene, vary)
        for point in planned.points:
            settings = point_task(point, scene, 1, "").settings
            assert (settings["accuracy"] == "unknown") == (vary != "accuracy")
            level = load_scene(name, dict(settings))
            assert level.estimates == (vary == "accuracy")
    # the finest mesh can be planned too
    finest = min(plan_study(scene, "mesh").points, key=lambda p: p.size)
    assert make_plan(load_scene(name, dict(finest.overrides))).seconds > 0.0


@pytest.mark.parametrize(("name", "vary"), REFUSED)
def test_a_refusal_says_what_there_is(name: str, vary: str) -> None:
    scene = load_scene(name)
    with pytest.raises(InputError) as caught:
        plan_study(scene, vary)
    offered = ladders_of(scene)
    near = did_you_mean(vary, offered, f"choose one of {', '.join(offered)}")
    assert str(caught.value) == f"--vary {vary}: no such study{near}"


def test_the_load_that_is_studied() -> None:
    response = scene_at(load_scene("symmetric-response"), "100")
    assert response.excitation.centrifugal_to_force == (100.0,)
    assert dict(plan_study(response, "harmonics").points[0].overrides)[
        "excitation.centrifugal_to_force"
    ] == [100.0]
    by_force = load_scene(
        "symmetric-response",
        {
            "excitation.force": ["1 N", "2 N"],
            "excitation.centrifugal_to_force": "from force",
        },
    )
    assert scene_at(by_force, 50).excitation.centrifugal_to_force == (50.0,)
    for at in ("155 N", "0.155 kN", 155):
        assert scene_at(load_scene("symmetric"), at).loads.normal == (155.0,)
    assert scene_at(load_scene("hertz"), "70").loads.normal == (70.0,)
    assert scene_at(load_scene("symmetric-seated"), "200 N").damper.centrifugal == 200.0
    hertz = load_scene("hertz")
    assert scene_at(hertz, None) is hertz


@pytest.mark.parametrize(
    ("name", "at", "told"),
    [
        ("symmetric-response", "200 N", "one F_C/F_E; write a positive number without a unit"),
        ("symmetric-response", "-3", "one F_C/F_E"),
        ("symmetric-response", "nan", "one F_C/F_E"),
        (
            "hertz",
            "five",
            "the normal force of a contact; write a positive force, for example --at",
        ),
        ("hertz", "0", "the normal force of a contact"),
        ("hertz", "200 mm", "the normal force of a contact"),
        ("symmetric-seated", "inf", "F_C of a seated damper"),
        ("rig", "5", "the scene has no load to choose"),
    ],
)
def test_a_load_that_is_none(name: str, at: str, told: str) -> None:
    with pytest.raises(InputError) as caught:
        scene_at(load_scene(name), at)
    assert str(caught.value).startswith(f"--at {at}: ")
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


def test_levels_that_are_none() -> None:
    response, rig, hertz = (load_scene(n) for n in ("symmetric-response", "rig", "hertz"))
    for scene, vary, levels in (
        (response, "harmonics", (1.5, 3)),
        (response, "harmonics", (3, 3)),
        (response, "steps", (4, 32)),
        (response, "mesh", (0.7, 1)),
        (response, "element", (1,)),
        (rig, "mesh", (float("nan"), 1)),
        (rig, "modes", (1, -1)),
        (hertz, "mesh", (8.5, 12)),
        (load_scene("hertz", {"contact.coupling": "coupled"}), "steps", (2, 80)),
        (hertz, "accuracy", (5, 5)),
        (hertz, "accuracy", (0, 5)),
        (hertz, "accuracy", (5, float("nan"))),
    ):
        with pytest.raises(InputError, match=r"--levels .*: give at least two "):
            plan_study(scene, vary, levels)
    assert [p.size for p in plan_study(rig, "mesh", (2, 0.5)).points] == [2.0, 0.5]


def test_what_the_mesh_ladder_of_a_response_sets() -> None:
    scene = load_scene(
        "symmetric-response", {**LINES, "contact.left.rows": [1, 2], "contact.columns": 1}
    )
    made = [
        load_scene("symmetric-response", {**LINES, **dict(p.overrides)})
        for p in response_meshes(scene, None, vary="element")
    ]
    assert {one.mesh.element for one in made} == {"hex8", "hex8i", "hex20", "hex20r", "hex27"}
    for one in made:
        assert one.excitation.centrifugal_to_force == (194.0,)
        assert one.contact.lines("left") == one.contact.lines("right") == (4, 2)
        assert one.contact.rule == "gauss"
        assert one.left_out.solve == "no"
    faces = load_scene(
        "symmetric-response",
        {"contact.model": "interface", "mesh.element": "hex8i", "want": ["response"]},
    )
    points = list(response_meshes(faces, None, vary="element"))
    assert {p.source for p in points} == {"hex8", "hex8i"}, "faces of four nodes alone carry it"
    assert not any(key.startswith("contact.rows") for p in points for key, _ in p.overrides)
    own = replace(scene, geometry={"recipe": "sphere_block"})
    with pytest.raises(InputError, match="--vary mesh: the recipe has no parameter refine"):
        list(response_meshes(own, None))


def test_a_toy_response_converges_with_its_mesh(tmp_path: Path) -> None:
    scene = load_scene("symmetric-response", STUCK)
    planned = plan_study(scene, "mesh", (0.5, 1))
    found = run_study(scene, planned, tmp_path, workers=Workers(0, 1))
    assert [one.outcome.failure for one in found.solved] == ["", ""]
    stuck = [one.values["stuck_out_of_phase", "thesis"] for one in found.solved]
    assert stuck[0] > stuck[1], "displacement elements are too stiff"
    swept = [
        one.values["peak_2_frequency", "thesis, F_C/F_E 1e+06, out of phase"]
        for one in found.solved
    ]
    assert swept == pytest.approx(stuck, rel=5e-4)
    data = json.loads((tmp_path / "study.json").read_text("utf-8"))
    curve = next(c for c in data["curves"] if c["name"] == "stuck_out_of_phase")
    assert curve["estimate"]["error"] > 0.0
    assert min(curve["seconds"]) > 0.0
    assert min(curve["memory_mb"]) > 50.0
    assert "every level: 4 x 2 Gauss points" in (tmp_path / "study.md").read_text("utf-8")
    assert (tmp_path / "work_precision.png").stat().st_size > 10_000


def test_load_steps_of_a_contact_and_of_a_seated_damper() -> None:
    coupled = load_scene("symmetric", {"contact.coupling": "coupled"})
    points = plan_study(coupled, "steps", (40, 20)).points
    assert [dict(p.overrides)["loads.cycle_steps"] for p in points] == [20, 40]
    assert [p.size for p in points] == [1 / 20, 1 / 40]
    assert [
        load_scene(
            "symmetric", {"contact.coupling": "coupled", **dict(p.overrides)}
        ).loads.cycle_steps
        for p in points
    ] == [20, 40]
    seated = plan_study(load_scene("symmetric-seated"), "steps", (2, 4)).points
    assert [dict(p.overrides)["seating.steps"] for p in seated] == [2, 4]


def test_load_steps_change_the_cycle_of_coupled_contact_alone(tmp_path: Path) -> None:
    """Without coupling every step slips exactly, however long it is."""
    light = {
        "geometry.patch": "auto",
        "geometry.divisions": 4,
        "loads.normal": ["200 N"],
        "want": ["cycle"],
    }
    energies = {}
    for coupling, n in (("uncoupled", 60), ("uncoupled", 120), ("coupled", 8), ("coupled", 16)):
        result = run(
            "hertz",
            overrides={
                **light,
                "contact.coupling": coupling,
                "loads.cycle_steps": n,
                "left_out.solve": "no",
                "accuracy": "unknown",
            },
        )
        energies[coupling, n] = result.value("cycle_energy", "F=200 N T/muN=0.75")
    assert energies["uncoupled", 60] == pytest.approx(energies["uncoupled", 120], rel=1e-9)
    assert abs(energies["coupled", 8] / energies["coupled", 16] - 1.0) > 1e-3


def level(curve: str, n: int, *results: Result) -> SolvedPoint:
    """A level as it comes back from its file."""
    outcome = Outcome(results, seconds=1.0 * n, memory_mb=100.0, n_dof=9)
    return SolvedPoint(Variation(curve, str(n), (), 1.0 / n), read_outcome(outcome.text()))


def peak(value: float, **more: Any) -> Result:
    case = Case(stiffness="thesis", force_ratio=194.0, mode="in phase")
    return Result("peak_1_frequency", case, value, "Hz", **more)


def test_both_sweeps_have_their_order() -> None:
    """Peaks of 300 - 8 h^2 on the way up and 320 + 4 h on the way down."""
    up, down = (Case(force_ratio=194.0, choice=f"sweep {way}") for way in ("up", "down"))
    levels = [
        level(
            "steps",
            n,
            Result("peak_1_frequency", up, 300 - 8 / n**2, "Hz"),
            Result("peak_1_frequency", down, 320 + 4 / n, "Hz"),
        )
        for n in (1, 2, 4)
    ]
    curves = {c.case: c for c in finest_curves(levels, ["*peak_1_frequency"])}
    assert curves[up.label].order == pytest.approx(2.0, abs=1e-6)
    assert curves[down.label].order == pytest.approx(1.0, abs=1e-6)
    assert curves[down.label].verdict == "converges, order 1.0"


def test_time_steps_are_of_the_sweeps_and_samples_of_the_balance() -> None:
    scene = load_scene("symmetric-response")
    for vary, method in (("steps", "march"), ("samples", "balance")):
        made = [
            load_scene("symmetric-response", dict(p.overrides))
            for p in plan_study(scene, vary, (32, 64)).points
        ]
        assert [one.balance.samples for one in made] == [32, 64]
        assert {one.balance.method for one in made} == {method}


@pytest.mark.usefixtures("without_pictures")
def test_a_ladder_of_accuracies_tells_estimated_and_true_errors(tmp_path: Path) -> None:
    arguments = ["study", "hertz", "--vary", "accuracy", "--levels", "20", "8.5"]
    arguments += ["--at", "200 N", "--workers", "0", "--out", str(tmp_path)]
    for key in ("want", "geometry.patch"):
        arguments += ["--set", f"{key}={json.dumps(LIGHT[key])}"]
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 0
    data = json.loads((tmp_path / "study.json").read_text("utf-8"))
    assert [p["label"] for p in data["points"]] == ["20 %", "8.5 %"]
    assert {c["case"] for c in data["curves"]} == {"F=200 N"}
    by_name = {(c["name"], c["curve"]): c for c in data["curves"]}
    for name in ("max_pressure", "radius_moment"):
        estimated, true = by_name[name, ESTIMATED], by_name[name, TRUE]
        for wanted, told, real in zip((0.2, 0.085), estimated["error"], true["error"], strict=True):
            assert abs(real) <= told <= wanted
    assert data["points"][0]["seconds"] > 0.0
    report = (tmp_path / "study.md").read_text("utf-8")
    assert "## Estimated error" in report
    assert "## True error" in report


def test_an_estimate_comes_back_from_a_worker() -> None:
    one = level("accuracy", 1, replace(peak(310.0), estimated_error=0.02))
    assert [r.estimated_error for r in one.outcome.results] == [0.02]
    (curve,) = accuracy_report(None, [one], ["*"]).curves
    assert (curve.curve, curve.error) == (ESTIMATED, (0.02,))


def test_a_narrow_terminal_keeps_order_and_estimate() -> None:
    levels = [
        SolvedPoint(
            Variation("hex20", f"refine {1 / h:g}", (), h),
            Outcome((peak(320.0 + 4.0 * h**2),), seconds=1.0 / h, memory_mb=100.0),
        )
        for h in (2.0, 1.0, 0.5)
    ]
    report = convergence_report(None, levels, ["peak_1_frequency"])
    console = Console(width=100, file=io.StringIO())
    print_table(console, report.details[0])
    printed = console.file.getvalue()  # type: ignore[attr-defined]
    assert "estimated" in printed
    assert "order" in printed
    assert "0.93 %" in "\n".join(markdown_table(report.details[0]))


def test_figures_show_both_costs_and_the_estimate() -> None:
    levels = [
        SolvedPoint(
            Variation("hex20", f"refine {1 / h:g}", (), h),
            Outcome(
                (peak(320.0 + 4.0 * h**2), Result("stuck", Case(kind="stuck"), 300.0 + h, "")),
                seconds=1.0 / h,
                memory_mb=100.0 / h,
            ),
        )
        for h in (2.0, 1.0, 0.5)
    ]
    curves = [asdict(c) for c in make_curves(levels, ["peak_1_frequency", "stuck"])]
    charts = work_precision_charts(curves)
    sheet = [c for c in charts if c.sheet]
    assert [c.x.name for c in sheet] == ["seconds"], "friction alone"
    assert len(charts) == 4
    for chart in (c for c in charts if c.case == sheet[0].case):
        assert [m.text for m in chart.marks] == ["refine 0.5", "refine 1", "refine 2"]
        curve, estimate = chart.traces
        assert estimate.style == "open points"
        assert estimate.x == curve.x[-1:]
        # order 2 of three levels: 3 times the difference from the limit, 321 - 320
        assert estimate.y == pytest.approx(100.0 * 3.0 / 321.0, rel=1e-9)
