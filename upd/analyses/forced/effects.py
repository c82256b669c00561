"""Effects of a forced response: what is simulated, what is left out, and the check of each."""

from __future__ import annotations

from upd.analyses.base import Effect
from upd.analyses.centrifugal import centrifugal_effects
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.faces_cost import harmonics_effect
from upd.scene import ForcedScene

#: checks of what is left out; each solves a number again with the effect
ALONG = "sliding along y"
ELASTIC = "elastic damper"


def effects_of_points(scene: ForcedScene) -> list[Effect]:
    """Of contact by springs at points."""
    mu, b, c = scene.contact.friction, scene.balance, scene.contact
    adaptive, swept = b.harmonics == "adaptive", b.method == "march"
    samples = "power of two by rule" if b.samples == "auto" else f"{b.samples} a period"
    whole = scene.mesh.symmetry == "full"
    return [
        Effect(
            "friction",
            mu > 0.0,
            f"Coulomb, mu = {mu:g}; a curve stuck everywhere is answered linearly"
            if mu
            else "mu = 0",
            applies=mu > 0.0,
        ),
        _along(scene),
        Effect(
            "motion odd about y = 0",
            whole,
            "the full model"
            if whole
            else "rig, load and contact are even about y = 0: an even motion excites no odd one",
            applies=whole,
        ),
        _excited(scene),
        Effect("lift-off", True, "every point may open: N = max(0, k_n w)"),
        Effect("static balance", True, f"mean positions are unknowns; {_static_words(scene)}"),
        Effect(
            "blades spread by F_C",
            not c.loaded,
            f"the faces fit each other {'under F_C, worn in' if c.loaded else 'without load'}",
            applies=not c.loaded,
        ),
        Effect("damper inertia", True, "rigid body; mass and inertia from its mesh"),
        Effect(
            "harmonics",
            True,
            "all: time integration"
            if swept
            else "as many as matter, up to 31"
            if adaptive
            else f"0 to {b.harmonics}; {samples} samples",
            "" if swept else "more harmonics",
        ),
        Effect(
            "damper elasticity",
            False,
            "in the contact stiffness; the body moves rigidly",
            ELASTIC if scene.left_out.solves else "",
        ),
        Effect("modes above", False, f"{scene.reduction.modes} modes a blade, static remainder"),
        *centrifugal_effects(scene),
    ]


def effects_of_faces(scene: ForcedScene) -> list[Effect]:
    """Of contact by all nodes of both faces."""
    mu, c = scene.contact.friction, scene.contact
    whole = scene.mesh.symmetry == "full"
    return [
        Effect(
            "friction",
            mu > 0.0,
            f"Coulomb, mu = {mu:g}, both directions, every node of both faces" if mu else "mu = 0",
            applies=mu > 0.0,
        ),
        Effect("normal and tangential coupling", True, "solved together at every step in time"),
        Effect(
            "motion odd about y = 0",
            whole,
            "the full model is marched" if whole else "load and bodies are even about it",
            applies=whole,
        ),
        _excited(scene),
        Effect("lift-off", True, "every node may open"),
        Effect("damper elasticity", True, "its deformation follows its forces statically"),
        Effect("damper inertia", True, "mass and inertia from its mesh"),
        Effect(
            "worn faces",
            c.worn > 0.0,
            f"worn in under F_C to {100.0 * c.worn:g} %"
            if c.worn
            else "flat faces that fit without load",
            applies=c.worn > 0.0,
        ),
        Effect("static balance", True, _static_words(scene), "static balance"),
        harmonics_effect(scene),
        *centrifugal_effects(scene),
    ]


def _excited(scene: ForcedScene) -> Effect:
    """Which blades the excitation acts on."""
    return Effect("excitation", True, f"{excitation_of(scene.excitation).words}, along x")


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
    why = (
        "left out where it changes the stuck frequencies by less than 0.1 %"
        if c.directions == "auto"
        else "asked for"
    )
    check = ALONG if scene.left_out.solves and scene.balance.method == "balance" else ""
    return Effect(name, False, why, check, ("contact.directions=two",), applies=c.friction > 0.0)
