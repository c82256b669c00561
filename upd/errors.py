"""The three ways a run can fail. Every message names the problem, its place and the remedy."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import Any


class UpdError(Exception):
    """Base of all errors a user can cause or cure.

    The command line prints the message without a traceback.

    ``partial`` is what was solved before the error, ``estimates`` the parts of the errors of its
    numbers, ``result`` the finished result that failed a self-check, ``folder`` the run folder with
    what was written; each may be None.
    """

    partial: Any = None
    estimates: Any = None
    result: Any = None
    folder: Path | None = None


class InputError(UpdError):
    """Bad scene, bad argument, or a load the scene cannot carry.

    The command line exits with code 2.
    """


class MeshError(UpdError):
    """A mesh that could not be made, or is not what the solver needs."""


class OwnMeshError(InputError, MeshError):
    """A mesh from the user's own recipe that is not what the solver needs.

    Bad input, so exit code 2.
    """


class ConvergenceError(UpdError):
    """A solver or a self-check that did not reach its tolerance; the message carries the status."""


def did_you_mean(word: object, known: Iterable[str], otherwise: str) -> str:
    """What follows in a message about a name that is not known: the nearest that is, or
    ``otherwise``.
    """
    near = difflib.get_close_matches(str(word), list(known), 1)
    return f", did you mean {near[0]!r}?" if near else f"; {otherwise}"


def one_line(error: BaseException) -> str:
    """A fault in one line: the system's words for one of the disk, else the error."""
    text = getattr(disk_fault(error) or error, "strerror", None) or f"{error}"
    return " ".join(str(text or type(error).__name__).split())


def disk_fault(error: BaseException) -> OSError | None:
    """The fault of the disk behind an error; None when it is another."""
    cause = error.__context__ if isinstance(error, UpdError) else error
    return cause if isinstance(cause, OSError) else None
