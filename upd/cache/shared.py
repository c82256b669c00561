"""What the points of a sweep share in one process.

The folder of kept arrays and the last large object of each kind, in memory.

Off unless `sharing` is entered: a single run and the cost studies measure what they do themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar, cast

from upd.cache.arrays import LIMIT_BYTES
from upd.cache.sources import key_of

Found = TypeVar("Found")


@dataclass
class Store:
    """Where condensations are kept, how many threads may make them, and what was taken from where.

    Attributes
    ----------
    counts
        "made" (factorised), "disk" (read), "factor" (factorised again for displacements inside
        a body), "memory" (a whole model kept).
    """

    folder: Path
    threads: int = 1
    limit_bytes: float = LIMIT_BYTES
    counts: dict[str, int] = field(
        default_factory=lambda: {"made": 0, "disk": 0, "factor": 0, "memory": 0}
    )
    _memory: dict[str, tuple[str, Any]] = field(default_factory=dict)

    def remembered(self, kind: str, key: str, make: Callable[[], Found]) -> Found:
        """What `make` gives, kept in memory for the next point with the same `key`.

        One object of each kind: another is released before the new one is made, so that two never
        stand side by side.
        """
        held = self._memory.get(kind)
        if held is not None and held[0] == key:
            self.counts["memory"] += 1
            return cast(Found, held[1])
        del held
        self._memory.pop(kind, None)
        made = make()
        self._memory[kind] = (key, made)
        return made


_active: list[Store] = []


def active() -> Store | None:
    """The store of the sweep that runs in this process, if any."""
    return _active[-1] if _active else None


@contextmanager
def sharing(store: Store) -> Iterator[Store]:
    """Take condensations from `store` inside the block."""
    _active.append(store)
    try:
        yield store
    finally:
        _active.remove(store)


def shared(kind: str, parts: Mapping[str, Any], make: Callable[[], Found]) -> Found:
    """What `make` gives; inside a sweep it is kept for the next point whose ``parts`` (all it
    depends on) are the same.
    """
    store = active()
    return (
        make()
        if store is None
        else store.remembered(kind, key_of({**parts, "threads": store.threads}), make)
    )
