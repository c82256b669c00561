"""Every self-check of the modal analysis and the forced response can fail.

One answer is solved, one thing in it is spoiled, and the check that watches it must not pass.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from upd.analyses import forced, make_plan, modal
from upd.analyses.base import Resolved
from upd.analyses.forced.curves import both_ways
from upd.analyses.forced.interface_model import by_coulomb, make_springs
from upd.analyses.forced.measures import accelerance, residual_error
from upd.analyses.forced.performance import Performance, RatioPoint, of_curve
from upd.analyses.forced.solve import ForcedSolution
from upd.analyses.forced.statics import StaticState
from upd.analyses.modal.solve import ModalSolution
from upd.hbm.faces.sweep import period_of_sweep
from upd.progress import Stages, silent
from upd.results import Check
from upd.scene import load_scene

pytestmark = pytest.mark.estimated

FORCED = [
    "balance.harmonics=3",
    "excitation.points=40",
    "excitation.start=430 Hz",
    "excitation.stop=460 Hz",
    "excitation.centrifugal_to_force=[250.0]",
    'want=["response"]',
    # what the answer may change by is the scene's to say
    "left_out.frequency=5 %",
    "left_out.peak=20 %",
]
MODAL = [
    "mesh.element=hex8",
    'modes.arrangements=["symmetric"]',
    'want=["free", "reduction", "response"]',
    "response.points=200",
    "accuracy=unknown",
]


def solved(scene: str, overrides: list[str]) -> Any:
    plan = make_plan(load_scene(scene, overrides))
    analysis: Any = forced.ANALYSIS if scene.endswith("response") else modal.ANALYSIS
    return analysis.solve(plan, Stages(silent))


@pytest.fixture(scope="module")
def forced_scene(few_points: Sequence[str]) -> list[str]:
    return [*few_points, *FORCED]


@pytest.fixture(scope="module")
def response(forced_scene: list[str]) -> ForcedSolution:
    solution = solved("symmetric-response", forced_scene)
    assert isinstance(solution, ForcedSolution)
    curve = solution.curves[0]
    i = int(np.abs(curve.accelerance["right"]).argmax())
    _add_sweeps(solution, float(curve.answer.frequency[i]))
    solution.performances = {"thesis": Performance((of_curve(curve),), 300.0, 190.0)}
    return solution


def _add_sweeps(solution: ForcedSolution, f: float) -> None:
    """A few frequencies up and down beside the peak."""
    plan, model, curve = solution.plan, solution.models["thesis"], solution.curves[0]
    springs = make_springs(plan, model)
    near = replace(plan.scene.excitation, start=f - 6.0, stop=f + 6.0, points=10)
    beside = replace(plan, scene=replace(plan.scene, excitation=near))
    start = springs.at_rest()
    solution.curves += both_ways(beside, "thesis", curve.ratio, springs.march, start)
    sweep = solution.curves[1]
    periods = {
        top.number: period_of_sweep(sweep.answer, top.sample, by_coulomb)
        for top in sweep.peaks["right"]
    }
    solution.curves[1] = replace(sweep, periods=periods)


@pytest.fixture(scope="module")
def rig() -> ModalSolution:
    solution = solved("rig", MODAL)
    assert isinstance(solution, ModalSolution)
    return solution


def failing(checks: list[Check]) -> set[str]:
    return {c.name for c in checks if not c.passed}


def with_answer(solution: ForcedSolution, **values: Any) -> ForcedSolution:
    curve = solution.curves[0]
    answer = replace(curve.answer, **values)
    blades = {
        side: accelerance(answer, solution.models["thesis"].row(side), curve.force)
        for side in curve.accelerance
    }
    return replace(
        solution, curves=[replace(curve, answer=answer, accelerance=blades), *solution.curves[1:]]
    )


def _forces(s: ForcedSolution, factor: float, which: slice) -> ForcedSolution:
    force = s.curves[0].answer.contact_force.copy()
    force[..., which] *= factor
    return with_answer(s, contact_force=force)


def _points(s: ForcedSolution, kept: Any) -> ForcedSolution:
    """Some of the points of the path alone."""
    a = s.curves[0].answer
    names = ("frequency", "x", "contact_displacement", "contact_force", "state", "energy", "linear")
    names += ("truncation", "aliasing", "periodic")
    return with_answer(s, **{name: getattr(a, name)[kept] for name in names})


def _cut_performance(s: ForcedSolution) -> ForcedSolution:
    one = s.performances["thesis"]
    cut = tuple(p._replace(arrived=False) for p in one.points)
    return replace(s, performances={"thesis": replace(one, points=cut)})


def _checked(s: ForcedSolution, **values: Any) -> ForcedSolution:
    """A peak's time integration, spoiled."""
    curve = s.curves[0]
    first, *others = curve.checked
    return replace(
        s, curves=[replace(curve, checked=(replace(first, **values), *others)), *s.curves[1:]]
    )


