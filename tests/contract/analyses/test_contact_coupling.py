"""A scene picks normal and tangential contact at once: its numbers are `coupled_contact` by hand,
at full size, and its checks see what breaks it.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from upd.analyses import analysis_of, make_plan
from upd.analyses.contact.plan import COMPONENTS, ContactPlan
from upd.analyses.contact.solution import shear_nodes
from upd.contact import coupled_contact
from upd.contact.coulomb_conditions import STICK
from upd.errors import InputError
from upd.progress import Stages
from upd.results import Result
from upd.scene import as_scene

COUPLED = {"contact.coupling": "coupled", "left_out.solve": "no"}
TOYS: dict[str, tuple[str, dict[str, Any]]] = {
    "flat": (
        "symmetric",
        {
            "want": ["normal", "stiffness", "tangential", "cycle", "curve"],
            "geometry.divisions": 4,
            "geometry.divisions_long": 8,
            "geometry.growth": 1.6,
            "loads.normal": ["155 N"],
            "loads.tangential": [0.5],
            "loads.directions": ["x"],
            "loads.cycle_steps": 40,
            "loads.curve_points": 2,
        },
    ),
    "curved": (
        "hertz",
        {
            "want": ["normal", "stiffness", "tangential", "cycle", "fields"],
            "geometry.divisions": 8,
            "geometry.patch": "auto",
            "loads.normal": ["200 N"],
            "loads.tangential": [0.5],
            "loads.cycle_steps": 40,
        },
    ),
}


@cache
def solved(toy: str, *more: tuple[str, Any]) -> Any:
    scene, overrides = TOYS[toy]
    loaded = as_scene(scene, {**overrides, **COUPLED, **dict(more)})
    return analysis_of(loaded).solve(make_plan(loaded), Stages())


def numbers(solution: Any) -> dict[tuple[str, float | None], Result]:
    found = analysis_of(solution.plan.scene).make_results(solution)
    return {(r.name, r.case.ratio): r for r in found}


def failures(solution: Any) -> set[str]:
    checks = analysis_of(solution.plan.scene).check_solution(solution)
    return {c.name for c in checks if not c.passed}


@pytest.mark.parametrize("toy", TOYS)
def test_the_run_is_coupled_contact_by_hand(toy: str) -> None:
    """The whole compliance in one call: load raised in eight steps and more, then sheared."""
    solution = solved(toy)
    model, scene, mine = solution.model, solution.plan.scene, numbers(solution)
    N, mu = float(scene.loads.normal[0]), scene.contact.friction
    C = np.block([[model.compliance(i, j) for j in COMPONENTS] for i in COMPONENTS])
    way = [t.coupled for t in solution.tangential]
    assert len(way) == 1
    assert len(C) == 3 * len(model.gap)
    assert solution.plan.copies == 1

    def pressed(*loads: float) -> Any:
        steps = np.concatenate(
            [np.linspace(a, b, 9)[1:] for a, b in zip((0.0, *loads[:-1]), loads, strict=True)]
        )
        return coupled_contact(
            C, model.gap, mu, load=np.column_stack([steps, 0 * steps, 0 * steps])
        )

    approach = {s: pressed(N * s).displacement[-1, 0] for s in (0.9, 1.1)}
    found = pressed(N)
    # Friction's way in other steps: to their error, none for faces that touch without a load.
    exact = 1e-9 if toy == "flat" else 2e-4
    K_N = 0.2 * N / (approach[1.1] - approach[0.9])
    assert mine["K_N_tangent_raw", None].value == pytest.approx(K_N, rel=10 * exact)
    small = 1e-3 * mu * N
    more = found.go_on(load=[N, small, 0.0])
    K_T = small / (more.displacement[-1, 1] - found.displacement[-1, 1])
    name = "K_Tx_initial_raw" if toy == "flat" else "K_T_initial_raw"
    assert mine[name, None].value == pytest.approx(K_T, rel=exact)
    full = found.go_on(load=[[N, s * mu * N, 0.0] for s in np.arange(1, 11) / 20.0])
    force = solution.tangential[0].coupled.force[-1]
    largest = np.abs(full.force[-1]).max()
    np.testing.assert_allclose(
        force, full.force[-1], atol=(1e-8 if toy == "flat" else 1e-3) * largest
    )
    # unprocessed: cone and balance
    shear = np.linalg.norm(force[:, 1:], axis=1)
    assert (shear <= mu * force[:, 0] + 1e-9 * largest).all()
    assert force.sum(axis=0) == pytest.approx([N, 0.5 * mu * N, 0.0], abs=1e-9 * N)
    assert not failures(solution) - {"resolution"}


def test_a_sphere_of_like_material_hardly_couples() -> None:
    """Exact for half-spaces; of finite bodies to the change that a run without it prints."""
    scene, overrides = TOYS["curved"]
    loaded = as_scene(scene, {**overrides, "geometry.divisions": 10})
    plan = make_plan(loaded)
    plain = analysis_of(loaded).solve(plan, Stages())
    told = {one.quantity: one for one in plain.left_out if one.effect.startswith("normal-tang")}
    assert {"K_N_tangent_raw", "K_T_initial_raw", "contact_area", "stick_area"} <= set(told)
    mine, uncoupled = numbers(solved("curved", ("geometry.divisions", 10))), numbers(plain)
    for name in ("K_N_tangent_raw", "K_T_initial_raw", "contact_area"):
        one = told[name]
        change = mine[name, None].value / uncoupled[name, None].value - 1.0
        assert abs(change) < 1e-3
        assert change == pytest.approx(one.included / one.without - 1.0, abs=2e-4)
    assert mine["cycle_energy", 0.75].value == pytest.approx(
        uncoupled["cycle_energy", 0.75].value, rel=0.02
    )


@pytest.mark.parametrize("toy", TOYS)
def test_coupling_is_no_effect_left_out_any_more(toy: str) -> None:
    plan = solved(toy).plan
    words = {e.name: e.word for e in plan.effects}
    assert words["normal-tangential coupling"] == words["slip in two directions"] == "yes"
    scene, overrides = TOYS[toy]
    half = {"mesh.symmetry": "half" if toy == "flat" else "quarter"}
    with pytest.raises(InputError, match="at once"):
        make_plan(as_scene(scene, {**overrides, **COUPLED, **half}))


def test_loops_that_shake_down_are_closed() -> None:
    """Unlike materials and little shear: slip fades from loop to loop, to rounding."""
    unlike = {
        "materials.sphere.E": "3.42 GPa",
        "materials.block.nu": 0.0,
        "contact.friction": 0.03,
        "loads.normal": ("1 N",),
        "loads.cycle_amplitude": 0.1,
        "geometry.divisions": 6,
        "want": ("normal", "cycle"),
    }
    solution = solved("curved", *unlike.items())
    (path,) = (one for one in solution.paths if one.cycle)
    assert abs(path.slip_work) < 1e-2 * path.most_work
    assert "loop area" not in failures(solution)


def test_a_loop_that_sticks_is_closed_to_rounding() -> None:
    more = {
        "contact.friction": 1.5,
        "loads.normal": ("100 N",),
        "loads.cycle_amplitude": 1e-3,
        "geometry.divisions": 4,
        "want": ("normal", "cycle"),
    }
    solution = solved("curved", *more.items())
    (path,) = (one for one in solution.paths if one.cycle)
    assert 0.0 < path.most_work < 1e-12 * path.load.max() * path.displacement.max()
    assert "loop area" not in failures(solution)


def test_without_friction_there_is_nothing_to_couple() -> None:
    scene, overrides = TOYS["flat"]
    plan: Any = make_plan(as_scene(scene, {**overrides, **COUPLED, "contact.friction": 0.0}))
    assert isinstance(plan, ContactPlan)
    assert plan.symmetry == "half"
    assert "normal-tangential coupling" not in {e.name for e in plan.effects}


def test_a_free_tilt_is_coupled_too() -> None:
    """No moment about the load line, from the nodal forces; softer than with the tilt held."""
    point = {"contact.tilt": "free", "contact.load_point": ("21.25 mm", "2 mm")}
    more = {**point, "want": ("normal", "stiffness")}
    solution, held = solved("flat", *more.items()), solved("flat")
    (case,) = solution.normal
    assert case.tilt is not None
    assert not failures(solution)
    assert case.stiffness < held.normal[0].stiffness
    spoiled = replace(case, coupled=None)
    solution = replace(solution, normal=[spoiled])
    assert failures(solution) == {"no penetration", "no force across a gap"}


def spoiled_force(solution: Any, component: int) -> Any:
    """One sticking node's force beyond its cone, or a tenth of a newton too much of a total."""
    t = solution.tangential[0]
    found = t.coupled
    force = found.force.copy()
    node = int(np.flatnonzero(found.state[-1] == STICK)[0])
    force[-1, node, component] += 2.0 * found.load[-1, 0]
    found = replace(found, force=force)
    nodes = shear_nodes(solution.model, solution.plan.scene.contact.friction, found)
    return replace(solution, tangential=[replace(t, coupled=found, nodes=nodes)])


@pytest.mark.parametrize("toy", TOYS)
def test_its_checks_see_forces_that_break_the_law(toy: str) -> None:
    solution = solved(toy)
    assert {"tangential balance", "Coulomb limit", "stick"} <= failures(spoiled_force(solution, 1))
    assert {"reaction", "no force across a gap"} <= failures(spoiled_force(solution, 0))
