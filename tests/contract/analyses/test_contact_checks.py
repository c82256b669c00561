"""Every self-check of the contact analyses can fail.

Each name has a spoiler that breaks one thing in a solved toy scene and sees exactly that check
fail.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import upd
from upd.analyses import analysis_of, make_plan
from upd.analyses.contact import plan as left_out
from upd.analyses.contact.solution import Sheared
from upd.progress import Stages
from upd.results import Check
from upd.scene import as_scene

ROOT = Path(__file__).resolve().parents[3]
OWN = str(ROOT / "upd" / "scenes" / "examples" / "own_damper.toml")
WIDE = {
    "left_out.stiffness": "50 %"
}  # what a toy leaves out may change its numbers by more than 5 %

#: toy -> ready scene and overrides
TOYS: dict[str, tuple[str, dict[str, Any]]] = {
    "sphere": (
        "hertz",
        {
            **WIDE,
            "want": ["normal", "stiffness", "tangential", "cycle"],
            "geometry.divisions": 10,
            "geometry.patch": "auto",
            "mesh.symmetry": "full",
            "materials.block.E": "150 GPa",
            "loads.normal": ["200 N"],
            "loads.tangential": [0.5],
            "loads.cycle_steps": 40,
        },
    ),
    "products": (
        "hertz",
        {
            **WIDE,
            "want": ["normal"],
            "geometry.divisions": 8,
            "geometry.patch": "auto",
            "loads.normal": ["200 N"],
            "solver.route": "products",
        },
    ),
    "own": (OWN, {**WIDE, "geometry.divisions": 8, "want": ["normal"]}),
    "damper": (
        "symmetric",
        {
            **WIDE,
            "want": ["normal", "stiffness", "tangential", "cycle"],
            "geometry.divisions": 4,
            "geometry.divisions_long": 8,
            "geometry.growth": 1.6,
            "materials.damper.E": "150 GPa",
            "loads.normal": ["155 N"],
            "loads.tangential": [0.5],
            "loads.cycle_steps": 60,
        },
    ),
    "tilting": (
        "symmetric",
        {
            **WIDE,
            "want": ["normal", "stiffness"],
            "geometry.divisions": 4,
            "geometry.divisions_long": 8,
            "geometry.growth": 1.6,
            "contact.friction": 0.0,
            "contact.tilt": "free",
            "contact.load_point": ["21.25 mm", "2 mm"],
            "loads.normal": ["100 N"],
        },
    ),
}


@cache
def solved(toy: str) -> Any:
    scene, overrides = TOYS[toy]
    loaded = as_scene(scene, overrides)
    return analysis_of(loaded).solve(make_plan(loaded), Stages())


def fresh(toy: str) -> Any:
    """A solution whose cases, dictionaries and lists may be changed."""
    out = copy.copy(solved(toy))
    out.normal = [copy.copy(case) for case in out.normal]
    out.tangential = [copy.copy(case) for case in out.tangential]
    for case in out.normal:
        case.reaction = dict(case.reaction)
    out.left_out = list(out.left_out)
    return out


def failures(toy: str, solution: Any) -> set[str]:
    scene, overrides = TOYS[toy]
    checks: list[Check] = analysis_of(as_scene(scene, overrides)).check_solution(solution)
    return {c.name for c in checks if not c.passed}


def changed(array: Any, place: Any, by: float) -> np.ndarray:
    out = np.array(array, dtype=float)
    out[place] += by
    return out


def open_node(s: Any) -> int:
    return int(np.flatnonzero(s.normal[0].solution.force == 0.0)[0])


def closed_node(s: Any) -> int:
    return int(np.argmax(s.normal[0].solution.force))


def tension(s: Any) -> None:
    answer = s.normal[0].solution
    unclipped = changed(answer.unclipped, closed_node(s), -2.0 * answer.force.max())
    s.normal[0].solution = replace(answer, unclipped=unclipped)


def penetration(s: Any) -> None:
    s.model = replace(s.model, gap=changed(s.model.gap, open_node(s), -1.0))


def force_across_a_gap(s: Any) -> None:
    s.model = replace(s.model, gap=changed(s.model.gap, closed_node(s), 1e-6))


def reaction(s: Any) -> None:
    case = s.normal[0]
    case.force *= 1.01


def nodes(s: Any, change: Callable[[Sheared], dict[str, Any]]) -> None:
    t = s.tangential[0]
    t.nodes = replace(t.nodes, **change(t.nodes))


def one_slips(t: Sheared) -> np.ndarray:
    """The states with the stuck node furthest from its limit called slipping."""
    load = np.linalg.norm(t.force.reshape(len(t.components), -1), axis=0) / t.limit
    return np.where(np.arange(len(t.stick)) == np.argmin(load), False, t.stick)


def limit_lowered(t: Sheared) -> np.ndarray:
    limit = t.limit.copy()
    limit[np.flatnonzero(t.stick)[0]] *= 1e-3
    return limit


def slip_reversed(t: Sheared) -> np.ndarray:
    at = np.flatnonzero(~t.stick)[0]
    return changed(t.before, at, 10.0 * float(t.displacement[0]) * np.sign(t.force[at]))


def stuck_moved(t: Sheared) -> np.ndarray:
    """The slip before the step with one stuck node moved by a thousandth of the shift."""
    at = np.flatnonzero(t.stick)[0]
    return changed(t.before, at, 1e-3 * float(np.abs(t.displacement).max()))


def rim(s: Any) -> None:
    answer, (corner, *_) = s.normal[0].solution, s.model.patch.order
    s.normal[0].solution = replace(answer, force=changed(answer.force, corner, 1e-12))


def moved(s: Any, low: Any, high: Any, by: float) -> None:
    """Forces moved from node to node, with gaps that fit them."""
    answer, model = s.normal[0].solution, s.model
    f = answer.force
    force = changed(changed(f, low, by), high, -by)
    s.model = replace(model, gap=model.gap - model.compliance(2) @ (force - f))
    s.normal[0].solution = replace(answer, force=force)


def measures(s: Any, **change: float) -> None:
    s.normal[0].measures = replace(s.normal[0].measures, **change)


def steeper(s: Any) -> None:
    patch = s.model.patch
    s.model = replace(
        s.model, patches={"contact": replace(patch, x=1e-3 * patch.x, y=1e-3 * patch.y)}
    )


def softer(s: Any) -> None:
    scene = s.plan.scene
    name = next(iter(scene.materials))
    soft = replace(scene.materials[name], E=1.0)
    s.plan = replace(s.plan, scene=replace(scene, materials={**scene.materials, name: soft}))


def incompressible(s: Any) -> None:
    """Bodies of hex8 that hardly change their volumes."""
    scene = s.plan.scene
    held = {name: replace(one, nu=0.49) for name, one in scene.materials.items()}
    mesh = replace(scene.mesh, element="hex8")
    s.plan = replace(s.plan, scene=replace(scene, materials=held, mesh=mesh))


def yielding(s: Any) -> None:
    """One body's material yields at hardly any stress."""
    scene = s.plan.scene
    name = next(iter(scene.materials))
    weak = replace(scene.materials[name], yield_stress=1e-3)
    s.plan = replace(s.plan, scene=replace(scene, materials={**scene.materials, name: weak}))


