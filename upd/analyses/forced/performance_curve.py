"""Peaks of a forced response over F_C/F_E."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from upd.analyses.forced.curves import SweptCurve
from upd.analyses.forced.model import Array


@dataclass(frozen=True)
class Branch:
    """One peak over F_C/F_E: ratio (n,) rising.

    Frequency (n,) Hz; height (n,) (m/s2)/N; lift (n,) share open; the mode in words; the lower of
    the heights on both sweeps (n,), the height itself where the peak is one.
    """

    name: str
    ratio: Array
    frequency: Array
    height: Array
    lift: Array
    complete: bool
    message: str
    mode: str = ""
    low: Array | None = None

    @property
    def least(self) -> Array:
        """(n,) lower height of both sweeps."""
        return self.height if self.low is None else self.low


@dataclass(frozen=True)
class Performance:
    """The peaks over F_C/F_E, and the linear limits.

    Free (small ratios) and stuck (large ones) peak in (m/s2)/N. Where points move, the highest
    point of the sweeps up and down: ratio rising, frequency in Hz, height on the higher and on the
    lower sweep, (4, n); and the sweeps. Whole curves whose highest point is on no branch: F_C/F_E,
    frequency in Hz, height, and that of the highest branch there.
    """

    branches: tuple[Branch, ...]
    free_peak: float
    stuck_peak: float
    swept: Array = field(default_factory=lambda: np.zeros((4, 0)))
    sweeps: tuple[SweptCurve, ...] = ()
    beside: tuple[tuple[float, float, float, float], ...] = ()

    @property
    def missed(self) -> str:
        """What of whole curves is on no branch, in words; empty where nothing is."""
        return "; ".join(
            f"the whole curve at F_C/F_E {ratio:.4g} has {height:.4g} (m/s2)/N at {f:.4g} Hz, the "
            f"highest peak followed there {followed:.4g}"
            for ratio, f, height, followed in self.beside
        )

    @property
    def optimum(self) -> tuple[float, float, float] | None:
        """Ratio, frequency in Hz and height of the lowest highest peak.

        None when it lies at an end of what was reached.
        """
        best = self._best
        if best is None:
            return None
        ratio, frequency, height = self.highest[:3, best]
        return float(ratio), float(frequency), float(height)

    @property
    def _best(self) -> int | None:
        height = self.highest[2]
        best = int(height.argmin()) if len(height) else 0
        return best if 0 < best < len(height) - 1 else None

    @property
    def optimum_between(self) -> tuple[float, float]:
        """F_C/F_E between which the optimum lies: the next on the curve, and beyond them all at
        which the lower sweep is below the least height of the higher one.
        """
        ratio, _, height, low = self.highest
        best = self._best
        assert best is not None
        may = np.flatnonzero(low <= height[best])
        return float(ratio[min(may[0], best - 1)]), float(ratio[max(may[-1], best + 1)])

    @property
    def optimum_heights(self) -> tuple[float, float]:
        """Height at the optimum on the lower and on the higher sweep."""
        best = self._best
        assert best is not None
        return float(self.highest[3, best]), float(self.highest[2, best])

    @property
    def highest(self) -> Array:
        """(4, n): ratio, frequency in Hz, height of the highest peak, and that on the lower sweep,
        at every ratio that all branches reach, and at every ratio that was swept.
        """
        told = self._followed()
        if not self.swept.shape[1]:
            return told
        return np.hstack([self.swept, told[:, told[0] > self.swept[0, -1]]])

    def _followed(self) -> Array:
        full = [b for b in self.branches if len(b.ratio)]
        if not full:
            return np.zeros((4, 0))
        low, high = max(b.ratio[0] for b in full), min(b.ratio[-1] for b in full)
        ratio = np.unique(np.concatenate([b.ratio for b in full]))
        ratio = ratio[(ratio >= low) & (ratio <= high)]
        at = np.log(ratio)
        heights = np.array([np.interp(at, np.log(b.ratio), b.height) for b in full])
        frequencies = np.array([np.interp(at, np.log(b.ratio), b.frequency) for b in full])
        top = heights.argmax(axis=0) if len(ratio) else np.zeros(0, np.int64)
        every = np.arange(len(ratio))
        height = heights[top, every]
        return np.array([ratio, frequencies[top, every], height, height])
