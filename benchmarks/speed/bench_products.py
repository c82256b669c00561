"""What a curved contact costs by each route, over its size: condensed, by products with a factor,
by products with multigrid.

One normal load of 200 N on the quarter of the sphere and block, each run in a process of its own:
processor seconds and the largest resident memory. The mesh is refined everywhere at once. --figure
draws the errors over both as products.png beside this file.

With --cycle: 60 steps of a tangential load between +-0.75 mu N by products with multigrid, after
each load given, and the energy lost against Mindlin and Deresiewicz. Their closed form is of
half-spaces; what the curvature of a sphere of radius R adds goes with a / R, and the contact radius
a with the cube root of the load. So two loads show what the mesh leaves where a / R goes to zero.

python benchmarks/speed/bench_products.py                 # 50 k to 400 k dofs
python benchmarks/speed/bench_products.py --to 3000000 --figure    # 24 GB, 20 minutes
python benchmarks/speed/bench_products.py --cycle --to 400000
python benchmarks/speed/bench_products.py --cycle --from 1000000 --to 1000000 --loads "50 N"
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

Row = dict[str, Any]

#: divisions of the patch -> growth of the far mesh: both bodies together have about the dofs beside
MESHES = {
    28: (1.32, 50_000),
    36: (1.24, 100_000),
    46: (1.185, 200_000),
    60: (1.14, 400_000),
    76: (1.112, 800_000),
    94: (1.09, 1_500_000),
    120: (1.07, 3_000_000),
}
#: of the cycles
CYCLE_MESHES = {28: (1.32, 50_000), 44: (1.2, 200_000), 60: (1.14, 400_000), 82: (1.105, 1_000_000)}
CYCLE_LOADS = ("200 N", "25 N")
CYCLE_STEPS = 60
ROUTES = {
    "condensed": {"solver.route": "condensed", "solver.name": "pardiso"},
    "products, factor": {"solver.route": "products", "solver.name": "pardiso"},
    "products, multigrid": {"solver.route": "products", "solver.name": "amg"},
}
#: what a factor may take here, bytes
FACTOR_BYTES = 6e9
#: numbers with a closed form
NUMBERS = ("radius_moment", "max_pressure", "approach_contact")


def overrides(divisions: int, route: str, cycle: str = "") -> dict[str, Any]:
    """Of the scene "hertz"; ``cycle``: the normal load of a tangential cycle."""
    growth = (CYCLE_MESHES if cycle else MESHES)[divisions][0]
    return {
        "want": ["normal", "cycle"] if cycle else ["normal", "body_compression"],
        "loads.normal": [cycle or "200 N"],
        "loads.cycle_steps": CYCLE_STEPS,
        "geometry.patch": "auto",
        "geometry.divisions": divisions,
        "geometry.growth": growth,
        "accuracy": "unknown",
        "left_out.solve": "no",
        **ROUTES[route],
    }


def one(divisions: int, route: str, cycle: str = "") -> dict[str, Any]:
    """Run one size by one route; what it took and found."""
    import upd

    begin, wall = time.process_time(), time.perf_counter()
    result = upd.run("hertz", overrides=overrides(divisions, route, cycle))
    (case,) = (a for a in result.arrays.values() if "normal_force" in a)
    found: dict[str, Any] = {
        "cpu": time.process_time() - begin,
        "wall": time.perf_counter() - wall,
        "GB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
        "stages": dict(result.cost["stages"]),
        "dofs": sum(result.size["n_dof"].values()),
        "contact": result.size["n_pairs"],
        "force": np.asarray(case["normal_force"][1]).ravel().tolist(),
    }
    for row in result.rows:
        found[row.name] = row.value
        if row.error is not None:
            found[f"{row.name} error"] = row.error
    for check in result.checks:
        if check.name == "products":
            found["bound"], found["says"] = check.value, check.says
    return found


def measured(divisions: int, route: str, cycle: str = "") -> dict[str, Any]:
    """`one` in a process of its own, on one thread."""
    command = [sys.executable, str(Path(__file__)), "--one", str(divisions), route, cycle]
    env = {**os.environ, "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, env=env, check=False)
    if done.returncode:
        return {"failed": done.stderr.strip().splitlines()[-1:]}
    found: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return found


def _stages(found: Mapping[str, Any]) -> str:
    """Seconds by the clock before the contact (by products: set-up) and in it."""
    names = ("condensation", "normal contact")
    return ", ".join(f"{name} {found['stages'][name]:.3g} s" for name in names)


def exponent(points: Mapping[float, float]) -> float:
    """Slope of log seconds over log dofs."""
    n, t = np.array(sorted(points.items())).T
    return float(np.polyfit(np.log(n), np.log(t), 1)[0])


def draw(runs: Mapping[str, Sequence[Mapping[str, Any]]], folder: Path) -> list[Path]:
    """The errors of each route's runs over their seconds and memory as ``products.png``."""
    from upd.plot.matplotlib import write_sheets
    from upd.plot.work_precision import work_precision_charts

    curves = [
        {
            "curve": route,
            "name": name,
            "case": "F=200 N",
            "error": [one[f"{name} error"] for one in found],
            "seconds": [one["cpu"] for one in found],
            "memory_mb": [1000.0 * one["GB"] for one in found],
            "order": None,
            "against": "the closed form",
        }
        for name in NUMBERS
        for route, found in runs.items()
        if found
    ]
    charts = work_precision_charts(curves)
    return write_sheets((replace(one, figure="products") for one in charts), folder)


