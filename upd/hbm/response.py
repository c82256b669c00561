"""Forced response over frequency: free, stuck and nonlinear.

With fast exits that are checked, a status and a message.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import InputError
from upd.hbm.balance import Balance
from upd.hbm.checks import aliasing, portions, separated, stuck_points, truncation
from upd.hbm.contact_points import Contacts, frictionless
from upd.hbm.continuation import Settings
from upd.hbm.coulomb import LIFT, SLIP, STICK
from upd.hbm.damper import RigidDamper, attach
from upd.hbm.fourier import Harmonics, harmonics, sample_count, to_complex
from upd.hbm.friction import Start
from upd.hbm.modal import modal
from upd.hbm.peaks import climb
from upd.hbm.starts import first_point
from upd.hbm.sweep import sweep

log = logging.getLogger(__name__)

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
EPS = float(np.finfo(float).eps)
#: largest share of the contact motion that harmonics left out may cause before more are taken
TRUNCATION = 1e-3
#: largest change of the contact force with twice the samples before a warning
ALIASING = 1e-2
#: harmonics an adaptive answer may reach
MOST_HARMONICS = 31


@dataclass(frozen=True)
class FrequencyResponse:
    """Steady forced response along the solution path.

    n points, in order of the path: frequencies repeat or turn back at folds. Coefficients are
    [a0, a1, b1, a2, b2, ...] (no a0 without harmonic 0).

    Attributes
    ----------
    balance : Balance
        The condensed problem.
    frequency : (n,) ndarray
        [Hz]
    x : (n, n_unknown) ndarray
        Unknowns.
    contact_displacement : (n, n_point, 1 + d, size) ndarray
        Coefficients of the relative displacements [mm].
    contact_force : (n, n_point, 1 + d, size) ndarray
        Coefficients of the contact forces [N].
    state : (n, n_point, 3) ndarray
        Shares of the cycle in stick, slip, lift-off.
    energy : (n, n_point) ndarray
        Energy lost per cycle [N mm].
    linear : (n,) ndarray of bool
        Answered by an exact linear solution.
    truncation : (n,) ndarray
        Contact motion that missing harmonics would cause, relative.
    aliasing : (n,) ndarray
        Change of the contact force with twice the samples, relative.
    status : {"complete", "stopped", "step limit"}
    message : str
        Where and why the path ended, and warnings.
    """

    balance: Balance
    frequency: FloatArray
    x: FloatArray
    contact_displacement: FloatArray
    contact_force: FloatArray
    state: FloatArray
    energy: FloatArray
    linear: NDArray[np.bool_]
    truncation: FloatArray
    aliasing: FloatArray
    status: str
    message: str

    @property
    def harmonics(self) -> Harmonics:
        """Harmonics of the answer."""
        return self.balance.harmonics

    @cached_property
    def coefficients(self) -> FloatArray:
        """Coefficients of the displacement of all dofs (n, n_dof, size) [mm]."""
        force = self.contact_force.reshape(
            len(self.frequency), len(self.balance.Psi), self.harmonics.size
        )
        return self.balance.displacement(self._omega, force, self.balance.rigid_part(self.x))

    def amplitude(self, row: ArrayLike, harmonic: int = 1) -> FloatArray:
        """Amplitude of one harmonic along the path.

        Parameters
        ----------
        row : (n_dof,) array_like
            Weighs the displacements: row @ q.
        harmonic : int
            Number of the harmonic, above 0.

        Returns
        -------
        (n,) ndarray
            Amplitude [mm].
        """
        q = np.einsum("i,nis->ns", np.asarray(row, dtype=float), self.coefficients)
        k = int(np.flatnonzero(self.harmonics.dynamic == harmonic)[0])
        return np.abs(to_complex(q, self.harmonics)[:, k])

    def free(self, row: ArrayLike, frequencies: ArrayLike | None = None) -> FloatArray:
        """Linear amplitude of the first harmonic without contacts.

        Parameters
        ----------
        row : (n_dof,) array_like
            Weighs the displacements: row @ q.
        frequencies : (k,) array_like, optional
            [Hz]; those of the path by default.

        Returns
        -------
        (k,) ndarray
            Amplitude [mm].
        """
        return self._linear(row, frequencies, stuck=False)

    def stuck(self, row: ArrayLike, frequencies: ArrayLike | None = None) -> FloatArray:
        """Linear amplitude of the first harmonic with all points closed and sticking.

        Parameters
        ----------
        row : (n_dof,) array_like
            Weighs the displacements: row @ q.
        frequencies : (k,) array_like, optional
            [Hz]; those of the path by default.

        Returns
        -------
        (k,) ndarray
            Amplitude [mm].
        """
        return self._linear(row, frequencies, stuck=True)

    @cached_property
    def energy_balance(self) -> FloatArray:
        """(Work of excitation - viscous loss - contact loops) / work per cycle, (n,).

        Zero up to the tolerance of the solver.
        """
        h, b, q = self.harmonics, self.balance, to_complex(self.coefficients, self.harmonics)
        k = h.dynamic
        work = np.pi * np.einsum("k,ki,nik->n", k, b.dynamic, q.conj()).imag
        # modal velocities: the damping matrix is kept in the modes only
        eta = np.einsum("ij,nik->njk", np.linalg.inv(b.modal.Phi).T, q)
        c = np.diag(b.modal.damping) if b.modal.proportional else b.modal.damping
        viscous = (
            np.pi * self._omega * np.einsum("k,nik,ij,njk->n", k**2.0, eta.conj(), c, eta).real
        )
        total = np.abs(work) + np.abs(viscous) + self.energy.sum(axis=1)
        return np.asarray(
            (work - viscous - self.energy.sum(axis=1)) / np.where(total > 0, total, 1.0)
        )

    def peak(self, row: ArrayLike) -> tuple[float, float]:
        """Highest first harmonic: climbed to from the highest point, else by a parabola.

        The parabola through the highest point and its neighbours also serves where the highest
        point is an end of the curve.

        Parameters
        ----------
        row : (n_dof,) array_like
            Weighs the displacements: row @ q.

        Returns
        -------
        frequency : float
            [Hz]
        amplitude : float
            [mm]
        """
        a = self.amplitude(row)
        i = int(np.argmax(a))
        if 0 < i < len(a) - 1:
            top = climb(self.balance, row, self.x[i], float(self.frequency[i]))
            if top.found and top.amplitude >= a[i] * (1 - EPS**0.5):
                return top.frequency, top.amplitude
        return parabola(self.frequency, a)

    @property
    def _omega(self) -> FloatArray:
        return 2 * np.pi * self.frequency

    def _linear(self, row: ArrayLike, frequencies: ArrayLike | None, stuck: bool) -> FloatArray:
        f = self.frequency if frequencies is None else np.asarray(frequencies, dtype=float)
        q = self.balance.linear_displacement(2 * np.pi * f, stuck)
        return np.asarray(np.abs(q @ np.asarray(row, dtype=float)))


def parabola(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Vertex of the parabola through the highest point and its neighbours.

    Parameters
    ----------
    x, y : (n,) ndarray
        Points of a curve.

    Returns
    -------
    x, y : float
        The vertex; the point itself at an end or a turning point.
    """
    i = int(np.argmax(y))
    if 0 < i < len(x) - 1:
        d0, d1 = x[i] - x[i - 1], x[i + 1] - x[i]
        if d0 * d1 > 0:
            s0, s1 = (y[i] - y[i - 1]) / d0, (y[i + 1] - y[i]) / d1
            curve = (s1 - s0) / (d0 + d1)
            slope = (s0 * d1 + s1 * d0) / (d0 + d1)
            if curve < 0:
                shift = -slope / (2 * curve)
                return float(x[i] + shift), float(y[i] + slope * shift / 2)
    return float(x[i]), float(y[i])


