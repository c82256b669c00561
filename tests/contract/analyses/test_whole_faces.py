"""Forced responses with both faces node by node: scenes, static states, limits, what is refused."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from rigs import LINES

import upd
from upd.analyses import make_plan
from upd.analyses.forced.curves import TOLERANCE
from upd.analyses.forced.interface_model import make_whole_faces
from upd.analyses.forced.statics import static_state
from upd.analyses.seated.bodies import make_bodies
from upd.errors import InputError
from upd.progress import Stages
from upd.report.notebook import RunResult, charts
from upd.scene import load_scene

TOY: Mapping[str, Any] = {
    **LINES,
    "contact.model": "interface",
    "contact.static": "frictionless",
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


def data(variable: Any) -> np.ndarray:
    return np.asarray(variable[1] if isinstance(variable, tuple) else variable.data)


@pytest.fixture(scope="module")
def stuck() -> RunResult:
    near = {"excitation.start": "450 Hz", "excitation.stop": "456 Hz"}
    return run(**near, **{"excitation.centrifugal_to_force": [1e6]})


def test_a_small_force_finds_the_stuck_response(stuck: RunResult) -> None:
    """Without slip the sweeps are the linear response: worn faces that stick are glued."""
    for way in ("up", "down"):
        case = f"interface, F_C/F_E 1e+06, in phase, sweep {way}"
        wanted = "interface, stuck, in phase"
        # points of a sweep 0.15 Hz apart
        assert stuck.value("peak_1_frequency", case) == pytest.approx(
            stuck.value("peak_1_frequency", wanted), rel=5e-4
        )
        assert stuck.value("peak_1_accelerance", case) == pytest.approx(
            stuck.value("peak_1_accelerance", wanted), rel=1e-2
        )
    states = stuck.arrays["sweep interface, F_C/F_E 1e+06, sweep up"]["share"]
    assert data(states)[:, 0] == pytest.approx(1.0)


def test_mass_of_the_whole_damper_though_half_is_meshed(stuck: RunResult) -> None:
    """7800 kg/m3 of 216 mm2 times 42.5 mm."""
    found = next(r.value for r in stuck.results if r.name == "damper_mass")
    assert found == pytest.approx(7.8e-3 * 216.0 * 42.5)


def test_the_damper_swings_about_its_rest(stuck: RunResult) -> None:
    """Without slip its mean is where F_C put it; F_E is a millionth of what did."""
    shifts = [one for one in stuck.results if one.name in {f"damper_u{k}" for k in "xyz"}]
    assert shifts
    for one in shifts:
        still = [
            abs(r.value)
            for r in stuck.results
            if r.case == one.case and r.name.startswith("damper_u") and r.name.endswith("_static")
        ]
        swing = max(r.value for r in shifts if r.case == one.case)
        assert max(still, default=0.0) < TOLERANCE * swing


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
            "excitation.start": "425 Hz",
            "excitation.stop": "450 Hz",
            "excitation.points": 26,
        }
    )
    T, N = (found.value(f"static_{k}", "interface, seated, right") for k in "TN")
    assert pytest.approx(0.6 * N, rel=1e-4) == T
    checks = {c.name: c for c in found.checks}
    assert checks["sweep energy"].passed
    group = found.arrays["sweep interface, F_C/F_E 300, sweep up"]
    loss = data(group["energy"])[:, 2]
    assert (loss > 0.0).any()
    # node by node at the peaks, of a half model each with its image
    peaks = found.arrays["marched peaks interface, F_C/F_E 300, sweep down"]
    nodes = data(found.arrays["points interface"]["face"])
    assert data(peaks["state"]).shape == (1, len(nodes), 3)
    case = next(
        r.case for r in found.rows if r.name == "friction_energy" and "down" in r.case.choice
    )
    told = found.value("friction_energy", case)
    assert data(peaks["energy"]).sum() == pytest.approx(told, rel=1e-9)
    f = data(peaks["frequency"])[0]
    assert 1e3 * data(peaks["power"]).sum() == pytest.approx(f * told)
    maps = [c for c in charts(found) if c.figure == "contact_map"]
    for way in ("up", "down"):
        f = found.value("peak_2_frequency", f"interface, F_C/F_E 300, out of phase, sweep {way}")
        assert f"time integration, sweep {way}, {f:.1f} Hz" in {c.detail for c in maps}


def test_the_balance_of_a_small_force_is_the_stuck_response() -> None:
    found = run(
        **{
            "balance.method": "balance",
            "excitation.centrifugal_to_force": [1e6],
            "want": ["response", "contact_state"],
        }
    )
    case, wanted = "interface, F_C/F_E 1e+06, in phase", "interface, stuck, in phase"
    for blade in ("", "left_"):
        for kind, rel in (("frequency", 5e-4), ("accelerance", 1e-2)):
            name = f"{blade}peak_1_{kind}"
            assert found.value(name, case) == pytest.approx(found.value(name, wanted), rel=rel)
    assert not any(name.startswith("sweep") for name in found.arrays)
    checks = {c.name: c for c in found.checks}
    assert all(checks[k].passed for k in ("path complete", "energy balance"))


def test_balance_and_sweeps_agree_where_nodes_slip_and_open() -> None:
    balanced, marched = (
        run(
            **{
                "balance.method": method,
                "balance.harmonics": 3,
                "want": ["response", "contact_state"],
                "excitation.centrifugal_to_force": [800.0],
                "excitation.start": "449.5 Hz",
                "excitation.stop": "455 Hz",
                "excitation.points": 16,
            }
        )
        for method in ("balance", "march")
    )
    assert balanced.value("contact_slip", "interface, F_C/F_E 800, at peak 1, in phase") > 3.0
    failed = {c.name for c in (*balanced.checks, *marched.checks) if not c.passed}
    # three harmonics are few
    assert not failed - {"truncation"}
    assert "energy balance" in {c.name for c in balanced.checks}
    path = balanced.arrays["friction interface, F_C/F_E 800"]
    swept = marched.arrays["sweep interface, F_C/F_E 800, sweep up"]
    here, there = (
        (data(one["frequency"]), np.linalg.norm(data(one["accelerance_right"]), axis=1))
        for one in (path, swept)
    )
    np.testing.assert_allclose(np.interp(there[0], *here), there[1], rtol=2e-2)
    states = data(path["state"])
    assert states.shape == (len(here[0]), 18, 3)
    np.testing.assert_allclose(states.sum(axis=2), 1.0)
    # the balance's states of both faces over frequency, and the march's at the peak
    np.testing.assert_allclose(data(path["share"]).sum(axis=2), 1.0)
    drawn = [{c.figure for c in charts(one) if c.detail} for one in (balanced, marched)]
    assert all("contact_map" in one for one in drawn)
    lines = [t for c in charts(balanced) for t in c.traces if t.label == "F_C/F_E 800"]
    assert {len(t.x) for t in lines} == {len(here[0])}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"want": ["response", "performance"]},
            "want: contact.model = .interface. has no performance",
        ),
        ({"mesh.element": "hex20"}, 'needs "hex8i"'),
        ({"balance.harmonics": 5, "balance.samples": 8}, "cannot carry harmonic 5"),
        (
            {"balance.method": "balance", "want": ["response", "hysteresis"]},
            "want: hysteresis of whole faces",
        ),
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


def test_worn_faces_carry_each_its_traction() -> None:
    scene = TOY | {"contact.static": {"left": 0.1, "right": 0.2}}
    plan: Any = make_plan(load_scene("symmetric-response", scene))
    found = make_whole_faces(plan, make_bodies(plan), Stages())
    ratio = (found.state.T / found.state.N).tolist()
    assert ratio == pytest.approx([0.1, 0.2], rel=1e-9)
    wanted = static_state(plan, make_bodies(plan))
    assert found.state.N.tolist() == pytest.approx(wanted.N.tolist(), rel=1e-9)
