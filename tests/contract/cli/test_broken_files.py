"""Broken files at every door.

Exit code 2, one message with fault and remedy, no traceback, nothing half-written.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np
import pytest
from scipy.sparse import csr_array, save_npz

from upd import cli
from upd.contact.law import ContactLaw
from upd.errors import InputError
from upd.matrices import Matrices, read_dof_map, read_matrices, read_matrix, write_matrices
from upd.matrices.response import Joint, forced_response
from upd.reduction import ReducedModel, craig_bampton
from upd.results import Group, write_netcdf
from upd.scene import ready_scenes

#: what the whole set must hold
WANTED = 30
TRIED: list[str] = []

GOOD_RECIPE = """
from dataclasses import dataclass
import numpy as np
from geometry.blocks import REFERENCE
from upd.mesh import Mesh

@dataclass(frozen=True)
class Bricks:
    edge: float = 2.0

def build(params: Bricks) -> dict[str, Mesh]:
    made = {}
    for k, name in enumerate(("upper", "lower")):
        points = (REFERENCE[:8] + [0.0, 0.0, 1.0 - 2.0 * k]) * params.edge / 2.0
        contact = np.array([4, 5, 6, 7] if k else [0, 1, 2, 3])
        made[name] = Mesh(points, np.arange(8)[None, :], faces={"contact": contact[None, :]}, nodes={"contact": contact})
    return made
