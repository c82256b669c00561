"""Hard cases of the shipped scene, each with its physics checked.

Meshes are small, patches sized from the load, mirror symmetry used.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

import upd
from upd.errors import InputError
from upd.reference import contact_modulus, hertz_sphere
from upd.report.notebook import RunResult

NORMAL_ONLY = {
    "want": ["normal"],
    "geometry.patch": "auto",
    "geometry.divisions": 20,
    "geometry.growth": 1.4,
    "left_out.solve": "no",
}
#: what is left out is solved again, as by default
WHOLE = {"left_out__solve": "yes"}


def run(**changes: Any) -> RunResult:
    settings: dict[str, Any] = {
        **NORMAL_ONLY,
        **{k.replace("__", "."): v for k, v in changes.items()},
    }
    return upd.run("hertz", overrides=settings)


def error(result: RunResult, name: str) -> float:
    found = [abs(r.error) for r in result.rows if r.name == name and r.error is not None]
    assert found
    return max(found)


def materials(E1: float, nu1: float, E2: float, nu2: float) -> Mapping[str, Any]:
    return {
        "materials__sphere__E": f"{E1!r} MPa",
        "materials__sphere__nu": nu1,
        "materials__block__E": f"{E2!r} MPa",
        "materials__block__nu": nu2,
    }


def test_nearly_incompressible() -> None:
    result = run(**materials(2e5, 0.499, 2e5, 0.499), loads__normal=["200 N"])
    assert error(result, "max_pressure") < 0.01
    assert error(result, "radius_moment") < 0.02


@pytest.mark.parametrize("ratio", [1e-6, 1e-3, 1e3, 1e6])
def test_stiffness_ratios(ratio: float) -> None:
    E_star = contact_modulus(2e5, 0.3, 2e5 * ratio, 0.3)
    # The load that gives the same contact radius whatever the moduli.
    load = 200.0 * E_star / contact_modulus(2e5, 0.3, 2e5, 0.3)
    result = run(**materials(2e5, 0.3, 2e5 * ratio, 0.3), loads__normal=[f"{load!r} N"])
    assert error(result, "max_pressure") < 0.015
    assert error(result, "radius_moment") < 0.015
    # The stiff body does not move: all of the approach is the soft one's.
    assert error(result, "approach") < 0.03


@pytest.mark.parametrize("load", ["1e-6 N", "1e-3 N", "1 N"])
def test_tiny_loads_with_a_patch_to_fit(load: str) -> None:
    result = run(loads__normal=[load])
    assert error(result, "max_pressure") < 0.01
    assert error(result, "approach") < 0.01


def test_one_node_in_contact() -> None:
    result = run(loads__normal=["1e-6 N"], geometry__patch="1 mm")
    assert result.value("radius_outermost") == 0.0
    lowest = [c for c in result.checks if c.name == "resolution"]
    assert lowest[0].verdict == "warning"
    assert "geometry.patch" in lowest[0].remedy
    force = result.arrays["F=1e-06 N"]["normal_force"][1]
    assert force.max() == pytest.approx(1e-6, rel=1e-12)
    assert np.count_nonzero(force) == 1


def test_patch_overrun_says_the_size_needed() -> None:
    with pytest.raises(InputError, match=r"set geometry\.patch to \"([\d.]+) mm\"") as caught:
        run(loads__normal=["5000 N"], geometry__patch="0.8 mm")
    needed = float(str(caught.value).split('geometry.patch to "')[1].split(" ")[0])
    radius = hertz_sphere(5000.0, 5.0, contact_modulus(2e5, 0.3, 2e5, 0.3)).radius
    assert 2.0 * radius < needed < 4.0 * radius
    assert run(loads__normal=["5000 N"], geometry__patch=f"{needed} mm").status == "ok"


def test_zero_load() -> None:
    result = run(loads__normal=["0 N", "50 N"])
    assert result.status == "ok"
    assert result.value("approach", "F=0 N") == 0.0
    assert result.value("max_pressure", "F=0 N") == 0.0
    assert result.value("max_pressure", "F=50 N") > 1600.0


def test_negative_load_is_refused_before_anything_is_made() -> None:
    with pytest.raises(InputError, match="pulls the bodies apart"):
        run(loads__normal=["-50 N"])


def test_no_friction_is_no_tangential_problem() -> None:
    result = run(want=["normal", "tangential", "cycle"], contact__friction=0.0)
    friction = next(e for e in result.effects if e["name"] == "friction")
    assert not friction["on"]
    assert not friction["applies"]
    assert not any("tangential" in r.name for r in result.rows)
    assert not any("tangential" in stage for stage in result.cost["stages"])


def test_friction_is_left_out_when_nobody_asks() -> None:
    result = run()
    assert (
        next(e for e in result.effects if e["name"] == "friction")["why"] == "no output asks for it"
    )


@pytest.mark.parametrize("ratio", [1e-9, 0.5, 1.0 - 1e-9])
def test_tangential_load_up_to_the_limit(ratio: float) -> None:
    result = run(
        want=["normal", "tangential", "stiffness"],
        geometry__divisions=12,
        loads__normal=["200 N"],
        loads__tangential=[ratio],
        **WHOLE,
    )
    # At the limit tractions that may turn hold less than the limits of all nodes added up: one
    # direction leaves out what matters there, and the run says so.
    warned = {c.name for c in result.checks if not c.passed}
    assert warned == ({"slip in two directions"} if ratio > 0.9 else set())
    if ratio > 0.9:
        assert result.value("stick_radius", f"F=200 N T/muN={ratio:g}") < 30.0


def test_unlike_bodies_with_friction_are_warned_of_or_accepted_on_request() -> None:
    steel_on_rubber = materials(2e5, 0.3, 10.0, 0.3)
    few = {"want": ["normal", "tangential"], "loads__normal": ["0.02 N"], "geometry__divisions": 8}
    warned_of = run(**steel_on_rubber, **few)
    (beta,) = [c for c in warned_of.checks if c.name == "Dundurs beta"]
    assert not beta.passed
    assert not beta.fatal
    assert 'contact.coupling = "coupled"' in beta.remedy
    assert warned_of.value("max_pressure") > 0.0
    accepted = run(
        **steel_on_rubber,
        want=["normal", "tangential"],
        loads__normal=["0.02 N"],
        contact__coupling_limit=0.5,
        **WHOLE,
    )
    # pressure alone lets the rim slip: that is what it costs, and all that the run warns of
    warned = {(c.name, c.quantity) for c in accepted.checks if not c.passed}
    assert warned == {("normal-tangential coupling", "stick_area")}


def test_the_same_scene_in_m_and_in_mm() -> None:
    few = {"want": ["normal", "tangential"], "geometry__divisions": 8}
    mm = run(**few)
    m = run(
        **few,
        geometry__radius="0.005 m",
        geometry__block="0.01 m",
        materials__sphere__E="200e9 Pa",
        materials__block__E="200e9 Pa",
        loads__normal=["0.05 kN", "0.2 kN"],
    )
    for a, b in zip(mm.rows, m.rows, strict=True):
        assert (a.name, a.case) == (b.name, b.case)
        assert a.value == pytest.approx(b.value, rel=1e-9)


def test_everything_a_thousand_times_larger() -> None:
    few = {"want": ["normal", "tangential"], "geometry__divisions": 8}
    small = run(**few, loads__normal=["200 N"])
    large = run(**few, loads__normal=["2e8 N"], geometry__radius="5 m", geometry__block="10 m")
    for a, b in zip(small.rows, large.rows, strict=True):
        scale = {"um": 1e3, "um2": 1e6, "N/mm": 1e3}.get(a.unit, 1.0)
        assert b.value == pytest.approx(scale * a.value, rel=1e-9), a.name


def test_full_half_and_quarter_agree() -> None:
    want = ["normal", "stiffness", "tangential", "cycle"]
    parts = [
        run(want=want, geometry__divisions=8, loads__normal=["200 N"], mesh__symmetry=symmetry)
        for symmetry in ("full", "half", "quarter")
    ]
    for other in parts[1:]:
        for a, b in zip(parts[0].rows, other.rows, strict=True):
            assert b.value == pytest.approx(a.value, rel=1e-6), (a.name, a.case)


def test_slip_in_two_directions_stays_near_one() -> None:
    want = ["normal", "tangential"]
    both = [
        run(
            want=want,
            geometry__divisions=8,
            loads__normal=["200 N"],
            contact__directions=d,
            mesh__symmetry="full",
        )
        for d in (1, 2)
    ]
    one, two = ({(r.name, r.case): r.value for r in result.rows} for result in both)
    for key, value in one.items():
        if key[0] == "tangential_displacement_raw":
            # Johnson, Contact Mechanics, section 7.2: the slip lines turn by about nu / (4 - 2 nu),
            # a few per cent in displacement.
            assert two[key] == pytest.approx(value, rel=0.02)


@pytest.mark.parametrize(
    ("want", "ratios"),
    [
        (["normal", "tangential"], [0.0]),
        (["normal", "tangential"], [0.9, 0.1]),
        (["normal", "stiffness"], [0.2]),
        (["normal", "stiffness"], [0.5, 0.0]),
        (["stiffness", "cycle"], [0.2]),
        (["stiffness", "cycle"], [0.9, 0.1]),
        (["stiffness", "tangential"], [0.0]),
        (["stiffness", "tangential"], [0.5, 0.0]),
    ],
)
def test_every_declared_check_is_made_whatever_is_asked(
    want: list[str], ratios: list[float]
) -> None:
    few = {"geometry__divisions": 8, "loads__normal": ["200 N"]}
    result = run(want=want, loads__tangential=ratios, **few, **WHOLE)
    assert result.status == "ok"
    for effect in result.effects:
        if effect["check"] and not effect["on"]:
            assert effect["verdict"].startswith("passed"), effect
    if "stiffness" in want:
        names = {r.name for r in result.rows}
        assert {"K_T_initial", "K_T_initial_raw", "K_T_over_K_N"} <= names


def test_stiffness_does_not_depend_on_the_order_of_loads() -> None:
    want = ["stiffness", "tangential"]
    one, other = (
        run(want=want, geometry__divisions=8, loads__normal=["200 N"], loads__tangential=q)
        for q in ([0.25, 0.9], [0.9, 0.25])
    )
    assert one.value("K_T_initial") == other.value("K_T_initial")


def test_a_contact_too_large_to_split_keeps_its_other_numbers() -> None:
    result = run(want=["normal", "body_compression"], loads__normal=["21000 N"])
    assert result.status == "ok with warnings: body compression"
    assert [c.verdict for c in result.checks if c.name == "body compression"] == ["warning"]
    assert not any(r.name == "approach_contact" for r in result.rows)
