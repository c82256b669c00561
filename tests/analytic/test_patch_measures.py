"""Measures on the contact patch, from the exact fields of Hertz's contact."""

import numpy as np
import pytest

from upd.contact.patch import consistent_average, make_patch, measure
from upd.errors import MeshError
from upd.reference import contact_modulus, hertz_pressure, hertz_sphere

E_STAR = contact_modulus(2e5, 0.3, 2e5, 0.3)
R = 5.0


def exact_fields(h: float, load: float, half: float = 0.4):
    """Lattice of spacing h with the Hertz pressure averaged over the cells."""
    hertz = hertz_sphere(load, R, E_STAR)
    a, p0 = hertz.radius, hertz.max_pressure
    n = round(half / h)
    lines = h * np.arange(-n, n + 1)
    X, Y = np.meshgrid(lines, lines, indexing="ij")
    points = np.column_stack([X.ravel(), Y.ravel(), 0.0 * X.ravel()])
    fine = (np.arange(10) + 0.5) / 10 - 0.5
    r_cell = np.hypot(X[..., None, None] + h * fine[:, None], Y[..., None, None] + h * fine)
    mean = np.where(r_cell <= a, hertz_pressure(np.minimum(r_cell, a), a, p0), 0.0).mean((-1, -2))
    force = mean * h**2
    patch = make_patch(points, np.full(len(points), h**2), (False, False))
    return patch, force * load / force.sum(), hertz


@pytest.mark.parametrize("load", [50.0, 80.0, 120.0, 200.0])
def test_moments_of_hertz_pressure(load: float) -> None:
    patch, force, hertz = exact_fields(0.025, load)
    m = measure(patch, force)
    # Gathering the pressure of a cell in its node adds F h^2 / 12 per axis to the second moment (by
    # parts), hence to the radius:
    gathered = 2.5 * 0.025**2 / 12.0 / hertz.radius**2
    assert m.radius_moment / hertz.radius - 1.0 == pytest.approx(gathered, rel=0.25)
    assert m.area / hertz.area - 1.0 == pytest.approx(2.0 * gathered, rel=0.25)
    assert m.mean_pressure * m.area == pytest.approx(load, rel=1e-12)
    assert m.radius_outermost <= hertz.radius + 0.025


def test_moments_converge_at_second_order() -> None:
    spacings = np.array([0.04, 0.02, 0.01])
    error = []
    for h in spacings:
        found = [
            measure(*exact_fields(h, F)[:2]).area / hertz_sphere(F, R, E_STAR).area - 1.0
            for F in np.linspace(60.0, 200.0, 9)
        ]
        error.append(float(np.sqrt(np.mean(np.square(found)))))
    assert 1.7 < np.polyfit(np.log(spacings), np.log(error), 1)[0] < 2.3, error


def test_elliptic_contact_off_centre() -> None:
    patch, force, hertz = exact_fields(0.01, 50.0)
    moved = make_patch(
        np.column_stack(
            [c.ravel() for c in np.meshgrid(2.0 * patch.X + 3.0, patch.Y - 1.0, indexing="ij")]
        ),
        np.full(force.size, 2e-4),
        (False, False),
    )
    m = measure(moved, force)
    assert m.area == pytest.approx(2.0 * hertz.area, rel=1e-2)
    assert m.max_pressure == pytest.approx(0.5 * hertz.max_pressure, rel=2e-2)


def test_one_node_has_the_area_of_its_cell() -> None:
    patch, force, _ = exact_fields(0.025, 50.0)
    single = np.where(force == force.max(), 1.0, 0.0)
    m = measure(patch, single)
    assert (m.radius_outermost, m.radius_moment) == (0.0, 0.0)
    assert m.area == pytest.approx(0.025**2)
    assert measure(patch, 0.0 * force).area == 0.0


def test_consistent_average_keeps_integrals_and_linear_fields() -> None:
    patch, _, hertz = exact_fields(0.025, 200.0)
    p = consistent_average(
        patch, lambda r: hertz_pressure(r, hertz.radius, hertz.max_pressure), samples=24
    )
    # The hats sum to one, so the total force is kept whatever the lattice.
    assert (p * 0.025**2).sum() == pytest.approx(200.0, rel=1e-3)
    assert np.allclose(consistent_average(patch, lambda r: 0.0 * r + 3.0), 3.0)


@pytest.mark.parametrize("mirrored", [(True, True), (False, True)])
def test_part_model_measures_as_the_whole(mirrored: tuple[bool, bool]) -> None:
    patch, force, _ = exact_fields(0.025, 200.0)
    x = patch.X[patch.X >= 0.0] if mirrored[0] else patch.X
    y = patch.Y[patch.Y >= 0.0] if mirrored[1] else patch.Y
    X, Y = np.meshgrid(x, y, indexing="ij")
    share = np.where((X == 0.0) & mirrored[0], 0.5, 1.0) * np.where(
        (Y == 0.0) & mirrored[1], 0.5, 1.0
    )
    shuffled = np.random.default_rng(3).permutation(X.size)
    points = np.column_stack([X.ravel(), Y.ravel()])[shuffled]
    part = make_patch(points, (share.ravel() * 0.025**2)[shuffled], mirrored)
    i, j = np.searchsorted(patch.X, x), np.searchsorted(patch.Y, y)
    cut = np.ix_(i, j)
    whole = part.whole((force[cut] * share).ravel()[shuffled], extensive=True)
    assert np.allclose(whole, force, rtol=1e-12, atol=0.0)
    assert np.allclose(part.area(), 0.025**2, rtol=1e-12)
    assert np.allclose(part.whole(force[cut].ravel()[shuffled]), force, rtol=1e-12)


def test_nodes_off_the_lattice_are_refused() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.1, 1.0]])
    with pytest.raises(MeshError, match="no lattice"):
        make_patch(points, np.ones(4), (False, False))
