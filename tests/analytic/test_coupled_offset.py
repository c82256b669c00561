"""Imposed motion of the contact nodes: against rigid motions, energy, frame, differences."""

import numpy as np
import pytest

from upd.contact import CoupledContact, coupled_contact
from upd.errors import InputError


def bodies(seed: int = 0, n: int = 9, c: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """A coupled compliance (c n, c n) mm/N and gaps (n,) mm."""
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.standard_normal((c * n, c * n)))[0]
    C = 1e-6 * Q @ np.diag(np.logspace(0.0, -2.0, c * n)) @ Q.T
    return 0.5 * (C + C.T), 1e-5 * rng.random(n)


MOTION = 1e-5 * np.array([[1.5, 0, 0], [1.4, 1.2, -0.7], [1.5, -0.9, 0.2], [0.9, 0.4, 0.4]])


def shift(n: int) -> np.ndarray:
    """Columns (3 n, 3): approach and shifts."""
    return np.kron(np.eye(3), np.ones((n, 1)))


@pytest.mark.parametrize("by", ["load", "displacement"])
def test_offset_along_a_column_is_a_rigid_motion(by: str) -> None:
    """w = B s - C f - offset: an offset -B a is a motion s + a, with the same slip."""
    C, h = bodies()
    a = 1e-5 * np.array([[0.4, 0.0, 0.1], [-0.3, 0.5, 0.2], [0.1, -0.6, 0.0], [0.2, 0.1, 0.3]])
    plain = coupled_contact(C, h, 0.4, displacement=MOTION)
    target = plain.load if by == "load" else MOTION - a
    found = coupled_contact(C, h, 0.4, **{by: target}, offset=-a @ shift(9).T)
    assert set(plain.state.ravel().tolist()) == {0, 1, 2}
    np.testing.assert_allclose(found.force, plain.force, atol=1e-8 * plain.force.max())
    np.testing.assert_allclose(found.slip, plain.slip, atol=1e-13)
    np.testing.assert_allclose(found.gap, plain.gap, atol=1e-13)
    np.testing.assert_allclose(found.displacement, MOTION - a, atol=1e-13)


def path(seed: int = 1) -> np.ndarray:
    """Two rounds of an offset (24, 27) mm, different at every node."""
    rng = np.random.default_rng(seed)
    one, two = 1e-5 * rng.standard_normal((2, 27))
    t = 2.0 * np.pi * np.arange(1, 25) / 12.0
    return np.asarray(np.outer(np.sin(t), one) + np.outer(1.0 - np.cos(t), two))


def trapezoidal(found: CoupledContact, h: np.ndarray) -> float:
    """Work that contact takes from the nodes: forces on gap and slip, by the trapezoidal rule."""
    f = np.concatenate((np.zeros_like(found.force[:1]), found.force))
    w = np.concatenate(((h - found.gap)[:, :, None], found.slip), axis=2)
    w = np.concatenate((np.zeros_like(w[:1]), w))
    return float((0.5 * (f[1:] + f[:-1]) * np.diff(w, axis=0)).sum())


@pytest.mark.parametrize("by", ["load", "displacement"])
def test_energy_of_imposed_motion(by: str) -> None:
    """Work in = elastic energy + what contact takes, to rounding, over two rounds.

    With C df = B ds - d(offset) - dw, the mean forces of a step times this is
    d(f'Cf / 2) = p.ds - f.d(offset) - f.dw.
    """
    C, h = bodies()
    hold = np.array([30.0, 3.0, 2.0]) if by == "load" else MOTION[1]
    found = coupled_contact(C, h, 0.4, **{by: hold}, offset=path())
    assert set(found.state.ravel().tolist()) == {0, 1, 2}
    f = found.force[-1].T.ravel()
    stored, taken = 0.5 * f @ C @ f, trapezoidal(found, h)
    assert found.slip_work.sum() > 0.1 * stored
    assert found.work.sum() == pytest.approx(stored + taken, rel=1e-11)

    # the closed second round: what goes in is dissipated, to first order in the steps
    def off(k: int) -> float:
        turns = 2.0 * np.pi * np.arange(1, 2 * k + 1) / k
        drive = np.outer(np.sin(turns), path()[2])
        round_ = coupled_contact(C, 0.0 * h, 0.4, **{by: hold}, offset=drive)
        return abs(round_.work[k:].sum() / round_.slip_work[k:].sum() - 1.0)

    assert off(96) < off(24) / 2.0
    assert off(96) < 0.05


