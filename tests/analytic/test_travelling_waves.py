"""Travelling waves of one sector against all sectors, in time and in frequency.

The numbers of the chains and of the wedge were computed by a balance and by a time integration of
twelve masses that were written for this purpose alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from upd.errors import InputError
from upd.hbm import (
    FrequencyResponse,
    System,
    all_sectors,
    contacts,
    frequency_response,
    nodal_diameters,
    rigid_damper,
    stability,
    steady_state,
    travelling_wave_response,
    wave_in_time,
)
from upd.hbm.core.factors import Border
from upd.hbm.springs import jacobian
from upd.hbm.springs.waves import WaveBalance, spread_to_all

N = 12
SLIDER = contacts([[0.0, 0.0]], [[1.0, -1.0]], k_n=0.0, k_t=0.1, mu=1.0, preload=0.5)


def springs(d: int, k: float) -> float:
    """Stiffness of springs between neighbours in a wave of nodal diameter d."""
    return k * (2.0 - 2.0 * np.cos(2.0 * np.pi * d / N))


def chain(**changed: Any) -> FrequencyResponse:
    """Masses with a spring and a Jenkins element between neighbours, at w rad/s."""
    disk = {d: ([[1.0]], [[0.01]], [[1.0 + springs(d, 0.05)]]) for d in range(N // 2 + 1)}
    given: dict[str, Any] = {
        "sectors": disk,
        "contacts": SLIDER,
        "n_sectors": N,
        "engine_order": 3,
        "harmonic_force": [1.0],
        "harmonics": range(4),
        "samples": 2048,
        "w": 1.04,
    } | changed
    w = given.pop("w")
    own = {
        name: given.pop(name) for name in ("harmonics", "samples", "static_force") if name in given
    }
    return travelling_wave_response(
        System(given.pop("sectors"), given.pop("contacts"), **own),
        frequencies=[w / (2.0 * np.pi)],
        **given,
    )


@pytest.mark.parametrize(
    ("order", "w", "heights"),
    [
        (3, 1.00, (3.331483, 3.331483, 3.331483)),
        (3, 1.04, (7.476701, 7.446893, 7.446914)),
        (3, 1.06, (22.478836, 22.414098, 22.412801)),
        (3, 1.10, (11.480970, 11.469108, 11.471284)),
        (3, 1.20, (5.005269, 5.008753, 5.008524)),
        (2, 1.04, (28.605193, 28.516383, 28.517147)),
        (4, 1.10, (12.752630, 12.752630, 12.757308)),
        (6, 1.20, (6.199419, 6.194231, 6.195682)),
    ],
)
def test_chains(order: int, w: float, heights: tuple[float, ...]) -> None:
    for highest, height in zip((1, 3, 7), heights, strict=True):
        answer = chain(engine_order=order, w=w, harmonics=range(highest + 1))
        assert answer.amplitude([1.0])[0] == pytest.approx(height, rel=1e-5)
        assert abs(answer.energy_balance[0]) < 1e-9


def test_each_harmonic_has_its_own_phase(monkeypatch: pytest.MonkeyPatch) -> None:
    # the phase of the first harmonic for all: seen with the engine order 2, not with 3
    right = {order: float(chain(engine_order=order).amplitude([1.0])[0]) for order in (2, 3)}
    part = WaveBalance.part

    def wrong(self: WaveBalance, harmonic: int | None = None) -> tuple[Any, Any]:
        modes, _ = part(self, harmonic)
        rows = self.near + self.far * np.exp(2j * np.pi * self.engine_order / self.n_sectors)
        return modes, rows.reshape(-1, len(modes.Phi)) @ modes.Phi

    monkeypatch.setattr(WaveBalance, "part", wrong)
    assert chain(engine_order=3).amplitude([1.0])[0] == pytest.approx(right[3], rel=1e-9)
    spoiled = chain(engine_order=2, harmonics=range(8)).amplitude([1.0])[0]
    assert spoiled == pytest.approx(28.584, abs=1e-3) != pytest.approx(right[2], rel=1e-3)


def varying(order: int, w: float, highest: int, samples: int = 2048) -> FrequencyResponse:
    """Blades that move in two coupled directions, with a varying normal load between them."""
    K = [[1.0, 0.2], [0.2, 1.0]]
    point = contacts(
        [[1.0, 0.0, -1.0, 0.0]], [[0.0, -1.0, 0.0, 1.0]], k_n=0.3, k_t=0.2, mu=0.3, preload=0.3
    )
    return travelling_wave_response(
        System(
            {d: (np.eye(2), 0.01 * np.eye(2), K) for d in range(7)},
            point,
            harmonics=range(highest + 1),
            samples=samples,
        ),
        n_sectors=N,
        engine_order=order,
        harmonic_force=[0.2, 0.2],
        frequencies=[w / (2.0 * np.pi)],
    )


@pytest.mark.parametrize(
    ("order", "w", "highest", "x", "y"),
    [
        (3, 1.00, 1, 0.753261, 1.881024),
        (3, 1.00, 3, 0.616054, 1.548029),
        (3, 1.00, 7, 0.616457, 1.549115),
        (5, 1.08, 1, 0.290659, 0.822112),
        (5, 1.08, 7, 0.287279, 0.811633),
    ],
)
def test_varying_normal_load(order: int, w: float, highest: int, x: float, y: float) -> None:
    answer = varying(order, w, highest)
    assert answer.amplitude([1.0, 0.0])[0] == pytest.approx(x, rel=1e-5)
    assert answer.amplitude([0.0, 1.0])[0] == pytest.approx(y, rel=1e-5)


def wedge(load: float, highest: int, frequencies: Any, **changed: Any) -> FrequencyResponse:
    """Blades with a sliding body between neighbours, its normal load constant; SI."""
    needed = nodal_diameters(N, 3, range(highest + 1))
    disk = {d: ([[1.0]], [[8.0]], [[4e6 + springs(d, 1e5)]]) for d in needed}
    points = contacts(
        np.zeros((2, 2)),
        [[-1.0, 0.0], [0.0, -1.0]],
        k_n=0.0,
        k_t=1.5e6,
        mu=0.4,
        preload=load / (2.0 * np.cos(np.pi / 4.0)),
    )
    given: dict[str, Any] = {
        "damper": rigid_damper(0.02, [1.0, 1.0, 1.0], [0, 0, 0], [0, 0, 0], kept=(1,)),
        "damper_rows": np.array([[[0.0], [1.0]]] * 2),
        "harmonics": range(1, highest + 1),
        "samples": 1024,
    } | changed
    force = given.pop("harmonic_force", [1.0])
    return travelling_wave_response(
        System(disk, points, **given),
        n_sectors=N,
        engine_order=3,
        harmonic_force=force,
        frequencies=frequencies,
    )


@pytest.mark.parametrize(
    ("ratio", "highest", "height", "f"),
    [
        (600, 11, 5.262812e-5, 378.0173),
        (194, 11, 5.170816e-5, 378.0167),
        (60, 11, 1.633912e-5, 377.8063),
        (60, 1, 1.635786e-5, 377.7303),
        (20, 11, 5.838206e-6, 375.9395),
        (10, 11, 3.224007e-6, 371.83),
        (5, 11, 1.935430e-6, 361.66),
    ],
)
def test_wedge_with_a_body(ratio: float, highest: int, height: float, f: float) -> None:
    at, top = wedge(ratio, highest, f + np.linspace(-1.0, 1.0, 5)).peak([1.0, 0.0])
    assert top == pytest.approx(height, rel=1e-5)
    # flat tops: their place depends on the samples
    assert at == pytest.approx(f, rel=1e-4)


def test_wedge_free_and_stuck() -> None:
    answer = wedge(1e9, 1, [377.0, 378.0173, 379.0])
    assert answer.free([1.0, 0.0], [326.1693])[0] == pytest.approx(6.099387e-5, rel=1e-6)
    assert answer.stuck([1.0, 0.0], [378.0173])[0] == pytest.approx(5.262812e-5, rel=1e-6)
    np.testing.assert_allclose(answer.amplitude([1.0, 0.0]), answer.stuck([1.0, 0.0]), rtol=1e-12)
    assert answer.linear.all()


def test_chain_sticks_as_its_nodal_diameter() -> None:
    stiff = contacts([[0.0, 0.0]], [[1.0, -1.0]], k_n=0.0, k_t=0.1, mu=1.0, preload=1e9)
    for order in (2, 3):
        w = 1.1
        D = 1.0 + springs(order, 0.15) - w**2 + 0.01j * w
        found = chain(engine_order=order, w=w, contacts=stiff).amplitude([1.0])[0]
        assert found == pytest.approx(abs(1.0 / D), rel=1e-12)


def test_damper_of_the_other_sector_and_other_numbering() -> None:
    want = wedge(20.0, 5, [375.0]).amplitude([1.0, 0.0])[0]
    turned = wedge(20.0, 5, [375.0], harmonic_force=[np.exp(2j * np.pi * 3 / N)])
    assert turned.amplitude([1.0, 0.0])[0] == pytest.approx(want, rel=1e-12)
    # the body as dofs of a sector: of the one before the gap, then of the one behind it
    needed = nodal_diameters(N, 3, range(6))
    disk = {
        d: (np.diag([1.0, 0.02]), np.diag([8.0, 0.0]), np.diag([4e6 + springs(d, 1e5), 0.0]))
        for d in needed
    }
    for rows in (
        [[-1.0, 1.0, 0.0, 0.0], [0.0, 1.0, -1.0, 0.0]],
        [[-1.0, 0.0, 0.0, 1.0], [0.0, 0.0, -1.0, 1.0]],
    ):
        points = contacts(
            np.zeros((2, 4)), rows, k_n=0.0, k_t=1.5e6, mu=0.4, preload=20.0 / np.sqrt(2.0)
        )
        answer = travelling_wave_response(
            System(disk, points, harmonics=range(1, 6), samples=1024),
            n_sectors=N,
            engine_order=3,
            harmonic_force=[1.0, 0.0],
            frequencies=[375.0],
        )
        assert answer.amplitude([1.0, 0.0])[0] == pytest.approx(want, rel=1e-12)


def test_blades_numbered_the_other_way() -> None:
    # the forward wave N - EO, with the rows of both sectors exchanged
    mirrored = contacts([[0.0, 0.0]], [[-1.0, 1.0]], k_n=0.0, k_t=0.1, mu=1.0, preload=0.5)
    # the same samples of all sectors
    same = {"samples": 85 * N, "contacts": SLIDER}
    want = chain(**same, engine_order=2).amplitude([1.0])[0]
    found = chain(**same | {"contacts": mirrored}, engine_order=N - 2).amplitude([1.0])[0]
    assert found == pytest.approx(want, rel=1e-12)


def test_standing_waves_are_real() -> None:
    for order, far in ((0, 1.0), (6, -1.0)):
        answer = wedge_order(order)
        part = answer.balance.linear
        assert not part.Psi.imag.any()
        # one blade with its damper between walls that move alike, or against each other
        K = 4e6 + springs(order, 1e5)
        alone = frequency_response(
            System(
                (np.diag([1.0, 0.02]), np.diag([8.0, 0.0]), np.diag([K, 0.0])),
                contacts(
                    np.zeros((2, 2)),
                    [[-1.0, 1.0], [-far, 1.0]],
                    k_n=0.0,
                    k_t=1.5e6,
                    mu=0.4,
                    preload=20.0 / np.sqrt(2.0),
                ),
                harmonics=(1, 3),
                samples=1024,
            ),
            harmonic_force=[1.0, 0.0],
            frequencies=[322.0],
        )
        want = alone.amplitude([1.0, 0.0])[0]
        assert answer.amplitude([1.0, 0.0])[0] == pytest.approx(want, rel=1e-9)


def wedge_order(order: int) -> FrequencyResponse:
    """The wedge of another engine order, odd harmonics only."""
    disk = {d: ([[1.0]], [[8.0]], [[4e6 + springs(d, 1e5)]]) for d in {0, order}}
    return travelling_wave_response(
        System(
            disk,
            contacts(
                np.zeros((2, 2)),
                [[-1.0, 0.0], [0.0, -1.0]],
                k_n=0.0,
                k_t=1.5e6,
                mu=0.4,
                preload=20.0 / np.sqrt(2.0),
            ),
            harmonics=(1, 3),
            samples=1024,
            damper=rigid_damper(0.02, [1.0, 1.0, 1.0], [0, 0, 0], [0, 0, 0], kept=(1,)),
            damper_rows=np.array([[[0.0], [1.0]]] * 2),
        ),
        n_sectors=N,
        engine_order=order,
        harmonic_force=[1.0],
        frequencies=[322.0],
    )


def random_disk(seed: int, proportional: bool) -> FrequencyResponse:
    """Random Hermitian sectors with a body between two points of two tangents, under EO 2."""
    rng, n, theta = np.random.default_rng(seed), 4, 2.0 * np.pi / N
    K0, M0 = (R @ R.T + 4.0 * np.eye(n) for R in rng.normal(size=(2, n, n)))
    K1, M1 = 0.3 * rng.normal(size=(2, n, n))

    def cyclic(A: Any, B: Any, d: int) -> Any:
        coupled = B * np.exp(1j * theta * d)
        out = A + coupled + coupled.conj().T
        return out.real if d in (0, N // 2) else out

    uneven = 0.0 if proportional else np.diag(rng.uniform(size=n))
    disk = {}
    for d in range(N // 2 + 1):
        K, M = cyclic(K0, K1, d), cyclic(M0, M1, d)
        disk[d] = M, 0.02 * (K + M) + uneven, K
    normals, across = np.array([[0.6, 0.0, 0.8], [-0.6, 0.0, 0.8]]), np.array([0.0, 1.0, 0.0])
    body = np.array([[v, across, np.cross(v, across)] for v in normals])
    rows = np.zeros((2, 3, 2 * n))
    rows[0, :, :n], rows[1, :, n:] = rng.normal(size=(2, 3, n))
    points = contacts(
        rows[:, 0],
        np.swapaxes(rows[:, 1:], 0, 1),
        k_n=[0.7, 0.4],
        k_t=[0.5, 0.6],
        mu=0.4,
        preload=0.6,
    )
    return travelling_wave_response(
        System(
            disk,
            points,
            harmonics=(0, 1, 2, 3),
            samples=11 * N,
            damper=rigid_damper(0.3, [0.1, 0.2, 0.3], [0, 0, 0], [0.0, 0.0, 1.0], kept=(0, 1, 2)),
            damper_rows=body,
        ),
        n_sectors=N,
        engine_order=2,
        harmonic_force=[0.05, 0.02j, 0.0, 0.01],
        frequencies=[0.2],
    )


@pytest.mark.parametrize("proportional", [True, False])
def test_jacobian_and_all_sectors(proportional: bool) -> None:
    answer = random_disk(0, proportional)
    b, w = answer.balance, 2.0 * np.pi * float(answer.frequency[0])
    x = np.random.default_rng(1).normal(size=b.size)
    # any motion of a wave leaves of the equations of all sectors what it leaves of its own
    assert isinstance(b, WaveBalance)
    whole = all_sectors(b)
    left = spread_to_all(b, b.linearised(x, w, False)[0], whole)
    found = whole.linearised(spread_to_all(b, x, whole), w, False)[0]
    np.testing.assert_allclose(found, left, atol=1e-11 * np.abs(left).max())
    seen = set()
    G = b.linear.modal.receptance_parts(b.linear.Psi, b.linear.k * w)
    assert max(np.abs(one - np.swapaxes(one, 1, 2)).max() for one in G) > 0.01 * np.abs(G).max()
    for shift, size in ((0.0, 1.0), ([3.0, 0.0], 0.1), ([3.0, 3.0], 1e-3), ([-3.0, 3.0], 1e-3)):
        at = size * x
        at[: b.split(x)[0].size : 3 * b.harmonics.size] += shift
        _, J, slope = b.linearised(at, w)
        assert J is not None
        seen |= set(J.state.tolist())
        h = 1e-6 * np.abs(x).max()
        steps = h * np.eye(len(at))
        sides = [[b.linearised(at + s * e, w, False)[0] for e in steps] for s in (1.0, -1.0)]
        numeric = (np.array(sides[0]) - sides[1]).T / (2.0 * h)
        np.testing.assert_allclose(J.matrix(), numeric, atol=1e-5 * np.abs(numeric).max())
        up, down = (b.linearised(at, w * (1.0 + s), False)[0] for s in (1e-6, -1e-6))
        by_w = (up - down) / (2e-6 * w)
        np.testing.assert_allclose(slope, by_w, atol=1e-6 * max(1.0, np.abs(by_w).max()))
        rng = np.random.default_rng(0)
        D, border, right = 0.5 + rng.uniform(size=len(at)), *rng.normal(size=(2, len(at) + 1))
        A = np.block([[J.matrix() * D, 0.3 * slope[:, None]], [border[None]]])
        for kind in (jacobian.EveryPoint, jacobian.Eliminated):
            z = kind(J, Border(slope, D, 0.3, border)).solve(right[:-1], float(right[-1]))
            np.testing.assert_allclose(A @ z, right, atol=1e-7 * np.abs(z).max())
    assert seen == {0, 1, 2}


@pytest.mark.parametrize(
    ("order", "w", "highest", "height"), [(2, 1.04, 7, 28.517296), (4, 1.10, 7, 12.757463)]
)
def test_chain_in_time(order: int, w: float, highest: int, height: float) -> None:
    answer = chain(engine_order=order, w=w, harmonics=range(highest + 1))
    march = wave_in_time(answer, [1.0], 0, steps=2048, tolerance=1e-7)
    assert march.steady.status == "periodic"
    assert march.amplitude == pytest.approx(height, rel=1e-4)
    assert march.spread < 1e-5


def test_varying_normal_load_in_time() -> None:
    answer = varying(3, 1.0, 7)
    march = wave_in_time(answer, [1.0, 0.0], 0)
    assert march.amplitude == pytest.approx(0.616536, rel=1e-4)
    assert march.spread < 1e-5


def test_unknowns_do_not_grow_with_the_sectors() -> None:
    sizes = set()
    for n in (12, 24, 96):
        disk = {d: ([[1.0]], [[0.01]], [[1.0]]) for d in nodal_diameters(n, 3, range(4))}
        sizes.add(chain(sectors=disk, n_sectors=n).x.shape[1])
    assert len(sizes) == 1


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"harmonic_force": [0.0]}, "moves no blade"),
        ({"harmonic_force": np.cos(2 * np.pi * 3 * np.arange(N)[:, None] / N)}, "standing"),
        ({"n_sectors": 2}, "n_sectors = 2 must be a whole number, at least 3"),
        ({"engine_order": 2.5}, "engine_order = 2.5 must be a whole number"),
        ({"sectors": {0: ([[1.0]], [[0.01]], [[1.0]])}}, "need the nodal diameters"),
        ({"sectors": {d: ([[1.0]], [[0.01]], [[1.0]]) for d in range(9)}}, "give some of 0 to 6"),
        (
            {"sectors": {d: (np.eye(2), np.eye(2), [[1.0, 1j], [-1j, 2.0]]) for d in range(7)}},
            "complex at nodal diameter",
        ),
        ({"contacts": contacts([[1.0]], k_n=1.0, mu=0.0)}, "columns, give 2"),
        (
            {
                "contacts": contacts(
                    [[0.0, 0.0]], [[1.0, -1.0]], k_n=0.0, k_t=1.0, mu=1.0, preload=-1.0
                )
            },
            "a preload is negative",
        ),
        (
            {
                "contacts": contacts([[1.0, -1.0]], k_n=1.0, mu=0.0, preload=1.0),
                "harmonics": (1, 2),
            },
            "needs harmonic 0",
        ),
    ],
)
def test_bad_input(changed: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        chain(**changed)


def test_forces_of_all_sectors_of_one_order() -> None:
    force = np.exp(2j * np.pi * 3 * np.arange(N)[:, None] / N)
    want = chain().amplitude([1.0])[0]
    assert chain(harmonic_force=force).amplitude([1.0])[0] == pytest.approx(want, rel=1e-9)


def test_one_sector_is_not_all() -> None:
    answer = chain()
    with pytest.raises(InputError, match="all sectors"):
        steady_state(answer.balance, 0.1, answer.x[0])
    with pytest.raises(InputError, match="all sectors"):
        stability(answer)
    few = {d: ([[1.0]], [[0.01]], [[1.0]]) for d in (0, 3, 6)}
    with pytest.raises(InputError, match=r"nodal diameters \[1, 2, 4, 5\] as well"):
        wave_in_time(chain(sectors=few), [1.0], 0)
