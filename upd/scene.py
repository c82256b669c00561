"""A scene: what is simulated, read from TOML with every fault reported at once and by its path in the file."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, replace
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, ConfigDict, TypeAdapter, ValidationError

from upd import recipes
from upd.errors import InputError
from upd.toml_text import to_toml
from upd.units import parse_quantity

_STRICT = ConfigDict(extra="forbid", strict=False)

#: Outputs a scene can ask for, and what each one is.
WANTS = {
    "normal": "pressure, contact area and radius, approach",
    "stiffness": "normal (and, with friction, tangential) contact stiffness",
    "curve": "force-approach curve up to the largest load",
    "body_compression": "approach split into contact and finite body",
    "tangential": "stick and slip under tangential load",
    "cycle": "hysteresis loop of a full tangential cycle",
    "fields": "displacement of the whole bodies as VTU",
}
#: Outputs that call for friction when there is some.
FRICTION_WANTS = ("stiffness", "tangential", "cycle")
#: Parameters of a recipe that may be "auto".
_AUTO = ("patch", "core_depth", "divisions")
#: Outputs that need no mass matrix.
STATIC_WANTS = ("normal", "stiffness", "curve", "body_compression", "tangential", "cycle", "fields")


def _quantity(kind: str) -> BeforeValidator:
    def check(value: Any) -> Any:
        try:
            return parse_quantity(value, kind)
        except InputError as error:
            raise ValueError(str(error)) from None

    return BeforeValidator(check)


def _must(rule: Callable[[Any], bool], told: str) -> AfterValidator:
    def check(value: Any) -> Any:
        if not rule(value):
            raise ValueError(f"{value:g} {told}" if isinstance(value, (int, float)) else f"{value!r} {told}")
        return value

    return AfterValidator(check)


def _known_want(value: str) -> str:
    if value not in WANTS:
        near = difflib.get_close_matches(value, WANTS, 1)
        raise ValueError(f"{value!r} is not an output" + (f", did you mean {near[0]!r}?" if near else f"; known: {', '.join(WANTS)}"))
    return value


_FILLED = AfterValidator(lambda value: value if value else _empty())


def _empty() -> Any:
    raise ValueError("is empty; give at least one")


_positive = _must(lambda v: v > 0.0, "is not positive")
_not_negative = _must(lambda v: v >= 0.0, "is negative")
_share = _must(lambda v: 0.0 < v < 1.0, 'is outside (0, 1); write for example "1 %" or 0.01')

Stress = Annotated[float, _quantity("stress"), _positive]
Density = Annotated[float, _quantity("density"), _positive]
Poisson = Annotated[float, _quantity("fraction"), _must(lambda v: -1.0 < v < 0.5, "is outside (-1, 0.5)")]
Force = Annotated[
    float,
    _quantity("force"),
    _must(lambda v: v >= 0.0, "N pulls the bodies apart; a contact carries only pressure, give a positive force"),
]
LoadRatio = Annotated[
    float,
    _quantity("fraction"),
    _not_negative,
    _must(lambda v: v < 1.0, "times mu N is gross slip (T >= mu N has no static answer); stay below 1"),
]
Coefficient = Annotated[float, _quantity("fraction"), _not_negative]
Share = Annotated[float, _quantity("fraction"), _share]
Memory = Annotated[float, _quantity("memory"), _positive]
Want = Annotated[str, AfterValidator(_known_want)]
Name = Annotated[str, _must(lambda v: bool(re.fullmatch(r"[\w.-]*\w[\w.-]*", v)), "is no name: use letters, digits, '-', '_' and '.'")]


@dataclass(frozen=True)
class MaterialData:
    """Elastic constants of one body: E in MPa, nu, density in t/mm3 (used only when inertia is on)."""

    __pydantic_config__ = _STRICT
    E: Stress
    nu: Poisson
    density: Density = 7.8e-9


@dataclass(frozen=True)
class MeshChoice:
    """Element family, mirror symmetry, and the accuracy wanted instead of a mesh size."""

    __pydantic_config__ = _STRICT
    element: Literal["hex8", "hex8i", "hex20", "hex27"] = "hex8i"
    symmetry: Literal["auto", "full", "half", "quarter"] = "auto"
    accuracy: Share | None = None


@dataclass(frozen=True)
class ContactData:
    """Coulomb friction and what the solver may assume.

    directions : tangential directions of the slip problem, 1 (along the load) or 2 (slip circle).
    coupling_limit : largest |beta| of Dundurs for which normal and tangential problems are solved one after the other.
    transverse_limit : largest slip across the load, as a share of the slip along it, that one direction may leave out.
    """

    __pydantic_config__ = _STRICT
    friction: Coefficient = 0.0
    directions: Literal[1, 2] = 1
    coupling_limit: Coefficient = 0.1
    transverse_limit: Coefficient = 0.25


@dataclass(frozen=True)
class Loads:
    """Normal forces in N; tangential forces as fractions of mu N; amplitude of the cycle likewise."""

    __pydantic_config__ = _STRICT
    normal: Annotated[tuple[Force, ...], _FILLED]
    tangential: tuple[LoadRatio, ...] = ()
    cycle_amplitude: Share = 0.75
    cycle_steps: Annotated[int, _must(lambda v: v >= 8, "is less than 8")] = 300
    curve_points: Annotated[int, _must(lambda v: v >= 2, "is less than 2")] = 12


@dataclass(frozen=True)
class SolverChoice:
    """Linear solver (auto, pardiso, superlu, amg) and the memory it may use."""

    __pydantic_config__ = _STRICT
    name: Literal["auto", "pardiso", "superlu", "amg"] = "auto"
    memory: Memory | None = None


@dataclass(frozen=True)
class Scene:
    """One simulation. ``geometry`` holds the recipe's name under "recipe" and its parameters beside it, in mm."""

    __pydantic_config__ = _STRICT
    name: Name
    want: Annotated[tuple[Want, ...], _FILLED]
    geometry: Mapping[str, Any]
    materials: Mapping[str, MaterialData]
    loads: Loads
    title: str = ""
    mesh: MeshChoice = field(default_factory=MeshChoice)
    contact: ContactData = field(default_factory=ContactData)
    solver: SolverChoice = field(default_factory=SolverChoice)
    text: str = field(default="", repr=False)

    @property
    def recipe(self) -> str:
        return str(self.geometry["recipe"])

    @property
    def sphere_radius(self) -> float | None:
        """Radius in mm when the recipe declares a sphere on a plane, whose closed forms then apply."""
        if recipes.closed_form(self.recipe) != "sphere on plane":
            return None
        return float(self.geometry["radius"])

    def wants(self, *names: str) -> bool:
        """True when at least one of the outputs is asked for."""
        return any(name in self.want for name in names)


