"""What `upd describe` and `upd new` print and write: every key of a scene or recipe explained."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources
from itertools import groupby
from pathlib import Path
from textwrap import wrap

from rich.console import Console
from rich.text import Text

from upd.cache.files import placed_file
from upd.cli.tables import print_table
from upd.cli.terminal import check_ending
from upd.errors import InputError
from upd.mesh import recipes
from upd.mesh.recipe_modules import READY, is_file
from upd.plot.answer_table import AnswerTable
from upd.scene import load_scene
from upd.scene.keys import (
    SceneKey,
    chosen_keys,
    recipe_keys,
    scene_keys,
    scene_to_start_from,
)
from upd.scene.quantities import is_name
from upd.units import UNITS

#: what an input may carry beside its value
UNCERTAINTY = '"VALUE +- HALF-WIDTH" or "VALUE +- 10 %"'

_EXAMPLES = Path(str(resources.files("upd"))) / "scenes" / "examples"


def described(what: str, overrides: Sequence[str] = ()) -> tuple[str, list[SceneKey]]:
    """Title and keys of a scene or a recipe. Raises InputError for what is neither."""
    if what in READY or is_file(what):
        if overrides:
            raise InputError("--set is for scenes: leave it out of a recipe")
        return f"Recipe {what}", recipe_keys(what)
    scene = load_scene(what, overrides)
    title = f"Scene {scene.name}: {scene.title}" if scene.title else f"Scene {scene.name}"
    return title, scene_keys(scene, absent=True)


def print_keys(console: Console, title: str, keys: Sequence[SceneKey], asked: str) -> None:
    """All keys as tables, those of a table that was asked for, or one key in full."""
    chosen = chosen_keys(keys, asked) if asked else keys
    if asked and len(chosen) == 1:
        _print_one(console, chosen[0])
        return
    console.print(Text(title, "bold"))
    for place, mine in groupby(chosen, key=lambda k: ".".join(k.steps[:-1])):
        heads = ("key", "value", "unit", "bounds", "what it is")
        rows = []
        for key in mine:
            changed = key.value and key.value != key.default != "must be given"
            value = f"{key.value} (default {key.default})" if changed else key.value or key.default
            cost = "" if key.cost == "none" else f" Cost: {key.cost}."
            rows.append((key.name, value, key.unit, key.bounds, key.meaning + cost))
        print_table(console, AnswerTable(f"[{place}]" if place else "", heads, tuple(rows)))
    example = f"upd describe SCENE KEY, for example {chosen[-1].path}"
    console.print(Text(f"A key in full: {example}.", "dim"))


def _print_one(console: Console, key: SceneKey) -> None:
    """One key in full."""
    units = [unit for unit in UNITS.get(key.kind, {}) if unit]
    others = f"; understood: {', '.join(units)}" if len(units) > 1 else ""
    texts = {
        "meaning": key.meaning,
        "value": f"{key.value}{'' if key.given else ' (default)'}" if key.value else "",
        "default": key.default,
        "unit": f"{key.unit}{others}" if key.unit else "",
        "bounds": key.bounds or "none",
        "uncertainty": UNCERTAINTY if key.uncertain else "",
        "cost": key.cost,
    }
    console.print(Text(key.path, "bold"))
    for head, text in texts.items():
        lines = wrap(text, console.width, initial_indent=f"{head:13}", subsequent_indent=" " * 13)
        for line in lines:
            console.print(Text(line))


def write_drawing(what: str, overrides: Sequence[str], path: Path) -> Path:
    """Draw the geometry of a scene or a recipe with its dimensions.

    Raises InputError for a place that is no .png file.
    """
    check_ending(path, "--drawing", ".png")
    # matplotlib and the analyses take a while to import
    from upd.analyses.meshing import mesh_request
    from upd.plot.drawing import draw_sections

    request = mesh_request(what, overrides)
    meshes, views = recipes.drawing(request.recipe, request.given)
    with placed_file(path) as temporary:
        draw_sections(meshes, views).savefig(temporary, format="png")
    return path


def write_new(source: str, file: Path) -> Path:
    """Write a commented copy of a scene under the name of its file, or an example as it is.

    Raises InputError for a file that is there already, or whose name is no name of a scene.
    """
    if file.exists():
        raise InputError(f"{file}: is there already; to fix it: give another name")
    example = _EXAMPLES / source
    known = example.is_file() and not Path(source).exists()
    ending = example.suffix if known else ".toml"
    if file.suffix.lower() != ending:
        raise InputError(f"{file}: its ending must be {ending}: name it {file.stem}{ending}")
    if not is_name(file.stem):
        raise InputError(
            f"{file}: its name becomes the scene's: use letters, digits, '-', '_' and '.'"
        )
    text = example.read_text("utf-8") if known else None
    with placed_file(file) as temporary:
        temporary.write_text(text or scene_to_start_from(load_scene(source), file.stem), "utf-8")
    return file
