"""A contact scene gives a rig its stiffness only when it is of the same damper."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upd.analyses.forced.plan import make_plan
from upd.contact import contact_points
from upd.errors import InputError
from upd.fem import Material, mass_properties
from upd.mesh import recipes
from upd.results import Group, write_netcdf
from upd.scene import load_scene

RIGS = {"symmetric": "wedge_platform", "asymmetric": "pads_platform"}
DENSITY = 7.8e-9


def plan(arrangement: str, **changes: Any) -> None:
    own = {"contact.stiffness": ["own"], **changes}
    make_plan(load_scene(f"{arrangement}-response", own))


@pytest.mark.parametrize("arrangement", RIGS)
def test_ready_rig_and_contact_are_of_one_damper(arrangement: str) -> None:
    rig = recipes.damper_sizes("blade_rig", {"arrangement": arrangement})
    contact = recipes.damper_sizes(RIGS[arrangement], {})
    assert rig is not None and contact is not None
    assert rig.differences(contact, "", "") == []
    assert rig.volume == pytest.approx(contact.volume, rel=1e-12)


@pytest.mark.parametrize("arrangement", RIGS)
def test_volume_is_that_of_the_mesh(arrangement: str) -> None:
    parameters = {"arrangement": arrangement, "damper": "free"}
    mesh = recipes.build_mesh("blade_rig", parameters)[0]["damper"]
    mass = mass_properties(mesh, Material(2e5, 0.3, DENSITY)).mass
    sizes = recipes.damper_sizes("blade_rig", parameters)
    assert sizes is not None
    assert DENSITY * sizes.volume == pytest.approx(mass, rel=1e-12)


@pytest.mark.parametrize(
    ("arrangement", "changes", "says"),
    [
        ("symmetric", {"geometry.patch_length": "6 mm"}, "contact along the slope: 6 mm"),
        ("symmetric", {"geometry.patch_width": "17 mm"}, "contact along the damper: 17 mm"),
        ("symmetric", {"geometry.patch_offset": "1.6 mm"}, "upper end of its leg: 1.6 mm"),
        ("symmetric", {"geometry.front_angle": "44 deg"}, "angle of the contact face"),
        ("symmetric", {"geometry.platform_wy": "43 mm"}, "length of the damper: 43 mm"),
        ("symmetric", {"geometry.damper_base": "30.1 mm"}, "base of the damper: 30.1 mm"),
        ("asymmetric", {"geometry.pad_width": "7 mm"}, "pad along the slope: 7 mm"),
        ("asymmetric", {"geometry.pad_gap": "6 mm"}, "gap between the pads: 6 mm"),
        ("asymmetric", {"geometry.rear_angle_right": "29 deg"}, "angle of the padded face"),
        ("asymmetric", {"geometry.pad_step": "1.1 mm"}, "height of the pads: 1.1 mm"),
        ("asymmetric", {"stiffness.own.scene": "symmetric"}, "kind of damper"),
    ],
)
def test_another_damper_is_refused(arrangement: str, changes: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match="contact of another damper") as refused:
        plan(arrangement, **changes)
    assert says in str(refused.value) and "to fix it" in str(refused.value)


def test_mesh_block_and_unused_stiffness_do_not_matter(tmp_path: Path) -> None:
    scene = load_scene(
        "symmetric", {"geometry.divisions": 6, "geometry.margin": "10 mm", "mesh.element": "hex8"}
    )
    (tmp_path / "coarse.toml").write_text(scene.text, encoding="utf-8")
    plan("symmetric", **{"stiffness.own.scene": str(tmp_path / "coarse.toml")})
    plan("symmetric", **{"geometry.patch_length": "6 mm", "contact.stiffness": ["thesis"]})


def test_a_contact_scene_changed_alike_is_accepted(tmp_path: Path) -> None:
    scene = load_scene("symmetric", {"geometry.patch_length": "6 mm"})
    (tmp_path / "short.toml").write_text(scene.text, encoding="utf-8")
    own = {"stiffness.own.scene": str(tmp_path / "short.toml")}
    plan("symmetric", **own, **{"geometry.patch_length": "6 mm"})
    with pytest.raises(InputError, match=r"15 mm .* in the rig, 6 mm .* in the contact"):
        plan("symmetric", **own)


def test_a_damper_that_cannot_be_compared_is_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    own = (
        "from geometry.wedge_platform import *\nfrom geometry.wedge_platform import WedgePlatform\n"
    )
    (tmp_path / "mine.py").write_text(f"{own}del damper_sizes\n", encoding="utf-8")
    scene = load_scene("symmetric", {"geometry.recipe": str(tmp_path / "mine.py")})
    (tmp_path / "mine.toml").write_text(scene.text, encoding="utf-8")
    with caplog.at_level(logging.WARNING):
        plan("symmetric", **{"stiffness.own.scene": str(tmp_path / "mine.toml")})
    assert "not compared with the rig's damper" in caplog.text
    assert "damper_sizes" in caplog.text


def test_a_run_is_compared_by_the_scene_in_its_folder(tmp_path: Path) -> None:
    law = contact_points(
        positions=[[-1.0, 0.0], [1.0, 0.0]],
        areas=[1.0, 1.0],
        normal_force=[5.0, 5.0],
        normal_stiffness=[100.0, 100.0],
        tangential_stiffness=np.full((2, 2), 80.0),
        grid=(1, 2),
    )
    group = Group(law.to_arrays(), content="contact law")
    write_netcdf(tmp_path / "result.nc", {"contact law F=5 N": group})
    own = {
        "stiffness.own": {"run": str(tmp_path)},
        "contact.stiffness": ["own"],
    }
    (tmp_path / "scene.toml").write_text(load_scene("symmetric").text, encoding="utf-8")
    plan("symmetric", **own)
    shorter = load_scene("symmetric", {"geometry.patch_length": "6 mm"})
    (tmp_path / "scene.toml").write_text(shorter.text, encoding="utf-8")
    with pytest.raises(InputError, match="contact of another damper"):
        plan("symmetric", **own)
