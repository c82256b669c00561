"""What inputs do to peaks: closed forms where all sticks, runs with the input changed where not."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import pytest
from rigs import LINES

from upd.analyses import forced, make_plan
from upd.analyses.forced.again import Run, run_curve, solve_again
from upd.analyses.forced.curves import linear_of
from upd.analyses.forced.inputs import effects_of, few_harmonics, input_variants
from upd.analyses.forced.solve import ForcedSolution, with_totals
from upd.progress import Stages, silent
from upd.scene import load_scene

RIG: dict[str, Any] = LINES | {
    "contact.rule": "gauss",
    "contact.rows": 3,
    "contact.columns": 2,
    "contact.directions": "one",
    "mesh.element": "hex8i",
    "reduction.modes": 4,
    "balance.harmonics": 3,
    "excitation.start": "285 Hz",
    "excitation.stop": "470 Hz",
    "excitation.points": 40,
    "want": ["response"],
    "left_out.solve": "no",
}
#: F_C/F_E at which all sticks, and at which points of the out-of-phase mode slip
STICKS, SLIPS = 1e5, 240.0
NAMES = (
    "fit of the faces",
    "height of the contact patch",
    "K_T of the left face",
    "K_T of the right face",
    "K_N of both faces",
    "friction",
    "static friction before vibration",
    "modal damping",
)


@cache
def solved(ratio: float, **more: Any) -> ForcedSolution:
    changes = {key.replace("__", "."): value for key, value in more.items()}
    if ratio == SLIPS:
        changes |= {"excitation.start": "435 Hz"}
    scene = RIG | {"excitation.centrifugal_to_force": [ratio]} | changes
    plan = make_plan(load_scene("symmetric-response", scene))
    found: Any = forced.ANALYSIS.solve(plan, Stages(silent))
    return found  # type: ignore[no-any-return]


class Effect(NamedTuple):
    """Relative changes of a peak by one end of an input."""

    label: str
    frequency: float
    height: float


@cache
def effects(ratio: float, name: str, **more: Any) -> dict[tuple[str, int], Effect]:
    """End and number of the mode -> what it does."""
    s = solved(ratio, **more)
    curves, model = tuple(run_curve(curve) for curve in s.curves), s.models["thesis"]
    plan = with_totals(s.plan, "thesis", model)
    few = few_harmonics(Run(plan, "thesis", model, s.linear["thesis"], curves))
    assert few is not None and s.bodies is not None
    mine = [one for one in input_variants(few, s.bodies) if one.of.source == name]
    found_again = {v.of.label: effects_of(few, solve_again(few, v)) for v in mine}
    changes: dict[tuple[str, int], list[float]] = {}
    for label, results in found_again.items():
        for one in results:
            assert one.case.choice == f"{name}: {label}"
            changes.setdefault((label, int(one.name.split("_")[1])), []).append(one.value / 100.0)
    return {key: Effect(key[0], *both) for key, both in changes.items()}


def test_damping_divides_the_heights_of_stuck_peaks() -> None:
    found = effects(STICKS, "modal damping")
    assert {label for label, _ in found} == {"x 0.8", "x 1.25"}
    assert {number for _, number in found} == {1, 2}
    for (label, _), one in found.items():
        factor = float(label.removeprefix("x "))
        assert 1.0 + one.height == pytest.approx(1.0 / factor, rel=2e-3)
        assert abs(one.frequency) < 2e-4


@pytest.mark.parametrize(
    ("name", "key", "factor"),
    [
        ("K_N of both faces", "K_N", 0.5),
        ("K_T of the left face", "left.K_T", 2.0),
        ("K_T of the right face", "right.K_T", 0.5),
    ],
)
def test_stiffness_moves_stuck_peaks_to_those_of_a_run_with_it(
    name: str, key: str, factor: float
) -> None:
    tables = {side: {"K_N": 1.56e6, "K_T": 4.9e5} for side in ("left", "right")}
    side, _, of = key.rpartition(".")
    for one in (side,) if side else tables:
        tables[one][of] *= factor
    given = {
        f"stiffness__thesis__{side}__{of}": f"{value} N/mm"
        for side, table in tables.items()
        for of, value in table.items()
    }
    changed, run = solved(STICKS, **given), solved(STICKS)
    model, linear = changed.models["thesis"], changed.linear["thesis"]
    assert linear_of(changed.plan, model).modes == linear.modes
    found = effects(STICKS, name)
    assert {label for label, _ in found} == {"x 0.5", "x 2"}
    for number in (1, 2):
        effect = found[f"x {factor:g}", number]
        was, now = (
            next(p for p in s.linear["thesis"].stuck_peaks["right"] if p.number == number)
            for s in (run, changed)
        )
        assert 1.0 + effect.frequency == pytest.approx(now.frequency / was.frequency, rel=1e-5)
        assert 1.0 + effect.height == pytest.approx(now.height / was.height, rel=1e-4)


def test_what_slips_nowhere_does_not_feel_friction() -> None:
    found = effects(STICKS, "friction")
    assert found
    for one in found.values():
        assert abs(one.frequency) < 1e-6 and abs(one.height) < 1e-6


def test_friction_moves_a_slipping_peak_to_that_of_a_run_with_it() -> None:
    top = solved(SLIPS).curves[0].tops["right", 2]
    assert top.slips
    found = effects(SLIPS, "friction")
    assert set(found) == {("mu 0.48", 2), ("mu 0.72", 2)}
    for mu in (0.48, 0.72):
        other = solved(SLIPS, contact__friction=mu).curves[0].tops["right", 2]
        one = found[f"mu {mu:g}", 2]
        assert 1.0 + one.height == pytest.approx(other.height / top.height, rel=2e-3)
        assert 1.0 + one.frequency == pytest.approx(other.frequency / top.frequency, rel=2e-4)
    heights = [abs(one.height) for one in found.values()]
    assert max(heights) > 1e-3


def test_a_smaller_patch_tilts_more() -> None:
    found = effects(STICKS, "height of the contact patch")
    assert {one.label for one in found.values()} == {"0.5 of its height"}
    assert found["0.5 of its height", 1].frequency < -0.01


def test_faces_that_are_new_or_carry_friction_at_rest() -> None:
    """At so small a force nothing slips: half of friction at rest leaves the stuck response, and so
    do new faces only where no point opens under F_C.
    """
    for one in effects(STICKS, "static friction before vibration").values():
        assert one.label in ("T/N -0.3 on both faces", "T/N 0.3 on both faces")
        assert abs(one.frequency) < 1e-4 and abs(one.height) < 1e-3
    fit = effects(STICKS, "fit of the faces")
    assert {one.label for one in fit.values()} == {"new, not worn in"}


def test_without_friction_what_is_of_friction_does_not_apply() -> None:
    smooth = {"contact__friction": 0.0}
    assert effects(STICKS, "modal damping", **smooth)
    for name in ("friction", "static friction before vibration"):
        assert effects(STICKS, name, **smooth) == {}


def test_a_run_tells_every_input_that_applies() -> None:
    found = solved(SLIPS, want=("response", "inputs"))
    told = {one.case.choice.partition(":")[0] for one in found.effects}
    assert told == set(NAMES)
    results = [r for r in forced.ANALYSIS.make_results(found) if r.name.endswith("_change")]
    assert {r.case.choice.partition(":")[0] for r in results} <= told
    assert {r.case.force_ratio for r in results} == {SLIPS}
    assert all(abs(r.value) < 100.0 for r in results)
