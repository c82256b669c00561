"""Self-checks of a rig.

Every mode's residual and orthogonality, none missed, the reduction's upper bound, effects omitted.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from upd.analyses.measured import fit_checks
from upd.analyses.modal.plan import MODES_ABOVE
from upd.analyses.modal.solve import FAMILIES, ModalSolution, ModeSet, ReducedBlade, RigBody
from upd.linalg import Modes
from upd.linalg.eigen import RESIDUAL_LIMIT
from upd.results import NO_CASE, Case, Check, left_out_check


def check_solution(solution: ModalSolution) -> list[Check]:
    """All self-checks."""
    checks = [check for found in solution.sets for check in _modes_checks(found)]
    checks += [_upper_bound(r) for r in solution.reductions]
    if solution.response is not None:
        checks += fit_checks(solution.plan.scene.measured)
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
        text = "|modal / direct - 1| off resonance, undamped"
        checks.append(
            Check(
                "modal response",
                NO_CASE,
                solution.response.modal_error,
                0.02,
                text,
                remedy,
                fatal=False,
            )
        )
    return checks + _left_out(solution)


def _left_out(solution: ModalSolution) -> list[Check]:
    """Modes above the limit in the response, and what hex8 leaves out, on the number itself."""
    scene, again, response = solution.plan.scene, solution.again, solution.response
    checks = []
    if response is not None and response.peak is not None and scene.left_out.solves:
        checks.append(
            left_out_check(
                MODES_ABOVE,
                Case(kind="free", blade="right"),
                "peak_accelerance",
                without=response.peak[1],
                included=float("nan") if again.peak is None else again.peak,
                unit="(m/s2)/N",
                limit=scene.left_out.peak,
                remedy="raise modes.below",
            )
        )
    free = next((s for s in solution.sets if s.kind == "free" and s.modes), None)
    if again.unlocked is not None and free is not None:
        checks.append(
            left_out_check(
                "shear locking",
                free.case,
                "f1_free",
                without=free.modes[0].frequency,
                included=again.unlocked,
                unit="Hz",
                limit=scene.left_out.frequency,
                remedy='fully integrated hex8 is too stiff in bending: use mesh.element = "hex20" '
                'or "hex8i"',
            )
        )
    return checks


def _modes_checks(found: ModeSet) -> list[Check]:
    """Residual and orthogonality of the modes as they are written, from K and M; none missed."""
    case = found.case
    families = [_family(found, body, family, m) for body, family, m in found.found]
    return [
        Check(
            "mode residual",
            case,
            max((residual for residual, _ in families), default=0.0),
            RESIDUAL_LIMIT,
            "||K x - lambda M x|| / ||lambda M x|| beyond rounding",
            "report this mesh",
        ),
        Check(
            "orthogonality",
            case,
            max((off for _, off in families), default=0.0),
            1e-8,
            "largest |X'MX - 1|",
            "report this mesh",
        ),
        no_mode_missed(
            case, [(f"{body.name} {family}".strip(), m) for body, family, m in found.found]
        ),
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


def _family(found: ModeSet, body: RigBody, family: str, solved: Modes) -> tuple[float, float]:
    """Largest residual beyond rounding and largest off-orthogonality of one body's modes."""
    mine = [m for m in found.modes if m.body is body and m.family == family]
    if not mine:
        return 0.0, 0.0
    free = body.free(FAMILIES.get(family, ()))
    X = np.column_stack([m.shape.ravel()[free] for m in mine])
    KX, MX = body.K.submatrix(free) @ X, body.M.submatrix(free) @ X
    inertia = (2.0 * np.pi * np.array([m.frequency for m in mine])) ** 2 * MX
    size = np.linalg.norm(inertia, axis=0)
    residual = np.linalg.norm(KX - inertia, axis=0) / np.where(size > 0.0, size, 1.0)
    # Modes are listed by frequency, as their solver gives them.
    beyond = residual - np.asarray(solved.rounding)[: len(mine)]
    return float(beyond.max()), float(np.abs(X.T @ MX - np.eye(len(mine))).max())


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
