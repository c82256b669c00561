"""Everything that runs many times.

Sweeps over grids of parameters, studies of what accuracy costs. One engine runs their points.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from upd.batch.studies import study
    from upd.batch.sweeps import sweep

# Loaded on first use: a worker of a cluster needs neither.
_HOME = {"study": "upd.batch.studies", "sweep": "upd.batch.sweeps"}

__all__ = ["study", "sweep"]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'upd.batch' has no attribute {name!r}")
