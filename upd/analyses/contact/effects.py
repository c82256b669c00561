"""Effects of a contact: their names, why one is simulated or left out, what to do about it."""

from __future__ import annotations

from collections.abc import Iterable

from upd.analyses.base import Effect, Resolved
from upd.reference import dundurs_beta
from upd.results import Check
from upd.scene import Scene

TILT, DIRECTIONS, COUPLING, MATERIALS, LARGE = (
    "tilt of the damper",
    "slip in two directions",
    "normal-tangential coupling",
    "unlike materials",
    "large displacement",
)

#: why coupled contact slips in two directions
TOGETHER = "pressure and shear are solved at once"
#: Numbers that show what coupling changes: of them those that a run has.
COUPLED_NUMBERS = (
    "K_N_tangent_raw",
    "K_T_initial_raw",
    "K_Tx_initial_raw",
    "K_Ty_initial_raw",
    "contact_area",
    "stick_area",
)

#: What to do about an effect that changes a number too much.
REMEDIES = {
    TILT: 'set contact.tilt = "free" (with a contact.load_point inside the contact), or choose '
    "another contact.distant set",
    DIRECTIONS: "set contact.directions = 2",
    COUPLING: 'set contact.coupling = "coupled", or trust the number to this change only',
    MATERIALS: 'the pressure shears these materials: set contact.coupling = "coupled", choose '
    "materials of equal stiffness, or trust the number to this change only",
    LARGE: "the contact is too large for small-displacement theory: lower the load",
}


#: The same of a damper that tips over when its tilt is free.
TIPS = (
    "the load line runs beside the contact, so that a damper free to tilt tips over: give a "
    "contact.load_point inside the contact, or choose another contact.distant set"
)


def checks_of(found: Iterable[Resolved], scene: Scene) -> list[Check]:
    """One check per number that was solved again."""
    return [one.check(scene.left_out, REMEDIES[one.effect]) for one in found]


def beta_of(scene: Scene) -> float:
    """Size of Dundurs' beta of the scene's two materials: how far pressure shears the contact."""
    first, second = list(scene.materials.values())[:2]
    return abs(float(dundurs_beta(first.E, first.nu, second.E, second.nu)))


def largest_ratio(scene: Scene) -> float:
    """Largest T / (mu N) of the tangential loads asked for; zero without any."""
    return max(scene.loads.tangential, default=0.0) if scene.wants("tangential") else 0.0


def omitted(name: str, why: str, *switch: str, applies: bool) -> Effect:
    """An effect left out, with its check where it applies."""
    return Effect(name, False, why, name if applies else "", switch, applies)


def coupling_effects(scene: Scene, loaded: bool) -> list[Effect]:
    """Normal-tangential coupling, and what of it the difference of the materials makes.

    Parameters
    ----------
    loaded
        Whether any normal load presses the bodies.
    """
    beta = beta_of(scene)
    unlike = beta > 0.0 and (scene.wants("cycle") or largest_ratio(scene) > 0.0)
    why = (
        "beta = 0: pressure alone does not shear the contact"
        if not beta > 0.0
        else f"|beta| = {beta:.3g}: the shear of the pressure alone is not simulated"
        if unlike
        else "no output depends on the shear of the pressure alone"
    )
    if scene.coupled:
        return [
            Effect(COUPLING, True, "asked for", applies=loaded),
            Effect(MATERIALS, unlike, TOGETHER if unlike else why, applies=unlike and loaded),
        ]
    frozen = "normal forces stay frozen under shear: exact for half-spaces of like materials alone"
    if scene.contact.friction > 0.0 and beta > scene.contact.coupling_limit:
        frozen += (
            f"; |beta| = {beta:.3g} is above contact.coupling_limit = "
            f"{scene.contact.coupling_limit:.3g}: set contact.coupling = coupled"
        )
    return [
        omitted(
            COUPLING,
            frozen,
            "contact.coupling=coupled",
            applies=loaded,
        ),
        omitted(MATERIALS, why, applies=unlike and loaded),
    ]
