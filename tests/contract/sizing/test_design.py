"""`upd design` and `upd.design`: the scene's damper, its verdict, figure and numbers."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import upd
from tests.pictures import png_size
from upd import cli
from upd.contact.rigid_damper import SLIDINGS, DamperSection, FaceSection, eccentricity
from upd.errors import InputError
from upd.scene import load_scene
from upd.sizing import damper_statics
from upd.sizing.statics import (
    CARRIES,
    JAMS,
    LEFT_LIFTS,
    OUTCOMES,
    TILTS,
    motion_state,
    outcomes,
    scene_damper,
    tilts_from,
)

F_C, TAN_30 = 350.0, math.tan(math.pi / 6.0)


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as end:
        cli.main(list(arguments))
    return int(end.value.code or 0)


def test_section_of_the_symmetric_rig() -> None:
    """The trapezoid 30 mm wide below and 6 mm above, 12 mm high, its contact of 15 mm ending 1.5 mm
    below the platform's tip.
    """
    section, mass = scene_damper(load_scene("symmetric-response"))
    left, right = section.faces
    height = 12.0 * (30.0 + 2.0 * 6.0) / (3.0 * (30.0 + 6.0))
    # the tips of the platforms are 3 mm from the middle, level with the damper's upper side
    down = (1.5 + 7.5) * math.sqrt(0.5)
    assert right.middle == pytest.approx((3.0 + down, 12.0 - down - height), abs=1e-9)
    assert left.middle == pytest.approx((-3.0 - down, 12.0 - down - height), abs=1e-9)
    assert (left.half_length, right.half_length) == pytest.approx((7.5, 7.5))
    assert (left.angle, right.angle) == pytest.approx((45.0, 45.0))
    assert mass == pytest.approx(7.8e-9 * 18.0 * 12.0 * 42.5)


def test_section_of_the_asymmetric_rig() -> None:
    found = scene_damper(load_scene("asymmetric-seated"))[0]
    assert (found.left.angle, found.right.angle) == pytest.approx((90.0, 30.0))
    assert 2.0 * found.right.half_length == pytest.approx(8.0)
    # the middle of the pads is so far from the upright face
    assert found.right.middle[0] - found.left.middle[0] == pytest.approx(7.129)


def test_asymmetric_damper_jams_and_lifts_off_above_tan_30() -> None:
    """90 and 30 deg: both limits at tan 30 deg; on the pads alone F_C cos 30 and F_C sin 30."""
    found = damper_statics(load_scene("asymmetric-response"))
    assert found.problems == ("jams", "left face lifts off")
    assert found.sound_below == pytest.approx(TAN_30)
    part = found.states[0]
    assert part.outcome == OUTCOMES[LEFT_LIFTS]
    assert pytest.approx([0.0, F_C * math.cos(math.pi / 6.0)]) == part.N
    assert pytest.approx([0.0, F_C * math.sin(math.pi / 6.0)]) == part.T
    assert np.isposinf(found.force_limits[0, :, 1]).all()
    below = damper_statics(load_scene("asymmetric-response", {"contact.friction": 0.57}))
    assert below.problems == ()
    assert np.isfinite(below.force_limits).all()
    told = upd.design("asymmetric-response", overrides=["contact.friction=0.57"]).verdict
    assert told.endswith("at mu = 0.57 both faces carry in every motion, as below mu = 0.5774")


def test_symmetric_damper_rolls_as_one_platform_rises() -> None:
    """By hand: N = F_C (1 +- mu) / (sqrt 2 (1 + mu^2)), and the moment of both forces at the
    middles of the faces.
    """
    found = damper_statics(load_scene("symmetric-response"))
    assert found.problems == ("tilts",)
    rises = found.states[2]
    mu, r = 0.6, math.sqrt(0.5)
    N = F_C * np.array([1.0 + mu, 1.0 - mu]) * r / (1.0 + mu**2)
    # left: friction opposes F_C, resultant leans by 45 deg - phi; right: by 45 deg + phi
    assert pytest.approx(N) == rises.N
    assert pytest.approx(mu * N * [1.0, -1.0]) == rises.T
    x, z = found.section.right.middle
    up = N * r + rises.T * r
    across = (N * r - rises.T * r) * [-1.0, 1.0]
    moment = (-x) * up[0] - z * across[0] + x * up[1] - z * across[1]
    assert rises.eccentricity == pytest.approx(abs(moment) / (7.5 * N.sum()))
    assert rises.eccentricity > 1.0
    limit = found.tilts
    shares = [
        float(eccentricity(found.section, m.left * limit, m.right * limit)[1]) for m in SLIDINGS
    ]
    assert max(shares) == pytest.approx(1.0)


def test_work_of_friction_is_that_of_the_blades() -> None:
    """What friction takes is what the force on the moving blade gives, less F_C's own work."""
    found = damper_statics(load_scene("symmetric-response", {"contact.friction": 0.4}))
    a = math.radians(45.0)
    for state in found.states:
        N, T, s = state.N, state.T, state.slides
        force = np.array(
            [N[1] * math.sin(a) - T[1] * math.cos(a), N[1] * math.cos(a) + T[1] * math.sin(a)]
        )
        moved = np.array([state.motion.across, state.motion.up])
        lifts = s[0] * math.sin(a)
        # the damper pushes the right blade by that force; the blade's holder gives the opposite
        assert -force @ moved + F_C * lifts == pytest.approx(np.abs(T * s).sum())


