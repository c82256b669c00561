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
#: what a user of pyHarm writes of that script
WRITTEN = ("contact_force", "WedgeContact", "curve")
INSTALL = (
    "pyHarm is not installed (it is optional): pip install pyHarm-os into an environment of its "
    f"own and let {pair.INTERPRETER} name its interpreter"
)


def run() -> list[pair.Row]:
    """Rows of the benchmark; one row that says so when pyHarm is not installed."""
    if not pair.imports("pyHarm"):
        return pair.skipped("pyharm", INSTALL)
    told = f"element of one's own, model and call; {pair.GIVEN}"
    return list(pair.rows("pyHarm", pair.theirs(SCRIPT, WRITTEN), pair.ours(), told))


if __name__ == "__main__":
    for row in run():
        print(row)
