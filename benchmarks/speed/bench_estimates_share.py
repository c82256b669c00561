"""What the error estimates that runs make by default cost, as a share of the rest of the run.

Of the processor, in one run of each scene as shipped, everything but page and pictures:
``python benchmarks/speed/bench_estimates_share.py symmetric-response`` runs one scene alone. With
OMP_NUM_THREADS=1: threads that wait for each other beside other work count as if they worked.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from typing import Any

from upd.analyses import analysis_of, make_plan
from upd.progress import Stages
from upd.scene import load_scene

SCENES = ("hertz", "symmetric", "asymmetric", "rig", "symmetric-response", "asymmetric-response")
#: per cent of the run without them
WANTED = 35.0
STAGE = "error estimates"


class ProcessorClock:
    """A listener of stages that counts the processor's seconds in those of one name."""

    def __init__(self, stage: str) -> None:
        self.stage, self.inside, self._begun = stage, 0.0, 0.0

    def __call__(self, stage: str, detail: str, seconds: float | None) -> None:
        if stage != self.stage:
            return
        if seconds is None:
            self._begun = time.process_time()
        else:
            self.inside += time.process_time() - self._begun


def run(scenes: Sequence[str] = SCENES) -> Iterator[dict[str, Any]]:
    """A row for every scene."""
    for name in scenes:
        scene = load_scene(name)
        clock, begin = ProcessorClock(STAGE), time.process_time()
        stages = Stages(clock)
        analysis = analysis_of(scene)
        solution = analysis.solve(make_plan(scene), stages)
        analysis.estimate(solution, analysis.make_results(solution), stages)
        rest = time.process_time() - begin - clock.inside
        yield {
            "name": "estimates over the rest",
            "case": name,
            "value": 100.0 * clock.inside / rest,
            "unit": "%",
            "target": f"<= {WANTED:g}",
            "note": f"{clock.inside:.0f} and {rest:.0f} s of the processor",
        }


if __name__ == "__main__":
    for row in run(sys.argv[1:] or SCENES):
        print(row, flush=True)
