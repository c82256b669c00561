"""Self-checks of a rig.

Every mode's residual and orthogonality, none missed, the reduction's upper bound, effects omitted.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from upd.analyses.measured import fit_checks
from upd.analyses.modal.solve import FAMILIES, ModalSolution, ModeSet, ReducedBlade, RigBody
from upd.linalg import Modes
from upd.linalg.eigen import RESIDUAL_LIMIT
from upd.results import NO_CASE, Case, Check


def check_solution(solution: ModalSolution) -> list[Check]:
    """All self-checks."""
    checks = [check for found in solution.sets for check in _modes_checks(found)]
    checks += [_upper_bound(r) for r in solution.reductions]
    response, compared = solution.response, list[tuple[str, float, str, str]]()
    if response is not None:
        checks += fit_checks(solution.plan.scene.measured)
        if solution.reductions:
            worst = max(abs(r / f - 1.0) for r, f in response.against_full.values())
            remedy = "keep more fixed-interface modes: raise reduction.modes"
            compared.append(
                ("reduced response", worst, "|reduced / full - 1| off resonance", remedy)
            )
        text = "|modal / direct - 1| off resonance, undamped"
        remedy = "the modes left out matter here: raise modes.below"
        compared.append(("modal response", response.modal_error, text, remedy))
    checks += [
        Check(name, NO_CASE, value, 0.02, statement, remedy, fatal=False)
        for name, value, statement, remedy in compared
    ]
    return checks + [one.check(solution.plan.scene.left_out) for one in solution.left_out]


def _modes_checks(found: ModeSet) -> list[Check]:
    """Residual and orthogonality of the modes as they are written, from K and M; none missed."""
    case, report = found.case, "report this mesh"
    families = [_family(found, body, family, m) for body, family, m in found.found]
    residual, off = (max(worst, default=0.0) for worst in zip(*families, strict=True))
    statement = "||K x - lambda M x|| / ||lambda M x|| beyond rounding"
    searches = [(f"{body.name} {family}".strip(), m) for body, family, m in found.found]
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
    lowered, case = max(0.0, float((1.0 - r.frequency / r.full).max())), Case(body=r.body.name)
    statement = "largest 1 - f reduced / f full"
    return Check("upper bound", case, lowered, 1e-7, statement, "report this mesh")
