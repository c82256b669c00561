"""Forced responses with both faces node by node: scenes, static states, limits, what is refused."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

import upd
from upd.errors import InputError
from upd.report.notebook import RunResult, charts
from upd.scene import load_scene

TOY: Mapping[str, Any] = {
    "contact.model": "interface",
    "mesh.element": "hex8i",
    "geometry.patch_along_y": 4,
    "geometry.patch_along_slope": 2,
    "balance.method": "march",
    "want": ["response", "contact_state", "hysteresis", "damper_motion"],
    "excitation.start": "440 Hz",
    "excitation.stop": "475 Hz",
    "excitation.points": 40,
}


def run(**changes: Any) -> RunResult:
    return upd.run("symmetric-response", overrides=TOY | changes)


def array(variable: Any) -> Any:
    """Of a run just made, or of one read."""
    return np.asarray(variable[1] if isinstance(variable, tuple) else variable.data)


@pytest.fixture(scope="module")
def stuck() -> RunResult:
    return run(**{"excitation.centrifugal_to_force": [1e6]})


def test_a_small_force_finds_the_stuck_response(stuck: RunResult) -> None:
    """Without slip the sweeps are the linear response: worn faces that stick are glued."""
    case = "interface, F_C/F_E 1e+06, in phase"
    wanted = "interface, stuck, in phase"
    assert stuck.value("peak_1_frequency", case) == pytest.approx(
        stuck.value("peak_1_frequency", wanted), rel=5e-4
    )
    assert stuck.value("peak_1_accelerance", case) == pytest.approx(
        stuck.value("peak_1_accelerance", wanted), rel=1e-2
    )
    told = next(r for r in stuck.results if r.name == "peak_1_frequency" and r.case == case)
    assert told.low is None
    assert "alike" in told.why
    states = stuck.arrays["sweep interface, F_C/F_E 1e+06, sweep up"]["share"]
    assert array(states)[:, 0] == pytest.approx(1.0)


def test_the_faces_carry_the_damper(stuck: RunResult) -> None:
    """On slopes of 45 degrees without friction each face carries F_C / sqrt 2."""
    for side in ("left", "right"):
        case = f"interface, frictionless, {side}"
        assert stuck.value("static_N", case) == pytest.approx(350.0 / np.sqrt(2.0), rel=1e-9)
        assert stuck.value("static_T", case) == pytest.approx(0.0, abs=1e-6)
    assert all(c.passed for c in stuck.checks)


def test_a_large_force_slips_and_the_energy_closes() -> None:
    """F_C raised with friction on new faces, where the damper slides all the way."""
    found = run(
        **{
            "contact.fit": "new",
            "contact.static": "seated",
            "excitation.centrifugal_to_force": [300.0],
            "excitation.start": "440 Hz",
            "excitation.stop": "450 Hz",
        }
    )
    T, N = (found.value(f"static_{k}", "interface, seated, right") for k in "TN")
    assert pytest.approx(0.6 * N, rel=1e-4) == T
    checks = {c.name: c for c in found.checks}
    assert checks["static balance"].passed
    assert checks["sweep energy"].passed
    group = found.arrays["sweep interface, F_C/F_E 300, sweep up"]
    loss = array(group["energy"])[:, 2]
    assert (loss > 0.0).any()
    # node by node at the peaks, of a half model with their images
    assert checks["loss by nodes"].passed
    peaks = found.arrays["marched peaks interface, F_C/F_E 300, sweep down"]
    nodes = array(found.arrays["points interface"]["face"])
    assert array(peaks["state"]).shape == (1, len(nodes), 3)
    case = checks["loss by nodes"].case
    told = found.value("friction_energy", case)
    assert 2.0 * array(peaks["energy"]).sum() == pytest.approx(told, rel=1e-9)
    assert 1e3 * array(peaks["power"]).sum() == pytest.approx(found.value("friction_power", case))
    maps = [c for c in charts(found) if c.figure == "contact_map"]
    assert {c.detail for c in maps} == {"time march, sweep down, 440.0 Hz"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"want": ["response", "performance"]}, "want: performance is of contact points"),
        ({"mesh.element": "hex20"}, 'needs "hex8i"'),
        ({"balance.method": "balance"}, 'write "march" or "auto"'),
        ({"balance.time_march": ["440 Hz"]}, "marched at every frequency"),
        ({"contact.model": "springs", "contact.fit": 0.5}, "is for whole faces"),
        ({"contact.fit": 1.5}, "is no fit of the faces"),
    ],
)
def test_what_does_not_go_together_is_told(changes: Mapping[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        load_scene("symmetric-response", TOY | changes)


def test_states_of_worn_faces_need_worn_faces() -> None:
    with pytest.raises(InputError, match="is a state of faces worn in"):
        run(**{"contact.fit": "new", "contact.static": "opposing"})
    uneven = {"left": 0.1, "right": 0.2}
    with pytest.raises(InputError, match="one T/N for both"):
        run(**{"contact.static": uneven})
