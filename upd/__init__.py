"""Finite elements, contact and friction for underplatform dampers.

    parameters -> geometry -> mesh -> K, M -> reduction -> contact -> harmonic balance -> report

    >>> import upd
    >>> result = upd.run("hertz")                 # doctest: +SKIP
    >>> result.value("max_pressure", "F=50 N")    # doctest: +SKIP

Units everywhere inside: mm, N, MPa, tonne, s.

The rooms, from what a user calls down to what everything rests on. Each imports only from rooms
below it, none in a circle; contracts in pyproject.toml hold this.

    cli         the commands; each is a thin call that Python users can make
    sizing      which damper: closed forms before any dynamics, the lowest worst peak
    fitting     which inputs give wanted numbers
    batch       many runs: sweeps, samples, studies
    runner      one run: plan, solve, check, write the run folder
    report      the run folder read back: page, comparison, notebook, figures
    analyses    contact, modal, seated, forced, bladed disk: each plans, solves, checks and draws
    vary        one scene with one thing changed, solved again: errors, effects, inputs
    plot        a Chart of arrays drawn by matplotlib or plotly; pictures of modes and surfaces
    scene       scene.toml -> frozen dataclasses
    matrices    K and M of other programs
    measured    measured curves: files, comparison, damping
    contact     normal and tangential contact, tilt, contact points
    hbm         harmonic balance with friction
    dynamics    linear response, peaks, damping
    reduction   Guyan, Craig-Bampton, cyclic sectors
    fem         mesh -> K, M, rotation
    linalg      factorisation, Schur complement, modes
    reference   closed forms, usable by themselves
    mesh        Mesh, checks and quality, recipes (the one door to geometry), export
    results     cases, numbers, checks, arrays in netCDF
    cache       files kept on disk: keys, locks, written whole or not at all
    units, labels, progress, errors

Beside the package: geometry/ (gmsh recipes, no physics), tests/ (by why a test can be trusted),
benchmarks/.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from upd import (
        contact,
        dynamics,
        hbm,
        linalg,
        matrices,
        measured,
        own_matrices,
        reduction,
        reference,
    )
    from upd.analyses import make_plan
    from upd.analyses.base import Plan
    from upd.batch.studies import study
    from upd.batch.sweeps import sweep
    from upd.fitting import fit
    from upd.measured import fit_damping, read_measured
    from upd.report.notebook import RunResult, load
    from upd.runner import run
    from upd.scene import Scene, load_scene
    from upd.sizing import design

__version__ = "0.2.0"

# Loaded on first use: `import upd` stays fast.
_HOME = {
    "load_scene": "upd.scene",
    "Scene": "upd.scene",
    "run": "upd.runner",
    "RunResult": "upd.report.notebook",
    "load": "upd.report.notebook",
    "read_measured": "upd.measured",
    "fit_damping": "upd.measured",
    "sweep": "upd.batch.sweeps",
    "study": "upd.batch.studies",
    "design": "upd.sizing",
    "fit": "upd.fitting",
    "make_plan": "upd.analyses",
    "Plan": "upd.analyses.base",
}

__all__ = [
    "Plan",
    "RunResult",
    "Scene",
    "__version__",
    "contact",
    "design",
    "dynamics",
    "fit",
    "fit_damping",
    "hbm",
    "linalg",
    "load",
    "load_scene",
    "make_plan",
    "matrices",
    "measured",
    "own_matrices",
    "read_measured",
    "reduction",
    "reference",
    "run",
    "study",
    "sweep",
]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        globals()[name] = value = getattr(import_module(_HOME[name]), name)
        return value
    if name in __all__:
        return import_module(f"upd.{name}")
    raise AttributeError(f"module 'upd' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
