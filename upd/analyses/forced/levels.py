"""Levels of a response: coarser and finer in one source of error each.

Every level is a model of its own or another choice of harmonics and samples.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal

from upd.analyses.cost import NODES
from upd.analyses.forced.model import Model, make_model
from upd.analyses.forced.peaks_again import Variant
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.stiffness import FaceLaw
from upd.analyses.seated.bodies import Bodies, make_bodies
from upd.errors import UpdError, one_line
from upd.mesh import recipes
from upd.scene import ForcedScene
from upd.scene.forced_contact import GAUSS, SIDES, FaceLines, FrictionChoice, Side
from upd.scene.quantities import UNKNOWN
from upd.vary.variation import Variation

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
MORE_HARMONICS = (2,)
#: times the samples of the run
_MORE_SAMPLES = 2
Laws = Mapping[Side, FaceLaw]


def coarse_model(plan: ForcedPlan, base: Model, laws: Laws, factor: float) -> Variant:
    """The blades on a coarser mesh with the same contact points.

    Parameters
    ----------
    base
        Of the run.
    factor
        On the elements along every edge.
    """
    begin = time.perf_counter()
    other, label, size = _coarser(plan, factor)
    of = Variation(MESH, label, size=size)
    if other is None:
        return Variant(of, why="the mesh has no such level")
    try:
        model = make_model(_alike(other, base), make_bodies(other), laws, base.state)
    except UpdError as error:
        return Variant(of, why=one_line(error))
    return Variant(of, model, seconds=time.perf_counter() - begin)


def _coarser(plan: ForcedPlan, factor: float) -> tuple[ForcedPlan | None, str, float]:
    """The plan of a coarser mesh, its label and size.

    Where the recipe does not tell the elements, or the contact points are nodes, quadratic elements
    become linear ones with incompatible modes at the last.
    """
    scene, parameters, size = plan.scene, dict(plan.parameters), 1.0 / factor
    label = f"{factor:g} times the elements along every edge"
    gauss = scene.contact.rule == GAUSS
    counts = (*OFF_CONTACT, *on_contact(scene)) if scene.recipe == RECIPE and gauss else ()
    fewer = times(scene, counts, factor)
    if fewer != times(scene, counts, 1.0):
        parameters |= fewer
    elif gauss and "refine" in parameters and scene.recipe != RECIPE:
        parameters["refine"] = factor * parameters["refine"]
    elif NODES[scene.mesh.element] > 8 and factor == min(COARSER):
        scene = replace(scene, mesh=replace(scene.mesh, element="hex8i"))
        parameters["element_nodes"] = NODES["hex8i"]
        label, size = "hex8i elements on the same lattice", _LINEAR
    else:
        return None, label, size
    # it has no levels of its own
    scene = replace(scene, accuracy=UNKNOWN)
    return replace(plan, scene=scene, parameters=parameters, workers=1), label, size


def other_levels(plan: ForcedPlan, base: Model, bodies: Bodies, laws: Laws) -> list[Variant]:
    """Half of the modes, more contact points; more harmonics, twice the samples."""
    scene, count = plan.scene, plan.scene.reduction.modes
    wanted = []
    if count > 1:
        fewer = replace(scene.reduction, modes=count // 2)
        of = Variation(MODES, f"{count // 2} modes a blade", size=count / (count // 2))
        wanted.append((of, replace(scene, reduction=fewer)))
    for label, size, contact in _contact_levels(scene.contact):
        of = Variation(POINTS, label, size=size)
        wanted.append((of, replace(scene, contact=contact)))
    out = []
    for of, other in wanted:
        try:
            model = make_model(_alike(replace(plan, scene=other), base), bodies, laws, base.state)
        except UpdError as error:
            out.append(Variant(of, why=one_line(error)))
        else:
            out.append(Variant(of, model))
    for more in MORE_HARMONICS:
        out.append(Variant(Variation(HARMONICS, f"{more} harmonics more"), more=more))
    twice = Variation(SAMPLES, f"{_MORE_SAMPLES} times the samples", size=1.0 / _MORE_SAMPLES)
    return [*out, Variant(twice, finer=_MORE_SAMPLES)]


def lines_named(contact: FrictionChoice) -> bool:
    """Whether a scene names single lattice lines."""
    lines = [one for side in SIDES for one in contact.lines(side)]
    return any(one != "all" and not isinstance(one, int) for one in lines)


def with_gauss(contact: FrictionChoice, rows: int, columns: int) -> FrictionChoice:
    """The contact with so many Gauss points on each face."""
    given: dict[str, Any] = {side: FaceLines() for side in SIDES}
    return replace(contact, rule=GAUSS, rows=rows, columns=columns, share="area", **given)


def _contact_levels(contact: FrictionChoice) -> list[tuple[str, float, FrictionChoice]]:
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
        (
            f"{rows} x {columns} Gauss points",
            row / rows,
            with_gauss(contact, rows, columns),
        )
        for rows, columns in counts
    ]


def _alike(plan: ForcedPlan, model: Model) -> ForcedPlan:
    """The plan with the sliding directions of a model, one blade after the other."""
    directions: Literal["one", "two"] = "one" if model.contacts.tangents < 2 else "two"
    contact = replace(plan.scene.contact, directions=directions)
    return replace(plan, scene=replace(plan.scene, contact=contact), workers=1)


# -- numbers of elements ---------------------------------------------------------------------------


def count_of(scene: ForcedScene, key: str) -> int:
    """A number of elements, as the scene or the recipe gives it."""
    default = recipes.parameters(scene.recipe).__dataclass_fields__[key].default
    return int(scene.geometry.get(key, default))


def on_contact(scene: ForcedScene) -> tuple[str, ...]:
    """Counts of the scene's contact faces that its recipe has."""
    slopes, along = FACES[scene.arrangement]
    return tuple(key for key in (*slopes, along) if recipes.has_parameter(scene.recipe, key))


def meshed(scene: ForcedScene) -> tuple[str, ...]:
    """Counts that its mesh is refined by: on the contact too, where the contact points are none of
    its nodes.
    """
    return (*OFF_CONTACT, *(on_contact(scene) if scene.contact.rule == GAUSS else ()))


def times(scene: ForcedScene, keys: tuple[str, ...], factor: float) -> dict[str, Any]:
    """So many times the counts, rounded up to those the recipe allows, as its parameters."""
    known = recipes.parameters(scene.recipe).__dataclass_fields__
    out = {}
    for key in keys:
        step = 2 if known[key].metadata["bounds"].even else 1
        count = -int(-factor * count_of(scene, key) / step // 1)
        out[key] = step * max(1, count)
    return out


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
