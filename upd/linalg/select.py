"""Which solver is there, which to take, and what it will cost before anything is assembled; how a
contact sees its bodies: condensed onto the contact dofs, or by products with a solver.
"""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from upd.errors import InputError
from upd.linalg.common import EPS

SOLVERS = ("pardiso", "superlu", "amg")
#: before the name of a solver that serves a contact by products
PRODUCTS = "products by "

# Nested dissection of a solid has nnz(L) ~ n^(4/3) and flops ~ n^2 (A. George, SIAM J. Numer. Anal.
# 10 (1973) 345); an elongated body has smaller separators. Kept dofs come last in the elimination
# and so widen the fronts above them. Fitted to PARDISO's own counts of 139 matrices of the ready
# scenes, all elements, 2 600 to 314 000 dofs: entries within 0.88 ... 1.19, operations within 0.75
# ... 1.43, bytes of given entries within 3 %. A separator of 20-node hexahedra has 3/4 of the nodes
# that one of 27-node ones has, for half the dofs: (9/16) 2^(4/3) = 1.42 and (27/64) 4 = 1.69.
_NNZ, _NNZ_KEPT, _NNZ_SHAPE, _NNZ_SMALL = 19.8, 2.84, -0.65, 5.44
_FLOPS, _FLOPS_KEPT, _FLOPS_SHAPE, _FLOPS_SMALL = 13.3, 4.9, -1.51, -4.56
_NNZ_20, _FLOPS_20 = 1.36, 1.68
#: bytes a dense entry of a condensed matrix: itself and its inverse
DENSE = 16.0
_BYTES_NNZ, _BYTES_ENTRY, _BYTES_DOF = 8.0, 27.7, 540.0
# A mesh of scenes is less regular than the cube that was timed: ordering takes longer. Checks
# and copies of the matrix, s per entry; substitutions that look for free motions.
_ANALYSIS, _CHECKS, _SOLVES = 2.2, 5e-8, 3
# SuperLU orders by minimum degree, whose fill-in grows faster; it runs on one thread.
_MMD_NNZ, _MMD_POWER = 2.4, 1.58
_MMD_FACTOR, _MMD_SOLVE = 1.2e-10, 2.8e-10  # s per nnz^2 / n, s per entry
# Multigrid: about 27 iterations per column, 0.26 us per dof each, where there are no slivers;
# counted on the ready scene at 50 000 to 800 000 dofs, bytes while it is set up.
_AMG_SETUP, _AMG_COLUMN, _AMG_BYTES_DOF = 1.8e-5, 7e-6, 2500.0
#: solutions with K that a first load takes, and each further load of any kind (what is known serves
#: them too); counted on the ready scene: 6 for one load, 22 for 18, 22 for 8 tangential loads and
#: two cycles
FIRST, EACH = 6, 1
#: "auto" condenses unless that takes so many times as long as the fastest other route: the last
#: digits of a run do not change for less
WORTH = 2.0
# Two triangular solutions of a product with a factor: the second refines it.
_SOLUTIONS = 2
# Bytes of the field of a product, per dof.
_FIELD = 8.0


# Speeds of one core of a server of 2.1 GHz, where the seconds in plans were measured.
#: operations per s of a sparse Cholesky factorisation, and of dense Cholesky, LU and products
FACTOR_FLOPS, DENSE_FLOPS = 3.0e10, 2.6e10
#: entries of a matrix ordered and analysed per s
ANALYSIS_ENTRIES = 9.0e6
#: bytes of a factor read per s by a triangular solve
SOLVE_BYTES = 1.0e10
#: hexahedra with eight nodes per s whose stiffness is assembled: numpy on large arrays
ELEMENTS = 6.0e4
#: all threads over one thread, of a sparse factorisation
SPEEDUP = 1.5


@dataclass(frozen=True)
class Solid:
    """What of a body's mesh its factor depends on.

    Attributes
    ----------
    compactness : float
        Half the surface of its lattice over that of a cube of as many hexahedra: 1 for a cube, 2 of
        a bar ten times as long as wide.
    nodes : int
        Per hexahedron.
    entries : float
        Of a row of K.
    """

    compactness: float = 1.0
    nodes: int = 8
    entries: float = 72.0

    @classmethod
    def of(cls, hexes: int, n_node: int, nodes: int) -> Solid:
        """From the numbers of hexahedra and nodes of a body.

        A lattice of H hexahedra with half the surface s has H + s nodes, with mid-edge nodes 4 H +
        3 s, with 27 nodes per hexahedron 8 H + 4 s, but for its edges.
        """
        inner, surface = {8: (1, 1), 20: (4, 3), 27: (8, 4)}[nodes]
        half = max(n_node - inner * hexes, 1) / surface
        return cls(half / (3.0 * hexes ** (2 / 3)), nodes, {8: 69.0, 20: 148.0, 27: 168.0}[nodes])


