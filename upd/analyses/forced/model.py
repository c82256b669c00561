"""Two reduced blades, their contact rows and the rigid damper, and their harmonic balance."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, eigh

from upd.analyses.forced.blade_parts import FacePoints, reduced_blades
from upd.analyses.forced.plan import Excitation, ForcedPlan, excitation_of
from upd.analyses.forced.statics import StaticState, point_preload, static_state
from upd.analyses.seated.bodies import Bodies
from upd.fem import modal_damping
from upd.hbm import (
    Contacts,
    FrequencyResponse,
    RigidDamper,
    Settings,
    contact_rows,
    contacts,
    rigid_damper,
)
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.damper import attach
from upd.hbm.springs.points import Start, stuck_stiffness
from upd.hbm.springs.response import System, response_of
from upd.mesh import IntArray
from upd.scene import ForcedScene
from upd.scene.forced_contact import SIDES, FaceStiffness, Side

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
_AXIS_Y = 1
#: damper dofs that are even about y = 0: ux, uz and the rotation about y
_EVEN_DOFS = (0, 2, 4)
#: relative change of the stuck frequencies up to which sliding along the damper is not resisted
ALONG_MATTERS = 1e-3


@dataclass(frozen=True)
class Model:
    """The linear system of both blades and its contacts for one contact stiffness.

    Attributes
    ----------
    M, C, K
        (n, n) in t, N s/mm, N/mm.
    places
        (n, L) per newton at each excited blade.
    excitation
        Which blades, and how.
    output
        Side -> (n,) displacement along x at the accelerometer.
    faces, laws
        Side -> contact points, and their stiffness.
    contacts
        Contact law and rows on the blades' dofs.
    damper, damper_rows
        Rigid damper, and (n_point, 1 + d, n_dof of the damper) contact rows on it.
    frequency, damping
        (m,) Hz of the blades without damper, and their damping ratios.
    face
        (n_point,) index into SIDES.
    static
        (n,) N that holds the blades where they are under the preload.
    traction
        (n_point, d) N along the tangents before anything moves.
    state
        The static state that preload and traction are; None without.
    """

    M: Array
    C: Array
    K: Array
    places: Array
    excitation: Excitation
    output: Mapping[Side, Array]
    faces: Mapping[Side, FacePoints]
    laws: Mapping[Side, FaceStiffness]
    contacts: Contacts
    damper: RigidDamper
    damper_rows: Array
    frequency: Array
    damping: Array
    face: IntArray
    static: Array
    traction: Array
    state: StaticState | None = None

    @property
    def force(self) -> ComplexArray:
        """(n,) the lowest harmonic that is excited, per newton of F_E."""
        return np.asarray(self.places @ self.excitation.read)

    def row(self, side: Side) -> Array:
        """Output row (n + damper.n_dof,) with the damper's dofs."""
        return np.concatenate([self.output[side], np.zeros(self.damper.n_dof)])

    @property
    def system(self) -> System:
        """What `upd.hbm` takes of it, the excitation and the balance aside; with friction the
        sliders stand where they carry the static traction.
        """
        law = self.contacts.law
        slider = -self.traction / law.k_t[:, None] if np.any(law.mu) else None
        own = {name: getattr(self, name) for name in ("contacts", "damper", "damper_rows")}
        return System((self.M, self.C, self.K), static_force=self.static, slider=slider, **own)

    def linear(self, stuck: bool) -> tuple[Array, Array, Array, Array]:
        """M, C, K (n, n) of blades and damper and rows B of the points, without contacts or with
        every point closed and sticking.
        """
        M, C, K, points = attach(
            self.M, self.C, self.K, self.contacts, self.damper, self.damper_rows
        )
        if stuck:
            K = K + points.B.T @ (stuck_stiffness(points).ravel()[:, None] * points.B)
        return M, C, K, points.B

    @property
    def position(self) -> Array:
        """Contact points (n_point, 3) mm."""
        return np.vstack([self.faces[side].position for side in SIDES])


def make_model(
    plan: ForcedPlan,
    bodies: Bodies,
    laws: Mapping[Side, FaceStiffness],
    state: StaticState | None = None,
) -> Model:
    """Reduce both blades to the points of one contact stiffness and put them beside each other.

    Parameters
    ----------
    state
        The static state, with contact.fit = "loaded"; that of the scene when None.
    """
    scene = plan.scene
    faces, small = reduced_blades(plan, bodies)
    K, M = block_diag(*(one.K for one in small)), block_diag(*(one.M for one in small))
    values, shapes = eigh(K, M)
    frequency = np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi)
    # M has a block for each blade
    on_blade = np.repeat(np.eye(len(SIDES)), [len(one.K) for one in small], axis=0)
    damping = scene.modal_damping(frequency, (shapes * (M @ shapes)).T @ on_blade)
    rows = block_diag(*(one.rows.reshape(-1, len(one.K)) for one in small)).reshape(-1, 3, len(K))
    probes = block_diag(*(one.probes for one in small))
    # of each blade its accelerometer, and behind it the node of its force
    seen = dict(zip(SIDES, (0, len(small[0].probes)), strict=True))
    excitation = excitation_of(scene.excitation)
    damper = _rigid(scene, bodies)
    k_n, k_t = (
        np.concatenate([getattr(laws[side], of) * faces[side].weight for side in SIDES])
        for of in ("K_N", "K_T")
    )
    # the blade's motion opens the contact that the damper's closes
    made = contacts(
        -rows[:, 0], [-rows[:, 1], -rows[:, 2]], k_n=k_n, k_t=k_t, mu=scene.contact.friction
    )
    on_damper = contact_rows(
        damper,
        np.vstack([faces[side].position for side in SIDES]),
        np.concatenate([np.tile(faces[side].frame, (faces[side].n_point, 1, 1)) for side in SIDES]),
    )
    model = Model(
        M,
        modal_damping(M, shapes, frequency, damping),
        K,
        probes[[seen[side] + 1 for side in excitation.blades]].T,
        excitation,
        {side: probes[seen[side]] for side in SIDES},
        faces,
        laws,
        made,
        damper,
        on_damper,
        frequency,
        damping,
        np.repeat([0, 1], [faces[side].n_point for side in SIDES]),
        np.zeros(len(M)),
        np.zeros((made.n_point, made.tangents)),
    )
    directions = scene.contact.directions
    if directions == "one" or (directions == "auto" and bodies.half and not _along_matters(model)):
        model = _without_along(model)
    if not scene.contact.loaded:
        return model
    return preloaded(model, state or static_state(plan, bodies))


