"""Condensations kept on disk under the hash of all they depend on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.cache.arrays import Store, load_arrays, save_arrays, trim, unreadable
from upd.cache.files import locked
from upd.reduction.guyan import Condensed


def stored_condensation(
    store: Store, key: str, make: Callable[[], Condensed], *, solver: str, with_factor: bool
) -> Condensed:
    """The condensation under ``key``, from disk or by ``make``.

    Parameters
    ----------
    store
        Folder, bound of its size, and counts of what was taken from where.
    key
        Hash of all the condensation depends on.
    make
        Factorises.
    solver
        The one `key` stands for; what another one made (memory ran short meanwhile) is not kept.
    with_factor
        The factor is needed too, which is not kept on disk: then nobody waits for another process
        that makes the same.
    """
    path = store.folder / f"{key}.npz"
    found = _read(store, path, make)
    if found is not None:
        return found
    if with_factor:
        return _made(store, path, make, solver)
    with locked(store.folder / f"{key}.lock"):
        # Another process may have made it while this one waited.
        return _read(store, path, make) or _made(store, path, make, solver)


def _made(store: Store, path: Path, make: Callable[[], Condensed], solver: str) -> Condensed:
    made = make()
    store.counts["made"] += 1
    if made.solver == solver:
        sizes = np.array([made.n_dof, made.factor_nnz, made.peak_bytes], np.int64)
        save_arrays(
            path,
            {"S": made.S, "C": made.compliance(), "sizes": sizes, "solver": np.array(made.solver)},
        )
        trim(store.folder, store.limit_bytes, path.name)
    return made


def _read(store: Store, path: Path, make: Callable[[], Condensed]) -> Condensed | None:
    arrays = load_arrays(path)
    if arrays is None:
        return None
    try:
        S, C = arrays["S"], arrays["C"]
        if (
            S.ndim != 2
            or S.shape[0] != S.shape[1]
            or S.shape != C.shape
            or not (np.isfinite(S).all() and np.isfinite(C).all())
        ):
            raise ValueError("the arrays are not those of a condensation")
        revived = _revived(arrays, make, store.counts)
    except (KeyError, ValueError, TypeError) as problem:
        unreadable(path, problem)
        return None
    store.counts["disk"] += 1
    return revived


def _revived(
    arrays: Mapping[str, NDArray[Any]], make: Callable[[], Condensed], counts: dict[str, int]
) -> Condensed:
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
