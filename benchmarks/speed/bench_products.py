"""What a curved contact costs by each route, over its size: condensed, by products with a factor,
by products with multigrid.

One normal load of 200 N on the quarter of the sphere and block, each run in a process of its own:
processor seconds and the largest resident memory. The mesh is refined everywhere at once.

python benchmarks/speed/bench_products.py                 # 50 k to 400 k dofs
python benchmarks/speed/bench_products.py --to 3000000    # an idle machine with 24 GB, two hours
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
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
ROUTES = {
    "condensed": {"solver.route": "condensed", "solver.name": "pardiso"},
    "products, factor": {"solver.route": "products", "solver.name": "pardiso"},
    "products, multigrid": {"solver.route": "products", "solver.name": "amg"},
}
#: what a factor may take here, bytes
FACTOR_BYTES = 6e9


def overrides(divisions: int, route: str) -> dict[str, Any]:
    """Of the scene "hertz"."""
    return {
        "want": ["normal", "body_compression"],
        "loads.normal": ["200 N"],
        "geometry.patch": "auto",
        "geometry.divisions": divisions,
        "geometry.growth": MESHES[divisions][0],
        "accuracy": "unknown",
        "left_out.solve": "no",
        **ROUTES[route],
    }


def one(divisions: int, route: str) -> dict[str, Any]:
    """Run one size by one route; what it took and found."""
    import upd

    begin, wall = time.process_time(), time.perf_counter()
    result = upd.run("hertz", overrides=overrides(divisions, route))
    found: dict[str, Any] = {
        "cpu": time.process_time() - begin,
        "wall": time.perf_counter() - wall,
        "GB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
        "stages": dict(result.cost["stages"]),
        "dofs": sum(result.size["n_dof"].values()),
        "contact": result.size["n_pairs"],
    }
    for row in result.rows:
        found[row.name] = row.value
        if row.error is not None:
            found[f"{row.name} error"] = row.error
    for check in result.checks:
        if check.name == "products":
            found["bound"], found["says"] = check.value, check.says
    return found


def measured(divisions: int, route: str) -> dict[str, Any]:
    """`one` in a process of its own, on one thread."""
    command = [sys.executable, str(Path(__file__)), "--one", str(divisions), route]
    env = {**os.environ, "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, env=env, check=False)
    if done.returncode:
        return {"failed": done.stderr.strip().splitlines()[-1:]}
    found: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return found


def exponent(points: Mapping[float, float]) -> float:
    """Slope of log seconds over log dofs."""
    n, t = np.array(sorted(points.items())).T
    return float(np.polyfit(np.log(n), np.log(t), 1)[0])


def rows(largest: int = 400_000, smallest: int = 0) -> Iterator[Row]:
    """All sizes up to ``largest`` dofs, by every route that fits."""
    from upd.linalg.select import predict

    seconds: dict[str, dict[float, float]] = {route: {} for route in ROUTES}
    for divisions, (_, about) in MESHES.items():
        if not smallest <= about <= largest:
            continue
        forces: dict[str, float] = {}
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
            seconds[route][found["dofs"]] = found["cpu"]
            forces[route] = found["approach"]
            note = "; ".join(
                f"{name} {100 * found[f'{name} error']:+.3f} %"
                for name in ("radius_moment", "max_pressure", "approach_contact")
                if f"{name} error" in found
            )
            yield row("time", case, found["cpu"], "processor s", found.get("says", "") + note)
            yield row("memory", case, found["GB"], "GB", "largest resident set")
            if route != "condensed" and "condensed" in forces:
                apart = abs(forces[route] / forces["condensed"] - 1.0)
                yield row("agreement", case, apart, "", "approach against the condensed run")
    for route, points in seconds.items():
        if len(points) > 1:
            yield row("exponent", route, exponent(points), "", "of seconds over dofs")


def row(name: str, case: str, value: float, unit: str, note: str) -> Row:
    """One line of the table."""
    return {"name": name, "case": case, "value": value, "unit": unit, "target": "", "note": note}


def main() -> None:
    """Print the rows, or run one size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--one", nargs=2)
    parser.add_argument("--to", type=int, default=400_000)
    parser.add_argument("--from", type=int, default=0, dest="smallest")
    given = parser.parse_args()
    if given.one:
        print(json.dumps(one(int(given.one[0]), given.one[1])))
        return
    for line in rows(given.to, given.smallest):
        print(f"{line['name']:10s} {line['case']:60s} {line['value']:.6g} {line['unit']}", end="")
        print(f"  {line['note']}", flush=True)


if __name__ == "__main__":
    main()
