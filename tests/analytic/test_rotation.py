"""Rotating bodies against the rotating beam and another program."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse.linalg import spsolve

from tests.sectors import STEEL, bladed_sector, model_of
from upd.errors import ConvergenceError, InputError
from upd.fem import Material, box_mesh, mass, stiffness
from upd.fem.inertia import (
    centrifugal_load,
    coriolis,
    displaced_stiffness,
    plane_mass,
    stress_stiffness,
)
from upd.reduction.cyclic import CyclicModel, ModeFamily, with_coriolis

#: speed and first two flapwise frequencies of a clamped beam that rotates about its root, both in
#: sqrt(EI/m)/L^2 (A. D. Wright et al., J. Appl. Mech. 49 (1982) 197)
BEAM = (
    (1, 3.68165, 22.18101),
    (2, 4.13732, 22.61492),
    (4, 5.58500, 24.27335),
    (6, 7.36037, 26.80908),
    (10, 11.20233, 33.64037),
    (12, 13.17015, 37.60311),
)
#: the bladed sector at 1000 rad/s, Hz: stress stiffness and spin softening; and CalculiX 2.20,
#: *STATIC, then *FREQUENCY, PERTURBATION, which has the initial displacements too
SPINNING = {
    0: ((507.2561, 1284.332), (507.1677, 1284.600)),
    1: ((509.4547, 1320.387), (509.3614, 1320.699)),
    2: ((525.0483, 1341.247), (524.9398, 1341.579)),
    3: ((563.6189, 1342.058), (563.4914, 1342.390)),
    6: ((644.0418, 1334.800), (643.9075, 1335.122)),
}


def beam_frequencies(n_hex: int, speed: float) -> tuple[np.ndarray, np.ndarray]:
    """Flapwise and lagwise, of 1000 x 10 x 10 mm without Poisson's effect, in sqrt(EI/m)/L^2."""
    mesh = box_mesh(np.linspace(0, 1000, n_hex + 1), [-5, 5], [-5, 5], 20)
    material = Material(2e5, 0.0, 7.8e-9)
    unit = np.sqrt(2e5 * (1e4 / 12.0) / (7.8e-9 * 100.0)) / 1000.0**2
    K, M = stiffness(mesh, material, "hex20"), mass(mesh, material)
    held = (3 * mesh.nodes["x0"][:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(3 * mesh.n_node), held)
    u = np.zeros(3 * mesh.n_node)
    u[free] = spsolve(K[free][:, free].tocsc(), centrifugal_load(mesh, M)[free])
    spin = stress_stiffness(mesh, material, u, "hex20") - plane_mass(M)
    K_spin = (K + (speed * unit) ** 2 * spin)[free][:, free].toarray()
    value, shapes = eigh(K_spin, M[free][:, free].toarray(), subset_by_index=[0, 5])
    U = np.zeros((mesh.n_node, 3, 6))
    U.reshape(-1, 6)[free] = shapes
    flap = np.abs(U[:, 2]).max(axis=0) > np.abs(U[:, 1]).max(axis=0)
    frequency = np.sqrt(value) / unit
    return frequency[flap][:2], frequency[~flap][:2]


@pytest.mark.parametrize(("speed", "first", "second"), BEAM)
def test_a_rotating_cantilever(speed: float, first: float, second: float) -> None:
    flap, lag = beam_frequencies(20, speed)
    assert flap[0] == pytest.approx(first, rel=5e-4)
    # the second bending mode of twenty elements is .2 % too high, of forty .008 % too low: below
    assert flap[1] == pytest.approx(second, rel=2.5e-3)
    np.testing.assert_allclose(lag, np.sqrt(flap**2 - speed**2), rtol=2e-4)


@pytest.mark.parametrize(("speed", "first", "second"), [BEAM[0], BEAM[-1]])
def test_a_fine_rotating_cantilever(speed: float, first: float, second: float) -> None:
    """The mesh is what twenty elements miss: ten have 1.2 % of the second mode, forty .008 %."""
    flap, _ = beam_frequencies(40, speed)
    assert flap[0] == pytest.approx(first, rel=2e-5)
    assert flap[1] == pytest.approx(second, rel=1e-4)
    coarse, middle = (float(beam_frequencies(n, speed)[0][1]) / second - 1.0 for n in (10, 20))
    assert 0.0 < 4.0 * middle < coarse
    assert abs(flap[1] / second - 1.0) < middle / 10.0


@pytest.mark.parametrize("n", SPINNING)
def test_a_rotating_sector(n: int) -> None:
    model = model_of(bladed_sector(), 12, rotating=True)
    np.testing.assert_allclose(model.modes(n, 2, 1000.0).frequency, SPINNING[n][0], rtol=1e-6)


@pytest.fixture(scope="module")
def displaced() -> CyclicModel:
    """The sector at 1000 rad/s with the stiffness of its displaced state."""
    model = model_of(bladed_sector(), 12)
    mesh = model.sector.mesh
    M = mass(mesh, STEEL)
    u = 1e6 * model.static(centrifugal_load(mesh, M))
    K = displaced_stiffness(mesh, STEEL, u, "hex20") + stress_stiffness(mesh, STEEL, u, "hex20")
    return CyclicModel.of(model.sector, K - 1e6 * plane_mass(M), M)


@pytest.mark.parametrize("n", SPINNING)
def test_with_initial_displacements_it_is_that_of_calculix(n: int, displaced: CyclicModel) -> None:
    np.testing.assert_allclose(displaced.modes(n, 2).frequency, SPINNING[n][1], rtol=1e-6)


def test_no_displacement_leaves_the_stiffness() -> None:
    mesh = bladed_sector()
    K = stiffness(mesh, STEEL, "hex20")
    same = displaced_stiffness(mesh, STEEL, np.zeros(3 * mesh.n_node), "hex20")
    assert abs(same - K).max() < 1e-14 * abs(K).max()


def test_a_turned_body_has_its_stiffness_turned() -> None:
    """F of a rotation: no strain, so K(F) = R K R' for a finite angle."""
    mesh = box_mesh([0, 2, 3], [0, 1], [0, 1.5], 20)
    c, s = np.cos(0.4), np.sin(0.4)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    u = (mesh.points @ (R - np.eye(3)).T).ravel()
    found = displaced_stiffness(mesh, STEEL, u, "hex20").toarray()
    T = np.kron(np.eye(mesh.n_node), R)
    expected = T @ stiffness(mesh, STEEL, "hex20").toarray() @ T.T
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def test_a_uniform_tension_stiffens_by_the_force() -> None:
    """A bar under the force P between its ends: a turn by v/L of the whole takes P v/L."""
    mesh = box_mesh(np.linspace(0, 10, 4), [0, 2], [0, 1], 20)
    material = Material(2e5, 0.0)
    u = np.zeros((mesh.n_node, 3))
    u[:, 0] = 1e-3 * mesh.points[:, 0]
    K = stress_stiffness(mesh, material, u.ravel(), "hex20")
    v = np.zeros((mesh.n_node, 3))
    v[:, 2] = mesh.points[:, 0] / 10.0
    force = (K @ v.ravel()).reshape(-1, 3)
    assert force[mesh.nodes["x1"], 2].sum() == pytest.approx(2e5 * 1e-3 * 2.0 / 10.0, rel=1e-12)


def test_coriolis_splits_the_waves() -> None:
    """509.340 and 509.569 Hz for 509.455 Hz at nodal diameter 1 and 1000 rad/s, by quadratic
    eigenvalues of the full Hermitian pencil.
    """
    model = model_of(bladed_sector(), 12, rotating=True)
    found = model.modes(1, 12, 1000.0)
    U = model.sector.field(found.shapes, 1)
    G = coriolis(mass(model.sector.mesh, STEEL))
    waves = with_coriolis(found.frequency, U, G, 1000.0)
    np.testing.assert_allclose(sorted(waves[:, 0]), (509.340, 509.569), atol=6e-4)
    assert abs(G + G.T).max() < 1e-20


def test_beyond_static_stability_is_one_error() -> None:
    """A blade that bends in the plane of rotation about a small radius; here M_P is made large."""
    model = model_of(bladed_sector(), 12, rotating=True)
    assert model.spin is not None
    soft = CyclicModel(
        model.sector,
        model.K,
        model.M,
        model.sector.matrix(-plane_mass(mass(model.sector.mesh, STEEL))),
    )
    speed = 1.05 * 2.0 * np.pi * soft.modes(0, 1).frequency[0] * 3.0
    family = ModeFamily.of(soft, (0, 6), 4)
    for n in (0, 3):
        with pytest.raises(ConvergenceError, match="beyond static stability"):
            soft.modes(n, 2, speed)
    with pytest.raises(ConvergenceError, match="beyond static stability"):
        family.frequencies(0, 2, speed)


def test_hex8i_has_no_stress_stiffness() -> None:
    mesh = box_mesh([0, 1], [0, 1], [0, 1])
    with pytest.raises(InputError, match="hex8i is not available"):
        stress_stiffness(mesh, STEEL, np.zeros(24), "hex8i")
