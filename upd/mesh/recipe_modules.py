"""Where a recipe's code comes from: the geometry package, a user's file, or a mesh."""

from __future__ import annotations

import functools
import hashlib
import importlib
import importlib.util
import logging
import sys
import traceback
from contextlib import suppress
from pathlib import Path
from types import ModuleType

from upd.cache.arrays import cache_folder
from upd.cache.sources import user_files
from upd.errors import InputError, did_you_mean

log = logging.getLogger(__name__)

#: endings of mesh files
MESH_ENDINGS = (".msh", ".inp")
#: ready recipes, modules of the geometry package
READY = ("sphere_block", "wedge_platform", "pads_platform", "blade_rig", "sector")


#: our geometry package lies beside ours, or inside it in a wheel
_HOME = Path(__file__).resolve().parents[1]
_GEOMETRY = (_HOME if (_HOME / "geometry").is_dir() else _HOME.parent) / "geometry/__init__.py"


def is_file(recipe: str) -> bool:
    """Whether a recipe is named by its file: .py, or a mesh (.msh, .inp)."""
    return recipe.lower().endswith((".py", *MESH_ENDINGS))


def is_mesh(recipe: str) -> bool:
    """Whether a recipe is a mesh file (.msh, .inp), which has no parameters of its geometry."""
    return recipe.lower().endswith(MESH_ENDINGS)


def module_of(recipe: str) -> ModuleType:
    """The recipe's module: a ready one, a user's file as it was run, or what stands for a mesh.

    Raises InputError for a recipe that is not known, cannot be read or fails.
    """
    if recipe.endswith(".py"):
        return _user_module(Path(recipe))
    if is_mesh(recipe):
        digest = hashlib.sha256(_content(Path(recipe), "a mesh")).hexdigest()
        return _read_mesh(str(Path(recipe).resolve()), digest)
    if recipe not in READY:
        ready = f"ready: {', '.join(READY)}, or the path of a .py file or of a mesh (.msh, .inp)"
        raise InputError(f"recipe {recipe!r}: is not known{did_you_mean(recipe, READY, ready)}")
    return geometry_module(recipe)


def geometry_module(name: str) -> ModuleType:
    """Module `name` of our geometry package.

    The package lies beside ours, or inside it in a wheel. It is loaded from its place, so that
    files of that name elsewhere do not matter. Raises InputError when another module of that name
    has been imported before.
    """
    known = sys.modules.get("geometry")
    if known is None:
        spec = importlib.util.spec_from_file_location("geometry", _GEOMETRY)
        assert spec is not None and spec.loader is not None
        known = sys.modules["geometry"] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(known)
    origin = getattr(known, "__file__", None) or "another module"
    if origin != str(_GEOMETRY) and Path(origin).resolve() != _GEOMETRY:
        raise InputError(
            f"recipes: upd's package 'geometry' is hidden by {origin}: rename that file or start "
            "elsewhere"
        )
    return importlib.import_module(f"geometry.{name}")


def _content(path: Path, what: str) -> bytes:
    """What the user's file holds. Raises InputError where it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as problem:
        raise InputError(
            f"recipe {str(path)!r}: cannot be read ({problem.strerror}); give the path of {what}"
        ) from None


@functools.lru_cache(maxsize=4)
def _read_mesh(path: str, digest: str) -> ModuleType:
    """The user's mesh file as a recipe, read afresh whenever its content changed."""
    from upd.mesh.own_mesh import recipe_of  # few recipes are meshes

    del digest
    return recipe_of(Path(path), geometry_module("blocks").read_msh)


def _user_module(path: Path) -> ModuleType:
    """The user's recipe file, run afresh when its text or that of a module it imports changed."""
    source = _content(path, "a .py file")
    geometry_module("blocks")  # a recipe imports from our package: say so first when it is hidden
    files = user_files(path)
    content = b"".join(file.read_bytes() for file in files)
    name = f"upd_recipe_{hashlib.sha256(str(path.resolve()).encode() + content).hexdigest()[:16]}"
    if name in sys.modules:
        return sys.modules[name]
    # what it imports may have changed since another recipe imported it
    changed = {str(file) for file in files[1:]}
    for known in [k for k, m in sys.modules.items() if getattr(m, "__file__", "") in changed]:
        del sys.modules[known]
    _warn_first(path, name)
    # dataclasses and typing look the module up by name
    module = sys.modules[name] = ModuleType(name)
    module.__file__ = str(path.resolve())
    try:
        exec(compile(source, str(path), "exec"), module.__dict__)
    except (Exception, SystemExit) as problem:
        del sys.modules[name]
        raise InputError(
            f"recipe {str(path)!r}: fails when it is run{line_of(str(path), problem)}: "
            f"{type(problem).__name__}: {problem}; to fix it: correct it there"
        ) from problem
    return module


def _warn_first(path: Path, name: str) -> None:
    """Say that a scene runs the code of a file, the first time it does so on this machine."""
    if (mark := cache_folder() / "recipes" / name).exists():
        return
    log.warning(
        "the scene runs the Python code of %s, which may do whatever you may: read it when it is "
        "not your own (printed once, until the file changes)",
        path,
    )
    with suppress(OSError):
        mark.parent.mkdir(parents=True, exist_ok=True)
        mark.touch()


def line_of(recipe: str, problem: BaseException) -> str:
    """The last line of the recipe on the way to the problem, in words."""
    own = str(Path(recipe).resolve())
    lines = [
        frame.lineno
        for frame in traceback.extract_tb(problem.__traceback__)
        if str(Path(frame.filename).resolve()) == own
    ]
    return f" in line {lines[-1]}" if lines else ""
