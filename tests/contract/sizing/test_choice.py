"""`upd design --minimise` and `upd.design(minimise=...)` on a toy: against runs, going on where it
was, parameters that make other rigs, what is refused.
"""

from __future__ import annotations

import importlib.util
import json
import math
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from rigs import LINES

import upd
from tests.pictures import png_size
from upd import cli
from upd.analyses.forced import peaks
from upd.analyses.forced.curves import point_limit
from upd.errors import InputError
from upd.scene import load_scene
from upd.sizing import BestDamper, search
from upd.sizing.choice import is_along, sensitivities
from upd.sizing.ranges import read_ranges
from upd.sizing.worst_peak import WorstPeak

#: a rig of six contact points that is reduced at once
TOY: Mapping[str, Any] = {
    **LINES,
    "mesh.element": "hex8i",
    "geometry.refine": 0.5,
    "contact.stiffness": ["thesis"],
    "contact.columns": 1,
    "contact.static": "frictionless",
    "reduction.modes": 4,
    "balance.harmonics": 1,
    "balance.method": "balance",
    "excitation.points": 60,
    "excitation.centrifugal_to_force": [280.0],
}
OVER, FORCE = "damper.centrifugal=4:20", "excitation.force=1:1.5"


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as end:
        cli.main(list(arguments))
    return int(end.value.code or 0)


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> BestDamper:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("UPD_CACHE", str(tmp_path_factory.mktemp("cache")))
        return upd.design(
            "asymmetric-response", minimise="peak", over=OVER, for_=FORCE, overrides=TOY
        )


