"""Modes, reduction and linear response of the two-blade rig. Arrays in, arrays out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import spsolve

from upd.analyses.base import Resolved, keeping
from upd.analyses.modal.plan import MODES_ABOVE, MORE_MODES, ModalPlan, configurations, parameters
from upd.dynamics import (
    frequency_response,
    modal_system,
    peak_response,
    tune_damping,
)
from upd.errors import InputError
from upd.fem import Material, mass, stiffness
from upd.linalg import Modes, factorise, modes
from upd.linalg.parallel import in_parallel
from upd.linalg.symmetric import Symmetric, combined, whole
from upd.mesh import Mesh, recipes
from upd.progress import Stages
from upd.reduction import ErrorTarget, ReducedModel, craig_bampton
from upd.results import Case, Estimates
from upd.results import quantities as q
from upd.scene import RigScene

Array = NDArray[np.float64]

#: mirror family -> components the plane y = 0 holds: x and z move evenly in "x", y does in "y"
FAMILIES = {"x": (1,), "y": (0, 2)}
_AXIS_X = 0
#: parts of the first frequency at which the reduced model is compared with the full one
OFF_RESONANCE = (0.5, 1.2)


@dataclass(frozen=True)
class RigBody:
    """One body of one configuration: mesh (half or whole), K and M with all dofs."""

    name: str
    mesh: Mesh
    K: Symmetric
    M: Symmetric

    def free(self, held: tuple[int, ...]) -> NDArray[np.int64]:
        """Dofs left when the clamped faces are held, and the components ``held`` on the mirror
        plane.
        """
        fixed = np.zeros((self.mesh.n_node, 3), bool)
        fixed[self.mesh.nodes["clamped"]] = True
        for c in held:
            fixed[self.mesh.nodes["plane_y"], c] = True
        return np.flatnonzero(~fixed.ravel())


@dataclass(frozen=True)
class RigMode:
    """One mode: frequency in Hz, its body and mirror family ("" without one), its displacement
    (n_node, 3) on the body's mesh.
    """

    frequency: float
    body: RigBody
    family: str
    shape: Array


@dataclass
class ModeSet:
    """Modes of one configuration, rising, and the answers of their solver.

    (body, mirror family, modes).
    """

    arrangement: str
    kind: str
    modes: list[RigMode]
    found: list[tuple[RigBody, str, Modes]]

    @property
    def case(self) -> Case:
        """The configuration."""
        return Case(kind=self.kind, arrangement=self.arrangement)


@dataclass(frozen=True)
class ReducedBlade:
    """Craig-Bampton model of one blade.

    Its free dofs, the model, its first frequencies and those of the full blade in Hz.
    """

    body: RigBody
    free: NDArray[np.int64]
    model: ReducedModel
    frequency: Array
    full: Array


@dataclass
class RigResponse:
    """Linear response of the rig to a force on the right blade.

    Attributes
    ----------
    arrangement
        The configuration's, "symmetric" or "asymmetric".
    frequency
        (n,) Hz.
    accelerance
        "free" or "glued" -> blade -> (n,) at its accelerometer, (m/s2)/N.
    damping
        Modal damping ratio.
    peak
        Frequency in Hz and height in (m/s2)/N of the free right blade's peak in the band, if any.
    participation
        phi_force phi_output of the peak's mode, 1/kg.
    against_full
        Part of the first frequency -> accelerance of the reduced and of the full right blade.
    """

    arrangement: str
    frequency: Array
    accelerance: dict[str, dict[str, NDArray[np.complex128]]]
    damping: float
    peak: tuple[float, float] | None
    participation: float
    against_full: dict[float, tuple[float, float]]


@dataclass
class ModalSolution:
    """All that was solved, for results, arrays and files.

    Attributes
    ----------
    left_out
        Numbers solved again with effects left out.
    estimates
        Of its numbers, where the levels were chosen by an accuracy.
    """

    plan: ModalPlan
    sets: list[ModeSet] = field(default_factory=list)
    reductions: list[ReducedBlade] = field(default_factory=list)
    response: RigResponse | None = None
    left_out: list[Resolved] = field(default_factory=list)
    estimates: Estimates | None = None


def solve(plan: ModalPlan, stages: Stages) -> ModalSolution:
    """Run everything the plan calls for.

    An error raised on the way carries what converged so far as ``partial``.
    """
    solution = ModalSolution(plan)
    with keeping(solution):
        for arrangement, kind in configurations(plan.scene):
            solution.sets.append(_mode_set(plan, arrangement, kind, stages))
        if plan.scene.wants("reduction"):
            _reduce(solution, stages)
        if plan.scene.wants("response"):
            with stages("response", f"{plan.scene.response.points} frequencies"):
                solution.response = _response(solution)
        if plan.scene.left_out.solves:
            with stages("effects left out", "each solved again"):
                solution.left_out += [*_more_modes(solution), *_unlocked(solution)]
    return solution


def _bodies(plan: ModalPlan, arrangement: str, kind: str, symmetry: str) -> list[RigBody]:
    scene = plan.scene
    meshes, _ = recipes.build_mesh(scene.recipe, parameters(scene, arrangement, kind, symmetry))
    material = Material(scene.material.E, scene.material.nu, scene.material.density)

    def body(name: str, mesh: Mesh) -> RigBody:
        return RigBody(
            name,
            mesh,
            Symmetric.of(stiffness(mesh, material, scene.mesh.element)),
            Symmetric.of(mass(mesh, material)),
        )

    return in_parallel([partial(body, name, mesh) for name, mesh in meshes.items()], plan.workers)


def _mode_set(plan: ModalPlan, arrangement: str, kind: str, stages: Stages) -> ModeSet:
    with stages("mesh and assembly", f"{kind}, {arrangement}"):
        bodies = _bodies(plan, arrangement, kind, plan.symmetry)
    families = FAMILIES if plan.symmetry == "half" else {"": ()}
    jobs = [(body, family, held) for body in bodies for family, held in families.items()]
    sizes = ", ".join(f"{b.name} {3 * b.mesh.n_node} dofs" for b in bodies)
    with stages("modes", f"{kind}, {arrangement}: {sizes}"):
        found = in_parallel(
            [partial(_modes, plan, body, held) for body, _, held in jobs], plan.workers
        )
    out: list[RigMode] = []
    for (body, family, held), one in zip(jobs, found, strict=True):
        free = body.free(held)
        for f, x in zip(one.frequency, one.shapes.T, strict=True):
            u = np.zeros(3 * body.mesh.n_node)
            u[free] = x
            out.append(RigMode(float(f), body, family, u.reshape(-1, 3)))
    out.sort(key=lambda m: m.frequency)
    return ModeSet(
        arrangement,
        kind,
        out,
        [(b, family, m) for (b, family, _), m in zip(jobs, found, strict=True)],
    )


def _modes(
    plan: ModalPlan, body: RigBody, held: tuple[int, ...], below: float | None = None
) -> Modes:
    free = body.free(held)
    return modes(
        body.K.submatrix(free),
        body.M.submatrix(free),
        below_hz=plan.scene.modes.below if below is None else below,
        solver=plan.scene.solver.name,
    )


def _reduce(solution: ModalSolution, stages: Stages) -> None:
    """Craig-Bampton of both blades of the first arrangement, on whole bodies whatever the mirror
    plane saves elsewhere.
    """
    plan = solution.plan
    scene = plan.scene
    arrangement = scene.modes.arrangements[0]
    with stages("mesh and assembly", f"whole blades, {arrangement}"):
        bodies = _bodies(plan, arrangement, "free", "full")
    with stages("reduction", f"{', '.join(b.name for b in bodies)}: {scene.reduction.words} each"):
        solution.reductions = in_parallel(
            [partial(_reduced, solution, body) for body in bodies], plan.workers
        )


def _reduced(solution: ModalSolution, body: RigBody) -> ReducedBlade:
    scene = solution.plan.scene
    free = body.free(())
    kept = np.concatenate([body.mesh.nodes[name] for name in ("patch", "force", "accelerometer")])
    boundary = np.searchsorted(free, (3 * np.unique(kept)[:, None] + np.arange(3)).ravel())
    free_modes = free_set(solution, scene.modes.arrangements[0]).modes
    full = [m.frequency for m in free_modes if m.body.name == body.name]
    if not full:
        raise InputError(
            f"modes.below: the {body.name} blade has no mode below {scene.modes.below:g} "
            "Hz; raise it"
        )
    model = craig_bampton(
        body.K.submatrix(free),
        body.M.submatrix(free),
        boundary,
        **_wanted(scene, len(full)),
        rows=boundary,
        solver=scene.solver.name,
    )
    return ReducedBlade(body, free, model, model.modes(count=len(full)).frequency, np.array(full))


def _wanted(scene: RigScene, n_full: int) -> dict[str, Any]:
    choice = scene.reduction
    if choice.below is not None:
        return {"below_hz": choice.below}
    return (
        {"n_modes": choice.count}
        if choice.error is None
        else {"target": ErrorTarget(choice.error, n_full)}
    )


def free_set(solution: ModalSolution, arrangement: str) -> ModeSet:
    """The modes of the blades without a damper."""
    return next(s for s in solution.sets if s.arrangement == arrangement and s.kind == "free")


def _system_modes(found: ModeSet, names: tuple[str, ...]) -> tuple[Modes, RigBody, str]:
    """The modes of the named bodies whose plane y = 0 moves in itself, the only ones a force in
    that plane excites; body and family.
    """
    mine = [m for m in found.modes if m.body.name in names and m.family in ("x", "")]
    if not mine:
        raise InputError(
            f"modes.below: no mode of {', '.join(names)} below it moves along x; raise it"
        )
    first = next(m for b, family, m in found.found if b.name in names and family in ("x", ""))
    # Half a rig has half the modal mass: its shapes are those of the whole times sqrt 2.
    scale = np.sqrt(0.5) if mine[0].family else 1.0
    shapes = scale * np.column_stack([m.shape.ravel() for m in mine])
    return (
        replace(first, frequency=np.array([m.frequency for m in mine]), shapes=shapes),
        mine[0].body,
        mine[0].family,
    )


def probe(mesh: Mesh, name: str) -> int:
    """Dof along x of the node named ``name``."""
    return 3 * int(mesh.nodes[name][0]) + _AXIS_X


def probes(mesh: Mesh) -> tuple[int, int]:
    """Dofs of the force and of the accelerometer of a blade."""
    return probe(mesh, "force"), probe(mesh, "accelerometer")


def _response(solution: ModalSolution) -> RigResponse:
    scene = solution.plan.scene
    choice, arrangement = scene.response, scene.modes.arrangements[0]
    grid = np.linspace(choice.start, choice.stop, choice.points)
    free, body, family = _system_modes(free_set(solution, arrangement), ("right",))
    static, (force, output) = _static(body, family), probes(body.mesh)
    band = (choice.start, choice.stop)
    system = modal_system(free, choice.damping, static=static)
    zeta = choice.damping
    if choice.peak is not None:
        zeta = tune_damping(system, force, [output], choice.peak, band=band).zeta
        system = modal_system(free, zeta, static=static)
    found = frequency_response(system, force, [output], grid)
    curves = {"free": {"right": found.H[:, 0], "left": np.zeros(len(grid), complex)}}
    at, height = peak_response(system, force, [output], band)
    # One number per newton: mode and force of the peak's own mode, if one lies in the band at all.
    inside = bool(((free.frequency >= choice.start) & (free.frequency <= choice.stop)).any())
    nearest = free.shapes[:, int(np.argmin(np.abs(free.frequency - at)))]
    peak = (at, height) if inside else None
    glued = next(
        (s for s in solution.sets if s.arrangement == arrangement and s.kind == "glued"), None
    )
    if glued is not None:
        curves["glued"] = _glued(glued, zeta, grid)
    return RigResponse(
        arrangement,
        grid,
        curves,
        zeta,
        peak,
        1e-3 * abs(float(nearest[force] * nearest[output])),
        _against_full(solution),
    )


def _more_modes(solution: ModalSolution) -> Iterator[Resolved]:
    """Height of the free right blade's peak with the modes up to twice the limit, (m/s2)/N."""
    response, scene = solution.response, solution.plan.scene
    if response is None or response.peak is None:
        return
    _, body, family = _system_modes(free_set(solution, response.arrangement), ("right",))
    held = FAMILIES.get(family, ())
    found = _modes(solution.plan, body, held, MORE_MODES * scene.modes.below)
    shapes = np.zeros((3 * body.mesh.n_node, len(found.frequency)))
    shapes[body.free(held)] = found.shapes * (np.sqrt(0.5) if family else 1.0)
    system = modal_system(
        replace(found, shapes=shapes), response.damping, static=_static(body, family)
    )
    force, output = probes(body.mesh)
    band, of = (scene.response.start, scene.response.stop), q.FREE_PEAK_ACCELERANCE
    height = float(peak_response(system, force, [output], band)[1])
    case, remedy = Case(kind="free", blade="right"), "raise modes.below"
    yield Resolved(MODES_ABOVE, of.name, case, response.peak[1], height, of.unit, remedy)


