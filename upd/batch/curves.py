"""Convergence curves: a number along its ladder, with its rate, its limit, and the cost of every
level.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.convergence import Extrapolation, change_order, extrapolate, fit_rate
from upd.batch.ladder import Key, SolvedPoint, matching

Array = NDArray[np.float64]

#: Numbers of the raw bodies: their error is taken against the converged value on the same bodies,
#: not against the half-space.
_SAME_BODIES = re.compile(r"approach|f\d+_(free|glued)")
#: order of change below which a number is said not to converge: a logarithm has 0, the edge of a
#: punch less
_CONVERGES = 0.2
#: spread in % of the last three levels up to which a number without a clear order counts as settled
_SETTLED = 5.0


@dataclass(frozen=True)
class ConvergenceCurve:
    """One number of one case along one ladder.

    Attributes
    ----------
    error
        (n,), fractions of ``reference``.
    against
        What the reference is.
    order
        The fitted rate; nan for none.
    thesis_error
        Relative error of a printed value.
    limit
        Where the ladder itself leads.
    change
        Order at which the number still changes, `upd.analyses.convergence.change_order`.
    """

    curve: str
    name: str
    case: str
    labels: tuple[str, ...]
    h: tuple[float, ...]
    error: tuple[float, ...]
    seconds: tuple[float, ...]
    memory_mb: tuple[float, ...]
    reference: float
    against: str
    order: float = float("nan")
    thesis_error: float | None = None
    limit: Extrapolation | None = None
    change: float = float("nan")

    @property
    def verdict(self) -> str:
        """Whether the number converges under refinement, in words."""
        if len(self.error) < 3:
            return "too few levels"
        if "no limit" in self.against:
            return f"grows like h^{self.change:.2f}: no limit"
        if np.isfinite(self.change) and self.change >= _CONVERGES:
            return f"converges, order {self.change:.1f}"
        last = [1.0 + e for e in self.error[-3:]]
        spread = 100.0 * (max(last) / min(last) - 1.0) if min(last) > 0.0 else float("inf")
        return (
            f"{'settled' if spread <= _SETTLED else 'not settled'}: last three within "
            f"{spread:.2g} %"
        )


def make_curves(solved: Iterable[SolvedPoint], names: Iterable[str]) -> list[ConvergenceCurve]:
    """Curves of the numbers whose names match ``names`` (shell patterns).

    Failed points are left out.
    """
    good = [one for one in solved if not one.outcome.failure]
    ladders: dict[str, list[SolvedPoint]] = {}
    for one in good:
        ladders.setdefault(one.point.curve, []).append(one)
    curves = []
    for key in matching(good, names):
        finest = _common_limit(ladders, key) if _SAME_BODIES.fullmatch(key[0]) else None
        for points in ladders.values():
            mine = [p for p in points if np.isfinite(p.values.get(key, np.nan))]
            # What ends in zero has no relative error.
            if mine and mine[-1].values[key]:
                curves.append(_curve(key, mine, finest))
    return curves


def _common_limit(ladders: Mapping[str, list[SolvedPoint]], key: Key) -> Extrapolation | None:
    """Converged value on the same bodies: extrapolated from the ladder with the finest mesh."""
    fits = []
    for points in ladders.values():
        mine = [p for p in points if np.isfinite(p.values.get(key, np.nan))]
        if len({p.point.h for p in mine}) >= 3:
            fit = extrapolate(
                [p.point.h for p in mine], [p.values[key] for p in mine], orders=(1.0, 3.0)
            )
            finest = min(mine, key=lambda p: p.point.h)
            # The finest ladder; among equals the one nearest to its own extrapolation.
            fits.append(
                (
                    -finest.outcome.n_dof,
                    abs(finest.values[key] / fit.limit - 1.0) + fit.scatter,
                    fit,
                )
            )
    return min(fits, key=lambda found: found[:2])[2] if fits else None


def _curve(
    key: Key, points: Sequence[SolvedPoint], common: Extrapolation | None
) -> ConvergenceCurve:
    values = np.array([p.values[key] for p in points])
    h = [p.point.h for p in points]
    own = extrapolate(h, values) if len(set(h)) >= 3 else None
    change = change_order(h, values)
    order = None
    if common is not None:
        error, reference, against = (
            values / common.limit - 1.0,
            common.limit,
            "converged value, same bodies",
        )
    elif all(key in p.errors for p in points):
        error = np.array([p.errors[key] for p in points])
        reference, against = float(values[-1] / (1.0 + error[-1])), "reference"
    elif change < _CONVERGES:
        # No limit to extrapolate to.
        reference, against, order = float(values[-1]), "finest level, no limit", float("nan")
        error = values / reference - 1.0
    else:
        reference = own.limit if own else float(values[-1])
        error, against = values / reference - 1.0, "converged value"
    order = fit_rate(h, error) if order is None else order
    printed = next((p.printed_errors[key] for p in points if key in p.printed_errors), None)
    seconds = tuple(p.outcome.seconds for p in points)
    return _made(
        key,
        points,
        error,
        seconds,
        float(reference),
        against,
        order=order,
        thesis_error=printed,
        limit=own,
        change=change,
    )


def finest_curves(
    solved: Iterable[SolvedPoint], keys: Iterable[Key], seconds: Callable[[SolvedPoint], float]
) -> list[ConvergenceCurve]:
    """Curves of ladders whose levels are no sizes: every number against that of the finest level.

    A number the finest level does not have, a second peak for example, has nothing to be compared
    with; what the variation does not touch has no error to show.
    """
    good = [one for one in solved if not one.outcome.failure]
    curves = []
    for key in keys:
        mine = [p for p in good if np.isfinite(p.values.get(key, np.nan))]
        if len(mine) < 2 or mine[-1] is not good[-1]:
            continue
        values = np.array([p.values[key] for p in mine])
        reference = float(values[-1])
        error = values / reference - 1.0 if reference else np.zeros(0)
        if error.any():
            curves.append(
                _made(key, mine, error, tuple(map(seconds, mine)), reference, "finest level")
            )
    return curves


def _made(
    key: Key,
    points: Sequence[SolvedPoint],
    error: Array,
    seconds: tuple[float, ...],
    reference: float,
    against: str,
    **more: Any,
) -> ConvergenceCurve:
    name, case = key
    return ConvergenceCurve(
        curve=points[0].point.curve,
        name=name,
        case=case.label,
        labels=tuple(p.point.label for p in points),
        h=tuple(p.point.h for p in points),
        error=tuple(map(float, error)),
        seconds=seconds,
        memory_mb=tuple(p.outcome.memory_mb for p in points),
        reference=reference,
        against=against,
        **more,
    )
