"""Performance curve: peak accelerance of the right blade and its frequency against F_C/F_E, each peak followed by itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from upd.analyses.forced import measures
from upd.analyses.forced.model import Model
from upd.analyses.forced.plan import ForcedPlan
from upd.hbm.friction import LIFT
from upd.hbm.peaks import performance_curve

if TYPE_CHECKING:
    from upd.analyses.forced.solve import Case

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Branch:
    """One peak followed over F_C/F_E: ratio (n,) rising; frequency (n,) Hz; height (n,) (m/s2)/N; lift (n,) share open."""

    name: str
    ratio: Array
    frequency: Array
    height: Array
    lift: Array
    complete: bool
    message: str


@dataclass(frozen=True)
class Performance:
    """The peaks over F_C/F_E, and the linear limits: free (small ratios) and stuck (large ones) peak in (m/s2)/N."""

    branches: tuple[Branch, ...]
    free_peak: float
    stuck_peak: float

    @property
    def optimum(self) -> tuple[float, float, float] | None:
        """Ratio, frequency in Hz and height of the lowest highest peak; None when it lies at an end of what was reached."""
        ratio, frequency, height = self.highest
        best = int(height.argmin()) if len(ratio) else 0
        return (float(ratio[best]), float(frequency[best]), float(height[best])) if 0 < best < len(ratio) - 1 else None

    @property
    def highest(self) -> Array:
        """(3, n): ratio, frequency in Hz and height of the highest peak at every ratio that all branches reach."""
        full = [b for b in self.branches if len(b.ratio)]
        if not full:
            return np.zeros((3, 0))
        low, high = max(b.ratio[0] for b in full), min(b.ratio[-1] for b in full)
        ratio = np.unique(np.concatenate([b.ratio for b in full]))
        ratio = ratio[(ratio >= low) & (ratio <= high)]
        at = np.log(ratio)
        heights = np.array([np.interp(at, np.log(b.ratio), b.height) for b in full])
        frequencies = np.array([np.interp(at, np.log(b.ratio), b.frequency) for b in full])
        top = heights.argmax(axis=0) if len(ratio) else np.zeros(0, np.int64)
        every = np.arange(len(ratio))
        return np.array([ratio, frequencies[top, every], heights[top, every]])


def performance(plan: ForcedPlan, model: Model, case: Case, stuck: Array, free_peak: float) -> Performance:
    """Every stuck peak, stuck (2, n) Hz and (m/s2)/N over frequency, followed from the highest F_C/F_E to the lowest."""
    peaks = measures.path_peaks(*stuck)
    names = [f"peak {k + 1}" for k in range(len(peaks))] if len(peaks) > 1 else ["peak"]
    found = tuple(_branch(plan, model, case, peak, name) for peak, name in zip(peaks, names, strict=False))
    return Performance(found, free_peak, float(stuck[1].max()))


def _branch(plan: ForcedPlan, model: Model, case: Case, peak: measures.PathPeak, name: str) -> Branch:
    choice = plan.scene.performance
    ratio = np.geomspace(choice.highest, choice.lowest, choice.points)
    # With every gap closed at rest a factor on F_E is its inverse on F_C.
    curve = performance_curve(case.answer.balance, model.row("right"), case.ratio / ratio, peak.frequency)
    height = 1e-3 * (2 * np.pi * curve.frequency) ** 2 * curve.amplitude / (case.force * curve.factor)
    lift = curve.state[..., LIFT].mean(axis=1)
    ratios, frequency, height, lift = (part[::-1] for part in (case.ratio / curve.factor, curve.frequency, height, lift))
    message = "" if curve.status == "complete" else curve.message
    return Branch(name, ratios, frequency, height, lift, not message, message)
