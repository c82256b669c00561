"""A recipe becomes checked meshes, made only when something they depend on changed."""

from __future__ import annotations

import importlib
import logging
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upd.cache import sources
from upd.cache.arrays import cache_folder
from upd.cache.sources import source_digest, user_files
from upd.errors import InputError, MeshError
from upd.mesh import Mesh, recipes
from upd.mesh.checks import check_pairs
from upd.mesh.recipe_modules import module_of
from upd.mesh.recipes import load_meshes

SMALL: dict[str, Any] = {"divisions": 4, "growth": 2.0}

RECIPE = """
from __future__ import annotations
from dataclasses import dataclass
import numpy as np
from geometry.blocks import REFERENCE
from upd.mesh import Mesh

@dataclass(frozen=True)
class Bricks:
    edge: float
    skew: float = 0.0
    names: tuple[str, ...] = ("upper", "lower")

def build(params: Bricks) -> dict[str, Mesh]:
    made = {}
    for k, name in enumerate(params.names):
        points = (REFERENCE[:8] + [0.0, 0.0, 1.0 - 2.0 * k]) * params.edge / 2.0
        points[6] += params.skew
        contact = np.array([4, 5, 6, 7] if k else [0, 1, 2, 3])
        made[name] = Mesh(points, np.arange(8)[None, :], nodes={"contact": contact})
    return made
"""


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """No test touches the user's cache."""
    monkeypatch.setenv("UPD_CACHE", str(tmp_path_factory.mktemp("cache")))


@pytest.fixture
def brick(tmp_path: Path) -> str:
    path = tmp_path / "bricks.py"
    path.write_text(RECIPE)
    return str(path)


def same(one: dict[str, Mesh], two: dict[str, Mesh]) -> bool:
    return list(one) == list(two) and all(
        np.array_equal(a.points, b.points)
        and np.array_equal(a.hexes, b.hexes)
        and list(a.nodes) == list(b.nodes)
        and list(a.faces) == list(b.faces)
        and all(np.array_equal(a.nodes[k], b.nodes[k]) for k in a.nodes)
        and all(np.array_equal(a.faces[k], b.faces[k]) for k in a.faces)
        for a, b in zip(one.values(), two.values(), strict=True)
    )


def test_second_call_comes_from_the_cache_unchanged(tmp_path: Path) -> None:
    heard: list[str] = []
    first, cached_1 = recipes.build_mesh(
        "sphere_block", SMALL, cache_dir=tmp_path, progress=heard.append
    )
    second, cached_2 = recipes.build_mesh(
        "sphere_block", SMALL, cache_dir=tmp_path, progress=heard.append
    )
    assert (cached_1, cached_2) == (False, True)
    assert same(first, second)
    assert [p.suffix for p in tmp_path.iterdir()] == [".npz"]
    assert len(heard) == 2


