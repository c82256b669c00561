"""Hard cases of flat contact.

Touching faces, one corner, lift-off, a step, one held node, extreme friction, the way to gross
slip.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from upd.contact import normal_contact, tangential_contact, tangential_path
from upd.contact.tilt import tilted_contact
from upd.errors import ConvergenceError
from upd.fem import Material, box_mesh, rigid_body_modes, stiffness
from upd.reduction.guyan import condense
from upd.reference.half_space import half_space_compliance

FloatArray = NDArray[np.float64]

EPS = float(np.finfo(float).eps)
E, NU, H = 200e3, 0.3, 0.5
NX, NY = 9, 9


def places(nx: int, ny: int) -> FloatArray:
    """Nodes (n, 2) of a lattice about its centre, x fastest.

    The order of `half_space_compliance`.
    """
    place = np.arange(nx * ny)
    X = np.column_stack([place % nx, place // nx]) * H
    return X - X.mean(axis=0)


def compliance(component: str, nx: int = NX, ny: int = NY) -> FloatArray:
    return 2 * half_space_compliance(nx, ny, H, H, E, NU, component)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def flat() -> tuple[FloatArray, FloatArray]:
    """Compliance of both directions and normal forces of a square patch pressed flat by 300 N."""
    return compliance("both"), normal_contact(
        compliance("normal"), np.zeros(NX * NY), load=300.0
    ).force


# -- normal ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("load", [0.0, 1e-300, 1e-30, 1e-12, 1e-6])
def test_a_face_that_just_touches(load: float) -> None:
    """No load, no force; the smallest loads the arithmetic holds give the same share to every node
    as 300 N does.
    """
    C, X = compliance("normal"), places(NX, NY)
    share = normal_contact(C, np.zeros(81), load=300.0).force / 300.0
    for answer in (
        normal_contact(C, np.zeros(81), load=load),
        tilted_contact(C, np.zeros(81), X, load=load).normal,
    ):
        assert answer.status == ("no load" if load == 0 else "converged")
        assert np.allclose(answer.force, load * share, rtol=1e-10, atol=0)
        assert np.array_equal(answer.gap, np.zeros(81))
        assert answer.contact.all() == (load > 0)


@pytest.mark.parametrize("slope", [1e-2, 1e-6, 1e-10])
def test_one_corner_touches_first(slope: float) -> None:
    """A wedge gap over both directions.

    The corner alone at first, up to the load at which the next node is reached, then a growing set.
    """
    C, X = compliance("normal"), places(NX, NY)
    h = slope * ((X - X[0]) @ [1.0, 0.7])
    # One node carries F until C_00 F - C_j0 F exceeds its gap.
    first = float(np.min(h[1:] / (C[0, 0] - C[1:, 0])))
    below, above = (normal_contact(C, h, load=factor * first) for factor in (1 - 1e-6, 1 + 1e-6))
    assert np.flatnonzero(below.contact).tolist() == [0] and below.approach == pytest.approx(
        C[0, 0] * below.load, rel=1e-12
    )
    assert above.contact.sum() == 2 and above.contact[0]
    counts = [
        int(normal_contact(C, h, load=factor * first).contact.sum())
        for factor in (1, 10, 100, 1000)
    ]
    assert counts == sorted(counts) and counts[-1] > counts[0]
    # Free to tilt about its centre, the body closes the wedge and all of it touches.
    tilted = tilted_contact(C, h, X, load=first)
    assert tilted.normal.contact.all()
    assert np.allclose(tilted.tilt, slope * np.array([1.0, 0.7]), rtol=0, atol=1e-11 * slope)
    level = normal_contact(C, np.zeros(81), load=first)
    # The gap's rounding, felt through the stiffest pattern.
    assert np.allclose(
        tilted.normal.force,
        level.force,
        rtol=0,
        atol=100 * 81 * EPS * slope * 4.0 / np.linalg.eigvalsh(C)[0],
    )


def test_lift_off_under_an_eccentric_load() -> None:
    """From the core to the edge.

    The set only shrinks, the lost nodes are on the far side, the tilt grows without bound, no
    fallback.
    """
    C, X = compliance("normal", 17, 9), places(17, 9)
    edge = X[:, 0].max()
    before, tilts = np.ones(153, dtype=bool), []
    for eccentricity in (0.0, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 0.95, 0.999, 1 - 1e-9):
        answer = tilted_contact(
            C, np.zeros(153), X - [eccentricity * edge, 0.0], load=200.0, start=before
        )
        now = answer.normal.contact
        assert answer.normal.method == "active set"
        assert not (now & ~before).any()
        # Symmetric in y: columns of the lattice mirror.
        assert np.allclose(
            answer.normal.force.reshape(9, 17),
            answer.normal.force.reshape(9, 17)[::-1],
            rtol=0,
            atol=1e-10 * 200.0,
        )
        if not now.all():
            assert X[~now, 0].min() == X[:, 0].min()
        tilts.append(float(answer.tilt[0]))
        before = now
    assert tilts[0] == pytest.approx(0.0, abs=1e-12 * tilts[-1])
    assert (np.diff(tilts) > 0).all()
    assert X[before, 0].min() >= edge - 2 * H
    held = normal_contact(C, np.zeros(153), load=200.0)
    assert held.contact.all() and held.stiffness > answer.free_stiffness


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e6])
def test_two_patches_at_unequal_height(unit: float) -> None:
    """Pads 1 um apart: the first alone up to F = step e'C^-1 e less what it drags the second down,
    then both, and their sum of stiffness.

    Pads on one body: coupled. The load at which the second touches follows from the first alone:
    d(F) - (C f)_j = step.
    """
    n = 35
    x = np.r_[places(7, 5), places(7, 5) + np.array([10.0, 0.0])]
    C = np.zeros((2 * n, 2 * n))
    own = compliance("normal", 7, 5)
    C[:n, :n] = C[n:, n:] = own
    far = np.linalg.norm(x[:n, None] - x[None, n:], axis=2)
    C[:n, n:] = 2 * (1 - NU**2) / (np.pi * E * far)
    C[n:, :n] = C[:n, n:].T
    C, step = C * unit, 1e-3
    h = np.r_[np.zeros(n), np.full(n, step)]
    one = normal_contact(C[:n, :n], np.zeros(n), load=1.0)
    touch = step / (one.approach - float((C[n:, :n] @ one.force).min()))
    assert touch > 0
    below, above = (normal_contact(C, h, load=factor * touch) for factor in (1 - 1e-9, 1 + 1e-9))
    assert (
        not below.contact[n:].any()
        and below.contact[:n].all()
        and below.stiffness == pytest.approx(one.stiffness, rel=1e-10)
    )
    assert 1 <= above.contact[n:].sum() < n
    heavy = normal_contact(C, h, load=1e4 * touch)
    assert heavy.contact.all() and heavy.stiffness < 2 * one.stiffness
    assert heavy.stiffness == pytest.approx(
        float(np.linalg.solve(C, np.ones(2 * n)).sum()), rel=1e-10
    )
    # Free to tilt, the body leans on the inner rim of the low pad and the outer rim of the high
    # one, 10 mm apart, under the least load.
    light = tilted_contact(C, h, x - [5.0, 0.0], load=1e-6 * touch)
    assert np.unique(x[light.normal.contact, 0]).tolist() == [1.5, 11.5]
    assert light.normal.force[:n].sum() == pytest.approx(0.65 * light.normal.load, rel=1e-9)
    assert light.tilt[0] == pytest.approx(step / 10.0, rel=1e-4)
    # Under much load the pads lie flat and the step is forgotten.
    flat = tilted_contact(C, h, x - [5.0, 0.0], load=1e4 * touch)
    assert flat.normal.contact.all() and flat.normal.force[:n].sum() == pytest.approx(
        flat.normal.load / 2, rel=1e-3
    )


def test_a_distant_set_of_one_node_is_refused() -> None:
    """A body held at one node still turns: named, with the remedy.

    With its motions given, and without.
    """
    mesh = box_mesh(*[np.linspace(0, 1, 4)] * 3)
    K = stiffness(mesh, Material(E, NU))
    held = int(mesh.nodes["z0"][5])
    free = np.setdiff1d(np.arange(3 * mesh.n_node), 3 * held + np.arange(3))
    kept = np.searchsorted(free, 3 * mesh.nodes["z1"] + 2)
    inner = K[free][:, free]
    with pytest.raises(
        ConvergenceError, match=r"body floats: free in .*rotation about [xyz].*hold the distant set"
    ):
        condense(inner, kept, rigid_modes=rigid_body_modes(mesh.points)[free])
    with pytest.raises(ConvergenceError, match=r"floats.*hold the distant set"):
        condense(inner, kept)
    # Two nodes leave the turn about their line, three hold the body.
    for count, holds in ((2, False), (3, True)):
        nodes = mesh.nodes["z0"][[0, 3, 12][:count]]
        free = np.setdiff1d(np.arange(3 * mesh.n_node), (3 * nodes[:, None] + np.arange(3)).ravel())
        kept = np.searchsorted(free, 3 * mesh.nodes["z1"] + 2)
        if holds:
            assert len(condense(K[free][:, free], kept).S) == 16
        else:
            with pytest.raises(ConvergenceError, match="floats"):
                condense(K[free][:, free], kept)


# -- friction --------------------------------------------------------------------------------------


def bonded(C: FloatArray, load: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Tractions and rigid displacement when every node sticks."""
    n = len(C) // 2
    B = np.kron(np.eye(2), np.ones((n, 1)))
    BC = np.linalg.solve(C, B)
    d = np.linalg.solve(B.T @ BC, load)
    return BC @ d, d


