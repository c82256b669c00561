"""Folders written under a name of their own beside their place, held by a lock, moved in whole.

The lock is `flock` on the folder itself: it moves with the folder, needs no file and ends with the
process, so that a folder with a free lock is what a killed process left.
"""

from __future__ import annotations

import errno
import fcntl
import os
import re
import shutil
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from upd.errors import InputError, UpdError

_PART = re.compile(r"^\.(?P<name>.+)\.part-(?P<process>\d+)-[0-9a-f]{8}$")


def plain_name(folder: Path) -> str:
    """Name of a folder, of one that is not yet in its place the name it will have."""
    name = folder.resolve().name
    found = _PART.match(name)
    return found["name"] if found else name


class OwnFolder:
    """A folder that one process owns until it stands in its place.

    Attributes
    ----------
    place
        Where it will stand, as the user gave it.
    path
        Where to write meanwhile.
    replaces
        Whether another folder stands in that place now.
    """

    def __init__(self, place: Path, path: Path, lock: int | None, ours: Ours) -> None:
        self.place, self.path, self._lock, self._ours = place, path, lock, ours
        self.replaces = place.is_dir() and any(e != path for e in place.resolve().iterdir())

    def move_in(self) -> Path:
        """Put the folder into its place, whole, in place of what is ours there; returns the place.

        Files that are not ours and came while it was written stay. When the place cannot be taken
        any more, the next free name is.

        Raises
        ------
        UpdError
            When no name can be taken: the files are then where the message names.
        """
        try:
            with _turn(self.path.parent):
                _replace(self.path, self.place.resolve(), self._ours)
        except OSError as error:
            free = next(place for place in numbered(self.place) if not place.exists())
            with suppress(OSError):
                shutil.move(self.path, free)
                self.place = free
                return free
            kept = self.path.with_name(self.path.name.lstrip("."))
            with suppress(OSError):
                # Under a name that no later call takes for what a killed process left.
                self.path.rename(kept)
            raise UpdError(
                f"{self.place} cannot be written any more ({error.strerror or error}): the files "
                f"are in {kept if kept.exists() else self.path}; move them to where they can stay"
            ) from None
        finally:
            self._release()
        return self.place

    def step_aside(self) -> Path:
        """Take the next free name instead of replacing what stands in the place; returns that."""
        stays = self.place
        with _turn(self.path.parent):
            self.place = next(
                name
                for name in numbered(stays)
                if not name.exists() and not _holder(name.resolve())
            )
        self.replaces = False
        return stays

    def drop(self) -> None:
        """Remove the folder: nothing takes its place."""
        shutil.rmtree(self.path, ignore_errors=True)
        self._release()

    def _release(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


#: Whether an entry of a folder, by its path, is one that the program itself writes.
Ours = Callable[[Path], bool]


def own_folder(
    place: Path, *, check: Callable[[Path], None], ours: Ours, number: bool = False
) -> OwnFolder:
    """Take a place for a folder: no other process takes it until the folder stands there.

    What killed processes left beside that place is removed.

    Parameters
    ----------
    place
        Where the folder will stand.
    check
        Called with a place that holds something; raises when that must stay.
    ours
        Entries that may be removed when the folder replaces another.
    number
        Take the first of NAME, NAME-2, NAME-3 ... that is neither there nor taken.

    Raises
    ------
    InputError
        When another process has taken the place, and what ``check`` raises.
    OSError
        As the file system does.
    """
    try:
        real = place.resolve()
    except RuntimeError:
        raise OSError(errno.ELOOP, "its links lead in a circle") from None
    if real.exists() and not real.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, "it is a file")
    real.parent.mkdir(parents=True, exist_ok=True)
    # where the folder lies while it is written: beside its place, on the same disk
    inside = real.is_dir() and (real.is_mount() or not os.access(real.parent, os.W_OK))
    base = real if inside else real.parent
    with _turn(base):
        for candidate in numbered(place) if number else [place]:
            holder = _holder(candidate.resolve())
            if number and (holder or candidate.exists()):
                continue
            if holder:
                raise InputError(
                    f"{place}: another run (process {holder}) is writing it; wait for it, or "
                    "choose another folder with --out"
                )
            if candidate.is_dir() and any(candidate.iterdir()):
                check(candidate)
            path = base / _part_name(candidate.resolve().name)
            path.mkdir()
            return OwnFolder(candidate, path, _locked(path), ours)
    raise AssertionError("names never end")


def numbered(place: Path) -> Iterator[Path]:
    """NAME, NAME-2, NAME-3 and so on."""
    yield place
    for k in count(2):
        yield place.with_name(f"{place.name}-{k}")


def _part_name(name: str) -> str:
    return f".{name}.part-{os.getpid()}-{uuid.uuid4().hex[:8]}"


def _locked(folder: Path) -> int | None:
    """A descriptor that holds the folder's lock; None where locks do not work (some network disks).

    Raises BlockingIOError when another process holds it.
    """
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(descriptor)
        if error.errno in (errno.EAGAIN, errno.EACCES):
            raise BlockingIOError(error.errno, "held") from None
        return None
    return descriptor


@contextmanager
def _turn(base: Path) -> Iterator[None]:
    """One process at a time takes places in ``base``; where locks do not work, all at once."""
    descriptor = os.open(base, os.O_RDONLY)
    try:
        with suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _holder(place: Path) -> str:
    """Process that has taken the place, "" when none has; what killed ones left is removed."""
    holder = ""
    for base in (place.parent, place):
        for part in base.glob(".*.part-*"):
            found = _PART.match(part.name)
            if found is None or found["name"] != place.name:
                continue
            try:
                lock = _locked(part)
            except BlockingIOError:
                holder = found["process"]
                continue
            if lock is not None:
                shutil.rmtree(part, ignore_errors=True)
                os.close(lock)
    return holder


def _replace(part: Path, place: Path, ours: Ours) -> None:
    """Put ``part`` into ``place``.

    By renaming where that leaves nobody without a folder; else what is ours leaves and the files
    move one by one.
    """
    inside = part.parent == place
    there = list(place.iterdir()) if place.is_dir() else []
    here = place in (Path.cwd(), *Path.cwd().parents)
    if inside or here or not all(map(ours, there)):
        new = sorted(part.iterdir(), key=lambda entry: (entry.name == "summary.json", entry.name))
        taken = [e.name for e in new if (place / e.name).exists() and not ours(place / e.name)]
        if taken:
            raise FileExistsError(errno.EEXIST, f"{', '.join(taken)} in it is not ours")
        for entry in place.iterdir():
            if entry != part and ours(entry):
                shutil.rmtree(
                    entry
                ) if entry.is_dir() and not entry.is_symlink() else entry.unlink()
        for entry in new:
            entry.rename(place / entry.name)
        part.rmdir()
        return
    if not there:
        # An empty folder is replaced, a missing one made.
        part.rename(place)
        return
    # Whoever is killed now leaves it to the next call to remove.
    old = part.with_name(_part_name(place.name))
    place.rename(old)
    try:
        part.rename(place)
    except OSError:
        old.rename(place)
        raise
    shutil.rmtree(old, ignore_errors=True)
