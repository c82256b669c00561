"""The contact before vibration: stiffness of both faces, N and T under F_C, what points carry.

Stiffnesses are totals from the scene, or the contact law of a contact analysis, run here or read
from its folder.

F_C on a damper with friction leaves N and T open: any pair of mobilised ratios t = T/N within
+-mu is an equilibrium. With n and u the unit normal into the blade and the unit vector up the
slope of each face, and T positive when it opposes F_C,

    N_left (n + t u)_left + N_right (n + t u)_right = F_C e_z

in the plane of the slopes gives N from both ratios; with one face empty the other one's
resultant is vertical, t = -n_x / u_x. Every point of a face has its face's ratio, so that it keeps
to the friction cone when the face does; the normal forces are as even as the damper's balance of
forces and moments lets them be: the least sum N^2 / weight of all N >= 0 with G'N = F, G the
motion of the points along n + t u by the damper's dofs.

References
----------
C. L. Lawson, R. J. Hanson, Solving Least Squares Problems (1974), ch. 23: least distance
programming by NNLS.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses import analysis_of
from upd.analyses.base import Plan
from upd.analyses.seated.bodies import Bodies, face_angles, make_bodies, patch_frame, rigid_balance
from upd.analyses.seated.interface import make_interface
from upd.cache.arrays import cache_folder, load_arrays, save_arrays
from upd.cache.sources import key_of, source_digest
from upd.contact.law import ContactLaw
from upd.contact.rigid_damper import FaceForces, equilibrium
from upd.errors import ConvergenceError, InputError
from upd.linalg.least_distance import least_positive
from upd.mesh import IntArray, recipes
from upd.mesh.fields import DamperSizes
from upd.progress import Stages
from upd.results import Group, read_netcdf
from upd.scene import ForcedScene, Scene, load_scene
from upd.scene.contact import CONTACT_WANTS
from upd.scene.forced_contact import SIDES, STATES, FaceStiffness, Side, StiffnessChoice

log = logging.getLogger(__name__)


def face_laws(choice: StiffnessChoice, stages: Stages) -> dict[Side, FaceStiffness]:
    """Stiffness of the left and the right face.

    A contact analysis stands for the right one and, mirrored, for the symmetric rig's left.
    """
    given = {side: choice.face(side) for side in SIDES}
    if not choice.from_contact:
        return {side: one for side, one in given.items() if one is not None}
    law = _law(choice, stages)
    found = FaceStiffness(float(law.k_n.sum()), float(law.k_t.sum(axis=0).mean()))
    return {side: one or found for side, one in given.items()}


def check_sources(scene: ForcedScene) -> None:
    """Raise InputError when a contact scene or run that gives a stiffness is not there, damaged, of
    another kind, or of another damper than the rig's. Solves nothing.
    """
    problems = []
    for name, choice in scene.stiffnesses.items():
        try:
            if choice.run is not None:
                _law(choice, Stages())
                contact = None
                # the folder may not hold it any more, or not as this version reads it
                with suppress(InputError):
                    contact = load_scene(Path(choice.run) / "scene.toml")
                known = contact is not None and contact.analysis in CONTACT_WANTS
                _check_damper(scene, f"run {choice.run}", contact if known else None)
            elif choice.scene is not None:
                _check_damper(scene, f"scene {choice.scene}", _contact_scene(choice))
        except InputError as error:
            problems.append(f"stiffness.{name}: {error}")
    if problems:
        raise InputError("\n".join(problems))


def _check_damper(scene: ForcedScene, source: str, contact: Scene | None) -> None:
    """Raise InputError when the contact is that of another damper: its stiffness is not this
    one's. A damper that cannot be compared gives a warning.
    """
    rig = _damper(scene.recipe, {**scene.geometry, "arrangement": scene.arrangement})
    other = None if contact is None else _damper(contact.recipe, contact.geometry)
    if rig is None or other is None:
        log.warning(
            "contact stiffness from %s: not compared with the rig's damper; to fix it: both need a "
            "scene.toml and a recipe with a function damper_sizes(params)",
            source,
        )
        return
    different = rig.differences(other, "in the rig", "in the contact")
    if different:
        raise InputError(
            f"{source} is the contact of another damper: {'; '.join(different)}; to fix it: set "
            "[geometry] of both scenes alike (a copy of the contact scene may be named), or give "
            "K_N and K_T themselves"
        )


def _damper(recipe: str, geometry: Mapping[str, Any]) -> DamperSizes | None:
    """Sizes of the damper; of the scene's parameters those that the recipe knows count."""
    given = {k: v for k, v in geometry.items() if k not in ("recipe", "damper") and v != "auto"}
    return recipes.damper_sizes(recipe, given)


