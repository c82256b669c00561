"""Build the manual: `./run.sh docs` writes plain files to build/manual. Warnings are errors.

The sources are copied first, and what is taken from the program (commands, keys of scenes and
recipes) is written beside the copy, so that nothing generated lies in the repository.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator
from itertools import groupby
from pathlib import Path

from upd.cli.app import command_table
from upd.mesh.recipe_modules import READY
from upd.scene import load_scene
from upd.scene.keys import SceneKey, absent_keys, recipe_keys, scene_keys

HERE = Path(__file__).resolve().parent
SCENES = {
    "contact": "hertz",
    "modal": "rig",
    "seated": "symmetric-seated",
    "forced": "asymmetric-response",
}


def main() -> int:
    """Copy, generate, run Sphinx. Returns its exit code."""
    target = HERE.parents[1] / "build"
    source = target / "manual-source"
    shutil.rmtree(source, ignore_errors=True)
    shutil.copytree(HERE, source, ignore=shutil.ignore_patterns("build.py", "__pycache__"))
    shutil.copytree(HERE.parent / "scenes" / "examples", source / "_examples")
    for kind, what in SCENES.items():
        scene = load_scene(what)
        keys = [k for k in (*scene_keys(scene), *absent_keys(scene)) if k.steps[0] != "geometry"]
        write(source / f"reference/scene_{kind}.md", f"Keys of a {scene.analysis} (`{what}`)", keys)
    for recipe in READY:
        write(source / f"reference/{recipe}.md", f"Recipe `{recipe}`", recipe_keys(recipe))
    rows = ["| command | what it does |", "|---|---|"]
    rows += [f"| `{usage}` | {text} |" for usage, text in command_table()]
    (source / "reference/command_table.md").write_text("\n".join(rows) + "\n", encoding="utf-8")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html"]
    return subprocess.call([*command, str(source), str(target / "manual")])


def write(path: Path, title: str, keys: Iterable[SceneKey]) -> None:
    """A page with a table per table of the scene."""
    path.write_text("\n".join(page(title, keys)) + "\n", encoding="utf-8")


def page(title: str, keys: Iterable[SceneKey]) -> Iterator[str]:
    """Its lines."""
    yield f"# {title}"
    for steps, mine in groupby(keys, key=lambda k: k.steps[:-1]):
        yield from ("", f"## [{'.'.join(steps)}]" if steps else "## Top of the file", "")
        yield from ("| key | default | unit | bounds | meaning |", "|---|---|---|---|---|")
        for key in mine:
            cells = key.name, key.default, key.unit, key.bounds, key.meaning
            name, *rest = (cell.replace("|", "\\|").replace("\n", " ") for cell in cells)
            texts = [
                text.replace("*", "\\*").replace("<", "&lt;").replace("$", "\\$") for text in rest
            ]
            yield f"| `{name}` | {' | '.join(texts)} |"


if __name__ == "__main__":
    sys.exit(main())
