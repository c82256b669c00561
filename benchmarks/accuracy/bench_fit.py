"""Fits of contact stiffness: made-up targets, and the two measured frequencies of a thesis.

Run: .venv/bin/python benchmarks/accuracy/bench_fit.py (a minute).
"""

from __future__ import annotations

import time

import numpy as np

import upd
from upd.fitting import LinearResponses, read_parameters, read_targets

SCENE = upd.load_scene("asymmetric-response", {"contact.stiffness": ["thesis"]})
RIGHT, LEFT = "stiffness.thesis.right", "stiffness.thesis.left"
BOTH = f"{RIGHT}.K_N+{RIGHT}.K_T"
MODES = "stuck_in_phase={} Hz{w},stuck_out_of_phase={} Hz{w}"


def made_up() -> None:
    """Targets computed from known parameters, and how near the fit comes to these."""
    targets = read_targets(MODES.format(1, 1, w=""))
    for vary, factors in (
        ([f"{RIGHT}.K_T=x0.2:x10", f"{LEFT}.K_T=x0.01:x10"], (0.4, 0.07)),
        ([f"{BOTH}=x0.2:x10", f"{LEFT}.K_T=x0.01:x10"], (2.485, 0.07)),
    ):
        responses = LinearResponses(SCENE, targets, read_parameters(SCENE, vary))
        numbers, _ = responses.at(np.log(factors))
        begin = time.perf_counter()
        responses.at(1.01 * np.log(factors))
        took = time.perf_counter() - begin
        found = upd.fit(SCENE, MODES.format(*(repr(float(v)) for v in numbers), w=""), vary)
        off = np.abs(np.exp(found.answers[0]) / factors - 1.0).max()
        print(
            f"made up, factors {factors}: {found.status}, {len(found.answers)} answer(s), off by "
            f"{off:.1e} at most; {found.evaluations} models, {1e3 * took:.1f} ms an "
            f"evaluation with derivatives, {found.seconds:.1f} s"
        )


def measured() -> None:
    """377 and 440 Hz measured; what the stiffness would have to be."""
    for out_of_phase, vary in ((440.5, BOTH), (439.8, f"{RIGHT}.K_T")):
        wanted = MODES.format(377.0, out_of_phase, w="")
        print(upd.fit(SCENE, wanted, [vary, f"{LEFT}.K_T"]))
    members = [(2.485, 2.485, 0.070), (1.0, 2.80, 0.081)]
    vary = [f"{RIGHT}.K_N", f"{RIGHT}.K_T", f"{LEFT}.K_T"]
    responses = LinearResponses(
        SCENE, read_targets(MODES.format(1, 1, w="")), read_parameters(SCENE, vary)
    )
    for factors in members:
        print(f"factors {factors}: {responses.at(np.log(factors))[0]} Hz")
    print(upd.fit(SCENE, MODES.format(377.0, 440.2, w=" +- 0.5 Hz"), vary))


if __name__ == "__main__":
    made_up()
    measured()
