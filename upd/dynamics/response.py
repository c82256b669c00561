"""Frequency response functions: receptance, mobility, accelerance.

References
----------
D. J. Ewins, Modal Testing, ch. 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import ConvergenceError, InputError
from upd.fem.damping import checked_ratio
from upd.labels import Shown
from upd.linalg.common import checked_vectors
from upd.linalg.eigen_checks import Modes
from upd.mesh import FloatArray

ComplexArray = NDArray[np.complex128]

#: name -> power of i omega, factor to the unit, unit
QUANTITIES = {
    "receptance": (0, 1.0, "mm/N"),
    "mobility": (1, 1.0, "(mm/s)/N"),
    "accelerance": (2, 1e-3, "(m/s2)/N"),
}


class System(Protocol):
    """What answers a harmonic force: ModalSystem, or a user's own.

    Attributes
    ----------
    n : int
        Number of dofs.
    """

    @property
    def n(self) -> int: ...

    def receptance(self, force: FloatArray, rows: FloatArray, omega: FloatArray) -> ComplexArray:
        """Displacement of the outputs under a harmonic force.

        Parameters
        ----------
        force : (n,) ndarray
            Amplitude of the force [N].
        rows : (n_out, n) ndarray
            Rows that weigh the displacements.
        omega : (n_f,) ndarray
            Angular frequencies [rad/s].

        Returns
        -------
        (n_f, n_out) ndarray of complex
            Displacement [mm].
        """
        ...


@dataclass(frozen=True, repr=False)
class ModalSystem(Shown):
    """Superposition of modes with modal damping.

    Attributes
    ----------
    frequency : (m,) ndarray
        Natural frequencies [Hz].
    shapes : (n, m) ndarray
        Mass-normalised mode shapes [t^-1/2].
    zeta : (m,) ndarray
        Damping ratios; that of a rigid motion (0 Hz) has no effect.
    static : callable, optional
        K^-1 of the static problem as a function, f (n,) -> u (n,), for the modes left out; None:
        they are left out.
    """

    frequency: FloatArray
    shapes: FloatArray
    zeta: FloatArray
    static: Any = None

    @property
    def n(self) -> int:
        """Number of dofs."""
        return int(self.shapes.shape[0])

    def receptance(self, force: FloatArray, rows: FloatArray, omega: FloatArray) -> ComplexArray:
        """Displacement of the outputs under a harmonic force.

        The sum of phi_out phi_f / (omega_j^2 - omega^2 + 2 i zeta_j omega_j omega); the rest
        statically.

        Parameters
        ----------
        force : (n,) ndarray
            Amplitude of the force [N].
        rows : (n_out, n) ndarray
            Rows that weigh the displacements.
        omega : (n_f,) ndarray
            Angular frequencies [rad/s].

        Returns
        -------
        (n_f, n_out) ndarray of complex
            Displacement [mm].

        Raises
        ------
        ConvergenceError
            At an undamped natural frequency.

        References
        ----------
        D. J. Ewins, Modal Testing, 2.4; static correction: R. W. Clough and J. Penzien, Dynamics of
        Structures, ch. 13.
        """
        natural = 2.0 * np.pi * self.frequency
        share, out = self.shapes.T @ force, rows @ self.shapes
        below = (
            natural[None, :] ** 2 - omega[:, None] ** 2 + 2j * self.zeta * natural * omega[:, None]
        )
        if (below == 0.0).any():
            raise ConvergenceError(
                "The response is infinite at an undamped natural frequency: add damping or "
                "move the frequency."
            )
        H: ComplexArray = np.asarray((share / below) @ out.T, dtype=np.complex128)
        if self.static is not None:
            rest = self.static(force) - self.shapes @ (share / natural**2)
            H += rows @ rest
        return H


def modal_system(found: Modes, zeta: ArrayLike, *, static: Any = None) -> ModalSystem:
    """System of modes with damping ratios.

    Parameters
    ----------
    found : Modes
        What `upd.linalg.modes` found, m modes.
    zeta : float or (m,) array_like
        Damping ratios.
    static : callable, optional
        K^-1 f of a supported body, as `upd.linalg.factorise(K)` gives it.

    Returns
    -------
    ModalSystem

    Raises
    ------
    InputError
        For ratios that do not fit, or a static correction of a body that floats.
    """
    if static is not None and found.n_rigid:
        raise InputError("A body that floats has no static answer: leave `static` out.")
    return ModalSystem(
        found.frequency, found.shapes, checked_ratio(zeta, len(found.frequency)), static
    )


@dataclass(frozen=True, repr=False)
class LinearResponse(Shown):
    """Response per newton.

    Attributes
    ----------
    frequency : (n_f,) ndarray
        Frequencies [Hz].
    H : (n_f, n_out) ndarray of complex
        Response of the outputs, phase against the force.
    quantity : {"receptance", "mobility", "accelerance"}
        Receptance in mm/N, mobility in (mm/s)/N, accelerance in (m/s2)/N.
    unit : str
        The unit as text.
    """

    frequency: FloatArray
    H: ComplexArray
    quantity: str
    unit: str

    @property
    def magnitude(self) -> FloatArray:
        """Modulus (n_f, n_out)."""
        return np.abs(self.H)


def frequency_response(
    system: System,
    force: ArrayLike,
    outputs: ArrayLike,
    frequencies: ArrayLike,
    quantity: str = "accelerance",
) -> LinearResponse:
    """Linear response of a system to a harmonic force.

    Parameters
    ----------
    system : DirectSystem, ModalSystem or System
        The system of n dofs.
    force : int or (n,) array_like
        A dof number (unit force), or a force distribution; the response is per newton of the unit
        it is given in.
    outputs : int, (n_out,) array_like of int, or (n_out, n) array_like
        Dof numbers, or rows that weigh the displacements (a row of a reduced model's basis, a
        mean).
    frequencies : (n_f,) array_like
        Frequencies [Hz].
    quantity : {"accelerance", "mobility", "receptance"}

    Returns
    -------
    LinearResponse

    Raises
    ------
    InputError
        For numbers out of range or an unknown quantity.
    ConvergenceError
        At an undamped natural frequency.

    Examples
    --------
    At 0 Hz the receptance is the static compliance:

    >>> import numpy as np
    >>> from upd.dynamics import frequency_response, modal_system
    >>> from upd.linalg import modes
    >>> K = np.array([[3000.0, -1000.0], [-1000.0, 3000.0]])  # N/mm
    >>> system = modal_system(modes(K, 1e-3 * np.eye(2), count=2), 0.0)
    >>> response = frequency_response(system, 0, [0, 1], [0.0, 100.0], "receptance")
    >>> response.unit
    'mm/N'
    >>> (1e6 * response.magnitude).round(3).tolist()  # nm/N
    [[375.0, 125.0], [450.173, 172.797]]
    >>> (1e6 * np.linalg.inv(K)[0]).round(3).tolist()
    [375.0, 125.0]
    """
    f = np.atleast_1d(np.asarray(frequencies, dtype=np.float64))
    if f.ndim != 1 or not np.isfinite(f).all() or (f < 0.0).any():
        raise InputError("Frequencies are a list of finite numbers in Hz, none negative.")
    rows = _rows(outputs, system.n, "output")
    load = (
        _rows(force, system.n, "force")
        if np.ndim(force) == 0
        else checked_vectors(force, system.n, "force")
    )
    H = system.receptance(load.reshape(-1), rows, 2.0 * np.pi * f)
    return converted(LinearResponse(f, H, "receptance", "mm/N"), quantity)


def converted(response: LinearResponse, quantity: str) -> LinearResponse:
    """The same response as another quantity: times (i omega) to a power.

    Parameters
    ----------
    response : LinearResponse
    quantity : {"receptance", "mobility", "accelerance"}

    Returns
    -------
    LinearResponse

    Raises
    ------
    InputError
        For an unknown quantity, or a division by 0 Hz.
    """
    if quantity not in QUANTITIES:
        raise InputError(f"Unknown quantity {quantity!r}: use one of {', '.join(QUANTITIES)}.")
    (old, old_scale, _), (new, scale, unit) = QUANTITIES[response.quantity], QUANTITIES[quantity]
    if new < old and (response.frequency == 0.0).any():
        raise InputError(
            "At 0 Hz there is no way back to a lower derivative: leave 0 Hz out, or ask "
            "for the receptance first."
        )
    factor = (2j * np.pi * response.frequency) ** (new - old) * (scale / old_scale)
    return LinearResponse(response.frequency, response.H * factor[:, None], quantity, unit)


def _rows(dofs: Any, n: int, name: str) -> FloatArray:
    """(k, n) unit rows of dof numbers; rows given as such pass."""
    given = np.asarray(dofs)
    if given.ndim == 2:
        if given.shape[1] != n:
            raise InputError(
                f"The {name} rows are {given.shape}: the system has {n} dofs, give (k, {n})."
            )
        return given.astype(np.float64)
    numbers = np.atleast_1d(given)
    if numbers.ndim != 1 or not np.issubdtype(numbers.dtype, np.integer):
        raise InputError(
            f"The {name} is a dof number or several: got {given.dtype} of shape {given.shape}."
        )
    wrong = numbers[(numbers < 0) | (numbers >= n)]
    if wrong.size:
        raise InputError(f"The {name} names dof {wrong[0]}; the system has 0 to {n - 1}.")
    rows = np.zeros((len(numbers), n))
    rows[np.arange(len(numbers)), numbers] = 1.0
    return rows