def _at_rest(s: ForcedSolution, N: Sequence[float], T: Sequence[float]) -> ForcedSolution:
    model = s.models["thesis"]
    state = StaticState("given", np.array(N), np.array(T))
    return replace(s, models={"thesis": replace(model, state=state)})


def _omitted(name: str) -> Callable[[ForcedSolution], ForcedSolution]:
    def spoil(s: ForcedSolution) -> ForcedSolution:
        def wrong(found: list[Resolved]) -> list[Resolved]:
            return [
                replace(one, included=1.3 * one.without) if one.effect == name else one
                for one in found
            ]

        assert any(one.effect == name for one in s.omissions)
        return replace(s, omissions=wrong(s.omissions))

    return spoil


def _swept(s: ForcedSolution, **values: Any) -> ForcedSolution:
    path, one, other = s.curves
    return replace(s, curves=[path, replace(one, answer=replace(one.answer, **values)), other])


SPOIL_FORCED: dict[str, Callable[[ForcedSolution], ForcedSolution]] = {
    "path complete": lambda s: with_answer(s, status="stopped"),
    "path complete, periodic": lambda s: with_answer(
        s, periodic=np.zeros_like(s.curves[0].answer.periodic)
    ),
    "balance residual": lambda s: _forces(s, 1.0 + 1e-4, slice(None)),
    "balance residual, mean forces": lambda s: _forces(s, 1.01, slice(0, 1)),
    "energy balance": lambda s: with_answer(s, energy=s.curves[0].answer.energy + 1e-3),
    "preloaded contact": lambda s: _at_rest(s, (0.0, 350.0), (0.0, 100.0)),
    "preloaded contact, mobilised": lambda s: _at_rest(s, (200.0, 200.0), (120.0, -120.0)),
    "confirmed by time integration": lambda s: _checked(
        s, integrated=1.06 * s.curves[0].checked[0].balance
    ),
    "confirmed by time integration, none stays": lambda s: _checked(s, integrated=np.nan),
    "performance complete": _cut_performance,
    "path complete, of a sweep": lambda s: _swept(s, status="stopped"),
    "sweep settled": lambda s: _swept(s, settled=s.curves[1].answer.settled & False),
    "sweep energy": lambda s: _swept(s, energy=s.curves[1].answer.energy * [1.05, 1.0, 1.0]),
    "sliding along y": _omitted("sliding along y"),
    "elastic damper": _omitted("elastic damper"),
}


def name_of(spoiled: str) -> str:
    return spoiled.partition(",")[0]


def test_a_motion_off_by_a_little_is_off_balance(response: ForcedSolution) -> None:
    """1e-5 of the motion leaves about as much of the largest terms where all stick, and the check
    fails.
    """
    stuck = _points(response, response.curves[0].answer.linear)
    a = stuck.curves[0].answer
    assert residual_error(a) < 1e-9
    x = a.x * (1.0 + 1e-5)
    force = np.array([a.balance.force(one) for one in x])
    off = residual_error(replace(a, x=x, contact_force=force))
    assert 1e-6 < off < 1e-4


def _spoiled(s: ModalSolution, **values: Any) -> ModalSolution:
    """Something of its first modes."""
    (key, found), *others = s.sets.items()
    return replace(s, sets=dict([(key, replace(found, **values)), *others]))


def _mode(s: ModalSolution, name: str) -> ModalSolution:
    first, *others = next(iter(s.sets.values())).modes
    return _spoiled(s, modes=[replace(first, **{name: 1.001 * getattr(first, name)}), *others])


def _missed(s: ModalSolution) -> ModalSolution:
    (body, m), *others = next(iter(s.sets.values())).found
    bad = replace(m, missed=1, message="one of two was found")
    return _spoiled(s, found=[(body, bad), *others])


SPOIL_MODAL: dict[str, Callable[[ModalSolution], ModalSolution]] = {
    "mode residual": lambda s: _mode(s, "frequency"),
    "orthogonality": lambda s: _mode(s, "shape"),
    "no mode missed": _missed,
    "reduced frequencies": lambda s: replace(
        s, reductions=[replace(r, frequency=1.03 * r.frequency) for r in s.reductions]
    ),
    "modes above": lambda s: replace(
        s, left_out=[replace(one, included=1.2 * one.included) for one in s.left_out]
    ),
    "shear locking": lambda s: s,
}


