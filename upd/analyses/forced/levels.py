"""Levels of a response: coarser and finer in one source of error each.

Every level is the scene with one thing changed: a model of its own, or other harmonics or samples.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from upd.analyses.cost import NODES
from upd.analyses.forced.plan import ForcedPlan
from upd.hbm.core.fourier import harmonics, sample_count
from upd.mesh import recipes
from upd.scene import ForcedScene
from upd.scene.forced_contact import GAUSS, SIDES, FaceLines, FrictionChoice
from upd.scene.quantities import UNKNOWN
from upd.vary.variation import Overrides, Variation

RECIPE = "blade_rig"
#: off the contact, see `geometry.blade_rig_params`
OFF_CONTACT = (
    "across",
    "base_columns",
    "base_side",
    "base_layers",
    "shank_layers",
    "platform_layers",
    "core_layers",
    "core_upper",
    "wing_columns",
)
#: arrangement -> counts up its faces, and the count along the damper
FACES: Mapping[str, tuple[tuple[str, ...], str]] = {
    "symmetric": (("patch_along_slope",), "patch_along_y"),
    "asymmetric": (("pad_along_slope", "face_along_z"), "pad_along_y"),
}
#: elements of the coarsest graded mesh for those of the recipe's defaults: from every re-entrant
#: edge on as many, which shank, core and platform have on both sides; few along the damper and many
#: up the slope, where free and stuck frequencies gain the least and the most for their dofs
GRADED: Mapping[str, int] = {
    "across": 4,
    "base_columns": 4,
    "base_side": 2,
    "base_layers": 4,
    "shank_layers": 4,
    "platform_layers": 6,
    "core_layers": 6,
    "core_upper": 2,
    "wing_columns": 4,
    "patch_along_slope": 8,
    "patch_along_y": 6,
    "pad_along_slope": 4,
    "pad_along_y": 4,
    "face_along_z": 4,
}
#: ratio of neighbouring sizes in the coarsest graded mesh, and its elements beside a re-entrant
#: edge outside and inside of shank, core and platform
_GROWTH, _OUTSIDE, _INSIDE = 2.0, 4, 2
#: exponent of displacements at a right-angled re-entrant edge: sin(3 pi x / 2) = -x
_EDGE = 0.5445
MESH, MODES, POINTS = "mesh", "modes kept", "contact points"
HARMONICS, SAMPLES, TIME = "harmonics", "samples", "time integration"
#: elements along every edge of the coarser meshes, over those of the run
COARSER = (0.75, 0.5)
#: spacing of the nodes of linear elements over that of quadratic ones on the same lattice
_LINEAR = 2.0
#: rows of Gauss points of the levels, over those of the run
OTHER_ROWS = (1.5, 0.7)
#: the same of a run on lattice lines, and what stands for their number
_GAUSS_ROWS, _LATTICE = (4, 8), 3
#: harmonics that a finer level has more than the run
MORE_HARMONICS = 2
#: times the samples of the run
_MORE_SAMPLES = 2


def level_variations(plan: ForcedPlan) -> list[Variation]:
    """Half of the modes, more contact points; more harmonics, more samples; coarser meshes."""
    scene = plan.scene
    modes, highest = scene.reduction.modes, int(scene.balance.harmonics)
    out = []
    if modes > 1:
        few = modes // 2
        half = (("reduction.modes", few),)
        out.append(Variation(MODES, f"{few} modes a blade", half, size=modes / few))
    out += _contact_levels(scene.contact)
    more = highest + MORE_HARMONICS
    finer = (("balance.harmonics", more), ("balance.samples", samples(scene, 1, more)))
    label = f"{MORE_HARMONICS} harmonics more"
    out.append(Variation(HARMONICS, label, finer, size=highest / more))
    twice = (("balance.samples", samples(scene, _MORE_SAMPLES)),)
    label = f"{_MORE_SAMPLES} times the samples"
    out.append(Variation(SAMPLES, label, twice, size=1.0 / _MORE_SAMPLES))
    return [*out, *(_coarser(plan, factor) for factor in COARSER)]


def samples(scene: ForcedScene, factor: int, highest: int = 1) -> int:
    """So many times those of the scene's balance, and as many as the rule gives a harmonic."""
    given, rule = scene.balance.samples, sample_count(harmonics(range(highest + 1)))
    own = sample_count(harmonics(scene.harmonic_numbers)) if given == "auto" else int(given)
    return max(factor * own, rule)


