"""What numbers depend on beside their input.

Our sources, a user's recipe file, and the versions of the libraries.
"""

from __future__ import annotations

import ast
import hashlib
import json
import platform
import sys
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

#: libraries that numbers depend on
_LIBRARIES = ("numpy", "scipy", "scikit-fem", "gmsh", "pyamg", "numba", "pypardiso", "mkl")
#: folders in which packages are installed
_PACKAGES = frozenset({"site-packages", "dist-packages"})
#: where the packages upd and geometry are
_HOME = Path(__file__).resolve().parents[2]
#: folders of the environment and of this program; geometry lies inside upd in a wheel
_HOMES = tuple(
    Path(home).resolve()
    for home in (sys.prefix, sys.base_prefix, _HOME / "upd", _HOME / "geometry")
)
#: packages whose version a run writes into its log
_LOGGED = ("numpy", "scipy", "scikit-fem", "gmsh", "pypardiso")


@cache
def digest_of(root: Path) -> str:
    """SHA-256 of the names, relative to ``root``, and the contents of all Python files of the
    packages upd and geometry there.
    """
    digest = hashlib.sha256()
    files = (file for package in ("upd", "geometry") for file in (root / package).rglob("*.py"))
    for file in sorted(files):
        digest.update(file.relative_to(root).as_posix().encode())
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


@cache
def library_versions() -> str:
    return json.dumps({name: version_of(name) for name in _LIBRARIES})


def source_digest(recipe: str = "") -> str:
    """SHA-256 of our sources, of the libraries' versions, and of a user's ``recipe`` when that is
    the path of a file, with all that it imports from outside the environment.

    Raises
    ------
    OSError
        When the recipe's file cannot be read.
    """
    digest = hashlib.sha256(f"{digest_of(_HOME)}{library_versions()}".encode())
    if recipe.lower().endswith((".py", ".msh", ".inp")):
        for file in user_files(Path(recipe)):
            digest.update(file.read_bytes())
    return digest.hexdigest()


def user_files(recipe: Path) -> list[Path]:
    """A user's file, and of a .py file all modules outside the environment that it imports, itself
    or through others.

    Raises
    ------
    OSError
        When one of them cannot be read.
    """
    found, wanted = list[Path](), [recipe.resolve()]
    while wanted:
        file = wanted.pop()
        if file in found:
            continue
        found.append(file)
        own = file.suffix == ".py" and not _installed(file)
        for name in _imported(file.read_bytes()) if own else ():
            for folder in (file.parent, *map(Path, sys.path)):
                place = folder.joinpath(*name.split("."))
                both = (place.with_suffix(".py"), place / "__init__.py")
                files = [one.resolve() for one in both if one.is_file()]
                wanted += [one for one in files if not _installed(one)]
    return found


@cache
def _imported(source: bytes) -> list[str]:
    """Modules that a file with this content imports, and what may be one."""
    found: list[str] = []
    with suppress(SyntaxError, ValueError):
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.Import):
                found += [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                found += [node.module, *(f"{node.module}.{a.name}" for a in node.names)]
    return list(dict.fromkeys(found))


def _installed(file: Path) -> bool:
    """Whether a module, its path resolved, is of the environment or of this program."""
    return not _PACKAGES.isdisjoint(file.parts) or any(map(file.is_relative_to, _HOMES))


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