def frequency_response(
    M: ArrayLike,
    C: ArrayLike,
    K: ArrayLike,
    contacts: Contacts,
    *,
    harmonic_force: ArrayLike | Mapping[int, ArrayLike],
    frequencies: ArrayLike,
    static_force: ArrayLike | None = None,
    harmonics: Iterable[int] | Literal["adaptive"] = (0, 1),
    samples: int | None = None,
    damper: RigidDamper | None = None,
    damper_rows: FloatArray | None = None,
    start: Start = "zero",
    sweep_down: bool = False,
    fast_exits: bool = True,
    settings: Settings | None = None,
) -> FrequencyResponse:
    """Forced response of M q'' + C q' + K q = f(t) - B'f_c by multi-harmonic balance.

    Parameters
    ----------
    M, C, K : (n, n) array_like
        Mass [t], damping [N s/mm] and stiffness [N/mm], dense and symmetric; M positive definite, K
        may be singular (a body held only by its contacts).
    contacts : Contacts
        The contact points and their rows B on the n dofs.
    harmonic_force : (n,) array_like of complex, or mapping
        Complex amplitude F of the first harmonic [N], f(t) = Re(F exp(i w t)); a mapping (harmonic
        number -> amplitude) gives several harmonics.
    frequencies : (n_f,) array_like
        Frequencies [Hz], answered at these and between.
    static_force : (n,) array_like, optional
        [N]
    harmonics : iterable of int, or "adaptive"
        A set with or without 0; "adaptive" takes (0, 1) first, more only while those left out
        matter.
    samples : int, optional
        Samples per period; by rule when None.
    damper : RigidDamper, optional
        Its dofs and its centrifugal force are appended.
    damper_rows : (n_point, 1 + d, damper.n_dof) ndarray, optional
        The damper's share of the rows, see `contact_rows`; comes together with `damper`.
    start : {"zero", "static", "mid", "upper", "lower"}
        Position of the sliders before the march, which decides the residual traction of points that
        stick.
    sweep_down : bool
        Go from the highest frequency to the lowest.
    fast_exits : bool
        Take the exact linear answers where they are proven.
    settings : Settings, optional
        Step control of the continuation.

    Returns
    -------
    FrequencyResponse
        A path that stops early is returned with its status, never raised.

    Raises
    ------
    InputError
        On bad input; all problems are named.

    Examples -------- A mass on a spring with a Jenkins element, without any other damping. With one
    harmonic the peak is (mu N/k_t) / (1 - pi F/(4 mu N)); it is lowest at mu N = pi F/2, where it
    is pi F/k_t:

    >>> import numpy as np
    >>> from upd.hbm import contacts, frequency_response
    >>> jenkins = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=1.0, mu=1.0, preload=np.pi / 2)
    >>> f0 = np.sqrt(1.5) / (2 * np.pi)
    >>> answer = frequency_response(
    ...     [[1.0]], [[0.0]], [[1.0]], jenkins,
    ...     harmonic_force=[1.0], frequencies=np.array([0.9, 1.0, 1.1]) * f0, harmonics=(1,),
    ...     samples=1024,
    ... )
    >>> answer.status
    'complete'
    >>> f, height = answer.peak([1.0])
    >>> float(round(f / f0, 2)), float(round(height / np.pi, 3))
    (1.0, 1.0)

    There the slider dissipates 4 mu N (A - mu N/k_t) = pi^2 per cycle:

    >>> bool(np.isclose(answer.energy.max(), np.pi**2, rtol=1e-3))
    True
    """
    f = np.asarray(frequencies, dtype=float).ravel()
    A = [np.asarray(a, dtype=float) for a in (M, C, K)]
    force = _force(harmonic_force)
    n = len(A[0])
    static = np.zeros(n) if static_force is None else np.asarray(static_force, dtype=float)
    _require(f, static, force, contacts, n, (damper is None) == (damper_rows is None))
    if damper is not None and damper_rows is not None:
        *A, contacts = attach(A[0], A[1], A[2], contacts, damper, damper_rows)
        static = np.concatenate([static, damper.force])
        force = {k: np.concatenate([v, np.zeros(damper.n_dof)]) for k, v in force.items()}
    if fast_exits and contacts.tangents and not np.any(contacts.law.mu):
        contacts = frictionless(contacts)
    numbers = _harmonics((0, 1) if harmonics == "adaptive" else harmonics, force)
    b = _balance(Balance, modal(A[0], A[1], A[2]), contacts, numbers, samples, static, force, start)
    order = np.unique(f)[::-1] if sweep_down else np.unique(f)
    answer = _answer(b, order, fast_exits, settings)
    while harmonics == "adaptive" and (more := _more(answer)) is not None:
        b = _balance(Balance, b.modal, contacts, more, samples, static, force, start)
        answer = _answer(b, order, fast_exits, settings, answer)
    return _warned(answer)