def _coarser(plan: ForcedPlan, factor: float) -> Variation:
    """The blades on a coarser mesh with the same contact points; without overrides where the mesh
    has no such level.

    Where the recipe does not tell the elements, or the contact points are nodes, quadratic elements
    become linear ones with incompatible modes at the last.
    """
    scene, size = plan.scene, 1.0 / factor
    label, changes = f"{factor:g} times the elements along every edge", Overrides()
    if scene.contact.rule == GAUSS and recipes.has_parameter(scene.recipe, "refine"):
        refine = plan.parameters.get("refine", count_of(scene, "refine"))
        changes = of_geometry({"refine": factor * refine})
    elif NODES[scene.mesh.element] > 8 and factor == min(COARSER):
        changes = (("mesh.element", "hex8i"),)
        label, size = "hex8i elements on the same lattice", _LINEAR
    # it has no levels of its own
    alone = (*changes, ("accuracy", UNKNOWN)) if changes else ()
    return Variation(MESH, label, alone, size=size)


def of_geometry(parameters: Mapping[str, Any]) -> Overrides:
    """Parameters of a recipe as overrides."""
    return tuple((f"geometry.{name}", value) for name, value in parameters.items())


def lines_named(contact: FrictionChoice) -> bool:
    """Whether a scene names single lattice lines."""
    lines = [one for side in SIDES for one in contact.lines(side)]
    return any(one != "all" and not isinstance(one, int) for one in lines)


def with_gauss(rows: int, columns: int) -> Overrides:
    """So many Gauss points on each face."""
    return (
        ("contact.rule", GAUSS),
        ("contact.rows", rows),
        ("contact.columns", columns),
        ("contact.share", "area"),
        *((f"contact.{side}", FaceLines()) for side in SIDES),
    )


def _contact_levels(contact: FrictionChoice) -> list[Variation]:
    """More and fewer Gauss points than the run has; Gauss points where it has lattice lines of
    whole faces.

    Lines that the scene names are a choice of the patch: they have no finer level.
    """
    if contact.rule == GAUSS:
        row, column = int(contact.rows), int(contact.columns)
        rows = dict.fromkeys(math.ceil(factor * row) for factor in OTHER_ROWS)
        counts = [(one, column) for one in rows if one != row]
    else:
        if lines_named(contact):
            return []
        row, counts = _LATTICE, [(rows, 2) for rows in _GAUSS_ROWS]
    return [
        Variation(POINTS, f"{m} x {n} Gauss points", with_gauss(m, n), size=row / m)
        for m, n in counts
    ]


# -- numbers of elements ---------------------------------------------------------------------------


def count_of(scene: ForcedScene, key: str) -> int:
    """A number of elements, as the scene or the recipe gives it."""
    default = recipes.parameters(scene.recipe).__dataclass_fields__[key].default
    return int(scene.geometry.get(key, default))


def meshed(scene: ForcedScene) -> tuple[str, ...]:
    """Counts that its mesh is refined by: on the contact too, where the contact points are none of
    its nodes.
    """
    slopes, along = FACES[scene.arrangement]
    return (*OFF_CONTACT, *((*slopes, along) if scene.contact.rule == GAUSS else ()))


def graded(scene: ForcedScene, factor: float) -> dict[str, Any]:
    """A mesh that gets finer at re-entrant edges faster than elsewhere, as the recipe's parameters.

    Where displacements go with r^a from an edge, elements of order p leave an error of h^p if their
    sizes are h r^(1 - a/p) [1]_: a stretch that ends there is divided at (i/n)^q, q = p/a, and its
    last size is n^(q - 1) times its first. With s times the elements, sizes that grow by g each do
    so with g^(n - 1) = 2^(n_1 - 1) s^(q - 1), n = s n_1; a = 0.5445 at a right angle [2]_. Equal
    division, or one that keeps the ratio of sizes, leaves h^a, and one that keeps g as much as its
    largest elements leave.

    Parameters
    ----------
    scene
        Its own counts multiply those of the mesh, over the defaults of the recipe.
    factor
        s, 1 or more.

    Returns
    -------
    dict
        Counts, those on the contact where it is refined too (`meshed`), and growths.

    References
    ----------
    .. [1] I. Babuska, R. B. Kellogg, J. Pitkaranta, Numer. Math. 33 (1979) 447.
    .. [2] M. L. Williams, J. Appl. Mech. 19 (1952) 526.
    """
    known = recipes.parameters(scene.recipe).__dataclass_fields__
    order = 1 if NODES[scene.mesh.element] == 8 else 2
    out: dict[str, Any] = {}
    for key in meshed(scene):
        step = 2 if known[key].metadata["bounds"].even else 1
        own = count_of(scene, key) / int(known[key].default)
        # up to rounding in the product
        out[key] = step * max(1, math.ceil(round(factor * GRADED[key] * own / step, 9)))
    for name, n in (("growth", _OUTSIDE), ("growth_inside", _INSIDE)):
        ends = _GROWTH ** (n - 1) * factor ** (order / _EDGE - 1.0)
        out[name] = ends ** (1.0 / (factor * n - 1.0))
    return out
