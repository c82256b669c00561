"""`upd sweep SCENE --sample N`: points drawn from uncertain inputs, and what they make of the
first-order bands.
"""

import csv
import json
import tomllib
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np
import pytest

import upd
from upd.batch.engine import Progress
from upd.batch.plan import plan_sweep
from upd.batch.point import point_settings
from upd.batch.sweeps import SweepResult
from upd.cli import main
from upd.errors import InputError
from upd.plot.sweep_charts import sample_charts
from upd.results.sampled import AGREES, DIFFERS
from upd.scene import load_scene

#: a pressed half-sphere with 8 elements along a patch sized by the load
TINY: dict[str, Any] = {
    "geometry.divisions": 8,
    "geometry.patch": "auto",
    "geometry.core_depth": 0.2,
    "contact.friction": 0.0,
    "want": ["normal"],
    "left_out.solve": "no",
}
KNOWN = {"loads.normal": ["200 N +- 10 N"], "materials.sphere.E": "200 GPa +- 5 %"}


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing of other tests may be found, nor left behind."""
    monkeypatch.setenv("UPD_CACHE", str(tmp_path_factory.mktemp("cache")))


def drawn(folder: Path, inputs: dict[str, Any], count: int, **more: Any) -> SweepResult:
    """The tiny sphere over a sample, in this process."""
    return upd.sweep("hertz", sample=count, overrides=TINY | inputs, out=folder, workers=0, **more)


@pytest.fixture(scope="module")
def narrow(tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    """Load and modulus within 5 %."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("UPD_CACHE", str(tmp_path_factory.mktemp("cache")))
        return drawn(tmp_path_factory.mktemp("narrow") / "s", KNOWN, 8, seed=3)


def test_hertz_within_five_per_cent(narrow: SweepResult) -> None:
    """p_0 ~ F^(1/3) E*^(2/3), d ~ F^(2/3) E*^(-2/3): sampled deviations are those to first order,
    within 1 %, by points at the closed form's own values.
    """
    assert not narrow.failed
    assert not narrow.faults
    of = {one.name: one for one in narrow.sampled}
    for name, of_force, of_modulus in (("max_pressure", 1 / 3, 2 / 3), ("approach", 2 / 3, -2 / 3)):
        one = of[name]
        assert one.outcome == AGREES, one.verdict
        assert one.count == 8
        # of one of two like bodies E* takes half
        exact = np.hypot(of_force * 0.05, of_modulus * 0.025)
        assert one.first_order == pytest.approx(exact, rel=0.1)
        assert one.band == pytest.approx(one.first_order, rel=0.02)
        values = narrow.column(name).values
        modulus, force = (np.array(axis.numbers) for axis in narrow.plan.axes)
        share = modulus / (modulus + modulus[0]) * 2.0
        closed = (force / force[0]) ** of_force * share**of_modulus
        np.testing.assert_allclose(values / values[0], closed, rtol=5e-3)


@pytest.mark.usefixtures("without_pictures")
def test_an_interval_of_nine_tenths_differs(tmp_path: Path) -> None:
    """F^(1/3) between a tenth and nearly twice the load: both ends are 45 % apart to either side,
    the deviation is 35 / sqrt(3) % and the mean 4 % less (closed forms).
    """
    result = drawn(tmp_path / "s", {"loads.normal": ["200 N +- 90 %"]}, 16)
    one = next(one for one in result.sampled if one.name == "max_pressure")
    assert one.outcome == DIFFERS
    assert one.first_order == pytest.approx(0.4547, rel=0.02)
    assert one.band == pytest.approx(0.349, rel=0.05)
    assert one.band_high < one.first_order
    assert one.mean / one.nominal - 1.0 == pytest.approx(-0.039, abs=0.01)
    assert one.verdict == "24 % narrower than first order"


def test_points_know_their_inputs_exactly_and_estimate_nothing() -> None:
    """The scene itself has the half-widths: its run tells the first-order bands."""
    scene = load_scene("hertz", TINY | KNOWN)
    plan = plan_sweep(scene, (), Path("nowhere"), sample=5, workers=0)
    data = [tomllib.loads(task.scene) for task in plan.tasks]
    scenes = [load_scene(one, point_settings(one, {})) for one in data]
    assert {one.given for one in scenes[0].uncertain.values()} == {
        "200 N +- 10 N",
        "200 GPa +- 5 %",
    }
    assert all(not one.uncertain for one in scenes[1:])
    assert not any(one.estimates for one in scenes)
    loads = np.array([one.loads.normal[0] for one in scenes])
    moduli = np.array([one.materials["sphere"].E for one in scenes])
    assert loads[0] == 200.0
    assert moduli[0] == 200e3
    # a point in every fifth of every interval
    for values, half in ((loads[1:] - 200.0, 10.0), (moduli[1:] - 200e3, 10e3)):
        assert sorted(np.floor(2.5 * (values / half + 1.0))) == [0, 1, 2, 3, 4]
    again = plan_sweep(scene, (), Path("nowhere"), sample=5, workers=0)
    other = plan_sweep(scene, (), Path("nowhere"), sample=5, seed=1, workers=0)
    assert again.tasks == plan.tasks
    assert other.tasks[1:] != plan.tasks[1:]


