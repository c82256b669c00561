"""Meshes kept on disk under the hash of all they depend on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.cache.arrays import load_arrays, save_arrays, unreadable
from upd.mesh.hexmesh import Mesh

#: sets of a mesh by name -> what their arrays hold
_SETS = {"faces": np.int64, "nodes": np.int64, "weights": np.float64}


def load_meshes(where: Path, key: str) -> dict[str, Mesh] | None:
    """Meshes saved under `key`, or None; a damaged file counts as absent."""
    path = where / f"{key}.npz"
    arrays = load_arrays(path)
    if arrays is None:
        return None
    try:
        return _meshes(arrays)
    except (KeyError, ValueError, TypeError, IndexError) as problem:
        unreadable(path, problem)
        return None


def save_meshes(where: Path, key: str, meshes: Mapping[str, Mesh]) -> None:
    """Keep `meshes` under `key`; where the folder cannot be written, only a log line."""
    save_arrays(where / f"{key}.npz", _arrays(meshes))


def _arrays(meshes: Mapping[str, Mesh]) -> dict[str, NDArray[np.generic]]:
    """Arrays by number, so that any name of a body or a set will do.

    The names are stored as text.
    """
    arrays: dict[str, NDArray[np.generic]] = {"bodies": np.array(list(meshes), dtype=np.str_)}
    for b, mesh in enumerate(meshes.values()):
        arrays |= {f"{b}.points": mesh.points, f"{b}.hexes": mesh.hexes}
        for kind in _SETS:
            sets = getattr(mesh, kind)
            arrays[f"{b}.{kind}"] = np.array(list(sets), dtype=np.str_)
            arrays |= {f"{b}.{kind}.{k}": one for k, one in enumerate(sets.values())}
    return arrays


def _meshes(arrays: Mapping[str, NDArray[np.generic]]) -> dict[str, Mesh]:
    meshes = {}
    for b, name in enumerate(arrays["bodies"].tolist()):
        sets: dict[str, Any] = {
            kind: {
                str(key): arrays[f"{b}.{kind}.{k}"].astype(dtype, copy=False)
                for k, key in enumerate(arrays[f"{b}.{kind}"].tolist())
            }
            for kind, dtype in _SETS.items()
        }
        points = arrays[f"{b}.points"].astype(np.float64, copy=False)
        hexes = arrays[f"{b}.hexes"].astype(np.int64, copy=False)
        if (
            points.ndim != 2
            or hexes.ndim != 2
            or (hexes.size and not 0 <= hexes.min() <= hexes.max() < len(points))
        ):
            raise ValueError("the arrays are not those of a mesh")
        meshes[str(name)] = Mesh(points, hexes, **sets)
    return meshes
