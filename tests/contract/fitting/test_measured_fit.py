"""Fits of measured curves and of peaks with friction: what made synthetic data is recovered, noise
is estimated, a fit that was stopped goes on, and further measurements are ranked.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import upd
from upd.errors import InputError
from upd.fitting import (
    CurveTarget,
    Fit,
    FitResponses,
    Residuals,
    Targets,
    knowledge,
    read_parameters,
    read_targets,
)
from upd.fitting.residuals import rank_measurements
from upd.fitting.targets import fitted_scene
from upd.measured import MeasuredCurve
from upd.scene import ForcedScene, load_scene

RIGHT, LEFT = "stiffness.thesis.right.K_T", "stiffness.thesis.left.K_T"
VARY, FACTORS = [RIGHT, "contact.friction"], [0.7, 0.8]
FREQUENCIES = np.linspace(300.0, 480.0, 41)


@pytest.fixture(scope="module")
def scene(small: dict[str, Any]) -> ForcedScene:
    found: ForcedScene = load_scene(
        "asymmetric-response", small | {"excitation.centrifugal_to_force": [194.0]}
    )
    return found


@pytest.fixture(scope="module")
def like(scene: ForcedScene) -> FitResponses:
    """Whose blades all others take."""
    return FitResponses(scene, read_targets("stuck_in_phase=1 Hz"), read_parameters(scene, VARY))


def blank(**state: Any) -> CurveTarget:
    curve = MeasuredCurve(FREQUENCIES, np.ones(len(FREQUENCIES), complex), **state)
    return CurveTarget(state.get("state") or "damped", curve)


@pytest.fixture(scope="module")
def data(scene: ForcedScene, like: FitResponses) -> list[MeasuredCurve]:
    """A stuck and a damped curve of moved inputs."""
    targets = Targets((), (blank(state="stuck"), blank(force_ratio=194.0)))
    made = FitResponses(scene, targets, read_parameters(scene, VARY), like=like)
    parts = made.value(np.log(FACTORS)).reshape(2, 2, -1)
    return [
        MeasuredCurve(FREQUENCIES, H, state=one.curve.state, force_ratio=one.curve.force_ratio)
        for one, H in zip(targets.curves, parts[:, 0] + 1j * parts[:, 1], strict=True)
    ]


def test_moved_contacts_are_those_of_the_scene_read_again(
    scene: ForcedScene, like: FitResponses
) -> None:
    """Stiffness and friction move without a new model: its curves are those of a new one."""
    targets = Targets((), (blank(state="stuck"), blank(force_ratio=194.0)))
    moved = FitResponses(scene, targets, read_parameters(scene, VARY), like=like)
    here = moved.value(np.zeros(2))
    there = moved.value(np.log(FACTORS))
    again = fitted_scene(scene, read_parameters(scene, VARY), np.log(FACTORS))
    assert again.contact.friction == pytest.approx(0.8 * scene.contact.friction)
    new = FitResponses(again, targets, read_parameters(again, VARY), like=like)
    value = new.value(np.zeros(2))
    assert there == pytest.approx(value, rel=1e-8, abs=1e-8 * np.abs(value).max())
    assert np.abs(there - here).max() > 0.01 * np.abs(here).max()


def test_what_a_curve_leaves_out_is_told_once(
    scene: ForcedScene, like: FitResponses, caplog: pytest.LogCaptureFixture
) -> None:
    made = FitResponses(
        scene, Targets((), (blank(force_ratio=194.0),)), read_parameters(scene, VARY), like=like
    )
    for _ in range(3):
        made.value(np.zeros(2))
    assert made.made == 3
    found = [one for one in caplog.records if "omitted harmonics" in one.getMessage()]
    assert len(found) == 1


def written(path: Path, curve: MeasuredCurve) -> Path:
    lines = [
        f"{f!r},{H.real!r},{H.imag!r}"
        for f, H in zip(curve.frequency.tolist(), curve.accelerance.tolist(), strict=True)
    ]
    head = "frequency [Hz],accelerance real [(m/s2)/N],accelerance imaginary [(m/s2)/N]"
    path.write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def noisy(
    scene: ForcedScene, data: list[MeasuredCurve], tmp_path_factory: pytest.TempPathFactory
) -> Fit:
    """A fit of files with 1 % noise, with its folder."""
    folder, rng = tmp_path_factory.mktemp("noisy"), np.random.default_rng(4)
    to = []
    for name, one in zip(("stuck", "194"), data, strict=True):
        H = one.accelerance
        error = rng.standard_normal(len(H)) + 1j * rng.standard_normal(len(H))
        made = MeasuredCurve(FREQUENCIES, H + 0.01 * np.abs(H) * error)
        to.append(f"{name}={written(folder / f'{name}.csv', made)}")
    return upd.fit(scene, to, VARY, starts=1, out=folder / "fit")


def test_curves_with_friction_are_recovered(scene: ForcedScene, data: list[MeasuredCurve]) -> None:
    found = upd.fit(scene, data, VARY, starts=1)
    assert found.status == "found"
    assert np.exp(found.answers[0]) == pytest.approx(FACTORS, rel=1e-6)


def test_noise_is_estimated_and_the_intervals_are_its_own(
    noisy: Fit, data: list[MeasuredCurve]
) -> None:
    for one, exact in zip(noisy.measured, data, strict=True):
        assert one.estimated
        assert one.white
        # 95 % of the errors lie within it, to three standard deviations of that share of 82 values
        half = np.hypot(one.relative * exact.magnitude, one.constant)
        error = one.target.curve.accelerance - exact.accelerance
        inside = np.abs([error.real, error.imag]) <= half
        assert 0.878 <= inside.mean() <= 1.0
        assert float((half / exact.magnitude).min()) > 0.01
        assert float((half / exact.magnitude).max()) < 0.04
    assert noisy.known.error is not None
    off = np.abs(noisy.answers[0] - np.log(FACTORS))
    assert (off < 2.5 * noisy.known.error).all()
    assert (noisy.known.error < 0.05).all()
    assert "(estimated)" in noisy.table() and "95 % intervals" in noisy.table()


def test_the_folder_has_page_summary_and_scene(noisy: Fit) -> None:
    assert noisy.folder is not None
    summary = json.loads((noisy.folder / "summary.json").read_text("utf-8"))
    inputs = summary["tables"][0]["rows"]
    assert [row[0] for row in inputs] == VARY
    fitted, low, high = inputs[0][3:]
    assert low < fitted < high
    assert fitted == noisy.value(RIGHT)
    page = (noisy.folder / "report.html").read_text("utf-8")
    for part in ("Inputs", "Next measurement", "Scene file"):
        assert f"<h2>{part}</h2>" in page
    scene = load_scene(noisy.folder / "asymmetric-response-fitted.toml")
    assert scene.contact.friction == pytest.approx(noisy.value("contact.friction"))
    assert max(map(len, noisy.table().splitlines())) <= 80


def test_a_fit_that_was_stopped_goes_on(
    scene: ForcedScene,
    data: list[MeasuredCurve],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What was found before is not solved again, and the answer is the same; then it is removed."""
    monkeypatch.setenv("UPD_CACHE", str(tmp_path))
    real, count = FitResponses.solved_at, [0]

    def stopped(self: FitResponses, z: np.ndarray) -> Any:
        count[0] += 1
        if count[0] > 4:
            raise KeyboardInterrupt
        return real(self, z)

    monkeypatch.setattr(FitResponses, "solved_at", stopped)
    with pytest.raises(KeyboardInterrupt):
        upd.fit(scene, data, VARY, starts=1)
    assert len(list(tmp_path.glob("fit-*.jsonl"))) == 1
    monkeypatch.setattr(FitResponses, "solved_at", real)
    told: list[str] = []
    found = upd.fit(scene, data, VARY, starts=1, progress=lambda _, text, __: told.append(text))
    assert "continues from 4 evaluations of an earlier call" in told
    assert np.exp(found.answers[0]) == pytest.approx(FACTORS, rel=1e-6)
    assert not list(tmp_path.glob("fit-*.jsonl"))


