"""Self-checks that every contact of two bodies has.

Balance, one-sided contact, Coulomb's limit, what the effects left out stand on.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.loading import LoadPath
from upd.analyses.contact.plan import NORMAL, ContactPlan
from upd.contact.model import ContactModel
from upd.contact.normal import NormalContact
from upd.reference import dundurs_beta
from upd.results import NO_CASE, Case, Check
from upd.scene import STATIC_WANTS, Scene

Array = NDArray[np.float64]
_EPS = float(np.finfo(float).eps)


def normal_checks(
    case: Case,
    load: float,
    answer: NormalContact,
    gap: Array,
    carried: float,
    reaction: Mapping[str, float],
) -> list[Check]:
    """Balance of forces, no tension and no penetration under one normal load.

    Parameters
    ----------
    load
        N on the whole contact.
    gap
        (n,) mm before the load.
    carried
        Sum of the contact forces in N, compared with the load where no reactions are known.
    reaction
        Body -> N on its distant set.
    """
    scale = _EPS * len(answer.force) * max(abs(answer.approach), float(np.abs(gap).max()))
    balance = max(
        (abs(r / load - 1.0) for r in reaction.values()), default=abs(carried / load - 1.0)
    )
    return [
        Check(
            "reaction",
            case,
            balance,
            1e-8,
            "|reaction of the distant set - sum of forces| / F",
            'the linear solve lost accuracy: try solver.name = "superlu" and report the mesh',
        ),
        Check(
            "no tension",
            case,
            float(max(0.0, -answer.force.min())) / load,
            0.0,
            "largest tensile force / F",
            "report this",
        ),
        Check(
            "no penetration",
            case,
            float(max(0.0, -answer.gap.min())),
            64.0 * scale,
            "largest penetration, mm",
            "report this",
        ),
    ]


def coulomb_check(case: Case, size: Array, limit: Array) -> Check:
    """Tangential forces of ``size`` in N against mu times the normal forces, any shape."""
    excess = float((size - limit).max()) / float(limit.max())
    return Check(
        "Coulomb limit",
        case,
        max(0.0, excess),
        1e-10,
        "largest (|t| - mu f) / max(mu f)",
        "report this case",
    )


def loop_check(path: LoadPath) -> Check:
    """Area of a cycle's loop against the work of slip."""
    error = abs(path.loop_area / path.slip_work - 1.0) if path.slip_work else path.loop_area
    remedy = "the loop is drawn with too few steps: raise loads.cycle_steps"
    return Check("loop area", path.case, error, 1e-2, "|loop area / slip work - 1|", remedy)


def frictionless_check(plan: ContactPlan) -> Check:
    """Without friction nothing tangential was condensed."""
    families = sum(any(c != NORMAL for c in f.components) for f in plan.families)
    return Check(
        "no tangential force",
        NO_CASE,
        families,
        0,
        "tangential families condensed",
        "report this scene",
    )


def coupling_check(scene: Scene, model: ContactModel) -> Check:
    """How far the materials are from shearing a contact of half-spaces by pressure alone.

    Bodies of finite shape couple the two problems whatever their materials: nearly not at all
    where the contact is small against both, much where it is as large as they are.
    """
    upper, lower = (scene.materials[b.name] for b in (model.upper, model.lower))
    beta = abs(float(dundurs_beta(upper.E, upper.nu, lower.E, lower.nu)))
    return Check(
        "Dundurs beta",
        NO_CASE,
        beta,
        scene.contact.coupling_limit,
        "|beta|: how much pressure shears half-spaces of unlike materials",
        "normal and tangential problems are coupled for these materials: raise "
        "contact.coupling_limit to accept the error, "
        "or set contact.friction = 0",
    )


def static_check(scene: Scene) -> Check:
    """No output needs inertia, which is left out."""
    dynamic = [w for w in scene.want if w not in STATIC_WANTS]
    return Check(
        "static outputs",
        NO_CASE,
        len(dynamic),
        0,
        "outputs that need inertia",
        f"leave out {', '.join(dynamic)}",
    )


def with_missing(plan: ContactPlan, checks: Sequence[Check]) -> list[Check]:
    """The checks, and a failed one for every effect left out whose check was not made."""
    return [*checks, *_missing(plan, {c.name for c in checks})]


def _missing(plan: ContactPlan, made: set[str]) -> Iterable[Check]:
    for effect in plan.effects:
        if effect.check and not effect.on and effect.check not in made:
            yield Check(
                effect.check,
                NO_CASE,
                1,
                0,
                f"the check of {effect.name} was not made",
                "report this scene",
            )