def plans_to_solve(scene: ForcedScene) -> list[Plan[Any]]:
    """Plans of the contact scenes that give a stiffness and were not solved before."""
    scenes = [_contact_scene(c) for c in scene.stiffnesses.values() if c.scene is not None]
    found = {_kept_law(contact): contact for contact in scenes}
    return [
        analysis_of(contact).make_plan(contact)
        for path, contact in found.items()
        if not path.exists()
    ]


def _kept_law(scene: Scene) -> Path:
    """Where the law of a contact scene is kept once it is solved."""
    key = key_of({"contact law": scene.text, "sources": source_digest(scene.recipe)})
    return cache_folder() / f"law-{key[:32]}.npz"


def _law(choice: StiffnessChoice, stages: Stages) -> ContactLaw:
    """The law of a finished run, or of a contact scene's first load, kept on disk."""
    if choice.run is not None:
        path = Path(choice.run) / "result.nc"
        try:
            groups = read_netcdf(path)
        except OSError as error:
            raise InputError(
                f"stiffness: no contact law in {path} ({error}); give the folder of a "
                "finished contact run"
            ) from None
        return ContactLaw.from_arrays(_first(groups, str(path)))
    scene = _contact_scene(choice)
    kept = _kept_law(scene)
    with stages("contact stiffness", f"{scene.name}, {choice.bodies} bodies"):
        arrays = load_arrays(kept)
        if arrays is None:
            arrays = {name: variable[1] for name, variable in _run(scene).items()}
            save_arrays(kept, arrays)
    return ContactLaw.from_arrays(arrays)


def _first(groups: Mapping[str, Group], where: str) -> Group:
    laws = (one for one in groups.values() if one.attributes.get("content") == "contact law")
    if (found := next(laws, None)) is not None:
        return found
    raise InputError(
        f'stiffness: {where} holds no contact law; run the contact with "contact_law" among want'
    )


def _contact_scene(choice: StiffnessChoice) -> Scene:
    """The contact scene, cut down to what gives its law."""
    assert choice.scene is not None
    given = load_scene(choice.scene)
    if "contact_law" not in CONTACT_WANTS.get(given.analysis, ()):
        raise InputError(
            f"stiffness: {choice.scene} is no contact of a damper on its platform; use "
            "symmetric, asymmetric or a scene of that kind"
        )
    changed: Scene = load_scene(
        choice.scene, {"want": ["stiffness", "contact_law"], "law.bodies": choice.bodies}
    )
    return changed


def _run(scene: Scene) -> Group:
    flat = analysis_of(scene)
    solution = flat.solve(flat.make_plan(scene), Stages())
    for check in (one for one in flat.check_solution(solution) if not one.passed):
        what = f"{check.name}: {check.says} = {check.value:.3g}, limit {check.limit:.3g}"
        log.warning("contact analysis %s: %s", scene.name, what)
        if check.fatal:
            raise InputError(
                f"stiffness: the contact analysis {scene.name} failed its check {check.name}; "
                f"run it alone: upd run {scene.name}"
            )
    return _first(flat.arrays(solution), scene.name)


# -- stiffness of the faces ------------------------------------------------------------------------


Array = NDArray[np.float64]
#: imbalance of a static state with F_C, relative to it, above which it is none
BALANCE = 1e-9
SEATED, GIVEN = "seated", "given"
#: load steps in which F_C is raised from nothing
_STEPS = 20
_X, _Z = 0, 2


