"""Which solver is there, which to take, and what it will cost before anything is assembled."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from upd.errors import InputError
from upd.linalg.common import EPS

SOLVERS = ("pardiso", "superlu", "amg")

# Measured with 8-node hexahedra on boxes of 5 000 to 214 000 dofs, bottom clamped, kept dofs on a
# patch of the top. Nested dissection of a solid has nnz(L) ~ n^(4/3) and flops ~ n^2 (A. George,
# SIAM J. Numer. Anal. 10 (1973) 345). Kept dofs come last in the elimination and so widen the
# fronts above them. Elements with more nodes have up to twice the entries.
_NNZ, _NNZ_KEPT = 18.0, 2.6
_FLOPS, _FLOPS_KEPT = 16.0, 6.0
_FLOP_RATE = 17e9  # per thread and second
_ANALYSIS = 2.0e-5  # s per dof
_BYTES_NNZ, _BYTES_DOF = 8.4, 2700.0
# SuperLU orders by minimum degree, whose fill-in grows faster; it runs on one thread.
_MMD_NNZ, _MMD_POWER = 2.4, 1.58
_MMD_FACTOR, _MMD_SOLVE = 1.2e-10, 2.8e-10  # s per nnz^2 / n, s per entry
# Multigrid: about forty iterations per column on a mesh without slivers.
_AMG_SETUP, _AMG_COLUMN, _AMG_BYTES_DOF = 1.5e-5, 5.0e-5, 2500.0


@dataclass(frozen=True)
class Prediction:
    """Expected cost of a solver on an idle machine.

    Rough: for SuperLU on flat bodies several times too much.

    Attributes
    ----------
    bytes : float
        Peak memory.
    seconds : float
        Wall time.
    """

    bytes: float
    seconds: float


@dataclass(frozen=True)
class Choice:
    """A solver's name and why it was taken."""

    name: str
    why: str


def threads() -> int:
    """Processors this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on macOS and Windows
        return os.cpu_count() or 1


def has_pardiso() -> bool:
    """Whether pypardiso is installed."""
    return importlib.util.find_spec("pypardiso") is not None


def predict(n_dof: int, n_kept: int, solver: str) -> Prediction:
    """Memory and time of condensing a solid of hexahedra.

    Parameters
    ----------
    n_dof : int
        Dofs of the solid.
    n_kept : int
        Dofs condensed onto; 0: factorisation, or one load case with "amg".
    solver : {"pardiso", "superlu", "amg"}

    Returns
    -------
    Prediction

    Raises
    ------
    InputError
        For an unknown solver.
    """
    n, k = float(n_dof), float(n_kept)
    if solver == "pardiso":
        nnz = _NNZ * n ** (4 / 3) + _NNZ_KEPT * k * n ** (2 / 3)
        flops = _FLOPS * n**2 + _FLOPS_KEPT * k * n ** (4 / 3) + k**3 / 3
        return Prediction(
            _BYTES_NNZ * nnz + _BYTES_DOF * n + 16 * k**2,
            _ANALYSIS * n + flops / (_FLOP_RATE * threads()),
        )
    if solver == "superlu":
        nnz = _MMD_NNZ * n**_MMD_POWER
        # Operations are the squares of the column counts of L, whose mean is nnz / n.
        return Prediction(
            24 * nnz + 16 * k**2 + 2**28, _MMD_FACTOR * nnz**2 / n + 2 * nnz * k * _MMD_SOLVE
        )
    if solver == "amg":
        return Prediction(
            _AMG_BYTES_DOF * n + 16 * k**2, n * (_AMG_SETUP + _AMG_COLUMN * max(k, 1.0))
        )
    raise InputError(
        f'Unknown solver {solver!r}: choose "auto", '
        + ", ".join(f'"{name}"' for name in SOLVERS)
        + "."
    )


def choose(
    n_dof: int,
    n_kept: int,
    *,
    solver: str = "auto",
    memory_limit_bytes: float | None = None,
    direct: bool = False,
) -> Choice:
    """The solver for condensing n_dof dofs onto n_kept.

    Parameters
    ----------
    n_dof, n_kept : int
    solver : {"auto", "pardiso", "superlu", "amg"}
        A name is taken as it is.
    memory_limit_bytes : float, optional
        What the solver may use; None: what the machine has left.
    direct : bool, default False
        Only those that factorise.

    Returns
    -------
    Choice

    Raises
    ------
    InputError
        For an unknown name or one that is not installed.
    """
    if solver != "auto":
        predict(n_dof, n_kept, solver)
        if solver == "pardiso" and not has_pardiso():
            raise InputError(
                'Solver "pardiso" is not installed: pip install upd[mkl], or choose '
                '"superlu" or "amg".'
            )
        if solver == "amg" and direct:
            raise InputError(
                'Solver "amg" has no factor and gives compliances only: choose "pardiso" '
                'or "superlu" here.'
            )
        return Choice(solver, "named by the user")
    limit = memory_limit_bytes if memory_limit_bytes is not None else memory_left()
    names = [
        name
        for name in SOLVERS
        if (name != "pardiso" or has_pardiso()) and (name != "amg" or not direct)
    ]
    costs = {name: predict(n_dof, n_kept, name) for name in names}
    fitting = [name for name in names if costs[name].bytes <= limit]
    if not fitting:
        name = min(names, key=lambda name: costs[name].bytes)
        return Choice(
            name,
            f"needs the least memory, {_size(costs[name].bytes)}, though more than the "
            f"{_size(limit)} it may use",
        )
    name = min(fitting, key=lambda name: costs[name].seconds)
    cost = costs[name]
    why = (
        f"the fastest that fits: about {cost.seconds:.2g} s and {_size(cost.bytes)} of "
        f"{_size(limit)}"
    )
    if not has_pardiso():
        why += "; pip install upd[mkl] for a faster one"
    return Choice(name, why)


def _size(count: float) -> str:
    return f"{count / 1e9:.2g} GB"


def memory_left() -> float:
    """Memory that processes can still take, bytes; infinite where the system does not say."""
    try:
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * int(line.split()[1])
    except OSError:
        pass
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return float("inf")


def available() -> dict[str, str]:
    """What is installed, as text.

    Each solver's version, the BLAS of numpy and scipy, threads, rounding unit.
    """
    found = {
        "solver pardiso": _pardiso_version(),
        "solver superlu": f"scipy {scipy.__version__}",
        "solver amg": f"pyamg {metadata.version('pyamg')}",
        "BLAS of numpy": _blas(np.show_config(mode="dicts")),
        "BLAS of scipy": _blas(scipy.show_config(mode="dicts")),
        "threads": str(threads()),
        "double precision eps": f"{EPS:.3g}",
    }
    found["solver chosen"] = "pardiso" if has_pardiso() else "superlu"
    return found


def _pardiso_version() -> str:
    if not has_pardiso():
        return "not installed: pip install upd[mkl]"
    try:
        mkl = metadata.version("mkl")
    except metadata.PackageNotFoundError:
        mkl = "from the system"
    return f"pypardiso {metadata.version('pypardiso')}, MKL {mkl}"


def _blas(config: Mapping[str, Any] | None) -> str:
    """Vendor and version from a build configuration."""
    blas = (config or {}).get("Build Dependencies", {}).get("blas", {})
    return f"{blas.get('name', 'unknown')} {blas.get('version', '')}".strip()
