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
    plot        a Chart of arrays drawn by matplotlib or plotly; an AnswerTable of words; pictures
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

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from upd import contact as contact
    from upd import dynamics as dynamics
    from upd import hbm as hbm
    from upd import linalg as linalg
    from upd import matrices as matrices
    from upd import measured as measured
    from upd import own_matrices as own_matrices
    from upd import reduction as reduction
    from upd import reference as reference
    from upd.analyses import make_plan as make_plan
    from upd.analyses.base import Plan as Plan
    from upd.batch.studies import study as study
    from upd.batch.sweeps import sweep as sweep
    from upd.fitting import fit as fit
    from upd.measured import fit_damping as fit_damping
    from upd.measured import read_measured as read_measured
    from upd.report.notebook import RunResult as RunResult
    from upd.report.notebook import load as load
    from upd.runner import run as run
    from upd.scene import Scene as Scene
    from upd.scene import load_scene as load_scene
    from upd.sizing import design as design

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

_ROOMS = "contact dynamics hbm linalg matrices measured own_matrices reduction reference"
__all__ = ["__version__", *_HOME, *_ROOMS.split()]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        globals()[name] = value = getattr(import_module(_HOME[name]), name)
        return value
    if name in __all__:
        return import_module(f"upd.{name}")
    raise AttributeError(f"module 'upd' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
