"""The command line and the run folder: what a user types, sees and finds."""

import json
from pathlib import Path

import pytest

import upd
from upd import cli
from upd.results import read_netcdf

SMALL = [
    "--set",
    "geometry.divisions=12",
    "--set",
    "geometry.patch=auto",
    "--set",
    'loads.normal=["200 N"]',
    "--set",
    "loads.tangential=[0.5]",
]


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as end:
        cli.main(list(arguments))
    return int(end.value.code or 0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("runs") / "hertz"
    assert call("run", "hertz", *SMALL, "--out", str(out)) == 0
    return out


def test_run_folder_holds_what_is_promised(folder: Path) -> None:
    names = {p.name for p in folder.iterdir()}
    assert {
        "scene.toml",
        "summary.json",
        "result.nc",
        "mesh.vtu",
        "fields.vtu",
        "run.log",
        "pressure.png",
        "traction.png",
    } <= names
    assert not [n for n in names if n.startswith(".")], "half-written files"


def test_summary_has_its_keys(folder: Path) -> None:
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert summary["status"] == "ok"
    assert {"n_dof", "n_pairs"} <= set(summary["size"])
    assert {"stages", "total_s", "peak_rss_mb"} <= set(summary["cost"])
    keys = {"name", "on", "applies", "why", "check", "switch", "verdict"}
    assert keys == set(summary["effects"][0])
    for effect in summary["effects"]:
        if effect["applies"] and not effect["on"]:
            assert effect["verdict"].startswith("passed"), effect
    rows = {(r["name"], r["case"]): r for r in summary["results"]}
    radii = ("radius_moment", "radius_area", "radius_outermost")
    for name in (
        *radii,
        "approach",
        "contact_area",
        "max_pressure",
        "mean_pressure",
        "K_N_tangent",
        "K_T_initial",
    ):
        row = rows[name, "F=200 N"]
        assert set(row) >= {
            "name",
            "case",
            "value",
            "unit",
            "reference",
            "source",
            "error",
            "thesis_error",
        }
        assert row["error"] == pytest.approx(row["value"] / row["reference"] - 1.0)
    for name in ("stick_radius", "tangential_displacement"):
        assert (name, "F=200 N T/muN=0.5") in rows
    assert rows["cycle_energy", "F=200 N T/muN=0.75"]["unit"] == "mJ"


def test_thesis_errors_stand_beside_the_thesis_scene(folder: Path) -> None:
    rows = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["results"]
    printed = {r["name"]: r["thesis_error"] for r in rows if r["thesis_error"] is not None}
    # Table VIII against the exact closed form.
    assert printed["max_pressure"] == pytest.approx(0.104, abs=1e-3)
    assert printed["approach"] == pytest.approx(-0.030, abs=1e-3)


def test_arrays_read_back(folder: Path) -> None:
    arrays = read_netcdf(folder / "result.nc")
    case = arrays["F=200 N"]
    assert case["normal_force"].data.sum() == pytest.approx(200.0, rel=1e-10)
    assert case["pressure"].data.shape == (len(case["x"].data), len(case["y"].data)) == (13, 13)
    assert "F=200 N T per muN=0.5" in arrays


def test_scene_as_run_gives_the_same_numbers(folder: Path) -> None:
    again = upd.run(folder / "scene.toml")
    rows = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["results"]
    for row, ours in zip(rows, again.rows, strict=True):
        assert ours.value == pytest.approx(row["value"], rel=1e-9)


def test_bad_scene_is_exit_2_and_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "never"
    assert (
        call(
            "run",
            "hertz",
            "--set",
            "geometry.radius=5 kg",
            "--set",
            "mesh.element=hex9",
            "--out",
            str(out),
        )
        == 2
    )
    told = capsys.readouterr().err
    assert "geometry.radius" in told
    assert "mesh.element" in told
    assert "Traceback" not in told
    assert not out.exists()


def test_failed_check_is_exit_1_and_leaves_the_log_and_the_numbers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "overrun"
    code = call(
        "run",
        "hertz",
        "--set",
        "geometry.divisions=8",
        "--set",
        "geometry.patch=0.2 mm",
        "--set",
        'want=["normal"]',
        "--out",
        str(out),
    )
    assert code == 1
    assert 'set geometry.patch to "' in capsys.readouterr().err
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["status"].startswith("failed: patch rim")
    assert summary["results"]
    assert "patch rim" in (out / "run.log").read_text(encoding="utf-8")


def test_out_that_cannot_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("", encoding="utf-8")
    assert call("run", "hertz", *SMALL, "--out", str(blocked / "run")) == 2
    assert "cannot be written" in capsys.readouterr().err


def test_plan_that_does_not_fit_names_the_size_that_does(
    capsys: pytest.CaptureFixture[str],
) -> None:
    size = ("--set", "geometry.divisions=60")
    assert call("plan", "hertz", *size, "--set", "solver.memory=100 GB") == 0
    assert "upd run refuses it" not in capsys.readouterr().out
    assert call("plan", "hertz", *size, "--set", "solver.memory=1 GB") == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "more than the 1.0 GB of memory that a run may take here (about " in told
    assert "dofs fit, these are" in told


def test_plan_solves_nothing_and_says_what_is_left_out(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "upd.mesh.recipes.build_mesh", lambda *_: pytest.fail("the plan made a mesh")
    )
    assert call("plan", "hertz", "--set", "contact.friction=0") == 0
    told = capsys.readouterr().out
    assert "mu = 0" in told
    assert "Predicted" in told
    assert call("plan", "hertz", "--set", "geometry.divisions=auto", "--set", "accuracy=2 %") == 0


def test_predicted_size_is_the_size(folder: Path) -> None:
    overrides = [SMALL[k] for k in range(1, len(SMALL), 2)]
    plan = upd.make_plan(upd.load_scene("hertz", overrides))
    size = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["size"]
    assert {body: 3 * n["nodes"] for body, n in plan.size.items()} == size["n_dof"]


@pytest.mark.parametrize("ending", ["msh", "vtu", "inp"])
def test_mesh_files(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"mesh.{ending}"
    assert call("mesh", "hertz", *SMALL, "-o", str(path)) == 0
    assert path.stat().st_size > 10_000


def test_mesh_ending_unknown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("mesh", "hertz", *SMALL, "-o", str(tmp_path / "mesh.stl")) == 2
    assert ".vtu" in capsys.readouterr().err


def test_lists_and_doctor(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("scenes") == 0
    assert "hertz" in capsys.readouterr().out
    assert call("doctor") == 0
    told = capsys.readouterr().out
    for word in ("scikit-fem", "BLAS", "threads", "solver", "gmsh libraries"):
        assert word in told


def test_import_is_light() -> None:
    import subprocess
    import sys

    code = (
        "import sys, upd; print([m for m in ('skfem', 'matplotlib', 'gmsh', 'pydantic', "
        "'scipy') if m in sys.modules])"
    )
    assert (
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout.strip()
        == "[]"
    )
