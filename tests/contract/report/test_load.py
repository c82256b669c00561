"""A run folder read back: the result it was written from, and its curves as text."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import upd
from upd.errors import InputError
from upd.labels import file_name
from upd.report import notebook
from upd.report.folder import read_run
from upd.report.notebook import RunResult, write_curves

SCENES = ("hertz", "symmetric", "rig")


@pytest.fixture(scope="module", params=SCENES)
def run(request: pytest.FixtureRequest, small_run: Callable[[str], RunResult]) -> RunResult:
    return small_run(request.param)


def _same(ours: object, theirs: object) -> bool:
    return json.dumps(ours, default=float) == json.dumps(theirs, default=float)


def test_result_is_the_one_the_run_returned(run: RunResult) -> None:
    assert run.folder is not None
    again = upd.load(run.folder)
    assert isinstance(again, upd.RunResult)
    assert _same(again.summary(), run.summary())
    assert [r.case for r in again.results] == [r.case for r in run.results]
    assert [(c.name, c.verdict, c.fatal, c.sentence) for c in again.checks] == [
        (c.name, c.verdict, c.fatal, c.sentence) for c in run.checks
    ]
    assert (again.scene_text, again.outcome) == (run.scene_text, run.outcome)
    assert str(again) == str(run)
    row = run.results[-1]
    assert again.value(row.name, row.case) == row.value


def test_arrays_and_charts_are_those_of_the_run(run: RunResult) -> None:
    assert run.folder is not None
    again = upd.load(run.folder)
    assert list(again.arrays) == list(run.arrays)
    for name, group in run.arrays.items():
        theirs = again.arrays[name]
        assert theirs.attributes == group.attributes
        assert list(theirs) == list(group)
        for key, variable in group.items():
            np.testing.assert_array_equal(theirs[key].data, variable.data)
            assert (theirs[key].dims, theirs[key].units) == (variable.dims, variable.units)
    ours, theirs_too = notebook.charts(run), notebook.charts(again)
    assert [(c.title, c.case) for c in ours] == [(c.title, c.case) for c in theirs_too]


def test_no_run_folder_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no run folder"):
        upd.load(tmp_path)


def test_withheld_number_stays_withheld(run: RunResult, tmp_path: Path) -> None:
    assert run.folder is not None
    summary = json.loads((run.folder / "summary.json").read_text(encoding="utf-8"))
    summary["results"][0] |= {"value": None, "withheld": "the path stopped"}
    del summary["sha256"]
    (tmp_path / "summary.json").write_text(json.dumps(summary), encoding="utf-8")
    again = upd.load(tmp_path)
    assert again.results[0].withheld == "the path stopped"
    assert math.isnan(again.results[0].value)
    assert again.results[1].case == run.results[1].case


def _read(path: Path) -> dict[str, np.ndarray]:
    with path.open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    return dict(zip(head, np.array(rows, float).T, strict=True))


def test_curves_hold_every_digit_and_their_units(run: RunResult) -> None:
    assert run.folder is not None
    files = sorted((run.folder / "curves").glob("*.csv"))
    assert files
    if run.scene.startswith("hertz"):
        curve = _read(run.folder / "curves" / "force_approach.csv")
        group = run.arrays["force-approach"]
        np.testing.assert_array_equal(curve["approach [mm]"], group["approach"].data)
        np.testing.assert_array_equal(curve["normal_force [N]"], group["normal_force"].data)
        # the computed fields, with their places, beside the closed forms
        label = run.results[0].case.label
        file, group = file_name(label), run.arrays[label]
        places = _read(run.folder / "curves" / f"{file}.csv")
        np.testing.assert_array_equal(places["pressure [MPa]"], group["pressure"].data.ravel())
        top = np.argmax(places["pressure [MPa]"])
        i, j = np.unravel_index(top, group["pressure"].data.shape)
        assert places["x [mm]"][top] == group["x"].data[i]
        assert places["y [mm]"][top] == group["y"].data[j]
    if run.scene.startswith("rig"):
        curve = _read(run.folder / "curves" / "response_free.csv")
        group = run.arrays["response free"]
        value = group["accelerance_right"].data
        unit = "[(m/s2)/N]"
        np.testing.assert_array_equal(curve["frequency [Hz]"], group["frequency"].data)
        np.testing.assert_array_equal(curve[f"accelerance_right imaginary {unit}"], value[:, 1])
        np.testing.assert_allclose(
            curve[f"accelerance_right amplitude {unit}"], np.abs(value @ [1.0, 1.0j]), rtol=1e-14
        )


def test_every_curve_of_the_arrays_has_a_file(run: RunResult, tmp_path: Path) -> None:
    assert run.folder is not None
    files = write_curves(read_run(run.folder).arrays, tmp_path)
    assert [f.name for f in files] == list(dict.fromkeys(f.name for f in files)), "overwritten"
    assert {f.name for f in files} == {f.name for f in (run.folder / "curves").iterdir()}


def test_hysteresis_loops_are_columns_of_one_file(tmp_path: Path) -> None:
    from upd.results import Group, variable

    loop = np.arange(6.0).reshape(2, 3)
    group = Group({"loop_displacement": variable("loop sample", loop, "mm")})
    (path,) = write_curves({"friction own": group}, tmp_path)
    curve = _read(path)
    assert list(curve) == ["loop_displacement loop 1 [mm]", "loop_displacement loop 2 [mm]"]
    np.testing.assert_array_equal(curve["loop_displacement loop 2 [mm]"], loop[1])
