r"""The spring model of a forced response as a time march takes it.

A point with k_n and k_t in series with a Coulomb slider is a contact node without springs, behind a
compliance of its own: 1/k_n along the normal, 1/k_t along the tangents. With R the displacement of
the blades' points, the modes phi and what they leave of the static compliance,

    G = diag(1/k_n, 1/k_t, 1/k_t) + R (K^-1 - phi Lambda^-1 phi') R',

`upd.hbm.faces.march` then has the same points, forces and states as the harmonic balance,
another discretisation in time, and another code for the contact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh

from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.plan import ForcedPlan, time_steps
from upd.hbm.core.fourier import to_complex
from upd.hbm.faces.state import InterfaceModel, InterfaceState, resting
from upd.hbm.faces.step import OPEN, STICK
from upd.hbm.springs.balance import Balance
from upd.scene.forced_contact import SIDES

#: place of the normal and of the tangents a point has among normal, along, up
_PLACES = {0: [0], 1: [0, 2], 2: [0, 1, 2]}
#: steps in a period of the fastest mode that swings; what swings faster follows statically
LEAST_STEPS = 1
#: modes below so many times the highest frequency of the sweep tell which mode a motion is
SEEN = 8.0


@dataclass(frozen=True)
class SpringMarch:
    """A spring model ready for time integration.

    Attributes
    ----------
    march
        Its outputs are the displacements along x at the left and the right accelerometer, mm, and
        the lowest modes' coordinates.
    modes
        (m, n) rows from the blades' dofs to those coordinates.
    rest
        (n_point, 3) N before vibration: normal force, tractions along the damper and up the slope.
    """

    march: InterfaceModel
    modes: Array
    rest: Array

    def at_rest(self) -> InterfaceState:
        """Nothing moves, every point carries its static force.

        Raises
        ------
        InputError
            When these forces are none: the faces then fit without load, and F_C is not carried.
        """
        model = self.march
        whole = model.compliance + (model.shapes / model.omega**2) @ model.shapes.T
        w = -(whole @ self.rest.T.ravel()).reshape(3, -1)
        still = np.zeros(len(model.load))
        return resting(model, self.rest, w[1:].T, np.zeros(model.n), still)


def spring_march(model: Model, damping: ArrayLike, count: int, seen: int) -> SpringMarch:
    """The march's form of a model.

    Parameters
    ----------
    damping
        Of the modes of the blades, ratio to critical: one, or one for each.
    count
        Modes that swing; the rest of the blades follows statically.
    seen
        Of these, the lowest that are outputs.
    """
    values, shapes = eigh(model.K, model.M)
    omega = np.sqrt(np.maximum(values, 0.0))
    m = min(count, len(omega))
    kept, rest = shapes[:, :m], shapes[:, m:]
    static = (rest / omega[m:] ** 2) @ rest.T
    # the balance's rows are the damper's motion relative to the blades
    R, D = _wide(-model.contacts.rows), _wide(model.damper_rows)
    law, n = model.contacts.law, model.contacts.n_point
    springs = 1.0 / np.concatenate([law.k_n, law.k_t, law.k_t])
    G = R @ static @ R.T + np.diag(springs)
    tips = np.array([model.output[side] for side in SIDES])
    force = model.places
    low = np.eye(m)[: min(seen, m)]
    nothing = np.zeros((len(low), 3 * n)), np.zeros((len(low), force.shape[1]))
    carried = np.zeros((n, 3))
    carried[:, _PLACES[model.contacts.tangents]] = np.column_stack([law.preload, model.traction])
    march = InterfaceModel(
        omega[:m] / (2.0 * np.pi),
        np.broadcast_to(np.asarray(damping, float), omega.shape)[:m].copy(),
        R @ kept,
        0.5 * (G + G.T),
        D,
        model.damper.M,
        model.damper.force,
        law.gap,
        law.mu,
        kept.T @ force,
        R @ static @ force,
        np.vstack([tips @ kept, low]),
        np.vstack([tips @ static @ R.T, nothing[0]]),
        np.vstack([tips @ static @ force, nothing[1]]),
        springs=springs,
    )
    # springs count from the static state, the march from faces without any force
    whole = march.compliance + (march.shapes / march.omega**2) @ march.shapes.T
    gap = law.gap - (whole @ carried.T.ravel())[:n]
    return SpringMarch(replace(march, gap=gap), kept.T @ model.M, carried)


def _wide(rows: Array) -> Array:
    """(n_point, 1 + d, n) to (3 n_point, n): normal of all, along of all, up of all."""
    out = np.zeros((3, len(rows), rows.shape[2]))
    out[_PLACES[rows.shape[1] - 1]] = rows.transpose(1, 0, 2)
    return out.reshape(-1, rows.shape[2])


def make_springs(plan: ForcedPlan, model: Model) -> SpringMarch:
    """The model as time integration takes it: modes with `LEAST_STEPS` or more in a period swing
    (those that the steps do not resolve implicitly), the rest of the blades follows statically.
    """
    e = plan.scene.excitation
    fastest = time_steps(plan.scene) / LEAST_STEPS * e.start
    modes = int((model.frequency < fastest).sum())
    seen = int((model.frequency < SEEN * e.stop).sum())
    return spring_march(model, model.damping, modes, seen)


def state_at(
    springs: SpringMarch, model: Model, b: Balance, x: Array, frequency: float, force: float
) -> InterfaceState:
    """Where a steady motion by harmonic balance is at t = 0, residual slips included.

    Parameters
    ----------
    b, x
        The problem, and its unknowns there.
    frequency
        Hz.
    force
        F_E, N.
    """
    drive = force * model.excitation.at_start
    march, h, contact = springs.march, b.harmonics, b.force(x)
    omega, k = 2.0 * np.pi * frequency, h.dynamic
    flat = contact.force.reshape(1, len(b.Psi), h.size)
    moving = b.displacement(np.array([omega]), flat, b.split(x)[1][None])[0]
    z = to_complex(moving, h)
    mean = moving[:, 0] if h.static else np.zeros(len(z))
    moved = mean + z.real.sum(axis=1)
    speed = (1j * omega * k * z).real.sum(axis=1)
    pull = (-((omega * k) ** 2) * z).real.sum(axis=1)
    n_blade = model.n
    q = springs.modes @ moved[:n_blade]
    q += (march.shapes.T @ springs.rest.T.ravel()) / march.omega**2
    carried = np.zeros((march.n, 3))
    # without friction there is no force along a face
    now = contact.march.force[:, :, 0]
    carried[:, _PLACES[now.shape[1] - 1]] = now
    f = np.ascontiguousarray(carried.T).ravel()
    s, sv, sa = (part[n_blade:] for part in (moved, speed, pull))
    # slips that fit these motions and forces
    n = march.n
    w = march.columns @ s - march.compliance @ f - march.shapes @ q - march.pushed @ drive
    open_: NDArray[np.bool_] = f[:n] <= 0.0
    y = np.zeros_like(f)
    y[:n] = np.where(open_, np.minimum(w[:n] - march.gap, 0.0), 0.0)
    return InterfaceState(
        q,
        springs.modes @ speed[:n_blade],
        march.shapes.T @ f + march.places @ drive,
        s,
        sv,
        sa,
        f,
        y,
        w[n:].copy(),
        np.where(open_, OPEN, STICK).astype(np.int64),
        march.shapes.T @ springs.rest.T.ravel(),
    )
