"""Half-space Green's functions: Navier's equations, free surface, equilibrium.

Rectangles and lattices against integrals and Hertz.
"""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import dblquad, quad

import upd.reference as ref
from upd.errors import InputError

E, NU = 2e5, 0.3
G = E / (2 * (1 + NU))
EPS = np.finfo(float).eps
POINT_LOADS = [ref.boussinesq, ref.cerruti]
# fourth-order differences: first derivative, central and one-sided; second derivative
CENTRAL = {-2: 1 / 12, -1: -8 / 12, 1: 8 / 12, 2: -1 / 12}
FORWARD = {0: -25 / 12, 1: 4, 2: -3, 3: 4 / 3, 4: -1 / 4}
SECOND = {-2: -1 / 12, -1: 4 / 3, 0: -5 / 2, 1: 4 / 3, 2: -1 / 12}


def field(load):
    return lambda x: np.array(load(*x, 1.0, E, NU))


def gradient(u, x, h, free_surface=False):
    """du_i/dx_j at the points x (3, n), axes (i, j, n); one-sided in z on the free surface."""
    columns = []
    for j in range(3):
        rule = FORWARD if free_surface and j == 2 else CENTRAL
        step = np.zeros((3, 1))
        step[j] = h
        columns.append(sum(w * u(x + k * step) for k, w in rule.items()) / h)
    return np.stack(columns, axis=1)


def stress(grad, nu=NU):
    lam = E * nu / ((1 + nu) * (1 - 2 * nu))
    return (
        G * (grad + grad.transpose(1, 0, 2))
        + lam * np.einsum("kkn->n", grad) * np.eye(3)[:, :, None]
    )


@pytest.mark.parametrize(
    ("load", "stresses"),
    [(ref.boussinesq, ref.boussinesq_stress), (ref.cerruti, ref.cerruti_stress)],
)
def test_stresses_are_those_of_the_displacements(load, stresses):
    x = np.random.default_rng(3).uniform(-1.0, 1.0, (3, 40))
    x[2] = np.abs(x[2]) + 0.2
    expected = stress(gradient(field(load), x, 1e-3))
    found = np.moveaxis(stresses(*x, 1.0, NU), 0, -1)
    assert np.abs(found - expected).max() < 1e-8 * np.abs(expected).max()
    on_axis = stresses(0.0, 0.0, 0.7, 1.0, NU)
    assert np.isfinite(on_axis).all()


@pytest.mark.parametrize("load", POINT_LOADS)
def test_navier(load):
    u = field(load)
    x = np.random.default_rng(1).uniform(0.5, 1.5, (3, 20))
    h = 5e-3
    hessian = np.zeros((3, 3, 3, 20))
    for j in range(3):
        for k in range(3):
            e_j, e_k = h * np.eye(3)[:, j, None], h * np.eye(3)[:, k, None]
            if j == k:
                hessian[:, j, j] = sum(w * u(x + s * e_j) for s, w in SECOND.items()) / h**2
            else:
                hessian[:, j, k] = (
                    sum(
                        v * w * u(x + s * e_j + t * e_k)
                        for s, v in CENTRAL.items()
                        for t, w in CENTRAL.items()
                    )
                    / h**2
                )
    residual = (1 - 2 * NU) * np.einsum("ijjn->in", hessian) + np.einsum("jjin->in", hessian)
    # truncation h^4 times sixth derivatives of 1/r, up to 720/90 on unit distance
    assert np.abs(residual).max() < 100 * h**4 * np.abs(hessian).max()


@pytest.mark.parametrize("load", POINT_LOADS)
def test_surface_is_free_of_traction(load):
    angle = np.linspace(0, 2 * np.pi, 9)
    x = np.array([np.cos(angle), np.sin(angle), np.zeros(9)])
    h = 1e-3
    sigma = stress(gradient(field(load), x, h, free_surface=True))
    assert (
        np.abs(sigma[:, 2]).max()
        < 100 * h**4 * np.abs(sigma).max() + 1e3 * EPS / h * np.abs(sigma).max()
    )


