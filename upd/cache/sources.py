"""What numbers depend on beside their input.

Our sources, a user's recipe file, and the versions of the libraries.
"""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Iterable, Mapping
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

#: libraries that numbers depend on
_LIBRARIES = ("numpy", "scipy", "scikit-fem", "gmsh", "pyamg", "numba", "pypardiso", "mkl")
#: packages whose version a run writes into its log
_LOGGED = ("numpy", "scipy", "scikit-fem", "gmsh", "pypardiso")


def our_sources(root: Path | None = None) -> list[Path]:
    """All Python files of the packages upd and geometry under ``root`` (that of this installation
    when None), sorted.
    """
    top = Path(__file__).resolve().parents[2] if root is None else root
    return sorted(file for package in ("upd", "geometry") for file in (top / package).rglob("*.py"))


def digest_of(files: Iterable[Path], root: Path) -> str:
    """SHA-256 of the names, relative to ``root``, and the contents of ``files``."""
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.relative_to(root).as_posix().encode())
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


@cache
def _ours() -> str:
    return digest_of(our_sources(), Path(__file__).resolve().parents[2])


@cache
def _libraries() -> str:
    return json.dumps({name: version_of(name) for name in _LIBRARIES})


def source_digest(recipe: str = "") -> str:
    """SHA-256 of our sources, of the libraries' versions, and of a user's ``recipe`` when that is
    the path of a file.

    Raises
    ------
    OSError
        When the recipe's file cannot be read.
    """
    digest = hashlib.sha256(f"{_ours()}{_libraries()}".encode())
    if recipe.lower().endswith((".py", ".msh", ".inp")):
        digest.update(Path(recipe).read_bytes())
    return digest.hexdigest()


def key_of(data: Mapping[str, Any]) -> str:
    """SHA-256 of a plain mapping, whatever the order of its entries."""
    return hashlib.sha256(json.dumps(data, sort_keys=True, default=str).encode()).hexdigest()


def version_of(package: str) -> str:
    """Version of an installed package, or "none"."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "none"


def versions() -> dict[str, str]:
    """Versions of what computes.

    This package, Python, and the libraries under it that are installed.
    """
    found = {name: version_of(name) for name in ("upd", *_LOGGED)}
    return {"upd": found.pop("upd"), "python": platform.python_version()} | {
        name: v for name, v in found.items() if v != "none"
    }
