"""How much a computed curve is like a measured one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

from upd.errors import InputError


def frac(measured: ArrayLike, computed: ArrayLike) -> float:
    r"""Frequency response assurance criterion of two complex responses at the same frequencies.

    FRAC = |sum_k conj(H_m) H_c|^2 / (sum_k |H_m|^2 sum_k |H_c|^2)

    1 where they differ by a factor only, which it does not see: compare heights beside it.

    Parameters
    ----------
    measured, computed : (n,) array_like of complex
        Any one unit each.

    Returns
    -------
    float
        0 to 1.

    Raises
    ------
    InputError
        For other shapes, or a response that is zero throughout.

    References
    ----------
    .. [1] W. Heylen, S. Lammens, FRAC: a consistent way of comparing frequency response
       functions, Proc. Int. Conf. Identification in Engineering Systems, Swansea (1996), 48-57.
    .. [2] W. Heylen, P. Avitabile, Correlation considerations - part 5 (degree of freedom
       correlation techniques), Proc. 16th Int. Modal Analysis Conf. (1998), 207-214.

    Examples
    --------
    >>> from upd.measured import frac
    >>> frac([1.0, 2j], [2.0, 4j])
    1.0
    >>> frac([1.0, 2j], [2.0, -4j])
    0.36
    """
    a, b = np.asarray(measured, complex), np.asarray(computed, complex)
    if a.ndim != 1 or a.shape != b.shape:
        raise InputError(
            f"FRAC takes two responses (n,) at the same frequencies; got {a.shape} and {b.shape}."
        )
    power = float(np.vdot(a, a).real) * float(np.vdot(b, b).real)
    if not power > 0.0:
        raise InputError("FRAC of a response that is zero throughout is not defined.")
    return float(abs(np.vdot(a, b)) ** 2 / power)


def magnitude_correlation(measured: ArrayLike, computed: ArrayLike) -> float:
    """The formula of `frac` on magnitudes alone, for curves without phase.

    It is no FRAC: phases that differ do not lower it, so it is the larger of the two, and closer to
    1 for unlike curves.

    Parameters
    ----------
    measured, computed : (n,) array_like
        Magnitudes or complex values.

    Returns
    -------
    float
        0 to 1.

    Raises
    ------
    InputError
        As `frac` does.

    References
    ----------
    C. Zang, H. Grafe, M. Imregun, Frequency-domain criteria for correlating and updating dynamic
    finite element models, Mech. Syst. Signal Process. 15 (2001), 139-155.
    """
    return frac(np.abs(np.asarray(measured)), np.abs(np.asarray(computed)))


def paired(measured: Sequence[float], computed: Sequence[float]) -> dict[int, int]:
    """Which of the measured peaks each computed one is: computed place -> measured place.

    One to one, with the least sum of |ln(f_c / f_m)|.

    Parameters
    ----------
    measured, computed
        Hz.
    """
    if not len(measured) or not len(computed):
        return {}
    m, c = np.asarray(measured, float), np.asarray(computed, float)
    rows, columns = linear_sum_assignment(np.abs(np.log(c[:, None] / m[None, :])))
    return {int(i): int(j) for i, j in zip(rows, columns, strict=True)}


def on_path(
    at: NDArray[np.float64], frequency: NDArray[np.float64], values: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """A path in frequency read at (k,) frequencies, by straight lines of real and imaginary part.

    Parameters
    ----------
    at
        (k,) Hz.
    frequency, values
        (n,) along the path, which may turn back.

    Returns
    -------
    (k,) ndarray
        NaN where the path has no value, or several.
    """
    low, high = frequency[:-1] <= at[:, None], frequency[1:] <= at[:, None]
    passed = low != high
    k = passed.argmax(axis=1)
    share = (at - frequency[k]) / np.where(passed.any(axis=1), np.diff(frequency)[k], 1.0)
    found = values[k] + share * (values[k + 1] - values[k])
    # a highest frequency is passed by none, or twice where the path turns
    last = at == frequency[-1]
    found = np.where(last & ~passed.any(axis=1), values[-1], found)
    one = (passed.sum(axis=1) == 1) | (last & (passed.sum(axis=1) == 0))
    return np.asarray(np.where(one, found, np.nan))


def within(measured: NDArray[np.float64], low: float, high: float) -> NDArray[np.bool_]:
    """Which of the measured frequencies lie in the computed band.

    Parameters
    ----------
    measured
        (n,) Hz.
    low, high
        Of the computed band, Hz.
    """
    return np.asarray((measured >= low) & (measured <= high))
