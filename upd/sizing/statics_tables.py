"""The statics of a damper as verdict, tables, notes and plain numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from upd.results.answer_table import AnswerTable
from upd.scene.forced_contact import SIDES
from upd.sizing.statics import JAMS, OUTCOMES, DamperStatics, MotionState


def verdict(found: DamperStatics) -> str:
    """One sentence: what the damper does, and the friction below which it carries on both faces."""
    text = f"{found.scene}: at mu = {found.friction:g} {_does(found.problems)}"
    if found.sound_below == 0.0:
        return f"{text}; no friction is low enough"
    below = f"below mu = {found.sound_below:.4g}"
    return f"{text}; both faces always carry {below}" if found.problems else f"{text}, as {below}"


def _does(problems: Sequence[str]) -> str:
    return ", ".join(problems) or "both faces carry in every motion"


def tables(found: DamperStatics) -> tuple[AnswerTable, ...]:
    """Friction from which it jams, lifts off or tilts; forces of the faces in every motion, and
    their limits.
    """
    limits = (
        ("jams: blades that approach are held by friction alone", found.limits.jams),
        ("left face lifts off: the right one can hold the damper", found.limits.left_lifts),
        ("right face lifts off: the left one can hold the damper", found.limits.right_lifts),
        ("tilts: a force would act beyond the end of its face", found.tilts),
    )
    # a damper that jams or lifts off is not followed further
    friction = tuple((what, _number(mu, "not before", 4)) for what, mu in limits)
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


def notes(found: DamperStatics) -> tuple[str, ...]:
    """Angles, friction, F_C and mass."""
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


def _number(value: float, infinite: str, digits: int = 5) -> str:
    return f"{value:.{digits}g}" if math.isfinite(value) else infinite


def _forces(state: MotionState) -> list[str]:
    """N and T of both faces, and how far off the middle of a face they must act."""
    if not math.isfinite(state.N[0]):
        return ["-"] * 5
    pairs = zip(state.N, state.T, strict=True)
    # what cancels to rounding is nothing
    small = 1e-9 * float(state.N.max())
    forces = [f"{v if abs(v) > small else 0.0:.5g}" for pair in pairs for v in pair]
    return [*forces, f"{100.0 * state.eccentricity:.0f} %"]


def _outcome(state: MotionState) -> str:
    stuck = [side for side, s in zip(SIDES, state.slides, strict=True) if s == 0.0]
    if state.outcome == OUTCOMES[JAMS] or len(stuck) != 1:
        return state.outcome
    return f"{state.outcome}, {stuck[0]} face does not slide"


def plain_numbers(found: DamperStatics) -> dict[str, Any]:
    """All numbers with their units, for JSON: what has no limit, and what is not there, is null."""
    limits = found.force_limits
    return {
        "scene": found.scene,
        "verdict": verdict(found),
        "problems": list(found.problems),
        "friction": found.friction,
        "friction_known_within": [
            {"friction": mu, "problems": list(problems)} for mu, problems in found.known_within
        ],
        "centrifugal_N": found.centrifugal,
        "mass_g": found.mass,
        "faces": {
            side: {
                "angle_deg": face.angle,
                "middle_from_centre_of_mass_mm": list(face.middle),
                "length_mm": 2.0 * face.half_length,
            }
            for side, face in zip(SIDES, found.section.faces, strict=True)
        },
        "friction_from_which": {
            "jams": finite(found.limits.jams),
            "left_face_lifts_off": finite(found.limits.left_lifts),
            "right_face_lifts_off": finite(found.limits.right_lifts),
            "tilts": finite(found.tilts),
        },
        "jams_on_its_faces": found.admissible.jams,
        "force_limits_N": {
            side: {letter: _list(limits[j, k]) for j, letter in enumerate("NT")}
            for k, side in enumerate(SIDES)
        },
        "motions": [
            {
                "motion": state.motion.name,
                "outcome": state.outcome,
                "N_N": _list(state.N),
                "T_N": _list(state.T),
                "eccentricity": finite(state.eccentricity),
                "sliding_per_motion": _list(state.slides),
                "friction_work_mJ_per_mm": finite(state.work),
            }
            for state in found.states
        ],
    }


def finite(value: float) -> float | None:
    """As JSON takes it."""
    return float(value) if math.isfinite(value) else None


def _list(values: Iterable[float]) -> list[float | None]:
    return [finite(value) for value in values]