def test_only_what_matters_makes_a_new_mesh(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cached(params: dict[str, Any]) -> bool:
        return recipes.build_mesh("sphere_block", params, cache_dir=tmp_path)[1]

    assert not cached(SMALL)
    assert cached({**SMALL, "radius": 5.0}), "a default spelt out is the same mesh"
    assert cached(dict(reversed(SMALL.items())))
    assert not cached({**SMALL, "radius": 5.0 + 1e-12})
    # read once per process: a fresh look, and none of it left behind
    monkeypatch.setattr(sources, "library_versions", sources.library_versions.__wrapped__)
    assert cached(SMALL)
    monkeypatch.setattr(sources, "version_of", lambda _: "0.0")
    assert not cached(SMALL), "another gmsh"


def test_changed_recipe_is_run_again(brick: str, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    meshes, cached = recipes.build_mesh(brick, {"edge": 2.0}, cache_dir=cache)
    assert not cached
    assert recipes.build_mesh(brick, {"edge": 2.0}, cache_dir=cache)[1]
    Path(brick).write_text(RECIPE.replace("params.edge / 2.0", "params.edge"))
    larger, cached = recipes.build_mesh(brick, {"edge": 2.0}, cache_dir=cache)
    assert not cached
    assert np.array_equal(larger["upper"].points, 2.0 * meshes["upper"].points)


@pytest.mark.parametrize("damage", ["cut", "empty", "text", "bit", "foreign", "indices"])
def test_damaged_cache_is_made_again_with_a_word(
    damage: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    good, _ = recipes.build_mesh("sphere_block", SMALL, cache_dir=tmp_path)
    (path,) = tmp_path.iterdir()
    data = path.read_bytes()
    if damage == "foreign":
        np.savez(path, a=np.zeros(3))
    elif damage == "indices":
        arrays = dict(np.load(path))
        arrays['["sphere", "hexes"]'][0, 0] = 10**6
        np.savez(path, **arrays)
    else:
        flipped = with_flipped_bit(data, data.index(good["sphere"].points.tobytes()) + 100)
        path.write_bytes(
            {"cut": data[:-100], "empty": b"", "text": b"hello", "bit": flipped}[damage]
        )
    with caplog.at_level(logging.WARNING, "upd"):
        again, cached = recipes.build_mesh("sphere_block", SMALL, cache_dir=tmp_path)
    assert not cached
    assert same(good, again)
    assert "made again" in caplog.text
    assert recipes.build_mesh("sphere_block", SMALL, cache_dir=tmp_path)[1], (
        "the damaged file is replaced"
    )


def with_flipped_bit(data: bytes, at: int) -> bytes:
    return data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]


def test_a_flipped_bit_never_gives_another_mesh(tmp_path: Path) -> None:
    good, _ = recipes.build_mesh("sphere_block", SMALL, cache_dir=tmp_path)
    (path,) = tmp_path.iterdir()
    data = path.read_bytes()
    for at in np.random.default_rng(0).choice(len(data), 200):
        path.write_bytes(with_flipped_bit(data, int(at)))
        found = load_meshes(tmp_path, path.stem)
        assert found is None or same(found, good)


def test_cache_that_cannot_be_written_is_done_without(
    brick: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    with caplog.at_level(logging.WARNING, "upd"):
        meshes, cached = recipes.build_mesh(brick, {"edge": 1.0}, cache_dir=blocked / "cache")
    assert not cached
    assert len(meshes) == 2
    assert "is not kept" in caplog.text


def test_interrupted_save_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("upd.cache.arrays.np.savez", full)
    _, cached = recipes.build_mesh("sphere_block", SMALL, cache_dir=tmp_path)
    assert not cached
    assert list(tmp_path.iterdir()) == []


def test_folder_of_the_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", "/home/someone")
    monkeypatch.delenv("UPD_CACHE", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    assert cache_folder() == Path("/home/someone/.cache/upd")
    monkeypatch.setenv("XDG_CACHE_HOME", "/xdg")
    assert cache_folder() == Path("/xdg/upd")
    monkeypatch.setenv("UPD_CACHE", "/mine")
    assert cache_folder() == Path("/mine")
    assert cache_folder("/given") == Path("/given")


def test_counts_and_parameters(brick: str) -> None:
    assert recipes.parameters("sphere_block").__name__ == "SphereBlock"
    assert recipes.count("sphere_block", {})["block"]["contact"] == 1681
    assert recipes.parameters(brick).__name__ == "Bricks"
    assert recipes.count(brick, {"edge": 1.0}) == {
        name: {"nodes": 8, "hexes": 1, "contact": 4} for name in ("upper", "lower")
    }


def test_unknown_recipe_and_parameters_are_named(brick: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="did you mean 'sphere_block'"):
        recipes.parameters("sphere_blok")
    with pytest.raises(InputError, match=r"path of a \.py file"):
        recipes.parameters("xyz")
    with pytest.raises(InputError, match="cannot be read"):
        recipes.parameters(str(tmp_path / "none.py"))
    with pytest.raises(InputError) as caught:
        recipes.build_mesh(brick, {"eddge": 1.0, "foo": 2}, cache_dir=tmp_path)
    message = str(caught.value)
    assert "did you mean 'edge'" in message
    assert "foo: unknown parameter" in message
    assert "edge: is missing" in message


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("1 / 0", "ZeroDivisionError"),
        ("def build(", "SyntaxError"),
        ("x = 1", "no function build"),
        ("def build(params): return {}", "annotated with a frozen dataclass"),
        ("def build(params: 'Nowhere'): return {}", "cannot be read"),
        (RECIPE.replace("frozen=True", "frozen=False"), "frozen dataclass"),
        (RECIPE.replace("return made", "return []"), "must return a dictionary"),
    ],
)
def test_broken_recipes_are_explained(text: str, word: str, tmp_path: Path) -> None:
    path = tmp_path / "broken.py"
    path.write_text(text)
    with pytest.raises(InputError, match=word):
        recipes.build_mesh(str(path), {"edge": 1.0} if "Bricks" in text else {}, cache_dir=tmp_path)


def test_bad_shape_names_place_and_remedy(brick: str, tmp_path: Path) -> None:
    with pytest.raises(
        MeshError, match=r"upper: hexahedron 0 about \(.*\) mm has the scaled Jacobian .*refine"
    ):
        recipes.build_mesh(brick, {"edge": 2.0, "skew": -1.8}, cache_dir=tmp_path)
    assert list(tmp_path.glob("*.npz")) == [], "a bad mesh is not kept"


def pair(change: Any = None) -> dict[str, Mesh]:
    x, y = np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0], indexing="ij")
    flat = np.stack([x.ravel(), y.ravel(), np.zeros(6)], axis=1)
    curved = flat + np.array([0.0, 0.0, 1.0]) * (flat[:, :1] - 1.0) ** 2
    order = np.arange(6)
    if change is not None:
        curved, order = change(curved.copy(), order.copy())
    hexes = np.empty((0, 8), dtype=np.int64)
    return {
        "one": Mesh(curved, hexes, nodes={"contact": order}),
        "two": Mesh(flat, hexes, nodes={"contact": np.arange(6)}),
    }