@pytest.mark.parametrize(("load", "direction"), [(ref.boussinesq, 2), (ref.cerruti, 0)])
def test_stress_carries_the_load(load, direction):
    """The traction on a half-sphere about the load is the load's opposite."""
    node, weight = np.polynomial.legendre.leggauss(16)
    cosine, weight = (node + 1) / 2, weight / 2
    angle = 2 * np.pi * np.arange(16) / 16
    c, phi = (v.ravel() for v in np.meshgrid(cosine, angle))
    w = np.tile(weight, 16) * 2 * np.pi / 16
    s = np.sqrt(1 - c**2)
    n = np.array([s * np.cos(phi), s * np.sin(phi), c])
    force = np.einsum("ijn,jn,n->i", stress(gradient(field(load), n, 1e-3)), n, w)
    expected = np.zeros(3)
    expected[direction] = -1.0
    # s = sqrt(1 - c^2) is not analytic: 16 Gauss points leave a few 1e-5
    assert force == pytest.approx(expected, abs=1e-4)


@given(s=st.floats(0.01, 100.0), x=st.floats(-1, 1), z=st.floats(0.1, 1))
@settings(max_examples=30, deadline=None)
def test_point_loads_fall_with_distance(s, x, z):
    for load in POINT_LOADS:
        near, far = (
            np.array(load(x, 0.4, z, 1.0, E, NU)),
            np.array(load(s * x, s * 0.4, s * z, 1.0, E, NU)),
        )
        assert s * far == pytest.approx(near, rel=1e-12, abs=40 * EPS * np.abs(near).max())


def test_maxwell_reciprocity():
    """Surface u_z under a tangential load = -u_x under a normal load at mirrored places."""
    u_z = ref.cerruti(0.7, 0.3, 0.0, 1.0, E, NU)[2]
    u_x = ref.boussinesq(-0.7, -0.3, 0.0, 1.0, E, NU)[0]
    assert u_z == pytest.approx(u_x, rel=8 * EPS)


def kernels(cos, sin):
    """Distance times (u_z of P, u_x and u_y of Q) on the surface."""
    return (
        (1 - NU) / (2 * np.pi * G),
        ((1 - NU) + NU * cos**2) / (2 * np.pi * G),
        NU * cos * sin / (2 * np.pi * G),
    )


def rectangle(x, y, half_x, half_y):
    return (
        float(ref.love_rectangle(x, y, half_x, half_y, 1.0, E, NU)),
        *(float(u) for u in ref.cerruti_rectangle(x, y, half_x, half_y, 1.0, E, NU)),
    )


@pytest.mark.parametrize("point", [(0.0, 0.0), (0.3, 0.1), (-0.45, 0.85), (0.5, 0.2), (0.5, 1.0)])
def test_rectangle_inside(point):
    """In polar coordinates about the point the 1/r singularity goes.

    Integral of kernel(angle) times the distance to the edge.
    """
    half = np.array([0.5, 1.0])
    x = np.array(point)

    def distance(t):
        d = np.array([np.cos(t), np.sin(t)])
        # a ray towards -d leaves through the edge it meets first
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.nanmin(np.where(d == 0, np.inf, (x + np.sign(d) * half) / d))

    corners = np.arctan2(
        *(x - np.array([(sx, sy) for sx in (-1, 1) for sy in (-1, 1)]) * half).T[::-1]
    )
    edges = np.unique(np.concatenate([corners, np.linspace(-np.pi, np.pi, 5)]))
    for i, closed in enumerate(rectangle(*point, *half)):
        u = sum(
            quad(
                lambda t, i=i: kernels(np.cos(t), np.sin(t))[i] * distance(t), *span, epsabs=1e-16
            )[0]
            for span in pairwise(edges)
        )
        assert closed == pytest.approx(u, abs=1e-9 / G)


@pytest.mark.parametrize("point", [(1.2, 0.0), (0.9, -1.7), (-3.0, 2.0)])
def test_rectangle_outside(point):
    half = (0.5, 1.0)

    def load(i):
        def at(t, s):
            dx, dy = point[0] - s, point[1] - t
            r = np.hypot(dx, dy)
            return kernels(dx / r, dy / r)[i] / r

        return dblquad(at, -half[0], half[0], -half[1], half[1], epsabs=1e-16, epsrel=1e-8)[0]

    for i, closed in enumerate(rectangle(*point, *half)):
        assert closed == pytest.approx(load(i), rel=1e-7, abs=1e-12 / G)


