"""The statics of a damper in words, numbers first, and as plain numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from upd.scene.forced_contact import SIDES
from upd.sizing.statics import JAMS, OUTCOMES, DamperStatics, MotionState


def headline(found: DamperStatics) -> str:
    """One sentence: what the damper does, and the friction below which it carries on both faces."""
    mu, below = found.friction, found.sound_below
    what = _does(found.problems)
    if below == 0.0:
        return f"{found.scene}: at mu = {mu:g} {what}; no friction is low enough"
    if not found.problems:
        return f"{found.scene}: at mu = {mu:g} {what}, as below mu = {below:.4g}"
    return f"{found.scene}: at mu = {mu:g} {what}; both faces always carry below mu = {below:.4g}"


def _does(problems: Sequence[str]) -> str:
    return ", ".join(problems) or "both faces carry in every motion"


def lines(found: DamperStatics) -> list[str]:
    """The answer, line by line: the damper, its limits of friction, its motions, its forces."""
    return [headline(found), *damper_lines(found), *limit_lines(found), *motion_lines(found)]


def damper_lines(found: DamperStatics) -> list[str]:
    """Angles, friction, F_C and mass."""
    left, right = found.section.faces
    phi = math.degrees(math.atan(found.friction))
    within = "; ".join(f"at {mu:g} {_does(problems)}" for mu, problems in found.known_within)
    return [
        *([f"  mu known within limits: {within}"] if within else []),
        f"  left face {left.angle:.4g} deg, right face {right.angle:.4g} deg to the horizontal; "
        f"friction angle {phi:.4g} deg",
        f"  F_C {found.pressed}; contacts {2.0 * left.half_length:.4g} and "
        f"{2.0 * right.half_length:.4g} mm up the slopes",
    ]


def limit_lines(found: DamperStatics) -> list[str]:
    """Friction from which it jams, a face lifts off, or it tilts."""
    limits, mu = found.limits, found.friction
    told = [
        (limits.jams, "jams: blades that approach are held by friction alone, without limit"),
        (limits.left_lifts, "left face lifts off: the right one can hold the damper alone"),
        (limits.right_lifts, "right face lifts off: the left one can hold the damper alone"),
        (
            found.tilts,
            "tilts: a force would have to act beyond the end of its face (100 % off middle)",
        ),
    ]
    out = ["  from mu"]
    for limit, words in told:
        at = f"{limit:.4g}" if math.isfinite(limit) else "never"
        if math.isinf(limit) and words.startswith("tilts"):
            # a damper that jams or lifts off is not followed further
            at = "not before"
        out.append(f"    {at:>10}  {words}{' <- here' if mu >= limit else ''}")
    return out


def motion_lines(found: DamperStatics) -> list[str]:
    """Forces of both faces while the blades move against each other, and over all states."""
    heads = ("left N", "T", "right N", "T", "off middle")
    out = [f"  {'friction at its limit, N:':<25}" + "".join(f"{head:>11}" for head in heads)]
    for state in found.states:
        numbers = "".join(f"{text:>11}" for text in _numbers(state))
        out.append(f"    {state.motion.name:<23}{numbers}  {_outcome(state)}")
    limits = found.force_limits
    if math.isnan(limits[0, 0, 0]):
        return [*out, "  no forces hold it against F_C without tilting it"]
    out.append("  any friction up to its limit, without tilting:")
    for k, side in enumerate(SIDES):
        N, T = limits[0, k], limits[1, k]
        out.append(f"    {side:<6}N {_span(*N)}; T {_span(*T)}")
    return out


def _numbers(state: MotionState) -> list[str]:
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


def _span(low: float, high: float) -> str:
    ends = [f"{v:.5g} N" if math.isfinite(v) else "no limit" for v in (low, high)]
    return f"{ends[0]} to {ends[1]}"


def plain_numbers(found: DamperStatics) -> dict[str, Any]:
    """All numbers with their units, for JSON: what has no limit, and what is not there, is null."""
    limits = found.force_limits
    return {
        "scene": found.scene,
        "verdict": headline(found),
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
            "jams": _finite(found.limits.jams),
            "left_face_lifts_off": _finite(found.limits.left_lifts),
            "right_face_lifts_off": _finite(found.limits.right_lifts),
            "tilts": _finite(found.tilts),
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
                "eccentricity": _finite(state.eccentricity),
                "sliding_per_motion": _list(state.slides),
                "friction_work_mJ_per_mm": _finite(state.work),
            }
            for state in found.states
        ],
    }


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _list(values: Iterable[float]) -> list[float | None]:
    return [_finite(value) for value in values]
