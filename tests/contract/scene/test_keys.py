"""Every key of every scene and recipe is explained, and a scene written with all its values is the
same scene.
"""

from __future__ import annotations

import tomllib
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import pytest

from upd.errors import InputError
from upd.mesh import recipes
from upd.mesh.recipe_modules import READY
from upd.scene import (
    BladedDiskScene,
    ForcedScene,
    ModalScene,
    Scene,
    SeatedScene,
    load_scene,
    ready_scenes,
)
from upd.scene.keys import (
    SceneKey,
    chosen_keys,
    entries,
    recipe_keys,
    scene_as_run,
    scene_keys,
    scene_to_start_from,
    table_keys,
)
from upd.units import UNITS, parse_quantity, quantity_text, unit_inside

EXAMPLE = Path(recipes.__file__).parents[1] / "scenes" / "examples" / "own_damper.toml"
KINDS = (Scene, ModalScene, ForcedScene, SeatedScene, BladedDiskScene)
SCENES = [*ready_scenes(), str(EXAMPLE)]
#: numbers without a unit: ratios, counts, coefficients
BARE = {
    *("nu", "friction", "coupling_limit", "tangential", "cycle_amplitude"),
    *("accuracy", "error", "damping", "centrifugal_to_force", "lowest", "highest"),
    *("left_out.stiffness", "left_out.frequency", "left_out.peak"),
    *("growth", "growth_inside", "core_depth", "first_layer", "refine", "seating.over"),
    *("taper", "up_to", "ratios"),
}


def bare(key: SceneKey) -> bool:
    return key.name in BARE or key.path in BARE


@pytest.mark.parametrize("kind", KINDS)
def test_every_key_of_a_scene_is_explained(kind: type[object]) -> None:
    keys = list(table_keys(kind))
    assert len(keys) > 20
    for key in keys:
        assert key.meaning.endswith("."), f"{key.path}: an entry under Attributes, please"
        assert key.default, key.path
        assert key.cost, key.path


@pytest.mark.parametrize("scene", SCENES)
def test_values_of_quantities_have_a_unit(scene: str) -> None:
    """A value written with a unit is a key that names one, and any other number is a known ratio,
    count or choice.
    """
    for key in scene_keys(load_scene(scene)):
        value = tomllib.loads(f"v = {key.value}")["v"] if key.value not in ("none", "") else None
        items = value if isinstance(value, list) else [value]
        for item in items:
            if isinstance(item, float):
                assert bare(key), f"{key.path}: {item} has no unit"
            for kind in UNITS if isinstance(item, str) else ():
                try:
                    parse_quantity(item, kind)
                except InputError:
                    continue
                assert key.unit == unit_inside(kind), key.path


@pytest.mark.parametrize("recipe", [*READY, str(EXAMPLE.with_suffix(".py"))])
def test_every_parameter_of_a_recipe_is_explained(recipe: str) -> None:
    keys = recipe_keys(recipe)
    asked = fields(recipes.parameters(recipe))
    assert [k.name for k in keys] == [f.name for f in asked]
    for key, parameter in zip(keys, asked, strict=True):
        assert key.meaning.endswith("."), f"{key.path}: an entry under Parameters, please"
        assert key.default, key.path
        if recipe in READY:
            assert key.bounds, key.path
            if key.default == "none":
                assert bool(key.unit) == (parameter.metadata["quantity"] is not None), key.path
                continue
            number = tomllib.loads(f"v = {key.default}")["v"]
            assert bool(key.unit) == (isinstance(number, str) and number[0].isdigit()), key.path
            assert not isinstance(number, float) or bare(key), key.path


def test_no_entry_of_a_docstring_is_without_its_key() -> None:
    """A key that was renamed leaves no entry behind."""

    def tables(cls: type[object]) -> list[type[object]]:
        import typing

        found = [cls]
        for hint in typing.get_type_hints(cls).values():
            for inner in (hint, *typing.get_args(hint)):
                if is_dataclass(inner) and isinstance(inner, type):
                    found += tables(inner)
        return found

    for kind in KINDS:
        for cls in tables(kind):
            assert set(entries(cls)) <= {f.name for f in fields(cls)}, cls.__name__  # type: ignore[arg-type]
    for recipe in READY:
        params = recipes.parameters(recipe)
        assert set(entries(params)) <= {f.name for f in fields(params)}


def test_cost_is_a_part_of_the_entry() -> None:
    keys = {k.path: k for k in recipe_keys("sphere_block")}
    assert keys["divisions"].meaning == "Elements along the patch edge, even."
    assert keys["divisions"].cost.startswith("contact nodes grow with the square")
    assert keys["radius"].cost == "none"
    assert keys["radius"].meaning == "Of the half-sphere."
    assert (keys["radius"].unit, keys["radius"].default) == ("mm", '"5 mm"')


