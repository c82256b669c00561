"""Both faces of the damper node by node: the equations, and where they begin.

The rig as blades in modes and contact by whole faces, for `upd.hbm.faces.march`. No springs: the
blades' and the damper's own elasticity, Signorini's and Coulomb's conditions on every matching
node. Where the faces of the damper and the platforms come from, and which static state they are in,
decides the answer as much as friction does.

Spring models take the same form. A point with k_n and k_t in series with a Coulomb slider is a
contact node without springs, behind a compliance of its own: 1/k_n along the normal, 1/k_t along
the tangents. With R the displacement of the blades' points, the modes phi and what they leave of
the static compliance,

    G = diag(1/k_n, 1/k_t, 1/k_t) + R (K^-1 - phi Lambda^-1 phi') R',

`upd.hbm.faces.march` then has the same points, forces and states as the harmonic balance,
another discretisation in time, and another code for the contact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh

from upd.analyses.base import Plan
from upd.analyses.forced.model import Model
from upd.analyses.forced.plan import ForcedPlan, excitation_of, time_steps
from upd.analyses.forced.statics import GIVEN, SEATED, StaticState, point_preload, static_state
from upd.analyses.seated.bodies import Blade, Bodies, lattice, patch_frame
from upd.analyses.seated.interface import Interface, make_interface
from upd.contact.coulomb import Coulomb
from upd.errors import ConvergenceError, InputError
from upd.hbm.core.fourier import to_complex
from upd.hbm.faces.state import InterfaceModel, InterfaceState, resting
from upd.hbm.faces.step import OPEN, STICK
from upd.hbm.springs.balance import Balance
from upd.linalg import factorise, modes
from upd.linalg.parallel import in_parallel
from upd.progress import Stages
from upd.scene.forced_contact import SIDES, Side

Array = NDArray[np.float64]
#: name of the contact that is no table of stiffnesses
INTERFACE = "interface"
#: load steps in which F_C is raised
_STEPS = 12
#: modes a blade: stuck frequencies are then within 0.005 % of those with 14
MODES = 5


def make_whole_faces(plan: ForcedPlan, bodies: Bodies, stages: Stages) -> WholeFaces:
    """Condense the bodies on both faces and put the damper into its static state.

    Raises
    ------
    InputError
        Where the static state does not exist on these faces.
    """
    scene = plan.scene
    F, mu = scene.damper.centrifugal, scene.contact.friction
    with stages("condensation", "both blades and the damper on the nodes of both faces"):
        of = make_interface(plan, bodies)
        made = make_interface_model(
            plan,
            bodies,
            of,
            friction=mu,
            centrifugal=F,
            damping=scene.excitation.damping,
            excited=excitation_of(scene.excitation).blades,
            kept_modes=(MODES, SEEN * scene.excitation.stop),
        )
        # every mode is of one blade, those of the left one first
        on = np.repeat(np.eye(len(SIDES)), len(made.frequency) // len(SIDES), axis=0)
        made = replace(made, damping=scene.modal_damping(made.frequency, on))
    name = scene.contact.static if isinstance(scene.contact.static, str) else GIVEN
    with stages("static state", f"{name}, {of.n} nodes"):
        march, start = _begin(plan, bodies, made, of)
    forces = of.copies * np.stack(
        [start.f.reshape(3, -1)[:, of.face == k].sum(axis=1) for k in range(len(SIDES))]
    )
    state = StaticState(name, forces[:, 0], forces[:, 2])
    return WholeFaces(of, march, start, state)


def _begin(
    plan: ForcedPlan, bodies: Bodies, model: InterfaceModel, of: Interface
) -> tuple[InterfaceModel, InterfaceState]:
    """The model with its gap, and the damper at rest under F_C."""
    contact, F = plan.scene.contact, plan.scene.damper.centrifugal
    worn, static, mu = contact.worn, contact.static, contact.friction
    if static in (SEATED, "frictionless"):
        gap = worn * of.worn_gap(F) if worn else np.zeros(of.n)
        loads = F * np.arange(1, _STEPS + 1) / _STEPS if static == SEATED else np.array([F])
        try:
            found = of.seat(mu if static == SEATED else 0.0, loads, gap=gap)
        except ConvergenceError as error:
            raise InputError(
                f'contact.static: "{static}" was not solved on these faces ({error}); to fix it: '
                "take another static state or contact.fit"
            ) from error
        model, last = replace(model, gap=gap), found.history
        slip = last.slip
        if static != SEATED:
            # without friction nothing keeps account of what slipped: it sticks from where it lies
            w = of.columns @ last.motion - of.compliance @ last.force.T.ravel()
            slip = w.reshape(3, -1)[1:].T
        return model, resting(model, last.force, slip, last.gap, last.motion)
    if worn < 1.0:
        raise InputError(
            f"contact.static: {static!r} is a state of faces worn in; to fix it: "
            'contact.fit = "worn", or contact.static = "seated" or "frictionless"'
        )
    return worn_start(model, of, F, static_state(plan, bodies).ratio)


def make_interface_model(
    plan: Plan[Any],
    bodies: Bodies,
    interface: Interface,
    *,
    friction: float,
    centrifugal: float,
    damping: float,
    excited: Sequence[Side] = ("right",),
    kept_modes: tuple[int, float] = (MODES, 0.0),
) -> InterfaceModel:
    """Blades in their free-interface modes and what those leave of the static compliance.

    Excited along x at the force nodes of some blades; the outputs are the displacements along x
    of the left and the right accelerometer, then the coordinates of the lowest modes.

    Parameters
    ----------
    plan, bodies
        Of a rig with a free damper.
    interface
        Of the same bodies, blades elastic down to their bases.
    friction
        Coefficient.
    centrifugal
        F_C on the whole, N.
    damping
        Of all modes, ratio to critical.
    excited
        Blades with a force.
    kept_modes
        How many of each blade, and Hz below which they are outputs.

    Raises
    ------
    InputError
        When the faces are those of other bodies.
    """
    blades = [bodies.blades[side] for side in SIDES]
    n = interface.n
    if [len(lattice(b.mesh).nodes) for b in blades] != [
        int((interface.face == k).sum()) for k in (0, 1)
    ]:
        raise InputError(
            "contact.model: the faces belong to other meshes: make them of these bodies"
        )
    solver, (n_modes, seen) = plan.scene.solver.name, kept_modes
    parts = in_parallel([partial(_part, b, n_modes, solver) for b in blades], plan.workers)
    both = _side_by_side(parts, interface, excited, seen)
    Phi, frequency = both["shapes"], both["frequency"]
    G = interface.compliance - (Phi / (2.0 * np.pi * frequency) ** 2) @ Phi.T
    inertia = np.zeros((6, 6))
    inertia[:3, :3], inertia[3:, 3:] = bodies.damper.mass * np.eye(3), bodies.damper.inertia
    kept = list(interface.kept)
    load = np.zeros(len(kept))
    load[kept.index(2)] = centrifugal / interface.copies
    return InterfaceModel(
        damping=np.full(len(frequency), damping),
        compliance=0.5 * (G + G.T),
        columns=interface.columns,
        mass=inertia[np.ix_(kept, kept)],
        load=load,
        gap=np.zeros(n),
        friction=np.full(n, friction),
        copies=interface.copies,
        **both,
    )


def _side_by_side(
    parts: Sequence[tuple[Array, Array, Array, Array, Array]],
    interface: Interface,
    excited: Sequence[Side],
    below: float,
) -> dict[str, Array]:
    """The blades' parts of `_part` beside each other, in the terms of `InterfaceModel`."""
    n, m = interface.n, len(parts[0][0])
    frequency = np.concatenate([part[0] for part in parts])
    low = np.eye(2 * m)[frequency < below]
    outputs = len(SIDES) + len(low)
    shapes, pushed, places = np.zeros((3, n, 2 * m)), np.zeros((3, n, 2)), np.zeros((2 * m, 2))
    carried, drive = np.zeros((outputs, 3, n)), np.zeros((outputs, 2))
    seen = np.vstack([np.zeros((2, 2 * m)), low])
    for k, (hertz, Phi, probes, static, direct) in enumerate(parts):
        on, mine = np.flatnonzero(interface.face == k), slice(k * m, (k + 1) * m)
        flexible = 1.0 / (2.0 * np.pi * hertz) ** 2
        # what the modes leave
        rest = static - np.einsum("fim,m,pm->pfi", Phi, flexible, probes)
        shapes[:, on, mine], pushed[:, on, k] = Phi, rest[1]
        seen[k, mine], carried[k][:, on] = probes[0], rest[0]
        places[mine, k] = probes[1]
        drive[k, k] = direct[0, 1] - (probes[0] * flexible) @ probes[1]
    forced = [SIDES.index(side) for side in excited]
    return {
        "frequency": frequency,
        "shapes": shapes.reshape(3 * n, -1),
        "places": places[:, forced],
        "pushed": pushed[..., forced].reshape(3 * n, -1),
        "seen_modes": seen,
        "seen_contact": carried.reshape(outputs, -1),
        "seen_drive": drive[:, forced],
    }