def _unlocked(solution: ModalSolution) -> Iterator[Resolved]:
    """First free frequency on the same mesh with the incompatible modes that hex8 leaves out."""
    plan = solution.plan
    free = next((s for s in solution.sets if s.kind == "free" and s.modes), None)
    if plan.scene.mesh.element != "hex8" or free is None:
        return
    first, data = free.modes[0], plan.scene.material
    material = Material(data.E, data.nu, data.density)
    K = Symmetric.of(stiffness(first.body.mesh, material, "hex8i"))
    found = _modes(plan, replace(first.body, K=K), FAMILIES.get(first.family, ()), first.frequency)
    lowest, of = float(found.frequency.min(initial=np.inf)), q.F_FREE
    remedy = 'fully integrated hex8 is too stiff in bending: use mesh.element = "hex20" or "hex8i"'
    yield Resolved(
        "shear locking", of.named(1), free.case, first.frequency, lowest, of.unit, remedy
    )


def _glued(found: ModeSet, zeta: float, grid: Array) -> dict[str, NDArray[np.complex128]]:
    own, body, family = _system_modes(found, ("rig",))
    mesh = body.mesh
    outputs = [probe(mesh, f"{side}_accelerometer") for side in ("left", "right")]
    H = frequency_response(
        modal_system(own, zeta, static=_static(body, family)),
        probe(mesh, "right_force"),
        outputs,
        grid,
    ).H
    return {"left": H[:, 0], "right": H[:, 1]}


