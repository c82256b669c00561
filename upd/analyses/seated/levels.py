"""Companions of a seated damper: coarser lattices of its faces, and on one of them finer bodies and
shorter load steps.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from upd.analyses.companions import COARSER, Companion
from upd.analyses.seated.plan import SeatedPlan, make_plan, solve_seconds
from upd.errors import InputError, one_line
from upd.mesh import recipes
from upd.mesh.fields import Bounds
from upd.mesh.recipe_modules import is_mesh
from upd.scene import SeatedScene
from upd.scene.quantities import UNKNOWN

#: sources of error
NODES, MESH, STEPS = "contact nodes", "mesh", "load steps"
#: arrangement -> elements up a patch, and those that go with them, along it first
PATCH = {
    "symmetric": ("patch_along_slope", ("patch_along_y",)),
    "asymmetric": ("pad_along_slope", ("pad_along_y", "face_along_z")),
}
#: elements along an edge, or load steps, of a finer companion over those of its base
_FINER = 2
#: largest share of the run, companions included, that these take
_SHARE = 0.35
_Counts = Mapping[str, int]


@dataclass
class SeatedCompanions:
    """What a run's errors are estimated with.

    Attributes
    ----------
    lattices
        The same bodies with coarser lattices on the faces, the coarsest first.
    others
        Source -> the coarsest of these with it refined, or coarser; the run's own lattice where
        there is no coarser one.
    told
        Source -> why it has no companion.
    """

    lattices: list[Companion] = field(default_factory=list)
    others: dict[str, Companion] = field(default_factory=dict)
    told: dict[str, str] = field(default_factory=dict)

    @property
    def seconds(self) -> float:
        """Predicted, of all."""
        return sum(one.seconds for one in (*self.lattices, *self.others.values()))

    def take(self, source: str, one: Companion, budget: float) -> None:
        """Take a companion where all then fit into a budget in seconds; tell why where not."""
        if self.seconds + one.seconds > budget:
            share = f"{100.0 * _SHARE:.0f} % of the run"
            self.told.setdefault(source, f"{one.label}: {one.seconds:.2g} s, beyond {share}")
        elif source == NODES:
            self.lattices.append(one)
        else:
            self.others[source] = one


def companions(plan: SeatedPlan) -> SeatedCompanions:
    """The companions of a plan; none where its scene wants none.

    Coarser lattices of the faces tell what the contact's nodes leave. On the coarsest, where a
    seating costs a few hundredths, all bodies get twice the elements along every edge and the
    faces' nodes stay; and every load step is halved. What these change there is taken for what they
    change in the run. All of them take at most 35 % of the run: where they would take more the
    bodies get half the elements instead, and lattices between are left out.

    Parameters
    ----------
    plan
        Without companions' cost.
    """
    out = SeatedCompanions()
    if not plan.scene.estimates:
        return out
    scene = companion_scene(plan.scene)
    own = lattice_counts(scene)
    coarsest, keeps = _coarsest(scene, own)
    made: dict[str, Companion] = {}

    def make(source: str, one: Callable[[], Companion]) -> None:
        try:
            made[source] = one()
        except InputError as error:
            out.told[source] = one_line(error)

    budget = _SHARE / (1.0 - _SHARE) * plan.seconds
    if coarsest == own:
        out.told[NODES] = "the lattice of the faces cannot be made coarser"
    else:
        make(NODES, lambda: _on_lattice(scene, own, coarsest))
    make(STEPS, lambda: _shorter_steps(scene, coarsest))
    if keeps:
        make(MESH, lambda: _other_bodies(scene, coarsest, _FINER))
        if sum(one.seconds for one in made.values()) > budget:
            make(MESH, lambda: _other_bodies(scene, coarsest, 1.0 / _FINER))
    else:
        out.told[MESH] = "the bodies cannot be refined with the lattice of the faces kept"
    for source, one in made.items():
        if source != NODES and coarsest != own and not out.lattices:
            out.told[source] = f"{_label(coarsest)}, which it stands on: {out.told[NODES]}"
        else:
            out.take(source, one, budget)
    if out.lattices:
        _between(out, scene, own, coarsest, budget)
    return out


def _between(
    out: SeatedCompanions, scene: SeatedScene, own: _Counts, coarsest: _Counts, budget: float
) -> None:
    """Lattices between the run's and the coarsest, as far as they fit; the coarser ones first."""
    taken = [own, coarsest]
    for ratio in COARSER[1::-1]:
        counts = _coarser(scene, own, ratio)
        if counts in taken:
            continue
        taken.append(counts)
        with suppress(InputError):
            out.take(NODES, _on_lattice(scene, own, counts), budget)


