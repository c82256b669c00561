"""A wedge damper between two platforms on springs, with the numbers of the rig.

Rocking, lift-off, limits of little and much load.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import block_diag, eigh

from upd.hbm import (
    Contacts,
    FrequencyResponse,
    Settings,
    System,
    contact_rows,
    contacts,
    frequency_response,
    rigid_damper,
)
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.modal import modal
from upd.hbm.springs.sweep import from_stuck, newton, static_point
from upd.hbm.springs.time_integration import steady_state

S = np.sqrt(0.5)
#: blade dofs x, z, rotation about y of the platform, which carries the core as a rigid body 45 mm
#: above it: 296 Hz
HEIGHT, GYRATION, M_CORE = 45.0, 40.0, 1.6e-3
BLADE_M = M_CORE * np.array([[1, 0, HEIGHT], [0, 1, 0], [HEIGHT, 0, HEIGHT**2 + GYRATION**2]])
#: shank of 63 mm, bending stiffness 2.69e9 N mm2 (a cantilever's tip), axial 2e5 x 663 N
SHANK, EI = 63.0, 2.69e9
BLADE_K = np.array(
    [
        [12 * EI / SHANK**3, 0, -6 * EI / SHANK**2],
        [0, 2e5 * 663 / SHANK, 0],
        [-6 * EI / SHANK**2, 0, 4 * EI / SHANK],
    ]
)
CF = 350.0
OUT = np.array([0, 0, 0, 1.0, 0, 0])
BAND = np.linspace(240.0, 420.0, 91)


def frames(side: int) -> np.ndarray:
    """Normal from the damper into the blade, tangent up the slope."""
    return np.array([[side * S, 0, S], [-side * S, 0, S]])


def place(points: Contacts, N0: float) -> np.ndarray:
    """Static loads on the six blade dofs that hold the preload N0 of each point."""
    return np.asarray(N0 * points.rows[:, 0].sum(axis=0)[:6])


def wedge(
    load: float,
    *,
    half: float = 5.0,
    rows: int = 2,
    fitted: bool = True,
    mu: float = 0.6,
    zeta: float = 0.005,
    k_n: float = 1.56e6,
    frequencies: np.ndarray = BAND,
    cf: float = CF,
    fast_exits: bool = True,
    settings: Settings | None = None,
    **options: Any,
) -> FrequencyResponse:
    """Response to a force on the right platform.

    Each face has `rows` points over +- half mm of the slope.
    """
    k_n, k_t = k_n / rows, k_n / 3 / rows
    M, K = block_diag(BLADE_M, BLADE_M), block_diag(BLADE_K, BLADE_K)
    values, Phi = eigh(K, M)
    C = M @ Phi @ np.diag(2 * zeta * np.sqrt(values)) @ Phi.T @ M
    normal, tangent, where, frame = [], [], [], []
    for i, side in enumerate((-1, 1)):
        for along in np.linspace(-half, half, rows):
            f, r = frames(side), along * frames(side)[1]
            u = np.zeros((3, 6))
            u[0, 3 * i], u[0, 3 * i + 2], u[2, 3 * i + 1], u[2, 3 * i + 2] = 1, r[2], 1, -r[0]
            normal.append(-f[0] @ u)
            tangent.append(-f[1] @ u)
            where.append(r + np.array([side * 8.0, 0, 0]))
            frame.append(f)
    N0 = cf / (2 * S * rows) if fitted else 0.0
    points = contacts(normal, [tangent], k_n=k_n, k_t=k_t, mu=mu, preload=N0)
    damper = rigid_damper(
        7.2e-5, [1.1e-2, 3.5e-3, 1.3e-2], [0, 0, -1.0], [0, 0, cf], kept=(0, 2, 4)
    )
    return frequency_response(
        System(
            (M, C, K),
            points,
            static_force=place(points, N0),
            damper=damper,
            damper_rows=contact_rows(damper, where, np.array(frame)),
            **options,
        ),
        harmonic_force=load * OUT,
        frequencies=frequencies,
        fast_exits=fast_exits,
        settings=settings,
    )


def out(answer: FrequencyResponse) -> np.ndarray:
    return answer.amplitude(np.append(OUT, np.zeros(3)))


def test_little_load_is_the_stuck_curve() -> None:
    answer = wedge(1e-3, fast_exits=False)
    row = np.append(OUT, np.zeros(3))
    assert answer.status == "complete"
    np.testing.assert_allclose(out(answer), answer.stuck(row), rtol=1e-8)
    assert answer.state[..., 0].min() == 1.0


def test_no_centrifugal_force_is_the_free_curve() -> None:
    answer = wedge(1.0, cf=0.0)
    assert "free answer" in answer.message
    np.testing.assert_allclose(out(answer), answer.free(np.append(OUT, np.zeros(3))), rtol=1e-8)
    assert answer.state[..., 2].min() == 1.0


def test_rocking_lifts_the_rows_and_the_path_arrives() -> None:
    answer = wedge(4.0, harmonics=range(4))
    assert answer.status == "complete", answer.message
    assert answer.state[..., 2].max() > 0.3
    assert np.any(np.diff(answer.frequency) < 0), "the peak leans and the path turns back"
    assert np.abs(answer.energy_balance).max() < 1e-6


def test_lift_off_against_time() -> None:
    # a light damper on stiff springs that opens a third of its points: the difference falls with
    # the harmonics, slowly
    frequency, row = 280.0, np.append(OUT, np.zeros(3))
    answer = wedge(4.0, fitted=False, harmonics=range(6), frequencies=np.array([frequency]))
    assert answer.status == "complete", answer.message
    assert answer.state[-1, :, 2].max() > 0
    # numerical damping of the high frequencies: nothing else ends the chatter of the damper
    marched = steady_state(answer.balance, frequency, answer.x[-1], steps=1024, alpha=-1 / 3)
    assert marched.status == "periodic"
    assert marched.amplitude(row) == pytest.approx(out(answer)[-1], rel=3e-2)


def test_both_loads_times_s() -> None:
    one, other = wedge(1.8, frequencies=BAND[:20]), wedge(5.4, cf=3 * CF, frequencies=BAND[:20])
    np.testing.assert_allclose(
        np.interp(BAND[:20], other.frequency, out(other)),
        3 * np.interp(BAND[:20], one.frequency, out(one)),
        rtol=1e-9,
    )


def test_identical_blades_do_not_move_across_when_pushed_alike() -> None:
    # both blades pushed along x: the symmetric wedge moves with them, no point slides
    base = wedge(1.0, frequencies=BAND[:2])
    load = np.zeros((1, 9), dtype=complex)
    load[0, [0, 3]] = 1.0
    own = base.balance
    points, static, start = own.contacts, own.static, own.start
    b = Balance(own.modal, points, own.harmonics, own.samples, static, load, start, own.slider)
    x = newton(b, b.stuck(2 * np.pi * 250.0), 250.0)
    assert x is not None
    w = b.split(x)[0][:, :, 1:]
    np.testing.assert_allclose(w[:2, 0], -w[2:, 0], atol=1e-9 * np.abs(w).max())


def test_preload_taken_away_finds_the_point_newton_finds() -> None:
    answer = wedge(1.8, fitted=False, half=2.0, frequencies=np.array([250.0]))
    b, x = answer.balance, answer.x[0]
    released = from_stuck(b, 250.0)
    assert released is not None
    scale = np.abs(b.split(x)[0]).max()
    np.testing.assert_allclose(b.split(released)[0], b.split(x)[0], atol=1e-7 * scale)


def test_static_point_balances_the_centrifugal_force() -> None:
    answer = wedge(1.8, fitted=False, frequencies=np.array([250.0]))
    b = answer.balance
    x = static_point(b, 250.0)
    assert x is not None
    f = b.force(x)[..., 0]
    held = np.einsum("pri,pr->i", b.contacts.rows, f)[6:]
    np.testing.assert_allclose(held, [0, CF, 0], atol=1e-8 * CF)


def test_static_sliders_are_where_the_static_loads_left_them() -> None:
    # thin load: every point sticks about its static traction, whatever the friction mobilised
    # before
    answer = wedge(1e-3, fitted=False, start="static", frequencies=BAND[:5])
    assert answer.status == "complete"
    lifted = answer.state[0, :, 2] == 1.0
    assert answer.state[1:, ~lifted, 0].min() >= 1 - 1 / answer.balance.samples


def test_a_path_cut_short_is_the_beginning_of_the_whole() -> None:
    whole = wedge(1.8, fitted=False)
    few = wedge(1.8, fitted=False, settings=Settings(most_points=10))
    assert few.status == "step limit"
    n = len(few.frequency)
    np.testing.assert_allclose(few.frequency, whole.frequency[:n], rtol=1e-12)


def test_modal_restriction_drops_what_the_plane_holds() -> None:
    b = wedge(1.0, frequencies=BAND[:1]).balance
    assert b.modal.rigid.sum() == 3
    assert modal(np.eye(2), np.zeros((2, 2)), np.eye(2)).rigid.sum() == 0
