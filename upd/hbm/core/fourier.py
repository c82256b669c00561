"""Real Fourier coefficients of periodic signals: layout, synthesis, analysis, number of samples.

A signal with the harmonics (0, k1, k2, ...) is kept as the row [a0, a1, b1, a2, b2, ...] (no a0
when 0 is not in the set):

    x(theta) = a0 + sum_k a_k cos(k theta) + b_k sin(k theta),
    complex amplitude of harmonic k: X_k = a_k - i b_k.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from upd.errors import InputError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

#: Samples per period of the highest harmonic. The force of a slider has a kinked slope, so its
#: coefficients fall as 1/k^2 and what a rule with n samples folds back onto harmonic k comes from
#: n - k: 16 samples leave it below 1/200 of the highest kept coefficient.
SAMPLES_PER_WAVE = 16
#: The kinks of the first harmonic need this many samples, however few harmonics are kept.
LEAST_SAMPLES = 128


@dataclass(frozen=True)
class Harmonics:
    """A set of harmonics and its coefficient layout.

    Attributes
    ----------
    numbers : tuple of int
        Harmonic numbers, ascending.
    static : bool
        Whether harmonic 0 is in the set.
    dynamic : (n_k,) ndarray of int
        Harmonics above 0.
    offset : int
        Column of the first cosine coefficient: 1 with harmonic 0, else 0.
    size : int
        Real coefficients per signal.
    highest : int
        Highest harmonic number.
    """

    numbers: tuple[int, ...]
    static: bool = field(init=False, compare=False, repr=False)
    dynamic: NDArray[np.int64] = field(init=False, compare=False, repr=False)
    offset: int = field(init=False, compare=False, repr=False)
    size: int = field(init=False, compare=False, repr=False)
    highest: int = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        static = self.numbers[0] == 0
        dynamic, o = np.array(self.numbers[static:], dtype=np.int64), int(static)
        size, highest = o + 2 * len(dynamic), self.numbers[-1]
        self.__dict__.update(static=static, dynamic=dynamic, offset=o, size=size, highest=highest)

    def place(self, harmonic: int | None = None) -> int:
        """Place of a harmonic in `dynamic`.

        Parameters
        ----------
        harmonic : int, optional
            Number of the harmonic, above 0; the lowest that is kept by default, nearly always 1.

        Returns
        -------
        int

        Raises
        ------
        InputError
            When it is not kept.
        """
        if harmonic is None:
            return 0
        found = np.flatnonzero(self.dynamic == harmonic)
        if not len(found):
            raise InputError(
                f"harmonic {harmonic!r} is not among those kept above 0, "
                f"{', '.join(map(str, self.dynamic))}; to fix it: ask for one of these, or solve "
                "with it among harmonics"
            )
        return int(found[0])


def harmonics(numbers: Iterable[int]) -> Harmonics:
    """A set of harmonics.

    Parameters
    ----------
    numbers : iterable of int
        Whole numbers >= 0, in any order; repeats are dropped.

    Returns
    -------
    Harmonics

    Raises
    ------
    InputError
        When none is above 0, or when they are no whole numbers.
    """
    try:
        given = [(k, int(k)) for k in numbers]
    except (TypeError, ValueError):
        given = []
    else:
        given = [] if any(k != whole for k, whole in given) else given
    if not given:
        form = f"range({numbers + 1})" if isinstance(numbers, int) and numbers > 0 else "(0, 1, 3)"
        raise InputError(
            f"harmonics: {numbers!r} is no set of whole numbers; to fix it: list them, for example "
            f"{form}"
        )
    ordered = tuple(sorted({whole for _, whole in given}))
    if not ordered or ordered[0] < 0 or ordered[-1] < 1:
        raise InputError(
            f"harmonics: {ordered} needs whole numbers >= 0 and one above 0; (0, 1) is the "
            "usual start"
        )
    return Harmonics(ordered)


def sample_count(h: Harmonics, samples: int | None = None) -> int:
    """Samples per period.

    Parameters
    ----------
    h : Harmonics
    samples : int, optional
        Given number of samples; None takes the power of two >= max(128, 16 times the highest
        harmonic).

    Returns
    -------
    int

    Raises
    ------
    InputError
        At twice the highest harmonic or fewer (aliasing).
    """
    if samples is None:
        return int(2 ** np.ceil(np.log2(max(LEAST_SAMPLES, SAMPLES_PER_WAVE * h.highest))))
    if samples <= 2 * h.highest:
        raise InputError(
            f"samples: {samples} cannot carry harmonic {h.highest}; take more than {2 * h.highest}"
        )
    return int(samples)


def synthesis(h: Harmonics, samples: int) -> FloatArray:
    """Matrix from coefficients to samples: signal at theta_j = 2 pi j/samples = E @ coefficients.

    Parameters
    ----------
    h : Harmonics
    samples : int
        Samples per period.

    Returns
    -------
    (samples, h.size) ndarray
    """
    theta = 2 * np.pi * np.arange(samples) / samples
    E = np.ones((samples, h.size))
    for j, k in enumerate(h.dynamic):
        # whole turns are taken out before the sine: exact zeros and ones stay exact to rounding for
        # high harmonics
        angle = theta[(k * np.arange(samples)) % samples]
        E[:, h.offset + 2 * j], E[:, h.offset + 2 * j + 1] = np.cos(angle), np.sin(angle)
    return E


def analysis(h: Harmonics, samples: int) -> FloatArray:
    """Matrix from samples to coefficients: coefficients = Q @ signal.

    The inverse of `synthesis` on signals it can carry (samples > 2 highest).

    Parameters
    ----------
    h : Harmonics
    samples : int
        Samples per period.

    Returns
    -------
    (h.size, samples) ndarray
    """
    Q = synthesis(h, samples).T * (2 / samples)
    if h.static:
        Q[0] /= 2
    return Q


def to_complex(coefficients: FloatArray, h: Harmonics) -> ComplexArray:
    """Complex amplitudes a_k - i b_k of the harmonics above 0.

    Parameters
    ----------
    coefficients : (..., h.size) ndarray
        Real coefficients.
    h : Harmonics

    Returns
    -------
    (..., n_k) ndarray of complex
    """
    o = h.offset
    return np.asarray(coefficients[..., o::2] - 1j * coefficients[..., o + 1 :: 2])


def embed(coefficients: FloatArray, old: Harmonics, new: Harmonics) -> FloatArray:
    """The same signal on another set: missing harmonics are zero, surplus ones dropped.

    Parameters
    ----------
    coefficients : (..., old.size) ndarray
    old, new : Harmonics

    Returns
    -------
    (..., new.size) ndarray
    """
    out = np.zeros((*coefficients.shape[:-1], new.size))
    for k in set(old.numbers) & set(new.numbers):
        out[..., columns(new, k)] = coefficients[..., columns(old, k)]
    return out


def columns(h: Harmonics, k: int) -> list[int]:
    """Columns of harmonic k: one for k = 0, (cosine, sine) above."""
    if k == 0:
        return [0]
    first = h.offset + 2 * h.place(k)
    return [first, first + 1]
