"""How fast a machine works: what predictions of seconds are made from."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Rates:
    """Speeds of one thread, and what all threads together gain.

    Attributes
    ----------
    factor_flops
        Operations per s of a sparse Cholesky factorisation.
    analysis_entries
        Entries of a matrix ordered and analysed per s.
    solve_bytes
        Bytes of a factor read per s by a triangular solve.
    dense_flops
        Operations per s of dense Cholesky, LU and products.
    elements
        Hexahedra with eight nodes per s whose stiffness is assembled: numpy on large arrays.
    speedup
        All threads over one thread, of a sparse factorisation.
    """

    factor_flops: float = 3.0e10
    analysis_entries: float = 9.0e6
    solve_bytes: float = 1.0e10
    dense_flops: float = 2.6e10
    elements: float = 6.0e4
    speedup: float = 1.5


#: one core of a server of 2.1 GHz, where the seconds in plans were measured
USUAL = Rates()
