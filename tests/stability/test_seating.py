"""The elastic damper seated between both blades: statics in closed form, displacements by whole
matrices, hysteresis, and what must not depend on how it is computed.
"""

from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest
from rigs import SET_LINES
from scipy import sparse
from scipy.sparse.linalg import spsolve

from upd.analyses import make_plan
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.seated.bodies import Bodies, lattice, make_bodies, patch_frame
from upd.analyses.seated.interface import Interface, make_interface
from upd.contact.rigid_damper import equilibrium
from upd.fem import Material, mass, stiffness
from upd.linalg import symmetric
from upd.reference import half_space_compliance
from upd.scene import load_scene
from upd.scene.forced_contact import SIDES

F_C = 350.0


@cache
def rig(scene: str, element: str = "hex8i") -> tuple[ForcedPlan, Bodies]:
    plan: Any = make_plan(
        load_scene(
            f"{scene}-response", [*SET_LINES, f"mesh.element={element}", "mesh.symmetry=full"]
        )
    )
    return plan, make_bodies(plan)


@cache
def interface(scene: str) -> Interface:
    return make_interface(*rig(scene))


@pytest.mark.parametrize("mu", [1e-6, 0.3, 0.6])
def test_wedge_raised_from_zero(mu: float) -> None:
    """Friction opposes F_C on both faces: 247.5 N without it, 154.7 N with 0.6.

    To 1e-5: the slip fans out along the damper by some thousandths of a radian.
    """
    of = interface("symmetric")
    found = of.seat(mu, F_C * np.linspace(0.1, 1.0, 10))
    want = equilibrium(45.0, 45.0, F_C, mu, "opposing")
    assert found.status == "converged"
    for side in range(2):
        normal, along, up = of.face_forces(found)[-1, side]
        assert normal == pytest.approx(want.normal_left, rel=1e-5)
        assert up == pytest.approx(want.tangential_left, rel=1e-5)
        assert abs(along) < 1e-6 * normal


def test_wedge_lowered_and_raised_again() -> None:
    """It stays wedged at first, then friction is reversed; the way up ends where it began."""
    of, mu = interface("symmetric"), 0.3
    down, up = np.linspace(0.9, 0.1, 9), np.linspace(0.2, 1.0, 9)
    found = of.seat(mu, F_C * np.concatenate((np.linspace(0.1, 1.0, 10), down, up)))
    force = of.face_forces(found)
    want = equilibrium(45.0, 45.0, 0.1 * F_C, mu, "reversed")
    assert force[18, :, 0] == pytest.approx([want.normal_left] * 2, rel=1e-5)
    assert force[18, :, 2] == pytest.approx([want.tangential_left] * 2, rel=1e-5)
    np.testing.assert_allclose(found.force[-1], found.force[9], atol=1e-9 * F_C)
    # the loop of load and lift is friction's work
    loop = slice(10, 28)
    stored = [0.5 * f.T.ravel() @ of.compliance @ f.T.ravel() for f in found.force[[9, 27]]]
    assert stored[0] == pytest.approx(stored[1], rel=1e-9)
    assert found.work[loop].sum() == pytest.approx(found.slip_work[loop].sum(), rel=0.15)
    assert found.work[loop].sum() > 0.0


def test_pads_hold_the_damper_by_the_sloped_face_alone() -> None:
    """mu > tan 30 deg: F_C cos 30 and F_C sin 30 on the right, nothing on the left, and it is said
    that the damper can hold itself.
    """
    of = interface("asymmetric")
    found = of.seat(0.6, F_C * np.linspace(0.1, 1.0, 10))
    left, right = of.face_forces(found)[-1]
    assert right[[0, 2]] == pytest.approx(
        F_C * np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)]), rel=1e-9
    )
    assert np.abs(left).max() < 1e-9 * F_C
    assert found.self_locking
    assert not of.seat(0.5, [F_C]).self_locking


@pytest.mark.parametrize("mu", [0.05, 0.3])
def test_pads_with_less_friction_use_both_faces(mu: float) -> None:
    of = interface("asymmetric")
    force = of.face_forces(of.seat(mu, F_C * np.linspace(0.1, 1.0, 10)))[-1]
    want = equilibrium(90.0, 30.0, F_C, mu, "opposing")
    # The damper may keep a face from sliding fully: between the frictionless and the opposing one.
    free = equilibrium(90.0, 30.0, F_C, 0.0, "frictionless")
    low, high = sorted((want.normal_right, free.normal_right))
    assert low * (1.0 - 1e-6) <= force[1, 0] <= high
    # both balances, the frame's up slope included
    a = np.radians(30.0)
    vertical = force[1, 0] * np.cos(a) + force[1, 2] * np.sin(a) + force[0, 2]
    across = force[1, 0] * np.sin(a) - force[1, 2] * np.cos(a) - force[0, 0]
    assert vertical == pytest.approx(F_C)
    assert across == pytest.approx(0.0, abs=1e-8 * F_C)


