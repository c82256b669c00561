"""A damper between two blades before any dynamics: does it jam, lift off or tilt, and what can its
faces carry.

Closed forms of `upd.contact.rigid_damper` at the angles, the
friction, the faces and the centrifugal force of a scene. The damper is rigid, its mass does not
count beside F_C, and the blades move in the plane of the slopes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from upd.analyses.seated.bodies import face_angles, patch_frame
from upd.analyses.seated.plan import centrifugal_words
from upd.contact.rigid_damper import (
    SLIDINGS,
    AdmissibleForces,
    DamperSection,
    FaceSection,
    FrictionLimits,
    Sliding,
    admissible_forces,
    eccentricity,
    friction_limits,
    jams,
    lifted,
    moment_share,
)
from upd.errors import InputError
from upd.fem import Material, mass_properties
from upd.mesh import recipes
from upd.plot.answer_table import AnswerTable, Rounded
from upd.plot.chart import Axis, Band, Chart, Map, Trace
from upd.report.answer import FigureAnswer
from upd.scene import AnyScene
from upd.scene.base import rig_parameters
from upd.scene.forced import FORCED
from upd.scene.forced_contact import SIDES
from upd.scene.seated import SEATED

Array = NDArray[np.float64]
#: what a damper does, by the numbers of `outcomes`
OUTCOMES = (
    "both faces carry",
    "tilts",
    "left face lifts off",
    "right face lifts off",
    "either face lifts off",
    "jams",
)
#: friction coefficients among which the first that tilts the damper is looked for
_SCANNED = 400
#: x and z
_ACROSS = [0, 2]
#: points of a map along one axis
_MAP = 121
#: least angle of a map [deg]; friction to which maps reach at least, and beyond that of the scene
_LEAST, _FRICTION, _BEYOND = 1.0, 1.2, 1.6
#: end of the axes of angles [deg]: room for a mark at 90
_EDGE = 95.0
_SIZE = (6.0, 5.0)
#: rounding of angles measured on a mesh [deg]
_SAME = 1e-6
_STATE = Axis("state")
CARRIES, TILTS, LEFT_LIFTS, RIGHT_LIFTS, EITHER_LIFTS, JAMS = range(len(OUTCOMES))


def scene_damper(scene: AnyScene) -> tuple[DamperSection, float]:
    """Faces of the damper between two blades, seen from its centre of mass, and its mass [t].

    Parameters
    ----------
    scene
        A forced response or a seated damper.

    Raises
    ------
    InputError
        For a scene without a damper between two blades.
    """
    if scene.analysis not in (FORCED, SEATED):
        raise InputError(
            f"scene {scene.name}: has no damper between two blades (it is a {scene.analysis}); "
            f'to fix it: take one with analysis = "{FORCED}" or "{SEATED}", for example '
            "symmetric-response"
        )
    meshes, _ = recipes.build_mesh(scene.recipe, rig_parameters(scene, "full", 8))
    of: Any = scene
    material = Material(of.material.E, of.material.nu, of.damper.density or of.material.density)
    body = mass_properties(meshes["damper"], material)
    # from the patches of the blades' meshes
    frames = np.stack([patch_frame(meshes[side]) for side in SIDES])
    faces = []
    for side, frame, angle in zip(SIDES, frames, face_angles(frames), strict=True):
        mesh = meshes[side]
        points = mesh.points[np.unique(mesh.faces["patch"][:, :4])] @ frame.T
        low, high = points[:, 2].min(), points[:, 2].max()
        middle = (0.5 * (low + high) * frame[2] + points[:, 0].mean() * frame[0])[_ACROSS]
        x, z = middle - np.asarray(body.centre)[_ACROSS]
        faces.append(FaceSection(angle, (float(x), float(z)), 0.5 * float(high - low)))
    return DamperSection(*faces), body.mass


@dataclass(frozen=True)
class MotionState:
    """The damper while one blade slides against the other, friction at its limit.

    Attributes
    ----------
    motion : Sliding
        Of the blades.
    outcome : str
        One of `OUTCOMES`.
    N, T : (2,) ndarray
        Forces of both faces, N; those of the face that carries alone where the other lifts off, nan
        where no forces hold the damper or either face may lift off.
    eccentricity : float
        How far off the middles of the faces they must act at least, as a part of half a face.
    slides : (2,) ndarray
        Sliding up each face per length of the blades' motion; nan where a face lifts off.
    """

    motion: Sliding
    outcome: str
    N: Array
    T: Array
    eccentricity: float
    slides: Array


@dataclass(frozen=True, repr=False)
class DamperDesign(FigureAnswer):
    """What `upd.design` found of a rigid damper.

    Attributes
    ----------
    section : DamperSection
        Faces of the damper.
    friction : float
        Coulomb's coefficient.
    centrifugal : float
        F_C [N].
    mass : float
        Of the damper [g].
    pressed : str
        F_C, where it comes from, and the mass, in words.
    limits : FrictionLimits
        Friction from which it jams, or a face can stay empty.
    admissible : AdmissibleForces
        Forces over F_C that hold it without tilting.
    tilts : float
        Friction from which it tilts in one of the motions; infinite where it does not before it
        jams or lifts off.
    states : tuple of MotionState
        While the blades part, approach, and rise against each other.
    known_within : tuple of (float, tuple of str)
        Where the scene knows friction within limits: these, and the problems there.
    """

    section: DamperSection
    friction: float
    centrifugal: float
    mass: float
    pressed: str
    limits: FrictionLimits
    admissible: AdmissibleForces
    tilts: float
    states: tuple[MotionState, ...]
    known_within: tuple[tuple[float, tuple[str, ...]], ...]
    figure = "design"

    @property
    def force_limits(self) -> Array:
        """(2, 2, 2): N and T of each face, least and greatest, N; infinite where it jams, nan
        where nothing holds it without tilting it.
        """
        return self.centrifugal * self.admissible.limits

    @property
    def sound_below(self) -> float:
        """Friction below which both faces carry in every motion, with bounded forces."""
        return min(self.limits.lowest, self.tilts)

    @property
    def problems(self) -> tuple[str, ...]:
        """What it does besides carrying on both faces, worst first."""
        return _problems(self.states, self.admissible)

    @property
    def outcome(self) -> tuple[str, str]:
        """Whether both faces carry."""
        return ("Warning", "warning") if self.problems else ("Carries", "passed")

    @property
    def verdict(self) -> str:
        """What the damper does, and the friction below which it carries on both faces."""
        text = f"{self.source.name}: at mu = {self.friction:g} {_does(self.problems)}"
        if self.sound_below == 0.0:
            return f"{text}; no friction is low enough"
        below = f"below mu = {self.sound_below:.4g}"
        return (
            f"{text}; both faces always carry {below}" if self.problems else f"{text}, as {below}"
        )

    @property
    def tables(self) -> tuple[AnswerTable, ...]:
        """Friction from which it jams, lifts off or tilts; forces of the faces in every motion, and
        their limits.
        """
        limits = (
            ("jams: blades that approach are held by friction alone", self.limits.jams),
            ("left face lifts off: the right one can hold the damper", self.limits.left_lifts),
            ("right face lifts off: the left one can hold the damper", self.limits.right_lifts),
            ("tilts: a force would act beyond the end of its face", self.tilts),
        )
        # a damper that jams or lifts off is not followed further
        friction = tuple((what, _number(mu, "not before", ".4g")) for what, mu in limits)
        motions = tuple(map(_motion, self.states))
        bounds = tuple(
            (side, *(_number(v, "no limit") for v in self.force_limits[:, k].ravel()))
            for k, side in enumerate(SIDES)
        )
        return (
            AnswerTable("Friction", ("the damper", "#from mu"), friction),
            AnswerTable(
                "Forces while it slides, N",
                ("motion", "#left N", "#T", "#right N", "#T", "#off middle", "outcome"),
                motions,
            ),
            AnswerTable(
                "Forces with any friction up to its limit, without tilting, N",
                ("face", "#N from", "#to", "#T from", "#to"),
                () if math.isnan(self.force_limits[0, 0, 0]) else bounds,
            ),
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """Angles, friction, F_C and mass."""
        left, right = self.section.faces
        phi = math.degrees(math.atan(self.friction))
        within = "; ".join(f"at {mu:g} {_does(problems)}" for mu, problems in self.known_within)
        tilted = math.isnan(self.force_limits[0, 0, 0])
        return (
            *([f"mu is known within limits: {within}."] if within else []),
            *(["No forces hold the damper against F_C without tilting it."] if tilted else []),
            f"Left face {left.angle:.4g} deg, right face {right.angle:.4g} deg to the horizontal; "
            f"friction angle {phi:.4g} deg; contacts {2.0 * left.half_length:.4g} and "
            f"{2.0 * right.half_length:.4g} mm up the slopes.",
            f"F_C {self.pressed}.",
        )

    @property
    def charts(self) -> list[Chart]:
        """Maps of its angles and friction, marked with the damper."""
        tied = abs(self.section.left.angle - self.section.right.angle) <= _SAME
        over = [("left face", True, False), ("right face", False, True)]
        over = [("both faces", True, True)] if tied else over
        charts = [_angles(self), *(_over_friction(self, *one) for one in over)]
        return [replace(one, figure=self.figure, size=_SIZE, columns=2) for one in charts]


def damper_statics(scene: AnyScene) -> DamperDesign:
    """The statics of a scene's damper.

    Parameters
    ----------
    scene
        A forced response or a seated damper.

    Raises
    ------
    InputError
        For a scene without a damper between two blades.
    """
    of: Any = scene
    section, mass = scene_damper(scene)
    mu, F = float(of.contact.friction), float(of.damper.centrifugal)
    admissible, states = _at(section, mu, F)
    known = of.uncertain.get("contact.friction")
    ends = () if known is None else (max(0.0, known.at(-1.0)), known.at(1.0))
    return DamperDesign(
        scene,
        section,
        mu,
        F,
        1e6 * mass,
        centrifugal_words(scene, mass),
        friction_limits(section.left.angle, section.right.angle),
        admissible,
        tilts_from(section),
        states,
        tuple((end, _problems(*_at(section, end, F)[::-1])) for end in ends),
    )


def _at(
    section: DamperSection, mu: float, F: float
) -> tuple[AdmissibleForces, tuple[MotionState, ...]]:
    """Forces that hold the damper, and its motions."""
    states = tuple(motion_state(section, mu, F, motion) for motion in SLIDINGS)
    return admissible_forces(section, mu), states


def _problems(states: Iterable[MotionState], admissible: AdmissibleForces) -> tuple[str, ...]:
    """What a damper does besides carrying on both faces, worst first."""
    found = {OUTCOMES.index(state.outcome) for state in states}
    if not len(admissible.corners):
        found.add(TILTS)
    return tuple(OUTCOMES[k] for k in sorted(found - {CARRIES}, reverse=True))


def tilts_from(section: DamperSection) -> float:
    """Friction from which the damper tilts in one of the motions.

    Parameters
    ----------
    section : DamperSection
        Its faces.

    Returns
    -------
    float
        Infinite where it does not before it jams or lifts off.
    """
    left, right = section.left.angle, section.right.angle
    friction = np.linspace(0.0, friction_limits(left, right).lowest, _SCANNED)[:-1]

    def beyond(mu: ArrayLike) -> Array:
        shares = [
            eccentricity(section, motion.left * np.asarray(mu), motion.right * np.asarray(mu))[1]
            for motion in SLIDINGS
        ]
        return np.asarray(np.fmax.reduce(shares) - 1.0)

    over = np.flatnonzero(beyond(friction) > 0.0)
    if not over.size:
        return math.inf
    first = int(over[0])
    if first == 0:
        return 0.0
    low, high = friction[first - 1 : first + 1]
    return float(brentq(lambda mu: float(beyond(mu)), low, high))


def motion_state(section: DamperSection, mu: float, F: float, motion: Sliding) -> MotionState:
    """What a damper does while the blades slide against each other.

    Parameters
    ----------
    section : DamperSection
        Its faces.
    mu, F : float
        Friction coefficient; F_C [N].
    motion : Sliding
        Of the blades.
    """
    left, right = section.left.angle, section.right.angle
    none = np.full(2, math.nan)
    empty = lifted(left, right, mu, motion)
    if len(empty) == len(SIDES):
        return MotionState(motion, OUTCOMES[EITHER_LIFTS], none, none, math.nan, none)
    if empty:
        on = 1 - SIDES.index(empty[0])
        angle = math.radians(section.faces[on].angle)
        alone = np.zeros((2, 2))
        alone[:, on] = F * math.cos(angle), F * math.sin(angle)
        outcome = LEFT_LIFTS if empty[0] == "left" else RIGHT_LIFTS
        off = float(moment_share(section, alone))
        return MotionState(motion, OUTCOMES[outcome], alone[0], alone[1], off, none)
    if motion.left < 0 and motion.right < 0 and jams(left, right, mu):
        # forces that hold each other without F_C must also meet on both faces
        held = JAMS if admissible_forces(section, mu).jams else TILTS
        return MotionState(motion, OUTCOMES[held], none, none, math.nan, np.zeros(2))
    ratios = mu * np.array([motion.left, motion.right])
    N, share = eccentricity(section, *ratios)
    slides = np.array(motion.lengths(left, right))
    kept = CARRIES if share <= 1.0 else TILTS
    return MotionState(motion, OUTCOMES[kept], F * N, F * ratios * N, float(share), slides)


def outcomes(
    section: DamperSection, left: ArrayLike, right: ArrayLike, friction: ArrayLike
) -> NDArray[np.int64]:
    """What the damper does in the worst of its motions, its faces turned about their middles.

    Parameters
    ----------
    section : DamperSection
        Its faces.
    left, right : array_like
        Inclinations [deg] to which they are turned.
    friction : array_like
        Friction coefficient; all broadcast together.

    Returns
    -------
    ndarray of int
        Numbers into `OUTCOMES`: jams before lift-off before tilting.
    """
    a, b, mu = np.broadcast_arrays(*(np.asarray(v, float) for v in (left, right, friction)))
    phi = np.degrees(np.arctan(mu))
    tilts = np.zeros(a.shape, bool)
    for motion in SLIDINGS:
        N, share = eccentricity(section, motion.left * mu, motion.right * mu, a, b)
        tilts |= np.isfinite(N).all(axis=0) & (share > 1.0)
    return np.select(
        [jams(a, b, mu), (phi >= a) & (phi >= b), phi >= b, phi >= a, tilts],
        [JAMS, EITHER_LIFTS, LEFT_LIFTS, RIGHT_LIFTS, TILTS],
        CARRIES,
    )


# -- the answer ------------------------------------------------------------------------------------


def _does(problems: Sequence[str]) -> str:
    named = (f"the {'' if 'face' in one else 'damper '}{one}" for one in problems)
    return ", ".join(named) or "both faces carry in every motion"


def _number(value: float, infinite: str, digits: str = ".5g") -> str:
    return Rounded(value, digits, "{}" if math.isfinite(value) else infinite)


def _motion(state: MotionState) -> tuple[str, ...]:
    """Its name, N and T of both faces, how far off the middle of a face they must act, and what
    the damper does.
    """
    forces = ["-"] * 5
    if math.isfinite(state.N[0]):
        # what cancels to rounding is nothing
        small = 1e-9 * float(state.N.max())
        pairs = zip(state.N, state.T, strict=True)
        forces = [Rounded(v if abs(v) > small else 0.0, ".5g") for pair in pairs for v in pair]
        forces.append(Rounded(100.0 * state.eccentricity, ".0f", "{} %"))
    stuck = [side for side, s in zip(SIDES, state.slides, strict=True) if s == 0.0]
    one = len(stuck) == 1 and state.outcome != OUTCOMES[JAMS]
    note = f", {stuck[0]} face does not slide" if one else ""
    return state.motion.name, *forces, f"{state.outcome}{note}"


# -- charts ---------------------------------------------------------------------------------------


def _map(x: Array, y: Array, states: NDArray[np.int64]) -> Map:
    return Map(x, y, states.astype(float), _STATE, states=OUTCOMES)


def _here(x: float, y: float, text: str) -> Trace:
    """Where the damper lies on a map."""
    return Trace(f"this damper, {text}", np.array([x]), np.array([y]), "star", outline=True)


def _angles(found: DamperDesign) -> Chart:
    left, right = (face.angle for face in found.section.faces)
    at = np.linspace(_LEAST, 90.0, _MAP)
    phi = math.degrees(math.atan(found.friction))
    jam = np.linspace(max(_LEAST, 90.0 - 2.0 * phi), 90.0, _MAP)
    return Chart(
        f"{found.source.name}: angles of the faces, mu = {found.friction:g}",
        Axis("left face to the horizontal", "deg", low=0.0, high=_EDGE),
        Axis("right face to the horizontal", "deg", low=0.0, high=_EDGE),
        maps=(_map(at, at, outcomes(found.section, at[:, None], at, found.friction)),),
        traces=(
            Trace("limit of jamming", jam, 180.0 - 2.0 * phi - jam, outline=True),
            Trace("limit of lift-off", np.full(2, phi), np.array([_LEAST, 90.0]), "dashed", 7),
            Trace(
                "limit of lift-off, right alone",
                np.array([_LEAST, 90.0]),
                np.full(2, phi),
                "dashed",
                7,
                entry="limit of lift-off",
            ),
            _here(left, right, f"{left:.4g} / {right:.4g} deg"),
        ),
        equal=True,
        note="Faces turned about the middles of their contacts, centre of mass kept; jams before "
        "lift-off before tilting.",
    )


def _over_friction(found: DamperDesign, what: str, left: bool, right: bool) -> Chart:
    """The map over the angle of one face or of both, and friction."""
    known = [mu for mu, _ in found.known_within]
    bands = (Band("friction, known within", "y", known[0], known[1], dashed=True),) if known else ()
    own = [face.angle for face in found.section.faces]
    angle = np.linspace(_LEAST, 90.0, _MAP)
    top = max(_FRICTION, _BEYOND * found.friction)
    mu = np.linspace(0.0, top, _MAP)
    a, b = (angle[:, None] if turns else own[k] for k, turns in enumerate((left, right)))
    here = own[0] if left else own[1]
    kept = "" if left and right else f", {'right' if left else 'left'} {own[left]:.4g} deg"
    return Chart(
        f"Angle of {what} and friction{kept}",
        Axis(f"{what} to the horizontal", "deg", low=0.0, high=_EDGE),
        Axis("friction coefficient", low=0.0, high=top),
        maps=(_map(angle, mu, outcomes(found.section, a, b, mu)),),
        traces=(_here(here, found.friction, f"{here:.4g} deg, mu {found.friction:g}"),),
        bands=bands,
    )
