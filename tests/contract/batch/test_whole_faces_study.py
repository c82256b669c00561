"""The ladder of a forced response from springs to both faces node by node."""

import io
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from rigs import LINES

from upd import load_scene, make_plan
from upd.analyses.forced.varied import whole_faces_points
from upd.batch.engine import Workers
from upd.batch.studies import plan_study, run_study
from upd.cli.batch import print_study
from upd.errors import InputError

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
    for word in ('mesh.element = "hex8i"', 'balance.method = "balance"', "194"):
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
        values["peak_2_frequency", f"{name}, F_C/F_E 1e+06, out of phase"] for values, name in cases
    ]
    assert found_at == pytest.approx(stuck, rel=5e-4)
    peaks, levels = found.report.tables
    row = next(one for one in peaks.rows if one[0] == "peak 2, frequency")
    assert [float(cell) for cell in row[2:]] == pytest.approx(found_at, abs=0.006)
    assert len(levels.rows) == 2
    console = Console(width=80, file=io.StringIO())
    print_study(console, found)
    printed = console.file.getvalue()
    assert 'balance.method = "balance"' in " ".join(printed.split())
