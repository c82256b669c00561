"""The balance of a linear system with contacts and loads, for any harmonics."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from upd.hbm.core.fourier import Harmonics, sample_count
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.damper import RigidDamper, attach
from upd.hbm.springs.friction import Start
from upd.hbm.springs.modal import modal
from upd.hbm.springs.points import Contacts, frictionless

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def assembled(
    M: FloatArray,
    C: FloatArray,
    K: FloatArray,
    contacts: Contacts,
    force: Mapping[int, ComplexArray],
    static: FloatArray,
    *,
    joined_to: tuple[RigidDamper, FloatArray] | None = None,
    samples: int | None = None,
    start: Start = "zero",
    slider: FloatArray | None = None,
    fast_exits: bool = True,
) -> Callable[[Harmonics], Balance]:
    """The condensed problem as a function of its harmonics.

    Parameters
    ----------
    M, C, K : (n, n) ndarray
        Mass [t], damping [N s/mm] and stiffness [N/mm].
    contacts : Contacts
    force : mapping
        Harmonic number -> (n,) complex amplitude [N].
    static : (n,) ndarray
        [N]
    joined_to : (RigidDamper, (n_point, 1 + d, n_dof of the damper) ndarray), optional
        A damper, whose dofs and centrifugal force are appended, and its share of the rows.
    samples : int, optional
        Samples per period; by rule when None.
    start, slider
        As `upd.hbm.springs.response.frequency_response` takes them, sliders (n_point, 2).
    fast_exits : bool
        Leave the tangents out where there is no friction.

    Returns
    -------
    callable
        Harmonics -> Balance.
    """
    if joined_to is not None:
        damper, rows = joined_to
        M, C, K, contacts = attach(M, C, K, contacts, damper, rows)
        static = np.concatenate([static, damper.force])
        force = {k: np.concatenate([v, np.zeros(damper.n_dof)]) for k, v in force.items()}
    if fast_exits and contacts.tangents and not np.any(contacts.law.mu):
        contacts = frictionless(contacts)
    system = modal(M, C, K)

    def problem(h: Harmonics) -> Balance:
        dynamic = np.zeros((len(h.dynamic), len(static)), dtype=complex)
        for k, amplitude in force.items():
            dynamic[h.place(k)] = amplitude
        count = sample_count(h, samples)
        return Balance(system, contacts, h, count, static, dynamic, start, slider)

    return problem
