"""One BLAS thread for small problems."""

from __future__ import annotations

from collections.abc import Sized
from contextlib import AbstractContextManager, nullcontext
from functools import cache
from typing import Any

try:
    from threadpoolctl import ThreadpoolController  # type: ignore[import-not-found, import-untyped, unused-ignore]
except ImportError:
    ThreadpoolController = None

# Below this many unknowns the threads of a factorisation wait for each other longer than they work:
# on two busy cores 300 load steps of 185 nodes took 3.5 s with two threads and 0.1 s with one.
SMALL = 2000


@cache
def _controller() -> Any:
    return None if ThreadpoolController is None else ThreadpoolController()


def few_threads(rows: object) -> AbstractContextManager[Any]:
    """Context in which BLAS uses one thread when there are too few `rows` to share out.

    Without threadpoolctl nothing changes.
    """
    small = not isinstance(rows, Sized) or len(rows) < SMALL
    controller = _controller() if small else None
    return nullcontext() if controller is None else controller.limit(limits=1, user_api="blas")
