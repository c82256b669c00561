"""Meshes kept on disk under the hash of all they depend on: .npz files without pickle, written in one step."""

from __future__ import annotations

import logging
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from upd.mesh import Mesh

log = logging.getLogger(__name__)


def folder(cache_dir: Path | str | None = None) -> Path:
    """Folder of the cache: `cache_dir`, else $UPD_CACHE, else upd/ in $XDG_CACHE_HOME or ~/.cache."""
    if cache_dir is not None:
        return Path(cache_dir)
    if os.environ.get("UPD_CACHE"):
        return Path(os.environ["UPD_CACHE"])
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")  # noqa: PTH111, PTH118 (Path.home() may raise)
    return Path(base) / "upd"


def load(where: Path, key: str) -> dict[str, Mesh] | None:
    """Meshes saved under `key`, or None; a damaged file counts as absent."""
    path = where / f"{key}.npz"
    try:
        # numpy leaves a file it opened itself open when that is no zip
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            return _meshes({name: stored[name] for name in stored.files})
    except FileNotFoundError:
        return None
    except Exception as fault:  # whatever a damaged zip makes the readers raise: the mesh can always be made again
        log.warning("cached mesh %s cannot be read (%s: %s): made again", path, type(fault).__name__, fault)
        return None


def save(where: Path, key: str, meshes: Mapping[str, Mesh]) -> None:
    """Keep `meshes` under `key`; where the folder cannot be written, only a log line."""
    temporary = None
    try:
        where.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=where, suffix=".tmp", delete=False) as file:
            temporary = Path(file.name)
            np.savez(file, **cast(dict[str, Any], _arrays(meshes)))
        temporary.replace(where / f"{key}.npz")
    except OSError as fault:
        log.warning("mesh not kept in %s (%s): it is made again next time", where, fault)
        if temporary is not None:
            temporary.unlink(missing_ok=True)


def _arrays(meshes: Mapping[str, Mesh]) -> dict[str, NDArray[np.generic]]:
    """Arrays by number, so that any name of a body or a set will do; the names are stored as text."""
    arrays: dict[str, NDArray[np.generic]] = {"bodies": np.array(list(meshes), dtype=np.str_)}
    for b, mesh in enumerate(meshes.values()):
        arrays |= {f"{b}.points": mesh.points, f"{b}.hexes": mesh.hexes}
        for kind, sets in (("faces", mesh.faces), ("nodes", mesh.nodes)):
            arrays[f"{b}.{kind}"] = np.array(list(sets), dtype=np.str_)
            arrays |= {f"{b}.{kind}.{k}": numbers for k, numbers in enumerate(sets.values())}
    return arrays


def _meshes(arrays: Mapping[str, NDArray[np.generic]]) -> dict[str, Mesh]:
    meshes = {}
    for b, name in enumerate(arrays["bodies"].tolist()):
        faces, nodes = (
            {str(key): arrays[f"{b}.{kind}.{k}"].astype(np.int64, copy=False) for k, key in enumerate(arrays[f"{b}.{kind}"].tolist())}
            for kind in ("faces", "nodes")
        )
        points = arrays[f"{b}.points"].astype(np.float64, copy=False)
        hexes = arrays[f"{b}.hexes"].astype(np.int64, copy=False)
        if points.ndim != 2 or hexes.ndim != 2 or (hexes.size and not 0 <= hexes.min() <= hexes.max() < len(points)):
            raise ValueError("the arrays are not those of a mesh")
        meshes[str(name)] = Mesh(points, hexes, faces, nodes)
    return meshes