def _part(blade: Blade, n_modes: int, solver: str) -> tuple[Array, Array, Array, Array, Array]:
    """Frequencies in Hz, modes at the patch (3, i, m) and at accelerometer and force node (2, m).

    Then the displacement of the patch (2, 3, i) and of both (2, 2) by a unit force at each.
    """
    found = modes(blade.K, blade.M, count=n_modes, solver=solver)
    probes = [blade.probe(name) for name in ("accelerometer", "force")]
    loads = np.zeros((blade.K.shape[0], len(probes)))
    loads[probes, np.arange(len(probes))] = 1.0
    moved = factorise(blade.K, solver=solver).solve(loads)
    whole = np.zeros((3 * blade.mesh.n_node, n_modes + len(probes)))
    whole[blade.free] = np.hstack([found.shapes, moved])
    nodes = whole.reshape(blade.mesh.n_node, 3, -1)[lattice(blade.mesh).nodes]
    patch = np.einsum("fc,icm->fim", patch_frame(blade.mesh), nodes)
    return (
        found.frequency,
        patch[:, :, :n_modes],
        found.shapes[probes],
        patch[:, :, n_modes:].transpose(2, 0, 1),
        moved[probes],
    )


def worn_start(
    model: InterfaceModel, interface: Interface, centrifugal: float, traction: ArrayLike = 0.0
) -> tuple[InterfaceModel, InterfaceState]:
    """Faces worn in until they touch everywhere under F_C, as evenly as they can.

    The forces are normal ones and `traction` times as large ones that hold the damper back, up the
    blades' slopes, on every node: of all that balance F_C those with the least sum of squares over
    areas. The gap before any load is what these forces close, h = -(C f)_n, up to a rigid motion.

    Parameters
    ----------
    model
        Of the interface; its own gap is not used.
    interface
        With blades and damper elastic.
    centrifugal
        F_C on the whole, N.
    traction
        T/N of both faces, or (2,) of each.

    Returns
    -------
    tuple
        The model with the gap of these faces, and the state at rest.

    Raises
    ------
    InputError
        When friction cannot hold that traction, or the faces would have to pull.
    """
    n, kept, ratio = interface.n, interface.kept, np.broadcast_to(traction, len(SIDES))
    words = ", ".join(f"{one:g}" for one in dict.fromkeys(ratio.tolist()))
    if np.abs(ratio).max() > model.friction.min():
        raise InputError(
            f"contact.static: T/N {words} is more than friction {model.friction.min():g} holds"
        )
    load = np.zeros(len(kept))
    load[kept.index(2)] = centrifugal / interface.copies
    columns = interface.columns
    normal, held = point_preload(
        columns[:n],
        columns[2 * n :],
        interface.face,
        interface.area,
        StaticState(f"T/N {words}", np.ones(len(SIDES)), ratio),
        load,
    )
    if normal.min() <= 0.0:
        raise InputError(
            f"contact.static: pressure on the whole of both faces with T/N {words} cannot "
            "hold this damper against F_C; take another T/N, or seat it"
        )
    force = np.stack([normal, np.zeros(n), held], axis=1)
    w = -(interface.compliance @ force.T.ravel()).reshape(3, n)
    made = replace(model, gap=w[0])
    still = np.zeros(len(kept))
    return made, resting(made, force, w[1:].T, np.zeros(n), still)


