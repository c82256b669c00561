"""Meshes graded toward the re-entrant edges of a blade: their sizes, and what they leave."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from rigs import LINES

from upd.analyses.forced.again import GRADED, OFF_CONTACT, graded, times
from upd.analyses.forced.varied import PROBLEM, choices
from upd.fem import Material, mass, stiffness
from upd.linalg import modes
from upd.mesh import recipes
from upd.scene import ForcedScene, load_scene
from upd.vary.solve import changed

GAUSS = {"contact.rule": "gauss", "contact.rows": 3, "contact.columns": 2}


def _scene(**changes: Any) -> ForcedScene:
    settings = {key.replace("__", "."): value for key, value in changes.items()}
    scene = load_scene("symmetric-response", {**LINES, **settings})
    assert isinstance(scene, ForcedScene)
    return scene


def _free(scene: ForcedScene, parameters: dict[str, Any]) -> tuple[float, int]:
    """The lowest frequency of half the right blade, Hz, and its dofs."""
    chosen = {"symmetry": "half", "element_nodes": 20, **parameters}
    mesh = recipes.build_mesh(scene.recipe, chosen)[0]["right"]
    held = (3 * mesh.nodes["clamped"][:, None] + np.arange(3)).ravel()
    across = 3 * mesh.nodes["plane_y"] + 1
    free = np.setdiff1d(np.arange(3 * mesh.n_node), np.concatenate([held, across]))
    steel = Material(2e5, 0.3, 7.8e-9)
    K, M = stiffness(mesh, steel, "hex20"), mass(mesh, steel)
    return float(modes(K[free][:, free], M[free][:, free], count=1).frequency[0]), len(free)


def test_graded_meshes_are_nearer_to_the_limit_with_fewer_dofs() -> None:
    """A stiffer mesh has the higher frequency: finer ones, graded far more, tend to 292.4 Hz."""
    scene = _scene(**GAUSS)
    found, few = _free(scene, graded(scene, 1))
    counts = {key: n for key, n in times(scene, 1.5).items() if key != "patch_along_y"}
    even, many = _free(scene, counts)
    finer, _ = _free(scene, graded(scene, 1.5))
    assert few < 0.6 * many
    assert finer < 293.0 < found < even < 294.0


@pytest.mark.parametrize(
    ("element", "power"), [("hex20", 2 / 0.5445 - 1), ("hex8i", 1 / 0.5445 - 1)]
)
def test_sizes_at_edges_fall_faster_than_the_others(element: str, power: float) -> None:
    """The last over the first of n elements goes with n^(p/a - 1)."""
    scene = _scene(mesh__element=element)
    for name, n in (("growth", 4), ("growth_inside", 2)):
        ends = [graded(scene, s)[name] ** (s * n - 1) for s in (1, 2, 3)]
        assert ends[0] == pytest.approx(2.0 ** (n - 1))
        for s, one in zip((2, 3), ends[1:], strict=True):
            assert one / ends[0] == pytest.approx(s**power)


def test_counts_of_a_level_are_whole_and_multiply_those_of_the_scene() -> None:
    scene = _scene(geometry__core_layers=8)
    found = graded(scene, 1.5)
    assert "patch_along_slope" not in found
    assert found["core_layers"] == 18
    assert found["across"] == 6
    with_points = graded(_scene(**GAUSS), 1.5)
    assert {k: v for k, v in with_points.items() if k in GRADED} == {
        key: 10 if key == "patch_along_y" else 1.5 * GRADED[key]
        for key in (*OFF_CONTACT, "patch_along_slope", "patch_along_y")
    }


def test_levels_of_an_accuracy_are_graded() -> None:
    asked = _scene(accuracy={"peak_frequency": "1 %"}, left_out__solve="no")
    (mesh,) = (one for one in choices(asked) if one.name == "mesh")

    def plan(level: int) -> Any:
        return PROBLEM.make_plan(changed(asked, mesh.at(asked, level)))

    assert plan(0).scene.geometry == asked.geometry
    for level, finer in ((1, 1.5), (3, 2.5), (4, 3)):
        assert plan(level).scene.geometry.items() >= graded(asked, finer).items()
