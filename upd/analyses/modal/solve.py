"""Modes, reduction and linear response of the two-blade rig. Arrays in, arrays out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Resolved, keeping
from upd.analyses.modal.plan import MODES_ABOVE, MORE_MODES, ModalPlan, configurations, parameters
from upd.analyses.seated.bodies import Blade, make_blade
from upd.dynamics import (
    ModalSystem,
    frequency_response,
    modal_system,
    peak_response,
    tune_damping,
)
from upd.errors import InputError
from upd.fem import Material, stiffness
from upd.linalg import Modes, factorise, modes
from upd.linalg.parallel import in_parallel
from upd.linalg.symmetric import Symmetric
from upd.mesh import recipes
from upd.progress import Stages
from upd.reduction import ErrorTarget, ReducedModel, craig_bampton
from upd.results import Case, Estimates
from upd.results import quantities as q

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RigMode:
    """One mode: frequency in Hz, its body, its displacement (n_node, 3) on the body's mesh."""

    frequency: float
    body: Blade
    shape: Array


@dataclass
class ModeSet:
    """Modes of one configuration, its case, rising, and the answers of their solver by body and
    mirror family.
    """

    case: Case
    modes: list[RigMode]
    found: list[tuple[Blade, Modes]]


@dataclass(frozen=True)
class ReducedBlade:
    """Craig-Bampton model of one blade, its first frequencies and those of the full blade in Hz."""

    body: Blade
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
    """

    arrangement: str
    frequency: Array
    accelerance: dict[str, dict[str, NDArray[np.complex128]]]
    damping: float
    peak: tuple[float, float] | None
    participation: float


@dataclass
class ModalSolution:
    """All that was solved, for results, arrays and files.

    Attributes
    ----------
    sets
        By arrangement and "free" or "glued".
    left_out
        Numbers solved again with effects left out.
    estimates
        Of its numbers, where the levels were chosen by an accuracy.
    """

    plan: ModalPlan
    sets: dict[tuple[str, str], ModeSet] = field(default_factory=dict)
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
            solution.sets[arrangement, kind] = _mode_set(plan, arrangement, kind, stages)
        if plan.scene.wants("reduction"):
            # on whole bodies, whatever the mirror plane saves elsewhere
            first = plan.scene.modes.arrangements[0]
            with stages("mesh and assembly", f"whole blades, {first}"):
                bodies = _bodies(plan, first, "free", "full")
            names, kept = ", ".join(b.name for b in bodies), plan.scene.reduction.words
            with stages("reduction", f"{names}: {kept} each"):
                jobs = [partial(_reduced, solution, body) for body in bodies]
                solution.reductions = in_parallel(jobs, plan.workers)
        if plan.scene.wants("response"):
            with stages("response", f"{plan.scene.response.points} frequencies"):
                solution.response = _response(solution)
        if plan.scene.left_out.solves:
            with stages("effects left out", "each solved again"):
                solution.left_out += [*_more_modes(solution), *_unlocked(solution)]
    return solution


def _bodies(plan: ModalPlan, arrangement: str, kind: str, symmetry: str) -> list[Blade]:
    """The bodies of a configuration; of halves each in both mirror families."""
    scene = plan.scene
    meshes, _ = recipes.build_mesh(scene.recipe, parameters(scene, arrangement, kind, symmetry))
    material = Material(scene.material.E, scene.material.nu, scene.material.density)
    jobs = [
        partial(make_blade, name, mesh, material, scene.mesh.element, ("x", "y"))
        for name, mesh in meshes.items()
    ]
    return [body for both in in_parallel(jobs, plan.workers) for body in both]


def _mode_set(plan: ModalPlan, arrangement: str, kind: str, stages: Stages) -> ModeSet:
    with stages("mesh and assembly", f"{kind}, {arrangement}"):
        bodies = _bodies(plan, arrangement, kind, plan.symmetry)
    sizes = ", ".join({b.name: f"{b.name} {3 * b.mesh.n_node} dofs" for b in bodies}.values())
    with stages("modes", f"{kind}, {arrangement}: {sizes}"):
        found = in_parallel(
            [partial(_modes, plan, body, plan.scene.modes.below) for body in bodies], plan.workers
        )
    pairs = list(zip(bodies, found, strict=True))
    out = [
        RigMode(float(f), body, body.whole(x).reshape(-1, 3))
        for body, one in pairs
        for f, x in zip(one.frequency, one.shapes.T, strict=True)
    ]
    out.sort(key=lambda m: m.frequency)
    return ModeSet(Case(kind=kind, arrangement=arrangement), out, pairs)


def _modes(plan: ModalPlan, body: Blade, below: float) -> Modes:
    return modes(body.K, body.M, below_hz=below, solver=plan.scene.solver.name)


def _reduced(solution: ModalSolution, body: Blade) -> ReducedBlade:
    """Craig-Bampton of a blade of the first arrangement."""
    scene = solution.plan.scene
    kept = np.concatenate([body.mesh.nodes[name] for name in ("patch", "force", "accelerometer")])
    boundary = body.dofs(np.unique(kept))
    free_modes = solution.sets[scene.modes.arrangements[0], "free"].modes
    full = [m.frequency for m in free_modes if m.body.name == body.name]
    if not full:
        raise InputError(
            f"modes.below: the {body.name} blade has no mode below {scene.modes.below:g} "
            "Hz; raise it"
        )
    choice = scene.reduction
    counted = choice.below is None and choice.error is None
    model = craig_bampton(
        body.K,
        body.M,
        boundary,
        n_modes=choice.count if counted else None,
        below_hz=choice.below,
        target=None if choice.error is None else ErrorTarget(choice.error, len(full)),
        rows=boundary,
        solver=scene.solver.name,
    )
    return ReducedBlade(body, model, model.modes(count=len(full)).frequency, np.array(full))


def _excited(found: ModeSet, name: str) -> tuple[Blade, Modes]:
    """The modes of the named body whose plane y = 0 moves in itself, the only ones a force in that
    plane excites.
    """
    body, mine = next((b, m) for b, m in found.found if b.name == name and b.family != "y")
    if not len(mine.frequency):
        raise InputError(f"modes.below: no mode of {name} below it moves along x; raise it")
    return body, mine


def _system(body: Blade, found: Modes, zeta: float) -> ModalSystem:
    """Modes and statics of the whole rig: half a rig has half the modal mass and carries half the
    force, its shapes are those of the whole times sqrt 2.
    """
    factor, part = factorise(body.K), 0.5 if body.family else 1.0
    whole = replace(found, shapes=found.shapes * np.sqrt(part))
    return modal_system(whole, zeta, static=lambda f: factor.solve(part * f))


def _response(solution: ModalSolution) -> RigResponse:
    scene = solution.plan.scene
    choice, arrangement = scene.response, scene.modes.arrangements[0]
    grid = np.linspace(choice.start, choice.stop, choice.points)
    body, modes_x = _excited(solution.sets[arrangement, "free"], "right")
    force, output = body.probe("force"), body.probe("accelerometer")
    band, zeta = (choice.start, choice.stop), choice.damping
    system = _system(body, modes_x, zeta)
    if choice.peak is not None:
        zeta = tune_damping(system, force, [output], choice.peak, band=band)
        system = replace(system, zeta=np.full_like(system.zeta, zeta))
    found = frequency_response(system, force, [output], grid)
    curves = {"free": {"right": found.H[:, 0], "left": np.zeros(len(grid), complex)}}
    at, height = peak_response(system, force, [output], band)
    # One number per newton: mode and force of the peak's own mode, if one lies in the band at all.
    f = system.frequency
    inside = bool(((f >= choice.start) & (f <= choice.stop)).any())
    nearest = system.shapes[:, int(np.argmin(np.abs(f - at)))]
    peak = (at, height) if inside else None
    glued = solution.sets.get((arrangement, "glued"))
    if glued is not None:
        body, modes_x = _excited(glued, "rig")
        outputs = [body.probe(f"{side}_accelerometer") for side in ("left", "right")]
        system = _system(body, modes_x, zeta)
        H = frequency_response(system, body.probe("right_force"), outputs, grid).H
        curves["glued"] = {"left": H[:, 0], "right": H[:, 1]}
    return RigResponse(
        arrangement,
        grid,
        curves,
        zeta,
        peak,
        1e-3 * abs(float(nearest[force] * nearest[output])),
    )


def _more_modes(solution: ModalSolution) -> Iterator[Resolved]:
    """Height of the free right blade's peak with the modes up to twice the limit, (m/s2)/N."""
    response, scene = solution.response, solution.plan.scene
    if response is None or response.peak is None:
        return
    body, _ = _excited(solution.sets[response.arrangement, "free"], "right")
    found = _modes(solution.plan, body, MORE_MODES * scene.modes.below)
    system = _system(body, found, response.damping)
    force, output = body.probe("force"), body.probe("accelerometer")
    band, of = (scene.response.start, scene.response.stop), q.FREE_PEAK_ACCELERANCE
    height = float(peak_response(system, force, [output], band)[1])
    case, remedy = Case(kind="free", blade="right"), "raise modes.below"
    yield Resolved(MODES_ABOVE, of.name, case, response.peak[1], height, of.unit, remedy)


def _unlocked(solution: ModalSolution) -> Iterator[Resolved]:
    """First free frequency on the same mesh with the incompatible modes that hex8 leaves out."""
    plan = solution.plan
    free = next((s for s in solution.sets.values() if s.case.kind == "free" and s.modes), None)
    if plan.scene.mesh.element != "hex8" or free is None:
        return
    first, data = free.modes[0], plan.scene.material
    material = Material(data.E, data.nu, data.density)
    K = Symmetric.of(stiffness(first.body.mesh, material, "hex8i")).submatrix(first.body.free)
    found = _modes(plan, replace(first.body, K=K), first.frequency)
    lowest, of = float(found.frequency.min(initial=np.inf)), q.F_FREE
    remedy = 'fully integrated hex8 is too stiff in bending: use mesh.element = "hex20" or "hex8i"'
    yield Resolved(
        "shear locking", of.named(1), free.case, first.frequency, lowest, of.unit, remedy
    )
