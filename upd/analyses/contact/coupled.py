"""Normal and tangential contact at once, along a run's loads.

The normal load rises without a tangential one; the tangential loads follow it. Friction remembers
its way: every state starts from the one before.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.loading import (
    LOAD_STEP,
    LoadPath,
    Sheared,
    cycle_shares,
    tangential_compliance,
)
from upd.analyses.contact.plan import ACROSS, ALONG, COMPONENTS, NORMAL
from upd.contact.coulomb_conditions import STICK
from upd.contact.coupled import CoupledContact, coupled_contact
from upd.contact.model import Body, ContactModel
from upd.contact.normal import NormalContact, normal_contact
from upd.errors import ConvergenceError
from upd.results import Case

Array = NDArray[np.float64]

#: Steps in which a normal load rises from nothing, at least, and the tangential load of an initial
#: stiffness as a part of mu N.
NORMAL_STEPS, SMALL_SHEAR = 8, 1e-3


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


def coupled_columns(n: int, arms: Array) -> Array:
    """(3 n, 3 + k) rigid columns: approach, shifts along x and y, and the k free tilts."""
    out = np.zeros((3 * n, 3 + arms.shape[1]))
    for k in range(3):
        out[k * n : (k + 1) * n, k] = 1.0
    out[:n, 3:] = arms
    return out


def raised(
    model: ContactModel,
    friction: float,
    loads: Iterable[float],
    arms: Array,
    *,
    body: Body | None = None,
    gap: Array | None = None,
) -> dict[float, CoupledState]:
    """States of the positive normal loads in N, each on the way to the next, without a tangential
    load.

    Parameters
    ----------
    arms
        (n, k) mm of the k free tilts.
    body
        Against a rigid counterpart; None: both.
    gap
        (n,) mm, in place of the model's.
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
            found = coupled_contact(
                tangential_compliance(model, COMPONENTS, np.arange(n), body),
                model.gap if gap is None else gap,
                friction,
                load=way,
                columns=coupled_columns(n, arms),
            )
        else:
            found = found.go_on(load=way)
        out[F] = CoupledState(found, found.slip[-2] if steps > 1 else before)
        at = F
    return out


def slope_loads(loads: Iterable[float]) -> list[float]:
    """The loads with one a little below and above each, for `slope`."""
    return [F * (1.0 + s) for F in loads for s in (-LOAD_STEP, 0.0, LOAD_STEP)]


def slope(states: dict[float, CoupledState], load: float) -> float:
    """dF/d approach in N/mm while the normal load rises, tilts and shifts following."""
    low, high = (states[load * (1.0 + s)] for s in (-LOAD_STEP, LOAD_STEP))
    return 2.0 * LOAD_STEP * load / float(high.motion[0] - low.motion[0])


def held_stiffness(state: CoupledState) -> float:
    """dF/d approach in N/mm with the tilts held and the states kept, shifts following."""
    return float(1.0 / np.linalg.inv(state.found.stiffness()[:3, :3])[0, 0])


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


def unloaded(model: ContactModel) -> NormalContact:
    """No load: friction has nothing to hold."""
    return normal_contact(model.compliance(NORMAL), model.gap, load=0.0)


def pressed_by(model: ContactModel, body: Body, force: Array) -> float:
    """Mean approach in mm that a body takes under the forces (n, 3) in N, weighted by the
    pressure.
    """
    f = force[:, 0]
    moved = sum(
        (model.body_compliance(body, NORMAL, c) @ force[:, k] for k, c in enumerate(COMPONENTS)),
        np.zeros(len(f)),
    )
    return float(f @ moved) / float(f.sum())


# -- tangential loads ------------------------------------------------------------------------------


@dataclass(frozen=True)
class CoupledPath:
    """Tangential loads one after the other, the normal one kept.

    Attributes
    ----------
    base
        The state under the normal load alone.
    unit
        (2,) direction.
    loads
        (k,) N along it.
    states
        After each of them.
    """

    base: CoupledState
    unit: Array
    loads: Array
    states: Sequence[CoupledState]

    @property
    def moved(self) -> Array:
        """(k,) mm along the direction since the normal load."""
        start = self.base.motion[1:3]
        return np.array([(s.motion[1:3] - start) @ self.unit for s in self.states])