def loop(s: Any) -> None:
    s.paths = [replace(p, loop_area=2.0 * p.loop_area) if p.cycle else p for p in s.paths]


def solved_again(effect: str) -> Callable[[Any], None]:
    def spoil(s: Any) -> None:
        k = next(i for i, one in enumerate(s.left_out) if one.effect == effect)
        s.left_out[k] = replace(s.left_out[k], included=3.0 * s.left_out[k].without)

    return spoil


def moment(s: Any) -> None:
    f, model = s.normal[0].solution.force, s.model
    closed = np.flatnonzero(f > 0.0)
    y = model.lower.mesh.points[model.lower.contact[model.multipliers.nodes], 1]
    low, high = closed[np.argmin(y[closed])], closed[np.argmax(y[closed])]
    moved(s, low, high, 0.1 * min(f[low], f[high]))


def few_lines(s: Any) -> None:
    patches: Any = {
        name: SimpleNamespace(quads=None, X=p.X, Y=p.Y[::2], mirrored=p.mirrored)
        for name, p in s.model.patches.items()
    }
    s.model = replace(s.model, patches=patches)


def careless(s: Any) -> None:
    """Products with K of one body that were solved to a thousandth."""
    condensed = {k: (copy.copy(one), at) for k, (one, at) in s.model.upper.condensed.items()}
    for one, _ in condensed.values():
        one.errors = [1e-3] * len(one.errors)
    s.model = replace(s.model, upper=replace(s.model.upper, condensed=condensed))


