"""Errors of a seated damper's numbers: bounds that hold against finer levels, and reasons where
nothing was found.
"""

from __future__ import annotations

from typing import Any

import pytest

import upd
from upd.analyses import make_plan
from upd.analyses.seated.plan import make_plan as bare_plan
from upd.analyses.seated.varied import PROBLEM, STEPS, edges, levels
from upd.errors import InputError
from upd.progress import Stages
from upd.report.tables import budget_table, error_parts
from upd.scene import load_scene
from upd.vary.solve import MESH, varied_plan
from upd.vary.variation import Variation

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
    """Elastic numbers: all bounded but one, that nearly; none out of all proportion."""
    fine = upd.run("symmetric-seated", overrides=WEDGE | FINE)
    known = {(r.name, r.case): r.value for r in fine.results}
    mine = [one for one in wedge.results if is_elastic(one)]
    assert len(mine) > 8
    held = 0
    for one in mine:
        true = abs(known[one.name, one.case] / one.value - 1.0)
        assert one.estimated_error is not None, one.name
        held += true <= one.estimated_error
        assert true <= 1.25 * one.estimated_error, one.name
        assert one.estimated_error < 0.6, one.name
        assert [part.source for part in one.parts] == [MESH, STEPS]
    assert held >= len(mine) - 1


def test_terminal_and_page_tell_them(wedge: upd.RunResult) -> None:
    row = next(r for r in wedge.results if r.name == "face_N")
    assert "normal force of the face 154.68 N ±" in wedge.table()
    parts = error_parts(row.as_dict())
    assert {source for source, *_ in parts} == {MESH, STEPS}
    # an error that is exactly zero has no half
    assert all(bool(half) == bool(error) for _, error, half, _ in parts)


@pytest.mark.parametrize("scene", ["symmetric-seated", "asymmetric-seated"])
def test_the_plan_counts_what_errors_take(scene: str) -> None:
    plan = make_plan(load_scene(scene))
    without = make_plan(load_scene(scene, {"accuracy": "unknown"}))
    assert without.estimate_seconds == 0.0
    assert plan.seconds == pytest.approx(without.seconds + plan.estimate_seconds)
    by_source = levels(bare_plan(load_scene(scene)))
    found = [one for them in by_source.values() for one in them if isinstance(one, Variation)]
    each = [varied_plan(PROBLEM, load_scene(scene), one).solve_seconds for one in found]
    assert plan.estimate_seconds == pytest.approx(sum(each))
    # no level costs as much as the run itself
    assert 0.0 < min(each) <= max(each) < without.seconds
    assert [one.source for one in found] == [MESH, MESH, STEPS]


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
    assert [part.known for part in row.parts] == [False, True]
    assert "cannot be meshed" in row.parts[0].basis
    assert "not found" in str(budget_table([row.as_dict()]).rows)


def test_a_rig_that_cannot_be_coarser_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> Any:
        raise InputError("too coarse")

    monkeypatch.setattr("upd.vary.solve.varied_plan", refuse)
    found = levels(bare_plan(load_scene("symmetric-seated")))
    assert "cannot be meshed coarser" in found[MESH]


def test_shares_of_a_face_are_known_to_a_row_of_nodes() -> None:
    """Two rows of 6 elements touch, a quarter of the face. The edge lies between two rows: one of
    one and a half. No ladder of meshes makes that smaller.
    """
    counts = {"geometry.patch_along_y": 16, "geometry.patch_along_slope": 6}
    scene = load_scene("symmetric-seated", SMALL | counts)
    spacing, found = edges(PROBLEM.solve(bare_plan(scene), Stages())), upd.run(scene)
    rows = {(r.name, r.case): r for r in found.results}
    assert rows["closed_share", "raised, left"].value == pytest.approx(25.0)
    for key, error in spacing.items():
        if key[0] != "slip_share" and key[1].side == "left":
            assert error == pytest.approx(2.0 / 3.0)
        assert rows[key].parts[0].error >= error
    # all nodes slip on every level: the levels alone say that nothing is open
    assert "one spacing of nodes" in rows["slip_share", "raised, left"].parts[0].basis


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
