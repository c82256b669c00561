"""Balance with the blades in frequency and whole faces in time, beside the march: peaks, seconds.

The symmetric damper on the rig's half, friction 0.6, faces worn in under F_C, from rest with
T/N = 0 on both faces; F_C/F_E 600 and 194, 3 harmonics of the blades, 128 samples. At some of the
points of the curve a march from the balance's own state tells how far it moves away: the same past,
so that only the harmonics left out and the time step differ.

What sticks remembers the way, so that beyond the peak the steps along the curve decide too:
`--largest-step 0.03` takes finer ones, in shares of the motion, `--nodes 198` one lattice alone.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from upd.analyses import make_plan
from upd.analyses.forced.interface_model import by_coulomb, make_interface_model, worn_start
from upd.analyses.seated.bodies import make_bodies
from upd.analyses.seated.interface import make_interface
from upd.hbm.interface_balance import SHORTEST, TOLERANCE, interface_response
from upd.hbm.interface_sweep import stepped_sine
from upd.hbm.newton import Settings
from upd.linalg.select import threads_used
from upd.scene import load_scene

F_C, MU, DAMPING = 350.0, 0.6, 0.005
RIGHT = 1
#: lattices of the patch (along y, along the slope), and the most seconds by the clock, on two
#: cores, that a curve at 600 may take
PATCHES = {(10, 4): 5.0, (20, 8): 20.0, (34, 12): 90.0}
#: of F_C/F_E: Hz
CURVES = {600.0: np.arange(434.0, 458.0), 194.0: np.arange(420.0, 457.0)}
#: of the smallest patch: Hz at which a march starts from the balance
MARCHED = {600.0: (447.0, 448.0, 450.0, 452.0), 194.0: (436.0, 439.0, 442.0, 450.0)}


#: Hz beyond the fold at 600
BEYOND = 452.0


def run(
    largest_step: float = Settings().largest_step, nodes: int | None = None
) -> Iterator[dict[str, Any]]:
    """Peak accelerance of the right blade, seconds, and what a march makes of its points."""
    steps = Settings(
        tolerance=TOLERANCE,
        smallest_step=SHORTEST,
        largest_step=largest_step,
        first_step=min(Settings().first_step, largest_step),
    )
    for (along_y, along_slope), most in PATCHES.items():
        patch = [f"geometry.patch_along_y={along_y}", f"geometry.patch_along_slope={along_slope}"]
        plan: Any = make_plan(load_scene("symmetric-seated", [*patch, "mesh.symmetry=half"]))
        bodies = make_bodies(plan)
        of = make_interface(plan, bodies)
        if nodes not in (None, of.n):
            continue
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
                "note": f"at {found.frequency[i]:.2f} Hz; {share}; forces left out "
                f"{100 * found.truncation[i]:.1f} %; {found.message}",
            }
            yield {
                "name": "interface_balance_seconds",
                "case": case,
                "value": found.seconds,
                "unit": "s",
                "target": most if ratio == 600.0 else None,
                "note": f"by the clock, {threads_used()} threads; {seconds:.3g} s of processors; "
                f"{len(found.frequency)} points, {int(found.iterations.sum())} derivatives",
            }
            if ratio == 600.0:
                yield {
                    "name": "interface_balance_beyond_the_fold",
                    "case": case,
                    "value": float(H[int(np.flatnonzero(found.frequency == BEYOND)[0])]),
                    "unit": "(m/s2)/N",
                    "note": f"at {BEYOND:g} Hz, steps of at most {largest_step:g} of the motion",
                }
            off = []
            for f in MARCHED[ratio] if smallest else ():
                k = int(np.flatnonzero(found.frequency == f)[0])
                marched = stepped_sine(
                    model, [f], drive, found.state_at(k), fallback=by_coulomb, most_periods=400
                )
                here, there = found.amplitude[k, 1, RIGHT], marched.amplitude[0, RIGHT]
                off.append(abs(abs(here) / abs(there) - 1.0))
            if off:
                yield {
                    "name": "interface_balance_against_march",
                    "case": case,
                    "value": float(100.0 * max(off)),
                    "unit": "%",
                    "target": 0.5,
                    "note": "largest at "
                    + ", ".join(
                        f"{f:g} Hz {100 * one:.3f}"
                        for f, one in zip(MARCHED[ratio], off, strict=True)
                    ),
                }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--largest-step", type=float, default=Settings().largest_step)
    parser.add_argument("--nodes", type=int)
    for line in run(**vars(parser.parse_args())):
        print(line, flush=True)
