"""`upd mesh`: recipes and scenes, configurations, parameters with bounds, files of every body."""

from __future__ import annotations

import shutil
from pathlib import Path

import meshio
import numpy as np
import pytest

import upd
from upd import cli
from upd.analyses.meshing import mesh_request
from upd.cli import terminal
from upd.mesh import recipes
from upd.mesh.recipe_modules import READY
from upd.scene.keys import recipe_keys

EXAMPLES = Path(upd.__file__).parent / "scenes" / "examples"
#: a quick mesh of each recipe
SMALL = {
    "sphere_block": ["--set", "divisions=4", "--set", "growth=2.0"],
    "wedge_platform": ["--set", "divisions=2", "--set", "divisions_long=4", "--set", "growth=2"],
    "pads_platform": ["--set", "divisions=2", "--set", "divisions_long=2", "--set", "growth=2"],
    "blade_rig": ["--set", "element_nodes=8", "--set", "wing_columns=1"],
}


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    # no cell is folded, whatever width the terminal had when its console was made
    monkeypatch.setattr(terminal.console, "width", 240)


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as end:
        cli.main(["mesh", *arguments])
    return int(end.value.code or 0)


@pytest.mark.parametrize("recipe", list(SMALL))
@pytest.mark.parametrize("ending", ["msh", "vtu", "inp"])
def test_every_body_is_in_every_file(recipe: str, ending: str) -> None:
    settings = SMALL[recipe]
    assert call(recipe, *settings, "-o", f"all.{ending}", "--no-picture") == 0
    assert call(recipe, *settings, "-o", f"one.{ending}", "--split", "--no-picture") == 0
    overrides = [settings[k + 1] for k, word in enumerate(settings) if word == "--set"]
    request = mesh_request(recipe, overrides)
    meshes, _ = recipes.build_mesh(recipe, request.given)
    total = 0
    for body, mesh in meshes.items():
        found = meshio.read(f"one-{body}.{ending}")
        np.testing.assert_allclose(found.points, mesh.points, rtol=1e-12, atol=1e-12)
        total += mesh.n_node
    assert len(meshio.read(f"all.{ending}").points) == total
    assert sorted(p.name for p in Path.cwd().iterdir()) == sorted(
        [f"all.{ending}", *(f"one-{body}.{ending}" for body in meshes)]
    )


