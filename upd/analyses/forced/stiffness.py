"""Contact stiffness of both faces.

Totals from the scene, or the contact law of a contact analysis, run here or read from its folder.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from upd.analyses import analysis_of
from upd.analyses.base import Plan
from upd.cache.arrays import cache_folder, load_arrays, save_arrays
from upd.cache.sources import key_of, source_digest
from upd.contact.law import ContactLaw
from upd.errors import InputError
from upd.mesh import recipes
from upd.mesh.fields import DamperSizes
from upd.progress import Stages
from upd.results import Group, read_netcdf
from upd.scene import Scene, load_scene
from upd.scene.contact import CONTACT_WANTS
from upd.scene.forced import ForcedScene
from upd.scene.forced_contact import SIDES, FaceStiffness, Side, StiffnessChoice

log = logging.getLogger(__name__)


def face_laws(choice: StiffnessChoice, stages: Stages) -> dict[Side, FaceStiffness]:
    """Stiffness of the left and the right face.

    A contact analysis stands for the right one and, mirrored, for the symmetric rig's left.
    """
    law = _law(choice, stages) if choice.from_contact else None
    out: dict[Side, FaceStiffness] = {}
    for side in SIDES:
        given = choice.face(side)
        if given is None:
            assert law is not None
            K_T = float(law.k_t.sum(axis=0).mean())
            given = FaceStiffness(float(law.k_n.sum()), K_T)
        out[side] = given
    return out


def check_sources(scene: ForcedScene) -> None:
    """Raise InputError when a contact scene or run that gives a stiffness is not there, damaged, of
    another kind, or of another damper than the rig's. Solves nothing.
    """
    problems = []
    for name, choice in scene.stiffnesses.items():
        try:
            if choice.run is not None:
                _law(choice, Stages())
                _check_damper(scene, f"run {choice.run}", _scene_of_run(Path(choice.run)))
            elif choice.scene is not None:
                _check_damper(scene, f"scene {choice.scene}", _contact_scene(choice))
        except InputError as error:
            problems.append(f"stiffness.{name}: {error}")
    if problems:
        raise InputError("\n".join(problems))


def _scene_of_run(folder: Path) -> Scene | None:
    """The contact scene of a run folder; None when the folder does not hold it any more, or not as
    this version reads it.
    """
    with suppress(InputError):
        scene = load_scene(folder / "scene.toml")
        return scene if scene.analysis in CONTACT_WANTS else None
    return None


def _check_damper(scene: ForcedScene, source: str, contact: Scene | None) -> None:
    """Raise InputError when the contact is that of another damper: its stiffness is not this
    one's. A damper that cannot be compared gives a warning.
    """
    rig = _damper(scene.recipe, {**scene.geometry, "arrangement": scene.arrangement})
    other = None if contact is None else _damper(contact.recipe, contact.geometry)
    if rig is None or other is None:
        why = "its folder holds no scene.toml that can be read"
        if rig is None or contact is not None:
            recipe = scene.recipe if contact is None or rig is None else contact.recipe
            why = (
                f"the recipe {recipe} does not tell the damper's sizes: add a function "
                "damper_sizes(params)"
            )
        log.warning(
            "contact stiffness from %s: not compared with the rig's damper; %s", source, why
        )
        return
    different = rig.differences(other, "in the rig", "in the contact")
    if different:
        raise InputError(
            f"{source} is the contact of another damper: {'; '.join(different)}; to fix it: set "
            "[geometry] of both scenes alike (a copy of the contact scene may be named), or give "
            "K_N and K_T themselves"
        )


def _damper(recipe: str, geometry: Mapping[str, Any]) -> DamperSizes | None:
    """Sizes of the damper; of the scene's parameters those that the recipe knows count."""
    given = {k: v for k, v in geometry.items() if k not in ("recipe", "damper") and v != "auto"}
    return recipes.damper_sizes(recipe, given)


def plans_to_solve(scene: ForcedScene) -> list[Plan[Any]]:
    """Plans of the contact scenes that give a stiffness and were not solved before."""
    scenes = [_contact_scene(c) for c in scene.stiffnesses.values() if c.scene is not None]
    found = {_kept_law(contact): contact for contact in scenes}
    return [
        analysis_of(contact).make_plan(contact)
        for path, contact in found.items()
        if not path.exists()
    ]


def _kept_law(scene: Scene) -> Path:
    """Where the law of a contact scene is kept once it is solved."""
    key = key_of({"contact law": scene.text, "sources": source_digest(scene.recipe)})
    return cache_folder() / f"law-{key[:32]}.npz"


def _law(choice: StiffnessChoice, stages: Stages) -> ContactLaw:
    """The law of a finished run, or of a contact scene's first load, kept on disk."""
    if choice.run is not None:
        path = Path(choice.run) / "result.nc"
        try:
            groups = read_netcdf(path)
        except OSError as error:
            raise InputError(
                f"stiffness: no contact law in {path} ({error}); give the folder of a "
                "finished contact run"
            ) from None
        return ContactLaw.from_arrays(_first(groups, str(path)))
    scene = _contact_scene(choice)
    kept = _kept_law(scene)
    with stages("contact stiffness", f"{scene.name}, {choice.bodies} bodies"):
        arrays = load_arrays(kept)
        if arrays is None:
            arrays = {name: variable[1] for name, variable in _run(scene).items()}
            save_arrays(kept, arrays)
    return ContactLaw.from_arrays(arrays)


def _first(groups: Mapping[str, Group], where: str) -> Group:
    for group in groups.values():
        if group.attributes.get("content") == "contact law":
            return group
    raise InputError(
        f'stiffness: {where} holds no contact law; run the contact with "contact_law" among want'
    )


def _contact_scene(choice: StiffnessChoice) -> Scene:
    """The contact scene, cut down to what gives its law."""
    assert choice.scene is not None
    given = load_scene(choice.scene)
    if "contact_law" not in CONTACT_WANTS.get(given.analysis, ()):
        raise InputError(
            f"stiffness: {choice.scene} is no contact of a damper on its platform; use "
            "symmetric, asymmetric or a scene of that kind"
        )
    changed: Scene = load_scene(
        choice.scene, {"want": ["stiffness", "contact_law"], "law.bodies": choice.bodies}
    )
    return changed


def _run(scene: Scene) -> Group:
    flat = analysis_of(scene)
    solution = flat.solve(flat.make_plan(scene), Stages())
    for check in flat.check_solution(solution):
        if not check.passed:
            log.warning(
                "contact analysis %s: %s: %s = %.3g, limit %.3g",
                scene.name,
                check.name,
                check.says,
                check.value,
                check.limit,
            )
            if check.fatal:
                raise InputError(
                    f"stiffness: the contact analysis {scene.name} failed its check "
                    f"{check.name}; run it alone: upd run {scene.name}"
                )
    return _first(flat.arrays(solution), scene.name)