@pytest.mark.parametrize("scene", ["symmetric", "asymmetric"])
def test_against_whole_matrices(scene: str) -> None:
    """The found forces put on the three whole bodies: gaps and slips as found, to 1e-9."""
    plan, bodies = rig(scene)
    of = interface(scene)
    found = of.seat(0.3, F_C * np.linspace(0.2, 1.0, 5))
    f = found.force[-1]
    w = np.zeros((of.n, 3))
    mesh, data = bodies.damper_mesh, plan.scene.material
    material = Material(data.E, data.nu, data.density)
    load = np.zeros((mesh.n_node, 3))
    moves = []
    for k, side in enumerate(SIDES):
        blade, on = bodies.blades[side], of.face == k
        nodes, frame = lattice(blade.mesh).nodes, patch_frame(blade.mesh)
        push = np.zeros((blade.mesh.n_node, 3))
        push[nodes] = f[on] @ frame
        u = np.zeros(3 * blade.mesh.n_node)
        u[blade.free] = spsolve(symmetric.whole(blade.K).tocsc(), push.ravel()[blade.free])
        own = dict(zip(blade.mesh.nodes["patch"], mesh.nodes[f"{side}_patch"], strict=True))
        there = np.array([own[node] for node in nodes])
        np.testing.assert_allclose(mesh.points[there], blade.mesh.points[nodes], atol=1e-9)
        load[there] -= f[on] @ frame
        moves.append((on, there, frame))
        w[on] -= u.reshape(-1, 3)[nodes] @ frame.T
    K, M = stiffness(mesh, material, "hex8i"), mass(mesh, material)
    arms = mesh.points - bodies.damper.centre
    R = np.zeros((mesh.n_node, 3, 6))
    for j in range(3):
        R[:, j, j] = 1.0
        R[:, :, 3 + j] = np.cross(np.eye(3)[j], arms)
    R = R.reshape(-1, 6)
    MR = sparse.csr_array(M @ R)
    whole = sparse.block_array([[K, MR], [MR.T, None]]).tocsc()
    u = spsolve(whole, np.concatenate((load.ravel(), np.zeros(6))))[: 3 * mesh.n_node]
    u = (u + R @ found.displacement[-1]).reshape(-1, 3)
    for on, there, frame in moves:
        w[on] += u[there] @ frame.T
    size = np.abs(w).max()
    closed = found.state[-1] > 0
    assert closed.any()
    np.testing.assert_allclose(w[closed, 0], 0.0, atol=1e-9 * size)
    np.testing.assert_allclose(-w[:, 0], found.gap[-1], atol=1e-9 * size)
    np.testing.assert_allclose(w[:, 1:], found.slip[-1], atol=1e-9 * size)


@pytest.mark.parametrize("scene", ["symmetric", "asymmetric"])
def test_let_go_it_carries_nothing(scene: str) -> None:
    """Friction too small to hold it: nothing is left without F_C, and it can be seated again."""
    of = interface(scene)
    found = of.seat(0.3, [F_C, 0.0, F_C])
    assert np.abs(found.force[1]).max() < 1e-9 * F_C
    assert found.load[2, 2] == pytest.approx(F_C)


def test_touching_faces_scale_with_F_C() -> None:
    of = interface("symmetric")
    steps = np.linspace(0.25, 1.0, 4)
    one, ten = of.seat(0.6, F_C * steps), of.seat(0.6, 10.0 * F_C * steps)
    np.testing.assert_allclose(ten.force, 10.0 * one.force, atol=1e-8 * F_C)


def test_mirror_image_of_the_wedge() -> None:
    """The wedge is its own image: both faces carry the same pressures."""
    of = interface("symmetric")
    found = of.seat(0.6, [0.5 * F_C, F_C])
    sides = [found.force[-1, of.face == k] for k in range(2)]
    place = [of.position[of.face == k] for k in range(2)]
    # to the 1 % by which the blades' meshes differ
    order = [np.lexsort(np.round(p[:, [1, 2]], 6).T) for p in place]
    a, b = (s[o, 0] for s, o in zip(sides, order, strict=True))
    np.testing.assert_allclose(a, b, atol=0.01 * a.max())


#: unequal pads: nodes along and up the slope, pitch mm, MPa, inclination in degrees
SMALL, LARGE = (3, 2, 0.2, 2e3, 70.0), (6, 5, 0.5, 2e5, 30.0)


