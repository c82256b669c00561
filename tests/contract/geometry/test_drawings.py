"""Drawings of the recipes: what is written on them is what the meshes measure."""

from __future__ import annotations

from dataclasses import fields
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.pictures import png_size
from upd.mesh import FloatArray, recipes
from upd.mesh.section import Length, SectionView, cut
from upd.plot.drawing import draw_sections

#: parts of a side that a set of nodes takes: no corners of the mesh
SETS = {"band", "wire_position", "wire_width"}
#: recipe -> parameters that bring every length and angle onto some drawing
CASES: dict[str, list[dict[str, Any]]] = {
    "sphere_block": [{}, {"radius": 8.0, "patch": 2.0, "block": 9.0}],
    "wedge_platform": [
        {},
        {"angle": 55.0, "base": 26.0, "patch_length": 9.0, "patch_width": 20.0, "band": 4.0},
    ],
    "pads_platform": [{}, {"pad_offset": 0.2, "angle_a": 65.0, "pad_centre": 8.0, "step": 1.5}],
    "blade_rig": [
        {},
        {"patch_width": 20.0, "front_angle": 40.0, "patch_length": 10.0},
        {"arrangement": "asymmetric", "pad_along_slope": 4},
        {
            "arrangement": "asymmetric",
            "rear_angle_right": 35.0,
            "pad_step": 1.5,
            "pad_along_slope": 4,
        },
    ],
    "sector": [
        {},
        {"n_sectors": 12, "blade_thickness": 12.0, "bore_width": 30.0, "face_angle": 11.0},
    ],
}
ALL = [(recipe, given) for recipe, cases in CASES.items() for given in cases]
OWN = Path(recipes.__file__).parents[1] / "scenes" / "examples" / "own_damper.py"


def ends(view: SectionView) -> list[tuple[str, FloatArray]]:
    found = []
    for mark in view.marks:
        points = (
            (mark.start, mark.end)
            if isinstance(mark, Length)
            else (mark.vertex, mark.one, mark.two)[:1]
        )
        found += [(mark.name, np.array(p)) for p in points]
    return found


@pytest.mark.parametrize(("recipe", "given"), ALL)
def test_dimensions_are_those_of_the_mesh(recipe: str, given: dict[str, Any]) -> None:
    """Each number is the parameter's, and lies between corners of the meshes' own sections."""
    params = recipes.made(recipe, given)
    meshes, views = recipes.drawing(recipe, given)
    for view in views:
        bodies = cut(meshes, view)
        corners = np.vstack([outline.reshape(-1, 2) for _, outline in bodies.values()])
        size = float(np.ptp(corners, axis=0).max())
        for mark in view.marks:
            assert mark.value == pytest.approx(getattr(params, mark.name), rel=1e-9), mark.name
        for name, point in ends(view):
            if name in SETS:
                continue
            if isinstance(next(m for m in view.marks if m.name == name), Length):
                # a length's end is on a line through a corner, along which its extension is drawn
                along = np.array(next(m for m in view.marks if m.name == name).along)  # type: ignore[union-attr]
                away = np.abs((corners - point) @ along)
            else:
                away = np.linalg.norm(corners - point, axis=1)
            middle = np.abs(point).min() < 1e-9 or name == "pitch" or "halfwidth" in name
            assert middle or away.min() < 2e-4 * size, (name, point)


@pytest.mark.parametrize("recipe", CASES)
def test_every_length_and_angle_is_drawn(recipe: str) -> None:
    drawn = {
        mark.name
        for given in CASES[recipe]
        for view in recipes.drawing(recipe, given)[1]
        for mark in view.marks
    }
    params = recipes.parameters(recipe)
    assert drawn == {f.name for f in fields(params) if f.metadata.get("quantity")}


def test_section_is_that_of_the_body() -> None:
    """The cut elements fill the section: a half-disc and a square."""
    meshes, (view,) = recipes.drawing("sphere_block", {})

    def area(polygons: list[FloatArray]) -> float:
        total = 0.0
        for corners in polygons:
            (x, y), (u, v) = corners.T, np.roll(corners, -1, axis=0).T
            total += abs(float(np.sum(x * v - u * y))) / 2.0
        return total

    bodies = cut(meshes, view)
    assert area(bodies["block"][0]) == pytest.approx(100.0, rel=1e-3)
    # straight sides between the nodes of the sphere
    assert area(bodies["sphere"][0]) == pytest.approx(np.pi * 25.0 / 2.0, rel=2e-2)


def test_drawing_of_a_recipe_of_ones_own(tmp_path: Path) -> None:
    """Its extents, or what its own views() tells."""
    meshes, views = recipes.drawing(str(OWN), {"divisions": 4})
    assert [[round(m.value, 6) for m in v.marks] for v in views] == [[4.0, 8.0], [4.0, 8.0]]
    more = (
        "\n\ndef views(params: OwnDamper):\n"
        "    from upd.mesh.section import Length, SectionView\n"
        "    mark = Length('width', (-2.0, 0.0), (2.0, 0.0), (1.0, 0.0), 1.0)\n"
        "    return [SectionView('mine', (0.0, 0.0, 0.0), (0, 2), [mark])]\n"
    )
    (tmp_path / "mine.py").write_text(OWN.read_text("utf-8") + more, "utf-8")
    meshes, views = recipes.drawing(str(tmp_path / "mine.py"), {"divisions": 4})
    assert [v.title for v in views] == ["mine"]
    draw_sections(meshes, views).savefig(tmp_path / "mine.png")
    assert png_size((tmp_path / "mine.png").read_bytes())[0] > 500


@pytest.mark.parametrize(("recipe", "given"), ALL)
def test_no_name_on_a_drawing_lies_on_another(recipe: str, given: dict[str, Any]) -> None:
    figure = draw_sections(*recipes.drawing(recipe, given))
    figure.canvas.draw()
    for ax in figure.axes:
        # those that are not slanted: of these the box is what the letters fill
        flat = [t for t in ax.texts if t.get_text() and t.get_rotation() % 90.0 < 1e-6]
        boxes = [(t.get_text(), t.get_window_extent()) for t in flat]
        for (name, box), (other, there) in combinations(boxes, 2):
            assert not box.overlaps(there), (name, other)
