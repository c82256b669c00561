"""Derivatives of the linear answers of a forced response: free, and with every point stuck.

Of q = D^-1 F, D = K + i w C - w^2 M, with the adjoint z = D^-1 r of the output r'q

    d(r'q)/dp = z' (dF/dp - dD/dp q),

and of its peak as `upd.hbm.peaks.sensitivity` has it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.model import Array, ComplexArray, Model
from upd.hbm.peaks.parameter_change import ParameterChange
from upd.hbm.peaks.sensitivity import PeakDerivative
from upd.scene.forced_contact import Side

#: half of the difference over the frequency, as a share of it
STEP = 1e-5


@dataclass(frozen=True)
class LinearSystem:
    """Mass, damping, stiffness (n, n) of blades and damper, and rows and stiffness of its stuck
    points.
    """

    M: Array
    C: Array
    K: Array
    B: Array
    stuck: bool

    def changed(self, change: ParameterChange, tangents: int) -> tuple[Array, Array, Array]:
        """Derivatives of M, C and K by a parameter."""
        none = np.zeros_like(self.M)
        M, C, K = (none if value is None else value for value in (change.M, change.C, change.K))
        if self.stuck:
            n_point = len(self.B) // (1 + tangents)
            k = np.zeros((n_point, 1 + tangents))
            if change.k_n is not None:
                k[:, 0] = change.k_n
            if change.k_t is not None:
                k[:, 1:] = change.k_t[:, None]
            K = K + self.B.T @ (k.ravel()[:, None] * self.B)
        return M, C, K


def linear_system(model: Model, stuck: bool) -> LinearSystem:
    """Blades and damper without contacts, or with every point closed and sticking."""
    return LinearSystem(*model.linear(stuck), stuck)


def linear_peak(
    system: LinearSystem,
    force: ComplexArray,
    row: Array,
    frequency: float,
    harmonic: int,
    changes: Sequence[tuple[Array, Array, Array]],
) -> PeakDerivative:
    """Derivatives of a peak of w^2 |row @ q| by parameters.

    Parameters
    ----------
    force
        (n,) amplitude.
    row
        (n,) output.
    frequency
        Hz, of the peak; of the sweep, the harmonic being answered.
    harmonic
        Its number.
    changes
        Derivatives of M, C and K by every parameter.
    """
    low, here, high = (
        _slopes(system, force, row, 2.0 * np.pi * harmonic * f, changes)
        for f in frequency * np.array([1.0 - STEP, 1.0, 1.0 + STEP])
    )
    fall = low[1] - high[1]
    more = high[2] - low[2]
    by_frequency = more / fall / (2.0 * np.pi * harmonic)
    return PeakDerivative(frequency, here[0], low[2] + low[1] / fall * more, by_frequency)


def stuck_frequencies(
    model: Model, below: float, changes: Sequence[ParameterChange]
) -> dict[str, tuple[float, Array]]:
    """The lowest stuck modes along x, in and out of phase, by Rayleigh's quotient

        df/f = phi' (dK - w^2 dM) phi / (2 w^2),   phi' M phi = 1.

    Parameters
    ----------
    below
        Hz; modes above are left out.
    changes
        Of the whole model by every parameter.

    Returns
    -------
    dict
        Name of the number -> Hz, and relative changes (n,).

    References
    ----------
    R. L. Fox, M. P. Kapoor, AIAA J. 6 (1968) 2426.
    """
    _, values, shapes = measures.stuck_shapes(model)
    modes = measures.tell_modes(model, values, shapes, below)
    system = linear_system(model, stuck=True)
    made = [system.changed(one, model.contacts.tangents) for one in changes]
    out = {}
    for in_phase, number in ((True, "stuck_in_phase"), (False, "stuck_out_of_phase")):
        which = [j for j, m in enumerate(modes) if m.axis == "x" and m.in_phase == in_phase]
        for j in which[:1]:
            phi, value = shapes[:, j], values[j]
            change = [phi @ (K - value * M) @ phi / (2.0 * value) for M, _, K in made]
            out[number] = (modes[j].frequency, np.array(change))
    return out


def limit_peak(
    model: Model, side: Side, stuck: bool, frequency: float, changes: Sequence[ParameterChange]
) -> PeakDerivative:
    """Derivatives of a peak of a blade's free or stuck accelerance.

    Parameters
    ----------
    frequency
        Hz, of the peak.
    changes
        Of the whole model by every parameter.
    """
    system = linear_system(model, stuck)
    made = [system.changed(one, model.contacts.tangents) for one in changes]
    force = np.concatenate([model.force, np.zeros(model.damper.n_dof)])
    k = model.excitation.lowest
    return linear_peak(system, force, model.row(side), frequency, k, made)


def _slopes(
    system: LinearSystem,
    force: ComplexArray,
    row: Array,
    w: float,
    changes: Sequence[tuple[Array, Array, Array]],
) -> tuple[float, float, Array]:
    """w^2 |row @ q|, its derivative by w, and those by the parameters."""
    D = system.K + 1j * w * system.C - w**2 * system.M
    q, z = np.linalg.solve(D, np.column_stack([force, row])).T
    moved = complex(row @ q)
    size = abs(moved)

    def by(dq: complex) -> float:
        return float(w**2 * (moved.conjugate() * dq).real / size)

    by_w = by(-complex(z @ ((1j * system.C - 2.0 * w * system.M) @ q))) + 2.0 * w * size
    each = [-complex(z @ ((K + 1j * w * C - w**2 * M) @ q)) for M, C, K in changes]
    return w**2 * size, by_w, np.array([by(dq) for dq in each])