def _force(given: ArrayLike | Mapping[int, ArrayLike]) -> dict[int, ComplexArray]:
    if isinstance(given, Mapping):
        return {int(k): np.asarray(v, dtype=complex) for k, v in given.items()}
    return {1: np.asarray(given, dtype=complex)}


def _require(
    f: FloatArray,
    static: FloatArray,
    force: dict[int, ComplexArray],
    points: Contacts,
    n: int,
    paired: bool,
) -> None:
    problems = (
        []
        if len(f) and np.all(np.isfinite(f)) and np.all(f > 0)
        else ["frequencies must be finite and above 0"]
    )
    problems += (
        [] if static.shape == (n,) else [f"static_force has shape {static.shape}, give ({n},)"]
    )
    problems += [
        f"harmonic_force {k} has shape {v.shape}, give ({n},)"
        for k, v in force.items()
        if v.shape != (n,)
    ]
    problems += (
        []
        if all(k > 0 for k in force)
        else ["harmonic_force belongs to harmonics above 0; the mean goes into static_force"]
    )
    problems += [
        f"loads at {name} are not finite"
        for name, v in [("static_force", static), *force.items()]
        if not np.all(np.isfinite(v))
    ]
    problems += (
        []
        if points.rows.shape[2] == n
        else [f"contact rows have {points.rows.shape[2]} columns, the system {n} dofs"]
    )
    problems += [] if paired else ["damper and damper_rows come together"]
    if problems:
        raise InputError("frequency_response: " + "; ".join(problems))