def test_faces_too_short_for_a_jam_tilt_the_damper_instead() -> None:
    """Friction could hold it, but no line from face to face lies in both cones."""
    low = DamperSection(FaceSection(60.0, (-5.0, -6.0), 0.5), FaceSection(60.0, (5.0, 6.0), 0.5))
    level = DamperSection(FaceSection(60.0, (-5.0, 2.0), 0.5), FaceSection(60.0, (5.0, 2.0), 0.5))
    approach = SLIDINGS[1]
    assert motion_state(level, 0.7, F_C, approach).outcome == OUTCOMES[JAMS]
    assert motion_state(low, 0.7, F_C, approach).outcome == OUTCOMES[TILTS]


def test_maps_agree_with_the_damper_itself() -> None:
    tilts = set()
    for name in ("symmetric-response", "asymmetric-response"):
        for mu in (0.2, 0.5, 0.57, 0.6, 0.7, 1.1):
            found = damper_statics(load_scene(name, {"contact.friction": mu}))
            left, right = (face.angle for face in found.section.faces)
            worst = OUTCOMES[int(outcomes(found.section, left, right, mu))]
            assert worst == (found.problems or (OUTCOMES[CARRIES],))[0], (name, mu)
            if found.limits.lowest > mu:
                tilts.add((found.tilts <= mu, "tilts" in found.problems))
    # both outcomes are among them
    assert tilts == {(True, True), (False, False)}


def test_a_damper_that_tilts_without_friction() -> None:
    off = DamperSection(FaceSection(45.0, (20.0, 0.0), 1.0), FaceSection(45.0, (30.0, 0.0), 1.0))
    assert tilts_from(off) == 0.0


@pytest.mark.parametrize("mu", [0.0, 0.6, 1.2])
@pytest.mark.parametrize("name", ["symmetric-response", "asymmetric-seated"])
def test_charts_mark_the_damper(name: str, mu: float) -> None:
    found = damper_statics(load_scene(name, {"contact.friction": mu}))
    charts = found.charts
    maps = [chart for chart in charts if chart.maps]
    assert {state for chart in maps for state in chart.maps[0].states} == set(OUTCOMES)
    marked = [t for chart in maps for t in chart.traces if t.style == "star"]
    assert len(marked) == len(maps)
    assert all(t.label.startswith("this damper") for t in marked)
    left, right = (face.angle for face in found.section.faces)
    places = [(float(t.x[0]), float(t.y[0])) for t in marked]
    assert places == [(left, right), *((at, mu) for at in dict.fromkeys((left, right)))]
    assert all(chart.x.name and chart.y.name for chart in charts)


def test_command_tells_first_and_draws(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert call("design", "asymmetric-response", "--set", "contact.friction=0.6") == 0
    told = capsys.readouterr().out
    first = " ".join(told.partition("\n\n")[0].split())
    assert first == (
        "asymmetric-response: at mu = 0.6 the damper jams, the left face lifts off; both faces "
        "always carry below mu = 0.5774"
    )
    assert "350 N, damper 46.996 g" in told
    folder = tmp_path / "runs" / "design-asymmetric-response"
    assert {file.name for file in folder.iterdir()} == {"design.png", "report.html", "summary.json"}
    wide, tall = png_size((folder / "design.png").read_bytes())
    assert wide > tall > 500
    numbers = json.loads((folder / "summary.json").read_text())
    assert first == f"{numbers['verdict']}"
    friction, motions, bounds = numbers["tables"]
    limits = [mu for _, mu in friction["rows"]]
    assert limits[0] == pytest.approx(TAN_30) and limits[2] is None
    assert bounds["rows"][0][1:3] == [0.0, None]
    assert motions["rows"][0][3] == pytest.approx(F_C * math.cos(math.pi / 6.0))
    page = (folder / "report.html").read_text()
    assert "<h2>Friction</h2>" in page and "data:image/webp" in page
    # again into the same folder
    assert call("design", "asymmetric-response") == 0


@pytest.mark.parametrize(
    ("scene", "kind"), [("hertz", "curved contact"), ("symmetric", "flat contact"), ("rig", "rig")]
)
def test_scene_without_a_damper_between_blades(
    scene: str, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call("design", scene) == 2
    told = " ".join(capsys.readouterr().err.split())
    assert f"scene {scene}: has no damper between two blades (it is a {kind})" in told
    assert "symmetric-response" in told


def test_folder_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"cannot be written.*--out"):
        upd.design("symmetric-response", out=tmp_path / "file" / "deep")


def test_friction_known_within_limits() -> None:
    found = upd.design("asymmetric-response", overrides=["contact.friction=0.6 +- 0.1"])
    assert [mu for mu, _ in found.known_within] == pytest.approx([0.5, 0.7])
    told = (
        "at 0.5 both faces carry in every motion; at 0.7 the damper jams, the left face lifts off"
    )
    assert told in " ".join(found.table().split())
    ends = [(b.low, b.high) for c in found.charts for b in c.bands if "known within" in b.label]
    assert ends == [pytest.approx((0.5, 0.7))] * 2


def test_in_a_notebook() -> None:
    turning: dict[str, Any] = {
        "damper.centrifugal": "from speed",
        "damper.radius": "300 mm",
        "damper.speed": "4000 rpm",
    }
    found = upd.design("symmetric-response", overrides=turning)
    assert found.folder is None
    omega = 4000.0 * 2.0 * math.pi / 60.0
    assert found.centrifugal == pytest.approx(7.8e-9 * 9180.0 * 300.0 * omega**2)
    assert "F_C 3769.1 N = m r w^2: damper 71.604 g, 300 mm, 4000 rpm" in found.table()
    assert "tilts" in found.table()
