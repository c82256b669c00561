"""How far the highest point of a curve is below the free peak."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curves import FacesCurve, ForcedCurve
from upd.analyses.forced.peak_results import LEFT
from upd.analyses.forced.ranges import alike_heights, peak_ranges, sweeps_of
from upd.analyses.forced.solution import ForcedSolution
from upd.results import Case, Result, withheld
from upd.scene.forced_contact import Side

NOT_ALIKE = "sweeps up and down are not alike"


def reduced_results(
    solution: ForcedSolution, case: Case, heights: Sequence[float], blade: Side
) -> list[Result]:
    """How far the highest point of every sweep is below the blade's free peak."""
    free = solution.linear[case.stiffness].free_peaks[blade]
    if not free or not heights:
        return []
    top = max(peak.height for peak in free)
    left = [100.0 * (1.0 - height / top) for height in heights]
    one = Result(reduction_name(blade), case, min(left), "%")
    if alike_heights(heights):
        return [one]
    return [replace(one, low=min(left), high=max(left), why=NOT_ALIKE)]


def reduction_results(
    solution: ForcedSolution, curve: ForcedCurve | FacesCurve, blade: Side = "right"
) -> list[Result]:
    """Highest point of a blade's curve against its free peak, where the paths reach the whole
    sweep.

    Only where the sweep holds the free peak; a run that broke off may have no free curve yet.
    """
    linear = solution.linear.get(curve.stiffness)
    free = linear.free_peaks[blade] if linear else []
    if not free or curve.reversed:
        return []
    name = reduction_name(blade)
    top = max(peak.height for peak in free)
    swept = _swept_heights(solution, curve, blade)
    if swept:
        return reduced_results(solution, curve.case, swept, blade)
    mine = [
        c for c in solution.paths if replace(c.case, reversed=False) == curve.case and not c.empty
    ]
    if curve.stopped and not meet(mine):
        reached = " and ".join(c.where for c in mine) or curve.where
        reason = f"{reached}; the highest point may lie between"
        return [withheld(name, curve.case, "%", reason)]
    ends = [c for c in mine if _highest_at_end(c, blade)]
    if ends:
        reason = (
            "the highest point is an end of the sweep, so the resonance lies outside: widen "
            "excitation.start and excitation.stop"
        )
        return [withheld(name, curve.case, "%", reason)]
    heights = [_height(solution, c, blade) for c in mine]
    if not any(heights):
        reason = (
            "a march leaves the maxima of the path, not steady or with too few harmonics: "
            'balance.method = "auto" sweeps as a test does'
        )
        return [withheld(name, curve.case, "%", reason)]
    value = 100.0 * (1.0 - max(heights) / top)
    return [Result(name, curve.case, value, "%")]


def reduction_name(blade: Side) -> str:
    """Name of the number of a blade."""
    return f"{LEFT * (blade == 'left')}reduction_of_free_peak"


def _swept_heights(
    solution: ForcedSolution, curve: ForcedCurve | FacesCurve, blade: Side
) -> list[float]:
    """Highest point of every sweep of a curve, and of the curve beside it; empty where the balance
    tells the same, or where not every sweep came to its end.
    """
    ranges = peak_ranges(solution, curve.stiffness, curve.ratio, blade)
    sweeps = sweeps_of(solution, curve.stiffness, curve.ratio)
    if all(one.agrees for one in ranges.values()) or any(
        s.found.status == "stopped" for s in sweeps
    ):
        return []
    f, out = curve.answer.frequency, []
    for one in sweeps:
        beside = (f < one.found.frequency.min()) | (f > one.found.frequency.max())
        parts = (one.accelerance[blade], curve.accelerance[blade][beside])
        out.append(max(float(np.abs(part).max(initial=0.0)) for part in parts))
    return out


def _highest_at_end(curve: ForcedCurve | FacesCurve, blade: Side) -> bool:
    size, f = np.abs(curve.accelerance[blade]), curve.answer.frequency
    at = f[int(size.argmax())]
    return bool(at in (f.min(), f.max()))


def _height(solution: ForcedSolution, curve: ForcedCurve | FacesCurve, blade: Side) -> float:
    """Highest of a path, between its points as the free peak is; where a march leaves maxima the
    highest of its peaks, 0 without one.
    """
    size = np.abs(curve.accelerance[blade])
    if isinstance(curve, ForcedCurve) and curve.left:
        return max((p.height for p in solution.numbered_peaks(curve, blade)), default=0.0)
    if isinstance(curve, FacesCurve):
        # nothing is read across a jump
        return max([float(size.max()), *(peak.height for peak in curve.peaks[blade])])
    peaks = measures.path_peaks(curve.answer.frequency, size)
    return max([float(size.max()), *(peak.height for peak in peaks)])


def meet(paths: Sequence[ForcedCurve | FacesCurve]) -> bool:
    """Whether the paths from both ends are one: an end of one lies on the other.

    Ends that pass each other in frequency alone may be on two branches, with the resonance on the
    part between that neither has.
    """
    return any(
        _on(up.answer.frequency[-1], up.accelerance["right"][-1], down)
        or _on(down.answer.frequency[-1], down.accelerance["right"][-1], up)
        for up in paths
        if not up.reversed
        for down in paths
        if down.reversed
    )


def _on(f: float, H: complex, path: ForcedCurve | FacesCurve) -> bool:
    """Whether a point lies between two neighbouring points of a path: frequency, real and
    imaginary part.
    """
    points = np.column_stack(
        [path.answer.frequency, path.accelerance["right"].real, path.accelerance["right"].imag]
    )
    low, high = np.minimum(points[:-1], points[1:]), np.maximum(points[:-1], points[1:])
    at = np.array([f, H.real, H.imag])
    return bool(((low <= at) & (at <= high)).all(axis=1).any())
