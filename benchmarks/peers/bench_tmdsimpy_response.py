"""Side by side with tmdsimpy: one response of the blade-damper-blade problem.

tmdsimpy is not on PyPI: clone its repository (github.com/tmd-lab/tmdsimpy) and let UPD_TMDSIMPY
name the folder. It needs numpy, scipy and jax in the environment whose interpreter UPD_PEERS names
(the one that runs the benchmark without it). Nothing of it is kept here.

UPD_TMDSIMPY=~/tmdsimpy UPD_PEERS=peers/bin/python \
    python benchmarks/peers/bench_tmdsimpy_response.py
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

# The benchmarks are no package: what they share is found by its folder.
sys.path.append(str(Path(__file__).parent))
import side_by_side as pair

FOLDER = "UPD_TMDSIMPY"
SCRIPT = pair.HERE / "tmdsimpy_curve.py"
#: what a user of tmdsimpy writes of that script
WRITTEN = ("curve",)


def missing() -> str:
    """Why tmdsimpy cannot run here, empty when it can."""
    given = os.environ.get(FOLDER)
    if not given:
        return f"{FOLDER} is not set: clone github.com/tmd-lab/tmdsimpy and let it name the folder"
    if not (Path(given).expanduser() / "tmdsimpy" / "continuation.py").is_file():
        return f"{FOLDER} names {given}, which holds no tmdsimpy"
    if not pair.imports("jax"):
        return (
            "jax is not installed: pip install jax scipy into an environment of its own and let "
            f"{pair.INTERPRETER} name its interpreter"
        )
    return ""


def run() -> list[pair.Row]:
    """Rows of the benchmark; one row that says why when tmdsimpy is not there."""
    why = missing()
    if why:
        return pair.skipped("tmdsimpy", why)
    folder = str(Path(os.environ[FOLDER]).expanduser().resolve())
    told = f"model and call; {pair.GIVEN}"
    return list(pair.rows("tmdsimpy", pair.theirs(SCRIPT, WRITTEN, folder), pair.ours(), told))


if __name__ == "__main__":
    for row in run():
        print(row)