@dataclass(frozen=True)
class Prediction:
    """Expected cost of a solver on an idle machine, of one thread.

    Rough: for SuperLU on flat bodies several times too much.

    Attributes
    ----------
    bytes : float
        Peak memory.
    seconds : float
        Of one thread.
    factor_seconds : float
        Of these, what more threads make shorter.
    factor_nnz : float
        Entries of the factor; 0 for multigrid.
    """

    bytes: float
    seconds: float
    factor_seconds: float = 0.0
    factor_nnz: float = 0.0

    def substitution(self) -> float:
        """Seconds of one right-hand side, forward and backward."""
        return 16.0 * self.factor_nnz / SOLVE_BYTES


@dataclass(frozen=True)
class Choice:
    """One way to an answer.

    Attributes
    ----------
    name : str
        A solver, or "products by " and a solver.
    why : str
        Why it was taken, or for how many products.
    cost : Prediction
    """

    name: str
    why: str
    cost: Prediction


def threads() -> int:
    """Processors this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on macOS and Windows
        return os.cpu_count() or 1


def threads_used() -> int:
    """Threads that the libraries may use: fewer than the processors where limited."""
    asked = os.environ.get("MKL_NUM_THREADS") or os.environ.get("OMP_NUM_THREADS") or ""
    return min(threads(), int(asked)) if asked.isdigit() and int(asked) > 0 else threads()


def has_pardiso() -> bool:
    """Whether pypardiso is installed."""
    return importlib.util.find_spec("pypardiso") is not None


def predict(n_dof: int, n_kept: int, solver: str, solid: Solid | None = None) -> Prediction:
    """Memory and time of condensing a solid of hexahedra, at the rates of a usual machine.

    Parameters
    ----------
    n_dof : int
        Dofs of the solid.
    n_kept : int
        Dofs condensed onto; 0: factorisation, or one load case with "amg".
    solver : {"pardiso", "superlu", "amg"}
    solid : Solid, optional
        Its shape; a cube of 8-node hexahedra by default.

    Returns
    -------
    Prediction

    Raises
    ------
    InputError
        For an unknown solver.
    """
    n, k = float(n_dof), float(n_kept)
    body = Solid() if solid is None else solid
    if solver == "pardiso":
        quadratic = body.nodes == 20
        nnz = _NNZ * n ** (4 / 3) * body.compactness**_NNZ_SHAPE * (
            _NNZ_20 if quadratic else 1.0
        ) * max(0.2, 1.0 - _NNZ_SMALL * n ** (-1 / 3)) + _NNZ_KEPT * k * n ** (2 / 3)
        flops = (
            _FLOPS
            * n**2
            * body.compactness**_FLOPS_SHAPE
            * (_FLOPS_20 if quadratic else 1.0)
            * (1.0 - _FLOPS_SMALL * n ** (-1 / 3))
            + _FLOPS_KEPT * k * n ** (4 / 3)
            + k**3 / 3
        )
        entries, factor = body.entries * n, flops / FACTOR_FLOPS
        return Prediction(
            _BYTES_NNZ * nnz + _BYTES_ENTRY * entries + _BYTES_DOF * n + DENSE * k**2,
            entries * (_ANALYSIS / ANALYSIS_ENTRIES + _CHECKS)
            + factor
            + _SOLVES * 16.0 * nnz / SOLVE_BYTES
            + k**3 / DENSE_FLOPS,
            factor,
            nnz,
        )
    if solver == "superlu":
        nnz = _MMD_NNZ * n**_MMD_POWER
        # Operations are the squares of the column counts of L, whose mean is nnz / n.
        return Prediction(
            24 * nnz + DENSE * k**2 + 2**24,
            _MMD_FACTOR * nnz**2 / n + 2 * nnz * k * _MMD_SOLVE,
            0.0,
            nnz,
        )
    if solver == "amg":
        return Prediction(
            _AMG_BYTES_DOF * n + DENSE * k**2,
            n * (_AMG_SETUP + _AMG_COLUMN * max(k, 1.0)),
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
    solid: Solid | None = None,
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
    solid : Solid, optional
        Shape of the body.

    Returns
    -------
    Choice

    Raises
    ------
    InputError
        For an unknown name or one that is not installed.
    """
    if solver != "auto":
        cost = predict(n_dof, n_kept, solver, solid)
        if solver == "pardiso" and not has_pardiso():
            raise InputError(
                'Solver "pardiso" is not installed: pip install updampers[mkl], or choose '
                '"superlu" or "amg".'
            )
        if solver == "amg" and direct:
            raise InputError(
                'Solver "amg" has no factor and gives compliances only: choose "pardiso" '
                'or "superlu" here.'
            )
        return Choice(solver, "named by the user", cost)
    limit = memory_limit_bytes if memory_limit_bytes is not None else memory_left()
    names = [
        name
        for name in SOLVERS
        if (name != "pardiso" or has_pardiso()) and (name != "amg" or not direct)
    ]
    costs = {name: predict(n_dof, n_kept, name, solid) for name in names}
    fitting = [name for name in names if costs[name].bytes <= limit]
    if not fitting:
        name = min(names, key=lambda name: costs[name].bytes)
        return Choice(
            name,
            f"needs the least memory, {_size(costs[name].bytes)}, though more than the "
            f"{_size(limit)} it may use",
            costs[name],
        )
    # the only one that serves several bodies side by side, and beyond small ones the fastest
    name = "pardiso" if "pardiso" in fitting else min(fitting, key=lambda name: costs[name].seconds)
    cost = costs[name]
    why = f"it fits: about {cost.seconds:.2g} s and {_size(cost.bytes)} of {_size(limit)}"
    if not has_pardiso():
        why += "; pip install updampers[mkl] for a faster one"
    return Choice(name, why, cost)


