"""Stepped sine by time march, contact by the whole of both faces: peaks up and down, and seconds.

The symmetric damper on the rig's half, 60 nodes, friction 0.6, faces worn in under F_C, from rest
with T/N = 0 on both faces; F_C/F_E 600 and 194, up and down in steps of 2 Hz and of 1 Hz near the
peaks.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from upd.analyses import make_plan
from upd.analyses.forced.interface_model import by_coulomb, make_interface_model, worn_start
from upd.analyses.seated.bodies import make_bodies
from upd.analyses.seated.interface import make_interface
from upd.hbm.interface_sweep import stepped_sine
from upd.scene import load_scene

F_C, MU, DAMPING = 350.0, 0.6, 0.005
RIGHT = 1
#: the patch's default lattice
PATCH = ("geometry.patch_along_y=10", "geometry.patch_along_slope=4")
#: of F_C/F_E: Hz
SWEEPS = {
    600.0: np.concatenate([np.arange(434.0, 446.0, 2.0), np.arange(446.0, 457.0)]),
    194.0: np.concatenate([np.arange(420.0, 436.0, 2.0), np.arange(436.0, 457.0)]),
}


def run() -> Iterator[dict[str, Any]]:
    """Peak accelerance of the right blade, its frequency, and the seconds of each sweep."""
    plan: Any = make_plan(load_scene("symmetric-seated", [*PATCH, "mesh.symmetry=half"]))
    bodies = make_bodies(plan)
    of = make_interface(plan, bodies)
    model, start = worn_start(
        make_interface_model(plan, bodies, of, friction=MU, centrifugal=F_C, damping=DAMPING),
        of,
        F_C,
    )
    for ratio, up in SWEEPS.items():
        force, state = F_C / ratio, start
        for way, frequencies in (("up", up), ("down", up[::-1])):
            found = stepped_sine(
                model, frequencies, [-1j * force], state, tolerance=2e-3, fallback=by_coulomb
            )
            state = found.state
            case = f"symmetric, worn, {of.n} nodes, F_C/F_E {ratio:g}, {way}"
            to_accelerance = (2 * np.pi * found.frequency) ** 2 / force / 1e3
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
                "value": float(found.seconds.sum()),
                "unit": "s",
                "note": f"{len(found.frequency)} frequencies, {int(found.periods.sum())} periods "
                f"of 128 steps, {int(found.fallbacks.sum())} by the solver behind Newton's",
            }


if __name__ == "__main__":
    for line in run():
        print(line, flush=True)