#: Parameters of a recipe that the [mesh] table sets.
_CHOSEN_BY_MESH = {"symmetry": "mesh.symmetry", "element_nodes": "mesh.element"}


def ready_scenes() -> dict[str, Path]:
    """Name -> file of the scenes that come with the package."""
    root = Path(str(resources.files("upd") / "scenes"))
    return {p.stem: p for p in sorted(root.glob("*.toml"))}


def load_scene(source: str | Path | Mapping[str, Any], overrides: Sequence[str] | Mapping[str, Any] = ()) -> Scene:
    """Read a scene from a ready name, a .toml path or a mapping; ``overrides`` are "path=value" texts or a mapping path -> value.

    Raises InputError with every fault of the scene and its path in the file.
    """
    if isinstance(source, Mapping):
        data, place, folder = _copy(source), "scene", Path.cwd()
    else:
        path = _find(source)
        folder, place = path.parent, path.name
        try:
            data = tomllib.loads(path.read_text(encoding="utf-8"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise InputError(f"{place} is not valid TOML: {error}") from None
        except OSError as error:
            raise InputError(f"{place} cannot be read: {error.strerror}") from None
    faults = _apply(data, overrides)
    geometry = data.get("geometry")
    if isinstance(geometry, dict) and isinstance(geometry.get("recipe"), str):
        # Absolute, so that the scene as run reads back from any folder.
        geometry["recipe"] = _recipe_path(geometry["recipe"], folder)
    scene, more = _validate(data, folder)
    faults += more
    if faults or scene is None:
        raise InputError(f"{place}: {len(faults)} fault{'s' * (len(faults) != 1)}\n" + "\n".join(f"  {f}" for f in faults))
    return scene


def _copy(data: Any) -> Any:
    if isinstance(data, Mapping):
        return {str(k): _copy(v) for k, v in data.items()}
    if isinstance(data, (list, tuple)):
        return [_copy(v) for v in data]
    # numpy's numbers become Python's.
    return data.item() if hasattr(data, "item") and getattr(data, "ndim", 0) == 0 else data


def _find(source: str | Path) -> Path:
    ready = ready_scenes()
    if str(source) in ready:
        return ready[str(source)]
    path = Path(source)
    if path.is_file():
        return path
    near = difflib.get_close_matches(str(source), ready, 1)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    raise InputError(f"no scene {str(source)!r}: neither a file here nor a ready scene ({', '.join(ready)}).{hint}")


def _apply(data: dict[str, Any], overrides: Sequence[str] | Mapping[str, Any]) -> list[str]:
    faults = []
    pairs: list[tuple[str, Any]] = []
    if isinstance(overrides, Mapping):
        pairs = [(path, _copy(value)) for path, value in overrides.items()]
    else:
        for text in overrides:
            path, sep, value = text.partition("=")
            if not sep or not path.strip():
                faults.append(f"--set {text!r}: write it as path=value, for example contact.friction=0.3")
                continue
            pairs.append((path.strip(), _toml_value(value.strip())))
    for path, value in pairs:
        *parents, last = path.split(".")
        node: Any = data
        for key in parents:
            node = node.setdefault(key, {})
            if not isinstance(node, dict):
                faults.append(f"--set {path}: {key!r} is a value, not a table")
                break
        else:
            node[last] = value
    return faults


def _toml_value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _validate(data: dict[str, Any], folder: Path) -> tuple[Scene | None, list[str]]:
    faults: list[str] = []
    scene = None
    own = {k: v for k, v in data.items() if k not in ("text",)}
    faults += [f"{k}: not a key of a scene" for k in data if k not in own]
    try:
        scene = TypeAdapter(Scene).validate_python({**own, "text": to_toml(data)})
    except ValidationError as error:
        faults += [_sentence(e) for e in error.errors(include_url=False)]
    geometry = data.get("geometry")
    parameters: dict[str, Any] = {}
    if isinstance(geometry, Mapping):
        parameters, more = geometry_parameters(geometry, folder)
        faults += more
    if scene is None:
        return None, faults
    faults += _cross_checks(scene)
    if faults:
        return None, faults
    if parameters.get("divisions") == "auto":
        del parameters["divisions"]
    cls = recipes.parameters(_recipe_path(str(scene.geometry["recipe"]), folder))
    usual = {f.name: f.default for f in fields(cls) if f.default is not MISSING and f.name not in _CHOSEN_BY_MESH}
    if scene.mesh.accuracy is not None:
        usual.pop("divisions", None)
    return replace(scene, geometry={"recipe": scene.geometry["recipe"], **usual, **parameters}), []


def _sentence(error: Any) -> str:
    path = "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in error["loc"]).lstrip(".") or "scene"
    kind, told = error["type"], str(error["msg"])
    if kind == "unexpected_keyword_argument":
        known = _keys_at(error["loc"][:-1])
        near = difflib.get_close_matches(str(error["loc"][-1]), known, 1)
        return f"{path}: unknown key" + (f", did you mean {near[0]!r}?" if near else f"; known here: {', '.join(known)}")
    if kind in ("missing", "missing_argument"):
        return f"{path}: is missing"
    return f"{path}: {told.removeprefix('Value error, ')}"


def _keys_at(location: Sequence[Any]) -> list[str]:
    tables = {"mesh": MeshChoice, "contact": ContactData, "loads": Loads, "solver": SolverChoice, "materials": MaterialData}
    cls: Any = tables.get(str(location[0]), Scene) if location else Scene
    return [f.name for f in fields(cls) if f.name not in ("text",)]


def _recipe_path(recipe: str, folder: Path) -> str:
    """A ready recipe's name, or the absolute path of the user's file, which the scene gives relative to its own folder."""
    return str((folder / recipe).resolve()) if recipe.endswith(".py") else recipe


def geometry_parameters(table: Mapping[str, Any], folder: Path) -> tuple[dict[str, Any], list[str]]:
    """Parameters of the recipe in mm from the scene's [geometry] table, and the faults found."""
    recipe = table.get("recipe")
    if not isinstance(recipe, str):
        return {}, ["geometry.recipe: is missing: name a recipe or a .py file"]
    try:
        cls = recipes.parameters(_recipe_path(recipe, folder))
    except InputError as error:
        return {}, [f"geometry.recipe: {error}"]
    known = {f.name: f for f in fields(cls)}
    out: dict[str, Any] = {}
    faults: list[str] = []
    for key, value in table.items():
        if key == "recipe":
            continue
        where = f"geometry.{key}"
        if key in _CHOSEN_BY_MESH:
            faults.append(f"{where}: set {_CHOSEN_BY_MESH[key]} instead")
        elif key not in known:
            near = difflib.get_close_matches(key, known, 1)
            faults.append(f"{where}: unknown key" + (f", did you mean {near[0]!r}?" if near else f"; known here: {', '.join(known)}"))
        elif value == "auto":
            if key in _AUTO:
                out[key] = value
            else:
                faults.append(f'{where}: cannot be "auto"; give it a value')
        else:
            read = _reader(known[key].metadata.get("quantity"), known[key].type)
            try:
                out[key] = read(value)
            except InputError as error:
                faults.append(f"{where}: {error}")
    if not faults:
        # What "auto" stands for is chosen later and fits: faults of its stand-in are not the user's.
        chosen = {key for key, value in out.items() if value == "auto"}
        try:
            cls(**{key: value for key, value in out.items() if key not in chosen})
        except InputError as error:
            told = [line.strip() for line in str(error).splitlines()]
            faults += [f"geometry: {line}" for line in told if not any(f"{key}:" in line for key in chosen)]
    return out, faults


def _reader(quantity: str | None, kind: Any) -> Callable[[Any], Any]:
    def read(value: Any) -> Any:
        if quantity is not None:
            return parse_quantity(value, quantity)
        if "int" in str(kind) and "float" not in str(kind):
            if isinstance(value, bool) or not isinstance(value, int):
                raise InputError(f"{value!r} is not a whole number")
            return value
        if "float" in str(kind):
            return parse_quantity(value, "fraction")
        return value

    return read


def _cross_checks(scene: Scene) -> list[str]:
    faults = []
    for name, values in (("normal", scene.loads.normal), ("tangential", scene.loads.tangential)):
        labels = [f"{v:g}" for v in values]
        faults += [
            f"loads.{name}: {label} stands there more than once (to six digits)"
            for label in sorted({x for x in labels if labels.count(x) > 1})
        ]
    given = scene.geometry.get("divisions", "auto") != "auto"
    if scene.mesh.accuracy is not None and given:
        faults.append('mesh.accuracy: chooses the mesh, so geometry.divisions cannot be given too: remove it or set it to "auto"')
    if scene.mesh.accuracy is None and scene.geometry.get("divisions") == "auto":
        faults.append('geometry.divisions: "auto" needs mesh.accuracy, for example "1 %"')
    return faults


def friction_on(scene: Scene) -> bool:
    """True when an output needs friction and there is some."""
    return scene.contact.friction > 0.0 and scene.wants(*FRICTION_WANTS)
