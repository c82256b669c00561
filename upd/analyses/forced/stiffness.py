"""Contact stiffness of both faces.

Totals from the scene, or the contact law of a contact analysis, run here or read from its folder.
"""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from upd.analyses.contact.plan import ContactPlan
from upd.analyses.contact.scene_plan import make_plan as make_contact_plan
from upd.analyses.flat import ANALYSIS as FLAT
from upd.cache.arrays import cache_folder
from upd.cache.sources import source_digest
from upd.contact.law import ContactLaw
from upd.errors import InputError
from upd.mesh import recipes
from upd.mesh.fields import DamperSizes
from upd.progress import Stages
from upd.results import ArrayGroup, read_netcdf, write_netcdf
from upd.scene import Scene, load_scene
from upd.scene.contact import CONTACT_WANTS
from upd.scene.forced import ForcedScene
from upd.scene.forced_contact import Side, StiffnessChoice

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class FaceLaw:
    """Stiffness of one face.

    Attributes
    ----------
    K_N, K_T
        Totals, N/mm.
    law
        Contact law in the axes of its patch, when its own points are used.
    source
        Where the totals come from.
    """

    K_N: float
    K_T: float
    law: ContactLaw | None = None
    source: str = "given"


def face_laws(choice: StiffnessChoice, stages: Stages) -> dict[Side, FaceLaw]:
    """Stiffness of the left and the right face.

    A contact analysis stands for the right one and, mirrored, for the symmetric rig's left.
    """
    law, source = _law(choice, stages) if choice.from_contact else (None, "")
    out: dict[Side, FaceLaw] = {}
    sides: tuple[Side, Side] = ("left", "right")
    for side in sides:
        given = choice.face(side)
        if given is not None:
            out[side] = FaceLaw(given.K_N, given.K_T)
        else:
            assert law is not None
            own = law if choice.points == "law" else None
            K_T = float(law.k_t.sum(axis=0).mean())
            out[side] = FaceLaw(float(law.k_n.sum()), K_T, own, source)
    return out


def mirrored(law: ContactLaw) -> ContactLaw:
    """The same points on the other blade: x turned round."""
    flip = np.array([-1.0, 1.0, 1.0])
    turned = {name: getattr(law, name) * flip for name in ("position", "normal", "tangents")}
    return replace(law, **turned)


def _is_law(group: ArrayGroup) -> bool:
    """Whether a group holds a contact law."""
    return group.attributes.get("content") == "contact law"


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
    try:
        scene = load_scene(folder / "scene.toml")
    except InputError:
        return None
    return scene if scene.analysis in CONTACT_WANTS else None


def _check_damper(scene: ForcedScene, source: str, contact: Scene | None) -> None:
    """Raise InputError when the contact is that of another damper: its stiffness is not this
    one's. A damper that cannot be compared gives a warning.
    """
    own = {**scene.geometry, "arrangement": scene.arrangement}
    rig, other = _damper(scene.recipe, own), None
    if contact is not None:
        other = _damper(contact.recipe, contact.geometry)
    if rig is None or other is None:
        recipe = scene.recipe if rig is None else getattr(contact, "recipe", None)
        why = (
            f"the recipe {recipe} does not tell the damper's sizes: add a function "
            "damper_sizes(params)"
            if recipe is not None
            else "its folder holds no scene.toml that can be read"
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


def plans_to_solve(scene: ForcedScene) -> list[ContactPlan]:
    """Plans of the contact scenes that give a stiffness and were not solved before."""
    found: dict[Path, ContactPlan] = {}
    for choice in scene.stiffnesses.values():
        if choice.scene is not None:
            contact = _contact_scene(choice)
            kept = _kept_law(contact)
            if not kept.exists():
                found[kept] = make_contact_plan(contact)
    return list(found.values())


def _kept_law(scene: Scene) -> Path:
    """Where the law of a contact scene is kept once it is solved."""
    key = hashlib.sha256(
        f"contact law {scene.text}{source_digest(scene.recipe)}".encode()
    ).hexdigest()
    return cache_folder() / f"law-{key[:32]}.nc"


def _law(choice: StiffnessChoice, stages: Stages) -> tuple[ContactLaw, str]:
    if choice.run is not None:
        path = Path(choice.run) / "result.nc"
        try:
            groups = read_netcdf(path)
        except OSError as error:
            raise InputError(
                f"stiffness: no contact law in {path} ({error}); give the folder of a "
                "finished contact run"
            ) from None
        return _first(groups, str(path)), f"run {choice.run}"
    assert choice.scene is not None
    return _solved(choice, stages), f"scene {Path(choice.scene).stem}"


def _first(groups: Mapping[str, ArrayGroup], where: str) -> ContactLaw:
    found = [arrays for arrays in groups.values() if _is_law(arrays)]
    if not found:
        raise InputError(
            f'stiffness: {where} holds no contact law; run the contact with "contact_law" '
            "among want"
        )
    return ContactLaw.from_arrays(found[0])


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


def _solved(choice: StiffnessChoice, stages: Stages) -> ContactLaw:
    """The law of the contact scene's first load, from an earlier run of the same scene and code
    when there is one.
    """
    scene = _contact_scene(choice)
    kept = _kept_law(scene)
    with stages("contact stiffness", f"{scene.name}, {choice.bodies} bodies"):
        try:
            return _first(read_netcdf(kept), str(kept))
        except (OSError, InputError, KeyError):
            groups = _run(scene)
        _keep(kept, groups)
        group = next(iter(groups.values()), None)
    if group is None:
        return _first({}, scene.name)
    return ContactLaw.from_arrays({name: variable[1] for name, variable in group.items()})


def _run(scene: Scene) -> dict[str, ArrayGroup]:
    solution = FLAT.solve(FLAT.make_plan(scene), Stages())
    for check in FLAT.check_solution(solution):
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
    return {name: group for name, group in FLAT.arrays(solution).items() if _is_law(group)}


def _keep(path: Path, groups: Mapping[str, ArrayGroup]) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_netcdf(path, groups)
    except OSError as error:
        log.warning("contact law not kept in %s (%s): it is solved again next time", path, error)