@pytest.mark.parametrize("scene", SCENES)
def test_scene_with_every_value_is_the_same_scene(scene: str) -> None:
    loaded = load_scene(scene)
    for text, name in (
        (scene_as_run(loaded), loaded.name),
        (scene_to_start_from(loaded, "mine"), "mine"),
    ):
        again = load_scene(tomllib.loads(text))
        assert replace(again, text="") == replace(loaded, text="", name=name)
        for key in scene_keys(loaded):
            assert any(
                line.startswith((f"{key.name} = ", f"# {key.name} = "))
                and line.endswith(("    # default", "    # follows from other keys"))
                == (not key.given)
                for line in text.splitlines()
            ), key.path


def test_what_was_given_is_written_as_it_was_given() -> None:
    changes = {"loads.normal": ["0.05 kN"], "accuracy": "2 %", "geometry.divisions": "auto"}
    text = scene_as_run(load_scene("hertz", changes))
    assert 'normal = ["0.05 kN"]\n' in text
    assert 'accuracy = "2 %"\n' in text
    assert "curve_points = 12    # default\n" in text
    again = load_scene(tomllib.loads(text))
    assert again.loads.normal == (50.0,)


def test_what_auto_stands_for_needs_no_default_that_fits() -> None:
    """The default of the patch is too large for this sphere; the loads size another."""
    text = scene_as_run(load_scene("hertz", {"geometry.radius": "1 mm", "geometry.patch": "auto"}))
    assert 'patch = "auto"\n' in text


@pytest.mark.parametrize(
    ("scene", "changes"),
    [
        (
            "symmetric",
            {
                "loads.centrifugal": "from speed",
                "loads.mass": "70 g",
                "loads.radius": "300 mm",
                "loads.speed": "3000 rpm",
            },
        ),
        (
            "symmetric-response",
            {
                "damper.centrifugal": "from speed",
                "damper.mass": "70 g",
                "damper.radius": "300 mm",
                "damper.speed": "3000 rpm",
            },
        ),
        (
            "symmetric-response",
            {"excitation.centrifugal_to_force": "from force", "excitation.force": ["2 N"]},
        ),
    ],
)
def test_what_follows_from_other_keys_is_read_back(scene: str, changes: dict[str, object]) -> None:
    loaded = load_scene(scene, changes)
    text = scene_as_run(loaded)
    assert '"from ' in text
    assert replace(load_scene(tomllib.loads(text)), text="") == replace(loaded, text="")


def test_names_that_need_quotes_are_read_back() -> None:
    table = {"K_N": "1e6 N/mm", "K_T": "5e5 N/mm"}
    loaded = load_scene(
        "symmetric-response", {"stiffness": {"v1.2": table}, "contact.stiffness": []}
    )
    again = load_scene(tomllib.loads(scene_as_run(loaded)))
    assert list(again.stiffness) == ["v1.2"]
    assert replace(again, text="") == replace(loaded, text="")


def test_default_of_a_recipe_that_no_file_can_give_stays_out(tmp_path: Path) -> None:
    source = EXAMPLE.with_suffix(".py").read_text("utf-8")
    line = "    divisions: int = 16\n"
    more = '    points: tuple[float, ...] = (1.0, 2.0)\n    far: float = float("inf")\n'
    source = source.replace(line, line + more)
    (tmp_path / "own_damper.py").write_text(source, "utf-8")
    (tmp_path / "own.toml").write_bytes(EXAMPLE.read_bytes())
    loaded = load_scene(tmp_path / "own.toml")
    text = scene_as_run(loaded)
    assert "# points = [1.0, 2.0]    # default" in text
    assert "# far = inf    # default" in text
    assert replace(load_scene(tomllib.loads(text)), text="") == replace(loaded, text="")


@pytest.mark.parametrize(
    ("value", "kind", "text"),
    [
        (5.0, "length", "5 mm"),
        (2e5, "stress", "200 GPa"),
        (7.8e-9, "density", "7800 kg/m3"),
        (0.1 + 0.2, "length", "0.30000000000000004 mm"),
        (1 / 3, "stress", "0.3333333333333333 MPa"),
        (0.05, "fraction", "0.05"),
        (7.2e-5, "mass", "72 g"),
        (1 / 3, "mass", "0.3333333333333333 t"),
    ],
)
def test_quantity_as_text_is_the_same_float(value: float, kind: str, text: str) -> None:
    assert quantity_text(value, kind) == text
    assert parse_quantity(float(text) if kind == "fraction" else text, kind) == value


def test_a_key_is_found_by_path_table_or_name() -> None:
    keys = scene_keys(load_scene("hertz"))
    assert [k.path for k in chosen_keys(keys, "contact.friction")] == ["contact.friction"]
    assert [k.path for k in chosen_keys(keys, "friction")] == ["contact.friction"]
    assert {k.path for k in chosen_keys(keys, "E")} == {"materials.sphere.E", "materials.block.E"}
    tables = {k.steps[:-1] for k in chosen_keys(keys, "materials")}
    assert tables == {("materials", "sphere"), ("materials", "block")}
    with pytest.raises(InputError, match="did you mean friction"):
        chosen_keys(keys, "frction")
