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
from upd.analyses.cost import NODES, CostModel, Count
from upd.analyses.forced.statics import check_sources, plans_to_solve
from upd.analyses.seated.plan import centrifugal_effects, friction_effect, worn_effect
from upd.hbm.core.fourier import harmonics, sample_count
from upd.mesh import recipes
from upd.scene import ForcedScene
from upd.scene.base import rig_parameters
from upd.scene.forced import ExcitationChoice, combined_forces
from upd.scene.forced_contact import GAUSS, SIDES, Side

Array = NDArray[np.float64]
#: checks of omitted effects; each solves a number again with the effect
ALONG = "sliding along y"
CONFIRMED = "confirmed by time integration"
ELASTIC = "elastic damper"
# Timed on the ready scenes with one thread: a point of a curve, of each contact point its harmonics
# and samples, of each entry of the Jacobian.
_CURVE_POINT_S, _HARMONIC_S, _SAMPLE_S, _ENTRY_S = 3e-4, 8e-6, 6e-7, 2e-9
# Points that a curve has beside the frequencies asked for, and those of a mode over its amplitude.
_MORE, _MODE = 150, 600
# What is solved again around the peaks, and the coarser meshes, over the run.
_AROUND = 0.4
# Sweeps: periods at each frequency until it settles; seconds of a time step, of each point there.
_PERIODS, _MARCH_S, _MARCH_POINT_S = 150.0, 1.2e-6, 4e-8
# Whole faces by sweeps: frequencies of one in a unit of the logarithm, time steps at each, seconds
# of each dof of the contact there. By the balance: Newton iterations of a curve, seconds of one
# sample for each dof. Matrices of all dofs at a time.
_CLOSER, _MARCHED, _DOF_S, _ITERATIONS, _MOVED_S, _MATRICES = 130.0, 3.2e4, 2e-7, 250.0, 8e-7, 10.0
# Figures, files and page.
_FILES_S = 5.0
#: time steps in a period where the scene names none: of whole faces twice as many change peaks by
#: 0.05 %
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
    needs = cost.side_by_side(min(2, cost.threads), 2)
    solves = not whole and scene.balance.method == "balance"
    again = _AROUND * (cost.seconds + cost.shared)
    again *= solves and (scene.estimates or scene.left_out.solves)
    cost.seconds += again
    return ForcedPlan.of(
        cost,
        parameters["symmetry"],
        parameters,
        effects_of(scene),
        needs,
        _FILES_S,
        estimate_seconds=again,
    )


def _add_whole_faces(cost: CostModel, scene: ForcedScene) -> None:
    """Bodies and curves of both faces node by node."""
    for body, count in cost.size.items():
        cost.dynamic_body(count)
        cost.condensed(f"{body}, compliance", count, 3 * count["contact"])
    m = 3.0 * sum(cost.size[side]["contact"] for side in SIDES)
    e, curves = scene.excitation, len(scene.excitation.centrifugal_to_force)
    if scene.balance.method == "march":
        solved = 2.0 * curves * _CLOSER * math.log(e.stop / e.start)
        cost.seconds += solved * _MARCHED * _DOF_S * m
    else:
        slides = scene.contact.friction > 0.0
        cost.seconds += _ITERATIONS * curves * time_steps(scene) * slides * _MOVED_S * m
    cost.kept_bytes += _MATRICES * 8.0 * m**2


def parameters_of(scene: ForcedScene) -> dict[str, Any]:
    """Of the recipe."""
    symmetry = "full" if scene.mesh.symmetry == "full" else "half"
    return rig_parameters(scene, symmetry, NODES[scene.mesh.element])


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
    _add_curves(cost, scene)
    cost.before_bytes = max((plan.memory_bytes for plan in sources), default=0.0)


def _add_curves(cost: CostModel, scene: ForcedScene) -> None:
    """All curves of the run, and those of the performance curve."""
    e, points = scene.excitation, _points(scene, cost.size)
    names, curves = len(scene.stiffnesses), len(e.centrifugal_to_force)
    if scene.balance.method == "march":
        solved = 2.0 * e.points * names * curves
        cost.seconds += solved * _PERIODS * time_steps(scene) * (_MARCH_S + _MARCH_POINT_S * points)
        return
    whole = names * curves + scene.wants("performance") * scene.performance.points
    places = whole * (e.points + _MORE) + 2 * names * _MODE * scene.wants("nonlinear_modes")
    highest, given = int(scene.balance.harmonics), scene.balance.samples
    samples = sample_count(harmonics(range(highest + 1)), None if given == "auto" else given)
    # normal and along, cosine and sine
    unknowns = 2.0 * points * (2 * highest + 1)
    each = _CURVE_POINT_S + _HARMONIC_S * unknowns + _ENTRY_S * unknowns**2
    cost.shared += places * (each + _SAMPLE_S * points * samples)


