"""The dampers loaded over bands of exact width: levels of the mesh, balance, half and whole.

Bands of whole elements were 5.3 to 10 mm wide instead of 10 on the wedge, by what divided the
contact: K_N rose by 17 % from 6 to 8 divisions and fell by 5 % to 12. Wires of the pads, of whole
elements, let it rise by 38 % from 6 to 8 divisions and fall by 2 % to 12.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from upd.analyses.contact.bodies import pressed
from upd.analyses.contact.plan import make_plan, refined_growth
from upd.analyses.contact.solution import ContactSolution, load_point, tilt_arms
from upd.analyses.contact.solve import solve_plan
from upd.progress import Stages
from upd.scene import load_scene
from upd.vary.orders import estimate_error

LOAD = 155.0
#: divisions along the slope and along the damper: 34 to 12 as nearly as even numbers come, 36 to 16
LEVELS = {
    "symmetric": {4: 12, 6: 16, 8: 22, 10: 28},
    "asymmetric": {2: 5, 4: 9, 6: 14, 8: 18},
}
#: what the damper is loaded over, and its middle along x, mm
BANDS = {"symmetric": "bands", "asymmetric": "wires"}
#: largest ratio of neighbouring elements at 8 divisions
GROWTH = {"symmetric": 1.4, "asymmetric": 1.69}
both = pytest.mark.parametrize("scene", ["symmetric", "asymmetric"])


@cache
def solved(scene: str, divisions: int, held: str = "", **settings: Any) -> ContactSolution:
    changes: dict[str, Any] = {
        "geometry.divisions": divisions,
        "geometry.divisions_long": LEVELS[scene][divisions],
        "geometry.growth": refined_growth(GROWTH[scene], 8 / divisions),
        "contact.distant.damper": held or BANDS[scene],
        "contact.friction": 0.0,
        "loads.normal": [f"{LOAD} N"],
        "want": ["normal"],
    }
    changes |= {key.replace("__", "."): value for key, value in settings.items()}
    return solve_plan(make_plan(load_scene(scene, changes)), Stages())


def K_N(solution: ContactSolution) -> float:
    (case,) = solution.normal
    return LOAD / case.solution.approach


@both
def test_levels_of_the_mesh_show_an_order(scene: str) -> None:
    """Three levels converge with a clear order, and their estimate bounds the step to the next."""
    *coarse, finer = [K_N(solved(scene, n)) for n in LEVELS[scene]]
    h = [1.0 / n for n in LEVELS[scene]]
    found = estimate_error(h[:-1], coarse)
    assert np.isfinite(found.order), (found, coarse)
    assert abs(finer / coarse[-1] - 1.0) < found.error
    # each refinement takes K_N down, by less than the one before
    steps = np.diff([*coarse, finer])
    assert np.all(steps < 0.0)
    assert steps[0] < steps[1] < steps[2]
    if scene == "symmetric":  # twice the spacing
        assert coarse[0] / coarse[2] < 1.05


@both
@pytest.mark.parametrize("symmetry", ["full", "half"])
def test_the_bands_carry_the_force_and_the_moments(scene: str, symmetry: str) -> None:
    """Sum and moments of the reaction are those of the contact forces; its traction is linear."""
    solution = solved(scene, 4, mesh__symmetry=symmetry)
    (case,), body = solution.normal, solution.model.upper
    u, _ = pressed(solution.model, case.solution.force, solution.plan.copies)
    mesh = body.mesh
    all_forces = (body.K @ u[body.name].ravel()).reshape(-1, 3)
    nodes, weights = mesh.nodes["distant"], mesh.weights["distant"]
    force = np.zeros((len(mesh.nodes["contact"]), 3))
    force[:, 2] = solution.model.nodal(case.solution.force)
    arms, places = mesh.points[mesh.nodes["contact"]], mesh.points[nodes]
    size = np.abs(force).sum()
    # of half a model only what its plane does not carry: forces in it, the moment about its normal
    parts = [0, 1, 2] if symmetry == "full" else [1, 2]
    about = [0, 1, 2] if symmetry == "full" else [0]
    reaction = all_forces[nodes]
    np.testing.assert_allclose(
        reaction.sum(axis=0)[parts], -force.sum(axis=0)[parts], atol=1e-9 * size
    )
    moment = np.cross(places, reaction).sum(axis=0) + np.cross(arms, force).sum(axis=0)
    np.testing.assert_allclose(moment[about], 0.0, atol=1e-9 * size * np.abs(arms).max())
    # evenly: a traction linear in position, up to what the plane takes of its own nodes
    off = places[:, 0] != 0.0
    traction = (reaction / weights[:, None])[off][:, parts]
    linear = np.column_stack([np.ones(off.sum()), places[off]])
    left = traction - linear @ np.linalg.lstsq(linear, traction, rcond=None)[0]
    assert np.abs(left).max() < 1e-8 * np.abs(traction).max()
    # nothing moves in the mean
    assert np.abs(weights @ u[body.name][nodes])[parts].max() < 1e-9 * np.abs(u[body.name]).max()


@both
def test_half_is_whole(scene: str) -> None:
    half, full = (solved(scene, 4, mesh__symmetry=name) for name in ("half", "full"))
    assert K_N(half) == pytest.approx(K_N(full), rel=1e-9)
    mine, whole = (load_point(one.plan, one.model) for one in (half, full))
    assert mine == pytest.approx(whole, abs=1e-12)


def test_a_free_tilt_is_softer_and_leaves_no_moment() -> None:
    held = solved("symmetric", 4, mesh__symmetry="full")
    free = solved("symmetric", 4, contact__tilt="free")
    (case,) = free.normal
    assert case.tilt is not None and np.abs(case.tilt).max() > 0.0
    assert case.stiffness < held.normal[0].stiffness
    moment = tilt_arms(free.plan, free.model).T @ case.solution.force
    assert np.abs(moment).max() < 1e-9 * LOAD * 42.5
    # the load line passes through the middle of the bands, at 30 cos(45 deg) / 2 from their low end
    low = 7.5 + 1.5 - 12.0 * np.sqrt(2.0)
    middle = load_point(free.plan, free.model)
    assert middle == pytest.approx([0.0, low + 15.0 / np.sqrt(2.0)], abs=1e-9)


@pytest.mark.parametrize(("scene", "held"), [("symmetric", "base"), ("asymmetric", "bottom")])
def test_a_set_without_weights_is_held_node_by_node(scene: str, held: str) -> None:
    solution = solved(scene, 4, held)
    assert "distant" not in solution.model.upper.mesh.weights
    displacement, _ = pressed(solution.model, solution.normal[0].solution.force, 2)
    nodes = solution.model.upper.mesh.nodes[f"distant_{held}"]
    assert not displacement["damper"][nodes].any()
