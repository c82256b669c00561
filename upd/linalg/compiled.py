"""One place for the compiler's options.

Loops compiled on first use and kept on disk beside the modules. The compiler itself looks at a
function's own file only; loops that are built into others from another file would stay as they
were when that file changes. So what is kept is named after the module and all modules of ours that
it imports.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import re
import shutil
import sys
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any, cast

import numba
from numba.core.caching import FunctionCache

log = logging.getLogger(__name__)

# the compiler has no types
_FunctionCache: Any = FunctionCache

_ROOT = Path(__file__).resolve().parents[2]
_IMPORT = re.compile(r"^\s*(?:from|import) (upd[\w.]*)", re.MULTILINE)


def compiled(function: Callable[..., Any], **more: Any) -> Callable[..., Any]:
    """The function compiled by numba, cached on disk.

    Division by zero gives inf as in numpy, so that no branch hides in the loops. Other threads go
    on while it runs. Named tuples are given as plain ones: their classes would be part of the
    signatures on disk, which another version that has renamed them cannot read.

    Parameters
    ----------
    function
        In the compiler's part of Python.
    more
        Further options of numba's.
    """
    options: Any = numba.config
    usual, folder = options.CACHE_DIR, folder_of(function.__module__)
    if folder is not None:
        options.CACHE_DIR = str(folder)
    try:
        made: Any = numba.njit(error_model="numpy", nogil=True, **more)(function)
        made._cache = _Kept(function)
    except RuntimeError:
        warn_not_kept("no folder for them can be written")
    finally:
        options.CACHE_DIR = usual
    return cast("Callable[..., Any]", made)


#: `compiled`, and built into every compiled function that calls it: for what takes less than some
#: hundred nanoseconds, as a call counts references to every array it is given, one atomic
#: instruction each way
inlined = partial(compiled, forceinline=True)
#: the same for long functions: they are not compiled by themselves as well
joined = partial(compiled, inline="always")


class _Kept(_FunctionCache):  # type: ignore[misc]
    """Functions kept on disk; what cannot be read or written is compiled again.

    The compiler's own cache raises at a damaged file in every process, and on a full disk.
    """

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # damaged bytes raise anything
            with contextlib.suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except Exception as error:  # a full disk, or a damaged index that could not be replaced
            warn_not_kept(getattr(error, "strerror", None) or type(error).__name__)


def kept_in(module: str) -> Path | None:
    """Folder of the compiled functions of a module; None where none can be written."""
    folder = folder_of(module)
    if folder is None:
        with contextlib.suppress(RuntimeError):
            folder = Path(_FunctionCache(sources_digest).cache_path)
    return folder if folder is not None and os.access(folder.parent, os.W_OK) else None


@cache
def warn_not_kept(reason: str) -> None:
    log.warning(
        "compiled functions cannot be kept on disk (%s): every start compiles them again, about "
        "a minute; to fix it: set NUMBA_CACHE_DIR to a folder that can be written",
        reason,
    )


@cache
def folder_of(module: str) -> Path | None:
    """Where the compiled functions of a module are kept; None for the compiler's own choice."""
    file = getattr(sys.modules.get(module), "__file__", None)
    if file is None or "NUMBA_CACHE_DIR" in os.environ:
        return None
    path = Path(file).resolve()
    beside, digest = path.parent / "__pycache__", sources_digest(path, _ROOT)[:16]
    folder = beside / f"{path.stem}-{digest}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK):
            return None
        for other in beside.glob(f"{path.stem}-*"):
            if other != folder and re.fullmatch(r"-[0-9a-f]{16}", other.name[len(path.stem) :]):
                shutil.rmtree(other, ignore_errors=True)
    except OSError:
        return None
    return folder


def sources_digest(file: Path, root: Path) -> str:
    """SHA-256 of a module and all modules of the package upd that it imports, directly or not.

    Parameters
    ----------
    file : Path
        Of the module.
    root : Path
        Folder in which the package lies.

    Returns
    -------
    str
    """
    wanted, seen = [file], dict[str, bytes]()
    while wanted:
        one = wanted.pop()
        if one.as_posix() in seen:
            continue
        text = seen[one.as_posix()] = one.read_bytes()
        for name in _IMPORT.findall(text.decode("utf-8")):
            place = root.joinpath(*name.split("."))
            wanted += [p for p in (place.with_suffix(".py"), place / "__init__.py") if p.is_file()]
    digest = hashlib.sha256()
    for name in sorted(seen):
        # a module of the user's may lie anywhere
        at = Path(name)
        path = at.relative_to(root) if at.is_relative_to(root) else Path(at.name)
        digest.update(path.as_posix().encode() + b"\0")
        digest.update(hashlib.sha256(seen[name]).digest())
    return digest.hexdigest()
