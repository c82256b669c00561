"""Frequency response functions: receptance, mobility, accelerance; damping for a wanted peak.

References
----------
D. J. Ewins, Modal Testing, ch. 2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq, minimize_scalar

from upd.errors import ConvergenceError, InputError
from upd.fem.assembly import checked_ratio
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
    system: ModalSystem,
    force: ArrayLike,
    outputs: ArrayLike,
    frequencies: ArrayLike,
    quantity: str = "accelerance",
) -> LinearResponse:
    """Linear response of a system to a harmonic force.

    Parameters
    ----------
    system : ModalSystem
        The system of n dofs, or what has its ``n`` and ``receptance``.
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
    if quantity not in QUANTITIES:
        raise InputError(f"Unknown quantity {quantity!r}: use one of {', '.join(QUANTITIES)}.")
    f = np.atleast_1d(np.asarray(frequencies, dtype=np.float64))
    if f.ndim != 1 or not np.isfinite(f).all() or (f < 0.0).any():
        raise InputError("Frequencies are a list of finite numbers in Hz, none negative.")
    rows = _rows(outputs, system.n, "output")
    load = (
        _rows(force, system.n, "force")
        if np.ndim(force) == 0
        else checked_vectors(force, system.n, "force")
    )
    power, scale, unit = QUANTITIES[quantity]
    H = system.receptance(load.reshape(-1), rows, 2.0 * np.pi * f)
    # times (i omega) to a power
    factor = (2j * np.pi * f) ** power * scale
    return LinearResponse(f, H * factor[:, None], quantity, unit)


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


# -- damping that gives a wanted peak --------------------------------------------------------------


#: Damping ratios searched: from a bell to hardly a resonance.
_ZETA = (1e-7, 0.5)
#: Samples over the band, at least, from which the highest one is refined.
_GRID = 400


def peak_response(
    system: ModalSystem,
    force: ArrayLike,
    output: ArrayLike,
    band: tuple[float, float],
) -> tuple[float, float]:
    """Frequency and height of the highest response of one output in a band.

    Refined to the square root of eps.

    Parameters
    ----------
    system : ModalSystem
    force, output
        As in `frequency_response`; one output.
    band : tuple of two float
        Lowest and highest frequency [Hz].

    Returns
    -------
    frequency : float
        [Hz]
    height : float
        (m/s2)/N.

    Raises
    ------
    InputError
        For a band that is none, and as `frequency_response` does.
    """
    low, high = band
    if not 0.0 <= low < high:
        raise InputError(f"The band {band} is none: give two rising frequencies in Hz.")
    output = np.atleast_1d(np.asarray(output)) if np.ndim(output) < 2 else output
    inside = (system.frequency >= low) & (system.frequency <= high)
    # Each resonance with samples over its own width, however sharp.
    offsets = np.array([-4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0])
    near = system.frequency[inside, None] * (1.0 + system.zeta[inside, None] * offsets)
    f = np.unique(np.clip(np.concatenate([np.linspace(low, high, _GRID), near.ravel()]), low, high))

    def height(at: ArrayLike) -> FloatArray:
        out: FloatArray = frequency_response(system, force, output, at).magnitude.max(axis=1)
        return out

    sampled = height(f)
    k = int(sampled.argmax())
    bounds = (float(f[max(k - 1, 0)]), float(f[min(k + 1, len(f) - 1)]))
    found = minimize_scalar(
        lambda x: -float(height(x)[0]),
        bounds=bounds,
        method="bounded",
        options={"xatol": 1e-9 * bounds[1]},
    )
    best = float(height(found.x)[0])
    return (float(found.x), best) if best >= sampled[k] else (float(f[k]), float(sampled[k]))


def tune_damping(
    system: ModalSystem,
    force: ArrayLike,
    output: ArrayLike,
    target_peak: float,
    *,
    band: tuple[float, float],
) -> float:
    """The damping ratio at which the highest response in a band has a given height.

    The peak of a lone mode is |phi_out phi_force| / (2 zeta) in accelerance; here the neighbours
    count too.

    Parameters
    ----------
    system : ModalSystem
        The system; the ratio is that of all its modes.
    force, output
        As in `frequency_response`; one output.
    target_peak : float
        Height wanted, (m/s2)/N.
    band : tuple of two float
        Lowest and highest frequency [Hz].

    Returns
    -------
    float

    Raises
    ------
    InputError
        For a target that is not positive.
    ConvergenceError
        When no ratio between 1e-7 and 0.5 gives the target; the message names the peaks at both
        ends.

    Examples
    --------
    A modal mass of 1 kg: 1 / (2 zeta) = 25 (m/s2)/N asks for 2 % of damping.

    >>> import numpy as np
    >>> from upd.dynamics import ModalSystem, tune_damping
    >>> mode = ModalSystem(np.array([100.0]), np.array([[1.0 / np.sqrt(1e-3)]]), np.array([0.01]))
    >>> round(tune_damping(mode, 0, 0, target_peak=25.0, band=(90.0, 110.0)), 4)
    0.02
    """
    if not (np.isfinite(target_peak) and target_peak > 0.0):
        raise InputError(f"target_peak = {target_peak}: give a positive peak.")

    def excess(log_zeta: float) -> float:
        tried = replace(system, zeta=np.full_like(system.zeta, np.exp(log_zeta)))
        _, height = peak_response(tried, force, output, band)
        return float(np.log(height / target_peak)) if height > 0.0 else -np.inf

    ends = [excess(float(np.log(z))) for z in _ZETA]
    if not ends[0] >= 0.0 >= ends[1]:
        least, most = (target_peak * float(np.exp(e)) for e in (ends[1], ends[0]))
        raise ConvergenceError(
            f"No damping ratio between {_ZETA[0]:g} and {_ZETA[1]:g} gives a peak of "
            f"{target_peak:.4g} in {band[0]:g} to {band[1]:g} Hz: "
            f"they give {most:.4g} to {least:.4g}. Check force, output and band, or the target."
        )
    low, high = (float(np.log(zeta)) for zeta in _ZETA)
    return float(np.exp(brentq(excess, low, high, xtol=1e-12, rtol=1e-12)))
