"""How far F_C and F_E may move until the worst peak has grown by so much, on whole curves that were
solved there and up to there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upd.hbm.peaks.over import SAME
from upd.sizing.least_worst import ROUNDS, LowestWorst
from upd.sizing.worst_peak import FINE, WorstPeak

Array = NDArray[np.float64]
#: ln(F_C/F_E) between an end and the whole curve that it comes from
STILL_AT = 5e-3


@dataclass(frozen=True)
class Reach:
    """Up to where the worst peak stays below some growth.

    Attributes
    ----------
    end : float
        In N; nan where it does up to the end of what was asked, and where it is not known.
    why : str
        Why it is not known; "" where it is.
    """

    end: float
    why: str = ""


def how_far(worst: WorstPeak, found: LowestWorst, growth: float, bound: float) -> Reach:
    """F_C up to which the worst peak stays below so many times its least, on whole curves.

    Parameters
    ----------
    worst, found
        The worst peaks, and where they are least.
    growth
        1.05 for 5 %.
    bound
        F_C [N] up to which it is sought, on either side.
    """
    c, way = found.log_centrifugal, math.copysign(1.0, math.log(bound) - found.log_centrifugal)
    end = max(math.log(bound), worst.known_from())

    def read() -> tuple[Array, Array]:
        grid, values = worst.over(*sorted((c, end)))
        return (grid, values) if way > 0.0 else (grid[::-1], values[::-1])

    def settle(at: float, limit: float) -> bool | None:
        ends = (c, at) if way > 0.0 else (at, c)
        return _settled(worst, ends, limit, None)

    def solve(at: float) -> bool:
        return worst.look(at, STILL_AT)

    return _reached(found.log_worst + math.log(growth), read, solve, settle, end)


def how_far_force(
    worst: WorstPeak, found: LowestWorst, growth: float, way: float, bound: float
) -> Reach:
    """F_E up to which a range of it may be widened at the optimum's F_C.

    Parameters
    ----------
    worst, found, growth
        As of `how_far`.
    way
        -1.0 for the lower end of the range, 1.0 for the upper one.
    bound
        F_E [N] up to which it is sought.
    """
    c, begin = found.log_centrifugal, worst.f[0 if way < 0.0 else 1]
    # between the F_C/F_E that are known
    s = (min(one.nodes[-1] for one in worst.peaks), max(one.known_from for one in worst.peaks))
    end = max(math.log(bound), c - s[0]) if way < 0.0 else min(math.log(bound), c - s[1])
    if (end - begin) * way <= SAME:
        return Reach(math.nan)

    def read() -> tuple[Array, Array]:
        f = np.linspace(begin, end, max(2, math.ceil(abs(end - begin) / FINE) + 1))
        return f, worst.single(c, f)

    def solve(at: float) -> bool:
        solved = [one.look_unless_known(c - at, STILL_AT) for one in worst.peaks]
        return any(solved)

    def settle(at: float, limit: float) -> bool | None:
        # F_C whose windows cover these F_C/F_E
        ends = (c, c + begin - at) if way < 0.0 else (c + begin - at, c)
        return _settled(worst, ends, limit, max(at, worst.f[1]))

    return _reached(found.log_worst + math.log(growth), read, solve, settle, end)


def _settled(
    worst: WorstPeak, ends: tuple[float, float], limit: float, most: float | None
) -> bool | None:
    """Solve a whole curve that decides whether worst peaks between two ln F_C pass a limit: whether
    one was; None where one is not known.
    """
    if not worst.is_whole(ends):
        return None
    return worst.settle(ends, limit, most, math.inf) or worst.clear(ends, limit, most)


def _reached(
    limit: float,
    read: Callable[[], tuple[Array, Array]],
    solve: Callable[[float], bool],
    settle: Callable[[float, float], bool | None],
    end: float,
) -> Reach:
    """The first place beyond a limit, whole curves solved there and up to there until it stays.

    Parameters
    ----------
    limit
        ln of the worst peak.
    read
        Places from the optimum on, and ln of the worst peaks that are read there.
    solve
        The whole curves that decide a place: whether any is new.
    settle
        Whole curves up to a place: whether any is new, None where one is not known.
    end
        The last place.
    """
    for _ in range(ROUNDS):
        at = beyond(*read(), limit)
        while new := settle(end if math.isnan(at) else at, limit):
            at = beyond(*read(), limit)
        if new is None:
            return Reach(math.nan, "no whole curve was followed through on the way")
        if math.isnan(at) or not solve(at):
            return Reach(math.exp(at))
    return Reach(math.nan, f"whole curves and what is read between differ after {ROUNDS} of them")


def beyond(places: Array, values: Array, limit: float) -> float:
    """The first place beyond a limit; nan where there is none."""
    over = np.flatnonzero(values > limit)
    return float(places[over[0]]) if over.size else math.nan
