"""The search of a fit: from several starts, with weights that agree with what it finds, and how it
ended.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upd.errors import ConvergenceError
from upd.fitting.first_order import Knowledge
from upd.fitting.residuals import ROUNDING, Residuals, Start

Array = NDArray[np.float64]
Status = Literal["found", "several", "family", "not reached"]
#: rounds in which the weights of curves are renewed, and change of a weight below which they end
_ROUNDS, _SETTLED = 12, 1e-3
#: seconds of a start that is reported when it ends
_LONG_S = 2.0
#: two ends of starts nearer than this in every ln(factor) are one answer
_SAME = 1e-3


def search(
    residuals: Residuals, count: int, tell: Callable[[str, float | None], None]
) -> list[Start]:
    """All starts, the best end first.

    Parameters
    ----------
    residuals
        Of the fit.
    count
        Of starts.
    tell
        Told where each begins, and with its seconds where one that took long ends.

    Raises
    ------
    ConvergenceError
        When all fail.
    """
    done = []
    for k, begin in enumerate(residuals.starts(count), 1):
        tell(f"start {k} of {count}", None)
        since = time.perf_counter()
        done.append(_from(residuals, begin))
        took = time.perf_counter() - since
        if took > _LONG_S:
            end = done[-1].failure or f"misfit {done[-1].misfit:.3g}"
            tell(f"start {k} of {count}: {end}", took)
    if not np.isfinite([one.misfit for one in done]).any():
        raise ConvergenceError(f"no start of the fit came to an answer: {done[0].failure}")
    return sorted(done, key=lambda one: one.misfit)


def _from(residuals: Residuals, begin: Array) -> Start:
    """One start: of curves their magnitudes first, as logarithms, then as they are."""
    if not residuals.parts:
        return residuals.solve(begin)
    residuals.coarse = True
    try:
        near = residuals.solve(begin)
    finally:
        residuals.coarse = False
    if near.failure:
        return near
    found = residuals.solve(residuals.inside(near.end))
    return replace(found, begin=begin, evaluations=near.evaluations + found.evaluations)


def settled(residuals: Residuals, done: list[Start]) -> list[Start]:
    """The starts again with weights by the best fit, until these agree with it.

    Parameters
    ----------
    residuals
        Of the fit; its weights are renewed.
    done
        Of `search`.

    Returns
    -------
    list of Start
        The best first; those that ended elsewhere with their misfit under the new weights.
    """
    if not residuals.parts:
        return done
    best = done[0]
    for _ in range(_ROUNDS):
        change = residuals.weigh(best.end)
        again = residuals.solve(residuals.inside(best.end))
        if not again.failure:
            best = replace(
                again, begin=best.begin, evaluations=best.evaluations + again.evaluations
            )
        if change < _SETTLED:
            break
    others = []
    for one in done[1:]:
        if np.isfinite(one.misfit):
            one = replace(one, misfit=float((residuals(one.end) ** 2).sum()))
        others.append(one)
    return sorted([best, *others], key=lambda one: one.misfit)


def answers(residuals: Residuals, done: Sequence[Start]) -> list[Array]:
    """Ends that fit as well as the best and differ from each other, the one nearest to the scene
    first.

    Parameters
    ----------
    residuals
        Of the fit.
    done
        Of `search`.
    """
    best = done[0].misfit
    J = residuals.jacobian(done[0].end) if residuals.known else None

    def apart(a: Array, b: Array) -> bool:
        """Whether two ends differ, and by more than is known."""
        known = J is None or float(((J @ (a - b)) ** 2).sum()) > 1.0
        return bool(np.abs(a - b).max() > _SAME) and known

    more = 1.0 if residuals.known else max(residuals.rounding**2, ROUNDING * best)
    out: list[Array] = []
    for one in done:
        if one.misfit <= best + more and all(apart(one.end, z) for z in out):
            out.append(one.end)
    return sorted(out, key=lambda z: float(np.linalg.norm(z)))


def status_of(residuals: Residuals, known: Knowledge, found: Sequence[Array]) -> Status:
    """How a fit ended.

    Parameters
    ----------
    residuals
        Of the fit.
    known
        At the best answer.
    found
        Of `answers`.
    """
    compromise = len(residuals.target) > len(residuals.low) and not residuals.known
    compromise |= any(one.estimated for one in residuals.curves)
    if not compromise and not residuals.met(found[0]):
        return "not reached"
    if known.unknown.any():
        return "family"
    return "several" if len(found) > 1 else "found"
