"""Steps of contact by inverses that were kept: the same answers, with fewer matrices formed."""

from functools import cache
from typing import Any

import numpy as np

from tests.analytic.test_interface_march import by_base
from upd.analyses import make_plan
from upd.analyses.forced.interface_model import by_coulomb, make_interface_model, worn_start
from upd.analyses.seated.bodies import make_bodies
from upd.analyses.seated.interface import make_interface
from upd.hbm.faces.equations import InterfaceEquations
from upd.hbm.faces.kept import border, kept_inverses, kept_step
from upd.hbm.faces.march import InterfaceMarch
from upd.hbm.faces.state import InterfaceModel, InterfaceState
from upd.hbm.faces.step import (
    FEW,
    OPEN,
    SLIP,
    STICK,
    contact_scratch,
    contact_step,
    newton_rows,
)
from upd.hbm.faces.sweep import SteadyPoint, settle
from upd.scene import load_scene

F_C, MU = 350.0, 0.6


@cache
def worn() -> tuple[InterfaceModel, InterfaceState]:
    """Half of the rig with the wedge, 4 x 6 nodes a face, worn in under the load."""
    changes = ["mesh.symmetry=half", "geometry.patch_along_y=6", "geometry.patch_along_slope=5"]
    plan: Any = make_plan(load_scene("symmetric-seated", changes))
    bodies = make_bodies(plan)
    of = make_interface(plan, bodies)
    model = make_interface_model(plan, bodies, of, friction=MU, centrifugal=F_C, damping=0.005)
    return worn_start(model, of, F_C)


def stepped() -> tuple[InterfaceMarch, tuple[Any, ...], np.random.Generator, Any]:
    """A march's step, its scratch, chance, and what its samples are asked for."""
    model, _ = worn()
    march, rng, n = InterfaceMarch(model, 450.0, [1.0], 128), np.random.default_rng(5), model.n
    march.rebase(rng.random(n) < 0.3)
    pressed, angle = rng.uniform(-0.2, 1.0, n), rng.uniform(0.0, 2.0 * np.pi, n)
    traction = rng.uniform(0.0, 1.3, n) * MU * pressed * np.array([np.cos(angle), np.sin(angle)])
    return march, contact_scratch(n), rng, np.concatenate([pressed, *traction])


def test_steps_by_kept_inverses() -> None:
    """200 samples, each somewhat off the one before: forces of the coupled contact's solver."""
    march, scratch, rng, asked = stepped()
    model, n = march.model, march.model.n
    kept, inverses = kept_inverses(1, n)
    laws = (model.friction, march.rho_n, march.rho_t)
    node = f, _, state = np.zeros(3 * n), np.zeros(3 * n), np.ones(n, np.int64)
    formed, changed, ways = [], 0, rng.standard_normal((2, 3 * n))
    for sample in range(200):
        turn = 2.0 * np.pi * sample / 100.0
        now = asked + 0.1 * (np.cos(turn) * ways[0] + np.sin(turn) * ways[1])
        x0 = by_base(march) @ now
        step = (x0, (march.bases.open, march.bases.Tt), 0, laws, node)
        if not sample:
            assert contact_step(*step, False, scratch) > 0
        before = state.copy()
        formed.append(kept_step(0, *step, (kept, inverses), scratch))
        changed += int((state != before).any())
        want = by_coulomb(march.A, model.friction, march.A @ now)
        assert want is not None and formed[-1] >= 0, f"sample {sample}"
        np.testing.assert_allclose(f, want[0], rtol=0.0, atol=1e-8 * np.abs(want[0]).max())
        assert min(np.bincount(state, minlength=3)) > 0
    # most samples have nodes in other states than the one before, few need a matrix of their own
    assert changed > 100 and sum(formed) < 0.5 * changed, (changed, sum(formed))


