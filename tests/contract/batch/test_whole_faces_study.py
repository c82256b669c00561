"""The ladder of a forced response from springs to both faces node by node."""

import csv
import io
import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from rigs import LINES

from upd import load_scene, make_plan
from upd.batch import point
from upd.batch.engine import Workers
from upd.batch.ladder import SolvedPoint, StudyPoint
from upd.batch.level_peaks import ladder_curves
from upd.batch.point import Outcome, PointResult, read_outcome
from upd.batch.studies import plan_study, run_study
from upd.batch.whole_faces_ladder import WholeFacesStudy, whole_faces_points
from upd.cli.study import print_study
from upd.errors import InputError
from upd.results import Case, Result

STUCK: Mapping[str, Any] = {
    **LINES,
    "mesh.element": "hex8i",
    "geometry.patch_along_y": 4,
    "geometry.patch_along_slope": 2,
    "contact.stiffness": ["thesis"],
    "contact.columns": 1,
    "contact.static": "frictionless",
    "reduction.modes": 4,
    "balance.method": "balance",
    "balance.harmonics": 1,
    "excitation.start": "454 Hz",
    "excitation.stop": "474 Hz",
    "excitation.points": 30,
    "excitation.centrifugal_to_force": [2e6, 1e6],
}


#: of a scene: elements up a face that are run unless asked for others
USUAL = {"symmetric-response": ["4 x 10", "6 x 16"], "asymmetric-response": ["3 x 6", "4 x 8"]}
ASKED = {"symmetric-response": (4, 8, 12), "asymmetric-response": (3, 6, 9)}


@pytest.mark.parametrize(
    ("name", "nodes"),
    [("symmetric-response", [60, 198, 468]), ("asymmetric-response", [60, 196, 460])],
)
def test_levels_are_springs_of_every_stiffness_then_finer_faces(
    name: str, nodes: list[int]
) -> None:
    both = {"contact.stiffness": ["thesis", "own"]}
    scene = load_scene(name, both | {"balance.time_march": ["330 Hz"]})
    usual = whole_faces_points(scene, "contact")
    assert [p.label for p in usual[2:]] == USUAL[name]
    points = whole_faces_points(scene, "contact", ASKED[name])
    assert points[:3] == usual[:3]
    assert [(p.curve, p.label) for p in points[:2]] == [("springs", "thesis"), ("springs", "own")]
    made = [load_scene(name, dict(p.settings)) for p in points]
    for one, level_of in zip(made, points, strict=True):
        assert one.contact.model == level_of.curve
        assert one.excitation.centrifugal_to_force == (194.0,)
        assert (one.contact.static, one.want) == (scene.contact.static, ("response",))
    assert {one.mesh.element for one in made[:2]} == {scene.mesh.element}
    assert {one.balance.method for one in made[:2]} == {scene.balance.method}
    sizes = [make_plan(one).size for one in made[2:]]
    assert [size["left"]["contact"] + size["right"]["contact"] for size in sizes] == nodes
    told = " ".join(plan_study(scene, "contact").present(()).notes)
    for word in ('mesh.element = "hex8i" (the scene: "hex20")', 'balance.method = "march"', "194"):
        assert word in told


def test_levels_a_user_asks_for() -> None:
    scene = load_scene("symmetric-response", {"contact.stiffness": ["thesis"]})
    points = whole_faces_points(scene, "contact", (5, 4))
    assert [p.label for p in points] == ["thesis", "4 x 10", "5 x 14"]
    for bad in ((1, 4), (4, 4)):
        with pytest.raises(InputError, match="elements up a face, 2 or more"):
            whole_faces_points(scene, "contact", bad)
    own = replace(scene, geometry={"recipe": "./own.py", "patch_along_slope": 4})
    with pytest.raises(InputError, match="the recipe has no patch_along_y, by which"):
        whole_faces_points(own, "contact")


def level(curve: str, label: str, h: float, seconds: float, *results: PointResult) -> SolvedPoint:
    """A level as it comes back from its file."""
    outcome = Outcome(results, seconds=seconds, memory_mb=100.0, n_dof=9)
    return SolvedPoint(StudyPoint(curve, label, (), h), read_outcome(outcome.text()))


def peak(stiffness: str, k: int, height: float, **more: Any) -> PointResult:
    mode = {1: "in phase", 2: "out of phase"}[k]
    case = Case(stiffness=stiffness, force_ratio=194.0, mode=mode, reversed=more.pop("down", False))
    return PointResult(f"peak_{k}_accelerance", case, "(m/s2)/N", height, **more)


SWEPT = "not unique: sweep up 100 at 450 Hz, sweep down 200 at 440 Hz"
LADDER = (
    level(
        "springs",
        "thesis",
        1.0,
        2.0,
        PointResult("peak_1_accelerance", Case(stiffness="thesis", kind="stuck"), "", 1.0),
        peak("thesis", 2, 99.0),
        peak("thesis", 1, None, withheld="stopped at 300 Hz"),  # type: ignore[arg-type]
        peak("thesis", 1, 120.0, down=True),
    ),
    level("interface", "4 x 10", 0.25, 20.0, peak("interface", 1, 100.0)),
    level(
        "interface",
        "8 x 20",
        0.125,
        50.0,
        peak("interface", 1, 200.0, low=100.0, high=200.0, why=SWEPT),
        peak("interface", 2, None, withheld="neither sweep has it"),  # type: ignore[arg-type]
    ),
    SolvedPoint(StudyPoint("interface", "12 x 34", (), 0.08), Outcome(failure="no memory")),
)


