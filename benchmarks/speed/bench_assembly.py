"""Time of assembling K: ours against the elasticity form of scikit-fem, both to CSR, in one run.
The stock form has our 2 x 2 x 2 points; with its default of 64 it takes minutes and 12 GB.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
from skfem import CellBasis, ElementHex1, ElementVector, MeshHex
from skfem.models.elasticity import linear_elasticity

from upd.fem import Material, box_mesh, stiffness
from upd.fem.elements import BasisMaker, gauss, hex_element
from upd.mesh import Mesh

STEEL = Material(200e3, 0.3)
Row = dict[str, Any]


def box(n_node: int, nx: int, ny: int, nz: int) -> Mesh:
    """A 10 mm cube of nx x ny x nz hexahedra."""
    x, y, z = (np.linspace(0.0, 10.0, n + 1) for n in (nx, ny, nz))
    return box_mesh(x, y, z, n_node)


def fastest(run: Callable[[], object], repeats: int) -> float:
    """Shortest wall time of some runs, s: the least disturbed one."""
    times = []
    for _ in range(repeats):
        start = perf_counter()
        run()
        times.append(perf_counter() - start)
    return min(times)


def stock_stiffness(mesh: Mesh) -> object:
    """scikit-fem's linear_elasticity on its vector element, with two points per direction."""
    hexes = BasisMaker(mesh, hex_element("hex8", mesh)).nodes
    grid = MeshHex(np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(hexes.T))
    basis = CellBasis(
        grid,
        ElementVector(ElementHex1()),
        quadrature=gauss(2, 3),
    )
    return linear_elasticity(STEEL.lam, STEEL.mu).assemble(basis)


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


def time_assembly_hex8_vs_stock() -> Iterator[Row]:
    """hex8 at about 226 000 dofs: our time, the stock time, the ratio."""
    mesh = box(8, 40, 40, 44)
    case = f"hex8, {3 * mesh.n_node} dofs"
    ours = fastest(partial(stiffness, mesh, STEEL, "hex8"), 5)
    yield row("time_assembly_hex8", case, ours, "s", "", "K to CSR, best of 5")
    stock = fastest(partial(stock_stiffness, mesh), 2)
    label = "2x2x2 rule"
    yield row(
        "time_assembly_hex8_stock",
        case,
        stock,
        "s",
        "",
        f"scikit-fem linear_elasticity, {label}, mesh and basis included",
    )
    yield row(
        "ratio_assembly_hex8_vs_stock",
        case,
        stock / ours,
        "x",
        7.0,
        f"stock {label} / ours; reference: the least wanted",
    )


def run() -> list[Row]:
    """All rows: name, case, value, unit, reference, note."""
    return list(time_assembly_hex8_vs_stock())


if __name__ == "__main__":
    for line in run():
        print(line)
