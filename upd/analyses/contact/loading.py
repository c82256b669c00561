"""Loads after loads of two condensed bodies: what carries them, the states of normal and tangential
contact at once, closed loops.

The normal load rises without a tangential one; the tangential loads follow it. Friction remembers
its way: every state of coupled contact starts from the one before.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.plan import ACROSS, ALONG, COMPONENTS, NORMAL, ContactPlan
from upd.contact.coulomb_conditions import STICK
from upd.contact.coupled import CoupledContact, coupled_contact
from upd.contact.model import Body, ContactModel
from upd.contact.normal import NormalContact
from upd.errors import ConvergenceError
from upd.results import Case

Array = NDArray[np.float64]

#: Relative step of load on both sides of a load over which a slope of the force-approach curve is
#: taken; the curvature of Hertz's F ~ d^(3/2) makes it 0.074 LOAD_STEP^2 too soft.
LOAD_STEP = 0.1
#: Steps in which a normal load rises from nothing, at least.
NORMAL_STEPS = 8


def contact_points_of(model: ContactModel) -> Array:
    """(n, 3) the contact nodes that carry forces, in contact axes, mm."""
    points: Array = model.lower.mesh.points[model.lower.contact[model.multipliers.nodes]]
    return points


def load_point(plan: ContactPlan, model: ContactModel) -> Array:
    """(2,) where the load line meets the contact plane, contact axes in mm."""
    upper = model.upper
    if plan.scene.contact.load_point is not None:
        low: Array = contact_points_of(model)[:, :2].min(axis=0)
        return np.asarray(low + np.array(plan.scene.contact.load_point))
    nodes = upper.mesh.points[upper.mesh.nodes["distant"], :2]
    weights = upper.mesh.weights.get("distant")
    # Middle of the set's extent: its nodes need not be evenly spread. Weights say where it is.
    middle = (
        0.5 * (nodes.min(axis=0) + nodes.max(axis=0))
        if weights is None
        else np.asarray(weights @ nodes / weights.sum())
    )
    return np.asarray(middle if 0 not in plan.mirrors else middle * np.array([0.0, 1.0]))


def tilt_arms(plan: ContactPlan, model: ContactModel) -> Array:
    """(n, k) mm from the load line to the nodes, for the k free tilts."""
    if plan.scene.contact.tilt != "free":
        return np.zeros((len(model.gap), 0))
    return contact_points_of(model)[:, :2] - load_point(plan, model)


def tangential_compliance(
    model: ContactModel,
    components: Sequence[int],
    loaded: NDArray[np.int64],
    body: Body | None = None,
) -> Array:
    """Compliance of the loaded nodes, (n, n) or (2n, 2n) mm/N with x dofs first, of both bodies or
    of one.
    """
    pick = np.ix_(loaded, loaded)
    rows = [[model.compliance(i, j, body)[pick] for j in components] for i in components]
    return np.block(rows)


# -- tangential force over displacement ------------------------------------------------------------


@dataclass(frozen=True)
class LoadPath:
    """Tangential force over displacement after one normal load, of the whole contact.

    Attributes
    ----------
    case
        Of the normal load, with the direction.
    load, displacement
        (n_step,) N and mm along the load, from zero on.
    cycle
        First loading to +T*, then the closed loop +T* -> -T* -> +T*; otherwise first loading only.
    slip_work, loop_area
        N mm over the closed loop.
    most_work
        Slip work of the loop that has most, N mm: of coupled contact it may fade from loop to loop
        (shakedown).
    """

    case: Case
    load: Array
    displacement: Array
    cycle: bool = False
    slip_work: float = 0.0
    loop_area: float = 0.0
    most_work: float = 0.0


@dataclass(frozen=True)
class Sheared:
    """What a tangential load step left at the n loaded nodes, unprocessed: for checks.

    Vectors are (n,), or (2 n,) with x dofs first.

    Attributes
    ----------
    components
        Of the load, one per n entries of a vector.
    loaded
        (n,) contact nodes that carry a normal force.
    limit
        (n,) mu times the normal force, N.
    force
        Tractions in N, before they were brought inside their limits.
    before
        Slip before the step, mm.
    displacement, load
        (1 or 2,) mm, and N on the model.
    stick
        (n,) which nodes stick.
    terms
        Size of what ``before`` was summed from where that is more than a slip, mm.
    """

    components: tuple[int, ...]
    loaded: NDArray[np.int64]
    limit: Array
    force: Array
    before: Array
    displacement: Array
    load: Array
    stick: NDArray[np.bool_]
    terms: Array | float = 0.0


def cycle_shares(steps: int, loops: int) -> tuple[Array, int, int]:
    """Loads of a cycle over its peak, the first loading and so many loops, and how many of them are
    before the loops and in each.
    """
    quarter = max(2, steps // 5)
    half = (steps - quarter) // 2
    back, forth = np.linspace(1.0, -1.0, half + 1)[1:], np.linspace(-1.0, 1.0, half + 1)[1:]
    first = np.linspace(0.0, 1.0, quarter + 1)[1:]
    return np.concatenate([first, *(back, forth) * loops]), quarter, 2 * half


# -- normal and tangential contact at once ---------------------------------------------------------


@dataclass(frozen=True)
class CoupledState:
    """A load step of coupled contact.

    Attributes
    ----------
    found
        Answers up to it; its own is the last.
    before
        (n, 2) slip before the step, mm.
    """

    found: CoupledContact
    before: Array

    @property
    def force(self) -> Array:
        """(n, 3) normal force, force along x and y, N."""
        return np.asarray(self.found.force[-1])

    @property
    def motion(self) -> Array:
        """(r,) approach, shifts along x and y in mm, free tilts in rad."""
        return np.asarray(self.found.displacement[-1])

    @property
    def stick(self) -> NDArray[np.bool_]:
        """(n,) nodes that stick."""
        return np.asarray(self.found.state[-1] == STICK)

    @property
    def shear_stiffness(self) -> Array:
        """(2, 2) dT/dd in N/mm with the normal load and the states kept; 0 where nothing holds."""
        try:
            return np.asarray(np.linalg.inv(np.linalg.inv(self.found.stiffness())[1:3, 1:3]))
        except (ConvergenceError, np.linalg.LinAlgError):
            return np.zeros((2, 2))


def raised(
    model: ContactModel,
    friction: float,
    loads: Iterable[float],
    arms: Array,
    *,
    body: Body | None = None,
) -> dict[float, CoupledState]:
    """States of the positive normal loads in N, each on the way to the next, without a tangential
    load.

    Parameters
    ----------
    arms
        (n, k) mm of the k free tilts.
    body
        Against a rigid counterpart; None: both.
    """
    n, out = len(model.gap), {}
    found: CoupledContact | None = None
    at = 0.0
    for F in sorted({load for load in loads if load > 0.0}):
        steps = int(np.ceil(NORMAL_STEPS * (1.0 - at / F)))
        way = np.zeros((steps, 3 + arms.shape[1]))
        way[:, 0] = np.linspace(at, F, steps + 1)[1:]
        before = np.zeros((n, 2)) if found is None else found.slip[-1]
        if found is None:
            # approach, shifts along x and y, tilts
            columns = np.zeros((3 * n, 3 + arms.shape[1]))
            columns[:, :3], columns[:n, 3:] = np.kron(np.eye(3), np.ones((n, 1))), arms
            found = coupled_contact(
                tangential_compliance(model, COMPONENTS, np.arange(n), body),
                model.gap,
                friction,
                load=way,
                columns=columns,
            )
        else:
            found = found.go_on(load=way)
        out[F] = CoupledState(found, found.slip[-2] if steps > 1 else before)
        at = F
    return out


def slope(states: dict[float, CoupledState], load: float) -> float:
    """dF/d approach in N/mm while the normal load rises, tilts and shifts following."""
    low, high = (states[load * (1.0 + s)] for s in (-LOAD_STEP, LOAD_STEP))
    return 2.0 * LOAD_STEP * load / float(high.motion[0] - low.motion[0])


def as_normal(state: CoupledState, stiffness: float) -> NormalContact:
    """The normal part of a state."""
    found, f = state.found, state.force[:, 0]
    return NormalContact(
        np.maximum(f, 0.0),
        np.maximum(found.gap[-1], 0.0),
        np.asarray(found.state[-1] > 0),
        float(state.motion[0]),
        stiffness,
        int(found.iterations[-1]),
        "fallback" if found.fallbacks else "active set",
        found.status,
        found.message,
        f,
    )


def pressed_by(model: ContactModel, body: Body, force: Array) -> float:
    """Mean approach in mm that a body takes under the forces (n, 1 or 3) in N, weighted by the
    pressure.
    """
    f = force[:, 0]
    parts = zip(COMPONENTS, force.T, strict=False)
    moved = sum((model.compliance(NORMAL, c, body) @ part for c, part in parts), np.zeros(len(f)))
    return float(f @ moved) / float(f.sum()) if f.any() else 0.0


def opened_by_shear(model: ContactModel, state: CoupledState) -> Array:
    """(n,) mm that the tangential forces open, C_nt t."""
    f = state.force
    return np.asarray(
        sum(
            (model.compliance(NORMAL, c) @ f[:, 1 + k] for k, c in enumerate((ALONG, ACROSS))),
            np.zeros(len(f)),
        )
    )


def shear_nodes(model: ContactModel, friction: float, state: CoupledState) -> Sheared:
    """What a step left at the closed nodes: beside the slip before it stands the way that the
    pressure alone moves them, C_tn f.
    """
    on = np.flatnonzero(state.found.state[-1] > 0)
    f, axes = state.force, (ALONG, ACROSS)
    size = float(np.sqrt(np.diagonal(model.compliance(NORMAL))) @ np.abs(f[:, 0]))
    before = [model.compliance(c, NORMAL) @ f[:, 0] + state.before[:, c] for c in axes]
    return Sheared(
        axes,
        on,
        friction * f[on, 0],
        np.concatenate([f[on, 1], f[on, 2]]),
        np.concatenate([one[on] for one in before]),
        state.motion[1:3],
        state.found.load[-1, 1:3],
        state.stick[on],
        np.concatenate([np.sqrt(np.diagonal(model.compliance(c)))[on] * size for c in axes]),
    )


def loads_along(base: CoupledState, values: Array, unit: Array) -> Array:
    """The normal load of a state with tangential ones (k,) in N along ``unit`` (2,)."""
    out = np.zeros((len(values), len(base.motion)))
    out[:, 0] = base.found.load[-1, 0]
    out[:, 1:3] = np.outer(values, unit)
    return out


def sheared(
    base: CoupledState, values: Array, unit: Array, needed: float
) -> tuple[list[CoupledState], Array]:
    """Tangential loads (k,) in N along ``unit`` (2,), rising, from the state of a normal load.

    Those above ``needed`` are there for a curve, which ends where the contact slides.

    Returns
    -------
    states, displacement
        After each load, and (k,) mm along the direction since the normal load.
    """
    now, states = base, []
    for T in values:
        try:
            found = now.found.go_on(load=loads_along(base, np.array([T]), unit))
        except ConvergenceError:
            if needed >= T:
                raise
            break
        now = CoupledState(found, now.found.slip[-1])
        states.append(now)
    start = base.motion[1:3]
    return states, np.array([(one.motion[1:3] - start) @ unit for one in states])
