"""ModalSolution -> the flat list of numbers, beside the frequencies printed for the rig.

Self-checks: every mode's residual and orthogonality, none missed, the reduction's error,
effects omitted.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from upd.analyses.base import printed_of, with_printed
from upd.analyses.measured import FREE, Computed, CurvePeak, fit_checks, measured_results
from upd.analyses.modal.solve import (
    ModalSolution,
    ModeSet,
    ReducedBlade,
    RigResponse,
)
from upd.analyses.seated.bodies import Blade
from upd.dynamics import find_peaks
from upd.linalg import Modes
from upd.linalg.eigen import RESIDUAL_LIMIT
from upd.measured.compare import on_path
from upd.results import Case, Check, Result
from upd.results import quantities as q
from upd.scene.measured import MeasuredChoice

#: the numbers that matter, most important first (shell patterns): terminal, page, notebook, tables
#: of sweeps and studies
HEADLINE = (
    "f?_free",
    "f?_glued",
    "f?_reduced",
    "peak_frequency",
    "peak_accelerance",
)
REDUCED = Case(name="Craig-Bampton")
_KEEP = "keep more fixed-interface modes: raise reduction.modes"


def make_results(solution: ModalSolution) -> list[Result]:
    """All numbers of a run."""
    results = [one for found in solution.sets.values() for one in mode_results(solution, found)]
    if solution.reductions:
        results += _reduction_results(solution.reductions)
    if solution.response is not None:
        results += _response_results(solution.response)
        results += _beside_measured(solution, solution.response)
    return results


def mode_results(solution: ModalSolution, found: ModeSet) -> list[Result]:
    """Frequencies of one configuration, lowest first, with what was printed of them."""
    if not found.modes:
        below = solution.plan.scene.modes.below
        reason = f"no mode lies below modes.below = {below:g} Hz; raise it"
        return [q.NATURAL[found.case.kind].withheld(found.case, reason, n=1)]
    modes = [
        q.NATURAL[found.case.kind].of(mode.frequency, found.case, n=k, exact=False)
        for k, mode in enumerate(found.modes, 1)
    ]
    return with_printed(modes, printed_of(solution.plan.scene))


def _reduction_results(reductions: Sequence[ReducedBlade]) -> list[Result]:
    """Frequencies of the reduced blades beside those of the full ones, lowest first."""
    pairs = sorted(pair for r in reductions for pair in zip(r.full, r.frequency, strict=True))
    return [
        q.REDUCTION_MODES.of(sum(r.model.n_modes for r in reductions), REDUCED),
        q.REDUCTION_BOUNDARY.of(sum(len(r.model.boundary) for r in reductions), REDUCED),
        *(
            q.F_REDUCED.of(f, REDUCED, full, "full model", n=k)
            for k, (full, f) in enumerate(pairs, 1)
        ),
    ]


def _response_results(response: RigResponse) -> list[Result]:
    case = Case(kind="free", blade="right")
    results = [q.DAMPING.of(response.damping, case)]
    if response.peak is None:
        reason = (
            "the free right blade has no mode between response.start and response.stop; widen them"
        )
        peak = (q.FREE_PEAK_FREQUENCY, q.FREE_PEAK_ACCELERANCE)
        results += [quantity.withheld(case, reason) for quantity in peak]
    else:
        at, height = response.peak
        alone = response.participation / (2.0 * response.damping)
        results += [
            q.FREE_PEAK_FREQUENCY.of(at, case),
            q.FREE_PEAK_ACCELERANCE.of(height, case, alone, "phi phi / (2 zeta), one mode"),
            q.PARTICIPATION.of(response.participation, case),
        ]
    return results


def _beside_measured(solution: ModalSolution, response: RigResponse) -> list[Result]:
    """The measured curves beside the free and the glued response."""

    def computed(choice: MeasuredChoice) -> list[Computed]:
        curves = response.accelerance.get("free" if choice.state == FREE else "glued", {})
        H, f = curves.get(choice.blade), response.frequency
        if H is None or not H.any():
            return []
        found = find_peaks(f, np.abs(H))
        peaks = [
            CurvePeak(float(at), float(height), int(np.abs(f - at).argmin()), k)
            for k, (at, height) in enumerate(zip(found.frequency, found.height, strict=True), 1)
        ]
        case = Case(kind=choice.state or "", blade=choice.blade)
        band = (float(f[0]), float(f[-1]))
        return [Computed(case, band, lambda at: on_path(at, f, H), peaks)]

    def missing(choice: MeasuredChoice) -> str:
        if choice.state == FREE:
            return f"the {choice.blade} blade is at rest without the damper"
        return 'the run has no response with the damper glued; add "glued" to want'

    return measured_results(solution.plan.scene.measured, computed, missing, response.damping)


# -- self-checks -----------------------------------------------------------------------------------


def check_solution(solution: ModalSolution) -> list[Check]:
    """All self-checks."""
    checks = [check for found in solution.sets.values() for check in _modes_checks(found)]
    for r in solution.reductions:
        off = float(np.abs(r.frequency / r.full - 1.0).max())
        case, what = Case(body=r.body.name), "|f reduced / f full - 1|"
        checks.append(Check("reduced frequencies", case, off, 0.02, what, _KEEP, fatal=False))
    if solution.response is not None:
        checks += fit_checks(solution.plan.scene.measured)
    return checks + [one.check(solution.plan.scene.left_out) for one in solution.left_out]


def _modes_checks(found: ModeSet) -> list[Check]:
    """Residual and orthogonality of the modes as they are written, from K and M; none missed."""
    case, report = found.case, "report this mesh"
    families = [_family(found, body, m) for body, m in found.found]
    residual, off = (max(worst, default=0.0) for worst in zip(*families, strict=True))
    statement = "||K x - lambda M x|| / ||lambda M x|| beyond rounding"
    searches = [(f"{body.name} {body.family}".strip(), m) for body, m in found.found]
    return [
        Check("mode residual", case, residual, RESIDUAL_LIMIT, statement, report),
        Check("orthogonality", case, off, 1e-8, "largest |X'MX - 1|", report),
        no_mode_missed(case, searches),
    ]


def no_mode_missed(case: Case, found: Sequence[tuple[str, Modes]]) -> Check:
    """Modes counted and not found, summed over the bodies and mirror families (name, modes).

    One for each search that could not show it. Says how each was shown.
    """
    return Check(
        "no mode missed",
        case,
        sum(m.missed for _, m in found),
        0,
        "modes missing: " + "; ".join(f"{name}: {m.shown}" for name, m in found),
        "; ".join(f"{name}: {m.message}" for name, m in found if m.missed),
        fatal=False,
    )


def _family(found: ModeSet, body: Blade, solved: Modes) -> tuple[float, float]:
    """Largest residual beyond rounding and largest off-orthogonality of one body's modes."""
    mine = [m for m in found.modes if m.body is body]
    if not mine:
        return 0.0, 0.0
    X = np.column_stack([m.shape.ravel()[body.free] for m in mine])
    KX, MX = body.K @ X, body.M @ X
    inertia = (2.0 * np.pi * np.array([m.frequency for m in mine])) ** 2 * MX
    size = np.linalg.norm(inertia, axis=0)
    residual = np.linalg.norm(KX - inertia, axis=0) / np.where(size > 0.0, size, 1.0)
    # Modes are listed by frequency, as their solver gives them.
    beyond = residual - np.asarray(solved.rounding)[: len(mine)]
    return float(beyond.max()), float(np.abs(X.T @ MX - np.eye(len(mine))).max())
