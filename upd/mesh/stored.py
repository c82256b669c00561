"""Meshes kept on disk under the hash of all they depend on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from upd.cache.arrays import load_arrays, save_arrays, unreadable
from upd.mesh.hexmesh import Mesh


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
        for kind, sets in (("faces", mesh.faces), ("nodes", mesh.nodes)):
            arrays[f"{b}.{kind}"] = np.array(list(sets), dtype=np.str_)
            arrays |= {f"{b}.{kind}.{k}": numbers for k, numbers in enumerate(sets.values())}
        arrays[f"{b}.weights"] = np.array(list(mesh.weights), dtype=np.str_)
        arrays |= {f"{b}.weights.{k}": own for k, own in enumerate(mesh.weights.values())}
    return arrays


def _meshes(arrays: Mapping[str, NDArray[np.generic]]) -> dict[str, Mesh]:
    meshes = {}
    for b, name in enumerate(arrays["bodies"].tolist()):
        faces, nodes = (
            {
                str(key): arrays[f"{b}.{kind}.{k}"].astype(np.int64, copy=False)
                for k, key in enumerate(arrays[f"{b}.{kind}"].tolist())
            }
            for kind in ("faces", "nodes")
        )
        weights = {
            str(key): arrays[f"{b}.weights.{k}"].astype(np.float64, copy=False)
            for k, key in enumerate(arrays[f"{b}.weights"].tolist())
        }
        points = arrays[f"{b}.points"].astype(np.float64, copy=False)
        hexes = arrays[f"{b}.hexes"].astype(np.int64, copy=False)
        if (
            points.ndim != 2
            or hexes.ndim != 2
            or (hexes.size and not 0 <= hexes.min() <= hexes.max() < len(points))
        ):
            raise ValueError("the arrays are not those of a mesh")
        meshes[str(name)] = Mesh(points, hexes, faces, nodes, weights)
    return meshes
