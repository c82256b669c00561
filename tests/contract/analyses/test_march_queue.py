"""Marches beside the interpreter: what they find comes back, an error ends the rest."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import pytest

from upd.analyses.forced import march_queue
from upd.analyses.forced.march_queue import MarchQueue
from upd.errors import ConvergenceError

Told = Callable[[float], None]


def test_results_belong_to_their_marches() -> None:
    with MarchQueue(8) as queue:
        found = [queue.add(lambda told, k=k: (told(300.0), k)[1]) for k in range(5)]
        assert queue.added == 5
        assert [one.result() for one in found] == list(range(5))


def test_an_error_of_a_march_is_raised_where_it_is_awaited() -> None:
    def fails(told: Told) -> None:
        raise ConvergenceError("a step at 400 Hz has no answer")

    with MarchQueue(8) as queue:
        one, other = queue.add(fails), queue.add(lambda told: 7)
        with pytest.raises(ConvergenceError, match="400 Hz"):
            one.result()
        assert other.result() == 7


def test_left_by_an_error_what_runs_ends_and_what_waits_never_begins(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(march_queue, "MOST_WORKERS", 1)
    running, begun = threading.Event(), []

    def endless(told: Told) -> None:
        while True:
            told(300.0)
            running.set()
            time.sleep(0.001)

    with pytest.raises(KeyboardInterrupt), MarchQueue(8) as queue:
        first = queue.add(endless)
        waiting = queue.add(begun.append)
        assert running.wait(10.0)
        raise KeyboardInterrupt
    assert first.done() and first.exception() is not None
    assert waiting.cancelled() and not begun
