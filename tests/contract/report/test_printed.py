"""Printed values are found for the bodies and the load they were printed of, and for no others."""

from __future__ import annotations

from dataclasses import dataclass, replace

import pytest

from upd.analyses.printed import with_printed
from upd.reference import THESIS_FREQUENCIES, printed_values
from upd.results import Case, Result


@dataclass(frozen=True)
class Steel:
    E: float = 2.0e5
    nu: float = 0.3


SPHERE = {"recipe": "sphere_block", "radius": 5.0, "block": 10.0}


def test_a_load_of_the_printed_sphere() -> None:
    printed = printed_values("sphere_block", SPHERE, [Steel(), Steel()])
    (found,) = printed("radius_area", {"load": 50.0})
    assert found.value == pytest.approx(117.0)
    assert found.source == "thesis, Table VII"
    assert printed("contact_area_nodes", {"load": 200.0})[0].value == pytest.approx(1.131e5)
    (corrected,) = printed("approach_within_3a", {"load": 200.0})
    assert (corrected.value, corrected.source) == (pytest.approx(6.50), "thesis, Table IX")
    (stiffness,) = printed("K_N_tangent_3a", {"load": 50.0})
    assert (stiffness.value, stiffness.source) == (pytest.approx(3.3e4), "thesis, Table X")
    # The approach at the distant sets is that of Table VIII, not the corrected one.
    assert printed("approach", {"load": 200.0})[0].value == pytest.approx(6.98)


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
    assert free("f3_free", {"kind": "free", "arrangement": "asymmetric"})[0].value == 784.06
    assert free("f1_glued", {"kind": "glued", "arrangement": "asymmetric"}) == ()
    assert [
        p.value for p in free("peak_frequency", {"stiffness": "own", "force_ratio": 194.0})
    ] == [377.0, 440.0]
    assert [p.value for p in free("peak_frequency", {"kind": "free"})] == list(
        THESIS_FREQUENCIES["experiment_free"]
    )
    assert free("peak_frequency", {"kind": "stuck"}) == ()
