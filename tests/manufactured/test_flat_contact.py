"""Flat contact of finite element bodies.

Patch test across the interface, bending, rigid punch, Saint-Venant, homogeneity.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from scipy.sparse.linalg import splu

from upd.contact import normal_contact
from upd.contact.model import Body, ContactModel, make_contact_model
from upd.contact.tilt import tilted_contact
from upd.fem import Material, box_mesh, face_mass, stiffness
from upd.mesh import Mesh
from upd.reduction.guyan import condense
from upd.reference.half_space import half_space_compliance

FloatArray = NDArray[np.float64]

NODES = {"hex8": 8, "hex8i": 8, "hex20": 20, "hex27": 27}
UPPER, LOWER = Material(200e3, 0.3), Material(70e3, 0.4)


def moved(mesh: Mesh, seed: int) -> Mesh:
    """The mesh with its inner nodes moved at random by up to a tenth of an element."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    inside = ((mesh.points > low) & (mesh.points < high)).all(axis=1)
    shift = np.random.default_rng(seed).uniform(-0.04, 0.04, mesh.points.shape)
    return mesh.with_points(mesh.points + shift * inside[:, None])


def body(
    name: str, mesh: Mesh, material: Material, element: str, contact: str, distant: str
) -> Body:
    """A block on rollers: the distant face held along z, and two of its nodes so that it can swell
    but not slide or turn.
    """
    named = replace(
        mesh,
        faces={"contact": mesh.faces[contact]},
        nodes={"contact": mesh.nodes[contact], "distant": mesh.nodes[distant]},
    )
    K = stiffness(named, material, element)
    held = np.zeros((mesh.n_node, 3), bool)
    rollers = named.nodes["distant"]
    held[rollers, 2] = True
    at = mesh.points[rollers]
    pin = int(rollers[np.argmin(np.abs(at[:, :2]).sum(axis=1))])
    line = rollers[np.abs(at[:, 1] - mesh.points[pin, 1]) < 1e-9]
    held[pin, :2] = True
    held[line[np.argmax(mesh.points[line, 0])], 1] = True
    free = np.flatnonzero(~held.ravel())
    kept = np.searchsorted(free, 3 * named.nodes["contact"] + 2)
    one = Body(name, named, K, 1 if contact == "z0" else -1)
    one.condensed[(2,)] = (condense(K[free][:, free], kept), free)
    return one


def two_blocks(
    element: str,
    *,
    distorted: bool,
    x: ArrayLike,
    y: ArrayLike,
    heights: tuple[float, float] = (3.0, 2.0),
) -> ContactModel:
    """Two blocks of the same section and mesh of the interface z = 0, of different steel, height
    and layers.
    """
    above = box_mesh(x, y, np.linspace(0, heights[0], 4), NODES[element])
    below = box_mesh(x, y, np.linspace(-heights[1], 0, 3), NODES[element])
    if distorted:
        above, below = moved(above, 1), moved(below, 2)
    return make_contact_model(
        body("upper", above, UPPER, element, "z0", "z1"),
        body("lower", below, LOWER, element, "z1", "z0"),
        (False, False),
    )


# -- patch test ------------------------------------------------------------------------------------


@pytest.mark.parametrize("element", NODES)
def test_uniform_pressure_crosses_the_interface(element: str) -> None:
    """Two blocks in series.

    Uniform pressure at every node to 1e-10, the stiffness of two rods, a uniform state in both
    bodies.
    """
    x, y = [-2.0, -1.1, 0.2, 1.0, 2.0], [-1.5, -0.4, 0.6, 1.5]
    model = two_blocks(element, distorted=True, x=x, y=y)
    area, F = 12.0, 600.0
    answer = normal_contact(model.compliance(2), model.gap, load=F)
    pressure = answer.force / model.multipliers.weights
    assert np.abs(pressure / (F / area) - 1).max() < 1e-10
    series = 1 / (3.0 / (UPPER.E * area) + 2.0 / (LOWER.E * area))
    assert F / answer.approach == pytest.approx(series, rel=1e-10)
    assert answer.stiffness == pytest.approx(series, rel=1e-10)
    assert answer.contact.all()
    for one, material, height in ((model.upper, UPPER, 3.0), (model.lower, LOWER, -2.0)):
        u = one.displacement(2, one.side * model.nodal(answer.force))
        strain = F / area / material.E
        z = one.mesh.points[:, 2]
        # Pressed towards its rollers: u_z = strain (height - z), and swollen by nu strain about the
        # pin.
        assert np.allclose(
            u[:, 2], strain * (height - z), rtol=0, atol=1e-10 * strain * abs(height)
        )
        swell = np.polyfit(one.mesh.points[:, 0], u[:, 0], 1)
        assert swell[0] == pytest.approx(material.nu * strain, rel=1e-9)
        assert one.reaction(u, 2) == pytest.approx(-one.side * F, rel=1e-10)


