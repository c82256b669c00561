"""Forces on both faces of the dampers seated between the rig's blades, and the seconds of it.

F_C raised from zero to 350 N in ten steps, over-pressed by half and let go to 350 N, and lowered to
a tenth; friction 0.6. Elastic blades and damper, every node of both faces.
"""

from __future__ import annotations

from collections.abc import Iterator
from time import perf_counter
from typing import Any

import numpy as np

from upd.analyses import make_plan
from upd.analyses.seated.bodies import make_bodies
from upd.analyses.seated.interface import make_interface
from upd.contact.rigid_damper import equilibrium
from upd.scene import load_scene
from upd.scene.forced_contact import SIDES

F_C, MU = 350.0, 0.6
#: left and right face to the horizontal, deg
ANGLES = {"symmetric": (45.0, 45.0), "asymmetric": (90.0, 30.0)}


def run() -> Iterator[dict[str, Any]]:
    """Normal and tangential force of each face, beside the statics of full friction."""
    for name, (left, right) in ANGLES.items():
        plan: Any = make_plan(load_scene(f"{name}-response", ["mesh.element=hex8i"]))
        made = perf_counter()
        of = make_interface(plan, make_bodies(plan))
        solved = perf_counter()
        up, over = np.linspace(0.1, 1.0, 10), np.linspace(1.1, 1.5, 5)
        back, down = np.linspace(1.4, 1.0, 5), np.linspace(0.9, 0.1, 9)
        found = of.seat(MU, F_C * np.concatenate((up, over, back, down)))
        end = perf_counter()
        force = of.face_forces(found)
        states = {
            "raised to 350 N": (9, equilibrium(left, right, F_C, MU, "opposing")),
            "over-pressed to 525 N, back to 350 N": (19, None),
            "lowered to 35 N": (28, None),
        }
        for case, (step, want) in states.items():
            for k, side in enumerate(SIDES):
                for j, letter in ((0, "N"), (2, "T")):
                    known = (
                        None
                        if want is None
                        else getattr(want, f"{'normal' if j == 0 else 'tangential'}_{side}")
                    )
                    yield {
                        "name": f"seated_{letter}_{side}",
                        "case": f"{name}, {case}",
                        "value": float(force[step, k, j]),
                        "unit": "N",
                        "reference": known,
                        "note": "" if known is None else "full friction against F_C",
                    }
        yield {
            "name": "seated_seconds",
            "case": f"{name}, {of.n} nodes, {len(found.force)} steps",
            "value": end - solved,
            "unit": "s",
            "note": f"after {solved - made:.1f} s for meshes, matrices and condensation; "
            f"{int(found.iterations.sum())} Newton steps, {found.fallbacks} fallbacks",
        }


if __name__ == "__main__":
    for line in run():
        print(line)
