"""Measured curves in a scene: where their files are, what is refused, damping from them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from upd.errors import InputError
from upd.measured import MeasuredCurve, fit_damping
from upd.scene import load_scene
from upd.scene.keys import scene_as_run

SCENE = """
name = "lab"
analysis = "forced response"
want = ["response"]
geometry = {{ recipe = "blade_rig" }}
material = {{ E = "200 GPa", nu = 0.3 }}
stiffness = {{ own = {{ K_N = "1e6 N/mm", K_T = "5e5 N/mm" }} }}
excitation = {{ damping = {damping} }}
{more}
"""
FREE = '[measured.free]\nfile = "free.csv"\nstate = "free"\n'


def curve(folder: Path, zeta: float = 0.004) -> Path:
    f = np.linspace(300.0, 380.0, 400)
    H = -(f**2) / (340.0**2 - f**2 + 2j * zeta * 340.0 * f)
    rows = "\n".join(f"{a!r},{b.real!r},{b.imag!r}" for a, b in zip(f.tolist(), H, strict=True))
    head = "frequency [Hz],accelerance real [(m/s2)/N],accelerance imaginary [(m/s2)/N]\n"
    path = folder / "free.csv"
    path.write_text(head + rows.replace("np.float64(", "").replace(")", ""), encoding="utf-8")
    return path


def scene(folder: Path, more: str = FREE, damping: str = '"measured"') -> Path:
    path = folder / "lab.toml"
    path.write_text(SCENE.format(damping=damping, more=more), encoding="utf-8")
    return path


def test_files_stand_relative_to_the_scene(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "here").mkdir()
    path = curve(tmp_path / "here")
    monkeypatch.chdir(tmp_path)
    loaded = load_scene(scene(tmp_path / "here"))
    assert loaded.measured["free"].file == str(path)
    ((_, _, zeta),) = loaded.fitted
    assert zeta == loaded.excitation.damping == pytest.approx(0.004, rel=1e-5)
    assert loaded.modal_damping(np.array([340.0]), np.ones((1, 2)))[0] == zeta


def test_the_scene_as_run_reads_back_and_refuses_another_file(tmp_path: Path, monkeypatch) -> None:
    path = curve(tmp_path)
    loaded = load_scene(scene(tmp_path))
    written = tmp_path / "elsewhere" / "scene.toml"
    written.parent.mkdir()
    written.write_text(scene_as_run(loaded), encoding="utf-8")
    again = load_scene(written)
    assert (again.measured, again.fitted) == (loaded.measured, loaded.fitted)
    assert 'damping = "measured"' in written.read_text("utf-8")
    curve(tmp_path, 0.006)
    with pytest.raises(InputError, match=f"{path} is not the file .* remove digest"):
        load_scene(written)
    assert load_scene(scene(tmp_path)).fitted[0][2] == pytest.approx(0.006, rel=1e-5)


def test_points_of_sweeps_know_the_file_they_were_solved_with(tmp_path: Path) -> None:
    curve(tmp_path)
    one = load_scene(scene(tmp_path)).text
    curve(tmp_path, 0.006)
    assert load_scene(scene(tmp_path)).text != one


@pytest.mark.parametrize(
    ("more", "damping", "told"),
    [
        ("", '"measured"', "needs a measured free curve"),
        (FREE + "centrifugal_to_force = 5.0", "0.005", "are both given"),
        ('[measured.free]\nfile = "free.csv"', "0.005", "are both missing"),
        (FREE + 'unit = "furlong"', "0.005", "measured.free.unit: 'furlong' is none"),
        (FREE.replace("free.csv", "no.csv"), "0.005", "no.csv, cannot be read"),
        (FREE + 'blade = "middle"', "0.005", "measured.free.blade"),
        (FREE + 'colum = "x"', "0.005", "did you mean 'column'"),
    ],
)
def test_refused(tmp_path: Path, more: str, damping: str, told: str) -> None:
    curve(tmp_path)
    with pytest.raises(InputError, match=told):
        load_scene(scene(tmp_path, more, damping))


def test_all_faults_at_once_with_line_and_column(tmp_path: Path) -> None:
    path = curve(tmp_path)
    lines = path.read_text("utf-8").splitlines()
    lines[6], lines[9] = "abc,1,2", "314.0,1,x"
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_scene(scene(tmp_path), {"excitation.start": "600 Hz"})
    told = str(caught.value)
    assert "lab.toml: 3 problems" in told
    assert "measured.free.file: free.csv, line 7, column 1 (frequency): 'abc'" in told
    assert "measured.free.file: free.csv, line 10, column 3 (accelerance): 'x'" in told
    assert "excitation.start" in told


def test_every_mode_has_the_ratio_of_the_next_fitted_one_of_its_blade() -> None:
    fitted = ("left", 300.0, 0.01), ("right", 340.0, 0.004), ("right", 900.0, 0.002)
    loaded = load_scene("symmetric-response", {"excitation.damping": 0.005})
    share = np.array([[1.0, 0.0], [0.0, 1.0], [0.5, 0.5], [0.0, 1.0], [0.0, 1.0]])
    frequency = np.array([900.0, 350.0, 340.0, 0.0, 5000.0])
    found = replace(loaded, fitted=fitted).modal_damping(frequency, share)
    assert found == pytest.approx([0.01, 0.004, 0.007, 0.004, 0.002])
    assert loaded.modal_damping(np.ones(2), np.ones((2, 2))).tolist() == [0.005, 0.005]
    # a blade that was not measured takes the other's
    one = replace(loaded, fitted=fitted[1:]).modal_damping(np.array([340.0]), share[:1])
    assert one[0] == 0.004


def test_fit_is_that_of_the_library(tmp_path: Path) -> None:
    curve(tmp_path)
    mine = load_scene(scene(tmp_path)).measured["free"].read()
    assert isinstance(mine, MeasuredCurve)
    assert fit_damping(mine).zeta[0] == load_scene(scene(tmp_path)).fitted[0][2]


def test_a_file_of_one_curve_says_what_it_is(tmp_path: Path) -> None:
    """What the table leaves out is the file's; what it says chooses, or is refused."""
    path = curve(tmp_path)
    head, *rows = path.read_text().splitlines()
    free = [f"{row},left,free" for row in rows]
    path.write_text("\n".join([head + ",blade,state", *free]) + "\n", encoding="utf-8")
    bare = '[measured.free]\nfile = "free.csv"\n'
    one = load_scene(scene(tmp_path, bare)).measured["free"]
    assert (one.blade, one.state, one.read().blade) == ("left", "free", "left")
    with pytest.raises(InputError, match="no curve of blade right; the file has blade left, stat"):
        load_scene(scene(tmp_path, bare + 'blade = "right"\n'))
