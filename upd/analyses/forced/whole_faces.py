"""Both faces of the damper node by node in a forced response: the equations, and where they begin.

No springs: the blades' and the damper's own elasticity, Signorini's and Coulomb's conditions on
every matching node. Where the faces of the damper and the platforms come from, and which static
state they are in, decides the answer as much as friction does. Curves by harmonic balance have
blades in frequency, damper and contact in time, see `upd.hbm.faces.balance`: every node of both
faces with its past, as a sweep from the static state at rising frequency.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from upd.analyses.forced.curves import Curve, FacesCurve, LinearCurves, WholeFaces
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.interface_model import (
    by_coulomb,
    make_interface_model,
    seated_start,
    worn_start,
)
from upd.analyses.forced.linear_limits import linear_curves, stuck_modes_of
from upd.analyses.forced.measures import PEAKS_ABOVE, CurvePeak, path_maxima
from upd.analyses.forced.mode_peaks import CANDIDATES
from upd.analyses.forced.model import Array
from upd.analyses.forced.plan import SAMPLES, ForcedPlan, blade_harmonics, grid
from upd.analyses.forced.spring_march import SEEN
from upd.analyses.forced.statics import GIVEN, SEATED, StaticState
from upd.analyses.forced.sweeps import with_outputs
from upd.analyses.seated.bodies import Bodies
from upd.analyses.seated.interface import Interface, make_interface
from upd.errors import ConvergenceError, InputError
from upd.hbm.faces.balance import interface_response
from upd.hbm.faces.state import InterfaceModel, InterfaceState, resting
from upd.progress import Stages
from upd.scene.forced_contact import SIDES

#: name of the contact that is no table of stiffnesses
INTERFACE = "interface"
#: load steps in which F_C is raised
_STEPS = 12


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


def linear_limits(plan: ForcedPlan, faces: WholeFaces, frequency: Array) -> LinearCurves:
    """Curves without the damper, and with every node closed and sticking.

    Parameters
    ----------
    frequency
        (n,) Hz, rising: the sweep.
    """
    excitation = excitation_of(plan.scene.excitation)
    free, free_peaks = linear_curves(faces.march, frequency, excitation, stuck=False)
    stuck, stuck_peaks = linear_curves(faces.march, frequency, excitation, stuck=True)
    modes, _ = stuck_modes_of(faces.march, CANDIDATES * plan.scene.excitation.stop)
    return LinearCurves(frequency, free, stuck, modes, free_peaks, stuck_peaks)


def balance_curve(plan: ForcedPlan, name: str, faces: WholeFaces, ratio: float) -> FacesCurve:
    """The balance from the static state along the sweep, rising.

    Parameters
    ----------
    name
        Of the contact.
    ratio
        F_C/F_E.
    """
    b, force = plan.scene.balance, plan.scene.damper.centrifugal / ratio
    excitation = excitation_of(plan.scene.excitation)
    found = interface_response(
        faces.march,
        grid(plan),
        force * excitation.drive,
        faces.start,
        harmonics=blade_harmonics(plan.scene),
        samples=SAMPLES if b.samples == "auto" else b.samples,
        fallback=by_coulomb,
    )
    moved = {k: found.amplitude[:, k] for k in excitation.harmonics}
    curve = Curve(name, ratio, force, {}, {}, {}, found, found.seconds)
    return with_outputs(plan, faces.march, curve, moved, partial(_maxima, found.jumps))


def _maxima(jumps: Sequence[int], frequency: Array, size: Array) -> list[CurvePeak]:
    """Local maxima of a curve; none is read across a jump, and a stretch may be highest where one
    ends it.
    """
    out, begin = [], 0
    for end in (*(i + 1 for i in jumps), len(size)):
        f, a = frequency[begin:end], size[begin:end]
        out += [one._replace(sample=one.sample + begin) for one in path_maxima(f, a, 0.0)]
        for i, inner, jumped in ((0, 1, begin > 0), (len(a) - 1, len(a) - 2, end < len(size))):
            if jumped and (len(a) == 1 or a[i] > a[inner]):
                out.append(CurvePeak(float(f[i]), float(a[i]), begin + i))
        begin = end
    return [one for one in out if one.height >= PEAKS_ABOVE * size.max()]
