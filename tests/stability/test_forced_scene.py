"""The forced response scenes on a cheap mesh.

Numbers that must hold, files, partial curves, and what must be refused.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rigs import LINES

import upd
from upd.analyses import forced
from upd.analyses.forced import model as paths
from upd.batch.studies import plan_study
from upd.errors import ConvergenceError, InputError
from upd.report.notebook import RunResult, charts
from upd.report.tables import main_numbers
from upd.results import Case, Result, read_netcdf
from upd.scene import load_scene
from upd.vary.curves import finest_curves
from upd.vary.outcome import Outcome, SolvedPoint
from upd.vary.variation import Variation

CHEAP: dict[str, Any] = {
    **LINES,
    "mesh.element": "hex8i",
    "contact.stiffness": ["thesis"],
    "contact.columns": 1,
    "contact.static": "frictionless",
    "reduction.modes": 4,
    "balance.method": "balance",
    "balance.harmonics": 1,
    "excitation.points": 60,
    # above the in-phase mode of the whole face
    "excitation.start": "430 Hz",
    "excitation.stop": "500 Hz",
    "want": ["response", "contact_state", "hysteresis", "damper_motion"],
    "left_out.solve": "no",
}


def run(out: Path | None = None, scene: str = "symmetric-response", **changes: Any) -> RunResult:
    return upd.run(
        scene,
        overrides={**CHEAP, **{k.replace("__", "."): v for k, v in changes.items()}},
        out=out,
        report=False,
    )


@pytest.fixture(scope="module")
def weak(tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    """A force so small that every point sticks."""
    return run(tmp_path_factory.mktemp("weak"), excitation__centrifugal_to_force=[1e5])


def case(result: RunResult) -> Case:
    return next(r.case for r in result.rows if r.name == "excitation_force")


def test_weak_force_is_the_stuck_answer(weak: RunResult) -> None:
    curves = weak.arrays
    stuck = np.asarray(curves["linear thesis"]["accelerance_stuck_right"][1])
    friction = np.asarray(curves[f"friction {case(weak)}"]["accelerance_right"][1])
    assert friction == pytest.approx(stuck, rel=1e-8, abs=1e-8 * np.abs(stuck).max())
    assert weak.value("peak_2_frequency", case(weak)) == pytest.approx(
        weak.value("stuck_out_of_phase"), rel=1e-3
    )
    assert weak.value("contact_slip") == weak.value("contact_lift") == 0.0
    assert [c.name for c in weak.checks if not c.passed] == []


def test_peaks_of_the_left_blade_stand_beside_those_of_the_right(weak: RunResult) -> None:
    curve = weak.arrays[f"friction {case(weak)}"]
    frequency, H = (np.asarray(curve[name][1]) for name in ("frequency", "accelerance_left"))
    size = np.hypot(*H.T)
    # the sweep holds the out-of-phase mode alone; the grid has steps of 1.2 Hz
    top = int(np.argmax(size))
    assert weak.value("left_peak_2_frequency", case(weak)) == pytest.approx(
        frequency[top], abs=frequency[1] - frequency[0]
    )
    height = weak.value("left_peak_2_accelerance", case(weak))
    assert height >= size[top]
    # a whole step off the peak, of a half-power width of 4.5 Hz, is 12 % below it, half a step 3 %
    assert height == pytest.approx(size[top], rel=0.1)
    right = weak.value("peak_2_accelerance", case(weak))
    assert height != pytest.approx(right, rel=1e-4)
    kinds = {r.case.kind for r in weak.rows if r.name.startswith("left_peak_")}
    assert kinds == {"", "stuck"}, "without a damper the left blade is at rest"


@pytest.mark.parametrize("points", [12, 100])
def test_linear_peaks_do_not_depend_on_the_frequencies_asked_for(points: int) -> None:
    """The free peak is 3 Hz wide at half its power, the steps are 23 and 2.5 Hz."""
    result = run(
        excitation__start="250 Hz",
        excitation__points=points,
        excitation__centrifugal_to_force=[1e5],
        want=["response"],
    )
    linear = {
        (r.case.kind, r.name): r.value
        for r in result.results
        if r.case.kind and r.name.startswith("peak_")
    }
    # 125 001 points of step 2 mHz, a peak between two of them
    exact = {
        ("free", "peak_1"): (298.128, 312.93238),
        ("stuck", "peak_1"): (409.951, 204.35628),
        ("stuck", "peak_2"): (455.678, 191.38081),
    }
    for (kind, name), (frequency, height) in exact.items():
        assert linear.pop((kind, f"{name}_frequency")) == pytest.approx(frequency, abs=2e-3)
        assert linear.pop((kind, f"{name}_accelerance")) == pytest.approx(height, rel=1e-6)
    assert not linear


def test_static_forces_are_those_of_the_wedge(weak: RunResult) -> None:
    for side in ("left", "right"):
        N = weak.value("static_N", f"thesis, frictionless, {side}")
        assert pytest.approx(350.0 / (2.0 * np.cos(np.pi / 4)), rel=1e-6) == N


def test_page_shows_the_loss_per_cycle_at_the_peak(weak: RunResult) -> None:
    assert "friction_energy" in {
        row["name"] for row in main_numbers(weak.size, weak.summary()["results"])
    }


def test_main_numbers_are_those_of_the_curve_with_friction(weak: RunResult) -> None:
    found = {
        row["name"]: row["case_fields"]
        for row in main_numbers(weak.size, weak.summary()["results"])
    }
    # The sweep from 430 Hz has no free peak; those of the stuck curve are left to the stuck
    # frequencies.
    names = [
        "peak_2_frequency",
        "peak_2_accelerance",
        "friction_energy",
        "stuck_in_phase",
        "stuck_out_of_phase",
        "static_N",
        "static_T",
    ]
    assert list(found) == names
    curve = {"stiffness": "thesis", "force_ratio": 1e5, "mode": "out of phase"}
    assert found["peak_2_frequency"] == curve
    assert found["friction_energy"] == curve | {"peak": 2}
    # the sweep from 430 Hz holds the out-of-phase mode alone; the label without it still finds it
    label = "thesis, F_C/F_E 100000"
    assert weak.value("peak_2_frequency", label) == weak.value(
        "peak_2_frequency", f"{label}, out of phase"
    )
    assert weak.value("peak_2_mac") > 0.99


def test_cases_are_data_and_come_back_from_the_file(weak: RunResult) -> None:
    assert weak.folder is not None
    curve = {"stiffness": "thesis", "force_ratio": 1e5}
    own = {"stiffness": "thesis"}
    expected = {
        "points thesis": {"content": "points"} | own,
        "linear thesis": {"content": "linear"} | own,
        "friction thesis, F_C/F_E 100000": {"content": "friction"} | curve,
    }
    expected = {
        name.replace("100000", f"{1e5:g}"): attributes for name, attributes in expected.items()
    }
    assert {name: vars(group)["attributes"] for name, group in weak.arrays.items()} == expected
    kept = read_netcdf(weak.folder / "result.nc")
    assert {name: group.attributes for name, group in kept.items()} == {
        n.replace("/", " per "): a for n, a in expected.items()
    }
    for group in kept.values():
        fields = {k: v for k, v in group.attributes.items() if k != "content"}
        assert Case(**fields).given() == fields
    # Every number and check has the fields its label is made of.
    for entry in (*weak.rows, *weak.checks):
        assert entry.case == Case(**entry.case.given())
        assert not entry.case.name or entry.case.name == "performance"
    sides = {r.case.side for r in weak.rows if r.name == "static_N"}
    assert sides == {"left", "right"}


def test_charts_need_no_more_than_the_file(weak: RunResult) -> None:
    assert weak.folder is not None
    again = forced.ANALYSIS.charts(read_netcdf(weak.folder / "result.nc"), {})
    mine = charts(weak)
    assert [(c.title, c.case) for c in mine] == [(c.title, c.case) for c in again]
    assert list(dict.fromkeys(c.title for c in again)) == [
        "Frequency response",
        "Contact state",
        "Hysteresis",
    ]


def test_run_folder_holds_curves_states_and_figures(weak: RunResult) -> None:
    assert weak.folder is not None
    for name in (
        "response.png",
        "contact_state.png",
        "hysteresis.png",
        "summary.json",
    ):
        assert (weak.folder / name).stat().st_size > 1000, name
    assert not (weak.folder / "contact_map.png").exists(), "nothing moves"
    groups = read_netcdf(weak.folder / "result.nc")
    curve = groups[f"friction {case(weak)}".replace("/", " per ")]
    stored = {name: one.data for name, one in curve.items()}
    assert stored["share"].sum(axis=2) == pytest.approx(np.ones(stored["share"].shape[:2]))
    assert stored["loop_energy"] == pytest.approx(
        stored["energy"][stored["peak_index"][0], stored["loop_point"]]
    )
    assert stored["accelerance_left"].shape == (len(stored["frequency"]), 2)
    assert stored["state"].sum(axis=2) == pytest.approx(np.ones(stored["state"].shape[:2]))
    assert stored["energy"].shape == stored["power"].shape
    # the plane y = 0 is a mirror of rig and load: the damper moves in it
    moved = {r.name for r in weak.rows if r.name.startswith("damper_") and r.unit in ("um", "mrad")}
    assert moved == {"damper_ux", "damper_uz", "damper_ry"}
    assert groups["points thesis"]["k_n"].data.sum() == pytest.approx(2 * 1.56e6)


def test_both_loads_together_scale_the_answer() -> None:
    wanted, found = np.linspace(430.0, 440.0, 12), []
    for centrifugal in ("350 N", "3500 N"):
        changes = {
            "excitation.stop": "440 Hz",
            "excitation.points": 12,
            "damper.centrifugal": centrifugal,
            "want": ["response"],
        }
        result = run(
            excitation__centrifugal_to_force=[194.0],
            **{k.replace(".", "__"): v for k, v in changes.items()},
        )
        curve = result.arrays[f"friction {case(result)}"]
        frequency, H = (np.asarray(curve[name][1]) for name in ("frequency", "accelerance_right"))
        # the steps between them are the path's own
        found.append(
            H[[int(np.argmax(np.isclose(frequency, f, rtol=1e-12, atol=0.0))) for f in wanted]]
        )
    assert found[1] == pytest.approx(found[0], rel=1e-8, abs=1e-8 * np.abs(found[0]).max())


def test_a_stopped_path_is_a_warning_with_its_partial_curve(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # another process would not see the changes
    monkeypatch.setattr("upd.linalg.processes.threads_used", lambda: 1)
    monkeypatch.setattr(paths, "LEAST_POINTS", 6)
    monkeypatch.setattr(paths, "MOST_POINTS", 0)
    result = run(want=["response"], excitation__centrifugal_to_force=[100.0], excitation__points=20)
    check = next(c for c in result.checks if c.name == "path complete")
    assert check.verdict == "warning"
    assert "6 points used" in check.remedy
    assert result.outcome == "ok with warnings"
    assert "path complete" in result.status
    missing = {
        r.name: r.withheld for r in result.rows if r.withheld and r.case.matches(case(result))
    }
    assert {"peak_2_frequency", "peak_2_accelerance"} <= set(missing)
    assert all(reason.startswith("the path stopped at") for reason in missing.values())
    with pytest.raises(ConvergenceError, match="not reached, the path stopped at"):
        result.value("peak_2_accelerance", case(result))
    scene = load_scene("symmetric-response")
    frequency = np.asarray(result.arrays[f"friction {case(result)}"]["frequency"][1])
    assert len(frequency) > 0
    assert frequency.max() < scene.excitation.stop


def test_faults_are_told_together() -> None:
    bad = {
        "want": ["respons"],
        "contact.rows": "some",
        "contact.frction": 0.3,
        "balance.harmonics": 0,
        "excitation.centrifugal_to_force": [],
        "stiffness.thesis.K_N": "5 N",
        "geometry.damper": "none",
    }
    with pytest.raises(InputError) as caught:
        load_scene("symmetric-response", bad)
    for told in (
        "did you mean 'response'",
        "contact.rows",
        "'friction'",
        "balance.harmonics",
        "is empty",
        "N/mm",
        "geometry.damper",
    ):
        assert told in str(caught.value), told


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"contact.stiffness": ["other"]}, "no table"),
        ({"stiffness.own.K_N": "1e6 N/mm"}, "come together"),
        ({"stiffness.own.scene": "symmetric", "stiffness.own.run": "runs/a"}, "both given"),
        ({"stiffness.thesis.points": "law"}, "'law' is not known"),
        ({"excitation.start": "600 Hz"}, "not below"),
        ({"damper.centrifugal": "0 N"}, "loose"),
        ({"geometry.arrangement": "asymmetric"}, "left face needs"),
    ],
)
def test_what_does_not_fit_is_refused(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        load_scene("symmetric-response", changes)


def test_only_a_rig_can_be_forced() -> None:
    with pytest.raises(InputError, match="no rig of two blades"):
        load_scene("hertz", {"analysis": "forced response"})


def test_missing_contact_run_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"result\.nc"):
        run(contact__stiffness=["own"], stiffness__own={"run": str(tmp_path)})


def test_scene_as_run_reads_back_the_same(tmp_path: Path) -> None:
    scene = load_scene(
        "asymmetric-response",
        {
            "stiffness.third.run": "runs/pads",
            "stiffness.third.left": {"K_N": "1 N/mm", "K_T": "1 N/mm"},
        },
    )
    (tmp_path / "again.toml").write_text(scene.text, encoding="utf-8")
    again = load_scene(tmp_path / "again.toml")
    assert (again.stiffness, again.contact, again.geometry) == (
        scene.stiffness,
        scene.contact,
        scene.geometry,
    )


def test_ladders_compare_with_their_finest_level() -> None:
    scene = load_scene("symmetric-response")
    points = plan_study(scene, "harmonics", (3, 1)).points
    assert [p.label for p in points] == ["to harmonic 1", "to harmonic 3"]
    # at the load under which most slips, one path
    assert scene.excitation.centrifugal_to_force[0] > 194.0
    for point in points:
        told = dict(point.overrides)
        assert told["excitation.centrifugal_to_force"] == [194.0]
        assert told["balance.method"] == "balance"
    for vary in ("samples", "modes", "contacts"):
        for point in plan_study(scene, vary).points:
            assert isinstance(load_scene("symmetric-response", dict(point.overrides)).name, str)

    def solved(label: str, f: float, seconds: float) -> SolvedPoint:
        case, linear = (
            Case(stiffness="thesis", force_ratio=194.0),
            Case(stiffness="thesis", kind="free"),
        )
        found = [
            ("peak_1_frequency", case, f),
            ("curve_seconds", case, seconds),
            ("peak_1_frequency", linear, 2.0 * f),
        ]
        found += [("peak_2_frequency", case, 500.0)]
        return SolvedPoint(
            Variation("harmonics", label, ()),
            Outcome(tuple(Result(n, c, v, "") for n, c, v in found), seconds=9.0),
        )

    # Linear curves and what no level moves have nothing to show.
    (curve,) = finest_curves(
        [solved("1", 303.0, 1.0), solved("3", 300.0, 4.0)], ["peak_?_frequency"]
    )
    assert curve.name == "peak_1_frequency"
    assert curve.error == pytest.approx((0.01, 0.0))
    with pytest.raises(InputError, match="no such study"):
        plan_study(scene, "setup")


def test_a_stop_before_the_linear_curves_keeps_its_error_and_what_was_solved(
    tmp_path: Path,
) -> None:
    def stop(stage: str, detail: str, seconds: float | None) -> None:
        if stage == "free and stuck":
            raise ConvergenceError("made up")

    short = {
        "want": ["response"],
        "excitation.points": 20,
        "excitation.centrifugal_to_force": [1e5],
    }
    with pytest.raises(ConvergenceError, match="made up"):
        upd.run(
            "symmetric-response",
            overrides=CHEAP | short,
            out=tmp_path / "run",
            report=False,
            progress=stop,
        )
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    names = {number["name"] for number in summary["results"]}
    assert "static_N" in names
    assert "reduction_of_free_peak" not in names
