"""Modal damping that gives a wanted peak."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, minimize_scalar

from upd.dynamics.response import ModalSystem, frequency_response
from upd.errors import ConvergenceError, InputError
from upd.mesh import FloatArray

#: Damping ratios searched: from a bell to hardly a resonance.
_ZETA = (1e-7, 0.5)
#: Samples over the band, at least, from which the highest one is refined.
_GRID = 400


@dataclass(frozen=True)
class TunedDamping:
    """Damping that gives a wanted peak.

    Attributes
    ----------
    zeta : float
        Damping ratio.
    peak : float
        The peak it gives, in the unit of the quantity.
    frequency : float
        Its frequency [Hz].
    evaluations : int
        Number of peaks computed.
    message : str
        One sentence.
    """

    zeta: float
    peak: float
    frequency: float
    evaluations: int
    message: str


def peak_response(
    system: ModalSystem,
    force: ArrayLike,
    output: ArrayLike,
    band: tuple[float, float],
    quantity: str = "accelerance",
) -> tuple[float, float]:
    """Frequency and height of the highest response of one output in a band.

    Refined to the square root of eps.

    Parameters
    ----------
    system : ModalSystem
    force, output, quantity
        As in `frequency_response`; one output.
    band : tuple of two float
        Lowest and highest frequency [Hz].

    Returns
    -------
    frequency : float
        [Hz]
    height : float
        In the unit of the quantity.

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
        out: FloatArray = frequency_response(system, force, output, at, quantity).magnitude.max(
            axis=1
        )
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
    quantity: str = "accelerance",
    modes: ArrayLike | None = None,
) -> TunedDamping:
    """The damping ratio at which the highest response in a band has a given height.

    The peak of a lone mode is |phi_out phi_force| / (2 zeta) in accelerance; here the neighbours
    count too.

    Parameters
    ----------
    system : ModalSystem
        The system; its own damping ratios serve for the modes that are not tuned.
    force, output, quantity
        As in `frequency_response`; one output.
    target_peak : float
        Height wanted, in the unit of the quantity.
    band : tuple of two float
        Lowest and highest frequency [Hz].
    modes : (k,) array_like of int, optional
        Numbers of the modes whose ratio is tuned (all alike); None: all.

    Returns
    -------
    TunedDamping

    Raises
    ------
    InputError
        For a target that is not positive, or no mode.
    ConvergenceError
        When no ratio between 1e-7 and 0.5 gives the target; the message names the peaks at both
        ends.

    Examples
    --------
    A modal mass of 1 kg: 1 / (2 zeta) = 25 (m/s2)/N asks for 2 % of damping.

    >>> import numpy as np
    >>> from upd.dynamics import ModalSystem, tune_damping
    >>> mode = ModalSystem(np.array([100.0]), np.array([[1.0 / np.sqrt(1e-3)]]), np.array([0.01]))
    >>> tuned = tune_damping(mode, 0, 0, target_peak=25.0, band=(90.0, 110.0))
    >>> round(tuned.zeta, 4)
    0.02
    >>> round(tuned.frequency, 1)
    100.0
    """
    if not (np.isfinite(target_peak) and target_peak > 0.0):
        raise InputError(f"target_peak = {target_peak}: give a positive peak.")
    chosen = (
        np.arange(len(system.frequency))
        if modes is None
        else np.atleast_1d(np.asarray(modes, dtype=np.int64))
    )
    if not chosen.size or chosen.min() < 0 or chosen.max() >= len(system.frequency):
        raise InputError(
            f"Modes {chosen.tolist()} are tuned; the system has {len(system.frequency)}, "
            "numbered from 0."
        )
    count = 0

    def peak(zeta: float) -> tuple[float, float]:
        nonlocal count
        count += 1
        ratios = system.zeta.copy()
        ratios[chosen] = zeta
        return peak_response(replace(system, zeta=ratios), force, output, band, quantity)

    def excess(log_zeta: float) -> float:
        height = peak(float(np.exp(log_zeta)))[1]
        return float(np.log(height / target_peak)) if height > 0.0 else -np.inf

    ends = [excess(float(np.log(z))) for z in _ZETA]
    if not ends[0] >= 0.0 >= ends[1]:
        least, most = (target_peak * float(np.exp(e)) for e in (ends[1], ends[0]))
        raise ConvergenceError(
            f"No damping ratio between {_ZETA[0]:g} and {_ZETA[1]:g} gives a peak of "
            f"{target_peak:.4g} in {band[0]:g} to {band[1]:g} Hz: "
            f"they give {most:.4g} to {least:.4g}. Check force, output and band, or the target."
        )
    root = float(
        np.exp(
            brentq(excess, float(np.log(_ZETA[0])), float(np.log(_ZETA[1])), xtol=1e-12, rtol=1e-12)
        )
    )
    where, height = peak(root)
    message = (
        f"zeta = {root:.6g} gives {height:.6g} at {where:.6g} Hz; {target_peak:.6g} was asked."
    )
    return TunedDamping(root, height, where, count, message)