COMMON: dict[str, Callable[[Any], None]] = {
    "reaction": reaction,
    "no tension": tension,
    "no force across a gap": force_across_a_gap,
    "tangential balance": lambda s: nodes(s, lambda t: {"load": 1.01 * t.load}),
    "Coulomb limit": lambda s: nodes(s, lambda t: {"limit": limit_lowered(t)}),
    "slip at the limit": lambda s: nodes(s, lambda t: {"stick": one_slips(t)}),
    "stick": lambda s: nodes(s, lambda t: {"before": stuck_moved(t)}),
    "slip direction": lambda s: nodes(s, lambda t: {"before": slip_reversed(t)}),
    "Dundurs beta": softer,
    "onset of yield": yielding,
    **{effect: solved_again(effect) for effect in (left_out.DIRECTIONS, left_out.COUPLING)},
}

#: (analysis, toy, name of the check) -> what makes it fail
SPOILERS: dict[tuple[str, str, str], Callable[[Any], None]] = {
    **{("hertz", "sphere", name): spoil for name, spoil in COMMON.items()},
    ("hertz", "sphere", "no penetration"): penetration,
    ("hertz", "sphere", "loop area"): loop,
    ("hertz", "sphere", "patch rim"): rim,
    ("hertz", "sphere", "resolution"): lambda s: measures(s, radius_moment=1e-6),
    ("hertz", "sphere", "locking"): incompressible,
    ("hertz", "sphere", "body compression"): lambda s: setattr(s, "no_shares", "too coarse"),
    ("hertz", "own", "slope in the contact"): steeper,
    ("hertz", "products", "products"): careless,
    **{("flat", "damper", name): spoil for name, spoil in COMMON.items()},
    ("flat", "damper", "loop area"): loop,
    ("flat", "damper", "resolution"): few_lines,
    ("flat", "damper", left_out.TILT): solved_again(left_out.TILT),
    ("flat", "tilting", "no penetration"): penetration,
    ("flat", "tilting", "moment balance"): moment,
}


@pytest.mark.parametrize(("analysis", "toy", "name"), SPOILERS)
def test_a_spoiled_answer_fails_exactly_its_check(analysis: str, toy: str, name: str) -> None:
    solution = fresh(toy)
    assert solution.plan.scene.analysis.startswith({"hertz": "curved", "flat": "flat"}[analysis])
    before = failures(toy, solution)
    assert before <= {"resolution"}  # a toy is coarse
    SPOILERS[analysis, toy, name](solution)
    assert failures(toy, solution) - before == {name} - before


def test_every_check_of_a_contact_has_a_spoiler() -> None:
    names = {
        check.name
        for toy, (scene, overrides) in TOYS.items()
        for check in analysis_of(as_scene(scene, overrides)).check_solution(fresh(toy))
    }
    # of bodies that are rarely made
    names |= {"locking", "body compression"}
    assert {name for _, _, name in SPOILERS} >= names | set(left_out.REMEDIES)


def test_one_element_across_flat_faces_warns() -> None:
    coarse = ["geometry.divisions=1", "geometry.divisions_long=2", "left_out.solve=no"]
    result = upd.run("symmetric", overrides=[*coarse, "want=['normal','stiffness']"])
    assert "resolution" in result.status
    (check,) = (c for c in result.checks if c.name == "resolution")
    assert "geometry.divisions to 4 or more" in check.remedy