def time_steps(scene: ForcedScene) -> int:
    """Steps in a period of every march, and samples of whole faces by the balance."""
    given = scene.balance.samples
    return MARCH_SAMPLES if given == "auto" else int(given)


def _points(scene: ForcedScene, size: Mapping[str, Count]) -> float:
    """Contact points of both faces, roughly: one for itself and its mirror image."""
    total, whole = 0.0, scene.mesh.symmetry == "full"
    for side in SIDES:
        # of the nodes of quadratic elements those at corners
        nodes = size[side]["contact"] * (1.0 if whole else 2.0)
        lines = math.sqrt(nodes * 8 / NODES[scene.mesh.element])
        rows, columns = (
            lines if one == "all" else float(one if isinstance(one, int) else len(one))
            for one in scene.contact.lines(side)
        )
        total += rows * (columns if whole else math.ceil(0.5 * columns))
    return total


def grid(plan: ForcedPlan) -> Array:
    """Frequencies of the sweep in Hz."""
    e = plan.scene.excitation
    return np.linspace(e.start, e.stop, e.points)


# -- what is simulated and left out ----------------------------------------------------------------


#: where the static forces of the faces come from
_STATIC = {
    "seated": "F_C raised from nothing on both faces, coupled contact",
    "frictionless": "no mean friction before vibration, near what vibration leaves",
    "opposing": "friction fully mobilised against F_C",
    "reversed": "friction fully mobilised along F_C",
}


def effects_of(scene: ForcedScene) -> list[Effect]:
    """All of them, of springs at points or of all nodes of both faces."""
    even = "rig, load and contact are even about y = 0: an even motion excites no odd one"
    whole, static = scene.mesh.symmetry == "full", "N and T of both faces are given"
    if isinstance(scene.contact.static, str):
        static = _STATIC[scene.contact.static]
    return [
        *(_of_faces(scene) if scene.contact.model == "interface" else _of_points(scene)),
        Effect.either("motion odd about y = 0", whole, "the full model", even),
        Effect("excitation", True, f"{excitation_of(scene.excitation).words}, along x"),
        Effect("lift-off", True, "every point of the contact may open"),
        Effect("static balance", True, static),
        Effect("damper inertia", True, "mass and inertia from its mesh"),
        *centrifugal_effects(scene),
    ]


def _of_points(scene: ForcedScene) -> list[Effect]:
    """Contact by springs at points."""
    b, elastic = scene.balance, ELASTIC if scene.left_out.solves else ""
    samples = "power of two by rule" if b.samples == "auto" else f"{b.samples} a period"
    fit, spread = "the faces fit each other", "blades spread by F_C"
    loaded, rigid = scene.contact.loaded, "in the contact stiffness; the body moves rigidly"
    return [
        friction_effect(scene, "; a curve stuck everywhere is answered linearly"),
        _along(scene),
        Effect.either(spread, not loaded, f"{fit} without load", f"{fit} under F_C, worn in"),
        _harmonics(scene, f"0 to {b.harmonics}; {samples} samples", CONFIRMED),
        Effect("damper elasticity", False, rigid, elastic),
        Effect("modes above", False, f"{scene.reduction.modes} modes a blade, static remainder"),
    ]


def _of_faces(scene: ForcedScene) -> list[Effect]:
    """Contact by all nodes of both faces."""
    balanced = f"0 to {scene.balance.harmonics} of the blades; contact and damper in time"
    return [
        friction_effect(scene),
        Effect("normal and tangential coupling", True, "solved together at every step in time"),
        Effect("damper elasticity", True, "its deformation follows its forces statically"),
        worn_effect(scene),
        _harmonics(scene, balanced, "truncation"),
    ]


def _harmonics(scene: ForcedScene, balanced: str, check: str) -> Effect:
    if scene.balance.method == "march":
        return Effect("harmonics", True, "all: time integration")
    return Effect("harmonics", True, balanced, check)


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
    def free_blades(self) -> tuple[Side, ...]:
        """Those that move without a damper, in the harmonic that is read."""
        return tuple(side for side, a in zip(self.blades, self.read, strict=True) if a != 0.0)

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
