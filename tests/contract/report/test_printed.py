"""Printed values are found for the bodies and the load they were printed of, and for no others."""

from __future__ import annotations

from dataclasses import dataclass, replace

import pytest

from upd.analyses.base import printed_of, with_printed
from upd.analyses.contact.results import printed_of as flat_printed_of
from upd.analyses.forced.plan import make_plan
from upd.analyses.forced.results import printed_of as forced_printed_of
from upd.reference import THESIS_FREQUENCIES, printed_values
from upd.results import Case, Result
from upd.scene import load_scene


@dataclass(frozen=True)
class Steel:
    E: float = 2.0e5
    nu: float = 0.3


#: a scene that asks for no contact analysis
THESIS_ONLY = {"contact.stiffness": ["thesis"]}
SPHERE = {"recipe": "sphere_block", "radius": 5.0, "block": 10.0}


def test_a_load_of_the_printed_sphere() -> None:
    printed = printed_values("sphere_block", SPHERE, [Steel(), Steel()])
    ((value, source),) = printed("radius_area", {"load": 50.0})
    assert value == pytest.approx(117.0)
    assert source == "thesis, Table VII"
    assert printed("contact_area_nodes", {"load": 200.0})[0][0] == pytest.approx(1.131e5)
    (corrected,) = printed("approach_within_3a", {"load": 200.0})
    assert corrected == (pytest.approx(6.50), "thesis, Table IX")
    (stiffness,) = printed("K_N_tangent_3a", {"load": 50.0})
    assert stiffness == (pytest.approx(3.3e4), "thesis, Table X")
    # The approach at the distant sets is that of Table VIII, not the corrected one.
    assert printed("approach", {"load": 200.0})[0][0] == pytest.approx(6.98)


@pytest.mark.parametrize(
    ("recipe", "geometry", "material", "case"),
    [
        ("sphere_block", SPHERE, Steel(), {"load": 60.0}),
        ("sphere_block", SPHERE, replace(Steel(), E=2.1e5), {"load": 50.0}),
        ("sphere_block", SPHERE | {"radius": 6.0}, Steel(), {"load": 50.0}),
        ("own.py", SPHERE, Steel(), {"load": 50.0}),
    ],
)
def test_other_bodies_and_loads_have_none(
    recipe: str, geometry: dict[str, float], material: Steel, case: dict[str, float]
) -> None:
    assert printed_values(recipe, geometry, [Steel(), material])("max_pressure", case) == ()


def test_a_printed_value_is_reference_or_has_an_error_against_it() -> None:
    case = Case(load=154.7)
    damper = with_printed(
        [Result("K_Tx_initial_raw", case, 5e5, "N/mm")], printed_values("wedge_platform", {}, [])
    )[0]
    assert (damper.reference, damper.source, damper.exact) == (4.90e5, "thesis, Table XI", False)
    exact = Result("max_pressure", Case(load=50.0), 1700.0, "MPa", 1672.0, "Hertz")
    sphere = with_printed([exact], printed_values("sphere_block", SPHERE, [Steel(), Steel()]))[0]
    assert (sphere.reference, sphere.source, sphere.exact) == (1672.0, "Hertz", True)
    assert sphere.printed_error == pytest.approx(1800.0 / 1672.0 - 1.0)


def test_frequencies_of_the_rig() -> None:
    free = printed_values("blade_rig", {"arrangement": "asymmetric"}, [Steel()])
    assert free("f3_free", {"kind": "free", "arrangement": "asymmetric"})[0][0] == 784.06
    assert free("f1_glued", {"kind": "glued", "arrangement": "asymmetric"}) == ()
    assert [
        value for value, _ in free("peak_frequency", {"stiffness": "own", "force_ratio": 194.0})
    ] == [377.0, 440.0]
    assert [value for value, _ in free("peak_frequency", {"kind": "free"})] == list(
        THESIS_FREQUENCIES["experiment_free"]
    )
    assert free("peak_frequency", {"kind": "stuck"}) == ()


CONTACTS = {"symmetric": ("K_N_secant_raw", 155.0), "asymmetric": ("K_N_per_pad", 303.0)}


@pytest.mark.parametrize("name", CONTACTS)
def test_a_damper_has_printed_values_only_as_it_was_printed(name: str) -> None:
    number, load = CONTACTS[name]
    given = load_scene(name)
    assert len(flat_printed_of(given)(number, {"load": load})) == 1
    # to the newton that is printed
    assert len(flat_printed_of(given)(number, {"load": load - 0.4})) == 1
    assert flat_printed_of(given)(number, {"load": load + 1.0}) == ()
    for meshed in (
        {"geometry.divisions": 4},
        {"mesh.element": "hex20"},
        {"solver.name": "superlu"},
    ):
        assert len(flat_printed_of(load_scene(name, meshed))(number, {"load": load})) == 1
    for other in (
        {"geometry.thickness": "30 mm"},
        {"geometry.wire_position": "12 mm"},
        {"materials.damper.E": "210 GPa"},
        {"materials.platform.nu": 0.29},
    ):
        assert flat_printed_of(load_scene(name, other))(number, {"load": load}) == ()


def test_a_rig_has_printed_values_only_as_it_was_printed() -> None:
    case = {"kind": "free", "arrangement": "symmetric"}
    assert len(printed_of(load_scene("rig"))("f1_free", case)) == 1
    assert len(printed_of(load_scene("rig", {"geometry.refine": 2}))("f1_free", case)) == 1
    for other in (
        {"geometry.core_length": "140 mm"},
        {"geometry.clamped": "bottom"},
        {"material.density": "7850 kg/m3"},
    ):
        assert printed_of(load_scene("rig", other))("f1_free", case) == ()


def test_a_response_has_measured_peaks_only_under_the_loads_of_the_measurement() -> None:
    def found(kind: str = "", **changes: object) -> int:
        plan = make_plan(load_scene("asymmetric-response", {**THESIS_ONLY, **changes}))
        case = {"kind": kind} if kind else {"force_ratio": 194.0}
        return len(forced_printed_of(plan)("peak_frequency", case))

    assert (found(), found("free")) == (2, 1)
    assert found(**{"excitation.damping": "1 %", "balance.harmonics": 1}) == 2
    for load in ({"damper.centrifugal": "300 N"}, {"contact.friction": 0.3}):
        assert found(**load) == 0
        assert found("free", **load) == 1
    assert found("free", **{"geometry.core_length": "140 mm"}) == 0
    plan = make_plan(load_scene("asymmetric-response", THESIS_ONLY))
    assert forced_printed_of(plan)("peak_frequency", {"force_ratio": 50.0}) == ()
