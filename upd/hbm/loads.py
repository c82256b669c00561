"""Answers over the size of a load at one frequency: F_E or F_C grows, the frequency stays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import InputError
from upd.hbm.balance import Balance
from upd.hbm.continuation import follow
from upd.hbm.fourier import to_complex
from upd.hbm.newton import Settings
from upd.hbm.residuals import over_load, scale_of
from upd.hbm.starts import first_point

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class LoadCurve:
    """Solution path over a factor on the loads, n points.

    Folds make the factor turn back.

    Attributes
    ----------
    balance : Balance
        The problem with the factor 1.
    frequency : float
        [Hz]
    factor : (n,) ndarray
        Factors reached, in order of the path.
    x : (n, n_unknown) ndarray
        Unknowns.
    status : {"complete", "stopped", "step limit"}
    message : str
        Where and why the path ended.
    dynamic : bool
        Whether the factor is on the dynamic loads (F_E) or on the static ones (F_C).
    """

    balance: Balance
    frequency: float
    factor: FloatArray
    x: FloatArray
    status: str
    message: str
    dynamic: bool = True

    def amplitude(self, row: ArrayLike, harmonic: int | None = None) -> FloatArray:
        """Amplitude of one harmonic along the path.

        Parameters
        ----------
        row : (n_dof,) array_like
            Weighs the displacements: row @ q.
        harmonic : int, optional
            Number of the harmonic; the lowest above 0 by default.

        Returns
        -------
        (n,) ndarray
            Amplitude [mm].

        Raises
        ------
        InputError
            For a harmonic that is not kept, or a row of another length.
        """
        b = self.balance
        j, modal_row = b.harmonics.place(harmonic), b.modal_row(row)
        if not len(self.x):
            return np.zeros(0)
        F = (b.marched(b.coefficients(self.x), b.E).coefficients(b.Q)).reshape(
            len(self.x), len(b.Psi), -1
        )
        w = np.full(len(self.x), 2 * np.pi * b.harmonics.dynamic[j] * self.frequency)
        load = (self.factor if self.dynamic else np.ones(len(self.x)))[:, None] * b.loads[j]
        held = to_complex(F, b.harmonics)[..., j] @ b.Psi
        return np.abs(b.modal.solve(w, load - held) @ modal_row)


def load_curve(
    b: Balance,
    frequency: float,
    factors: ArrayLike,
    *,
    static: bool = False,
    settings: Settings | None = None,
) -> LoadCurve:
    """Answers at one frequency over the size of the loads.

    The path goes from the first factor to the last and hits those between; preloads of the contacts
    do not change with the factor.

    Parameters
    ----------
    b : Balance
        The problem with the factor 1.
    frequency : float
        [Hz]
    factors : (n,) array_like
        Two or more factors that rise, or fall.
    static : bool
        Put the factor on the static loads (F_C) instead of the dynamic ones (F_E).
    settings : Settings, optional
        Step control of the continuation.

    Returns
    -------
    LoadCurve

    Raises
    ------
    InputError
        For fewer than two factors, factors that do not rise or fall, or static loads without
        harmonic 0.
    """
    wanted = np.asarray(factors, dtype=float)
    steps = np.diff(wanted)
    if len(wanted) < 2 or not (np.all(steps > 0) or np.all(steps < 0)):
        raise InputError("load_curve: factors must be two or more numbers that rise, or fall")
    if static and not b.harmonics.static:
        raise InputError(
            f"load_curve: static loads act in harmonic 0, not among {b.harmonics.numbers}; "
            "to fix it: solve with 0 among harmonics"
        )
    first = b.with_loads(float(wanted[0]), 1.0) if static else b.with_loads(1.0, float(wanted[0]))
    start = first_point(first, frequency, settings=settings)
    if start is None:
        message = f"stopped: no solution at {frequency:.6g} Hz with the factor {wanted[0]:.4g}"
        return LoadCurve(
            b, frequency, np.zeros(0), np.zeros((0, b.size)), "stopped", message, not static
        )
    function, unit = over_load(b, frequency, static), float(np.abs(wanted).max())
    path = follow(
        function,
        (start, float(wanted[0])),
        float(wanted[-1]),
        scale=scale_of(b, b.stuck(2 * np.pi * frequency)),
        p_scale=unit,
        wanted=wanted,
        settings=settings,
    )
    return LoadCurve(b, frequency, path.p, path.x, path.status, path.message, not static)
