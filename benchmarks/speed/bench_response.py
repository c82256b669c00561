"""Time of forced responses after compilation.

The public problem, the two-blade rig, and what every left-out effect saves.

Seconds of a curve are those after reduction. A saving is the time with the effect over the time
without it, both in this run; the change of the peak it costs stands beside it.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from upd.hbm import condensed
from upd.hbm.coulomb import LIFT, SLIP
from upd.hbm.friction import Law, harmonic_force

# The benchmarks are no package: what they share is found by its folder.
sys.path.append(str(Path(__file__).parents[1]))
import blade_damper_blade as public
from rig_response import Curve, Rig, curve, on_lines, rig

Row = dict[str, Any]
Array = public.Array
SAMPLES, FREQUENCIES = 256, 300
#: harmonics -> target in seconds
PUBLIC = {1: None, 5: 0.5, 15: None}
RIG = {1: 5.0, 5: 30.0}
#: F_C/F_E
STRONG, MEDIUM, WEAK = 194.0, 600.0, 2000.0
#: rows of a face of Gauss points, of a mesh fine enough to tell them apart
MANY_ROWS = (16, 32, 64)
GAUSS: dict[str, Any] = {
    "contact__rule": "gauss",
    "contact__columns": 2,
    "geometry__refine": 2,
    "mesh__element": "hex20",
}
NEAR_A_PEAK = np.linspace(380.0, 400.0, 21)


def best(run: Callable[[], Any], rounds: int = 3) -> tuple[Any, float]:
    """Answer and shortest seconds of several runs, after one that compiles."""
    answer, seconds = run(), []
    for _ in range(rounds):
        begin = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - begin)
    return answer, min(seconds)


def public_curves() -> Iterator[Row]:
    """Seconds of the whole curve, points on its path, milliseconds per point."""
    grid = np.linspace(*public.SWEEP, FREQUENCIES)
    for highest, target in PUBLIC.items():
        answer, seconds = best(lambda highest=highest: public.response(grid, highest, SAMPLES))  # type: ignore[misc]
        n = len(answer.frequency)
        frequency, peak = answer.peak(public.Y2)
        case = (
            f"blade-damper-blade, {FREQUENCIES} frequencies, {SAMPLES} samples, harmonics 0 to "
            f"{highest}"
        )
        told = f"best of 3, {n} points, {answer.status}; peak {peak:.4e} m at {frequency:.2f} Hz"
        yield {
            "name": "time_response",
            "case": case,
            "value": seconds,
            "unit": "s",
            "target": target,
            "note": told,
        }
        yield {"name": "time_point", "case": case, "value": 1e3 * seconds / n, "unit": "ms"}
    told = (
        f"as printed with the original scripts for {public.OCTAVE_POINTS} frequencies, another "
        "machine: not measured here"
    )
    yield {
        "name": "time_response_octave",
        "case": "blade-damper-blade",
        "value": public.OCTAVE_SECONDS,
        "unit": "s",
        "note": told,
    }


def plain_step(
    law: Law, p: int, T: float, dT: Array, N: float, row: Array
) -> tuple[float, Array, int]:
    """One sample of one point in plain Python: traction, its derivative (2, size), state."""
    if N <= 0.0:
        return 0.0, np.zeros_like(dT), LIFT
    limit = law.mu[p] * N
    if abs(T) <= limit:
        return T, dT, 0
    out = np.zeros_like(dT)
    out[0] = np.sign(T) * law.mu[p] * law.k_n[p] * row
    return float(np.sign(T)) * limit, out, SLIP


def plain_force(law: Law, X: Array, E: Array, Q: Array) -> tuple[Array, Array]:
    """Coefficients and Jacobian of the contact force, one sliding direction, loops over points and
    samples in plain Python.
    """
    n, size = E.shape
    force, jacobian = np.zeros_like(X), np.zeros((*X.shape, 2, size))
    for p in range(len(X)):
        w = X[p] @ E.T
        f, d, T, dT, last = (
            np.zeros((2, n)),
            np.zeros((2, n, 2, size)),
            0.0,
            np.zeros((2, size)),
            np.inf,
        )
        # the march begins with the slider at 0, and repeats its period until the traction does
        moved, rows = w[1, 0], E[0]
        for _ in range(40):
            for j in range(n):
                N = max(0.0, law.preload[p] + law.k_n[p] * (w[0, j] - law.gap[p]))
                dT = dT.copy()
                dT[1] += law.k_t[p] * rows
                T, dT, _state = plain_step(law, p, T + law.k_t[p] * moved, dT, N, E[j])
                f[:, j], d[1, j] = (N, T), dT
                d[0, j, 0] = law.k_n[p] * E[j] if N > 0.0 else 0.0
                after = (j + 1) % n
                moved, rows = w[1, after] - w[1, j], E[after] - E[j]
            if abs(T - last) <= 1e-11 * law.mu[p] * f[0].max():
                break
            last = T
        force[p] = f @ Q.T
        jacobian[p] = np.einsum("sn,anbm->asbm", Q, d)
    return force, jacobian


def timed(function: Callable[..., Any], b: Any, X: Array) -> float:
    """Seconds of one evaluation."""
    begin = time.perf_counter()
    function(b.contacts.law, X, b.E, b.Q)
    return time.perf_counter() - begin


def compiled_against_plain() -> Iterator[Row]:
    """One evaluation of force and Jacobian at the peak of the public problem.

    Compiled and in plain Python with numpy.
    """
    for highest in PUBLIC:
        answer = public.response(np.array([145.0, 155.0, 163.0]), highest, SAMPLES)
        b = answer.balance
        X = np.ascontiguousarray(answer.contact_displacement[-1])
        ours, (force, jacobian) = (
            harmonic_force(b.contacts.law, X, b.E, b.Q),
            plain_force(b.contacts.law, X, b.E, b.Q),
        )
        assert ours.jacobian is not None
        # in turns and as often, so that other load on the machine meets both
        rounds = [(timed(harmonic_force, b, X), timed(plain_force, b, X)) for _ in range(10)]
        fast, slow = (min(seconds) for seconds in zip(*rounds, strict=True))
        apart = max(
            np.abs(force / np.abs(ours.force).max() - ours.force / np.abs(ours.force).max()).max(),
            np.abs(jacobian - ours.jacobian).max() / np.abs(ours.jacobian).max(),
        )
        told = (
            f"compiled {1e3 * fast:.3f} ms, plain {1e3 * slow:.1f} ms; the plain one does not "
            f"locate the events between its samples: force and Jacobian differ by {apart:.0e}"
        )
        case = f"force and Jacobian, 2 points, {SAMPLES} samples, harmonics 0 to {highest}"
        yield {
            "name": "speedup_compiled",
            "case": case,
            "value": slow / fast,
            "unit": "times",
            "note": told,
        }


def rig_curves() -> Iterator[Row]:
    """The symmetric rig with 2 x 9 points.

    The whole curve, mirror images as one and every point by itself.
    """
    changes: dict[str, Any] = {"contact__rows": [0, 2, 4], "contact__columns": 3}
    half = on_lines("symmetric-response", **changes)
    full = on_lines("symmetric-response", half.bodies, mesh__symmetry="full", **changes)
    for built in (half, full):
        warm(built)
    for ratio in (STRONG, MEDIUM):
        for highest, target in RIG.items():
            yield from rig_curve(half, ratio, highest, target)
            if ratio == STRONG:
                yield from rig_curve(full, ratio, highest, None)


def rig_curve(built: Rig, ratio: float, highest: int, target: float | None) -> Iterator[Row]:
    """One curve. A path that stopped has no time for the curve: its row has another name."""
    found = curve(built, ratio, highest)
    case = (
        f"symmetric rig, 2 x 9 points, F_C/F_E {ratio:g}, 400 frequencies, harmonics 0 to {highest}"
    )
    name = "time_response" if found.complete else "time_until_stop"
    told = f"{built.size}; {found.told}"
    told += "" if found.complete else "; not the whole curve, so not to be held against the target"
    yield {
        "name": name,
        "case": case,
        "value": found.seconds,
        "unit": "s",
        "target": target,
        "note": told,
    }
    yield {
        "name": "time_point",
        "case": case,
        "value": 1e3 * found.seconds / len(found.answer.frequency),
        "unit": "ms",
    }


def warm(built: Rig) -> None:
    """A few points, so that everything is compiled and loaded."""
    curve(built, WEAK, 1, np.linspace(300.0, 310.0, 3))


def saving(
    name: str,
    case: str,
    slow: tuple[str, Callable[[], Curve]],
    quick: tuple[str, Callable[[], Curve]],
) -> Row:
    """Time with the effect over that without it, the shorter of two each, in turns.

    And what leaving it out does to the peak.
    """
    rounds = [(slow[1](), quick[1]()) for _ in range(2)]
    a, b = (min(curves, key=lambda c: c.seconds) for curves in zip(*rounds, strict=True))
    moved = f"peak {b.frequency - a.frequency:+.3f} Hz, {100 * (b.height / a.height - 1):+.3f} %"
    linear = f"{100 * b.answer.linear.mean():.0f} % of the points linear"
    told = (
        f"{quick[0]} {b.seconds:.2f} s ({b.told}; {linear}); {slow[0]} {a.seconds:.2f} s "
        f"({a.told}); {moved}"
    )
    return {
        "name": name,
        "case": case,
        "value": a.seconds / b.seconds,
        "unit": "times",
        "note": told,
    }


def savings() -> Iterator[Row]:
    """The asymmetric rig: each effect left out alone."""
    usual = on_lines("asymmetric-response")
    full = on_lines("asymmetric-response", usual.bodies, mesh__symmetry="full")
    two = on_lines("asymmetric-response", usual.bodies, contact__directions="two")
    for built in (usual, full, two):
        warm(built)
    for ratio in (WEAK, STRONG):
        case = f"asymmetric rig, {usual.size}, F_C/F_E {ratio:g}, 400 frequencies"
        base, whole, both = (partial(curve, built, ratio, 1) for built in (usual, full, two))
        yield saving("saving_symmetry", case, ("full", whole), ("mirror images as one", base))
        yield saving("saving_directions", case, ("two directions", both), ("auto", base))
        yield saving(
            "saving_harmonics",
            case,
            ("harmonics 0 to 5", partial(curve, usual, ratio, 5)),
            ("0 and 1", base),
        )
        yield saving(
            "saving_fast_exits",
            case,
            ("iterated everywhere", partial(base, fast_exits=False)),
            ("fast exits", base),
        )


def kept_factors() -> Iterator[Row]:
    """Many Gauss points, of which many slip: factors that serve for later corrections against new
    ones for each, in processor seconds of the same run.
    """
    usual = condensed.WORTH_KEEPING
    bodies = None
    for rows in MANY_ROWS:
        built = rig("symmetric-response", bodies, **GAUSS, contact__rows=rows)
        bodies = built.bodies
        warm(built)
        found = {}
        for worth in (usual, np.inf):
            condensed.WORTH_KEEPING = worth
            begin = time.process_time()
            answer = curve(built, STRONG, 7, NEAR_A_PEAK)
            found[worth] = time.process_time() - begin, answer
        condensed.WORTH_KEEPING = usual
        (quick, a), (slow, b) = found.values()
        change = 100 * (a.height / b.height - 1)
        yield {
            "name": "kept_factors",
            "case": f"symmetric rig, {built.size}, F_C/F_E {STRONG:g}, {NEAR_A_PEAK[0]:g} to "
            f"{NEAR_A_PEAK[-1]:g} Hz, harmonics 0 to 7",
            "value": slow / quick,
            "unit": "times",
            "note": f"kept {quick:.2f} s ({a.told}); new each time {slow:.2f} s; peak "
            f"{change:+.4f} %",
        }


def run() -> list[Row]:
    """All rows."""
    return [
        *public_curves(),
        *compiled_against_plain(),
        *rig_curves(),
        *savings(),
        *kept_factors(),
    ]


if __name__ == "__main__":
    for line in run():
        print(line)
