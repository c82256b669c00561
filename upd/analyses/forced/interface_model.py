"""Both faces of the damper node by node: the equations, and where they begin.

The rig as blades in modes and contact by whole faces, for `upd.hbm.faces.march`. No springs: the
blades' and the damper's own elasticity, Signorini's and Coulomb's conditions on every matching
node. Where the faces of the damper and the platforms come from, and which static state they are in,
decides the answer as much as friction does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Plan
from upd.analyses.forced.curves import WholeFaces
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.spring_march import SEEN
from upd.analyses.forced.statics import GIVEN, SEATED, StaticState
from upd.analyses.seated.bodies import Blade, Bodies
from upd.analyses.seated.interface import Interface, make_interface
from upd.analyses.seated.lattice import lattice, patch_frame
from upd.contact import CoupledContact
from upd.contact.coulomb import Coulomb
from upd.errors import ConvergenceError, InputError
from upd.hbm.faces.state import InterfaceModel, InterfaceState, resting
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
        )
        # every mode is of one blade, those of the left one first
        on = np.repeat(np.eye(len(SIDES)), len(made.frequency) // len(SIDES), axis=0)
        made = replace(made, damping=scene.modal_damping(made.frequency, on))
    with stages("static state", f"{_name(scene.contact.static)}, {of.n} nodes"):
        march, start = _begin(made, of, scene.contact.worn, scene.contact.static, F, mu)
    forces = of.copies * np.stack(
        [start.f.reshape(3, -1)[:, of.face == k].sum(axis=1) for k in range(len(SIDES))]
    )
    state = StaticState(_name(scene.contact.static), forces[:, 0], forces[:, 2])
    return WholeFaces(of, _seen(march, SEEN * scene.excitation.stop), start, state)


def _name(static: Any) -> str:
    return static if isinstance(static, str) else GIVEN


def _begin(
    model: InterfaceModel, of: Interface, worn: float, static: Any, F: float, mu: float
) -> tuple[InterfaceModel, InterfaceState]:
    """The model with its gap, and the damper at rest under F_C."""
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
        model = replace(model, gap=gap)
        if static == SEATED:
            return model, seated_start(model, found)
        # without friction nothing keeps account of what slipped: it sticks from where it lies
        last = found.history
        w = of.columns @ last.motion - of.compliance @ last.force.T.ravel()
        slip = w.reshape(3, -1)[1:].T
        return model, resting(model, last.force, slip, last.gap, last.motion)
    if worn < 1.0:
        raise InputError(
            f"contact.static: {_name(static)!r} is a state of faces worn in; to fix it: "
            'contact.fit = "worn", or contact.static = "seated" or "frictionless"'
        )
    named = {"opposing": mu, "reversed": -mu}
    ratio = named[static] if isinstance(static, str) else _both(static)
    return worn_start(model, of, F, ratio)


def _both(static: Any) -> float:
    """T/N that both faces share."""
    left, right = (static[side] for side in SIDES)
    if not isinstance(left, float) or left != right:
        raise InputError(
            "contact.static: worn faces node by node take one T/N for both; to fix it: give the "
            'same ratio to left and right, or contact.static = "seated"'
        )
    return left


def _seen(model: InterfaceModel, below: float) -> InterfaceModel:
    """The model with the tips and the coordinates of its modes below a frequency as outputs."""
    low = np.flatnonzero(model.frequency < below)
    rows = np.eye(len(model.frequency))[low]
    tips = len(SIDES)
    n, places = 3 * model.n, model.places.shape[1]
    return replace(
        model,
        seen_modes=np.vstack([model.seen_modes[:tips], rows]),
        seen_contact=np.vstack([model.seen_contact[:tips], np.zeros((len(low), n))]),
        seen_drive=np.vstack([model.seen_drive[:tips], np.zeros((len(low), places))]),
    )


def make_interface_model(
    plan: Plan[Any],
    bodies: Bodies,
    interface: Interface,
    *,
    friction: float,
    centrifugal: float,
    damping: float,
    n_modes: int = MODES,
    excited: Sequence[Side] = ("right",),
) -> InterfaceModel:
    """Blades in their free-interface modes and what those leave of the static compliance.

    Excited along x at the force nodes of some blades; the outputs are the displacements along x
    of the left and the right accelerometer and of these force nodes.

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
    n_modes
        Of each blade.
    excited
        Blades with a force.

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
    solver = plan.scene.solver.name
    parts = in_parallel(
        [partial(_part, b, n_modes, solver, excited=b.side in excited) for b in blades],
        plan.workers,
    )
    both = _side_by_side(parts, interface, excited)
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
) -> dict[str, Array]:
    """The blades' parts of `_part` beside each other, in the terms of `InterfaceModel`."""
    n, n_modes = interface.n, len(parts[0][0])
    m, L, K = 2 * n_modes, len(excited), len(SIDES) + len(excited)
    shapes, seen_modes, places = np.zeros((3, n, m)), np.zeros((K, m)), np.zeros((m, L))
    pushed, seen_contact, seen_drive = np.zeros((3, n, L)), np.zeros((K, 3, n)), np.zeros((K, L))
    frequency = np.zeros(m)
    for k, (hertz, Phi, seen, static, direct) in enumerate(parts):
        on, mine = np.flatnonzero(interface.face == k), slice(k * n_modes, (k + 1) * n_modes)
        # outputs of this blade: its accelerometer, and the force node where it is excited
        forced = [j for j, side in enumerate(excited) if side == SIDES[k]]
        rows = [k, *(len(SIDES) + j for j in forced)]
        frequency[mine] = hertz
        shapes[:, on, mine] = Phi
        seen_modes[rows, mine] = seen
        flexible = 1.0 / (2.0 * np.pi * hertz) ** 2
        # what the modes leave
        rest = static - np.einsum("fim,m,pm->pfi", Phi, flexible, seen)
        for j, row in enumerate(rows):
            seen_contact[row][:, on] = rest[j]
        for j in forced:
            places[mine, j] = seen[1]
            pushed[:, on, j] = rest[1]
            seen_drive[rows, j] = direct[:, 1] - (seen * flexible) @ seen[1]
    return {
        "frequency": frequency,
        "shapes": shapes.reshape(3 * n, m),
        "places": places,
        "pushed": pushed.reshape(3 * n, L),
        "seen_modes": seen_modes,
        "seen_contact": seen_contact.reshape(K, 3 * n),
        "seen_drive": seen_drive,
    }


