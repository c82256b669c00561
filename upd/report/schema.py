"""What the JSON files of a folder must have, checked once where they are read."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from upd.errors import InputError
from upd.results import Case

Kind = Literal["run", "sweep"]
#: kind of a folder -> what makes its files again
_AGAIN: dict[Kind, str] = {
    "run": "run the scene again",
    "sweep": "start the same sweep again, finished points are kept",
}
#: faults of a file that a message names
_MOST = 4


@dataclass
class _EffectEntry:
    name: str
    on: bool
    why: str
    verdict: str
    applies: bool = True


@dataclass
class _CheckEntry:
    name: str
    case: str
    case_fields: Case
    value: float | None
    limit: float | None
    says: str
    verdict: Literal["passed", "warning", "failed"]
    remedy: str = ""
    fatal: bool = True
    quantity: str = ""
    without: float | None = None
    included: float | None = None


@dataclass
class _ErrorPartEntry:
    source: str
    error: float | None
    basis: str
    half_cost_s: float | None = None
    companion_s: float | None = None
    half_why: str = ""


@dataclass
class _InputPartEntry:
    path: str
    half_width: float | None
    share: float | None
    change: float | None
    basis: str


@dataclass
class _NumberEntry:
    name: str
    case: str
    case_fields: Case
    value: float | None
    unit: str
    reference: float | None
    source: str = ""
    error: float | None = None
    thesis_error: float | None = None
    estimated_error: float | None = None
    half_error_cost_s: float | None = None
    error_parts: list[_ErrorPartEntry] = field(default_factory=list)
    input_error: float | None = None
    input_parts: list[_InputPartEntry] = field(default_factory=list)
    withheld: str = ""


@dataclass
class _Size:
    symmetry: str = ""
    n_dof: dict[str, int] = field(default_factory=dict)
    n_pairs: int | None = None
    analysis: str = ""
    mesh: dict[str, Any] = field(default_factory=dict)
    solver: dict[str, Any] = field(default_factory=dict)


@dataclass
class _Cost:
    total_s: float
    peak_rss_mb: float
    stages: dict[str, float] = field(default_factory=dict)


@dataclass
class Summary:
    """What summary.json must have; there may be more."""

    scene: str
    title: str
    status: str
    effects: list[_EffectEntry]
    checks: list[_CheckEntry]
    size: _Size
    cost: _Cost
    results: list[_NumberEntry]
    result_nc_sha256: str = ""


def read_json(path: Path, schema: type, kind: Kind) -> dict[str, Any]:
    """The content of a JSON file of a folder that `upd run` or `upd sweep` wrote.

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
    # pydantic is slow to import: only when a folder is read
    from pydantic import TypeAdapter, ValidationError

    try:
        text = path.read_text("utf-8")
        found = json.loads(text)
        TypeAdapter(schema).validate_json(text, strict=True)
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
        raise damaged_file(path, dict.fromkeys(places), kind) from None
    except (ValueError, RecursionError) as problem:
        raise InputError(f"{path}: is not JSON ({problem}); {_AGAIN[kind]}") from None
    return dict(found)


def damaged_file(path: Path, places: Iterable[str], kind: Kind) -> InputError:
    """The error of a file that is damaged in these places."""
    names = list(places)
    more = f" and {len(names) - _MOST} more" if len(names) > _MOST else ""
    return InputError(f"{path}: is damaged in {', '.join(names[:_MOST])}{more}; {_AGAIN[kind]}")
