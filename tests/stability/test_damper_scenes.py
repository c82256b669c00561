"""Hard cases of the damper scenes, each with its physics checked, on coarse meshes of the shipped
geometry.
"""

from typing import Any

import numpy as np
import pytest

import upd
from upd.errors import ConvergenceError, InputError
from upd.report.notebook import RunResult

COARSE = {
    "symmetric": {"geometry.divisions": 6, "geometry.divisions_long": 16, "geometry.growth": 1.6},
    "asymmetric": {"geometry.divisions": 4, "geometry.divisions_long": 10, "geometry.growth": 1.6},
}


def run(scene: str = "symmetric", **changes: Any) -> RunResult:
    given = {k.replace("__", "."): v for k, v in changes.items()}
    return upd.run(scene, overrides={"left_out.solve": "no", **COARSE[scene], **given})


def forces(result: RunResult, label: str, patch: str = "") -> np.ndarray:
    return np.asarray(result.arrays[f"{label} {patch}".strip()]["normal_force"][1])


@pytest.mark.parametrize("scene", ["symmetric", "asymmetric"])
def test_half_is_full(scene: str) -> None:
    """The mirror plane changes no number."""
    half, full = (
        run(scene, mesh__symmetry=s, want=["normal", "stiffness", "tangential"])
        for s in ("half", "full")
    )
    theirs = {(r.name, r.case): r.value for r in full.rows}
    assert theirs.keys() == {(r.name, r.case) for r in half.rows}
    for r in half.rows:
        if r.name != "stick_share":  # nodes of the half: those on the mirror plane count once
            assert r.value == pytest.approx(theirs[r.name, r.case], rel=1e-7, abs=1e-12), r.name


def test_forces_scale_with_the_load() -> None:
    """No gap at the start: the contact set does not depend on the load, and everything else is
    proportional to it.
    """
    result = run(loads__normal=["1 N", "1000 N"], want=["normal", "stiffness"])
    small, large = (forces(result, f"F={F} N") for F in ("1", "1000"))
    assert np.array_equal(small > 0.0, large > 0.0)
    assert large == pytest.approx(1000.0 * small, rel=1e-8, abs=1e-9)


def test_just_touching() -> None:
    with pytest.raises(InputError, match="0 N presses nothing together"):
        run(loads__normal=["0 N"], want=["normal"])
    tiny = run(loads__normal=["1e-9 N"], want=["normal", "stiffness"])
    usual = run(loads__normal=["100 N"], want=["normal", "stiffness"])
    assert tiny.value("K_N_secant_raw") == pytest.approx(usual.value("K_N_secant_raw"), rel=1e-9)


def test_no_slip_at_high_friction_and_full_slip_at_low() -> None:
    loads = {"loads__normal": ["100 N"], "want": ["tangential"]}
    # Corners under almost no pressure slip first: nothing does at a thousandth of the limit.
    sticking = run(contact__friction=2.0, loads__tangential=[0.001], **loads)
    assert all(r.value == pytest.approx(100.0) for r in sticking.rows if r.name == "stick_share")
    slippery = run(contact__friction=1e-6, loads__tangential=[0.001, 0.9], **loads)
    for axis in "xy":
        case = f"F=100 N T_{axis}/muN="
        # Displacements are proportional to mu as long as T / mu N is the same.
        ratio = slippery.value("displacement", case + "0.001") / sticking.value(
            "displacement", case + "0.001"
        )
        assert ratio == pytest.approx(0.5e-6, rel=1e-6)
        assert slippery.value("stick_share", case + "0.9") < 75.0


