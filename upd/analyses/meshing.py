"""Which mesh a user means who names a recipe or a scene: the recipe and all its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from upd.analyses import make_plan
from upd.errors import InputError
from upd.mesh import recipes
from upd.mesh.recipe_modules import READY, is_file
from upd.scene import geometry_parameters, load_scene
from upd.scene.read import ready_scenes
from upd.scene.toml import read_overrides


@dataclass(frozen=True)
class MeshRequest:
    """A recipe with its parameters in mm and degrees.

    Attributes
    ----------
    name
        For files.
    given
        The parameters that are not left to the recipe's defaults.
    """

    name: str
    recipe: str
    given: dict[str, Any]

    @property
    def parameters(self) -> Any:
        """The recipe's own object. Raises InputError for values that it refuses."""
        return recipes.made(self.recipe, self.given)


def mesh_request(what: str, overrides: Sequence[str] = ()) -> MeshRequest:
    """The mesh of a recipe (ready name or .py file) or of a scene; the whole model.

    Of a scene it is what its run would mesh, but whole unless the scene itself names a symmetry.

    Parameters
    ----------
    what
        Recipe or scene.
    overrides
        "path=value" texts: of a scene as for a run, of a recipe "radius=5 mm" (or
        "geometry.radius=5 mm").

    Raises
    ------
    InputError
        For an unknown recipe or scene, and for parameters that do not fit.
    """
    is_recipe = what in READY or is_file(what)
    request = _of_recipe(what, overrides) if is_recipe else _of_scene(what, overrides)
    # what is wrong with them is reported before anything is meshed
    _ = request.parameters
    return request


def _of_recipe(recipe: str, overrides: Sequence[str]) -> MeshRequest:
    known = [f.name for f in fields(recipes.parameters(recipe))]
    table: dict[str, Any] = {"recipe": recipe}
    pairs, problems = read_overrides(overrides)
    for path, value in pairs:
        name = path.removeprefix("geometry.")
        if "." in name:
            problems.append(
                f"--set {path}: a recipe has parameters only ({', '.join(known)}); name a scene "
                "for its other tables"
            )
        elif value == "auto":
            problems.append(f'--set {path}: "auto" needs the loads of a scene; give a value')
        else:
            table[name] = value
    given, more = geometry_parameters(table, known)
    problems += [problem.removeprefix("geometry.") for problem in more]
    if problems:
        raise InputError("\n".join(f"{recipe}: {problem}" for problem in problems))
    return MeshRequest(Path(recipe).stem, recipe, given)


def _of_scene(what: str, overrides: Sequence[str]) -> MeshRequest:
    if what not in ready_scenes() and not Path(what).is_file():
        raise InputError(
            f"{what!r} is neither a file here nor a ready scene, nor a recipe; recipes: "
            f"{', '.join(READY)}, or the path of a .py file; scenes: "
            f"{', '.join(ready_scenes())}, or the path of a .toml file"
        )
    scene = load_scene(what, overrides)
    made = make_plan(scene)
    given = dict(made.parameters)
    if "symmetry" in {f.name for f in fields(recipes.parameters(made.scene.recipe))}:
        asked = scene.mesh.symmetry
        given["symmetry"] = "full" if asked == "auto" else asked
    return MeshRequest(scene.name, made.scene.recipe, given)
