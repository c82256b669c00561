"""Side by side with the iterative solvers of CalculiX (Debian package calculix-ccx).

One load of 200 N on the quarter of the half-sphere and block, hex8i against C3D8I, refined
everywhere at once as in `bench_products.py`. Ours finds the contact by products with multigrid.
CalculiX is then given the contact forces that were found as loads of its nodes, so that it solves
one linear problem with both bodies in it, by conjugate gradients with a diagonal scaling or an
incomplete Cholesky factor, and by its usual direct solver. That is the problem of one product of
ours; a contact in CalculiX solves it in every iteration of Newton, with the penalty springs added.
The last rows try that contact itself with the iterative solvers, at the approach ours found.

Processor seconds of one thread, and the largest resident memory of a process of its own. What is
compared is the work of the forces f'u: CalculiX's elements are softer by the share that
`bench_calculix.py` measures, so its digits beyond show what its iteration leaves.

python benchmarks/peers/bench_calculix_iterative.py                   # 50 k and 200 k dofs
python benchmarks/peers/bench_calculix_iterative.py --divisions 76    # 800 k
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

sys.path.append(str(Path(__file__).parents[1] / "speed"))
import bench_calculix
import bench_products

from upd.analyses import make_plan
from upd.analyses.contact.bodies import prepare
from upd.contact.products import normal_contact_by_products
from upd.progress import Stages
from upd.scene import load_scene

Row = dict[str, Any]

ELEMENT = "hex8i"
LOAD = 200.0  # N on the whole model
#: of a contact in CalculiX, MPa/mm
PENALTY = 1e8
SOLVERS = ("SPOOLES", "ITERATIVE SCALING", "ITERATIVE CHOLESKY")
DIVISIONS = (28, 46)
#: the direct solver and the contact only up to here
SMALL = 28
#: Runs a command and writes what it used. A child starts with the largest resident memory of the
#: process that starts it: a small one must.
_LAUNCH = """
import json, resource, subprocess, sys
code = subprocess.run(sys.argv[2:]).returncode
used = resource.getrusage(resource.RUSAGE_CHILDREN)
with open(sys.argv[1], "w") as file:
    json.dump({"cpu": used.ru_utime + used.ru_stime, "GB": used.ru_maxrss / 1e6}, file)
sys.exit(code)
"""


def ours(divisions: int) -> tuple[bench_calculix.Ours, float]:
    """Contact by products with multigrid, and the approach in mm."""
    overrides = bench_products.overrides(divisions, "products, multigrid")
    plan = make_plan(load_scene("hertz", overrides | {"want": ["normal"]}))
    begin = time.process_time()
    model = prepare(plan, Stages())
    found = normal_contact_by_products(model, load=LOAD / plan.copies)
    seconds = time.process_time() - begin
    C = model.compliance(2)
    return bench_calculix.Ours(plan, model, C, found.force, LOAD, seconds), found.approach


def work(answer: bench_calculix.Ours) -> float:
    """f' C f of our contact forces, N mm."""
    return float(answer.nodal @ (answer.compliance @ answer.nodal))


def loads(answer: bench_calculix.Ours) -> tuple[list[str], dict[int, float]]:
    """Lines of the contact forces on both bodies, and node -> force."""
    forces: dict[int, float] = {}
    first = 1
    for body in (answer.model.upper, answer.model.lower):
        for node, force in zip(body.contact, body.side * answer.nodal, strict=True):
            if force != 0.0:
                forces[int(node) + first] = float(force)
        first += body.mesh.n_node
    return [f"{node}, 3, {force!r}" for node, force in forces.items()], forces


