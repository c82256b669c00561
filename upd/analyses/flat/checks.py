"""Self-checks of a flat contact: each number against its limit, with the remedy."""

from __future__ import annotations

import numpy as np

from upd.analyses.contact.plan import NORMAL
from upd.analyses.flat.maps import centre_of_force, lattices
from upd.analyses.flat.solve import FlatSolution, NormalCase, TangentialCase, contact_points_of, direction_name, load_point
from upd.reference import dundurs_beta
from upd.results import Check
from upd.scene import STATIC_WANTS

_EPS = float(np.finfo(float).eps)


def check_solution(solution: FlatSolution) -> list[Check]:
    """All self-checks; the ones that replace a left-out effect carry the name the plan gives them."""
    checks = [check for case in solution.normal if case.force > 0.0 for check in _normal_checks(solution, case)]
    checks += [_coulomb(solution, t) for t in solution.tangential]
    checks += [
        Check("loop area", p.label, abs(p.loop_area / p.slip_work - 1.0) if p.slip_work else p.loop_area, 1e-2,
              "|loop area / slip work - 1|", "the loop is drawn with too few steps: raise loads.cycle_steps")
        for p in solution.paths if p.cycle
    ]  # fmt: skip
    checks += _left_out(solution)
    made = {c.name for c in checks}
    return checks + [
        Check(e.check, "", 1, 0, f"the check of {e.name} was not made", "report this scene")
        for e in solution.plan.effects
        if e.check and not e.on and e.check not in made
    ]


def _normal_checks(solution: FlatSolution, case: NormalCase) -> list[Check]:
    s = case.solution
    n, total = len(s.force), case.force / solution.plan.copies
    scale = _EPS * n * max(abs(s.approach), float(np.abs(solution.model.gap).max()))
    reactions = [abs(r / case.force - 1.0) for r in case.reaction.values()] or [abs(float(s.force.sum()) / total - 1.0)]
    checks = [
        Check("opening", case.label, case.n_open, n, "open nodes; without any the linear answer is exact"),
        Check("reaction", case.label, max(reactions), 1e-8, "|reaction of the distant set - sum of forces| / F",
              'the linear solve lost accuracy: try solver.name = "superlu" and report the mesh'),
        Check("no tension", case.label, float(max(0.0, -s.force.min())) / case.force, 0.0, "largest tensile force / F", "report this"),
        Check("no penetration", case.label, float(max(0.0, -s.gap.min())), 64.0 * scale, "largest penetration, mm", "report this"),
    ]  # fmt: skip
    if case.tilted is not None:
        size = float(np.ptp(contact_points_of(solution.model)[:, :2], axis=0).max())
        moment = float(np.abs(case.tilted.moment).max()) / (case.force * size)
        checks.append(Check("moment balance", case.label, moment, 1e-8, "moment about the load line / (F patch length)", "report this"))
    return checks


def _coulomb(solution: FlatSolution, t: TangentialCase) -> Check:
    limit = solution.plan.scene.contact.friction * t.normal.solution.force
    excess = float((np.linalg.norm(t.force, axis=1) - limit).max()) / float(limit.max())
    return Check("Coulomb limit", t.label, max(0.0, excess), 1e-10, "largest (|t| - mu f) / max(mu f)", "report this case")


def _left_out(solution: FlatSolution) -> list[Check]:
    scene = solution.plan.scene
    loaded = [case for case in solution.normal if case.force > 0.0]
    effects = {e.name: e.on for e in solution.plan.effects}
    checks = []
    if not effects["tilt of the damper"]:
        checks += [_held_tilt(solution, case) for case in loaded] or [Check("held tilt", "", 0, 1.0, "no load, no moment")]
    if not effects["friction"]:
        families = sum(any(c != NORMAL for c in f.components) for f in solution.plan.families)
        checks.append(Check("no tangential force", "", families, 0, "tangential families condensed", "report this scene"))
    else:
        checks += _friction_checks(solution)
    dynamic = [w for w in scene.want if w not in STATIC_WANTS]
    checks.append(Check("static outputs", "", len(dynamic), 0, "outputs that need inertia", f"leave out {', '.join(dynamic)}"))
    size = min(float(np.ptp(lines)) for k in lattices(solution) for lines in (k.X, k.Y))
    ratio = max((case.solution.approach for case in loaded), default=0.0) / size
    remedy = "too large for small-displacement theory: lower the load"
    return [*checks, Check("approach against patch", "", ratio, 1e-2, "approach / shorter edge of the patch", remedy)]


def _held_tilt(solution: FlatSolution, case: NormalCase) -> Check:
    """The held tilt takes a moment: how far the contact's resultant is from the load line, in halves of the contact's extent."""
    away = np.abs(centre_of_force(solution, case) - load_point(solution))
    if 0 in solution.plan.mirrors:
        away[0] = 0.0
    half = 0.5 * np.array([max(k.X[-1] for k in lattices(solution)) - min(k.X[0] for k in lattices(solution)),
                           max(k.Y[-1] for k in lattices(solution)) - min(k.Y[0] for k in lattices(solution))])  # fmt: skip
    return Check(
        "held tilt", case.label, float((away / half).max()), 1.0, "distance of the resultant from the load line / half the contact",
        'the support takes a large moment: choose another contact.distant set, or set contact.tilt = "free" with a '
        "contact.load_point inside the contact",
        fatal=False,
    )  # fmt: skip


def _friction_checks(solution: FlatSolution) -> list[Check]:
    scene, model = solution.plan.scene, solution.model
    upper, lower = (scene.materials[b.name] for b in (model.upper, model.lower))
    effects = {e.name: e.on for e in solution.plan.effects}
    checks = [
        Check("Dundurs beta", "", abs(float(dundurs_beta(upper.E, upper.nu, lower.E, lower.nu))), scene.contact.coupling_limit,
              "|beta|: how much normal pressure shears unlike bodies",
              "normal and tangential problems are coupled for these materials: raise contact.coupling_limit to accept the error, "
              "or set contact.friction = 0")
    ]  # fmt: skip
    checks += [
        Check("pressure moved by shear", _case(key), value, 0.5, "sum |df| / 2 F at T = mu N",
              "gross slip would move much of the pressure: trust the first loading only", fatal=False)
        for key, value in solution.moved.items()
    ]  # fmt: skip
    if not solution.moved:
        unseen = sum(case.force > 0.0 for case in solution.normal)
        says, remedy = "loaded cases sheared along x alone, on half the model: not measured", 'set mesh.symmetry = "full" to measure it'
        checks.append(Check("pressure moved by shear", "", unseen, 0, says, remedy, fatal=False))
    if not effects["slip in two directions"]:
        checks += [] if solution.transverse else [Check("transverse motion", "", 0, scene.contact.transverse_limit, "no load, no motion")]
        checks += [
            Check("transverse motion", _case(key), value, scene.contact.transverse_limit, "motion across the load / along it, all stuck",
                  "slip across the load is not small: set contact.directions = 2", fatal=False)
            for key, value in solution.transverse.items()
        ]  # fmt: skip
    return checks


def _case(key: tuple[str, float]) -> str:
    return f"{key[0]} T_{direction_name(key[1])}"