def test_by_default_all_formats_and_a_picture_in_a_folder_of_their_own(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert call("sphere_block", *SMALL["sphere_block"]) == 0
    folder = Path("runs/mesh-sphere_block")
    names = [f"sphere_block.{ending}" for ending in ("inp", "msh", "png", "vtu")]
    assert sorted(p.name for p in folder.iterdir()) == names
    assert (folder / "sphere_block.png").read_bytes().startswith(b"\x89PNG")
    told = capsys.readouterr().out
    assert "divisions 4, growth 2" in told
    (pairs,) = [line for line in told.splitlines() if line.split()[:2] == ["sphere,", "block"]]
    assert pairs.split()[2:5] == ["contact", "25", "0"], "5 x 5 pairs of nodes"
    assert told.count("scaled Jacobian") == told.count("aspect ratio") == 2
    assert call("sphere_block", *SMALL["sphere_block"], "--no-picture") == 0
    assert Path("runs/mesh-sphere_block-2").is_dir(), "the first one stays"


def test_worst_elements_are_where_it_says(capsys: pytest.CaptureFixture[str]) -> None:
    from upd.mesh.checks import edge_ratio, scaled_jacobian

    assert call("sphere_block", *SMALL["sphere_block"], "-o", "a.msh", "--no-picture") == 0
    told = capsys.readouterr().out
    meshes, _ = recipes.build_mesh("sphere_block", {"divisions": 4, "growth": 2.0})
    lines = [line for line in told.splitlines() if "Jacobian" in line or "aspect" in line]
    assert len(lines) == 2 * len(meshes)
    for jacobian, aspect, mesh in zip(lines[::2], lines[1::2], meshes.values(), strict=True):
        centre = mesh.points[mesh.hexes[:, :8]].mean(axis=1)
        assert f"{scaled_jacobian(mesh).min():.3f}" in jacobian
        assert f"{edge_ratio(mesh).max():.1f}" in aspect
        x, y, z = centre[scaled_jacobian(mesh).argmin()]
        assert f"{x:.3g}, {y:.3g}, {z:.3g}" in jacobian


def test_a_scene_gives_the_whole_model_and_the_old_call_stays() -> None:
    small = ["--set", "geometry.divisions=4", "--set", "geometry.patch=1 mm"]
    assert call("hertz", *small, "-o", "whole.vtu") == 0
    assert Path("whole.png").is_file()
    part = ["--set", "mesh.symmetry=quarter", "--no-picture"]
    assert call("hertz", *small, "-o", "quarter.vtu", *part) == 0
    whole, quarter = (meshio.read(f"{name}.vtu") for name in ("whole", "quarter"))
    assert whole.points[:, :2].min() < -4.0
    assert quarter.points[:, :2].min() == 0.0
    cells = [sum(len(block.data) for block in mesh.cells) for mesh in (whole, quarter)]
    assert cells[0] == 4 * cells[1]


def test_a_symmetry_the_scene_names_is_kept() -> None:
    assert mesh_request("hertz").given["symmetry"] == "full"
    assert mesh_request("hertz", ["mesh.symmetry=half"]).given["symmetry"] == "half"
    assert mesh_request("rig").given["symmetry"] == "full"
    assert mesh_request("rig", ["mesh.symmetry=half"]).given["symmetry"] == "half"


@pytest.mark.parametrize("arrangement", ["symmetric", "asymmetric"])
@pytest.mark.parametrize(
    ("damper", "bodies"),
    [("none", ["left", "right"]), ("glued", ["rig"]), ("free", ["left", "right", "damper"])],
)
def test_configurations_of_the_rig(arrangement: str, damper: str, bodies: list[str]) -> None:
    settings = ["element_nodes=8", f"arrangement={arrangement}", f"damper={damper}"]
    request = mesh_request("blade_rig", settings)
    assert request.given["arrangement"] == arrangement
    assert list(recipes.count(request.recipe, request.given)) == bodies


def test_pairs_of_the_free_damper_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    settings = [*SMALL["blade_rig"], "--no-picture"]
    assert call("blade_rig", *settings, "--set", "damper=free", "-o", "a.msh") == 0
    told = capsys.readouterr().out
    for side in ("left", "right"):
        (line,) = [row for row in told.splitlines() if f"patch, {side}_patch" in row]
        assert line.split()[-3:] == ["55", "0", "0"], "11 x 5 nodes, on each other"
    assert call("blade_rig", *settings, "--set", "damper=glued", "-o", "a.msh") == 0
    assert "left_patch 55 nodes, right_patch 55 nodes" in capsys.readouterr().out
    assert call("blade_rig", *settings, "-o", "a.msh") == 0
    assert "No bodies touch" in capsys.readouterr().out


def test_own_recipe_by_its_file(capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copy(EXAMPLES / "own_damper.py", ".")
    assert call("own_damper.py", "--set", "divisions=4", "--set", "width=5 mm", "-o", "a.inp") == 0
    assert "width 5 mm, divisions 4" in capsys.readouterr().out
    assert Path("a.png").is_file()
    assert call("own_damper.py", "--list") == 0
    told = capsys.readouterr().out
    assert "crown" in told


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (
            ["sphere_blok", "-o", "a.msh"],
            "is neither a file here nor a ready scene, nor a recipe; recipes: sphere_block",
        ),
        (["sphere_block", "-o", "a.stl"], "the ending '.stl' is not known; use .msh"),
        (["sphere_block", "-o", "no/where/a.msh"], "cannot be written"),
        (["sphere_block", "--set", "radius=5"], "has no unit"),
        (["sphere_block", "--set", "radus=5 mm"], "radus: unknown key, did you mean 'radius'?"),
        (["sphere_block", "--set", "contact.friction=0.3"], "a recipe has parameters only"),
        (["sphere_block", "--set", "patch=auto"], '"auto" needs the loads of a scene'),
        (["sphere_block", "--set", "patch=9 mm"], "at most 4.24264 mm"),
        (["sphere_block", "--set", "patch"], "write it as path=value"),
        (["sphere_block", "--set", "damper=glued"], "damper: set want"),
        (
            ["blade_rig", "--set", "symmetry=quarter"],
            'symmetry: \'quarter\' is not "full" or "half"',
        ),
        (["none.py"], "cannot be read"),
        (["sphere_block", "--picture", "a.jpg", "--set", "divisions=4"], "use .png"),
    ],
)
def test_faults_are_told_before_anything_is_written(
    arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(*arguments) == 2
    assert told in " ".join(capsys.readouterr().err.split())
    assert list(Path.cwd().iterdir()) == []


def test_the_list_has_units_defaults_and_bounds(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("sphere_block", "--list", "--set", "radius=2 mm") == 0
    told = capsys.readouterr().out
    rows = {line.split()[0]: " ".join(line.split()) for line in told.splitlines() if line.strip()}
    assert rows["patch"].startswith('patch "1 mm" mm > 0 ')
    assert rows["radius"].startswith('radius "2 mm" (default "5 mm") mm ')
    assert "even, >= 2" in rows["divisions"]
    assert "1.05 ... 2" in rows["growth"]
    assert "8, 20, 27" in rows["element_nodes"]
    assert list(Path.cwd().iterdir()) == []


@pytest.mark.parametrize("recipe", READY)
def test_every_parameter_tells_its_bounds_or_choices(recipe: str) -> None:
    assert all(key.bounds for key in recipe_keys(recipe))
