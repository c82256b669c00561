"""Argument checks shared by the closed forms: one InputError instead of a NaN further down."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from upd.errors import InputError

FloatArray = NDArray[np.float64]
#: the argument a user sweeps; the other arguments broadcast against it
Real = TypeVar("Real", float, FloatArray)


def require(condition: Any, where: str, problem: str, remedy: str) -> None:
    """Raise InputError "where: problem; remedy" unless the condition holds for every element."""
    if not np.all(condition):
        raise InputError(f"{where}: {problem}; {remedy}")


def plain(value: Any) -> Any:
    """The value itself, or a float where it is an array without dimensions."""
    return np.asarray(value)[()]


def positive(where: str, **values: Any) -> None:
    """InputError unless every named value is finite and above zero."""
    for name, value in values.items():
        array = np.asarray(value, dtype=float)
        # Large arrays take longer to print than to check.
        if np.all(np.isfinite(array) & (array > 0)):
            continue
        require(
            False,
            where,
            f"{name} = {value} is not finite and above zero",
            f"give a positive {name}",
        )


def not_negative(where: str, **values: Any) -> None:
    """InputError unless every named value is finite and at least zero."""
    for name, value in values.items():
        array = np.asarray(value, dtype=float)
        # Large arrays take longer to print than to check.
        if np.all(np.isfinite(array) & (array >= 0)):
            continue
        require(
            False,
            where,
            f"{name} = {value} is not finite and at least zero",
            f"give {name} >= 0",
        )


def elastic(where: str, E: Any, nu: Any) -> None:
    """InputError unless E > 0 (MPa) and -1 < nu <= 0.5."""
    positive(where, E=E)
    array = np.asarray(nu, dtype=float)
    require(
        (array > -1) & (array <= 0.5),
        where,
        f"Poisson's ratio {nu} is outside (-1, 0.5]",
        "steel has 0.3",
    )
