"""The time marches of a forced response, begun as soon as the curve they belong to is known."""

from __future__ import annotations

from concurrent.futures import Future
from functools import partial

from upd.analyses.forced.bands import band_jobs
from upd.analyses.forced.curves import ForcedCurve, SweptCurve
from upd.analyses.forced.march_queue import MarchQueue
from upd.analyses.forced.marched_peaks import march_peaks
from upd.analyses.forced.performance import PerformanceSweeps
from upd.analyses.forced.solution import Confirmation, ForcedSolution
from upd.analyses.forced.sweeps import both_ways, confirmations, sweep_job
from upd.progress import Stages


class Marching:
    """Marches of a run that are under way.

    Parameters
    ----------
    solution
        What they find is added to it.
    queue
        Where they run.

    Attributes
    ----------
    performance
        Sweeps of the performance curve, once begun.
    """

    def __init__(self, solution: ForcedSolution, queue: MarchQueue) -> None:
        self.solution, self.queue = solution, queue
        self.performance: PerformanceSweeps | None = None
        self._confirmed: list[Future[Confirmation]] = []
        self._own: list[Future[list[SweptCurve]]] = []
        self._others: list[Future[list[SweptCurve]]] = []

    def begin(self, name: str, ratio: float, stages: Stages, *, band: bool) -> None:
        """March where points move on the curves with this contact and F_C/F_E.

        Parameters
        ----------
        band
            Whether from every other static state too.
        """
        solution, plan = self.solution, self.solution.plan
        job = sweep_job(solution, name, ratio)
        if job is not None:
            if plan.scene.balance.method == "auto":
                for one in confirmations(solution, name, ratio):
                    self._confirmed.append(self.queue.add(one))
            self._own.append(self.queue.add(partial(both_ways, plan, job)))
        if band:
            curve = next(c for c in solution.curves if (c.stiffness, c.ratio) == (name, ratio))
            for other in band_jobs(solution, curve, stages):
                self._others.append(self.queue.add(partial(both_ways, plan, other)))

    def begin_performance(self, curve: ForcedCurve) -> None:
        """Begin the sweeps of the performance curve.

        Parameters
        ----------
        curve
            Any solved one of its contact.
        """
        linear = self.solution.linear[curve.stiffness]
        self.performance = PerformanceSweeps(self.solution, curve, linear, self.queue)

    def finish(self, stages: Stages) -> None:
        """Wait for the marches of the curves, and read their peaks."""
        words = f"{self.queue.added} marches, of which most went on beside the stages before"
        if self._own or self._others:
            with stages("sweeps", words):
                self.solution.confirmations += [one.result() for one in self._confirmed]
                for found in (*self._own, *self._others):
                    self.solution.sweeps += found.result()
        march_peaks(self.solution, stages)
