"""Forces at both blades, with phases and in several harmonics: what these must give."""

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from rigs import SET_LINES, state_of

from upd.analyses import make_plan
from upd.analyses.forced import measures
from upd.analyses.forced.curves import faces_limit, point_limit
from upd.analyses.forced.interface_model import (
    by_coulomb,
    make_interface_model,
    spring_march,
    worn_start,
)
from upd.analyses.forced.measures import Array, ComplexArray
from upd.analyses.forced.model import Model, make_model, respond
from upd.analyses.forced.performance import peaks_at
from upd.analyses.forced.plan import Excitation, ForcedPlan, excitation_of
from upd.analyses.forced.statics import face_laws
from upd.analyses.seated.bodies import make_bodies
from upd.analyses.seated.interface import make_interface
from upd.hbm import FrequencyResponse
from upd.hbm.faces.march import InterfaceMarch
from upd.hbm.faces.state import InterfaceModel
from upd.hbm.faces.sweep import settle
from upd.hbm.springs.time_integration import steady_state
from upd.progress import Stages, silent
from upd.scene import load_scene
from upd.scene.forced import ExcitationChoice, HarmonicForce
from upd.scene.forced_contact import SIDES

SCENE = [
    *SET_LINES,
    "mesh.element=hex8i",
    "contact.static=frictionless",
    'contact.stiffness=["thesis"]',
    "contact.columns=1",
    "contact.rows=2",
    "contact.friction=0.15",
    "reduction.modes=4",
    "balance.harmonics=3",
    "excitation.start=380 Hz",
    "excitation.stop=480 Hz",
    "excitation.points=60",
    "excitation.forces=[{blade='left'}, {blade='right'}]",
]
LEFT, RIGHT = 0, 1
#: F_E of a motion in which every point sticks, and of one in which some slip, N
STUCK, SLIPPING = 350.0 / 1e6, 350.0 / 300.0
F = np.array([395.0, 411.0, 440.0, 456.0])
#: where points slip, Hz
NEAR = 400.0


@cache
def rig() -> tuple[ForcedPlan, Model]:
    """The wedge on a column of points a face, places at both blades."""
    plan: Any = make_plan(load_scene("symmetric-response", SCENE))
    laws = face_laws(next(iter(plan.scene.stiffnesses.values())), Stages(silent))
    return plan, make_model(plan, make_bodies(plan), laws)


def excited(*forces: HarmonicForce) -> Model:
    """The rig with other forces at the same places."""
    drive = np.zeros((2, max(one.harmonic for one in forces)), complex)
    found = excitation_of(ExcitationChoice(forces=forces))
    for side, row in zip(found.blades, found.drive, strict=True):
        drive[SIDES.index(side), : len(row)] = row
    return replace(rig()[1], excitation=Excitation(SIDES, drive))


def answer(model: Model, f: Array, force: float = STUCK, **changes: Any) -> FrequencyResponse:
    found = respond(rig()[0], model, force, f, **changes)
    assert found.arrived
    return found


def accelerances(model: Model, f: Array, force: float = STUCK, **changes: Any) -> ComplexArray:
    """(2, n) of the left and the right blade at the frequencies."""
    found = answer(model, f, force, **changes)
    at = [int(np.argmin(np.abs(found.frequency - one))) for one in f]
    return np.array([measures.accelerance(found, model.row(s), force)[at] for s in SIDES])


ONE, OTHER = HarmonicForce("right"), HarmonicForce("left")


def test_forces_in_phase_leave_out_the_out_of_phase_peak() -> None:
    """Stuck, the answer is the sum of those to each force; the blades, 1 % apart in mass, move in
    phase alone.
    """
    plan = rig()[0]
    alone = [accelerances(excited(one), F) for one in (ONE, OTHER)]
    both = accelerances(excited(ONE, OTHER), F)
    assert np.abs(both - alone[0] - alone[1]).max() < 1e-9 * np.abs(both).max()
    for forces, modes in (
        ((ONE,), ["in phase", "out of phase"]),
        ((ONE, OTHER), ["in phase"]),
        ((ONE, replace(OTHER, phase=180.0)), ["out of phase"]),
    ):
        model = excited(*forces)
        for side in SIDES:
            told = point_limit(plan, model, True).peaks(side, np.linspace(380.0, 480.0, 101))
            assert [one.mode for one in told] == modes


