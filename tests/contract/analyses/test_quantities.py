"""Every number of a run is declared once: name, unit and words.

Runs of the other analyses are looked at beside their own tests (`rigs.undeclared`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest
from rigs import undeclared

from upd.analyses import analysis_named
from upd.results import NO_CASE, Result
from upd.results import quantities as q
from upd.results.quantities import DECLARED, number_label, quantity_of

if TYPE_CHECKING:
    from upd.report.notebook import RunResult


@pytest.mark.parametrize("scene", ["hertz", "symmetric", "rig"])
def test_numbers_of_a_run_are_declared(
    scene: str, small_run: Callable[[str], RunResult], monkeypatch: pytest.MonkeyPatch
) -> None:
    results = small_run(scene).results
    assert undeclared(results) == []
    quantity, n = quantity_of(results[0].name)
    monkeypatch.delitem(DECLARED, quantity.name)
    quantity_of.cache_clear()
    assert f"{quantity.named(n)}, {results[0].unit}" in undeclared(results)
    monkeypatch.undo()
    quantity_of.cache_clear()


def test_a_number_of_another_unit_is_found() -> None:
    assert undeclared([Result("max_pressure", NO_CASE, 1.0, "Pa")]) == ["max_pressure, Pa"]
    assert undeclared([Result("peak_1_width", NO_CASE, 1.0, "Hz")]) == ["peak_1_width, Hz"]


@pytest.mark.parametrize("n", ["1", "12", "x", "damper"])
def test_a_name_is_of_one_quantity(n: str) -> None:
    for one in DECLARED.values():
        if "{n}" in one.name and one.named(n) not in DECLARED:
            assert quantity_of(one.named(n)) == (one, n)
            assert quantity_of(one.on("left").named(n)) == (one.on("left"), n)


@pytest.mark.parametrize("analysis", ["hertz", "flat", "modal", "seated", "forced"])
def test_main_numbers_are_declared(analysis: str) -> None:
    found = analysis_named(analysis)
    assert found is not None
    for name in (*found.headline_names, *found.verdict_names):
        assert quantity_of(name.replace("?", "1"))[0].name in DECLARED


def test_values_are_given_in_mm_and_come_in_the_unit() -> None:
    one = q.APPROACH.of(2e-3, NO_CASE, 1e-3, "Hertz")
    assert (one.name, one.value, one.unit, one.reference) == ("approach", 2.0, "um", 1.0)
    assert q.CONTACT_AREA.in_unit("um2").of(1e-6, NO_CASE).value == 1.0
    lost = q.PEAK_FREQUENCY.on("left").withheld(NO_CASE, "no curve", n=2)
    assert (lost.name, lost.unit, lost.withheld) == ("left_peak_2_frequency", "Hz", "no curve")


def test_words() -> None:
    assert number_label("left_peak_2_frequency") == "left blade, peak 2, frequency"
    assert number_label("K_N_damper_alone") == "K_N of the damper alone"
    assert number_label("K_Ty_damper_alone") == "K_T along y, platform rigid"
    assert number_label("f3_free") == "f3 free"
    assert number_label("number_of_another_tool") == "number of another tool"
