"""K and M of another finite-element program in a forced response with friction.

Copy it and put your own files and dofs in.

    ./run.sh python upd/scenes/examples/own_matrices.py

Two cantilevers stand for the blades and a slider between them for the damper. Units are those of
the matrices: N, mm and t give Hz.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from upd.matrices import DofMap, Matrices, write_matrices
from upd.own_matrices import Joint, OwnResponse, forced_response

Array = np.ndarray[Any, np.dtype[np.float64]]

#: elements per blade and its data: a steel cantilever of 150 mm, 10 mm x 30 mm
ELEMENTS, LENGTH, E, RHO = 12, 150.0, 2.0e5, 7.8e-9

#: a dof is (node, direction); a motion is a dof, or several with their weights
TIP, MIDDLE = (ELEMENTS, "UX"), (ELEMENTS // 2, "UX")
#: the damper: a slider between the blades at two thirds of their length
RUBBING = {(8, "UX"): 1.0, (108, "UX"): -1.0}
FREQUENCIES = np.linspace(320.0, 430.0, 23)
ASKED: dict[str, Any] = {
    "joints": [Joint(closing={}, sliding=[RUBBING], k_n=0.0, k_t=600.0, mu=0.4, preload=20.0)],
    "force": {MIDDLE: 20.0},
    "watch": {"tip": TIP, "gap": RUBBING},
    "frequencies": FREQUENCIES,
    "harmonics": (1, 3),
}


def beam(width: float, n: int = ELEMENTS) -> tuple[Array, Array]:
    """K and M of a cantilever in bending (Hermite elements), dofs deflection and slope of every
    free node.
    """
    a = LENGTH / n
    EI, rho_a = E * width * 10.0**3 / 12.0, RHO * width * 10.0
    k = (
        EI
        / a**3
        * np.array(
            [
                [12, 6 * a, -12, 6 * a],
                [6 * a, 4 * a**2, -6 * a, 2 * a**2],
                [-12, -6 * a, 12, -6 * a],
                [6 * a, 2 * a**2, -6 * a, 4 * a**2],
            ]
        )
    )
    m = (
        rho_a
        * a
        / 420.0
        * np.array(
            [
                [156, 22 * a, 54, -13 * a],
                [22 * a, 4 * a**2, 13 * a, -3 * a**2],
                [54, 13 * a, 156, -22 * a],
                [-13 * a, -3 * a**2, -22 * a, 4 * a**2],
            ]
        )
    )
    K, M = np.zeros((2 * n + 2, 2 * n + 2)), np.zeros((2 * n + 2, 2 * n + 2))
    for i in range(n):
        part = slice(2 * i, 2 * i + 4)
        K[part, part] += k
        M[part, part] += m
    return K[2:, 2:], M[2:, 2:]


def two_blades(n: int = ELEMENTS) -> Matrices:
    """Two cantilevers, a little mistuned, side by side.

    Nodes 1 to n and 101 to 100 + n, deflection UX, slope ROTY.
    """
    (K1, M1), (K2, M2) = beam(30.0, n), beam(30.6, n)
    zero = np.zeros_like(K1)
    node = np.repeat(np.concatenate([np.arange(1, n + 1), np.arange(101, 101 + n)]), 2)
    K, M = np.block([[K1, zero], [zero, K2]]), np.block([[M1, zero], [zero, M2]])
    return Matrices(K, M, DofMap(node, np.tile([0, 4], 2 * n)))  # type: ignore[arg-type]


def respond(folder: Path) -> OwnResponse:
    """Write the files your program would write (Matrix Market, Harwell-Boeing or npz), then read
    and solve them.
    """
    K, M, dofs = write_matrices(folder, two_blades(), name="blades")
    return forced_response(K, M, dofs=dofs, zeta=0.005, **ASKED)


def main() -> None:
    """Print how much the friction takes off the tip's peak."""
    with TemporaryDirectory() as folder:
        answer = respond(Path(folder))
    free = answer.free("tip", np.linspace(FREQUENCIES[0], FREQUENCIES[-1], 2001)).max()
    frequency, peak = answer.peak("tip")
    print(
        f"tip: {1e3 * free:.0f} um free, {1e3 * peak:.0f} um at {frequency:.1f} Hz with "
        f"the damper ({answer.status})"
    )


if __name__ == "__main__":
    main()
