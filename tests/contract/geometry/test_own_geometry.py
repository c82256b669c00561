"""A user's own geometry, from two files to numbers: the worked example of the README, and what is told when a set is missing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import upd
from upd import cli
from upd.errors import InputError
from upd.mesh import recipes
from upd.results import read_netcdf

#: my_damper.py: a damper with a crowned face on a flat platform. Contact plane z = 0; all lengths in mm.
MY_DAMPER = '''
"""A damper with a crowned face on a flat platform."""

from dataclasses import dataclass, field

import numpy as np

from geometry.blocks import Blocks, require, session
from upd.mesh import Mesh

LENGTH = {"quantity": "length"}                 # scenes give it with a unit, "20 mm"


@dataclass(frozen=True)
class MyDamper:
    width: float = field(default=4.0, metadata=LENGTH)
    height: float = field(default=4.0, metadata=LENGTH)
    crown: float = field(default=200.0, metadata=LENGTH)      # radius of the face
    divisions: int = 16
    element_nodes: int = 8                      # set by mesh.element

    def __post_init__(self):
        require([f"{n}: {getattr(self, n)!r} is not positive" for n in ("width", "height", "crown") if not getattr(self, n) > 0.0])


def build(params: MyDamper) -> dict[str, Mesh]:
    """Two boxes of hexahedra; the upper one's lower face is bent up by r^2 / (2 crown)."""
    return {"damper": box(params, 1.0), "platform": box(params, -1.0)}


