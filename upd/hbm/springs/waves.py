"""Travelling waves of a bladed disk with friction between its sectors, from one sector.

Blades are numbered in the direction of rotation. The engine order EO pushes sector j with
f_j = Re sum_h F_h exp(i h (w t + phi j)), phi = 2 pi EO / N. All sectors then move alike,

    x_j,h = x_0,h exp(i h phi j),

and harmonic h is a wave of the nodal diameter h EO mod N; one above N/2 is the wave of N less it
that goes the other way, with conjugate matrices. Harmonic 0 has nodal diameter 0. Contacts between
sector j and the next have rows B_a on the one and B_b on the other: for each harmonic

    B_h = B_a + B_b exp(i h phi),   w_h = u_h - G_h f_h,   G_h = B_h D_h^-1 B_h^H.

The condensed balance and its continuation serve as they are, with one complex compliance for each
harmonic. The number of unknowns does not depend on N.

A motion of all sectors may leave the travelling wave, and partial slip keeps the static traction of
its start: `wave_in_time` integrates all sectors and reports how alike they move.

References
----------
E. P. Petrov, A method for use of cyclic symmetry properties in analysis of nonlinear multiharmonic
vibrations of bladed disks, J. Turbomach. 126 (2004) 175; D. L. Thomas, Dynamics of rotationally
periodic structures, Int. J. Numer. Meth. Eng. 14 (1979) 81.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import gcd
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag

from upd.errors import InputError
from upd.hbm.core.fourier import Harmonics, to_complex
from upd.hbm.core.newton import Settings
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.modal import Modal, modal
from upd.hbm.springs.points import Contacts
from upd.hbm.springs.response import FrequencyResponse, System, force_of, response_of
from upd.hbm.springs.time_integration import SteadyState, steady_state
from upd.linalg.parallel import threads_for
from upd.reduction.cyclic import phase_of

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
#: difference of the forces of sectors, relative, up to which they are one engine order
ALIKE = 1e-9


def nodal_diameters(
    n_sectors: int, engine_order: int, harmonics: Iterable[int] = (0, 1)
) -> tuple[int, ...]:
    """Nodal diameters, 0 to N/2, of the harmonics of a travelling wave and of its mean motion.

    Parameters
    ----------
    n_sectors : int
    engine_order : int
    harmonics : iterable of int

    Returns
    -------
    tuple of int

    Examples
    --------
    >>> from upd.hbm import nodal_diameters
    >>> nodal_diameters(12, 2, range(6))
    (0, 2, 4, 6)
    """
    waves = (h * engine_order % n_sectors for h in (0, *harmonics))
    return tuple(sorted({min(n, n_sectors - n) for n in waves}))


@dataclass(frozen=True)
class WaveBalance(Balance):
    """The balance of one sector under a travelling wave; its static part is nodal diameter 0.

    Attributes
    ----------
    n_sectors, engine_order : int
        Beside those of `Balance`.
    modes : mapping
        Nodal diameter, at most N/2 -> modes of the sector, a damper's dofs last.
    near, far : (n_point, 1 + d, n) ndarray
        Rows of the contacts on a sector and on the next one.
    """

    n_sectors: int = field(kw_only=True)
    engine_order: int = field(kw_only=True)
    modes: Mapping[int, Modal] = field(kw_only=True)
    near: FloatArray = field(kw_only=True)
    far: FloatArray = field(kw_only=True)
    _parts: dict[int, tuple[Modal, Any]] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        each = zip(self.dynamic, self.harmonics.dynamic, strict=True)
        loads = [f @ self.part(int(k))[0].Phi.conj() for f, k in each]
        self.__dict__["loads"] = np.array(loads, dtype=complex)

    def number(self, harmonic: int) -> int:
        """Index of the wave of a harmonic, 0 to N - 1."""
        return harmonic * self.engine_order % self.n_sectors

    def part(self, harmonic: int | None = None) -> tuple[Modal, Any]:
        """As of `Balance`, with complex modes and rows.

        Raises KeyError without the modes of its nodal diameter.
        """
        first, N = int(self.harmonics.dynamic[0]), self.n_sectors
        n = self.number(first if harmonic is None else harmonic)
        if n not in self._parts:
            m = self.modes[min(n, N - n)]
            if 2 * n > N:
                m = Modal(m.Phi.conj(), m.eigenvalues, m.damping.conj(), m.rigid)
            rows = (self.near + self.far * phase_of(n, N)).reshape(-1, len(m.Phi))
            self._parts[n] = m, rows @ m.Phi
        return self._parts[n]

    @property
    def _each_harmonic(self) -> tuple[Modal, Any]:
        """As of `Balance`, one after the other."""
        parts = [self.part(int(k)) for k in self.harmonics.dynamic]
        modes, c = [m for m, _ in parts], [m.damping for m, _ in parts]
        if not all(m.proportional for m in modes):
            c = [one if one.ndim == 2 else np.diag(one) for one in c]
        stacked = Modal(
            np.array([m.Phi for m in modes], dtype=complex),
            np.array([m.eigenvalues for m in modes]),
            np.array(c),
            np.array([m.rigid for m in modes]),
        )
        return stacked, np.array([rows for _, rows in parts], dtype=complex)


def travelling_wave_response(
    system: System,
    *,
    n_sectors: int,
    engine_order: int,
    harmonic_force: ArrayLike | Mapping[int, ArrayLike],
    frequencies: ArrayLike,
    sweep_down: bool = False,
    fast_exits: bool = True,
    settings: Settings | None = None,
) -> FrequencyResponse:
    """Forced response of a bladed disk to an engine order, with friction between its sectors.

    Parameters
    ----------
    system : System
        Its matrices are a mapping nodal diameter -> (M, C, K), each (n, n) and Hermitian, on the
        same n dofs of a sector. Those of `nodal_diameters` are needed; more of them serve the
        estimate of what omitted harmonics do. Its contacts are the points of one gap, their rows on
        the n dofs of a sector, then on the n of the next one in the direction of rotation; with a
        damper, which moves with its sector's axes: minus (frame @ blade displacement). Its static
        force acts on every sector. Harmonics with 0 where the normal load varies, or where a static
        load acts; without where it does not and nothing else holds the mean place of a damper that
        slips.
    n_sectors, engine_order : int
        N, at least 3, and EO.
    harmonic_force : (n,) or (N, n) array_like of complex, or mapping
        Amplitude F_1 of the first harmonic on sector 0 [N], or on all sectors, which must then be
        one engine order; a mapping (harmonic number -> amplitude) gives several harmonics.
    frequencies : (n_f,) array_like
        Frequencies [Hz] of the first harmonic, EO times that of rotation.
    sweep_down, fast_exits, settings
        As in `upd.hbm.frequency_response`.

    Returns
    -------
    FrequencyResponse
        Displacements are those of sector 0.

    Raises
    ------
    InputError
        On bad input.

    Notes
    -----
    Points that slip in two directions and partly stick keep the static traction of their start:
    their answer is not unique. Another `start` shows how far.

    Examples
    --------
    Twelve masses that rub on their neighbours, under the engine order 3:

    >>> import numpy as np
    >>> from upd.hbm import System, contacts, nodal_diameters, travelling_wave_response
    >>> slider = contacts([[0.0, 0.0]], [[1.0, -1.0]], k_n=0.0, k_t=0.1, mu=1.0, preload=0.5)
    >>> spring = {d: 0.05 * (2 - 2 * np.cos(2 * np.pi * d / 12)) for d in range(7)}
    >>> disk = {d: ([[1.0]], [[0.01]], [[1.0 + spring[d]]]) for d in nodal_diameters(12, 3)}
    >>> answer = travelling_wave_response(
    ...     System(disk, slider), n_sectors=12, engine_order=3,
    ...     harmonic_force=[1.0], frequencies=[1.04 / (2 * np.pi)],
    ... )
    >>> round(float(answer.amplitude([1.0])[0]), 4)
    7.4733
    """
    f = np.asarray(frequencies, dtype=float).ravel()
    what, N, EO = "travelling_wave_response", n_sectors, engine_order
    points, damper, rows = system.contacts, system.damper, system.damper_rows
    h = system.balanced()
    kept = _require_waves(what, N, EO, system, h)
    n = len(kept[0][0])
    near, far = points.rows[..., :n], points.rows[..., n:]
    force = {k: _one_order(what, v, n, k * EO, N) for k, v in force_of(harmonic_force).items()}
    mean = replace(system, matrices=kept[0], contacts=Contacts(near + far, points.law))
    b = mean.balance(what, f, force, fast_exits=fast_exits)
    none: tuple[FloatArray, ...] = ()
    if damper is not None and rows is not None:
        near = np.concatenate([near, rows], axis=2)
        far = np.concatenate([far, 0.0 * rows], axis=2)
        none = damper.M, 0.0 * damper.M, damper.K
    joined = {
        d: [block_diag(*pair) for pair in zip(A, none, strict=True)] if none else A
        for d, A in kept.items()
    }
    with threads_for(len(b.modal.Phi)):
        modes = {d: modal(*A) if d else b.modal for d, A in joined.items()}
    d1 = 1 + b.contacts.tangents
    parts = (b.modal, b.contacts, b.harmonics, b.samples, b.static, b.dynamic, b.start, b.slider)
    near, far = near[:, :d1], far[:, :d1]
    wave = WaveBalance(*parts, n_sectors=N, engine_order=EO, modes=modes, near=near, far=far)
    if not np.any(wave.loads):
        raise InputError(f"{what}: engine order {EO} moves no blade: its force is zero")
    return response_of(wave, f, sweep_down, fast_exits, settings)


def _require_waves(
    what: str, N: int, EO: int, system: System, h: Harmonics
) -> dict[int, tuple[Any, ...]]:
    """The matrices as arrays, real at 0 and N/2; all problems are named."""
    for name, value, least in (("n_sectors", N, 3), ("engine_order", EO, 0)):
        if value != int(value) or value < least:
            raise InputError(f"{what}: {name} = {value!r} must be a whole number, at least {least}")
    contacts, given, rows = system.contacts, system.matrices, system.damper_rows
    if not isinstance(given, Mapping):
        raise InputError(f"{what}: give the matrices of each nodal diameter, {{0: (M, C, K), ...}}")
    law, needed = contacts.law, nodal_diameters(N, EO, h.numbers)
    A = {d: tuple(np.asarray(one) for one in of) for d, of in given.items()}
    shapes = {one.shape for of in A.values() for one in of}
    n = len(next(iter(A.values()))[0]) if A else 0
    moves = np.any(contacts.rows[:, 0]) or (rows is not None and np.any(rows[:, 0]))
    waved = [d for d, of in A.items() if 2 * d % N == 0 and any(np.any(one.imag) for one in of)]
    found = [
        (
            not set(needed) <= set(A),
            f"the harmonics need the nodal diameters {needed}, matrices has {tuple(sorted(A))}",
        ),
        (
            bool(A) and not 0 <= min(A) <= 2 * max(A) <= N,
            f"matrices has nodal diameters {tuple(sorted(A))}, give some of 0 to {N // 2}",
        ),
        (shapes - {(n, n)} != set(), f"matrices have shapes {sorted(shapes)}, give one"),
        (bool(waved), f"matrices are complex at nodal diameter {waved}, where waves stand"),
        (
            contacts.rows.shape[2] != 2 * n,
            f"contact rows have {contacts.rows.shape[2]} columns, give {2 * n}: those of a sector, "
            "then those of the next",
        ),
        (bool((law.preload < 0.0).any()), "a preload is negative"),
        (
            not h.static and bool(moves and (law.k_n > 0.0).any()),
            f"the normal load varies, its mean needs harmonic 0 among {h.numbers}",
        ),
    ]
    if problems := [words for bad, words in found if bad]:
        raise InputError(f"{what}: " + "; ".join(problems))
    return {d: tuple(one.real if 2 * d % N == 0 else one for one in of) for d, of in A.items()}


def _one_order(what: str, force: ComplexArray, n: int, order: int, N: int) -> ComplexArray:
    """Force of sector 0, from it or from those of all sectors."""
    if force.shape != (N, n):
        return force
    phases = np.array([phase_of(j * order, N) for j in range(N)])
    off = np.abs(force - phases[:, None] * force[0]).max()
    if off > ALIKE * np.abs(force).max():
        raise InputError(
            f"{what}: the forces of the sectors are not of engine order {order} alone: a standing "
            "excitation moves no sector as its neighbour; to fix it: solve for all sectors"
        )
    return np.asarray(force[0])


def all_sectors(b: WaveBalance) -> Balance:
    """The same problem without the assumption of a wave: all sectors, each with its own unknowns.

    Its modes are those of every nodal diameter, the contacts those of every gap.

    Parameters
    ----------
    b : WaveBalance
        With the modes of all nodal diameters.

    Returns
    -------
    Balance
        Dofs of sector 0 first, then of sector 1 and so on.

    Raises
    ------
    InputError
        When nodal diameters are missing.
    """
    N, Phi, damping = b.n_sectors, [], []
    missing = sorted({*range(N // 2 + 1)} - {*b.modes})
    if missing:
        raise InputError(f"all sectors: give the nodal diameters {missing} as well")
    modes = [b.modes[d] for d in range(N // 2 + 1)]
    for d, m in enumerate(modes):
        each = np.array([phase_of(j * d, N) for j in range(N)])[:, None, None] * m.Phi
        shapes = each.reshape(-1, each.shape[-1]) / N**0.5
        c = np.diag(m.damping) if m.proportional else m.damping
        if 2 * d % N == 0:
            Phi.append(shapes.real)
            damping.append(c.real)
        else:
            Phi += [2**0.5 * shapes.real, -(2**0.5) * shapes.imag]
            damping.append(np.block([[c.real, -c.imag], [c.imag, c.real]]))
    twice = [m for d, m in enumerate(modes) for _ in range(1 if 2 * d % N == 0 else 2)]
    c = block_diag(*damping)
    if all(m.proportional for m in modes):
        c = np.diagonal(c).copy()
    whole = Modal(
        np.hstack(Phi),
        np.concatenate([m.eigenvalues for m in twice]),
        c,
        np.concatenate([m.rigid for m in twice]),
    )
    n_point, d1, n = b.near.shape
    rows = np.zeros((N, n_point, d1, N, n))
    for j in range(N):
        rows[j, :, :, j] += b.near
        rows[j, :, :, (j + 1) % N] += b.far
    turns = np.array(
        [[phase_of(j * b.number(k), N) for j in range(N)] for k in b.harmonics.dynamic.tolist()]
    )
    return Balance(
        whole,
        Contacts(rows.reshape(N * n_point, d1, N * n), b.contacts.law.tiled(N)),
        b.harmonics,
        b.samples,
        np.tile(b.static, N),
        (turns[:, :, None] * b.dynamic[:, None]).reshape(len(turns), -1),
        b.start,
        None if b.slider is None else np.tile(b.slider, (N, 1)),
    )


def spread_to_all(b: WaveBalance, x: FloatArray, whole: Balance) -> FloatArray:
    """Unknowns of a travelling wave as unknowns of all sectors.

    Parameters
    ----------
    b : WaveBalance
    x : (n_unknown,) ndarray
    whole : Balance
        Of `all_sectors`.

    Returns
    -------
    (whole.size,) ndarray
    """
    (W, a), N, o = b.split(x), b.n_sectors, b.harmonics.offset
    out = np.repeat(W[None], N, axis=0)
    for i, k in enumerate(b.harmonics.dynamic.tolist()):
        turns = np.array([phase_of(j * b.number(k), N) for j in range(N)])
        wave = turns[:, None, None] * (W[..., o + 2 * i] - 1j * W[..., o + 2 * i + 1])
        out[..., o + 2 * i], out[..., o + 2 * i + 1] = wave.real, -wave.imag
    # modes of nodal diameter 0 come first, each over all sectors
    rest = np.zeros(whole.rigid)
    rest[: len(a)] = N**0.5 * a
    return np.concatenate([out.ravel(), rest])


class WaveInTime(NamedTuple):
    """Steady motion of all sectors by time integration.

    Attributes
    ----------
    sectors : (N,) ndarray of complex
        First harmonic of row @ q on each sector, turned back by its phase [mm].
    steady : SteadyState
        Last period of all sectors.
    """

    sectors: ComplexArray
    steady: SteadyState

    @property
    def amplitude(self) -> float:
        """Mean amplitude of the sectors [mm]."""
        return float(np.abs(self.sectors).mean())

    @property
    def spread(self) -> float:
        """Largest difference of a sector from their mean, relative: 0 for a travelling wave."""
        mean = self.sectors.mean()
        return float(np.abs(self.sectors - mean).max() / np.abs(self.sectors).max())


def wave_in_time(
    answer: FrequencyResponse,
    row: ArrayLike,
    point: int,
    *,
    steps: int = 1024,
    most_periods: int = 2000,
    tolerance: float = 1e-6,
) -> WaveInTime:
    """Time integration of all sectors from a travelling wave: its height, and whether it stays.

    Parameters
    ----------
    answer : FrequencyResponse
        Of `travelling_wave_response`, with the matrices of all nodal diameters.
    row : (n_dof,) array_like
        Weighs the displacements of a sector, those of a damper last.
    point : int
        Number of the point of the answer.
    steps : int
        Least time steps per period; more are taken where sectors would fall between them.
    most_periods, tolerance
        As in `upd.hbm.steady_state`.

    Returns
    -------
    WaveInTime
    """
    b = answer.balance
    if not isinstance(b, WaveBalance):
        raise InputError("wave_in_time: give an answer of travelling_wave_response")
    N, k = b.n_sectors, int(b.harmonics.dynamic[0])
    shift = N // gcd(N, b.engine_order)
    whole = all_sectors(b)
    steady = steady_state(
        whole,
        float(answer.frequency[point]),
        spread_to_all(b, answer.x[point], whole),
        steps=-(-steps // shift) * shift,
        most_periods=most_periods,
        tolerance=tolerance,
    )
    q = to_complex(steady.coefficients, b.harmonics)[:, 0].reshape(N, -1)
    back = np.array([phase_of(-j * b.number(k), N) for j in range(N)])
    return WaveInTime(back * (q @ np.asarray(row, dtype=float)), steady)