@pytest.mark.parametrize("element", ["hex8i", "hex27"])
@pytest.mark.parametrize("eccentricity", [(0.0, 0.0), (0.5, 0.0), (0.2, -0.2)])
def test_linear_pressure_crosses_the_interface(
    element: str, eccentricity: tuple[float, float]
) -> None:
    """Load inside the core of the section.

    Pressure of bending theory, and the tilt of two bent rods, exact on bricks.

    Pure bending is quadratic in the coordinates: hex27 has it, hex8i by its incompatible modes; a
    cross-section stays plane.
    """
    width, depth, F = 4.0, 3.0, 600.0
    model = two_blocks(
        element, distorted=False, x=np.linspace(-2, 2, 5), y=np.linspace(-1.5, 1.5, 4)
    )
    upper = model.upper.mesh
    places = upper.points[model.upper.contact][model.multipliers.nodes][:, :2]
    answer = tilted_contact(model.compliance(2), model.gap, places - eccentricity, load=F)
    inertia = np.array([depth * width**3, width * depth**3]) / 12
    M = face_mass(upper.points, upper.faces["contact"])[model.upper.contact][:, model.upper.contact]
    slope = F * np.array(eccentricity) / inertia
    exact = M @ (F / (width * depth) + places @ slope)
    assert np.allclose(answer.normal.force, exact, rtol=0, atol=1e-10 * F)
    flexibility = 3.0 / UPPER.E + 2.0 / LOWER.E
    assert np.allclose(answer.tilt, flexibility * slope, rtol=1e-9, atol=1e-12 * flexibility * F)
    at_load = flexibility * (F / (width * depth) + slope @ eccentricity)
    assert answer.normal.approach == pytest.approx(at_load, rel=1e-10)
    assert answer.normal.contact.all()


# -- rigid flat punch ------------------------------------------------------------------------------

#: F = pi C E* delta L of a square of side L, C its capacitance per side: 0.3667892 (E. Goto, Y.
#: Shi, N. Yoshida, J. Comput. Phys. 100 (1992) 105). The pressure under a rigid punch and the
#: charge on a plate solve the same equation: Johnson, section 5.7, gives 1.15.
SQUARE = np.pi * 0.3667892
E_STAR = LOWER.E / (1 - LOWER.nu**2)


def extrapolated(values: list[float]) -> tuple[float, float]:
    """Limit of three values at steps halved each time, and the order of convergence."""
    a, b, c = values
    ratio = (a - b) / (b - c)
    return c - (b - c) / (ratio - 1), float(np.log2(ratio))


def test_square_punch_on_a_half_space() -> None:
    """Stiffness of piecewise constant pressure.

    The edge's singularity leaves first order, the limit is the literature's to 1e-3.
    """
    stiffness_of = []
    for n in (8, 16, 32):
        C = half_space_compliance(n, n, 2.0 / n, 2.0 / n, LOWER.E, LOWER.nu)
        answer = normal_contact(C, np.zeros(n * n), load=100.0)
        assert answer.contact.all()
        stiffness_of.append(100.0 / answer.approach / (E_STAR * 2.0))
    limit, order = extrapolated(stiffness_of)
    assert limit == pytest.approx(SQUARE, rel=1e-3)
    assert order == pytest.approx(1.0, abs=0.15)


