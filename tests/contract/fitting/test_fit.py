"""`upd fit` and `upd.fit`: made-up targets are recovered, and what they leave unknown is told."""

from __future__ import annotations

import json
import math
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import upd
from tests.pictures import png_size
from upd import cli
from upd.errors import InputError
from upd.fitting import FitResponses, Residuals, knowledge, read_parameters, read_targets
from upd.fitting.residuals import ROUNDING
from upd.fitting.targets import KNOWN
from upd.scene import ForcedScene, load_scene

RIGHT, LEFT = "stiffness.thesis.right.K_T", "stiffness.thesis.left.K_T"
NORMAL = "stiffness.thesis.right.K_N"
MODES = "stuck_in_phase={:.12g} Hz{w},stuck_out_of_phase={:.12g} Hz{w}"


@pytest.fixture(scope="module")
def scene(small: dict[str, Any]) -> ForcedScene:
    found: ForcedScene = load_scene(
        "asymmetric-response", small | {"excitation.centrifugal_to_force": [1e6]}
    )
    return found


def numbers(scene: ForcedScene, names: str, vary: list[str], factors: list[float]) -> np.ndarray:
    """What a scene with moved inputs has."""
    targets = read_targets([f"{name}=1 {unit_of(name)}" for name in names.split(",")])
    responses = FitResponses(scene, targets, read_parameters(scene, vary))
    return responses.at(np.log(factors))[0]


def unit_of(name: str) -> str:
    return "(m/s2)/N" if "accelerance" in name else "Hz"


def test_determined_targets_are_recovered_and_the_written_scene_has_them(
    scene: ForcedScene, tmp_path: Path
) -> None:
    vary, factors = [f"{RIGHT}=x0.2:x10", f"{LEFT}=x0.01:x10"], [0.4, 0.07]
    made = numbers(scene, "stuck_in_phase,stuck_out_of_phase", vary, factors)
    found = upd.fit(scene, MODES.format(*made, w=""), vary, starts=4, out=tmp_path / "fit")
    assert found.status == "found"
    assert found.value(RIGHT) == pytest.approx(0.4 * 1.5e5, rel=1e-6)
    assert found.value(LEFT) == pytest.approx(0.07 * 1e6, rel=1e-6)
    # the scene that is written gives them, by a run of its own
    result = upd.run(tmp_path / "fit" / "asymmetric-response-fitted.toml")
    run = [result.value(name, "thesis") for name in ("stuck_in_phase", "stuck_out_of_phase")]
    assert run == pytest.approx(made, rel=1e-9)
    data = json.loads((tmp_path / "fit" / "summary.json").read_text("utf-8"))
    assert data["outcome"] == "Found"
    assert data["tables"][0]["rows"][0][3] == pytest.approx(found.value(RIGHT), rel=1e-12)
    assert min(png_size((tmp_path / "fit" / "fit.png").read_bytes())) > 300
    assert max(map(len, found.table().splitlines())) <= 80


def test_answers_apart_from_each_other_are_all_told(scene: ForcedScene) -> None:
    """Within wide bounds other sets have the same two frequencies."""
    made = numbers(scene, "stuck_in_phase,stuck_out_of_phase", [RIGHT, LEFT], [0.4, 0.07])
    found = upd.fit(scene, MODES.format(*made, w=""), [RIGHT, LEFT])
    assert found.status == "several"
    assert "Other sets, times the scene's values" in found.table()
    names = "stuck_in_phase,stuck_out_of_phase"
    for z in found.answers:
        assert numbers(scene, names, [RIGHT, LEFT], list(np.exp(z))) == pytest.approx(made)
    assert any(np.exp(z) == pytest.approx([0.4, 0.07], rel=1e-6) for z in found.answers)


def test_slopes_are_those_of_finer_central_differences(scene: ForcedScene) -> None:
    """Of every number, by stiffnesses, Young's modulus, density and damping."""
    vary = [RIGHT, f"{LEFT}+{NORMAL}", "material.E", "material.density", "excitation.damping"]
    parts = [name for name in KNOWN if name.startswith(("free_peak_1", "stuck"))]
    targets = read_targets([f"{name}=1 {unit_of(name)}" for name in parts])
    responses = FitResponses(scene, targets, read_parameters(scene, vary))
    slope = responses.at(np.zeros(5))[1]
    for k in range(5):
        step = np.zeros(5)
        step[k] = 1e-4
        change = (responses.value(step) - responses.value(-step)) / 2e-4
        assert slope[:, k] == pytest.approx(change, rel=1e-2, abs=2e-2)


