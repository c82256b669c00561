"""A body with a yield stress is checked against it, one without is not."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from functools import cache
from typing import Any

import pytest

from upd.analyses import analysis_of, make_plan
from upd.progress import Stages
from upd.reference import contact_modulus, hertz_sphere, hertz_yield_point
from upd.results import Check
from upd.scene import load_scene

SPHERE = {
    "want": ["normal", "tangential"],
    "geometry.divisions": 10,
    "geometry.patch": "auto",
    "loads.normal": ["200 N"],
    "loads.tangential": [0.5],
    "left_out.solve": "no",
}
DAMPER = {
    "want": ["normal", "tangential"],
    "geometry.divisions": 4,
    "geometry.divisions_long": 8,
    "geometry.growth": 1.6,
    "loads.normal": ["155 N"],
    "loads.tangential": [0.5],
    "loads.directions": ["y"],
    "left_out.solve": "no",
}
TOYS = {"hertz": SPHERE, "symmetric": DAMPER}


@cache
def solved(name: str) -> Any:
    """The toy without a yield stress."""
    scene: Any = load_scene(name, TOYS[name])
    return analysis_of(scene).solve(make_plan(scene), Stages())


def checks(name: str, **limits: float) -> dict[tuple[str, str], Check]:
    """The yield checks of a toy by body and load, with yield stresses in MPa."""
    solution = solved(name)
    plan = solution.plan
    materials = {
        body: replace(m, yield_stress=limits.get(body)) for body, m in plan.scene.materials.items()
    }
    limited = copy(solution)
    limited.plan = replace(plan, scene=replace(plan.scene, materials=materials))
    found = analysis_of(plan.scene).check_solution(limited)
    return {
        (c.case.body, "T" if c.case.ratio else "N"): c for c in found if c.name == "onset of yield"
    }


@pytest.mark.parametrize("name", TOYS)
def test_without_a_yield_stress_nothing_is_checked(name: str) -> None:
    assert checks(name) == {}


def test_a_soft_sphere_yields_and_a_hard_block_does_not() -> None:
    found = checks("hertz", sphere=1600.0, block=3000.0)
    assert set(found) == {("sphere", "N"), ("sphere", "T"), ("block", "N"), ("block", "T")}
    p0 = hertz_sphere(200.0, 5.0, contact_modulus(200e3, 0.3, 200e3, 0.3)).max_pressure
    stress = hertz_yield_point(0.3)[0] * p0
    soft, hard = found["sphere", "N"], found["block", "N"]
    assert soft.value == pytest.approx(stress / 1600.0)
    assert (soft.verdict, hard.verdict) == ("warning", "passed")
    assert hard.value == pytest.approx(stress / 3000.0)
    assert "yields from" in soft.says and soft.limit == 1.0
    # friction never relieves
    assert found["block", "T"].value >= hard.value


def test_a_flat_contact_is_checked_by_its_own_pressure() -> None:
    hard, soft = checks("symmetric", damper=300.0), checks("symmetric", damper=0.1)
    assert set(hard) == {("damper", "N"), ("damper", "T")}
    for case, check in hard.items():
        assert (check.verdict, soft[case].verdict) == ("passed", "warning")
        assert soft[case].value == pytest.approx(3000.0 * check.value)
    # 155 N over 15 x 42.5 mm2 is 0.24 MPa; its stress is of that size
    assert 0.1 < 300.0 * hard["damper", "N"].value < 2.0
    assert "friction" in hard["damper", "T"].says and "leaves open" in hard["damper", "T"].says