def test_friction_of_two_lets_nothing_slip(flat: tuple[FloatArray, FloatArray]) -> None:
    """mu = 2: at a load of 0.3 N every node keeps t < 2 f (checked on the bonded answer), so the
    bonded answer is the answer.
    """
    C, f = flat
    load = 0.3 * 300.0 * np.array([0.6, 0.8])
    t, d = bonded(C, load)
    assert (np.hypot(t[:81], t[81:]) < 2 * f).all()
    answer = tangential_contact(C, 2 * f, load=load)
    assert answer.stick.all() and answer.slip_work == pytest.approx(
        0.0, abs=1e-12 * float(load @ d)
    )
    noise = 162 * EPS * np.linalg.cond(C)
    assert np.allclose(answer.force, t, rtol=0, atol=noise * np.abs(t).max())
    assert np.allclose(answer.displacement, d, rtol=noise)


@pytest.mark.parametrize("mu", [1e-6, 1e-12])
def test_hardly_any_friction_is_friction_scaled(
    flat: tuple[FloatArray, FloatArray], mu: float
) -> None:
    """Coulomb's problem is homogeneous.

    Mu = 1e-6 at 1e-6 of the load gives 1e-6 of the answer, the same nodes slipping.
    """
    C, f = flat
    load = 0.97 * 300.0 * np.array([0.6, -0.8])
    one, small = tangential_contact(C, f, load=load), tangential_contact(C, mu * f, load=mu * load)
    assert one.slipping.any() and one.stick.any()
    assert np.array_equal(small.stick, one.stick)
    assert np.allclose(small.force, mu * one.force, rtol=0, atol=1e-9 * mu * f.max())
    assert np.allclose(small.displacement, mu * np.asarray(one.displacement), rtol=1e-9)


