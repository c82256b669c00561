"""Condensations kept on disk under the hash of all they depend on, and the last contact model kept in memory: for points of a sweep.

Off unless `sharing` is entered: a single run and the cost studies measure what they do themselves.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from upd import mesh_cache
from upd.errors import InputError
from upd.reduction.guyan import Condensed
from upd.units import parse_quantity

log = logging.getLogger(__name__)

#: Bytes the folder may hold; $UPD_CACHE_LIMIT ("500 MB") sets another bound. The files used longest ago go first.
LIMIT_BYTES = 4e9
#: Age in s after which a half-written file is one of a killed process.
_ABANDONED_S = 3600.0
Found = TypeVar("Found")
_LIBRARIES = ("numpy", "scipy", "scikit-fem", "gmsh", "pyamg", "pypardiso", "mkl")


@dataclass
class Store:
    """Where condensations are kept, how many threads may make them, and what was taken from where.

    counts : "made" (factorised), "disk" (read), "factor" (factorised again for displacements inside a body), "memory" (a whole model kept).
    """

    folder: Path
    threads: int = 1
    limit_bytes: float = LIMIT_BYTES
    counts: dict[str, int] = field(default_factory=lambda: {"made": 0, "disk": 0, "factor": 0, "memory": 0})
    _memory: dict[str, tuple[str, Any]] = field(default_factory=dict)

    def remembered(self, kind: str, key: str, make: Callable[[], Found]) -> Found:
        """What `make` gives, kept in memory for the next point with the same `key`.

        One object of each kind: another is let go before the new one is made, so that two never stand side by side.
        """
        held = self._memory.get(kind)
        if held is not None and held[0] == key:
            self.counts["memory"] += 1
            return cast(Found, held[1])
        del held
        self._memory.pop(kind, None)
        made = make()
        self._memory[kind] = (key, made)
        return made

    def condensed(self, key: str, make: Callable[[], Condensed], *, solver: str, with_factor: bool) -> Condensed:
        """The condensation under `key`, from disk or by `make`.

        solver      : the one `key` stands for; what another one made (memory ran short meanwhile) is not kept.
        with_factor : the factor is needed too, which is not kept on disk: then nobody waits for another process that makes the same.
        """
        found = self._read(key, make)
        if found is not None:
            return found
        if with_factor:
            return self._made(key, make, solver)
        with _locked(self.folder / f"{key}.lock"):
            # Another process may have made it while this one waited.
            return self._read(key, make) or self._made(key, make, solver)

    def _made(self, key: str, make: Callable[[], Condensed], solver: str) -> Condensed:
        made = make()
        self.counts["made"] += 1
        if made.solver == solver:
            _save(self.folder, key, made)
            _trim(self.folder, self.limit_bytes, f"{key}.npz")
        return made

    def _read(self, key: str, make: Callable[[], Condensed]) -> Condensed | None:
        arrays = _load(self.folder / f"{key}.npz")
        if arrays is None:
            return None
        self.counts["disk"] += 1
        return _revived(arrays, make, self.counts)


_active: list[Store] = []


def active() -> Store | None:
    """The store of the sweep that runs in this process, if any."""
    return _active[-1] if _active else None


@contextmanager
def sharing(store: Store) -> Iterator[Store]:
    """Take condensations from `store` inside the block."""
    _active.append(store)
    try:
        yield store
    finally:
        _active.remove(store)


def shared(kind: str, parts: Mapping[str, Any], make: Callable[[], Found]) -> Found:
    """What `make` gives; inside a sweep it is kept for the next point whose ``parts`` (all it depends on) are the same."""
    store = active()
    return make() if store is None else store.remembered(kind, key_of({**parts, "threads": store.threads}), make)


def default_folder() -> Path:
    """condensed/ in the folder of the mesh cache."""
    return mesh_cache.folder() / "condensed"


def default_limit() -> float:
    """Bytes from $UPD_CACHE_LIMIT, else LIMIT_BYTES. Raises InputError for a text that is no amount of memory."""
    given = os.environ.get("UPD_CACHE_LIMIT")
    try:
        return parse_quantity(given, "memory") if given else LIMIT_BYTES
    except InputError as error:
        raise InputError(f"the environment variable UPD_CACHE_LIMIT: {error}") from None


@cache
def source_digest(recipe: str) -> str:
    """SHA-256 of our sources, of a user's recipe file, and of the versions of the libraries that numbers depend on."""
    package = Path(__file__).resolve().parent
    files = [*sorted(package.rglob("*.py")), *sorted((package.parent / "geometry").rglob("*.py"))]
    files += [Path(recipe)] if recipe.endswith(".py") else []
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.read_bytes())
    digest.update(json.dumps({name: _version(name) for name in _LIBRARIES}).encode())
    return digest.hexdigest()


