"""A run folder as it lies on disk: summary, arrays, figures, scene, log.

Nothing of it is trusted to be whole.
"""

from __future__ import annotations

import fnmatch
import hashlib
import json
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeVar

from pydantic import TypeAdapter, ValidationError

from upd.cache.files import json_text
from upd.cache.folders import plain_name
from upd.errors import InputError
from upd.labels import sentence
from upd.results import Arrays, read_netcdf

_LOG_LINE = re.compile(r"^(?P<time>\S+ \S+) (?P<level>[A-Z]+) +(?P<where>\S+): (?P<text>.*)$")
_VERSIONS = "versions: "
#: key of a JSON file: SHA-256 of what else it has
_DIGEST = "sha256"
_PNG = b"\x89PNG\r\n\x1a\n"
#: names of the figures a run may leave, without their ending
FIGURES = (
    "pressure",
    "pressure_sections",
    "force_approach",
    "stick_slip",
    "traction",
    "hysteresis",
    "contact_open",
    "surface",
    "force_displacement",
    "contact_law",
    "response",
    "response_harmonics",
    "damping",
    "contact_state",
    "contact_map",
    "damper_motion",
    "damper_period",
    "seating",
    "performance",
    "nonlinear_modes",
    "modes_free",
    "modes_glued",
    "dimensions",
    "nodal_diameters",
    "campbell",
    "interference",
)
#: What a run may write, whatever its analysis; all that may be removed when a run replaces another.
RUN_FILES = (
    "scene.toml",
    "run.log",
    "summary.json",
    "result.nc",
    "report.html",
    "mesh.vtu",
    "fields.vtu",
    "modes_*.vtu",
    "reduced_*.nc",
    "matrices/reduced_*",
    "curves/*.csv",
    *(f"{name}.png" for name in FIGURES),
)
#: names that the operating system or a viewer leaves
_NOBODYS = (".DS_Store", "Thumbs.db", "desktop.ini")
Kind = Literal["run", "sweep"]
Kept = TypeVar("Kept")
#: kind of a folder -> what makes its files again
_AGAIN: dict[Kind, str] = {
    "run": "run the scene again",
    "sweep": "start the same sweep again, finished points are kept",
}
#: faults of a file that a message names
_MOST = 4


@dataclass(frozen=True)
class RunFolder:
    """Content of a run folder.

    Attributes
    ----------
    summary
        Summary.json, with the scene file's tables under "scene_file".
    figures
        Name without ending -> PNG file, in alphabetical order.
    log
        Lines of run.log with their time, level, where and text.
    missing
        Files that could not be read, each with the reason.
    """

    path: Path
    summary: Mapping[str, Any]
    arrays: Arrays
    figures: Mapping[str, Path]
    scene: str
    log: tuple[re.Match[str], ...]
    missing: tuple[str, ...]

    @property
    def origin(self) -> str:
        """Its name, when the run began and with which packages, by its log."""
        found = (line["text"] for line in self.log if line["text"].startswith(_VERSIONS))
        versions = sentence(next(found, ""))
        started = f", run on {self.log[0]['time'].partition(',')[0]}" if self.log else ""
        return f"Run folder {plain_name(self.path)}{started}. {versions}".rstrip()


def is_run_file(entry: Path) -> bool:
    """Whether an entry of a run folder, a file or a folder with all it holds, is one that runs
    write.
    """
    if entry.is_symlink():
        return False
    if entry.is_dir():
        inner = list(entry.iterdir())
        return bool(inner) and all(
            one.is_file() and _is_known(f"{entry.name}/{one.name}") for one in inner
        )
    return _is_known(entry.name)


def _is_known(name: str) -> bool:
    return name in _NOBODYS or any(
        name.count("/") == pattern.count("/") and fnmatch.fnmatchcase(name, pattern)
        for pattern in RUN_FILES
    )


def check_replaceable(folder: Path) -> None:
    """Raise InputError unless ``folder`` holds a run and nothing else, so that another may replace
    it.
    """
    foreign = sorted(entry.name for entry in folder.iterdir() if not is_run_file(entry))
    if not _is_run(folder):
        raise InputError(
            f"the folder {folder} is not empty and holds no run: choose another with --out, or "
            "empty it"
        )
    if foreign:
        shown = ", ".join(foreign[:3]) + (f" and {len(foreign) - 3} more" * (len(foreign) > 3))
        raise InputError(
            f"the run folder {folder} also holds what no run wrote ({shown}): move that away, or "
            "choose another folder with --out"
        )