def unequal(left: tuple[Any, ...], right: tuple[Any, ...]) -> Interface:
    """A damper between two pads of their own size, stiffness and slope; no moment about its mass
    where both resultants meet it.
    """
    parts, position, frames, areas = [], [], [], []
    for sign, (nx, ny, d, E, degrees) in zip((-1.0, 1.0), (left, right), strict=True):
        a = np.radians(degrees)
        frame = np.array(
            [[sign * np.sin(a), 0, np.cos(a)], [0, 1, 0], [-sign * np.cos(a), 0, np.sin(a)]]
        )
        x, y = (d * (np.arange(k) - 0.5 * (k - 1)) for k in (nx, ny))
        local = np.array([[u, v] for v in y for u in x])
        position.append(5.0 * frame[0] + local @ frame[1:])
        parts.append(half_space_compliance(nx, ny, d, d, E, 0.3, "all"))
        frames.append(frame)
        areas.append(np.full(nx * ny, d * d))
    face = np.repeat([0, 1], [len(p) for p in position])
    n, place = len(face), np.vstack(position)
    C = np.zeros((3, n, 3, n))
    for k, part in enumerate(parts):
        on = np.flatnonzero(face == k)
        m = len(on)
        C[:, on[:, None], :, on[None, :]] = part.reshape(3, m, 3, m).transpose(1, 3, 0, 2)
    turn = np.array(frames)[face]
    moves = np.zeros((n, 3, 6))
    moves[:, :, :3] = np.eye(3)
    for j in range(3):
        moves[:, :, 3 + j] = np.cross(np.eye(3)[j], place)
    columns = np.einsum("nfc,ncr->fnr", turn, moves).reshape(3 * n, 6)
    none = np.zeros((3 * n, 3 * n))
    return Interface(
        C.reshape(3 * n, 3 * n),
        columns,
        tuple(range(6)),
        face,
        place,
        np.concatenate(areas),
        np.array(frames),
        1,
        none,
    )


@pytest.mark.parametrize("mu", [0.0, 0.05, 0.25])
@pytest.mark.parametrize("pads", [(SMALL, LARGE), (LARGE, SMALL)])
def test_unequal_pads(pads: tuple[Any, Any], mu: float) -> None:
    """Six nodes a hundred times softer than thirty: raised, lowered, pushed. Forces and moments
    balance, cone and complementarity hold for gaps and slips made again from the forces.
    """
    of = unequal(*pads)
    F = F_C * np.array([0.25, 0.5, 0.75, 1.0, 0.5, 0.2, 1.0, 1.0])
    moved = np.zeros((len(F), 3))
    moved[-1] = [-1e-3, 2e-4, 1e-3]
    found = of.seat(mu, F, moved=moved)
    assert found.status == "converged"
    before = np.zeros((of.n, 2))
    for k, f in enumerate(found.force):
        nodal = np.einsum("nf,nfc->nc", f, of.frame[of.face])
        assert nodal.sum(axis=0) == pytest.approx([0.0, 0.0, F[k]], abs=1e-9 * F_C)
        moment = np.cross(of.position, nodal).sum(axis=0)
        np.testing.assert_allclose(moment, 0.0, atol=1e-9 * F_C * 5.0)
        w = of.columns @ found.displacement[k] - of.compliance @ f.T.ravel()
        w = (w - of.shifts(1) @ moved[k]).reshape(3, of.n)
        gap, slip = -w[0], w[1:].T
        size = np.abs(w).max() + np.abs(of.columns @ found.displacement[k]).max()
        top = np.abs(f).max()
        assert f[:, 0].min() >= -1e-9 * top
        assert gap.min() >= -1e-9 * size
        assert np.abs(f[:, 0] * gap).max() <= 1e-9 * top * size
        shear = np.linalg.norm(f[:, 1:], axis=1)
        assert (shear <= mu * f[:, 0] + 1e-9 * top).all()
        step = slip - before
        below = (shear < mu * f[:, 0] - 1e-6 * top) & (f[:, 0] > 1e-6 * top)
        assert np.abs(step[below]).max(initial=0.0) <= 1e-9 * size
        # what slips goes with the force that opposes it
        along = (step * f[:, 1:]).sum(axis=1)
        assert (along >= np.linalg.norm(step, axis=1) * shear - 1e-8 * top * size).all()
        before = slip
    # Raised: what a rigid damper's balance allows for any friction on either face.
    a, b = (np.radians(pad[-1]) for pad in pads)
    allowed = []
    for t in product((-mu, mu), repeat=2):
        balance = [
            [np.sin(a) - t[0] * np.cos(a), -np.sin(b) + t[1] * np.cos(b)],
            [np.cos(a) + t[0] * np.sin(a), np.cos(b) + t[1] * np.sin(b)],
        ]
        allowed.append(np.linalg.solve(balance, [0.0, F_C]))
    normal = of.face_forces(found)[3, :, 0]
    assert (normal >= np.min(allowed, axis=0) * (1.0 - 1e-9)).all()
    assert (normal <= np.max(allowed, axis=0) * (1.0 + 1e-9)).all()
