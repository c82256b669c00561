"""How the house is built.

Few modules at the root, names that mean one thing, doors that are used, array functions that say
their shapes.

Everything here is read from the sources (nothing is imported or run), so each rule holds for every
file, those of extras included. The layers themselves are import-linter's contracts in
pyproject.toml.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
#: Packages whose functions work on arrays: what a shape is must be read from the docstring.
ARRAY_ROOMS = (
    "contact",
    "dynamics",
    "fem",
    "hbm",
    "linalg",
    "matrices",
    "measured",
    "reduction",
    "reference",
)
ARRAY = re.compile(r"(NDArray|ArrayLike|\w*Array|ndarray|\bc[so][rc]_array|\bsparray|\bspmatrix)\b")


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def modules(*folders: str) -> list[Path]:
    found = sorted(file for folder in folders for file in (ROOT / folder).rglob("*.py"))
    assert found, f"no module in {folders}"
    return found


def place(path: Path, node: ast.AST) -> str:
    return f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 0)}"


def none_of(found: Iterable[str]) -> None:
    """Fail with every place that breaks a rule, one a line."""
    if places := sorted(found):
        pytest.fail("\n".join(places), pytrace=False)


def last_name(node: ast.expr) -> str:
    """The name in ``Name``, ``package.Name`` or ``Generic[T]``."""
    if isinstance(node, ast.Subscript):
        return last_name(node.value)
    return (
        node.attr
        if isinstance(node, ast.Attribute)
        else node.id
        if isinstance(node, ast.Name)
        else ""
    )


def names_used(tree: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """Every name a module reads, writes or imports, with the node that does it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            yield node.id, node
        elif isinstance(node, ast.Attribute):
            yield node.attr, node
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            yield from ((alias.name, node) for alias in node.names)


# -- the root --------------------------------------------------------------------------------------


def test_few_modules_at_the_root() -> None:
    root = sorted(file.name for file in (ROOT / "upd").glob("*.py"))
    assert len(root) <= 8, f"upd/ holds {len(root)} modules, rooms are folders: {root}"


# -- names -----------------------------------------------------------------------------------------


def classes(*folders: str) -> dict[str, list[str]]:
    """Class name -> where it is defined."""
    found: dict[str, list[str]] = defaultdict(list)
    for path in modules(*folders):
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.ClassDef):
                found[node.name].append(place(path, node))
    return found


def test_class_names_are_unique() -> None:
    none_of(
        f"{name}: {', '.join(where)}"
        for name, where in classes("upd", "geometry").items()
        if len(where) > 1
    )


def constants(tree: ast.Module) -> Iterator[tuple[str, ast.stmt]]:
    """Names in capitals that a module assigns at its top."""
    for node in tree.body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        for target in targets:
            for one in getattr(target, "elts", [target]):
                if isinstance(one, ast.Name) and one.id.isupper():
                    yield one.id, node


def test_constants_are_given_once() -> None:
    """Of two in one module the first would silently have the value of the second."""
    found = []
    for path in modules("upd", "geometry"):
        names: dict[str, ast.stmt] = {}
        for name, node in constants(parsed(path)):
            if name in names:
                found.append(f"{place(path, node)} {name} again")
            names[name] = node
    none_of(found)


def bound_in(init: Path) -> dict[str, str]:
    """Names that a package's __init__ binds to something other than its own modules -> where."""
    package = ".".join(init.parent.relative_to(ROOT).parts)
    bound: dict[str, str] = {}
    for node in ast.walk(parsed(init)):
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            bound[node.name] = place(init, node)
        elif isinstance(node, ast.ImportFrom) and not (
            node.module == package or (node.level == 1 and not node.module)
        ):
            bound |= {alias.asname or alias.name: place(init, node) for alias in node.names}
        elif isinstance(node, ast.Import):
            bound |= {alias.asname: place(init, node) for alias in node.names if alias.asname}
        elif isinstance(node, ast.Assign):
            bound |= {
                name: place(init, node) for target in node.targets if (name := last_name(target))
            }
    return bound


def test_no_module_is_hidden_by_what_its_package_exports() -> None:
    """``from upd.batch import sweep`` must not depend on which import ran first.

    The function or the module of that name.
    """
    hidden: list[str] = []
    for init in (path for path in modules("upd", "geometry") if path.name == "__init__.py"):
        inside = {p.stem for p in init.parent.glob("*.py")} | {
            p.parent.name for p in init.parent.glob("*/__init__.py")
        }
        bound = bound_in(init)
        assert "*" not in bound, (
            f"{init.relative_to(ROOT)}: a star import hides what the package exports"
        )
        hidden += [
            f"{where} hides the module {name}" for name, where in bound.items() if name in inside
        ]
    none_of(hidden)


