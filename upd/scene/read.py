"""A scene: what is simulated, read from TOML with every problem reported at once and by its path in
the file.
"""

from __future__ import annotations

import difflib
import tomllib
import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, Field, fields, is_dataclass, replace
from datetime import date, datetime, time
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import tomli_w
from pydantic import TypeAdapter, ValidationError

from upd.errors import InputError, did_you_mean
from upd.mesh import recipes
from upd.mesh.recipe_modules import is_file
from upd.scene.base import INSIDE, SceneBase
from upd.scene.bladed_disk import BladedDiskScene
from upd.scene.contact import Scene
from upd.scene.forced import FORCED, ForcedScene
from upd.scene.measured import note_files
from upd.scene.modal import ModalScene
from upd.scene.quantities import Note, hint_at, hints, must_be_given, path_of, without_notes
from upd.scene.seated import SEATED, SeatedScene
from upd.scene.toml import plain, read_overrides, toml_value
from upd.scene.uncertain import Band, taken_out, uncertainties
from upd.units import parse_quantity

AnyScene = Scene | ModalScene | ForcedScene | SeatedScene | BladedDiskScene

#: Parameters of a recipe that may be "auto".
_AUTO = ("patch", "core_depth", "divisions")
#: Parameters of a recipe that the [mesh] table sets.
CHOSEN_BY_MESH = {
    "symmetry": "mesh.symmetry",
    "element_nodes": "mesh.element",
    "arrangement": "modes.arrangements",
    "damper": 'want ("free", "glued")',
}
#: Largest whole number: counts beyond it fill any memory.
_MOST = 100_000
#: Letters before and after what a very long problem leaves out.
_HALF = 300
#: the classes of scenes that name their analysis
_NAMED: dict[str, type[AnyScene]] = {SEATED: SeatedScene, FORCED: ForcedScene}
#: pydantic's kinds of errors, or how they begin -> what a value is not
_NOT = {
    "tuple": "list",
    "dict": "table",
    "mapping": "table",
    "dataclass": "table",
    "string": "text",
    "int": "whole number",
    "float": "number",
    "finite_number": "finite number",
}
#: pydantic's validator of a class of scenes, compiled once: that takes longer than reading a scene
_adapter: Callable[..., TypeAdapter[Any]] = cache(TypeAdapter)


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
    scene's file names are relative to it, those that an override names relative to the working
    directory.

    Raises InputError with every problem of the scene and its path in the file.
    """
    try:
        return _loaded(source, overrides)
    except RecursionError:
        name = "the scene" if isinstance(source, Mapping) else source
        raise InputError(
            f"{name}: it, or what is set in it, nests tables or lists too deeply; to fix it: "
            "correct the file or the value"
        ) from None


def _loaded(
    source: str | Path | Mapping[str, Any], overrides: Sequence[str] | Mapping[str, Any]
) -> AnyScene:
    data, place, folder = _data(source)
    pairs, problems = read_overrides(overrides)
    nul = [path for path, value in leaves("", data | dict(pairs)) if "\0" in str(value)]
    if nul:
        # no path may hold it, nor what becomes text of files and figures
        raise InputError(
            f"{place}: {', '.join(nul)}: the text holds the character NUL; write it without"
        )
    _make_absolute(data, folder)
    problems += _apply(data, pairs)
    _make_absolute(data, Path.cwd())
    note_files(data)
    bands: list[Band] = []
    data = taken_out(data, bands)
    scene, more = _validate(data)
    problems += more
    if scene is not None and bands:
        uncertain, more = uncertainties(
            type(scene), data, bands, scene.recipe, lambda other: _validate(other)[1]
        )
        problems += more
        scene = replace(scene, uncertain=uncertain)
    if problems or scene is None:
        raise InputError(
            f"{place}: {len(problems)} problem{'s' * (len(problems) != 1)}\n"
            + "\n".join(f"  {_shortened(f)}" for f in problems)
        )
    return scene


def _data(source: str | Path | Mapping[str, Any]) -> tuple[dict[str, Any], str, Path]:
    """The tables of a source, its name, and the folder that its paths are relative to."""
    if isinstance(source, Mapping):
        return plain(source), "scene", Path.cwd()
    if not isinstance(source, (str, Path)):
        raise InputError(
            f"{source!r} is no scene; give a ready name, the path of a .toml file or a mapping"
        )
    path = _find(source)
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(
            f"{path.name} is not valid TOML: {error}; to fix it: correct the file or copy a ready "
            "scene"
        ) from None
    except OSError as error:
        raise InputError(f"{path.name} cannot be read: {error.strerror}") from None
    return data, path.name, path.parent


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


def leaves(path: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Every value that is no table or list, with its path."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from leaves(f"{path}.{key}" if path else str(key), inner)
    elif isinstance(value, list):
        for k, inner in enumerate(value):
            yield from leaves(f"{path}[{k}]", inner)
    else:
        yield path, value


def _shortened(problem: str) -> str:
    """A problem that repeats a very long value, without the middle.

    The place stays in front, the remedy at the end.
    """
    return problem if len(problem) <= 2 * _HALF else f"{problem[:_HALF]} ... {problem[-_HALF:]}"


def _make_absolute(data: dict[str, Any], folder: Path) -> None:
    """Make paths of files and folders absolute, so that the scene as run reads back from any
    folder.
    """

    places: list[tuple[Any, str]] = [(data.get("geometry"), "recipe")]
    for name, keys in (("stiffness", ("scene", "run")), ("measured", ("file",))):
        named = data.get(name)
        tables = named.values() if isinstance(named, dict) else ()
        places += [(table, key) for table in tables for key in keys]
    for table, key in places:
        text = table.get(key) if isinstance(table, dict) else None
        if not isinstance(text, str) or (key == "recipe" and not is_file(text)):
            continue
        # another text names a ready scene
        if key != "scene" or text.endswith(".toml"):
            table[key] = str((folder / text).resolve())


def _apply(data: dict[str, Any], pairs: Sequence[tuple[str, Any]]) -> list[str]:
    problems = []
    for path, value in pairs:
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


def _validate(data: dict[str, Any]) -> tuple[AnyScene | None, list[str]]:
    """The scene of tables whose paths are absolute, or every problem of it."""
    analyses = _analyses(data)
    kind = _kind(data, analyses)
    between_blades = kind in _NAMED.values()
    own = {k: v for k, v in data.items() if k not in INSIDE}
    problems = [f"{k}: not a key of a scene" for k in data if k not in own]
    problems += [
        f"{path}: {message}"
        for path, value in leaves("", own)
        if (message := never(value)) and not path.startswith("geometry.")
    ]
    scene: AnyScene | None = None
    try:
        scene = _adapter(kind).validate_python({**own, "text": tomli_w.dumps(_writable(data))})
    except ValidationError as error:
        known = {problem.partition(":")[0] for problem in problems}
        # pydantic marks an error of a table's key by one more step
        places = (
            (e, tuple(step for step in e["loc"] if step != "[key]"))
            for e in error.errors(include_url=False)
        )
        found = [f"{path_of(at) or 'scene'}: {_fault(e, at, kind)}" for e, at in places]
        problems += [problem for problem in found if problem.partition(":")[0] not in known]
    parameters: dict[str, Any] = {}
    geometry = data.get("geometry")
    if isinstance(geometry, Mapping):
        own_keys = ("arrangement",) if between_blades else ()
        parameters, more = geometry_parameters(geometry, own_keys)
        problems += more
    if between_blades and analyses and FORCED not in analyses:
        problems.append(
            f"analysis: the recipe {data['geometry']['recipe']!r} is no rig of two blades and a "
            "damper; remove it or use blade_rig"
        )
    if scene is None or "recipe" not in scene.geometry:
        return None, problems
    recipe, wrong = scene.recipe, list[str]()
    if not problems:
        scene = replace(scene, geometry={"recipe": recipe, **parameters})
        try:
            scene = scene.derived(own)
        except InputError as error:
            wrong = list(error.args)
    problems += wrong or scene.problems()
    if problems:
        return None, problems
    if parameters.get("divisions") == "auto":
        del parameters["divisions"]
    usual = {
        f.name: f.default
        for f in fields(recipes.parameters(recipe))
        if f.default is not MISSING and f.name not in CHOSEN_BY_MESH
    }
    return replace(scene, geometry={"recipe": recipe, **usual, **parameters}), []


def _writable(value: Any) -> Any:
    """Tables, lists and values that TOML has; anything else as text."""
    if isinstance(value, Mapping):
        return {k: _writable(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_writable(v) for v in value]
    return value if isinstance(value, (str, int, float, bool, datetime, date, time)) else str(value)


def _analyses(data: Mapping[str, Any]) -> tuple[str, ...]:
    """The analyses that the scene's recipe declares; none where it is not known."""
    geometry = data.get("geometry")
    recipe = geometry.get("recipe") if isinstance(geometry, Mapping) else None
    # a recipe that fails is a problem of geometry.recipe
    with suppress(InputError):
        return recipes.analyses(recipe) if isinstance(recipe, str) else ()
    return ()


