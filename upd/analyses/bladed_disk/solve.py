"""Modes by nodal diameter and speed, and where engine orders cross them. Arrays in, arrays out."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.sparse import csr_array

from upd.analyses.base import Resolved, keeping
from upd.analyses.bladed_disk.plan import (
    CORIOLIS,
    DISPLACED,
    BladedDiskPlan,
    computed,
    damped,
    rotates,
)
from upd.analyses.bladed_disk.response import (
    WavePerformance,
    Wedge,
    on_sector,
    other_start,
    performance,
    wave_response,
)
from upd.errors import InputError, MeshError
from upd.fem import Material, mass, stiffness
from upd.fem.inertia import (
    centrifugal_load,
    coriolis,
    displaced_stiffness,
    plane_mass,
    stress_stiffness,
)
from upd.hbm import FrequencyResponse, nodal_diameters
from upd.linalg.parallel import in_parallel
from upd.linalg.select import threads
from upd.mesh import recipes
from upd.progress import Stages
from upd.reduction.cyclic import (
    CyclicModel,
    ModeFamily,
    ReducedSector,
    Sector,
    reduce_sector,
    with_coriolis,
)
from upd.results import Case
from upd.results import quantities as q
from upd.scene import BladedDiskScene

Array = NDArray[np.float64]


class Crossing(NamedTuple):
    """Where an engine order meets a mode.

    Attributes
    ----------
    engine_order, nodal_diameter, mode : int
    speed : float
        rad/s.
    frequency : float
        Hz.
    """

    engine_order: int
    nodal_diameter: int
    mode: int
    speed: float
    frequency: float


class DampedWave(NamedTuple):
    """Response at a crossing.

    Attributes
    ----------
    crossing : Crossing
    sectors : dict
        Nodal diameter -> reduced sector.
    f_c : float
        N.
    frequency : (k,) ndarray
        Hz.
    free, stuck : (k,) ndarray
        Linear amplitudes at the tip, mm.
    answer : FrequencyResponse
    damped : (n,) ndarray
        Amplitudes at its frequencies, mm.
    peak : (2,) tuple
        Hz and mm.
    fewer_harmonics, other_start : float
        The peak with two harmonics less and with another start of the sliders, mm; nan where not
        solved.
    performance : WavePerformance or None
    """

    crossing: Crossing
    sectors: dict[int, ReducedSector]
    f_c: float
    frequency: Array
    free: Array
    stuck: Array
    answer: FrequencyResponse
    damped: Array
    peak: tuple[float, float]
    fewer_harmonics: float
    other_start: float
    performance: WavePerformance | None


@dataclass
class BladedDiskSolution:
    """All that was solved, for results, arrays and files.

    Attributes
    ----------
    sector : Sector or None
    at_rest, at_speed : (N/2 + 1, m) ndarray
        Frequencies by nodal diameter, at the operating speed too, Hz.
    speeds : (k,) ndarray
        rad/s.
    campbell : (N/2 + 1, k, m) ndarray
        Hz.
    crossings : list
        The nearest to the operating speed first.
    proof : tuple or None
        A nodal diameter between the computed ones, the largest speed in rad/s, and (m,) frequencies
        there in Hz: in the span of the computed ones, and solved by itself.
    left_out : list
        Its numbers solved again with effects left out.
    wave : DampedWave or None
    """

    plan: BladedDiskPlan
    sector: Sector | None = None
    at_rest: Array = field(default_factory=lambda: np.empty((0, 0)))
    at_speed: Array = field(default_factory=lambda: np.empty((0, 0)))
    speeds: Array = field(default_factory=lambda: np.empty(0))
    campbell: Array = field(default_factory=lambda: np.empty((0, 0, 0)))
    crossings: list[Crossing] = field(default_factory=list)
    proof: tuple[int, float, Array, Array] | None = None
    left_out: list[Resolved] = field(default_factory=list)
    wave: DampedWave | None = None


def solve(plan: BladedDiskPlan, stages: Stages) -> BladedDiskSolution:
    """Run everything the plan calls for.

    An error raised on the way carries what converged so far as ``partial``.
    """
    solution = BladedDiskSolution(plan)
    with keeping(solution):
        _solve(solution, stages)
    return solution


def _solve(solution: BladedDiskSolution, stages: Stages) -> None:
    plan, scene = solution.plan, solution.plan.scene
    spin, count = scene.rotation, scene.modes.count
    with stages("mesh", f"{scene.recipe}, 1 of {scene.n_sectors} sectors"):
        sector = solution.sector = _sector(plan)
    with stages("matrices", f"{3 * sector.mesh.n_node} dofs"):
        mesh, material, element = sector.mesh, _material(plan), scene.mesh.element
        K, M = stiffness(mesh, material, element), mass(mesh, material, element)
        model = CyclicModel.of(sector, K, M)
    u = np.zeros(3 * mesh.n_node)
    if rotates(scene):
        with stages("prestress", "static state at nodal diameter 0"):
            u = model.static(centrifugal_load(mesh, M))
            stress = stress_stiffness(mesh, material, u, element)
            model = CyclicModel.of(sector, K, M, csr_array(stress - plane_mass(M)))
    known = computed(scene)
    with stages("modes", f"nodal diameters {', '.join(map(str, known))}"):
        family = ModeFamily.of(model, known, count + 2, plan.workers)
        solution.at_rest = _by_diameter(family, model, count, 0.0)
    if not rotates(scene):
        return
    with stages("speeds", f"{spin.points}, and crossings of {len(spin.engine_orders)} orders"):
        solution.at_speed = _by_diameter(family, model, count, spin.speed)
        solution.speeds = np.linspace(0.0, spin.up_to * spin.speed, spin.points)
        rows = [_by_diameter(family, model, count, float(w)) for w in solution.speeds]
        solution.campbell = np.stack(rows, axis=1)
        solution.crossings = _crossings(solution, family)
    if damped(scene):
        solution.wave = _damped_wave(solution, model, family, stages)
    if scene.left_out.solves:
        with stages("effects left out", "one nodal diameter solved by itself"):
            _prove(solution, model, family, (K, M), u)


def _sector(plan: BladedDiskPlan) -> Sector:
    meshes, _ = recipes.build_mesh(plan.scene.recipe, plan.parameters)
    if len(meshes) != 1:
        raise MeshError(
            f"a sector is one body, the mesh has {len(meshes)}: {', '.join(meshes)}; glue them."
        )
    return Sector.of(next(iter(meshes.values())), plan.scene.n_sectors)


def _material(plan: BladedDiskPlan) -> Material:
    given = plan.scene.material
    return Material(given.E, given.nu, given.density)


def _by_diameter(family: ModeFamily, model: CyclicModel, count: int, speed: float) -> Array:
    """(N/2 + 1, m) frequencies, Hz."""
    return np.array([family.frequencies(n, count, speed) for n in model.nodal_diameters])


def _crossings(solution: BladedDiskSolution, family: ModeFamily) -> list[Crossing]:
    """All up to the largest speed, the nearest to the operating speed first."""
    scene, speeds = solution.plan.scene, solution.speeds
    count, found = scene.modes.count, []

    def above(w: float, n: int, mode: int, order: int) -> float:
        return float(family.frequencies(n, count, w)[mode] - order * w / (2.0 * np.pi))

    for order in scene.rotation.engine_orders:
        n = min(order % scene.n_sectors, -order % scene.n_sectors)
        for mode in range(count):
            over = solution.campbell[n, :, mode] - order * speeds / (2.0 * np.pi)
            for k in np.flatnonzero((over[:-1] > 0.0) & (over[1:] <= 0.0)):
                w = float(brentq(above, speeds[k], speeds[k + 1], args=(n, mode, order)))
                f = float(order * w / (2.0 * np.pi))
                found.append(Crossing(order, n, mode + 1, w, f))
    return sorted(found, key=lambda c: abs(c.speed - scene.rotation.speed))


def _prove(
    solution: BladedDiskSolution,
    model: CyclicModel,
    family: ModeFamily,
    matrices: tuple[csr_array, csr_array],
    u: Array,
) -> None:
    """The nodal diameter farthest from the computed ones, at the largest speed: solved by itself,
    with the stiffness of the displaced state, with the Coriolis force.
    """
    scene, sector, (K, M) = solution.plan.scene, model.sector, matrices
    known, count = np.array(computed(scene)), scene.modes.count
    n = max(model.nodal_diameters, key=lambda n: int(np.abs(known - n).min()))
    speed = float(solution.speeds[-1])
    found = model.modes(n, count, speed)
    f, U = found.frequency, sector.field(found.shapes, n)
    solution.proof = n, speed, family.frequencies(n, count, speed), f
    moved = displaced_stiffness(
        sector.mesh, _material(solution.plan), speed**2 * u, scene.mesh.element
    )
    # in the span of the modes
    more = U.conj().T @ ((moved - K) @ U)
    value = np.linalg.eigvalsh(np.diag((2.0 * np.pi * f) ** 2) + more)
    # of both waves the frequency farther from that without the force
    one, other = with_coriolis(f, U, coriolis(M), speed)
    changed = {
        DISPLACED: (np.sqrt(value) / (2.0 * np.pi), "use another program for the last digits"),
        CORIOLIS: (
            np.where(np.abs(one - f) > np.abs(other - f), one, other),
            "both travelling waves differ: see each in the check",
        ),
    }
    for name, (included, remedy) in changed.items():
        k = int(np.abs(included / f - 1.0).argmax())
        of, case = q.F_SPINNING.named(k + 1), Case(nodal_diameter=n)
        numbers = float(f[k]), float(included[k])
        solution.left_out.append(Resolved(name, of, case, *numbers, "Hz", remedy))


def _damped_wave(
    solution: BladedDiskSolution, model: CyclicModel, family: ModeFamily, stages: Stages
) -> DampedWave:
    """Free, stuck and damped response at the crossing nearest to the operating speed."""
    scene, chosen = solution.plan.scene, solution.plan.scene.response
    if not solution.crossings:
        raise InputError(
            "rotation.engine_orders: none crosses a mode up to the largest speed, so there is no "
            "resonance to damp; raise rotation.up_to or name others"
        )
    crossing = solution.crossings[0]
    mesh, harmonics = model.sector.mesh, range(chosen.harmonics + 1)
    tip = mesh.nodes.get("tip", np.empty(0, np.int64))[:1]
    if not len(tip):
        raise MeshError("the mesh has no node set tip, where the blade is excited: name one node.")
    # C = beta K has the ratio asked for at the crossing
    beta = 2.0 * chosen.damping / (2.0 * np.pi * crossing.frequency)
    needed = nodal_diameters(scene.n_sectors, crossing.engine_order, harmonics)
    with stages("reduction", f"nodal diameters {', '.join(map(str, needed))}"):
        jobs = [
            partial(
                reduce_sector,
                model,
                n,
                n_modes=chosen.modes,
                keep={"tip": tip},
                speed=crossing.speed,
                damping=(0.0, beta),
                full=family.frequencies(n, scene.modes.count, crossing.speed),
            )
            for n in needed
        ]
        sectors = dict(zip(needed, in_parallel(jobs, solution.plan.workers), strict=True))
    one = sectors[crossing.nodal_diameter]
    x, y, _ = mesh.points[tip[0]]
    row = np.array([-y, x, 0.0]) / np.hypot(x, y) @ one.rows["tip"]
    wedge = _wedge(scene, one)
    f_c = wedge.mass * wedge.radius * crossing.speed**2
    low = 0.97 * crossing.frequency
    solved = partial(wave_response, sectors, wedge, f_c, engine_order=crossing.engine_order)
    with stages("response", f"EO {crossing.engine_order}, {chosen.points} frequencies"):
        force, out = chosen.force * row, on_sector(row)
        probe = solved(force=force, frequencies=[low], harmonics=harmonics)
        wide = np.linspace(low, 2.0 * low, 4001)
        top = float(wide[probe.stuck(out, wide).argmax()])
        frequencies = np.linspace(low, 1.03 * top, chosen.points)
        curve_of = partial(solved, frequencies=frequencies, harmonics=harmonics)
        curves = [partial(curve_of, force=force)]
        if chosen.harmonics > 2:
            curves.append(partial(curves[0], harmonics=harmonics[:-2]))
        answer, *less = in_parallel(curves, threads())
        fine = np.linspace(low, frequencies[-1], 2001)
        free, stuck = answer.free(out, fine), answer.stuck(out, fine)
        amplitude, peak = np.asarray(answer.amplitude(out)), answer.peak(out)
        fewer = less[0].peak(out)[1] if less else float("nan")
        started = other_start(answer, out)
    curve = None
    if scene.wants("performance"):
        with stages("performance", f"{len(chosen.ratios)} ratios F_C/F_E"):
            found = performance(curve_of, f_c, chosen.ratios, row, row)
            # the response is a point of it
            own = f_c / chosen.force, peak[0], peak[1] / chosen.force
            points = np.column_stack([found, own])
            curve = WavePerformance(*points[:, points[0].argsort()])
    return DampedWave(
        crossing, sectors, f_c, fine, free, stuck, answer, amplitude, peak, fewer, started, curve
    )


def _wedge(scene: BladedDiskScene, sector: ReducedSector) -> Wedge:
    """The wedge with the inertia of a box between both patches."""
    given, places = scene.damper, np.vstack([sector.high, sector.low])
    r = np.hypot(places[:, 0], places[:, 1])
    sides = np.array(
        [
            np.ptp(r),
            np.linalg.norm(sector.high.mean(axis=0) - sector.low.mean(axis=0)),
            np.ptp(places[:, 2]),
        ]
    )
    squares = given.mass / 12.0 * sides**2
    return Wedge(
        given.mass,
        squares.sum() - squares,
        float(r.mean()),
        given.angle,
        given.normal_stiffness,
        given.tangential_stiffness,
        given.friction,
        given.axial_stiffness,
    )
