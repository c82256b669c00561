"""A run's result in a notebook: text, table, figure, xarray.

And an import that does not make one wait.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from types import ModuleType

import matplotlib as mpl
import numpy as np
import pytest

from upd.errors import InputError
from upd.report import notebook
from upd.report.folder import read_run
from upd.report.notebook import RunResult
from upd.report.tables import analysis_charts
from upd.results.check import status_of


@pytest.fixture(scope="module")
def sphere(small_run: Callable[[str], RunResult]) -> RunResult:
    return small_run("hertz")


@pytest.fixture(autouse=True)
def no_window() -> Iterator[None]:
    import matplotlib.pyplot as plt

    before = mpl.get_backend()
    plt.switch_backend("Agg")
    yield
    plt.close("all")
    plt.switch_backend(before)


def test_text_says_how_it_ended_and_the_main_numbers(sphere: RunResult) -> None:
    lines = repr(sphere).splitlines()
    pressure = f"{sphere.value('max_pressure'):.5g} MPa"
    assert lines[0].startswith(f"hertz: ok - maximum pressure {pressure} (Hertz 2654, ")
    assert lines[-1] == "... .table()"
    assert any(line.startswith("radius, second moment ") for line in lines)


@pytest.mark.parametrize("columns", [80, 120])
def test_print_has_ten_lines_and_the_table_all(
    sphere: RunResult, columns: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However many numbers and warnings a run has."""
    monkeypatch.setenv("COLUMNS", str(columns))
    bad = [replace(check, value=2.0, limit=1.0, fatal=False) for check in sphere.checks]
    warned = replace(sphere, checks=bad, folder=None, status=status_of(bad, sphere.results))
    for result in (sphere, warned):
        lines = repr(result).splitlines()
        assert 5 < len(lines) <= 10
        assert all(len(line) <= columns for line in lines if "folder" not in line)
    assert lines[0].startswith("hertz: ok with warnings") and lines[-1] == "... .table()"
    assert len(sphere.table().splitlines()) > 40


def test_a_number_of_several_cases_asks_for_one(sphere: RunResult) -> None:
    row = next(r for r in sphere.results if r.name == "max_pressure")
    other = replace(row, case=replace(row.case, load=1.0), value=1.0)
    two = replace(sphere, results=[*sphere.results, other])
    with pytest.raises(InputError, match=r"max_pressure has several cases.*F=1 N"):
        two.value("max_pressure")
    assert two.value("max_pressure", "F=1 N") == 1.0


def test_failed_checks_are_named(sphere: RunResult) -> None:
    first = replace(sphere.checks[0], value=2.0, limit=1.0)
    checks = (first, *sphere.checks[1:])
    status = status_of(checks, sphere.results)
    bad = replace(sphere, checks=checks, status=status)
    assert repr(bad).startswith(f"hertz: failed: {first.name}")


def test_result_without_rows_and_arrays(sphere: RunResult) -> None:
    empty = replace(sphere, results=(), arrays={}, checks=(), effects=(), folder=None)
    assert "all 0 numbers" in repr(empty)
    with pytest.raises(InputError, match="no arrays to draw"):
        empty.plot()


def test_figure_of_the_main_charts(sphere: RunResult) -> None:
    axes = sphere.plot()
    titles = [ax.get_title() for ax in axes]
    assert titles[0] == "Contact pressure: F=200 N"
    assert len({t.partition(":")[0] for t in titles}) == len(titles) <= 6
    assert all(", " in ax.get_xlabel() for ax in axes)
    assert all(", " in ax.get_ylabel() for ax in axes)
    assert len({ax.figure for ax in axes}) == 1


def test_one_chart_on_own_axes(sphere: RunResult) -> None:
    from matplotlib.figure import Figure

    ax = Figure().add_subplot()
    assert sphere.plot("force over approach", ax=ax) == [ax]
    force = ax.get_lines()[0].get_ydata()
    np.testing.assert_allclose(np.max(np.asarray(force, float)), 200.0)
    (alone,) = sphere.plot("hysteresis", case="F=200 N T/muN=0.75")
    assert alone.get_title() == "Hysteresis: F=200 N T/µN=0.75"


def test_unknown_charts_are_told(sphere: RunResult) -> None:
    from matplotlib.figure import Figure

    with pytest.raises(InputError, match="no chart 'modes'; there are Contact pressure, "):
        sphere.plot("modes")
    with pytest.raises(InputError, match="no chart of the case 'F=1 N', did you mean 'F=200 N'"):
        sphere.plot("contact pressure", case="F=1 N")
    with pytest.raises(InputError, match="give title and case"):
        sphere.plot(ax=Figure().add_subplot())


@pytest.mark.parametrize("scene", ["hertz", "symmetric", "rig"])
def test_charts_are_those_of_the_run_folder(
    scene: str, small_run: Callable[[str], RunResult]
) -> None:
    result = small_run(scene)
    assert result.folder is not None
    run = read_run(result.folder)
    mine, theirs = notebook.charts(result), analysis_charts(run.arrays, run.summary)
    assert [(c.title, c.case) for c in mine] == [(c.title, c.case) for c in theirs]
    for a, b in zip(mine, theirs, strict=True):
        for ta, tb in zip(a.traces, b.traces, strict=True):
            np.testing.assert_array_equal(ta.y, tb.y)
    assert len(result.plot()) == min(6, len({c.title for c in mine})) > 0
    assert scene in repr(result)


def test_a_name_or_case_that_is_nearly_right_is_named(sphere: RunResult) -> None:
    with pytest.raises(InputError, match="no result 'max_presure', did you mean 'max_pressure'"):
        sphere.value("max_presure")
    with pytest.raises(InputError, match="for case 'F=201 N', did you mean 'F=200 N'"):
        sphere.value("max_pressure", "F=201 N")
    assert "maximum pressure" in sphere.table()


def test_datasets_have_dimensions_and_units(
    sphere: RunResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a stand-in that keeps what xarray.Dataset is given."""
    stand_in = ModuleType("xarray")
    stand_in.Dataset = lambda variables, attrs: {"variables": variables, "attrs": attrs}  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "xarray", stand_in)
    found = sphere.to_xarray()
    assert list(found) == list(sphere.arrays)
    dims, pressure, attributes = found["F=200 N"]["variables"]["pressure"]
    assert dims == ("x", "y")
    assert pressure.shape == (9, 9)
    assert attributes["units"] == "MPa"


def test_xarray_itself(sphere: RunResult) -> None:
    xarray = pytest.importorskip("xarray")
    data = sphere.to_xarray()["F=200 N"]
    assert isinstance(data, xarray.Dataset)
    assert set(data.coords) >= {"x", "y"}
    assert float(data.normal_force.sum()) == pytest.approx(200.0, rel=1e-9)


def test_import_is_fast_and_loads_nothing_heavy() -> None:
    heavy = (
        "numpy",
        "scipy",
        "matplotlib",
        "numba",
        "pydantic",
        "gmsh",
        "skfem",
        "h5py",
        "jinja2",
        "plotly",
        "rich",
    )
    code = (
        "import sys, time; t = time.process_time(); import upd; t = time.process_time() - t; "
        f"print(t, [m for m in {heavy} if m in sys.modules])"
    )
    told = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout
    seconds, loaded = told.split(maxsplit=1)
    assert loaded.strip() == "[]"
    assert float(seconds) < 0.5
