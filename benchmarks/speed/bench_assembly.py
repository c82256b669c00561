"""Time of assembling K: ours against the elasticity form of scikit-fem, both to CSR, in one run.

python benchmarks/speed/bench_assembly.py                   # the stock form with our 2 x 2 x 2
points python benchmarks/speed/bench_assembly.py --default-rule    # and with its default 64 points:
minutes, about 12 GB
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
from skfem import CellBasis, ElementHex1, ElementVector, MeshHex
from skfem.models.elasticity import linear_elasticity

from upd.fem import Material, box_mesh, mass, stiffness
from upd.fem.elements import gauss, hex_element
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


def stock_stiffness(mesh: Mesh, n_gauss: int | None) -> object:
    """scikit-fem's linear_elasticity on its vector element, with n_gauss points per direction or
    its default rule.
    """
    hexes = mesh.hexes[:, hex_element("hex8", mesh).vtk_of_local]
    grid = MeshHex(np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(hexes.T))
    basis = CellBasis(
        grid,
        ElementVector(ElementHex1()),
        quadrature=None if n_gauss is None else gauss(n_gauss, 3),
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


def time_assembly_hex8_vs_stock(with_default_rule: bool = True) -> Iterator[Row]:
    """hex8 at about 226 000 dofs: our time, the stock times, the ratios."""
    mesh = box(8, 40, 40, 44)
    case = f"hex8, {3 * mesh.n_node} dofs"
    ours = fastest(partial(stiffness, mesh, STEEL, "hex8"), 5)
    yield row("time_assembly_hex8", case, ours, "s", "", "K to CSR, best of 5")
    for label, n_gauss, repeats in (("2x2x2 rule", 2, 2), ("default rule (64 points)", None, 1)):
        if n_gauss is None and not with_default_rule:
            continue
        stock = fastest(partial(stock_stiffness, mesh, n_gauss), repeats)
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


def time_assembly_other_elements() -> Iterator[Row]:
    """The other elements at 200 000 to 240 000 dofs, and the mass matrix."""
    for element, n_node, shape, reference in (
        ("hex8i", 8, (40, 40, 44), ""),
        ("hex20", 20, (25, 25, 25), ""),
        ("hex27", 27, (21, 21, 21), 3.0),
    ):
        mesh = box(n_node, *shape)
        case = f"{element}, {3 * mesh.n_node} dofs"
        stiff = fastest(partial(stiffness, mesh, STEEL, element), 3)
        yield row(f"time_assembly_{element}", case, stiff, "s", reference, "K to CSR, best of 3")
        yield row(
            f"time_mass_{element}",
            case,
            fastest(partial(mass, mesh, STEEL), 3),
            "s",
            "",
            "M to CSR, best of 3",
        )


def run(with_default_rule: bool = False) -> list[Row]:
    """All rows: name, case, value, unit, reference, note."""
    return [*time_assembly_hex8_vs_stock(with_default_rule), *time_assembly_other_elements()]


if __name__ == "__main__":
    for line in run(with_default_rule="--default-rule" in sys.argv[1:]):
        print(
            f"{line['name']:32} {line['case']:22} {line['value']:10.3f} {line['unit']:2} "
            f"{line['note']}"
        )