def rows(largest: int = 400_000, smallest: int = 0, figure: Path | None = None) -> Iterator[Row]:
    """All sizes up to ``largest`` dofs, by every route that fits; drawn into the folder ``figure``
    at the end.
    """
    from upd.linalg.select import predict

    runs: dict[str, list[dict[str, Any]]] = {route: [] for route in ROUTES}
    # compiles what no earlier run has
    measured(min(MESHES), "products, multigrid")
    for divisions, (_, about) in MESHES.items():
        if not smallest <= about <= largest:
            continue
        forces: dict[str, Any] = {}
        for route in ROUTES:
            if route != "products, multigrid" and predict(about / 2, 0, "pardiso").bytes > (
                FACTOR_BYTES / 2
            ):
                continue
            found = measured(divisions, route)
            if "failed" in found:
                yield row("failed", f"{about} dofs, {route}", float("nan"), "", str(found))
                continue
            case = f"{found['dofs']} dofs, {found['contact']} contact nodes, {route}"
            runs[route].append(found)
            forces[route] = np.array(found["force"])
            note = "; ".join(
                f"{name} {100 * found[f'{name} error']:+.3f} %"
                for name in NUMBERS
                if f"{name} error" in found
            )
            yield row(
                "time",
                case,
                found["cpu"],
                "processor s",
                "; ".join(filter(None, (_stages(found), found.get("says"), note))),
            )
            yield row("memory", case, found["GB"], "GB", "largest resident set")
            if route != "condensed" and "condensed" in forces:
                apart = (
                    np.abs(forces[route] - forces["condensed"]).max() / forces["condensed"].max()
                )
                note = (
                    "largest difference of a contact force from the condensed run's, of the largest"
                )
                yield row("agreement", case, float(apart), "", note)
    for route, each in runs.items():
        points = {one["dofs"]: one["cpu"] for one in each}
        if len(points) > 1:
            yield row("exponent", route, exponent(points), "", "of seconds over dofs")
    if figure is not None:
        draw(runs, figure)


def cycle_rows(
    largest: int = 200_000, smallest: int = 0, loads: Sequence[str] = CYCLE_LOADS
) -> Iterator[Row]:
    """Tangential cycles on all sizes up to ``largest`` dofs by products with multigrid."""
    radii = [float(load.split()[0]) ** (1.0 / 3.0) for load in loads]  # of contact, relative
    route = "products, multigrid"
    for divisions, (_, about) in CYCLE_MESHES.items():
        if not smallest <= about <= largest:
            continue
        errors = []
        for load in loads:
            found = measured(divisions, route, load)
            if "failed" in found:
                yield row("failed", f"{about} dofs, {load}", float("nan"), "", str(found))
                continue
            case = f"cycle after {load}, {found['dofs']} dofs, {found['contact']} contact nodes"
            errors.append(100.0 * found["cycle_energy error"])
            yield row("time", case, found["cpu"], "processor s", found.get("says", ""))
            yield row("memory", case, found["GB"], "GB", "largest resident set")
            note = "energy against Mindlin and Deresiewicz"
            yield row("energy", case, errors[-1], "%", note)
        if len(errors) == len(loads) and len(loads) > 1:
            limit = (radii[0] * errors[-1] - radii[-1] * errors[0]) / (radii[0] - radii[-1])
            note = f"for a / R to zero, from {loads[0]} and {loads[-1]}"
            yield row("energy", f"{about} dofs", limit, "%", note)


def row(name: str, case: str, value: float, unit: str, note: str) -> Row:
    """One line of the table."""
    return {"name": name, "case": case, "value": value, "unit": unit, "target": "", "note": note}


def main() -> None:
    """Print the rows, or run one size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--one", nargs=3)
    parser.add_argument("--cycle", action="store_true")
    parser.add_argument("--figure", action="store_true")
    parser.add_argument("--to", type=int, default=400_000)
    parser.add_argument("--from", type=int, default=0, dest="smallest")
    parser.add_argument("--loads", nargs="+", default=CYCLE_LOADS, help='of the cycles, "200 N"')
    given = parser.parse_args()
    if given.one:
        print(json.dumps(one(int(given.one[0]), *given.one[1:])))
        return
    found = (
        cycle_rows(given.to, given.smallest, given.loads)
        if given.cycle
        else rows(given.to, given.smallest, Path(__file__).parent if given.figure else None)
    )
    for line in found:
        print(f"{line['name']:10s} {line['case']:60s} {line['value']:.6g} {line['unit']}", end="")
        print(f"  {line['note']}", flush=True)


if __name__ == "__main__":
    main()
