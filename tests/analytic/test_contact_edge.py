"""Area of contacts of any shape, from closed forms of pressure and gap and from solved contacts."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from upd.contact import normal_contact
from upd.contact.patch import located_area, make_patch
from upd.reference import contact_modulus, half_space_compliance, hertz_sphere, sphere_gap

Array = NDArray[np.float64]
E, NU, R = 2e5, 0.3, 5.0
MODULUS = contact_modulus(E, NU, E, NU)


def lattice(h: float, half: float, shift: float = 0.0) -> tuple[Array, Array, Array, Array]:
    n = round(half / h)
    x, y = h * (np.arange(-n, n + 1) + shift), h * (np.arange(-n, n + 1) + 0.7 * shift)
    return (x, y, *np.meshgrid(x, y, indexing="ij"))


def on_lattice(
    x: Array, y: Array, p: Array, gap: Array, contact: NDArray[np.bool_], modulus: float
) -> tuple[float, float]:
    points = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    cells = make_patch(points, np.ones(len(points)), (False, False)).cells()
    return located_area(points, cells, p.ravel(), gap.ravel(), contact.ravel(), modulus)


def hertz_fields(r: Array, load: float) -> tuple[Array, Array]:
    """Pressure and gap of Hertz's contact (Johnson, equations 3.39 and 3.42)."""
    hertz = hertz_sphere(load, R, MODULUS)
    a, p0 = hertz.radius, hertz.max_pressure
    p = p0 * np.sqrt(np.maximum(0.0, 1.0 - (r / a) ** 2))
    out = np.maximum(r, a)
    away = (
        p0
        / (2.0 * MODULUS * a)
        * ((2.0 * a**2 - out**2) * np.arcsin(a / out) + a * np.sqrt(out**2 - a**2))
    )
    return p, np.where(r > a, r**2 / (2.0 * R) + away - a**2 / R, 0.0)


def edge_fields(distance: Array) -> tuple[Array, Array]:
    """Pressure and gap near a smooth edge, from the distance to it, positive inside."""
    B = 3000.0
    s = np.abs(distance)
    return (
        np.where(distance > 0.0, B * np.sqrt(s), 0.0),
        np.where(distance > 0.0, 0.0, 4.0 * B / (3.0 * MODULUS) * s**1.5),
    )


def order(error: Callable[[float, float], float], spacings: tuple[float, ...]) -> float:
    """Order of the error's root mean square over nine places of the lattice."""
    rms = [
        np.sqrt(np.mean([error(h, shift) ** 2 for shift in np.linspace(0.0, 0.9, 9)]))
        for h in spacings
    ]
    return float(np.polyfit(np.log(spacings), np.log(rms), 1)[0])


def test_square_face_has_its_own_area() -> None:
    x, y = np.linspace(-2.0, 2.0, 17), np.linspace(-2.0, 2.0, 9)
    p = np.full((17, 9), 25.0)
    area, resolution = on_lattice(x, y, p, 0.0 * p, p > 0.0, MODULUS)
    assert area == pytest.approx(16.0, rel=1e-14)
    assert resolution == 0.0


def test_straight_edge_is_exact_in_any_direction() -> None:
    """The asymptotic fields themselves: the strip ends where they say."""
    x, y, X, Y = lattice(0.1, 1.0)
    for angle, offset in ((0.0, 0.033), (25.0, 0.0), (45.0, 0.0), (90.0, -0.071)):
        n = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        p, gap = edge_fields(offset - (n[0] * X + n[1] * Y))
        # By symmetry a line through the centre halves the square.
        exact = 2.0 + 2.0 * offset
        assert on_lattice(x, y, p, gap, p > 0.0, MODULUS)[0] == pytest.approx(exact, rel=2e-3)


def test_circle_converges_at_second_order() -> None:
    exact = hertz_sphere(150.0, R, MODULUS).area

    def error(h: float, shift: float) -> float:
        x, y, X, Y = lattice(h, 0.3, shift)
        p, gap = hertz_fields(np.hypot(X, Y), 150.0)
        area, resolution = on_lattice(x, y, p, gap, p > 0.0, MODULUS)
        assert abs(area - exact) < resolution
        return area / exact - 1.0

    assert abs(error(0.025, 0.3)) < 0.01
    assert 1.8 < order(error, (0.04, 0.02, 0.01)) < 2.3


def distance_to(shape: str, X: Array, Y: Array) -> tuple[Array, float]:
    """Distance to the edge to first order, positive inside, and the area."""
    if shape == "ellipse":
        level = np.hypot(X / 0.8, Y / 0.4)
        slope = np.hypot(X / 0.64, Y / 0.16) / np.maximum(level, 1e-9)
        return (1.0 - level) / np.maximum(slope, 1e-9), np.pi * 0.32
    if shape == "two discs":
        away = np.minimum(np.hypot(X - 0.5, Y), np.hypot(X + 0.5, Y))
        return 0.3 - away, 2.0 * np.pi * 0.09
    r = np.hypot(X, Y)
    return np.minimum(0.8 - r, r - 0.4), np.pi * 0.48


