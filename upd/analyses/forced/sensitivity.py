"""What an input known in closed form changes of a response, for fits and for choices of a damper.

Friction, totals of the contact stiffness, F_C and F_E, damping, Young's modulus and densities move
data of the model that are known: none needs the mesh again. In step with them the static state is
that of both ends of an interval.

Of the linear answers, free and with every point stuck, q = D^-1 F, D = K + i w C - w^2 M, with the
adjoint z = D^-1 r of the output r'q

    d(r'q)/dp = z' (dF/dp - dD/dp q),

and of its peak as `upd.hbm.peaks.sensitivity` has it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.model import Array, ComplexArray, Model, preloaded
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.statics import StaticState, static_state
from upd.analyses.seated.bodies import Bodies
from upd.hbm.peaks.parameter_change import ParameterChange
from upd.hbm.peaks.sensitivity import PeakDerivative
from upd.progress import Stages
from upd.scene import ForcedScene
from upd.scene.forced_contact import SIDES, Side, StiffnessChoice
from upd.vary.inputs import InputEnds

#: half of the difference over the frequency, as a share of it
STEP = 1e-5


# -- what an input changes of the data of the models -----------------------------------------------


def is_known(end: InputEnds) -> bool:
    """Whether an input moves nothing but data that are known here."""
    return all(_alike(other, end.given) == end.given for other in (end.low, end.high))


def _alike(other: ForcedScene, scene: ForcedScene) -> ForcedScene:
    """A scene with the data that are known here as another scene has them."""
    m, d, e = scene.material, scene.damper, scene.excitation
    return replace(
        other,
        text=scene.text,
        uncertain=scene.uncertain,
        accuracy=scene.accuracy,
        left_out=scene.left_out,
        material=replace(other.material, E=m.E, density=m.density),
        damper=d,
        contact=replace(other.contact, friction=scene.contact.friction),
        excitation=replace(
            other.excitation,
            damping=e.damping,
            force=e.force,
            centrifugal_to_force=e.centrifugal_to_force,
        ),
        stiffness={
            name: _with_totals(choice, scene.stiffness.get(name))
            for name, choice in other.stiffness.items()
        },
    )


def _with_totals(choice: StiffnessChoice, like: StiffnessChoice | None) -> StiffnessChoice:
    if like is None or choice.from_contact:
        return choice
    return replace(choice, K_N=like.K_N, K_T=like.K_T, left=like.left, right=like.right)


@dataclass(frozen=True)
class DataChange:
    """What half an interval of an input does to one model.

    Attributes
    ----------
    contacts
        Of the contact points and the static loads.
    blades
        Of mass, damping and stiffness of the blades alone, (n, n).
    damper
        Relative change of the damper's mass and inertia.
    forces
        Relative change of F_E of every curve, by the place of its F_C/F_E.
    """

    contacts: ParameterChange
    blades: ParameterChange
    damper: float
    forces: Array

    def whole(self, model: Model) -> ParameterChange:
        """All of it but the forces, on the dofs of blades and damper."""
        m, n = model.n, model.damper.n_dof
        M, C, K = (
            np.zeros((m + n, m + n))
            if (value := getattr(self.blades, name)) is None
            else np.pad(value, (0, n))
            for name in ("M", "C", "K")
        )
        M[m:, m:] += self.damper * model.damper.M
        return self.contacts + ParameterChange(M=M, C=C, K=K)


def data_change(
    plan: ForcedPlan, bodies: Bodies, name: str, model: Model, end: InputEnds, stages: Stages
) -> DataChange:
    """What half an interval of a known input does to the model of one contact stiffness.

    Raises
    ------
    InputError
        Where the static state does not exist at an end.
    """
    scene = plan.scene

    def relative(value: Any) -> float:
        """Half of the change between both ends, over the scene's."""
        low, now, high = (float(value(one)) for one in (end.low, scene, end.high))
        return 0.5 * (high - low) / now if now else 0.0

    law = model.contacts.law
    parts = ParameterChange()
    mu = relative(lambda s: s.contact.friction)
    if mu and np.any(law.mu):
        parts += ParameterChange(mu=mu * law.mu)
    for k, side in enumerate(SIDES):
        for total, of in (("K_N", "k_n"), ("K_T", "k_t")):
            given = scene.stiffness[name].face(side)
            if given is None:
                continue
            share = relative(lambda s, a=side, b=total: getattr(s.stiffness[name].face(a), b))
            if share:
                values = share * np.where(model.face == k, getattr(law, of), 0.0)
                mine = ParameterChange(k_n=values) if of == "k_n" else ParameterChange(k_t=values)
                parts += mine
    F_C = relative(lambda s: s.damper.centrifugal)
    if F_C:
        load = np.concatenate([model.static, model.damper.force])
        parts += ParameterChange(
            preload=F_C * law.preload, traction=F_C * model.traction, static=F_C * load
        )
    if mu and model.state is not None:
        parts += _by_state(
            model,
            [
                static_state(replace(plan, scene=_rubbed(scene, one)), bodies, stages=stages)
                for one in (end.low, end.high)
            ],
        )
    E = relative(lambda s: s.material.E)
    density = relative(lambda s: s.material.density)
    damping = relative(lambda s: s.excitation.damping)
    # C = M Phi diag(2 zeta omega) Phi' M of the blades: as zeta, and as the root of E rho
    blades = ParameterChange(
        M=density * model.M, C=(damping + 0.5 * (E + density)) * model.C, K=E * model.K
    )
    forces = [
        relative(lambda s, k=k: s.damper.centrifugal / s.excitation.centrifugal_to_force[k])
        for k in range(len(scene.excitation.centrifugal_to_force))
    ]
    rigid = relative(lambda s: s.damper.density or s.material.density)
    return DataChange(parts, blades, rigid, np.array(forces))


