"""What inputs known within limits do to the numbers of runs: against closed forms, identities of
dimensional analysis, and models changed and followed again.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rigs import LINES

import upd
from upd.analyses import analysis_of
from upd.analyses.forced import model as paths
from upd.analyses.forced import peaks
from upd.analyses.forced.sensitivity import (
    data_change,
    is_known,
    limit_peak,
    stuck_frequencies,
)
from upd.analyses.forced.solution import ForcedSolution
from upd.hbm import Settings, climb
from upd.hbm.peaks.parameter_change import ParameterChange
from upd.hbm.peaks.sensitivity import PeakDerivative, peak_derivatives
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.starts import newton
from upd.progress import Stages
from upd.results import Case, InputPart, Result
from upd.scene import load_scene
from upd.vary.inputs import input_ends, input_parts

SPHERE = {
    "geometry.divisions": 12,
    "geometry.patch": "auto",
    "loads.normal": ["200 N"],
    "contact.friction": 0.0,
    "want": ["normal", "stiffness"],
    "left_out.solve": "no",
    "accuracy": "unknown",
}
WEDGE = {
    **LINES,
    "mesh.element": "hex8i",
    "contact.stiffness": ["thesis"],
    "contact.static": "frictionless",
    "contact.directions": "one",
    "contact.rows": [1, 2],
    "contact.columns": 2,
    "reduction.modes": 4,
    "balance.method": "balance",
    "balance.harmonics": 3,
    "balance.samples": 256,
    # 5.83 N on 350 N
    "excitation.centrifugal_to_force": "from force",
    "excitation.force": ["5.833 N +- 1 %"],
    "excitation.points": 60,
    "excitation.start": "380 Hz",
    "excitation.stop": "470 Hz",
    "want": ["response", "hysteresis"],
    "left_out.solve": "no",
    "accuracy": "unknown",
}
#: all half-widths are 1 %
INPUTS = {
    "contact.friction": "0.6 +- 0.006",
    "stiffness.thesis.K_N": "1.56e6 N/mm +- 1 %",
    "stiffness.thesis.K_T": "4.9e5 N/mm +- 1 %",
    "damper.centrifugal": "350 N +- 1 %",
    "excitation.damping": "0.5 % +- 0.005 %",
    "material.E": "200 GPa +- 1 %",
    "material.density": "7800 kg/m3 +- 1 %",
}
Changes = dict[str, dict[tuple[str, Case], float]]
#: of identities that hold at every frequency: a peak's derivative is taken from points beside it,
#: STEP of 0.005 times its width away, which is a hundredth of its frequency
BESIDE = 1e-4
#: numbers of samples at which derivatives of a peak are compared, rising
SAMPLES = (1024, 2048, 4096)


def test_parts_add_as_squares() -> None:
    """Independent inputs; a part that was not found leaves the whole unknown."""
    parts = (InputPart("a", 0.1, 0.03, "x"), InputPart("b", 0.1, 0.04, "x"))
    one = Result("q", Case(), 2.0, "N", inputs=parts)
    assert one.input_error == pytest.approx(0.05)
    assert one.as_dict()["input_error"] == pytest.approx(0.05)
    assert [p["path"] for p in one.as_dict()["input_parts"]] == ["a", "b"]
    lost = replace(one, inputs=(*parts, InputPart("c", 0.1, math.nan, "why")))
    assert lost.input_error is None
    assert lost.as_dict()["input_parts"][2]["share"] is None
    assert "input_parts" not in Result("q", Case(), 2.0, "N").as_dict()


def test_sphere_in_closed_form(tmp_path: Path) -> None:
    """Hertz: p_0 ~ F^(1/3) E*^(2/3), d ~ F^(2/3) E*^(-2/3), K_N ~ F^(1/3) E*^(2/3); of one of two
    like bodies E* takes half. Solved again at both ends of the intervals, on half the divisions.
    """
    inputs = {"loads.normal": ["200 N +- 10 N"], "materials.sphere.E": "200 GPa +- 5 %"}
    result = upd.run("hertz", overrides=SPHERE | inputs, out=tmp_path / "run", report=False)
    force, modulus = 0.05, 0.025
    for name, of_force, of_modulus in (
        ("max_pressure", 1 / 3, 2 / 3),
        ("approach", 2 / 3, 2 / 3),
        ("radius_moment", 1 / 3, 1 / 3),
        ("K_N_tangent", 1 / 3, 2 / 3),
    ):
        row = next(r for r in result.rows if r.name == name)
        shares = {part.path: part.share for part in row.inputs}
        # six divisions: a stiffness scatters with the nodes of its edge
        assert shares["loads.normal[0]"] == pytest.approx(of_force * force, rel=0.03)
        assert shares["materials.sphere.E"] == pytest.approx(of_modulus * modulus, rel=0.03)
        assert row.input_error == pytest.approx(math.hypot(*shares.values()))
        assert "divisions 6" in row.inputs[0].basis
    told = json.loads((tmp_path / "run" / "summary.json").read_text())["results"]
    assert any("input_parts" in one for one in told)
    again = load_scene(tmp_path / "run" / "scene.toml")
    assert {one.given for one in again.uncertain.values()} == {"200 N +- 10 N", "200 GPa +- 5 %"}


@pytest.fixture(scope="module")
def wedge() -> ForcedSolution:
    """A curve with slip at its peak, its inputs known within 1 %; the peak is the balance's top, on
    a path of short steps: a peak with ripples is climbed to from close by.
    """
    scene = load_scene("symmetric-response", WEDGE | INPUTS)
    analysis = analysis_of(scene)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(peaks, "confirmed", lambda plan, model, curve: curve)
        patch.setattr(paths, "LONG_STEPS", Settings())
        solution: ForcedSolution = analysis.solve(analysis.make_plan(scene), Stages())
    return solution


def relative_changes(solution: ForcedSolution) -> Changes:
    """Relative changes by a relative change of 1 of every input: peaks of the right blade with
    friction and stuck, stuck frequencies.
    """
    (model,), (linear,) = solution.models.values(), solution.linear.values()
    plan, row, bodies = solution.plan, model.row("right"), solution.bodies
    assert bodies is not None
    ends, out = input_ends(plan.scene), {}
    for end in ends:
        assert is_known(end)
        change = data_change(plan, bodies, "thesis", model, end, Stages())
        mine: dict[tuple[str, Case], float] = {}
        whole = [change.whole(model)]
        for name, (_, by) in stuck_frequencies(model, 1e3, whole).items():
            mine[name, Case(stiffness="thesis")] = by[0]
        for peak in linear.stuck_peaks["right"]:
            found = limit_peak(model, "right", True, peak.frequency, whole)
            mine |= _of_peak(found, 0.0, 2, Case(stiffness="thesis", kind="stuck"))
        for curve in solution.curves:
            (force,) = change.forces
            b = curve.answer.balance
            for (side, number), top in curve.tops.items():
                x = newton(b, top.x, top.frequency)
                assert x is not None
                if (side, number) == ("right", 2):
                    both = whole[0] + ParameterChange(dynamic=force * b.dynamic)
                    found = peak_derivatives(b, row, x, top.frequency, [both], power=2.0)
                    mine |= _of_peak(found, force, number, curve.case)
        out[end.of.path] = {key: 100.0 * one for key, one in mine.items()}
    return out


def _of_peak(
    found: PeakDerivative, force: float, number: int, case: Case
) -> dict[tuple[str, Case], float]:
    """Relative changes of frequency and height of a peak, per newton of F_E."""
    return {
        (f"peak_{number}_frequency", case): float(found.by_frequency[0] / found.frequency),
        (f"peak_{number}_accelerance", case): float(found.by_height[0] / found.height - force),
    }


@pytest.fixture(scope="module")
def changes(wedge: ForcedSolution) -> Changes:
    return relative_changes(wedge)


@pytest.fixture(scope="module")
def sampled(wedge: ForcedSolution) -> dict[int, Changes]:
    """The same with more samples at the peaks, rising."""
    return {n: relative_changes(_with_samples(wedge, n)) for n in SAMPLES}


def _with_samples(solution: ForcedSolution, samples: int) -> ForcedSolution:
    """The run with its curves on balances with other samples, on which its peaks are climbed to."""
    curves, model = [], solution.models["thesis"]
    for c in solution.curves:
        b = _balance(c.answer.balance, samples=samples)
        tops = {}
        for at, top in c.tops.items():
            near = newton(b, top.x, top.frequency)
            assert near is not None
            found = climb(b, model.row(at[0]), near, top.frequency, power=2.0)
            assert found.found
            tops[at] = top._replace(frequency=found.frequency, x=found.x)
        curves.append(replace(c, answer=replace(c.answer, balance=b), tops=tops))
    return replace(solution, curves=curves)


def _peaks(changes: Changes, quantity: str) -> list[tuple[str, Case]]:
    return [key for key in changes["material.E"] if key[0] == f"peak_2_{quantity}"]


def test_scale_of_stiffness_and_mass(changes: Changes) -> None:
    """All stiffnesses by a factor move every frequency by its root and no accelerance; densities
    move frequencies by the inverse root and accelerances by the inverse.
    """
    stiff = ("material.E", "stiffness.thesis.K_N", "stiffness.thesis.K_T")
    for key in [*_peaks(changes, "frequency"), ("stuck_out_of_phase", Case(stiffness="thesis"))]:
        assert sum(changes[path][key] for path in stiff) == pytest.approx(0.5, rel=BESIDE)
        assert changes["material.density"][key] == pytest.approx(-0.5, rel=BESIDE)
    for key in _peaks(changes, "accelerance"):
        assert sum(changes[path][key] for path in stiff) == pytest.approx(0.0, abs=BESIDE)
        assert changes["material.density"][key] == pytest.approx(-1.0, rel=BESIDE)


def test_only_the_ratio_of_the_forces_counts(changes: Changes) -> None:
    """Without gaps F_C and F_E by one factor change nothing; neither moves what is linear."""
    with_friction = 0
    for key in [*_peaks(changes, "frequency"), *_peaks(changes, "accelerance")]:
        pair = [changes[path][key] for path in ("damper.centrifugal", "excitation.force[0]")]
        assert sum(pair) == pytest.approx(0.0, abs=BESIDE)
        if key[1].kind:
            assert pair == [0.0, 0.0]
        else:
            with_friction += abs(pair[0]) > 0.01
    assert with_friction


@pytest.mark.parametrize(
    ("path", "changed"),
    [
        ("contact.friction", lambda b, s: _with_law(b, mu=s * b.contacts.law.mu)),
        ("stiffness.thesis.K_N", lambda b, s: _with_law(b, k_n=s * b.contacts.law.k_n)),
        ("stiffness.thesis.K_T", lambda b, s: _with_law(b, k_t=s * b.contacts.law.k_t)),
        (
            "excitation.damping",
            lambda b, s: _balance(b, modal=replace(b.modal, damping=s * b.modal.damping)),
        ),
        ("excitation.force[0]", lambda b, s: _balance(b, dynamic=s * b.dynamic)),
    ],
)
def test_peak_of_a_changed_balance(
    wedge: ForcedSolution,
    sampled: dict[int, Changes],
    path: str,
    changed: Callable[[Balance, float], Balance],
) -> None:
    """The peak climbed to again on the balance with the input changed.

    Kinks by the samples move so flat a peak, and with it the derivative: that is known to the range
    of three numbers of samples. Central differences over h and h / 2 differ by three times what the
    finer one lacks; the bound takes the whole difference, Roache's factor of two levels.
    """
    solution = _with_samples(wedge, SAMPLES[-1])
    model = solution.models["thesis"]
    curve, peak = next(
        (curve, one) for curve in solution.curves for one in curve.peaks["right"] if one.number == 2
    )
    x, f = curve.tops["right", 2].x, curve.tops["right", 2].frequency

    def top(scale: float) -> np.ndarray:
        b = changed(curve.answer.balance, scale)
        near = newton(b, x, f)
        assert near is not None
        found = climb(b, model.row("right"), near, f, power=2.0)
        assert found.found
        force = scale if path == "excitation.force[0]" else 1.0
        return np.log([found.frequency, found.frequency**2 * found.amplitude / force])

    coarse, fine = ((top(1.0 + h) - top(1.0 - h)) / (2.0 * h) for h in (0.005, 0.0025))
    assert peak.number == 2
    keys = [(f"peak_2_{kind}", curve.case) for kind in ("frequency", "accelerance")]
    told = np.array([[sampled[n][path][key] for key in keys] for n in SAMPLES])
    bound = np.ptp(told, axis=0) + np.abs(fine - coarse)
    # not so vague that it proves nothing: of the friction's derivatives a fourth and a thousandth
    assert np.all(bound < [0.015, 0.0025])
    assert np.all(np.abs(told[-1] - fine) < bound)


def _balance(b: Balance, **values: Any) -> Balance:
    names = ("modal", "contacts", "harmonics", "samples", "static", "dynamic", "start", "slider")
    return Balance(**({name: getattr(b, name) for name in names} | values))


def _with_law(b: Balance, **values: Any) -> Balance:
    return _balance(b, contacts=replace(b.contacts, law=replace(b.contacts.law, **values)))


def test_main_numbers_have_a_part_for_every_input() -> None:
    """By solves at both ends, which agree with the exact derivatives; those of numbers that the
    cheap companion does not have say so.
    """
    few = {"excitation.damping": INPUTS["excitation.damping"], "material.nu": "0.3 +- 0.003"}
    scene = load_scene("symmetric-response", WEDGE | few)
    analysis = analysis_of(scene)
    run: ForcedSolution = analysis.solve(analysis.make_plan(scene), Stages())
    numbers = analysis.make_results(run)
    found = input_parts(analysis, run, numbers, Stages())
    of_peaks = {key: parts for key, parts in found.items() if key[0].startswith("peak_2")}
    assert of_peaks
    for parts in found.values():
        assert {part.path for part in parts} == set(scene.uncertain)
        assert all(part.known or "not" in part.basis for part in parts)
    assert all(part.known for parts in of_peaks.values() for part in parts)
    by_damping = {
        name: next(p.change for p in parts if p.path == "excitation.damping")
        for (name, case), parts in of_peaks.items()
        if case.kind == "stuck"
    }
    assert by_damping["peak_2_frequency"] == pytest.approx(0.0, abs=1e-4)
    assert by_damping["peak_2_accelerance"] == pytest.approx(-0.01, rel=0.05)
    certain = replace(run.plan, scene=replace(scene, uncertain={}))
    assert input_parts(analysis, replace(run, plan=certain), numbers, Stages()) == {}