@pytest.mark.parametrize("shape", ["ellipse", "two discs", "annulus"])
def test_area_of_any_shape(shape: str) -> None:
    def error(h: float, shift: float) -> float:
        x, y, X, Y = lattice(h, 1.0, shift)
        distance, exact = distance_to(shape, X, Y)
        p, gap = edge_fields(distance)
        area, resolution = on_lattice(x, y, p, gap, p > 0.0, MODULUS)
        assert abs(area - exact) < resolution
        return area / exact - 1.0

    assert abs(error(0.05, 0.3)) < 0.01
    if shape == "annulus":
        # Chords leave out as much of the rim as they take of the hole: only the lattice's noise.
        assert max(abs(error(0.05, shift)) for shift in np.linspace(0.0, 0.9, 5)) < 0.002
    else:
        assert order(error, (0.1, 0.05, 0.025)) > 1.8


def solved_area(h: float, gap: Callable[[Array, Array], Array], half: float, load: float) -> float:
    """Area of a contact solved on the lattice of an elastic half-space."""
    x, y, X, Y = lattice(h, half, 0.4)
    n = len(x)
    C = 2.0 * half_space_compliance(n, n, h, h, E, NU)
    answer = normal_contact(C, gap(X, Y).T.ravel(), load=load)
    p, g, on = (v.reshape(n, n).T for v in (answer.force / h**2, answer.gap, answer.contact))
    return on_lattice(x, y, p, g, on, MODULUS)[0]


def test_solved_sphere_has_hertz_area() -> None:
    exact = hertz_sphere(150.0, R, MODULUS).area
    coarse, fine = (
        solved_area(h, lambda X, Y: sphere_gap(np.hypot(X, Y), R), 0.24, 150.0) / exact - 1.0
        for h in (0.04, 0.02)
    )
    # Counted nodes are 7 % and 3 % off.
    assert abs(coarse) < 0.04
    assert abs(fine) < 0.01


def test_two_solved_spots_add_up() -> None:
    """Two spheres 1.6 mm apart hardly feel each other: Hertz's area of half the load, twice."""
    exact = 2.0 * hertz_sphere(60.0, R, MODULUS).area

    def gap(X: Array, Y: Array) -> Array:
        r = np.minimum(np.hypot(X - 0.8, Y), np.hypot(X + 0.8, Y))
        return np.asarray(sphere_gap(r, R))

    assert solved_area(0.05, gap, 1.0, 120.0) == pytest.approx(exact, rel=0.06)


def test_nothing_in_contact_has_no_area() -> None:
    x, y, X, _ = lattice(0.1, 0.3)
    area, resolution = on_lattice(x, y, 0.0 * X, 0.0 * X + 1.0, X > 9.0, MODULUS)
    assert (area, resolution) == (0.0, 0.0)


def test_one_node_keeps_within_its_cells() -> None:
    x, y, X, Y = lattice(0.1, 0.3)
    p = np.where((np.abs(X) < 1e-9) & (np.abs(Y) < 1e-9), 100.0, 0.0)
    area, resolution = on_lattice(x, y, p, np.where(p > 0.0, 0.0, 1e-4), p > 0.0, MODULUS)
    assert 0.0 < area < 0.04
    assert resolution == pytest.approx(0.02)


def o_grid(n: int, half: float) -> tuple[Array, NDArray[np.int64]]:
    """A square of 2n x 2n cells whose lines are bent to rings: points and quadrilaterals."""
    lines = np.linspace(-1.0, 1.0, 2 * n + 1)
    x, y = (v.ravel() for v in np.meshgrid(lines, lines, indexing="ij"))
    largest = np.maximum(np.abs(x), np.abs(y))
    stretch = np.divide(largest, np.hypot(x, y), out=np.ones_like(x), where=largest > 0.0)
    bend = 1.0 - largest + largest * stretch
    cells = make_patch(np.column_stack([x, y]), np.ones(len(x)), (False, False)).cells()
    return half * np.column_stack([x * bend, y * bend]), cells


def test_disc_on_rings_converges_at_second_order() -> None:
    """A disc off the middle of an O-grid, its edge cuts quadrilaterals anywhere."""
    hertz = hertz_sphere(150.0, R, MODULUS)

    def error(h: float, shift: float) -> float:
        points, quads = o_grid(round(0.32 / h), 0.32)
        p, gap = hertz_fields(np.hypot(points[:, 0] - 0.05 * shift, points[:, 1] - 0.02), 150.0)
        area, resolution = located_area(points, quads, p, gap, p > 0.0, MODULUS)
        assert abs(area - hertz.area) < resolution
        return area / hertz.area - 1.0

    assert abs(error(0.02, 0.3)) < 0.01
    assert 1.7 < order(error, (0.04, 0.02, 0.01)) < 2.4
