"""The curve over frequency with as many harmonics as each stretch of it needs.

One harmonic first. Where the harmonics left out would move the contacts by more than `TRUNCATION`,
or where the path ends early, that stretch is solved again with more, from a point before it to a
point behind it, and takes the place of the old one when it joins the rest: at both ends both
answers agree to the same limit, and no other part of the curve lies at these frequencies.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upd.hbm.core.fourier import Harmonics, harmonics
from upd.hbm.core.newton import Settings
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.checks import separated, stuck_points
from upd.hbm.springs.pieces import Piece, piece_of
from upd.hbm.springs.residuals import scale_of
from upd.hbm.springs.starts import place_sliders
from upd.hbm.springs.sweep import sweep

log = logging.getLogger(__name__)

FloatArray = NDArray[np.float64]
Range = tuple[float, float]
EPS = float(np.finfo(float).eps)
#: largest share of the contact motion that harmonics left out may cause before more are taken
TRUNCATION = 1e-3
#: harmonics an adaptive answer may reach
MOST_HARMONICS = 31


@dataclass(frozen=True)
class Whole:
    """A curve in pieces, in order of the path.

    Attributes
    ----------
    pieces : list of Piece
        Each solved with one set of harmonics.
    status : {"complete", "stopped", "step limit"}
    message : str
        Where and why the path ended.
    """

    pieces: list[Piece]
    status: str
    message: str

    @property
    def frequency(self) -> FloatArray:
        """Frequencies (n,) [Hz] along the path."""
        return np.concatenate([part.frequency for part in self.pieces])

    @property
    def truncation(self) -> FloatArray:
        """Contact motion (n,) that missing harmonics would cause, relative."""
        return np.concatenate([part.truncation for part in self.pieces])

    @property
    def highest(self) -> NDArray[np.int64]:
        """Highest harmonic (n,) of each point."""
        return np.concatenate(
            [np.full(len(part.frequency), part.balance.harmonics.highest) for part in self.pieces]
        )

    def cut(self, begin: int, end: int) -> list[Piece]:
        """The pieces of the points from `begin` to before `end`."""
        out, first = [], 0
        for part in self.pieces:
            n = len(part.frequency)
            low, high = max(begin - first, 0), min(end - first, n)
            if low < high:
                out.append(part.points(slice(low, high)))
            first += n
        return out

    def point(self, k: int) -> tuple[Balance, FloatArray]:
        """The problem and the unknowns of point k."""
        part = self.cut(k, k + 1)[0]
        return part.balance, part.x[0]


def solve_curve(
    b: Balance,
    f: FloatArray,
    fast: bool,
    settings: Settings | None,
    guess: FloatArray | None = None,
) -> Whole:
    """The curve with one set of harmonics.

    Parameters
    ----------
    b : Balance
    f : (n,) ndarray
        Frequencies [Hz], rising or falling.
    fast : bool
        Take the exact linear answers where they are proven.
    settings : Settings or None
        Step control of the continuation.
    guess : (n_unknown,) ndarray, optional
        Initial guess of the first point.

    Returns
    -------
    Whole
    """
    omega = 2 * np.pi * f
    linear = stuck_points(b, omega) if fast and b.start == "zero" else np.zeros(len(f), dtype=bool)
    if linear.all():
        x = np.array([b.stuck(float(w)) for w in omega])
        message = "every point sticks over the whole cycle: the linear answer is exact"
        return Whole([piece_of(b, f, x, linear)], "complete", message)
    apart = separated(b, omega) if fast else None
    if apart is not None:
        message = "nothing presses the contacts: the free answer is exact"
        return Whole([piece_of(b, f, apart, np.ones(len(f), dtype=bool))], "complete", message)
    placed = place_sliders(b, float(f[0]), settings)
    if placed is None:
        message = (
            'start "static": no solution under the static loads alone, so the sliders have no '
            'place to start from; to fix it: start = "zero" or "mid", or static loads that press '
            "the contacts"
        )
        log.warning(message)
        nothing = piece_of(b, f[:0], np.zeros((0, b.size)), linear[:0])
        return Whole([nothing], "stopped", message)
    path = sweep(placed, f, linear, guess, settings)
    return Whole([piece_of(placed, path.p, path.x, path.exact)], path.status, path.message)


def solve_adaptively(
    make: Callable[[Harmonics], Balance],
    first: Harmonics,
    f: FloatArray,
    fast: bool,
    settings: Settings | None,
) -> Whole:
    """The curve, with more harmonics only where those left out matter.

    Parameters
    ----------
    make : callable
        Harmonics -> Balance: the problem with them.
    first : Harmonics
        Those to begin with.
    f : (n,) ndarray
        Frequencies [Hz], rising or falling.
    fast : bool
        Take the exact linear answers where they are proven.
    settings : Settings or None
        Step control of the continuation.

    Returns
    -------
    Whole
        Its truncation stays above `TRUNCATION` only where the most harmonics were not enough, or
        where no path with more of them joins the rest.
    """
    curve = solve_curve(make(first), f, fast, settings)
    start, known = curve.pieces[0].balance, {first.highest: curve.pieces[0].balance}

    def problem(highest: int) -> Balance:
        if highest not in known:
            # the static loads leave the sliders where they do, whatever the harmonics
            made = make(harmonics(range(highest + 1)))
            known[highest] = made.with_sliders(start.start, start.slider)
        return known[highest]

    solver = _Solver(problem, f, 1.0 if f[-1] >= f[0] else -1.0, fast, settings)
    given_up: list[Range] = []
    while (wanted := solver.wanting(curve, given_up)) is not None:
        curve, settled = solver.improved(curve, wanted)
        if not settled:
            given_up.append((wanted.low, wanted.high))
    return replace(curve, message=_told(curve)) if len(known) > 1 else curve


def more(highest: int) -> int | None:
    """The next larger highest harmonic, None beyond the most."""
    if highest >= MOST_HARMONICS:
        return None
    # by two while every one counts, then by a half: few solutions on the way to many harmonics
    return min(MOST_HARMONICS, highest + max(2, highest // 2))


def _told(curve: Whole) -> str:
    """How the curve ended, and the harmonics it was solved with."""
    f, highest = curve.frequency, curve.highest
    parts = []
    for top in np.unique(highest):
        at = f[highest == top]
        points = f"{len(at)} point{'s' * (len(at) != 1)}"
        parts.append(f"to {top} at {points} from {at.min():.6g} to {at.max():.6g} Hz")
    ended = curve.message
    if curve.status == "complete":
        exact = sum(int(part.linear.sum()) for part in curve.pieces)
        ended = (
            f"reached {f[-1]:.9g} Hz in {len(f)} points, {exact} of them by the linear stuck answer"
        )
    return "; ".join([ended, *([f"harmonics {', '.join(parts)}"] if parts else [])])


class _Wanting(NamedTuple):
    """A range of frequencies, times their sense, that wants more harmonics than `highest`."""

    low: float
    high: float
    highest: int


@dataclass(frozen=True)
class _Solver:
    """What it takes to solve a stretch of the curve again."""

    problem: Callable[[int], Balance]
    f: FloatArray
    sense: float
    fast: bool
    settings: Settings | None

    @property
    def grid(self) -> FloatArray:
        """The frequencies asked for, rising."""
        return self.sense * self.f

    def wanting(self, curve: Whole, given_up: list[Range]) -> _Wanting | None:
        """The first part of the path that has too few harmonics, or does not arrive."""
        q, begin, end = self.sense * curve.frequency, float(self.grid[0]), float(self.grid[-1])
        few = curve.truncation > TRUNCATION
        for low, high in given_up:
            few &= (q < low) | (q > high)
        lost = curve.status != "complete" and all(high < end for _, high in given_up)
        if lost and not len(q):
            return _Wanting(begin, end, curve.pieces[0].balance.harmonics.highest)
        few[len(q) - 1 :] |= lost
        if not few.any():
            return None
        first = int(np.argmax(few))
        last = first + int(np.argmin(np.append(few[first:], False))) - 1
        around = q[max(first - 1, 0) : last + 2]
        high = end if lost and last == len(q) - 1 else float(around.max())
        return _Wanting(float(around.min()), high, int(curve.highest[first : last + 1].max()))

    def improved(self, curve: Whole, wanted: _Wanting) -> tuple[Whole, bool]:
        """The curve with more harmonics there, and whether they were found.

        A stretch that does not join the rest is solved again, twice as wide on that side; one that
        does not arrive, with still more harmonics. Where none arrives, the path that goes farthest
        is kept.
        """
        low, high, top, best = wanted.low, wanted.high, more(wanted.highest), curve
        while top is not None:
            i, j = self._ends(curve, low, high)
            k, m = self._points(curve, i, j)
            # what was solved with more is not given back
            top = max(top, int(curve.highest[k:m].max(initial=0)))
            b, guess = self.problem(top), None
            if k < m:
                old, x = curve.point(k)
                guess = b.embedded(x, old)
            new = solve_curve(b, self.f[i : j + 1], self.fast, self.settings, guess)
            arrived = new.status == "complete"
            # a path that turns back behind the joint passes there more than once
            left = i == 0 or (
                _same(new, 0, curve, k)
                and (self.sense * new.frequency).min() >= self.grid[i] * (1 - self.sense * 16 * EPS)
            )
            right = j == len(self.f) - 1 or (arrived and _same(new, -1, curve, m - 1))
            if left and right:
                whole = [*curve.cut(0, k), *new.pieces, *curve.cut(m, len(curve.frequency))]
                found = replace(new if j == len(self.f) - 1 else curve, pieces=whole)
                if arrived:
                    return found, True
                best = max(best, found, key=self._reach)
            top = top if arrived else more(top)
            width = max(j - i, 1)
            if not left:
                low = float(self.grid[max(0, i - width)])
            if arrived and not right:
                high = float(self.grid[min(len(self.f) - 1, j + width)])
        return best, False

    def _reach(self, curve: Whole) -> float:
        return float((self.sense * curve.frequency).max(initial=-np.inf))

    def _ends(self, curve: Whole, low: float, high: float) -> tuple[int, int]:
        """Frequencies i, j about a range at which the path passes once, or ends."""
        q, grid, last = self.sense * curve.frequency, self.grid, len(self.f) - 1
        folds = _folds(q)

        def once(value: float) -> bool:
            on = np.abs(q - value) <= 16 * EPS * abs(value)
            return bool(on.any()) and not any(a <= value <= b for a, b in folds)

        while True:
            for a, b in folds:
                if a <= high and b >= low:
                    low, high = min(low, a), max(high, b)
            i = max(int(np.searchsorted(grid, low, "left")) - 1, 0)
            j = min(int(np.searchsorted(grid, high, "right")), last)
            before = low, high
            low = low if i == 0 or once(float(grid[i])) else float(grid[i])
            high = high if j == last or once(float(grid[j])) else float(grid[j])
            if (low, high) == before:
                return i, j

    def _points(self, curve: Whole, i: int, j: int) -> tuple[int, int]:
        """Points k to before m of the path that lie on the frequencies i to j."""
        f = curve.frequency
        k = 0 if i == 0 else int(np.argmin(np.abs(f - self.f[i])))
        m = len(f) if j == len(self.f) - 1 else int(np.argmin(np.abs(f - self.f[j]))) + 1
        return k, m


def _folds(q: FloatArray) -> list[Range]:
    """Ranges that a path passes more than once, rising and apart from each other."""
    top = np.maximum.accumulate(q)
    low = np.minimum.accumulate(q[::-1])[::-1]
    # where a point lies behind one before it, all between both is passed again
    ranges = sorted((float(a), float(b)) for a, b in zip(low, top, strict=True) if a < b)
    out: list[Range] = []
    for a, b in ranges:
        if out and a <= out[-1][1]:
            out[-1] = out[-1][0], max(b, out[-1][1])
        else:
            out.append((a, b))
    return out


def _same(new: Whole, i: int, old: Whole, k: int) -> bool:
    """Whether a point of a stretch is one of the curve, but for what its harmonics may change."""
    if not len(new.frequency):
        return False
    b, x = new.point(i % len(new.frequency))
    other, y = old.point(k)
    return bool(np.abs((x - b.embedded(y, other)) / scale_of(b)(x)).max() <= TRUNCATION)
