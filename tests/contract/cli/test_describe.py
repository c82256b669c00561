"""`upd describe` and `upd new`: what a user reads of the keys, and a copy to start from."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.pictures import png_size
from upd import cli
from upd.scene import load_scene


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as end:
        cli.main(list(arguments))
    return int(end.value.code or 0)


def test_all_keys_of_a_scene(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("describe", "hertz", "--set", "contact.friction=0.3") == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "Scene hertz: Half-sphere on a block" in told
    for table in ("[geometry]", "[materials.sphere]", "[contact]", "[left_out]"):
        assert table in told
    assert "friction 0.3 (default 0.0) >= 0" in told
    assert 'E "200 GPa" MPa > 0' in told


def test_one_key_in_full(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("describe", "hertz", "geometry.radius") == 0
    rows = [line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines()]
    assert rows[0] == ["geometry.radius"]
    told = {row[0]: row[1].strip() for row in rows[1:]}
    assert told == {
        "meaning": "Of the half-sphere.",
        "value": '"5 mm"',
        "default": '"5 mm"',
        "unit": "mm; understood: mm, m, cm, um, µm, nm",
        "bounds": "> 0",
        "uncertainty": '"VALUE +- HALF-WIDTH" or "VALUE +- 10 %"',
        "cost": "none",
    }


def test_recipe_and_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("describe", "blade_rig", "refine") == 0
    assert "elements grow with its cube" in capsys.readouterr().out
    assert call("describe", "rig", "modes") == 0
    told = capsys.readouterr().out
    assert "below" in told
    assert "[geometry]" not in told


def test_drawing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = tmp_path / "rig.png"
    assert call("describe", "rig", "refine", "--drawing", str(place)) == 0
    assert png_size(place.read_bytes())[0] > 1000
    assert call("describe", "rig", "refine", "--drawing", str(tmp_path / "rig.gif")) == 2
    assert "use .png" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("hertz", "frction"), "did you mean friction"),
        (("hertzz",), "Did you mean 'hertz'"),
        (("sphere_block", "--set", "radius=4 mm"), "--set is for scenes"),
    ],
)
def test_what_is_not_there(
    arguments: tuple[str, ...], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call("describe", *arguments) == 2
    assert says in " ".join(capsys.readouterr().err.split())


def test_a_new_scene_is_the_old_one_with_every_key_explained(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert call("new", "hertz", "mine.toml") == 0
    assert "mine.toml" in capsys.readouterr().out
    text = Path("mine.toml").read_text("utf-8")
    assert "# Coulomb's coefficient. (>= 0)" in text
    assert max(map(len, text.splitlines())) <= 100
    mine = load_scene("mine.toml")
    assert mine.name == "mine"
    assert mine.loads == load_scene("hertz").loads
    assert call("new", "hertz", "mine.toml") == 2
    assert "is there already" in capsys.readouterr().err
    assert call("new", "hertz", "mine") == 2
    assert "name it mine.toml" in capsys.readouterr().err
    assert call("new", "hertz", "no/folder.toml") in (0, 2)
    assert call("new", "hertz", "what is this.toml") == 2
    assert call("new", "own_damper.py", "wedge.toml") == 2
    assert "name it wedge.py" in capsys.readouterr().err
    for example in ("own_damper.toml", "own_damper.py"):
        assert call("new", example, example) == 0
    assert load_scene("own_damper.toml").recipe == str(tmp_path / "own_damper.py")