def _kind(data: Mapping[str, Any], analyses: Sequence[str]) -> type[AnyScene]:
    """The class of the scene, from the analysis it names or those its recipe declares."""
    if analyses[:1] == (BladedDiskScene.analysis,):
        return BladedDiskScene
    named = data.get("analysis")
    if isinstance(named, str) and named in _NAMED:
        return _NAMED[named]
    for kind in _NAMED.values():
        if any(table in data for table in kind.only):
            return kind
    if "analysis" in data:
        return ForcedScene
    if analyses:
        return ModalScene if analyses[0] == "rig" else Scene
    # without a recipe the other keys show which scene is meant
    return max((Scene, ModalScene), key=lambda kind: sum(f.name in data for f in fields(kind)))


# -- the [geometry] table: which recipe, and its parameters in mm ----------------------------------


def geometry_parameters(
    table: Mapping[str, Any], own: Sequence[str] = ()
) -> tuple[dict[str, Any], list[str]]:
    """Parameters of the recipe in mm from the scene's [geometry] table, and the problems found.

    `own`: those no other table chooses.
    """
    recipe = table.get("recipe")
    if not isinstance(recipe, str):
        return {}, ["geometry.recipe: is missing: name a recipe or a .py file"]
    try:
        cls = recipes.parameters(recipe)
    except InputError as error:
        return {}, [f"geometry.recipe: {error}"]
    known = {f.name: f for f in fields(cls)}
    out: dict[str, Any] = {}
    problems: list[str] = []
    for key, value in table.items():
        if key == "recipe":
            continue
        where = f"geometry.{key}"
        if key in CHOSEN_BY_MESH and key not in own:
            problems.append(f"{where}: set {CHOSEN_BY_MESH[key]} instead")
        elif key not in known:
            others = f"known here: {', '.join(known)}"
            problems.append(f"{where}: unknown key{did_you_mean(key, known, others)}")
        elif value == "auto" and key not in _AUTO:
            problems.append(f'{where}: cannot be "auto"; give it a value')
        else:
            try:
                out[key] = value if value == "auto" else _parameter(value, known[key])
            except InputError as error:
                problems.append(f"{where}: {error}")
    if not problems:
        # What "auto" stands for is chosen later and fits: problems of its stand-in are not the
        # user's.
        chosen = {key for key, value in out.items() if value == "auto"}
        try:
            recipes.made(recipe, {key: value for key, value in out.items() if key not in chosen})
        except InputError as error:
            message = [line.strip() for line in str(error).splitlines()]
            problems += [
                f"geometry: {line}"
                for line in message
                if not any(f"{key}:" in line for key in chosen)
            ]
    return out, problems


