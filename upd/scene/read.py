"""A scene: what is simulated, read from TOML with every problem reported at once and by its path in
the file.
"""

from __future__ import annotations

import difflib
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
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
from upd.scene.contact import CONTACT_WANTS, LawChoice, Scene
from upd.scene.forced import FORCED, FORCED_ONLY, ForcedScene, settle_paths
from upd.scene.forced_problems import forced_problems
from upd.scene.modal import ModalScene, modal_problems
from upd.scene.rotation import turning
from upd.scene.seated import SEATED, SEATED_ONLY, SeatedScene, seated_problems
from upd.scene.sentences import sentence
from upd.scene.uncertain import taken_out, uncertainties
from upd.units import parse_quantity

AnyScene = Scene | ModalScene | ForcedScene | SeatedScene

#: Parameters of a recipe that may be "auto".
_AUTO = ("patch", "core_depth", "divisions")
#: Parameters of a recipe that the [mesh] table sets.
_CHOSEN_BY_MESH = {
    "symmetry": "mesh.symmetry",
    "element_nodes": "mesh.element",
    "arrangement": "modes.arrangements",
    "damper": 'want ("free", "glued")',
}
#: Letters before and after what a very long problem leaves out.
_HALF = 300
#: Largest whole number: counts beyond it fill any memory.
_MOST = 100_000
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
        data, place, folder = _copy(source), "scene", Path.cwd()
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


def _copy(data: Any) -> Any:
    if isinstance(data, Mapping):
        return {str(k): _copy(v) for k, v in data.items()}
    if isinstance(data, (list, tuple)):
        return [_copy(v) for v in data]
    # numpy's numbers and arrays become Python's.
    return data.tolist() if hasattr(data, "tolist") else data


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


def read_overrides(
    overrides: Sequence[str] | Mapping[str, Any],
) -> tuple[list[tuple[str, Any]], list[str]]:
    """Paths and values of "path=value" texts or of a mapping, and what is wrong with them."""
    if isinstance(overrides, Mapping):
        return [(str(path), _copy(value)) for path, value in overrides.items()], []
    pairs: list[tuple[str, Any]] = []
    problems = []
    for text in [overrides] if isinstance(overrides, str) else overrides:
        path, sep, value = str(text).partition("=")
        if not sep or not path.strip():
            problems.append(
                f"--set {text!r}: write it as path=value, for example contact.friction=0.3"
            )
            continue
        pairs.append((path.strip(), _toml_value(value.strip())))
    return pairs, problems


def _settle(data: dict[str, Any], folder: Path) -> None:
    """Paths of files and folders made absolute, so that the scene as run reads back from any
    folder.
    """
    geometry = data.get("geometry")
    if isinstance(geometry, dict) and isinstance(geometry.get("recipe"), str):
        geometry["recipe"] = _recipe_path(geometry["recipe"], folder)
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


