"""What a contact leaves out is verified on the number itself: each effect has its change, and a run
with the effect switched on changes the number by that much.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import splu

import upd
from upd.analyses import make_plan
from upd.analyses.contact.bodies import prepare
from upd.analyses.contact.plan import ContactPlan
from upd.analyses.contact.solution import raised
from upd.contact.model import ContactModel
from upd.fem import rigid_body_modes
from upd.linalg.symmetric import whole
from upd.progress import Stages
from upd.report.notebook import RunResult
from upd.results import Case, Check
from upd.scene import as_scene

ROOT = Path(__file__).resolve().parents[3]
OWN = str(ROOT / "upd" / "scenes" / "examples" / "own_damper.toml")

#: Toys no finer than their companions, so that a switch changes a number as much as was printed.
TOYS: dict[str, tuple[str, dict[str, Any]]] = {
    "hertz": (
        "hertz",
        {
            "want": ["normal", "stiffness", "tangential", "cycle"],
            "geometry.divisions": 8,
            "geometry.patch": "auto",
            "materials.block.E": "150 GPa",
            "loads.normal": ["200 N"],
            "loads.tangential": [0.3, 0.8],
            "loads.cycle_steps": 40,
        },
    ),
    "symmetric": (
        "symmetric",
        {
            "want": ["normal", "stiffness", "tangential"],
            "geometry.divisions": 4,
            "geometry.divisions_long": 8,
            "geometry.growth": 1.6,
            "loads.normal": ["155 N"],
            # 0.8 leaves nodes just at the limit, which rounding tells stuck or slipping
            "loads.tangential": [0.7],
        },
    ),
    "asymmetric": (
        "asymmetric",
        {
            "want": ["normal", "stiffness", "tangential"],
            "geometry.divisions": 4,
            "geometry.divisions_long": 8,
            "geometry.growth": 1.6,
            "contact.load_point": ["21.25 mm", "3 mm"],
            "loads.normal": ["303 N"],
            "loads.tangential": [0.8],
        },
    ),
    "own damper": (
        OWN,
        {
            "want": ["normal", "tangential"],
            "geometry.divisions": 8,
            "contact.friction": 0.3,
            "loads.tangential": [0.5],
        },
    ),
}


@cache
def solved(toy: str, *switch: str) -> RunResult:
    scene, overrides = TOYS[toy]
    values = dict(text.split("=") for text in switch)
    return upd.run(
        scene,
        overrides={**overrides, **{k: int(v) if v.isdigit() else v for k, v in values.items()}},
    )


def changes(result: RunResult, effect: Mapping[str, Any]) -> list[Check]:
    return [c for c in result.checks if c.name == effect["check"]]


@pytest.mark.parametrize("toy", TOYS)
def test_every_effect_left_out_has_a_number(toy: str) -> None:
    result = solved(toy)
    numbers = {(r.name, r.case) for r in result.results}
    omitted = [e for e in result.effects if not e["on"] and e["applies"]]
    assert "normal-tangential coupling" in {e["name"] for e in omitted}
    for effect in omitted:
        found = changes(result, effect)
        assert found, effect
        for check in found:
            assert math.isfinite(check.value)
            assert (check.quantity, check.case) in numbers
            assert not check.fatal
            assert check.without == pytest.approx(result.value(check.quantity, check.case), rel=0.2)
    for effect in result.effects:
        assert effect["applies"] or not effect["check"], effect


def compare(plain: RunResult, switched: RunResult, effect: Mapping[str, Any]) -> None:
    """The number changes as printed.

    Four steps of a slip circle stand for many: a thousandth of the number.
    """
    for check in changes(plain, effect):
        before, after = (r.value(check.quantity, check.case) for r in (plain, switched))
        assert check.without == pytest.approx(before, rel=1e-6)
        allowed = 1e-3 if "secant" in check.quantity else 1e-6
        if check.quantity == "stick_area":  # its change is a part of the contact area
            area = plain.value("contact_area", Case(load=check.case.load))
            assert abs(after - before) / area == pytest.approx(check.value, abs=1e-6), check
            continue
        assert abs(after / before - 1.0) == pytest.approx(check.value, abs=allowed), check


SWITCHES = [
    ("hertz", "contact.directions=2"),
    ("symmetric", "contact.directions=2"),
    ("hertz", "contact.coupling=coupled"),
    ("symmetric", "contact.coupling=coupled"),
    ("symmetric", "contact.tilt=free"),
    ("asymmetric", "contact.tilt=free"),
    ("own damper", "contact.directions=2"),
    ("own damper", "contact.coupling=coupled"),
]


@pytest.mark.parametrize(("toy", "switch"), SWITCHES)
def test_switching_the_effect_on_changes_the_number_as_printed(toy: str, switch: str) -> None:
    plain, switched = solved(toy), solved(toy, switch)
    (effect,) = (e for e in plain.effects if switch in e["switch"])
    compare(plain, switched, effect)
    assert next(e for e in switched.effects if e["name"] == effect["name"])["on"]
    spoiled = replace(
        plain,
        checks=tuple(
            replace(c, value=c.value + 0.01) if c.name == effect["check"] else c
            for c in plain.checks
        ),
    )
    with pytest.raises(AssertionError):
        compare(spoiled, switched, effect)


def test_every_switch_is_tried() -> None:
    declared = {(toy, text) for toy in TOYS for e in solved(toy).effects for text in e["switch"]}
    missing = declared - set(SWITCHES)
    # as of the symmetric damper
    assert missing == {
        ("asymmetric", "contact.directions=2"),
        ("asymmetric", "contact.coupling=coupled"),
    }


def test_a_coarser_companion_prints_the_change_of_its_level() -> None:
    """The change itself has the error of the companion's mesh: of the first order of its numbers'
    error, not a part of the number.
    """
    overrides = {
        "want": ["normal", "stiffness"],
        "geometry.divisions": 16,
        "geometry.patch": "auto",
        "loads.normal": ["200 N"],
    }
    plain = upd.run("hertz", overrides=overrides)
    switched = upd.run("hertz", overrides={**overrides, "contact.directions": 2})
    (check,) = (c for c in plain.checks if c.name == "slip in two directions")
    before, after = (r.value(check.quantity, check.case) for r in (plain, switched))
    assert check.without is not None
    level = abs(check.without / before - 1.0)
    assert 0.0 < level < 0.05
    assert abs(after / before - 1.0) <= check.value * (1.0 + 10.0 * level)


def test_a_tilt_that_tips_the_damper_over_leaves_no_stiffness() -> None:
    """The wires hold the asymmetric damper beside its pads."""
    scene, overrides = TOYS["asymmetric"]
    result = upd.run(
        scene,
        overrides={**overrides, "contact.load_point": ["21.25 mm", "-1 mm"], "want": ["stiffness"]},
    )
    (check,) = (c for c in result.checks if c.name == "tilt of the damper")
    assert check.included == 0.0
    assert check.verdict == "warning"
    assert "tips over" in check.remedy


def companion(toy: str, **more: Any) -> tuple[ContactPlan, ContactModel]:
    scene, overrides = TOYS[toy]
    plan = make_plan(as_scene(scene, {**overrides, **more}))
    assert isinstance(plan, ContactPlan)
    assert plan.companion is not None
    return plan.companion, prepare(plan.companion, Stages())


def test_full_stick_is_both_bodies_glued() -> None:
    """One elastic body with the contact nodes merged, the mean of the damper's bands pushed down
    and free to move sideways: the same stiffness.
    """
    _, model = companion("symmetric")
    upper, lower = model.upper, model.lower
    n_up, n_low = (3 * b.mesh.n_node for b in (upper, lower))
    dofs = np.concatenate([np.arange(n_up), n_up + np.arange(n_low)])
    for k in range(3):
        dofs[3 * upper.contact + k] = n_up + 3 * lower.contact + k
    both = sparse.block_diag([whole(upper.K), whole(lower.K)]).tocoo()
    K = sparse.csr_array((both.data, (dofs[both.row], dofs[both.col])), shape=(n_up + n_low,) * 2)
    used = np.unique(dofs)
    held_low = n_up + (3 * lower.mesh.nodes["distant"][:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(used, held_low)
    # translations q of the bands' mean, no rotation: [K W; W' 0] (u, a) = (0, W'R q)
    weights = np.zeros((upper.mesh.n_node, 1))
    weights[upper.mesh.nodes["distant"], 0] = upper.mesh.weights["distant"]
    R = rigid_body_modes(upper.mesh.points)
    W = np.zeros((n_up + n_low, 6))
    W[:n_up] = np.repeat(weights, 3, axis=0) * R
    translated = W[:n_up].T @ np.tile(np.eye(3), (upper.mesh.n_node, 1))
    A = sparse.block_array([[K[free][:, free], W[free]], [W[free].T, None]]).tocsc()
    u = splu(A).solve(np.vstack([np.zeros((len(free), 3)), translated]))[: len(free)]
    S = u.T @ (K[free][:, free] @ u)
    glued = S[2, 2] - S[2, :2] @ np.linalg.solve(S[:2, :2], S[:2, 2])
    # so much friction that nothing slips; nothing opens either
    found = raised(model, 1e3, [100.0], np.zeros((len(model.gap), 0)))[100.0]
    assert (found.state[-1] == 1).all()
    assert 100.0 / found.displacement[-1, 0] == pytest.approx(glued, rel=1e-8)
