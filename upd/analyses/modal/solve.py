"""Modes, reduction and linear response of the two-blade rig. Arrays in, arrays out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Resolved, keeping
from upd.analyses.modal.plan import MODES_ABOVE, MORE_MODES, ModalPlan, configurations, parameters
from upd.analyses.seated.bodies import Blade, make_blade
from upd.dynamics import (
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
    """Modes of one configuration, rising, and the answers of their solver by body and mirror
    family.
    """

    arrangement: str
    kind: str
    modes: list[RigMode]
    found: list[tuple[Blade, Modes]]

    @property
    def case(self) -> Case:
        """The configuration."""
        return Case(kind=self.kind, arrangement=self.arrangement)


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
    return ModeSet(arrangement, kind, out, pairs)


def _modes(plan: ModalPlan, body: Blade, below: float) -> Modes:
    return modes(body.K, body.M, below_hz=below, solver=plan.scene.solver.name)


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


def _reduced(solution: ModalSolution, body: Blade) -> ReducedBlade:
    scene = solution.plan.scene
    kept = np.concatenate([body.mesh.nodes[name] for name in ("patch", "force", "accelerometer")])
    boundary = body.dofs(np.unique(kept))
    free_modes = free_set(solution, scene.modes.arrangements[0]).modes
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


def free_set(solution: ModalSolution, arrangement: str) -> ModeSet:
    """The modes of the blades without a damper."""
    return next(s for s in solution.sets if s.arrangement == arrangement and s.kind == "free")


def _system_modes(found: ModeSet, name: str) -> tuple[Modes, Blade]:
    """The modes of the named body whose plane y = 0 moves in itself, the only ones a force in that
    plane excites.
    """
    body, mine = next((b, m) for b, m in found.found if b.name == name and b.family != "y")
    if not len(mine.frequency):
        raise InputError(f"modes.below: no mode of {name} below it moves along x; raise it")
    return _on_rig(body, mine), body


def _on_rig(body: Blade, found: Modes) -> Modes:
    """Modes of the whole rig: half a rig has half the modal mass, its shapes are those of the whole
    times sqrt 2.
    """
    return replace(found, shapes=found.shapes * (np.sqrt(0.5) if body.family else 1.0))


def _response(solution: ModalSolution) -> RigResponse:
    scene = solution.plan.scene
    choice, arrangement = scene.response, scene.modes.arrangements[0]
    grid = np.linspace(choice.start, choice.stop, choice.points)
    free, body = _system_modes(free_set(solution, arrangement), "right")
    static, force, output = _static(body), body.probe("force"), body.probe("accelerometer")
    band = (choice.start, choice.stop)
    system = modal_system(free, choice.damping, static=static)
    zeta = choice.damping
    if choice.peak is not None:
        zeta = tune_damping(system, force, [output], choice.peak, band=band)
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
    )


def _more_modes(solution: ModalSolution) -> Iterator[Resolved]:
    """Height of the free right blade's peak with the modes up to twice the limit, (m/s2)/N."""
    response, scene = solution.response, solution.plan.scene
    if response is None or response.peak is None:
        return
    _, body = _system_modes(free_set(solution, response.arrangement), "right")
    found = _on_rig(body, _modes(solution.plan, body, MORE_MODES * scene.modes.below))
    system = modal_system(found, response.damping, static=_static(body))
    force, output = body.probe("force"), body.probe("accelerometer")
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
    K = Symmetric.of(stiffness(first.body.mesh, material, "hex8i")).submatrix(first.body.free)
    found = _modes(plan, replace(first.body, K=K), first.frequency)
    lowest, of = float(found.frequency.min(initial=np.inf)), q.F_FREE
    remedy = 'fully integrated hex8 is too stiff in bending: use mesh.element = "hex20" or "hex8i"'
    yield Resolved(
        "shear locking", of.named(1), free.case, first.frequency, lowest, of.unit, remedy
    )


def _glued(found: ModeSet, zeta: float, grid: Array) -> dict[str, NDArray[np.complex128]]:
    own, body = _system_modes(found, "rig")
    outputs = [body.probe(f"{side}_accelerometer") for side in ("left", "right")]
    H = frequency_response(
        modal_system(own, zeta, static=_static(body)),
        body.probe("right_force"),
        outputs,
        grid,
    ).H
    return {"left": H[:, 0], "right": H[:, 1]}


def _static(body: Blade) -> Callable[[Array], Array]:
    """K^-1 f of the whole body: what the modes left out contribute. Half a model carries half the
    force.
    """
    factor, part = factorise(body.K), 0.5 if body.family else 1.0
    return lambda f: factor.solve(part * f)
