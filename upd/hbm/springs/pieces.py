"""Points of a curve that were solved with one set of harmonics, and what is measured on them."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from upd.hbm.core.fourier import embed
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.checks import aliasing, portions, truncation
from upd.hbm.springs.coulomb import LIFT, SLIP, STICK

FloatArray = NDArray[np.float64]
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Piece:
    """n points in order of the path.

    Attributes
    ----------
    balance : Balance
        The condensed problem.
    frequency : (n,) ndarray
        [Hz]
    x : (n, n_unknown) ndarray
        Unknowns.
    linear : (n,) ndarray of bool
        Answered by an exact linear solution.
    displacement, force : (n, n_point, 1 + d, size) ndarray
        Coefficients of the relative displacements [mm] and of the contact forces [N].
    state : (n, n_point, 3) ndarray
        Shares of the cycle in stick, slip, lift-off.
    energy : (n, n_point) ndarray
        Energy lost per cycle [N mm].
    periodic : (n,) ndarray of bool
        Whether the contact forces of every point came back to their start.
    truncation, aliasing : (n,) ndarray
        What harmonics left out and twice the samples would change, relative.
    """

    balance: Balance
    frequency: FloatArray
    x: FloatArray
    linear: NDArray[np.bool_]
    displacement: FloatArray
    force: FloatArray
    state: FloatArray
    energy: FloatArray
    periodic: NDArray[np.bool_]
    truncation: FloatArray
    aliasing: FloatArray

    def points(self, which: slice) -> Piece:
        """Some of the points."""
        chosen = {f.name: getattr(self, f.name)[which] for f in fields(self) if f.name != "balance"}
        return replace(self, **chosen)

    def embedded(self, b: Balance) -> Piece:
        """The same points on the layout of a problem with more harmonics, which they leave zero."""
        if b is self.balance:
            return self
        x = np.array([b.embedded(one, self.balance) for one in self.x]).reshape(len(self.x), b.size)
        force = embed(self.force, self.balance.harmonics, b.harmonics)
        return replace(self, balance=b, x=x, displacement=b.coefficients(x), force=force)


def piece_of(b: Balance, f: FloatArray, x: FloatArray, linear: NDArray[np.bool_]) -> Piece:
    """Solved points with what is measured on them.

    Parameters
    ----------
    b : Balance
    f : (n,) ndarray
        Frequencies [Hz].
    x : (n, n_unknown) ndarray
        Answers.
    linear : (n,) ndarray of bool
        Which of them are exact linear solutions.

    Returns
    -------
    Piece
    """
    n_point = b.contacts.n_point
    W = b.coefficients(x)
    F, state = np.empty_like(W), np.empty((len(f), n_point, 3))
    periodic, left_out = np.empty(len(f), dtype=bool), np.empty(len(f))
    for part in portions(len(x)):
        found = b.marched(W[part], b.E)
        F[part] = found.coefficients(b.Q)
        periodic[part] = found.periodic.reshape(-1, n_point).all(axis=1)
        left_out[part] = truncation(b, f[part], x[part], found)
        for code in (STICK, SLIP, LIFT):
            state[part, :, code] = (found.state == code).mean(axis=-1)
    o, k = b.harmonics.offset, b.harmonics.dynamic
    energy = loop_area(F, W, o, k, b.samples)
    return Piece(b, f, x, linear, W, F, state, energy, periodic, left_out, aliasing(b, x, F))


def loop_area(
    F: FloatArray, W: FloatArray, offset: int, k: NDArray[np.int64], samples: int
) -> FloatArray:
    """Area of the loops of force over displacement, harmonic by harmonic,
    pi sum k (a_F b_W - b_F a_W); zero where it is rounding.

    A loop without area is a difference of equal products. Each coefficient of the force is a sum
    over the samples of a force no larger than sum |F|, so that the terms of the area add up to no
    more than pi sum k |F| |W|; their rounding is that times eps times the number of samples.

    Parameters
    ----------
    F, W : (n, n_point, 1 + d, size) ndarray
        Coefficients of the forces [N] and of the relative displacements [mm].
    offset : int
        Coefficients before those of the first of the harmonics `k`.
    k : (h,) ndarray
        Numbers of the harmonics above 0.
    samples : int
        Of a period, from which F was summed.

    Returns
    -------
    (n, n_point) ndarray
        [N mm]

    References
    ----------
    N. J. Higham, Accuracy and Stability of Numerical Algorithms (2002), ch. 3: errors of sums.
    """
    a, b = W[..., offset::2], W[..., offset + 1 :: 2]
    area = np.einsum("k,npck->np", k, F[..., offset::2] * b - F[..., offset + 1 :: 2] * a)
    terms = np.einsum("npc,k,npck->np", np.abs(F).sum(axis=-1), k, np.abs(a) + np.abs(b))
    return np.pi * np.where(np.abs(area) > samples * EPS * terms, area, 0.0)


def joined(pieces: list[Piece]) -> tuple[Piece, NDArray[np.int64]]:
    """All points as one piece on the layout of the most harmonics.

    Parameters
    ----------
    pieces : list of Piece
        In order of the path, one or more.

    Returns
    -------
    whole : Piece
    highest : (n,) ndarray of int
        Highest harmonic each point was solved with.
    """
    top = max((part.balance for part in pieces), key=lambda b: b.harmonics.highest)
    on_top = [part.embedded(top) for part in pieces]
    values = {
        f.name: np.concatenate([getattr(part, f.name) for part in on_top])
        for f in fields(Piece)
        if f.name != "balance"
    }
    highest = [
        np.full(len(part.frequency), part.balance.harmonics.highest, dtype=np.int64)
        for part in pieces
    ]
    return Piece(balance=top, **values), np.concatenate(highest)
