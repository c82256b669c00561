"""Pseudo-arclength continuation of r(x, p) = 0.

It passes folds, lands on wanted parameter values, and its message gives place and reason of a stop.

References
----------
H. B. Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems (1977);
R. Seydel, Practical Bifurcation and Stability Analysis (2010), ch. 4.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upd.hbm.core.newton import EPS, ROUNDING, FloatArray, Function, Scale, Settings
from upd.hbm.core.path_step import State, advance, begin
from upd.labels import Shown

log = logging.getLogger(__name__)

Status = Literal["complete", "stopped", "step limit"]
#: growth of the solution while p stands still that is taken for one without bound
UNBOUNDED = 10.0


@dataclass(frozen=True, repr=False)
class Path(Shown):
    """Points of a path.

    Attributes
    ----------
    x : (n_step, n) ndarray
        Unknowns.
    p : (n_step,) ndarray
        Parameter.
    iterations : (n_step,) ndarray of int
        Newton iterations.
    state : State
        The last state, from which the path can be continued.
    status : {"complete", "stopped", "step limit"}
    message : str
        Where and why it ended.
    """

    x: FloatArray
    p: FloatArray
    iterations: NDArray[np.int64]
    state: State
    status: Status
    message: str


def follow(
    function: Function,
    start: State | tuple[FloatArray, float],
    end: float,
    *,
    scale: Scale,
    p_scale: float,
    wanted: FloatArray | None = None,
    turned: float | None = None,
    settings: Settings | None = None,
) -> Path:
    """Path from a solved point to a value of the parameter.

    A failed corrector shortens the step; when that ends, the path so far comes back with status
    "stopped". So does one that comes to a solution at a wanted value a second time: it is closed,
    or runs back on itself, and does not arrive.

    Parameters
    ----------
    function : callable
        (x, p, with Jacobian) -> residual (n,), Jacobian (n, n) or None, derivative by p (n,).
    start : State, or tuple of (n,) ndarray and float
        A solved point (x, p), or the state of an earlier path.
    end : float
        Parameter at which the path is complete.
    scale : callable
        x (n,) -> sizes of the unknowns (n,).
    p_scale : float
        Size of the parameter.
    wanted : (k,) ndarray, optional
        Parameter values that are hit exactly.
    turned : float, optional
        A value on the other side of the start; a path that comes back as far has reversed its
        direction for good and ends there.
    settings : Settings, optional

    Returns
    -------
    Path
    """
    s = settings or Settings()
    state = (
        start
        if isinstance(start, State)
        else begin(function, start[0], start[1], scale, p_scale, s, end)
    )
    marks = np.unique(np.append(np.asarray([] if wanted is None else wanted, dtype=float), end))
    rest = 0
    xs, ps, counts = [state.x], [state.p], [0]
    passed: dict[float, list[FloatArray]] = {float(mark): [] for mark in marks}
    while len(ps) < s.most_points:
        if (end - state.p) * state.direction <= 0:
            return _path(
                xs, ps, counts, state, "complete", f"reached p = {end:.9g} in {len(ps)} points"
            )
        found, state = advance(function, state, marks, scale, p_scale, s)
        if found is None:
            message = (
                f"stopped at p = {state.p:.9g}: no convergence with the smallest step; refine "
                "the samples or change the start"
            )
            log.warning(message)
            return _path(xs, ps, counts, state, "stopped", message)
        rest = len(ps) if abs(found.p - ps[-1]) > 4 * EPS * abs(found.p) else rest
        if rest < len(ps) and np.abs(found.x).max() > UNBOUNDED * np.abs(xs[rest]).max() > 0:
            message = (
                f"stopped at p = {found.p:.9g}: the answer grows without bound there; it needs "
                "damping, or more friction"
            )
            log.warning(message)
            return _path(
                xs[: rest + 1], ps[: rest + 1], counts[: rest + 1], state, "stopped", message
            )
        left = rest == len(ps)
        xs.append(found.x)
        ps.append(found.p)
        counts.append(found.iterations)
        there = passed.get(found.p, [])
        if left and any(np.abs((found.x - x) / scale(x)).max() <= ROUNDING for x in there):
            message = (
                f"stopped at p = {found.p:.9g}: the path came to the same solution a second time; "
                "it is closed, or runs back on itself"
            )
            log.warning(message)
            return _path(xs, ps, counts, state, "stopped", message)
        there.append(found.x)
        if turned is not None and (turned - state.p) * state.direction > 0:
            message = (
                f"stopped at p = {state.p:.9g}: the path reversed its direction and came back "
                f"past {turned:.9g}"
            )
            log.warning(message)
            return _path(xs, ps, counts, state, "stopped", message)
    return _path(
        xs,
        ps,
        counts,
        state,
        "step limit",
        f"{s.most_points} points used before p = {end:.9g}; it is at p = {state.p:.9g}",
    )


def _path(
    xs: list[FloatArray],
    ps: list[float],
    counts: list[int],
    state: State,
    status: Status,
    message: str,
) -> Path:
    return Path(
        np.array(xs), np.array(ps), np.array(counts, dtype=np.int64), state, status, message
    )
