"""What inputs known within limits change of the data of a forced response's models.

Friction, totals of the contact stiffness, F_C and F_E, damping, Young's modulus and densities move
data that are known in closed form: none needs the mesh again. In step with them the static state is
that of both ends.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from upd.analyses.base import InputEnds
from upd.analyses.forced.model import Array, Model, preloaded
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.statics import StaticState, static_state
from upd.analyses.seated.bodies import Bodies
from upd.hbm.parameter_change import ParameterChange
from upd.progress import Stages
from upd.scene import ForcedScene
from upd.scene.forced_contact import SIDES, StiffnessChoice


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
    state_N, state_T
        (2,) N, of the faces' forces at rest.
    """

    contacts: ParameterChange
    blades: ParameterChange
    damper: float
    forces: Array
    state_N: Array
    state_T: Array

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
    N, T = np.zeros(2), np.zeros(2)
    F_C = relative(lambda s: s.damper.centrifugal)
    if F_C:
        load = np.concatenate([model.static, model.damper.force])
        parts += ParameterChange(
            preload=F_C * law.preload, traction=F_C * model.traction, static=F_C * load
        )
        if model.state is not None:
            N, T = N + F_C * model.state.N, T + F_C * model.state.T
    if mu and model.state is not None:
        states = [
            static_state(replace(plan, scene=_rubbed(scene, one)), bodies, stages=stages)
            for one in (end.low, end.high)
        ]
        parts += _by_state(model, states)
        N, T = (
            total + 0.5 * (getattr(states[1], of) - getattr(states[0], of))
            for total, of in ((N, "N"), (T, "T"))
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
    return DataChange(parts, blades, rigid, np.array(forces), N, T)


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
