"""Forced response over frequency: free, stuck and nonlinear, with fast exits that are checked and a status in words."""

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
from upd.hbm.damper import RigidDamper, attach
from upd.hbm.fourier import Harmonics, harmonics, sample_count, to_complex
from upd.hbm.friction import LIFT, SLIP, STICK, Start
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
    """Steady forced response along the solution path; n points, in order of the path (frequencies repeat or turn back at folds).

    frequency (n,) [Hz]; x (n, n_unknown) the unknowns; contact_displacement, contact_force (n, n_point, 1 + d, size) [mm, N], coefficients
    [a0, a1, b1, a2, ...]; state (n, n_point, 3): shares of the cycle in stick, slip, lift-off; energy (n, n_point) [N mm] lost per cycle;
    linear (n,): answered by an exact linear solution; truncation (n,): contact motion missing harmonics would cause, relative;
    aliasing (n,): change of the contact force with twice the samples, relative; status "complete", "stopped" or "step limit"; message.
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
        """Displacement of all dofs (n, n_dof, size) [mm]."""
        force = self.contact_force.reshape(len(self.frequency), len(self.balance.Psi), self.harmonics.size)
        return self.balance.displacement(self._omega, force, self.balance.rigid_part(self.x))

    def amplitude(self, row: ArrayLike, harmonic: int = 1) -> FloatArray:
        """|amplitude| (n,) [mm] of one harmonic of row @ q, row (n_dof,)."""
        q = np.einsum("i,nis->ns", np.asarray(row, dtype=float), self.coefficients)
        k = int(np.flatnonzero(self.harmonics.dynamic == harmonic)[0])
        return np.abs(to_complex(q, self.harmonics)[:, k])

    def free(self, row: ArrayLike, frequencies: ArrayLike | None = None) -> FloatArray:
        """Linear amplitude of the first harmonic without contacts at the given frequencies [Hz] (those of the path by default)."""
        return self._linear(row, frequencies, stuck=False)

    def stuck(self, row: ArrayLike, frequencies: ArrayLike | None = None) -> FloatArray:
        """Linear amplitude of the first harmonic with all points closed and sticking."""
        return self._linear(row, frequencies, stuck=True)

    @cached_property
    def energy_balance(self) -> FloatArray:
        """(work of excitation - viscous loss - contact loops) / work per cycle, (n,): zero up to the tolerance of the solver."""
        h, b, q = self.harmonics, self.balance, to_complex(self.coefficients, self.harmonics)
        k = h.dynamic
        work = np.pi * np.einsum("k,ki,nik->n", k, b.dynamic, q.conj()).imag
        # modal velocities: the damping matrix is kept in the modes only
        eta = np.einsum("ij,nik->njk", np.linalg.inv(b.modal.Phi).T, q)
        c = np.diag(b.modal.damping) if b.modal.proportional else b.modal.damping
        viscous = np.pi * self._omega * np.einsum("k,nik,ij,njk->n", k**2.0, eta.conj(), c, eta).real
        total = np.abs(work) + np.abs(viscous) + self.energy.sum(axis=1)
        return np.asarray((work - viscous - self.energy.sum(axis=1)) / np.where(total > 0, total, 1.0))

    def peak(self, row: ArrayLike) -> tuple[float, float]:
        """Frequency [Hz] and amplitude [mm] of the highest first harmonic: climbed to from the highest point, else by a parabola.

        The parabola through the highest point and its neighbours also serves where the highest point is an end of the curve.
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
    """Vertex (x, y) of the parabola through the highest point and its neighbours; the point itself at an end or a turning point."""
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
    """Forced response of M q'' + C q' + K q = f(t) - B'f_c by multi-harmonic balance, answered at the frequencies (n,) [Hz] and between.

    M, C, K (n, n) dense and symmetric, M positive definite, K may be singular (a body held only by its contacts). harmonic_force (n,):
    complex amplitude F of the first harmonic, f(t) = Re(F exp(i w t)); a mapping gives several harmonics. static_force (n,) [N].
    With `damper`, its dofs and its centrifugal force are appended; `damper_rows` (n_point, 1 + d, damper.n_dof): its share of the rows.
    harmonics: a set with or without 0, or "adaptive": (0, 1) first, more only while those left out matter. samples per period: by rule
    when None. start: position of the sliders before the march, which decides the residual traction of points that stick.
    InputError on bad input; a path that stops early is returned with its status, never raised.
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


def _require(f: FloatArray, static: FloatArray, force: dict[int, ComplexArray], points: Contacts, n: int, paired: bool) -> None:
    problems = [] if len(f) and np.all(np.isfinite(f)) and np.all(f > 0) else ["frequencies must be finite and above 0"]
    problems += [] if static.shape == (n,) else [f"static_force has shape {static.shape}, give ({n},)"]
    problems += [f"harmonic_force {k} has shape {v.shape}, give ({n},)" for k, v in force.items() if v.shape != (n,)]
    problems += [] if all(k > 0 for k in force) else ["harmonic_force belongs to harmonics above 0; the mean goes into static_force"]
    problems += [f"loads at {name} are not finite" for name, v in [("static_force", static), *force.items()] if not np.all(np.isfinite(v))]
    problems += [] if points.rows.shape[2] == n else [f"contact rows have {points.rows.shape[2]} columns, the system {n} dofs"]
    problems += [] if paired else ["damper and damper_rows come together"]
    if problems:
        raise InputError("frequency_response: " + "; ".join(problems))


def _harmonics(numbers: Iterable[int] | str, force: dict[int, ComplexArray]) -> Harmonics:
    if isinstance(numbers, str):
        raise InputError(f'harmonics: "{numbers}" is unknown; give numbers or "adaptive"')
    h = harmonics(numbers)
    missing = sorted(set(force) - set(h.numbers))
    if missing:
        raise InputError(f"harmonics: the excitation acts in {missing}, not among {h.numbers}; add them")
    return h


def _balance(
    make: type[Balance], model: object, points: Contacts, h: Harmonics, samples: int | None, static: FloatArray,
    force: dict[int, ComplexArray], start: Start,
) -> Balance:  # fmt: skip
    dynamic = np.zeros((len(h.dynamic), len(static)), dtype=complex)
    for j, k in enumerate(h.dynamic):
        dynamic[j] = force.get(int(k), 0.0)
    return make(model, points, h, sample_count(h, samples), static, dynamic, start)  # type: ignore[arg-type]


def _answer(b: Balance, f: FloatArray, fast: bool, settings: Settings | None, before: FrequencyResponse | None = None) -> FrequencyResponse:
    """The whole curve for one set of harmonics; `before` is an answer with fewer harmonics to start from."""
    linear = stuck_points(b, 2 * np.pi * f) if fast and b.start == "zero" else np.zeros(len(f), dtype=bool)
    if linear.all():
        x = np.array([b.stuck(2 * np.pi * v) for v in f])
        return _collect(b, f, x, linear, "complete", "every point sticks over the whole cycle: the linear answer is exact")
    apart = separated(b, 2 * np.pi * f) if fast else None
    if apart is not None:
        return _collect(b, f, apart, np.ones(len(f), dtype=bool), "complete", "nothing presses the contacts: the free answer is exact")
    guess = None if before is None else b.embedded(before.x[0], before.balance)
    if b.start == "static":
        b = b.with_sliders("static", first_point(b, f[0]).slider)
    path = sweep(b, f, linear, guess, settings)
    return _collect(b, path.p, path.x, path.exact, path.status, path.message)


def _collect(b: Balance, f: FloatArray, x: FloatArray, linear: NDArray[np.bool_], status: str, message: str) -> FrequencyResponse:
    n_point = b.contacts.n_point
    W = b.coefficients(x)
    F, state = np.empty_like(W), np.empty((len(f), n_point, 3))
    for part in portions(len(x)):
        found = b.marched(W[part], b.E)
        F[part] = found.force @ b.Q.T
        for code in (STICK, SLIP, LIFT):
            state[part, :, code] = (found.state == code).mean(axis=-1)
    o, k = b.harmonics.offset, b.harmonics.dynamic
    # loop area of f dw over a cycle, harmonic by harmonic
    cross = F[..., o::2] * W[..., o + 1 :: 2] - F[..., o + 1 :: 2] * W[..., o::2]
    energy = np.pi * np.einsum("k,npck->np", k, cross)
    return FrequencyResponse(b, f, x, W, F, state, energy, linear, truncation(b, f, x), aliasing(b, x, F), status, message)


def _more(answer: FrequencyResponse) -> Harmonics | None:
    """The next set of harmonics, or None when those left out do not matter or the most are taken."""
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
            f"harmonics above {answer.harmonics.highest} would move the contacts by up to {answer.truncation.max():.1%}: take more"
        )
    if answer.aliasing.max(initial=0.0) > ALIASING:
        notes.append(f"twice the samples change the contact force by up to {answer.aliasing.max():.1%}: take more samples")
    for note in notes:
        log.warning(note)
    return replace(answer, message="; ".join([answer.message, *notes]))