def test_rows_are_aligned_by_peak_with_ranges_and_reasons() -> None:
    report = WholeFacesStudy("", (), ()).present(LADDER)
    cost, first, second = report.tables
    assert [row[0] for row in cost.rows] == [
        "springs, thesis",
        "interface, 4 x 10",
        "interface, 8 x 20",
        "interface, 12 x 34",
    ]
    assert cost.rows[3][-1] == "no memory"
    # the finest level that was solved; the end of the range that is farther off
    assert first.title == "Peak 1, in phase; change from interface, 8 x 20"
    assert [row[3:] for row in first.rows] == [
        ("120", "-40.00 %"),
        ("100", "-50.00 %"),
        ("100 to 200", ""),
        ("none", ""),
    ]
    assert [row[3:] for row in second.rows] == [
        ("99", ""),
        ("none", ""),
        ("not reached", ""),
        ("none", ""),
    ]
    assert f"interface, 8 x 20, peak 1: {SWEPT}" in report.notes
    assert "interface, 8 x 20, peak 2: neither sweep has it" in report.notes


def test_a_worker_hands_on_ranges_with_their_reason() -> None:
    one = Result("peak_1_accelerance", Case(), 2.0, "", low=1.0, high=2.0, why=SWEPT)
    assert point._number(one) == PointResult(
        "peak_1_accelerance", Case(), "", 2.0, low=1.0, high=2.0, why=SWEPT
    )
    alike = replace(one, low=None, high=None, why="time march, up and down alike")
    assert point._number(alike).why == ""


def test_a_peak_that_one_sweep_alone_has_is_no_single_number() -> None:
    lone = peak("interface", 1, 60.0, low=60.0, high=60.0, why="not unique: sweep down none")
    (_, table) = (
        WholeFacesStudy("", (), ()).present([level("interface", "a", 0.5, 1.0, lone)]).tables
    )
    assert table.rows[0][3] == "60 or none"


def test_files_hold_every_digit_and_the_figure_every_change(tmp_path: Path) -> None:
    study = WholeFacesStudy("two models", (), ("a note",))
    table, rows, data, figure = study.write(tmp_path, LADDER)
    with rows.open(encoding="utf-8", newline="") as file:
        read = list(csv.DictReader(file))
    assert [float(row["peak_1_accelerance_high ((m/s2)/N)"] or 0.0) for row in read] == [
        120.0,
        100.0,
        200.0,
        0.0,
    ]
    assert read[2]["peak_1_accelerance_low ((m/s2)/N)"] == "100.0"
    assert SWEPT in read[2]["why"]
    assert read[3]["failure"] == "no memory"
    curves = json.loads(data.read_text(encoding="utf-8"))["curves"]
    assert [(c["curve"], c["error"], c["seconds"]) for c in curves] == [
        ("springs, thesis", pytest.approx([-0.4]), [2.0]),
        ("interface", pytest.approx([-0.5, 0.0]), [20.0, 50.0]),
    ]
    assert "| interface, 8 x 20 |" in table.read_text(encoding="utf-8")
    assert figure.name == "work_precision.png"
    assert figure.stat().st_size > 10_000


def test_without_whole_faces_nothing_is_compared(tmp_path: Path) -> None:
    study = WholeFacesStudy("", (), ())
    assert not study.present(LADDER[:1]).found
    assert ladder_curves(LADDER[:1]) == []
    assert [path.suffix for path in study.write(tmp_path, LADDER[:1])] == [".md", ".csv", ".json"]


def test_a_toy_ladder_finds_the_stuck_peaks_of_both_models(tmp_path: Path) -> None:
    """At a tiny force all sticks: each level's peak is that of its own linear limit."""
    # points of a sweep 0.2 Hz apart
    scene = load_scene("symmetric-response", {**STUCK, "excitation.points": 101})
    planned = plan_study(scene, "contact", (2,))
    found = run_study(scene, planned, tmp_path, workers=Workers(0, 1))
    assert [one.outcome.failure for one in found.solved] == ["", ""]
    cases = [
        (one.values, name) for one, name in zip(found.solved, ("thesis", "interface"), strict=True)
    ]
    stuck = [values["peak_2_frequency", f"{name}, stuck, out of phase"] for values, name in cases]
    found_at = [
        values["peak_2_frequency", f"{name}, F_C/F_E 1e+06, out of phase{way}"]
        for (values, name), way in zip(cases, ("", ", sweep up"), strict=True)
    ]
    assert found_at == pytest.approx(stuck, rel=5e-4)
    cost, *_, second = found.report.tables
    assert [row[1] for row in cost.rows] == ["6", "24"]
    assert [float(row[1]) for row in second.rows] == pytest.approx(found_at, abs=0.006)
    assert second.rows[0][2] == f"{100 * (found_at[0] / found_at[1] - 1):+.2f} %"
    console = Console(width=80, file=io.StringIO())
    print_study(console, found)
    printed = console.file.getvalue()
    assert "not shown at this width" not in printed
    assert "Peak 2, out of phase; change from interface, 2 x 6" in printed
    assert 'balance.method = "march"' in " ".join(printed.split())
