"""The blade-damper-blade curve by tmdsimpy: problem as JSON on stdin, curve as JSON on stdout.

Run by bench_tmdsimpy_response.py with the folder of tmdsimpy's own copy as its argument; nothing of
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

#: largest step of the continuation, and the share of the frequency in it: about 300 points
STEP, SHARE = 0.027, 0.9
ROUNDS = 2


def curve(p: dict[str, Any]) -> tuple[Any, Any]:
    """Frequencies in Hz and amplitudes of the first harmonic of the output."""
    M, C, K = (np.array(p[k]) for k in "MCK")
    system = VibrationSystem(M, K, C=C)
    for tangent, normal in zip(p["tangent"], p["normal"], strict=True):
        Q = np.array([tangent, normal])
        system.add_nl_force(ElasticDryFriction2D(Q, Q.T, p["k_t"], p["k_n"], p["mu"], u0=0.0))
    h = np.arange(p["harmonics"] + 1)
    n = len(M)
    load = np.zeros(n * harmonics.Nhc(h))
    load[:n], load[2 * n : 3 * n] = p["static"], p["sine"]
    low, high = (2 * np.pi * f for f in p["sweep"])

    def residual(Uw: Any) -> Any:
        return system.hbm_res(Uw, load, h, Nt=p["samples"])

    solver = NonlinearSolver()
    X, _, dRdX, _ = solver.nsolve(
        lambda U: residual(np.hstack((U, low)))[:2], np.ravel(p["start"]), verbose=False
    )
    start = np.hstack((X, low))
    scale = harmonics.harmonic_wise_conditioning(start, n, h, delta=1e-6)
    scale[-1] = high
    walk = Continuation(
        solver,
        ds0=STEP,
        CtoP=scale,
        RPtoC=1 / np.max(np.abs(np.diag(dRdX * scale[:-1]))),
        config={
            "DynamicCtoP": True,
            "FracLam": SHARE,
            "TargetNfev": 200,
            "MaxSteps": 5000,
            "dsmin": STEP / 1e4,
            "dsmax": STEP,
            "verbose": 0,
        },
    )
    found = walk.continuation(residual, start, low, high)
    x = found[:, :-1].reshape(len(found), -1, n)[:, :, p["output"]]
    return found[:, -1] / (2 * np.pi), np.hypot(x[:, 1], x[:, 2])


def main() -> None:
    """The shortest of several runs after one that compiles."""
    problem = json.load(sys.stdin)
    seconds = []
    for _ in range(ROUNDS + 1):
        begin = time.process_time()
        with contextlib.redirect_stdout(io.StringIO()):
            frequency, amplitude = curve(problem)
        seconds.append(time.process_time() - begin)
    out = {"frequency": frequency.tolist(), "amplitude": amplitude.tolist()}
    print(json.dumps({**out, "seconds": min(seconds[1:]), "version": f"jax {version('jax')}"}))


if __name__ == "__main__":
    main()
