"""Forced response over frequency: free, stuck and nonlinear.

With fast exits that are checked, a status and a message.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, cast, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import InputError
from upd.hbm.core.fourier import Harmonics, harmonics, sample_count, to_complex
from upd.hbm.core.newton import Settings
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.checks import Measures, measures
from upd.hbm.springs.damper import RigidDamper, attach
from upd.hbm.springs.modal import modal
from upd.hbm.springs.peak import climb
from upd.hbm.springs.points import Contacts, Start
from upd.hbm.springs.sweep import Curve, solve_curve
from upd.labels import Shown
from upd.linalg.parallel import threads_for

log = logging.getLogger(__name__)

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Matrices = tuple[ArrayLike, ArrayLike, ArrayLike]
EPS = float(np.finfo(float).eps)
#: largest contact motion that omitted harmonics may cause before a warning, relative
TRUNCATION = 1e-2
#: largest change of the contact force with twice the samples before a warning
ALIASING = 1e-2
Status = Literal["complete", "not periodic", "stopped", "step limit"]


@dataclass(frozen=True, kw_only=True)
class FrequencyResponse(Measures):
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
    status : {"complete", "not periodic", "stopped", "step limit"}
        "complete": the path reached the last frequency, and its contact forces are periodic. "not
        periodic": it reached it, but at some points the contact forces do not come back to their
        start. "stopped", "step limit": it did not reach it.
    message : str
        Where and why the path ended, and warnings.
    periodic : (n,) ndarray of bool
        Whether the contact forces came back to their start.
    """

    balance: Balance
    frequency: FloatArray
    x: FloatArray
    linear: NDArray[np.bool_]
    status: Status
    message: str

    def __repr__(self) -> str:
        """Its end and its size, without the arrays."""
        f = self.frequency
        span = f", {f.min():.5g} to {f.max():.5g} Hz" if len(f) else ""
        return f"Forced response: {self.status}, {len(f)} points{span}\n  {self.message}"

    @property
    def arrived(self) -> bool:
        """Whether the path reached the last frequency."""
        return self.status not in ("stopped", "step limit")

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
        rigid = self.x[:, self.balance.size - self.balance.rigid :]
        return self.balance.displacement(2 * np.pi * self.frequency, force, rigid)

    def amplitude(self, row: ArrayLike, harmonic: int | None = None) -> FloatArray:
        """Amplitude of one harmonic along the path.

        Parameters
        ----------
        row : (n_dof,) array_like
            Weighs the displacements: row @ q.
        harmonic : int, optional
            Number of the harmonic; the lowest above 0 by default, nearly always 1.

        Returns
        -------
        (n,) ndarray
            Amplitude [mm].

        Raises
        ------
        InputError
            For a harmonic that is not kept, or a row of another length.
        """
        self.balance.modal_row(row, harmonic)
        q = np.einsum("i,nis->ns", np.asarray(row, dtype=float), self.coefficients)
        return np.abs(to_complex(q, self.harmonics)[:, self.harmonics.place(harmonic)])

    def free(
        self,
        row: ArrayLike,
        frequencies: ArrayLike | None = None,
        harmonic: int | None = None,
    ) -> FloatArray:
        """Linear amplitude of one harmonic without contacts.

        Parameters
        ----------
        row : (n_dof,) array_like
            Weighs the displacements: row @ q.
        frequencies : (k,) array_like, optional
            [Hz]; those of the path by default.
        harmonic : int, optional
            Number of the harmonic; the lowest above 0 by default.

        Returns
        -------
        (k,) ndarray
            Amplitude [mm].
        """
        return self._linear(row, frequencies, harmonic, stuck=False)

    def stuck(
        self,
        row: ArrayLike,
        frequencies: ArrayLike | None = None,
        harmonic: int | None = None,
    ) -> FloatArray:
        """Linear amplitude of one harmonic with all points closed, and sticking with friction.

        Parameters
        ----------
        row : (n_dof,) array_like
            Weighs the displacements: row @ q.
        frequencies : (k,) array_like, optional
            [Hz]; those of the path by default.
        harmonic : int, optional
            Number of the harmonic; the lowest above 0 by default.

        Returns
        -------
        (k,) ndarray
            Amplitude [mm].
        """
        return self._linear(row, frequencies, harmonic, stuck=True)

    @cached_property
    def energy_balance(self) -> FloatArray:
        """(Work of excitation - viscous loss - contact loops) / work per cycle, (n,).

        Zero up to the tolerance of the solver.
        """
        b, k, omegas = self.balance, self.harmonics.dynamic, 2 * np.pi * self.frequency
        force = self.contact_force.reshape(len(self.frequency), len(b.Psi), -1)
        work, lost = np.zeros((2, len(force)))
        for i, (F, omega) in enumerate(zip(force, omegas, strict=True)):
            eta = b.amplitudes(F, float(omega))
            work[i] = np.pi * np.einsum("k,km,km", k, b.loads, eta.conj()).imag
            lost[i] = np.einsum("k,km,km", k**2.0, eta.conj(), b.linear.damped(eta)).real
        viscous = np.pi * omegas * lost
        total = np.abs(work) + np.abs(viscous) + self.energy.sum(axis=1)
        return np.asarray(
            (work - viscous - self.energy.sum(axis=1)) / np.where(total > 0, total, 1.0)
        )

    def peak(self, row: ArrayLike, harmonic: int | None = None) -> tuple[float, float]:
        """Highest point of one harmonic: climbed to from the highest solved, else by a parabola.

        The parabola through the highest point and its neighbours also serves where the highest
        point is an end of the curve.

        Parameters
        ----------
        row : (n_dof,) array_like
            Weighs the displacements: row @ q.
        harmonic : int, optional
            Number of the harmonic; the lowest above 0 by default.

        Returns
        -------
        frequency : float
            [Hz]
        amplitude : float
            [mm]

        Raises
        ------
        InputError
            When the path has no point.
        """
        a = self.amplitude(row, harmonic)
        if not len(a):
            raise InputError(f"peak: the path has no point: {self.message}")
        i = int(np.argmax(a))
        if 0 < i < len(a) - 1:
            at = float(self.frequency[i])
            with threads_for(self.balance.size):
                top = climb(self.balance, row, self.x[i], at, harmonic=harmonic)
            if top.found and top.amplitude >= a[i] * (1 - EPS**0.5):
                return top.frequency, top.amplitude
        return parabola(self.frequency, a)

    def _linear(
        self, row: ArrayLike, frequencies: ArrayLike | None, harmonic: int | None, stuck: bool
    ) -> FloatArray:
        self.balance.modal_row(row, harmonic)
        f = self.frequency if frequencies is None else np.asarray(frequencies, dtype=float)
        with threads_for(self.balance.size):
            q = self.balance.linear_displacement(2 * np.pi * f, stuck, harmonic)
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


