"""Arrays of a run in one netCDF file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np

from upd.cache.files import whole_bytes
from upd.errors import UpdError, one_line
from upd.results.case import NO_CASE, Case

#: key of summary.json: SHA-256 of the result.nc beside it
DIGEST = "result_nc_sha256"


class ArrayGroup(dict[str, Any]):
    """Variables of one group of result.nc: name -> (dimension names, array, attributes) or array.

    ``attributes`` are the group's own.

    The attributes say what the group holds (``content``: "normal", "tangential", "cycle", ...) and
    carry the case's.
    """

    def __init__(
        self,
        variables: Mapping[str, Any] | None = None,
        /,
        *,
        content: str = "",
        case: Case = NO_CASE,
        **attributes: Any,
    ) -> None:
        super().__init__(variables or {})
        self.attributes: dict[str, Any] = (
            ({"content": content} if content else {}) | case.given() | attributes
        )


def variable(
    dims: str, data: Any, units: str = "", long_name: str = "", **attributes: Any
) -> tuple[tuple[str, ...], np.ndarray[Any, Any], dict[str, Any]]:
    """A variable of result.nc: its dimensions, with blanks between, its array, unit and words."""
    known = {"units": units, "long_name": long_name}
    about = {key: text for key, text in known.items() if text} | attributes
    return tuple(dims.split()), np.asarray(data), about


def write_netcdf(path: Path, arrays: Mapping[str, Mapping[str, Any]]) -> None:
    """Write arrays as one netCDF-4 file, whole or not at all.

    Parameters
    ----------
    arrays
        Group -> name -> array or (dimension names, array, attributes); an `ArrayGroup` leaves its
        attributes on its group.

    Raises
    ------
    OSError
        As the file system does.
    """
    with whole_bytes(path) as content, h5netcdf.File(content, "w") as file:
        for name, variables in arrays.items():
            group = file.create_group(name.replace("/", " per ")) if name else file
            for key, value in getattr(variables, "attributes", {}).items():
                group.attrs[key] = np.int8(value) if isinstance(value, bool) else value
            for key, value in variables.items():
                dims, data, attributes = value if isinstance(value, tuple) else (None, value, {})
                _write_variable(group, key, np.asarray(data), dims, attributes)


def _write_variable(
    group: Any,
    name: str,
    data: np.ndarray[Any, Any],
    dims: Iterable[str] | None,
    attributes: Mapping[str, Any],
) -> None:
    if data.dtype == bool:
        data = data.astype(np.int8)
    dims = tuple(dims) if dims is not None else tuple(f"{name}_{i}" for i in range(data.ndim))
    for dim, length in zip(dims, data.shape, strict=True):
        if dim not in group.dimensions:
            group.dimensions[dim] = length
    variable = group.create_variable(name, dims, data.dtype, data=data)
    for key, text in attributes.items():
        variable.attrs[key] = text


def file_digest(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@contextmanager
def open_netcdf(path: Path) -> Iterator[h5netcdf.File]:
    """A netCDF file to read in a block.

    Raises
    ------
    OSError
        For whatever is wrong with it, and for a result.nc that is another than the one whose
        SHA-256 the summary.json beside it has.
    """
    try:
        if path.name == "result.nc":
            _check_digest(path)
        with h5netcdf.File(path, "r") as file:
            yield file
    except (OSError, UpdError):
        raise
    except Exception as error:
        # damaged files raise errors of any kind in HDF5
        raise OSError(one_line(error)) from error


def _check_digest(path: Path) -> None:
    try:
        known = json.loads(path.with_name("summary.json").read_text("utf-8")).get(DIGEST)
    except (OSError, ValueError, AttributeError, RecursionError):
        return
    if known and known != file_digest(path):
        raise OSError("it is not as the run wrote it, its SHA-256 is another; run the scene again")


def read_netcdf(path: Path) -> dict[str, ArrayGroup]:
    """Arrays of a result.nc: group -> variable -> array, with the groups' attributes.

    Raises OSError as `open_netcdf` does.
    """

    def read(group: Any) -> ArrayGroup:
        found = ArrayGroup({name: variable[...] for name, variable in group.variables.items()})
        found.attributes.update(group.attrs)
        return found

    with open_netcdf(path) as file:
        root = {"": read(file)} if file.variables else {}
        return root | {name: read(group) for name, group in file.groups.items()}
