"""The statics of a damper as an answer: verdict, tables, notes, and maps of angles and friction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upd.plot.chart import Axis, Band, Chart, Map, Trace
from upd.report.answer_folder import FigureAnswer
from upd.results.answer_table import AnswerTable, Rounded
from upd.scene.forced_contact import SIDES
from upd.sizing.statics import JAMS, OUTCOMES, DamperStatics, MotionState, outcomes

Array = NDArray[np.float64]
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


@dataclass(frozen=True, repr=False)
class DamperDesign(FigureAnswer):
    """What `upd.design` found of a damper.

    Attributes
    ----------
    statics : DamperStatics
        Its numbers.
    """

    statics: DamperStatics
    figure = "design"

    @property
    def outcome(self) -> tuple[str, str]:
        """Whether both faces carry."""
        return ("Warning", "warning") if self.statics.problems else ("Carries", "passed")

    @property
    def verdict(self) -> str:
        """What the damper does, and the friction below which it carries on both faces."""
        found = self.statics
        text = f"{found.scene}: at mu = {found.friction:g} {_does(found.problems)}"
        if found.sound_below == 0.0:
            return f"{text}; no friction is low enough"
        below = f"below mu = {found.sound_below:.4g}"
        return (
            f"{text}; both faces always carry {below}" if found.problems else f"{text}, as {below}"
        )

    @property
    def tables(self) -> tuple[AnswerTable, ...]:
        """Friction from which it jams, lifts off or tilts; forces of the faces in every motion, and
        their limits.
        """
        found = self.statics
        limits = (
            ("jams: blades that approach are held by friction alone", found.limits.jams),
            ("left face lifts off: the right one can hold the damper", found.limits.left_lifts),
            ("right face lifts off: the left one can hold the damper", found.limits.right_lifts),
            ("tilts: a force would act beyond the end of its face", found.tilts),
        )
        # a damper that jams or lifts off is not followed further
        friction = tuple((what, _number(mu, "not before", ".4g")) for what, mu in limits)
        motions = tuple((one.motion.name, *_forces(one), _outcome(one)) for one in found.states)
        bounds = tuple(
            (side, *(_number(v, "no limit") for v in found.force_limits[:, k].ravel()))
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
                () if math.isnan(found.force_limits[0, 0, 0]) else bounds,
            ),
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """Angles, friction, F_C and mass."""
        found = self.statics
        left, right = found.section.faces
        phi = math.degrees(math.atan(found.friction))
        within = "; ".join(f"at {mu:g} {_does(problems)}" for mu, problems in found.known_within)
        tilted = math.isnan(found.force_limits[0, 0, 0])
        return (
            *([f"mu is known within limits: {within}."] if within else []),
            *(["No forces hold the damper against F_C without tilting it."] if tilted else []),
            f"Left face {left.angle:.4g} deg, right face {right.angle:.4g} deg to the horizontal; "
            f"friction angle {phi:.4g} deg; contacts {2.0 * left.half_length:.4g} and "
            f"{2.0 * right.half_length:.4g} mm up the slopes.",
            f"F_C {found.pressed}.",
        )

    @property
    def charts(self) -> list[Chart]:
        """Maps of its angles and friction."""
        return statics_charts(self.statics)


def _does(problems: Sequence[str]) -> str:
    named = (f"the {'' if 'face' in one else 'damper '}{one}" for one in problems)
    return ", ".join(named) or "both faces carry in every motion"


def _number(value: float, infinite: str, digits: str = ".5g") -> str:
    return Rounded(value, digits, "{}" if math.isfinite(value) else infinite)


def _forces(state: MotionState) -> list[str]:
    """N and T of both faces, and how far off the middle of a face they must act."""
    if not math.isfinite(state.N[0]):
        return ["-"] * 5
    pairs = zip(state.N, state.T, strict=True)
    # what cancels to rounding is nothing
    small = 1e-9 * float(state.N.max())
    forces = [Rounded(v if abs(v) > small else 0.0, ".5g") for pair in pairs for v in pair]
    return [*forces, Rounded(100.0 * state.eccentricity, ".0f", "{} %")]


def _outcome(state: MotionState) -> str:
    stuck = [side for side, s in zip(SIDES, state.slides, strict=True) if s == 0.0]
    if state.outcome == OUTCOMES[JAMS] or len(stuck) != 1:
        return state.outcome
    return f"{state.outcome}, {stuck[0]} face does not slide"


# -- charts ---------------------------------------------------------------------------------------


def statics_charts(found: DamperStatics) -> list[Chart]:
    """Maps of angles and friction with the damper marked.

    Parameters
    ----------
    found : DamperStatics
        Of the damper.
    """
    tied = abs(found.section.left.angle - found.section.right.angle) <= _SAME
    over = (
        [("both faces", True, True)]
        if tied
        else [("left face", True, False), ("right face", False, True)]
    )
    charts = [_angles(found), *(_over_friction(found, *one) for one in over)]
    return [replace(one, figure=DamperDesign.figure, size=_SIZE, columns=2) for one in charts]


def _map(x: Array, y: Array, states: NDArray[np.int64]) -> Map:
    return Map(x, y, states.astype(float), _STATE, states=OUTCOMES)


def _here(x: float, y: float, text: str) -> Trace:
    """Where the damper lies on a map."""
    return Trace(f"this damper, {text}", np.array([x]), np.array([y]), "star", outline=True)


def _angles(found: DamperStatics) -> Chart:
    left, right = (face.angle for face in found.section.faces)
    at = np.linspace(_LEAST, 90.0, _MAP)
    phi = math.degrees(math.atan(found.friction))
    jam = np.linspace(max(_LEAST, 90.0 - 2.0 * phi), 90.0, _MAP)
    return Chart(
        f"{found.scene}: angles of the faces, mu = {found.friction:g}",
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


def _over_friction(found: DamperStatics, what: str, left: bool, right: bool) -> Chart:
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
