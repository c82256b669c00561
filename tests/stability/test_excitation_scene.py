"""Scenes with forces at both blades and in two harmonics, from the file to the page."""

import tomllib
from typing import Any

import numpy as np
import pytest
from rigs import LINES

import upd
from tests.pictures import no_figures
from upd.analyses import make_plan
from upd.errors import InputError
from upd.report import write_report
from upd.report.notebook import RunResult, charts
from upd.scene import load_scene
from upd.scene.keys import scene_as_run

FORCES: list[dict[str, Any]] = [
    {"blade": "right"},
    {"blade": "left", "amplitude": 0.5, "phase": "180 deg"},
    {"blade": "left", "amplitude": 0.2, "harmonic": 2},
]
CHEAP: dict[str, Any] = {
    **LINES,
    "mesh.element": "hex8i",
    "contact.stiffness": ["thesis"],
    "contact.columns": 1,
    "contact.rows": 2,
    "reduction.modes": 4,
    "balance.harmonics": 2,
    "left_out.solve": "no",
    "want": ["response", "damper_motion"],
}


@pytest.fixture(scope="module", params=["balance", "march"])
def both(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    """By the balance and by sweeps, around the free peaks."""
    ratio = {"balance": 1e5, "march": 5e3}[request.param]
    changes = {
        "balance.method": request.param,
        "excitation.forces": FORCES,
        "excitation.start": "294 Hz",
        "excitation.stop": "302 Hz",
        "excitation.points": 12,
        "excitation.centrifugal_to_force": [ratio],
    }
    folder = tmp_path_factory.mktemp("page") if request.param == "balance" else None
    with no_figures():
        return upd.run("symmetric-response", overrides=CHEAP | changes, out=folder, report=False)


def test_both_blades_have_their_free_peaks_and_both_harmonics(both: RunResult) -> None:
    named = {(r.name, r.case.kind): r for r in both.results}
    for name in ("peak_1", "left_peak_1"):
        assert named[f"{name}_frequency", "free"].value == pytest.approx(298.1, abs=0.3)
    # the left blade has half the force
    heights = [named[f"{name}_accelerance", "free"].value for name in ("peak_1", "left_peak_1")]
    assert heights[1] == pytest.approx(0.5 * heights[0], rel=1e-2)
    curve = next(g for name, g in both.arrays.items() if name.startswith(("friction", "sweep")))
    for side, prefix in (("right", ""), ("left", "left_")):
        size = np.hypot(*np.asarray(curve[f"accelerance_{side}_harmonic_2"][1]).T)
        told = next(r.value for r in both.results if r.name == f"{prefix}harmonic_2_accelerance")
        assert told == pytest.approx(size.max(), rel=0.05)
        assert size.max() > 0.0
    assert {r.name for r in both.results if r.case.stiffness} >= {
        "reduction_of_free_peak",
        "left_reduction_of_free_peak",
    }


def test_what_is_excited_is_told(both: RunResult) -> None:
    words = (
        "F_E on the right blade in harmonic 1, 0.5 F_E at 180 deg on the left blade in harmonic 1, "
        "0.2 F_E on the left blade in harmonic 2"
    )
    told = next(e for e in both.effects if e["name"] == "excitation")
    assert words in told["why"]
    found = charts(both)
    assert words in found[0].detail
    if both.folder is None:
        return
    page = write_report(both.folder).read_text("utf-8")
    assert "at 180 deg on the left blade in" in page


def test_one_force_is_told() -> None:
    plan = make_plan(load_scene("symmetric-response"))
    told = next(e for e in plan.effects if e.name == "excitation")
    assert told.why == "F_E on the right blade, along x"


def test_forces_are_read_back() -> None:
    loaded = load_scene("symmetric-response", {"excitation.forces": FORCES})
    again = load_scene(tomllib.loads(scene_as_run(loaded)))
    assert again.excitation.forces == loaded.excitation.forces
    assert loaded.excitation.forces[1].phase == 180.0
    usual = load_scene("symmetric-response")
    assert "harmonic = 1 }]    # default" in scene_as_run(usual)


@pytest.mark.parametrize(
    ("forces", "told"),
    [
        ([], "is empty"),
        ([{}, {"phase": "180 deg"}], "cancel each other"),
        ([{"harmonic": 3}], "do not carry the force in harmonic 3; write 3 or more"),
        ([{"harmonic": 32}], "is no harmonic, 1 to 31"),
        ([{"amplitude": 0.0}], "is not positive"),
        ([{"blade": "both"}], "none of its values"),
        ([{"phase": 90.0}], "has no unit"),
    ],
)
def test_what_cannot_excite_is_refused(forces: list[Any], told: str) -> None:
    changes = {"excitation.forces": forces, "balance.harmonics": 2}
    with pytest.raises(InputError, match=told):
        load_scene("symmetric-response", changes)


def test_enough_harmonics_and_whole_faces_carry_any_force() -> None:
    forces = {"excitation.forces": [{"harmonic": 3}]}
    load_scene("symmetric-response", forces | {"balance.harmonics": 3})
