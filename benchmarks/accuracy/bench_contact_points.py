"""What contact points and elements leave in the frequencies of a response.

Stuck frequencies of ``symmetric-response`` with the thesis's stiffness on points of lines, of equal
strips and of Gauss; peaks with friction of both rigs on Gauss points; the free in-phase frequency
with every count of elements off the contact doubled alone, and all of them times 1 to 3.
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

from upd.analyses.forced.linear_limits import linear_limits_of
from upd.analyses.forced.measures import Unsolved, accelerance, path_maxima
from upd.analyses.forced.mesh_counts import OFF_CONTACT, count_of, times
from upd.analyses.forced.paths import balance_of, respond
from upd.scene import load_scene

Row = dict[str, Any]
#: the mesh that points are compared on
_ELEMENT = "hex8i"
#: rule of the points, groups up the slope and along the damper
POINTS: Mapping[str, Mapping[str, Any]] = {
    "lines of the lattice, 5 rows": {},
    "4 equal strips": {"contact.rows": 4, "contact.columns": 2},
    **{
        f"Gauss, {n} rows": {"contact.rule": "gauss", "contact.rows": n, "contact.columns": m}
        for n, m in ((2, 2), (3, 2), (4, 4), (6, 6))
    },
}
#: rows of Gauss points, the band of the peak in Hz, and harmonics of the peaks with friction
SLIPPING = {"symmetric": (330.0, 365.0), "asymmetric": (370.0, 395.0)}
ROWS, HIGHEST, RATIO = (4, 6, 8, 12), 7, 194.0


def run() -> Iterator[Row]:
    """Rows of all three."""
    yield from points()
    yield from elements()
    yield from slipping()


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
        force = made.plan.scene.damper.centrifugal
        numbers = (0, *made.model.excitation.harmonics)
        answer = Unsolved(balance_of(made.plan, made.model, force, numbers))
        modes = linear_limits_of(made.plan, made.model, answer, force).modes
        for in_phase, word in ((True, "in phase"), (False, "out of phase")):
            found = next(m.frequency for m in modes if m.axis == "x" and m.in_phase == in_phase)
            count = f"{made.model.contacts.n_point} points"
            yield _row("stuck frequency", f"{case}, {word}", found, "Hz", begin, count)


def elements() -> Iterator[Row]:
    """The free in-phase frequency."""
    scene = load_scene("symmetric-response")
    own = {key: count_of(scene, key) for key in OFF_CONTACT}
    cases = {"own counts": {}}
    cases |= {f"twice {key} ({2 * n})": {key: 2 * n} for key, n in own.items()}
    cases |= {f"all counts x {n}": times(scene, OFF_CONTACT, n) for n in (2, 3)}
    first = None
    for case, counts in cases.items():
        begin = time.process_time()
        made = rig("symmetric-response", **{f"geometry.{k}": v for k, v in counts.items()})
        found = float(np.min(made.model.frequency))
        first = first or found
        yield _row(
            "free frequency", case, found, "Hz", begin, f"{100 * (found / first - 1):+.2f} %"
        )


def slipping() -> Iterator[Row]:
    """Highest peak of a band with friction, on the path of the balance."""
    for name, (low, high) in SLIPPING.items():
        bodies = None
        for rows in ROWS:
            begin = time.process_time()
            gauss = {"contact.rule": "gauss", "contact.rows": rows, "contact.columns": 2}
            changes = {"mesh.element": _ELEMENT, "contact.static": "seated", **gauss}
            made = rig(f"{name}-response", bodies, **changes)
            bodies, force = made.bodies, made.plan.scene.damper.centrifugal / RATIO
            grid = np.linspace(280.0, 500.0, 200)
            answer = respond(made.plan, made.model, force, grid, harmonics=range(HIGHEST + 1))
            size = np.abs(accelerance(answer, made.model.row("right"), force))
            inside = [p for p in path_maxima(answer.frequency, size) if low < p.frequency < high]
            top = max(inside, key=lambda p: p.height, default=None)
            told = f"{answer.status}, {len(answer.frequency)} points"
            case = f"{name}, F_C/F_E {RATIO:g}, {HIGHEST} harmonics, {rows} rows"
            if top is None:
                yield {"name": "peak with friction", "case": case, "note": f"no peak; {told}"}
                continue
            height = f"{top.height:.0f} (m/s2)/N; {told}"
            yield _row("peak with friction", case, top.frequency, "Hz", begin, height)


if __name__ == "__main__":
    for name in sys.argv[1:] or ("points", "elements", "slipping"):
        for row in globals()[name]():
            print(row, flush=True)
