"""A run folder as it lies on disk: summary, arrays, figures, scene, log.

Nothing of it is trusted to be whole.
"""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from PIL import Image

from upd.cache.files import json_text
from upd.errors import InputError, one_line
from upd.labels import listed
from upd.results import Arrays, Group, read_netcdf

_LOG_LINE = re.compile(
    r"^(?P<time>\S+ \S+) (?P<level>[A-Z]+) +(?P<where>\S+): (?P<text>.*)$", re.MULTILINE
)
#: key of a JSON file: SHA-256 of what else it has
_DIGEST = "sha256"
#: names of the figures a run may leave or left once, without their ending
_FIGURES = (
    "pressure pressure_sections force_approach over_load stick_slip traction hysteresis "
    "contact_open surface force_displacement contact_law response response_harmonics damping "
    "contact_state contact_map damper_motion damper_period seating performance nonlinear_modes "
    "modes_free modes_glued dimensions nodal_diameters campbell interference"
)
#: names that the operating system or a viewer leaves
_NOBODYS = (".DS_Store", "Thumbs.db", "desktop.ini")
#: What a run may write, whatever its analysis; all that may be removed when a run replaces another.
_RUN_FILES = (
    *("scene.toml", "run.log", "summary.json", "result.nc", "report.html", "mesh.vtu"),
    *("fields.vtu", "modes_*.vtu", "reduced_*.nc", *_NOBODYS),
    *(f"{name}.png" for name in _FIGURES.split()),
)
#: what it may write into folders of its own
_INNER_FILES = ("curves/*.csv", "matrices/reduced_*", *_NOBODYS)
#: kind of values -> keys of summary.json
_SUMMARY = {str: "scene title status", list: "effects checks results", dict: "size cost"}
_TEXT = partial(Path.read_text, encoding="utf-8")
Kept = TypeVar("Kept")


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


def is_run_file(entry: Path) -> bool:
    """Whether an entry of a run folder, a file or a folder with all it holds, is one that runs
    write.
    """
    if entry.is_symlink() or not entry.is_dir():
        return not entry.is_symlink() and any(map(entry.match, _RUN_FILES))
    inner = list(entry.iterdir())
    return bool(inner) and all(one.is_file() and any(map(one.match, _INNER_FILES)) for one in inner)


def check_replaceable(folder: Path) -> None:
    """Raise InputError unless ``folder`` holds a run and nothing else, so that another may replace
    it.
    """
    foreign = sorted(entry.name for entry in folder.iterdir() if not is_run_file(entry))
    if foreign or not (folder / "run.log").is_file():
        what = listed(foreign, 3, "what no run wrote ({})") or "no run"
        raise InputError(
            f"the folder {folder} holds {what}: choose another with --out, or move that away"
        )


def read_run(folder: Path, *, whole: bool = False) -> RunFolder:
    """Read ``folder``; what is missing beside summary.json is named in ``missing``.

    Raises InputError when there is no summary, and for a damaged result.nc where ``whole``.
    """
    summary = read_json(folder / "summary.json", _SUMMARY, "run")
    missing: list[str] = []

    def part(file: Path, read: Callable[[Path], Kept], default: Kept) -> Kept:
        try:
            return read(file)
        except (OSError, ValueError, SyntaxError) as problem:
            missing.append(f"{file.name}: cannot be read ({one_line(problem)})")
            return default

    arrays: dict[str, Group] = part(folder / "result.nc", read_netcdf, {})
    if whole and missing and (folder / "result.nc").exists():
        raise InputError(f"{folder}/{missing[0]}")
    none: tuple[str, dict[str, Any]] = "", {}
    scene, scene_file = part(folder / "scene.toml", _toml, none)
    pictures = {f.stem: part(f, _picture, None) for f in sorted(folder.glob("*.png"))}
    return RunFolder(
        path=folder,
        summary=summary | {"scene_file": scene_file},
        arrays=arrays,
        figures={name: file for name, file in pictures.items() if file is not None},
        scene=scene,
        log=tuple(_LOG_LINE.finditer(part(folder / "run.log", _TEXT, ""))),
        missing=tuple(missing),
    )


def _toml(path: Path) -> tuple[str, dict[str, Any]]:
    """Text and tables of a TOML file. Raises ValueError where it is none."""
    text = _TEXT(path)
    return text, tomllib.loads(text)


def _picture(path: Path) -> Path | None:
    """A PNG file. Raises OSError or SyntaxError where it is damaged."""
    with Image.open(path, formats=["PNG"]) as image:
        image.verify()
    return path


def sealed(data: Mapping[str, Any]) -> str:
    """Data as JSON with its SHA-256, by which a file that was changed is known."""
    return json_text({**data, _DIGEST: hashlib.sha256(json_text(data).encode()).hexdigest()})


def read_json(path: Path, keys: Mapping[Any, str], kind: str) -> dict[str, Any]:
    """The content of a JSON file of a folder that `upd run` or `upd sweep` wrote.

    Parameters
    ----------
    path
        Of the file.
    keys
        What it must have, by the kind of the values; there may be more.
    kind
        Of the folder: run or sweep.

    Raises
    ------
    InputError
        When there is none, something of it is missing, or it was changed.
    """
    again = f"call upd {kind} again"
    try:
        found = json.loads(path.read_text("utf-8"))
        names = [(name, of) for of, mine in keys.items() for name in mine.split()]
        missing = [name for name, of in names if not isinstance(found.get(name), of)]
        # folders of earlier versions have no digest
        rest = {key: found[key] for key in found if key != _DIGEST}
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(
            f"{path.parent}: is no {kind} folder (it has no {path.name}); give the folder "
            f"`upd {kind}` wrote"
        ) from None
    except OSError as problem:
        raise InputError(f"{path}: cannot be read ({one_line(problem)})") from None
    except (ValueError, AttributeError, RecursionError) as problem:
        raise InputError(f"{path}: is not JSON of a {kind} ({problem}); {again}") from None
    if missing:
        raise InputError(f"{path}: is damaged in {', '.join(missing)}; {again}")
    if _DIGEST in found and json_text(found) != sealed(rest):
        raise InputError(f"{path}: is not as upd {kind} wrote it (SHA-256); {again}")
    return rest
