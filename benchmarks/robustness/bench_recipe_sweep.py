"""Random sets of parameters of the ready recipes: how many end in a sound mesh, how many in a clear
error.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from recipe_sweep import sweep

from upd.mesh.recipe_modules import READY

#: sets of all recipes together
COUNT = 2000


def run() -> Iterator[dict[str, Any]]:
    """One row per recipe; every set that is neither sound nor refused is named."""
    for recipe in READY:
        begin, verdicts = time.perf_counter(), Counter[str]()
        for outcome in sweep(recipe, COUNT // len(READY), seed=2):
            known = outcome.verdict in ("sound", "refused")
            verdicts[outcome.verdict if known else "wrong"] += 1
            if not known:
                print(f"{recipe}: {outcome.verdict}: {dict(outcome.given)}", file=sys.stderr)
        yield {
            "name": "recipe_sweep_wrong",
            "case": recipe,
            "value": verdicts["wrong"],
            "unit": "",
            "target": "0",
            "note": f"{verdicts['sound']} sound meshes, {verdicts['refused']} refused, "
            f"{time.perf_counter() - begin:.0f} s",
        }


if __name__ == "__main__":
    for row in run():
        print(row)
