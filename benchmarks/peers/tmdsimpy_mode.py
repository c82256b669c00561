"""A nonlinear mode of the blade-damper-blade problem by tmdsimpy: JSON on stdin, JSON on stdout.

Run by bench_nonlinear_modes.py with the folder of tmdsimpy's own copy as its argument; nothing of
upd is imported. Its planar element with elastic dry friction is the contact law of the problem.
"""

from __future__ import annotations

import contextlib
import io
import json
import sys
import time
from importlib.metadata import version
from typing import Any

import numpy as np

sys.path.insert(0, sys.argv[1])
from tmdsimpy.continuation import Continuation
from tmdsimpy.jax.nlforces.elastic_dry_fric_2d import ElasticDryFriction2D
from tmdsimpy.solvers import NonlinearSolver
from tmdsimpy.utils import harmonic as harmonics
from tmdsimpy.vibration_system import VibrationSystem

#: largest step of the continuation: points close enough to read between them
STEP = 0.02
ROUNDS = 2


def mode(p: dict[str, Any]) -> Any:
    """(points, unknowns): harmonics over the amplitude, omega, xi, log10 of the amplitude."""
    M, C, K = (np.array(p[k]) for k in "MCK")
    system = VibrationSystem(M, K, C=C)
    for tangent, normal in zip(p["tangent"], p["normal"], strict=True):
        Q = np.array([tangent, normal])
        system.add_nl_force(ElasticDryFriction2D(Q, Q.T, p["k_t"], p["k_n"], p["mu"], u0=0.0))
    h = np.arange(p["harmonics"] + 1)
    n, size = len(M), len(M) * harmonics.Nhc(h)
    shape, low, high = np.array(p["shape"]), p["low"], p["high"]
    # static force, and the phase: no sine of the shape
    load, start = np.zeros(size), np.zeros(size)
    load[:n], load[2 * n : 3 * n] = p["static"], M @ shape
    start[:n], start[n : 2 * n] = p["start"][0], shape

    def residual(X: Any) -> Any:
        return system.epmc_res(X, load, h, Nt=p["samples"])

    solver = NonlinearSolver()
    found, *_ = solver.nsolve(
        lambda X: residual(np.hstack((X, low)))[:2],
        np.hstack((start, p["omega"], p["xi"])),
        verbose=False,
    )
    start = np.hstack((found, low))
    walk = Continuation(
        solver,
        ds0=STEP,
        CtoP=harmonics.harmonic_wise_conditioning(start, n, h, delta=1e-3),
        config={
            "DynamicCtoP": True,
            "TargetNfev": 200,
            "MaxSteps": 2000,
            "dsmin": STEP / 1e4,
            "dsmax": STEP,
            "verbose": 0,
            "corrector": "Ortho",
        },
    )
    return walk.continuation(residual, start, low, high)


def main() -> None:
    """The shortest of several runs after one that compiles."""
    problem = json.load(sys.stdin)
    seconds = []
    for _ in range(ROUNDS + 1):
        begin = time.process_time()
        with contextlib.redirect_stdout(io.StringIO()):
            found = mode(problem)
        seconds.append(time.process_time() - begin)
    omega, xi, log_a = found[:, -3:].T
    out = {"log_a": log_a.tolist(), "omega": omega.tolist(), "zeta": (xi / 2 / omega).tolist()}
    print(json.dumps({**out, "seconds": min(seconds[1:]), "version": f"jax {version('jax')}"}))


if __name__ == "__main__":
    main()
