"""A response beside measured curves: numbers, reasons, arrays, figures, damping in the model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rigs import undeclared

import upd
from tests.pictures import no_figures
from upd.errors import InputError
from upd.results import Result

EXAMPLE = Path(upd.__file__).parent / "scenes" / "examples" / "measured_response.toml"
QUICK = {"balance.harmonics": 1, "excitation.start": "310 Hz", "excitation.points": 60}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> upd.RunResult:
    more = {
        "measured.nothing": {
            "file": str(EXAMPLE.parent / "measured" / "damped_left.csv"),
            "centrifugal_to_force": 7.0,
        },
        "measured.at_rest": {
            "file": str(EXAMPLE.parent / "measured" / "free_right.csv"),
            "state": "free",
            "blade": "left",
        },
    }
    out = tmp_path_factory.mktemp("measured") / "run"
    return upd.run(EXAMPLE, overrides=QUICK | more, out=out, report=False)


def numbers(run: upd.RunResult, measured: str) -> dict[str, Result]:
    return {r.name: r for r in reversed(run.results) if r.case.name == measured}


def test_free_curve(run: upd.RunResult) -> None:
    """Made with 0.4 % and 2 % noise, which the file says."""
    found = numbers(run, "free")
    assert undeclared(run.results) == []
    assert found["frac"].value > 0.998
    assert abs(found["peak_frequency_difference"].value) < 0.05
    assert found["computed_peak_accelerance"].error == pytest.approx(0.0, abs=0.03)
    assert found["half_power_damping"].error == pytest.approx(0.0, abs=0.05)
    fitted, bound = found["fitted_damping"].value, found["fitted_damping"].estimated_error
    assert fitted == pytest.approx(0.4, rel=0.01)
    assert bound is not None and 0.001 < bound * fitted / 1.96 < 0.004
    assert found["fitted_noise"].value == pytest.approx(2.0, rel=0.15)


def test_the_model_has_the_fitted_damping(run: upd.RunResult) -> None:
    fitted = numbers(run, "free")["fitted_damping"].value
    assert numbers(run, "free")["half_power_damping"].value == pytest.approx(fitted, rel=1e-2)
    assert float(run.arrays["linear own"]["damping"][1]) == pytest.approx(0.01 * fitted, rel=0.02)


def test_curve_with_friction_and_without_phase(run: upd.RunResult) -> None:
    found = numbers(run, "damped")
    assert "frac" not in found
    assert found["computed_peak_frequency"].error == pytest.approx(0.0, abs=0.01)
    like = found["magnitude_correlation"]
    assert like.withheld or 0.9 < like.value <= 1.0


def test_what_was_not_reached_says_why(run: upd.RunResult) -> None:
    nothing, at_rest = numbers(run, "nothing"), numbers(run, "at_rest")
    assert "no curve at F_C/F_E 7, it has 400" in nothing["magnitude_correlation"].withheld
    assert "at rest without the damper" in at_rest["frac"].withheld


def test_bands_apart_and_no_peak_inside(tmp_path: Path) -> None:
    head = "frequency [Hz],accelerance [(m/s2)/N]\n"
    (tmp_path / "a.csv").write_text(head + "10,1\n11,2\n12,1\n", encoding="utf-8")
    (tmp_path / "b.csv").write_text(head + "400,3\n410,2\n420,1\n", encoding="utf-8")
    more = {f"measured.{k}": {"file": str(tmp_path / f"{k}.csv"), "state": "free"} for k in "ab"}
    run = upd.run(EXAMPLE, overrides=QUICK | more | {"excitation.damping": 0.004})
    a, b = numbers(run, "a"), numbers(run, "b")
    assert "do not overlap" in a["magnitude_correlation"].withheld
    assert "do not overlap" in a["computed_peak_frequency"].withheld
    assert "the measured curve has no peak" in b["computed_peak_frequency"].withheld
    assert "no peak between 400 and 420 Hz" in b["fitted_damping"].withheld
    assert b["magnitude_correlation"].value > 0.0


def test_arrays_and_figures(run: upd.RunResult) -> None:
    """The file's own curve reads back from the run folder; every figure of its blade draws it."""
    assert run.folder is not None
    again = upd.read_measured(
        run.folder / "curves" / "measured_free.csv", column="accelerance_right"
    )
    mine = upd.read_measured(EXAMPLE.parent / "measured" / "free_right.csv")
    assert np.array_equal(again.accelerance, mine.accelerance)
    stored = upd.read_measured(run.folder / "result.nc", column="measured free/accelerance_right")
    assert np.array_equal(stored.accelerance, mine.accelerance)
    for case, entries in (("right blade", 2), ("left blade", 2)):
        (axes,) = run.plot("Frequency response", case=f"{case}, stiffness own")
        labels = [line.get_label() for line in axes.get_lines()]
        assert sum(str(label).startswith("measured") for label in labels) == entries
        assert ("modes fitted to free" in labels) == (case == "right blade")


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> upd.RunResult:
    """A rig beside its own response with twice the height, and a wrong blade."""
    toy: dict[str, object] = {
        "want": ["free", "glued", "response"],
        "modes.arrangements": ["symmetric"],
        "mesh": {"element": "hex8i"},
        "response.points": 1500,
        "left_out.solve": "no",
    }
    folder = tmp_path_factory.mktemp("rig")
    first = upd.run("rig", overrides=toy | {"accuracy": "unknown"})
    more: dict[str, object] = {"response.damping": "measured"}
    for kind, state in (("free", "free"), ("glued", "stuck")):
        group = first.arrays[f"response {kind}"]
        f, H = group["frequency"][1], group["accelerance_right"][1]
        on = (f > 250.0) & (f < 480.0)
        head = "frequency [Hz],blade,state,H real [(m/s2)/N],H imag [(m/s2)/N]\n"
        rows = [
            f"{a:.6f},right,{state},{2 * b:.9g},{2 * c:.9g}\n"
            for a, (b, c) in zip(f[on], H[on], strict=True)
        ]
        (folder / f"{state}.csv").write_text(head + "".join(rows), encoding="utf-8")
        more[f"measured.{state}"] = {"file": str(folder / f"{state}.csv")}
    other = (folder / "free.csv").read_text(encoding="utf-8").replace("right", "left")
    (folder / "left.csv").write_text(other, encoding="utf-8")
    more["measured.left"] = {"file": str(folder / "left.csv")}
    more["accuracy"] = "unknown"
    with no_figures():
        return upd.run("rig", overrides=toy | more, out=folder / "b", report=False)


