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
from upd.analyses.forced.curves import ForcedCurve, LeftMaximum
from upd.analyses.forced.march_modes import stuck_modes_of
from upd.analyses.forced.marched_peaks import marched_peak
from upd.analyses.forced.measures import accelerance, residual_error
from upd.analyses.forced.performance import beside_branches
from upd.analyses.forced.performance_curve import Branch, Performance
from upd.analyses.forced.reduction_results import meet
from upd.analyses.forced.solution import AS_RUN, BandCurve, CurveBand, ForcedSolution, TimeMarch
from upd.analyses.forced.sweeps import (
    confirm,
    make_springs,
    march_sweep,
    swept,
)
from upd.analyses.modal.solve import ModalSolution, modal_error
from upd.hbm.checks import aliasing, truncation
from upd.hbm.march import steady_state
from upd.progress import Stages, silent
from upd.results import Check
from upd.scene import load_scene

FORCED = [
    "balance.harmonics=1",
    "excitation.points=40",
    "excitation.start=430 Hz",
    "excitation.stop=460 Hz",
    "excitation.centrifugal_to_force=[1000.0]",
    'want=["response"]',
    # what the answer may change by is the scene's to say
    "left_out.frequency=5 %",
]
MODAL = [
    "mesh.element=hex8",
    'modes.arrangements=["symmetric"]',
    'want=["free", "reduction", "response"]',
    "response.points=200",
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
    f = float(curve.answer.frequency[i])
    height = float(abs(curve.accelerance["right"][i]))
    steady = steady_state(curve.answer.balance, f, curve.answer.x[i])
    solution.marches = [TimeMarch(curve, f, height, steady)]
    solution.bands = [CurveBand(curve, (BandCurve(AS_RUN, curve, ()),))]
    _add_sweeps(solution, f)
    ratio = np.array([500.0, 1000.0])
    branch = Branch("peak 1", ratio, np.full(2, f), np.full(2, height), np.zeros(2), True, "")
    solution.performances = {
        "thesis": Performance((branch,), 2 * height, height, sweeps=tuple(solution.sweeps))
    }
    return solution


def _add_sweeps(solution: ForcedSolution, f: float) -> None:
    """A few frequencies up and down beside the peak, and the peak marched on."""
    model, curve = solution.models["thesis"], solution.curves[0]
    springs = make_springs(solution.plan, model)
    modes = stuck_modes_of(springs.march, 1000.0)
    near = np.linspace(f - 4.0, f + 4.0, 5)
    state = springs.at_rest()
    for way, order in (("up", near), ("down", near[::-1])):
        found = march_sweep(springs.march, order, curve.force, state)
        one = swept("thesis", curve.ratio, curve.force, way, found, modes)  # type: ignore[arg-type]
        solution.sweeps.append(one)
        state = found.state
    peak = solution.numbered_peaks(curve)[0]
    solution.confirmations = [confirm(springs, model, curve, peak)]
    top = solution.sweeps[0].peaks["right"][0]
    solution.marched = [marched_peak(solution, solution.sweeps[0], top)]


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
    return replace(solution, curves=[replace(curve, answer=answer, accelerance=blades)])


def _forces(s: ForcedSolution, factor: float, which: slice) -> ForcedSolution:
    force = s.curves[0].answer.contact_force.copy()
    force[..., which] *= factor
    return with_answer(s, contact_force=force)


def _again(s: ForcedSolution, measure: Callable[..., Any], name: str) -> ForcedSolution:
    """The measure of an answer thirty times as large: everything slips and lifts off."""
    a = s.curves[0].answer
    x = 30.0 * a.x
    given = (a.frequency, x) if measure is truncation else (x, a.contact_force)
    return with_answer(s, **{name: measure(a.balance, *given)})


def _open(s: ForcedSolution) -> ForcedSolution:
    state = np.zeros_like(s.curves[0].answer.state)
    state[..., 2] = 1.0
    return with_answer(s, state=state)


def _points(s: ForcedSolution, kept: slice) -> ForcedSolution:
    """Some of the points of the path alone."""
    a = s.curves[0].answer
    names = ("frequency", "x", "contact_displacement", "contact_force", "state", "energy", "linear")
    names += ("truncation", "aliasing", "periodic", "highest_harmonic")
    return with_answer(s, **{name: getattr(a, name)[kept] for name in names})


def _wide_steps(s: ForcedSolution) -> ForcedSolution:
    """Every fourth point, the peak among them."""
    peak = s.numbered_peaks(s.curves[0])[0].sample
    return _points(s, slice(peak % 4, None, 4))


def _stopped_branch(s: ForcedSolution) -> ForcedSolution:
    one = s.performances["thesis"]
    short = tuple(replace(b, complete=False, message="lost") for b in one.branches)
    return replace(s, performances={"thesis": replace(one, branches=short)})


def _unsettled_branch(s: ForcedSolution) -> ForcedSolution:
    one = s.performances["thesis"]
    lost = tuple(
        replace(b, found=replace(b.found, settled=b.found.settled & False)) for b in one.sweeps
    )
    return replace(s, performances={"thesis": replace(one, sweeps=lost)})


def _followed_at(s: ForcedSolution, share: float) -> ForcedSolution:
    """Every peak followed at a share of the curve's height, without sweeps."""
    one = replace(s.performances["thesis"], swept=np.zeros((4, 0)), sweeps=())
    ratios = np.array([0.5, 2.0]) * s.curves[0].ratio
    tops = share * np.abs(s.curves[0].accelerance["right"]).max() * np.ones(2)
    low = tuple(
        replace(b, ratio=ratios, frequency=400.0 * np.ones(2), height=tops, lift=0.0 * tops)
        for b in one.branches
    )
    found = beside_branches(replace(one, branches=low), s.curves)
    return replace(s, performances={"thesis": found})


def _other_modes(s: ForcedSolution) -> ForcedSolution:
    """A right blade so stiff that the stuck modes move the left one, which moves less, alone."""
    model = s.models["thesis"]
    right = np.abs(model.contacts.rows[model.face == 1]).max(axis=(0, 1))
    K, n_left = model.K.copy(), np.flatnonzero(right)[0]
    K[n_left:, n_left:] *= 1e4
    return replace(s, models={"thesis": replace(model, K=K)})


def _unbalanced(s: ForcedSolution) -> ForcedSolution:
    """A hundred-millionth more friction at rest."""
    model = s.models["thesis"]
    traction = model.traction + 1e-8 * model.contacts.law.preload[:, None]
    return replace(s, models={"thesis": replace(model, traction=traction)})


def _stopped_band(s: ForcedSolution) -> ForcedSolution:
    short = with_answer(s, status="stopped").curves[0]
    return replace(s, bands=[CurveBand(short, (BandCurve("static opposing", short, ()),))])


def _anisotropic(s: ForcedSolution) -> ForcedSolution:
    model = s.models["thesis"]
    laws = {side: replace(law, anisotropy=0.5) for side, law in model.laws.items()}
    return replace(s, models={"thesis": replace(model, laws=laws)})


def _omitted(name: str) -> Callable[[ForcedSolution], ForcedSolution]:
    def spoil(s: ForcedSolution) -> ForcedSolution:
        def wrong(found: list[Resolved]) -> list[Resolved]:
            return [
                replace(one, included=1.2 * one.without) if one.effect == name else one
                for one in found
            ]

        checked = s.levels.checked
        assert any(one.effect == name for one in (*s.omissions, *checked))
        levels = replace(s.levels, checked=wrong(checked))
        return replace(s, omissions=wrong(s.omissions), levels=levels)

    return spoil


def _swept(s: ForcedSolution, **values: Any) -> ForcedSolution:
    one = s.sweeps[0]
    return replace(s, sweeps=[replace(one, found=replace(one.found, **values)), *s.sweeps[1:]])


def _lower_down(s: ForcedSolution) -> ForcedSolution:
    """The sweep down two hundredths lower than the one up."""
    one = s.sweeps[1]
    peaks = {
        side: tuple(p._replace(height=0.98 * p.height) for p in found)
        for side, found in one.peaks.items()
    }
    return replace(s, sweeps=[s.sweeps[0], replace(one, peaks=peaks)])


def _unsteady(s: ForcedSolution) -> ForcedSolution:
    """The peak as one that a march leaves; `test_steady_peaks` has peaks that marches do leave."""
    curve = s.curves[0]
    left = LeftMaximum("right", s.numbered_peaks(curve)[0], 1.0)
    return replace(s, curves=[replace(curve, left=(left,))])


SPOIL_FORCED: dict[str, Callable[[ForcedSolution], ForcedSolution]] = {
    "path complete": lambda s: with_answer(replace(s, sweeps=[]), status="stopped"),
    "contact forces periodic": lambda s: with_answer(
        s, periodic=np.zeros_like(s.curves[0].answer.periodic)
    ),
    "balance residual": lambda s: _forces(s, 1.0 + 1e-4, slice(None)),
    "energy balance": lambda s: with_answer(s, energy=s.curves[0].answer.energy + 1e-3),
    "damper at rest": lambda s: _forces(s, 1.01, slice(0, 1)),
    "truncation": lambda s: _again(s, truncation, "truncation"),
    "aliasing": lambda s: _again(s, aliasing, "aliasing"),
    "both faces carry": _open,
    "frequency step": _wide_steps,
    "peaks told apart by mode": _other_modes,
    "time march": lambda s: replace(
        s, marches=[replace(s.marches[0], height=1.01 * s.marches[0].height)]
    ),
    "sweep complete": lambda s: _swept(s, status="stopped"),
    "sweep settled": lambda s: _swept(s, settled=s.sweeps[0].found.settled & False),
    "sweep energy": lambda s: _swept(s, energy=s.sweeps[0].found.energy * [1.05, 1.0, 1.0]),
    "loss by nodes": lambda s: replace(
        s,
        marched=[
            replace(one, period=replace(one.period, loss=one.period.loss + 1e-6))
            for one in s.marched
        ],
    ),
    "one steady motion": _lower_down,
    "maxima steady": _unsteady,
    "steady at the peak": lambda s: replace(
        s, confirmations=[replace(s.confirmations[0], marched=1.01 * s.confirmations[0].marched)]
    ),
    "performance complete": _stopped_branch,
    "performance settled": _unsettled_branch,
    "performance highest": lambda s: _followed_at(s, 0.92),
    "k_t anisotropy": _anisotropic,
    "static balance": _unbalanced,
    "band complete": _stopped_band,
    **{
        name: _omitted(name)
        for name in (
            "sliding along y",
            "odd motion",
            "faces that fit without load",
            "more harmonics",
            "twice the samples",
            "other slider starts",
            "other static states",
            "more modes",
            "elastic damper",
        )
    },
}


def test_a_motion_off_by_a_little_is_off_balance(response: ForcedSolution) -> None:
    """1e-5 of the motion leaves about as much of the largest terms, and the check fails."""
    a = response.curves[0].answer
    assert residual_error(a) < 1e-9
    x = a.x * (1.0 + 1e-5)
    force = np.array([a.balance.force(one).force for one in x])
    off = residual_error(replace(a, x=x, contact_force=force))
    assert 1e-6 < off < 1e-4


def _mode(s: ModalSolution, **values: Any) -> ModalSolution:
    found = s.sets[0]
    return replace(
        s, sets=[replace(found, modes=[replace(found.modes[0], **values), *found.modes[1:]])]
    )


def _missed(s: ModalSolution) -> ModalSolution:
    found = s.sets[0]
    body, family, m = found.found[0]
    bad = replace(m, missed=1, message="one of two was found")
    return replace(s, sets=[replace(found, found=[(body, family, bad), *found.found[1:]])])


def _few_modes(s: ModalSolution) -> ModalSolution:
    """The modal response from shapes with a tenth too much motion."""
    assert s.response is not None
    found = s.sets[0]
    body, family, m = next((b, f, m) for b, f, m in found.found if b.name == "right" and f == "x")
    u = np.zeros((3 * body.mesh.n_node, len(m.frequency)))
    u[body.free((1,))] = np.sqrt(0.5) * m.shapes
    right = replace(m, shapes=u)
    assert modal_error(right, body, family) < 1e-2
    wrong = modal_error(replace(right, shapes=1.1 * u), body, family)
    return replace(s, response=replace(s.response, modal_error=wrong))


def _reduced(s: ModalSolution) -> ModalSolution:
    assert s.response is not None
    wrong = {part: (1.1 * r, f) for part, (r, f) in s.response.against_full.items()}
    return replace(s, response=replace(s.response, against_full=wrong))


SPOIL_MODAL: dict[str, Callable[[ModalSolution], ModalSolution]] = {
    "mode residual": lambda s: _mode(s, frequency=1.001 * s.sets[0].modes[0].frequency),
    "orthogonality": lambda s: _mode(s, shape=1.001 * s.sets[0].modes[0].shape),
    "no mode missed": _missed,
    "upper bound": lambda s: replace(
        s, reductions=[replace(r, frequency=0.999 * r.frequency) for r in s.reductions]
    ),
    "reduced response": _reduced,
    "modal response": _few_modes,
    "modes above": lambda s: replace(s, again=replace(s.again, peak=1.2 * (s.again.peak or 0.0))),
    "shear locking": lambda s: s,
}


#: effects that move the peak of this scene beyond its limits as it is
SHIFTS = {"faces that fit without load", "other slider starts", "other static states"}


@pytest.mark.parametrize("name", SPOIL_FORCED)
def test_spoiled_response_fails(response: ForcedSolution, name: str) -> None:
    whole = {c.name for c in forced.ANALYSIS.check_solution(response)}
    # of stiffnesses from a table, and of peaks followed without sweeps
    assert name in whole or name in ("k_t anisotropy", "performance highest")
    before = failing(forced.ANALYSIS.check_solution(response))
    assert name not in before or name in SHIFTS
    assert name in failing(forced.ANALYSIS.check_solution(SPOIL_FORCED[name](response)))


def test_a_curve_with_a_higher_peak_than_any_followed_withholds_the_optimum(
    response: ForcedSolution,
) -> None:
    """A share of 0.92 of it; the peak itself is on its branch."""
    fine, off = _followed_at(response, 1.0), _followed_at(response, 0.92)
    assert not fine.performances["thesis"].missed
    assert "performance highest" not in failing(forced.ANALYSIS.check_solution(fine))
    told = {r.name: r for r in forced.ANALYSIS.make_results(off)}

    assert "higher peak is not followed" in told["optimum_ratio"].withheld


def test_every_check_of_a_response_is_spoiled(response: ForcedSolution) -> None:
    assert {c.name for c in forced.ANALYSIS.check_solution(response)} <= set(SPOIL_FORCED)


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
            assert mine, effect
            for check in mine:
                assert (check.quantity, check.case) in results, check
                assert check.without is not None


def test_no_smaller_number_stands_for_one_not_reached(response: ForcedSolution) -> None:
    """A path that stopped between the peaks, and a peak that was lost: the rest has a reason."""
    peaks = response.numbered_peaks(response.curves[0])
    assert peaks
    end = peaks[0].sample - 3
    part = _points(_stopped_branch(replace(response, sweeps=[])), slice(end))
    cut = with_answer(part, status="stopped", message="lost")
    results = {(r.name, str(r.case)): r for r in forced.ANALYSIS.make_results(cut)}
    peak = f"peak_{peaks[0].number}"
    missing = {name for (name, _), r in results.items() if r.withheld}
    assert {f"{peak}_frequency", f"{peak}_accelerance", "optimum_ratio", "lowest_peak"} <= missing
    assert all(
        np.isnan(r.value) and r.as_dict()["value"] is None for r in results.values() if r.withheld
    )
    curve = [
        r
        for r in results.values()
        if r.name == f"{peak}_accelerance" and r.case.matches(cut.curves[0].case)
    ]
    assert [r.withheld.partition(":")[0] for r in curve] == [cut.curves[0].where]


def test_paths_that_pass_each_other_on_two_branches_give_no_reduction(
    response: ForcedSolution,
) -> None:
    """They overlap in frequency; the highest point may lie on the part neither has."""
    whole = response.curves[0]

    def part(at: slice, shift: float, reverse: bool) -> ForcedCurve:
        a = whole.answer
        cut = replace(a, frequency=a.frequency[at], status="stopped", message="lost")
        blades = {side: shift * H[at] for side, H in whole.accelerance.items()}
        return replace(whole, answer=cut, accelerance=blades, reversed=reverse)

    n = len(whole.answer.frequency)
    up, down = slice(0, 2 * n // 3), slice(None, n // 3, -1)
    for shift, withheld in ((1.0, False), (0.5, True)):
        curves = [part(up, 1.0, False), part(down, shift, True)]
        assert curves[0].answer.frequency[-1] > curves[1].answer.frequency[-1]
        assert meet(curves) is not withheld


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


SWITCHED = ("sliding along the damper", "harmonics above")
COSTLIER = (
    "motion odd about y = 0",
    "modes above",
    "other slider starts",
    "other static states",
    "blades spread by F_C",
)


@pytest.mark.parametrize("effect", SWITCHED)
def test_switched_on_it_changes_a_peak_as_printed(
    response: ForcedSolution, forced_scene: list[str], effect: str
) -> None:
    _switched("symmetric-response", forced_scene, effect, response)


@pytest.mark.full
@pytest.mark.parametrize("effect", COSTLIER)
def test_costlier_effect_changes_a_peak_as_printed(
    response: ForcedSolution, forced_scene: list[str], effect: str
) -> None:
    _switched("symmetric-response", forced_scene, effect, response)


def test_every_switch_of_a_response_is_tried(response: ForcedSolution) -> None:
    declared = {e.name for e in response.plan.effects if e.switch and not e.on and e.applies}
    assert declared == {*SWITCHED, *COSTLIER}


def test_more_modes_change_the_linear_peak_as_printed(rig: ModalSolution) -> None:
    _switched("rig", MODAL, "modes above 1100 Hz", rig)