def test_amplitude_and_phase_turn_and_scale_the_answer() -> None:
    one, other = (accelerances(excited(force), F) for force in (ONE, OTHER))
    turned = accelerances(excited(replace(ONE, phase=180.0), replace(OTHER, phase=180.0)), F)
    assert np.abs(turned + one + other).max() < 1e-9 * np.abs(turned).max()
    part = accelerances(excited(ONE, replace(OTHER, amplitude=0.5, phase=90.0)), F)
    assert np.abs(part - one - 0.5j * other).max() < 1e-9 * np.abs(part).max()
    # two forces in one place are their sum
    twice = accelerances(excited(ONE, replace(ONE, amplitude=0.5, phase=90.0)), F)
    assert np.abs(twice - (1.0 + 0.5j) * one).max() < 1e-9 * np.abs(twice).max()


def test_friction_sees_a_shift_of_all_phases_as_one_of_time() -> None:
    forces = (ONE, replace(OTHER, amplitude=0.5, phase=-60.0))
    f = np.array([NEAR])
    plain = accelerances(excited(*forces), f, SLIPPING)
    shifted = [replace(one, phase=one.phase + 90.0) for one in forces]
    turned = accelerances(excited(*shifted), f, SLIPPING)
    assert np.abs(turned - 1j * plain).max() < 1e-6 * np.abs(plain).max()


def test_the_second_harmonic_is_the_first_of_twice_the_frequency() -> None:
    first, second = excited(ONE, OTHER), excited(*(replace(p, harmonic=2) for p in (ONE, OTHER)))
    one, two = (accelerances(m, f) for m, f in ((first, F), (second, F / 2.0)))
    assert np.abs(one - two).max() < 1e-9 * np.abs(one).max()
    # with its peaks, and its place in every number that is read
    tops = []
    for model, f, k in ((first, F, 1), (second, F / 2.0, 2)):
        found = answer(model, f)
        grid = np.linspace(380.0, 480.0, 101) / k
        (told,) = point_limit(rig()[0], model, True).peaks("right", grid)
        damper = measures.damper_motion(found, model)[1][1]
        tops.append([k * told.frequency, told.height, told.mac, *damper[[0, 4]]])
    assert tops[1] == pytest.approx(tops[0], rel=1e-6)


def test_a_peak_of_a_whole_curve_is_in_the_harmonic_that_is_read() -> None:
    plan, tops = rig()[0], []
    for k in (1, 2):
        swept = replace(plan.scene.excitation, start=380.0 / k, stop=480.0 / k)
        mine = replace(plan, scene=replace(plan.scene, excitation=swept))
        model = excited(*(replace(one, harmonic=k) for one in (ONE, OTHER)))
        found = peaks_at(mine, model, 1e5)
        assert found.arrived
        right = [one for one in found.peaks if one.blade == "right"]
        tops.append([v for one in right for v in (one.height, k * one.frequency)])
    assert len(tops[0]) == 2
    assert tops[1] == pytest.approx(tops[0], rel=1e-7)


def test_energy_of_two_forces_and_harmonics_closes_with_slip() -> None:
    forces = (ONE, replace(OTHER, amplitude=0.5, phase=70.0), replace(OTHER, harmonic=2))
    found = answer(excited(*forces), np.array([NEAR]), SLIPPING)
    assert found.energy.sum() > 0.0
    assert np.abs(found.energy_balance).max() < 1e-9


def test_the_march_settles_where_another_does_in_either_harmonic() -> None:
    """Points slip; the other march is that of `upd.hbm.springs.time_integration`."""
    marched = []
    for k in (1, 2):
        forces = (ONE, replace(OTHER, amplitude=0.5, phase=70.0))
        model = excited(*(replace(one, harmonic=k) for one in forces))
        f = NEAR / k
        found = answer(model, np.array([f]), SLIPPING, harmonics=range(0, 3 * k + 1, k))
        springs = spring_march(model, 0.005, len(model.K), 4)
        drive = SLIPPING * model.excitation.drive
        march = InterfaceMarch(springs.march, f, drive, 128 * k, by_coulomb)
        at = state_of(springs, model, found, 0, SLIPPING)
        point = settle(march, at, 1e-4, 400)
        assert point.settled and point.last.counts[2] > 0.0
        size = (2.0 * np.pi * k * f) ** 2 * 1e-3 / SLIPPING
        marched.append(size * np.abs(point.harmonics[0, : len(SIDES)]))
        other = steady_state(found.balance, f, found.x[0], steps=512 * k)
        wanted = [other.amplitude(model.row(s), found.harmonics.place(k)) for s in SIDES]
        assert marched[-1] == pytest.approx(size * np.array(wanted), rel=4e-3)
        work, *lost = point.last.energy
        assert work == pytest.approx(sum(lost), rel=2e-3)
    # the steps are as long in both, twice as many in a period of half the frequency: what differs
    # is left to settle
    assert marched[1] == pytest.approx(marched[0], rel=1e-4)