@dataclass(frozen=True)
class StaticState:
    """Forces on both faces of the whole damper before vibration, left first.

    Attributes
    ----------
    name
        As in contact.static, or "given".
    N, T : (2,) ndarray
        Normal force, and friction up the slope, positive when it opposes F_C, N.
    known
        Forces of a rigid damper in the same state, None where no closed form has it.
    """

    name: str
    N: Array
    T: Array
    known: FaceForces | None = None

    @property
    def ratio(self) -> Array:
        """(2,) T/N, nan for a face that carries nothing."""
        with np.errstate(invalid="ignore"):
            return np.asarray(np.where(self.N > 0.0, self.T / self.N, np.nan))

    @property
    def empty(self) -> list[str]:
        """Faces that carry nothing: they just touch."""
        return [side for side, N in zip(SIDES, self.N, strict=True) if N == 0.0]

    def same(self, other: StaticState) -> bool:
        """Whether another state has the same forces, to what the balance is checked to."""
        off = np.abs([self.N - other.N, self.T - other.T]).max()
        return bool(off <= BALANCE * np.abs(self.N).sum())


def face_frames(bodies: Bodies) -> Array:
    """(2, 3, 3) of each face, unit rows: normal into the blade, along the damper, up the slope."""
    return np.stack([patch_frame(bodies.blades[side].mesh) for side in SIDES])


def static_state(
    plan: Plan[ForcedScene], bodies: Bodies, choice: Any = None, stages: Stages | None = None
) -> StaticState:
    """The static state that a scene asks for.

    Parameters
    ----------
    plan
        Of the forced response.
    bodies
        Its blades: their faces' frames count.
    choice
        As contact.static; that of the scene when None.
    stages
        Of the run.

    Returns
    -------
    StaticState

    Raises
    ------
    InputError
        Where the state does not exist: the damper jams, the forces given are not in balance with
        F_C, or friction does not hold them.
    """
    c, F = plan.scene.contact, plan.scene.damper.centrifugal
    chosen = c.static if choice is None else choice
    frames = face_frames(bodies)
    if not isinstance(chosen, str):
        return _checked(StaticState(GIVEN, *_given(frames, F, chosen)), frames, F, c.friction)
    if chosen == SEATED:
        N, T = F * _seated_shares(plan, stages or Stages())
        known = rigid_balance(frames, F, c.friction, "opposing")
        return _checked(StaticState(SEATED, N, T, known), frames, F, c.friction)
    try:
        known = equilibrium(*face_angles(frames), F, c.friction, chosen)
    except InputError as error:
        raise InputError(f'contact.static: "{chosen}" does not exist here: {error}') from None
    N = np.array([known.normal_left, known.normal_right])
    T = np.array([known.tangential_left, known.tangential_right])
    return _checked(StaticState(chosen, N, T, known), frames, F, c.friction)


def admissible(plan: Plan[ForcedScene], bodies: Bodies, stages: Stages) -> list[StaticState]:
    """The named static states that exist here, each once; without friction one."""
    out: list[StaticState] = []
    for name in STATES:
        try:
            state = static_state(plan, bodies, name, stages)
        except InputError as error:
            log.info("static state %s: %s", name, error)
            continue
        out.append(state)
    return out


def imbalance(frames: Array, F: float, N: Array, T: Array) -> float:
    """Misfit of the faces' forces with F_C e_z in the plane of the slopes, relative to F_C."""
    total = N @ frames[:, 0] + T @ frames[:, 2] - np.array([0.0, 0.0, F])
    return float(np.abs(total[[_X, _Z]]).max() / F)


def _given(frames: Array, F: float, chosen: Mapping[str, Any]) -> tuple[Array, Array]:
    """N and T of both faces, from the ratios T/N or the forces that a scene gives."""
    if not all(isinstance(chosen[side], float) for side in SIDES):
        N, T = (np.array([chosen[side][letter] for side in SIDES]) for letter in "NT")
        return N, T
    ratios = np.array([chosen[side] for side in SIDES])
    A = (frames[:, 0] + ratios[:, None] * frames[:, 2])[:, [_X, _Z]].T
    N = np.linalg.lstsq(A, np.array([0.0, F]), rcond=None)[0]
    return N, N * ratios


