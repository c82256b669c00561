"""How fast this machine works: what predictions of seconds are made from.

Measured once by `upd.analyses.calibration` and kept in the cache folder; without that, those of one
core of a server of 2.1 GHz.
"""

from __future__ import annotations

import json
import logging
from dataclasses import asdict, dataclass, fields
from functools import lru_cache
from pathlib import Path

from upd.cache.arrays import cache_folder
from upd.cache.files import write_text

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Rates:
    """Speeds of one thread, and what all threads together gain.

    Attributes
    ----------
    factor_flops
        Operations per s of a sparse Cholesky factorisation.
    analysis_entries
        Entries of a matrix ordered and analysed per s.
    solve_bytes
        Bytes of a factor read per s by a triangular solve.
    dense_flops
        Operations per s of dense Cholesky, LU and products.
    elements
        Hexahedra with eight nodes per s whose stiffness is assembled: numpy on large arrays.
    calls
        Calls of numpy on small arrays per s: what Newton steps and figures are made of.
    speedup
        All threads over one thread, of a sparse factorisation.
    measured
        Whether they are this machine's own.
    """

    factor_flops: float = 3.0e10
    analysis_entries: float = 9.0e6
    solve_bytes: float = 1.0e10
    dense_flops: float = 2.6e10
    elements: float = 6.0e4
    calls: float = 1.0e6
    speedup: float = 1.5
    measured: bool = False


#: the machine that the seconds in plans were measured on
REFERENCE = Rates()
_NAME = "rates.json"


def rates_file() -> Path:
    """Where this machine's rates are kept."""
    return cache_folder() / _NAME


def rates() -> Rates:
    """Those of this machine when they were measured, else `REFERENCE`."""
    path = rates_file()
    try:
        return _read(path, path.stat().st_mtime_ns)
    except OSError:
        return REFERENCE


@lru_cache(maxsize=4)
def _read(path: Path, written: int) -> Rates:
    del written  # a file written again is read again
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        numbers = {f.name: float(data[f.name]) for f in fields(Rates) if f.name != "measured"}
    except (OSError, ValueError, KeyError, TypeError) as problem:
        log.warning("%s cannot be read (%s): run upd doctor --calibrate again", path, problem)
        return REFERENCE
    if not all(0.0 < value < float("inf") for value in numbers.values()):
        log.warning("%s holds no speeds: run upd doctor --calibrate again", path)
        return REFERENCE
    return Rates(**numbers, measured=True)


def keep_rates(found: Rates) -> Path:
    """Remember this machine's rates. Raises OSError where the cache folder cannot be written."""
    path = rates_file()
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, json.dumps(asdict(found), indent=1) + "\n")
    return path
