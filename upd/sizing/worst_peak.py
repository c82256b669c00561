r"""The worst peak over a range of F_E, as a function of F_C, and the F_C at which it is lowest.

Peaks h per unit of F_E depend on s = ln r = c - f alone, with c = ln F_C and f = ln F_E (see
`upd.hbm.peaks.over`). The worst over f_1 <= f <= f_2,

    W(c) = max over s in [c - f_2, c - f_1] of y(s) + k (c - s),   y = ln h,

k = 0 for peaks per newton, 1 for accelerations, is the largest value of one curve in a window that
slides with c: every whole response curve serves all pairs of forces. Between whole curves y is the
cubic of their values and slopes. The worst of a window comes from whole curves that stand closely
there, and more so where neighbours are not of one branch and may hide a higher peak.

Its least is sought on all that is read between whole curves, the points that decide (ends of the
window of F_C/F_E, and maxima within) are solved, and that again until they agree with what was
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
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from upd.errors import ConvergenceError
from upd.hbm.peaks.over import (
    AGREES,
    ANSWER_STEP,
    BESIDE,
    JUMP_STEP,
    SAME,
    Deciding,
    PeaksOver,
)
from upd.hbm.springs.peak import JUMP_HEIGHT

Array = NDArray[np.float64]
#: how closely jumps are located, as ln(F_C/F_E), where an optimum is compared with another one
COMPARED_STEP = 0.2
#: below the worst within which a point may decide, as a logarithm
_NEAR = 0.02
#: ln F_C between points of the curve between solved ones
FINE = 2e-3
#: ln(F_C/F_E) from the ends of the window beyond which a maximum is within it
_INNER = 1e-6
#: how closely F_C is found, as its logarithm
STILL = 5e-4
#: rounds of the search
ROUNDS = 25
#: slope of the one deciding point of an optimum beyond which it is none by itself
JUMPS = 0.05
#: slope of a deciding point that counts as none
_FLAT = 1e-6


class WorstPeak:
    """The worst peak over a range of F_E, as a function of F_C.

    Parameters
    ----------
    peaks
        One for every set of the parameters that are neither F_C nor F_E; the worst of all counts.
    forces
        F_E [N], the least and the largest.
    weight
        k: 0 for peaks per newton, 1 for accelerations.
    """

    def __init__(
        self, peaks: Sequence[PeaksOver], forces: tuple[float, float], weight: float = 0.0
    ) -> None:
        self.peaks, self.weight = tuple(peaks), weight
        self.f = (math.log(forces[0]), math.log(forces[1]))

    @property
    def _known(self) -> int:
        """Whole curves and sweeps."""
        return sum(len(one.nodes) for one in self.peaks)

    def known_from(self) -> float:
        """ln F_C from which the worst peak is known."""
        return max(one.known_from for one in self.peaks) + self.f[1]

    def at(self, c: Array) -> Array:
        """ln of the worst peak at ln F_C (n,), on the curves between solved points."""
        return np.array([self.read(float(one)) for one in np.atleast_1d(c)])

    def read(self, c: float) -> float:
        """The same at one ln F_C."""
        return float(self.single(c, self._forces()).max())

    def over(self, low: float, high: float) -> tuple[Array, Array]:
        """ln F_C from end to end, evenly, and ln of the worst peaks there, all at once: the largest
        in a window that slides, to its steps.
        """
        if high - low <= FINE:
            ends = np.array([low, high])
            return ends, self.at(ends)
        step = FINE / 2.0
        c = low + step * np.arange(math.ceil((high - low) / step) + 1)
        n = round((self.f[1] - self.f[0]) / step)
        s = c[0] - self.f[1] + step * np.arange(len(c) + n)
        out = np.full(len(c), -math.inf)
        for one in self.peaks:
            y = one.read(s) - self.weight * s
            window = sliding_window_view(y, n + 1).max(axis=1) if n else y
            out = np.maximum(out, window + self.weight * c)
        inside = c <= high + SAME
        return np.asarray(c[inside], float), np.asarray(out[inside], float)

    def single(self, c: float, f: Array) -> Array:
        """ln of the highest peak at ln F_C and every ln F_E (n,), on the curves."""
        return np.asarray(np.max([one.read(c - f) for one in self.peaks], axis=0) + self.weight * f)

    def _forces(self) -> Array:
        """ln F_E of the range, closely."""
        return np.linspace(*self.f, max(2, math.ceil((self.f[1] - self.f[0]) / FINE) + 1))

    def places(self, c: float) -> list[tuple[int, float]]:
        """Which peaks may decide at ln F_C: number of the set, and ln r; the ends of the window
        near the worst, and the highest within it where it is higher than both.
        """
        f = self._forces()
        worst = self.read(c)
        found = []
        for k, one in enumerate(self.peaks):
            y = one.read(c - f) + self.weight * f
            ends = [0, len(f) - 1] if f[-1] > f[0] else [0]
            found += [(k, float(c - f[i])) for i in ends if y[i] >= worst - _NEAR]
            top = int(y.argmax())
            if y[top] >= worst - _NEAR and y[top] > max(y[0], y[-1]) + 0.5 * AGREES:
                # a maximum at a jump is its node
                found.append((k, one.node(float(c - f[top]), FINE)))
        return found

    def solved(self, c: float) -> tuple[Deciding, ...]:
        """The deciding points at ln F_C, solved, worst first."""
        out = []
        for k, s in self.places(c):
            point = self.peaks[k].solve(s)
            # a maximum within the window stays where it is
            within = min(abs(c - f - s) for f in self.f) > _INNER
            out.append(point._replace(slope=self.weight) if within else point)
        return tuple(sorted(out, key=lambda p: -self.value(c, p)))

    def look(self, c: float, near: float) -> bool:
        """Solve whole curves at the deciding places unless so near ones are known, or neighbours
        tell the peaks there; whether any is new.
        """
        solved = [self.peaks[k].look_unless_known(s, near) for k, s in self.places(c)]
        return any(solved)

    def solved_worst(self, c: float) -> float:
        """ln of the worst peak at ln F_C, on whole curves; nan where it is not known."""
        if c < self.known_from() - SAME:
            return math.nan
        y, known = -math.inf, -1
        try:
            # a curve that has no higher peak where one was read leaves it elsewhere
            while known < (known := self._known) or self.settle((c, c), y, jump=COMPARED_STEP):
                y = max(y, self.value(c, self.solved(c)[0]))
        except ConvergenceError:
            return math.nan
        return y

    def settle(
        self,
        ends: tuple[float, float],
        limit: float,
        most: float | None = None,
        jump: float = JUMP_STEP,
    ) -> bool:
        """Solve the whole curve that is wanted most where neighbours are too far apart for the
        worst peaks between two ln F_C.

        Neighbours are too far apart with more than `ANSWER_STEP` between them, unless tangents of
        both stay below a limit by the factor that makes another peak (`upd.hbm.springs.peak`); and
        with more than a jump where tangents may reach the limit, if the neighbours are not of one
        branch or their tangents meet above it.

        Parameters
        ----------
        ends
            ln F_C.
        limit
            ln of the worst peak that matters.
        most
            ln of the largest F_E; that of the range when None.
        jump
            How closely jumps are located, as ln(F_C/F_E).

        Returns
        -------
        bool
            Whether one was.
        """
        # where a curve fails it has no nearer neighbours
        return any(one.look(s) for _, s, one in self._wanted(ends, limit, most, jump))

    def clear(self, ends: tuple[float, float], limit: float, most: float | None = None) -> bool:
        """Solve the whole curve that is wanted most for telling whether worst peaks between two
        ln F_C pass a limit: where the tangent of a neighbour passes it, between neighbours that do
        not tell that none does. There the peak is above the limit, or it is lost and below it up to
        there: one curve shows which.

        Parameters
        ----------
        ends, limit, most
            As of `settle`.

        Returns
        -------
        bool
            Whether one was.
        """
        low, high = ends[0] - self.f[1], ends[1] - self.f[0]
        found: list[tuple[float, float, PeaksOver]] = []
        for one in self.peaks:
            for a, b in one.intervals(low, high):
                more = self._more(a, ends, most)
                at = one.passes(a, b, limit + AGREES - more)
                if low + BESIDE < at < high - BESIDE:
                    found.append((one.may_reach(a, b) + more, at, one))
        return any(one.look(at) for _, at, one in sorted(found, key=lambda p: -p[0]))

    def _more(self, a: float, ends: tuple[float, float], most: float | None) -> float:
        """What a peak counts at most between two ln F_C, beside its height, from a node on."""
        return self.weight * min(self.f[1] if most is None else most, ends[1] - a)

    def is_settled(self, c: float, limit: float) -> bool:
        """Whether whole curves stand as closely as `settle` asks for at ln F_C."""
        return not self._wanted((c, c), limit, None, JUMP_STEP)

    def _wanted(
        self, ends: tuple[float, float], limit: float, most: float | None, jump: float
    ) -> list[tuple[float, float, PeaksOver]]:
        """Heights that may be reached, places and of which peaks whole curves are wanted, the
        highest first; see `settle`. What is asked for has more of an interval than the step of
        a jump, else the neighbour shows it.
        """
        low, high = ends[0] - self.f[1], ends[1] - self.f[0]
        over, far = limit + AGREES, limit - math.log(JUMP_HEIGHT)
        found: list[tuple[float, float, PeaksOver]] = []
        for one in self.peaks:
            for a, b in one.intervals(low, high):
                if min(b, high) - max(a, low) <= JUMP_STEP:
                    continue
                more = self._more(a, ends, most)
                top = one.may_reach(a, b) + more
                hidden = max(one.top(a), one.top(b)) + more <= over < one.kink(a, b) + more
                jumps = b - a > jump and top > over and (hidden or not one.agree(a, b))
                if jumps or (b - a > ANSWER_STEP + SAME and top > far):
                    found.append((top, _between(one, a, b, (low, high)), one))
        return sorted(found, key=lambda p: -p[0])

    def explore(self, ends: tuple[float, float], limit: float) -> bool:
        """Solve a whole curve where a worst peak below a limit may be hidden between two ln F_C:
        between neighbours that are not of one branch, for an F_C whose window has no curve with a
        peak above the limit.

        Parameters
        ----------
        ends
            ln F_C.
        limit
            ln of the least worst peak so far.

        Returns
        -------
        bool
            Whether one was.
        """
        c = np.linspace(*ends, max(2, math.ceil((ends[1] - ends[0]) / JUMP_STEP) + 1))
        low, high = ends[0] - self.f[1], ends[1] - self.f[0]
        below = np.ones(len(c), bool)
        for one in self.peaks:
            for s in one.nodes:
                inside = (s >= c - self.f[1]) & (s <= c - self.f[0])
                below &= ~(inside & (one.top(s) + self.weight * (c - s) > limit))
        return any(
            one.look(_between(one, a, b, (low, high)))
            for one in self.peaks
            for a, b in one.intervals(low, high)
            if b - a > ANSWER_STEP + SAME
            and not one.agree(a, b)
            and (
                below
                & (c - self.f[1] < b)
                & (c - self.f[0] > a)
                # else what is read there hides nothing
                & (one.highest(a, b) + self.weight * (c - a) > limit)
            ).any()
        )

    def is_whole(self, ends: tuple[float, float]) -> bool:
        """Whether nothing is unknown for the worst peaks between two ln F_C."""
        low, high = ends[0] - self.f[1], ends[1] - self.f[0]
        return not any(
            a < high - SAME and b > low + SAME for one in self.peaks for a, b in one.holes
        )

    def value(self, c: float, point: Deciding) -> float:
        """What a point counts at ln F_C."""
        return point.y + self.weight * (c - point.s)


def _between(one: PeaksOver, a: float, b: float, ends: tuple[float, float]) -> float:
    """ln(F_C/F_E) of the next whole curve between neighbours: of the places that divide them into
    the fewest parts of `ANSWER_STEP` one in the middle, next to the higher peak; within what is
    asked for.
    """
    n = max(2, math.ceil((b - a) / ANSWER_STEP - SAME))
    k = n // 2 if one.top(a) > one.top(b) else (n + 1) // 2
    return min(max(a + (b - a) * k / n, ends[0]), ends[1])


# -- the lowest worst peak -------------------------------------------------------------------------


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
