"""What does not fit together in the scene of a forced response."""

from __future__ import annotations

from upd.scene.forced import MARCHED_WANTS, WHOLE_FACES_WANTS, ForcedScene, combined_forces
from upd.scene.forced_contact import GAUSS, SIDES, StiffnessChoice
from upd.scene.forced_values import whole_number
from upd.scene.measured import measured_problems
from upd.scene.rig import rig_problems


def forced_problems(scene: ForcedScene) -> list[str]:
    """What does not fit together."""
    e, problems = scene.excitation, []
    if not e.start < e.stop:
        problems.append(
            f"excitation.start: {e.start:g} Hz is not below excitation.stop, {e.stop:g} Hz"
        )
    labels = [f"{r:g}" for r in e.centrifugal_to_force]
    problems += [
        f"excitation.centrifugal_to_force: {x} is duplicated"
        for x in sorted({x for x in labels if labels.count(x) > 1})
    ]
    if scene.damper.centrifugal <= 0.0:
        problems.append(
            "damper.centrifugal: 0 N leaves the damper loose and the excitation F_C / "
            "ratio without size; give a positive force"
        )
    # whole faces have no estimates that could prove an accuracy
    wanted = scene.accuracy if scene.contact.model == "interface" else None
    problems += rig_problems(
        scene.mesh, scene.solver, wanted, of="a forced response", instead="geometry.refine"
    )
    problems += measured_problems(scene.measured)
    problems += _force_problems(scene)
    problems += _static_problems(scene)
    problems += _model_problems(scene)
    b = scene.balance
    if whole_number(b.samples) and whole_number(b.harmonics) and b.samples <= 2 * b.harmonics:
        problems.append(
            f"balance.samples: {b.samples} cannot carry harmonic {b.harmonics}; take more "
            f"than {2 * b.harmonics}"
        )
    if scene.performance.lowest >= scene.performance.highest:
        problems.append("performance.lowest: is not below performance.highest")
    problems += [
        f"contact.stiffness: there is no table [stiffness.{name}]; known: "
        f"{', '.join(scene.stiffness)}"
        for name in scene.contact.stiffness
        if name not in scene.stiffness
    ]
    return problems + [
        problem
        for name, s in scene.stiffness.items()
        for problem in _stiffness_problems(f"stiffness.{name}", s, scene.arrangement)
    ]


def _force_problems(scene: ForcedScene) -> list[str]:
    """Forces that cancel, or that the balance's harmonics do not carry."""
    if not combined_forces(scene.excitation):
        return ["excitation.forces: cancel each other; give forces that excite something"]
    highest, kept = scene.excitation.highest_harmonic, scene.balance.harmonics
    if whole_number(scene.balance.samples) and scene.balance.samples <= 2 * highest:
        return [
            f"balance.samples: {scene.balance.samples} cannot carry the force in harmonic "
            f"{highest}; take more than {2 * highest}"
        ]
    marched = scene.contact.model != "springs" and scene.balance.method == "march"
    if not marched and whole_number(kept) and kept < highest:
        return [
            f"balance.harmonics: {kept} do not carry the force in harmonic {highest}; write "
            f'{highest} or more, or "adaptive"'
        ]
    return []


def _gauss_problems(scene: ForcedScene) -> list[str]:
    """What Gauss points are not: lines of a lattice, or points of a law. Whole faces have none."""
    c = scene.contact
    if c.rule != GAUSS or c.model != "springs":
        return []
    problems = []
    if c.share != "area":
        problems.append('contact.share: Gauss points have their own shares; write "area"')
    if not all(isinstance(one, int) for side in SIDES for one in c.lines(side)):
        problems.append(
            'contact.rule: "gauss" needs numbers of points, for example rows = 4 and columns = 2'
        )
    problems += [
        f'stiffness.{name}.points: Gauss points are not those of a law; write "lattice"'
        for name, s in scene.stiffness.items()
        if name in (c.stiffness or scene.stiffness) and s.points == "law"
    ]
    return problems


def _model_problems(scene: ForcedScene) -> list[str]:
    """What one model of the contact has and the other has not."""
    c, problems = scene.contact, _gauss_problems(scene)
    if c.model == "springs":
        if c.worn not in (0.0, 1.0):
            problems.append(
                f"contact.fit: {c.worn:g} is for whole faces; springs fit loaded or unloaded: "
                'write one of these, or contact.model = "interface"'
            )
        return problems
    if scene.mesh.element not in ("hex8", "hex8i"):
        problems.append(
            f"mesh.element: {scene.mesh.element} has nodes that do not carry the contact alike; "
            'contact.model = "interface" needs "hex8i"'
        )
    more = [one for one in scene.want if one not in WHOLE_FACES_WANTS]
    if more:
        problems.append(
            f"want: {', '.join(more)} {'is' if len(more) == 1 else 'are'} of contact points with "
            f'springs; with contact.model = "interface" take of {", ".join(WHOLE_FACES_WANTS)}'
        )
    marched = [one for one in scene.want if one in MARCHED_WANTS]
    if marched and scene.balance.method == "balance":
        problems.append(
            f"want: {', '.join(marched)} of whole faces {'is' if len(marched) == 1 else 'are'} "
            'read from the sweeps: write balance.method = "march"'
        )
    return problems


def _static_problems(scene: ForcedScene) -> list[str]:
    """Ratios of one face and forces of the other, more than friction, faces that pull."""
    given, mu, problems = scene.contact.static, scene.contact.friction, []
    if isinstance(given, str):
        return []
    if len({isinstance(given[side], float) for side in SIDES}) > 1:
        return [
            "contact.static: T/N of one face and forces of the other; give both faces alike: the "
            "ratios of both, or N and T of both"
        ]
    for side in SIDES:
        one = given[side]
        if isinstance(one, float) and abs(one) > mu:
            problems.append(
                f"contact.static.{side}: |T/N| = {abs(one):g} is beyond friction, {mu:g}; give at "
                "most that"
            )
        elif not isinstance(one, float) and one["N"] < 0.0:
            problems.append(
                f"contact.static.{side}: N = {one['N']:g} N pulls; a contact carries only pressure"
            )
    return problems


def _stiffness_problems(where: str, s: StiffnessChoice, arrangement: str) -> list[str]:
    problems = []
    if (s.K_N is None) != (s.K_T is None):
        problems.append(
            f"{where}: K_N and K_T come together; add {'K_N' if s.K_N is None else 'K_T'}"
        )
        return problems
    if s.scene is not None and s.run is not None:
        problems.append(f"{where}: scene and run are both given; give one")
    if s.from_contact and s.K_N is not None:
        problems.append(
            f"{where}: K_N and K_T beside a contact analysis; give one of them, or left = "
            f"{{ K_N = ..., K_T = ... }} for one face"
        )
    if not s.from_contact:
        missing = [side for side in SIDES if s.face(side) is None]
        if missing:
            problems.append(
                f"{where}: no stiffness for the {' and the '.join(missing)} face; give K_N "
                "and K_T, or scene, or run"
            )
        if s.points == "law":
            problems.append(
                f'{where}.points: "law" needs scene or run, the contact analysis whose '
                "points it means"
            )
    elif arrangement == "asymmetric" and s.left is None:
        problems.append(
            f"{where}: a contact analysis gives the pads on the right; the left face needs "
            f"left = {{ K_N = ..., K_T = ... }}"
        )
    return problems