def _toml_value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _validate(data: dict[str, Any], folder: Path) -> tuple[AnyScene | None, list[str]]:
    problems: list[str] = []
    scene: AnyScene | None = None
    kind = _kind(data, folder)
    own = {k: v for k, v in data.items() if k not in INSIDE}
    problems += [f"{k}: not a key of a scene" for k in data if k not in own]
    problems += [
        f"{path}: {message}"
        for path, value in _leaves("", own)
        if (message := _never(value)) and not path.startswith("geometry.")
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
        recipe = {"recipe": _recipe_path(str(scene.geometry["recipe"]), folder)}
        turned, wrong = turning(replace(scene, geometry={**recipe, **parameters}), own)
        scene = replace(turned, geometry=scene.geometry)
    problems += wrong or _more_problems(scene)
    if problems:
        return None, problems
    if parameters.get("divisions") == "auto":
        del parameters["divisions"]
    cls = recipes.parameters(_recipe_path(str(scene.geometry["recipe"]), folder))
    usual = {
        f.name: f.default
        for f in fields(cls)
        if f.default is not MISSING and f.name not in _CHOSEN_BY_MESH
    }
    if scene.mesh.accuracy is not None:
        usual.pop("divisions", None)
    return replace(scene, geometry={"recipe": scene.geometry["recipe"], **usual, **parameters}), []


def _never(value: Any) -> str:
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
    return modal_problems(scene) if isinstance(scene, ModalScene) else _cross_checks(scene)


def _between_blades() -> list[type[AnyScene]]:
    """Classes of the scenes of a damper between two blades."""
    return [kind for kind, _ in _NAMED.values()]


def _has_damper(geometry: Any, folder: Path) -> list[str]:
    """The problem of such a scene on a recipe without two blades and a damper."""
    recipe = geometry.get("recipe") if isinstance(geometry, Mapping) else None
    try:
        known = not isinstance(recipe, str) or FORCED in recipes.analyses(
            _recipe_path(recipe, folder)
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
            if isinstance(recipe, str) and recipes.analysis(_recipe_path(recipe, folder)) == "rig"
            else Scene
        )
    except InputError:
        # Told later, as a problem of geometry.recipe; the other keys say which scene is meant.
        return max((Scene, ModalScene), key=lambda kind: _shared_keys(kind, data))


def _shared_keys(kind: type[AnyScene], data: Mapping[str, Any]) -> int:
    return sum(f.name in data for f in fields(kind))


def _recipe_path(recipe: str, folder: Path) -> str:
    """A ready recipe's name, or the absolute path of the user's file, which the scene gives
    relative to its own folder.
    """
    return str((folder / recipe).resolve()) if recipes.is_file(recipe) else recipe


def geometry_parameters(
    table: Mapping[str, Any], folder: Path, own: Sequence[str] = ()
) -> tuple[dict[str, Any], list[str]]:
    """Parameters of the recipe in mm from the scene's [geometry] table, and the problems found.

    `own`: those no other table chooses.
    """
    recipe = table.get("recipe")
    if not isinstance(recipe, str):
        return {}, ["geometry.recipe: is missing: name a recipe or a .py file"]
    try:
        cls = recipes.parameters(_recipe_path(recipe, folder))
    except InputError as error:
        return {}, [f"geometry.recipe: {error}"]
    known = {f.name: f for f in fields(cls)}
    out: dict[str, Any] = {}
    problems: list[str] = []
    for key, value in table.items():
        if key == "recipe":
            continue
        where = f"geometry.{key}"
        if key in _CHOSEN_BY_MESH and key not in own:
            problems.append(f"{where}: set {_CHOSEN_BY_MESH[key]} instead")
        elif key not in known:
            near = difflib.get_close_matches(key, known, 1)
            problems.append(
                f"{where}: unknown key"
                + (f", did you mean {near[0]!r}?" if near else f"; known here: {', '.join(known)}")
            )
        elif value == "auto":
            if key in _AUTO:
                out[key] = value
            else:
                problems.append(f'{where}: cannot be "auto"; give it a value')
        else:
            read = _reader(known[key].metadata.get("quantity"), known[key].type)
            try:
                out[key] = read(value)
            except InputError as error:
                problems.append(f"{where}: {error}")
    if not problems:
        # What "auto" stands for is chosen later and fits: problems of its stand-in are not the
        # user's.
        chosen = {key for key, value in out.items() if value == "auto"}
        try:
            recipes.made(
                _recipe_path(recipe, folder),
                {key: value for key, value in out.items() if key not in chosen},
            )
        except InputError as error:
            message = [line.strip() for line in str(error).splitlines()]
            problems += [
                f"geometry: {line}"
                for line in message
                if not any(f"{key}:" in line for key in chosen)
            ]
    return out, problems


def _reader(quantity: str | None, kind: Any) -> Callable[[Any], Any]:
    def read(value: Any) -> Any:
        if quantity is not None:
            return parse_quantity(value, quantity)
        if "int" in str(kind) and "float" not in str(kind):
            if isinstance(value, bool) or not isinstance(value, int):
                raise InputError(
                    f"{value!r} is not a whole number; write digits without quotes, for example 12"
                )
            if message := _never(value):
                raise InputError(message)
            return value
        if "float" in str(kind):
            return parse_quantity(value, "fraction")
        return value

    return read


def _cross_checks(scene: Scene) -> list[str]:
    problems = []
    for name, values in (("normal", scene.loads.normal), ("tangential", scene.loads.tangential)):
        labels = [v if isinstance(v, str) else f"{v:g}" for v in values]
        problems += [
            f"loads.{name}: {label} is duplicated (to six digits)"
            for label in sorted(x for x, times in Counter(labels).items() if times > 1)
        ]
    problems += _analysis_checks(scene)
    given = scene.geometry.get("divisions", "auto") != "auto"
    if scene.mesh.accuracy is not None and given:
        problems.append(
            "mesh.accuracy: chooses the mesh, so geometry.divisions cannot be given too: "
            'remove it or set it to "auto"'
        )
    if scene.wanted_accuracy is None and scene.geometry.get("divisions") == "auto":
        problems.append('geometry.divisions: "auto" needs an accuracy, for example "1 %"')
    return problems


def _analysis_checks(scene: Scene) -> list[str]:
    """What the analysis of the scene's recipe does not know."""
    try:
        kind = recipes.analysis(scene.recipe)
    except InputError:
        # Told already, as a problem of geometry.recipe.
        return []
    if kind not in CONTACT_WANTS:
        return [
            f"geometry.recipe: its ANALYSIS is {kind!r}; write one of "
            f"{', '.join(CONTACT_WANTS)}, rig"
        ]
    known = CONTACT_WANTS[kind]
    problems = [
        f"want: {w!r} is no output of a {kind}; choose among {', '.join(known)}"
        for w in scene.want
        if w not in known
    ]
    words = [v for v in scene.loads.normal if isinstance(v, str)]
    if kind == "flat contact":
        names = [f"{d % 360.0:g} deg" for d in scene.loads.directions]
        problems += [
            f"loads.directions: {d} is duplicated"
            for d in sorted({d for d in names if names.count(d) > 1})
        ]
        if words and scene.loads.centrifugal == 0.0:
            problems.append(
                f"loads.centrifugal: 0 N presses nothing together, so {words[0]!r} has no answer; "
                'give the force at speed, for example "350 N"'
            )
        problems += [
            "loads.normal: 0 N presses nothing together; give a positive force"
            for load in scene.loads.normal
            if load == 0.0
        ]
        if scene.loads.curve_to is not None and scene.loads.curve_to == 0.0:
            problems.append("loads.curve_to: 0 N gives no curve; give a positive force")
        if words and scene.loads.centrifugal is None:
            problems.append(
                f"loads.normal: {words[0]!r} needs loads.centrifugal, the centrifugal "
                "force on the damper"
            )
        return problems
    if words:
        problems.append(
            f"loads.normal: {words[0]!r} is for flat damper faces; give a force with its unit"
        )
    plain = (
        ("loads.centrifugal", scene.loads.centrifugal is not None),
        ("loads.speed", scene.loads.speed is not None),
        ("loads.directions", scene.loads.directions != (0.0,)),
        ("loads.curve_to", scene.loads.curve_to is not None),
        ("contact.tilt", scene.contact.tilt != "held"),
        ("contact.load_point", scene.contact.load_point is not None),
        ("contact.distant", bool(scene.contact.distant)),
        ("law", scene.law != LawChoice()),
    )
    return problems + [
        f"{where}: has no meaning for a {kind}; remove it" for where, given in plain if given
    ]
