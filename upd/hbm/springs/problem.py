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
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import InputError
from upd.hbm.core.fourier import Harmonics, analysis, embed, synthesis
from upd.hbm.springs.friction import Start
from upd.hbm.springs.modal import Modal
from upd.hbm.springs.points import Contacts, stuck_constant, stuck_stiffness

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class CondensedProblem:
    """The condensed problem: what it is made of, its unknowns, its linear answers.

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
    loads: ComplexArray = field(init=False)
    G0: FloatArray = field(init=False)
    u0: FloatArray = field(init=False)
    rigid_load: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        Phi, free = self.modal.Phi, ~self.modal.rigid
        Psi = np.ascontiguousarray(self.contacts.B @ Phi)
        flexible = Psi[:, free] / self.modal.eigenvalues[free]
        values = {
            "Psi": Psi,
            "E": synthesis(self.harmonics, self.samples),
            "Q": analysis(self.harmonics, self.samples),
            "loads": self.dynamic @ Phi,
            "G0": flexible @ Psi[:, free].T,
            "u0": flexible @ (Phi[:, free].T @ self.static),
            "rigid_load": Phi[:, ~free].T @ self.static,
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def modal_row(self, row: ArrayLike) -> FloatArray:
        """Row on the modes (m,) of a row (n_dof,) that weighs the displacements.

        Raises InputError for a row of another length.
        """
        given = np.asarray(row, dtype=float)
        if given.shape != (len(self.modal.Phi),):
            raise InputError(
                f"row has shape {given.shape}; to fix it: give one weight for every dof, "
                f"({len(self.modal.Phi)},), those of a damper last"
            )
        return np.asarray(given @ self.modal.Phi)

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
        return len(self.Psi) * self.harmonics.size + self.rigid

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
        n = len(self.Psi) * self.harmonics.size
        return (
            x[:, :n]
            .reshape(len(x), self.contacts.n_point, 1 + self.contacts.tangents, self.harmonics.size)
            .copy()
        )

    def rigid_part(self, x: FloatArray) -> FloatArray:
        """Static rigid amplitudes (n, n_rigid) of many answers (n, n_unknown)."""
        return x[:, len(self.Psi) * self.harmonics.size :]

    def embedded(self, x: FloatArray, old: CondensedProblem) -> FloatArray:
        """Unknowns of an answer with other harmonics, as an initial guess for this problem.

        Parameters
        ----------
        x : (old.size,) ndarray
            Unknowns of the other problem.
        old : CondensedProblem
            The other problem.

        Returns
        -------
        (n_unknown,) ndarray
        """
        W, a = old.split(x)
        return np.concatenate([embed(W, old.harmonics, self.harmonics).ravel(), a])

    @property
    def _rigid_rows(self) -> FloatArray:
        return self.Psi[:, self.modal.rigid]

    @cached_property
    def _stiffness(self) -> FloatArray:
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
        return self._linear(omega, self._stiffness.ravel(), *self._stuck_rest)

    @property
    def stuck_modal_stiffness(self) -> FloatArray:
        """Stiffness (m, m) of the modes with closed points that stick [1/s2]."""
        own = np.diag(np.where(self.modal.rigid, 0.0, self.modal.eigenvalues))
        return np.asarray(own + (self.Psi.T * self._stiffness.ravel()) @ self.Psi)

    @property
    def stuck_constant(self) -> FloatArray:
        """Force (n_point, 1 + d) of closed points that stick to given sliders, unmoved [N]."""
        given = self.slider if self.start in ("zero", "static") else None
        return stuck_constant(self.contacts, given)

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
        return self._linear_rest(self._stiffness.ravel(), self.stuck_constant.ravel())

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
        c, o = len(self.Psi), self.harmonics.offset
        G, u, _, _ = self.modal.receptance(
            self.Psi,
            np.asarray(self.harmonics.dynamic * omega, dtype=float),
            self.loads,
            slopes=False,
        )
        try:
            w = np.linalg.solve(np.eye(c) + G * k, u[..., None])[..., 0].T
        except np.linalg.LinAlgError:
            raise InputError(
                f"frequency_response: no damping at a resonance of the sticking contacts, "
                f"{omega / (2.0 * np.pi):.6g} Hz: the response has no bound; give damping, or "
                "leave this frequency out"
            ) from None
        X = np.zeros((c, self.harmonics.size))
        X[:, o::2], X[:, o + 1 :: 2] = w.real, -w.imag
        if self.harmonics.static:
            X[:, 0] = mean
        return np.concatenate([X.ravel(), a])

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
        k = stuck_stiffness(self.contacts).ravel() if stuck else np.zeros(len(self.Psi))
        j = self.harmonics.place(harmonic)
        load = self.loads[j : j + 1]
        out = np.empty((len(omega), len(self.modal.Phi)), dtype=complex)
        for i, w in enumerate(self.harmonics.dynamic[j] * omega):
            G, u, _, _ = self.modal.receptance(self.Psi, np.array([w]), load, slopes=False)
            motion = np.linalg.solve(np.eye(len(k)) + G[0] * k, u[0])
            out[i] = (
                self.modal.solve(np.array([w]), load - (k * motion) @ self.Psi)[0]
                @ self.modal.Phi.T
            )
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
            q = self.modal.solve(k * omega, self.loads[j] - f @ self.Psi) @ Phi.T
            out[:, :, o + 2 * j], out[:, :, o + 2 * j + 1] = q.real, -q.imag
        if self.harmonics.static:
            eta = np.zeros((len(omega), Phi.shape[1]))
            eta[:, free] = (self.static @ Phi - force[:, :, 0] @ self.Psi)[
                :, free
            ] / self.modal.eigenvalues[free]
            eta[:, ~free] = rigid
            out[:, :, 0] = eta @ Phi.T
        return out

    def with_loads(self, static: float, dynamic: float) -> Self:
        """The same problem with its loads multiplied.

        Parameters
        ----------
        static, dynamic : float
            Factors on the static and on the dynamic loads.

        Returns
        -------
        CondensedProblem
            Of the same kind.
        """
        return self._changed(
            static=static * self.static,
            u0=static * self.u0,
            rigid_load=static * self.rigid_load,
            dynamic=dynamic * self.dynamic,
            loads=dynamic * self.loads,
        )

    def shifted(self, xi: float) -> Self:
        """The same problem with xi off its modal damping, C - xi M.

        Parameters
        ----------
        xi : float
            [1/s]

        Returns
        -------
        CondensedProblem
            Of the same kind.
        """
        off = xi if self.modal.proportional else xi * np.eye(len(self.modal.eigenvalues))
        return self._changed(modal=replace(self.modal, damping=self.modal.damping - off))

    def with_sliders(self, start: Start, slider: FloatArray | None = None) -> Self:
        """The same problem with another start of the sliders.

        Parameters
        ----------
        start : {"zero", "static", "mid", "upper", "lower"}
        slider : (n_point, 2) ndarray, optional
            Positions [mm] where the start is given.

        Returns
        -------
        CondensedProblem
            Of the same kind.
        """
        return self._changed(start=start, slider=slider)

    def pressed(self, P: FloatArray) -> Self:
        """The same problem with more preload and the static loads that balance it.

        Sticking motions stay solutions.

        Parameters
        ----------
        P : (n_point,) ndarray
            Extra preload [N].

        Returns
        -------
        CondensedProblem
            Of the same kind.
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

    def _changed(self, **values: object) -> Self:
        """A copy with these fields, derived ones included.

        The matrices are kept, not made again.
        """
        out = copy(self)
        out.__dict__.pop("_stuck_rest", None)
        for name, value in values.items():
            object.__setattr__(out, name, value)
        return out
