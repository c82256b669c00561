"""Balance with the blades in frequency and whole faces in time: peaks, seconds.

The symmetric damper on the rig's half, friction 0.6, faces worn in under F_C, from rest with
T/N = 0 on both faces; F_C/F_E 600 and 194, 3 harmonics of the blades, 128 samples.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from upd.analyses import make_plan
from upd.analyses.forced.interface_model import by_coulomb, make_interface_model, worn_start
from upd.analyses.seated.bodies import make_bodies
from upd.analyses.seated.interface import make_interface
from upd.hbm.core.newton import Settings
from upd.hbm.faces.balance import SHORTEST, TOLERANCE, interface_response
from upd.linalg.select import threads_used
from upd.scene import load_scene

F_C, MU, DAMPING = 350.0, 0.6, 0.005
RIGHT = 1
#: lattices of the patch (along y, along the slope), and the most seconds by the clock, on two
#: cores, that a curve at 600 may take
PATCHES = {(10, 4): 5.0, (20, 8): 20.0, (34, 12): 90.0}
#: of F_C/F_E: Hz
CURVES = {600.0: np.arange(434.0, 458.0), 194.0: np.arange(420.0, 457.0)}


def run() -> Iterator[dict[str, Any]]:
    """Peak accelerance of the right blade, and seconds."""
    steps = Settings(tolerance=TOLERANCE, smallest_step=SHORTEST)
    for (along_y, along_slope), most in PATCHES.items():
        patch = [f"geometry.patch_along_y={along_y}", f"geometry.patch_along_slope={along_slope}"]
        plan: Any = make_plan(load_scene("symmetric-seated", [*patch, "mesh.symmetry=half"]))
        bodies = make_bodies(plan)
        of = make_interface(plan, bodies)
        model, start = worn_start(
            make_interface_model(plan, bodies, of, friction=MU, centrifugal=F_C, damping=DAMPING),
            of,
            F_C,
        )
        smallest = (along_y, along_slope) == min(PATCHES)
        for ratio, frequencies in CURVES.items():
            if ratio != 600.0 and not smallest:
                continue
            drive = [-1j * F_C / ratio]
            begin = time.process_time()
            found = interface_response(
                model, frequencies, drive, start, fallback=by_coulomb, settings=steps
            )
            seconds = time.process_time() - begin
            case = f"symmetric, worn, {of.n} nodes, F_C/F_E {ratio:g}, up"
            to_accelerance = (2 * np.pi * found.frequency) ** 2 * ratio / F_C / 1e3
            H = to_accelerance * np.abs(found.amplitude[:, 1, RIGHT])
            i = int(H.argmax())
            share = ", ".join(
                f"{100 * part:.0f} % {word}"
                for part, word in zip(found.share[i], ("open", "stick", "slip"), strict=True)
            )
            yield {
                "name": "interface_balance_peak",
                "case": case,
                "value": float(H[i]),
                "unit": "(m/s2)/N",
                "note": f"at {found.frequency[i]:.2f} Hz; {share}; motion left out "
                f"{100 * found.points[i].unresolved:.1f} %; {found.message}",
            }
            yield {
                "name": "interface_balance_seconds",
                "case": case,
                "value": found.seconds,
                "unit": "s",
                "target": most if ratio == 600.0 else None,
                "note": f"by the clock, {threads_used()} threads; {seconds:.3g} s of processors; "
                f"{len(found.frequency)} points",
            }


if __name__ == "__main__":
    for line in run():
        print(line, flush=True)