# -- doors -----------------------------------------------------------------------------------------


def scene_classes() -> set[str]:
    """SceneBase and every class made from it."""
    bases = {
        node.name: {last_name(base) for base in node.bases}
        for path in modules("upd/scene")
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.ClassDef)
    }
    found = {"SceneBase"}
    while more := {name for name, parents in bases.items() if parents & found} - found:
        found |= more
    assert len(found) > 3
    return found


def test_no_question_is_put_to_the_class_of_a_scene() -> None:
    """What an analysis can answer is asked through its protocol, so that a new analysis needs no
    new branch elsewhere.
    """
    scenes, asked = scene_classes(), []
    for path in (p for p in modules("upd") if ROOT / "upd" / "scene" not in p.parents):
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.Call) and last_name(node.func) in ("isinstance", "issubclass"):
                kinds: list[ast.AST] = list(node.args[1:])
            elif isinstance(node, ast.Compare):
                sides = [node.left, *node.comparators]
                kinds = (
                    list(sides)
                    if any(isinstance(s, ast.Call) and last_name(s.func) == "type" for s in sides)
                    else []
                )
            elif isinstance(node, ast.MatchClass):
                kinds = [node.cls]
            else:
                continue
            if any(name in scenes for kind in kinds for name, _ in names_used(kind)):
                asked.append(place(path, node))
    none_of(asked)


def test_numbers_of_the_thesis_come_by_the_scene() -> None:
    """An analysis compares with the references its scene names; none of them knows a thesis."""
    used = [
        f"{place(p, n)} {name}"
        for p in modules("upd/analyses", "upd/batch")
        for name, n in names_used(parsed(p))
        if "THESIS_" in name
    ]
    none_of(used)


def test_geometry_is_entered_by_the_recipes_alone() -> None:
    """The library knows meshes.

    Gmsh and the parts are behind one module, and its digest counts their sources.
    """
    door, counted = ROOT / "upd/mesh/recipe_modules.py", ROOT / "upd/cache/sources.py"
    entered = []
    # Examples of the scenes are written as a user writes them, who does enter geometry.
    for path in (p for p in modules("upd") if ROOT / "upd" / "scenes" not in p.parents):
        for node in ast.walk(parsed(path)):
            asked = (
                [a.name for a in node.names]
                if isinstance(node, ast.Import)
                else [node.module]
                if isinstance(node, ast.ImportFrom)
                else []
            )
            if any((name or "").split(".")[0] in ("geometry", "gmsh") for name in asked):
                entered.append(place(path, node))
            if (
                isinstance(node, ast.Call)
                and last_name(node.func) in ("import_module", "__import__", "find_spec")
                and path != door
            ):
                text = " ".join(ast.unparse(argument) for argument in node.args)
                if "geometry" in text or "gmsh" in text:
                    entered.append(place(path, node))
    none_of(entered)
    assert "geometry" in door.read_text(encoding="utf-8")
    assert "geometry" in counted.read_text(encoding="utf-8")


# -- shapes ----------------------------------------------------------------------------------------


def public_functions(room: str) -> Iterator[tuple[str, ast.FunctionDef]]:
    """Public functions of a package's modules, as ``upd.room.module.name``."""
    for path in modules(f"upd/{room}"):
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        for node in parsed(path).body:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                yield f"{module}.{node.name}", node


def arguments(function: ast.FunctionDef) -> list[ast.arg]:
    a = function.args
    return [*a.posonlyargs, *a.args, *a.kwonlyargs, *(x for x in (a.vararg, a.kwarg) if x)]


def takes_arrays(function: ast.FunctionDef) -> bool:
    return any(
        a.annotation is not None and ARRAY.search(ast.unparse(a.annotation))
        for a in arguments(function)
    )


def test_annotations_of_arrays_are_recognised() -> None:
    for text in (
        "NDArray[np.float64]",
        "ArrayLike",
        "Array",
        "FloatArray",
        "csr_array",
        "csc_array | None",
        "Sequence[FloatArray]",
        "np.ndarray",
    ):
        assert ARRAY.search(text), text
    for text in ("float", "Mesh", "str | None", "Arrayed"):
        assert not ARRAY.search(text), text


