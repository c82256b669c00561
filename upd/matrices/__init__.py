"""K and M of other programs.

Files (Matrix Market, Harwell-Boeing, npz), the map of their dofs, their forced response.
"""

from __future__ import annotations

from upd.matrices.files import (
    COMPONENTS,
    DofMap,
    Matrices,
    check_sizes,
    checked,
    read_dof_map,
    read_matrices,
    read_matrix,
    write_dof_map,
    write_matrices,
    write_matrix,
)

__all__ = [
    "COMPONENTS",
    "DofMap",
    "Matrices",
    "check_sizes",
    "checked",
    "read_dof_map",
    "read_matrices",
    "read_matrix",
    "write_dof_map",
    "write_matrices",
    "write_matrix",
]