def _rigid(scene: ForcedScene, bodies: Bodies) -> RigidDamper:
    """The whole damper, in all its motions or, of halves, those even about y = 0."""
    own = bodies.damper.with_mirror_image(_AXIS_Y) if bodies.half else bodies.damper
    return rigid_damper(
        own.mass,
        0.5 * (own.inertia + own.inertia.T),
        own.centre,
        [0.0, 0.0, scene.damper.centrifugal],
        kept=_EVEN_DOFS if bodies.half else range(6),
    )


def preloaded(model: Model, state: StaticState) -> Model:
    """The model with a static state: what its points carry before anything moves.

    Raises
    ------
    InputError
        When its points cannot hold the damper in that state.
    """
    N, T = point_preload(
        model.damper_rows[:, 0],
        model.damper_rows[:, -1],
        model.face,
        np.concatenate([model.faces[side].weight for side in SIDES]),
        state,
        model.damper.force,
    )
    made = replace(model.contacts, law=replace(model.contacts.law, preload=N))
    traction = np.zeros((made.n_point, made.tangents))
    traction[:, -1] = T
    return replace(
        model,
        contacts=made,
        static=np.einsum("pdn,pd->n", made.rows, np.column_stack([N, traction])),
        traction=traction,
        state=state,
    )


def _without_along(model: Model) -> Model:
    """The model in which nothing resists sliding along the damper."""
    kept = [0, 2]
    rows, on_damper = (
        np.ascontiguousarray(of[:, kept]) for of in (model.contacts.rows, model.damper_rows)
    )
    contacts = replace(model.contacts, rows=rows)
    return replace(model, contacts=contacts, damper_rows=on_damper, traction=model.traction[:, :1])


def _along_matters(model: Model) -> bool:
    """Whether resistance to sliding along the damper changes the two lowest stuck frequencies."""
    if not np.any(model.contacts.law.mu):
        # without friction nothing resists
        return False
    found = []
    for one in (model, _without_along(model)):
        M, _, K, _ = one.linear(stuck=True)
        found.append(np.sqrt(eigh(K, M, subset_by_index=[0, 1])[0]))
    return bool(np.abs(found[1] / found[0] - 1.0).max() > ALONG_MATTERS)


# -- harmonic balance ------------------------------------------------------------------------------


#: half width of the band around a peak in which it is looked for, as a share of its frequency, and
#: the points in it
BAND, BAND_POINTS = 0.02, 15
#: points in which it is looked for in the whole sweep
SWEEP_POINTS = 60
#: points a path may have: so many where points slip and stick, however few frequencies are asked
#: for, or so many per frequency
LEAST_POINTS, MOST_POINTS = 1800, 4
#: steps of a path whose tops are climbed to afterwards: half the points of the usual ones, and tops
#: between them that differ by 0.2 % in height
LONG_STEPS = Settings(angle=0.7, kink_step=0.1, wanted_iterations=8)


def respond(
    plan: ForcedPlan,
    model: Model,
    force: float,
    frequencies: Array,
    harmonics: Iterable[int] | None = None,
    settings: Settings | None = None,
    **changes: Any,
) -> FrequencyResponse:
    """The harmonic balance of one model along the frequencies.

    Parameters
    ----------
    force
        Excitation, N.
    frequencies
        (n,) Hz.
    settings
        Of the path; by the number of frequencies when None.
    harmonics, **changes
        As of `balance_of`.
    """
    most = max(LEAST_POINTS, MOST_POINTS * len(frequencies))
    steps = settings or replace(LONG_STEPS, most_points=most)
    b = balance_of(plan, model, force, harmonics, **changes)
    return response_of(b, frequencies, False, True, steps)


def balance_of(
    plan: ForcedPlan,
    model: Model,
    force: float,
    harmonics: Iterable[int] | None = None,
    *,
    samples: int | None = None,
    start: Start | None = None,
) -> Balance:
    """The problem that `respond` follows.

    Parameters
    ----------
    force
        Excitation, N.
    harmonics
        Their numbers; those of the scene when None.
    samples, start
        Per period, and of the sliders; those of the scene when None.
    """
    b = plan.scene.balance
    given = replace(
        model.system,
        harmonics=plan.scene.harmonic_numbers if harmonics is None else harmonics,
        samples=samples or (None if b.samples == "auto" else b.samples),
        start=start or b.slider,
    )
    drive = force * model.excitation.drive
    forces = {k: model.places @ drive[:, k - 1] for k in model.excitation.harmonics}
    return given.balance("balance", np.ones(1), forces, fast_exits=True)


@contextmanager
def quiet() -> Iterator[None]:
    """Warnings of single paths are not the run's: its checks measure the peaks."""
    solver = logging.getLogger("upd.hbm")
    level = solver.level
    solver.setLevel(logging.ERROR)
    try:
        yield
    finally:
        solver.setLevel(level)