def _is_run(folder: Path) -> bool:
    """Whether the log is one of a run, or the summary can be read."""
    try:
        with (folder / "run.log").open(encoding="utf-8") as file:
            found = _LOG_LINE.match(file.readline().rstrip("\n"))
        if found and found["text"].startswith(_VERSIONS):
            return True
    except (OSError, UnicodeDecodeError):
        pass
    try:
        return bool(_summary(folder))
    except InputError:
        return False


def read_run(folder: Path, *, whole: bool = False) -> RunFolder:
    """Read ``folder``; what is missing beside summary.json is named in ``missing``.

    Raises InputError when there is no summary, and for a damaged result.nc where ``whole``.
    """
    summary = _summary(folder)
    missing: list[str] = []
    scene = _text(folder / "scene.toml", missing)
    tables: dict[str, Any] = {}
    try:
        tables = tomllib.loads(scene)
    except tomllib.TOMLDecodeError as problem:
        missing.append(f"scene.toml: is not TOML ({problem})")
    arrays: Arrays = {}
    if (folder / "result.nc").exists():
        try:
            arrays = read_netcdf(folder / "result.nc")
        except OSError as problem:
            if whole:
                raise InputError(f"{folder / 'result.nc'}: cannot be read ({problem})") from None
            missing.append(f"result.nc: cannot be read ({problem})")
    else:
        missing.append("result.nc: is not there, so there are no curves")
    pictures = {f.stem: f for f in sorted(folder.glob("*.png"))}
    figures = {name: f for name, f in pictures.items() if is_png(f)}
    missing += [f"{f.name}: is no PNG file" for name, f in pictures.items() if name not in figures]
    log = _text(folder / "run.log", missing).splitlines()
    return RunFolder(
        path=folder,
        summary=summary | {"scene_file": tables},
        arrays=arrays,
        figures=figures,
        scene=scene,
        log=tuple(filter(None, map(_LOG_LINE.match, log))),
        missing=tuple(missing),
    )


def _summary(folder: Path) -> dict[str, Any]:
    return read_json(folder / "summary.json", _Summary, "run")[0]


def _text(path: Path, missing: list[str]) -> str:
    try:
        return path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as problem:
        missing.append(
            f"{path.name}: cannot be read ({getattr(problem, 'strerror', None) or problem})"
        )
        return ""


def is_png(path: Path) -> bool:
    """Whether a file can be read and begins as every PNG does."""
    try:
        with path.open("rb") as file:
            return file.read(len(_PNG)) == _PNG
    except OSError:
        return False


# ---------------------------------------------------------------- JSON files, checked once


@dataclass
class _Summary:
    """What summary.json must have; there may be more, and its digest holds all of it."""

    scene: str
    title: str
    status: str
    effects: list[dict[str, Any]]
    checks: list[dict[str, Any]]
    size: dict[str, Any]
    cost: dict[str, Any]
    results: list[dict[str, Any]]


def sealed(data: Mapping[str, Any]) -> str:
    """Data as JSON with its SHA-256, by which a file that was changed is known."""
    return json_text({**data, _DIGEST: hashlib.sha256(json_text(data).encode()).hexdigest()})


def read_json(path: Path, schema: type[Kept], kind: Kind) -> tuple[dict[str, Any], Kept]:
    """The content of a JSON file of a folder that `upd run` or `upd sweep` wrote: all there is,
    and what must be there.

    Parameters
    ----------
    path
        Of the file.
    schema
        Dataclass of what it must have; there may be more.
    kind
        Of the folder.

    Raises
    ------
    InputError
        When there is none, or something of it is missing or of another kind.
    """
    try:
        text = path.read_text("utf-8")
        found = json.loads(text)
        checked = TypeAdapter(schema).validate_json(text, strict=True)
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(
            f"{path.parent}: is no {kind} folder (it has no {path.name}); give the folder "
            f"`upd {kind}` wrote"
        ) from None
    except OSError as problem:
        raise InputError(
            f"{path}: cannot be read ({problem.strerror}); check its permissions"
        ) from None
    except ValidationError as problem:
        places = [".".join(map(str, e["loc"])) or "the whole" for e in problem.errors()]
        names = list(dict.fromkeys(places))
        more = f" and {len(names) - _MOST} more" if len(names) > _MOST else ""
        raise InputError(
            f"{path}: is damaged in {', '.join(names[:_MOST])}{more}; {_AGAIN[kind]}"
        ) from None
    except (ValueError, RecursionError) as problem:
        raise InputError(f"{path}: is not JSON ({problem}); {_AGAIN[kind]}") from None
    # folders of earlier versions have no digest
    if _DIGEST in found and json_text(found) != sealed(
        {k: found[k] for k in found if k != _DIGEST}
    ):
        raise InputError(f"{path}: is not as upd {kind} wrote it (SHA-256); {_AGAIN[kind]}")
    return dict(found), checked