@dataclass(frozen=True, eq=False, repr=False)
class System(Shown):
    """A system with contacts, and the harmonics that describe its motion.

    Parameters
    ----------
    matrices : (M, C, K)
        Mass [t], damping [N s/mm] and stiffness [N/mm], each (n, n), dense and symmetric; M is
        positive definite, K may be singular (a body held only by its contacts). Of a bladed disk a
        mapping nodal diameter -> matrices, see `travelling_wave_response`.
    contacts : Contacts
        The contact points and their rows B on the n dofs.
    static_force : (n,) array_like, optional
        [N]
    damper : RigidDamper, optional
        Its dofs and its centrifugal force are appended.
    damper_rows : (n_point, 1 + d, damper.n_dof) ndarray, optional
        The damper's share of the rows, see `contact_rows`; comes together with `damper`.
    harmonics : iterable of int, optional
        A set with or without 0; static loads need it. 0 and 1 when None, of a nonlinear mode 0 to
        9.
    samples : int, optional
        Samples per period; by rule when None.
    start : {"zero", "frictionless", "static", "mid", "upper", "lower"}
        Position of the sliders before the march, which decides the residual traction of points that
        stick. "frictionless": where the closed contacts carry the static loads without traction.
    slider : (n_point, d) array_like, optional
        Positions [mm] from which the starts "zero" and "static" begin instead of zero: -T_0 / k_t
        carries the traction T_0 [N] where nothing has moved, a preload along the tangents.
    """

    matrices: Matrices | Mapping[int, Matrices]
    contacts: Contacts
    static_force: ArrayLike | None = None
    damper: RigidDamper | None = None
    damper_rows: FloatArray | None = None
    harmonics: Iterable[int] | None = None
    samples: int | None = None
    start: Start = "zero"
    slider: ArrayLike | None = None

    def balanced(self, usual: Iterable[int] = (0, 1)) -> Harmonics:
        """The harmonics, the usual ones where none are given."""
        return harmonics(usual if self.harmonics is None else self.harmonics)

    def balance(
        self, what: str, f: FloatArray, force: dict[int, ComplexArray] | None, *, fast_exits: bool
    ) -> Balance:
        """The balance under harmonic forces.

        Parameters
        ----------
        what : str
            Public function that was called, for messages.
        f : (k,) ndarray
            Frequencies [Hz].
        force : dict or None
            Harmonic number -> (n,) complex amplitude [N]; None for none in the first harmonic.
        fast_exits : bool
            As in `frequency_response`.

        Returns
        -------
        Balance
        """
        M, C, K = self._dense(what)
        force = {1: np.zeros(len(M), dtype=complex)} if force is None else force
        given = self.static_force
        static = np.zeros(len(M)) if given is None else np.asarray(given, float)
        self._require(what, f, static, force, len(M))
        slider, points = self._sliders(what), self.contacts
        h = self.balanced()
        self._require_harmonics(what, h, static, force)
        if self.damper is not None and self.damper_rows is not None:
            M, C, K, points = attach(M, C, K, points, self.damper, self.damper_rows)
            static = np.concatenate([static, self.damper.force])
        if fast_exits and points.tangents and not np.any(points.law.mu):
            points = replace(points, rows=np.ascontiguousarray(points.rows[:, :1]))
        dynamic = np.zeros((len(h.dynamic), len(static)), dtype=complex)
        for k, amplitude in force.items():
            dynamic[h.place(k), : len(amplitude)] = amplitude
        free = self.start == "frictionless"
        count, start = sample_count(h, self.samples), "zero" if free else self.start
        b = Balance(modal(M, C, K), points, h, count, static, dynamic, start, slider)
        return b.with_sliders("zero", b.frictionless_sliders) if free else b

    def _dense(self, what: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The matrices as arrays."""
        if isinstance(self.matrices, Mapping):
            raise InputError(
                f"{what}: matrices belong to nodal diameters; to fix it: give (M, C, K), or call "
                "travelling_wave_response"
            )
        for name, A in zip("MCK", self.matrices, strict=True):
            if hasattr(A, "toarray"):
                raise InputError(
                    f"{what}: {name} is sparse; to fix it: give {name}.toarray(), or large "
                    "matrices to upd.matrices.response.forced_response, which reduces them"
                )
        M, C, K = (np.asarray(A, dtype=float) for A in self.matrices)
        return M, C, K

    def _require(
        self, what: str, f: FloatArray, static: FloatArray, force: dict[int, ComplexArray], n: int
    ) -> None:
        """Refuse loads, rows and starts that do not fit n dofs; all problems are named."""
        columns, starts = self.contacts.rows.shape[2], get_args(Start)
        found = [
            (
                not (len(f) and np.isfinite(f).all() and (f > 0).all()),
                "frequencies must be finite and above 0",
            ),
            (static.shape != (n,), f"static_force has shape {static.shape}, give ({n},)"),
            *(
                (v.shape != (n,), f"harmonic_force {k} has shape {v.shape}, give ({n},)")
                for k, v in force.items()
            ),
            (
                any(k <= 0 for k in force),
                "harmonic_force belongs to harmonics above 0; the mean goes into static_force",
            ),
            *(
                (not np.isfinite(v).all(), f"loads at {name} are not finite")
                for name, v in [("static_force", static), *force.items()]
            ),
            (columns != n, f"contact rows have {columns} columns, the system {n} dofs"),
            (
                (self.damper is None) != (self.damper_rows is None),
                "damper and damper_rows come together",
            ),
            (
                self.start not in starts,
                f"start {self.start!r} is unknown; give one of {', '.join(starts)}",
            ),
            (not force, "harmonic_force is empty; give the amplitude of a harmonic"),
        ]
        if problems := [words for bad, words in found if bad]:
            raise InputError(f"{what}: " + "; ".join(problems))

    def _require_harmonics(
        self, what: str, h: Harmonics, static: FloatArray, force: dict[int, ComplexArray]
    ) -> None:
        """Refuse loads that no harmonic of the balance carries."""
        missing = sorted(set(force) - set(h.numbers))
        if missing:
            raise InputError(
                f"harmonics: the excitation acts in {', '.join(map(str, missing))}, not among "
                f"{h.numbers}; to fix it: harmonics = {tuple(sorted({*h.numbers, *missing}))}"
            )
        loads = ["static_force"] if np.any(static) else []
        if self.damper is not None and np.any(self.damper.force):
            loads.append("the damper's centrifugal force")
        if loads and not h.static:
            raise InputError(
                f"{what}: {' and '.join(loads)} would have no effect: harmonic 0 is not "
                f"among {h.numbers}; to fix it: harmonics = {(0, *h.numbers)}"
            )

    def _sliders(self, what: str) -> FloatArray | None:
        """Places (n_point, 2) of the sliders along both tangents, where they are given [mm]."""
        if self.slider is None:
            return None
        place, points = np.asarray(self.slider, dtype=float), self.contacts
        if place.shape != (points.n_point, points.tangents) or not np.all(np.isfinite(place)):
            raise InputError(
                f"{what}: slider has shape {place.shape}; to fix it: give a finite place "
                f"of every point along every tangent, ({points.n_point}, {points.tangents})"
            )
        out = np.zeros((points.n_point, 2))
        out[:, : points.tangents] = place
        return out


def frequency_response(
    system: System,
    *,
    harmonic_force: ArrayLike | Mapping[int, ArrayLike],
    frequencies: ArrayLike,
    sweep_down: bool = False,
    fast_exits: bool = True,
    settings: Settings | None = None,
) -> FrequencyResponse:
    """Forced response of M q'' + C q' + K q = f(t) - B'f_c by multi-harmonic balance.

    Parameters
    ----------
    system : System
        The matrices, what rubs between them, and the harmonics.
    harmonic_force : (n,) array_like of complex, or mapping
        Complex amplitude F of the first harmonic [N], f(t) = Re(F exp(i w t)); a mapping (harmonic
        number -> amplitude) gives several harmonics.
    frequencies : (n_f,) array_like
        Frequencies [Hz], answered at these and between.
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

    Examples
    --------
    A mass on a spring with a Jenkins element, without any other damping. With one
    harmonic the peak is (mu N/k_t) / (1 - pi F/(4 mu N)); it is lowest at mu N = pi F/2, where it
    is pi F/k_t:

    >>> import numpy as np
    >>> from upd.hbm import System, contacts, frequency_response
    >>> jenkins = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=1.0, mu=1.0, preload=np.pi / 2)
    >>> system = System(([[1.0]], [[0.0]], [[1.0]]), jenkins, harmonics=(1,), samples=1024)
    >>> f0 = np.sqrt(1.5) / (2 * np.pi)
    >>> f = np.array([0.9, 1.0, 1.1]) * f0
    >>> answer = frequency_response(system, harmonic_force=[1.0], frequencies=f)
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
    b = system.balance("frequency_response", f, force_of(harmonic_force), fast_exits=fast_exits)
    return response_of(b, f, sweep_down, fast_exits, settings)


