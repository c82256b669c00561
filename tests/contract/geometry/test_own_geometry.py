"""A user's own geometry, from the two files of upd/scenes/examples to numbers, and what is told
when a set is missing.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import upd
from upd import cli
from upd.errors import InputError
from upd.mesh import recipes
from upd.results import read_netcdf

#: the files a user copies
EXAMPLES = Path(upd.__file__).parent / "scenes" / "examples"
RECIPE = (EXAMPLES / "own_damper.py").read_text(encoding="utf-8")
SCENE = (EXAMPLES / "own_damper.toml").read_text(encoding="utf-8")


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user's folder with copies of the two files; no test touches the user's cache."""
    monkeypatch.setenv("UPD_CACHE", str(tmp_path / "cache"))
    folder = tmp_path / "mine"
    folder.mkdir()
    monkeypatch.chdir(folder)
    for name in ("own_damper.py", "own_damper.toml"):
        shutil.copy(EXAMPLES / name, folder)
    return folder


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as end:
        cli.main(list(arguments))
    return int(end.value.code or 0)


def test_from_two_files_to_numbers(mine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("plan", "own_damper.toml") == 0
    assert "A crowned damper on its platform" in capsys.readouterr().out
    assert call("run", "own_damper.toml", "--out", "run", "--no-report") == 0
    summary = json.loads((mine / "run" / "summary.json").read_text(encoding="utf-8"))
    assert summary["status"] == "ok"
    assert summary["size"]["mesh"]["crown"] == 300.0
    read = read_netcdf(mine / "run" / "result.nc")["F=400 N"]
    arrays = {name: one.data for name, one in read.items()}
    assert arrays["normal_force"].sum() == pytest.approx(400.0, rel=1e-9)
    # The crown is symmetric and the loads are: so is the pressure, to the solver's tolerance.
    np.testing.assert_allclose(
        arrays["pressure"], arrays["pressure"][::-1], atol=1e-6 * arrays["pressure"].max()
    )
    # A shallow sphere on bodies not much larger than the contact: Hertz within what 3 nodes along
    # the radius and small bodies allow.
    exact = upd.reference.hertz_sphere(
        400.0, 300.0, upd.reference.contact_modulus(2e5, 0.3, 2e5, 0.3)
    )
    assert arrays["pressure"].max() == pytest.approx(exact.max_pressure, rel=0.1)
    slope = next(c for c in summary["checks"] if c["name"] == "slope in the contact")
    assert slope["value"] == pytest.approx(exact.radius / 300.0, rel=0.35), (
        "a / R of a sphere, to one node spacing"
    )


def test_flatter_crown_is_stiffer_and_a_flat_face_is_a_bar(mine: Path) -> None:
    """With the ends held and nu = 0 a flat face is one bar of two halves: K_N = E A / L exactly."""
    steel = {f"materials.{body}.nu": 0.0 for body in ("damper", "platform")}
    changes = {**steel, "want": ["normal", "stiffness"]}
    flat = upd.run("own_damper.toml", overrides={**changes, "geometry.crown": "1e12 mm"})
    crowned = upd.run("own_damper.toml", overrides=changes)
    bar = 2.0e5 * 4.0 * 4.0 / 8.0
    assert flat.value("K_N_tangent_raw") == pytest.approx(bar, rel=1e-6)
    assert crowned.value("K_N_tangent_raw") < 0.9 * bar


#: the distant set with the tributary areas of its nodes
WEIGHTED = RECIPE.replace(
    """    return Mesh(
        points,
""",
    """    own = named(grid.layer(2, far))
    areas = traction_weights(points, grid.faces(2, far))[own]
    return Mesh(
        points,
""",
).replace(
    '"distant": named(grid.layer(2, far))},',
    '"distant": own}, weights={"distant": areas},',
)
WEIGHTED = WEIGHTED.replace(
    "from upd.mesh import Mesh\n",
    "from upd.fem import traction_weights\nfrom upd.mesh import Mesh\n",
)


def test_a_set_with_weights_holds_evenly(mine: Path) -> None:
    """A flat face is one bar again, K_N = E A / L with any nu: no end is kept from contracting."""
    changes = {
        "geometry.crown": "1e12 mm",
        "geometry.divisions": 8,
        "want": ["normal", "stiffness"],
        "accuracy": "unknown",
    }
    bar = 2.0e5 * 4.0 * 4.0 / 8.0
    held = upd.run("own_damper.toml", overrides=changes)
    assert held.value("K_N_tangent_raw") > 1.02 * bar
    (mine / "own_damper.py").write_text(WEIGHTED, encoding="utf-8")
    even = upd.run("own_damper.toml", overrides=changes)
    assert even.value("K_N_tangent_raw") == pytest.approx(bar, rel=1e-6)


@pytest.mark.parametrize(
    ("weights", "told"),
    [
        (
            "areas[1:]",
            "weights 'distant' have the shape (288,); give one per node of the set, (289,)",
        ),
        ("-areas", "weights 'distant' sum to -16 mm2; give finite ones of a positive sum"),
        ('areas.astype("U9")', "weights 'distant' hold <U9 values; give areas in mm2"),
    ],
)
def test_wrong_weights_are_told(
    weights: str, told: str, mine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = WEIGHTED.replace('weights={"distant": areas}', f'weights={{"distant": {weights}}}')
    (mine / "own_damper.py").write_text(text, encoding="utf-8")
    assert call("run", "own_damper.toml", "--out", "run") == 2
    assert f"damper: {told}" in capsys.readouterr().err
    text = WEIGHTED.replace('weights={"distant": areas}', 'weights={"far": areas}')
    (mine / "own_damper.py").write_text(text, encoding="utf-8")
    assert call("run", "own_damper.toml", "--out", "run") == 2
    assert "weights 'far' belong to no node set; give the set" in capsys.readouterr().err


def test_parameters_are_checked_with_their_place(
    mine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = call(
        "plan",
        "own_damper.toml",
        "--set",
        "geometry.crwon=1 mm",
        "--set",
        "geometry.width=5 kg",
        "--set",
        "geometry.divisions=many",
    )
    told = capsys.readouterr().err
    assert code == 2
    assert "geometry.crwon: unknown key, did you mean 'crown'?" in told
    assert (
        "geometry.width: 'kg' is a unit of" in told
        or "geometry.width: unit 'kg' is not known" in told
    )
    assert "geometry.divisions" in told
    assert call("plan", "own_damper.toml", "--set", "geometry.height=-1 mm") == 2
    assert "height: -1.0 is not positive" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (
            ('"distant": ', '"far": '),
            [
                "damper: node set 'distant', the nodes that are held and loaded, is missing",
                "far (289)",
            ],
        ),
        (
            ('"contact": named(grid.layer(2, contact)), ', ""),
            ["platform: node set 'contact'", "found: distant (289)"],
        ),
        (
            ('faces={"contact": ', 'faces={"touching": '),
            ["faces 'contact', the surface that touches", "found: touching (256)"],
        ),
    ],
)
def test_missing_sets_are_told_with_what_was_found(
    change: tuple[str, str], told: list[str], mine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (mine / "own_damper.py").write_text(RECIPE.replace(*change), encoding="utf-8")
    assert call("run", "own_damper.toml", "--out", "run") == 2
    message = capsys.readouterr().err
    for words in told:
        assert words in message
    assert "name these sets in build()" in message
    assert not (mine / "run").exists()


def test_bodies_are_named_like_their_materials(mine: Path) -> None:
    (mine / "own_damper.py").write_text(
        RECIPE.replace('"platform": box', '"blade": box'), encoding="utf-8"
    )
    with pytest.raises(InputError, match="blade has no material; platform is not one of them"):
        upd.run("own_damper.toml")


def test_texts_are_never_executed(mine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = "__import__('os')._exit(3) {{ 7 * 7 }} $(exit 3) [/]"
    (mine / "own_damper.toml").write_text(
        SCENE.replace("A crowned damper on its platform", text), encoding="utf-8"
    )
    assert call("plan", "own_damper.toml") == 0
    assert "{{ 7 * 7 }} $(exit 3) [/]" in capsys.readouterr().out


def test_mesh_is_made_once(mine: Path) -> None:
    scene = upd.load_scene("own_damper.toml")
    upd.make_plan(scene)
    parameters = {k: v for k, v in scene.geometry.items() if k != "recipe"}
    assert recipes.build_mesh(scene.recipe, {**parameters, "element_nodes": 8})[1], (
        "taken from the cache"
    )


def test_examples_are_no_ready_scenes() -> None:
    assert not {path.stem for path in EXAMPLES.iterdir()} & set(upd.scene.ready_scenes())
    assert upd.load_scene(EXAMPLES / "own_damper.toml").recipe == str(EXAMPLES / "own_damper.py")


TWO_PATCHES = """
from dataclasses import dataclass

from geometry.pads_platform import PadsPlatform
from geometry.pads_platform import build as pads
from upd.mesh import Mesh


@dataclass(frozen=True)
class TwoPatches:
    element_nodes: int = 8


def build(params: TwoPatches) -> dict[str, Mesh]:
    made = {}
    for name, m in pads(PadsPlatform(divisions=3, divisions_long=4, growth=2.0)).items():
        nodes = dict(m.nodes)
        nodes["contact_a"] = nodes.pop("contact_left")
        nodes["contact_b"] = nodes.pop("contact_right")
        made[name] = Mesh(m.points, m.hexes, m.faces, nodes)
    return made
"""


def two_patches(folder: Path, recipe: str) -> str:
    """A scene on a recipe with two pads, sets contact_a and contact_b."""
    (folder / "two.py").write_text(recipe, encoding="utf-8")
    own = ("recipe", "width", "crown")
    lines = [line for line in SCENE.splitlines() if not line.startswith(own)]
    text = "\n".join(lines).replace("[geometry]", '[geometry]\nrecipe = "./two.py"')
    (folder / "two.toml").write_text(text, encoding="utf-8")
    return "two.toml"


def test_two_patches_without_an_analysis_are_told(
    mine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = two_patches(mine, TWO_PATCHES)
    assert call("run", scene, "--out", "run") == 2
    told = capsys.readouterr().err
    assert "contact_a, contact_b are 2 patches, a curved contact has one" in told
    assert 'to fix it: write ANALYSIS = "flat contact"' in told
    assert not (mine / "run").exists()
    # the remedy is one
    two_patches(mine, 'ANALYSIS = "flat contact"\n' + TWO_PATCHES)
    result = upd.run(scene)
    # on its crown, and on few elements
    assert {c.name for c in result.checks if not c.passed} <= {"tilt of the damper", "resolution"}


def test_patches_that_leave_nodes_out_are_told(mine: Path) -> None:
    cut = TWO_PATCHES.replace(
        "        made[name]",
        "        nodes['contact_b'] = nodes['contact_b'][1:]\n        made[name]",
    )
    scene = two_patches(mine, 'ANALYSIS = "flat contact"\n' + cut)
    with pytest.raises(InputError, match="1 nodes of 'contact' not at all"):
        upd.run(scene)