def _size(count: float) -> str:
    return f"{count / 1e9:.2g} GB"


def contact_routes(
    n_dof: int,
    n_kept: int,
    products: int,
    *,
    solver: str = "auto",
    memory_limit_bytes: float | None = None,
    solid: Solid | None = None,
) -> list[Choice]:
    """The ways open to a solver's name, the condensing one first.

    Parameters
    ----------
    n_dof, n_kept, products : int
    solver : {"auto", "pardiso", "superlu", "amg"}
    memory_limit_bytes : float, optional
        For the choice among the solvers that condense; None: what the machine has left.
    solid : Solid, optional

    Returns
    -------
    list of Choice
    """
    found = [
        choose(n_dof, n_kept, solver=solver, memory_limit_bytes=memory_limit_bytes, solid=solid)
    ]
    direct = "pardiso" if has_pardiso() else "superlu"
    for name in (direct, "amg") if solver == "auto" else (solver,):
        # multigrid solves for each product, a factor is made once
        cost = predict(n_dof, products if name == "amg" else 0, name, solid)
        more = _SOLUTIONS * products * cost.substitution()
        fields = _FIELD * n_dof * products
        cost = replace(cost, bytes=cost.bytes + fields, seconds=cost.seconds + more)
        found.append(Choice(PRODUCTS + name, f"{products} products", cost))
    return found


def choose_route(
    ways: Sequence[Choice],
    products: int,
    *,
    route: str = "auto",
    memory_limit_bytes: float | None = None,
) -> Choice:
    """The way to take.

    Parameters
    ----------
    ways : sequence of Choice
        From `contact_routes`.
    products : int
        What they were predicted for.
    route : {"auto", "condensed", "products"}
    memory_limit_bytes : float, optional
        None: what the machine has left.

    Returns
    -------
    Choice

    Raises
    ------
    InputError
        For an unknown route.
    """
    if route not in ("auto", "condensed", "products"):
        raise InputError(f'Unknown route {route!r}: choose "auto", "condensed" or "products".')
    limit = memory_limit_bytes if memory_limit_bytes is not None else memory_left()
    dense, *others = ways
    fit = [one for one in others if one.cost.bytes <= limit]
    best = min(fit, key=lambda one: one.cost.seconds, default=None)
    if route == "condensed":
        return dense
    if route == "auto":
        affordable = dense.cost.bytes <= limit
        if affordable and (best is None or dense.cost.seconds <= WORTH * best.cost.seconds):
            return dense
    taken = best if best is not None else min(others, key=lambda one: one.cost.bytes)
    why = (
        f"about {taken.cost.seconds:.2g} s and {taken.cost.bytes / 1e9:.2g} GB for {products} "
        f"products, {dense.cost.seconds:.2g} s and {dense.cost.bytes / 1e9:.2g} GB condensed"
    )
    return replace(taken, why=why)


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
    pardiso = "not installed: pip install updampers[mkl]"
    if has_pardiso():
        try:
            mkl = metadata.version("mkl")
        except metadata.PackageNotFoundError:
            mkl = "from the system"
        pardiso = f"pypardiso {metadata.version('pypardiso')}, MKL {mkl}"
    found = {
        "solver pardiso": pardiso,
        "solver superlu": f"scipy {scipy.__version__}",
        "solver amg": f"pyamg {metadata.version('pyamg')}",
        "BLAS of numpy": _blas(np.show_config(mode="dicts")),
        "BLAS of scipy": _blas(scipy.show_config(mode="dicts")),
        "threads": str(threads()),
        "double precision eps": f"{EPS:.3g}",
    }
    found["solver chosen"] = "pardiso" if has_pardiso() else "superlu"
    return found


def _blas(config: Mapping[str, Any] | None) -> str:
    """Vendor and version from a build configuration."""
    blas = (config or {}).get("Build Dependencies", {}).get("blas", {})
    return f"{blas.get('name', 'unknown')} {blas.get('version', '')}".strip()
