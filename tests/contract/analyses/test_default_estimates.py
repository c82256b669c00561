"""Every run estimates the errors of its numbers from cheaper companions, unless told not to."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

import upd
from upd.analyses import analysis_of, make_plan
from upd.analyses.contact.varied import choices, levels
from upd.errors import InputError
from upd.plot.chart import Entry
from upd.report.tables import budget_table, error_parts
from upd.results import Case, ErrorPart, InputPart, Result, with_parts
from upd.scene import as_scene, load_scene
from upd.vary.solve import changed

pytestmark = pytest.mark.estimated

SPHERE: dict[str, Any] = {
    "want": ["normal", "stiffness"],
    "geometry.patch": "auto",
    "geometry.divisions": 16,
    "loads.normal": ["200 N"],
    "left_out.solve": "no",
}
WEDGE: dict[str, Any] = {
    "want": ["normal", "stiffness"],
    "geometry.divisions": 8,
    "geometry.divisions_long": 16,
    "geometry.thickness": "10 mm",
    "geometry.margin": "4 mm",
    "loads.normal": ["100 N"],
    "left_out.solve": "no",
}
RIG: dict[str, Any] = {
    "want": ["free", "reduction"],
    "mesh.element": "hex8i",
    "modes.arrangements": ["symmetric"],
    "left_out.solve": "no",
}


@pytest.fixture(scope="module")
def sphere() -> upd.RunResult:
    return upd.run("hertz", overrides=SPHERE)


def test_main_numbers_have_a_bound_that_holds(sphere: upd.RunResult) -> None:
    """Against Hertz: bounded, and not out of all proportion."""
    for name in ("max_pressure", "radius_moment", "mean_pressure", "approach_contact"):
        (row,) = (r for r in sphere.results if r.name == name)
        assert row.error is not None
        assert row.estimated_error is not None
        assert abs(row.error) <= row.estimated_error < 0.25
        assert row.parts[0].source.startswith("mesh")
        assert row.parts[0].basis


def test_terminal_page_and_files_tell_them(sphere: upd.RunResult) -> None:
    text = sphere.table()
    row = next(r for r in sphere.results if r.name == "max_pressure")
    assert row.estimated_error is not None
    assert f"MPa ±{100.0 * row.estimated_error:.2g} %" in text
    assert "Error of the maximum pressure: mesh" in text
    entry = row.as_dict()
    (part,) = error_parts(entry)
    assert part[:2] == ("mesh", row.estimated_error)
    assert "mesh" in budget_table([entry]).rows[0]


@pytest.mark.parametrize(
    ("scene", "small", "known"),
    [
        # Betti's theorem tells these from the run itself
        ("hertz", SPHERE, {"approach", "approach_contact"}),
        ("symmetric", WEDGE, set()),
        ("rig", RIG, set()),
    ],
)
def test_unknown_solves_no_companion(scene: str, small: dict[str, Any], known: set[str]) -> None:
    plan = make_plan(load_scene(scene, small))
    without = make_plan(load_scene(scene, small | {"accuracy": "unknown"}))
    assert plan.seconds == pytest.approx(without.seconds + plan.estimate_seconds)
    assert plan.estimate_seconds > without.estimate_seconds == 0.0
    found = upd.run(scene, overrides=small | {"accuracy": "unknown"})
    assert "error estimates" not in found.cost["stages"]
    assert {r.name for r in found.results if r.parts} == known
    assert {p.basis.split(":")[0] for r in found.results for p in r.parts} <= {"Betti's theorem"}


def test_rig_on_linear_elements_is_judged_by_coarser_ones() -> None:
    found = upd.run("rig", overrides=RIG)
    one = next(r for r in found.results if r.name == "f1_free")
    reduced = next(r for r in found.results if r.name == "f1_reduced")
    # hex20 to the second refinement: 293.3 Hz
    assert one.estimated_error is not None
    assert abs(one.value / 293.3 - 1.0) < one.estimated_error < 0.15
    assert [part.source for part in reduced.parts] == ["mesh", "modes kept"]
    assert reduced.reference is not None
    exact = abs(reduced.value / reduced.reference - 1.0)
    assert reduced.parts[1].error == pytest.approx(exact)


def test_companions_that_fail_leave_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    """A number without an estimate is not given a small one."""

    def refuse(*_: Any) -> Any:
        raise InputError("cannot be meshed")

    monkeypatch.setattr("upd.vary.solve.changed", refuse)
    found = upd.run("symmetric", overrides=WEDGE)
    row = next(r for r in found.results if r.name == "K_N_secant_raw")
    assert row.estimated_error is None
    assert "cannot be meshed" in row.parts[0].basis
    assert "not found" in str(budget_table([row.as_dict()]).rows)


def test_an_accuracy_is_reached_on_the_cheapest_level() -> None:
    """The stiffness within 10 %, proved by the run itself; a finer mesh agrees."""
    scene = WEDGE | {"accuracy": {"K_N_secant_raw": 0.1}}
    found = upd.run("symmetric", overrides=scene)
    row = next(r for r in found.results if r.name == "K_N_secant_raw")
    assert row.estimated_error is not None
    assert row.estimated_error <= 0.1
    finer = {"geometry.divisions": 12, "geometry.divisions_long": 24, "accuracy": "unknown"}
    fine = upd.run("symmetric", overrides=WEDGE | finer)
    assert abs(row.value / fine.value("K_N_secant_raw") - 1.0) <= row.estimated_error
    assert any(e["name"] == "levels chosen by accuracy" for e in found.effects)


def _levels(scene: Any) -> list[Any]:
    (mesh,) = choices(scene)
    return [changed(scene, mesh.at(scene, k)) for k in range(len(mesh.labels))]


def test_levels_of_a_flat_contact_have_twenty_nodes() -> None:
    """Unless the scene has elements of 27: the far end under its bands takes more than 8."""
    for element, there in (("hex8i", "hex20"), ("hex8", "hex20"), ("hex27", "hex27")):
        scene = load_scene("symmetric", WEDGE | {"accuracy": "1 %", "mesh.element": element})
        assert {one.mesh.element for one in _levels(scene)} == {there}
        assert make_plan(scene).scene.mesh.element == there


def test_levels_of_pads_have_thin_elements_under_the_wires() -> None:
    """Half as many across as the scene has, all counts and the layers of the pads in proportion."""
    given = {"accuracy": "1 %", "geometry.divisions": 8, "geometry.divisions_long": 18}
    names = ("divisions", "divisions_long", "first_layer", "bottom_layer")
    for more, layer in (({}, 1.0), ({"geometry.bottom_layer": 0.5}, 0.5)):
        levels = _levels(load_scene("asymmetric", given | more))
        found = [[one.geometry[name] for name in names] for one in levels]
        assert found[:3] == [[k, 9 * k // 2, 0.5, layer] for k in (2, 4, 6)]


def test_levels_of_a_wedge_have_an_even_number_along_it() -> None:
    found = [one.geometry for one in _levels(load_scene("symmetric", {"accuracy": "1 %"}))]
    assert [g["divisions"] for g in found[:4]] == [4, 6, 8, 12]
    assert [g["divisions_long"] for g in found[:4]] == [12, 16, 22, 34]
    assert not any("bottom_layer" in g for g in found)


def test_an_accuracy_of_no_number_is_refused() -> None:
    with pytest.raises(InputError, match=r"K_X: this run has no number of that name; it has .*K_N"):
        upd.run("symmetric", overrides=WEDGE | {"accuracy": {"K_X": 0.01}})


@pytest.mark.parametrize("scene", ["symmetric-seated"])
def test_a_scene_that_does_not_choose_its_levels_says_so(scene: str) -> None:
    with pytest.raises(InputError, match=r"accuracy: .* does not choose its levels itself; raise"):
        analysis_of(load_scene(scene, {"accuracy": "1 %"}))


def _entry(error: float | None, changes: dict[str, float], name: str = "max_pressure") -> Entry:
    """A number of a run with one source of error and its inputs."""
    parts = tuple(InputPart(path, 0.1, change, "x") for path, change in changes.items())
    row = Result(name, Case(load=200.0), 2650.0, "MPa", inputs=parts)
    mesh = () if error is None else (ErrorPart("mesh", error, "coarser", 3.0),)
    return with_parts(row, mesh).as_dict()


def test_inputs_have_a_line_without_estimates_too() -> None:
    entry = _entry(None, {"contact.friction": 0.03})
    assert budget_table([entry]).rows[0][2:4] == ("input contact.friction", "3 %")


@pytest.mark.parametrize(("error", "more"), [(0.01, True), (0.05, False)])
def test_an_answer_says_when_finer_levels_do_not_help(
    error: float, more: bool, sphere: upd.RunResult
) -> None:
    inputs = (InputPart("contact.friction", 0.1, 0.03, "x"),)
    mesh = (ErrorPart("mesh", error, "coarser", 3.0),)
    numbers = tuple(with_parts(replace(r, inputs=inputs), mesh) for r in sphere.results)
    lines = " ".join(text for text, _ in replace(sphere, results=numbers).answer(200))
    assert "input contact.friction 3 %" in lines
    assert ("finer levels do not help" in lines) == more


def test_the_coarsest_mesh_says_which_divisions_give_an_estimate() -> None:
    plan = make_plan(as_scene("symmetric", {"geometry.divisions": 1}))
    assert "geometry.divisions, 6 or more" in levels(plan)["mesh"]
