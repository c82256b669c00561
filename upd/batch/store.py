"""The folder of a batch: a file per finished point under the hash of all it depends on, so that a
killed batch takes up where it stood.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from upd.batch.point import Task
from upd.cache.files import locked, write_text
from upd.errors import InputError, UpdError
from upd.vary.outcome import Outcome, read_outcome

#: the grid of a sweep or the draw of its sample, from its first moment on
GRID = "grid.json"
#: key of a point's file: SHA-256 of the rest
_DIGEST = "sha256"
#: files of which one stands in every folder of a sweep or study
_OURS = {".lock", GRID, "sweep.json", "study.json"}


@dataclass(frozen=True)
class PointStore:
    """Finished points in ``folder``/points.

    Attributes
    ----------
    what
        What the folder belongs to, for messages: "sweep" or "study".
    """

    folder: Path
    what: str

    def path(self, task: Task) -> Path:
        """File of the task's outcome."""
        return self.folder / "points" / f"{task.key()}.json"

    def finished(self, tasks: Sequence[Task]) -> dict[int, Outcome]:
        """Number of the task -> outcome kept by an earlier call.

        A damaged or edited file, or one whose point is to be tried again, counts as none.
        """
        found = ((number, _read(self.path(task))) for number, task in enumerate(tasks))
        return {
            number: outcome for number, outcome in found if outcome is not None and outcome.final
        }

    def keep(self, task: Task, outcome: Outcome) -> None:
        """Keep a final outcome. Raises UpdError when the disk does not take it."""
        if outcome.final:
            with self.writing():
                data = json.loads(outcome.text())
                write_text(self.path(task), json.dumps(data | {_DIGEST: _digest(data)}) + "\n")

    def check(self) -> None:
        """Raise InputError where the folder cannot be written, or has other things in it."""
        there = set[str]()
        with suppress(OSError):
            # Missing, or a file: whoever writes into it reports that.
            there = {entry.name for entry in self.folder.iterdir()}
        # Points alone were copied there to keep what is solved.
        if there and there != {"points"} and not there & _OURS:
            raise InputError(
                f"the folder {self.folder} is not empty and holds no {self.what}: choose another "
                "with --out, or empty it"
            )
        if self.what == "study" and there & {GRID, "sweep.json"}:
            raise InputError(
                f"the folder {self.folder} holds a sweep: choose another with --out for the study"
            )
        try:
            places = (self.folder.resolve(), *self.folder.resolve().parents)
        except RuntimeError:
            raise self._refused("its links lead in a circle") from None
        place = next(place for place in places if place.exists())
        if not place.is_dir() or not os.access(place, os.W_OK):
            raise self._refused(f"{place}: no folder, or no permission")

    @contextmanager
    def sole(self) -> Iterator[None]:
        """The folder, made and locked: two at once would solve everything twice.

        Raises
        ------
        InputError
            When the folder cannot be written, or another sweep or study holds it.
        """
        self.check()
        try:
            (self.folder / "points").mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise self._refused(error.strerror) from None
        with ExitStack() as stack:
            try:
                stack.enter_context(locked(self.folder / ".lock", wait=False))
            except BlockingIOError:
                raise InputError(
                    f"another {self.what} is running in {self.folder}: wait for it, or "
                    "choose another folder with --out"
                ) from None
            yield

    @contextmanager
    def writing(self) -> Iterator[None]:
        """What goes wrong with the disk in this block as UpdError, with its remedy."""
        try:
            yield
        except OSError as error:
            raise UpdError(
                f"the {self.what} folder {self.folder} cannot be written any more "
                f"({error.strerror or error}): finished points are kept "
                "there. Make room or give write permission, then start the same "
                f"{self.what}: only what is missing runs"
            ) from None

    def sole_grid(self, grid: Mapping[str, Any]) -> None:
        """Leave the grid of a sweep in the folder, which the caller holds.

        Raises
        ------
        InputError
            When the folder has the results of another grid: they stay.
        """
        file = self.folder / GRID
        try:
            earlier = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            earlier = grid
        if earlier != grid:
            axes = (f"{one['path']}={','.join(map(str, one['values']))}" for one in earlier["axes"])
            what, drawn = " and ".join(axes), earlier.get("sample")
            if drawn:
                what = f"a sample of {drawn['count']} with seed {drawn['seed']}"
            differs = "" if earlier["axes"] != grid["axes"] else ", of a scene with other values"
            raise InputError(
                f"the sweep folder {self.folder} holds another sweep "
                f"({earlier['scene']}, {what}{differs}): "
                "choose another folder with --out (copy its points/ there to keep what is solved), "
                "or delete it"
            )
        with self.writing():
            write_text(file, json.dumps(grid, indent=1) + "\n")

    def kept_seed(self) -> int:
        """The seed of the sample that the folder holds; 0 where it holds none."""
        try:
            return int(json.loads((self.folder / GRID).read_text("utf-8"))["sample"]["seed"])
        except (OSError, ValueError, TypeError, KeyError):
            return 0

    def _refused(self, why: str | None) -> InputError:
        return InputError(
            f"the {self.what} folder {self.folder} cannot be written ({why}): choose another with "
            "--out"
        )


def _digest(data: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(data).encode()).hexdigest()


def _read(path: Path) -> Outcome | None:
    """The outcome in a file; None of one that is not there, damaged or edited."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        known = data.pop(_DIGEST)
        return read_outcome(json.dumps(data)) if known == _digest(data) else None
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None