@pytest.mark.parametrize("directions", [1, 2])
def test_the_last_hundred_steps_to_gross_slip(
    flat: tuple[FloatArray, FloatArray], directions: int
) -> None:
    """Steps of 1e-4 of the limit from 0.99 to 0.9999.

    Slip only spreads, displacement grows faster and faster, work balances.

    Then the other way, to the mirrored load: in one direction it ends on minus the first curve
    (Masing).
    """
    C, f = flat
    mu = 0.3
    if directions == 1:
        C = C[:81, :81]
    way = np.ones(1) if directions == 1 else np.sqrt([0.5, 0.5])
    limit = mu * float(f.sum())
    share = np.r_[0.0, 0.5, 0.9, 0.99 + 1e-4 * np.arange(100)]
    loads = share[:, None] * limit * way
    up = tangential_path(C, mu * f, loads=loads[:, 0] if directions == 1 else loads)
    assert up.status == "converged" and len(up.load) == 103
    slipping = (up.state != 0).sum(axis=1)
    # In two directions all may slip before the limit: their tractions are not yet parallel.
    assert (np.diff(slipping) >= 0).all() and (slipping[-1] < 81 or directions == 2)
    d = up.displacement if directions == 1 else up.displacement @ way
    assert (np.diff(d[3:], 2) >= -1e-9 * d[-1]).all() and d[3] > 0
    assert (up.slip_work >= -1e-12 * limit * d[-1]).all()
    back = tangential_path(
        C, mu * f, loads=-loads[1:, 0] if directions == 1 else -loads[1:], history=up.history
    )
    assert back.status == "converged"
    end = back.displacement if directions == 1 else back.displacement @ way
    assert (np.diff(end) < 0).all() and end[0] < d[-1]
    assert (back.slip_work >= -1e-12 * limit * d[-1]).all()
    if directions == 1:
        # Masing: the way back is the first loading twice as large, so at the mirrored load it meets
        # minus the first curve.
        assert end[-1] == pytest.approx(-d[-1], rel=1e-8)
    else:
        # Nodes that slid aside keep some of that on the way back: no Masing, but every slipping
        # node is on its circle.
        size = np.hypot(back.force[-1][:81], back.force[-1][81:])
        assert np.allclose(size[back.state[-1] != 0], mu * f[back.state[-1] != 0], rtol=1e-9)


