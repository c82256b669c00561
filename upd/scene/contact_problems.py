"""What does not fit together in the scene of a contact."""

from __future__ import annotations

from collections import Counter

from upd.errors import InputError
from upd.mesh import recipes
from upd.scene.contact import CONTACT_WANTS, LawChoice, Scene


def contact_problems(scene: Scene) -> list[str]:
    """What does not fit together."""
    problems = []
    for name, values in (("normal", scene.loads.normal), ("tangential", scene.loads.tangential)):
        labels = [v if isinstance(v, str) else f"{v:g}" for v in values]
        problems += [
            f"loads.{name}: {label} is duplicated (to six digits)"
            for label in sorted(x for x, times in Counter(labels).items() if times > 1)
        ]
    problems += _analysis_checks(scene)
    if scene.wanted_accuracy is None and scene.geometry.get("divisions") == "auto":
        problems.append('geometry.divisions: "auto" needs an accuracy, for example "1 %"')
    return problems


def _analysis_checks(scene: Scene) -> list[str]:
    """What the analysis of the scene's recipe does not know."""
    try:
        kind = recipes.analysis(scene.recipe)
    except InputError:
        # Told already, as a problem of geometry.recipe.
        return []
    if kind not in CONTACT_WANTS:
        return [
            f"geometry.recipe: its ANALYSIS is {kind!r}; write one of "
            f"{', '.join(CONTACT_WANTS)}, rig"
        ]
    known = CONTACT_WANTS[kind]
    problems = [
        f"want: {w!r} is no output of a {kind}; choose among {', '.join(known)}"
        for w in scene.want
        if w not in known
    ]
    words = [v for v in scene.loads.normal if isinstance(v, str)]
    if kind == "flat contact":
        names = [f"{d % 360.0:g} deg" for d in scene.loads.directions]
        problems += [
            f"loads.directions: {d} is duplicated"
            for d in sorted({d for d in names if names.count(d) > 1})
        ]
        if words and scene.loads.centrifugal == 0.0:
            problems.append(
                f"loads.centrifugal: 0 N presses nothing together, so {words[0]!r} has no answer; "
                'give the force at speed, for example "350 N"'
            )
        problems += [
            "loads.normal: 0 N presses nothing together; give a positive force"
            for load in scene.loads.normal
            if load == 0.0
        ]
        if scene.loads.curve_to is not None and scene.loads.curve_to == 0.0:
            problems.append("loads.curve_to: 0 N gives no curve; give a positive force")
        if words and scene.loads.centrifugal is None:
            problems.append(
                f"loads.normal: {words[0]!r} needs loads.centrifugal, the centrifugal "
                "force on the damper"
            )
        return problems
    if words:
        problems.append(
            f"loads.normal: {words[0]!r} is for flat damper faces; give a force with its unit"
        )
    plain = (
        ("loads.centrifugal", scene.loads.centrifugal is not None),
        ("loads.speed", scene.loads.speed is not None),
        ("loads.directions", scene.loads.directions != (0.0,)),
        ("loads.curve_to", scene.loads.curve_to is not None),
        ("contact.tilt", scene.contact.tilt != "held"),
        ("contact.load_point", scene.contact.load_point is not None),
        ("contact.distant", bool(scene.contact.distant)),
        ("law", scene.law != LawChoice()),
    )
    return problems + [
        f"{where}: has no meaning for a {kind}; remove it" for where, given in plain if given
    ]
