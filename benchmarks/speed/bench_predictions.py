"""Predicted seconds and memory of the ready scenes, of their elements and sizes, and what they use.

Every run is a process of its own on one thread: seconds are those of its processor, which other
work on the machine disturbs less than those of the clock, memory is its largest resident set. The
finest hertz takes 9 GB and is left out where there are less than 14.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

from upd.linalg.select import memory_left

# One load on 202 000 dofs, by all ways.
_REFINED = (
    'want=["normal"]',
    'loads.normal=["200 N"]',
    "geometry.patch=auto",
    "geometry.divisions=46",
    "geometry.growth=1.185",
    "accuracy=unknown",
    "left_out.solve=no",
)
_WAYS = (("condensed", "pardiso"), ("products", "pardiso"), ("products", "amg"))
#: scene, what is changed
CASES: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("hertz", ()),
    ("hertz", ("mesh.element=hex8",)),
    ("hertz", ("geometry.divisions=20",)),
    ("hertz", ("geometry.divisions=60",)),
    ("hertz", ("mesh.element=hex20", "geometry.divisions=20")),
    ("hertz", ("loads.cycle_steps=100000",)),
    ("hertz", ("mesh.element=hex20",)),
    *(
        ("hertz", (*_REFINED, f"solver.route={route}", f"solver.name={name}"))
        for route, name in _WAYS
    ),
    ("symmetric", ()),
    ("symmetric", ("mesh.element=hex8",)),
    ("symmetric", ("mesh.element=hex20",)),
    ("asymmetric", ()),
    ("rig", ()),
    ("rig", ("mesh.element=hex8",)),
    ("rig", ("mesh.element=hex27",)),
    ("symmetric-seated", ()),
    ("symmetric-seated", ("mesh.symmetry=full",)),
    ("symmetric-seated", ("geometry.patch_along_slope=6", "geometry.patch_along_y=18")),
    ("asymmetric-seated", ()),
    ("asymmetric-response", ()),
    ("asymmetric-response", ("mesh.element=hex8",)),
    ("asymmetric-response", ("excitation.points=100",)),
    ("symmetric-response", ()),
    ("symmetric-response", ("balance.harmonics=1", "excitation.points=200")),
)
#: bytes below which the largest is left out
ENOUGH = 14e9
FACTOR = 1.5

_RUN = """
import json, resource, sys, tempfile, time
from upd.analyses import make_plan
from upd.runner import run
from upd.scene import load_scene
scene = load_scene(sys.argv[1], sys.argv[2:])
plan = make_plan(scene)
begin = time.process_time()
with tempfile.TemporaryDirectory() as folder:
    run(scene, out=folder)
used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(json.dumps([plan.seconds, time.process_time() - begin, plan.memory_bytes, 1024 * used]))
"""


def run() -> Iterator[dict[str, Any]]:
    """Two rows per case: predicted over used, which is within a factor 1.5."""
    for scene, changes in CASES:
        case = " ".join((scene, *changes))
        if changes == ("mesh.element=hex20",) and scene == "hertz" and memory_left() < ENOUGH:
            yield {"name": "predictions", "case": case, "note": "left out: too little memory"}
            continue
        one = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        found = subprocess.run(
            [sys.executable, "-c", _RUN, scene, *changes],
            capture_output=True,
            text=True,
            env=os.environ | one,
            check=False,
        )
        if found.returncode:
            last = found.stderr.strip().splitlines()[-1:]
            yield {"name": "predictions", "case": case, "note": f"failed: {' '.join(last)}"}
            continue
        seconds, used_s, memory, used = json.loads(found.stdout.splitlines()[-1])
        for what, predicted, measured, unit in (
            ("seconds", seconds, used_s, "s"),
            ("memory", 1e-9 * memory, 1e-9 * used, "GB"),
        ):
            yield {
                "name": f"{what}, predicted / used",
                "case": case,
                "value": predicted / measured,
                "target": f"{1 / FACTOR:.2f} ... {FACTOR:g}",
                "note": f"{predicted:.3g} / {measured:.3g} {unit}",
            }
