"""What does not fit together in the scene of a forced response."""

from __future__ import annotations

from upd.scene import quantities as q
from upd.scene.base import repeated
from upd.scene.forced import MARCHED_WANTS, WHOLE_FACES_WANTS, ForcedScene, combined_forces
from upd.scene.forced_contact import GAUSS, SIDES, StiffnessChoice
from upd.scene.measured import measured_problems
from upd.scene.rig import rig_problems, unreachable_accuracy


def forced_problems(scene: ForcedScene) -> list[str]:
    """What does not fit together."""
    e, b, known = scene.excitation, scene.balance, ", ".join(scene.stiffness)
    highest = b.harmonics if q.is_whole(b.harmonics) else 0
    problems = repeated("excitation.centrifugal_to_force", e.centrifugal_to_force)
    add = problems.append
    if not e.start < e.stop:
        add(f"excitation.start: {e.start:g} Hz is not below excitation.stop, {e.stop:g} Hz")
    if scene.damper.centrifugal <= 0.0:
        add(
            "damper.centrifugal: 0 N leaves the damper loose and the excitation F_C / ratio "
            "without size; give a positive force"
        )
    if q.is_whole(b.samples) and b.samples <= 2 * highest:
        add(
            f"balance.samples: {b.samples} cannot carry harmonic {highest}; take more than "
            f"{2 * highest}"
        )
    if scene.performance.lowest >= scene.performance.highest:
        add("performance.lowest: is not below performance.highest")
    for name in scene.contact.stiffness:
        if name not in scene.stiffness:
            add(f"contact.stiffness: there is no table [stiffness.{name}]; known: {known}")
    if scene.contact.model == "interface":
        # whole faces have no estimates that could prove an accuracy
        problems += unreachable_accuracy(scene, "a forced response", "geometry.refine")
        problems += _whole_faces_problems(scene)
    else:
        problems += _springs_problems(scene)
    problems += rig_problems(scene) + measured_problems(scene.measured)
    problems += _force_problems(scene) + _static_problems(scene)
    for name, s in scene.stiffness.items():
        problems += _stiffness_problems(f"stiffness.{name}", s, scene.arrangement)
    return problems


def _force_problems(scene: ForcedScene) -> list[str]:
    """Forces that cancel, or that the balance's harmonics do not carry."""
    if not combined_forces(scene.excitation):
        return ["excitation.forces: cancel each other; give forces that excite something"]
    highest, b = scene.excitation.highest_harmonic, scene.balance
    if q.is_whole(b.samples) and b.samples <= 2 * highest:
        return [
            f"balance.samples: {b.samples} cannot carry the force in harmonic {highest}; take "
            f"more than {2 * highest}"
        ]
    integrated = scene.contact.model != "springs" and b.method == "march"
    if not integrated and q.is_whole(b.harmonics) and b.harmonics < highest:
        return [
            f"balance.harmonics: {b.harmonics} do not carry the force in harmonic {highest}; "
            f"write {highest} or more"
        ]
    return []


def _springs_problems(scene: ForcedScene) -> list[str]:
    """What springs have not: partly worn faces, Gauss points at lines."""
    c, gauss = scene.contact, scene.contact.rule == GAUSS
    problems: list[str] = []
    add = problems.append
    if c.worn not in (0.0, 1.0):
        add(
            f"contact.fit: {c.worn:g} is for whole faces; springs fit loaded or unloaded: write "
            'one of these, or contact.model = "interface"'
        )
    if gauss and c.share != "area":
        add('contact.share: Gauss points have their own shares; write "area"')
    if gauss and not all(isinstance(one, int) for side in SIDES for one in c.lines(side)):
        add('contact.rule: "gauss" needs numbers of points, for example rows = 4 and columns = 2')
    return problems


def _whole_faces_problems(scene: ForcedScene) -> list[str]:
    """What whole faces have not, or by time integration alone."""
    others = [one for one in scene.want if one not in WHOLE_FACES_WANTS]
    integrated = [one for one in scene.want if one in MARCHED_WANTS]
    problems: list[str] = []
    add = problems.append
    if scene.mesh.element not in ("hex8", "hex8i"):
        add(
            f"mesh.element: {scene.mesh.element} has nodes that do not carry the contact alike; "
            'contact.model = "interface" needs "hex8i"'
        )
    if others:
        known = ", ".join(WHOLE_FACES_WANTS)
        add(f'want: contact.model = "interface" has no {", ".join(others)}; take of {known}')
    if integrated and scene.balance.method == "balance":
        which = ", ".join(integrated)
        add(f'want: {which} of whole faces: from sweeps alone, write balance.method = "march"')
    return problems


def _static_problems(scene: ForcedScene) -> list[str]:
    """Ratios of one face and forces of the other, more than friction, faces that pull."""
    given, mu = scene.contact.static, scene.contact.friction
    if isinstance(given, str):
        return []
    if len({isinstance(given[side], float) for side in SIDES}) > 1:
        return [
            "contact.static: T/N of one face and forces of the other; give both faces alike: the "
            "ratios of both, or N and T of both"
        ]
    problems = []
    for side in SIDES:
        one = given[side]
        if isinstance(one, float):
            if abs(one) > mu:
                problems.append(
                    f"contact.static.{side}: |T/N| = {abs(one):g} is beyond friction, {mu:g}; give "
                    "at most that"
                )
        elif one["N"] < 0.0:
            problems.append(
                f"contact.static.{side}: N = {one['N']:g} N pulls; a contact carries only pressure"
            )
    return problems


def _stiffness_problems(where: str, s: StiffnessChoice, arrangement: str) -> list[str]:
    """What of totals and contact analysis does not go together."""
    if (s.K_N is None) != (s.K_T is None):
        missing = "K_N" if s.K_N is None else "K_T"
        return [f"{where}: K_N and K_T come together; add {missing}"]
    problems: list[str] = []
    add = problems.append
    without = [side for side in SIDES if s.face(side) is None]
    if s.scene is not None and s.run is not None:
        add(f"{where}: scene and run are both given; give one")
    if s.from_contact and s.K_N is not None:
        add(
            f"{where}: K_N and K_T beside a contact analysis; give one of them, or left = "
            "{ K_N = ..., K_T = ... } for one face"
        )
    if not s.from_contact and without:
        add(
            f"{where}: no stiffness for the {' and the '.join(without)} face; give K_N and K_T, or "
            "scene, or run"
        )
    if s.from_contact and arrangement == "asymmetric" and s.left is None:
        add(
            f"{where}: a contact analysis gives the pads on the right; the left face needs left = "
            "{ K_N = ..., K_T = ... }"
        )
    return problems
