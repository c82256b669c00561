"""A reduced linear model: K and M on boundary dofs and modal coordinates.

Saved and loaded without pickle.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np
from numpy.typing import ArrayLike

from upd.cache.files import whole_bytes, whole_file
from upd.errors import InputError
from upd.labels import Shown
from upd.linalg.common import FloatArray, IntArray
from upd.linalg.eigen import modes
from upd.linalg.eigen_checks import Modes

_DIMS = {
    "K": ("coordinate", "coordinate_"),
    "M": ("coordinate", "coordinate_"),
    "boundary": ("boundary",),
    "fixed_frequency": ("mode",),
    "rows": ("row",),
    "stiffness_size": ("coordinate",),
    "basis": ("row", "coordinate"),
}
_UNITS = {"K": "N/mm", "M": "t", "stiffness_size": "N/mm", "fixed_frequency": "Hz"}
_FORMAT = "upd reduced model 1"


@dataclass(frozen=True, repr=False)
class ReducedModel(Shown):
    """Model on r = k + m coordinates q: displacements of k boundary dofs, then modal coordinates.

    Attributes
    ----------
    K, M : (r, r) ndarray
        N/mm and t, exactly symmetric; the first k coordinates are in mm.
    boundary : (k,) array of int
        Dof numbers in the full model, in the order of the first coordinates.
    fixed_frequency : (m,) ndarray
        Hz of the modes with the boundary held.
    rows : (n_row,) array of int
        Dofs of the full model at which the basis is kept.
    basis : (n_row, r) ndarray
        Displacement there per unit coordinate.
    stiffness_size : (r,) ndarray
        Stiffness of the full model at each coordinate, N/mm: what the rounding of K is relative to.
    n_dof : int
        Number of dofs of the full model.
    """

    K: FloatArray
    M: FloatArray
    boundary: IntArray
    fixed_frequency: FloatArray
    rows: IntArray
    basis: FloatArray
    stiffness_size: FloatArray
    n_dof: int

    @property
    def n_modes(self) -> int:
        """m."""
        return len(self.fixed_frequency)

    @property
    def n(self) -> int:
        """r = k + m."""
        return len(self.K)

    def at(self, dofs: ArrayLike) -> FloatArray:
        """Rows of the basis at dofs of the full model.

        Parameters
        ----------
        dofs : (j,) array_like of int

        Returns
        -------
        (j, r) ndarray

        Raises
        ------
        InputError
            Where the basis was not kept.
        """
        wanted = np.atleast_1d(np.asarray(dofs, dtype=np.int64))
        order = np.argsort(self.rows, kind="stable")
        place = np.minimum(np.searchsorted(self.rows, wanted, sorter=order), len(order) - 1)
        found = order[place] if len(order) else np.zeros(0, np.int64)
        if not len(order) or (self.rows[found] != wanted).any():
            raise InputError(
                "The basis was not kept at some of these dofs: reduce with `rows` that "
                "contain them."
            )
        return self.basis[found]

    def modes(self, *, count: int | None = None, below_hz: float | None = None) -> Modes:
        """Modes of the reduced model, in its coordinates.

        Parameters
        ----------
        count, below_hz
            As for `upd.linalg.modes`.

        Returns
        -------
        Modes
            Shapes (r, m).

        Raises
        ------
        InputError, ConvergenceError
            As for `upd.linalg.modes`.
        """
        # The reduced K carries the rounding of sums over all dofs of the full model, not over its
        # own few.
        size = self.stiffness_size * np.sqrt(max(1.0, self.n_dof / len(self.K)))
        return modes(
            self.K, self.M, count=count, below_hz=below_hz, solver="dense", stiffness_size=size
        )

    def truncated(self, n_modes: int) -> ReducedModel:
        """The same with the first modal coordinates only.

        Parameters
        ----------
        n_modes : int

        Returns
        -------
        ReducedModel

        Raises
        ------
        InputError
            For more than there are.
        """
        if not 0 <= n_modes <= self.n_modes:
            raise InputError(
                f"{n_modes} modes of a reduced model that has {self.n_modes}: give 0 to "
                f"{self.n_modes}."
            )
        r = len(self.boundary) + n_modes
        return replace(
            self,
            K=self.K[:r, :r].copy(),
            M=self.M[:r, :r].copy(),
            fixed_frequency=self.fixed_frequency[:n_modes].copy(),
            basis=self.basis[:, :r].copy(),
            stiffness_size=self.stiffness_size[:r].copy(),
        )

    def save(self, path: Path | str) -> Path:
        """Write as netCDF-4 (.nc), in one step.

        Parameters
        ----------
        path : path or str
            With the ending .nc.

        Returns
        -------
        Path

        Raises
        ------
        InputError
            For another ending or a file that cannot be written.
        """
        path = _checked_ending(path)
        try:
            with (
                whole_file(path) as temporary,
                whole_bytes(temporary) as content,
                h5netcdf.File(content, "w") as file,
            ):
                file.attrs["format"] = _FORMAT
                file.attrs["n_dof"] = int(self.n_dof)
                for name, dims in _DIMS.items():
                    data = np.asarray(getattr(self, name))
                    for dim, length in zip(dims, data.shape, strict=True):
                        if dim not in file.dimensions:
                            file.dimensions[dim] = length
                    variable = file.create_variable(name, dims, data.dtype, data=data)
                    if name in _UNITS:
                        variable.attrs["units"] = _UNITS[name]
        except OSError as error:
            raise InputError(
                f"{path} cannot be written ({error}): choose a folder that exists and is yours."
            ) from error
        return path

    @classmethod
    def load(cls, path: Path | str) -> ReducedModel:
        """Read what `save` wrote.

        Parameters
        ----------
        path : path or str

        Returns
        -------
        ReducedModel

        Raises
        ------
        InputError
            For a file that is not there or no reduced model.
        """
        path = _checked_ending(path)
        try:
            with h5netcdf.File(path, "r") as file:
                if str(file.attrs["format"]) != _FORMAT:
                    raise KeyError("format")
                values: dict[str, Any] = {
                    name: np.asarray(file.variables[name][...]) for name in _DIMS
                }
                return cls(**values, n_dof=int(file.attrs["n_dof"]))
        except (OSError, KeyError, ValueError) as error:
            raise InputError(
                f"{path} cannot be read as a reduced model ({error}): give a file that "
                "ReducedModel.save wrote."
            ) from error


def _checked_ending(path: Path | str) -> Path:
    path = Path(path)
    if path.suffix != ".nc":
        raise InputError(f"{path}: a reduced model is kept as netCDF-4; give the ending .nc.")
    return path