def test_a_dimension_is_fitted_by_differences(scene: ForcedScene) -> None:
    vary = ["geometry.core_length=x0.98:x1.02"]
    made = numbers(scene, "free_peak_1_frequency", vary, [1.01])
    found = upd.fit(scene, f"free_peak_1_frequency={made[0]:.12g} Hz", vary, starts=1)
    assert found.value("geometry.core_length") == pytest.approx(
        1.01 * scene.geometry["core_length"], rel=1e-6
    )
    ends = [numbers(scene, "free_peak_1_frequency", vary, [x])[0] for x in (1.005, 1.015)]
    assert found.slopes[0, 0] == pytest.approx(np.ptp(ends) / np.log(1.005 / 1.015), rel=1e-2)
    assert found.scene.geometry["core_length"] == pytest.approx(
        found.value("geometry.core_length"), rel=1e-12
    )


def test_more_parameters_than_targets_are_told_as_a_family(scene: ForcedScene) -> None:
    vary, factors = [NORMAL, RIGHT, LEFT], [0.5, 0.6, 0.1]
    made = numbers(scene, "stuck_in_phase,stuck_out_of_phase", vary, factors)
    found = upd.fit(scene, MODES.format(*made, w=""), vary, starts=3)
    assert found.status == "family"
    assert "a family of inputs, with 1 unknown direction, meets both targets" in found.verdict
    assert found.known.correlation is None
    (row,) = found.known.directions[found.known.unknown]
    targets = read_targets(MODES.format(*made, w=""))
    residuals = Residuals(FitResponses(scene, targets, read_parameters(scene, vary)))
    # along the direction nothing moves to first order, across it something does
    along, across = (residuals.jacobian(found.answers[0]) @ v for v in (row, [1.0, 1.0, 1.0]))
    # another count of threads moves a frequency by 2e-11, and a difference over two steps by 7e-9
    assert np.abs(along).max() < ROUNDING < 1e-4 < np.abs(across).max()
    # every member meets the targets, and the family is long
    assert all(residuals.met(z) for z in found.answers)
    assert max(np.exp(np.ptp(found.ends, axis=1))) > 10.0
    for k, z in enumerate(found.ends[:, 0]):
        begin = np.array(found.answers[0])
        begin[k] = z
        assert residuals.met(residuals.solve(residuals.inside(begin), held=k).end)
    assert found.table().count("not determined") == 1


def test_friction_moves_no_linear_number(scene: ForcedScene) -> None:
    """A parameter without effect is a direction by itself."""
    made = numbers(scene, "stuck_in_phase", [LEFT], [0.2])
    found = upd.fit(
        scene, f"stuck_in_phase={made[0]:.12g} Hz", [LEFT, "contact.friction"], starts=1
    )
    assert found.status == "family"
    (row,) = found.known.directions[found.known.unknown]
    assert np.abs(row) == pytest.approx([0.0, 1.0], abs=1e-9)
    (table,) = [one for one in found.tables if one.heading == "Directions of the inputs"]
    assert table.rows[0] == ("contact.friction x 1.1", "not determined")


def test_half_widths_become_intervals(scene: ForcedScene) -> None:
    """To first order, as the misfit is quadratic there; twice the half-width, twice the
    interval.
    """
    made = numbers(scene, "stuck_in_phase,stuck_out_of_phase", [RIGHT, LEFT], [0.4, 0.07])
    half = []
    for width in (0.001, 0.002):
        found = upd.fit(scene, MODES.format(*made, w=f" +- {width} Hz"), [RIGHT, LEFT], starts=1)
        assert found.status == "found"
        assert found.known.error is not None
        J = found.slopes / width
        assert found.known.error == pytest.approx(np.sqrt(np.diag(np.linalg.inv(J.T @ J))))
        assert found.known.rises == pytest.approx(np.ones((2, 2)), abs=0.02)
        assert np.isnan(found.ends).all()
        half.append(found.known.error)
    assert half[1] == pytest.approx(2.0 * half[0])


def test_an_interval_that_is_not_of_first_order_is_the_profile_s(scene: ForcedScene) -> None:
    """Ends at which the number is off by its half-width, where first order has others."""
    made, width = numbers(scene, "stuck_in_phase", [RIGHT], [1.0])[0], 2.0
    found = upd.fit(scene, f"stuck_in_phase={made:.12g} Hz +- {width} Hz", [RIGHT], starts=1)
    (ends,) = found.ends
    assert found.known.rises is not None and found.known.error is not None
    first = found.answers[0][0] + np.array([-1.0, 1.0]) * found.known.error[0]
    off = [
        numbers(scene, "stuck_in_phase", [RIGHT], [math.exp(z)])[0] - made for z in (*ends, *first)
    ]
    told = np.abs(off) / width
    assert told[:2] == pytest.approx(1.0, abs=0.02)
    assert np.abs(told[2:] - 1.0).max() > 0.1
    assert "By profiles, in the same multiple" in " ".join(found.table().split())


