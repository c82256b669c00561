"""The calibrated examples: frequencies fitted, heights predicted, and the scenes say so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import upd
from upd.fitting import FitResponses, read_parameters, read_targets
from upd.reference import THESIS_FREQUENCIES
from upd.scene import load_scene

EXAMPLES = Path(upd.__file__).parent / "scenes" / "examples"
ASYMMETRIC, SYMMETRIC = (
    EXAMPLES / f"calibrated_{damper}.toml" for damper in ("asymmetric", "symmetric")
)
#: coarser than what was fitted: the frequencies are 1 % higher
COARSE = {"mesh.element": "hex20", "geometry.refine": 0.5, "reduction.modes": 4}
MEASURED = THESIS_FREQUENCIES["experiment_asymmetric"]


@pytest.mark.parametrize("path", [ASYMMETRIC, SYMMETRIC], ids=lambda path: path.stem)
def test_scene_plans_and_says_what_is_predicted(path: Path) -> None:
    scene = load_scene(path)
    plan = upd.make_plan(scene)
    assert plan.scene.want == ("response",)
    assert "frequencies fitted, heights predicted" in scene.title
    text = path.read_text("utf-8")
    assert "heights are predictions" in text
    assert "Neither fitted nor measured: friction" in text


def test_stuck_frequencies_are_the_measured_ones_by_the_fit() -> None:
    """Linear alone; with the stiffnesses before the fit they are not."""
    scene = load_scene(ASYMMETRIC, COARSE)
    before = load_scene("asymmetric-response").stiffness["thesis"]
    after = scene.stiffness["fitted"]
    targets = read_targets("stuck_in_phase=1 Hz,stuck_out_of_phase=1 Hz")
    names = [("right", "K_N"), ("right", "K_T"), ("left", "K_T")]
    vary = read_parameters(scene, [f"stiffness.fitted.{side}.{k}" for side, k in names])
    to_before = [getattr(getattr(before, s), k) / getattr(getattr(after, s), k) for s, k in names]
    responses = FitResponses(scene, targets, vary)
    assert responses.at(np.zeros(3))[0] == pytest.approx(MEASURED, rel=0.02)
    assert responses.at(np.log(to_before))[0][0] > 1.05 * MEASURED[0]
