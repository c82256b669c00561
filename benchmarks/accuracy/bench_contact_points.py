"""What contact points and elements leave in the frequencies of a response.

Stuck frequencies of ``symmetric-response`` with the thesis's stiffness on points of lines, of equal
strips and of Gauss; the free in-phase frequency with every count of elements off the contact
doubled alone, and all of them times 1 to 3; free and stuck frequencies on meshes graded toward
re-entrant edges, as an accuracy takes them (``graded``).
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

# The benchmarks are no package: what they share is found by its folder.
sys.path.append(str(Path(__file__).parents[1]))
from rig_response import rig

from upd.analyses.forced.again import OFF_CONTACT, times
from upd.analyses.forced.again import graded as graded_mesh
from upd.analyses.forced.curves import linear_of
from upd.scene import load_scene

Row = dict[str, Any]
#: the mesh that points are compared on
_ELEMENT = "hex8i"
_LINES: Mapping[str, Any] = {"contact.rule": "lines"}
#: rule of the points, groups up the slope and along the damper
POINTS: Mapping[str, Mapping[str, Any]] = {
    "lines of the lattice, 5 rows": {"contact.columns": 3, **_LINES, "contact.rows": "all"},
    "4 equal strips": {"contact.columns": 2, **_LINES, "contact.rows": 4},
    **{
        f"Gauss, {n} rows": {"contact.rule": "gauss", "contact.rows": n, "contact.columns": m}
        for n, m in ((2, 2), (3, 2), (4, 4), (6, 6))
    },
}
#: levels of graded meshes, and rows of Gauss points on them
GRADED, GRADED_ROWS = (1, 1.5, 2, 2.5), 6


def run() -> Iterator[Row]:
    """Rows of all."""
    for one in (points, elements, graded):
        yield from one()


def _row(name: str, case: str, value: float, unit: str, begin: float, note: str = "") -> Row:
    took = f"{time.process_time() - begin:.0f} s of processor"
    return {
        "name": name,
        "case": case,
        "value": f"{value:.3f}",
        "unit": unit,
        "note": f"{note}, {took}" if note else took,
    }


def points() -> Iterator[Row]:
    """Stuck frequencies."""
    bodies = None
    for case, changes in POINTS.items():
        begin = time.process_time()
        made = rig("symmetric-response", bodies, **{"mesh.element": _ELEMENT, **changes})
        bodies = made.bodies
        modes = linear_of(made.plan, made.model).modes
        for in_phase, word in ((True, "in phase"), (False, "out of phase")):
            found = next(m.frequency for m in modes if m.in_phase == in_phase)
            count = f"{made.model.contacts.n_point} points"
            yield _row("stuck frequency", f"{case}, {word}", found, "Hz", begin, count)


def elements() -> Iterator[Row]:
    """The free in-phase frequency."""
    scene = load_scene("symmetric-response")
    own = {key: n for key, n in times(scene, 1.0).items() if key in OFF_CONTACT}
    cases = {"own counts": {}}
    cases |= {f"twice {key} ({2 * n})": {key: 2 * n} for key, n in own.items()}
    cases |= {f"all counts x {n}": {key: n * one for key, one in own.items()} for n in (2, 3)}
    first = None
    for case, counts in cases.items():
        begin = time.process_time()
        made = rig("symmetric-response", **{f"geometry.{k}": v for k, v in counts.items()})
        found = float(np.min(made.model.frequency))
        first = first or found
        yield _row(
            "free frequency", case, found, "Hz", begin, f"{100 * (found / first - 1):+.2f} %"
        )


def _gauss(rows: int) -> dict[str, Any]:
    return {
        "contact.rule": "gauss",
        "contact.rows": rows,
        "contact.columns": 2,
        "left_out.solve": "no",
        "accuracy": "unknown",
    }


def graded() -> Iterator[Row]:
    """Free and stuck frequencies, graded meshes of 20 nodes an element."""
    scene = load_scene("symmetric-response", _gauss(GRADED_ROWS))
    for level in GRADED:
        begin = time.process_time()
        counts = {f"geometry.{k}": v for k, v in graded_mesh(scene, level).items()}
        made = rig("symmetric-response", **_gauss(GRADED_ROWS), **counts)
        modes = linear_of(made.plan, made.model).modes
        size = f"{made.bodies.blades['right'].K.shape[0]} dofs a blade"
        case = f"graded x {level:g}"
        free = float(np.min(made.model.frequency))
        yield _row("free frequency", case, free, "Hz", begin, size)
        for in_phase, word in ((True, "in phase"), (False, "out of phase")):
            found = next(m.frequency for m in modes if m.in_phase == in_phase)
            yield _row("stuck frequency", f"{case}, {word}", found, "Hz", begin, size)


if __name__ == "__main__":
    for name in sys.argv[1:] or ("points", "elements", "graded"):
        for row in globals()[name]():
            print(row, flush=True)
