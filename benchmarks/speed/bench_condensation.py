"""Time of condensing a body on its contact dofs.

Against one bare factorisation, in one run of a minute on two cores; it needs MKL's PARDISO.
"""

from __future__ import annotations

from collections.abc import Iterator
from time import perf_counter
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from upd.fem import Material, box_mesh, stiffness
from upd.linalg import factorise_pardiso, predict, schur_pardiso
from upd.linalg.select import has_pardiso
from upd.mesh import IntArray

Row = dict[str, Any]


def clamped_box(nx: int, ny: int, nz: int, patch: int) -> tuple[csr_array, IntArray]:
    """K of a box of 1 mm hexahedra with nx x ny x nz nodes above its clamped bottom; z dofs of a
    patch of the top.
    """
    mesh = box_mesh(*(np.arange(float(n)) for n in (nx, ny, nz + 1)))
    fixed = (3 * mesh.nodes["z0"][:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(3 * mesh.n_node), fixed)
    top = mesh.nodes["z1"]
    x, y = (mesh.points[top, axis] for axis in (0, 1))
    inside = top[(x < patch) & (y < patch)]
    K = stiffness(mesh, Material(200e3, 0.3), "hex8")[free][:, free]
    return csr_array(K), np.searchsorted(free, 3 * inside + 2)


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
        begin = perf_counter()
        factorise_pardiso(K)
        between = perf_counter()
        found = schur_pardiso(K, kept)
        bare.append(between - begin)
        condensed.append(perf_counter() - between)
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


def run() -> list[Row]:
    """All rows, none without MKL."""
    if not has_pardiso():
        return []
    return list(time_condensation_vs_factorisation(*clamped_box(42, 63, 27, 41)))


if __name__ == "__main__":
    for line in run():
        print(line)