def graded(level: int, size: float) -> FloatArray:
    """Planes of three cells on [0, 1] and cells that grow by sqrt 2 out to `size`, a power of 2,
    all halved `level` times.
    """
    outer = np.sqrt(2.0) ** np.arange(1, 2 * np.log2(size) + 1)
    lines = np.r_[np.linspace(0, 1, 4), outer]
    for _ in range(level):
        lines = np.sort(np.r_[lines, (lines[1:] + lines[:-1]) / 2])
    return lines


def punch(level: int, size: float) -> tuple[float, float]:
    """Compliance delta E* L / F and peak pressure of a rigid punch |x|, |y| <= 1 on a quarter of a
    block of half-width and depth `size`.
    """
    lines = graded(level, size)
    mesh = box_mesh(lines, lines, -lines[::-1])
    K = stiffness(mesh, LOWER, "hex8i")
    held = np.zeros((mesh.n_node, 3), bool)
    held[mesh.nodes["z0"]] = True
    held[mesh.nodes["x0"], 0] = held[mesh.nodes["y0"], 1] = True
    free = np.flatnonzero(~held.ravel())
    top = mesh.nodes["z1"]
    under = top[(mesh.points[top, :2] <= 1 + 1e-9).all(axis=1)]
    C = condense(K[free][:, free], np.searchsorted(free, 3 * under + 2)).compliance()
    answer = normal_contact(C, np.zeros(len(under)), load=1.0)
    assert answer.contact.all()
    return answer.approach / 4.0 * E_STAR * 2.0, float(answer.force.max()) * len(under)


@pytest.mark.parametrize(
    ("small", "bound"), [(2.0, 0.02), pytest.param(4.0, 0.005, marks=pytest.mark.full)]
)
def test_square_punch_on_blocks(small: float, bound: float) -> None:
    """Compliance of the finite block.

    First order in the cell (from the stiff side, the nodes at the edge reach half a cell beyond
    it), first order in 1 / size (what the half-space has beyond the block). Both limits together
    are the literature's; the mesh is refined on the small block only, so that what the coarse mesh
    has wrong in the far field stays.

    The pressure at the corner does not converge: the share of one node there falls slower than its
    area.
    """
    by_mesh, peaks = zip(*(punch(level, small) for level in (0, 1, 2)), strict=True)
    by_size = [punch(0, size)[0] for size in (small, 16.0, 32.0, 64.0)]
    fine, order = extrapolated(list(by_mesh))
    large, decay = extrapolated(by_size[1:])
    assert order == pytest.approx(1.0, abs=0.2)
    assert decay == pytest.approx(1.0, abs=0.05)
    assert (np.diff(by_mesh) > 0).all() and (np.diff(by_size) > 0).all()
    assert (fine + large - by_size[0]) * SQUARE == pytest.approx(1.0, abs=bound)
    assert (np.diff(peaks) > 0).all()