def test_eccentric_load_lifts_an_edge_when_the_tilt_is_free() -> None:
    """Load line near the lower edge: the upper edge opens, the resultant stays on the load line."""
    result = run(
        contact__tilt="free",
        contact__load_point=["21.25 mm", "2 mm"],
        loads__normal=["100 N"],
        want=["normal", "stiffness"],
    )
    f = forces(result, "F=100 N")
    x, y = (np.asarray(result.arrays["F=100 N"][name][1]) for name in "xy")
    assert f.sum() == pytest.approx(100.0, rel=1e-9)
    assert f.sum(axis=0) @ y / f.sum() == pytest.approx(2.0, abs=1e-6)
    assert f.sum(axis=1) @ x / f.sum() == pytest.approx(21.25, abs=1e-6)
    assert not f[:, -1].any()
    assert f[:, 0].all()
    assert next(c for c in result.checks if c.name == "moment balance").value < 1e-9


def test_corner_load_and_a_load_line_beside_the_patch() -> None:
    result = run(
        contact__tilt="free",
        contact__load_point=["1 mm", "1 mm"],
        loads__normal=["100 N"],
        want=["normal"],
    )
    f = forces(result, "F=100 N")
    assert f[0, 0] > 0.0
    assert not f[f.shape[0] // 2 :].any()
    with pytest.raises(InputError, match="tips over"):
        run(
            contact__tilt="free",
            contact__load_point=["1 mm", "-1 mm"],
            loads__normal=["100 N"],
            want=["normal"],
        )


def test_oblique_load_slips_in_two_directions() -> None:
    """45 deg: the work of the slip circle does not depend on the sense of the load, and |t| never
    exceeds mu f.
    """
    settings = {
        "contact__directions": 2,
        "loads__normal": ["100 N"],
        "loads__tangential": [0.8],
        "want": ["tangential"],
    }
    result = run(loads__directions=["45 deg", "225 deg", "0 deg"], **settings)
    # a node that is at its limit to rounding counts as either: one of 115
    for name, near in (("displacement", {"rel": 1e-8}), ("stick_share", {"abs": 100.0 / 115.0})):
        there, back = (result.value(name, f"F=100 N T_{d}/muN=0.8") for d in ("45deg", "225deg"))
        assert there == pytest.approx(back, **near)
    with pytest.raises(InputError, match=r"contact\.directions = 2"):
        run(loads__directions=["45 deg"], loads__normal=["100 N"], want=["tangential"])


def test_cycle_closes_and_dissipates() -> None:
    result = run(
        loads__normal=["100 N"], loads__directions=["y"], loads__cycle_steps=100, want=["cycle"]
    )
    loop = result.arrays["cycle F=100 N T_y"]
    T, d = (np.asarray(loop[name][1]) for name in ("tangential_force", "displacement"))
    assert T[20] == T[-1]
    assert d[20] == pytest.approx(d[-1], rel=1e-8)
    assert result.value("cycle_energy") > 0.0


def test_pads_at_unequal_height_touch_one_after_the_other() -> None:
    """1 um: one pad carries all of a small load.

    Under a large one the other joins, and the chain gets stiffer.
    """
    settings = {
        "geometry__pad_offset": "1 um",
        "loads__normal": ["1 N", "2000 N"],
        "want": ["normal", "stiffness"],
    }
    result = run("asymmetric", **settings)
    left, right = (forces(result, "F=1 N", side) for side in ("left", "right"))
    assert not left.any()
    assert right.sum() == pytest.approx(1.0, rel=1e-9)
    assert forces(result, "F=2000 N", "left").sum() > 100.0
    assert result.value("K_N_tangent_raw", "F=2000 N") > 1.3 * result.value(
        "K_N_tangent_raw", "F=1 N"
    )


def test_printed_stiffness_is_that_of_one_pad() -> None:
    """From its section 8.4 on the thesis looks at one of the two pads alone."""
    result = run("asymmetric", loads__normal=["303 N"], want=["normal", "stiffness"])
    label = "F=303 N"
    approach = 1e-3 * result.value("approach", label)
    for side in ("left", "right"):
        own = float(forces(result, label, side).sum()) / approach
        assert result.value("K_N_per_pad", label) == pytest.approx(own, rel=1e-9)
    by_name = {r.name: r for r in result.rows}
    for axis in "xy":
        total = by_name[f"K_T{axis}_initial_raw"]
        assert by_name[f"K_T{axis}_per_pad"].value == pytest.approx(total.value / 2.0, rel=1e-12)
        assert (by_name[f"K_T{axis}_per_pad"].reference, total.reference) == (1.50e5, None)
    assert by_name["K_N_per_pad"].reference == 4.71e5
    assert by_name["K_N_per_pad"].source == "thesis, Table XII"
    assert by_name["K_N_secant_raw"].reference is None
    assert not any(r.name.endswith("_per_pad") for r in run(want=["stiffness"]).rows)


def test_peaks_are_compared_with_what_is_printed() -> None:
    """Two spots of high pressure are printed; where the worn areas lie is not."""
    result = run(loads__normal=["155 N"], want=["normal", "worn_zones"])
    found = {r.name: r for r in result.rows}
    assert found["pressure_peaks"].reference == 2.0
    assert found["pressure_peaks"].source == "thesis, section 7.4"
    # "in the lower part of the contact area"
    assert max(found[f"peak_{k}_y"].value for k in (1, 2)) < 7.5


def test_equal_pads_carry_mirror_images() -> None:
    result = run("asymmetric", mesh__symmetry="full", loads__normal=["100 N"], want=["normal"])
    left, right = (forces(result, "F=100 N", side) for side in ("left", "right"))
    assert np.abs(left - right[::-1]).max() <= 1e-9 * right.max()


def test_thin_block_is_stiffer() -> None:
    thin, usual = (
        run(geometry__thickness=t, loads__normal=["100 N"], want=["normal", "stiffness"])
        for t in ("1 mm", "40 mm")
    )
    assert thin.value("K_N_platform_alone") > 5.0 * usual.value("K_N_platform_alone")
    assert thin.value("approach") < usual.value("approach")


def test_a_single_held_node_lets_the_damper_turn() -> None:
    with pytest.raises(ConvergenceError, match="float"):
        run(contact__distant={"damper": "point"}, loads__normal=["100 N"], want=["normal"])


def test_unknown_distant_set_and_body_are_told() -> None:
    with pytest.raises(InputError, match=r"contact\.distant\.damper.*known: .*bands"):
        run(contact__distant={"damper": "band"}, want=["normal"])
    with pytest.raises(InputError, match=r"contact\.distant\.dampr: no such body"):
        run(contact__distant={"dampr": "bands"}, want=["normal"])


def test_a_wedge_that_jams_is_refused_before_anything_is_computed() -> None:
    with pytest.raises(InputError, match=r"loads\.normal: 'reversed': the damper jams"):
        run(contact__friction=1.2, loads__normal=["reversed"])
    with pytest.raises(InputError, match=r"loads\.normal: 'opposing' needs loads\.centrifugal"):
        upd.load_scene({**_table("symmetric"), "loads": {"normal": ["opposing"]}})


def _table(name: str) -> dict[str, Any]:
    import tomllib

    from upd.scene import ready_scenes

    return tomllib.loads(ready_scenes()[name].read_text(encoding="utf-8"))


@pytest.mark.parametrize("bodies", ["both", "upper"])
def test_contact_points_sum_to_the_totals(bodies: str) -> None:
    result = run(
        law__bodies=bodies,
        law__rows=3,
        law__columns=5,
        loads__normal=["100 N"],
        want=["stiffness", "contact_law"],
    )
    assert result.value("law_points") == 15
    assert result.value("law_preload") == pytest.approx(100.0, rel=1e-9)
    k_n = result.value("K_N_secant_raw" if bodies == "both" else "K_N_damper_alone")
    assert result.value("law_k_n") == pytest.approx(k_n, rel=1e-9)
    for axis in "xy":
        k_t = result.value(
            f"K_T{axis}_initial_raw" if bodies == "both" else f"K_T{axis}_damper_alone"
        )
        assert result.value(f"law_k_t{axis}") == pytest.approx(k_t, rel=1e-9)
