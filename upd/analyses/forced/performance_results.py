"""Numbers of the peaks over F_C/F_E: the optimum and every branch."""

from __future__ import annotations

from dataclasses import replace

from upd.analyses.forced.performance_curve import Branch, Performance
from upd.analyses.forced.ranges import alike_heights
from upd.analyses.forced.read_points import WANDERS, wanders
from upd.analyses.forced.reduction_results import NOT_ALIKE
from upd.results import Case, Result, withheld


def performance_results(name: str, performance: Performance) -> list[Result]:
    """F_C/F_E reached, the lowest of every branch, the optimum."""
    case, ratios = Case(stiffness=name, name="performance"), performance.highest[0]
    results = (
        [
            Result("lowest_ratio_reached", case, float(ratios[0]), ""),
            Result("highest_ratio_reached", case, float(ratios[-1]), ""),
        ]
        if len(ratios)
        else []
    )
    for branch in performance.branches:
        results += _lowest_of_branch(
            replace(case, branch=branch.name, mode=branch.mode), branch, performance
        )
    optimum = [
        ("optimum_ratio", ""),
        ("optimum_peak", "(m/s2)/N"),
        ("optimum_frequency", "Hz"),
        ("optimum_reduction", "%"),
    ]
    # Where a peak was lost, what is best beyond is not known.
    stopped = not all(branch.complete for branch in performance.branches)
    if performance.optimum is None or stopped or performance.beside:
        reason = _no_optimum(performance)
        return results + [withheld(number, case, unit, reason) for number, unit in optimum]
    ratio, frequency, height = performance.optimum
    values = (ratio, height, frequency, 100.0 * (1.0 - height / performance.free_peak))
    best = [
        Result(number, case, value, unit)
        for (number, unit), value in zip(optimum, values, strict=True)
    ]
    if not performance.sweeps:
        return results + best
    low, high = performance.optimum_heights
    between = performance.optimum_between
    left = [100.0 * (1.0 - one / performance.free_peak) for one in (high, low)]
    why = "the next F_C/F_E of the curve, and all at which a sweep is as low"
    best[0] = replace(best[0], low=between[0], high=between[1], why=why)
    if not alike_heights([low, high]):
        why = _why_apart(performance, ratio)
        best[1] = replace(best[1], low=low, high=high, why=why)
        best[3] = replace(best[3], low=left[0], high=left[1], why=why)
    return results + best


def _lowest_of_branch(case: Case, branch: Branch, performance: Performance) -> list[Result]:
    """Lowest height of one peak over F_C/F_E; not the end of a branch that stopped on the way."""
    names = (
        ("lowest_peak", "(m/s2)/N"),
        ("lowest_peak_at_ratio", ""),
        ("lowest_peak_of_free", "%"),
    )
    k = int(branch.height.argmin()) if len(branch.ratio) else 0
    if not len(branch.ratio) or (not branch.complete and k == 0):
        at = f" at F_C/F_E {branch.ratio[0]:.3g}" if len(branch.ratio) else ""
        reason = f"the peak was lost{at} before it was lowest: {branch.message}"
        return [withheld(name, case, unit, reason) for name, unit in names]
    height = float(branch.height[k])
    values = (height, float(branch.ratio[k]), 100.0 * height / performance.free_peak)
    source = "" if branch.complete else f"down to F_C/F_E {branch.ratio[0]:.3g}, where it was lost"
    results = [
        Result(name, case, value, unit, source=source)
        for (name, unit), value in zip(names, values, strict=True)
    ]
    low = float(branch.least[k])
    if alike_heights([low, height]):
        return results
    ends = {
        "lowest_peak": (low, height),
        "lowest_peak_of_free": tuple(100.0 * v / performance.free_peak for v in (low, height)),
    }
    why = _why_apart(performance, float(branch.ratio[k]))
    return [
        replace(one, low=ends[one.name][0], high=ends[one.name][1], why=why)
        if one.name in ends
        else one
        for one in results
    ]


def _why_apart(performance: Performance, ratio: float) -> str:
    """Why heights at a F_C/F_E are a range."""
    lost = any(wanders(one) for one in performance.sweeps if one.ratio == ratio)
    return WANDERS if lost else NOT_ALIKE


def _no_optimum(performance: Performance) -> str:
    ratios = performance.highest[0]
    lost = [
        f"{b.name} was lost"
        + (f" at F_C/F_E {b.ratio[0]:.3g}" if len(b.ratio) else "")
        + f" ({b.message})"
        for b in performance.branches
        if not b.complete
    ]
    if lost or not len(ratios):
        return "; ".join(lost) or "no F_C/F_E that every peak reaches"
    if performance.beside:
        return f"a higher peak is not followed: {performance.missed}"
    return (
        f"the highest peak is lowest at an end of F_C/F_E {ratios[0]:.3g} to {ratios[-1]:.3g}: "
        "widen performance.lowest and performance.highest"
    )