def by_coulomb(A: Array, friction: Array, b: Array) -> tuple[Array, Array] | None:
    """A step by the quasi-static contact's solver, which ends where Newton's method cycles."""
    solver = Coulomb(A, np.ones((len(A), 1)), friction)
    found = solver.solve(b, motion=np.zeros(1))
    return (found.at.f, -found.at.y) if found.converged else None


# -- spring models ---------------------------------------------------------------------------------


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

        Faces that fit without load carry none before F_C: it then acts with friction from there.

        Raises
        ------
        InputError
            When they cannot carry it.
        """
        model = self.march
        whole = model.compliance + (model.shapes / model.omega**2) @ model.shapes.T
        if self.rest.any():
            w = -(whole @ self.rest.T.ravel()).reshape(3, -1)
            still = np.zeros(len(model.load))
            return resting(model, self.rest, w[1:].T, np.zeros(model.n), still)
        b = np.concatenate([-model.gap, np.zeros(2 * model.n)])
        found = Coulomb(whole, model.columns, model.friction).solve(b, load=model.load)
        if not found.converged:
            raise InputError(
                'contact.fit: faces that fit "unloaded" do not carry F_C here; to fix it: '
                'contact.fit = "loaded"'
            )
        f, y = (v.reshape(3, -1) for v in (found.at.f, found.at.y))
        return resting(model, f.T, -y[1:].T, y[0], found.at.s)


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
    drive = force * model.excitation.drive.real.sum(axis=1)
    march, h, contact = springs.march, b.harmonics, b.period(x)
    omega, k = 2.0 * np.pi * frequency, h.dynamic
    flat = contact.coefficients(b.Q).reshape(1, len(b.Psi), h.size)
    moving = b.displacement(np.array([omega]), flat, b.split(x)[1][None])[0]
    z = to_complex(moving, h)
    mean = moving[:, 0] if h.static else np.zeros(len(z))
    moved = mean + z.real.sum(axis=1)
    speed = (1j * omega * k * z).real.sum(axis=1)
    pull = (-((omega * k) ** 2) * z).real.sum(axis=1)
    n_blade = len(model.K)
    q = springs.modes @ moved[:n_blade]
    q += (march.shapes.T @ springs.rest.T.ravel()) / march.omega**2
    carried = np.zeros((march.n, 3))
    # without friction there is no force along a face
    now = contact.force[:, :, 0]
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


@dataclass(frozen=True)
class WholeFaces:
    """Both faces node by node.

    Attributes
    ----------
    of
        The contact: places, areas, frames of its nodes.
    march
        Its outputs are the tips of the left and the right blade along x, then the coordinates of
        the blades' lowest modes.
    start
        At rest under F_C.
    state
        Forces of both faces there.
    """

    of: Interface
    march: InterfaceModel
    start: InterfaceState
    state: StaticState