@pytest.fixture(scope="module")
def runs() -> ModuleType:
    """The benchmarks' check of a choice by a grid of runs."""
    path = Path(__file__).parents[3] / "benchmarks" / "choice_grid.py"
    spec = importlib.util.spec_from_file_location("choice_grid", path)
    assert spec is not None and spec.loader is not None
    module = sys.modules["choice_grid"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.usefixtures("without_pictures")
def test_worst_peaks_are_those_of_runs(
    found: BestDamper, runs: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Runs through `upd sweep`, whose peaks are read from whole curves at F_C and F_E themselves:
    the scaling, the peaks of whole curves and their worst at once.
    """
    # the choice follows the balance's peaks: runs need not confirm theirs
    monkeypatch.setattr(peaks, "confirmed", lambda plan, model, curve: curve)
    grid = runs.check_by_grid(found, 3, tmp_path / "grid", workers=0)
    assert grid.values == pytest.approx(np.geomspace(4.0, 20.0, 3))
    told = [math.exp(found.best.worst.read(math.log(F_C))) for F_C in grid.values]
    assert grid.heights == pytest.approx(told, rel=1e-2)
    assert found.worst <= grid.heights.min() * 1.01
    assert grid.processor_seconds > 0.0
    assert grid.within(found.centrifugal)
    # as many frequencies as the narrowest stuck peak needs, not the scene's 60
    plan, model = next(runs.rig_models(found))
    e, limit = plan.scene.excitation, point_limit(plan, model, True)
    narrowest = limit.width[(limit.modes > e.start) & (limit.modes < e.stop)].min()
    points = runs.grid_scene(found).excitation.points
    assert points > 60 and 0.24 < (e.stop - e.start) / (points - 1) / narrowest <= 0.25


def test_what_is_told(found: BestDamper, tmp_path: Path) -> None:
    numbers = json.loads(json.dumps(found.write(tmp_path / "out").as_dict()))
    assert {file.name for file in (tmp_path / "out").iterdir()} == {
        "choice.png",
        "report.html",
        "summary.json",
    }
    assert numbers == json.loads((tmp_path / "out" / "summary.json").read_text())
    optima, deciding, _ = numbers["tables"]
    assert optima["rows"][0][1:3] == [found.centrifugal, found.worst]
    assert deciding["rows"][0][4] == pytest.approx(found.worst, rel=1e-2)
    wide, tall = png_size((tmp_path / "out" / "choice.png").read_bytes())
    assert wide > tall > 400
    page = (tmp_path / "out" / "report.html").read_text()
    assert "worst peak" in page and "data:image/webp" in page
    text = found.table()
    assert text.startswith(f"{found.ranges.scene.name}: worst peak")
    sentences = " ".join(text.split())
    assert "best for" in sentences and "47 g as meshed" in sentences
    assert "whole curves by harmonic balance" in sentences
    assert max(map(len, text.splitlines())) <= 79


def test_what_an_optimum_has_in_the_others_place_may_be_unknown(found: BestDamper) -> None:
    told = replace(found, robust_at_nominal=math.nan, nominal_at_worst=math.nan)
    assert str(told).count("not known") == 2
    assert "nan" not in str(told).lower()
    assert "NaN" not in json.dumps(told.as_dict())


def test_robustness_costs_and_pays(found: BestDamper) -> None:
    """The robust optimum is no better than the nominal one at the scene's values, and no worse over
    the ranges.
    """
    one = found
    assert one.robust_at_nominal >= math.exp(one.plain.nominal.log_worst) * (1 - 1e-3)
    assert one.worst <= one.nominal_at_worst * (1 + 1e-3)


@pytest.fixture(scope="module")
def inner(tmp_path_factory: pytest.TempPathFactory) -> BestDamper:
    """A choice with its optimum within the range of F_C, where two peaks decide."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("UPD_CACHE", str(tmp_path_factory.mktemp("inner")))
        return upd.design(
            "symmetric-response",
            minimise="peak",
            over="damper.centrifugal=36:46",
            for_="excitation.force=0.5:5",
            overrides=TOY,
        )


def test_ends_of_the_force_decide_an_optimum_from_both_sides(inner: BestDamper) -> None:
    """A lower least force raises one of the peaks that decide, a higher largest one the other."""
    assert inner.best.best.status == "found"
    told = {one.path: one for one in sensitivities(inner)}
    low, high = (told[f"excitation.force, {word}"] for word in ("lowest", "highest"))
    assert low.below < -0.1
    assert high.above > 0.1


def test_ends_of_the_force_count_as_f_c_at_a_bound(found: BestDamper) -> None:
    """There the worst peak still changes by F_C, and by both ends together as much the other way,
    but for what curves between the ends of the window have.
    """
    assert found.best.best.status == "at the lower bound"
    told = {one.path: one for one in sensitivities(found)}
    ends = sum(told[f"excitation.force, {word}"].below for word in ("lowest", "highest"))
    assert ends == pytest.approx(-told["damper.centrifugal"].above, abs=1e-2)
    assert ends < -1e-2


def test_the_worst_peak_has_grown_by_5_per_cent_at_the_ends_told(inner: BestDamper) -> None:
    (one,) = [one for one in sensitivities(inner) if one.path == "damper.centrifugal"]
    low, high = one.within[0]
    assert low < inner.centrifugal < high
    at = [math.exp(inner.best.worst.read(math.log(F_C))) for F_C in (low, high)]
    assert at == pytest.approx([1.05 * inner.worst] * 2, rel=5e-3)


def test_called_again_it_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a killed call has solved is not solved again."""
    monkeypatch.setenv("UPD_CACHE", str(tmp_path))
    asked: dict[str, Any] = {
        "minimise": "peak",
        "over": "damper.centrifugal=7:8",
        "overrides": TOY,
    }
    begun: list[str] = []

    def stop(stage: str, detail: str, seconds: float | None) -> None:
        begun.append(detail)
        if "F_C/F_E" in detail and sum("F_C/F_E" in one for one in begun) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        upd.design("asymmetric-response", progress=stop, **asked)
    on = upd.design("asymmetric-response", **asked)
    assert on.resumed >= 1
    again = upd.design("asymmetric-response", **asked)
    assert again.curves == 0
    assert again.centrifugal == pytest.approx(on.centrifugal, rel=1e-4)


def test_uncertain_friction(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The worst of all its values counts; its slope is that between the rigs."""
    monkeypatch.setenv("UPD_CACHE", str(tmp_path))
    one = upd.design(
        "asymmetric-response",
        minimise="peak",
        over="damper.centrifugal=7:8",
        for_={"contact.friction": "0.59:0.61"},
        overrides=TOY,
    )
    values = [w for w, _ in one.best.rigs]
    assert values[:3] == [(0.59,), (0.6,), (0.61,)]
    c = one.best.best.log_centrifugal
    told = next(s for s in sensitivities(one) if s.path.startswith("contact.friction"))
    y = [WorstPeak([rig], one.ranges.forces).read(c) for _, rig in one.best.rigs[:3]]
    assert one.worst == pytest.approx(math.exp(max(y)), rel=1e-3)
    # here the most friction is the worst
    assert int(np.argmax(y)) == 2
    assert told.below == pytest.approx((y[2] - y[1]) / math.log(0.61 / 0.6))
    assert math.isnan(told.above)


def test_another_parameter_is_chosen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Friction chosen at the scene's F_C: the lowest of all that were tried."""
    monkeypatch.setenv("UPD_CACHE", str(tmp_path))
    one = upd.design(
        "asymmetric-response",
        minimise="acceleration",
        over="contact.friction=0.5:0.6",
        overrides=dict(TOY) | {"damper.centrifugal": "7 N"},
    )
    assert len(one.tried) >= 5
    assert one.worst == pytest.approx(min(math.exp(t.best.log_worst) for t in one.tried))
    assert one.centrifugal == pytest.approx(7.0)
    assert one.refused == ()
    assert math.isfinite(one.nominal_at_worst)
    told = sensitivities(one)[0]
    assert told.path == "contact.friction"
    assert (told.value,) == one.best.values


def test_several_parameters_are_chosen_and_stood(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing that was tried is lower, and all corners count."""
    monkeypatch.setenv("UPD_CACHE", str(tmp_path))
    monkeypatch.setattr(search, "GRID", 2)
    monkeypatch.setattr(search, "MORE", 2)
    left, right = "stiffness.thesis.left.K_T", "stiffness.thesis.right.K_T"
    one = upd.design(
        "asymmetric-response",
        minimise="peak",
        over={"contact.friction": "0.5:0.6", left: "0.9e6 N/mm:1.1e6 N/mm"},
        for_={right: "1.45e5 N/mm:1.55e5 N/mm", "excitation.damping": "0.49 %:0.51 %"},
        overrides=dict(TOY) | {"damper.centrifugal": "7 N"},
    )
    assert one.worst == pytest.approx(min(math.exp(t.best.log_worst) for t in one.tried))
    for k, shape in enumerate(one.ranges.shapes):
        line = one.along(k)
        assert len(line) >= 3 and line[0][0] >= shape.low and line[-1][0] <= shape.high
        assert all(one.worst <= math.exp(t.best.log_worst) * (1.0 + 1e-9) for _, t in line)
    corners = [w for w, _ in one.best.rigs]
    assert len(corners) == 5 and {w[1] for w in corners} == {0.0049, 0.005, 0.0051}
    c = one.best.best.log_centrifugal
    each = [WorstPeak([rig], one.ranges.forces).read(c) for _, rig in one.best.rigs]
    assert one.worst == pytest.approx(math.exp(max(each)), rel=1e-3)
    # the slopes told are those to the corners next to the worst
    told = {s.path: s for s in sensitivities(one)}
    worst = corners[int(np.argmax(each))]
    for k, path in enumerate((right, "excitation.damping")):
        near = {w[k]: y for w, y in zip(corners, each, strict=True) if is_along(w, worst, k)}
        (a, y), (b, z) = sorted(near.items())
        slopes = [told[f"{path}, worst"].below, told[f"{path}, worst"].above]
        known = [slope for slope in slopes if math.isfinite(slope)]
        assert known == pytest.approx([(z - y) / math.log(b / a)])


@pytest.mark.usefixtures("without_pictures")
def test_a_grid_of_one_of_several(
    runs: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Over F_C with the other input at its optimum; every run counts for all F_C in whose window
    its F_C/F_E is.
    """
    monkeypatch.setenv("UPD_CACHE", str(tmp_path))
    # one harmonic is what time integration leaves: runs tell the balance here, as the choice does
    monkeypatch.setattr(peaks, "confirmed", lambda plan, model, curve: curve)
    monkeypatch.setattr(search, "GRID", 2)
    monkeypatch.setattr(search, "MORE", 2)
    one = upd.design(
        "asymmetric-response",
        minimise="peak",
        over=["contact.friction=0.55:0.6", "damper.centrifugal=6:9"],
        for_=FORCE,
        overrides=TOY,
    )
    grid = runs.check_by_grid(one, 3, tmp_path / "grid", workers=0)
    assert grid.path == "damper.centrifugal"
    assert runs.grid_scene(one).contact.friction == pytest.approx(one.best.values[0])
    told = [math.exp(one.best.worst.solved(math.log(F_C))) for F_C in grid.values]
    assert grid.heights == pytest.approx(told, rel=1e-2)
    assert one.worst <= grid.heights.min() * 1.01


def test_ranges_are_read_together() -> None:
    scene = load_scene("asymmetric-response", TOY)
    with pytest.raises(InputError) as told:
        read_ranges(
            scene,
            ["damper.centrifugal=2000:50", "damper.mss=1 g:2 g", "excitation.force=1:2"],
            ["contact.friction=0.3", "damper.centrifugal=1 mm:2 mm"],
        )
    text = str(told.value)
    for problem in (
        "the lower one first",
        "damper.mss: is no scalar input",
        "excitation is not chosen",
        "is no range; write low:high",
        "is a unit of length; a force is needed here",
    ):
        assert problem in text
    one = read_ranges(scene, "damper.centrifugal=0.05 kN:2000", FORCE)
    assert (one.over[0].low, one.over[0].high) == pytest.approx((50.0, 2000.0))
    # as a scene reads it, and numbers of arrays are numbers
    assert one.over[0].text(np.float64(45.1)) == "45.1 N"
    assert one.forces == (1.0, 1.5)
    assert one.nominal_forces == pytest.approx((1.25, 1.25))
    with pytest.raises(InputError, match="given twice"):
        read_ranges(scene, ["damper.centrifugal=1:2", "damper.centrifugal=2:3"], ())


def test_speed_sets_the_force() -> None:
    """F_C = m r w^2: a range of speed is one of F_C, squared."""
    turning = {
        "damper.centrifugal": "from speed",
        "damper.radius": "300 mm",
        "damper.speed": "4000 rpm",
    }
    scene = load_scene("asymmetric-response", dict(TOY) | turning)
    one = read_ranges(scene, "damper.speed=2000 rpm:8000 rpm", ()).over[0]
    assert one.only_centrifugal
    assert one.centrifugal(one.high, scene) == pytest.approx(4.0 * scene.damper.centrifugal)
    assert one.value_at(one.centrifugal(one.low, scene), scene) == pytest.approx(one.low)
    with pytest.raises(InputError, match="follows from mass, radius and speed"):
        read_ranges(scene, OVER, ())
    with pytest.raises(InputError, match="each sets F_C alone"):
        read_ranges(scene, ["damper.speed=2000 rpm:8000 rpm", "damper.radius=200:300"], ())


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("balance.method=march", 'set "balance"'),
        ("contact.fit=unloaded", 'contact.fit="loaded"'),
        ("accuracy=2 %", "a choice keeps one mesh"),
    ],
)
def test_scenes_without_peaks_over_the_ratio(setting: str, told: str) -> None:
    with pytest.raises(InputError, match=told):
        upd.design(
            load_scene("symmetric-response", [setting]), minimise="peak", over=OVER, for_=FORCE
        )


def test_command_refuses(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("design", "symmetric-response", "--over", OVER) == 2
    assert "add --minimise peak" in " ".join(capsys.readouterr().err.split())
    assert call("design", "symmetric-response", "--minimise", "peak") == 2
    assert "nothing to choose" in " ".join(capsys.readouterr().err.split())
    assert call("design", "hertz", "--minimise", "peak", "--over", OVER) == 2
    with pytest.raises(InputError, match="add minimise"):
        upd.design("symmetric-response", over=OVER)  # type: ignore[call-overload]
