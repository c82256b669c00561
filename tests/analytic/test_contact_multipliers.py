"""Contact forces on the faces of every element.

Areas, consistency, and the Hertz contact they give.
"""

import numpy as np
import pytest

import upd
from upd.contact.model import make_multipliers
from upd.fem import face_mass
from upd.mesh import recipes
from upd.reference import contact_modulus, hertz_pressure, hertz_sphere


@pytest.mark.parametrize("nodes", [8, 20, 27])
def test_uniform_pressure_is_carried_consistently(nodes: int) -> None:
    meshes, _ = recipes.build_mesh(
        "sphere_block", {"divisions": 6, "element_nodes": nodes, "symmetry": "quarter"}
    )
    m = make_multipliers(meshes["block"])
    assert m.weights.min() > 0.0
    assert m.weights.sum() == pytest.approx(0.25, rel=1e-12)
    assert np.allclose(m.spread.sum(axis=0), 1.0)
    # Moments of a uniform pressure: total force p A through the middle of the quarter patch.
    force = m.spread @ (3.0 * m.weights)
    points = meshes["block"].points[meshes["block"].nodes["contact"]]
    assert force.sum() == pytest.approx(0.75, rel=1e-12)
    assert np.allclose(force @ points[:, :2] / force.sum(), 0.25)


@pytest.mark.parametrize(("nodes", "power"), [(8, 0), (20, 0), (20, 1), (27, 0), (27, 1), (27, 2)])
def test_pressure_of_consistent_forces_is_exact(nodes: int, power: int) -> None:
    """What the faces can carry comes back from its consistent load, edges of the patch included."""
    meshes, _ = recipes.build_mesh(
        "sphere_block", {"divisions": 6, "element_nodes": nodes, "symmetry": "quarter"}
    )
    block = meshes["block"]
    m, points = make_multipliers(block), block.points[block.nodes["contact"]]
    place = np.full(block.n_node, -1)
    place[block.nodes["contact"]] = np.arange(len(points))
    x, y = points[:, :2].T
    exact = 5.0 + (x - 2.0 * y + 3.0 * x * y * (power == 2)) ** power
    consistent = face_mass(points * [1.0, 1.0, 0.0], place[block.faces["contact"]]) @ exact
    # 8-node faces carry bilinear pressure: its load P' f is that of the multipliers at corners.
    force = np.linalg.lstsq(m.spread.toarray(), consistent, rcond=None)[0]
    assert np.allclose(m.pressure(force), exact[m.nodes], rtol=1e-10)


def test_hertz_pressure_on_9_node_faces_does_not_alternate() -> None:
    """Over the middle of the contact force over area is up to 0.7 % off, in turns."""
    settings = {"want": ["normal"], "mesh.element": "hex27", "geometry.patch": "auto"}
    settings |= {"geometry.divisions": 12, "loads.normal": ["200 N"], "left_out.solve": "no"}
    fields = upd.run("hertz", overrides=settings).arrays["F=200 N"]
    x, y, p = (np.asarray(fields[name][1]) for name in ("x", "y", "pressure"))
    hertz = hertz_sphere(200.0, 5.0, contact_modulus(2e5, 0.3, 2e5, 0.3))
    r = np.hypot(x[:, None], y)
    middle = r < 0.5 * hertz.radius
    exact = hertz_pressure(r[middle], hertz.radius, hertz.max_pressure)
    assert np.abs(p[middle] / exact - 1.0).max() < 0.003


@pytest.mark.parametrize(
    ("element", "divisions", "bound"),
    [("hex8", 20, 0.02), ("hex8i", 20, 0.01), ("hex20", 20, 0.03), ("hex27", 10, 0.02)],
)
def test_hertz_with_every_element(element: str, divisions: int, bound: float) -> None:
    settings = {
        "want": ["normal"],
        "mesh.element": element,
        "geometry.patch": "auto",
        "geometry.divisions": divisions,
        "loads.normal": ["200 N"],
        "left_out.solve": "no",
    }
    result = upd.run("hertz", overrides=settings)
    errors = {r.name: abs(r.error) for r in result.rows if r.error is not None}
    assert errors["max_pressure"] < bound
    assert errors["radius_moment"] < bound
    # Full integration locks a little in the bending of the far mesh.
    assert errors["approach"] < (0.03 if element == "hex8" else 0.02)
