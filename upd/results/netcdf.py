"""Arrays of a run in one netCDF file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

import h5netcdf
import numpy as np

from upd.cache.files import whole_bytes
from upd.errors import UpdError, one_line
from upd.results.case import NO_CASE, Case

#: key of summary.json: SHA-256 of the result.nc beside it
DIGEST = "result_nc_sha256"


class Variable(NamedTuple):
    """A variable of result.nc: names of its dimensions, data, attributes with unit and words."""

    dims: tuple[str, ...]
    data: np.ndarray[Any, Any]
    attributes: Mapping[str, Any]

    @property
    def units(self) -> str:
        """Its unit, "" when it has none."""
        return str(self.attributes.get("units", ""))


class Group(dict[str, Variable]):
    """Variables of one group of result.nc by name, and the group's own ``attributes``.

    The attributes say what the group holds (``content``: "normal", "tangential", "cycle", ...) and
    carry the case's.
    """

    def __init__(
        self, variables: Mapping[str, tuple[Any, ...]], /, case: Case = NO_CASE, **attributes: Any
    ) -> None:
        super().__init__({name: Variable(*one) for name, one in variables.items()})
        self.attributes: dict[str, Any] = case.given() | attributes


Arrays = Mapping[str, Group]


def variable(
    dims: str, data: Any, units: str = "", long_name: str = "", **attributes: Any
) -> Variable:
    """A variable from its dimensions, with blanks between, its array, unit and words."""
    known = {"units": units, "long_name": long_name}
    about = {key: text for key, text in known.items() if text} | attributes
    array = np.asarray(data)
    if array.dtype == bool:
        # netCDF has no truth values
        array = array.astype(np.int8)
    return Variable(tuple(dims.split()), array, about)


def write_netcdf(path: Path, arrays: Arrays) -> None:
    """Write arrays as one netCDF-4 file, whole or not at all.

    Parameters
    ----------
    arrays
        Group -> name -> variable.

    Raises
    ------
    OSError
        As the file system does.
    """
    with whole_bytes(path) as content, h5netcdf.File(content, "w") as file:
        for name, variables in arrays.items():
            # A file has no slash in the name of a group.
            group = file.create_group(name.replace("/", " per ")) if name else file
            for key, value in variables.attributes.items():
                group.attrs[key] = np.int8(value) if isinstance(value, bool) else value
            for key, one in variables.items():
                for dim, length in zip(one.dims, one.data.shape, strict=True):
                    if dim not in group.dimensions:
                        group.dimensions[dim] = length
                made = group.create_variable(key, one.dims, one.data.dtype, data=one.data)
                for word, text in one.attributes.items():
                    made.attrs[word] = text


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
        known, summary = None, path.with_name("summary.json")
        with suppress(OSError, ValueError, AttributeError, RecursionError):
            if path.name == "result.nc":
                known = json.loads(summary.read_text("utf-8")).get(DIGEST)
        if known and known != file_digest(path):
            raise OSError(
                "it is not as the run wrote it, its SHA-256 is another; run the scene again"
            )
        with h5netcdf.File(path, "r") as file:
            yield file
    except (OSError, UpdError):
        raise
    except Exception as error:
        # damaged files raise errors of any kind in HDF5
        raise OSError(one_line(error)) from error


def read_netcdf(path: Path) -> dict[str, Group]:
    """Groups of a netCDF file by name, with dimensions, units and attributes.

    Raises
    ------
    OSError
        For a file that is missing, damaged or not as its run wrote it.
    """

    def read(group: Any) -> Group:
        variables = group.variables.items()
        found = Group({n: (tuple(v.dimensions), v[...], dict(v.attrs)) for n, v in variables})
        for key, value in group.attrs.items():
            found.attributes[key] = value.item() if hasattr(value, "item") else value
        return found

    with open_netcdf(path) as file:
        root = {"": read(file)} if file.variables else {}
        return root | {name: read(group) for name, group in file.groups.items()}
