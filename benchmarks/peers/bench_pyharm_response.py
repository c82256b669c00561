"""Side by side with pyHarm (PyPI: pyHarm-os): one response of the blade-damper-blade problem.

pyHarm is no dependency of upd, and pins its own versions: install it into an environment of its own
and let UPD_PEERS name the interpreter of that. Without the variable the interpreter that runs the
benchmark is asked.

python -m venv peers && peers/bin/pip install pyHarm-os
UPD_PEERS=peers/bin/python python benchmarks/peers/bench_pyharm_response.py
"""

from __future__ import annotations

import sys
from pathlib import Path

# The benchmarks are no package: what they share is found by its folder.
sys.path.append(str(Path(__file__).parent))
import side_by_side as pair

SCRIPT = pair.HERE / "pyharm_curve.py"
#: how the contacts are made -> what a user of pyHarm writes of that script
WRITTEN = {
    "own": ("contact_force", "WedgeContact", "own_contacts", "curve"),
    "stock": ("stock_contacts", "stock_frames", "in_space", "curve"),
}
TOLD = {"own": "element of one's own", "stock": "Penalty3D"}
INSTALL = (
    "pyHarm is not installed (it is optional): pip install pyHarm-os into an environment of its "
    f"own and let {pair.INTERPRETER} name its interpreter"
)


def run() -> list[pair.Row]:
    """Rows of the benchmark; one row that says so when pyHarm is not installed."""
    if not pair.imports("pyHarm"):
        return pair.skipped("pyharm", INSTALL)
    others = {
        f"pyHarm, {TOLD[kind]}": (
            pair.theirs(SCRIPT, written, kind),
            f"{TOLD[kind]}, model and call; {pair.GIVEN}",
        )
        for kind, written in WRITTEN.items()
    }
    return list(pair.rows(others, pair.ours()))


if __name__ == "__main__":
    for row in run():
        print(row)
