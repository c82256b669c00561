"""What a long fit found, kept on disk evaluation by evaluation.

A search goes the same way every time: begun again after it was stopped, it passes over what is
kept and goes on from there.
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
        #: evaluations that an earlier call left
        self.passed = 0
        #: how often what has friction was followed afresh: the same parameters may then have
        #: other values
        self.chapter = 0
        self._known = _read(self.path)
        self._kept = len(self._known)

    @property
    def found(self) -> int:
        """Evaluations that lay there at the beginning."""
        return self._kept

    def find(self, z: Array) -> tuple[Array, Array] | None:
        """What was found at these parameters."""
        found = self._known.get((self.chapter, z.tobytes()))
        self.passed += found is not None
        return found

    def keep(self, z: Array, value: Array, slope: Array) -> None:
        """Add an evaluation; where the disk does not take it, only a line of the log."""
        self._known[self.chapter, z.tobytes()] = (value, slope)
        line = json.dumps(
            {
                "chapter": self.chapter,
                "z": z.tolist(),
                "value": value.tolist(),
                "slope": slope.tolist(),
            }
        )
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


def _read(path: Path) -> dict[tuple[int, bytes], tuple[Array, Array]]:
    """The evaluations of a file; a last line that was cut short is left out."""
    out: dict[tuple[int, bytes], tuple[Array, Array]] = {}
    try:
        lines = path.read_text("utf-8").splitlines()
    except FileNotFoundError:
        return out
    except (OSError, UnicodeDecodeError) as problem:
        log.warning("%s cannot be read (%s): made again", path, problem)
        return out
    for line in lines:
        try:
            one = json.loads(line)
            z, value, slope = (np.array(one[name], float) for name in ("z", "value", "slope"))
            chapter = int(one["chapter"])
        except (ValueError, KeyError, TypeError):
            continue
        out[chapter, z.tobytes()] = (value, slope.reshape(len(value), len(z)))
    return out
