"""Speed of the contact solvers on half-space compliances.

Steel on steel, sphere R = 5 mm, 200 N, mu = 0.5.
"""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.contact import normal_contact, tangential_path
from upd.reference.half_space import half_space_compliance
from upd.reference.hertz import sphere_gap

FloatArray = NDArray[np.float64]

E, NU, R, LOAD, MU, CELL = 200e3, 0.3, 5.0, 200.0, 0.5, 0.025


def _patch(n: int, cell: float) -> tuple[FloatArray, FloatArray]:
    """Normal compliance of both bodies and the gap on n x n cells."""
    x = (np.arange(n) - (n - 1) / 2) * cell
    X, Y = np.meshgrid(x, x)
    return 2 * half_space_compliance(n, n, cell, cell, E, NU), np.asarray(
        sphere_gap(np.hypot(X, Y).ravel(), R)
    )


def _best(call: Callable[[], Any], repeats: int = 5) -> tuple[float, Any]:
    """Shortest wall time of a few calls (the first warms up), and the last answer."""
    times, answer = [], call()
    for _ in range(repeats):
        start = perf_counter()
        answer = call()
        times.append(perf_counter() - start)
    return min(times), answer


def _row(name: str, case: str, seconds: float, reference: str, note: str) -> dict[str, Any]:
    return {
        "name": name,
        "case": case,
        "value": seconds,
        "unit": "s",
        "reference": reference,
        "note": note,
    }


def run() -> list[dict[str, Any]]:
    """Rows {name, case, value, unit, reference, note}; a few seconds."""
    rows = []
    fine, fine_gap = _patch(41, CELL / 2)
    seconds, answer = _best(lambda: normal_contact(fine, fine_gap, load=LOAD), repeats=3)
    rows.append(
        _row("time_normal_1681_nodes", "sphere, 41 x 41 lattice", seconds, "", answer.message)
    )
    C, h = _patch(21, CELL)
    normal = normal_contact(C, h, load=LOAD)
    c = normal.contact
    limit = MU * normal.force[c]
    Ct = 2 * half_space_compliance(21, 21, CELL, CELL, E, NU, "both")[: c.size, : c.size]
    T = 0.8 * MU * LOAD * np.interp(np.arange(300), [0, 60, 180, 299], [0, 1, -1, 1])
    seconds, path = _best(lambda: tangential_path(Ct[np.ix_(c, c)], limit, loads=T))
    note = (
        f"{limit.size} nodes, one direction, {int(path.iterations.sum())} steps of the active set, "
        f"{path.fallbacks} fallbacks"
    )
    rows.append(
        _row("time_tangential_cycle_300_steps", "sphere, T* = 0.8 mu N", seconds, "0.3 s", note)
    )
    return rows


if __name__ == "__main__":
    for row in run():
        print(row)
