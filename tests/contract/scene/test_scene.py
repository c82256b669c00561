"""Scenes at the door: good ones read, every fault of bad ones told at once with its path and a
remedy.
"""

import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

import upd
from upd.errors import InputError
from upd.scene import load_scene, ready_scenes
from upd.scene.bladed_disk import BLADED_DISK_WANTS
from upd.scene.contact import WANTS
from upd.scene.forced import FORCED_WANTS
from upd.scene.modal import MODAL_WANTS
from upd.scene.seated import SEATED_WANTS


def faults(*overrides: str) -> str:
    with pytest.raises(InputError) as caught:
        load_scene("hertz", overrides)
    return str(caught.value)


def test_ready_scenes_are_valid() -> None:
    assert "hertz" in ready_scenes()
    known = {*WANTS, *MODAL_WANTS, *FORCED_WANTS, *SEATED_WANTS, *BLADED_DISK_WANTS}
    for name in ready_scenes():
        scene = upd.load_scene(name)
        assert scene.name == name
        assert set(scene.want) <= known


def test_units_are_turned_into_mm_and_mpa() -> None:
    scene = load_scene(
        "hertz",
        ["geometry.radius=0.005 m", "materials.sphere.E=2e11 Pa", 'loads.normal=["0.05 kN"]'],
    )
    assert scene.geometry["radius"] == 5.0
    assert scene.materials["sphere"].E == 2.0e5
    assert scene.loads.normal == (50.0,)


def test_overrides_by_mapping_and_text_agree() -> None:
    a = load_scene("hertz", ["contact.friction=0.3", "mesh.symmetry=full"])
    b = load_scene("hertz", {"contact.friction": 0.3, "mesh.symmetry": "full"})
    assert a == b
    assert a.contact.friction == 0.3


def test_scene_as_run_reads_back_the_same(tmp_path: Path) -> None:
    scene = load_scene(
        "hertz",
        [
            "contact.friction=0.3",
            "geometry.patch=auto",
            "accuracy=1 %",
            "geometry.radius=6 mm",
        ][:2],
    )
    path = tmp_path / "again.toml"
    path.write_text(scene.text, encoding="utf-8")
    again = load_scene(path)
    assert again.contact == scene.contact
    assert again.geometry == scene.geometry
    assert again.loads == scene.loads


def test_all_faults_in_one_message() -> None:
    told = faults(
        "geometry.radius=5 kg",
        "geometry.patsh=1 mm",
        "materials.sphere.nu=0.5",
        'loads.normal=["-5 N"]',
        "mesh.element=hex9",
        "contact.frictoin=0.3",
        "colour=red",
    )
    assert "geometry.radius" in told
    assert "a length is needed" in told
    assert "did you mean 'patch'" in told
    assert "mesh.element" in told
    assert "did you mean 'friction'" in told
    assert "colour: unknown key" in told
    first = told.splitlines()[0]
    assert first == f"hertz.toml: {len(told.splitlines()) - 1} problems"


@pytest.mark.parametrize(
    ("override", "told"),
    [
        ('loads.normal=["-5 N"]', "pulls the bodies apart"),
        ("loads.normal=[]", "is empty"),
        ("loads.tangential=[1.0]", "gross slip"),
        ("loads.tangential=[-0.1]", "is negative"),
        ("loads.cycle_amplitude=1.2", "outside (0, 1)"),
        ("contact.friction=-0.1", "is negative"),
        ("materials.sphere.E=200", "has no unit"),
        ("materials.sphere.E=-200 GPa", "not positive"),
        ("materials.sphere.nu=0.6", "outside (-1, 0.5)"),
        ("geometry.radius=-5 mm", "radius: -5.0 is not a positive number"),
        ("geometry.patch=9 mm", "too large for the sphere"),
        ("geometry.divisions=41", "not an even number"),
        ("geometry.divisions=40.5", "not a whole number"),
        ("geometry.symmetry=full", "set mesh.symmetry instead"),
        ("geometry.recipe=cube", "geometry.recipe"),
        ("accuracy=2", "outside (0, 1)"),
        ("geometry.radius=auto", 'cannot be "auto"'),
        ('loads.normal=["200 N", "200.00001 N"]', "duplicated"),
        ("name=../../x", "is no name"),
        ("geometry.divisions=auto", "needs an accuracy"),
        ('want=["normal", "colour"]', "'colour' is none of its values; write one of"),
        ("want=[]", "is empty"),
        ("solver.name=mumps", "solver.name"),
    ],
)
def test_each_fault_names_its_path_and_the_remedy(override: str, told: str) -> None:
    message = faults(override)
    assert told in message
    path = override.partition("=")[0].split(".")[0]
    assert path in message


