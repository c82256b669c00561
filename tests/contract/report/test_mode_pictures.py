"""Pictures of modes: what is drawn, what the files hold, what is refused, what a failure leaves
behind.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from upd.fem import box_mesh
from upd.mesh import FloatArray, Mesh
from upd.mesh.hexmesh import boundary_faces
from upd.plot.matplotlib import draw_sheet, write_png
from upd.plot.pictures import draw_mode

SIDES = (2.0, 3.0, 4.0)


def box(nodes: int = 8, n: tuple[int, int, int] = (2, 3, 4)) -> Mesh:
    x, y, z = (np.linspace(0.0, side, k + 1) for side, k in zip(SIDES, n, strict=True))
    return box_mesh(x, y, z, nodes)


def shifted(mesh: Mesh, x: float, z: float = 0.0) -> Mesh:
    return mesh.with_points(mesh.points + np.array([x, 0.0, z]))


def bent(mesh: Mesh) -> FloatArray:
    """The first bending mode of a cantilever, roughly, in x."""
    u = np.zeros((mesh.n_node, 3))
    u[:, 0] = mesh.points[:, 2] ** 2
    return u


def drawn(meshes: Mapping[str, Mesh], shapes: Mapping[str, FloatArray], **more: Any) -> Axes:
    return draw_mode(meshes, shapes, Figure().add_subplot(), **more)


def collections(ax: Axes) -> tuple[PolyCollection, LineCollection]:
    (faces,) = (c for c in ax.collections if isinstance(c, PolyCollection))
    (lines,) = (c for c in ax.collections if isinstance(c, LineCollection))
    return faces, lines


@pytest.mark.parametrize("nodes", [8, 20, 27])
def test_boundary_is_closed_and_looks_outwards(nodes: int) -> None:
    mesh = box(nodes)
    quads = boundary_faces(mesh)[:, :4]
    assert len(quads) == 2 * (2 * 3 + 3 * 4 + 4 * 2)
    a, b, c, d = (mesh.points[quads[:, k]] for k in range(4))
    area = 0.5 * np.cross(c - a, d - b)
    centre = 0.25 * (a + b + c + d)
    # closed: the areas cancel; outwards: the divergence theorem gives plus the volume
    assert np.abs(area.sum(axis=0)).max() < 1e-12
    assert np.sum(area * centre) / 3.0 == pytest.approx(np.prod(SIDES), rel=1e-12)


def test_boundary_of_one_hexahedron() -> None:
    assert len(boundary_faces(box(8, (1, 1, 1)))) == 6


def test_only_sides_to_the_viewer_are_drawn_far_ones_first() -> None:
    mesh = box()
    faces, lines = collections(drawn({"box": mesh}, {}))
    # from x > 0, y < 0, above: three sides of the box, and the nine edges of these, cell by cell
    assert len(faces.get_paths()) == 2 * 3 + 3 * 4 + 4 * 2
    assert len(lines.get_segments()) == 3 * (2 + 3 + 4)
    # seen from straight above, upwards is y: two slabs, the upper must come last
    slabs = {"low": mesh, "high": shifted(mesh, 0.0, 10.0)}
    u = np.ones((mesh.n_node, 3))
    for order, grey_last in (
        (("low", "high"), False),
        (("high", "low"), False),
        (("low", "high"), True),
    ):
        moving = "low" if grey_last else "high"
        faces, _ = collections(drawn({k: slabs[k] for k in order}, {moving: u}, view=(-90.0, 90.0)))
        grey = np.ptp(np.asarray(faces.get_facecolor())[:, :3], axis=1) < 1e-12
        assert len(grey) == 2 * 2 * 3
        assert grey.tolist() == (
            [False] * 6 + [True] * 6 if grey_last else [True] * 6 + [False] * 6
        )


def test_one_scale_for_all_bodies() -> None:
    left = box()
    right = shifted(left, 10.0)
    meshes = {"left": left, "right": right}
    diagonal = np.linalg.norm([12.0, 3.0, 4.0])
    up = np.array([0.0, 0.0, 1.0])
    shapes = {
        "left": np.tile(5e3 * up, (left.n_node, 1)),
        "right": np.tile(-2.5e3 * up, (left.n_node, 1)),
    }
    # from the front: x to the right, z upwards
    faces, lines = collections(drawn(meshes, shapes, view=(-90.0, 0.0)))
    corners = np.vstack([path.vertices for path in faces.get_paths()])
    at_left = corners[:, 0] < 5.0
    assert corners[at_left, 1].max() == pytest.approx(4.0 + 0.08 * diagonal, rel=1e-12)
    assert corners[~at_left, 1].max() == pytest.approx(4.0 - 0.04 * diagonal, rel=1e-12)
    still = np.vstack(lines.get_segments())
    assert np.ptp(still, axis=0) == pytest.approx([12.0, 4.0], rel=1e-12)


def test_colours_follow_the_displacement_and_limits_the_bodies() -> None:
    mesh = box(20)
    ax = drawn({"box": mesh}, {"box": bent(mesh)}, title="first bending")
    again = drawn({"box": mesh}, {"box": -1e6 * bent(mesh)})
    assert ax.get_title() == "first bending"
    assert ax.get_aspect() == 1.0
    assert not ax.axison
    assert (ax.get_xlim(), ax.get_ylim()) == (again.get_xlim(), again.get_ylim())
    faces, _ = collections(ax)
    rgb = np.asarray(faces.get_facecolor())[:, :3]
    corners = np.array([np.asarray(path.vertices)[:4] for path in faces.get_paths()])
    low, high = (rgb[f(corners[:, :, 1].mean(axis=1))] for f in (np.argmin, np.argmax))
    # red is what tells viridis' two ends apart under any light
    dark, bright = (np.array(colormaps["viridis"](v)[:3]) for v in (0.0, 1.0))
    assert low[2] / low[0] > 1.0 > high[2] / high[0]
    assert dark[2] / dark[0] > 1.0 > bright[2] / bright[0]
    for (x0, x1), k in ((ax.get_xlim(), 0), (ax.get_ylim(), 1)):
        assert x0 < corners[:, :, k].min() < corners[:, :, k].max() < x1


def test_outline_leaves_out_gentle_turns() -> None:
    mesh = box(8, (1, 1, 2))
    for angle, extra in ((25.0, 0), (35.0, 1)):
        points = mesh.points.copy()
        # the upper half leans to the viewer: its front turns by the angle, back and sides stay
        # where they are
        front = (points[:, 1] == 0.0) & (points[:, 2] > 3.0)
        points[front, 1] -= 2.0 * np.tan(np.radians(angle))
        _, lines = collections(drawn({"box": mesh.with_points(points)}, {}, view=(-90.0, 0.0)))
        # the front's two uprights of two cells each, its lower and upper end, and the fold
        assert len(lines.get_segments()) == 4 + 2 + extra


def test_rest_and_zero_shapes_are_drawn_at_rest() -> None:
    mesh = box()
    zero, _ = collections(drawn({"box": mesh}, {"box": np.zeros((mesh.n_node, 3))}))
    rest, _ = collections(drawn({"box": mesh}, {}))
    for a, b in zip(zero.get_paths(), rest.get_paths(), strict=True):
        assert np.array_equal(a.vertices, b.vertices)


def test_two_blades_are_drawn_at_once(tmp_path: Path) -> None:
    blade = box_mesh(
        np.linspace(0.0, 10.0, 6), np.linspace(0.0, 40.0, 11), np.linspace(0.0, 200.0, 25), 20
    )
    meshes = {"left": blade, "right": shifted(blade, 50.0)}
    shapes = {name: bent(blade) for name in meshes}
    seconds = []
    for _ in range(3):
        begin = time.process_time()
        sheet = draw_sheet([lambda ax: draw_mode(meshes, shapes, ax)], 1)
        (path,) = write_png(sheet, tmp_path / "mode.png")
        seconds.append(time.process_time() - begin)
    assert path.stat().st_size > 0
    assert min(seconds) < 0.3