def _static(body: RigBody, family: str) -> Callable[[Array], Array]:
    """K^-1 f of the whole body on the nodes of the model: what the modes left out contribute.

    Half a model carries half the force.
    """
    free = body.free(FAMILIES.get(family, ()))
    factor, part = factorise(body.K.submatrix(free)), 0.5 if family else 1.0

    def displacement(f: Array) -> Array:
        u = np.zeros(3 * body.mesh.n_node)
        u[free] = factor.solve(part * f[free])
        return u

    return displacement


def _undamped(body: RigBody, free: NDArray[np.int64]) -> Callable[[float], float]:
    """w^2 -> displacement of the accelerometer per unit force, by a direct solve of K - w^2 M."""
    K, M = body.K.submatrix(free), body.M.submatrix(free)
    force, output = np.searchsorted(free, probes(body.mesh))
    f = np.zeros(len(free))
    f[force] = 1.0
    return lambda w2: float(spsolve(whole(combined(K, -w2, M)).tocsc(), f)[output])


def _against_full(solution: ModalSolution) -> dict[float, tuple[float, float]]:
    """Undamped accelerance (m/s2)/N of the right blade off resonance, reduced and by a direct solve
    of the full model, by f / f1.
    """
    one = next((r for r in solution.reductions if r.body.name == "right"), None)
    if one is None:
        return {}
    force, output = (int(at) for at in np.searchsorted(one.free, probes(one.body.mesh)))
    direct = _undamped(one.body, one.free)
    out = {}
    for part in OFF_RESONANCE:
        w2 = (2.0 * np.pi * part * float(one.full[0])) ** 2
        moved = np.linalg.solve(one.model.K - w2 * one.model.M, one.model.at([force])[0])
        out[part] = (-1e-3 * w2 * float(one.model.at([output])[0] @ moved), -1e-3 * w2 * direct(w2))
    return out