def test_the_state_of_a_motion_repeats_it_with_forces_at_both_places() -> None:
    forces = (ONE, replace(OTHER, phase=70.0), replace(OTHER, amplitude=0.3, harmonic=2))
    model = excited(*forces)
    found = answer(model, F[1:2])
    springs = spring_march(model, 0.005, len(model.K), 4)
    march = InterfaceMarch(springs.march, F[1], STUCK * model.excitation.drive, 128)
    at = state_of(springs, model, found, 0, STUCK)
    begun = at.copy()
    march.period(at)
    moving = begun.q - begun.held / springs.march.omega**2
    assert np.abs(at.q - begun.q).max() < 3e-3 * np.abs(moving).max()
    # modes that the steps resolve; the force at both places is a part of theirs
    push = springs.march.places @ (STUCK * model.excitation.drive.real.sum(axis=1))
    assert np.abs(at.p - begun.p)[:6].max() < 3e-3 * np.abs(push[:6]).max()


def test_modes_that_follow_statically_are_pushed_at_both_places() -> None:
    model = excited(ONE, replace(OTHER, phase=70.0))
    springs = spring_march(model, 0.005, 14, 4)
    moved = springs.march.linear_response(F, model.excitation.read, stuck=True)[:, :2].T
    H = -((2.0 * np.pi * F) ** 2) * 1e-3 * moved
    wanted = accelerances(model, F)
    assert np.abs(H - wanted).max() < 2e-4 * np.abs(wanted).max()


@cache
def whole_faces(*blades: Any) -> InterfaceModel:
    changes = ["mesh.symmetry=half", "geometry.patch_along_y=4", "geometry.patch_along_slope=2"]
    plan: Any = make_plan(load_scene("symmetric-seated", changes))
    bodies = make_bodies(plan)
    of = make_interface(plan, bodies)
    given: Any = {"friction": 0.6, "centrifugal": 350.0, "damping": 0.005}
    model = make_interface_model(plan, bodies, of, **given, excited=blades, kept_modes=(5, 2000.0))
    return worn_start(model, of, 350.0)[0]


def at_forces(model: InterfaceModel) -> InterfaceModel:
    """The model with the motion of its force nodes as outputs, but for what each force alone does
    beside the modes.
    """
    none = np.zeros((model.places.shape[1],) * 2)
    return replace(model, seen_modes=model.places.T, seen_contact=model.pushed.T, seen_drive=none)


@pytest.mark.parametrize("stuck", [True, False])
def test_whole_faces_are_reciprocal_at_both_places(stuck: bool) -> None:
    """What a force at one blade moves the other's force node by is what the other moves its by."""
    model, f = whole_faces(*SIDES), np.array([300.0, 420.0])
    seen = [at_forces(model).linear_response(f, drive, stuck=stuck) for drive in np.eye(2)]
    A = np.array(seen)
    assert np.abs(A[LEFT, :, 1] - A[RIGHT, :, 0]).max() < 1e-9 * np.abs(A).max()
    assert stuck == (np.abs(A[LEFT, :, 1]).min() > 1e-3 * np.abs(A).max())
    alone = at_forces(whole_faces("right")).linear_response(f, [1.0], stuck=stuck)
    assert np.abs(alone[:, 0] - A[RIGHT, :, 1]).max() < 1e-9 * np.abs(A).max()


def test_curves_of_whole_faces_are_sums_and_second_harmonics() -> None:
    model, f = whole_faces(*SIDES), np.linspace(400.0, 480.0, 17)

    def curves(*forces: HarmonicForce) -> Any:
        drive = np.zeros((2, forces[0].harmonic), complex)
        for one in forces:
            drive[SIDES.index(one.blade), one.harmonic - 1] = one.amplitude * np.exp(
                1j * math.radians(one.phase)
            )
        of = Excitation(SIDES, drive)
        at, limit = f / of.lowest, faces_limit(model, of, 480.0, True)
        read = np.array([limit.accelerance(side, at) for side in SIDES])
        return read, limit.peaks("right", at)

    (one, _), (other, _), (both, peaks) = curves(ONE), curves(OTHER), curves(ONE, OTHER)
    assert np.abs(both - one - other).max() < 1e-9 * np.abs(both).max()
    twice, same = curves(replace(ONE, harmonic=2), replace(OTHER, harmonic=2))
    assert np.abs(twice - both).max() < 1e-9 * np.abs(both).max()
    assert [2.0 * p.frequency for p in same] == pytest.approx([p.frequency for p in peaks])


def test_a_blade_without_a_force_and_damper_is_at_rest() -> None:
    f = np.linspace(280.0, 320.0, 5)
    alone = Excitation(("right",), np.ones((1, 1), complex))
    assert alone.free_blades == ("right",)
    limit = faces_limit(whole_faces("right"), alone, 320.0, False)
    assert np.all(limit.accelerance("right", f)) and limit.peaks("left", f) == []
