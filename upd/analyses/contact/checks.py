"""Self-checks that every contact of two bodies has.

Balance, one-sided contact, Coulomb's limit, the effects left out.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.coupled import as_normal, opened_by_shear, shear_nodes
from upd.analyses.contact.effects import beta_of, checks_of
from upd.analyses.contact.loading import LoadPath, Sheared, tangential_compliance, tilt_arms
from upd.analyses.contact.plan import NORMAL, ContactPlan
from upd.contact.model import ContactModel
from upd.contact.normal import NormalContact
from upd.results import NO_CASE, Case, Check
from upd.scene import Scene

Array = NDArray[np.float64]
_EPS, _TINY = float(np.finfo(float).eps), float(np.finfo(float).tiny)


def rounding(n: int) -> float:
    """Rounding level of a sum of n products and the handful of operations around it, that the
    checks allow.

    The contact solvers accept an answer at 4 (n + 10) eps and clip forces by as much; the product
    made again here leaves one more, and two directions double the terms.
    """
    return 20.0 * (n + 10) * _EPS


def normal_checks(
    case: Case,
    load: float,
    answer: NormalContact,
    compliance: Array,
    gap: Array,
    carried: float,
    reaction: Mapping[str, float],
    turned: Array | None = None,
) -> list[Check]:
    """Balance of forces, no tension, no penetration, and no force across a gap.

    Nothing the solver cleaned is used: the gap is made again from the compliance,
    g = h + C f - d e - T theta, and tension looks at the forces before they were clipped
    (K. L. Johnson, Contact Mechanics, 1985, section 5.9, for the conditions).

    Parameters
    ----------
    load
        N on the whole contact.
    compliance
        C (n, n), of both bodies, mm/N.
    gap
        h (n,) mm before the load.
    carried
        Sum of the contact forces on the whole contact, N.
    reaction
        Body -> N on its distant set, where that is known.
    turned
        T theta (n,) mm, what a free tilt adds to the approach.
    """
    f, limit = answer.force, rounding(len(answer.force))
    diagonal = np.diagonal(compliance)
    # |C_ij| <= sqrt(C_ii C_jj)
    row = np.sqrt(diagonal * diagonal.max())
    more = np.zeros(len(f)) if turned is None else turned
    scale = np.abs(gap) + abs(answer.approach) + np.abs(more) + row * float(np.abs(f).sum())
    g = (gap + compliance @ f - answer.approach - more) / scale
    allowed = limit * float((scale / row).max()) / load
    balance = max(abs(r / load - 1.0) for r in (carried, *reaction.values()))
    return [
        Check(
            "reaction",
            case,
            balance,
            1e-8,
            "|reaction of the distant set, or sum of the contact forces - F| / F",
            'the linear solve lost accuracy: try solver.name = "superlu" and report the mesh',
        ),
        Check(
            "no tension",
            case,
            float(max(0.0, -answer.unclipped.min())) / load,
            allowed,
            "largest tensile force / F, before clipping",
            "report this",
        ),
        Check(
            "no penetration",
            case,
            float(max(0.0, -g.min())),
            limit,
            "largest penetration h + C f - d / its terms",
            "report this",
        ),
        Check(
            "no force across a gap",
            case,
            float(np.abs(f) @ np.abs(g)) / float(np.abs(f).sum()),
            limit,
            "sum f |h + C f - d| / F, over its terms",
            "report this",
        ),
    ]


def tangential_checks(case: Case, model: ContactModel, t: Sheared) -> list[Check]:
    """Coulomb's law node by node, and the balance, after one tangential load step.

    The slip is made again from the compliance, dw = d - C t - w_before: none where a node sticks;
    where it slips |t| = mu f and dw = lambda t, lambda >= 0: largest dissipation
    (K. L. Johnson, Contact Mechanics, 1985, section 7.2).
    """
    n, k = len(t.loaded), len(t.components)
    C = tangential_compliance(model, t.components, t.loaded)
    allowed, diagonal = rounding(k * n), np.diagonal(C)
    force = t.force.reshape(k, n)
    row = np.sqrt(diagonal * diagonal.max())
    size = (
        np.repeat(np.abs(t.displacement), n)
        + np.abs(t.before)
        + t.terms
        + row * float(np.abs(t.force).sum())
        + diagonal * np.tile(t.limit, k)
    ).reshape(k, n)
    slip = (np.repeat(t.displacement, n) - C @ t.force - t.before).reshape(k, n)
    length = np.linalg.norm(force, axis=0)
    # Part of the slip that is not along the traction, or runs against it.
    along = np.maximum(0.0, (slip * force).sum(axis=0)) / np.maximum(length**2, _TINY)
    beside = np.abs(slip - along * force) / size
    largest, slips = float(t.limit.max()), ~t.stick
    force_allowed = allowed * float((size / diagonal.reshape(k, n)).max()) / largest
    remedy = "report this case"
    return [
        Check(
            "tangential balance",
            case,
            float(np.abs(force.sum(axis=1) - t.load).max() / t.limit.sum()),
            allowed,
            "|sum of tractions - T| / mu N",
            remedy,
        ),
        Check(
            "Coulomb limit",
            case,
            max(0.0, float((length - t.limit).max()) / largest),
            force_allowed,
            "largest (|t| - mu f) / max(mu f), before projection",
            remedy,
        ),
        Check(
            "slip at the limit",
            case,
            float(np.abs(length - t.limit)[slips].max(initial=0.0)) / largest,
            force_allowed,
            "largest ||t| - mu f| / max(mu f) where nodes slip",
            remedy,
        ),
        Check(
            "stick",
            case,
            float((np.abs(slip) / size)[:, t.stick].max(initial=0.0)),
            allowed,
            "largest slip d - C t / its terms where nodes stick",
            remedy,
        ),
        Check(
            "slip direction",
            case,
            float(beside[:, slips].max(initial=0.0)),
            allowed,
            "slip beside or against the traction / its terms",
            remedy,
        ),
    ]


def pressed_checks(
    plan: ContactPlan, model: ContactModel, case: Any, carried: float, tilted: Array | None = None
) -> list[Check]:
    """Of a normal load: `normal_checks`, and those of the shear that pressure alone makes.

    Parameters
    ----------
    case
        A normal load of a solution.
    carried
        Sum of the contact forces on the whole contact, N.
    tilted
        (n,) mm that a free tilt adds to the approach.
    """
    checks, turned = [], np.zeros(len(model.gap)) if tilted is None else tilted
    if case.state is not None:
        nodes = shear_nodes(model, plan.scene.contact.friction, case.state)
        checks = tangential_checks(case.case, model, nodes)
        turned = turned - opened_by_shear(model, case.state)
    C, load = model.compliance(NORMAL), case.case.load
    return [
        *checks,
        *normal_checks(
            case.case, load, case.solution, C, model.gap, carried, case.reaction, turned
        ),
    ]


def sheared_checks(plan: ContactPlan, model: ContactModel, t: Any) -> list[Check]:
    """Of a tangential load of a solution: `tangential_checks`, and where the pressure follows the
    shear `normal_checks` of the forces under it.
    """
    checks = tangential_checks(t.case, model, t.nodes)
    if t.state is None:
        return checks
    answer = as_normal(t.state, float("nan"))
    turned = -opened_by_shear(model, t.state)
    if t.state.motion[3:].size:
        turned = turned + tilt_arms(plan, model) @ t.state.motion[3:]
    C, carried = model.compliance(NORMAL), float(answer.unclipped.sum())
    load = t.normal.case.load
    return [
        *checks,
        *normal_checks(t.case, load, answer, C, model.gap, carried, {}, turned),
    ]


def loop_check(path: LoadPath) -> Check:
    """Area of a cycle's loop against the work of slip."""
    error = abs(path.loop_area / path.slip_work - 1.0) if path.slip_work else path.loop_area
    remedy = "the loop is drawn with too few steps: raise loads.cycle_steps"
    return Check("loop area", path.case, error, 1e-2, "|loop area / slip work - 1|", remedy)


