"""A scene: what is simulated, read from TOML with every problem reported at once and by its path in
the file.
"""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, fields, replace
from datetime import date, datetime, time
from importlib import resources
from pathlib import Path
from typing import Any

import tomli_w
from pydantic import TypeAdapter, ValidationError

from upd.errors import InputError
from upd.mesh import recipes
from upd.scene.base import INSIDE, SceneBase
from upd.scene.contact import Scene
from upd.scene.contact_problems import contact_problems
from upd.scene.forced import FORCED, FORCED_ONLY, ForcedScene, settle_paths
from upd.scene.forced_problems import forced_problems
from upd.scene.modal import ModalScene, modal_problems
from upd.scene.overrides import plain, read_overrides
from upd.scene.recipe_keys import CHOSEN_BY_MESH, geometry_parameters, never, recipe_path
from upd.scene.rotation import turning
from upd.scene.seated import SEATED, SEATED_ONLY, SeatedScene, seated_problems
from upd.scene.sentences import sentence
from upd.scene.uncertain import taken_out, uncertainties

AnyScene = Scene | ModalScene | ForcedScene | SeatedScene

#: Letters before and after what a very long problem leaves out.
_HALF = 300
#: Analyses that a scene names, their classes, and the tables that only these have.
_NAMED: dict[str, tuple[type[AnyScene], tuple[str, ...]]] = {
    SEATED: (SeatedScene, SEATED_ONLY),
    FORCED: (ForcedScene, FORCED_ONLY),
}
#: Class of a scene -> its validator.
_ADAPTERS: dict[type[AnyScene], TypeAdapter[Any]] = {}


def ready_scenes() -> dict[str, Path]:
    """Name -> file of the scenes that come with the package."""
    root = Path(str(resources.files("upd") / "scenes"))
    return {p.stem: p for p in sorted(root.glob("*.toml"))}


def as_scene(
    source: AnyScene | str | Path | Mapping[str, Any],
    overrides: Sequence[str] | Mapping[str, Any] = (),
) -> Any:
    """A scene that is loaded already as it is, anything else by `load_scene`.

    Raises InputError as `load_scene` does, and for overrides of a loaded scene.
    """
    if not isinstance(source, SceneBase):
        return load_scene(source, overrides)
    if overrides:
        raise InputError("overrides: the scene is loaded already; give them to load_scene")
    return source