@pytest.mark.parametrize("spoiled", SPOIL_FORCED)
def test_spoiled_response_fails(response: ForcedSolution, spoiled: str) -> None:
    name = name_of(spoiled)
    assert name not in failing(forced.ANALYSIS.check_solution(response))
    assert name in failing(forced.ANALYSIS.check_solution(SPOIL_FORCED[spoiled](response)))


def test_every_check_of_a_response_is_spoiled(response: ForcedSolution) -> None:
    checks = forced.ANALYSIS.check_solution(response)
    # multipliers are spoiled in tests/analytic/test_damping_over_amplitude.py
    spoiled = {"oscillating motion", *map(name_of, SPOIL_FORCED)}
    assert {c.name for c in checks} == spoiled


@pytest.mark.parametrize("name", SPOIL_MODAL)
def test_spoiled_modes_fail(rig: ModalSolution, name: str) -> None:
    """The mesh of hex8 locks: that check fails as it is, and passes on no other element."""
    before = failing(modal.ANALYSIS.check_solution(rig))
    assert before == {"shear locking"}
    assert name in failing(modal.ANALYSIS.check_solution(SPOIL_MODAL[name](rig)))


def test_every_check_of_modes_is_spoiled(rig: ModalSolution) -> None:
    assert {c.name for c in modal.ANALYSIS.check_solution(rig)} == set(SPOIL_MODAL)


def test_every_effect_left_out_has_a_number(response: ForcedSolution, rig: ModalSolution) -> None:
    for solution, analysis in ((response, forced.ANALYSIS), (rig, modal.ANALYSIS)):
        checks = analysis.check_solution(solution)
        results = {(r.name, r.case) for r in analysis.make_results(solution)}
        for effect in solution.plan.effects:
            if effect.on or not effect.applies:
                continue
            mine = [c for c in checks if c.name == effect.check]
            # of a response the error of modes is estimated beside the others
            assert mine or (effect.name == "modes above" and solution is response), effect
            for check in mine:
                assert (check.quantity, check.case) in results, check
                assert check.without is not None


def test_no_smaller_number_stands_for_one_not_reached(response: ForcedSolution) -> None:
    """A path that stopped before the peak, and curves without one: numbers with a reason."""
    curve = response.curves[0]
    (peak,) = curve.peaks["right"]
    part = _points(response, slice(peak.sample - 3))
    none = RatioPoint(250.0, (), True)
    performance = replace(response.performances["thesis"], points=(none,))
    bare = replace(part.curves[0], peaks={"left": (), "right": ()}, tops={}, checked=(), folds=())
    part = replace(part, curves=[bare])
    part = replace(part, performances={"thesis": performance})
    cut = with_answer(part, status="stopped", message="lost")
    results = [r for r in forced.ANALYSIS.make_results(cut) if r.withheld]
    missing = {r.name for r in results}
    assert {"peak_2_frequency", "peak_2_accelerance", "best_ratio", "best_peak"} <= missing
    assert all(np.isnan(r.value) and r.as_dict()["value"] is None for r in results)
    mine = [r for r in results if r.name == "peak_2_accelerance"]
    assert [r.withheld for r in mine] == [cut.curves[0].stopped]


def _switched(scene: str, overrides: list[str], effect: str, solution: Any) -> None:
    """The run with the effect changes the number by what the run without it printed."""
    analysis: Any = forced.ANALYSIS if scene.endswith("response") else modal.ANALYSIS
    found = next(e for e in solution.plan.effects if e.name == effect)
    assert found.switch
    again = solved(scene, [*overrides, "left_out.solve=no", *found.switch])
    numbers = {(r.name, r.case): r.value for r in analysis.make_results(solution)}
    with_it = {(r.name, r.case): r.value for r in analysis.make_results(again)}
    for check in analysis.check_solution(solution):
        if check.name != found.check:
            continue
        key = check.quantity, check.case
        # The peak is read from the points of two different paths: half a per cent.
        assert abs(with_it[key] / numbers[key] - 1.0) <= check.value + 5e-3, check


def test_sliding_along_the_damper_changes_a_peak_as_printed(
    response: ForcedSolution, forced_scene: list[str]
) -> None:
    scene = [*forced_scene, "accuracy=unknown"]
    _switched("symmetric-response", scene, "sliding along the damper", response)


def test_every_switch_of_a_response_is_tried(response: ForcedSolution) -> None:
    declared = {e.name for e in response.plan.effects if e.switch and not e.on and e.applies}
    assert declared == {"sliding along the damper"}


def test_more_modes_change_the_linear_peak_as_printed(rig: ModalSolution) -> None:
    _switched("rig", MODAL, "modes above 1100 Hz", rig)
