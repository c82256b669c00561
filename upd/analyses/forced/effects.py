"""Effects of a forced response: what is simulated, what is left out, and the check of each."""

from __future__ import annotations

from upd.analyses.base import Effect
from upd.analyses.centrifugal import centrifugal_effects
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.faces_cost import harmonics_effect
from upd.scene import ForcedScene

#: checks of what is left out; each solves a number again with the effect
ALONG = "sliding along y"
ODD = "odd motion"
FIT = "faces that fit without load"
HARMONICS = "more harmonics"
SAMPLES = "twice the samples"
START = "other slider starts"
STATIC = "other static states"
TWO_K_T = "the softer k_t"
MODES = "more modes"
ELASTIC = "elastic damper"
#: harmonics and fixed-interface modes added to see what those left out would change
MORE_HARMONICS, MORE_MODES = 2, 10


def effects_of_points(scene: ForcedScene) -> list[Effect]:
    """Of contact by springs at points."""
    mu, b, c = scene.contact.friction, scene.balance, scene.contact
    adaptive = b.harmonics == "adaptive"
    samples = "power of two by rule" if b.samples == "auto" else f"{b.samples} a period"
    measured = any(s.from_contact for s in scene.stiffnesses.values())
    loaded, band = c.loaded, scene.wants("band")
    spread, other = band or scene.wants("spread"), "frictionless"
    if c.static == other:
        other = "opposing"
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
            scene.mesh.symmetry == "full",
            'mesh.symmetry = "full"'
            if scene.mesh.symmetry == "full"
            else "points and their mirror images move as one, where they come in pairs",
            ODD,
            ("mesh.symmetry=full",),
        ),
        _excited(scene),
        Effect("lift-off", True, "every point may open: N = max(0, k_n w)"),
        Effect(
            "static balance",
            True,
            "mean positions are unknowns beside the vibration",
            "damper at rest",
        ),
        Effect(
            "blades spread by F_C",
            not loaded,
            f"the faces fit each other {'under F_C, worn in' if loaded else 'without load'}",
            FIT if loaded else "",
            ("contact.fit=unloaded",) if loaded else (),
        ),
        Effect("damper inertia", True, "rigid body; mass and inertia from its mesh"),
        Effect(
            "harmonics",
            True,
            "as many as matter, up to 31" if adaptive else f"0 to {b.harmonics}",
            "energy balance",
        ),
        Effect(
            "harmonics above",
            False,
            "added only where they matter" if adaptive else "not asked for",
            HARMONICS,
            () if adaptive else (f"balance.harmonics={b.harmonics + MORE_HARMONICS}",),
        ),
        Effect("signal between samples", False, samples, SAMPLES),
        Effect(
            "other slider starts",
            spread,
            f"sliders start at {b.slider}; points that always stick remember it",
            "" if spread else START,
            () if spread else ("balance.slider=mid",),
        ),
        Effect(
            "two tangential stiffnesses",
            False,
            "one k_t a point, the mean of both directions" if measured else "one K_T is given",
            TWO_K_T if measured else "",
            applies=measured,
        ),
        Effect(
            "other static states",
            band,
            _static_words(scene),
            "" if band else STATIC,
            () if band else (f"contact.static={other}",),
            applies=loaded and mu > 0.0,
        ),
        Effect(
            "damper elasticity",
            False,
            "in the contact stiffness; the body moves rigidly",
            ELASTIC,
        ),
        Effect(
            "modes above",
            False,
            f"{scene.reduction.modes} fixed-interface modes a blade",
            MODES,
            (f"reduction.modes={scene.reduction.modes + MORE_MODES}",),
        ),
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
        "frictionless": "no friction before vibration",
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
    return Effect(name, False, why, ALONG, ("contact.directions=two",), applies=c.friction > 0.0)