def test_missing_parts_are_named(tmp_path: Path) -> None:
    path = tmp_path / "bare.toml"
    path.write_text('name = "bare"\n', encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_scene(path)
    for part in ("want", "geometry", "materials", "loads"):
        assert f"{part}: is missing" in str(caught.value)


def test_files_that_are_no_scenes(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="Did you mean 'hertz'"):
        load_scene("hertzz")
    with pytest.raises(InputError, match="no scene"):
        load_scene(tmp_path / "absent.toml")
    broken = tmp_path / "broken.toml"
    broken.write_text("name = \n", encoding="utf-8")
    with pytest.raises(InputError, match="not valid TOML"):
        load_scene(broken)
    broken.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not valid TOML"):
        load_scene(broken)
    with pytest.raises(InputError, match="path=value"):
        load_scene("hertz", ["contact.friction"])
    with pytest.raises(InputError, match="is a value, not a table"):
        load_scene("hertz", ["name.first=3"])


def test_text_of_a_scene_is_toml_whatever_it_holds() -> None:
    import numpy as np

    scene = load_scene(
        "hertz",
        {
            "contact.friction": np.float64(0.3),
            "geometry.divisions": np.int64(20),
            "title": 'a "b"\r\x01\x7f',
        },
    )
    data = tomllib.loads(scene.text)
    assert data["contact"]["friction"] == 0.3
    assert data["title"] == 'a "b"\r\x01\x7f'
    assert load_scene(data) == scene


def test_recipe_file_is_found_beside_its_scene_from_anywhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine.py").write_text(
        "from geometry.sphere_block import CLOSED_FORM, SphereBlock, build, count\n",
        encoding="utf-8",
    )
    text = (
        ready_scenes()["hertz"]
        .read_text(encoding="utf-8")
        .replace('"sphere_block"', '"./mine.py"')
        .replace("= 40", "= 8")
    )
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    monkeypatch.chdir("/")
    scene = load_scene(tmp_path / "mine.toml", ['want=["normal"]', 'loads.normal=["200 N"]'])
    assert load_scene_text(scene.text, tmp_path) == scene.geometry
    assert upd.run(scene).value("max_pressure") == pytest.approx(
        upd.run(
            "hertz",
            overrides={"want": ["normal"], "loads.normal": ["200 N"], "geometry.divisions": 8},
        ).value("max_pressure"),
        rel=1e-12,
    )