def left_out_checks(solution: Any) -> list[Check]:
    """Of the effects left out of a solution."""
    plan, scene = solution.plan, solution.plan.scene
    checks = checks_of(solution.left_out, scene)
    if plan.effect("friction") and not scene.coupled:
        checks.append(_coupling_check(scene))
    return checks


def _coupling_check(scene: Scene) -> Check:
    """How far the materials are from shearing a contact of half-spaces by pressure alone.

    Bodies of finite shape couple the two problems whatever their materials: nearly not at all
    where the contact is small against both, much where it is as large as they are.
    """
    return Check(
        "Dundurs beta",
        NO_CASE,
        beta_of(scene),
        scene.contact.coupling_limit,
        "|beta|: how much pressure shears half-spaces of unlike materials",
        "normal and tangential problems are coupled for these materials: raise "
        "contact.coupling_limit to accept the error, "
        "or set contact.friction = 0",
    )


def with_missing(plan: ContactPlan, checks: Sequence[Check]) -> list[Check]:
    """The checks, and a failed one for every effect left out whose check was not made."""
    return [*checks, *_missing(plan, {c.name for c in checks})]


def _missing(plan: ContactPlan, made: set[str]) -> Iterable[Check]:
    for effect in plan.effects if plan.scene.left_out.solves else ():
        if effect.check and effect.word == "no" and effect.check not in made:
            yield Check(
                effect.check,
                NO_CASE,
                1,
                0,
                f"the check of {effect.name} was not made",
                "report this scene",
            )