def test_the_slope_of_a_peak_with_friction_is_that_of_differences(scene: ForcedScene) -> None:
    targets = read_targets(["peak_2_accelerance@100=1 (m/s2)/N"])
    responses = FitResponses(scene, targets, read_parameters(scene, ["contact.friction"]))
    slope = responses.at(np.zeros(1))[1]
    # the next point begins to slip at a change of 0.6 %
    change = responses.value(np.array([0.004])) - responses.value(np.array([-0.004]))
    assert slope[:, 0] == pytest.approx(change / 0.008, rel=1e-2)


def test_what_a_target_within_limits_cannot_tell_is_unknown(scene: ForcedScene) -> None:
    """With half-widths a direction is unknown when no residual moves by one over the bounds."""
    vary = [f"{RIGHT}=x0.99:x1.01", LEFT]
    parameters = read_parameters(scene, vary)
    for width, unknown in (("20 Hz", 1), ("0.001 Hz", 0)):
        targets = read_targets(MODES.format(400.0, 420.0, w=f" +- {width}"))
        residuals = Residuals(FitResponses(scene, targets, parameters))
        assert knowledge(residuals, np.zeros(2)).unknown.sum() == unknown


def test_targets_out_of_reach_end_with_1_and_the_nearest(
    small: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["fit", "asymmetric-response", "--to", "stuck_in_phase=600 Hz", "--vary", RIGHT]
    for key, value in small.items():
        arguments += ["--set", f"{key}={json.dumps(value)}"]
    with pytest.raises(SystemExit) as end:
        cli.main([*arguments, "--out", str(tmp_path / "fit"), "--starts", "2"])
    assert end.value.code == 1
    told = capsys.readouterr().out
    assert "not reached; the nearest inputs have stuck_in_phase" in " ".join(told.split())
    assert " (bound)" in told
    fitted = (tmp_path / "fit" / "asymmetric-response-fitted.toml").read_text("utf-8")
    assert fitted.startswith("# asymmetric-response: not reached")
    right = tomllib.loads(fitted)["stiffness"]["thesis"]["right"]["K_T"]
    assert float(right.split()[0]) > 1e7


def test_all_that_is_wrong_is_told_at_once(scene: ForcedScene) -> None:
    with pytest.raises(InputError) as told:
        upd.fit(
            scene,
            "stuck_in_phase=377 N,peak=3 Hz,stuck_out_of_phase=440 Hz +- 1 Hz",
            [
                "contact.frction",
                f"{LEFT}=1e5 N/mm:1e4 N/mm",
                "material.nu",
                RIGHT,
                f"{RIGHT}+{NORMAL}",
                "reduction.modes",
            ],
        )
    text = str(told.value)
    for part in (
        "stuck_in_phase: 'N' is a unit of force",
        "peak: is no number that can be fitted",
        "Known: stuck_in_phase, stuck_out_of_phase, free_",
        "contact.frction: is no scalar input of the scene; did you mean contact.friction",
        "write two values above 0, the lower one first",
        "material.nu: the scene refuses 0.6",
        f"{RIGHT}: varied twice",
        "reduction.modes: is no scalar input",
    ):
        assert part in text, part
    with pytest.raises(InputError, match="stuck_in_phase: no half-width, though others have one"):
        read_targets("stuck_in_phase=377 Hz,stuck_out_of_phase=440 Hz +- 1 Hz")
    with pytest.raises(InputError, match="a fit needs a forced response"):
        upd.fit("hertz", "stuck_in_phase=377 Hz", "material.E")
    with pytest.raises(InputError, match=r"set contact\.model"):
        whole = replace(scene, contact=replace(scene.contact, model="interface"))
        upd.fit(whole, "stuck_in_phase=377 Hz", RIGHT)
    with pytest.raises(InputError, match="parameters of several contact stiffnesses"):
        upd.fit(scene, "stuck_in_phase=377 Hz", [RIGHT, "stiffness.own.left.K_T"])


def test_what_only_moves_springs_reuses_the_reduced_blades(
    scene: ForcedScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    from upd.fitting import responses as home

    made = []
    real = home.make_bodies
    monkeypatch.setattr(home, "make_bodies", lambda plan: made.append(plan) or real(plan))
    upd.fit(scene, "stuck_in_phase=390 Hz", [LEFT], starts=2)
    assert len(made) == 1


def test_halton_starts_are_the_same_every_time(scene: ForcedScene) -> None:
    residuals = Residuals(
        FitResponses(scene, read_targets("stuck_in_phase=1 Hz"), read_parameters(scene, [LEFT]))
    )
    first, second = residuals.starts(5), residuals.starts(5)
    assert np.array_equal(first, second)
    assert first[0] == pytest.approx([0.0])
    assert all(abs(z[0]) < math.log(100.0) for z in first)