def key_of(data: Mapping[str, Any]) -> str:
    """SHA-256 of a plain mapping."""
    return hashlib.sha256(json.dumps(data, sort_keys=True, default=str).encode()).hexdigest()


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "none"


def _load(path: Path) -> dict[str, NDArray[Any]] | None:
    """Arrays of one file, or None; a damaged file counts as absent (the zip carries checksums)."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in ("S", "C", "sizes", "solver")}
        S, C = arrays["S"], arrays["C"]
        if S.ndim != 2 or S.shape[0] != S.shape[1] or S.shape != C.shape or not (np.isfinite(S).all() and np.isfinite(C).all()):
            raise ValueError("the arrays are not those of a condensation")
    except FileNotFoundError:
        return None
    except Exception as fault:  # whatever a damaged zip makes the readers raise
        log.warning("condensation %s cannot be read (%s: %s): made again", path, type(fault).__name__, fault)
        return None
    with suppress(OSError):
        # Used now: the last to be thrown away.
        os.utime(path)
    return arrays


def _revived(arrays: Mapping[str, NDArray[Any]], make: Callable[[], Condensed], counts: dict[str, int]) -> Condensed:
    """The condensation read; the factor behind `recover` is made when first asked for."""
    again: list[Condensed] = []

    def recover(u_kept: NDArray[np.float64]) -> NDArray[np.float64]:
        if not again:
            again.append(make())
            counts["factor"] += 1
        return again[0].recover(u_kept)

    n_dof, nnz, peak = (int(v) for v in arrays["sizes"])
    C = arrays["C"]
    C.flags.writeable = False
    return Condensed(arrays["S"], recover, str(arrays["solver"]), 0.0, n_dof, nnz, peak, [C])


def _save(folder: Path, key: str, made: Condensed) -> None:
    """Keep `made` under `key`, whole or not at all; where the folder cannot be written, only a log line."""
    temporary = None
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder, suffix=".tmp", delete=False) as file:
            temporary = Path(file.name)
            sizes = np.array([made.n_dof, made.factor_nnz, made.peak_bytes], np.int64)
            np.savez(file, S=made.S, C=made.compliance(), sizes=sizes, solver=np.array(made.solver))
        temporary.replace(folder / f"{key}.npz")
    except OSError as fault:
        log.warning("condensation not kept in %s (%s): it is made again next time", folder, fault)
        if temporary is not None:
            temporary.unlink(missing_ok=True)


def _trim(folder: Path, limit_bytes: float, newest: str) -> None:
    """Remove the files used longest ago until the rest fits, and what killed processes left."""
    known = []
    for path in folder.glob("*"):
        with suppress(OSError):
            status = path.stat()
            if path.suffix == ".npz":
                known.append((path.name == newest, status.st_mtime, status.st_size, path))
            elif time.time() - status.st_mtime > _ABANDONED_S:
                path.unlink(missing_ok=True)
    total = sum(size for _, _, size, _ in known)
    for _, _, size, path in sorted(known):
        if total <= limit_bytes:
            return
        with suppress(OSError):
            path.unlink(missing_ok=True)
        total -= size


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Hold a lock that ends with the process; where locks do not work, the block runs without (work is then done twice, not wrongly)."""
    try:
        import fcntl

        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    except (ImportError, OSError):
        yield
        return
    try:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)