"""
OWN_SCENE = """
name = "own"
want = ["normal"]
[geometry]
recipe = "./own.py"
[mesh]
element = "hex8"
[materials.upper]
E = "200 GPa"
nu = 0.3
[materials.lower]
E = "200 GPa"
nu = 0.3
[loads]
normal = ["50 N"]
"""


@pytest.fixture(autouse=True)
def empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("UPD_CACHE", str(tmp_path / "cache"))
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path / "here"


def refused(label: str, *arguments: str, says: str) -> None:
    """The command ends with 2 and one message that names fault and remedy.

    The folder is as before.
    """
    before = sorted(p for p in Path.cwd().rglob("*"))
    told = io.StringIO()
    with (
        contextlib.redirect_stderr(told),
        contextlib.redirect_stdout(io.StringIO()),
        pytest.raises(SystemExit) as end,
    ):
        cli.main(list(arguments))
    check_message(told.getvalue(), says)
    assert end.value.code == 2, told.getvalue()
    assert sorted(p for p in Path.cwd().rglob("*")) == before, "half-written"
    TRIED.append(label)


def check_message(told: str, *says: str) -> None:
    for word in says:
        assert word in told, told
    for word in ("Traceback", "<class", "<built-in"):
        assert word not in told, told
    # one error, beside what is said before a file's code runs for the first time
    assert told.count("upd: ") - told.count("upd: the scene runs the Python code of ") <= 1
    assert len(told) < 2000


SCENE_FILES: dict[str, tuple[bytes | None, str]] = {
    "absent": (None, "neither a file here nor a ready scene"),
    "empty": (b"", "is missing"),
    "binary": (bytes(range(256)), "not valid TOML"),
    "utf-16": ('name = "a"'.encode("utf-16"), "not valid TOML"),
    "a picture": (b"\x89PNG\r\n\x1a\n" + bytes(50), "not valid TOML"),
    "JSON": (b'{"name": "a"}', "not valid TOML"),
    "cut": (ready_scenes()["hertz"].read_bytes()[:333], "not valid TOML"),
    "key twice": (b'name = "a"\nname = "b"\n', "not valid TOML"),
    "no value": (b"name = \n", "not valid TOML"),
    "a recipe": (GOOD_RECIPE.encode(), "not valid TOML"),
    "NUL in a text": (b'name = "a"\n[geometry]\nrecipe = "\\u0000.py"\n', "NUL"),
    "deep": (b"a = " + 3000 * b"[" + 3000 * b"]", "too deeply"),
    "deep keys": (3000 * b"a." + b"a = 1", "too deeply"),
}


@pytest.mark.parametrize("label", list(SCENE_FILES))
def test_scene_files(label: str) -> None:
    content, says = SCENE_FILES[label]
    if content is not None:
        Path("scene.toml").write_bytes(content)
    for command in (
        ("plan", "scene.toml"),
        ("run", "scene.toml", "--out", "never"),
        ("mesh", "scene.toml", "-o", "never.vtu"),
    ):
        refused(f"scene file, {label}", *command, says=says)


def test_scene_folder_and_scene_nobody_may_read() -> None:
    Path("scene.toml").mkdir()
    refused("scene is a folder", "plan", "scene.toml", says="no scene")
    locked = Path("locked.toml")
    locked.write_bytes(ready_scenes()["hertz"].read_bytes())
    locked.chmod(0)
    if os.access(locked, os.R_OK):
        return  # root reads everything
    refused("scene unreadable", "plan", "locked.toml", says="cannot be read")


RECIPES: dict[str, tuple[Callable[[str], str], str]] = {
    "syntax error": (lambda t: t.replace("def build(", "def build(("), "SyntaxError"),
    "no build": (lambda t: t.replace("def build", "def make"), "no function build"),
    "build is a number": (lambda t: t + "\nbuild = 3\n", "no function build"),
    "no annotation": (lambda t: t.replace(": Bricks", ""), "frozen dataclass"),
    "dataclass not frozen": (lambda t: t.replace("frozen=True", ""), "frozen dataclass"),
    "raises when run": (
        lambda t: t + "\nraise RuntimeError('no')\n",
        "in line 19: RuntimeError: no",
    ),
    "ends the program": (lambda t: t + "\nraise SystemExit(0)\n", "SystemExit"),
    "import of what is not there": (lambda t: "import no_such_package\n" + t, "no_such_package"),
    "build raises": (
        lambda t: t.replace("made = {}", "made = 1 / 0"),
        "in line 12: ZeroDivisionError",
    ),
    "parameters raise": (
        lambda t: t.replace(
            "= 2.0\n", "= 2.0\n    def __post_init__(self): raise ValueError('x')\n"
        ),
        "ValueError: x",
    ),
    "returns a list": (
        lambda t: t.replace("return made", "return list(made.values())"),
        "dictionary",
    ),
    "returns nothing": (lambda t: t.replace("return made", "return {}"), "dictionary"),
    "empty contact set": (
        lambda t: t.replace('nodes={"contact": contact}', 'nodes={"contact": contact[:0]}'),
        "is empty",
    ),
    "no contact set": (
        lambda t: t.replace('nodes={"contact": contact}', "nodes={}"),
        "found: none",
    ),
    "no contact faces": (
        lambda t: t.replace('faces={"contact": contact[None, :]}, ', ""),
        "faces 'contact', the surface",
    ),
    "sets of two lengths": (
        lambda t: t.replace('nodes={"contact": contact}', 'nodes={"contact": contact[k:]}'),
        "nodes face",
    ),
    "nodes out of line": (
        lambda t: t.replace("if k else [0, 1, 2, 3]", "if k else [1, 0, 2, 3]"),
        "out of line",
    ),
    "node that is not there": (
        lambda t: t.replace("[4, 5, 6, 7]", "[4, 5, 6, 70]"),
        "names the node 70",
    ),
    "element of a node that is not there": (
        lambda t: t.replace("np.arange(8)[None, :]", "np.arange(1, 9)[None, :]"),
        "names the node 8",
    ),
    "inverted element": (
        lambda t: t.replace("np.arange(8)[None, :]", "np.array([[4, 5, 6, 7, 0, 1, 2, 3]])"),
        "inverted",
    ),
    "points not finite": (
        lambda t: t.replace("params.edge / 2.0\n", "params.edge / 2.0 * np.nan\n"),
        "not finite",
    ),
    "points in a plane": (
        lambda t: t.replace(
            "params.edge / 2.0\n", "params.edge / 2.0\n        points = points[:, :2]\n"
        ),
        "(8, 2)",
    ),
    "unknown analysis": (lambda t: "ANALYSIS = 'modal'\n" + t, "its ANALYSIS is 'modal'"),
    "flat contact without its sets": (lambda t: "ANALYSIS = 'flat contact'\n" + t, "distant"),
    "count raises": (
        lambda t: t + "\ndef count(params): return 1 / 0\n",
        "count failed in line 19",
    ),
    "count returns a number": (lambda t: t + "\ndef count(params): return 3\n", "count"),
    "elements of 7 nodes": (
        lambda t: t.replace("np.arange(8)[None, :]", "np.arange(7)[None, :]"),
        "shape (1, 7)",
    ),
    "wrong .msh": (
        lambda t: t.replace(
            "made = {}", "import meshio; made = meshio.read(__file__.replace('.py', '.msh'))"
        ),
        "failed",
    ),
}


@pytest.mark.parametrize("label", list(RECIPES))
def test_recipe_files(label: str) -> None:
    change, says = RECIPES[label]
    changed = change(GOOD_RECIPE)
    assert changed != GOOD_RECIPE
    Path("own.py").write_text(changed, encoding="utf-8")
    Path("own.msh").write_bytes(b"$MeshFormat\n9.9 0 8\n$EndMeshFormat\n")
    Path("scene.toml").write_text(OWN_SCENE, encoding="utf-8")
    refused(f"recipe, {label}", "run", "scene.toml", "--out", "never", says=says)


@pytest.mark.parametrize("content", [b"\x00\x01\x02", "µ".encode("latin-1"), None])
def test_recipe_file_that_is_no_text(content: bytes | None) -> None:
    if content is not None:
        Path("own.py").write_bytes(content)
    Path("scene.toml").write_text(OWN_SCENE, encoding="utf-8")
    refused(f"recipe, {content!r}", "plan", "scene.toml", says="geometry.recipe")


SUMMARY = {
    "scene": "a",
    "title": "a",
    "status": "ok",
    "effects": [],
    "checks": [],
    "size": {},
    "cost": {},
    "results": [],
}
SUMMARIES: dict[str, tuple[bytes | None, str]] = {
    "absent": (None, "is no run folder"),
    "empty": (b"", "is not JSON"),
    "cut": (json.dumps(SUMMARY).encode()[:40], "is not JSON"),
    "binary": (bytes(range(256)), "summary.json"),
    "a list": (b"[1, 2]", "is not JSON of a run"),
    "keys missing": (b'{"scene": "a"}', "damaged in title"),
    "wrong kinds": (json.dumps({**SUMMARY, "results": [1], "size": 3}).encode(), "damaged in size"),
    "changed": (
        json.dumps({**SUMMARY, "checks": [{}], "results": [{}], "sha256": "1"}).encode(),
        "summary.json: is not as upd run wrote it",
    ),
}


@pytest.mark.parametrize("label", list(SUMMARIES))
def test_run_folders(label: str) -> None:
    content, says = SUMMARIES[label]
    Path("run").mkdir()
    if content is not None:
        Path("run/summary.json").write_bytes(content)
    refused(f"run folder, {label}", "report", "run", says=says)


def test_run_folder_that_is_a_file_or_absent() -> None:
    Path("run").write_text("x", encoding="utf-8")
    refused("run folder is a file", "report", "run", says="run")
    refused("run folder absent", "report", "none", says="none")
    refused("two run folders absent", "report", "none", "nothing", says="run folder")


def law() -> dict[str, Any]:
    one = np.ones(2)
    found = ContactLaw(
        position=np.zeros((2, 3)),
        normal=np.tile([0.0, 0.0, 1.0], (2, 1)),
        tangents=np.tile(np.eye(3)[:2], (2, 1, 1)),
        k_n=one,
        k_t=np.ones((2, 2)),
        preload=one,
        area=one,
    )
    return dict(found.to_arrays())


def _law_file(path: Path, **changes: Any) -> None:
    arrays = {k: changes.get(k.rpartition("_")[2], v) for k, v in law().items()}
    given = {k: v for k, v in arrays.items() if v is not None}
    write_netcdf(path, {"contact law F=1 N": Group(given, content="contact law")})


def _cut(path: Path) -> None:
    _law_file(path)
    path.write_bytes(path.read_bytes()[:2000])


def _other(path: Path) -> None:
    with h5netcdf.File(path, "w") as file:
        file.dimensions["x"] = 2
        file.create_variable("x", ("x",), float, data=np.zeros(2))


RESULTS: dict[str, tuple[Callable[[Path], object], str]] = {
    "absent": (lambda p: None, "result.nc"),
    "text": (lambda p: p.write_text("x,y\n1,2\n", encoding="utf-8"), "result.nc"),
    "empty": (lambda p: p.write_bytes(b""), "result.nc"),
    "cut": (_cut, "result.nc"),
    "folder": (lambda p: p.mkdir(), "result.nc"),
    "no contact law": (_other, "contact_law"),
    "law without its stiffness": (lambda p: _law_file(p, n=None), "is missing"),
}


@pytest.mark.parametrize("label", list(RESULTS))
def test_contact_run_that_gives_a_stiffness(label: str) -> None:
    write, says = RESULTS[label]
    Path("contact").mkdir()
    write(Path("contact/result.nc"))
    set_own = ("--set", "stiffness.own.run=contact", "--set", 'contact.stiffness=["own"]')
    text = (
        ready_scenes()["symmetric-response"]
        .read_text(encoding="utf-8")
        .replace('scene = "symmetric"', "")
    )
    Path("scene.toml").write_text(text, encoding="utf-8")
    refused(f"contact run, {label}", "run", "scene.toml", *set_own, "--out", "never", says=says)


def test_contact_scene_that_gives_no_stiffness() -> None:
    for label, source, says in (
        ("without law", "hertz", "no contact of a damper"),
        ("absent", "./none.toml", "none.toml"),
        ("no scene", "./bad.toml", "TOML"),
    ):
        Path("bad.toml").write_text("name =", encoding="utf-8")
        refused(
            f"contact scene {label}",
            "plan",
            "symmetric-response",
            "--set",
            'contact.stiffness=["own"]',
            "--set",
            f"stiffness.own.scene={source}",
            says=says,
        )


K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]])
HEAD = "%%MatrixMarket matrix coordinate real "
MATRIX_FILES: dict[str, tuple[str, bytes | None, str]] = {
    "absent": ("K.mtx", None, "cannot be read"),
    "text as matrix": ("K.mtx", b"dear reader\n", "cannot be read"),
    "empty": ("K.mtx", b"", "cannot be read"),
    "cut": ("K.mtx", (HEAD + "symmetric\n3 3 5\n1 1 2\n2 1 -1\n").encode(), "cannot be read"),
    "asymmetric": (
        "K.mtx",
        (HEAD + "general\n2 2 4\n1 1 1\n2 2 1\n1 2 1\n2 1 3\n").encode(),
        "not symmetric",
    ),
    "one triangle": (
        "K.mtx",
        (HEAD + "general\n2 2 3\n1 1 1\n2 2 1\n1 2 1\n").encode(),
        "one triangle only",
    ),
    "not square": ("K.mtx", (HEAD + "general\n2 3 1\n1 1 1\n").encode(), "are square"),
    "no dofs": ("K.mtx", (HEAD + "general\n0 0 0\n").encode(), "are square"),
    "not finite": ("K.mtx", (HEAD + "general\n1 1 1\n1 1 nan\n").encode(), "not finite"),
    "complex": (
        "K.mtx",
        b"%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 1 1\n",
        "complex",
    ),
    "index beyond": ("K.mtx", (HEAD + "general\n1 1 1\n5 5 1\n").encode(), "cannot be read"),
    "text as npz": ("K.npz", b"dear reader\n", "cannot be read"),
    "text as Harwell-Boeing": ("K.hb", b"dear reader\n", "cannot be read"),
    "binary as Harwell-Boeing": ("K.hb", bytes(range(256)), "cannot be read"),
    "another ending": ("K.csv", b"1,2\n", "Harwell-Boeing"),
    "size of M": ("K.mtx", (HEAD + "general\n1 1 1\n1 1 1\n").encode(), "one set of constraints"),
}


@pytest.mark.parametrize("label", list(MATRIX_FILES))
def test_matrices_of_another_code(label: str) -> None:
    """Through the library: an InputError is what the command line turns into exit code 2."""
    name, content, says = MATRIX_FILES[label]
    write_matrices(Path.cwd(), Matrices(csr_array(K), csr_array(np.eye(3))))
    if content is not None:
        Path(name).write_bytes(content)
    with pytest.raises(InputError) as caught:
        forced_response(
            name,
            "model.M.mtx",
            zeta=0.01,
            joints=[Joint({}, [0], k_t=1.0)],
            force={0: 1.0},
            watch={"a": 0},
            frequencies=[0.1],
        )
    check_message(str(caught.value), says)
    TRIED.append(f"matrix, {label}")


def _read_pair() -> object:
    return read_matrices("model.K.mtx", None, "map")


OTHERS: dict[str, tuple[str, bytes, Callable[[], object], str]] = {
    "dense array in npz": (
        "a.npz",
        b"",
        lambda: (np.savez("a.npz", a=K), read_matrix("a.npz")),
        "cannot be read",
    ),
    "pickle in npz": (
        "a.npz",
        b"",
        lambda: (np.savez("a.npz", data=np.array([{}], dtype=object)), read_matrix("a.npz")),
        "cannot be read",
    ),
    "map without lines": ("map", b"hello\n", lambda: read_dof_map("map"), "no line"),
    "map of another component": (
        "map",
        b"1 5 TEMP\n",
        lambda: read_dof_map("map"),
        "components TEMP",
    ),
    "map cut": ("map", b"1 5 UX\n3 5 UZ\n", lambda: read_dof_map("map"), "the file is cut"),
    "map of another model": ("map", b"1 5 UX\n2 5 UY\n", _read_pair, "the map has 2 dofs"),
    "map with a dof twice": ("map", b"1 5 UX\n2 5 UX\n3 5 UY\n", _read_pair, "twice"),
    "reduced model cut": (
        "r.nc",
        b"\x89HDF\r\n\x1a\n" + bytes(90),
        lambda: ReducedModel.load("r.nc"),
        "cannot be read",
    ),
    "reduced model is text": (
        "r.nc",
        b"hello",
        lambda: ReducedModel.load("r.nc"),
        "cannot be read",
    ),
    "matrix as reduced model": (
        "r.npz",
        b"",
        lambda: (save_npz("r.npz", csr_array(K)), ReducedModel.load("r.npz")),
        "give the ending .nc",
    ),
    "reduced model with another ending": ("r.txt", b"", lambda: ReducedModel.load("r.txt"), ".nc"),
}


@pytest.mark.parametrize("label", list(OTHERS))
def test_maps_and_reduced_models(label: str) -> None:
    name, content, read, says = OTHERS[label]
    write_matrices(Path.cwd(), Matrices(csr_array(K), csr_array(np.eye(3))))
    Path(name).write_bytes(content)
    with pytest.raises(InputError) as caught:
        read()
    check_message(str(caught.value), says)
    TRIED.append(label)


COMMANDS: dict[str, tuple[tuple[str, ...], str]] = {
    "sweep of an unknown key": (
        ("sweep", "hertz", "--vary", "contact.frictoin=1,2"),
        "did you mean 'friction'",
    ),
    "sweep without values": (
        ("sweep", "hertz", "--vary", "contact.friction"),
        "path=first:last:count",
    ),
    "sweep of bad values": (("sweep", "hertz", "--vary", "contact.friction=-1,-2"), "is negative"),
    "study of nothing": (("study", "hertz", "--vary", "colour"), "choose one of"),
    "study of one level": (("study", "hertz", "--levels", "8"), "at least two"),
    "mesh into no folder": (
        ("mesh", "hertz", "--set", "geometry.divisions=4", "-o", "none/mesh.vtu"),
        "choose another place",
    ),
    "mesh of another ending": (
        ("mesh", "hertz", "--set", "geometry.divisions=4", "-o", "mesh.stl"),
        ".vtu",
    ),
    "value without path": (("plan", "hertz", "--set", "=3"), "path=value"),
    "list too deep": (
        ("plan", "hertz", "--set", "loads.normal=" + 3000 * "[" + 3000 * "]"),
        "loads.normal",
    ),
    "tables too deep": (("plan", "hertz", "--set", 2000 * "a." + "a=1"), "nests tables"),
    "axis too deep": (("sweep", "hertz", "--vary", 2000 * "a." + "a=1,2"), "nests tables"),
    "axis of a list too deep": (
        ("sweep", "hertz", "--vary", "contact.friction=" + 3000 * "[" + 3000 * "]"),
        "contact.friction",
    ),
    "value into a value": (("plan", "hertz", "--set", "name.first=3"), "is a value, not a table"),
}


@pytest.mark.parametrize("label", list(COMMANDS))
def test_commands_leave_nothing_either(label: str) -> None:
    arguments, says = COMMANDS[label]
    refused(label, *arguments, says=says)


def test_brackets_in_a_folder_are_no_markup() -> None:
    """Folder names come from the user.

    What looks like the terminal's markup is printed as it is.
    """
    Path("[/bold]").mkdir(parents=True)
    Path("[/bold]/own.toml").write_text(OWN_SCENE, encoding="utf-8")
    refused("folder with brackets", "plan", "[/bold]/own.toml", says="[/bold]/own.py")


def test_asymmetric_matrix_never_reaches_a_solver() -> None:
    with pytest.raises(InputError, match="symmetric"):
        craig_bampton(K + np.triu(K), np.eye(3), [0], n_modes=1)
    TRIED.append("asymmetric array")


def test_count_of_the_set(capsys: pytest.CaptureFixture[str]) -> None:
    """Last in this file: how many files the tests above have tried."""
    if not TRIED:
        pytest.skip("the other tests of this file have not run")
    told = f"{len(set(TRIED))} kinds of broken files"
    with capsys.disabled():
        sys.stdout.write(f"\n{told}\n")
    assert len(set(TRIED)) >= WANTED, told