def test_border_is_the_inverse_of_the_new_states() -> None:
    """Nodes that stick, slip and open: as the matrix of all rows formed and inverted anew."""
    march, scratch, rng, asked = stepped()
    model, n = march.model, march.model.n
    kept, inverses = kept_inverses(1, n)
    laws, base = (model.friction, march.rho_n, march.rho_t), march.bases.open
    bases, H = (base, march.bases.Tt), scratch[-1]
    f, y = asked.copy(), 1e-5 * rng.standard_normal(3 * n)
    states = rng.integers(0, 3, n)

    def matrix(state: Any) -> Any:
        k = newton_rows(asked, bases, 0, laws, (f, y, state), scratch)
        assert k > FEW
        return np.linalg.inv(H[:k, :k])

    inverses[0, : matrix(states).size], kept[0] = matrix(states).ravel(), 2 * states + base[0]
    for _ in range(20):
        for i in rng.choice(n, 2, replace=False):
            states[i] = rng.choice([one for one in (OPEN, STICK, SLIP) if one != states[i]])
        assert border(0, bases, 0, laws, (f, y, states), (kept, inverses))
        kept[0] = 2 * states + base[0]
        want = matrix(states)
        k = len(want)
        off = np.abs(inverses[0, : k * k].reshape(k, k) - want).max()
        assert off < 1e-8 * np.abs(want).max()
    kept[0] = 2 * states + ~base[0]
    assert not border(0, bases, 0, laws, (f, y, states), (kept, inverses))


def test_settling_by_kept_inverses_ends_in_the_same_motion() -> None:
    """A motion with nodes in all states, from rest: with the inverses and without."""
    model, start = worn()
    found: list[tuple[SteadyPoint, InterfaceState]] = []
    for room in (True, False):
        march, at = InterfaceMarch(model, 440.0, [-1j * F_C / 100.0], 64, by_coulomb), start.copy()
        if not room:
            march.past = march.past._replace(inverses=march.past.inverses[:, :0])
        found.append((settle(march, at, 0.1, 400), at))
    (kept, at), (plain, there) = found
    assert kept.settled and plain.settled and kept.periods == plain.periods
    assert (kept.last.counts > 0.2).all(), kept.last.counts
    size = np.abs(plain.last.output).max()
    np.testing.assert_allclose(kept.last.output, plain.last.output, rtol=0.0, atol=1e-7 * size)
    np.testing.assert_allclose(at.f, there.f, rtol=0.0, atol=1e-6 * np.abs(there.f).max())
    # matrices formed in the last period; samples of few rows are left to elimination
    assert kept.last.newton < 0.7 * plain.last.newton


def test_samples_of_a_period_by_kept_inverses() -> None:
    """Under motions of the blades near each other: forces and states as without them."""
    model, start = worn()
    e = InterfaceEquations(model, [-1j * F_C / 100.0], start, 3, 64, by_coulomb)
    q, w, rng = np.zeros(e.shape), 2.0 * np.pi * 440.0, np.random.default_rng(7)
    q[0] = start.q
    # millimetres of a face by a mode
    q[1:3] = 5e-3 / np.abs(model.shapes).max(axis=0) * rng.uniform(-1.0, 1.0, (2, e.shape[1]))
    rigid = np.zeros((3, len(model.load)))
    rigid[0] = start.s
    e.march_from(q, rigid, start.slip, w)
    e.known = e.march_from(q, rigid, start.slip, w)
    states, inverses = e.kept
    for scale in (1e-6, 1e-3, 1e-1):
        q[1:] *= 1.0 + scale
        found = []
        for given in (inverses, inverses[:, :0]):
            e.kept = states, given
            found.append(e.march_from(q, rigid, start.slip, w))
            if given is inverses:
                assert (states[:, 0] >= 0).sum() > 0.5 * e.samples
        size = np.abs(found[1].force).max()
        np.testing.assert_allclose(found[0].force, found[1].force, rtol=0.0, atol=1e-8 * size)
        np.testing.assert_array_equal(found[0].state, found[1].state)
        e.known = found[1]