def test_a_rig_beside_measured_curves(rig: upd.RunResult) -> None:
    free, stuck = numbers(rig, "free"), numbers(rig, "stuck")
    assert free["fitted_damping"].value == pytest.approx(0.5, rel=1e-3)
    assert rig.value("damping") == pytest.approx(0.5, rel=1e-3)
    for found in (free, stuck):
        assert found["frac"].value == pytest.approx(1.0, abs=1e-5)
        # one parabola through three samples, one through many: a fifth of a step apart
        assert found["peak_frequency_difference"].value == pytest.approx(0.0, abs=0.05)
        assert found["computed_peak_accelerance"].error == pytest.approx(-0.5, abs=0.01)
    assert "at rest without the damper" in numbers(rig, "left")["frac"].withheld
    labels = [str(line.get_label()) for line in rig.plot("Frequency response")[0].get_lines()]
    assert sum(label.startswith("measured") for label in labels) == 2


def test_a_rig_refuses_what_it_has_not(tmp_path: Path) -> None:
    choice = {
        "file": str(EXAMPLE.parent / "measured" / "damped_left.csv"),
        "centrifugal_to_force": 400.0,
    }
    with pytest.raises(InputError, match="centrifugal_to_force: a rig has no friction"):
        upd.load_scene("rig", {"measured.a": choice})
    with pytest.raises(InputError, match=r'response.damping: "measured" needs a measured free'):
        upd.load_scene("rig", {"response.damping": "measured"})
    with pytest.raises(InputError, match='add "response" to want'):
        upd.load_scene("rig", {"measured.a": choice, "want": ["free"]})
