"""Inputs known within limits: read, refused, written back, and no part of a scene's values."""

from __future__ import annotations

from pathlib import Path

import pytest

from upd.cli.describe import described, print_keys
from upd.errors import InputError
from upd.scene import load_scene
from upd.scene.keys import scene_as_run, scene_to_start_from

RIG = "symmetric-response"


@pytest.mark.parametrize(
    ("path", "given", "value", "half"),
    [
        ("contact.friction", "0.6 +- 0.1", 0.6, 0.1),
        ("contact.friction", "0.6 ± 10 %", 0.6, 0.06),
        ("contact.friction", "0.6+/-0.1", 0.6, 0.1),
        ("material.E", "200 GPa +- 5 GPa", 2e5, 5e3),
        ("material.E", "200 GPa +- 500 MPa", 2e5, 500.0),
        ("material.E", "200 GPa +- 5 %", 2e5, 1e4),
        ("material.nu", "0.3 +- 0.02", 0.3, 0.02),
        ("excitation.damping", "0.5 % +- 0.1 %", 5e-3, 1e-3),
        ("stiffness.given.K_T", "4.9e5 N/mm +- 30 %", 4.9e5, 1.47e5),
        ("stiffness.given.K_T", "4.9e5 N/mm +- 0.1 N/um", 4.9e5, 100.0),
        ("geometry.patch_length", "15 mm +- 500 um", 15.0, 0.5),
        ("damper.centrifugal", "350 N +- 10 N", 350.0, 10.0),
    ],
)
def test_value_and_half_width(path: str, given: str, value: float, half: float) -> None:
    """In the unit inside; a share is of the value, but of one in per cent its own unit."""
    table = {"stiffness.given.K_N": "1e6 N/mm", "stiffness.given.K_T": "4.9e5 N/mm"}
    one = load_scene(RIG, table | {path: given}).uncertain[path]
    assert one.value == pytest.approx(value, rel=1e-15)
    assert one.half_width == pytest.approx(half, rel=1e-12)
    assert one.relative == pytest.approx(half / value, rel=1e-12)
    assert one.given == given


def test_scene_has_the_value_alone() -> None:
    """What is known of an input changes no value, and no key under which results are kept."""
    plain = load_scene("symmetric")
    vague = load_scene("symmetric", {"contact.friction": f"{plain.contact.friction} +- 0.1"})
    assert vague.contact == plain.contact
    # the text is what results are kept under
    assert vague.text == plain.text
    assert not plain.uncertain


def test_item_of_a_list() -> None:
    """A load among several has its own."""
    scene = load_scene("hertz", {"loads.normal": ["50 N", "200 N +- 10 N"]})
    assert scene.loads.normal == (50.0, 200.0)
    assert scene.uncertain["loads.normal[1]"].half_width == 10.0


def test_written_back_as_given(tmp_path: Path) -> None:
    """The scene of a run folder, and a copy to start from, read as the scene."""
    given = {"contact.friction": "0.6 +- 0.1", "material.E": "200 GPa ± 5 GPa", "title": "1 +- 2"}
    scene = load_scene(RIG, given)
    assert scene.title == "1 +- 2"
    for k, text in enumerate((scene_as_run(scene), scene_to_start_from(scene, "copy"))):
        file = tmp_path / f"{k}.toml"
        file.write_text(text, encoding="utf-8")
        again = load_scene(file)
        assert 'friction = "0.6 +- 0.1"' in text
        assert dict(again.uncertain) == dict(scene.uncertain)
        assert again.contact == scene.contact


@pytest.mark.parametrize(
    ("path", "given", "told"),
    [
        ("contact.friction", "0.6 +- -0.1", "half-width -0.1 is not above 0"),
        ("contact.friction", "0.6 +- 0", "half-width 0 is not above 0"),
        ("contact.friction", "0.6 +-", "no number stands after"),
        ("contact.friction", "0.6 +- 0.1 mm", "'mm' is a unit of length"),
        ("contact.friction", "0.6 +- 0.7", "reaches -0.1, which the scene does not allow"),
        ("material.nu", "0.3 +- 0.2", "reaches 0.5, which the scene does not allow"),
        ("material.E", "200 GPa +- 30", "has no unit; to fix it: write \\+- 30 GPa"),
        ("material.E", "200 GPa +- 3 mm", "'mm' is a unit of length"),
        ("geometry.patch_length", "15 mm +- 20 mm", "reaches -5 mm"),
        ("geometry.refine", "1 +- 1", "no physical quantity"),
        ("excitation.start", "300 Hz +- 1 Hz", "no physical quantity"),
    ],
)
def test_one_clear_error(path: str, given: str, told: str) -> None:
    """Nonsense is one problem, with its place."""
    with pytest.raises(InputError, match="1 problem\n") as caught:
        load_scene(RIG, {path: given})
    assert caught.match(f"{path}: .*{told}")


def test_describe_tells_it(capsys: pytest.CaptureFixture[str]) -> None:
    """A key that may carry it says so, a choice does not, and a value shows it."""
    from rich.console import Console

    title, keys = described(RIG, ["contact.friction=0.6 +- 0.1"])
    for key, expected in (("contact.friction", True), ("excitation.points", False)):
        print_keys(Console(width=200), title, keys, key)
        told = capsys.readouterr().out
        assert ("uncertainty" in told) is expected
        assert ("0.6 +- 0.1" in told) is expected
