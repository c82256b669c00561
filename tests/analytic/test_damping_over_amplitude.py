"""Damping over amplitude of a rig: where slip begins, what F_C scales, the run's own peaks."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from rigs import LINES

import upd
from upd.analyses import forced, make_plan
from upd.analyses.forced import checks
from upd.analyses.forced.checks import check_solution
from upd.analyses.forced.performance import first_slip, mode_results
from upd.analyses.forced.solve import ForcedSolution
from upd.errors import InputError
from upd.hbm import System, contacts, nonlinear_mode
from upd.progress import Stages, silent
from upd.scene import load_scene

RIG: dict[str, Any] = LINES | {
    "mesh.element": "hex8i",
    "contact.rows": [1, 2],
    "contact.columns": 2,
    "contact.directions": "one",
    "reduction.modes": 4,
    "balance.harmonics": 5,
    "excitation.points": 60,
    "excitation.centrifugal_to_force": [600.0],
    "want": ["response", "nonlinear_modes"],
    "left_out.solve": "no",
    "accuracy": "unknown",
}


@cache
def solved(centrifugal: str = "350 N") -> ForcedSolution:
    scene = RIG | {"damper.centrifugal": centrifugal}
    plan = make_plan(load_scene("asymmetric-response", scene))
    found: Any = forced.ANALYSIS.solve(plan, Stages(silent))
    return found  # type: ignore[no-any-return]


def curves(found: ForcedSolution) -> dict[str, dict[str, np.ndarray[Any, Any]]]:
    return {
        case.mode: {name: one.data for name, one in curve.items()}
        for case, curve in found.nonlinear_modes
    }


def modes(centrifugal: str = "350 N") -> dict[str, dict[str, np.ndarray[Any, Any]]]:
    return curves(solved(centrifugal))


def test_a_mode_begins_stuck_and_its_damping_rises_with_slip() -> None:
    assert set(modes()) == {"in phase", "out of phase"}
    for one in modes().values():
        stuck = (one["slip"] == 0.0) & (one["lift"] == 0.0)
        assert stuck[0] and not stuck[-1]
        np.testing.assert_allclose(one["frequency"][stuck], one["stuck_frequency"], rtol=1e-6)
        assert one["damping"][stuck] == pytest.approx(one["damping"][0], rel=1e-9)
        assert one["damping"].max() > 1.2 * one["damping"][0]


def test_twice_the_centrifugal_force_is_twice_the_amplitude() -> None:
    for mode, one in modes().items():
        other = modes("700 N")[mode]
        a, b = (c["acceleration_right"] for c in (one, other))
        assert b[0] / a[0] == pytest.approx(2.0, rel=1e-6)
        zeta = [max(c["damping"]) for c in (one, other)]
        assert zeta[1] == pytest.approx(zeta[0], rel=1e-2)


def test_a_forced_peak_lies_on_its_mode() -> None:
    (curve,) = solved("350 N").curves
    for peak in curve.peaks["right"]:
        one = modes()[peak.mode]
        a = one["acceleration_right"]
        # where the amplitude first comes to that of the peak
        k = int(np.argmax(a >= peak.height * curve.force))
        frequency = np.interp(
            peak.height * curve.force, a[k - 1 : k + 1], one["frequency"][k - 1 : k + 1]
        )
        assert peak.frequency == pytest.approx(frequency, rel=1e-3)


def test_first_slip_by_hand() -> None:
    """One mass on a slider: mu N = k_t a / omega^0 at a = 4."""
    jenkins = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=0.25, mu=1.0, preload=1.0)
    b = nonlinear_mode(
        System(([[1.0]], [[0.0]], [[1.0]]), jenkins, harmonics=(0, 1)), mode=1, amplitudes=[0.1]
    ).balance
    assert first_slip(b, np.ones(1), 1.0) == pytest.approx(4.0, rel=1e-12)
    slides = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=0.25, mu=0.0, preload=1.0)
    with pytest.raises(InputError, match="no point sticks at rest"):
        first_slip(replace(b, contacts=slides), np.ones(1), 1.0)


def test_numbers_name_the_largest_damping_unless_it_still_rises() -> None:
    for case, curve in solved("350 N").nonlinear_modes:
        one, numbers = modes()[case.mode], {r.name: r for r in mode_results(case, curve)}
        largest = numbers["largest_damping"]
        assert largest.value == pytest.approx(100 * one["damping"].max(), rel=2e-2)
        rises = one["damping"].argmax() == one["acceleration_right"].argmax()
        assert rises == ("force_for_damping" not in numbers)
        if not rises:
            at = numbers["damping_acceleration"].value
            assert numbers["force_for_damping"].value * at == pytest.approx(350.0, rel=1e-9)


def test_sweeps_have_their_modes_too() -> None:
    scene = RIG | {"balance.method": "march", "excitation.points": 10}
    plan = make_plan(load_scene("asymmetric-response", scene))
    found: Any = forced.ANALYSIS.solve(plan, Stages(silent))
    assert list(curves(found)) == ["in phase", "out of phase"]
    for mode, one in curves(found).items():
        np.testing.assert_allclose(one["damping"], modes()[mode]["damping"], rtol=1e-9)


def test_without_friction_there_is_nothing_to_damp() -> None:
    with pytest.raises(InputError, match="leaves no point that sticks"):
        load_scene("asymmetric-response", RIG | {"contact.friction": 0.0})


def test_a_run_leaves_curves_chart_and_table(
    tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    # what a run makes of the rig solved above
    problem = replace(forced.ANALYSIS.problem, solve=lambda *_: solved("350 N"))
    known = replace(forced.ANALYSIS, problem=problem)
    monkeypatch.setattr("upd.runner.analysis_of", lambda scene: known)
    result = upd.run("asymmetric-response", overrides=RIG, out=tmp_path / "run", report=False)
    assert (tmp_path / "run" / "nonlinear_modes.png").stat().st_size > 0
    assert any((tmp_path / "run" / "curves").glob("*nonlinear*"))
    assert "Damping over amplitude" in "\n".join(map(str, result.answer(100)))
    assert result.value("largest_damping", "thesis, in phase") > 0.4


def test_a_reported_peak_that_oscillates_warns(monkeypatch: pytest.MonkeyPatch) -> None:
    found = solved("350 N")

    def of_oscillation() -> list[Any]:
        return [one for one in check_solution(found) if one.name == "oscillating motion"]

    assert [(one.value, one.passed) for one in of_oscillation()] == [(0.0, True)]
    monkeypatch.setattr(
        checks, "motion_stability", lambda *_: ("oscillating", np.array([1.2 + 0.3j, 0.5]))
    )
    (told,) = of_oscillation()
    assert not told.passed and told.value >= 1.0
    assert "oscillates about its period (multiplier 1.237)" in told.remedy