def _rubbed(scene: ForcedScene, other: ForcedScene) -> ForcedScene:
    return replace(scene, contact=replace(scene.contact, friction=other.contact.friction))


def _by_state(model: Model, states: list[StaticState]) -> ParameterChange:
    """Half of the change of preload, traction and static loads between two static states."""
    low, high = (preloaded(model, state) for state in states)
    return ParameterChange(
        preload=0.5 * (high.contacts.law.preload - low.contacts.law.preload),
        traction=0.5 * (high.traction - low.traction),
        static=np.pad(0.5 * (high.static - low.static), (0, model.damper.n_dof)),
    )


# -- linear answers --------------------------------------------------------------------------------


@dataclass(frozen=True)
class LinearSystem:
    """Mass, damping, stiffness (n, n) of blades and damper, and rows and stiffness of its stuck
    points.
    """

    M: Array
    C: Array
    K: Array
    B: Array
    stuck: bool

    def changed(self, change: ParameterChange, tangents: int) -> tuple[Array, Array, Array]:
        """Derivatives of M, C and K by a parameter."""
        none = np.zeros_like(self.M)
        M, C, K = (none if value is None else value for value in (change.M, change.C, change.K))
        if self.stuck:
            n_point = len(self.B) // (1 + tangents)
            k = np.zeros((n_point, 1 + tangents))
            if change.k_n is not None:
                k[:, 0] = change.k_n
            if change.k_t is not None:
                k[:, 1:] = change.k_t[:, None]
            K = K + self.B.T @ (k.ravel()[:, None] * self.B)
        return M, C, K


def linear_system(model: Model, stuck: bool) -> LinearSystem:
    """Blades and damper without contacts, or with every point closed and sticking."""
    return LinearSystem(*model.linear(stuck), stuck)


def stuck_frequencies(
    model: Model, below: float, changes: Sequence[ParameterChange]
) -> dict[str, tuple[float, Array]]:
    """The lowest stuck modes along x, in and out of phase, by Rayleigh's quotient

        df/f = phi' (dK - w^2 dM) phi / (2 w^2),   phi' M phi = 1.

    Parameters
    ----------
    below
        Hz; modes above are left out.
    changes
        Of the whole model by every parameter.

    Returns
    -------
    dict
        Name of the number -> Hz, and relative changes (n,).

    References
    ----------
    R. L. Fox, M. P. Kapoor, AIAA J. 6 (1968) 2426.
    """
    _, values, shapes = measures.stuck_shapes(model)
    modes = measures.tell_modes(model, values, shapes, below)
    system = linear_system(model, stuck=True)
    made = [system.changed(one, model.contacts.tangents) for one in changes]
    out = {}
    for in_phase, number in ((True, "stuck_in_phase"), (False, "stuck_out_of_phase")):
        which = [j for j, m in enumerate(modes) if m.axis == "x" and m.in_phase == in_phase]
        for j in which[:1]:
            phi, value = shapes[:, j], values[j]
            change = [phi @ (K - value * M) @ phi / (2.0 * value) for M, _, K in made]
            out[number] = (modes[j].frequency, np.array(change))
    return out


def limit_peak(
    model: Model, side: Side, stuck: bool, frequency: float, changes: Sequence[ParameterChange]
) -> PeakDerivative:
    """Derivatives of a peak of w^2 |row @ q|, a blade's free or stuck accelerance.

    Parameters
    ----------
    frequency
        Hz, of the peak.
    changes
        Of the whole model by every parameter.
    """
    system, row, k = linear_system(model, stuck), model.row(side), model.excitation.lowest
    made = [system.changed(one, model.contacts.tangents) for one in changes]
    force = np.concatenate([model.force, np.zeros(model.damper.n_dof)])
    low, here, high = (
        _slopes(system, force, row, 2.0 * np.pi * k * f, made)
        for f in frequency * np.array([1.0 - STEP, 1.0, 1.0 + STEP])
    )
    fall = low[1] - high[1]
    more = high[2] - low[2]
    by_frequency = more / fall / (2.0 * np.pi * k)
    return PeakDerivative(frequency, here[0], low[2] + low[1] / fall * more, by_frequency)


def _slopes(
    system: LinearSystem,
    force: ComplexArray,
    row: Array,
    w: float,
    changes: Sequence[tuple[Array, Array, Array]],
) -> tuple[float, float, Array]:
    """w^2 |row @ q|, its derivative by w, and those by the parameters."""
    D = system.K + 1j * w * system.C - w**2 * system.M
    q, z = np.linalg.solve(D, np.column_stack([force, row])).T
    moved = complex(row @ q)
    size = abs(moved)

    def by(dq: complex) -> float:
        return float(w**2 * (moved.conjugate() * dq).real / size)

    by_w = by(-complex(z @ ((1j * system.C - 2.0 * w * system.M) @ q))) + 2.0 * w * size
    each = [-complex(z @ ((K + 1j * w * C - w**2 * M) @ q)) for M, C, K in changes]
    return w**2 * size, by_w, np.array([by(dq) for dq in each])
