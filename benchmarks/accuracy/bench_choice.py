"""Dampers chosen by followed peaks against a grid of 40 runs through `upd sweep`, and what both
cost.

Both rigs on coarse meshes with one column of contact points and the printed stiffness. Processor
seconds of this process in the same run, nothing kept from before; the choice comes first, so that
compiled code is loaded at its cost. `python benchmarks/accuracy/bench_choice.py [RIG ...]` prints
the choices in words and the grid as well, how far its points pass what is printed of the range
within 10 %, and draws choice_RIG.png.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

# The benchmarks are no package: what they share is found by its folder.
sys.path.append(str(Path(__file__).parents[1]))
from choice_grid import GridCheck, check_by_grid

import upd
from upd.plot.chart import Trace
from upd.plot.matplotlib import write_sheets
from upd.sizing import BestDamper
from upd.sizing.choice import GROWTHS

#: rigs that are reduced in a second
COARSE: dict[str, Any] = {
    "mesh.element": "hex8i",
    "geometry.refine": 0.5,
    "contact.stiffness": ["thesis"],
    "contact.rule": "lines",
    "contact.rows": "all",
    "contact.columns": 1,
    "contact.static": "frictionless",
    "reduction.modes": 4,
    "balance.harmonics": 3,
    "balance.method": "balance",
    # coarser curves miss the tops between their points
    "excitation.points": 400,
}


class Case(NamedTuple):
    """A choice: its scene and what is changed in it, ranges of F_C and of F_E in N, in which the
    rig has its optimum within, and points of the grid.
    """

    scene: str
    changes: dict[str, Any]
    over: str
    during: str
    points: int = 40


CASES = {
    "symmetric": Case(
        "symmetric-response", COARSE, "damper.centrifugal=20:2000", "excitation.force=0.5:5"
    ),
    "asymmetric": Case(
        "asymmetric-response", COARSE, "damper.centrifugal=4:400", "excitation.force=1:1.5"
    ),
}
#: share of the grid's cost that a choice may take
SHARE = 0.2


@contextmanager
def _empty_cache() -> Iterator[Path]:
    before = os.environ.get("UPD_CACHE")
    with tempfile.TemporaryDirectory() as place:
        os.environ["UPD_CACHE"] = str(Path(place) / "cache")
        try:
            yield Path(place)
        finally:
            if before is None:
                del os.environ["UPD_CACHE"]
            else:
                os.environ["UPD_CACHE"] = before


def both(name: str) -> tuple[BestDamper, float, GridCheck]:
    """The choice of one rig, its processor seconds, and the grid."""
    case = CASES[name]
    with _empty_cache() as place:
        begin = time.process_time()
        found = upd.design(
            case.scene, minimise="peak", over=case.over, for_=case.during, overrides=case.changes
        )
        took = time.process_time() - begin
        return found, took, check_by_grid(found, case.points, place / name, workers=0)


def rows(name: str, found: BestDamper, took: float, grid: GridCheck) -> Iterator[dict[str, Any]]:
    """Optimum against grid, and what both cost."""
    chosen = found
    k, case = grid.best, CASES[name]
    where = "within" if grid.within(chosen.centrifugal) else "NOT within"
    spacing = 100.0 * (grid.values[1] / grid.values[0] - 1.0)
    yield {
        "name": "F_C with the lowest worst peak",
        "case": name,
        "value": round(chosen.centrifugal, 2),
        "unit": "N",
        "target": f"{grid.values[k]:.4g} N +- {spacing:.0f} %",
        "note": f"grid of {case.points}: {where} its spacing; {case.over} over {case.during}",
    }
    yield {
        "name": "worst peak there",
        "case": name,
        "value": round(chosen.worst, 2),
        "unit": "(m/s2)/N",
        "target": f"grid: {grid.heights[k]:.4g}",
        "note": "grid points stand beside the optimum",
    }
    for growth, told in zip(GROWTHS, chosen.reaches["damper.centrifugal"], strict=True):
        # points up to an end that is told; up to the bound where none is
        low, high = told
        inside = ~((grid.values < low) | (grid.values > high)) & np.isfinite(grid.heights)
        if not inside.any():
            continue
        over = 100.0 * (np.array(grid.heights)[inside] / (growth * chosen.worst) - 1.0)
        yield {
            "name": f"grid above the range within {100 * (growth - 1.0):.0f} %",
            "case": name,
            "value": round(float(over.max()), 2),
            "unit": "%",
            "target": "< 0",
            "note": f"largest of {int(inside.sum())} points from {low:.4g} to {high:.4g} N",
        }
    yield {
        "name": "processor seconds",
        "case": name,
        "value": round(took, 1),
        "unit": "s",
        "target": f"< {SHARE * grid.processor_seconds:.0f} s, a fifth of the grid",
        "note": f"grid {grid.processor_seconds:.0f} s, {grid.processor_seconds / took:.1f} times",
    }


def run() -> Iterator[dict[str, Any]]:
    """Both rigs."""
    for name in CASES:
        yield from rows(name, *both(name))


def main(names: Sequence[str]) -> None:
    """Print choices, grids and rows."""
    for name in names or CASES:
        found, took, grid = both(name)
        print(found)
        for value, height in zip(grid.values, grid.heights, strict=True):
            print(f"    {value:9.4g} N {height:9.4g}")
        for row in rows(name, found, took, grid):
            print(row, flush=True)
        points = Trace(f"grid of {len(grid.values)}", grid.values, grid.heights, "points", 7)
        first, *others = found.charts
        charts = [replace(first, traces=(*first.traces, points)), *others]
        mine = [replace(one, figure=f"choice_{name}") for one in charts]
        write_sheets(mine, Path(__file__).parent)


if __name__ == "__main__":
    main(sys.argv[1:])
