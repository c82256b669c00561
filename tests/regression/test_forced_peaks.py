"""Nonlinear peaks of the two ready rigs, where points slip and lift off.

The ready scenes with fewer frequencies, on the mesh of eight-node solids; points, laws, fit,
damping and forces are the scenes' own. The numbers come from a time march of the same model with
1024 steps a period, started from the answer with nine harmonics at its peak; the tolerance is
twice what the answer with five harmonics differs from it.
"""

import numpy as np
import pytest

from upd.analyses.forced.model import Model, make_bodies, make_model
from upd.analyses.forced.plan import ForcedPlan, make_plan
from upd.analyses.forced.solve import respond
from upd.analyses.forced.stiffness import face_laws
from upd.progress import Stages
from upd.scene import load_scene

#: ready scene -> F_C/F_E, first and last frequency, peak in Hz and (m/s2)/N by time march, what
#: five harmonics may differ from both
PEAKS = {
    # five harmonics: 299.46 Hz, 132.98; nine: 299.58 Hz, 132.95; time march at its peak -0.13 %
    "symmetric-response": [(60.0, 300.0, 345.0, 299.58, 132.78, 1e-3, 4e-3)],
    "asymmetric-response": [
        # 407.71 Hz, 76.92; 407.68 Hz, 76.52; -0.42 %
        (194.0, 400.0, 412.0, 407.68, 76.20, 1e-3, 2e-2),
        # 398.43 Hz, 27.91; 398.26 Hz, 27.66; -1.07 %
        (60.0, 396.0, 412.0, 398.26, 27.37, 1e-3, 4e-2),
    ],
}


def half_rig(name: str) -> tuple[ForcedPlan, Model]:
    """The ready scene on the mesh of eight-node solids."""
    scene = load_scene(name, {"contact.stiffness": ["thesis"], "mesh.element": "hex8i"})
    plan = make_plan(scene)
    laws = face_laws(scene.stiffnesses["thesis"], Stages())
    return plan, make_model(plan, make_bodies(plan), laws)


@pytest.mark.parametrize("name", list(PEAKS))
def test_peaks_with_slip_and_lift_off(name: str) -> None:
    plan, model = half_rig(name)
    row = model.row("right")
    for ratio, low, high, frequency, height, of_frequency, of_height in PEAKS[name]:
        force = plan.scene.damper.centrifugal / ratio
        answer = respond(plan, model, force, np.linspace(low, high, 7), harmonics=range(6))
        assert answer.status == "complete", answer.message
        found, amplitude = answer.peak(row)
        top = int(np.argmax(answer.amplitude(row)))
        assert answer.state[top, :, 2].max() > 0.2, "it lifts off"
        assert found == pytest.approx(frequency, rel=of_frequency)
        accelerance = 1e-3 * (2 * np.pi * found) ** 2 * amplitude / force
        assert accelerance == pytest.approx(height, rel=of_height)
