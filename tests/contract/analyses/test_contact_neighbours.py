"""Neighbouring loads of a curved contact: the numbers a run at such a load has."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from upd.analyses.contact.plan import make_plan
from upd.analyses.contact.results import make_results
from upd.analyses.contact.solve import solve_plan
from upd.analyses.contact.varied import levels, sample
from upd.progress import Stages
from upd.scene import load_scene

pytestmark = pytest.mark.estimated

SMALL: dict[str, Any] = {
    "want": ["normal", "stiffness", "tangential", "cycle"],
    "geometry.patch": "0.6 mm",
    "geometry.divisions": 12,
    "loads.normal": ["50 N"],
    "loads.tangential": [0.5],
    "left_out.solve": "no",
}


def test_samples_are_the_numbers_of_other_loads() -> None:
    plan = make_plan(load_scene("hertz", SMALL))
    solution = solve_plan(plan, Stages())
    found = sample(solution)
    numbers = {(r.name, r.case): r.value for r in make_results(solution) if not r.withheld}
    assert found.keys() == {key for key in numbers if "misfit" not in key[0]}
    for key, rows in found.items():
        assert rows[0].tolist() == [0.0, numbers[key]]
    t = found[next(iter(found))][3, 0]
    load = 50.0 * float(np.exp(t))
    scene = replace(plan.scene, loads=replace(plan.scene.loads, normal=(load,)))
    # the same mesh, which a load may size
    at_load = solve_plan(replace(plan, scene=scene), Stages())
    other = {(r.name, r.case.ratio): r.value for r in make_results(at_load) if not r.withheld}
    # what finite bodies add is in proportion to the load to 2 %, 0.3 % of a main number; what lies
    # beyond 3a is not, and no part of one
    for (name, case), rows in found.items():
        (value,) = rows[rows[:, 0] == t, 1]
        if not {"3a", "far", "finite"} & set(name.split("_")):
            assert value == pytest.approx(other[name, case.ratio], rel=2e-3)


def test_a_contact_at_the_rim_is_no_sample() -> None:
    """The patch of 0.3 mm holds 50 N (a = 0.119 mm) and no edge one spacing farther out."""
    small = SMALL | {"geometry.patch": "0.3 mm", "geometry.divisions": 8, "want": ["normal"]}
    found = sample(solve_plan(make_plan(load_scene("hertz", small)), Stages()))
    (rows,) = (rows for (name, _), rows in found.items() if name == "radius_moment")
    assert 2 < len(rows) < 9


def test_marched_contacts_have_none_and_keep_the_dearest_level() -> None:
    scene = load_scene("hertz", SMALL | {"contact.coupling": "coupled"})
    assert scene.coupled
    plan = make_plan(scene)
    assert len(levels(plan)["mesh"]) == 3
    assert len(levels(make_plan(load_scene("hertz", SMALL)))["mesh"]) == 2
