"""Stepped sine by time march, contact by the whole of both faces: peaks up and down, and seconds.

The symmetric damper on the rig's half, 60 nodes, friction 0.6, faces worn in under F_C, from rest
with T/N = 0 on both faces; F_C/F_E 600 and 194, up and down in steps of 2 Hz and of 1 Hz near the
peaks, with jumps ahead and without: what they spare, and that they lead to the same motions. Then
what a step costs, stuck and rocking, there and for a rigid damper on springs at 60 and 2 points.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from upd.analyses import make_plan
from upd.analyses.forced.interface_model import by_coulomb, make_interface_model, worn_start
from upd.analyses.seated.bodies import make_bodies
from upd.analyses.seated.interface import make_interface
from upd.hbm.interface_march import InterfaceMarch
from upd.hbm.interface_state import InterfaceModel, InterfaceState, resting
from upd.hbm.interface_sweep import SteppedSine, stepped_sine
from upd.scene import load_scene

F_C, MU, DAMPING = 350.0, 0.6, 0.005
RIGHT = 1
TOLERANCE, SAMPLES = 2e-3, 128
#: the patch's default lattice
PATCH = ("geometry.patch_along_y=10", "geometry.patch_along_slope=4")
#: of F_C/F_E: Hz
SWEEPS = {
    600.0: np.concatenate([np.arange(434.0, 446.0, 2.0), np.arange(446.0, 457.0)]),
    194.0: np.concatenate([np.arange(420.0, 436.0, 2.0), np.arange(436.0, 457.0)]),
}
#: N/mm of each face: normal, tangential
SPRINGS = 4.6e6, 1.5e6


def run() -> Iterator[dict[str, Any]]:
    """Peak accelerance of the right blade and its frequency; seconds of a sweep and of a step."""
    plan: Any = make_plan(load_scene("symmetric-seated", [*PATCH, "mesh.symmetry=half"]))
    bodies = make_bodies(plan)
    of = make_interface(plan, bodies)
    model, start = worn_start(
        make_interface_model(plan, bodies, of, friction=MU, centrifugal=F_C, damping=DAMPING),
        of,
        F_C,
    )
    for ratio, up in SWEEPS.items():
        plain = dict(both_ways(model, start, ratio, up, accelerate=False))
        for way, (found, seconds) in both_ways(model, start, ratio, up, accelerate=True):
            case = f"symmetric, worn, {of.n} nodes, F_C/F_E {ratio:g}, {way}"
            to_accelerance = (2 * np.pi * found.frequency) ** 2 / (F_C / ratio) / 1e3
            H = to_accelerance * np.abs(found.amplitude[:, RIGHT])
            i = int(H.argmax())
            share = ", ".join(
                f"{100 * part:.0f} % {word}"
                for part, word in zip(found.share[i], ("open", "stick", "slip"), strict=True)
            )
            top = to_accelerance[i] * found.highest[i, RIGHT]
            yield {
                "name": "interface_march_peak",
                "case": case,
                "value": float(H[i]),
                "unit": "(m/s2)/N",
                "note": f"at {found.frequency[i]:g} Hz; {share}; at most {top:.4g} in the last "
                f"periods; {found.message}",
            }
            yield {
                "name": "interface_march_seconds",
                "case": case,
                "value": seconds,
                "unit": "s",
                "note": f"{len(found.frequency)} frequencies, {int(found.periods.sum())} periods "
                f"of {SAMPLES} steps, {int(found.fallbacks.sum())} by the solver behind Newton's, "
                f"{int(found.accepted.sum())} jumps kept and {int(found.rejected.sum())} not",
            }
            slow, seconds = plain[way]
            off = np.abs(found.amplitude[:, RIGHT] / slow.amplitude[:, RIGHT])
            yield {
                "name": "interface_march_jumps",
                "case": case,
                "value": float(np.abs(off - 1.0).max()),
                "unit": "",
                "note": f"most that jumps change of an amplitude, tolerance {TOLERANCE:g}; without "
                f"them {int(slow.periods.sum())} periods, {seconds:.1f} s",
            }
    yield from steps(model, start)


def both_ways(
    model: InterfaceModel, state: InterfaceState, ratio: float, up: Any, *, accelerate: bool
) -> Iterator[tuple[str, tuple[SteppedSine, float]]]:
    """Up, then down from there; seconds of the processor."""
    for way, frequencies in (("up", up), ("down", up[::-1])):
        begin = time.process_time()
        found = stepped_sine(
            model,
            frequencies,
            [-1j * F_C / ratio],
            state,
            samples=SAMPLES,
            tolerance=TOLERANCE,
            fallback=by_coulomb,
            accelerate=accelerate,
        )
        state = found.state
        yield way, (found, time.process_time() - begin)


def steps(model: InterfaceModel, start: InterfaceState) -> Iterator[dict[str, Any]]:
    """At the stuck peak, of the last 20 of 120 periods."""
    n = model.n
    every = np.arange(n)
    middle = [half[len(half) // 2] for half in (every[: n // 2], every[n // 2 :])]
    cases = (
        ("whole interface", model, start),
        ("springs", *on_springs(model, start, every)),
        ("springs", *on_springs(model, start, np.array(middle))),
    )
    grid = np.arange(300.0, 500.0)
    for name, one, at in cases:
        linear = one.linear_response(grid, [1.0], stuck=True)[:, RIGHT]
        top = float(grid[np.abs(linear).argmax()])
        for ratio in (1e6, 194.0):
            march = InterfaceMarch(one, top, [-1j * F_C / ratio], SAMPLES, by_coulomb)
            state = at.copy()
            for _ in range(100):
                march.period(state)
            begin = time.process_time()
            periods = [march.period(state) for _ in range(20)]
            seconds = (time.process_time() - begin) / (20 * SAMPLES)
            counts = np.mean([period.counts for period in periods], axis=0)
            share = ", ".join(
                f"{100 * part:.0f} % {kind}"
                for part, kind in zip(counts, ("open", "stick", "slip"), strict=True)
            )
            newton = np.mean([period.newton for period in periods])
            yield {
                "name": "interface_march_step",
                "case": f"{name}, {one.n} nodes, {top:g} Hz, F_C/F_E {ratio:g}",
                "value": 1e6 * seconds,
                "unit": "us",
                "note": f"{share}; {newton:.2f} Newton steps a step",
            }


def on_springs(
    model: InterfaceModel, start: InterfaceState, nodes: Any
) -> tuple[InterfaceModel, InterfaceState]:
    """The damper rigid, on springs at some nodes; of its motions those that they hold.

    A slider behind springs is a node of compliance diag(1/k_n, 1/k_t, 1/k_t).
    """
    n, k = model.n, len(nodes)
    rows = np.concatenate([nodes, n + nodes, 2 * n + nodes])
    share = 2.0 / (k * model.copies)
    kn, kt = (share * spring for spring in SPRINGS)
    # x and z, or also what turns about y
    r = 2 if k == 2 else len(model.load)
    Phi, B = model.shapes[rows], model.columns[rows][:, :r]
    force = start.f.reshape(3, n)[:, nodes]
    if k < n:
        force = np.zeros((3, k))
        force[0] = np.linalg.lstsq(B[:k].T, model.load[:r], rcond=None)[0]
    G = np.diag(np.repeat([1.0 / kn, 1.0 / kt, 1.0 / kt], k))
    w = -G @ force.ravel() - Phi @ (Phi.T @ force.ravel() / model.omega**2)
    made = replace(
        model,
        shapes=Phi,
        compliance=G,
        columns=B,
        mass=model.mass[:r, :r],
        load=model.load[:r],
        gap=w[:k],
        friction=model.friction[nodes],
        pushed=model.pushed[rows],
        seen_contact=model.seen_contact[:, rows],
    )
    return made, resting(made, force.T, w[k:].reshape(2, k).T, np.zeros(k), np.zeros(r))


if __name__ == "__main__":
    for line in run():
        print(line, flush=True)