def test_paths_of_the_terminal_are_those_of_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the file relative to the file, typed beside a command relative to where it is typed."""
    there, here = tmp_path / "there", tmp_path / "here"
    for folder in (there, here):
        folder.mkdir()
        (folder / "mine.py").write_text(
            "from geometry.sphere_block import CLOSED_FORM, SphereBlock, build, count\n",
            encoding="utf-8",
        )
        shutil.copy(ready_scenes()["hertz"], folder / "contact.toml")
    hertz = ready_scenes()["hertz"].read_text(encoding="utf-8")
    (there / "mine.toml").write_text(hertz.replace('"sphere_block"', '"./mine.py"'), "utf-8")
    response = ready_scenes()["symmetric-response"].read_text(encoding="utf-8")
    (there / "response.toml").write_text(
        response.replace('scene = "symmetric"', 'scene = "contact.toml"'), "utf-8"
    )
    monkeypatch.chdir(here)
    given = load_scene(there / "mine.toml")
    assert given.recipe == str(there / "mine.py")
    assert load_scene(there / "response.toml").stiffness["own"].scene == str(there / "contact.toml")
    for source in (there / "mine.toml", "hertz"):
        for typed in (
            ["geometry.recipe=./mine.py"],
            {"geometry.recipe": "mine.py"},
            {"geometry": {"recipe": "mine.py", "radius": "5 mm"}},
        ):
            assert load_scene(source, typed).recipe == str(here / "mine.py")
    for source in (there / "response.toml", "symmetric-response"):
        for key, typed in (("scene", "contact.toml"), ("run", "runs/symmetric")):
            other = load_scene(source, {"stiffness.own": {key: typed}})
            assert getattr(other.stiffness["own"], key) == str(here / typed)
    assert load_scene(there / "response.toml", ["stiffness.own.scene=contact.toml"]).stiffness[
        "own"
    ].scene == str(here / "contact.toml")
    # what is loaded reads back as it is, whatever the working directory
    monkeypatch.chdir("/")
    assert load_scene(dict(tomllib.loads(given.text))).recipe == given.recipe


def load_scene_text(text: str, folder: Path) -> object:
    again = folder / "elsewhere"
    again.mkdir()
    (again / "scene.toml").write_text(text, encoding="utf-8")
    return load_scene(again / "scene.toml").geometry


def test_one_material_is_told(tmp_path: Path) -> None:
    scene = load_scene({**_hertz_tables(), "materials": {"sphere": {"E": "200 GPa", "nu": 0.3}}})
    with pytest.raises(InputError, match="two bodies, 1 given"):
        upd.make_plan(scene)


def test_geometry_without_a_radius_keeps_its_closed_form() -> None:
    tables = _hertz_tables()
    del tables["geometry"]["radius"]
    result = upd.run(
        tables, overrides={"want": ["normal"], "loads.normal": ["200 N"], "geometry.divisions": 8}
    )
    assert all(r.reference is not None for r in result.rows if r.name != "closed_form_error")
    with pytest.raises(InputError, match="loaded already"):
        upd.run(load_scene("hertz"), overrides=["contact.friction=0"])


def _hertz_tables() -> dict:

    return tomllib.loads(ready_scenes()["hertz"].read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", ["rig", "hertz"])
def test_a_recipe_that_cannot_be_read_is_one_problem(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        load_scene(name, {"geometry.recipe": str(tmp_path / "none.py")})
    assert len(str(caught.value).splitlines()) == 2, caught.value
    assert "geometry.recipe: recipe" in str(caught.value)


def test_a_damper_without_a_force_is_refused() -> None:
    with pytest.raises(InputError, match=r"loads\.centrifugal: 0 N .*give the force"):
        load_scene("symmetric", {"loads.centrifugal": "0 N"})
    with pytest.raises(InputError, match=r"loads\.normal: 0 N .*positive"):
        load_scene("symmetric", {"loads.normal": ["0 N"]})


def test_files_of_windows_editors_load(tmp_path: Path) -> None:
    examples = Path(str(ready_scenes()["hertz"])).parent / "examples"
    for name in ("own_damper.toml", "own_damper.py"):
        text = (examples / name).read_text(encoding="utf-8")
        (tmp_path / name).write_text(text, encoding="utf-8-sig", newline="\r\n")
    assert (tmp_path / "own_damper.toml").read_bytes().startswith(b"\xef\xbb\xbf")
    theirs, ours = (load_scene(folder / "own_damper.toml") for folder in (tmp_path, examples))
    assert replace(theirs, text="", geometry={}) == replace(ours, text="", geometry={})
    assert {k: v for k, v in theirs.geometry.items() if k != "recipe"} == {
        k: v for k, v in ours.geometry.items() if k != "recipe"
    }