def _checked(state: StaticState, frames: Array, F: float, mu: float) -> StaticState:
    """The state, when it is one: in balance with F_C, pressing, within friction."""
    N, T = state.N, state.T
    faces = ", ".join(
        f"{side} N = {n:.10g} N, T = {t:.10g} N" for side, n, t in zip(SIDES, N, T, strict=True)
    )
    off = imbalance(frames, F, N, T)
    if off > BALANCE:
        raise InputError(
            f"contact.static: {faces} are not in balance with F_C = {F:g} N (misfit {off:.2g} of "
            "it); to fix it: give the ratios T/N of both faces, for example { left = 0.2, right = "
            "0.2 }: the forces then follow"
        )
    if (N < -BALANCE * F).any():
        raise InputError(
            f"contact.static: {faces}: a face would have to pull; to fix it: bring the ratios T/N "
            "of both faces nearer to 0"
        )
    if (np.abs(T) > mu * N + BALANCE * F).any():
        raise InputError(
            f"contact.static: {faces}: beyond friction, |T| > mu N with mu = {mu:g}; to fix it: "
            f"|T/N| of each face at most {mu:g}, or raise contact.friction"
        )
    none = N <= BALANCE * F
    return replace(state, N=np.where(none, 0.0, N), T=np.where(none, 0.0, T))


# -- the coupled contact ---------------------------------------------------------------------------


def _seated_shares(plan: Plan[ForcedScene], stages: Stages) -> Array:
    """(2, 2) N and T of both faces over F_C after it is raised from nothing.

    Without gaps the contact is homogeneous: the shares do not depend on F_C.
    """
    scene = plan.scene
    F, mu = scene.damper.centrifugal, scene.contact.friction
    # the contact takes faces of four nodes: the half of the same rig of eight-node solids
    plan = replace(
        plan,
        scene=replace(scene, mesh=replace(scene.mesh, element="hex8i")),
        parameters={**plan.parameters, "element_nodes": 8, "symmetry": "half"},
        symmetry="half",
    )
    with stages("static state", "F_C raised on both faces with friction"):
        of = make_interface(plan, make_bodies(plan))
        try:
            found = of.seat(mu, F * np.arange(1, _STEPS + 1) / _STEPS)
        except ConvergenceError as error:
            raise InputError(
                f'contact.static: "seated" was not solved ({error}); to fix it: '
                'contact.static = "frictionless", or T/N of both faces'
            ) from error
    return np.asarray((of.face_forces(found)[-1] / F)[:, [0, 2]].T)


# -- the contact points ----------------------------------------------------------------------------


def point_preload(
    normals: Array, slopes: Array, face: IntArray, weight: Array, state: StaticState, force: Array
) -> tuple[Array, Array]:
    """Normal force and friction up the slope of every point, as even as balance lets them be.

    Parameters
    ----------
    normals, slopes
        (n_point, n_dof) motion of the points along their normals, and up their slopes, by the
        damper's dofs.
    face
        (n_point,) index into SIDES.
    weight
        (n_point,) share of each in its face.
    state
        Of the faces: their ratios T/N count.
    force
        (n_dof,) static force on the damper, N and N mm.

    Returns
    -------
    N, T
        (n_point,) N; 0 of a face that carries nothing.

    Raises
    ------
    InputError
        When no pressing forces of these points hold the damper.
    """
    ratio = state.ratio[face]
    on = np.isfinite(ratio)
    t = np.where(on, ratio, 0.0)
    G = normals + t[:, None] * slopes
    root = np.where(on, np.sqrt(weight), 0.0)
    A = G.T * root
    # rows of forces and of moments differ by a length: each is taken relative to its own size
    size = np.linalg.norm(A, axis=1)
    forces = (len(force) + 1) // 2
    used = size > np.sqrt(np.finfo(float).eps) * np.repeat(
        [size[:forces].max(), size[forces:].max()], [forces, len(force) - forces]
    )
    x = least_positive(A[used] / size[used, None], force[used] / size[used])
    N = root * x if x is not None else np.zeros(len(face))
    # the largest lever arm makes a moment a force
    arm = max(size[forces:].max() / size[:forces].max(), np.finfo(float).tiny)
    misfit = np.abs(G.T @ N - force) / np.repeat([1.0, arm], [forces, len(force) - forces])
    if x is None or misfit.max() > BALANCE * np.abs(force[:forces]).max():
        faces = f"with the {' and '.join(state.empty)} face empty " if state.empty else ""
        raise InputError(
            f"contact.static: the chosen points cannot hold the damper {faces}against F_C in the "
            f'static state "{state.name}" (T/N = '
            f"{', '.join(f'{v:.3g}' for v in state.ratio)}): to fix it: choose other rows, "
            'another contact.static, or contact.fit = "unloaded"'
        )
    return N, t * N
