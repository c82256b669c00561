"""Stiffness of one body of a flat contact against a rigid counterpart, by two other ways.

A counterpart a million times stiffer through the whole pipeline, and the body's own finite
elements moved at its contact nodes without any condensation.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.sparse import block_array
from scipy.sparse.linalg import spsolve

import upd
from upd.analyses.contact.plan import ACROSS, ALONG, NORMAL, make_plan
from upd.analyses.contact.solution import ContactSolution
from upd.analyses.contact.solve import solve_plan as solve
from upd.contact.model import Body, free_dofs
from upd.linalg.symmetric import whole
from upd.mesh import Mesh
from upd.progress import Stages
from upd.report.notebook import RunResult
from upd.scene import load_scene

COARSE = {
    "symmetric": {"geometry.divisions": 4, "geometry.divisions_long": 8, "geometry.growth": 1.9},
    "asymmetric": {"geometry.divisions": 3, "geometry.divisions_long": 6, "geometry.growth": 1.9},
}
STIFFNESS = {
    "want": ["normal", "stiffness", "contact_law"],
    "loads.normal": ["100 N"],
    "left_out.solve": "no",
}
RIGID = "2e8 GPa"


@cache
def run(scene: str, tilt: str, rigid: str = "", bodies: str = "both") -> RunResult:
    changes: dict[str, Any] = {**COARSE[scene], **STIFFNESS, "law.bodies": bodies}
    changes["contact.tilt"] = tilt
    if rigid:
        # Normal and tangential contact of such bodies are coupled; here only C_1 + C_2 counts.
        changes[f"materials.{rigid}.E"], changes["contact.coupling_limit"] = RIGID, 1.0
    return upd.run(scene, overrides=changes)


@pytest.mark.parametrize("tilt", ["held", "free"])
def test_body_alone_is_the_scene_with_a_rigid_counterpart(tilt: str) -> None:
    usual = run("symmetric", tilt)
    for body, other in (("damper", "platform"), ("platform", "damper")):
        rigid = run("symmetric", tilt, rigid=other)
        assert usual.value(f"K_N_{body}_alone") == pytest.approx(
            rigid.value("K_N_secant_raw"), rel=1e-5
        )
        for axis in "xy":
            assert usual.value(f"K_T{axis}_{body}_alone") == pytest.approx(
                rigid.value(f"K_T{axis}_initial_raw"), rel=1e-5
            )


@pytest.mark.parametrize("scene", ["symmetric", "asymmetric"])
def test_law_of_the_upper_body_is_that_of_a_rigid_platform(scene: str) -> None:
    upper, rigid = run(scene, "held", bodies="upper"), run(scene, "held", rigid="platform")
    for name in ("law_k_n", "law_k_tx", "law_k_ty"):
        assert upper.value(name) == pytest.approx(rigid.value(name), rel=1e-5), name


def solved(scene: str) -> ContactSolution:
    plan = make_plan(load_scene(scene, {**COARSE[scene], **STIFFNESS}))
    return solve(plan, Stages())


def moved(body: Body, mirror: dict[str, tuple[int, ...]], on: np.ndarray, component: int) -> Any:
    """Forces and displacement of the body with its contact nodes ``on`` moved by one along the
    component, their other components and all other nodes free; a distant set with weights held by
    multipliers.
    """
    dofs = 3 * body.contact[on] + component
    free = np.setdiff1d(free_dofs(body.mesh, mirror), dofs)
    K, W, u = whole(body.K), in_the_mean(body.mesh, mirror), np.zeros(3 * body.mesh.n_node)
    u[dofs] = 1.0
    A = (
        block_array([[K[free][:, free], W[free]], [W[free].T, None]])
        if W.size
        else K[free][:, free]
    )
    load = np.r_[K[free][:, dofs] @ np.ones(len(dofs)), W[dofs].sum(axis=0)]
    u[free] = spsolve(A.tocsc(), -load)[: len(free)]
    return np.asarray(K[dofs] @ u), u


def in_the_mean(mesh: Mesh, mirror: dict[str, tuple[int, ...]]) -> np.ndarray:
    """(3 n_node, m) what has no mean over a distant set with weights: its translations and
    rotations about the origin that the mirror planes, which pass through it, leave free.
    """
    weights = np.zeros(mesh.n_node)
    if "distant" not in mesh.weights:
        return np.zeros((3 * mesh.n_node, 0))
    weights[mesh.nodes["distant"]] = mesh.weights["distant"]
    x, y, z = mesh.points.T
    o, e = np.zeros(mesh.n_node), np.ones(mesh.n_node)
    motions = [(e, o, o), (o, e, o), (o, o, e), (o, -z, y), (z, o, -x), (-y, x, o)]
    left = [
        np.stack(motion, axis=1) * weights[:, None]
        for motion in motions
        if not any(motion[c][mesh.nodes[plane]].any() for plane in mirror for c in mirror[plane])
    ]
    return np.stack(left, axis=-1).reshape(3 * mesh.n_node, -1)


@pytest.mark.parametrize("scene", ["symmetric", "asymmetric"])
def test_body_alone_by_its_own_finite_elements(scene: str) -> None:
    solution = solved(scene)
    (case,), copies = solution.normal, solution.plan.copies
    results = {way: of for case in solution.normal for way, (_, of) in case.stuck.items()}
    for body in (solution.model.upper, solution.model.lower):
        alone = case.alone[body.name].solution
        family = {c: dict(mirror) for f, mirror in solution.plan.families.items() for c in f}
        force, u = moved(body, family[NORMAL], alone.contact, NORMAL)
        # A rigid plane pressed in by one: it pushes where it touches, and touches nowhere else.
        assert force.min() > 0.0
        assert (u[3 * body.contact[~alone.contact] + 2] * body.side >= body.side - 1e-12).all()
        K = copies * force.sum()
        assert case.force / alone.approach == pytest.approx(K, rel=1e-8)
        for component, direction in ((ALONG, 0.0), (ACROSS, 90.0)):
            sheared, _ = moved(body, family[component], alone.contact, component)
            assert results[direction][body.name] == pytest.approx(copies * sheared.sum(), rel=1e-8)
