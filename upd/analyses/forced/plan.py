"""Plan of a forced response.

What is simulated and left out, how that is checked afterwards, size and cost.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from upd.analyses.base import NODES, CostModel, Effect, Needs, Plan
from upd.analyses.forced.stiffness import check_sources
from upd.cache.sources import key_of
from upd.mesh import recipes
from upd.scene import ForcedScene

# Measured on one core at 2.1 GHz: a reduction in factorisations of its blade, a contact analysis in
# seconds, and a point of the curve in seconds per cubed unknown.
_REDUCTION, _CONTACT_S, _POINT_S, _LEAST_POINT_S = 3.0, 10.0, 2.0e-10, 2e-3

ForcedPlan = Plan[ForcedScene]

#: checks of what is left out; each solves a number again with the effect
ALONG = "sliding along y"
ODD = "odd motion"
FIT = "faces that fit without load"
HARMONICS = "more harmonics"
SAMPLES = "twice the samples"
START = "other slider starts"
TWO_K_T = "the softer k_t"
MODES = "more modes"
ELASTIC = "elastic damper"
#: harmonics and fixed-interface modes added to see what those left out would change
MORE_HARMONICS, MORE_MODES = 2, 10


def make_plan(scene: ForcedScene) -> ForcedPlan:
    """Derive the plan of ``scene``. Raises InputError when its parts do not fit together."""
    parameters = _parameters(scene)
    check_sources(scene)
    size: dict[str, Mapping[str, int]] = {
        body: dict(count) for body, count in recipes.count(scene.recipe, parameters).items()
    }
    cost, memory, workers = _cost(scene, size)
    return ForcedPlan(
        scene,
        parameters,
        "full" if scene.mesh.symmetry == "full" else "half",
        tuple(_effects(scene)),
        size,
        cost.solver,
        cost.seconds,
        memory,
        workers,
    )


def _parameters(scene: ForcedScene) -> dict[str, Any]:
    own = {k: v for k, v in scene.geometry.items() if k not in ("recipe", "damper")}
    chosen = {
        "arrangement": scene.arrangement,
        "damper": "free",
        "symmetry": "full",
        "element_nodes": NODES[scene.mesh.element],
    }
    return {**own, **chosen}


def _cost(
    scene: ForcedScene, size: Mapping[str, Mapping[str, int]]
) -> tuple[CostModel, float, int]:
    """Seconds and solvers, bytes, and blades reduced side by side."""
    cost = CostModel(scene)
    for body in ("left", "right"):
        cost.dynamic_body(size[body]["hexes"])
        cost.solved(f"{body}, reduction", 3 * size[body]["nodes"], times=1.0 + _REDUCTION)
    own = len({(s.scene, s.bodies) for s in scene.stiffnesses.values() if s.scene is not None})
    n_curve = len(scene.stiffnesses) * len(scene.excitation.centrifugal_to_force)
    cost.seconds += own * _CONTACT_S + n_curve * scene.excitation.points * _point_seconds(
        scene, size
    )
    return cost, *cost.side_by_side(min(2, cost.threads), 2)


def _point_seconds(scene: ForcedScene, size: Mapping[str, Mapping[str, int]]) -> float:
    """Seconds per frequency: Newton steps on the displacements of all contact points."""
    n_point = sum(_point_count(scene, size[side]["contact"], side) for side in ("left", "right"))
    highest = 3 if scene.balance.harmonics == "adaptive" else int(scene.balance.harmonics)
    unknowns = 3 * n_point * (2 * highest + 1)
    return _LEAST_POINT_S + _POINT_S * float(unknowns) ** 3


def _point_count(scene: ForcedScene, nodes: int, side: Any) -> float:
    """Contact points of a face, roughly.

    The lattice has a third of a quadratic patch's nodes, a few rows of many columns.
    """
    corners = nodes / (
        3.0 if NODES[scene.mesh.element] == 20 else 4.0 if NODES[scene.mesh.element] == 27 else 1.0
    )
    usual = {"rows": 5.0, "columns": max(1.0, corners / 5.0)}
    product = 1.0
    for name, choice in zip(usual, scene.contact.lines(side), strict=True):
        product *= (
            usual[name]
            if choice == "all"
            else float(choice)
            if isinstance(choice, int)
            else float(len(choice))
        )
    return product


def needs(plan: ForcedPlan, threads: int) -> Needs:
    """What a point of a sweep with this plan needs, and may share with others."""
    del threads
    scene = plan.scene
    mesh = {"recipe": scene.recipe, "parameters": dict(plan.parameters)}
    model = mesh | {"mesh": scene.mesh, "material": scene.material, "reduction": scene.reduction}
    return Needs(key_of(model), key_of(mesh))


def _effects(scene: ForcedScene) -> list[Effect]:
    mu, b, c = scene.contact.friction, scene.balance, scene.contact
    adaptive = b.harmonics == "adaptive"
    samples = "power of two by rule" if b.samples == "auto" else f"{b.samples} a period"
    measured = any(s.from_contact for s in scene.stiffnesses.values())
    loaded = c.fit == "loaded"
    return [
        Effect(
            "friction",
            mu > 0.0,
            f"Coulomb, mu = {mu:g}; a curve stuck everywhere is answered linearly"
            if mu
            else "mu = 0",
            applies=mu > 0.0,
        ),
        _along(scene),
        Effect(
            "motion odd about y = 0",
            scene.mesh.symmetry == "full",
            'mesh.symmetry = "full"'
            if scene.mesh.symmetry == "full"
            else "points and their mirror images move as one, where they come in pairs",
            ODD,
            ("mesh.symmetry=full",),
        ),
        Effect("lift-off", True, "every point may open: N = max(0, k_n w)"),
        Effect(
            "static balance",
            True,
            "mean positions are unknowns beside the vibration",
            "damper at rest",
        ),
        Effect(
            "blades spread by F_C",
            not loaded,
            f"the faces fit each other {'under F_C, worn in' if loaded else 'without load'}",
            FIT if loaded else "",
            ("contact.fit=unloaded",) if loaded else (),
        ),
        Effect("damper inertia", True, "rigid body; mass and inertia from its mesh"),
        Effect(
            "harmonics",
            True,
            "as many as matter, up to 31" if adaptive else f"0 to {b.harmonics}",
            "energy balance",
        ),
        Effect(
            "harmonics above",
            False,
            "added only where they matter" if adaptive else "not asked for",
            HARMONICS,
            () if adaptive else (f"balance.harmonics={b.harmonics + MORE_HARMONICS}",),
        ),
        Effect("signal between samples", False, samples, SAMPLES),
        Effect(
            "other slider starts",
            scene.wants("spread"),
            f"sliders start at {b.slider}; points that always stick remember it",
            "" if scene.wants("spread") else START,
            () if scene.wants("spread") else ("balance.slider=mid",),
        ),
        Effect(
            "two tangential stiffnesses",
            False,
            "one k_t a point, the mean of both directions" if measured else "one K_T is given",
            TWO_K_T if measured else "",
            applies=measured,
        ),
        Effect(
            "preload of the contact run",
            False,
            "the static balance gives the normal forces; its states are the slider starts",
            START,
            applies=not scene.wants("spread"),
        ),
        Effect(
            "damper elasticity",
            False,
            "in the contact stiffness; the body moves rigidly",
            ELASTIC,
        ),
        Effect(
            "modes above",
            False,
            f"{scene.reduction.modes} fixed-interface modes a blade",
            MODES,
            (f"reduction.modes={scene.reduction.modes + MORE_MODES}",),
        ),
        Effect(
            "rotation",
            False,
            "the rig does not turn: wires pull the damper with F_C",
            applies=False,
        ),
    ]


def _along(scene: ForcedScene) -> Effect:
    """Whether the second sliding direction is simulated."""
    name, c = "sliding along the damper", scene.contact
    if c.directions == "two":
        return Effect(name, True, "slip circle: along the damper and up the slope")
    why = (
        "left out where it changes the stuck frequencies by less than 0.1 %"
        if c.directions == "auto"
        else "asked for"
    )
    return Effect(name, False, why, ALONG, ("contact.directions=two",), applies=c.friction > 0.0)