def _parameter(value: Any, parameter: Field[Any]) -> Any:
    """A value of a recipe's parameter, quantities in the unit inside. Raises InputError."""
    quantity, kind = parameter.metadata.get("quantity"), str(parameter.type)
    if quantity is not None or "float" in kind:
        return parse_quantity(value, quantity or "fraction")
    if "int" not in kind:
        return value
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(
            f"{value!r} is not a whole number; write digits without quotes, for example 12"
        )
    if message := never(value):
        raise InputError(message)
    return value


def never(value: Any) -> str:
    """What no key of a scene takes, though a number could be made of it.

    True and false, numbers beyond all counts.
    """
    if isinstance(value, bool):
        return f"{str(value).lower()} is no value of a scene; write a number, or text in quotes"
    if isinstance(value, bytes):
        return "is bytes; write text"
    if isinstance(value, int) and abs(value) > _MOST:
        return f"is more than the largest whole number of a scene, {_MOST}; give a smaller one"
    return ""


# -- what is wrong with a value and what to write instead, from pydantic's errors ------------------


def _fault(error: Any, location: Sequence[Any], scene: type[Any]) -> str:
    """What is wrong with one value of a scene, and what to write instead."""
    kind, value = error["type"], error["input"]
    if kind == "value_error":
        return str(error["msg"]).removeprefix("Value error, ")
    if kind == "unexpected_keyword_argument":
        known = _keys(hint_at(scene, location[:-1])) or _keys(scene)
        others = f"known here: {', '.join(known)}"
        return f"unknown key{did_you_mean(location[-1], known, others)}"
    if kind in ("missing", "missing_argument"):
        return f"is missing{_addition(location, scene)}"
    wanted = hint_at(scene, location)
    example = _example(wanted)
    if kind == "too_long":
        return f"has {len(value)} values; write {example}"
    if kind == "literal_error":
        one_of: Any = Literal[FORCED, SEATED] if location == ("analysis",) else wanted
        choices = [toml_value(choice) for choice in get_args(without_notes(one_of))]
        if len(choices) == 1:
            return f"{value!r} is not known; write {choices[0]}"
        near = difflib.get_close_matches(toml_value(value), choices, 1)
        meant = f", did you mean {near[0]}?" if near else ""
        return f"{value!r} is none of its values{meant}; write one of {', '.join(choices)}"
    what = next((word for begin, word in _NOT.items() if kind.startswith(begin)), "")
    quotes = ", quotes included" if '"' in example and isinstance(value, str) else ""
    quotes = ", without quotes" if kind.startswith(("int", "float")) else quotes
    fault = f"is no {what}" if what else "does not fit here"
    return f"{value!r} {fault}; write for example {example}{quotes}"