def test_pairs_across_a_curved_gap_are_fine() -> None:
    check_pairs(pair())
    turn, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    check_pairs({name: mesh.with_points(mesh.points @ turn) for name, mesh in pair().items()})


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda p, o: (p, o[:-1]), "5 nodes face 6"),
        (lambda p, o: (p, o[[0, 1, 2, 3, 4, 4]]), "twice"),
        (lambda p, o: (p, o[[1, 0, 2, 3, 4, 5]]), "pair 0 .* out of line"),
        (
            lambda p, o: (p + 1e-4 * np.eye(3)[0] * (o == 3)[:, None], o),
            "pair 3 .* 0.0001 mm out of line",
        ),
    ],
)
def test_wrong_pairs_are_named(change: Any, word: str) -> None:
    with pytest.raises(MeshError, match=word):
        check_pairs(pair(change))


@pytest.fixture
def fresh_geometry() -> Iterator[None]:
    """Forget the geometry package for one test."""
    kept = {
        name: module for name, module in sys.modules.items() if name.partition(".")[0] == "geometry"
    }
    for name in kept:
        del sys.modules[name]
    yield
    for name in [n for n in sys.modules if n.partition(".")[0] == "geometry"]:
        del sys.modules[name]
    sys.modules.update(kept)
    importlib.invalidate_caches()


@pytest.mark.usefixtures("fresh_geometry")
def test_a_file_of_that_name_elsewhere_is_not_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "geometry.py").write_text("raise RuntimeError('run')")
    monkeypatch.syspath_prepend(tmp_path)
    assert recipes.parameters("sphere_block")
    assert Path(sys.modules["geometry"].__file__ or "").parent.name == "geometry"


@pytest.mark.usefixtures("fresh_geometry")
def test_another_module_imported_before_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "geometry.py").write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    importlib.import_module("geometry")
    with pytest.raises(InputError, match=r"hidden by .*geometry\.py: rename"):
        recipes.build_mesh("sphere_block", {}, cache_dir=tmp_path)


@pytest.mark.usefixtures("fresh_geometry")
def test_shadowing_module_without_a_file_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "geometry", type(sys)("geometry"))
    with pytest.raises(InputError, match="hidden by another module"):
        recipes.parameters("sphere_block")


def test_library_does_not_load_gmsh_before_it_meshes() -> None:
    code = (
        "import sys; from upd.mesh import recipes; recipes.count('sphere_block', {}); "
        "sys.exit('gmsh' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_module_that_a_recipe_imports_is_part_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A changed helper is another recipe: in this process, and in the keys of what is kept."""
    monkeypatch.syspath_prepend(str(tmp_path))
    # within a second a file of the same size would be taken from its old bytecode
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    helper, further = tmp_path / "own_sizes.py", tmp_path / "own_units.py"
    further.write_text("mm = 1.0\n")
    helper.write_text("from own_units import mm\nWIDTH = 2.0 * mm\n")
    recipe = tmp_path / "own_recipe.py"
    recipe.write_text("import own_sizes\nWIDTH = own_sizes.WIDTH\n")
    digests, widths = [source_digest(str(recipe))], [module_of(str(recipe)).WIDTH]
    for file, text in ((further, "mm = 4.0\n"), (helper, "import own_units\nWIDTH = 3.0\n")):
        file.write_text(text)
        importlib.invalidate_caches()
        digests.append(source_digest(str(recipe)))
        widths.append(module_of(str(recipe)).WIDTH)
    assert widths == [2.0, 8.0, 3.0]
    assert len(set(digests)) == 3
    assert user_files(recipe) == [recipe, helper, further]