@pytest.mark.parametrize("room", ARRAY_ROOMS)
def test_functions_of_arrays_have_a_section_parameters(room: str) -> None:
    """With two arguments or more, a reader cannot guess shapes and units from a name."""
    without = [
        name
        for name, function in public_functions(room)
        if len(arguments(function)) > 1
        and takes_arrays(function)
        and not re.search(
            r"^\s*Parameters\n\s*-{10}\s*$", ast.get_docstring(function) or "", re.MULTILINE
        )
    ]
    none_of(without)


# -- sizes -----------------------------------------------------------------------------------------


#: room -> lines of code it may have; less is better, and a room that shrinks takes its limit along
ROOM_LINES = {
    "analyses": 10395,
    "hbm": 6042,
    "contact": 3313,
    "linalg": 2628,
    "scene": 2161,
    "plot": 1496,
    "report": 1345,
    "fitting": 1342,
    "sizing": 1292,
    "batch": 1438,
    "mesh": 1349,
    "vary": 1233,
    "reference": 860,
    "cli": 802,
    "measured": 850,
    "reduction": 1047,
    "results": 660,
    "fem": 689,
    "matrices": 610,
    "root": 522,
    "cache": 438,
    "dynamics": 245,
    "scenes": 212,
    "manual": 113,
}
#: totals of upd/; pages of the manual's gallery are no modules
MOST_LINES, MOST_FILES, MOST_FUNCTIONS, MOST_CLASSES = 41082, 275, 2848, 344
#: parameters and lines of a function, its docstring with them, and fields of a class
MOST_PARAMETERS, MOST_FUNCTION_LINES, MOST_FIELDS = 8, 80, 18
_KERNEL = "one compiled loop: calls from inside it would cost a part of each step"
_PUBLIC = "public: half of it or more is the docstring, with an example"
#: longer functions and why
LONG_FUNCTIONS = {
    "march_steps": _KERNEL,
    "march_point": _KERNEL,
    "border": _KERNEL,
    "forced_response": "public: the docstring, and one sentence for each fault of its input",
    "contact_points": _PUBLIC,
    "tilted_contact": _PUBLIC,
    "travelling_wave_response": _PUBLIC,
}


def code_lines(path: Path) -> int:
    """Lines of a module without blank ones, comments and docstrings."""
    docs: set[int] = set()
    for node in ast.walk(parsed(path)):
        if isinstance(node, (ast.Module, ast.FunctionDef, ast.ClassDef)) and ast.get_docstring(
            node
        ):
            docs.update(range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1))
    lines = path.read_text(encoding="utf-8").splitlines()
    return sum(
        bool(line.strip()) and not line.strip().startswith("#") and k not in docs
        for k, line in enumerate(lines, 1)
    )


def test_rooms_stay_within_their_sizes() -> None:
    sizes: dict[str, int] = defaultdict(int)
    for path in modules("upd"):
        parts = path.relative_to(ROOT / "upd").parts
        # pages of the manual's gallery are text
        if "gallery" in parts:
            continue
        sizes[parts[0] if len(parts) > 1 else "root"] += code_lines(path)
    none_of(
        f"upd/{room}: {size} lines of code, {ROOM_LINES.get(room, 0)} are allowed"
        for room, size in sizes.items()
        if size > ROOM_LINES.get(room, 0)
    )


def test_the_house_stays_within_its_size() -> None:
    files = [path for path in modules("upd") if path.parent.name != "gallery"]
    nodes = [node for path in files for node in ast.walk(parsed(path))]
    assert sum(map(code_lines, files)) <= MOST_LINES
    assert len(files) <= MOST_FILES
    assert sum(isinstance(node, ast.FunctionDef) for node in nodes) <= MOST_FUNCTIONS
    assert sum(isinstance(node, ast.ClassDef) for node in nodes) <= MOST_CLASSES


def test_functions_are_short_with_few_parameters_and_classes_have_few_fields() -> None:
    found, long = [], set()
    for path in modules("upd"):
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.FunctionDef):
                a, lines = node.args, (node.end_lineno or 0) - node.lineno
                if (count := len(a.posonlyargs + a.args + a.kwonlyargs)) > MOST_PARAMETERS:
                    found.append(f"{place(path, node)}: {count} parameters")
                if lines > MOST_FUNCTION_LINES:
                    long.add(node.name)
                    if node.name not in LONG_FUNCTIONS:
                        found.append(f"{place(path, node)}: {lines} lines")
            if isinstance(node, ast.ClassDef):
                fields = sum(isinstance(b, ast.AnnAssign) for b in node.body)
                if fields > MOST_FIELDS:
                    found.append(f"{place(path, node)}: {fields} fields")
    found += [f"LONG_FUNCTIONS: {name} is short now" for name in set(LONG_FUNCTIONS) - long]
    none_of(found)