# -- Saint-Venant ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("odd", "decay", "wave"),
    [(False, 4.2123922, 2.2507286), (True, 7.4976763, 2.7686783)],
    ids=["symmetric", "antisymmetric"],
)
def test_a_balanced_load_dies_out(odd: bool, decay: float, wave: float) -> None:
    """Plane strain strip of width b.

    It fades as exp(-(decay +- i wave) z / b), sin s = -+ s (Timoshenko and Goodier, art. 26).

    Displacements at equal distances follow a recurrence of two terms, whose roots are these
    exponentials.
    """
    mesh = box_mesh(np.linspace(-0.5, 0.5, 25), [0.0, 0.1], np.linspace(0, 3, 73), 20)
    K = stiffness(mesh, LOWER, "hex20")
    held = np.zeros((mesh.n_node, 3), bool)
    held[:, 1] = True
    held[mesh.nodes["z0"]] = True
    free = np.flatnonzero(~held.ravel())
    top = mesh.nodes["z1"]
    x = mesh.points[top, 0]
    shape = np.polynomial.legendre.legval(2 * x, [0, 0, 0, 1] if odd else [0, 0, 1])
    M = face_mass(mesh.points, mesh.faces["z1"])[top][:, top]
    rigid = np.column_stack([np.ones_like(x), x])
    force = np.zeros(3 * mesh.n_node)
    force[3 * top + 2] = M @ (
        shape - rigid @ np.linalg.solve(rigid.T @ (M @ rigid), rigid.T @ (M @ shape))
    )
    assert np.abs(rigid.T @ force[3 * top + 2]).max() < 1e-12 * np.abs(force).sum()
    u = np.zeros(3 * mesh.n_node)
    u[free] = splu(K[free][:, free].tocsc()).solve(force[free])
    at = mesh.points
    step = 1 / 12
    rows = [
        np.flatnonzero((np.abs(at[:, 2] - (3 - z)) < 1e-9) & (at[:, 1] == 0))
        for z in np.arange(9, 19) * step
    ]
    s = np.array([u.reshape(-1, 3)[row][np.argsort(at[row, 0])][:, [0, 2]].ravel() for row in rows])
    # Every pair of rows relative to its own size, so that the first do not drown the last.
    scale = np.linalg.norm(s[1:-1], axis=1)[:, None]
    a, b = ((s[k : len(s) - 2 + k] / scale).ravel() for k in (1, 0))
    p, q = np.linalg.lstsq(np.column_stack([a, b]), (s[2:] / scale).ravel(), rcond=None)[0]
    exponent = -np.log(np.roots([1, -p, -q]).astype(complex)) / step
    assert exponent.real.max() == pytest.approx(decay, rel=1e-3)
    assert np.abs(exponent.imag).max() == pytest.approx(wave, rel=1e-3)


# -- homogeneity -----------------------------------------------------------------------------------


def plate_on_block() -> FloatArray:
    """Compliance of a thin plate, held by a spot in the middle of its top, on a block of the same
    section: its rim lifts.
    """
    lines = np.linspace(-3, 3, 13)
    plate, block = (
        box_mesh(lines, lines, [0.0, 0.25, 0.5]),
        box_mesh(lines, lines, np.linspace(-3, 0, 5)),
    )
    spot = plate.nodes["z1"][(np.abs(plate.points[plate.nodes["z1"], :2]) < 0.75).all(axis=1)]
    total = np.zeros((169, 169))
    for mesh, contact, held in ((plate, "z0", spot), (block, "z1", block.nodes["z0"])):
        K = stiffness(mesh, UPPER)
        free = np.setdiff1d(np.arange(3 * mesh.n_node), (3 * held[:, None] + np.arange(3)).ravel())
        total += condense(
            K[free][:, free], np.searchsorted(free, 3 * mesh.nodes[contact] + 2)
        ).compliance()
    return total


def test_the_answer_is_homogeneous_in_the_load() -> None:
    """Zero gap: a receding contact whose set does not depend on the load, forces and approach in
    proportion to it.
    """
    C = plate_on_block()
    base = normal_contact(C, np.zeros(169), load=1.0)
    assert 9 <= base.contact.sum() < 169
    for load in (1e-9, 0.37, 5e3):
        answer = normal_contact(C, np.zeros(169), load=load)
        assert np.array_equal(answer.contact, base.contact)
        assert np.allclose(answer.force, load * base.force, rtol=0, atol=1e-12 * load)
        assert answer.approach == pytest.approx(load * base.approach, rel=1e-12)
        assert answer.stiffness == pytest.approx(load / answer.approach, rel=1e-12)


def test_nothing_opens_is_the_linear_answer() -> None:
    """Blocks of unequal height pressed evenly.

    The unilateral answer is that of bodies joined along the normal, tilted ones included.
    """
    model = two_blocks(
        "hex8i", distorted=False, x=np.linspace(-2, 2, 7), y=np.linspace(-1.5, 1.5, 6)
    )
    C = model.compliance(2)
    n = len(C)
    unit = np.linalg.solve(C, np.ones(n))
    answer = normal_contact(C, model.gap, load=50.0)
    noise = n * np.finfo(float).eps * np.linalg.cond(C)
    assert answer.contact.all() and answer.iterations == 1
    assert np.allclose(answer.force, 50.0 * unit / unit.sum(), rtol=noise)
    assert answer.approach == pytest.approx(50.0 / unit.sum(), rel=noise)
