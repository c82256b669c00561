"""The ladder of a forced response from springs to both faces node by node."""

import io
import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from rigs import LINES

from upd import load_scene, make_plan
from upd.analyses.forced.ladders import change_curves, whole_faces_points
from upd.batch.engine import Workers
from upd.batch.studies import plan_study, run_study
from upd.cli.batch import print_study
from upd.errors import InputError
from upd.results import Case, Result
from upd.vary.outcome import Outcome, SolvedPoint, read_outcome
from upd.vary.variation import Variation

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
    scene = load_scene(name, both)
    usual = whole_faces_points(scene)
    assert [p.label for p in usual[2:]] == USUAL[name]
    points = whole_faces_points(scene, ASKED[name])
    assert points[:3] == usual[:3]
    assert [(p.source, p.label) for p in points[:2]] == [("springs", "thesis"), ("springs", "own")]
    made = [load_scene(name, dict(p.overrides)) for p in points]
    for one, level_of in zip(made, points, strict=True):
        assert one.contact.model == level_of.source
        assert one.excitation.centrifugal_to_force == (194.0,)
        assert (one.contact.static, one.want) == (scene.contact.static, ("response",))
    assert {one.mesh.element for one in made[:2]} == {scene.mesh.element}
    assert {one.balance.method for one in made[:2]} == {scene.balance.method}
    sizes = [make_plan(one).size for one in made[2:]]
    assert [size["left"]["contact"] + size["right"]["contact"] for size in sizes] == nodes
    told = " ".join(plan_study(scene, "contact").present(()).notes)
    for word in ('mesh.element = "hex8i"', 'balance.method = "march"', "194"):
        assert word in told


def test_levels_a_user_asks_for() -> None:
    scene = load_scene("symmetric-response", {"contact.stiffness": ["thesis"]})
    points = whole_faces_points(scene, (5, 4))
    assert [p.label for p in points] == ["thesis", "4 x 10", "5 x 14"]
    for bad in ((1, 4), (4, 4)):
        with pytest.raises(InputError, match="elements up a face, 2 or more"):
            whole_faces_points(scene, bad)
    own = replace(scene, geometry={"recipe": "./own.py", "patch_along_slope": 4})
    with pytest.raises(InputError, match="the recipe has no patch_along_y, by which"):
        whole_faces_points(own)


def level(curve: str, label: str, h: float, seconds: float, *results: Result) -> SolvedPoint:
    """A level as it comes back from its file."""
    outcome = Outcome(results, seconds=seconds, memory_mb=100.0, n_dof=9)
    return SolvedPoint(Variation(curve, label, (), h), read_outcome(outcome.text()))


def peak(stiffness: str, k: int, height: float, **more: Any) -> Result:
    mode = {1: "in phase", 2: "out of phase"}[k]
    case = Case(stiffness=stiffness, force_ratio=194.0, mode=mode, choice=more.pop("choice", ""))
    return Result(f"peak_{k}_accelerance", case, height, "(m/s2)/N", **more)


STUDY = plan_study(load_scene("symmetric-response"), "contact")
UP, DOWN = ({"choice": f"sweep {way}"} for way in ("up", "down"))
LADDER = (
    level(
        "springs",
        "thesis",
        1.0,
        2.0,
        Result("peak_1_accelerance", Case(stiffness="thesis", kind="stuck"), 1.0, ""),
        peak("thesis", 2, 99.0),
        peak("thesis", 1, 120.0),
    ),
    level("interface", "4 x 10", 0.25, 20.0, peak("interface", 1, 100.0)),
    level(
        "interface",
        "8 x 20",
        0.125,
        50.0,
        peak("interface", 1, 100.0, **UP),
        peak("interface", 1, 200.0, **DOWN),
        peak("interface", 2, math.nan, withheld="stopped at 300 Hz", **UP),
        peak("interface", 2, math.nan, withheld="stopped at 299 Hz", **DOWN),
    ),
    SolvedPoint(Variation("interface", "12 x 34", (), 0.08), Outcome(failure="no memory")),
)


def test_rows_are_aligned_by_peak_with_ranges_and_reasons() -> None:
    report = STUDY.present(LADDER)
    cost, peaks, changes = report.tables
    assert len(cost.rows) == len(LADDER)
    assert "no memory" in cost.rows[3]
    assert list(peaks.rows) == [
        ("peak 1, accelerance", "in phase", "120", "100", "100 to 200", "none"),
        ("peak 2, accelerance", "out of phase", "99", "none", "not reached", "none"),
    ]
    # the finest level that was solved; the end of the range that is farther off
    assert changes.title == "Change from interface, 8 x 20"
    assert [row[2:] for row in changes.rows] == [
        ("-40.00 %", "-50.00 %", "", ""),
        ("", "", "", ""),
    ]
    assert "interface, 8 x 20, peak 2: stopped at 300 Hz" in report.notes


def test_a_peak_that_one_sweep_alone_has_is_no_single_number() -> None:
    lone = (
        peak("interface", 1, math.nan, withheld="no peak between 300 and 500 Hz", **UP),
        peak("interface", 1, 60.0, **DOWN),
    )
    _, table, _ = STUDY.present([level("interface", "a", 0.5, 1.0, *lone)]).tables
    assert table.rows[0][2] == "60 or none"


def test_files_hold_every_digit_and_the_figure_every_change(tmp_path: Path) -> None:
    table, data, figure, _ = STUDY.write(tmp_path, LADDER, STUDY.present(LADDER))
    written = json.loads(data.read_text(encoding="utf-8"))
    values = written["points"][2]["values"]
    case = "interface, F_C/F_E 194, in phase, sweep"
    assert values[f"peak_1_accelerance|{case} up"] == 100.0
    assert values[f"peak_1_accelerance|{case} down"] == 200.0
    assert written["points"][3]["failure"] == "no memory"
    assert "interface, 8 x 20, peak 2: stopped at 300 Hz" in written["notes"]
    assert [(c["curve"], c["error"], c["seconds"]) for c in written["curves"]] == [
        ("springs, thesis", pytest.approx([-0.4]), [2.0]),
        ("interface", pytest.approx([-0.5, 0.0]), [20.0, 50.0]),
    ]
    assert "8 x 20" in table.read_text(encoding="utf-8")
    assert figure.name == "work_precision.png"
    assert figure.stat().st_size > 10_000


def test_without_whole_faces_nothing_is_compared(tmp_path: Path) -> None:
    report = STUDY.present(LADDER[:1])
    assert not report.found
    assert list(change_curves(LADDER[:1])) == []
    written = STUDY.write(tmp_path, LADDER[:1], report)
    assert [path.suffix for path in written] == [".md", ".json", ".html"]


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
    _, peaks, changes = found.report.tables
    row = next(i for i, one in enumerate(peaks.rows) if one[0] == "peak 2, frequency")
    assert [float(cell) for cell in peaks.rows[row][2:]] == pytest.approx(found_at, abs=0.006)
    assert changes.rows[row][2] == f"{100 * (found_at[0] / found_at[1] - 1):+.2f} %"
    console = Console(width=80, file=io.StringIO())
    print_study(console, found)
    printed = console.file.getvalue()
    assert "not shown at this width" not in printed
    assert "Change from interface, 2 x 6" in printed
    assert 'balance.method = "march"' in " ".join(printed.split())
