"""One place for the compiler's options.

Loops compiled on first use and kept on disk beside the module.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import numba


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function compiled by numba, cached on disk.

    Division by zero gives inf as in numpy, so that no branch hides in the loops. Other threads go
    on while it runs. Named tuples are given as plain ones: their classes would be part of the
    signatures on disk, which another version that has renamed them cannot read.
    """
    return cast(
        "Callable[..., Any]", numba.njit(cache=True, error_model="numpy", nogil=True)(function)
    )