def _loads(base: CoupledState, along: Array, unit: Array) -> Array:
    out = np.zeros((len(along), len(base.motion)))
    out[:, 0] = base.found.load[-1, 0]
    out[:, 1:3] = np.outer(along, unit)
    return out


def sheared(base: CoupledState, along: Array, unit: Array, needed: float) -> CoupledPath:
    """Tangential loads (k,) in N along ``unit`` (2,), rising, from the state of a normal load.

    Those above ``needed`` are there for a curve, which ends where the contact slides.
    """
    now, states = base, []
    for T in along:
        try:
            found = now.found.go_on(load=_loads(base, np.array([T]), unit))
        except ConvergenceError:
            if needed >= T:
                raise
            break
        now = CoupledState(found, now.found.slip[-1])
        states.append(now)
    return CoupledPath(base, unit, along[: len(states)], states)


def initial_stiffness(base: CoupledState, friction: float, unit: Array) -> float:
    """Secant in N/mm of a small tangential load along ``unit`` (2,) after the normal one."""
    size = SMALL_SHEAR * friction * float(base.found.load[-1, 0])
    return size / float(sheared(base, np.array([size]), unit, size).moved[0])


def shear_tangent(state: CoupledState) -> Array:
    """(2, 2) dT/dd in N/mm with the normal load and the states kept; 0 where nothing holds."""
    try:
        return np.asarray(np.linalg.inv(np.linalg.inv(state.found.stiffness())[1:3, 1:3]))
    except (ConvergenceError, np.linalg.LinAlgError):
        return np.zeros((2, 2))


def shear_nodes(model: ContactModel, friction: float, state: CoupledState) -> Sheared:
    """What a step left at the closed nodes: beside the slip before it stands the way that the
    pressure alone moves them, C_tn f.
    """
    on = np.flatnonzero(state.found.state[-1] > 0)
    f, moves = state.force, [model.compliance(c, NORMAL) for c in (ALONG, ACROSS)]
    size = np.sqrt(np.diagonal(model.compliance(NORMAL)))
    terms = [
        np.sqrt(np.diagonal(model.compliance(c))) * float(size @ np.abs(f[:, 0]))
        for c in (ALONG, ACROSS)
    ]
    return Sheared(
        (ALONG, ACROSS),
        on,
        friction * f[on, 0],
        np.concatenate([f[on, 1], f[on, 2]]),
        np.concatenate([(C @ f[:, 0] + state.before[:, k])[on] for k, C in enumerate(moves)]),
        state.motion[1:3],
        state.found.load[-1, 1:3],
        state.stick[on],
        np.concatenate([one[on] for one in terms]),
    )


def opened_by_shear(model: ContactModel, state: CoupledState) -> Array:
    """(n,) mm that the tangential forces open, C_nt t."""
    f = state.force
    return np.asarray(
        sum(
            (model.compliance(NORMAL, c) @ f[:, 1 + k] for k, c in enumerate((ALONG, ACROSS))),
            np.zeros(len(f)),
        )
    )


def coupled_loop(
    case: Case, normal: Case, base: CoupledState, *, peak: float, steps: int, unit: Array
) -> LoadPath:
    """First loading to ``peak`` in N, then +peak -> -peak -> +peak twice, the normal load kept.

    The first of both loops does not close: shear settles what the pressure left, and the approach
    with it. Friction's work of the second, by the mean tractions of each step.
    """
    shares, quarter = cycle_shares(steps)
    shares, quarter = np.concatenate([shares, shares[quarter:]]), len(shares)
    found = base.found.go_on(load=_loads(base, peak * shares, unit))
    start = base.motion[1:3]
    d = np.concatenate([[0.0], (found.displacement[:, 1:3] - start) @ unit])
    T = np.concatenate([[0.0], peak * shares])
    shear = np.concatenate([base.force[None, :, 1:], found.force[..., 1:]])
    slip = np.concatenate([base.found.slip[-1:], found.slip])
    mean = 0.5 * (shear[1:] + shear[:-1])
    work = (mean * np.diff(slip, axis=0)).sum(axis=(1, 2))
    area = abs(float(np.trapezoid(T[quarter:], d[quarter:])))
    return LoadPath(case, normal, T, d, True, float(work[quarter:].sum()), area)
