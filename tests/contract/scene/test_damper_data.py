"""The damper's mass, the centrifugal force from it, and excitation in newtons."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from upd.analyses.forced.plan import make_plan
from upd.analyses.seated.bodies import make_bodies
from upd.errors import InputError
from upd.scene import load_scene

#: the symmetric damper: 216 mm2 of section, 42.5 mm long
VOLUME, STEEL = 9180.0, 7.8e-9
TURNING = {"centrifugal": "from speed", "radius": "300 mm", "speed": "4000 rpm"}
OMEGA = 4000.0 * 2.0 * math.pi / 60.0


def response(**changes: Any) -> Any:
    return load_scene("symmetric-response", changes)


def table(name: str, **values: Any) -> dict[str, Any]:
    return {f"{name}.{key}": value for key, value in values.items()}


def test_centrifugal_force_of_mass_radius_and_speed() -> None:
    given = response(**table("damper", **TURNING))
    assert given.damper.centrifugal == pytest.approx(STEEL * VOLUME * 300.0 * OMEGA**2)
    heavy = response(**table("damper", **TURNING, mass="100 g"))
    assert heavy.damper.centrifugal == pytest.approx(1e-4 * 300.0 * OMEGA**2)
    light = response(**table("damper", **TURNING, density="4.5 g/cm3"))
    assert light.damper.centrifugal == pytest.approx(4.5e-9 * VOLUME * 300.0 * OMEGA**2)


@pytest.mark.parametrize("mass", ["loads.mass", ""])
def test_centrifugal_force_of_a_contact(mass: str) -> None:
    more = {mass: "50 g"} if mass else {"materials.damper.density": "4.5 g/cm3"}
    scene = load_scene("symmetric", {**table("loads", **TURNING), **more})
    grams = 5e-5 if mass else 4.5e-9 * VOLUME
    assert scene.loads.centrifugal == pytest.approx(grams * 300.0 * OMEGA**2)


def test_the_damper_that_moves_has_the_given_mass() -> None:
    scene = response(**{"damper.mass": "50 g", "mesh.element": "hex8"})
    plan = make_plan(scene)
    # of the half that is meshed
    assert plan.copies * make_bodies(plan).damper.mass == pytest.approx(5e-5, rel=1e-9)


def test_excitation_in_newtons() -> None:
    scene = response(
        **{"excitation.centrifugal_to_force": "from force", "excitation.force": ["2 N", "0.5 N"]}
    )
    assert scene.excitation.centrifugal_to_force == pytest.approx((175.0, 700.0))


def test_scene_as_run_reads_back_the_same(tmp_path: Path) -> None:
    given = response(**table("damper", **TURNING, mass="60 g"))
    (tmp_path / "again.toml").write_text(given.text, encoding="utf-8")
    assert load_scene(tmp_path / "again.toml").damper == given.damper


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (table("damper", radius="1 m"), "add speed"),
        (table("damper", speed="10 rpm"), "add radius"),
        (table("damper", radius="1 m", speed="10 rpm"), "centrifugal and speed are both given"),
        (table("damper", centrifugal="from speed"), "needs radius and speed"),
        (table("damper", mass="1 g", density="1 g/cm3"), "mass and density are both given"),
        (table("damper", speed="3 m"), "a speed is needed here"),
        (table("damper", centrifugal="0 N"), "leaves the damper loose"),
        (table("excitation", force=["1 N"]), "are both given"),
        (table("excitation", centrifugal_to_force="from force"), "needs excitation.force"),
        ({"material.yield_stress": "900 MPa"}, "checked in a contact scene"),
    ],
)
def test_data_that_do_not_go_together(changes: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        response(**changes)
