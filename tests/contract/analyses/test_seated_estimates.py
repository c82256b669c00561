"""Errors of a seated damper's numbers: bounds that hold against finer levels, companions that keep
the nodes of the faces, and reasons where nothing was found.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import upd
from upd.analyses import make_plan
from upd.analyses.seated import varied
from upd.analyses.seated.plan import make_plan as bare_plan
from upd.analyses.seated.varied import MESH, NODES, PROBLEM, STEPS, levels
from upd.errors import InputError
from upd.mesh import recipes
from upd.progress import Stages
from upd.report.tables import budget_table, error_parts
from upd.results import Case, Result
from upd.scene import load_scene
from upd.vary.solve import varied_plan
from upd.vary.variation import SolvedVariation, Variation

pytestmark = pytest.mark.estimated

WEDGE: dict[str, Any] = {
    "geometry.patch_along_y": 12,
    "geometry.patch_along_slope": 4,
    "seating.steps": 4,
    "moved.steps": 4,
    "moved.directions": ["x"],
    "moved.cycles": 1,
    "want": ["seating", "stiffness", "moved"],
    "left_out.solve": "no",
}
#: bodies and load steps twice as fine on the faces of WEDGE
FINE = {
    "geometry.refine": 2,
    "geometry.patch_along_y": 6,
    "geometry.patch_along_slope": 2,
    "seating.steps": 8,
    "moved.steps": 8,
    "accuracy": "unknown",
}
#: the elastic numbers, which an order of convergence governs
ELASTIC = ("face_K_N", "face_K_T", "leg_K_N", "leg_K_T", "damper_uz", "friction_energy")
SMALL = {**WEDGE, "want": ["seating"], "seating.steps": 2}


def is_elastic(one: upd.Result) -> bool:
    """Of what sticks whole, or moves; not of the few nodes that touch."""
    return one.name in ELASTIC and one.case.choice not in ("raised", "vibrated in")


@pytest.fixture(scope="module")
def wedge() -> upd.RunResult:
    return upd.run("symmetric-seated", overrides=WEDGE)


def test_bounds_hold_against_finer_bodies_and_steps(wedge: upd.RunResult) -> None:
    """Every elastic number: bounded, and not out of all proportion."""
    fine = upd.run("symmetric-seated", overrides=WEDGE | FINE)
    known = {(r.name, r.case): r.value for r in fine.results}
    mine = [one for one in wedge.results if is_elastic(one)]
    assert len(mine) > 8
    for one in mine:
        true = abs(known[one.name, one.case] / one.value - 1.0)
        assert one.estimated_error is not None, one.name
        assert true <= one.estimated_error < 0.6, one.name
        assert [part.source for part in one.parts][:3] == [NODES, MESH, STEPS]


def test_terminal_and_page_tell_them(wedge: upd.RunResult) -> None:
    row = next(r for r in wedge.results if r.name == "face_N")
    assert "normal force of the face 154.68 N ±" in repr(wedge)
    parts = error_parts(row.as_dict())
    assert {source for source, *_ in parts} == {NODES, MESH, STEPS, varied.SOLVER}
    assert all(half for source, _, _, half, _ in parts if source == NODES)


def test_finer_bodies_keep_the_nodes_of_the_faces() -> None:
    """In the same places, so that nothing but the bodies differs; with eight times the elements."""
    for scene in ("symmetric-seated", "asymmetric-seated"):
        plan = bare_plan(load_scene(scene))
        finer = next(one for one in levels(plan).variations if one.source == MESH)
        assert finer.base is not None
        plans = [varied_plan(PROBLEM, plan.scene, one) for one in (finer.base, finer)]
        meshes = [recipes.build_mesh(p.scene.recipe, p.parameters)[0] for p in plans]
        for side in ("left", "right"):
            places = [m[side].points[m[side].nodes["patch"]] for m in meshes]
            ordered = [p[np.lexsort(p.round(6).T)] for p in places]
            np.testing.assert_allclose(*ordered, atol=1e-9)
        counts = [sum(body["hexes"] for body in p.size.values()) for p in plans]
        # lines along the damper lie on the faces' nodes
        assert 2.5 < counts[1] / counts[0] < 8.0


@pytest.mark.parametrize("scene", ["symmetric-seated", "asymmetric-seated"])
def test_the_plan_counts_what_errors_take(scene: str) -> None:
    plan = make_plan(load_scene(scene))
    without = make_plan(load_scene(scene, {"accuracy": "unknown"}))
    assert without.estimate_seconds == 0.0
    assert plan.seconds == pytest.approx(without.seconds + plan.estimate_seconds)
    assert not levels(without).variations
    found = levels(bare_plan(load_scene(scene))).variations
    each = [varied_plan(PROBLEM, load_scene(scene), one).solve_seconds for one in found]
    assert plan.estimate_seconds == pytest.approx(sum(each))
    # no level costs as much as the run itself
    assert 0.0 < min(each) <= max(each) < without.seconds
    assert [one.source for one in found] == [NODES, NODES, NODES, MESH, STEPS]
    # bases first
    assert found[0] in {one.base for one in found}


def test_companions_that_fail_leave_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    """A number without an estimate is not given a small one."""

    def broken(problem: Any, scene: Any, one: Variation) -> Any:
        if one.source == MESH:
            raise InputError("cannot be meshed")
        return varied_plan(problem, scene, one)

    monkeypatch.setattr("upd.vary.solve.varied_plan", broken)
    found = upd.run("symmetric-seated", overrides=SMALL)
    row = next(r for r in found.results if r.name == "damper_uz")
    assert row.estimated_error is None
    assert [part.known for part in row.parts] == [True, False, True]
    assert "cannot be meshed" in row.parts[1].basis
    assert "not found" in str(budget_table([row.as_dict()]).rows)


def test_faces_that_cannot_be_coarser_say_so() -> None:
    scene = load_scene(
        "symmetric-seated", {"geometry.patch_along_y": 4, "geometry.patch_along_slope": 1}
    )
    found = levels(bare_plan(scene))
    assert [one.source for one in found.variations] == [STEPS]
    assert "cannot be made coarser" in found.reasons[NODES]
    assert "cannot be refined" in found.reasons[MESH]


def test_bodies_that_would_have_too_many_nodes_are_not_refined(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plan = bare_plan(load_scene("symmetric-seated", WEDGE))
    assert MESH in {one.source for one in levels(plan).variations}
    monkeypatch.setattr(varied, "_FEW_NODES", 100)
    found = levels(plan)
    assert MESH not in {one.source for one in found.variations}
    assert "nodes, above" in found.reasons[MESH]


@pytest.mark.parametrize(
    ("value", "other", "why"),
    [(0.0, 0.0, "the number is zero"), (2.0, -1.0, "the other sign"), (2.0, 0.0, "zero or")],
)
def test_what_has_no_sign_has_no_relative_error(value: float, other: float, why: str) -> None:
    key = ("face_N", Case(name="raised"))
    told = varied.of_one_sign(value, key, [coarse(other)])
    assert told is not None
    assert not told[0].known
    assert why in told[0].basis
    assert varied.of_one_sign(2.0, key, [coarse(1.0)]) is None


def coarse(value: float) -> SolvedVariation:
    row = Result("face_N", Case(name="raised"), value, "N")
    return SolvedVariation(Variation(NODES, "coarse", size=2.0), [row])


def test_shares_of_a_face_are_known_to_a_row_of_nodes() -> None:
    """Two rows of 6 elements touch, a quarter of the face. The edge lies between two rows: one of
    one and a half. No ladder of lattices makes that smaller.
    """
    counts = {"geometry.patch_along_y": 16, "geometry.patch_along_slope": 6}
    scene = load_scene("symmetric-seated", SMALL | counts)
    solution = PROBLEM.solve(bare_plan(scene), Stages())
    edges, found = varied.by_edges(solution), upd.run(scene)
    rows = {(r.name, r.case): r for r in found.results}
    assert rows["closed_share", "raised, left"].value == pytest.approx(25.0)
    for key, (part,) in edges.items():
        if key[0] != "slip_share" and key[1].side == "left":
            assert part.error == pytest.approx(2.0 / 3.0)
            assert rows[key].parts[0].error >= part.error


def test_rounding_is_no_number() -> None:
    """The damper on pads is carried along by a blade that moves up: no loss, no stiffness."""
    pads = {
        **WEDGE,
        "geometry.pad_along_y": 8,
        "geometry.pad_along_slope": 4,
        "geometry.face_along_z": 2,
        "moved.directions": ["z"],
    }
    pads = {key: value for key, value in pads.items() if ".patch_" not in key}
    found = upd.run("asymmetric-seated", overrides=pads)
    row = next(r for r in found.results if r.name == "friction_energy")
    assert abs(row.value) < 1e-9
    assert row.estimated_error is None
    assert row.parts[0].basis.startswith("not estimated: zero but for rounding")
