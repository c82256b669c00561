"""Harmonic balance of a linear system with contacts, condensed to relative contact displacements.

    w_k = u_k - G_k f_k(w),   G_k = B D_k^-1 B',   D_k = K + i k W C - (k W)^2 M,

for every harmonic k > 0; u_k is the motion without contacts. Harmonic 0 has no compliance along
rigid modes R (a damper held only by its contacts): their amplitudes a stay unknowns beside w, and
R'(F_0 - B'f_0) = 0 is their equation. Unknowns: x = [w coefficients, a]. The size of the problem
is (1 + d) n_point (2 H + 1) + n_rigid, whatever the size of K.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import InputError
from upd.hbm.core.fourier import Harmonics, analysis, embed, synthesis, to_complex
from upd.hbm.springs.jacobian import BalanceJacobian, LinearPart, real_part
from upd.hbm.springs.modal import Modal
from upd.hbm.springs.points import (
    MOST_PERIODS,
    START_CODE,
    Contacts,
    March,
    Start,
    march,
    stuck_stiffness,
)
from upd.hbm.springs.terms import contact_terms

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
#: below every size, against division by none
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Balance:
    """The condensed problem: what it is made of, its unknowns, its residual, its linear answers.

    Attributes
    ----------
    modal : Modal
        The linear system.
    contacts : Contacts
        n_point points with d tangents.
    harmonics : Harmonics
        n_k harmonics above 0, `size` coefficients per signal.
    samples : int
        Samples per period.
    static : (n_dof,) ndarray
        Static loads [N].
    dynamic : (n_k, n_dof) ndarray of complex
        Amplitudes of the harmonics above 0 [N].
    start : {"zero", "static", "mid", "upper", "lower"}
        Position of the sliders before the march.
    slider : (n_point, 2) ndarray or None
        Slider positions [mm] where the start is given.
    Psi : (c, m) ndarray
        Rows of the contacts on the modes, c = (1 + d) n_point.
    E : (samples, size) ndarray
        Synthesis matrix.
    Q : (size, samples) ndarray
        Analysis matrix.
    transform : tuple of ndarray
        E, its transpose, Q and its transpose, as compiled loops take them.
    loads : (n_k, m) ndarray of complex
        Dynamic loads on the modes.
    G0 : (c, c) ndarray
        Static compliance of the flexible modes [mm/N].
    u0 : (c,) ndarray
        Displacement the static loads cause in the flexible modes, without contacts [mm].
    rigid_load : (n_rigid,) ndarray
        Static loads on the rigid modes.
    """

    modal: Modal
    contacts: Contacts
    harmonics: Harmonics
    samples: int
    static: FloatArray
    dynamic: ComplexArray
    start: Start = "zero"
    slider: FloatArray | None = None
    Psi: FloatArray = field(init=False)
    E: FloatArray = field(init=False)
    Q: FloatArray = field(init=False)
    transform: tuple[FloatArray, ...] = field(init=False)
    loads: ComplexArray = field(init=False)
    G0: FloatArray = field(init=False)
    u0: FloatArray = field(init=False)
    rigid_load: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        Phi, free = self.modal.Phi, ~self.modal.rigid
        Psi = np.ascontiguousarray(self.contacts.B @ Phi)
        E, Q = (of(self.harmonics, self.samples) for of in (synthesis, analysis))
        flexible = Psi[:, free] / self.modal.eigenvalues[free]
        values = {
            "Psi": Psi,
            "E": E,
            "Q": Q,
            "transform": (E, np.ascontiguousarray(E.T), Q, np.ascontiguousarray(Q.T)),
            "loads": self.dynamic @ Phi,
            "G0": flexible @ Psi[:, free].T,
            "u0": flexible @ (Phi[:, free].T @ self.static),
            "rigid_load": Phi[:, ~free].T @ self.static,
        }
        self.__dict__.update(values)

    def part(self, harmonic: int | None = None) -> tuple[Modal, FloatArray]:
        """The linear system in one harmonic above 0, and the rows Psi on its modes.

        Parameters
        ----------
        harmonic : int, optional
            Its number, kept or not; the lowest above 0 by default.
        """
        return self.modal, self.Psi

    def require_all_sectors(self, what: str) -> None:
        """Raise InputError where this is one sector of a travelling wave."""
        if not self.linear.symmetric:
            raise InputError(
                f"{what}: one sector of a travelling wave is not enough; to fix it: give the "
                "problem of all sectors, see upd.hbm.all_sectors"
            )

    def modal_row(self, row: ArrayLike, harmonic: int | None = None) -> FloatArray:
        """Row on the modes (m,) of a row (n_dof,) that weighs the displacements.

        Raises InputError for a row of another length.
        """
        given = np.asarray(row, dtype=float)
        if given.shape != (len(self.modal.Phi),):
            raise InputError(
                f"row has shape {given.shape}; to fix it: give one weight for every dof, "
                f"({len(self.modal.Phi)},), those of a damper last"
            )
        return np.asarray(given @ self.part(harmonic)[0].Phi)

    @cached_property
    def _layout(self) -> tuple[int, tuple[int, int, int]]:
        """Number and shape of the coefficients."""
        shape = (self.contacts.n_point, 1 + self.contacts.tangents, self.harmonics.size)
        return len(self.Psi) * self.harmonics.size, shape

    @property
    def rigid(self) -> int:
        """Static rigid unknowns beside the contact displacements (none without harmonic 0)."""
        return int(self.modal.rigid.sum()) if self.harmonics.static else 0

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self._layout[0] + self.rigid

    def split(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coefficients and rigid amplitudes of one answer.

        Parameters
        ----------
        x : (n_unknown,) ndarray
            Unknowns.

        Returns
        -------
        W : (n_point, 1 + d, size) ndarray
            Coefficients of the contact displacements [mm].
        a : (n_rigid,) ndarray
            Static amplitudes of the rigid modes.
        """
        n, shape = self._layout
        return x[:n].reshape(shape), x[n:]

    def coefficients(self, x: FloatArray) -> FloatArray:
        """Coefficients of the contact displacements of many answers.

        Parameters
        ----------
        x : (n, n_unknown) ndarray
            Unknowns.

        Returns
        -------
        (n, n_point, 1 + d, size) ndarray
            Coefficients [mm].
        """
        n, shape = self._layout
        return x[:, :n].reshape(len(x), *shape).copy()

    def embedded(self, x: FloatArray, old: Balance) -> FloatArray:
        """Unknowns of an answer with other harmonics, as an initial guess for this problem.

        Parameters
        ----------
        x : (old.size,) ndarray
            Unknowns of the other problem.
        old : Balance
            The other problem.

        Returns
        -------
        (n_unknown,) ndarray
        """
        W, a = old.split(x)
        return np.concatenate([embed(W, old.harmonics, self.harmonics).ravel(), a])

    def period(self, x: FloatArray) -> March:
        """One period of the contact forces of one answer.

        Parameters
        ----------
        x : (n_unknown,) ndarray
            Unknowns.

        Returns
        -------
        March
        """
        w = np.ascontiguousarray(self.split(x)[0] @ self.E.T)
        return march(self.contacts.law, w, self.E, start=self.start, slider=self.slider)

    def force(self, x: FloatArray) -> FloatArray:
        """Coefficients (n_point, 1 + d, size) of the contact forces of one answer [N]."""
        return self.period(x).coefficients(self.Q)

    def marched(self, W: FloatArray, E: FloatArray, most: int = MOST_PERIODS) -> March:
        """Contact forces of many motions in one march.

        Parameters
        ----------
        W : (n, n_point, 1 + d, size) ndarray
            Coefficients of the contact displacements [mm].
        E : (n_sample, size) ndarray
            Synthesis matrix of the samples.
        most : int
            Periods at most.

        Returns
        -------
        March
            With force (n, n_point, 1 + d, n_sample) [N] and state (n, n_point, n_sample).
        """
        n, n_point, rows, _ = W.shape
        slider = None if self.slider is None else np.tile(self.slider, (n, 1))
        w = np.ascontiguousarray(W @ E.T).reshape(n * n_point, rows, len(E))
        law = self.contacts.law.tiled(n)
        found = march(law, w, E, start=self.start, slider=slider, most=most)
        shape = (n, n_point)
        return replace(
            found,
            force=found.force.reshape(*shape, rows, len(E)),
            weighed=found.weighed.reshape(*shape, rows, len(E)),
            state=found.state.reshape(*shape, len(E)),
        )

    def linearised(
        self, x: FloatArray, omega: float, jacobian: bool = True
    ) -> tuple[FloatArray, BalanceJacobian | None, FloatArray]:
        """Residual w - u + G f(w) and the rigid equilibrium, with exact derivatives.

        Parameters
        ----------
        x : (n_unknown,) ndarray
            Unknowns.
        omega : float
            Angular frequency [rad/s].
        jacobian : bool
            Whether the derivatives are wanted.

        Returns
        -------
        residual : (n,) ndarray
            [mm], and [N] for the rigid equilibrium in modal coordinates.
        jacobian : BalanceJacobian or None
            None where it is not finite, too.
        by_frequency : (n,) ndarray
            Derivative by the angular frequency; zero unless asked for.
        """
        W, a = self.split(x)
        linear, c = self.linear, len(self.Psi)
        acting = self.loads, self.u0, self.rigid_load
        F, state, DF = self.contact_terms(x, jacobian)
        residual, by_frequency = linear.residual(
            W.reshape(c, -1), a, F.reshape(c, -1), omega, acting, jacobian
        )
        if not jacobian:
            return residual, None, by_frequency
        parts = BalanceJacobian(linear, linear.k * omega, state, self.stuck_stiffness, DF)
        return residual, parts if np.isfinite(DF).all() else None, by_frequency

    def contact_terms(
        self, x: FloatArray, jacobian: bool
    ) -> tuple[FloatArray, NDArray[np.int8], FloatArray]:
        """Contact forces of one answer, see `upd.hbm.springs.terms.contact_terms`."""
        slider = np.zeros((self.contacts.n_point, 2)) if self.slider is None else self.slider
        begin = (START_CODE[self.start], slider, MOST_PERIODS)
        W, law = self.split(x)[0], self.contacts.law.arrays
        return contact_terms(  # type: ignore[no-any-return]
            W, self.transform, self.harmonics.static, law, begin, jacobian
        )

    @cached_property
    def linear(self) -> LinearPart:
        """The linear system as the contacts see it."""
        # loads, preload and sliders may change in copies: none of them enters
        h = self.harmonics
        R = np.ascontiguousarray(self._rigid_rows[:, : self.rigid])
        return LinearPart(*self._each_harmonic, self.G0, R, h.dynamic.astype(float), h.offset)

    @property
    def _each_harmonic(self) -> tuple[Modal, FloatArray]:
        """The linear system and the rows on its modes, for all harmonics above 0."""
        return self.modal, self.Psi

    def amplitudes(self, F: FloatArray, omega: float) -> ComplexArray:
        """Amplitudes (n_k, m) of the modes under the loads and contact forces F (c, size) [N]."""
        pushed = self.loads - self.linear.pushes(to_complex(F, self.harmonics).T)
        w = np.asarray(self.harmonics.dynamic * omega, dtype=float)
        return self.linear.modal.solve(w, pushed)

    def misfit(self, x: FloatArray, omega: float) -> float:
        """Residual of the contact condition w - u + G f = 0 over its largest terms.

        Of the dynamic and of the static rows, each over the largest w, G f or u of its own;
        whichever is larger. Contact stiffness times compliance is large: an error of the motion by
        a share of its size leaves about this share of the terms as residual, and more of w.

        Parameters
        ----------
        x : (n_unknown,) ndarray
        omega : float
            Angular frequency [rad/s].

        Returns
        -------
        float
        """
        (W, a), o, c = self.split(x), self.harmonics.offset, len(self.Psi)
        F, w = self.force(x).reshape(c, -1), W.reshape(c, -1)
        residual = self.linearised(x, omega, False)[0]
        off = np.abs(residual[: W.size].reshape(c, -1))
        u = self.linear.moves(self.amplitudes(np.zeros_like(F), omega))
        G_f = u - self.linear.moves(self.amplitudes(F, omega))
        rows: list[tuple[FloatArray, tuple[Any, ...]]] = [(off[:, o:], (w[:, o:], G_f, u))]
        if self.harmonics.static:
            terms = (w[:, 0], self.G0 @ F[:, 0], self.u0, self._rigid_rows @ a)
            rows.append((off[:, :1], terms))
        return max(
            float(part.max(initial=0.0))
            / max(TINY, *(float(np.abs(term).max(initial=0.0)) for term in terms))
            for part, terms in rows
        )

    @property
    def _rigid_rows(self) -> FloatArray:
        return self.Psi[:, self.modal.rigid]

    @cached_property
    def stuck_stiffness(self) -> FloatArray:
        """Stiffness (n_point, 1 + d) of closed points that stick [N/mm]."""
        # loads, preload and sliders may change in copies: none of them enters
        return stuck_stiffness(self.contacts)

    def stuck(self, omega: float) -> FloatArray:
        """Unknowns of the linear answer with every point closed and sticking.

        The sliders stand where they are given, else at zero.

        Parameters
        ----------
        omega : float
            Angular frequency [rad/s].

        Returns
        -------
        (n_unknown,) ndarray
        """
        return self._linear(omega, self.stuck_stiffness.ravel(), *self._stuck_rest)

    @property
    def stuck_modal_stiffness(self) -> FloatArray:
        """Stiffness (m, m) of the modes with closed points that stick [1/s2]."""
        own = np.diag(np.where(self.modal.rigid, 0.0, self.modal.eigenvalues))
        return np.asarray(own + (self.Psi.T * self.stuck_stiffness.ravel()) @ self.Psi)

    @property
    def stuck_constant(self) -> FloatArray:
        """Force (n_point, 1 + d) of closed points that stick to given sliders, unmoved [N]."""
        law, out = self.contacts.law, np.zeros_like(self.stuck_stiffness)
        out[:, 0] = law.preload - law.k_n * law.gap
        if self.slider is not None and self.start in ("zero", "static"):
            out[:, 1:] = -self.stuck_stiffness[:, 1:] * self.slider[:, : self.contacts.tangents]
        return out

    @property
    def frictionless_sliders(self) -> FloatArray:
        """Slider positions (n_point, 2) at which closed points carry the static loads without
        traction [mm].
        """
        law, out = self.contacts.law, np.zeros((self.contacts.n_point, 2))
        k, constant = np.zeros_like(self.stuck_stiffness), np.zeros_like(self.stuck_stiffness)
        k[:, 0], constant[:, 0] = law.k_n, law.preload - law.k_n * law.gap
        mean = self._linear_rest(k.ravel(), constant.ravel())[0].reshape(k.shape)
        out[:, : self.contacts.tangents] = mean[:, 1:]
        return out

    def free(self, omega: float) -> FloatArray:
        """Unknowns of the linear answer without contacts, rigid amplitudes zero.

        Parameters
        ----------
        omega : float
            Angular frequency [rad/s].

        Returns
        -------
        (n_unknown,) ndarray
        """
        zero = np.zeros(len(self.Psi))
        return self._linear(omega, zero, *self._linear_rest(zero, zero))

    @cached_property
    def _stuck_rest(self) -> tuple[FloatArray, FloatArray]:
        return self._linear_rest(self.stuck_stiffness.ravel(), self.stuck_constant.ravel())

    def _linear_rest(self, k: FloatArray, constant: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean displacements (c,) and rigid amplitudes of a linear answer."""
        c, rows = len(self.Psi), self._rigid_rows
        if not self.harmonics.static or not (np.any(k) or not self.rigid):
            return np.zeros(c), np.zeros(self.rigid)
        A = np.block(
            [[np.eye(c) + self.G0 * k, -rows], [rows.T * k, np.zeros((self.rigid, self.rigid))]]
        )
        right = np.concatenate([self.u0 - self.G0 @ constant, self.rigid_load - rows.T @ constant])
        # an unloaded or unsupported damper has no unique place: the smallest one
        found = np.linalg.lstsq(A, right, rcond=None)[0]
        return found[:c], found[c:]

    def _linear(self, omega: float, k: FloatArray, mean: FloatArray, a: FloatArray) -> FloatArray:
        at = np.asarray(self.harmonics.dynamic * omega, dtype=float)
        try:
            w = _sprung(self.linear.modal, self.linear.Psi, at, self.loads, k)
        except np.linalg.LinAlgError:
            raise InputError(
                f"frequency_response: no damping at a resonance of the sticking contacts, "
                f"{omega / (2.0 * np.pi):.6g} Hz: the response has no bound; give damping, or "
                "leave this frequency out"
            ) from None
        return np.concatenate([real_part(w, mean, self.harmonics.offset).ravel(), a])

    def linear_displacement(
        self, omega: FloatArray, stuck: bool, harmonic: int | None = None
    ) -> ComplexArray:
        """One harmonic of all dofs, without contacts or with all points closed and sticking.

        Parameters
        ----------
        omega : (n,) ndarray
            Angular frequencies [rad/s].
        stuck : bool
            Whether the points stick.
        harmonic : int, optional
            Its number; the lowest above 0 by default.

        Returns
        -------
        (n, n_dof) ndarray of complex
            Displacement [mm].
        """
        k = self.stuck_stiffness.ravel() if stuck else np.zeros(len(self.Psi))
        j = self.harmonics.place(harmonic)
        load, (modal, Psi) = self.loads[j : j + 1], self.part(harmonic)
        out = np.empty((len(omega), len(modal.Phi)), dtype=complex)
        for i, w in enumerate(self.harmonics.dynamic[j] * omega):
            at = np.array([w])
            pushed = load - (k * _sprung(modal, Psi, at, load, k)) @ Psi.conj()
            out[i] = modal.solve(at, pushed)[0] @ modal.Phi.T
        return out

    def displacement(self, omega: FloatArray, force: FloatArray, rigid: FloatArray) -> FloatArray:
        """Displacement of all dofs from the contact forces.

        Parameters
        ----------
        omega : (n,) ndarray
            Angular frequencies [rad/s].
        force : (n, c, size) ndarray
            Coefficients of the contact forces [N], c = (1 + d) n_point.
        rigid : (n, n_rigid) ndarray
            Static rigid amplitudes.

        Returns
        -------
        (n, n_dof, size) ndarray
            Coefficients [mm].
        """
        o, Phi, free = self.harmonics.offset, self.modal.Phi, ~self.modal.rigid
        out = np.zeros((len(omega), len(Phi), self.harmonics.size))
        for j, k in enumerate(self.harmonics.dynamic):
            f = force[:, :, o + 2 * j] - 1j * force[:, :, o + 2 * j + 1]
            modal, Psi = self.part(int(k))
            q = modal.solve(k * omega, self.loads[j] - f @ Psi.conj()) @ modal.Phi.T
            out[:, :, o + 2 * j], out[:, :, o + 2 * j + 1] = q.real, -q.imag
        if self.harmonics.static:
            eta = np.zeros((len(omega), Phi.shape[1]))
            eta[:, free] = (self.static @ Phi - force[:, :, 0] @ self.Psi)[
                :, free
            ] / self.modal.eigenvalues[free]
            eta[:, ~free] = rigid
            out[:, :, 0] = eta @ Phi.T
        return out

    def unexcited(self) -> Balance:
        """The same problem under its static loads alone."""
        return self._changed(dynamic=0.0 * self.dynamic, loads=0.0 * self.loads)

    def with_sliders(self, start: Start, slider: FloatArray | None = None) -> Balance:
        """The same problem with another start of the sliders.

        Parameters
        ----------
        start : {"zero", "static", "mid", "upper", "lower"}
        slider : (n_point, 2) ndarray, optional
            Positions [mm] where the start is given.

        Returns
        -------
        Balance
        """
        return self._changed(start=start, slider=slider)

    def pressed(self, P: FloatArray) -> Balance:
        """The same problem with more preload and the static loads that balance it.

        Sticking motions stay solutions.

        Parameters
        ----------
        P : (n_point,) ndarray
            Extra preload [N].

        Returns
        -------
        Balance
        """
        law, shift = (
            self.contacts.law,
            np.zeros((self.contacts.n_point, 1 + self.contacts.tangents)),
        )
        shift[:, 0] = P
        f = shift.ravel()
        return self._changed(
            contacts=replace(self.contacts, law=replace(law, preload=law.preload + P)),
            u0=self.u0 + self.G0 @ f,
            rigid_load=self.rigid_load + self._rigid_rows.T @ f,
            static=self.static + self.contacts.B.T @ f,
        )

    def _changed(self, **values: object) -> Balance:
        """A copy with these fields, derived ones included.

        The matrices are kept, not made again.
        """
        out = copy(self)
        out.__dict__.pop("_stuck_rest", None)
        out.__dict__.update(values)
        return out


def _sprung(
    modal: Modal, Psi: FloatArray, w: FloatArray, loads: ComplexArray, k: FloatArray
) -> ComplexArray:
    """Motion (n, c) of rows on springs k (c,) at w (n,) rad/s under modal loads (n, m)."""
    G, u = modal.receptance(Psi, w, loads)
    return np.asarray(np.linalg.solve(np.eye(len(k)) + G * k, u[..., None])[..., 0])
