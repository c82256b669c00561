"""What the contact solvers ask of their input; all problems are reported at once."""

from __future__ import annotations

from collections.abc import Sized
from contextlib import AbstractContextManager

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import lapack

from upd.errors import InputError
from upd.linalg.parallel import threads_for

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
EPS = float(np.finfo(float).eps)
# Below this many unknowns the threads of a factorisation wait for each other longer than they work:
# on two busy cores 300 load steps of 185 nodes took 3.5 s with two threads and 0.1 s with one.
SMALL = 2000


def few_threads(rows: object) -> AbstractContextManager[object]:
    """Context in which BLAS uses one thread when there are too few `rows` to share out."""
    return threads_for(len(rows) if isinstance(rows, Sized) else 0, SMALL)


class Problems:
    """Collects what is wrong with an input, so that one InputError names all of it.

    Attributes
    ----------
    where : str
        Name of the analysis, put before the messages.
    found : list of str
        Messages noted so far.
    """

    def __init__(self, where: str) -> None:
        self.where = where
        self.found: list[str] = []

    def add(self, condition: bool, message: str) -> bool:
        """Note `message` when `condition` holds; returns the condition."""
        if condition:
            self.found.append(message)
        return condition

    def raise_any(self) -> None:
        """Raise an InputError with every message noted so far; nothing happens without one."""
        if self.found:
            raise InputError(f"{self.where}: " + " | ".join(self.found))


def numbers(
    problems: Problems, name: str, values: ArrayLike, *shapes: tuple[int | str, ...]
) -> FloatArray | None:
    """Float copy of an array, if it holds finite numbers and has one of the shapes.

    Parameters
    ----------
    problems : Problems
        Receives the message when `values` holds anything else than finite numbers.
    name : str
        Name of the array in the message.
    values : array_like
    shapes : tuple of int or str
        Allowed shapes; a name stands for any number from 1 on. None given: any shape.

    Returns
    -------
    ndarray or None
        Float copy of `values`; None when a problem was noted.
    """
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        problems.add(True, f"{name} is not an array of numbers: give floats.")
        return None
    bad = int(np.count_nonzero(~np.isfinite(array)))
    if problems.add(
        bad > 0,
        f"{name} holds {bad} values that are NaN or infinite: correct the step that made them.",
    ):
        return None
    wanted = " or ".join(str(shape).replace("'", "") for shape in shapes)
    fits = not shapes or any(
        len(shape) == array.ndim
        and all(
            have == n or (have > 0 and isinstance(n, str))
            for n, have in zip(shape, array.shape, strict=False)
        )
        for shape in shapes
    )
    if problems.add(not fits, f"{name} has shape {array.shape}: it must be {wanted}."):
        return None
    return array


def one_of(
    problems: Problems, *shapes: tuple[int | str, ...], **given: ArrayLike | None
) -> tuple[str, FloatArray] | None:
    """Name and numbers of the one argument of two that is not None.

    Parameters
    ----------
    problems : Problems
        Receives the message when both or none are given, or what is given is no numbers.
    shapes
        As for `numbers`.
    given
        Both arguments by their names.
    """
    names = [name for name, value in given.items() if value is not None]
    if problems.add(len(names) != 1, f"give exactly one of {' and '.join(given)}."):
        return None
    value = given[names[0]]
    assert value is not None
    values = numbers(problems, names[0], value, *shapes)
    return None if values is None else (names[0], values)


def one_load(problems: Problems, name: str, value: float | None) -> float:
    """One number, of a load not below zero; 0 for None and where a problem was noted."""
    array = numbers(problems, name, 0.0 if value is None else value, (), (1,))
    if array is None:
        return 0.0
    number = float(array.reshape(()))
    problems.add(
        name == "load" and number < 0.0,
        f"load is {number:g} N: the bodies cannot pull on each other, give a load >= 0.",
    )
    return number


def node_mask(problems: Problems, start: ArrayLike | None, n: int) -> BoolArray | None:
    """A guess of the contact set, checked.

    Parameters
    ----------
    problems : Problems
        Receives the message when it does not fit.
    start : (n,) array_like of bool, optional
    n : int
        Number of nodes.
    """
    if start is None:
        return None
    mask = np.asarray(start)
    problems.add(
        mask.dtype != bool or mask.shape != (n,),
        f"start must be a bool mask of shape ({n},), one per node.",
    )
    return mask


def compliance_matrix(
    problems: Problems, values: ArrayLike
) -> tuple[FloatArray | None, FloatArray | None]:
    """A compliance that is square, symmetric and positive definite, and its factor.

    Parameters
    ----------
    problems : Problems
        Receives the message otherwise.
    values : (n, n) array_like
        Compliance [mm/N]. A skew part of up to half of the digits counts as rounding.

    Returns
    -------
    C : (n, n) ndarray or None
        Its symmetric part; None when a problem was noted.
    L : (n, n) ndarray or None
        Lower triangle of C = L L', what is above it is not used; None where C is not positive
        definite to working precision.
    """
    C = numbers(problems, "compliance", values)
    if C is None:
        return None, None
    if problems.add(
        C.ndim != 2 or C.shape[0] != C.shape[-1] or C.size == 0,
        f"compliance has shape {C.shape}: it must be (n, n), n >= 1.",
    ):
        return None, None
    scale = float(np.abs(C).max())
    skew = float(np.abs(C - C.T).max())
    # Rounding of a condensation leaves far less than half the digits; more than that is a mistake
    # of the caller.
    if problems.add(
        skew > np.sqrt(EPS) * scale,
        "compliance is not symmetric (max |C - C'| is "
        f"{skew / scale if scale else 0.0:.1e} of max |C|): "
        "check the dof order and that both bodies use the same nodes.",
    ):
        return None, None
    dead = np.flatnonzero(np.diagonal(C) <= 0)
    if problems.add(
        dead.size > 0,
        f"compliance is not positive definite: {dead.size} diagonal entries are <= 0, "
        f"first at row {dead[0] if dead.size else 0}. "
        "Drop dofs fixed by symmetry and check the sign.",
    ):
        return None, None
    C = np.asarray((C + C.T) / 2)
    remedy = "Hold the bodies (no rigid motion) and merge coincident contact nodes."
    message = f"compliance is not positive definite to working precision: {{}}. {remedy}"
    L, info = lapack.dpotrf(C.T, lower=1, clean=0)
    if problems.add(
        info != 0, message.format(f"its Cholesky factorisation breaks down at row {info - 1}")
    ):
        return C, None
    pivot = np.diagonal(L) ** 2 / np.diagonal(C)
    worst = int(np.argmin(pivot))
    if problems.add(
        bool(pivot[worst] <= len(C) * EPS),
        message.format(f"row {worst} depends on the rows before it"),
    ):
        return C, None
    return C, np.asarray(L)
