"""Contact forces and residual of a condensed problem of harmonic balance."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from upd.hbm.springs.condensed import BalanceJacobian
from upd.hbm.springs.friction import (
    MOST_PERIODS,
    START_CODE,
    Harmonic,
    March,
    harmonic_force,
    march,
)
from upd.hbm.springs.linearised import Rows, rows_of
from upd.hbm.springs.problem import ComplexArray, CondensedProblem, FloatArray
from upd.hbm.springs.terms import contact_terms, residual_terms

#: below every size, against division by none
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Evaluation:
    """Residual of the balance at one point.

    Attributes
    ----------
    residual : (n,) ndarray
        [mm], and [N] for the rigid equilibrium in modal coordinates.
    jacobian : (n, n) ndarray or None
        Derivative by the unknowns.
    by_frequency : (n,) ndarray
        Derivative by the angular frequency.
    contact : Harmonic
        The contact forces.
    """

    residual: FloatArray
    jacobian: FloatArray | None
    by_frequency: FloatArray
    contact: Harmonic


class _Fixed(NamedTuple):
    """What the compiled loops take beside the fields of the problem."""

    rows: Rows
    Et: FloatArray
    Qt: FloatArray
    k: FloatArray
    R: FloatArray
    stiffness: FloatArray
    unmoved: FloatArray


class Balance(CondensedProblem):
    """The condensed problem with its contact forces and its residual, made of the same fields."""

    def force(self, x: FloatArray, jacobian: bool = False) -> Harmonic:
        """Contact forces of one answer.

        Parameters
        ----------
        x : (n_unknown,) ndarray
            Unknowns.
        jacobian : bool
            Whether the derivative is wanted.

        Returns
        -------
        Harmonic
        """
        return harmonic_force(
            self.contacts.law,
            self.split(x)[0],
            self.E,
            self.Q,
            start=self.start,
            slider=self.slider,
            jacobian=jacobian,
        )

    def marched(self, W: FloatArray, E: FloatArray) -> March:
        """Contact forces of many motions in one march.

        Parameters
        ----------
        W : (n, n_point, 1 + d, size) ndarray
            Coefficients of the contact displacements [mm].
        E : (n_sample, size) ndarray
            Synthesis matrix of the samples.

        Returns
        -------
        March
            With force (n, n_point, 1 + d, n_sample) [N] and state (n, n_point, n_sample).
        """
        n, n_point, rows, _ = W.shape
        slider = None if self.slider is None else np.tile(self.slider, (n, 1))
        w = np.ascontiguousarray(W @ E.T).reshape(n * n_point, rows, len(E))
        found = march(
            self.contacts.law.tiled(n), w, E, start=self.start, slider=slider, jacobian=False
        )
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
        """What `evaluate` gives, compiled, with the Jacobian in parts.

        Parameters
        ----------
        x, omega, jacobian : (n_unknown,) ndarray, float, bool
            As for `evaluate`.

        Returns
        -------
        residual : (n,) ndarray
        jacobian : BalanceJacobian or None
        by_frequency : (n,) ndarray
            Derivative by the angular frequency; zero unless asked for.
        """
        W, a = self.split(x)
        law, static, fixed = self.contacts.law, self.harmonics.static, self._fixed
        slider = fixed.unmoved if self.slider is None else self.slider
        F, state, DF = contact_terms(
            W,
            self.E,
            fixed.Et,
            self.Q,
            fixed.Qt,
            static,
            law.k_n,
            law.k_t,
            law.mu,
            law.preload,
            law.gap,
            START_CODE[self.start],
            slider,
            MOST_PERIODS,
            jacobian,
        )
        c, size = len(self.Psi), len(self.Q)
        residual, by_frequency = residual_terms(
            W.reshape(c, size),
            a,
            F.reshape(c, size),
            fixed.k,
            omega,
            static,
            self.modal.eigenvalues,
            self.modal.rigid,
            fixed.rows.damping,
            self.loads,
            self.Psi,
            fixed.rows.transposed,
            self.u0,
            self.rigid_load,
            jacobian,
        )
        if not jacobian:
            return residual, None, by_frequency
        parts = BalanceJacobian(
            self.modal,
            fixed.rows,
            fixed.k * omega,
            self.harmonics.offset,
            self.G0,
            fixed.R,
            state,
            fixed.stiffness,
            DF,
        )
        return residual, parts, by_frequency

    def forget_factors(self) -> None:
        """Let the factors go that corrections keep for later ones: their memory."""
        if "_fixed" in self.__dict__:
            self._fixed.rows.kept.forget()

    @cached_property
    def _fixed(self) -> _Fixed:
        # loads, preload and sliders may change in copies: none of them enters
        rigid = self.Psi[:, self.modal.rigid] if self.harmonics.static else self.Psi[:, :0]
        return _Fixed(
            rows_of(self.Psi, self.modal),
            np.ascontiguousarray(self.E.T),
            np.ascontiguousarray(self.Q.T),
            self.harmonics.dynamic.astype(float),
            np.ascontiguousarray(rigid),
            self._stiffness,
            np.zeros((self.contacts.n_point, 2)),
        )

    def evaluate(self, x: FloatArray, omega: float, jacobian: bool = True) -> Evaluation:
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
        Evaluation
        """
        W, a = self.split(x)
        contact = self.force(x, jacobian)
        k = self.harmonics.dynamic
        G, u, dG, du = self.modal.receptance(
            self.Psi, np.asarray(k * omega, dtype=float), self.loads, slopes=jacobian
        )
        c, o = len(self.Psi), self.harmonics.offset
        F = contact.force.reshape(c, -1)
        F_k = F[:, o::2] - 1j * F[:, o + 1 :: 2]
        R, slope = W.reshape(c, -1).copy(), np.zeros((c, self.harmonics.size))
        r = np.einsum("kcd,dk->ck", G, F_k) - u.T
        R[:, o::2] += r.real
        R[:, o + 1 :: 2] -= r.imag
        if jacobian:
            s = (np.einsum("kcd,dk->ck", dG, F_k) - du.T) * k
            slope[:, o::2], slope[:, o + 1 :: 2] = s.real, -s.imag
        below = np.zeros(0)
        if self.harmonics.static:
            R[:, 0] += self.G0 @ F[:, 0] - self.u0 - self._rigid_rows @ a
            below = self._rigid_rows.T @ F[:, 0] - self.rigid_load
        residual = np.concatenate([R.ravel(), below])
        J = None if contact.jacobian is None else self._jacobian(G, contact.jacobian)
        return Evaluation(
            residual, J, np.concatenate([slope.ravel(), np.zeros(self.rigid)]), contact
        )

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
        found = self.evaluate(x, omega, jacobian=False)
        (W, a), k, o = self.split(x), self.harmonics.dynamic, self.harmonics.offset
        c = len(self.Psi)
        F, w = found.contact.force.reshape(c, -1), W.reshape(c, -1)
        off = np.abs(found.residual[: W.size].reshape(c, -1))
        G, u, _, _ = self.modal.receptance(
            self.Psi, np.asarray(k * omega, dtype=float), self.loads, slopes=False
        )
        G_f = np.einsum("kcd,dk->ck", G, F[:, o::2] - 1j * F[:, o + 1 :: 2])
        rows: list[tuple[FloatArray, tuple[Any, ...]]] = [(off[:, o:], (w[:, o:], G_f, u))]
        if self.harmonics.static:
            terms = (w[:, 0], self.G0 @ F[:, 0], self.u0, self._rigid_rows @ a)
            rows.append((off[:, :1], terms))
        return max(
            float(part.max(initial=0.0))
            / max(TINY, *(float(np.abs(term).max(initial=0.0)) for term in terms))
            for part, terms in rows
        )

    def _jacobian(self, G: ComplexArray, DF: FloatArray) -> FloatArray:
        n_point, d1, size = DF.shape[:3]
        c, o, L = n_point * d1, self.harmonics.offset, d1 * size
        D = DF.reshape(n_point, d1, size, L)
        J = np.zeros((self.size, self.size))
        top = np.zeros((c, size, n_point, L))
        # (point, harmonic, row, column of the point)
        g = G.reshape(len(G), c, n_point, d1).transpose(2, 0, 1, 3)
        cos, sin = D[:, :, o::2].transpose(0, 2, 1, 3), D[:, :, o + 1 :: 2].transpose(0, 2, 1, 3)
        top[:, o::2] = (g.real @ cos + g.imag @ sin).transpose(2, 1, 0, 3)
        top[:, o + 1 :: 2] = (g.real @ sin - g.imag @ cos).transpose(2, 1, 0, 3)
        m = c * size
        if self.harmonics.static:
            top[:, 0] = (self.G0.reshape(c, n_point, d1).transpose(1, 0, 2) @ D[:, :, 0]).transpose(
                1, 0, 2
            )
            R = self._rigid_rows
            J[:m:size, m:] = -R
            J[m:, :m] = np.einsum("pdr,pdL->rpL", R.reshape(n_point, d1, -1), D[:, :, 0]).reshape(
                -1, m
            )
        J[:m, :m] = top.reshape(m, m)
        J.flat[: m * (self.size + 1) : self.size + 1] += 1.0
        return J