def companion_scene(scene: SeatedScene) -> SeatedScene:
    """The scene without what is solved again and without estimates of its own."""
    return replace(
        scene,
        left_out=replace(scene.left_out, solve="no"),
        accuracy=UNKNOWN,
        uncertain={},
    )


def shorter_steps(scene: SeatedScene) -> SeatedScene:
    """The scene with every load step in two."""
    s = scene.seating
    return replace(
        scene,
        seating=replace(s, steps=_FINER * s.steps, cycle_steps=_FINER * s.cycle_steps),
        moved=replace(scene.moved, steps=_FINER * scene.moved.steps),
    )


def refined(scene: SeatedScene, factor: float = _FINER) -> SeatedScene:
    """The scene with so many times the elements along all edges, the faces' included."""
    return _with(scene, {"refine": factor * _parameter(scene, "refine")})


def with_lattice(scene: SeatedScene, ratio: float) -> SeatedScene:
    """The scene with so many times larger elements on the faces."""
    own = lattice_counts(scene)
    return _with(scene, {name: _allowed(scene, name, n / ratio) for name, n in own.items()})


# -- lattices --------------------------------------------------------------------------------------


def lattice_counts(scene: SeatedScene) -> dict[str, int]:
    """Elements of the lattices of both faces by their parameters, empty of a recipe without."""
    if is_mesh(scene.recipe):
        return {}
    slope, others = PATCH[scene.arrangement]
    names = (slope, *others)
    if not all(recipes.has_parameter(scene.recipe, name) for name in names):
        return {}
    return {name: int(_parameter(scene, name)) for name in names}


def _parameter(scene: SeatedScene, name: str) -> Any:
    """Of the recipe, as the scene has it or by default."""
    if name in scene.geometry:
        return scene.geometry[name]
    return _field(scene, name).default


def _field(scene: SeatedScene, name: str) -> dataclasses.Field[Any]:
    known = dataclasses.fields(recipes.parameters(scene.recipe))
    return next(one for one in known if one.name == name)


def _allowed(scene: SeatedScene, name: str, count: float) -> int:
    """The number of elements that the recipe takes nearest to one."""
    bounds: Bounds = _field(scene, name).metadata.get("bounds", Bounds())
    step = 2 if bounds.even else 1
    return max(int(bounds.least or 1), step * round(count / step))


def _coarser(scene: SeatedScene, own: _Counts, ratio: float) -> dict[str, int]:
    """Counts of a lattice so many times coarser; none is finer than the run's."""
    return {name: min(n, _allowed(scene, name, n / ratio)) for name, n in own.items()}


def _coarsest(scene: SeatedScene, own: _Counts) -> tuple[_Counts, bool]:
    """The coarsest lattice, and whether the bodies can be refined with it kept: it is then that of
    half its elements, refined.
    """
    ratio = COARSER[-1]
    if own and recipes.has_parameter(scene.recipe, "refine"):
        kept = {n: _FINER * _allowed(scene, n, k / ratio / _FINER) for n, k in own.items()}
        if all(kept[name] <= n for name, n in own.items()):
            return kept, True
    return _coarser(scene, own, ratio), False


def _spacing(counts: _Counts) -> float:
    """Of the nodes on the inclined faces, but for a factor of their size."""
    up, along = tuple(counts.values())[:2]
    return float((up * along) ** -0.5)


def _label(counts: _Counts) -> str:
    up, along = tuple(counts.values())[:2]
    return f"{along} x {up} elements of a patch"


def _made(label: str, size: float, scene: SeatedScene) -> Companion:
    return Companion(label, size, partial(make_plan, scene), solve_seconds(make_plan(scene)))


def _with(scene: SeatedScene, counts: Mapping[str, float]) -> SeatedScene:
    return replace(scene, geometry={**scene.geometry, **counts})


def _on_lattice(scene: SeatedScene, own: _Counts, counts: _Counts) -> Companion:
    size = _spacing(counts) / _spacing(own)
    return _made(_label(counts), size, _with(scene, counts))


def _other_bodies(scene: SeatedScene, base: _Counts, factor: float) -> Companion:
    """The base's faces on bodies with so many times the elements along every edge."""
    kept = {name: round(n / factor) for name, n in base.items()}
    made = refined(_with(scene, kept), factor)
    word = "twice" if factor > 1.0 else "half"
    return _made(f"{word} the elements along every edge, {_label(base)} kept", 1.0 / factor, made)


def _shorter_steps(scene: SeatedScene, base: _Counts) -> Companion:
    label = "twice the load steps" + (f", {_label(base)}" if base else "")
    return _made(label, 1.0 / _FINER, shorter_steps(_with(scene, base)))