def box(p: MyDamper, side: float) -> Mesh:
    a, low, high = p.width / 2.0, *sorted((0.0, side * p.height))
    square = [(-a, -a), (a, -a), (a, a), (-a, a)]
    with session("box") as gmsh:
        blocks = Blocks(gmsh)
        for k, (x, y) in enumerate(square):
            blocks.point(f"b{k}", (x, y, low))
            blocks.point(f"t{k}", (x, y, high))
        for k in range(4):
            blocks.curve(f"b{k}", f"b{(k + 1) % 4}", p.divisions)
            blocks.curve(f"t{k}", f"t{(k + 1) % 4}", p.divisions)
            blocks.curve(f"b{k}", f"t{k}", p.divisions // 2)
        blocks.volume("box", [f"b{k}" for k in range(4)] + [f"t{k}" for k in range(4)])
        points, grids = blocks.mesh(p.element_nodes)
    grid, contact, far = grids["box"], int(side < 0.0), int(side > 0.0)
    if side > 0.0:
        points[:, 2] += (1.0 - points[:, 2] / p.height) * (points[:, 0] ** 2 + points[:, 1] ** 2) / (2.0 * p.crown)
    return Mesh(
        points,
        grid.hexes(),
        faces={"contact": grid.faces(2, contact)},
        nodes={"contact": grid.layer(2, contact).ravel(), "distant": grid.layer(2, far).ravel()},
    )
'''

#: my.toml
MY_SCENE = """
name = "my"
title = "A crowned damper on its platform"
want = ["normal", "stiffness", "curve"]

[geometry]
recipe = "./my_damper.py"
width = "4 mm"
crown = "0.3 m"

[mesh]
element = "hex8i"

[materials.damper]
E = "200 GPa"
nu = 0.3

[materials.platform]
E = "200 GPa"
nu = 0.3

[loads]
normal = ["400 N"]
curve_points = 4
"""


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user's folder with the two files; no test touches the user's cache."""
    monkeypatch.setenv("UPD_CACHE", str(tmp_path / "cache"))
    folder = tmp_path / "mine"
    folder.mkdir()
    monkeypatch.chdir(folder)
    (folder / "my_damper.py").write_text(MY_DAMPER, encoding="utf-8")
    (folder / "my.toml").write_text(MY_SCENE, encoding="utf-8")
    return folder


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as end:
        cli.main(list(arguments))
    return int(end.value.code or 0)


def test_from_two_files_to_numbers(mine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("plan", "my.toml") == 0
    assert "A crowned damper on its platform" in capsys.readouterr().out
    assert call("run", "my.toml", "--out", "run", "--no-report") == 0
    summary = json.loads((mine / "run" / "summary.json").read_text(encoding="utf-8"))
    assert summary["status"] == "ok"
    assert summary["size"]["mesh"]["crown"] == 300.0
    arrays = read_netcdf(mine / "run" / "result.nc")["F=400 N"]
    assert arrays["normal_force"].sum() == pytest.approx(400.0, rel=1e-9)
    # The crown is symmetric and the loads are: so is the pressure, to the solver's tolerance.
    np.testing.assert_allclose(arrays["pressure"], arrays["pressure"][::-1], atol=1e-6 * arrays["pressure"].max())
    # A shallow sphere on bodies not much larger than the contact: Hertz within what 3 nodes along the radius and small bodies allow.
    exact = upd.reference.hertz_sphere(400.0, 300.0, upd.reference.contact_modulus(2e5, 0.3, 2e5, 0.3))
    assert arrays["pressure"].max() == pytest.approx(exact.max_pressure, rel=0.1)
    slope = next(c for c in summary["checks"] if c["name"] == "slope in the contact")
    assert slope["value"] == pytest.approx(exact.radius / 300.0, rel=0.35), "a / R of a sphere, to one node spacing"


def test_flatter_crown_is_stiffer_and_a_flat_face_is_a_bar(mine: Path) -> None:
    """With the ends held and nu = 0 a flat face is one bar of two halves: K_N = E A / L exactly."""
    steel = {f"materials.{body}.nu": 0.0 for body in ("damper", "platform")}
    changes = {**steel, "want": ["normal", "stiffness"]}
    flat = upd.run("my.toml", overrides={**changes, "geometry.crown": "1e12 mm"})
    crowned = upd.run("my.toml", overrides=changes)
    bar = 2.0e5 * 4.0 * 4.0 / 8.0
    assert flat.value("K_N_tangent_raw") == pytest.approx(bar, rel=1e-6)
    assert crowned.value("K_N_tangent_raw") < 0.9 * bar


def test_parameters_are_checked_with_their_place(mine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code = call("plan", "my.toml", "--set", "geometry.crwon=1 mm", "--set", "geometry.width=5 kg", "--set", "geometry.divisions=many")
    told = capsys.readouterr().err
    assert code == 2
    assert "geometry.crwon: unknown key, did you mean 'crown'?" in told
    assert "geometry.width: 'kg' is a unit of" in told or "geometry.width: unit 'kg' is not known" in told
    assert "geometry.divisions" in told
    assert call("plan", "my.toml", "--set", "geometry.height=-1 mm") == 2
    assert "height: -1.0 is not positive" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (('"distant": ', '"far": '), ["damper: node set 'distant', the nodes that are held and loaded, is missing", "far (289)"]),
        (('"contact": grid.layer(2, contact).ravel(), ', ""), ["platform: node set 'contact'", "found: distant (289)"]),
        (('faces={"contact": ', 'faces={"touching": '), ["faces 'contact', the surface that touches", "found: touching (256)"]),
    ],
)
def test_missing_sets_are_told_with_what_was_found(
    change: tuple[str, str], told: list[str], mine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (mine / "my_damper.py").write_text(MY_DAMPER.replace(*change), encoding="utf-8")
    assert call("run", "my.toml", "--out", "run") == 2
    message = capsys.readouterr().err
    for words in told:
        assert words in message
    assert "name these sets in build()" in message
    assert not (mine / "run").exists()


def test_bodies_are_named_like_their_materials(mine: Path) -> None:
    (mine / "my_damper.py").write_text(MY_DAMPER.replace('"platform": box', '"blade": box'), encoding="utf-8")
    with pytest.raises(InputError, match="blade has no material; platform is not one of them"):
        upd.run("my.toml")


def test_texts_are_never_executed(mine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = "__import__('os')._exit(3) {{ 7 * 7 }} $(exit 3) [/]"
    (mine / "my.toml").write_text(MY_SCENE.replace("A crowned damper on its platform", text), encoding="utf-8")
    assert call("plan", "my.toml") == 0
    assert "{{ 7 * 7 }} $(exit 3) [/]" in capsys.readouterr().out


def test_mesh_is_made_once(mine: Path) -> None:
    scene = upd.load_scene("my.toml")
    upd.make_plan(scene)
    parameters = {k: v for k, v in scene.geometry.items() if k != "recipe"}
    assert recipes.build_mesh(scene.recipe, {**parameters, "element_nodes": 8})[1], "taken from the cache"
