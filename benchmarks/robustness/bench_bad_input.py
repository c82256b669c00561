"""What products do with bodies they may fail on: refused with a message, or solved, with the
iterations and how far the answer is from a direct factor's.

A block of 20 x 20 x 20 hexahedra (`hex8i`), held at its bottom, pressed on a few nodes at the top
to 1e-10 in energy, as one product of a contact does; then whole contacts of the half-sphere by all
routes, whose forces are compared with the condensed run's.

python benchmarks/robustness/bench_bad_input.py
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, csr_array

import upd
from upd.errors import UpdError
from upd.fem import Material, box_mesh, rigid_body_modes, stiffness
from upd.linalg.multigrid import MultigridSolver
from upd.linalg.schur import DirectSolver
from upd.reduction.guyan import require_held

Row = dict[str, Any]
Array = NDArray[np.float64]

ELEMENTS = 20
ACCURACY = 1e-10
SOFT = 2e5
#: case -> edges of an element, Poisson's ratio, E of the upper half over that of the lower one (0:
#: layers of E and 1e4 E by turns)
BODIES = {
    "as usual": ((1.0, 1.0, 1.0), 0.3, 1.0),
    "nu 0.499": ((1.0, 1.0, 1.0), 0.499, 1.0),
    "nu 0.4999": ((1.0, 1.0, 1.0), 0.4999, 1.0),
    "edges 100 : 100 : 1": ((100.0, 100.0, 1.0), 0.3, 1.0),
    "edges 100 : 1 : 1": ((100.0, 1.0, 1.0), 0.3, 1.0),
    "edges 100 : 10 : 1": ((100.0, 10.0, 1.0), 0.3, 1.0),
    "a rod of edges 1 : 1 : 100": ((1.0, 1.0, 100.0), 0.3, 1.0),
    "E 1e4 times as large below": ((1.0, 1.0, 1.0), 0.3, 1e-4),
    "E 1e4 times as large above": ((1.0, 1.0, 1.0), 0.3, 1e4),
    "layers of E and 1e4 E": ((1.0, 1.0, 1.0), 0.3, 0.0),
    "nu 0.499, edges 10 : 10 : 1": ((10.0, 10.0, 1.0), 0.499, 1.0),
    "nu 0.499, edges 100 : 100 : 1": ((100.0, 100.0, 1.0), 0.499, 1.0),
    "nu 0.499, edges 100 : 1 : 1": ((100.0, 1.0, 1.0), 0.499, 1.0),
    "nu 0.499, E 1e4 times as large below": ((1.0, 1.0, 1.0), 0.499, 1e-4),
    "nu 0.499, edges 100 : 100 : 1, E 1e4 times as large below": ((100.0, 100.0, 1.0), 0.499, 1e-4),
}
#: bodies that move without deforming, by what of them is held
HELD = ("nowhere", "along one edge", "in z only", "a loose block beside")
#: of whole contacts: case -> overrides of the scene "hertz"
_NU: dict[str, Any] = {"materials.sphere.nu": 0.499, "materials.block.nu": 0.499}
_STRETCHED: dict[str, Any] = {"geometry.growth": 2.0, "geometry.divisions": 40}
_SOFT: dict[str, Any] = {"materials.block.E": "20 MPa", "loads.normal": ["0.02 N"]}
CONTACTS: dict[str, dict[str, Any]] = {
    "as usual": {},
    "nu 0.499": _NU,
    "edges up to 50 : 1": _STRETCHED,
    "block 1e4 times as soft": _SOFT,
    "nu 0.499, edges up to 50 : 1": {**_NU, **_STRETCHED},
    "all three": {**_NU, **_STRETCHED, **_SOFT},
}
ROUTES = ("factor", "multigrid")
BY_PRODUCTS = {
    "products, factor": ("products", "pardiso"),
    "products, multigrid": ("products", "amg"),
}
COMMON: dict[str, Any] = {
    "want": ["normal"],
    "loads.normal": ["200 N"],
    "geometry.divisions": 16,
    "accuracy": "unknown",
    "left_out.solve": "no",
}


def body(
    edges: tuple[float, float, float] = (1.0, 1.0, 1.0),
    nu: float = 0.3,
    ratio: float = 1.0,
    held: str = "bottom",
) -> tuple[csr_array, Array, NDArray[np.int64], Array, Array]:
    """K, rigid-body modes, free dofs, points and load."""
    side = np.arange(ELEMENTS + 1.0)
    mesh = box_mesh(*(edge * side for edge in edges))
    layer = np.tile(np.arange(ELEMENTS), ELEMENTS**2)
    regions = layer % 2 if ratio == 0.0 else (layer >= ELEMENTS // 2).astype(int)
    materials = (Material(SOFT, nu), Material(SOFT * (ratio or 1e4), nu))
    K, points = csr_array(stiffness(mesh, materials, "hex8i", regions)), mesh.points
    top, bottom = mesh.nodes["z1"], mesh.nodes["z0"]
    away = np.hypot(*(points[top, :2] / edges[:2] - 0.5 * side[-1]).T)
    near = top[np.argsort(away, kind="stable")[:9]]
    load = np.zeros(3 * mesh.n_node)
    load[3 * near + 2], load[3 * near] = -1.0, 0.3
    if held == "along one edge":
        bottom = np.intersect1d(bottom, mesh.nodes["x0"])
    fixed = 3 * bottom + 2 if held == "in z only" else (3 * bottom[:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(3 * mesh.n_node), [] if held == "nowhere" else fixed)
    if held == "a loose block beside":
        free = np.concatenate([free, 3 * mesh.n_node + np.arange(3 * mesh.n_node)])
        points = np.concatenate([points, points + 2.0 * side[-1]])
        K, load = csr_array(block_diag((K, K))), np.concatenate([load, 0.0 * load])
    return csr_array(K[free][:, free]), rigid_body_modes(points)[free], free, points, load[free]


def products() -> Iterator[Row]:
    """One product with each body by each route."""
    cases = {
        case: dict(zip(("edges", "nu", "ratio"), one, strict=True)) for case, one in BODIES.items()
    }
    cases |= {f"held {held}": {"held": held} for held in HELD}
    for case, settings in cases.items():
        K, modes, free, points, load = body(**settings)
        exact: Array | None = None
        for route in ROUTES:
            begin = time.process_time()
            try:
                require_held(K, modes)
                solver = (
                    DirectSolver(K, "pardiso")
                    if route == "factor"
                    else MultigridSolver(K, modes, layout=free, points=points)
                )
                (found,) = solver.many(load[:, None], ACCURACY)
            except UpdError as error:
                yield row(f"product, {case}, {route}", refusal(error, begin))
                continue
            seconds, size = time.process_time() - begin, np.sqrt(found.x @ load)
            note = f"bound {found.error / size:.1e} in energy, {seconds:.1f} s of processor"
            if exact is None:
                exact = found.x
            else:
                e = found.x - exact
                note += f", {np.sqrt(max(e @ (K @ e), 0.0)) / size:.1e} off the factor's in energy"
            yield row(f"product, {case}, {route}", note, found.iterations)


def contacts() -> Iterator[Row]:
    """Whole contacts by each route."""
    for case, overrides in CONTACTS.items():
        exact: Array | None = None
        for route, (way, name) in {"condensed": ("condensed", "pardiso"), **BY_PRODUCTS}.items():
            begin = time.process_time()
            given = {**COMMON, **overrides, "solver.route": way, "solver.name": name}
            try:
                result = upd.run("hertz", overrides=given)
            except UpdError as error:
                yield row(f"contact, {case}, {route}", refusal(error, begin))
                continue
            (found,) = (a for a in result.arrays.values() if "normal_force" in a)
            force = np.asarray(found["normal_force"][1]).ravel()
            note = f"{time.process_time() - begin:.1f} s of processor"
            counts = [one.says for one in result.checks if one.name == "products"]
            if exact is None:
                exact = force
            else:
                apart = np.abs(force - exact).max() / exact.max()
                note += f", largest difference of a force {apart:.1e} of the largest; {counts[0]}"
            yield row(f"contact, {case}, {route}", note, sum(result.size["n_dof"].values()))


def refusal(error: UpdError, begin: float) -> str:
    """Its message and the processor's seconds since ``begin``."""
    return f"refused after {time.process_time() - begin:.1f} s: {' '.join(str(error).split())}"


def row(case: str, note: str, value: float | None = None) -> Row:
    """One line of the table; a refusal has no value."""
    unit = "" if value is None else "dofs" if case.startswith("contact") else "iterations"
    name = case.split(",")[0]
    return {
        "name": name,
        "case": case.removeprefix(f"{name}, "),
        "value": value,
        "unit": unit,
        "target": "",
        "note": note,
    }


def run() -> Iterator[Row]:
    """All rows."""
    yield from products()
    yield from contacts()


if __name__ == "__main__":
    for line in run():
        value = "" if line["value"] is None else f"{line['value']} {line['unit']}"
        print(f"{line['name']:8s} {line['case']:60s} {value:16s} {line['note']}", flush=True)