def _harmonics(numbers: Iterable[int] | str, force: dict[int, ComplexArray]) -> Harmonics:
    if isinstance(numbers, str):
        raise InputError(f'harmonics: "{numbers}" is unknown; give numbers or "adaptive"')
    h = harmonics(numbers)
    missing = sorted(set(force) - set(h.numbers))
    if missing:
        raise InputError(
            f"harmonics: the excitation acts in {missing}, not among {h.numbers}; add them"
        )
    return h


def _balance(
    make: type[Balance],
    model: object,
    points: Contacts,
    h: Harmonics,
    samples: int | None,
    static: FloatArray,
    force: dict[int, ComplexArray],
    start: Start,
) -> Balance:
    dynamic = np.zeros((len(h.dynamic), len(static)), dtype=complex)
    for j, k in enumerate(h.dynamic):
        dynamic[j] = force.get(int(k), 0.0)
    return make(model, points, h, sample_count(h, samples), static, dynamic, start)  # type: ignore[arg-type]


def _answer(
    b: Balance,
    f: FloatArray,
    fast: bool,
    settings: Settings | None,
    before: FrequencyResponse | None = None,
) -> FrequencyResponse:
    """The whole curve for one set of harmonics.

    `before` is an answer with fewer harmonics to start from.
    """
    linear = (
        stuck_points(b, 2 * np.pi * f)
        if fast and b.start == "zero"
        else np.zeros(len(f), dtype=bool)
    )
    if linear.all():
        x = np.array([b.stuck(2 * np.pi * v) for v in f])
        return _collect(
            b,
            f,
            x,
            linear,
            "complete",
            "every point sticks over the whole cycle: the linear answer is exact",
        )
    apart = separated(b, 2 * np.pi * f) if fast else None
    if apart is not None:
        return _collect(
            b,
            f,
            apart,
            np.ones(len(f), dtype=bool),
            "complete",
            "nothing presses the contacts: the free answer is exact",
        )
    guess = None if before is None else b.embedded(before.x[0], before.balance)
    if b.start == "static":
        b = b.with_sliders("static", first_point(b, f[0]).slider)
    path = sweep(b, f, linear, guess, settings)
    return _collect(b, path.p, path.x, path.exact, path.status, path.message)


def _collect(
    b: Balance, f: FloatArray, x: FloatArray, linear: NDArray[np.bool_], status: str, message: str
) -> FrequencyResponse:
    n_point = b.contacts.n_point
    W = b.coefficients(x)
    F, state = np.empty_like(W), np.empty((len(f), n_point, 3))
    for part in portions(len(x)):
        found = b.marched(W[part], b.E)
        F[part] = found.coefficients(b.Q)
        for code in (STICK, SLIP, LIFT):
            state[part, :, code] = (found.state == code).mean(axis=-1)
    o, k = b.harmonics.offset, b.harmonics.dynamic
    # loop area of f dw over a cycle, harmonic by harmonic
    cross = F[..., o::2] * W[..., o + 1 :: 2] - F[..., o + 1 :: 2] * W[..., o::2]
    energy = np.pi * np.einsum("k,npck->np", k, cross)
    return FrequencyResponse(
        b,
        f,
        x,
        W,
        F,
        state,
        energy,
        linear,
        truncation(b, f, x),
        aliasing(b, x, F),
        status,
        message,
    )


def _more(answer: FrequencyResponse) -> Harmonics | None:
    """The next set of harmonics.

    None when those left out do not matter or the most are taken.
    """
    worst = float(answer.truncation.max(initial=0.0))
    top = answer.harmonics.highest
    if worst <= TRUNCATION or top >= MOST_HARMONICS or answer.status != "complete":
        return None
    return harmonics(range(0 if answer.harmonics.static else 1, min(MOST_HARMONICS, top + 2) + 1))


def _warned(answer: FrequencyResponse) -> FrequencyResponse:
    """The answer, its message extended and logged where harmonics or samples are too few."""
    notes = []
    if answer.truncation.max(initial=0.0) > 10 * TRUNCATION:
        notes.append(
            f"harmonics above {answer.harmonics.highest} would move the contacts by up to "
            f"{answer.truncation.max():.1%}: take more"
        )
    if answer.aliasing.max(initial=0.0) > ALIASING:
        notes.append(
            "twice the samples change the contact force by up to "
            f"{answer.aliasing.max():.1%}: take more samples"
        )
    for note in notes:
        log.warning(note)
    return replace(answer, message="; ".join([answer.message, *notes]))
