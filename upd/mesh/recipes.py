"""The one door from the library to the geometry.

a recipe's name (or .py file) and its parameters become checked meshes, made only once.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import logging
import typing
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from upd.cache.arrays import cache_folder, load_arrays, save_arrays, unreadable
from upd.cache.sources import source_digest
from upd.errors import InputError, MeshError, OwnMeshError, UpdError, did_you_mean
from upd.mesh import FloatArray
from upd.mesh.checks import check_mesh, check_pairs, scaled_jacobian
from upd.mesh.fields import DamperSizes
from upd.mesh.hexmesh import Mesh
from upd.mesh.recipe_modules import geometry_module, is_file, is_mesh, line_of, module_of
from upd.mesh.section import SectionView, plain_views

#: sets of a mesh by name -> what their arrays hold
_SETS = {"faces": np.int64, "nodes": np.int64, "weights": np.float64}


def load_meshes(where: Path, key: str) -> dict[str, Mesh] | None:
    """Meshes saved under `key`, or None; a damaged file counts as absent."""
    path = where / f"{key}.npz"
    arrays = load_arrays(path)
    if arrays is None:
        return None
    bodies: dict[str, dict[str, Any]] = {}
    try:
        for label, one in arrays.items():
            body, kind, *name = json.loads(label)
            mine = bodies.setdefault(body, {kind: {} for kind in _SETS})
            if name:
                mine[kind][name[0]] = one.astype(_SETS[kind], copy=False)
            else:
                mine[kind] = one.astype(np.int64 if kind == "hexes" else np.float64, copy=False)
        meshes = {body: Mesh(**mine) for body, mine in bodies.items()}
        for mesh in meshes.values():
            if (
                mesh.points.ndim != 2
                or mesh.hexes.ndim != 2
                or (mesh.hexes.size and not 0 <= mesh.hexes.min() <= mesh.hexes.max() < mesh.n_node)
            ):
                raise ValueError("the arrays are not those of a mesh")
    except (KeyError, ValueError, TypeError, IndexError) as problem:
        unreadable(path, problem)
        return None
    return meshes


def save_meshes(where: Path, key: str, meshes: Mapping[str, Mesh]) -> None:
    """Keep `meshes` under `key`; where the folder cannot be written, only a log line.

    Arrays under body, kind and name as JSON, so that any name of a body or a set will do.
    """
    arrays: dict[tuple[str, ...], NDArray[np.generic]] = {}
    for body, mesh in meshes.items():
        arrays |= {(body, "points"): mesh.points, (body, "hexes"): mesh.hexes}
        for kind in _SETS:
            arrays |= {(body, kind, name): one for name, one in getattr(mesh, kind).items()}
    save_arrays(where / f"{key}.npz", {json.dumps(label): one for label, one in arrays.items()})


log = logging.getLogger(__name__)

#: smallest scaled Jacobian a solver is given
LEAST_JACOBIAN = 0.1


# Meshes of users' recipes that no folder keeps, so that a plan does not run these once more for
# each question: that of the plan and that of its coarser companion.
_not_kept: dict[str, dict[str, Mesh]] = {}
_MOST_NOT_KEPT = 2


def build_mesh(
    recipe: str,
    params: Mapping[str, Any],
    *,
    cache_dir: Path | str | None = None,
    progress: Callable[[str], None] | None = None,
) -> tuple[dict[str, Mesh], bool]:
    """Meshes of the bodies of `recipe` (a ready name or the path of a .py file) and whether they
    came from the cache.

    The cache is `cache_dir`, else $UPD_CACHE, else upd/ in $XDG_CACHE_HOME or ~/.cache; a folder
    that cannot be written is done without. `progress` hears one line per stage. Raises InputError
    (recipe, parameters) and MeshError (gmsh, shape, pairing).
    """
    module = module_of(recipe)
    chosen = _chosen(recipe, params)
    say = progress or log.info
    folder = cache_folder(cache_dir)
    key = _key(recipe, module, chosen)
    if key in _not_kept:
        return _not_kept[key], True
    cached = load_meshes(folder, key)
    if cached is not None:
        say(f"{recipe}: meshes taken from {folder}")
        return cached, True
    say(f"{recipe}: meshing")
    meshes = _called(recipe, "build", module.build, chosen)
    try:
        _check(recipe, meshes)
    except MeshError as problem:
        if not is_file(recipe):
            raise
        raise OwnMeshError(f"recipe {recipe!r}: {problem}") from None
    save_meshes(folder, key, meshes)
    if is_file(recipe) and load_meshes(folder, key) is None:
        while len(_not_kept) >= _MOST_NOT_KEPT:
            del _not_kept[next(iter(_not_kept))]
        _not_kept[key] = meshes
    return meshes, False


def parameters(recipe: str) -> type[Any]:
    """The frozen dataclass with the parameters of `recipe`.

    Raises InputError when there is no such recipe.
    """
    module = module_of(recipe)
    if not callable(getattr(module, "build", None)):
        raise InputError(
            f"recipe {recipe!r}: has no function build(params); add one that returns {{name: Mesh}}"
        )
    try:
        hints = typing.get_type_hints(module.build)
    except NameError as problem:
        raise InputError(
            f"recipe {recipe!r}: the annotations of build() cannot be read ({problem})"
        ) from None
    first = next((kind for name, kind in hints.items() if name != "return"), None)
    if not (
        isinstance(first, type)
        and dataclasses.is_dataclass(first)
        and first.__dataclass_params__.frozen  # type: ignore[attr-defined]
    ):
        raise InputError(
            f"recipe {recipe!r}: the parameter of build() must be annotated with a frozen dataclass"
        )
    return first


def count(recipe: str, params: Mapping[str, Any]) -> dict[str, dict[str, int]]:
    """Numbers of "nodes", "hexes" and "contact" nodes of each body.

    From the recipe's count(), or by meshing when it has none.
    """
    module = module_of(recipe)
    if not counted_by_mesh(recipe):
        counted: dict[str, dict[str, int]] = _called(
            recipe, "count", module.count, _chosen(recipe, params)
        )
        keys = {"nodes", "hexes", "contact"}
        if not isinstance(counted, Mapping) or not all(
            isinstance(n, Mapping) and keys <= set(n) for n in counted.values()
        ):
            raise InputError(
                f"recipe {recipe!r}: count() must return body name -> {{'nodes': ..., "
                f"'hexes': ..., 'contact': ...}}"
            )
        return {body: dict(n) for body, n in counted.items()}
    meshes, _ = build_mesh(recipe, params)
    return {
        name: {"nodes": m.n_node, "hexes": m.n_hex, "contact": len(m.nodes.get("contact", ()))}
        for name, m in meshes.items()
    }


def counted_by_mesh(recipe: str) -> bool:
    """Whether the recipe has no count(), so that even a plan needs its mesh."""
    return not hasattr(module_of(recipe), "count")


def sets_of(
    recipe: str, params: Mapping[str, Any], kind: Literal["DISTANT", "WEIGHTED"]
) -> dict[str, tuple[str, ...]]:
    """Body -> names of its sets: distant_... without that beginning, which may be held, or those
    with weights, which hold it in the mean.

    From what the recipe declares, else from its mesh; without weights where a recipe that counts
    its nodes declares none.
    """
    declared = getattr(module_of(recipe), kind, None)
    if isinstance(declared, Mapping):
        return {str(body): tuple(map(str, names)) for body, names in declared.items()}
    if kind == "WEIGHTED" and not counted_by_mesh(recipe):
        return {}
    meshes, _ = build_mesh(recipe, params)
    if kind == "WEIGHTED":
        return {body: tuple(mesh.weights) for body, mesh in meshes.items()}
    return {
        body: tuple(n.removeprefix("distant_") for n in mesh.nodes if n.startswith("distant_"))
        for body, mesh in meshes.items()
    }


def closed_form(recipe: str) -> str:
    """The closed form a recipe declares its geometry has (its CLOSED_FORM), or ""."""
    return str(getattr(module_of(recipe), "CLOSED_FORM", ""))


def analyses(recipe: str) -> tuple[str, ...]:
    """All analyses a recipe declares its geometry is for.

    Its ANALYSIS, a curved contact where it declares none, and what its OTHER_ANALYSES names.
    """
    module = module_of(recipe)
    first = str(getattr(module, "ANALYSIS", "curved contact"))
    return (first, *getattr(module, "OTHER_ANALYSES", ()))


def inclination(recipe: str, params: Mapping[str, Any]) -> tuple[float, float]:
    """Angles in degrees of the damper's left and right contact face to the horizontal.

    Raises InputError when the recipe has none.
    """
    left, right = _declared(recipe, "inclination", "angles of the damper's contact faces")(
        _chosen(recipe, params)
    )
    return float(left), float(right)


def drawing(recipe: str, params: Mapping[str, Any]) -> tuple[dict[str, Mesh], list[SectionView]]:
    """Meshes with few elements, and sections through them with the recipe's dimensions.

    A recipe of the user's own gives its sections by a function views(params); without one they
    show the extents.
    """
    chosen = _chosen(recipe, params)
    if is_file(recipe):
        meshes, _ = build_mesh(recipe, params)
        views = getattr(module_of(recipe), "views", None)
        return meshes, plain_views(meshes) if views is None else _called(
            recipe, "views", views, chosen
        )
    module = geometry_module(f"drawings.{recipe}")
    meshes, _ = build_mesh(recipe, dataclasses.asdict(module.coarse(chosen)))
    views_of: Callable[[Any], list[SectionView]] = module.views
    return meshes, views_of(chosen)


def placement(recipe: str, params: Mapping[str, Any]) -> tuple[FloatArray, FloatArray]:
    """Origin (3,) in mm and unit vectors (3, 3), row by row, of the contact axes in the rig's.

    Raises InputError when there is none.
    """
    origin, axes = _declared(recipe, "placement", "place of the contact in the rig")(
        _chosen(recipe, params)
    )
    return np.asarray(origin, float), np.asarray(axes, float)


def damper_sizes(recipe: str, params: Mapping[str, Any]) -> DamperSizes | None:
    """The damper the parameters describe and its contact; None when the recipe has no
    damper_sizes(params).
    """
    declared = getattr(module_of(recipe), "damper_sizes", None)
    if not callable(declared):
        return None
    found = _called(recipe, "damper_sizes", declared, _chosen(recipe, params))
    if not isinstance(found, DamperSizes):
        raise InputError(
            f"recipe {recipe!r}: damper_sizes() must return geometry.blocks.DamperSizes"
        )
    return found


def _declared(recipe: str, function: str, what: str) -> Callable[[Any], Any]:
    found = getattr(module_of(recipe), function, None)
    if not callable(found):
        raise InputError(f"recipe {recipe!r}: has no {what}; add a function {function}(params)")
    declared: Callable[[Any], Any] = found
    return declared


def _chosen(recipe: str, params: Mapping[str, Any]) -> Any:
    """The parameter object; raises InputError naming every unknown or missing key."""
    cls = parameters(recipe)
    fields = {f.name: f for f in dataclasses.fields(cls) if f.init}
    known = f"known: {', '.join(fields)}"
    problems = [
        f"{key}: unknown parameter{did_you_mean(key, fields, known)}"
        for key in params
        if key not in fields
    ]
    for name, f in fields.items():
        if (
            name not in params
            and f.default is dataclasses.MISSING
            and f.default_factory is dataclasses.MISSING
        ):
            problems.append(f"{name}: is missing; give it a value")
    if problems:
        raise InputError("\n".join(f"{recipe}.{problem}" for problem in problems))
    return made(recipe, params)


def made(recipe: str, params: Mapping[str, Any]) -> Any:
    """The parameter object from its known keys.

    Raises InputError with what is wrong with their values.
    """
    return _called(recipe, "the parameters", parameters(recipe), **params)


def _called(recipe: str, what: str, function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
    """What a recipe's function returns.

    Its own errors, in a user's file, as an InputError with the line they come from.
    """
    try:
        return function(*args, **kwargs)
    except UpdError:
        raise
    except (Exception, SystemExit) as problem:
        if not is_file(recipe):
            raise
        raise InputError(
            f"recipe {recipe!r}: {what} failed{line_of(recipe, problem)}: "
            f"{type(problem).__name__}: {problem}; to fix it: correct it there"
        ) from problem


def has_parameter(recipe: str, name: str) -> bool:
    """Whether a recipe has a parameter of this name."""
    return name in {f.name for f in dataclasses.fields(parameters(recipe))}


def _key(recipe: str, module: ModuleType, chosen: Any) -> str:
    """SHA-256 over all a mesh depends on.

    Sources and libraries, the recipe as it was run, parameters.
    """
    try:
        text = json.dumps(dataclasses.asdict(chosen), sort_keys=True, allow_nan=False)
    except (TypeError, ValueError) as problem:
        raise InputError(
            f"recipe {recipe!r}: a parameter is no number, text, list or table of these ({problem})"
        ) from None
    return hashlib.sha256(f"{source_digest(str(module.__file__))}{text}".encode()).hexdigest()


def _check(recipe: str, meshes: Mapping[str, Mesh]) -> None:
    if (
        not isinstance(meshes, Mapping)
        or not meshes
        or not all(isinstance(mesh, Mesh) for mesh in meshes.values())
    ):
        raise InputError(
            f"recipe {recipe!r}: build() must return a dictionary body name -> upd.mesh.Mesh"
        )
    for name, mesh in meshes.items():
        if is_file(recipe):
            check_mesh(name, mesh)
        jacobian = scaled_jacobian(mesh)
        worst = int(jacobian.argmin())
        if not jacobian[worst] > LEAST_JACOBIAN:
            x, y, z = mesh.points[mesh.hexes[worst]].mean(axis=0)
            raise MeshError(
                f"{name}: hexahedron {worst} about ({x:.4g}, {y:.4g}, {z:.4g}) mm "
                f"has the scaled Jacobian {jacobian[worst]:.3g}, "
                f"more than {LEAST_JACOBIAN:g} is needed ({int((jacobian <= 0.0).sum())} of "
                f"{mesh.n_hex} are inverted): "
                + (
                    "mesh it anew there, with nodes in the file's order of corners"
                    if is_mesh(recipe)
                    else "bring the recipe's lengths nearer to each other or refine there"
                )
            )
    check_pairs(meshes)
