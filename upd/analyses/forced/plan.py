"""Plan of a forced response.

What is simulated and left out, how that is checked afterwards, size and cost.

Every force acts along x at mid-core of its blade,

    F(t) = F_E Re( sum_k a_k exp(i k omega t) ),

with the amplitudes a_k relative to F_E. What is read from an answer, its accelerance, is the
acceleration in the lowest harmonic that is excited, per newton of F_E.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Effect, Plan
from upd.analyses.cost import NODES, CostModel, Count, dense_s
from upd.analyses.forced.statics import check_sources, plans_to_solve
from upd.analyses.seated.plan import centrifugal_effects, friction_effect, worn_effect
from upd.hbm.core.fourier import harmonics, sample_count
from upd.hbm.core.kept_factors import WORTH_KEEPING
from upd.mesh import recipes
from upd.scene import ForcedScene
from upd.scene.base import rig_parameters
from upd.scene.forced import ExcitationChoice, combined_forces
from upd.scene.forced_contact import GAUSS, SIDES, Side

Array = NDArray[np.float64]
#: harmonics of the blades and samples in a period where the scene leaves them to the rule: two
#: more harmonics change peaks by up to 0.5 %, twice the samples by 0.05 %
HARMONICS, SAMPLES = 3, 128
#: checks of omitted effects; each solves a number again with the effect
ALONG = "sliding along y"
CONFIRMED = "confirmed by time integration"
ELASTIC = "elastic damper"
# Counted and timed on the ready scenes with one thread. A Newton step with new factors: its small
# calls, each contact point and each of its samples, each entry of the Jacobian, times of its LU.
_STEP_S, _POINT_S, _SAMPLE_S, _ENTRY_S, _STEP_LU = 4.5e-4, 1.9e-5, 2e-7, 1.7e-8, 0.55
# Large factors are kept for several steps.
_KEPT = 0.15
# Newton steps of a curve over F_C/F_E (points that begin or end to slip are kinks of its path).
_KINKS = 1.2e5
# Newton steps of a mode over its amplitude.
_MODE = 600.0
# What is solved again around the peaks, and the coarser meshes, over the run.
_AROUND = 0.4
# Sweeps: periods at each frequency until it settles; seconds of a time step, of each point there.
_PERIODS, _MARCH_S, _MARCH_POINT_S = 150.0, 1.2e-6, 4e-8
# Whole faces by sweeps: frequencies of one in a unit of the logarithm, time steps at each, seconds
# of a step and of each dof of the contact there; dense products of one frequency.
_CLOSER, _MARCHED, _FACES_S, _DOF_S, _FACTORS = 130.0, 3.2e4, 4e-6, 1.5e-7, 4.0
# By the balance: Newton iterations of a curve, seconds of one sample for each dof that moves, share
# of those; matrices of all dofs at a time.
_ITERATIONS, _MOVED_S, _MOVING, _MATRICES = 250.0, 2e-6, 0.2, 10.0
# Figures, files and page, and those of a curve.
_FILES_S, _CURVE_S = 4.0, 1.0
#: time steps in a period of a time integration where the scene names none
MARCH_SAMPLES = 128


#: plan of a forced response
ForcedPlan = Plan[ForcedScene]


def make_plan(scene: ForcedScene) -> ForcedPlan:
    """Derive the plan of ``scene``. Raises InputError when its parts do not fit together."""
    parameters = parameters_of(scene)
    whole = scene.contact.model == "interface"
    if not whole:
        check_sources(scene)
    cost = CostModel(scene, recipes.count(scene.recipe, parameters))
    (_add_whole_faces if whole else _add_points)(cost, scene)
    needs, files = cost.side_by_side(min(2, cost.threads), 2), _files_seconds(scene)
    solves = not whole and scene.balance.method == "balance"
    again = _AROUND * (cost.seconds + files)
    again *= solves and (scene.estimates or scene.left_out.solves)
    cost.seconds += again
    symmetry = "full" if scene.mesh.symmetry == "full" else "half"
    effects = effects_of_faces(scene) if whole else effects_of_points(scene)
    return ForcedPlan.of(cost, symmetry, parameters, effects, needs, files, estimate_seconds=again)


def _add_whole_faces(cost: CostModel, scene: ForcedScene) -> None:
    """Bodies and curves of both faces node by node."""
    for body, count in cost.size.items():
        cost.dynamic_body(count)
        cost.condensed(f"{body}, compliance", count, 3 * count["contact"])
    m = 3.0 * sum(cost.size[side]["contact"] for side in SIDES)
    e, curves = scene.excitation, len(scene.excitation.centrifugal_to_force)
    if scene.balance.method == "march":
        solved = 2.0 * curves * _CLOSER * math.log(e.stop / e.start)
        cost.seconds += solved * _MARCHED * (_FACES_S + _DOF_S * m)
        cost.seconds += solved * dense_s(_FACTORS * m**3)
    else:
        samples = SAMPLES if scene.balance.samples == "auto" else int(scene.balance.samples)
        moving, rows = _ITERATIONS * curves * samples * (scene.contact.friction > 0.0), _MOVING * m
        cost.seconds += moving * _MOVED_S * rows + dense_s(moving * 2.0 * rows**2 * m)
    cost.kept_bytes += _MATRICES * 8.0 * m**2


def _files_seconds(scene: ForcedScene) -> float:
    """Figures, files and page."""
    curves = len(scene.stiffnesses) * len(scene.excitation.centrifugal_to_force)
    whole = scene.contact.model == "interface"
    return _FILES_S + _CURVE_S * curves * (not whole)


def parameters_of(scene: ForcedScene) -> dict[str, Any]:
    """Of the recipe."""
    # points on lattice lines pair themselves
    apart = scene.contact.rule == GAUSS
    half = (scene.contact.model == "interface" or apart) and scene.mesh.symmetry != "full"
    return rig_parameters(scene, "half" if half else "full", NODES[scene.mesh.element])


def _add_points(cost: CostModel, scene: ForcedScene) -> None:
    """Blades reduced to springs at points, their contact stiffnesses and curves."""
    modes = scene.reduction.modes
    for side in SIDES:
        count, task = cost.size[side], f"{side}, reduction"
        cost.dynamic_body(count)
        if scene.contact.rule == GAUSS:
            rows, columns = scene.contact.lines(side)
            cost.attached(task, count, 3 * rows * columns + 2, modes)
        else:
            cost.reduction(task, count, 3 * (count["contact"] + 2), modes)
    if scene.left_out.solves:
        # K and M of the elastic damper, once per stiffness
        cost.dynamic_body(cost.size["damper"], len(scene.stiffnesses))
    sources = plans_to_solve(scene)
    cost.seconds += sum(one.seconds - one.estimate_seconds - one.files_seconds for one in sources)
    cost.seconds += _curves_seconds(scene, cost.size)
    cost.before_bytes = max((plan.memory_bytes for plan in sources), default=0.0)


def _curves_seconds(scene: ForcedScene, size: Mapping[str, Count]) -> float:
    """All curves of the run, and those of the performance curve."""
    e, points = scene.excitation, _points(scene, size)
    if scene.balance.method == "march":
        solved = 2.0 * e.points * len(scene.stiffnesses) * len(e.centrifugal_to_force)
        return solved * _PERIODS * time_steps(scene) * (_MARCH_S + _MARCH_POINT_S * points)
    kinks = _KINKS * (scene.contact.friction > 0.0)
    steps = sum(kinks / ratio + e.points for ratio in e.centrifugal_to_force)
    steps *= len(scene.stiffnesses)
    if scene.wants("performance"):
        c = scene.performance
        steps += c.points * (kinks / math.sqrt(c.lowest * c.highest) + e.points)
    if scene.wants("nonlinear_modes"):
        steps += 2 * _MODE * len(scene.stiffnesses)
    return steps * _step_seconds(scene, size)


def time_steps(scene: ForcedScene) -> int:
    """Steps in a period of every march."""
    given = scene.balance.samples
    return MARCH_SAMPLES if given == "auto" else int(given)


def _step_seconds(scene: ForcedScene, size: Mapping[str, Count]) -> float:
    """Seconds of a Newton step with its factors."""
    across = 3 if scene.contact.directions == "two" or scene.mesh.symmetry == "full" else 2
    highest, given = int(scene.balance.harmonics), scene.balance.samples
    points = _points(scene, size)
    # coefficients of the motion of the contact points
    n = across * points * (2 * highest + 1)
    factors = _ENTRY_S * n**2 + dense_s(_STEP_LU * 2.0 / 3.0 * n**3)
    factors *= _KEPT if n > WORTH_KEEPING else 1.0
    count = sample_count(harmonics(range(highest + 1)), None if given == "auto" else given)
    return _STEP_S + (_POINT_S + _SAMPLE_S * count) * points + factors


def _points(scene: ForcedScene, size: Mapping[str, Count]) -> float:
    """Contact points of both faces, roughly: one for itself and its mirror image."""
    total = 0.0
    for side in SIDES:
        # of the nodes of quadratic elements those at corners
        lines = math.sqrt(size[side]["contact"] * 8 / NODES[scene.mesh.element])
        rows, columns = (
            lines if one == "all" else float(one if isinstance(one, int) else len(one))
            for one in scene.contact.lines(side)
        )
        total += rows * (columns if scene.mesh.symmetry == "full" else math.ceil(0.5 * columns))
    return total


def grid(plan: ForcedPlan) -> Array:
    """Frequencies of the sweep in Hz."""
    e = plan.scene.excitation
    return np.linspace(e.start, e.stop, e.points)


# -- what is simulated and left out ----------------------------------------------------------------


def effects_of_points(scene: ForcedScene) -> list[Effect]:
    """Of contact by springs at points."""
    b, elastic = scene.balance, ELASTIC if scene.left_out.solves else ""
    samples = "power of two by rule" if b.samples == "auto" else f"{b.samples} a period"
    fit = "the faces fit each other"
    return [
        friction_effect(scene, "; a curve stuck everywhere is answered linearly"),
        _along(scene),
        *_motion_and_excitation(scene),
        Effect("lift-off", True, "every point may open: N = max(0, k_n w)"),
        Effect("static balance", True, f"mean positions are unknowns; {_static_words(scene)}"),
        Effect.either(
            "blades spread by F_C",
            not scene.contact.loaded,
            f"{fit} without load",
            f"{fit} under F_C, worn in",
        ),
        Effect("damper inertia", True, "rigid body; mass and inertia from its mesh"),
        _harmonics(scene, f"0 to {b.harmonics}; {samples} samples", CONFIRMED),
        Effect(
            "damper elasticity", False, "in the contact stiffness; the body moves rigidly", elastic
        ),
        Effect("modes above", False, f"{scene.reduction.modes} modes a blade, static remainder"),
        *centrifugal_effects(scene),
    ]


def effects_of_faces(scene: ForcedScene) -> list[Effect]:
    """Of contact by all nodes of both faces."""
    balanced = f"0 to {scene.balance.harmonics} of the blades; contact and damper in time"
    return [
        friction_effect(scene),
        Effect("normal and tangential coupling", True, "solved together at every step in time"),
        *_motion_and_excitation(scene),
        Effect("lift-off", True, "every node may open"),
        Effect("damper elasticity", True, "its deformation follows its forces statically"),
        Effect("damper inertia", True, "mass and inertia from its mesh"),
        worn_effect(scene),
        Effect("static balance", True, _static_words(scene), "static balance"),
        _harmonics(scene, balanced, "truncation"),
        *centrifugal_effects(scene),
    ]


def _harmonics(scene: ForcedScene, balanced: str, check: str) -> Effect:
    if scene.balance.method == "march":
        return Effect("harmonics", True, "all: time integration")
    return Effect("harmonics", True, balanced, check)


def _motion_and_excitation(scene: ForcedScene) -> list[Effect]:
    """Motion that the half model does not have; which blades the excitation acts on."""
    even = "rig, load and contact are even about y = 0: an even motion excites no odd one"
    whole = scene.mesh.symmetry == "full"
    return [
        Effect.either("motion odd about y = 0", whole, "the full model", even),
        Effect("excitation", True, f"{excitation_of(scene.excitation).words}, along x"),
    ]


def _static_words(scene: ForcedScene) -> str:
    """Where the static forces of the faces come from."""
    static = scene.contact.static
    if not isinstance(static, str):
        return "N and T of both faces are given"
    return {
        "seated": "F_C raised from nothing on both faces, coupled contact",
        "frictionless": "no mean friction before vibration, near what vibration leaves",
        "opposing": "friction fully mobilised against F_C",
        "reversed": "friction fully mobilised along F_C",
    }[static]


def _along(scene: ForcedScene) -> Effect:
    """Whether the second sliding direction is simulated."""
    name, c = "sliding along the damper", scene.contact
    if c.directions == "two":
        return Effect(name, True, "slip circle: along the damper and up the slope")
    changes = "left out where it changes the stuck frequencies by less than 0.1 %"
    why = changes if c.directions == "auto" else "asked for"
    check = ALONG if scene.left_out.solves and scene.balance.method == "balance" else ""
    return Effect(name, False, why, check, ("contact.directions=two",), applies=c.friction > 0.0)


# -- excitation ------------------------------------------------------------------------------------


ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class Excitation:
    """Forces relative to F_E, H harmonics at L blades.

    Attributes
    ----------
    blades
        (L,) those excited, the left one first.
    drive
        (L, H) complex amplitudes of harmonics 1 to H over F_E.
    """

    blades: tuple[Side, ...]
    drive: ComplexArray

    @property
    def harmonics(self) -> tuple[int, ...]:
        """Those excited, rising."""
        return tuple(int(k) + 1 for k in np.flatnonzero(np.any(self.drive != 0.0, axis=0)))

    @property
    def lowest(self) -> int:
        """The harmonic that is read from an answer."""
        return self.harmonics[0]

    @property
    def read(self) -> ComplexArray:
        """(L,) amplitudes of the lowest harmonic over F_E."""
        return np.asarray(self.drive[:, self.lowest - 1])

    @property
    def at_start(self) -> NDArray[np.float64]:
        """(L,) forces at t = 0 over F_E."""
        return np.asarray(self.drive.real.sum(axis=1))

    @property
    def free_blades(self) -> tuple[Side, ...]:
        """Those that move without a damper, in the harmonic that is read."""
        return tuple(side for side, a in zip(self.blades, self.read, strict=True) if a != 0.0)

    @property
    def usual(self) -> bool:
        """Whether F_E on the right blade is all of it."""
        return self.blades == ("right",) and self.drive.tolist() == [[1.0]]

    @property
    def words(self) -> str:
        """The forces along x at mid-core: "F_E on the right blade, 0.5 F_E at 180 deg on the left
        blade".
        """
        parts = []
        for k in self.harmonics:
            for side, a in zip(reversed(self.blades), self.drive[::-1, k - 1], strict=True):
                size, phase = abs(a), round(math.degrees(cmath.phase(a)), 6)
                if size:
                    times = "" if math.isclose(size, 1.0) else f"{size:.4g} "
                    at = f" at {phase + 0.0:g} deg" if phase else ""
                    of = f" in harmonic {k}" if self.harmonics != (1,) else ""
                    parts.append(f"{times}F_E{at} on the {side} blade{of}")
        return ", ".join(parts)


def excitation_of(choice: ExcitationChoice) -> Excitation:
    """The forces of a scene, those of one blade and harmonic added up."""
    found = combined_forces(choice)
    blades = tuple(side for side in SIDES if any(blade == side for blade, _ in found))
    drive = np.zeros((len(blades), max(harmonic for _, harmonic in found)), complex)
    for (blade, harmonic), amplitude in found.items():
        drive[blades.index(blade), harmonic - 1] = amplitude
    return Excitation(blades, drive)
