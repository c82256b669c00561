"""Time of condensing a body on its contact dofs.

Against one bare factorisation and against back-substitution, in one run.

python benchmarks/speed/bench_condensation.py            # about three minutes on two cores
python benchmarks/speed/bench_condensation.py --quick    # PARDISO and multigrid only
"""

from __future__ import annotations

import sys
import tracemalloc
from collections.abc import Iterator
from time import perf_counter, process_time
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from upd.fem import Material, box_mesh, rigid_body_modes, stiffness
from upd.linalg import amg_solve, factorise_pardiso, predict, schur_pardiso, schur_superlu
from upd.linalg.blocks import WIDTH
from upd.linalg.multigrid import MultigridSolver
from upd.linalg.select import has_pardiso
from upd.linalg.symmetric import Symmetric
from upd.mesh import FloatArray, IntArray
from upd.reduction import condense

Row = dict[str, Any]


def clamped_box(nx: int, ny: int, nz: int, patch: int) -> tuple[csr_array, IntArray, FloatArray]:
    """K of a box of 1 mm hexahedra with nx x ny x nz nodes above its clamped bottom.

    z dofs of a patch of the top; rigid-body modes.
    """
    mesh = box_mesh(*(np.arange(float(n)) for n in (nx, ny, nz + 1)))
    fixed = (3 * mesh.nodes["z0"][:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(3 * mesh.n_node), fixed)
    top = mesh.nodes["z1"]
    x, y = (mesh.points[top, axis] for axis in (0, 1))
    inside = top[(x < patch) & (y < patch)]
    K = stiffness(mesh, Material(200e3, 0.3), "hex8")[free][:, free]
    return csr_array(K), np.searchsorted(free, 3 * inside + 2), rigid_body_modes(mesh.points)[free]


def row(name: str, case: str, value: float, unit: str, reference: float | str, note: str) -> Row:
    """One line of the table."""
    return {
        "name": name,
        "case": case,
        "value": value,
        "unit": unit,
        "reference": reference,
        "note": note,
    }


def time_condensation_vs_factorisation(
    K: csr_array, kept: IntArray, rounds: int = 2
) -> Iterator[Row]:
    """Condensation with recovery against a bare factorisation of the same matrix, both with our
    checks, in turns: the shortest of each.
    """
    case = f"{K.shape[0]} dofs onto {len(kept)}"
    bare, condensed, found = [], [], None
    for _ in range(rounds):
        bare.append(factorise_pardiso(K).seconds)
        found = schur_pardiso(K, kept)
        condensed.append(found.seconds)
    assert found is not None
    predicted = predict(K.shape[0], len(kept), "pardiso")
    size = (
        f"{found.factor_nnz / 1e6:.0f} million factor entries, {found.peak_bytes / 1e9:.2f} "
        f"GB; predicted {predicted.bytes / 1e9:.2f} GB"
    )
    yield row(
        "time_condensation",
        case,
        min(condensed),
        "s",
        predicted.seconds,
        f"{size}; reference is the predicted time",
    )
    yield row("time_factorisation", case, min(bare), "s", "", "the same matrix, nothing kept")
    yield row(
        "time_condensation_vs_factorisation",
        case,
        min(condensed) / min(bare),
        "",
        1.3,
        "at most the reference",
    )
    start = perf_counter()
    u = found.recover(np.ones(len(kept)))
    yield row(
        "time_recovery",
        case,
        perf_counter() - start,
        "s",
        "",
        "one back-substitution with the kept factor",
    )
    residual = K @ u
    forces = np.abs(residual[kept] - found.S.sum(axis=1)).max() / np.abs(residual).max()
    residual[kept] = 0.0
    yield row(
        "error_condensation",
        case,
        float(max(forces, np.abs(residual).max() / np.abs(K @ u).max())),
        "",
        1e-10,
        "K u: S u at kept dofs, 0 else",
    )


def time_condensation_vs_back_substitution(K: csr_array, kept: IntArray) -> Iterator[Row]:
    """Schur complement inside PARDISO against a solve per kept dof with PARDISO's factor, K^-1 at
    the kept dofs.
    """
    case = f"{K.shape[0]} dofs onto {len(kept)}"
    condensed = schur_pardiso(K, kept)
    start = perf_counter()
    factor = factorise_pardiso(K)
    C = np.empty((len(kept), len(kept)))
    for first in range(0, len(kept), 200):
        block = kept[first : first + 200]
        rhs = np.zeros((K.shape[0], len(block)))
        rhs[block, np.arange(len(block))] = 1.0
        C[:, first : first + 200] = factor(rhs)[kept]
    seconds = perf_counter() - start
    error = float(np.abs(C @ condensed.S - np.eye(len(kept))).max())
    yield row("time_condensation", case, condensed.seconds, "s", "", "inside the factorisation")
    yield row(
        "time_back_substitution",
        case,
        seconds,
        "s",
        "",
        f"the compliance, same answer to {error:.0e}",
    )
    yield row(
        "speedup_condensation",
        case,
        seconds / condensed.seconds,
        "",
        "",
        "back-substitution / condensation",
    )


def memory_copies(K: csr_array, kept: IntArray) -> Iterator[Row]:
    """Most bytes of numpy's arrays during a condensation as a contact run does it, over those of K.

    The body's own K, that of its free dofs (all but one in a thousand here), PARDISO's input and
    S; PARDISO's own memory (its factor) is not among them.
    """
    size = K.data.nbytes + K.indices.nbytes + K.indptr.nbytes
    free = np.setdiff1d(np.arange(K.shape[0]), np.arange(0, K.shape[0], 1000))
    kept = np.searchsorted(free, np.intersect1d(free, kept))
    tracemalloc.start()
    body = Symmetric.of(K)
    tracemalloc.reset_peak()
    found = condense(body.submatrix(free), kept, solver="pardiso")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    yield row(
        "memory_copies_vs_matrix",
        f"{K.shape[0]} dofs onto {len(kept)}",
        peak / size,
        "",
        1.5,
        f"K {size / 1e9:.3f} GB, the factor and PARDISO's own {found.peak_bytes / 1e9:.2f} GB; at "
        "most the reference",
    )


def time_superlu(K: csr_array, kept: IntArray) -> Iterator[Row]:
    """The portable solver."""
    found = schur_superlu(K, kept)
    case = f"{K.shape[0]} dofs onto {len(kept)}"
    predicted = predict(K.shape[0], len(kept), "superlu")
    yield row(
        "time_superlu",
        case,
        found.seconds,
        "s",
        predicted.seconds,
        f"{found.factor_nnz / 1e6:.0f} million entries; reference predicted",
    )


def time_multigrid(K: csr_array, kept: IntArray, modes: FloatArray) -> Iterator[Row]:
    """One load case: set-up and conjugate gradients to 1e-8."""
    force = np.zeros(K.shape[0])
    force[kept[len(kept) // 2]] = 1.0
    found = amg_solve(K, force, modes, layout=np.arange(K.shape[0]), rtol=1e-8)
    case = f"{K.shape[0]} dofs, one load case"
    yield row("time_multigrid", case, found.seconds, "s", 16.0, "at most the reference")
    yield row("iterations_multigrid", case, found.iterations, "", 100, "at most the reference")


def block_of_columns(K: csr_array, kept: IntArray, modes: FloatArray) -> Iterator[Row]:
    """Eight columns of the compliance at once against one after the other, processor seconds."""
    solver = MultigridSolver(K, modes, layout=np.arange(K.shape[0]))
    units = np.zeros((K.shape[0], WIDTH))
    units[kept[:: len(kept) // WIDTH][:WIDTH], np.arange(WIDTH)] = 1.0
    # compiled, and with the smallest eigenvalue known
    solver.many(units[:, :2], 1e-4)
    solver(units[:, 0], 1e-4)
    begin = process_time()
    alone = [solver(unit, 1e-10) for unit in units.T.copy()]
    middle = process_time()
    together = solver.many(units, 1e-10)
    seconds = middle - begin, process_time() - middle
    case = f"{K.shape[0]} dofs, {WIDTH} columns"
    apart = max(
        float(np.abs(a.x - b.x).max() / np.abs(a.x).max())
        for a, b in zip(alone, together, strict=True)
    )
    note = f"{seconds[0]:.3g} / {seconds[1]:.3g} s of processor; apart {apart:.1e}"
    yield row("block_speedup", case, seconds[0] / seconds[1], "", 1.0, note)
    most = max(one.iterations for one in alone)
    yield row("block_iterations", case, together[0].iterations, "", most, "reference: one by one")


def run(quick: bool = False) -> list[Row]:
    """All rows; without MKL those of SuperLU and multigrid."""
    rows: list[Row] = []
    K, kept, modes = clamped_box(42, 63, 27, 41)
    rows += time_multigrid(K, kept, modes)
    rows += block_of_columns(K, kept, modes)
    if has_pardiso():
        rows += time_condensation_vs_factorisation(K, kept)
    K, kept, _ = clamped_box(36, 36, 29, 35)
    if has_pardiso():
        rows += memory_copies(K, kept[:: len(kept) // 100])
    if has_pardiso() and not quick:
        rows += time_condensation_vs_back_substitution(K, kept)
    if not quick:
        K, kept, _ = clamped_box(36, 36, 10, 35)
        rows += time_superlu(K, kept)
    return rows


if __name__ == "__main__":
    for line in run(quick="--quick" in sys.argv):
        print(line)
