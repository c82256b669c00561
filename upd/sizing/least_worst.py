r"""The F_C whose worst peak W over a range of F_E is lowest (`upd.sizing.worst_peak`).

Its least worst is sought on all that is read between whole curves, the points that decide (ends of
the window of F_C/F_E, and maxima within) are solved, and that again until they agree with what was
read; then whole curves in the window until none may hide a higher peak.

By c = ln F_C a worst peak at an end of the window changes by g = dy/ds, one within by g = k. At the
optimum the deciding points meet 0 = sum_i l_i g_i, l_i >= 0, sum_i l_i = 1, unless F_C is at its
bound; by any parameter p then dW/dp = sum_i l_i dy_i/dp.

References
----------
J. M. Danskin, The Theory of Max-Min (1967); V. F. Demyanov, V. N. Malozemov, Introduction to
Minimax (1974), ch. III.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from upd.errors import ConvergenceError
from upd.hbm.peaks.over import AGREES, JUMP_STEP, SAME, Deciding
from upd.sizing.worst_peak import WorstPeak

#: how closely F_C is found, as its logarithm
STILL = 5e-4
#: rounds of the search
ROUNDS = 25
#: slope of the one deciding point of an optimum beyond which it is none by itself
JUMPS = 0.05
#: slope of a deciding point that counts as none
_FLAT = 1e-6


@dataclass(frozen=True)
class LowestWorst:
    """F_C of the lowest worst peak.

    Attributes
    ----------
    log_centrifugal : float
        ln F_C.
    log_worst : float
        ln of the worst peak there.
    deciding : tuple of Deciding
        What it is the worst of.
    status : str
        "found", "at the lower bound", "at the upper bound"; "at the end of what is known": peaks
        are lost for lower F_C; "bracketed": deciding points and curve did not agree, the lowest
        solved point.
    reached : (float, float)
        ln F_C between which the worst peak is known.
    """

    log_centrifugal: float
    log_worst: float
    deciding: tuple[Deciding, ...]
    status: str
    reached: tuple[float, float]

    @property
    def at_jump(self) -> bool:
        """Whether one peak alone decides that is no optimum by itself: beyond, the worst jumps."""
        alone = [p for p in self.deciding if p.share > 0.0]
        inside = self.status == "found" and len(alone) == 1
        return inside and abs(alone[0].slope) > JUMPS


def lowest_worst(worst: WorstPeak, low: float, high: float, jump: float = JUMP_STEP) -> LowestWorst:
    """F_C between bounds whose worst peak is lowest.

    Parameters
    ----------
    worst
        Of the peaks.
    low, high
        F_C [N]; the same when it is fixed.
    jump
        How closely jumps are located, as ln(F_C/F_E).

    Raises
    ------
    ConvergenceError
        Where the worst peak is known at no F_C between the bounds.
    """
    ends = math.log(low), math.log(high)
    before, solved, rounds = math.nan, list[tuple[float, float]](), 0
    while rounds < ROUNDS:
        known = max(ends[0], worst.known_from())
        if known > ends[1] + SAME:
            lost = sorted({math.exp(s) for one in worst.peaks for s in one.failed})
            raise ConvergenceError(
                f"the worst peak is known at no F_C between {low:g} and {high:g} N: whole curves "
                f"were not followed through at F_C/F_E {', '.join(f'{r:.4g}' for r in lost)}; to "
                "fix it: larger F_C, or smaller F_E"
            )
        c = _least(worst, known, ends[1])
        rounds += 1
        guessed, deciding = worst.read(c), worst.solved(c)
        y = worst.value(c, deciding[0])
        off = max(abs(y - worst.read(c)), abs(y - guessed))
        near = abs(c - before) <= STILL or c in (known, ends[1])
        if off <= AGREES and near:
            # whole curves between may have higher peaks, and others hide lower ones
            if worst.settle((c, c), y, jump=jump) or worst.explore((known, ends[1]), y):
                rounds -= 1
                continue
            status = _status(c, ends, known)
            return LowestWorst(c, y, _shared(worst, c, deciding), status, (known, ends[1]))
        solved.append((y, c))
        before = c
    # later whole curves may have shown higher peaks at F_C that were solved before
    read = worst.at(np.array([c for _, c in solved]))
    _, c = min((max(y, float(now)), c) for (y, c), now in zip(solved, read, strict=True))
    deciding = worst.solved(c)
    y = max(worst.value(c, deciding[0]), worst.read(c))
    return LowestWorst(c, y, _shared(worst, c, deciding), "bracketed", (known, ends[1]))


def has_moved(worst: WorstPeak, found: LowestWorst, low: float, high: float) -> bool:
    """Whether what is read between whole curves solved since has another optimum: the worst peak
    higher there, or lower elsewhere.

    Parameters
    ----------
    worst, found
        The worst peaks, and where they were least.
    low, high
        F_C [N] between which it was sought.
    """
    here = worst.read(found.log_centrifugal)
    c = _least(worst, max(math.log(low), worst.known_from()), math.log(high))
    least = worst.read(c)
    off = 2.0 * AGREES
    return here > found.log_worst + off or least < found.log_worst - off


def _status(c: float, ends: tuple[float, float], known: float) -> str:
    if ends[1] - ends[0] <= SAME:
        return "found"
    if known > ends[0] + STILL and c - known <= STILL:
        return "at the end of what is known"
    if c - ends[0] <= STILL:
        return "at the lower bound"
    return "at the upper bound" if ends[1] - c <= STILL else "found"


def _least(worst: WorstPeak, low: float, high: float) -> float:
    """ln F_C of the least worst peak on the curves: on a grid, then between its neighbours."""
    if high - low <= SAME:
        return high
    grid, values = worst.over(low, high)
    i = int(values.argmin())
    a, b = grid[max(i - 1, 0)], min(grid[i] + (grid[1] - grid[0]), high)
    found = minimize_scalar(
        worst.read,
        bounds=(a, b),
        method="bounded",
        options={"xatol": 0.1 * STILL},
    )
    candidates = [(float(found.fun), float(found.x))]
    candidates += [(worst.read(c), float(c)) for c in (grid[i], low, high)]
    return min(candidates)[1]


def _shared(worst: WorstPeak, c: float, deciding: Sequence[Deciding]) -> tuple[Deciding, ...]:
    """The deciding points with their shares: of the worst alone, or of the worst rising one and the
    worst falling one whose slopes cancel.
    """
    top = worst.value(c, deciding[0])
    # as near as heights are known
    near = [p for p in deciding if top - worst.value(c, p) <= 10.0 * AGREES]
    rising = [p for p in near if p.slope > _FLAT]
    falling = [p for p in near if p.slope < -_FLAT]
    if not (rising and falling):
        return tuple(p._replace(share=float(i == 0)) for i, p in enumerate(near))
    up, down = rising[0], falling[0]
    share = -down.slope / (up.slope - down.slope)
    return up._replace(share=share), down._replace(share=1.0 - share)
