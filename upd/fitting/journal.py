"""What a long fit found, kept on disk evaluation by evaluation.

A search takes the same way every time: begun again after it was stopped, it reads what is kept and
continues from there.
"""

from __future__ import annotations

import json
import logging
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from upd.cache.arrays import cache_folder

log = logging.getLogger(__name__)
Array = NDArray[np.float64]


class Journal:
    """Values and derivatives by the parameters they belong to, in a file of the cache.

    Parameters
    ----------
    key
        Of all that they depend on.
    """

    def __init__(self, key: str) -> None:
        self.path = cache_folder() / f"fit-{key[:32]}.jsonl"
        self._known = _read(self.path)
        #: evaluations that an earlier call left
        self.kept = len(self._known)

    def find(self, z: Array) -> tuple[Array, Array] | None:
        """The evaluation at these parameters."""
        return self._known.get(z.tobytes())

    def keep(self, z: Array, value: Array, slope: Array) -> None:
        """Add an evaluation; where the disk does not take it, only a line of the log."""
        self._known[z.tobytes()] = (value, slope)
        line = json.dumps([z.tolist(), value.tolist(), slope.tolist()])
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with self.path.open("a", encoding="utf-8") as file:
                file.write(f"{line}\n")
        except OSError as problem:
            log.warning("%s: not kept (%s)", self.path, problem)

    def done(self) -> None:
        """Remove the file: the fit has ended."""
        try:
            self.path.unlink(missing_ok=True)
        except OSError as problem:
            log.warning("%s: not removed (%s)", self.path, problem)


def _read(path: Path) -> dict[bytes, tuple[Array, Array]]:
    """The evaluations of a file; a last line that was cut short is left out."""
    out: dict[bytes, tuple[Array, Array]] = {}
    try:
        lines = path.read_text("utf-8").splitlines() if path.exists() else []
    except (OSError, UnicodeDecodeError) as problem:
        log.warning("%s cannot be read (%s): made again", path, problem)
        lines = []
    for line in lines:
        try:
            z, value, slope = (np.array(one, float) for one in json.loads(line))
        except (ValueError, TypeError):
            continue
        out[z.tobytes()] = (value, slope.reshape(len(value), len(z)))
    return out
