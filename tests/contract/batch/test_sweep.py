"""Sweeps: grids, one row per point, shared condensations, the same table whoever solves it, only
missing points run again.
"""

import csv
import json
import math
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np
import pytest

from upd import load_scene, run
from upd.batch.engine import Progress
from upd.batch.plan import parse_axes, places, settings
from upd.batch.point import Task, solve_task
from upd.batch.store import PointStore
from upd.batch.sweeps import sweep
from upd.batch.table import csv_text, make_columns, reasons
from upd.cache.arrays import Store, active
from upd.cli import main
from upd.errors import InputError
from upd.reduction.guyan import stored_condensation
from upd.results import Case, Result
from upd.results.case import shared_label
from upd.vary.outcome import Outcome, read_outcome

pytestmark = pytest.mark.usefixtures("without_pictures")

SCENE = {
    "contact": {"friction": 0.6},
    "loads": {"normal": ["50 N"], "centrifugal": "350 N"},
    "mesh": {"element": "hex8i"},
}
#: A quick scene: a pressed half-sphere with 8 elements along the patch.
TINY = {
    "geometry.divisions": 8,
    "want": ["normal", "tangential"],
    "loads.tangential": [0.5],
    "geometry.core_depth": 0.2,
    "left_out.solve": "no",
}


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Nothing of other tests may be found, nor left behind."""
    where = tmp_path_factory.mktemp("cache")
    monkeypatch.setenv("UPD_CACHE", str(where))
    return where


def table(folder: Path) -> list[list[str]]:
    """The table without the seconds, which nobody can repeat."""
    with (folder / "table.csv").open(encoding="utf-8") as file:
        return [row[:-1] for row in csv.reader(file)]


@pytest.mark.parametrize(
    ("text", "values", "unit"),
    [
        ("contact.friction=0.1:0.6:6", (0.1, 0.2, 0.3, 0.4, 0.5, 0.6), ""),
        ("contact.friction=0.1,0.35", (0.1, 0.35), ""),
        ("contact.friction=0.01:1:3:log", (0.01, 0.1, 1.0), ""),
        ("loads.centrifugal=100:800:3", ("100 N", "450 N", "800 N"), "N"),
        ("loads.centrifugal=100 N:800 N:3", ("100 N", "450 N", "800 N"), "N"),
        ("loads.centrifugal=0.1 kN:0.8 kN:2", ("0.1 kN", "0.8 kN"), "kN"),
        ("loads.normal=20,30 N", ("20 N", "30 N"), "N"),
        ("geometry.divisions=8:12:3", (8, 10, 12), ""),
        ("geometry.divisions=8:11:3", (8.0, 9.5, 11.0), ""),
    ],
)
def test_axis_values(text: str, values: tuple[Any, ...], unit: str) -> None:
    (axis,) = parse_axes([text], SCENE)
    assert axis.values == values
    assert axis.unit == unit
    assert axis.numbers == tuple(float(str(v).split()[0]) for v in values)
    assert axis.wrapped == text.startswith("loads.normal")


def test_words_make_an_axis_without_numbers() -> None:
    (axis,) = parse_axes(["mesh.element=hex8i, hex20"], SCENE)
    assert axis.values == ("hex8i", "hex20")
    assert axis.numbers is None


@pytest.mark.parametrize(
    ("texts", "told"),
    [
        ([], "is missing"),
        (["contact.friction"], "write path="),
        (["contact.friction="], "write path="),
        (["contact.friction=0.1:0.6"], "write path="),
        (["contact.friction=0.1:0.6:0"], "write path="),
        (["contact.friction=0.1:0.6:2.5"], "write path="),
        (["contact.friction=0.1:0.6:3:lin"], "write path="),
        (["contact.friction=0:1:3:log"], "positive ends"),
        (["contact.friction=0.1,,0.3"], "between the commas"),
        (["contact.friction=0.3,0.3"], "is duplicated"),
        (["contact.friction=0.3:0.3:2"], "is duplicated"),
        (["contact.friction=0.1,0.2", "contact.friction=0.3"], "is duplicated"),
        (["loads.centrifugal=100 N:0.8 kN:3"], "give both in one unit"),
        (["contact.friction=0:1:999", "loads.centrifugal=1:900:900"], "more than"),
    ],
)
def test_bad_axes_are_told(texts: list[str], told: str) -> None:
    with pytest.raises(InputError, match=told):
        parse_axes(texts, SCENE)


def test_all_faults_of_the_axes_at_once() -> None:
    with pytest.raises(InputError) as caught:
        parse_axes(["a=1:2", "b=3,3"], SCENE)
    assert "--vary a=1:2" in str(caught.value)
    assert "--vary b" in str(caught.value)


def test_grid_is_the_full_factorial_last_axis_fastest() -> None:
    axes = parse_axes(["contact.friction=0.1,0.2", "loads.normal=10 N,20 N,30 N"], SCENE)
    grid = places(axes)
    assert grid == [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)]
    assert settings(axes, grid[4]) == {"contact.friction": 0.2, "loads.normal": ["20 N"]}


def test_numbers_are_those_of_single_runs_and_the_table_says_all(tmp_path: Path) -> None:
    vary = ["contact.friction=0.2,0.5", "loads.normal=40 N,60 N"]
    found = sweep(
        "hertz", vary, overrides=TINY, out=tmp_path, workers=0, follow=["max_pressure", "stick_r*"]
    )
    assert not found.failed
    rows = table(tmp_path)
    assert rows[0][:3] == ["contact.friction", "loads.normal [N]", "max_pressure (F=* N) [MPa]"]
    assert rows[0][-3:] == ["status", "reason", "warnings"]
    assert len(rows) == 5
    for row in rows[1:]:
        single = run(
            "hertz",
            overrides=[
                *(f"{k}={json.dumps(v)}" for k, v in TINY.items()),
                f"contact.friction={row[0]}",
                f'loads.normal=["{row[1]} N"]',
            ],
        )
        # Threads may differ, hence rounding: eps times the condition of the condensations.
        assert float(row[2]) == pytest.approx(single.value("max_pressure"), rel=1e-9)
        assert float(row[3]) == pytest.approx(single.value("stick_radius"), rel=1e-9)


def test_every_number_of_the_table_is_that_of_its_point(tmp_path: Path) -> None:
    grid = ["contact.friction=0.2,-1,0.4", "loads.normal=40 N:60 N:2"]
    made = sweep("hertz", grid, overrides=TINY, out=tmp_path, workers=0, follow=["*"])
    with (tmp_path / "table.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    data = json.loads((tmp_path / "sweep.json").read_text("utf-8"))
    assert len(rows) == len(data["points"]) == 6
    compared = 0
    for row, point in zip(rows, data["points"], strict=True):
        if not point["file"]:
            assert row["status"] == "failed"
            assert not any(row[column.header] for column in made.columns)
            continue
        kept = json.loads((tmp_path / point["file"]).read_text("utf-8"))["results"]
        numbers = [(r["name"], r["value"]) for r in kept]
        written = [(c.name, row[c.header]) for c in made.columns]
        # Every number of the point stands in the table, with all its digits, and no other.
        assert sorted((name, repr(value)) for name, value in numbers) == sorted(
            (name, repr(float(text))) for name, text in written if text
        )
        assert point["values"] == [float(text) if text else None for _, text in written]
        compared += len(numbers)
    assert compared > 40


def test_netcdf_has_named_axes_and_nan_for_failures(tmp_path: Path) -> None:
    vary = ["contact.friction=-0.1,0.5", "loads.normal=40 N,60 N,80 N", "mesh.element=hex8i,hex8"]
    found = sweep(
        "hertz",
        vary,
        overrides={**TINY, "want": ["normal"]},
        out=tmp_path,
        workers=0,
        follow=["max_pressure"],
    )
    with h5netcdf.File(tmp_path / "sweep.nc", "r") as file:
        assert dict(file.dimensions.items()).keys() == {"friction", "normal", "element"}
        np.testing.assert_array_equal(file["friction"][...], [-0.1, 0.5])
        np.testing.assert_array_equal(file["normal"][...], [40.0, 60.0, 80.0])
        assert file["normal"].attrs["units"] == "N"
        assert file["element"].attrs["flag_meanings"] == "hex8i hex8"
        pressure = file["max_pressure_F_N"]
        assert pressure.dimensions == ("friction", "normal", "element")
        assert pressure.attrs["units"] == "MPa"
        values = pressure[...]
        assert np.isnan(values[0]).all()
        np.testing.assert_array_equal(values.ravel(), found.column("max_pressure").values)
        np.testing.assert_array_equal(file["status"][...], np.isnan(values))
    summary = json.loads((tmp_path / "sweep.json").read_text(encoding="utf-8"))
    assert [point["status"] for point in summary["points"]] == 6 * ["failed"] + 6 * ["ok"]
    assert "friction" in summary["points"][0]["reason"]


def test_failing_point_is_a_row_with_its_reason_and_is_not_run_again(tmp_path: Path) -> None:
    # At 5 kN the contact outgrows the patch: a self-check refuses the numbers.
    vary = ["loads.normal=50 N,5000 N"]
    found = sweep("hertz", vary, overrides=TINY, out=tmp_path, workers=0)
    assert found.failed == [1]
    row = table(tmp_path)[2]
    assert row[-3] == "failed"
    assert "patch rim" in row[-2]
    assert set(row[1:-3]) == {""}
    again = sweep("hertz", vary, overrides=TINY, out=tmp_path, workers=0)
    assert sorted(again.plan.kept) == [0, 1]


def test_only_missing_points_run(tmp_path: Path) -> None:
    """Also of a wider grid, in a new folder that was given the finished points."""
    one, two = tmp_path / "one", tmp_path / "two"
    first = sweep("hertz", ["contact.friction=0.2,0.4"], overrides=TINY, out=one, workers=0)
    shutil.copytree(one / "points", two / "points")
    stamps = {path: path.stat().st_mtime_ns for path in (two / "points").iterdir()}
    seen: list[Progress] = []
    more = sweep(
        "hertz",
        ["contact.friction=0.2,0.3,0.4"],
        overrides=TINY,
        out=two,
        workers=0,
        watch=seen.append,
    )
    assert sorted(more.plan.kept) == [0, 2]
    assert [progress.label for progress in seen if progress.label] == ["friction 0.3"]
    assert (more.outcomes[0], more.outcomes[2]) == first.outcomes
    assert {path: path.stat().st_mtime_ns for path in stamps} == stamps


@pytest.mark.parametrize("damage", ["cut", "edit"])
def test_damaged_point_file_is_run_again(tmp_path: Path, damage: str) -> None:
    first = sweep("hertz", ["contact.friction=0.2,0.4"], overrides=TINY, out=tmp_path, workers=0)
    before = table(tmp_path)
    file = PointStore(tmp_path, "sweep").path(first.plan.tasks[1])
    data = json.loads(text := file.read_text(encoding="utf-8"))
    data["results"][0]["value"] *= 1.1
    file.write_text(text[:200] if damage == "cut" else json.dumps(data), encoding="utf-8")
    again = sweep("hertz", ["contact.friction=0.2,0.4"], overrides=TINY, out=tmp_path, workers=0)
    assert sorted(again.plan.kept) == [0]
    assert table(tmp_path) == before


def test_points_share_meshes_and_condensations(tmp_path: Path, own_cache: Path) -> None:
    vary = ["contact.friction=0.2,0.4,0.5", "materials.block.nu=0.3,0.25"]
    found = sweep("hertz", vary, overrides=TINY, out=tmp_path, workers=0)
    # Two bodies, two families of loads; the sphere is the same for both blocks.
    assert (found.plan.meshes, found.plan.condensations) == (1, 6)
    assert len(set(found.plan.groups.values())) == 2
    counts = {
        name: sum(outcome.shared[name] for outcome in found.outcomes)
        for name in ("made", "disk", "memory")
    }
    assert counts == {"made": 6, "disk": 2, "memory": 4}
    assert len(list((own_cache / "condensed").glob("*.npz"))) == 6
    # Another folder: everything comes from disk.
    again = sweep("hertz", vary, overrides=TINY, out=tmp_path / "again", workers=0)
    assert sum(outcome.shared["made"] for outcome in again.outcomes) == 0
    assert table(tmp_path / "again") == table(tmp_path)


def test_corrupt_condensation_is_made_again(tmp_path: Path, own_cache: Path) -> None:
    task = Task(load_scene("hertz", TINY).text, {})
    first = read_outcome(solve_task(task.text()))
    assert first.failure == ""
    files = sorted((own_cache / "condensed").glob("*.npz"))
    for k, file in enumerate(files):
        data = bytearray(file.read_bytes())
        data[len(data) // 2] ^= 255
        file.write_bytes(bytes(data) if k % 2 else bytes(data[: len(data) // 3]))
    from upd.batch.point import forget

    forget()
    second = read_outcome(solve_task(task.text()))
    forget()
    assert second.results == first.results
    assert second.shared["made"] == len(files) == 4
    assert second.shared["disk"] == 0


def test_kept_condensations_stay_within_their_limit(tmp_path: Path, own_cache: Path) -> None:
    condensed = own_cache / "condensed"
    sweep("hertz", ["materials.block.nu=0.3"], overrides=TINY, out=tmp_path / "a", workers=0)
    size = sum(path.stat().st_size for path in condensed.glob("*.npz"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("UPD_CACHE_LIMIT", f"{1.2 * size:.0f} B")
        sweep(
            "hertz",
            ["materials.block.nu=0.1:0.25:4"],
            overrides=TINY,
            out=tmp_path / "b",
            workers=0,
        )
    assert 0 < sum(path.stat().st_size for path in condensed.glob("*.npz")) <= 1.2 * size
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("UPD_CACHE_LIMIT", "much")
        with pytest.raises(InputError, match="UPD_CACHE_LIMIT"):
            sweep(
                "hertz", ["materials.block.nu=0.3"], overrides=TINY, out=tmp_path / "c", workers=0
            )


def test_what_another_solver_made_is_not_kept_under_the_key(tmp_path: Path) -> None:
    from upd.reduction.guyan import condense

    made = condense(np.diag([2.0, 3.0, 4.0]) + 1.0, [0, 1], solver="superlu")
    store = Store(tmp_path)
    assert (
        stored_condensation(store, "a", lambda: made, solver="pardiso", with_factor=False) is made
    )
    assert not list(tmp_path.glob("*.npz"))
    stored_condensation(store, "a", lambda: made, solver="superlu", with_factor=False)
    again = stored_condensation(store, "a", lambda: made, solver="superlu", with_factor=False)
    assert again is not made
    np.testing.assert_array_equal(again.compliance(), made.compliance())
    np.testing.assert_array_equal(again.recover(np.ones(2)), made.recover(np.ones(2)))
    assert store.counts == {"made": 2, "disk": 1, "factor": 1, "memory": 0}


def test_a_single_run_keeps_no_condensation(own_cache: Path) -> None:
    run("hertz", overrides=TINY)
    assert active() is None
    assert not (own_cache / "condensed").exists()


def test_unknown_followed_number_ends_the_sweep_at_the_first_point(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"--follow max_presure: no such number; there are .*max_pressure"
    ):
        sweep(
            "hertz",
            ["contact.friction=0.2,0.4"],
            overrides=TINY,
            out=tmp_path,
            workers=0,
            follow=["max_presure"],
        )
    assert len(list((tmp_path / "points").iterdir())) == 1, "the point solved before is kept"
    with pytest.raises(InputError, match="no such number"):
        sweep(
            "hertz",
            ["contact.friction=0.2,0.4"],
            overrides=TINY,
            out=tmp_path,
            workers=0,
            follow=["max_presure"],
        )


def test_scene_that_allows_no_point_is_refused(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"no point of the grid can be run.*did you mean 'friction'"
    ):
        sweep("hertz", ["contact.fricton=0.2,0.4"], out=tmp_path / "new", workers=0)
    assert not (tmp_path / "new").exists()


def test_points_are_named_with_six_digits(tmp_path: Path) -> None:
    from upd.batch.plan import plan_sweep

    vary = ["contact.friction=0.1:0.7:4:log"]
    plan = plan_sweep(load_scene("hertz", TINY), vary, tmp_path)
    assert [plan.label(k) for k in range(2)] == ["friction 0.1", "friction 0.191293"]


def test_threads_and_workers_never_exceed_the_cores(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from upd.batch.plan import plan_sweep
    from upd.linalg import select

    scene = load_scene("hertz", TINY)
    vary = ["contact.friction=0.1:0.8:8"]
    monkeypatch.setattr(select, "threads", lambda: 4)
    assert plan_sweep(scene, vary, tmp_path).workers.count == 4
    assert plan_sweep(scene, vary, tmp_path, threads=2).workers.count == 2
    crowded = plan_sweep(scene, vary, tmp_path, workers=64)
    assert crowded.workers.count == 4
    assert any("64 workers" in note for note in crowded.notes)
    monkeypatch.setattr(select, "memory_left", lambda: 2.5 * crowded.memory_bytes)
    assert plan_sweep(scene, vary, tmp_path).workers.count == 2
    for bad in ({"threads": 5}, {"threads": 0}, {"workers": -1}):
        with pytest.raises(InputError):
            plan_sweep(scene, vary, tmp_path, **bad)


def rows(*found: tuple[str, Case, float]) -> Outcome:
    return Outcome(tuple(Result(name, case, value, "N") for name, case, value in found))


def pressed(load: float) -> Case:
    return Case(load=load)


def sheared(ratio: float) -> Case:
    return Case(load=50.0, ratio=ratio)


def test_cases_that_change_with_the_parameters_share_a_column() -> None:
    first = rows(("p", pressed(50.0), 1.0), ("p", pressed(60.0), 2.0), ("q", Case(), 5.0))
    second = rows(("p", pressed(80.0), 3.0), ("p", pressed(90.0), 4.0), ("q", Case(), 6.0))
    p1, p2, q = make_columns([first, Outcome(failure="no"), second], ["p", "q"])
    assert [c.title for c in (p1, p2, q)] == ["p (F=* N #1)", "p (F=* N #2)", "q"]
    np.testing.assert_array_equal(p1.values, [1.0, np.nan, 3.0])
    np.testing.assert_array_equal(p2.values, [2.0, np.nan, 4.0])


def test_a_point_with_other_cases_keeps_its_numbers_in_their_columns() -> None:
    usual = [
        rows(("p", sheared(0.2), 1.0), ("p", sheared(0.5), 2.0)),
        rows(("p", sheared(0.2), 3.0), ("p", sheared(0.5), 4.0)),
    ]
    found = [*usual, rows(("p", sheared(0.5), 9.0))]
    low, high = make_columns(found, ["p"])
    assert [c.case for c in (low, high)] == ["F=50 N T/muN=0.2", "F=50 N T/muN=0.5"]
    np.testing.assert_array_equal(low.values, [1.0, 3.0, np.nan])
    np.testing.assert_array_equal(high.values, [2.0, 4.0, 9.0])
    assert reasons(found, [low, high]) == [
        "",
        "",
        "p (F=50 N T/muN=0.2): not among the numbers of this point",
    ]


def test_peaks_stand_in_the_columns_of_their_modes() -> None:
    """The order of the peaks moves no number into another column."""

    def peak(ratio: float, mode: str, **more: Any) -> Case:
        return Case(stiffness="own", force_ratio=ratio, mode=mode, **more)

    one, two = "peak_1_frequency", "peak_2_frequency"
    stopped = Outcome(
        (
            Result(one, peak(50.0, "in phase"), 300.0, "Hz"),
            Result(two, peak(50.0, "out of phase"), 444.0, "Hz"),
            Result("friction_energy", peak(50.0, "out of phase", peak=2), 1.0, "N mm"),
        )
    )
    short = Outcome(
        (
            Result(two, peak(20.0, "out of phase"), 443.0, "Hz"),
            Result(one, peak(20.0, "in phase"), math.nan, "Hz", withheld="it stopped at 290 Hz"),
            Result("friction_energy", peak(20.0, "out of phase", peak=2), 2.0, "N mm"),
        )
    )
    whole = Outcome(
        (
            Result(two, peak(194.0, "out of phase"), 450.0, "Hz"),
            Result(one, peak(194.0, "in phase"), 400.0, "Hz"),
            Result("friction_energy", peak(194.0, "in phase", peak=1), 3.0, "N mm"),
            Result("friction_energy", peak(194.0, "out of phase", peak=2), 4.0, "N mm"),
        )
    )
    found = [stopped, whole, short]
    columns = {c.title: c for c in make_columns(found, ["peak_?_frequency", "friction_energy"])}
    first, second = "in phase", "out of phase"
    label = "own, F_C/F_E *"
    expected = {
        f"{one} ({label}, {first})": [300.0, 400.0, np.nan],
        f"{two} ({label}, {second})": [444.0, 450.0, 443.0],
        f"friction_energy ({label}, at peak 1, {first})": [np.nan, 3.0, np.nan],
        f"friction_energy ({label}, at peak 2, {second})": [1.0, 4.0, 2.0],
    }
    assert set(columns) == set(expected)
    for title, values in expected.items():
        np.testing.assert_array_equal(columns[title].values, values)
    reason = reasons(found, list(columns.values()))[2]
    lost = f"{one} ({label}, {first}), friction_energy ({label}, at peak 1, {first})"
    assert f"{lost}: it stopped at 290 Hz" in reason
    axes = parse_axes(["excitation.centrifugal_to_force=50,194,20"], {})
    lines = csv_text(axes, places(axes), found, list(columns.values())).splitlines()
    assert "it stopped at 290 Hz" in lines[3]
    assert lines[3].split(",")[-4] != "failed"


def test_a_withheld_peak_of_no_known_mode_has_its_reason_in_the_row_and_no_column() -> None:
    def case(ratio: float, mode: str = "", **more: Any) -> Case:
        return Case(stiffness="own", force_ratio=ratio, mode=mode, **more)

    def both(ratio: float) -> Outcome:
        peak = (("in phase", 1), ("out of phase", 2))
        return Outcome(
            (
                Result("path_points", case(ratio), 60.0, ""),
                *(
                    Result(f"peak_{k}_frequency", case(ratio, mode), k * ratio, "Hz")
                    for mode, k in peak
                ),
                Result("energy", case(ratio, "in phase", peak=1), 3.0, "N mm"),
            )
        )

    reason = "no peak between 200 and 250 Hz"
    lost = Outcome(
        (
            Result("path_points", case(7.0), 60.0, ""),
            Result("peak_1_frequency", case(7.0), math.nan, "Hz", withheld=reason),
        )
    )
    found = [both(5.0), lost, both(9.0)]
    columns = make_columns(found, ["peak_?_frequency", "energy"])
    titles = [
        "peak_1_frequency (own, F_C/F_E *, in phase)",
        "peak_2_frequency (own, F_C/F_E *, out of phase)",
        "energy (own, F_C/F_E *, at peak 1, in phase)",
    ]
    assert [c.title for c in columns] == titles
    assert [np.isnan(c.values).tolist() for c in columns] == [[False, True, False]] * 3
    assert reasons(found, columns) == ["", f"{', '.join(titles)}: {reason}", ""]
    # of another curve it says nothing
    other = replace(lost.results[1], case=replace(lost.results[1].case, stiffness="thesis"))
    strange = [both(5.0), Outcome((lost.results[0], other)), both(9.0)]
    energy = make_columns(strange, ["energy"])
    assert "not among the numbers" in reasons(strange, energy)[1]


def test_shared_label() -> None:
    assert shared_label([Case(load=50.0, ratio=0.5), Case(load=60.0, ratio=0.5)]) == (
        "F=* N T/muN=0.5"
    )
    assert shared_label([Case(name="a"), Case(name="a")]) == "a"
    assert shared_label([Case(load=50.0), Case(name="c")]) == "*"
    alike = [Case(stiffness="own", force_ratio=r, peak=1) for r in (194.0, 600.0)]
    assert shared_label(alike) == "own, F_C/F_E *, at peak 1"


def test_outcome_survives_its_text() -> None:
    numbers = (
        Result(
            "p",
            Case(load=1.0, direction="x"),
            0.1 + 0.2,
            "MPa",
            1.0 / 3.0,
            "closed form",
            -0.05,
            exact=False,
        ),
        Result("q", Case(), math.nan, "", withheld="not reached"),
    )
    outcome = Outcome(numbers, seconds=1.5, stages={"mesh": 0.1}, n_dof=12, warnings=("rim",))
    again = read_outcome(outcome.text())
    assert again == outcome
    assert again.results[0].case.load == 1.0, "a case comes back with its fields, not as its label"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        '{"rows": [["p", "", "N", 1.0]]}',
        '{"results": ["p"]}',
        '{"results": [], "strange": 1}',
    ],
)
def test_a_file_that_is_no_outcome_counts_as_none(tmp_path: Path, text: str) -> None:
    store, task = PointStore(tmp_path, "sweep"), Task("", {})
    (tmp_path / "points").mkdir()
    store.path(task).write_text(text, encoding="utf-8")
    assert store.finished([task]) == {}


def test_a_sweep_is_a_function_of_the_package(tmp_path: Path) -> None:
    import upd

    assert upd.sweep is sweep
    assert "sweep" in dir(upd)
    with pytest.raises(InputError, match="--vary: is missing"):
        upd.sweep("hertz", [], out=tmp_path / "s")
    with pytest.raises(TypeError, match="wokers"):
        upd.sweep("hertz", ["contact.friction=0.2,0.4"], out=tmp_path / "s", wokers=2)


def test_command_prints_plan_and_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = [
        "sweep",
        "hertz",
        "--vary",
        "contact.friction=0.2,0.4",
        "--out",
        str(tmp_path / "s"),
        "--workers",
        "1",
        "--follow",
        "max_pressure,tangential_displacement",
    ]
    words += [
        word for key, value in TINY.items() for word in ("--set", f"{key}={json.dumps(value)}")
    ]
    with pytest.raises(SystemExit) as ended:
        main([*words, "--plan-only"])
    assert ended.value.code == 0
    assert "2 points to solve, from 1 mesh, 4 condensations" in capsys.readouterr().out
    assert not (tmp_path / "s").exists()
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 0
    told = capsys.readouterr().out
    assert "2 of 2 points ok" in told
    assert 0 < told.index("µm") < told.index("MPa"), "what varies comes first"
    with pytest.raises(SystemExit) as ended:
        main([*words, "--cluster", "nowhere"])
    assert ended.value.code == 2
    assert "tcp://host:port" in capsys.readouterr().err
