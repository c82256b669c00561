"""Who solves the points.

The same few calls for this process, processes of this machine, and the workers of a cluster.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from upd.batch.point import forget, solve_task


@dataclass(frozen=True)
class Answer:
    """The JSON outcome of the task given under ``number``; None when its worker died."""

    number: int
    text: str | None


class Executor(Protocol):
    """Workers that take JSON tasks."""

    def free(self) -> Sequence[str]:
        """Names of the workers that have nothing to do."""

    def give(self, worker: str, number: int, task: str) -> None:
        """Let ``worker`` solve the task."""

    def wait(self, seconds: float) -> list[Answer]:
        """What has come in, after ``seconds`` at the latest.

        Raises UpdError when nobody is left to answer.
        """

    def close(self) -> None:
        """End the workers, at once."""


class InProcess:
    """This process itself, one point at a time."""

    def __init__(self) -> None:
        self._given: list[tuple[int, str]] = []

    def free(self) -> Sequence[str]:
        return [] if self._given else ["here"]

    def give(self, worker: str, number: int, task: str) -> None:
        self._given.append((number, task))

    def wait(self, seconds: float) -> list[Answer]:
        return (
            [Answer(number, solve_task(task)) for number, task in [self._given.pop(0)]]
            if self._given
            else []
        )

    def close(self) -> None:
        forget()
