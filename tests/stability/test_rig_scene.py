"""The rig scene on its default geometry with a cheap element and half the elements along an edge.

Families, reduction, response, and what must be refused.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import upd
from upd.analyses import modal
from upd.analyses.modal.varied import DIMENSIONS, MODES_ONLY
from upd.batch.engine import Batch, Workers, run_points
from upd.batch.store import PointStore
from upd.batch.studies import plan_study, point_task, run_study
from upd.errors import InputError, UpdError
from upd.reduction import ReducedModel
from upd.report.notebook import RunResult, charts
from upd.report.tables import main_numbers
from upd.results import Case, read_netcdf
from upd.vary.outcome import SolvedPoint
from upd.vary.variation import Variation

CHEAP: dict[str, Any] = {
    "mesh.element": "hex8i",
    "geometry.refine": 0.5,
    "modes.arrangements": ["symmetric"],
    "left_out.solve": "no",
}


def run(**changes: Any) -> RunResult:
    return upd.run(
        "rig", overrides={**CHEAP, **{k.replace("__", "."): v for k, v in changes.items()}}
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    """One run with its folder, read by many tests."""
    want = ["free", "reduction", "response", "pictures", "matrices"]
    folder = tmp_path_factory.mktemp("rig") / "whole"
    return upd.run("rig", overrides={**CHEAP, "want": want}, out=folder, report=False)


def frequencies(result: RunResult, kind: str) -> np.ndarray:
    return np.array(
        [r.value for r in result.rows if r.name.endswith(f"_{kind}") and r.unit == "Hz"]
    )


def test_mirror_families_give_the_modes_of_the_whole_rig() -> None:
    half, full = (run(mesh__symmetry=s, want=["free", "glued"]) for s in ("half", "full"))
    for kind in ("free", "glued"):
        assert frequencies(half, kind) == pytest.approx(frequencies(full, kind), rel=1e-8)
        assert len(frequencies(half, kind)) == 4


def test_hex8_is_used_only_with_a_warning() -> None:
    locked, usual = (
        run(mesh__element=e, want=["free"], left_out__solve="yes") for e in ("hex8", "hex8i")
    )
    assert frequencies(locked, "free")[0] > 1.14 * frequencies(usual, "free")[0]
    warned = next(c for c in locked.checks if c.name == "shear locking")
    assert warned.verdict == "warning"
    assert "hex20" in warned.remedy
    assert not any(c.name == "shear locking" for c in usual.checks)


def test_numbers_that_are_not_there_have_their_reason() -> None:
    """Not "ok" without them."""
    light = {"mesh__element": "hex8"}
    with pytest.raises(UpdError, match=r"no mode lies below modes\.below = 1 Hz") as caught:
        run(**light, want=["free"], modes__below="1 Hz")
    assert "no number was reached" in str(caught.value)
    result = run(
        **light, want=["free", "response"], response__start="10 Hz", response__stop="20 Hz"
    )
    withheld = {r.name: r.withheld for r in result.rows if r.withheld}
    assert set(withheld) == {"peak_frequency", "peak_accelerance"}
    assert "between response.start and response.stop; widen them" in withheld["peak_frequency"]
    assert result.outcome == "ok with warnings"


def test_reduction_is_an_upper_bound_and_reads_back(whole: RunResult) -> None:
    assert whole.folder is not None
    for r in whole.rows:
        if r.name.endswith("_reduced"):
            assert r.error is not None
            assert -1e-9 < r.error < 3e-4
    model = ReducedModel.load(whole.folder / "reduced_right.nc")
    assert model.modes(count=1).frequency[0] == pytest.approx(whole.value("f2_reduced"), rel=1e-9)


def test_peak_follows_the_damping_and_can_tune_it() -> None:
    given = run(want=["free", "response"], response__damping="0.2 %")
    row = next(r for r in given.rows if r.name == "peak_accelerance")
    assert row.value == pytest.approx(row.reference, rel=5e-3)
    tuned = run(want=["free", "response"], response__peak=500.0)
    assert tuned.value("peak_accelerance") == pytest.approx(500.0, rel=1e-6)
    assert tuned.value("damping") == pytest.approx(
        100.0 * given.value("participation") / 1000.0, rel=5e-3
    )
    curve = np.asarray(tuned.arrays["response free"]["accelerance_right"][1])
    assert np.linalg.norm(curve, axis=-1).max() <= 500.0 * (1.0 + 1e-6)
    # Separate bases: the left blade of a rig without a damper hears nothing.
    assert not np.asarray(tuned.arrays["response free"]["accelerance_left"][1]).any()


def test_run_folder_has_pictures_shapes_and_matrices(whole: RunResult) -> None:
    assert whole.folder is not None
    matrices = [f"matrices/reduced_left.{ending}" for ending in ("K.mtx", "M.mtx", "mapping")]
    for name in ("modes_free.png", "response.png", "modes_free_symmetric.vtu", *matrices):
        assert (whole.folder / name).stat().st_size > 1000, name


def test_cases_are_data_and_come_back_from_the_file(whole: RunResult) -> None:
    assert whole.folder is not None
    free = {"kind": "free", "arrangement": "symmetric"}
    expected = {
        "modes free symmetric": {"content": "modes"} | free,
        "response free": {"content": "response"} | free,
    }
    assert {name: vars(group)["attributes"] for name, group in whole.arrays.items()} == expected
    kept = read_netcdf(whole.folder / "result.nc")
    assert {name: group.attributes for name, group in kept.items()} == expected
    for entry in (*whole.rows, *whole.checks):
        assert entry.case == Case(**entry.case.given())
        assert entry.case.name in ("", "Craig-Bampton")
    labels = {
        "peak_frequency": "free, right blade",
        "f1_free": "free, symmetric",
    }
    assert {r.name: r.case for r in whole.rows if r.name in labels} == labels
    # What was printed stands beside the modes.
    printed = [r.reference for r in whole.rows if r.name.endswith("_free")]
    assert printed == [294.88, 295.19, 783.88, 784.94]
    assert [c.title for c in charts(whole)] == ["Frequency response"]
    assert len(modal.ANALYSIS.charts(kept, {})) == 1


def test_main_numbers_are_the_lowest_frequencies_and_the_peak() -> None:
    result = run(want=["free", "glued", "reduction", "response"])
    assert [row["name"] for row in main_numbers(result.size, result.summary()["results"])] == [
        "f1_free",
        "f2_free",
        "f1_glued",
        "f2_glued",
        "f1_reduced",
        "f2_reduced",
        "peak_frequency",
        "peak_accelerance",
    ]


def test_faults_are_told_together() -> None:
    bad = {
        "want": ["fre"],
        "modes.below": "-1 Hz",
        "geometry.arrangement": "symmetric",
        "geometry.core_lenght": "5 mm",
        "loads.normal": 1,
    }
    with pytest.raises(InputError) as caught:
        upd.load_scene("rig", bad)
    told = str(caught.value)
    known = (
        "did you mean 'free'",
        "modes.below: -1 is not positive",
        "core_length",
        "loads: unknown key",
    )
    for part in (*known, "geometry.arrangement: set modes.arrangements instead"):
        assert part in told, told
    with pytest.raises(InputError, match=r"response\.start: 700 Hz is not below"):
        upd.load_scene("rig", ["response.start=700 Hz"])
    with pytest.raises(InputError, match="asks for no modes"):
        upd.make_plan(upd.load_scene("rig", {"want": ["pictures"]}))


def test_ladders(tmp_path: Path) -> None:
    scene = upd.load_scene("rig", CHEAP)
    found = run_study(scene, plan_study(scene, "modes", (0, 10)), tmp_path, workers=Workers(0, 0))
    few, many = (abs(one.errors["f3_reduced", Case(name="Craig-Bampton")]) for one in found.solved)
    assert many < 1e-3 < few
    points = plan_study(scene, "element").points
    assert {p.source for p in points} == {"hex8", "hex8i", "hex20", "hex20r", "hex27"}
    with pytest.raises(InputError, match="--vary patch"):
        plan_study(scene, "patch")


def test_sensitivity_of_a_cantilever(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lengthening the core lowers every frequency.

    The shank's thickness stiffens the free x bending, the core's hardly does. The derivatives are
    those that whole runs with a longer and a shorter core show.
    """
    scene = upd.load_scene("rig", CHEAP)
    two = {name: DIMENSIONS[name] for name in ("core_length", "shank_tx")}
    monkeypatch.setattr("upd.analyses.modal.varied.DIMENSIONS", two)
    study, core = plan_study(scene, "dimensions"), float(scene.geometry["core_length"])
    chosen = [
        Variation("core_length", label, (*MODES_ONLY, ("geometry.core_length", f"{length!r} mm")))
        for label, length in (("shorter", 0.99 * core), ("longer", 1.01 * core))
    ]
    store, points = PointStore(tmp_path, "study"), [*study.points, *chosen]
    with store.sole():
        tasks = [point_task(p, scene, 0, "") for p in points]
        outcomes = run_points(Batch(tasks, Workers(0, 0), {}), store)
    solved = [SolvedPoint(p, o) for p, o in zip(points, outcomes, strict=True)]
    report = study.present(solved[:-2])
    (table,) = report.tables
    assert report.found and [row[0] for row in table.rows] == ["as given, Hz", *two]
    names = [head.removeprefix("# ").replace(" ", "_") for head in table.columns[1:]]
    slopes = {row[0]: dict(zip(names, map(float, row[1:]), strict=True)) for row in table.rows[1:]}
    assert -2.2 < max(slopes["core_length"].values()) < -1.0
    assert 0.85 < slopes["shank_tx"]["f1_free"] < 1.05
    assert slopes["shank_tx"]["f1_glued"] < 0.3
    low, up = (one.values for one in solved[-2:])
    whole = {key[0]: np.log(up[key] / low[key]) / np.log(1.01 / 0.99) for key in low}
    assert slopes["core_length"] == pytest.approx(whole, abs=2e-3)
    other = replace(solved[1], outcome=replace(solved[1].outcome, n_dof=1))
    ((_, _, (_, why, *_)),) = [
        one.rows for one in study.present([solved[0], solved[2], other]).tables
    ]
    assert "changes the elements" in why
    lost = replace(solved[0], outcome=replace(solved[0].outcome, failure="no memory", results=()))
    without = study.present([lost, *solved[1:-2]])
    assert not without.found and without.tables[0].rows[0] == ("as given", "no memory")
