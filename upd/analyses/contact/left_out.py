"""Effects left out of a contact, each verified on a number of the run: solved again with it.

Most are solved on the plan's companion, a coarser whole model with all three directions, once
without the effect and once with it:

- normal and tangential contact at once, the load raised in steps,
- the shear that pressure alone puts between unlike materials, as a slip already there,
- the gap taken at the places that the displacement carries the faces to.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Effect, Resolved
from upd.analyses.contact.loading import LOAD_STEP, load_history, tangential_compliance
from upd.analyses.contact.plan import (
    ACROSS,
    ALONG,
    NORMAL,
    OWN_LEVEL,
    ContactPlan,
    Family,
    unit_vector,
)
from upd.contact.coupled import CoupledContact, coupled_contact
from upd.contact.model import ContactModel
from upd.contact.tangential import TangentialHistory, tangential_path
from upd.errors import UpdError
from upd.reference import dundurs_beta
from upd.results import Case, Check, Result
from upd.scene import Scene

Array = NDArray[np.float64]

TILT, DIRECTIONS, COUPLING, MATERIALS, LARGE = (
    "tilt of the damper",
    "slip in two directions",
    "normal-tangential coupling",
    "unlike materials",
    "large displacement",
)

#: Steps in which the normal load rises with pressure and shear at once, and the tangential load of
#: an initial stiffness as a part of mu N.
COUPLED_STEPS, SMALL_SHEAR = 8, 1e-3

#: What to do about an effect that changes a number too much.
REMEDIES = {
    TILT: 'set contact.tilt = "free" (with a contact.load_point inside the contact), or choose '
    "another contact.distant set",
    DIRECTIONS: "set contact.directions = 2",
    COUPLING: "pressure and shear move each other: trust the number to this change only",
    MATERIALS: "the pressure shears these materials: trust the number to this change only, or "
    "choose materials of equal stiffness",
    LARGE: "the contact is too large for small-displacement theory: lower the load",
}


#: The same of a damper that tips over when its tilt is free.
TIPS = (
    "the load line runs beside the contact, so that a damper free to tilt tips over: give a "
    "contact.load_point inside the contact, or choose another contact.distant set"
)


@dataclass(frozen=True)
class Pressed:
    """A frictionless contact: approach in mm, forces (n,) in N."""

    approach: float
    force: Array


#: gap (n,) mm and load in N -> contact of the companion
Press = Callable[[Array, float], Pressed]


def checks_of(found: Iterable[Resolved], scene: Scene) -> list[Check]:
    """One check per number that was solved again."""
    return [one.check(scene.left_out, REMEDIES[one.effect]) for one in found]


def beta_of(scene: Scene) -> float:
    """Size of Dundurs' beta of the scene's two materials: how far pressure shears the contact."""
    first, second = list(scene.materials.values())[:2]
    return abs(float(dundurs_beta(first.E, first.nu, second.E, second.nu)))


def largest_ratio(scene: Scene) -> float:
    """Largest T / (mu N) of the tangential loads asked for; zero without any."""
    return max(scene.loads.tangential, default=0.0) if scene.wants("tangential") else 0.0


def omitted(name: str, why: str, *switch: str, applies: bool) -> Effect:
    """An effect left out, with its check where it applies."""
    return Effect(name, False, why, name if applies else "", switch, applies)


def coupling_effects(scene: Scene, loaded: bool) -> list[Effect]:
    """Normal-tangential coupling, and what of it the difference of the materials makes.

    Parameters
    ----------
    loaded
        Whether any normal load presses the bodies.
    """
    beta = beta_of(scene)
    unlike = beta > 0.0 and (scene.wants("cycle") or largest_ratio(scene) > 0.0)
    why = (
        "beta = 0: pressure alone does not shear the contact"
        if not beta > 0.0
        else f"|beta| = {beta:.3g}: the shear of the pressure alone is left out"
        if unlike
        else "no output depends on the shear of the pressure alone"
    )
    return [
        omitted(
            COUPLING,
            "normal forces stay frozen under shear: exact for half-spaces of like materials alone",
            applies=loaded,
        ),
        omitted(MATERIALS, why, applies=unlike and loaded),
    ]


def left_out(plan: ContactPlan, name: str) -> bool:
    """Whether the plan leaves out an effect that applies, and is to show what it changes."""
    solves = plan.scene.left_out.solves
    return solves and any(e.name == name and e.word == "no" for e in plan.effects)


def changes(
    effect: str, names: Iterable[str], without: Iterable[Result], included: Iterable[Result]
) -> Iterator[Resolved]:
    """The numbers of ``names`` that both lists of results have."""
    theirs = {(r.name, r.case): r.value for r in included}
    wanted = set(names)
    for r in without:
        if r.name in wanted and (r.name, r.case) in theirs:
            yield Resolved(effect, r.name, r.case, r.value, theirs[r.name, r.case], r.unit)


def pressed_changes(
    plan: ContactPlan, model: ContactModel, press: Press, case: Case, load: float, arms: Array
) -> Iterator[Resolved]:
    """What coupling and displaced faces change of the normal stiffness, or of the approach where
    no stiffness is asked for.

    Parameters
    ----------
    model, press
        The companion and its frictionless contact.
    load
        N on the whole contact.
    arms
        (n, k) mm of the k free tilts.
    """

    @cache
    def plain(load: float) -> Pressed:
        return press(model.gap, load)

    def with_shear(load: float) -> float:
        mu = plan.scene.contact.friction
        # Without friction nothing shears.
        return (
            float(coupled(model, mu, load, arms).displacement[-1, 0])
            if mu > 0.0
            else plain(load).approach
        )

    def displaced(load: float) -> float:
        return press(displaced_gap(model, plain(load).force), load).approach

    quantity, unit = _quantity(plan.scene)
    for effect, again in ((COUPLING, with_shear), (LARGE, displaced)):
        if left_out(plan, effect):
            numbers = [
                _number(plan.scene, way, load) for way in (lambda F: plain(F).approach, again)
            ]
            yield Resolved(effect, quantity, case, numbers[0], numbers[1], unit)


def _quantity(scene: Scene) -> tuple[str, str]:
    """Name and unit of the normal number that a run has."""
    return ("K_N_tangent_raw", "N/mm") if scene.wants("stiffness") else ("approach", "um")


def _number(scene: Scene, approach: Callable[[float], float], load: float) -> float:
    """Tangent stiffness in N/mm at the load, or the approach in um; NaN when it is not found."""
    try:
        if not scene.wants("stiffness"):
            return 1e3 * approach(load)
        low, high = (approach(load * (1.0 + s)) for s in (-LOAD_STEP, LOAD_STEP))
        return 2.0 * LOAD_STEP * load / (high - low)
    except (UpdError, np.linalg.LinAlgError):
        return float("nan")


def coupled_columns(model: ContactModel, arms: Array) -> Array:
    """(3 n, 3 + k) rigid columns: approach, shifts along x and y, and the k free tilts."""
    n = len(model.gap)
    out = np.zeros((3 * n, 3 + arms.shape[1]))
    for k in range(3):
        out[k * n : (k + 1) * n, k] = 1.0
    out[:n, 3:] = arms
    return out


def coupled(
    model: ContactModel, friction: float, load: float, arms: Array, *, more: Array | None = None
) -> CoupledContact:
    """Normal and tangential contact at once, the normal load raised in steps without any
    tangential load; after it the tangential load ``more`` (2,) in N.

    Parameters
    ----------
    arms
        (n, k) mm of the free tilts.
    """
    part = np.arange(1, COUPLED_STEPS + 1) / COUPLED_STEPS
    loads = np.zeros((COUPLED_STEPS + (more is not None), 3 + arms.shape[1]))
    loads[:, 0] = load
    loads[:COUPLED_STEPS, 0] *= part
    if more is not None:
        loads[-1, 1:3] = more
    every = np.arange(len(model.gap))
    return coupled_contact(
        tangential_compliance(model, (NORMAL, ALONG, ACROSS), every),
        model.gap,
        friction,
        load=loads,
        columns=coupled_columns(model, arms),
    )


def coupled_stiffness(
    model: ContactModel, friction: float, load: float, direction: float, arms: Array
) -> float:
    """Initial tangential stiffness in N/mm of the pressed contact, pressure and shear at once: the
    secant of a small load along ``direction`` in degrees; NaN when it is not found.
    """
    way = unit_vector(direction, (ALONG, ACROSS))
    size = SMALL_SHEAR * friction * load
    try:
        found = coupled(model, friction, load, arms, more=size * way)
    except (UpdError, np.linalg.LinAlgError):
        return float("nan")
    before, after = found.displacement[-2:, 1:3] @ way
    return size / float(after - before)


def pressure_slip(
    model: ContactModel,
    components: tuple[int, ...],
    force: Array,
    loaded: NDArray[np.int64],
) -> TangentialHistory:
    """The slip that the normal forces (n,) in N put between the loaded nodes, as the history of
    the tangential loads that follow.

    w = d - C_tt t - C_tn f: without tangential load the contact starts with the mismatch C_tn f.
    """
    slip = np.concatenate([(model.compliance(c, NORMAL) @ force)[loaded] for c in components])
    return TangentialHistory(slip, np.zeros(len(slip)), np.zeros(len(loaded), dtype=np.int8))


def displaced_gap(model: ContactModel, force: Array) -> Array:
    """(n,) gap in mm before the load, with the faces where the displacement carries their nodes.

    Node pairs that the normal forces (n,) in N move apart by s along the faces no longer stand on
    one normal: across the slope of the deformed faces the gap is smaller by grad(zeta) . s, the
    mean of both faces.
    """
    slope = np.zeros((len(force), 2))
    places = model.multipliers.nodes
    pushed = {
        b.name: b.side * (model.body_compliance(b, NORMAL) @ force)
        for b in (model.upper, model.lower)
    }
    height = 0.5 * sum(
        (b.mesh.points[b.contact[places], 2] + pushed[b.name] for b in (model.upper, model.lower)),
        np.zeros(len(force)),
    )
    for patch in model.patches.values():
        rises = np.gradient(patch.whole(height), patch.X, patch.Y)
        for k, rise in enumerate(rises):
            slope[patch.order, k] = rise.ravel()
    moved = np.column_stack([model.compliance(c, NORMAL) @ force for c in (ALONG, ACROSS)])
    return np.asarray(model.gap - (slope * moved).sum(axis=1))


def variant(plan: ContactPlan, directions: tuple[int, ...]) -> ContactPlan:
    """The companion's plan for slip along ``directions``: the loads that press, sheared as far as
    the scene asks for, and only what a change is looked for in.
    """
    scene, companion = plan.scene, plan.companion
    assert companion is not None
    want = [w for w in ("stiffness", "tangential") if scene.wants(w)]
    ratio = largest_ratio(scene)
    if scene.wants("cycle") and not scene.wants("stiffness") and not ratio > 0.0:
        want.append("cycle")
    smaller = replace(
        scene,
        want=tuple(want),
        contact=replace(scene.contact, directions=2 if len(directions) == 2 else 1),
        loads=replace(scene.loads, tangential=(ratio,)),
    )
    return replace(companion, scene=smaller, families=(Family((NORMAL, *directions)),))


def slipped_stiffness(
    model: ContactModel,
    components: tuple[int, ...],
    pressed: Pressed,
    friction: float,
    load: Array,
) -> float:
    """Secant tangential stiffness in N/mm along the load (1 or 2,) in N, with the slip that the
    pressure alone puts between the bodies; NaN when it is not found.
    """
    loaded = np.flatnonzero(pressed.force > 0.0)
    C = tangential_compliance(model, components, loaded)
    before = pressure_slip(model, components, pressed.force, loaded)
    size = float(np.linalg.norm(load))
    unit = load / size
    try:
        path = tangential_path(
            C,
            friction * pressed.force[loaded],
            loads=load_history(np.array([0.0, size]), unit),
            history=before,
        )
    except UpdError:
        return float("nan")
    first, last = path.displacement.reshape(2, len(unit)) @ unit
    return size / float(last - first)


def not_solved(plan: ContactPlan, cases: Iterable[Case]) -> list[Resolved]:
    """What the checks are told when the companion has no answer."""
    quantity, unit = _quantity(plan.scene)
    return [
        Resolved(e.name, quantity, case, float("nan"), float("nan"), unit)
        for e in plan.effects
        if e.check and e.word == "no" and e.name not in OWN_LEVEL
        for case in cases
    ]