def _addition(location: Sequence[Any], scene: type[Any]) -> str:
    """The remedy for a key or an item that is missing."""
    if location == ("analysis",):
        name = SEATED if scene is SeatedScene else FORCED
        return (
            f'; add analysis = "{name}", or remove the tables that only it has '
            f"({', '.join(scene.only)})"
        )
    if isinstance(location[-1], int):
        return f"; write {_example(hint_at(scene, location[:-1]))}"
    return f"; add for example {location[-1]} = {_example(hint_at(scene, location))}"


def _keys(wanted: Any) -> list[str]:
    """Keys of the table at a place; none when its keys are free."""
    cls = without_notes(wanted)
    return [f.name for f in fields(cls) if f.name not in INSIDE] if is_dataclass(cls) else []


def _example(wanted: Any) -> str:
    """TOML that would do."""
    return _items(wanted)[0]


def _items(wanted: Any) -> tuple[str, ...]:
    """TOML of one or more values that would do."""
    origin, inside = get_origin(wanted), get_args(wanted)
    if origin is Annotated:
        given = next((note for note in wanted.__metadata__ if isinstance(note, Note)), None)
        return given.values if given else _items(inside[0])
    if origin in (Union, types.UnionType):
        return _items(next(kind for kind in inside if kind is not type(None)))
    if origin is Literal:
        return tuple(map(toml_value, inside))
    if origin is tuple:
        items = _items(inside[0]) if inside[-1] is Ellipsis else [_example(kind) for kind in inside]
        return (f"[{', '.join(items)}]",)
    if origin is Mapping:
        return (f"{{ key = {_example(inside[1])} }}",)
    if is_dataclass(wanted):
        # with the keys that must be there, or with the first one
        known: tuple[Field[Any], ...] = fields(wanted)
        needed = [f for f in known if must_be_given(f)] or known[:1]
        keys = [f"{f.name} = {_example(hints(wanted)[f.name])}" for f in needed]
        return (f"{{ {', '.join(keys)} }}",)
    return ({int: "12", float: "0.5"}.get(wanted, '"text"'),)