def _part(
    blade: Blade, n_modes: int, solver: str, *, excited: bool
) -> tuple[Array, Array, Array, Array, Array]:
    """Frequencies in Hz, modes at the patch (3, i, m) and at the probes (p, m).

    Then the displacement of the patch (p, 3, i) and of the probes (p, p) by a unit force at each.
    """
    found = modes(blade.K, blade.M, count=n_modes, solver=solver)
    names = ["accelerometer"] + (["force"] if excited else [])
    probes = [blade.probe(name) for name in names]
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


def seated_start(model: InterfaceModel, seated: CoupledContact) -> InterfaceState:
    """Where a march starts: the end of a seating on the same faces, at rest."""
    last = seated.history
    return resting(model, last.force, last.slip, last.gap, last.motion)


def worn_start(
    model: InterfaceModel, interface: Interface, centrifugal: float, traction: float = 0.0
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
        T/N of both faces.

    Returns
    -------
    tuple
        The model with the gap of these faces, and the state at rest.

    Raises
    ------
    InputError
        When friction cannot hold that traction, or the faces would have to pull.
    """
    n, kept = interface.n, interface.kept
    if abs(traction) > model.friction.min():
        raise InputError(
            f"contact.static: T/N {traction:g} is more than friction {model.friction.min():g} holds"
        )
    load = np.zeros(len(kept))
    load[kept.index(2)] = centrifugal / interface.copies
    B = interface.columns[:n] + traction * interface.columns[2 * n :]
    A = B.T * np.sqrt(interface.area)
    # rows of forces and of moments differ by a length
    size = np.linalg.norm(A, axis=1)
    eps = np.sqrt(np.finfo(float).eps)
    used = size > eps * np.where(np.array(kept) < 3, size[0], size.max())
    x = np.linalg.lstsq(A[used] / size[used, None], load[used] / size[used], rcond=eps)[0]
    normal = np.sqrt(interface.area) * x
    off = np.abs(B.T @ normal - load)[used] / size[used]
    if off.max() > eps * np.abs(load[used] / size[used]).max() or normal.min() < 0.0:
        raise InputError(
            f"contact.static: pressure on the whole of both faces with T/N {traction:g} cannot "
            "hold this damper against F_C; take another T/N, or seat it"
        )
    force = np.stack([normal, np.zeros(n), traction * normal], axis=1)
    w = -(interface.compliance @ force.T.ravel()).reshape(3, n)
    made = replace(model, gap=w[0])
    still = np.zeros(len(kept))
    return made, resting(made, force, w[1:].T, np.zeros(n), still)


def by_coulomb(A: Array, friction: Array, b: Array) -> tuple[Array, Array] | None:
    """A step by the quasi-static contact's solver, which ends where Newton's method cycles."""
    solver = Coulomb(A, np.ones((len(A), 1)), friction)
    found = solver.solve(b, motion=np.zeros(1))
    return (found.at.f, -found.at.y) if found.converged else None