def test_rectangle_far_away_is_a_point_load():
    x, y = 60.0, 80.0
    closed = rectangle(x, y, 0.5, 0.5)
    point = (ref.boussinesq(x, y, 0.0, 1.0, E, NU)[2], *ref.cerruti(x, y, 0.0, 1.0, E, NU)[:2])
    # next multipole: (side/distance)^2; rounding of the corner sums: eps (distance/side)^2
    assert closed == pytest.approx(point, rel=1e-4)


@pytest.mark.parametrize("component", ["normal", "tangential", "both", "all"])
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
@pytest.mark.parametrize("dy", [1.0, 3.0, 20.0])
def test_compliance_is_symmetric_positive_definite(component, nu, dy):
    S = ref.half_space_compliance(9, 7, 1.0, dy, E, nu, component)
    size = {"both": 126, "all": 189}.get(component, 63)
    assert S.shape == (size, size)
    assert np.array_equal(S, S.T)
    assert np.linalg.eigvalsh(S)[0] > EPS * len(S) * np.abs(S).max()


def test_compliance_layout():
    nx, ny, dx, dy = 4, 3, 0.1, 0.2
    S = ref.half_space_compliance(nx, ny, dx, dy, E, NU, "both")
    n = nx * ny
    assert S[:n, :n] == pytest.approx(
        ref.half_space_compliance(nx, ny, dx, dy, E, NU, "tangential"), rel=4 * EPS
    )
    for load, node in [(0, 11), (3, 8), (5, 6)]:
        x, y = (node % nx - load % nx) * dx, (node // nx - load // nx) * dy
        u_x, u_y = ref.cerruti_rectangle(x, y, dx / 2, dy / 2, 1 / (dx * dy), E, NU)
        assert S[node, load] == pytest.approx(u_x, rel=1e-12)
        assert S[n + node, load] == pytest.approx(u_y, rel=1e-12, abs=1e-14 * u_x)
    turned = ref.half_space_compliance(ny, nx, dy, dx, E, NU, "both").reshape(2, nx, ny, 2, nx, ny)
    again = S.reshape(2, ny, nx, 2, ny, nx)
    assert turned.transpose(0, 2, 1, 3, 5, 4)[::-1, :, :, ::-1] == pytest.approx(again, rel=1e-12)


def test_pressure_shifts_the_surface_as_its_point_loads_do():
    nodes, weights = np.polynomial.legendre.leggauss(40)
    x0, y0 = 0.5 * nodes[:, None], 1.5 * nodes[None, :]
    w = 0.5 * 1.5 * weights[:, None] * weights[None, :]
    for x, y in [(2.0, 0.3), (-1.2, 2.5), (0.7, -2.0)]:
        u = ref.boussinesq(x - x0, y - y0, np.zeros((40, 40)), 1.0, E, NU)
        want = [float((w * u[k]).sum()) for k in (0, 1)]
        assert ref.pressure_shift_rectangle(x, y, 0.5, 1.5, 1.0, E, NU) == pytest.approx(
            want, rel=1e-9
        )


def test_pressure_and_shear_move_each_other_alike():
    """Betti: z by a force along x at j is x at j by a force along z."""
    S = ref.half_space_compliance(4, 3, 0.1, 0.2, E, NU, "all")
    n = 12
    assert S[:n, :n] == pytest.approx(ref.half_space_compliance(4, 3, 0.1, 0.2, E, NU))
    assert np.array_equal(S[n:, n:], ref.half_space_compliance(4, 3, 0.1, 0.2, E, NU, "both"))
    for load, node in [(0, 11), (3, 8), (5, 6)]:
        x, y = (node % 4 - load % 4) * 0.1, (node // 4 - load // 4) * 0.2
        u = ref.pressure_shift_rectangle(x, y, 0.05, 0.1, 50.0, E, NU)
        assert [S[n + node, load], S[2 * n + node, load]] == pytest.approx(u, rel=1e-12)
    # z under a force along x far away: Cerruti's point load
    far = ref.half_space_compliance(81, 1, 1.0, 1.0, E, NU, "all")
    assert far[80, 81] == pytest.approx(ref.cerruti(80.0, 0.0, 0.0, 1.0, E, NU)[2], rel=1e-4)


@given(s=st.floats(0.01, 100.0))
@settings(max_examples=20, deadline=None)
def test_compliance_of_similar_lattices(s):
    one, other = (
        ref.half_space_compliance(3, 4, 0.1 * t, 0.2 * t, E, NU, "both") for t in (1.0, s)
    )
    assert s * other == pytest.approx(one, rel=1e-12)


def lattice(cells):
    """Unit contact circle on a lattice of spacing 1/cells: (spacing, x, y) of all nodes."""
    h = 1 / cells
    line = np.arange(-cells, cells + 1) * h
    x, y = (v.ravel() for v in np.meshgrid(line, line))
    return h, x, y


def errors(cells, component):
    """Largest relative error of the displacements inside r < 0.8 under the Hertz distribution of
    unit maximum.
    """
    h, x, y = lattice(cells)
    r = np.hypot(x, y)
    force = h**2 * ref.hertz_pressure(r, 1.0, 1.0)
    n = 2 * cells + 1
    S = ref.half_space_compliance(n, n, h, h, E, NU, component)
    inside = r < 0.8
    if component == "normal":
        exact = ref.hertz_surface_displacement(r, 1.0, 1.0, E, NU)
        return np.abs(S @ force - exact)[inside].max() / exact.max()
    # Johnson, eqs (3.91a) and (3.91b)
    exact_x = np.pi / (32 * G) * (4 * (2 - NU) - (4 - 3 * NU) * x**2 - (4 - NU) * y**2)
    exact_y = np.pi / (32 * G) * 2 * NU * x * y
    u_x, u_y = (S @ np.concatenate([force, np.zeros_like(force)])).reshape(2, -1)
    return (
        max(np.abs(u_x - exact_x)[inside].max(), np.abs(u_y - exact_y)[inside].max())
        / exact_x.max()
    )


@pytest.mark.parametrize("component", ["normal", "both"])
def test_hertz_distribution_on_the_lattice(component):
    coarse, fine = errors(6, component), errors(18, component)
    # the root at the rim limits the order to 1.5 on average; counting cells on a circle scatters it
    assert fine < coarse / 3
    assert fine < 0.5 * (1 / 18) ** 1.5


@pytest.mark.parametrize("q", [0.3, 0.7, 0.9])
def test_mindlin_traction_moves_the_stick_zone_as_one(q):
    cells = 20
    h, x, y = lattice(cells)
    r = np.hypot(x, y)
    mu, N = 0.6, 50.0
    T = q * mu * N
    c = ref.stick_radius(T, mu, N, 1.0)
    force = h**2 * ref.mindlin_traction(r, 1.0, c, mu, N)
    u = ref.half_space_compliance(2 * cells + 1, 2 * cells + 1, h, h, E, NU, "tangential") @ force
    stick = r < c - h
    d = ref.mindlin_displacement(T, mu, N, 1.0, (2 - NU) / G)
    assert stick.sum() > 100
    assert np.abs(u[stick] / d - 1).max() < 0.5 * h


@pytest.mark.parametrize(
    ("call", "names"),
    [
        (lambda: ref.boussinesq(0.0, 0.0, 0.0, 1.0, E, NU), "at the load"),
        (lambda: ref.cerruti(1.0, 0.0, -1.0, 1.0, E, NU), "z ="),
        (lambda: ref.love_rectangle(0.0, 0.0, 0.0, 1.0, 1.0, E, NU), "half_x"),
        (lambda: ref.cerruti_rectangle(0.0, 0.0, 1.0, 1.0, 1.0, E, 0.7), "Poisson"),
        (lambda: ref.half_space_compliance(0, 2, 1.0, 1.0, E, NU), "nx"),
        (lambda: ref.half_space_compliance(2, 2, 1.0, 1.0, E, NU, "diagonal"), "diagonal"),
    ],
)
def test_refuses(call, names):
    with pytest.raises(InputError, match=names):
        call()
