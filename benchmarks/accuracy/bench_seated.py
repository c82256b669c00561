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
from upd.contact.equilibrium import equilibrium
from upd.scene import load_scene
from upd.scene.forced_contact import SIDES

F_C, MU = 350.0, 0.6
#: left and right face to the horizontal, deg
ANGLES = {"symmetric": (45.0, 45.0), "asymmetric": (90.0, 30.0)}
#: elements up the slope of the wedge's patch, as many per mm along it: the ladder of its stiffness
LADDER = (4, 8, 12, 16)
#: the thesis's contact nodes: 455 a face
THESIS = ("geometry.patch_along_y=34", "geometry.patch_along_slope=12", "mesh.symmetry=full")
STEPS = 20


def run() -> Iterator[dict[str, Any]]:
    """Forces beside statics; stiffness over the patch's mesh; seconds at the thesis's nodes."""
    yield from forces()
    yield from stiffness()
    yield from seconds()


def stiffness() -> Iterator[dict[str, Any]]:
    """Stuck stiffness of the nodes that touch, and of whole faces, over the mesh of the patch."""
    for slope in LADDER:
        along = 2 * round(slope * 42.5 / 30.0)
        over = [f"geometry.patch_along_slope={slope}", f"geometry.patch_along_y={along}"]
        plan: Any = make_plan(load_scene("symmetric-seated", over))
        of = make_interface(plan, make_bodies(plan), "platforms")
        found = of.seat(MU, F_C * np.arange(1, STEPS + 1) / STEPS)
        closed = found.state[-1] > 0
        area = float(of.area[closed].sum() / of.area.sum())
        for name, on in (("nodes that touch", closed), ("whole faces", np.ones(of.n, bool))):
            case = f"wedge, {slope} x {along} elements, {name}"
            face, leg = of.face_stiffness(0, on), of.leg_stiffness(on)
            note = f"{100.0 * area:.1f} % of the patch touch" if on is closed else ""
            for label, value in (
                ("seated_face_K_N", face[0]),
                ("seated_face_K_T", face[2]),
                ("seated_leg_K_N", leg[0, 0]),
            ):
                yield {
                    "name": label,
                    "case": case,
                    "value": float(value),
                    "unit": "N/mm",
                    "note": note,
                }


def seconds() -> Iterator[dict[str, Any]]:
    """F_C raised, lowered and raised again at 455 nodes a face, both faces, full model."""
    plan: Any = make_plan(load_scene("symmetric-seated", THESIS))
    begin = perf_counter()
    of = make_interface(plan, make_bodies(plan))
    made = perf_counter()
    way = np.concatenate(
        (
            np.arange(1, STEPS + 1) / STEPS,
            np.linspace(1.0, 0.1, STEPS + 1)[1:],
            np.linspace(0.1, 1.0, STEPS + 1)[1:],
        )
    )
    for mu in (0.6, 0.3):
        start = perf_counter()
        found = of.seat(mu, F_C * way)
        took = perf_counter() - start
        case = f"wedge, full model, {of.n} nodes, mu {mu:g}, {len(way)} steps"
        note = f"{int(found.iterations.sum())} Newton steps, {found.fallbacks} fallbacks"
        yield {
            "name": "seated_history_seconds",
            "case": case,
            "value": took,
            "unit": "s",
            "target": 20.0,
            "note": note,
        }
        yield {
            "name": "seated_step_seconds",
            "case": case,
            "value": took / len(way),
            "unit": "s",
            "target": 0.5,
            "note": f"after {made - begin:.1f} s for meshes and condensation",
        }


def forces() -> Iterator[dict[str, Any]]:
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