@pytest.mark.parametrize("share", [0.2, 0.7, 0.95, 0.9999])
def test_a_load_turned_by_a_right_angle_turns_the_answer(
    flat: tuple[FloatArray, FloatArray], share: float
) -> None:
    """A square patch has its quarter turns and diagonal mirrors: exact for any load.

    The slip circle turns with it.
    """
    C, f = flat
    n = np.arange(81).reshape(NY, NX)
    # The node a quarter turn carries to place (i, j): (x, y) -> (-y, x).
    turn = (
        np.rot90(n, 1).ravel()
        if np.allclose(places(NX, NY)[np.rot90(n, 1).ravel()][1], [1.5, -2.0])
        else np.rot90(n, -1).ravel()
    )
    X = places(NX, NY)
    assert np.allclose(np.column_stack([-X[turn, 1], X[turn, 0]]), X)
    load = share * 0.3 * 300.0 * np.array([np.cos(0.4), np.sin(0.4)])
    a = tangential_contact(C, 0.3 * f, load=load)
    b = tangential_contact(C, 0.3 * f, load=np.array([-load[1], load[0]]))
    tx, ty = a.force[:81], a.force[81:]
    noise = 1e-7 * f.max()
    assert np.allclose(b.force[:81], -ty[turn], rtol=0, atol=noise) and np.allclose(
        b.force[81:], tx[turn], rtol=0, atol=noise
    )
    assert np.array_equal(b.slipping, a.slipping[turn])
    da, db = np.asarray(a.displacement), np.asarray(b.displacement)
    assert np.allclose(db, [-da[1], da[0]], rtol=1e-7, atol=1e-9 * np.abs(da).max())
    # On the diagonal the answer is its own mirror image: displacement along the load, |t| symmetric
    # about y = x.
    diagonal = tangential_contact(C, 0.3 * f, load=share * 0.3 * 300.0 * np.sqrt([0.5, 0.5]))
    mirror = n.T.ravel()
    assert np.allclose(diagonal.force[:81], diagonal.force[81:][mirror], rtol=0, atol=noise)
    d = np.asarray(diagonal.displacement)
    assert d[0] == pytest.approx(d[1], rel=1e-7)
    # Slipping nodes are on the circle, whatever their direction.
    size = np.hypot(diagonal.force[:81], diagonal.force[81:])
    assert (
        np.allclose(size[diagonal.slipping], 0.3 * f[diagonal.slipping], rtol=1e-9)
        and (size <= 0.3 * f * (1 + 1e-9)).all()
    )


def test_small_loads_at_any_angle_meet_the_same_stiffness(
    flat: tuple[FloatArray, FloatArray],
) -> None:
    """While all sticks, a patch with a quarter turn is as stiff at 45 degrees as along x (its 2 by
    2 stiffness is a multiple of I).
    """
    C, f = flat
    d = [
        np.asarray(
            tangential_contact(C, 2 * f, load=30.0 * np.array([np.cos(a), np.sin(a)])).displacement
        )
        for a in np.linspace(0, np.pi, 9)
    ]
    assert np.allclose(np.linalg.norm(d, axis=1), np.linalg.norm(d[0]), rtol=1e-10)
    for angle, one in zip(np.linspace(0, np.pi, 9), d, strict=True):
        assert np.cross([np.cos(angle), np.sin(angle), 0], [*one, 0])[2] == pytest.approx(
            0.0, abs=1e-10 * np.linalg.norm(one)
        )