def response_of(
    b: Balance, f: FloatArray, sweep_down: bool, fast_exits: bool, settings: Settings | None
) -> FrequencyResponse:
    """The response of a condensed problem.

    Parameters
    ----------
    b : Balance
    f : (k,) ndarray
        Frequencies [Hz], in any order.
    sweep_down, fast_exits, settings
        As in `frequency_response`.

    Returns
    -------
    FrequencyResponse
    """
    order = np.unique(f)[::-1] if sweep_down else np.unique(f)
    with threads_for(b.size):
        b, curve = solve_curve(b, order, fast_exits, settings)
        b.linear.kept.forget()
        return _answer(b, curve)


def _answer(b: Balance, curve: Curve) -> FrequencyResponse:
    """The answer with its status, and warnings about what the path leaves out."""
    found = measures(b, curve.p, curve.x)
    worst, astray = found.truncation.max(initial=0.0), int((~found.periodic).sum())
    status = "not periodic" if curve.status == "complete" and astray else curve.status
    notes = []
    if worst > TRUNCATION:
        h = b.harmonics
        omitted = [*(str(k) for k in range(h.highest) if k not in h.numbers), f"above {h.highest}"]
        notes.append(
            f"the omitted harmonics ({', '.join(omitted)}) would move the contacts by up to "
            f"{100.0 * worst:.3g} %: take more harmonics"
        )
    if astray:
        at = int(np.argmin(found.periodic))
        notes.append(
            f"at {astray} of {len(curve.p)} points, the first at {curve.p[at]:.6g} Hz, the "
            "contact forces do not come back to their start in 40 periods: they settle slowly, or "
            'never; start = "mid" or fewer tangents settle at once, '
            "`upd.hbm.springs.checks.creep` tells what is left"
        )
    if found.aliasing.max(initial=0.0) > ALIASING:
        notes.append(
            "twice the samples change the contact force by up to "
            f"{found.aliasing.max():.1%}: take more samples"
        )
    for note in notes:
        log.warning(note)
    return FrequencyResponse(
        **vars(found),
        balance=b,
        frequency=curve.p,
        x=curve.x,
        linear=curve.exact,
        status=cast(Status, status),
        message="; ".join([curve.message, *notes]),
    )


def force_of(given: ArrayLike | Mapping[int, ArrayLike]) -> dict[int, ComplexArray]:
    """Harmonic number -> amplitude, of the first harmonic where it is alone."""
    if isinstance(given, Mapping):
        return {int(k): np.asarray(v, dtype=complex) for k, v in given.items()}
    return {1: np.asarray(given, dtype=complex)}