@pytest.mark.usefixtures("without_pictures")
def test_what_is_missing_of_a_stopped_sample_runs_with_the_same_points(tmp_path: Path) -> None:
    """The seed lies in the folder; another one is another sample."""

    def stop(progress: Progress) -> None:
        if progress.done >= 2:
            raise KeyboardInterrupt

    inputs = {"loads.normal": ["200 N +- 5 %"]}
    with pytest.raises(KeyboardInterrupt):
        drawn(tmp_path / "s", inputs, 4, seed=7, watch=stop)
    begun = json.loads((tmp_path / "s" / "grid.json").read_text())
    assert begun["sample"]["seed"] == 7
    with pytest.raises(InputError, match=r"holds another sweep \(hertz, a sample of 4 with seed 7"):
        drawn(tmp_path / "s", inputs, 4, seed=8)
    kept = sorted((tmp_path / "s" / "points").iterdir())
    times = [file.stat().st_mtime_ns for file in kept]
    result = drawn(tmp_path / "s", inputs, 4)
    assert len(kept) == len(result.plan.kept) == 2
    assert times == [file.stat().st_mtime_ns for file in kept]
    assert result.plan.sample is not None
    assert result.plan.sample.seed == 7
    assert json.loads((tmp_path / "s" / "grid.json").read_text()) == begun
    # bands come from the kept point of the scene itself
    assert all(one.first_order is not None for one in result.sampled if one.name == "approach")


def test_files_of_a_sample(narrow: SweepResult) -> None:
    """Tables, arrays over the points, the figure and the page; the page is made again."""
    folder = narrow.folder
    assert {file.name for file in narrow.files} == {
        *("sample.csv", "table.csv", "sweep.nc", "sweep.json", "sample.png", "report.html")
    }
    with (folder / "table.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert rows[0][:2] == ["materials.sphere.E [MPa]", "loads.normal[0] [N]"]
    assert len(rows) == 1 + 9
    assert [float(v) for v in rows[1][:2]] == [200e3, 200.0]
    with h5netcdf.File(folder / "sweep.nc") as file:
        assert file.variables["status"].dimensions == ("point",)
        assert len(file.dimensions["point"]) == 9
    data = json.loads((folder / "sweep.json").read_text())
    assert data["sample"]["seed"] == 3
    assert data["sample"]["inputs"] == {
        "loads.normal[0]": "200 N +- 10 N",
        "materials.sphere.E": "200 GPa +- 5 %",
    }
    assert [one["verdict"] for one in data["sample"]["numbers"]] == [
        one.verdict for one in narrow.sampled
    ]
    (folder / "report.html").unlink()
    main_code(["report", str(folder)])
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "Bands by the inputs, to first order and sampled" in page
    assert "with seed 3" in page
    data["sample"]["numbers"] = data["sample"]["numbers"][1:]
    broken = folder.parent / "broken"
    broken.mkdir()
    (broken / "sweep.json").write_text(json.dumps(data), encoding="utf-8")
    assert main_code(["report", str(broken)]) == 2


def test_figure_has_what_the_inputs_move(narrow: SweepResult) -> None:
    """The first-order band of each number around it, the sample's around its mean."""
    columns = [column.values for column in narrow.columns]
    still = [np.full(9, 2.0), *columns[1:]]
    assert len(sample_charts(narrow.sampled, still)) == len(columns) - 1
    charts = sample_charts(narrow.sampled, columns)
    for one, chart in zip(narrow.sampled, charts, strict=True):
        assert chart.figure == "sample"
        first, own = chart.bands
        assert one.nominal is not None
        assert one.first_order is not None
        assert first.low == pytest.approx(one.nominal * (1.0 - one.first_order))
        assert own.dashed
        assert 0.5 * (own.low + own.high) == pytest.approx(one.mean)
        counts = chart.traces[0].y[1:-1:2]
        assert counts.sum() == 8


def main_code(arguments: list[str]) -> int:
    """Exit code of a command."""
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    return int(caught.value.code or 0)


@pytest.mark.parametrize(
    ("inputs", "more", "told"),
    [
        ({}, {"sample": 20}, "knows all its inputs exactly"),
        (KNOWN, {"sample": 3}, "2 inputs known within limits need 4 points or more"),
        (KNOWN, {"sample": 20, "vary": ["contact.friction=0.1,0.2"]}, "give one of both"),
        (KNOWN, {"sample": 20, "seed": -1}, "seed -1"),
        (KNOWN, {"vary": ["contact.friction=0.1,0.2"], "seed": 1}, "is for a sample"),
        (KNOWN, {}, "--vary: is missing"),
    ],
)
def test_what_is_no_sample_is_refused(
    tmp_path: Path, inputs: dict[str, Any], more: dict[str, Any], told: str
) -> None:
    with pytest.raises(InputError, match=told):
        upd.sweep("hertz", **more, overrides=TINY | inputs, out=tmp_path / "s")
    assert not (tmp_path / "s").exists()


def test_command_prints_bands_and_verdict(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = [f"--set={path}={json.dumps(value)}" for path, value in TINY.items()]
    settings.append('--set=loads.normal=["200 N +- 5 %"]')
    command = ["sweep", "hertz", "--sample", "3", "--workers", "0", *settings]
    assert main_code([*command, "--plan-only", "--out", str(tmp_path / "s")]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "4 points (a sample of 3 with seed 0, and the scene itself)" in told
    assert "loads.normal[0]: 200 N +- 5 %, evenly between these limits" in told
    assert main_code([*command, "--out", str(tmp_path / "s")]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "First order agrees with the sample for" in told
    assert "4 of 4 points ok" in told
