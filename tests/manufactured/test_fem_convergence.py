"""Orders of convergence for a smooth displacement field on smoothly curved meshes.

p + 1 in L2, p in H1.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.sparse import diags_array
from scipy.sparse.linalg import cg
from skfem import CellBasis

from upd.fem import Material, box_mesh, mass, stiffness
from upd.fem.elements import BasisMaker, gauss, hex_element
from upd.mesh import Mesh

MATERIAL = Material(1.0, 0.3, 1.0)
WAVE = np.array([[0.9, 0.5, 0.7], [0.4, 1.1, 0.6], [0.8, 0.3, 1.0]]) * np.pi
PHASE = np.array([0.3, 0.9, 0.1])

Field = Callable[[np.ndarray], np.ndarray]


def displacement(x: np.ndarray) -> np.ndarray:
    """u_i = sin(k_i . x + c_i) at x (..., 3)."""
    return np.sin(x @ WAVE.T + PHASE)


def gradient(x: np.ndarray) -> np.ndarray:
    """d u_i / d x_j, (..., 3, 3)."""
    return np.cos(x @ WAVE.T + PHASE)[..., None] * WAVE


def body_force(x: np.ndarray) -> np.ndarray:
    """f = -mu Laplace u - (lam + mu) grad div u."""
    s = displacement(x)
    squares = (WAVE**2).sum(axis=1)
    grad_div = -np.einsum("...i,i,ij->...j", s, np.diag(WAVE), WAVE)
    return MATERIAL.mu * squares * s - (MATERIAL.lam + MATERIAL.mu) * grad_div


def curved_cube(n: int, n_node: int) -> Mesh:
    """A smooth image of the unit cube, the same for every n."""
    mesh = box_mesh(*[np.linspace(0, 1, n + 1)] * 3, n_node)
    x, y, z = mesh.points.T
    bent = np.stack(
        [x + 0.08 * np.sin(2 * y + z), y + 0.08 * np.sin(2 * z + x), z + 0.08 * np.sin(2 * x + y)],
        axis=1,
    )
    return mesh.with_points(bent)


def errors(n: int, element: str) -> tuple[float, float]:
    """L2 error of the displacement and of its gradient."""
    mesh = curved_cube(n, int(element[3:].rstrip("i")))
    outer = np.zeros(3 * mesh.n_node, dtype=bool)
    for nodes in mesh.nodes.values():
        outer.reshape(-1, 3)[nodes] = True
    K = stiffness(mesh, MATERIAL, element)
    u = displacement(mesh.points).ravel()
    load = mass(mesh, MATERIAL) @ body_force(mesh.points).ravel() - K[:, outer] @ u[outer]
    inner = K[~outer][:, ~outer]
    u[~outer], info = cg(inner, load[~outer], rtol=1e-10, M=diags_array(1.0 / inner.diagonal()))
    assert info == 0
    # More Gauss points than the element uses: at its own points the gradient may be better than
    # anywhere else.
    maker = BasisMaker(mesh, hex_element(element, mesh))
    mapping = maker.mapping()
    basis = CellBasis(
        mapping.mesh,
        maker.element.scalar,
        mapping=mapping,
        quadrature=gauss(4, 3),
        dofs=maker.basis().dofs,
    )
    local = u.reshape(-1, 3)[maker.nodes]
    x = mapping.F(basis.X).transpose(1, 2, 0)
    values = sum(
        local[:, None, a, :] * np.asarray(f)[:, :, None] for a, (f,) in enumerate(basis.basis)
    )
    slopes = sum(
        local[:, None, a, :, None] * f.grad.transpose(1, 2, 0)[:, :, None, :]
        for a, (f,) in enumerate(basis.basis)
    )
    L2 = ((values - displacement(x)) ** 2).sum(axis=2)
    H1 = ((slopes - gradient(x)) ** 2).sum(axis=(2, 3))
    return float(np.sqrt((L2 * basis.dx).sum())), float(np.sqrt((H1 * basis.dx).sum()))


@pytest.mark.parametrize(
    ("element", "sizes", "order"),
    [
        ("hex8", (4, 6, 9), 1),
        ("hex8i", (4, 6, 9), 1),
        ("hex20", (2, 3, 5), 2),
        ("hex27", (2, 3, 5), 2),
    ],
)
def test_orders_of_convergence(element: str, sizes: tuple[int, ...], order: int) -> None:
    found = np.array([errors(n, element) for n in sizes])
    rates = -np.polyfit(np.log(sizes), np.log(found), 1)[0]
    assert rates[0] > order + 1 - 0.15, rates
    assert rates[1] > order - 0.15, rates


def test_gradient_and_body_force_of_the_manufactured_field_are_consistent() -> None:
    x, h = np.array([0.3, 0.6, 0.2]), 1e-5
    steps = h * np.eye(3)
    numeric = np.stack(
        [(displacement(x + d) - displacement(x - d)) / (2 * h) for d in steps], axis=-1
    )
    np.testing.assert_allclose(numeric, gradient(x), atol=1e-8)

    def stress(at: np.ndarray) -> np.ndarray:
        g = gradient(at)
        return MATERIAL.mu * (g + g.T) + MATERIAL.lam * np.trace(g) * np.eye(3)

    divergence = sum((stress(x + d) - stress(x - d))[:, j] / (2 * h) for j, d in enumerate(steps))
    np.testing.assert_allclose(-divergence, body_force(x), atol=1e-7)
