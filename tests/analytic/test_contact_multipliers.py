"""Contact forces on the faces of every element.

Areas, consistency, and the Hertz contact they give.
"""

import numpy as np
import pytest

import upd
from upd.contact.model import make_multipliers
from upd.mesh import recipes


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
    }
    result = upd.run("hertz", overrides=settings)
    errors = {r.name: abs(r.error) for r in result.rows if r.error is not None}
    assert errors["max_pressure"] < bound
    assert errors["radius_moment"] < bound
    # Full integration locks a little in the bending of the far mesh.
    assert errors["approach"] < (0.03 if element == "hex8" else 0.02)
