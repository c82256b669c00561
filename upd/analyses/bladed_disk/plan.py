"""Plan of a bladed disk: one sector, which nodal diameters are computed, effects, size and cost;
what a convergence study varies.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from upd.analyses.base import Effect, Plan
from upd.analyses.cost import NODES, CostModel
from upd.errors import InputError
from upd.mesh import recipes
from upd.scene import BladedDiskScene
from upd.vary.ladder import Asked, Ladder, chosen_levels, counts
from upd.vary.solve import changed
from upd.vary.variation import Overrides, Variation

BladedDiskPlan = Plan[BladedDiskScene]
#: checks of effects left out
CORIOLIS, DISPLACED = "Coriolis force", "initial displacements"
# Figures, page.
_FILES_S = 1.5
# Bytes of the complex problem of a nodal diameter over those of the real sector: of its modes,
# with its reduction (recorded: 3.4 at 3000 dofs, 3.6 to 3.9 at 54 000).
_COMPLEX, _REDUCED = 2.0, 4.0
# A damped curve, in seconds of one thread (recorded: 4 to 10), at so many unknowns.
_CURVE_S, _UNKNOWNS = 6.0, 756.0


def parameters(scene: BladedDiskScene) -> dict[str, Any]:
    """Parameters of the recipe."""
    own = {k: v for k, v in scene.geometry.items() if k != "recipe"}
    return {**own, "element_nodes": NODES[scene.mesh.element]}


def computed(scene: BladedDiskScene) -> tuple[int, ...]:
    """Nodal diameters whose modes are computed, 0 to N/2, denser where the disk moves most."""
    most = scene.n_sectors // 2
    count = min(scene.modes.computed, most + 1)
    places = most * (1.0 - np.cos(np.linspace(0.0, 0.5 * np.pi, count)))
    return tuple(dict.fromkeys(np.rint(places).astype(int).tolist()))


def rotates(scene: BladedDiskScene) -> bool:
    """Whether any output needs the rotating sector."""
    return scene.wants("campbell", "interference") or damped(scene)


def damped(scene: BladedDiskScene) -> bool:
    """Whether the damped response is solved."""
    return scene.wants("response", "performance")


def make_plan(scene: BladedDiskScene) -> BladedDiskPlan:
    """Derive the plan of ``scene``."""
    chosen = parameters(scene)
    cost = CostModel(scene, recipes.count(scene.recipe, chosen))
    curves = 1.5 * damped(scene) + len(scene.response.ratios) * scene.wants("performance")
    for body, count in cost.size.items():
        cost.dynamic_body(count, 2.0)
        # the check solves one more; of the harmonics, some share a nodal diameter
        most = min(scene.response.harmonics + 1, scene.n_sectors // 2 + 1)
        times = len(computed(scene)) + 1 + most * damped(scene)
        cost.modes(f"{body}, modes", count, times)
        unknowns = 6 * count["contact"] * (2 * scene.response.harmonics + 1)
        cost.shared += float(curves * _CURVE_S * (unknowns / _UNKNOWNS) ** 1.5)
    cost.jobs = [(_REDUCED if damped(scene) else _COMPLEX) * one for one in cost.jobs]
    needs = cost.side_by_side(cost.threads, len(computed(scene)))
    return BladedDiskPlan.of(cost, "full", chosen, _effects(scene), needs, _FILES_S)


def _effects(scene: BladedDiskScene) -> list[Effect]:
    turns, known = rotates(scene), ", ".join(map(str, computed(scene)))
    unasked, either = "no output asks for a speed", Effect.either
    off = "small" if turns else unasked
    return [
        Effect(
            "cyclic symmetry",
            True,
            f"one of {scene.n_sectors} sectors; nodal diameters {known} computed, the others in "
            "the span of their modes",
        ),
        either(
            "centrifugal stiffening",
            turns,
            "stresses at nodal diameter 0, spin softening",
            unasked,
        ),
        Effect(DISPLACED, False, off, DISPLACED, applies=turns),
        Effect(CORIOLIS, False, off, CORIOLIS, applies=turns),
        Effect("mistuning", False, "all blades are alike"),
        either(
            "friction",
            damped(scene),
            "a rigid wedge in every gap, at the speed of the crossing",
            "no output asks for the damped response",
        ),
    ]


# -- convergence studies: counts of elements, harmonics --------------------------------------------


_RESPONSE: Overrides = (("want", ["response"]),)
#: shares of the scene's own counts
_SHARES = (0.35, 0.5, 0.7, 1.0)


def _meshes(scene: BladedDiskScene, asked: Asked) -> Iterator[Variation]:
    """Shares of all counts of elements; the size is the cube root of the hexahedra."""
    kinds = "layers", "columns", "axial"
    own = {name: n for name, n in scene.geometry.items() if name.endswith(kinds)}
    if not own:
        raise InputError("--vary mesh: geometry names no numbers of elements; give them")
    shares = chosen_levels(asked or _SHARES, lambda n: n > 0.0, "shares of the elements, above 0")
    for share in shares:
        # an overhang has two columns at least
        given = (
            (f"geometry.{name}", max(1 + ("over" in name), round(share * n)))
            for name, n in own.items()
        )
        overrides: Overrides = (("want", ["modes"]), *given)
        plans = make_plan(scene), make_plan(changed(scene, overrides))
        hexes = [sum(body["hexes"] for body in one.size.values()) for one in plans]
        size = (hexes[0] / hexes[1]) ** (1.0 / 3.0)
        yield Variation("mesh", f"{share:g} of the elements along edges", overrides, size)


LADDERS: Mapping[str, Ladder] = {
    "mesh": Ladder(_meshes),
    "harmonics": Ladder(
        counts("harmonics", "{} harmonics", "response.harmonics", (1, 3, 5), 1, _RESPONSE)
    ),
}
