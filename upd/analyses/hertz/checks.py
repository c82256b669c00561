"""Self-checks of a run: each number against its limit, with the remedy. One per line of physics the solver must not break."""

from __future__ import annotations

import numpy as np

from upd.analyses.contact.plan import NORMAL
from upd.analyses.hertz.solve import Cycle, HertzSolution, NormalCase, TangentialCase
from upd.contact.normal import NormalContact
from upd.reference import dundurs_beta
from upd.results import Check
from upd.scene import STATIC_WANTS

_EPS = float(np.finfo(float).eps)


def check_solution(solution: HertzSolution) -> list[Check]:
    """All self-checks; the ones that replace a left-out effect carry the name the plan gives them."""
    checks = []
    for case in solution.normal:
        checks += _normal_checks(solution, case)
    for t in solution.tangential:
        checks.append(_coulomb(solution, t))
    for cycle in solution.cycles:
        checks.append(_loop(cycle))
    checks += _left_out(solution)
    if solution.no_shares:
        checks.append(Check("body compression", "", 1, 0, solution.no_shares, "use a larger or finer body", fatal=False))
    made = {c.name for c in checks}
    return checks + [
        Check(e.check, "", 1, 0, f"the check of {e.name} was not made", "report this scene")
        for e in solution.plan.effects
        if e.check and not e.on and e.check not in made
    ]


