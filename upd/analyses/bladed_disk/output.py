"""What the analysis of a bladed disk leaves behind: numbers, checks, arrays."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from upd.analyses.base import conditions
from upd.analyses.bladed_disk.solve import BladedDiskSolution, Crossing, DampedWave
from upd.hbm.springs.checks import creep
from upd.results import NO_CASE, Case, Check, ErrorPart, Estimates, Group, Result, variable
from upd.results import quantities as q
from upd.scene import BladedDiskScene

#: what the groups of result.nc hold, their attribute ``content``
BY_DIAMETER, CAMPBELL, CROSSINGS = "nodal diameters", "campbell", "crossings"
WAVE, PERFORMANCE = "travelling wave", "wave performance"
#: change of contact forces from 40 to 80 periods of slip, relative
CREEP = 0.01
HEADLINE = (
    "crossing_speed",
    "crossing_frequency",
    "crossing_margin",
    "free_amplitude",
    "stuck_amplitude",
    "damped_amplitude",
    "damped_frequency",
    "amplitude_reduction",
    "best_damper_mass",
    "best_mass_amplitude",
    "start_change",
    "force_creep",
    "f1",
)
#: largest error of a frequency in the span of the computed nodal diameters
PROJECTION_LIMIT = 1e-3
_RPM = 60.0 / (2.0 * np.pi)


def estimate(solution: BladedDiskSolution, results: Sequence[Result]) -> Estimates:
    """Of the damped peak, what two harmonics less change."""
    wave = solution.wave
    if wave is None:
        return {}
    H, change = solution.plan.scene.response.harmonics, abs(wave.fewer_harmonics / wave.peak[1] - 1)
    basis = f"change from {H - 2} to {H}" if np.isfinite(change) else "needs 3 harmonics or more"
    part = ErrorPart("harmonics", float(change), basis)
    of = [one for one in results if one.name == q.WAVE_DAMPED.name]
    return {(one.name, one.case): (part,) for one in of}


def make_results(solution: BladedDiskSolution) -> list[Result]:
    """All numbers of a run."""
    scene, results = solution.plan.scene, list[Result]()
    # of the damped response without a Campbell diagram, its own
    most = None if scene.wants("campbell") else int(solution.wave is not None)
    for c in solution.crossings[:most]:
        case = _at(c)
        margin = c.speed / scene.rotation.speed - 1.0
        results += [
            q.CROSSING_SPEED.of(c.speed * _RPM, case),
            q.CROSSING_FREQUENCY.of(c.frequency, case),
            q.CROSSING_MARGIN.of(margin, case),
        ]
    if scene.wants("campbell") and not solution.crossings:
        reason = "no engine order crosses a mode up to the largest speed; raise rotation.up_to"
        results.append(q.CROSSING_SPEED.withheld(NO_CASE, reason))
    if solution.wave is not None:
        results += _wave_results(solution.wave, scene)
    wanted = [
        ("modes", q.F_SECTOR, solution.at_rest),
        ("interference", q.F_SPINNING, solution.at_speed),
    ]
    return results + [
        quantity.of(f, Case(nodal_diameter=n), n=k, exact=False)
        for want, quantity, rows in wanted
        if scene.wants(want)
        for n, row in enumerate(rows)
        for k, f in enumerate(row, 1)
    ]


def _wave_results(wave: DampedWave, scene: BladedDiskScene) -> list[Result]:
    """Peaks at the tip and the best mass."""
    case, curve = _at(wave.crossing), wave.performance
    free, crept = float(wave.free.max()), float(creep(wave.answer.balance, wave.answer.x).max())
    # the axial motion of the wedge is the third of its last six
    walked = float(abs(wave.answer.coefficients[wave.damped.argmax(), -4, 0]))
    results = [
        q.WAVE_FREE.of(free, case),
        q.WAVE_STUCK.of(float(wave.stuck.max()), case),
        q.WAVE_DAMPED.of(wave.peak[1], case),
        q.WAVE_FREQUENCY.of(wave.peak[0], case),
        q.WAVE_REDUCTION.of(1.0 - wave.peak[1] / free, case),
        q.WAVE_CENTRIFUGAL.of(wave.f_c, case),
        q.WAVE_AXIAL.of(scene.damper.axial_stiffness * walked, case),
        q.WAVE_START.of(abs(wave.other_start / wave.peak[1] - 1.0), case)
        if np.isfinite(wave.other_start)
        else q.WAVE_START.withheld(case, "leads to no peak near by"),
        q.WAVE_CREEP.of(crept, case),
    ]
    if curve is not None and curve.inside:
        (ratio, height), force = curve.best, scene.response.force
        mass = scene.damper.mass * ratio * force / wave.f_c
        results += [q.BEST_MASS.of(mass, case), q.BEST_MASS_PEAK.of(height * force, case)]
    elif curve is not None:
        reason = "the lowest peak is at an end of response.ratios; give others beyond it"
        results.append(q.BEST_MASS.withheld(case, reason))
    return results


def _at(c: Crossing) -> Case:
    return Case(engine_order=c.engine_order, nodal_diameter=c.nodal_diameter, mode=f"mode {c.mode}")


def check_solution(solution: BladedDiskSolution) -> list[Check]:
    """Frequencies solved by themselves, and with what the model leaves out."""
    scene, wave = solution.plan.scene, solution.wave
    reduced: list[Check] = []
    if wave is not None:
        errors = [one.frequency_error for one in wave.sectors.values()]
        answer = wave.answer
        rows = (
            ("reduced sectors", np.max(errors), PROJECTION_LIMIT, "|reduced / full - 1|"),
            ("energy balance", abs(answer.energy_balance).max(), 1e-3, "|power in / lost - 1|"),
            ("path complete", not answer.arrived, 0, "whether the damped curve stopped early"),
            ("contact settled", creep(answer.balance, answer.x).max(), CREEP, "over 40 periods"),
        )
        reduced = conditions(NO_CASE, "raise response.modes or response.harmonics", *rows)
        # what omitted harmonics change is an estimated error of the peak, where it is known
        lacking = max(0.0, 3.0 - scene.response.harmonics)
        few = "omitted harmonics", lacking, 0, "harmonics lacking to know their effect on the peak"
        reduced += conditions(NO_CASE, "take response.harmonics = 3 or more", few, fatal=False)
    checks = [one.check(scene.left_out) for one in solution.left_out] + reduced
    if solution.proof is None:
        return checks
    n, speed, projected, direct = solution.proof
    error = float(np.abs(projected / direct - 1.0).max())
    compared = f"|in the span of others / by itself - 1| at {speed * _RPM:.5g} rpm"
    between = "nodal diameters in between", error, PROJECTION_LIMIT, compared
    remedy = "compute more nodal diameters: raise modes.computed"
    return conditions(Case(nodal_diameter=n), remedy, between) + checks


def arrays(solution: BladedDiskSolution) -> dict[str, Group]:
    """Frequencies by nodal diameter, at rest and at speed; over the speed; crossings."""
    scene, out = solution.plan.scene, dict[str, Group]()
    speed = variable("", scene.rotation.speed * _RPM, "rpm")
    numbers = variable("nodal_diameter", np.arange(len(solution.at_rest)))
    sectors = variable("", scene.n_sectors)
    orders = variable("engine_order", np.array(scene.rotation.engine_orders))
    dims = "nodal_diameter mode"
    if scene.wants("modes"):
        rest = {"nodal_diameter": numbers, "frequency": variable(dims, solution.at_rest, "Hz")}
        out["at rest"] = Group(rest, content=BY_DIAMETER, case=Case(name="at rest"))
    if scene.wants("interference"):
        at = {"nodal_diameter": numbers, "frequency": variable(dims, solution.at_speed, "Hz")}
        at |= {"speed": speed, "engine_order": orders, "sectors": sectors}
        out["at speed"] = Group(at, content=BY_DIAMETER, case=Case(name="at speed"))
    if scene.wants("campbell"):
        over = {
            "speed": variable("speed", solution.speeds * _RPM, "rpm"),
            "frequency": variable("nodal_diameter speed mode", solution.campbell, "Hz"),
            "operating_speed": speed,
            "engine_order": orders,
            "sectors": sectors,
        }
        out["campbell"] = Group(over, content=CAMPBELL)
        if solution.crossings:
            table = np.array(solution.crossings)
            columns = {
                name: variable("crossing", table[:, k].astype(int))
                for k, name in enumerate(("engine_order", "nodal_diameter", "mode"))
            }
            columns["speed"] = variable("crossing", table[:, 3] * _RPM, "rpm")
            columns["frequency"] = variable("crossing", table[:, 4], "Hz")
            out["crossings"] = Group(columns, content=CROSSINGS)
    return out | ({} if solution.wave is None else _wave_arrays(solution.wave))


def _wave_arrays(wave: DampedWave) -> dict[str, Group]:
    case = _at(wave.crossing)
    curves = {
        "frequency": variable("frequency", wave.frequency, "Hz"),
        "free": variable("frequency", 1e3 * wave.free, "um"),
        "stuck": variable("frequency", 1e3 * wave.stuck, "um"),
        "damped_frequency": variable("point", wave.answer.frequency, "Hz"),
        "damped": variable("point", 1e3 * wave.damped, "um"),
    }
    out = {"travelling wave": Group(curves, content=WAVE, case=case)}
    if wave.performance is not None:
        over = {
            "ratio": variable("ratio", wave.performance.ratio),
            "height": variable("ratio", 1e3 * wave.performance.height, "um/N"),
        }
        out["wave performance"] = Group(over, content=PERFORMANCE, case=case)
    return out


def write_files(solution: BladedDiskSolution, folder: Path) -> None:
    """The mesh of the sector."""
    if solution.sector is not None:
        # meshio is slow to import
        from upd.mesh.export import write_mesh

        write_mesh({"sector": solution.sector.mesh}, folder / "mesh.vtu")
