"""Self-checks of a rig.

Every mode's residual and orthogonality, none missed, the band, the reduction's upper bound,
locking.
"""

from __future__ import annotations

from upd.analyses.modal.solve import ModalSolution, ModeSet, ReducedBlade
from upd.linalg.eigen import RESIDUAL_LIMIT
from upd.results import NO_CASE, Case, Check


def check_solution(solution: ModalSolution) -> list[Check]:
    """All self-checks."""
    scene = solution.plan.scene
    checks = [check for found in solution.sets for check in _modes_checks(found)]
    checks += [_band(found, scene.modes.below) for found in solution.sets]
    checks += [_upper_bound(r) for r in solution.reductions]
    if solution.response is not None and solution.reductions:
        worst = max(abs(r / f - 1.0) for r, f in solution.response.against_full.values())
        remedy = "keep more fixed-interface modes: raise reduction.modes"
        checks.append(
            Check(
                "reduced response",
                NO_CASE,
                worst,
                0.02,
                "|reduced / full - 1| off resonance",
                remedy,
                fatal=False,
            )
        )
    if solution.response is not None:
        remedy = "the modes left out matter here: raise modes.below"
        says = "|modal / direct - 1| off resonance, undamped"
        checks.append(
            Check(
                "modal response",
                NO_CASE,
                solution.response.modal_error,
                0.02,
                says,
                remedy,
                fatal=False,
            )
        )
    if scene.mesh.element == "hex8":
        checks.append(
            Check(
                "shear locking",
                NO_CASE,
                len(solution.sets),
                0,
                "sets of modes on fully integrated hex8",
                "too stiff in bending (346 Hz for 295 Hz on the default mesh): use "
                'mesh.element = "hex20" or "hex8i"',
                fatal=False,
            )
        )
    return checks


def _modes_checks(found: ModeSet) -> list[Check]:
    case = found.case
    residual = max(
        (float((m.residual - m.rounding).max(initial=0.0)) for _, _, m in found.found), default=0.0
    )
    orthogonality = max((m.orthogonality for _, _, m in found.found), default=0.0)
    missed = [m.message for _, _, m in found.found if m.status != 0]
    return [
        Check(
            "mode residual",
            case,
            residual,
            RESIDUAL_LIMIT,
            "||K x - lambda M x|| / ||lambda M x|| beyond rounding",
            "report this mesh",
        ),
        Check("orthogonality", case, orthogonality, 1e-8, "largest |X'MX - 1|", "report this mesh"),
        Check(
            "no mode missed",
            case,
            len(missed),
            0,
            "searches that could not show it",
            "; ".join(missed),
            fatal=False,
        ),
    ]


def _band(found: ModeSet, below: float) -> Check:
    beyond = sum(m.frequency > below for m in found.modes)
    return Check("band", found.case, beyond, 0, "modes above the limit", "report this scene")


def _upper_bound(r: ReducedBlade) -> Check:
    """A Ritz method never lowers a frequency."""
    lowered = max(0.0, float((1.0 - r.frequency / r.full).max(initial=0.0)))
    return Check(
        "upper bound",
        Case(body=r.body.name),
        lowered,
        1e-7,
        "largest 1 - f reduced / f full",
        "report this mesh",
    )