def rim_check(solution: HertzSolution, case: NormalCase) -> Check:
    """The contact must stay clear of the rim of the potential patch: beyond it nothing stops the bodies from overlapping."""
    patch, force = solution.model.patch, case.force
    rim = np.concatenate([force[0], force[-1], force[:, 0], force[:, -1]])
    half = 0.5 * min(np.ptp(patch.X), np.ptp(patch.Y))
    touched = int((rim > 0.0).sum())
    # The gap gives the radius of curvature, h = r^2 / 2R at the rim; a flat patch (to rounding of its coordinates) has none.
    gap = patch.whole(solution.model.gap)
    corner = float(gap[0, len(patch.Y) // 2] - gap.min())
    if corner <= 1e-9 * half:
        return Check("patch rim", case.label, 0, 0, "the contact is flat: its rim belongs to it")
    radius = half**2 / (2.0 * corner)
    needed = 2.6 * float(np.cbrt(0.75 * case.load * radius / solution.modulus))
    return Check(
        "patch rim", case.label, touched, 0, "rim nodes in contact",
        f"the contact reaches the rim of the {2 * half:.4g} mm patch: set geometry.patch to \"{needed:.3g} mm\" or more, or to \"auto\"",
    )  # fmt: skip


def _normal_checks(solution: HertzSolution, case: NormalCase) -> list[Check]:
    s: NormalContact = case.solution
    n = len(s.force)
    checks = [rim_check(solution, case)]
    if case.load > 0.0:
        scale = _EPS * n * max(abs(s.approach), float(np.abs(solution.model.gap).max()))
        checks += [
            Check("reaction", case.label, _reaction_error(solution, case), 1e-8, "|reaction of the distant set - sum of forces| / F",
                  "the linear solve lost accuracy: try solver.name = \"superlu\" and report the mesh"),
            Check("no tension", case.label, float(max(0.0, -s.force.min())) / case.load, 0.0, "largest tensile force / F", "report this"),
            Check("no penetration", case.label, float(max(0.0, -s.gap.min())), 64.0 * scale, "largest penetration, mm", "report this"),
            Check("resolution", case.label, 3.0 * solution.model.patch.spacing / max(case.measures.radius_moment, 1e-300), 1.0,
                  "3 h / a (a contact radius, h node spacing)",
                  f"fewer than 3 nodes along the contact radius, so the numbers of this load are rough: set geometry.patch to "
                  f"\"auto\" or geometry.divisions to {_divisions(solution, case)} or more", fatal=False),
        ]  # fmt: skip
    return checks


def _divisions(solution: HertzSolution, case: NormalCase) -> int:
    patch = solution.model.patch
    width = float(np.ptp(patch.X))
    return int(2 * np.ceil(1.5 * width / max(case.measures.radius_moment, 0.1 * patch.spacing)))


def _reaction_error(solution: HertzSolution, case: NormalCase) -> float:
    if not case.reaction:
        return abs(float(case.force.sum()) / case.load - 1.0)
    return max(abs(r / case.load - 1.0) for r in case.reaction.values())


def _coulomb(solution: HertzSolution, t: TangentialCase) -> Check:
    limit = solution.plan.scene.contact.friction * t.normal.force
    force = t.traction * (solution.model.patch.area()[..., None] if t.traction.ndim == 3 else solution.model.patch.area())
    size = np.linalg.norm(force, axis=-1) if force.ndim == 3 else np.abs(force)
    excess = float((size - limit).max()) / float(limit.max())
    return Check("Coulomb limit", t.label, max(0.0, excess), 1e-10, "largest (|t| - mu f) / max(mu f)", "report this case")


def _loop(cycle: Cycle) -> Check:
    error = abs(cycle.loop_area / cycle.slip_work - 1.0) if cycle.slip_work else abs(cycle.loop_area)
    return Check(
        "loop area", cycle.label, error, 1e-2, "|loop area / slip work - 1|",
        "the loop is drawn with too few steps: raise loads.cycle_steps",
    )  # fmt: skip


def _left_out(solution: HertzSolution) -> list[Check]:
    plan = solution.plan
    scene = plan.scene
    upper, lower = (scene.materials[b.name] for b in (solution.model.upper, solution.model.lower))
    effects = {e.name: e for e in plan.effects}
    checks = []
    if not effects["friction"].on:
        families = sum(any(c != NORMAL for c in f.components) for f in plan.families)
        checks.append(Check("no tangential force", "", families, 0, "tangential families condensed", "report this scene"))
    else:
        beta = abs(float(dundurs_beta(upper.E, upper.nu, lower.E, lower.nu)))
        checks.append(
            Check("Dundurs beta", "", beta, scene.contact.coupling_limit, "|beta|: how much normal pressure shears unlike bodies",
                  "normal and tangential problems are coupled for these materials: raise contact.coupling_limit to accept the error, "
                  "or set contact.friction = 0")
        )  # fmt: skip
        if not effects["load history"].on:
            checks.append(Check("first loading", "", _against(solution), 0.0, "slip against the load / largest slip", "report this scene"))
        if not effects["slip in two directions"].on:
            worst = max(solution.transverse.values(), default=0.0)
            checks.append(
                Check("transverse slip", "", worst, scene.contact.transverse_limit, "motion across the load / slip along it",
                      "slip across the load is not small: set contact.directions = 2")
            )  # fmt: skip
    if not effects["mirror symmetry"].on:
        checks += [
            Check("symmetric pressure", c.label, _asymmetry(c), 1e-6, "|f - mirrored f| / max f", "the mesh or the load is not symmetric")
            for c in solution.normal if c.load > 0.0
        ]  # fmt: skip
    dynamic = [w for w in scene.want if w not in STATIC_WANTS]
    checks.append(Check("static outputs", "", len(dynamic), 0, "outputs that need inertia", f"leave out {', '.join(dynamic)}"))
    if scene.sphere_radius is not None:
        ratio = max(c.measures.radius_outermost for c in solution.normal) / scene.sphere_radius
        checks.append(
            Check("contact radius against sphere", "", ratio, 0.2, "outermost contact node / sphere radius",
                  "the contact is too large for small-displacement theory: lower the load")
        )  # fmt: skip
    else:
        checks.append(
            Check("slope in the contact", "", _slope(solution), 0.2, "steepest slope of the gap where the bodies touch",
                  "the contact reaches where the faces are too steep for small-displacement theory: lower the load")
        )  # fmt: skip
    return checks


def _slope(solution: HertzSolution) -> float:
    """Steepest slope of the undeformed gap at the nodes in contact, over all loads; a / R for a sphere."""
    patch = solution.model.patch
    gap = patch.whole(solution.model.gap)
    steepness = np.hypot(*np.gradient(gap, patch.X, patch.Y))
    touching = [steepness[case.force > 0.0] for case in solution.normal]
    return max((float(s.max()) for s in touching if s.size), default=0.0)


def _against(solution: HertzSolution) -> float:
    """Largest slip against the load relative to the largest slip, over all tangential loads: none in a first loading."""
    worst = 0.0
    for t in solution.tangential:
        slip = t.slip[..., 0] if t.slip.ndim == 3 else t.slip
        slipping = (t.normal.force > 0.0) & ~t.stick
        if slipping.any() and np.abs(slip[slipping]).max() > 0.0:
            worst = max(worst, float((-slip[slipping]).max() / np.abs(slip[slipping]).max()))
    return max(0.0, worst)


def _asymmetry(case: NormalCase) -> float:
    f = case.force
    return float(max(np.abs(f - f[::-1]).max(), np.abs(f - f[:, ::-1]).max()) / f.max())
