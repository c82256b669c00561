"""Contact faces of any quadrilaterals: areas, symmetry and slopes, and runs of such meshes."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import upd
from upd.contact.patch import make_patch
from upd.reference import contact_modulus, hertz_sphere

Array = NDArray[np.float64]

SCENE = """name = "{name}"
title = "two bodies"
want = ["normal", "stiffness"]
accuracy = "unknown"
[geometry]
recipe = "./{name}.inp"
[mesh]
element = "hex8"
[materials]
damper = {{ E = "200 GPa", nu = 0.0 }}
platform = {{ E = "200 GPa", nu = 0.0 }}
[loads]
normal = ["{load} N"]
[left_out]
solve = "no"
"""


def square(n: int) -> tuple[Array, NDArray[np.int64]]:
    """(-1, 1)^2 and its quadrilaterals."""
    lines = np.linspace(-1.0, 1.0, n + 1)
    points = np.stack(np.meshgrid(lines, lines, indexing="ij"), -1).reshape(-1, 2)
    return points, make_patch(points, np.ones(len(points)), (False, False)).cells()


def disc(n: int, radius: float) -> tuple[Array, NDArray[np.int64]]:
    """The square bent to a disc."""
    points, quads = square(n)
    largest = np.abs(points).max(axis=1)
    size = np.where(largest > 0.0, np.hypot(*points.T), 1.0)
    bend = 1.0 - largest + largest * largest / size
    return radius * points * bend[:, None], quads


def ring(n: int, inner: float, outer: float) -> tuple[Array, NDArray[np.int64]]:
    r, t = np.meshgrid(np.linspace(inner, outer, 4), 2.0 * np.pi * np.arange(n) / n, indexing="ij")
    i, j = (v.ravel() for v in np.meshgrid(np.arange(3), np.arange(n), indexing="ij"))
    k = (j + 1) % n
    quads = np.column_stack([i * n + j, (i + 1) * n + j, (i + 1) * n + k, i * n + k])
    return np.column_stack([(r * np.cos(t)).ravel(), (r * np.sin(t)).ravel()]), quads


def write(
    folder: Path, name: str, points: Array, quads: Array, heights: Array, gap: Array, load: float
) -> Path:
    """Both bodies as hexahedra between copies of the face at ``heights``, the first one 0."""
    nodes, hexes, sets, lines = [], {"damper": [], "platform": []}, {}, ["*NODE"]
    n = len(points)
    for side, body in ((1.0, "damper"), (-1.0, "platform")):
        first, share = len(nodes), 1.0 - heights / heights[-1]
        for z, part in zip(heights, share, strict=True):
            lift = gap * part if side > 0 else 0.0 * gap
            nodes += np.column_stack([points, side * z + lift]).tolist()
        for k in range(len(heights) - 1):
            low = first + n * k + quads
            pair = (low, low + n) if side > 0 else (low + n, low)
            hexes[body] += (np.hstack(pair) + 1).tolist()
        sets[f"{body.upper()}_CONTACT"] = first + np.arange(n) + 1
        sets[f"{body.upper()}_DISTANT"] = first + n * (len(heights) - 1) + np.arange(n) + 1
    lines += [f"{i}, {x!r}, {y!r}, {z!r}" for i, (x, y, z) in enumerate(nodes, 1)]
    count = 0
    for body, found in hexes.items():
        lines.append(f"*ELEMENT, TYPE=C3D8, ELSET={body}")
        lines += [f"{count + i}, {', '.join(map(str, h))}" for i, h in enumerate(found, 1)]
        count += len(found)
    for key, members in sets.items():
        lines += [f"*NSET, NSET={key}", *(f"{m}," for m in members)]
    (folder / f"{name}.inp").write_text("\n".join(lines) + "\n")
    (folder / f"{name}.toml").write_text(SCENE.format(name=name, load=load))
    return folder / f"{name}.toml"


def polygon(points: Array, quads: Array) -> float:
    x, y = points[quads, 0], points[quads, 1]
    return 0.5 * float(np.abs((x * np.roll(y, -1, 1) - y * np.roll(x, -1, 1)).sum(axis=1)).sum())


@pytest.mark.parametrize("shape", ["turned", "disc", "ring"])
def test_flat_faces_press_evenly(shape: str, tmp_path: Path) -> None:
    """nu = 0: F / A everywhere, K_N = E A / 2h."""
    points, quads = {
        "turned": (square(4)[0] @ [[0.8, 0.6], [-0.6, 0.8]], square(4)[1]),
        "disc": disc(6, 2.0),
        "ring": ring(16, 1.0, 2.0),
    }[shape]
    area, h = polygon(points, quads), 3.0
    scene = write(tmp_path, shape, points, quads, np.linspace(0, h, 4), np.zeros(len(points)), 400)
    found = upd.run(str(scene), out=str(tmp_path / "out"))
    at = "F=400 N"
    assert found.value("contact_area", at) == pytest.approx(area, rel=1e-9)
    assert found.value("max_pressure", at) == pytest.approx(400.0 / area, rel=1e-6)
    assert found.value("K_N_secant_raw", at) == pytest.approx(2e5 * area / (2.0 * h), rel=1e-6)


def test_sphere_on_rings_is_near_hertz(tmp_path: Path) -> None:
    """Spacing a / 5, bodies 10 a wide and deep, held at the bottom: within 5 %."""
    radius, load, modulus = 50.0, 5.0, contact_modulus(2e5, 0.0, 2e5, 0.0)
    hertz = hertz_sphere(load, radius, modulus)
    points, quads = disc(24, 1.0)
    # half way to the square: the corners of the outermost ring stay acute enough for hexahedra
    points = 0.5 * (points + square(24)[0])
    r = np.hypot(*points.T)
    points *= (0.2 + 0.8 * r**2)[:, None] * 0.6
    gap = (points**2).sum(axis=1) / (2.0 * radius)
    heights = 0.6 * np.linspace(0.0, 1.0, 13) ** 2
    found = upd.run(
        str(write(tmp_path, "sphere", points, quads, heights, gap, load)),
        out=str(tmp_path / "out"),
    )
    at = "F=5 N"
    assert found.value("radius_moment", at) == pytest.approx(1e3 * hertz.radius, rel=0.05)
    assert found.value("contact_area", at) == pytest.approx(1e6 * hertz.area, rel=0.05)
    assert found.value("max_pressure", at) == pytest.approx(hertz.max_pressure, rel=0.05)


def test_quarter_patch_measures_as_the_whole() -> None:
    points, quads = disc(8, 1.0)
    weights = np.bincount(quads.ravel(), minlength=len(points)) * 1.0
    whole = make_patch(points, weights, (False, False), quads=quads)
    inside = (points[quads] >= 0.0).all(axis=(1, 2))
    kept, local = np.unique(quads[inside], return_inverse=True)
    own = np.bincount(local.ravel(), minlength=len(kept)) * 1.0
    part = make_patch(points[kept], own, (True, True), quads=local.reshape(-1, 4))
    assert len(part.cells()) == len(quads) and len(part.points()) == len(points)
    found, right = (sorted(map(tuple, one.points().round(9))) for one in (part, whole))
    assert np.allclose(found, right, atol=2e-9)
    assert part.area().sum() == pytest.approx(whole.area().sum(), rel=1e-14)
    assert part.rim().sum() == whole.rim().sum() == 32


def test_slopes_of_a_plane_are_exact() -> None:
    points, quads = disc(6, 1.0)
    patch = make_patch(points, np.ones(len(points)), (False, False), quads=quads)
    along, across = patch.slopes(3.0 * points[:, 0] - 2.0 * points[:, 1])
    assert np.allclose(along, 3.0) and np.allclose(across, -2.0)