def load_scene(
    source: str | Path | Mapping[str, Any], overrides: Sequence[str] | Mapping[str, Any] = ()
) -> Any:
    """Read a scene from a ready name, a .toml path or a mapping.

    ``overrides`` are "path=value" texts or a mapping path -> value. Files and folders that the
    scene's file names stand relative to it, those that an override names relative to the working
    directory.

    Raises InputError with every problem of the scene and its path in the file.
    """
    if isinstance(source, Mapping):
        data, place, folder = plain(source), "scene", Path.cwd()
    elif not isinstance(source, (str, Path)):
        raise InputError(
            f"{source!r} is no scene; give a ready name, the path of a .toml file or a mapping"
        )
    else:
        path = _find(source)
        folder, place = path.parent, path.name
        try:
            data = tomllib.loads(path.read_text(encoding="utf-8-sig"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
            raise InputError(
                f"{place} is not valid TOML: {error}; to fix it: correct the file or copy "
                "a ready scene"
            ) from None
        except OSError as error:
            raise InputError(f"{place} cannot be read: {error.strerror}") from None
    pairs, problems = read_overrides(overrides)
    _refuse_nul(data, place)
    _refuse_nul(dict(pairs), place)
    problems += _apply(data, pairs)
    _settle(data, folder)
    data, bands = taken_out(data)
    scene, more = _validate(data, folder)
    problems += more
    if scene is not None and bands:
        uncertain, more = uncertainties(
            type(scene), data, bands, scene.recipe, lambda other: _validate(other, folder)[1]
        )
        problems += more
        scene = replace(scene, uncertain=uncertain)
    if problems or scene is None:
        raise InputError(
            f"{place}: {len(problems)} problem{'s' * (len(problems) != 1)}\n"
            + "\n".join(f"  {_shortened(f)}" for f in problems)
        )
    return scene


def _refuse_nul(data: Mapping[str, Any], place: str) -> None:
    """No path may hold NUL, nor what becomes text of files and figures."""
    found = [path for path, value in _leaves("", data) if isinstance(value, str) and "\0" in value]
    if found:
        raise InputError(
            f"{place}: {', '.join(found)}: the text holds the character NUL; write it without"
        )


def _leaves(path: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Every value that is no table or list, with its path."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _leaves(f"{path}.{key}" if path else str(key), inner)
    elif isinstance(value, list):
        for k, inner in enumerate(value):
            yield from _leaves(f"{path}[{k}]", inner)
    else:
        yield path, value


def _shortened(problem: str) -> str:
    """A problem that repeats a very long value, its middle left out.

    The place stands in front, the remedy at the end.
    """
    return problem if len(problem) <= 2 * _HALF else f"{problem[:_HALF]} ... {problem[-_HALF:]}"


def _writable(value: Any) -> Any:
    """Tables, lists and values that TOML has; anything else as text."""
    if isinstance(value, Mapping):
        return {k: _writable(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_writable(v) for v in value]
    return value if isinstance(value, (str, int, float, bool, datetime, date, time)) else str(value)


def _find(source: str | Path) -> Path:
    ready = ready_scenes()
    if str(source) in ready:
        return ready[str(source)]
    path = Path(source)
    # A text too long for a name is no file either.
    with suppress(OSError):
        if path.is_file():
            return path
    near = difflib.get_close_matches(str(source), ready, 1)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    raise InputError(
        f"no scene {_shortened(repr(str(source)))}: neither a file here nor a ready scene "
        f"({', '.join(ready)}).{hint}"
    )


def _settle(data: dict[str, Any], folder: Path) -> None:
    """Paths of files and folders made absolute, so that the scene as run reads back from any
    folder.
    """
    geometry = data.get("geometry")
    if isinstance(geometry, dict) and isinstance(geometry.get("recipe"), str):
        geometry["recipe"] = recipe_path(geometry["recipe"], folder)
    settle_paths(data, folder)


def _typed_here(path: str, value: Any) -> Any:
    """The value of an override, paths in it those of the working directory."""
    parents = path.split(".")
    alone = {parents.pop(): value}
    node = alone
    for key in reversed(parents):
        alone = {key: alone}
    _settle(alone, Path.cwd())
    return next(iter(node.values()))


def _apply(data: dict[str, Any], pairs: Sequence[tuple[str, Any]]) -> list[str]:
    problems = []
    for path, text in pairs:
        value = _typed_here(path, text)
        *parents, last = path.split(".")
        node: Any = data
        for key in parents:
            node = node.setdefault(key, {})
            if not isinstance(node, dict):
                problems.append(f"--set {path}: {key!r} is a value, not a table")
                break
        else:
            node[last] = value
    return problems


def _validate(data: dict[str, Any], folder: Path) -> tuple[AnyScene | None, list[str]]:
    problems: list[str] = []
    scene: AnyScene | None = None
    kind = _kind(data, folder)
    own = {k: v for k, v in data.items() if k not in INSIDE}
    problems += [f"{k}: not a key of a scene" for k in data if k not in own]
    problems += [
        f"{path}: {message}"
        for path, value in _leaves("", own)
        if (message := never(value)) and not path.startswith("geometry.")
    ]
    try:
        scene = _adapter(kind).validate_python({**own, "text": tomli_w.dumps(_writable(data))})
    except ValidationError as error:
        told = {problem.partition(":")[0] for problem in problems}
        found = [sentence(e, kind) for e in error.errors(include_url=False)]
        problems += [problem for problem in found if problem.partition(":")[0] not in told]
    geometry = data.get("geometry")
    parameters: dict[str, Any] = {}
    if isinstance(geometry, Mapping):
        parameters, more = geometry_parameters(
            geometry, folder, ("arrangement",) if kind in _between_blades() else ()
        )
        problems += more
    if kind in _between_blades():
        problems += _has_damper(geometry, folder)
    if scene is None or "recipe" not in scene.geometry:
        return None, problems
    wrong: list[str] = []
    if not problems:
        recipe = {"recipe": recipe_path(str(scene.geometry["recipe"]), folder)}
        turned, wrong = turning(replace(scene, geometry={**recipe, **parameters}), own)
        scene = replace(turned, geometry=scene.geometry)
    problems += wrong or _more_problems(scene)
    if problems:
        return None, problems
    if parameters.get("divisions") == "auto":
        del parameters["divisions"]
    cls = recipes.parameters(recipe_path(str(scene.geometry["recipe"]), folder))
    usual = {
        f.name: f.default
        for f in fields(cls)
        if f.default is not MISSING and f.name not in CHOSEN_BY_MESH
    }
    return replace(scene, geometry={"recipe": scene.geometry["recipe"], **usual, **parameters}), []


def _adapter(kind: type[AnyScene]) -> TypeAdapter[Any]:
    """pydantic's validator of a scene, compiled once per class.

    That takes longer than reading a scene.
    """
    if kind not in _ADAPTERS:
        _ADAPTERS[kind] = TypeAdapter(kind)
    return _ADAPTERS[kind]


def _more_problems(scene: AnyScene) -> list[str]:
    if scene.moves and scene.material.yield_stress is not None:
        return [
            "material.yield_stress: is checked in a contact scene, body by body; remove it here"
        ]
    if isinstance(scene, ForcedScene):
        return forced_problems(scene)
    if isinstance(scene, SeatedScene):
        return seated_problems(scene)
    return modal_problems(scene) if isinstance(scene, ModalScene) else contact_problems(scene)


def _between_blades() -> list[type[AnyScene]]:
    """Classes of the scenes of a damper between two blades."""
    return [kind for kind, _ in _NAMED.values()]


def _has_damper(geometry: Any, folder: Path) -> list[str]:
    """The problem of such a scene on a recipe without two blades and a damper."""
    recipe = geometry.get("recipe") if isinstance(geometry, Mapping) else None
    try:
        known = not isinstance(recipe, str) or FORCED in recipes.analyses(
            recipe_path(recipe, folder)
        )
    except InputError:
        return []
    return (
        []
        if known
        else [
            f"analysis: the recipe {recipe!r} is no rig of two blades and a damper; remove "
            "it or use blade_rig"
        ]
    )


def _kind(data: Mapping[str, Any], folder: Path) -> type[AnyScene]:
    """The class of the scene, from the analysis it names or its recipe declares."""
    named = data.get("analysis")
    if isinstance(named, str) and named in _NAMED:
        return _NAMED[named][0]
    for kind, tables in _NAMED.values():
        if any(table in data for table in tables):
            return kind
    if "analysis" in data:
        return ForcedScene
    geometry = data.get("geometry")
    recipe = geometry.get("recipe") if isinstance(geometry, Mapping) else None
    try:
        return (
            ModalScene
            if isinstance(recipe, str) and recipes.analysis(recipe_path(recipe, folder)) == "rig"
            else Scene
        )
    except InputError:
        # Told later, as a problem of geometry.recipe; the other keys say which scene is meant.
        return max((Scene, ModalScene), key=lambda kind: _shared_keys(kind, data))


def _shared_keys(kind: type[AnyScene], data: Mapping[str, Any]) -> int:
    return sum(f.name in data for f in fields(kind))
