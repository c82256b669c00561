"""Self-checks of a forced response: path complete, energy balance, harmonics and samples left out, damper at rest on its contacts."""

from __future__ import annotations

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.model import ALONG_MATTERS, SIDES
from upd.analyses.forced.solve import Case, ForcedSolution
from upd.hbm.response import ALIASING, TRUNCATION
from upd.results import Check

#: largest imbalance of work and losses over a cycle, and of static forces on the damper: far above the solver's tolerance
_BALANCE = 1e-6
#: largest contact motion by harmonics left out, and difference of a time march, before a warning
_LEFT_OUT, _MARCH = 10.0 * TRUNCATION, 5e-3
#: share of the cycle that a whole face may be lifted off
_OPEN = 0.9
#: largest difference of a law's two tangential stiffnesses, relative to their mean
_ANISOTROPY = 0.2


def check_solution(solution: ForcedSolution) -> list[Check]:
    """All self-checks. None ends the run: a curve that stopped early is kept and told."""
    checks: list[Check] = []
    for case in solution.cases:
        checks.append(_path(case))
        if not case.empty:
            checks += _case_checks(solution, case)
    for case, f, height, found in solution.marches:
        marched = 1e-3 * (2 * np.pi * f) ** 2 * found.amplitude(solution.models[case.stiffness].row("right")) / case.force
        says = "|time march / harmonic balance - 1|"
        remedy = f"{found.message}; take more harmonics (balance.harmonics), or points that stay stuck remember another slider start"
        checks.append(Check("time march", f"{case.label}, {f:g} Hz", abs(marched / height - 1.0), _MARCH, says, remedy, fatal=False))
    for name, curve in solution.performances.items():
        for branch in curve.branches:
            remedy = f"{branch.message}. What was found is kept; bring performance.lowest and highest nearer to the scene's F_C/F_E"
            checks.append(Check("performance complete", f"{name}, {branch.name}", float(not branch.complete), 0, "curves stopped early",
                                remedy, fatal=False))  # fmt: skip
    for name, model in solution.models.items():
        if model.contacts.tangents < 2 and model.along is not None:
            checks.append(Check("sliding along y", name, model.along, ALONG_MATTERS, "relative change of the stuck frequencies by it",
                                'it matters here: contact.directions = "two"', fatal=False))  # fmt: skip
        for side in SIDES:
            value = model.laws[side].anisotropy
            if value is not None:
                remedy = "the answer along y and up the slope shares one k_t; read it for the direction that slides"
                checks.append(Check("k_t anisotropy", f"{name}, {side}", value, _ANISOTROPY, "|k_tx - k_ty| / mean", remedy, fatal=False))
    return checks


def _path(case: Case) -> Check:
    stopped = case.answer.status != "complete"
    remedy = f"{case.answer.message}. What was found is kept; fewer contact points, another balance.slider or a lower start may go further"
    return Check("path complete", case.label, float(stopped), 0, "curves that stopped early", remedy, fatal=False)


def _case_checks(solution: ForcedSolution, case: Case) -> list[Check]:
    answer, label = case.answer, case.label
    highest = answer.harmonics.highest
    balance = float(np.abs(answer.energy_balance).max())
    rest = measures.rest_error(answer, solution.models[case.stiffness])
    return [
        Check("energy balance", label, balance, _BALANCE, "|work - viscous loss - friction| / work", "report this scene", fatal=False),
        Check("damper at rest", label, rest, _BALANCE, "|mean contact forces - F_C| / F_C", "report this scene", fatal=False),
        Check("truncation", label, float(answer.truncation.max()), _LEFT_OUT, f"contact motion by harmonics above {highest}, relative",
              'take more: balance.harmonics = 3, 5, ... or "adaptive"', fatal=False),
        Check("aliasing", label, float(answer.aliasing.max()), ALIASING, "contact force with twice the samples, relative change",
              "take more samples: balance.samples", fatal=False),
        _face_open(solution, case),
    ]  # fmt: skip


def _face_open(solution: ForcedSolution, case: Case) -> Check:
    """A face that carries nothing over the whole path: the stuck answer is then never reached."""
    model, answer = solution.models[case.stiffness], case.answer
    lift = {side: float(share[:, 2].max()) for side, share in measures.shares(answer, model).items()}
    side = max(lift, key=lambda s: lift[s])
    remedy = (
        f"the {side} face opens over the cycle; on an asymmetric damper friction above tan(slope) lets one face carry it alone: "
        "lower contact.friction, or start the sliders elsewhere (balance.slider)"
    )
    return Check("both faces carry", case.label, lift[side], _OPEN, "largest share of a face lifted off", remedy, fatal=False)