def test_one_node_dragged_around() -> None:
    """mu N times the slip of a round; an offset that opens lets go, and closes again."""
    C, N = np.diag([1e-5, 2e-5]), 10.0
    way = 0.5 * N * 2e-5  # the limit is reached exactly here
    drags = way * np.array([1.0, 4.0, 2.0, -4.0, -2.0, 4.0])
    offset = np.column_stack((np.zeros(6), drags))
    found = coupled_contact(C, [0.0], 0.5, displacement=[1e-4, 0.0], offset=offset)
    # the offset is subtracted from the relative motion, so forces point against it
    assert found.force[:, 0, 1] == pytest.approx([-5.0, -5.0, 5.0, 5.0, -5.0, -5.0])
    assert found.slip[:, 0, 0] == pytest.approx(way * np.array([0, -3, -3, 3, 3, -3]), abs=1e-18)
    assert found.slip_work == pytest.approx(way * np.array([0, 15, 0, 30, 0, 30]), abs=1e-15)
    assert found.work[2:].sum() == pytest.approx(found.slip_work[2:].sum())
    apart = coupled_contact(
        C, [0.0], 0.5, displacement=[1e-4, 0.0], offset=[[3e-4, 0.0], [0.0, 0.0]]
    )
    assert apart.gap[:, 0] == pytest.approx([2e-4, 0.0], abs=1e-18)
    assert apart.force[:, 0, 0] == pytest.approx([0.0, N])


def test_offset_of_a_continued_history_is_absolute() -> None:
    """In one call or in three, or with the offset left out again: one path."""
    C, h = bodies()
    drive = path()
    drive[16:] = 0.0
    load = [30.0, 3.0, 2.0]
    whole = coupled_contact(C, h, 0.4, load=load, offset=drive)
    parts, history = [], None
    for rows in (drive[:7], drive[7:16], None):
        loads = load if rows is not None else np.tile(load, (8, 1))
        parts.append(coupled_contact(C, h, 0.4, load=loads, offset=rows, history=history))
        history = parts[-1].history
    for name in ("force", "slip", "gap", "displacement", "work", "slip_work"):
        value = getattr(whole, name)
        np.testing.assert_allclose(
            np.concatenate([getattr(part, name) for part in parts]),
            value,
            atol=1e-10 * np.abs(value).max(),
            err_msg=name,
        )


def test_frame_of_the_offset_may_turn() -> None:
    C, h = bodies()
    c, s = np.cos(0.5), np.sin(0.5)
    turn = np.kron(np.array([[1, 0, 0], [0, c, s], [0, -s, c]]), np.eye(9))
    load, offset = np.array([30.0, 3.0, 2.0]), path()
    one = coupled_contact(C, h, 0.4, load=load, offset=offset)
    two = coupled_contact(
        turn @ C @ turn.T,
        h,
        0.4,
        load=load @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
        offset=offset @ turn.T,
    )
    back = two.force.swapaxes(1, 2).reshape(24, -1) @ turn
    there = one.force.swapaxes(1, 2).reshape(24, -1)
    np.testing.assert_allclose(back, there, atol=1e-8 * there.max())
    np.testing.assert_allclose(two.work, one.work, atol=1e-10 * np.abs(one.work).max())


def test_bad_offsets_are_named() -> None:
    C, h = bodies()
    for offset, says in (
        (np.zeros(9), r"offset has shape \(9,\): it must be \(27,\)"),
        (np.zeros((2, 26)), r"offset has shape \(2, 26\)"),
        (0.0, r"offset has shape \(\)"),
        (np.zeros((3, 27)), "offset has 3 steps, load or displacement 4"),
        (np.full(27, np.nan), "offset holds 27 values that are NaN"),
        ("far", "offset is not an array of numbers"),
    ):
        with pytest.raises(InputError, match=says):
            coupled_contact(C, h, 0.4, displacement=MOTION, offset=offset)


def test_going_on_is_the_continued_history() -> None:
    """The same bodies, without giving them again."""
    C, h = bodies()
    one = coupled_contact(C, h, 0.4, load=[30.0, 3.0, 2.0], offset=path()[:3])
    two = one.go_on(displacement=MOTION[1], offset=path()[3:9])
    again = coupled_contact(
        C, h, 0.4, displacement=MOTION[1], offset=path()[3:9], history=one.history
    )
    np.testing.assert_array_equal(two.force, again.force)
    np.testing.assert_array_equal(two.work, again.work)
    np.testing.assert_array_equal(two.slip, again.slip)
    np.testing.assert_allclose(two.stiffness(), again.stiffness(), rtol=1e-9)
    with pytest.raises(InputError, match="exactly one of load and displacement"):
        one.go_on()
