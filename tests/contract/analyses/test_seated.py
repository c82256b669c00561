"""A seated damper as an analysis: what it answers, what it leaves behind, and that each of its
checks can fail.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rigs import undeclared

import upd
from upd.analyses import make_plan
from upd.analyses.seated import ANALYSIS
from upd.analyses.seated.interface import Interface, make_interface
from upd.analyses.seated.plan import AGAIN, LOWERED, OVER, RAISED, SHAKEN, SMOOTH
from upd.analyses.seated.solve import SeatedSolution
from upd.contact.rigid_damper import SLIDINGS, admissible_forces, equilibrium, moment_share
from upd.errors import ConvergenceError, InputError
from upd.progress import Stages, silent
from upd.results import Check
from upd.scene import load_scene
from upd.sizing.statics import motion_state, scene_damper

F_C = 350.0
WEDGE = {
    "geometry.patch_along_y": 4,
    "geometry.patch_along_slope": 2,
    "seating.steps": 4,
    "moved.steps": 4,
    "seating.cycles": 2,
    # other ways of loading change the forces by more
    "left_out.stiffness": 0.9,
}
PADS = {
    "geometry.pad_along_y": 4,
    "geometry.pad_along_slope": 2,
    "geometry.face_along_z": 2,
    "seating.steps": 4,
    "seating.cycles": 2,
    "want": ["seating", "band", "stiffness"],
}


def solved(scene: str, overrides: dict[str, Any]) -> SeatedSolution:
    plan = make_plan(load_scene(scene, overrides))
    solution = ANALYSIS.solve(plan, Stages(silent))
    assert isinstance(solution, SeatedSolution)
    return solution


@pytest.fixture(scope="module")
def wedge() -> SeatedSolution:
    return solved("symmetric-seated", WEDGE)


@pytest.fixture(scope="module")
def pads() -> SeatedSolution:
    return solved("asymmetric-seated", PADS)


def value(solution: SeatedSolution, name: str, case: str) -> float:
    return next(
        r.value for r in ANALYSIS.make_results(solution) if r.name == name and r.case == case
    )


def failing(checks: list[Check]) -> set[str]:
    return {c.name for c in checks if not c.passed}


def test_forces_are_those_of_statics(wedge: SeatedSolution, pads: SeatedSolution) -> None:
    """154.68 / 92.81 N on the wedge, 303.11 / 175.00 N and nothing on the pads, at mu 0.6."""
    want = equilibrium(45.0, 45.0, F_C, 0.6, "opposing")
    for side in ("left", "right"):
        assert value(wedge, "face_N", f"raised, {side}") == pytest.approx(
            want.normal_left, rel=1e-5
        )
        assert value(wedge, "face_T", f"raised, {side}") == pytest.approx(
            want.tangential_left, rel=1e-5
        )
    assert value(pads, "face_N", "raised, left") == pytest.approx(0.0, abs=1e-6)
    assert value(pads, "face_N", "raised, right") == pytest.approx(
        F_C * np.cos(np.pi / 6), rel=1e-9
    )
    free = equilibrium(90.0, 30.0, F_C, 0.6, "frictionless")
    assert value(pads, "face_N", "frictionless, left") == pytest.approx(free.normal_left, rel=1e-9)


@pytest.mark.parametrize("name", ["wedge", "pads"])
def test_elastic_dampers_stay_within_the_statics_of_rigid_ones(
    name: str, request: pytest.FixtureRequest
) -> None:
    """Elastic bodies, every node its own friction, all ways of loading and moving, every step: the
    totals obey the limits of forces of faces as long as these, and act within them.
    """
    solution: SeatedSolution = request.getfixturevalue(name)
    section = scene_damper(solution.plan.scene)[0]
    limits = admissible_forces(section, 0.6).limits
    for phase in solution.phases.values():
        totals = solution.interface.face_forces(phase.found)[:, :, [0, 2]]
        for F, faces in zip(phase.centrifugal, totals, strict=True):
            found, slack = faces.T / F, 1e-6
            assert (found >= limits[..., 0] - slack).all()
            assert (found <= limits[..., 1] + slack).all()
            assert moment_share(section, found) <= 1.0 + slack


def test_moved_wedge_reaches_the_limits_of_the_rigid_one(wedge: SeatedSolution) -> None:
    """Blades out of phase: friction at its limit as they part and as they approach. In phase the
    wedge rolls: forces end at the ends of its faces, N and T at the least and the greatest that
    does not tilt it.
    """
    section = scene_damper(wedge.plan.scene)[0]
    limits = F_C * admissible_forces(section, 0.6).limits
    across, up = (
        wedge.interface.face_forces(wedge.phases[f"moved along {axis}"].found)[:, :, [0, 2]]
        for axis in "xz"
    )
    part, approach = (motion_state(section, 0.6, F_C, motion) for motion in SLIDINGS[:2])
    for face in (0, 1):
        assert across[:, face].min(axis=0) == pytest.approx([part.N[face], approach.T[face]])
        assert across[:, face].max(axis=0) == pytest.approx([approach.N[face], part.T[face]])
        assert up[:, face, 0].min() == pytest.approx(limits[0, face, 0], rel=1e-5)
        assert up[:, face, 1].max() == pytest.approx(limits[1, face, 1], rel=1e-5)
    assert max(moment_share(section, faces.T) for faces in up) == pytest.approx(1.0)


def test_mass_of_the_whole_damper(wedge: SeatedSolution, pads: SeatedSolution) -> None:
    """7800 kg/m3 of 216 mm2 times 42.5 mm, though half of it is meshed."""
    assert value(wedge, "damper_mass", RAISED) == pytest.approx(7.8e-3 * 216.0 * 42.5)
    assert value(pads, "damper_mass", RAISED) == pytest.approx(46.99557, rel=1e-6)


def test_ways_of_loading_leave_different_states(wedge: SeatedSolution) -> None:
    """Under the same F_C, each in balance: the raised one has the least normal force."""
    forces = {name: wedge.forces(name)[0] for name in (RAISED, AGAIN, OVER, SHAKEN, SMOOTH)}
    for normal, along, up in forces.values():
        # F_C = 2 (N cos 45 + T sin 45) on faces alike
        assert 2.0 * np.sqrt(0.5) * (normal + up) == pytest.approx(F_C, rel=1e-4)
        assert along == 0.0
    assert forces[RAISED][0] < forces[OVER][0] < forces[SHAKEN][0]
    assert value(wedge, "highest_face_N", "ways of loading, left") == forces[SHAKEN][0]
    assert value(wedge, "lowest_face_N", "ways of loading, left") == pytest.approx(
        min(f[0] for f in forces.values())
    )


def test_half_is_the_whole() -> None:
    """All numbers that both have, and the fields of both faces."""
    quick = {**WEDGE, "want": ["seating", "stiffness", "moved"], "left_out.solve": "no"}
    half, full = (
        solved("symmetric-seated", {**quick, "mesh.symmetry": s}) for s in ("half", "full")
    )
    numbers = [
        {(r.name, r.case): r.value for r in ANALYSIS.make_results(one)} for one in (half, full)
    ]
    common = numbers[0].keys() & numbers[1].keys()
    assert len(common) > 40
    for key in common:
        size = max(abs(v) for k, v in numbers[1].items() if k[0][:6] == key[0][:6])
        assert numbers[0][key] == pytest.approx(numbers[1][key], rel=1e-5, abs=1e-6 * size), key
    fields = [ANALYSIS.arrays(one) for one in (half, full)]
    for name, group in fields[0].items():
        if name.startswith("face "):
            for key in ("x", "normal_force", "pressure", "traction_up", "traction_along"):
                a, b = (np.asarray(f[name][key][1]) for f in fields)
                assert a.shape == b.shape
                np.testing.assert_allclose(a, b, atol=1e-4 * max(1.0, np.abs(b).max()))
            assert np.asarray(group["normal_force"][1]).sum() == pytest.approx(
                half.forces(name.split(" ", 2)[2].strip())[int(name.startswith("face right")), 0],
                rel=1e-9,
                abs=1e-9,
            )


def test_motion_along_the_damper_takes_the_full_model() -> None:
    plan = make_plan(load_scene("symmetric-seated", {**WEDGE, "moved.directions": ["y"]}))
    assert plan.symmetry == "full"
    with pytest.raises(InputError, match=r'moved.directions.*mesh.symmetry = "auto"'):
        load_scene("symmetric-seated", {"moved.directions": ["y"], "mesh.symmetry": "half"})


def test_stuck_stiffness_against_small_motion(wedge: SeatedSolution) -> None:
    """A motion too small to slip meets the stuck stiffness of the nodes that touch."""
    of, phase = wedge.interface, wedge.phases[SHAKEN]
    closed = phase.found.state[-1] > 0
    K = of.leg_stiffness(closed)
    tiny = 1e-7
    moved = np.zeros((1, 3))
    for k, axis in enumerate(of.directions):
        step = moved.copy()
        step[0, axis] = tiny
        found = of.seat(0.6, [F_C], moved=step, after=phase.found)
        if (found.state[-1] == 2).any():
            continue
        force = (of.face_forces(found)[-1, 1] - wedge.forces(SHAKEN)[1]) @ -of.frame[1]
        assert force[axis] == pytest.approx(K[k, k] * tiny, rel=1e-3)
        break
    else:
        pytest.fail("every motion slips")


def test_platforms_held_are_stiffer(wedge: SeatedSolution) -> None:
    assert value(wedge, "leg_K_N", "platforms held, raised") > 10.0 * value(
        wedge, "leg_K_N", "bases held, raised"
    )
    assert value(wedge, "face_K_N", "platforms held, whole faces, left") > value(
        wedge, "face_K_N", "platforms held, raised, left"
    )


def test_open_face_has_no_stiffness(pads: SeatedSolution) -> None:
    assert value(pads, "face_K_N", "platforms held, raised, left") == 0.0
    assert value(pads, "leg_K_N", "platforms held, raised") == 0.0
    assert value(pads, "leg_K_N", "platforms held, whole faces") > 1e4


def test_blade_moved_in_cycles_closes_its_loop(wedge: SeatedSolution) -> None:
    """The last two cycles are one, and their area is what friction took."""
    phase, of = wedge.phases["moved along x"], wedge.interface
    n = 4 * wedge.plan.scene.moved.steps
    force = (of.face_forces(phase.found)[:, 1] @ -of.frame[1])[:, 0]
    way = phase.moved[:, 0]
    np.testing.assert_allclose(force[-n:], force[-2 * n : -n], atol=1e-6 * np.ptp(force))
    x, y = way[-n - 1 :], force[-n - 1 :]
    area = float((0.5 * (y[1:] + y[:-1]) * np.diff(x)).sum())
    loss = value(wedge, "friction_energy", "moved along x")
    # gaps that close within a step take the rest
    assert area == pytest.approx(loss, rel=1e-3)
    assert loss > 0.0


def test_a_way_that_fails_leaves_the_raised_state(monkeypatch: pytest.MonkeyPatch) -> None:
    seat = Interface.seat

    def refuse(of: Interface, *loads: Any, **more: Any) -> Any:
        if "after" in more:
            raise ConvergenceError("did not converge")
        return seat(of, *loads, **more)

    monkeypatch.setattr(Interface, "seat", refuse)
    with pytest.raises(ConvergenceError) as failed:
        solved("symmetric-seated", {**WEDGE, "want": ["seating"]})
    found = ANALYSIS.make_results(failed.value.partial)  # type: ignore[attr-defined]
    assert {one.name for one in found} >= {"face_N", "contact_area"}
    assert "seating_loss" not in {one.name for one in found}


def test_worn_faces_press_evenly() -> None:
    """Without friction, and worn in under F_C: the pressure of the wedge is even."""
    scene = {**WEDGE, "contact.friction": 0.0, "contact.fit": "worn", "want": ["seating"]}
    one = solved("symmetric-seated", scene)
    of = one.interface
    pressure = one.phases[RAISED].found.force[-1, :, 0] / of.area
    np.testing.assert_allclose(pressure, pressure.mean(), rtol=1e-6)
    assert one.forces(RAISED)[0, 0] == pytest.approx(
        equilibrium(45.0, 45.0, F_C, 0.0, "frictionless").normal_left, rel=1e-9
    )


def test_platforms_held_in_the_scene() -> None:
    """The same statics on stiffer blades; the whole interface is the one with platforms held."""
    one = solved(
        "symmetric-seated", {**WEDGE, "blades.held": "platforms", "want": ["seating", "stiffness"]}
    )
    assert one.platforms is one.interface
    # friction of held platforms is not fully mobilised everywhere
    assert 154.67 < one.forces(RAISED)[0, 0] < 247.49
    soft = make_interface(one.plan, one.bodies, "bases")
    m = 3 * one.interface.n
    assert np.linalg.eigvalsh(soft.compliance - one.interface.compliance)[0] > -1e-9
    assert soft.compliance.shape == (m, m)


def _found(s: SeatedSolution, name: str, **values: Any) -> SeatedSolution:
    phase = s.phases[name]
    changed = replace(phase, found=replace(phase.found, **values))
    return replace(s, phases={**s.phases, name: changed})


def _force(s: SeatedSolution, factor: float, component: int) -> SeatedSolution:
    force = s.phases[LOWERED].found.force.copy()
    force[..., component] *= factor
    return _found(s, LOWERED, force=force)


def _displaced(s: SeatedSolution) -> SeatedSolution:
    """The damper a thousandth too deep in the faces."""
    return _found(s, LOWERED, displacement=1.001 * s.phases[LOWERED].found.displacement)


def _all_stick(s: SeatedSolution) -> SeatedSolution:
    return _found(s, RAISED, state=np.ones_like(s.phases[RAISED].found.state))


def _changed(effect: str) -> Callable[[SeatedSolution], SeatedSolution]:
    def spoil(s: SeatedSolution) -> SeatedSolution:
        assert any(one.effect == effect for one in s.omissions)
        changed = [replace(one, included=2.5 * one.without) for one in s.omissions]
        return replace(s, omissions=changed)

    return spoil


SPOIL: dict[str, Callable[[SeatedSolution], SeatedSolution]] = {
    "equilibrium": lambda s: _force(s, 1.0 + 1e-7, 0),
    "Coulomb's cone": lambda s: _force(s, 1.0 + 1e-7, 2),
    "no penetration": _displaced,
    "sticking nodes": _all_stick,
    "worn faces": _changed("worn faces"),
}


@pytest.mark.parametrize("name", SPOIL)
def test_spoiled_seating_fails(wedge: SeatedSolution, name: str) -> None:
    assert not failing(ANALYSIS.check_solution(wedge))
    assert name in failing(ANALYSIS.check_solution(SPOIL[name](wedge)))


def test_every_check_of_a_seating_is_spoiled(wedge: SeatedSolution) -> None:
    assert {c.name for c in ANALYSIS.check_solution(wedge)} == set(SPOIL)


def test_other_ways_of_loading_are_told_when_left_out() -> None:
    """Without the band the run says by how much vibration changes the force, and warns."""
    one = solved("symmetric-seated", {**WEDGE, "want": ["seating"], "left_out.stiffness": 0.05})
    (check,) = [c for c in ANALYSIS.check_solution(one) if c.name == "other ways of loading"]
    assert check.value > 0.5
    assert not check.passed
    assert 'add "band" to want' in check.remedy
    assert SHAKEN not in one.phases


def test_run_folder_of_a_seating(tmp_path: Path) -> None:
    """From the file to the folder: figures, curves, state; loaded again it answers alike."""
    result = upd.run(
        "asymmetric-seated", overrides={**PADS, "want": ["seating", "moved"]}, out=tmp_path / "run"
    )
    assert result.status.startswith("ok")
    names = {p.name for p in (tmp_path / "run").iterdir()}
    assert {"seating.png", "pressure.png", "stick_slip.png", "hysteresis.png"} <= names
    assert {"report.html", "mesh.vtu"} <= names
    assert undeclared(result.results) == []
    again = upd.load(tmp_path / "run")
    assert [r.value for r in again.results] == [r.value for r in result.results]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mesh.element": "hex20"}, "mesh.element.*hex8i"),
        ({"damper.centrifugal": "0 N"}, "damper.centrifugal"),
        ({"contact.fit": "loose"}, 'contact.fit.*"new", "worn"'),
        ({"seating.over": 0.9}, "seating.over.*not above 1"),
        ({"moved.directions": ["x", "x"]}, "moved.directions.*duplicated"),
        ({"mesh.symmetry": "quarter"}, "mesh.symmetry"),
        ({"accuracy": "1 %"}, "accuracy: a seated damper"),
        ({"solver.name": "amg"}, "solver.name"),
        ({"geometry.recipe": "sphere_block"}, "no rig of two blades"),
        ({"want": ["modes"]}, "want"),
    ],
)
def test_bad_scene_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_scene("symmetric-seated", change)
