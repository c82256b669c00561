"""What inputs known within limits do to the numbers of runs: against closed forms."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
from rigs import LINES

import upd
from tests.pictures import no_figures
from upd.analyses import analysis_of
from upd.analyses.forced.solve import ForcedSolution
from upd.progress import Stages
from upd.results import Case, InputPart, Result
from upd.scene import load_scene
from upd.vary.inputs import input_parts

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
    assert Result("q", Case(), 2.0, "N").as_dict()["input_parts"] == []


def test_sphere_in_closed_form(tmp_path: Path) -> None:
    """Hertz: p_0 ~ F^(1/3) E*^(2/3), d ~ F^(2/3) E*^(-2/3), K_N ~ F^(1/3) E*^(2/3); of one of two
    like bodies E* takes half. Solved again at both ends of the intervals, on half the divisions.
    """
    inputs = {"loads.normal": ["200 N +- 10 N"], "materials.sphere.E": "200 GPa +- 5 %"}
    with no_figures():
        result = upd.run("hertz", overrides=SPHERE | inputs, out=tmp_path / "run", report=False)
    force, modulus = 0.05, 0.025
    for name, of_force, of_modulus in (
        ("max_pressure", 1 / 3, 2 / 3),
        ("approach", 2 / 3, 2 / 3),
        ("radius_moment", 1 / 3, 1 / 3),
        ("K_N_tangent", 1 / 3, 2 / 3),
    ):
        row = next(r for r in result.rows if r.name == name)
        shares = {part.path: abs(part.change) for part in row.inputs}
        # six divisions: a stiffness scatters with the nodes of its edge
        assert shares["loads.normal[0]"] == pytest.approx(of_force * force, rel=0.03)
        assert shares["materials.sphere.E"] == pytest.approx(of_modulus * modulus, rel=0.03)
        assert row.input_error == pytest.approx(math.hypot(*shares.values()))
        assert "divisions 6" in row.inputs[0].basis
    told = json.loads((tmp_path / "run" / "summary.json").read_text())["results"]
    assert any(one["input_parts"] for one in told)
    again = load_scene(tmp_path / "run" / "scene.toml")
    assert {one.given for one in again.uncertain.values()} == {"200 N +- 10 N", "200 GPa +- 5 %"}


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