def one(divisions: int, what: str) -> dict[str, Any]:
    """What one code takes: "ours", a solver of CalculiX, or "contact, " and a solver."""
    answer, approach = ours(divisions)
    n = sum(3 * body.mesh.n_node for body in (answer.model.upper, answer.model.lower))
    if what == "ours":
        used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return {"cpu": answer.seconds, "GB": used / 1e6, "found": work(answer), "nodes": n // 3}
    meshes = {body.name: body.mesh for body in (answer.model.upper, answer.model.lower)}
    contact = what.removeprefix("contact, ")
    if contact != what:
        text = bench_calculix.deck(
            answer,
            bench_calculix._CONTACT.format(law=f"{PENALTY:g}", kind=bench_calculix.SURFACE),
            f"*BOUNDARY\nSPHERE_DISTANT, 3, 3, {-approach!r}\n",
            "*NODE PRINT, NSET=BLOCK_DISTANT, TOTALS=ONLY\nRF\n",
            solver=contact,
        )
    else:
        lines, forces = loads(answer)
        text = bench_calculix.deck(
            answer,
            "",
            "*BOUNDARY\nSPHERE_DISTANT, 3, 3\n*CLOAD\n" + "\n".join(lines),
            "".join(f"*NODE PRINT, NSET={name}_CONTACT\nU\n" for name in ("SPHERE", "BLOCK")),
            solver=what,
        )
    with tempfile.TemporaryDirectory(prefix="upd-calculix-") as folder:
        usage = Path(folder) / "used.json"
        done = bench_calculix.run_job(
            meshes,
            bench_calculix.ELEMENTS[ELEMENT],
            text,
            threads=1,
            command=[sys.executable, "-c", _LAUNCH, str(usage), "ccx"],
        )
        used_by = json.loads(usage.read_text(encoding="ascii"))
    if contact != what:
        value = answer.plan.copies * bench_calculix.reaction(done.dat, "BLOCK_DISTANT")
    else:
        triple = bench_calculix._TRIPLE
        moved = re.findall(rf"^\s*(\d+){triple}\s*$", done.dat, re.MULTILINE)
        value = sum(forces.get(int(node), 0.0) * float(z) for node, _, _, z in moved)
    return {**used_by, "found": value, "nodes": n // 3}


def measured(divisions: int, what: str) -> dict[str, Any]:
    """`one` in a process of its own, on one thread."""
    command = [sys.executable, str(Path(__file__)), "--one", str(divisions), what]
    env = {**os.environ, "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, env=env, check=False)
    if done.returncode:
        return {"failed": " ".join(done.stderr.split())[-300:]}
    found: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return found


def rows(divisions: Sequence[int] = DIVISIONS) -> Iterator[Row]:
    """Seconds, memory and work of each code."""
    for number in divisions:
        mine = measured(number, "ours")
        if "failed" in mine:
            yield {"name": "failed", "case": f"{number} divisions, ours", "note": str(mine)}
            continue
        some = [s for s in SOLVERS if number <= SMALL or s.startswith("ITERATIVE")]
        contacts = [f"contact, {s}" for s in SOLVERS[1:]] if number <= SMALL else []
        for what in ("ours", *some, *contacts):
            case = f"{mine['nodes']} nodes, {what}"
            found = mine if what == "ours" else measured(number, what)
            if "failed" in found:
                yield {"name": "failed", "case": case, "note": found["failed"]}
                continue
            note = (
                f"force {found['found']:.4f} N"
                if what.startswith("contact")
                else f"work of the forces {100 * (found['found'] / mine['found'] - 1):+.4f} % "
                "from ours"
            )
            yield {"name": "time", "case": case, "value": found["cpu"], "unit": "s", "note": note}
            yield {"name": "memory", "case": case, "value": found["GB"], "unit": "GB", "note": ""}


def run(divisions: Sequence[int] = DIVISIONS) -> Iterator[Row]:
    """Rows of the benchmark; one row that says so when CalculiX is not installed."""
    if shutil.which("ccx") is None:
        yield {
            "name": "calculix",
            "case": "skipped",
            "note": "ccx is not on the path: apt-get install calculix-ccx",
        }
        return
    yield {"name": "calculix", "case": f"version {bench_calculix.version()}", "note": ""}
    yield from rows(divisions)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--one", nargs=2)
    parser.add_argument("--divisions", type=int, nargs="+", default=DIVISIONS)
    given = parser.parse_args()
    if given.one:
        print(json.dumps(one(int(given.one[0]), given.one[1])))
    else:
        for row in run(given.divisions):
            print(row, flush=True)
