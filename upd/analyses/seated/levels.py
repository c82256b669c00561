"""Companions of a seated damper: coarser lattices of its faces, and on one of them finer bodies and
shorter load steps.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from upd.analyses.companions import COARSER, Companion
from upd.analyses.seated.plan import SeatedPlan, make_plan, solve_seconds
from upd.errors import InputError, one_line
from upd.mesh import recipes
from upd.mesh.fields import Bounds
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
    finer
        Source -> the coarsest of these with it refined; the run where its lattice has no coarser.
    told
        Source -> why it has no companion.
    budget
        Seconds that all of them may take.
    """

    lattices: list[Companion] = field(default_factory=list)
    finer: dict[str, Companion] = field(default_factory=dict)
    told: dict[str, str] = field(default_factory=dict)
    budget: float = 0.0

    @property
    def seconds(self) -> float:
        """Predicted, of all."""
        return sum(one.seconds for one in (*self.lattices, *self.finer.values()))

    def take(self, source: str, make: Callable[[], Companion]) -> bool:
        """Take a companion where it fits; tell why where not."""
        try:
            one = make()
        except InputError as error:
            self.told.setdefault(source, one_line(error))
            return False
        if self.seconds + one.seconds > self.budget:
            why = f"{one.label}: {one.seconds:.2g} s, beyond {100.0 * _SHARE:.0f} % of the run"
            self.told.setdefault(source, why)
            return False
        if source == NODES:
            self.lattices.append(one)
        else:
            self.finer[source] = one
        return True


def companions(plan: SeatedPlan) -> SeatedCompanions:
    """The companions of a plan; none where its scene wants none.

    Coarser lattices of the faces tell what the contact's nodes leave. On the coarsest, where a
    seating costs a few hundredths, all bodies get twice the elements along every edge and the
    faces' nodes stay; and every load step is halved. What these change there is taken for what
    they change in the run. Companions that would take all of them beyond 35 % of the run are left
    out, the least telling first.

    Parameters
    ----------
    plan
        Without companions' cost.
    """
    if not plan.scene.estimates:
        return SeatedCompanions()
    out = SeatedCompanions(budget=_SHARE / (1.0 - _SHARE) * plan.seconds)
    scene = companion_scene(plan.scene)
    own = lattice_counts(scene)
    coarsest, keeps = _coarsest(scene, own)
    if coarsest == own:
        out.told[NODES] = "the lattice of the faces cannot be made coarser"
    elif not out.take(NODES, lambda: _on_lattice(scene, own, coarsest)):
        out.told |= dict.fromkeys((MESH, STEPS), out.told[NODES])
        return out
    if keeps:
        out.take(MESH, lambda: _finer_bodies(scene, coarsest))
    else:
        out.told[MESH] = "the bodies cannot be refined with the lattice of the faces kept"
    out.take(STEPS, lambda: _shorter_steps(scene, coarsest))
    taken = [own, coarsest]
    for ratio in COARSER[1::-1]:
        one = _coarser(scene, own, ratio)
        if one not in taken:
            taken.append(one)
            out.take(NODES, partial(_on_lattice, scene, own, one))
    return out


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
    if recipes.is_mesh(scene.recipe):
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


def _finer_bodies(scene: SeatedScene, base: _Counts) -> Companion:
    fewer = {name: n // _FINER for name, n in base.items()}
    made = refined(_with(scene, fewer))
    label = f"twice the elements along every edge, {_label(base)} kept"
    return _made(label, 1.0 / _FINER, made)


def _shorter_steps(scene: SeatedScene, base: _Counts) -> Companion:
    label = "twice the load steps" + (f", {_label(base)}" if base else "")
    return _made(label, 1.0 / _FINER, shorter_steps(_with(scene, base)))
