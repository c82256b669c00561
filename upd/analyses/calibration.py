"""How fast this machine is, measured in a few seconds on a clamped cube of hexahedra."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from scipy.linalg import lapack
from scipy.sparse import csr_array
from threadpoolctl import threadpool_limits

from upd.fem import Material, box_mesh, stiffness
from upd.linalg.pardiso import load
from upd.linalg.rates import REFERENCE, Rates
from upd.linalg.select import has_pardiso, threads
from upd.linalg.speed import FactorSpeed, factor_speed

#: hexahedra along an edge of the cube, rows of the dense matrix, small calls
_EDGE, _DENSE, _CALLS = 22, 1200, 20000


def calibrate() -> Rates:
    """Rates of this machine.

    The best of three tries each, by the time of this process: other work disturbs little.
    """
    lines = np.linspace(0.0, 10.0, _EDGE + 1)
    box, steel = box_mesh(lines, lines, lines), Material(E=200e3, nu=0.3)
    free = np.flatnonzero(np.repeat(box.points[:, 2] > 0.0, 3))
    K = csr_array(stiffness(box, steel, "hex8")[free][:, free])
    A = np.eye(_DENSE) + np.ones((_DENSE, _DENSE)) / _DENSE
    if has_pardiso():
        # Loaded first, so that its threads are limited too.
        load()
    with threadpool_limits(limits=1):
        elements = box.n_hex / _best(lambda: stiffness(box, steel, "hex8"))
        dense = _DENSE**3 / 3.0 / _best(lambda: lapack.dpotrf(A, lower=1))
        calls = _CALLS / _best(_small_calls)
        found = _factor_speed(K, elements, dense)
    speedup = 1.0
    if has_pardiso() and threads() > 1:
        with threadpool_limits(limits=1):
            alone = factor_speed(K, time.perf_counter).flops
        speedup = max(1.0, factor_speed(K, time.perf_counter).flops / alone)
    return Rates(
        found.flops,
        found.entries,
        found.solve_bytes,
        dense,
        elements,
        calls,
        speedup,
        measured=True,
    )


def _factor_speed(K: csr_array, elements: float, dense: float) -> FactorSpeed:
    """Of one thread; without PARDISO as much faster or slower as the rest is."""
    if has_pardiso():
        return factor_speed(K, time.process_time)
    arrays = elements / REFERENCE.elements
    return FactorSpeed(
        REFERENCE.factor_flops * dense / REFERENCE.dense_flops,
        REFERENCE.analysis_entries * arrays,
        REFERENCE.solve_bytes * arrays,
    )


def _best(work: Callable[[], object], tries: int = 3) -> float:
    """Seconds of the fastest try."""
    found = []
    for _ in range(tries):
        begin = time.process_time()
        work()
        found.append(time.process_time() - begin)
    return min(found)


def _small_calls() -> None:
    a = np.eye(8)
    for _ in range(_CALLS):
        a = a @ a
