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
from upd.scene.keys import SceneKey, recipe_keys, scene_keys

MARKED = str.maketrans({"*": "\\*", "<": "&lt;", "$": "\\$"})
HERE = Path(__file__).resolve().parent
#: one of every kind
SCENES = ("hertz", "rig", "symmetric-seated", "asymmetric-response", "bladed-disk")


def main() -> int:
    """Copy, generate, run Sphinx. Returns its exit code."""
    target = HERE.parents[1] / "build"
    source = target / "manual-source"
    shutil.rmtree(source, ignore_errors=True)
    shutil.copytree(HERE, source, ignore=shutil.ignore_patterns("build.py", "__pycache__"))
    shutil.copytree(HERE.parent / "scenes" / "examples", source / "_examples")
    for what in SCENES:
        scene = load_scene(what)
        keys = [k for k in scene_keys(scene, absent=True) if k.steps[0] != "geometry"]
        title = f"Keys of a {scene.analysis} (`{what}`)"
        write(source / f"reference/scene_{what}.md", page(title, keys))
    for recipe in READY:
        write(source / f"reference/{recipe}.md", page(f"Recipe `{recipe}`", recipe_keys(recipe)))
    rows = (f"| `{usage}` | {text} |" for usage, text in command_table())
    write(source / "reference/command_table.md", ("| command | what it does |", "|---|---|", *rows))
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html"]
    return subprocess.call([*command, str(source), str(target / "manual")])


def write(path: Path, lines: Iterable[str]) -> None:
    """A generated page."""
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def page(title: str, keys: Iterable[SceneKey]) -> Iterator[str]:
    """A page with a table per table of the scene."""
    yield f"# {title}"
    for steps, mine in groupby(keys, key=lambda k: k.steps[:-1]):
        yield from ("", f"## [{'.'.join(steps)}]" if steps else "## Top of the file", "")
        yield from ("| key | default | unit | bounds | meaning |", "|---|---|---|---|---|")
        for key in mine:
            cells = key.name, key.default, key.unit, key.bounds, key.meaning
            name, *rest = (cell.replace("|", "\\|").replace("\n", " ") for cell in cells)
            yield f"| `{name}` | {' | '.join(rest).translate(MARKED)} |"


if __name__ == "__main__":
    sys.exit(main())
