"""Finite elements, contact and friction for underplatform dampers.

    >>> import upd
    >>> result = upd.run("hertz")                 # doctest: +SKIP
    >>> result.value("max_pressure", "F=50 N")    # doctest: +SKIP

Units everywhere inside: mm, N, MPa, tonne, s.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from upd import contact, dynamics, hbm, linalg, matrices, own_matrices, reduction, reference
    from upd.analyses import make_plan
    from upd.analyses.base import Plan
    from upd.batch import study, sweep
    from upd.runner import run
    from upd.scene import Scene, load_scene

__version__ = "0.1.0"

# Loaded on first use: `import upd` stays fast.
_HOME = {
    "load_scene": "upd.scene",
    "Scene": "upd.scene",
    "run": "upd.runner",
    "sweep": "upd.batch",
    "study": "upd.batch",
    "make_plan": "upd.analyses",
    "Plan": "upd.analyses.base",
}
_MODULES = ("contact", "dynamics", "hbm", "linalg", "matrices", "own_matrices", "reduction", "reference")

__all__ = [
    "Plan",
    "Scene",
    "__version__",
    "contact",
    "dynamics",
    "hbm",
    "linalg",
    "load_scene",
    "make_plan",
    "matrices",
    "own_matrices",
    "reduction",
    "reference",
    "run",
    "study",
    "sweep",
]


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return import_module(f"upd.{name}")
    if name in _HOME:
        value = getattr(import_module(_HOME[name]), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'upd' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