def test_further_measurements_are_ranked_by_what_they_leave(
    scene: ForcedScene, like: FitResponses
) -> None:
    """One stuck frequency cannot tell two stiffnesses: each number's worth is that of adding it."""
    vary = [f"{RIGHT}=x0.1:x10", f"{LEFT}=x0.1:x10"]
    parameters = read_parameters(scene, vary)
    to = "stuck_in_phase=400 Hz +- 0.4 Hz"
    targets = read_targets(to)
    residuals = Residuals(FitResponses(scene, targets, parameters, like=like))
    none = np.zeros(2)
    today, ranked = rank_measurements(residuals, none)
    widest = [then for _, _, then in ranked]
    assert widest == sorted(widest) and widest[-1] <= today
    ((one, then),) = [(m, then) for m, _, then in ranked if m.name == "stuck_out_of_phase"]
    both = read_targets(f"{to},stuck_out_of_phase=430 Hz +- {one.half_width!r} Hz")
    J = Residuals(FitResponses(scene, both, parameters, like=like)).jacobian(none)
    room = np.log(10.0) * np.eye(2)
    left = np.linalg.inv(J.T @ J + np.linalg.inv(room @ room))
    assert np.log(then) == pytest.approx(np.sqrt(np.linalg.eigvalsh(left)[-1]), rel=1e-6)


def test_contact_totals_and_curves_weigh_together(scene: ForcedScene, like: FitResponses) -> None:
    """A total known to 5 % beside a curve known to 2 % of its values."""
    curve = blank(state="stuck")
    targets = Targets(
        read_targets("K_T=1.5e5 N/mm +- 5 %").numbers,
        (CurveTarget("stuck", curve.curve, relative=0.02),),
    )
    parameters = read_parameters(scene, [RIGHT])
    residuals = Residuals(FitResponses(scene, targets, parameters, like=like))
    J = residuals.jacobian(np.zeros(1))
    assert J[0, 0] == pytest.approx(20.0, rel=2e-3)
    assert residuals.scale[1:] == pytest.approx(0.02)
    assert knowledge(residuals, np.zeros(1)).error is not None


def test_targets_that_cannot_be_are_told_at_once(
    scene: ForcedScene, small: dict[str, Any], tmp_path: Path
) -> None:
    bare = tmp_path / "curve.csv"
    bare.write_text("frequency [Hz],accelerance [(m/s2)/N]\n1,1\n2,2\n3,1\n", "utf-8")
    with pytest.raises(InputError) as told:
        read_targets(
            f"peak_1_frequency=3 Hz,stuck_in_phase@194=3 Hz,{bare},measured,stuck={bare} +- 0 %,"
            "measured.x,free=",
            scene,
        )
    text = str(told.value)
    for part in (
        "peak_1_frequency: needs its F_C/F_E; write peak_1_frequency@194",
        "stuck_in_phase@194: has no F_C/F_E; write stuck_in_phase",
        f"{bare}: is no number that can be fitted",
        "files of measured curves as free=, stuck= or F_C/F_E=FILE",
        "the scene's [measured] has no such curve; it has: none",
        "is no half-width above 0",
        "free: names no file",
    ):
        assert part in text, part
    with pytest.raises(InputError, match="no half-width, though others have one or are curves"):
        read_targets(f"stuck_in_phase=3 Hz,stuck={bare}")
