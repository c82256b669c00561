"""Files written whole or not at all, JSON, and locks that end with the process that holds them."""

from __future__ import annotations

import errno
import io
import json
import math
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from filelock import FileLock, Timeout

from upd.errors import InputError


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A temporary file beside ``path``, of the same ending, that takes its place once the block is
    done.

    When the block or the replacement fails, ``path`` stays as it was and the temporary file is
    removed.

    Parameters
    ----------
    path
        File to write; its folder must exist.

    Yields
    ------
    Path
        Where the block writes.

    Raises
    ------
    OSError
        As the file system does.
    """
    temporary = path.with_name(f".{path.stem}-{uuid.uuid4().hex}{path.suffix}")
    try:
        yield temporary
        temporary.replace(path)
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


@contextmanager
def placed_file(path: Path) -> Iterator[Path]:
    """`whole_file` at a place that the user chose: InputError where it cannot be written."""
    try:
        with whole_file(path) as temporary:
            yield temporary
    except OSError as error:
        raise InputError(
            f"{path}: cannot be written ({error.strerror or error}); choose another place"
        ) from error


@contextmanager
def whole_files(folder: Path) -> Iterator[Path]:
    """A temporary folder whose files go to ``folder`` at the end, once all are written.

    When that fails, ``folder`` is as it was. It is made when only itself is missing. Raises OSError
    as the file system does.
    """
    made = not folder.exists()
    try:
        if made:
            folder.mkdir()
        with TemporaryDirectory(prefix=".", dir=folder) as name:
            yield Path(name)
            files = sorted(Path(name).iterdir())
            if blocked := [f.name for f in files if (folder / f.name).is_dir()]:
                raise IsADirectoryError(errno.EISDIR, "it is a folder", blocked[0])
            for file in files:
                file.replace(folder / file.name)
            made = False
    finally:
        if made:
            with suppress(OSError):
                folder.rmdir()


def write_text(path: Path, text: str) -> None:
    """Write ``text`` as UTF-8, whole or not at all. Raises OSError as the file system does."""
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def json_text(data: Any) -> str:
    """Data as JSON: what is not finite is null, arrays are lists, paths are text."""
    return json.dumps(_plain(data), indent=1, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return str(value) if isinstance(value, Path) else value


@contextmanager
def whole_bytes(path: Path) -> Iterator[io.BytesIO]:
    """A file made in memory and written, whole or not at all, once the block is done.

    For writers that cannot bear a full disk: HDF5 ends the process. Raises OSError as the file
    system does.
    """
    content = io.BytesIO()
    yield content
    with whole_file(path) as temporary:
        temporary.write_bytes(content.getbuffer())


@contextmanager
def locked(path: Path, *, wait: bool = True) -> Iterator[None]:
    """Hold a lock on the file ``path`` inside the block; its folder is made.

    Where locks do not work (some network disks), the block runs without: work is then done twice,
    not wrongly.

    Parameters
    ----------
    wait
        Wait for another holder; else raise BlockingIOError at once.
    """
    lock = FileLock(path, timeout=-1 if wait else 0)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock.acquire()
    except Timeout:
        raise BlockingIOError(f"{path} is locked by another process") from None
    except (NotImplementedError, OSError):
        yield
        return
    try:
        yield
    finally:
        lock.release()
