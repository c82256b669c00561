"""Charts of modal analyses and forced responses.

Described from the arrays alone, in the units on their axes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from upd.analyses import forced, modal
from upd.plot.chart import Chart
from upd.results import Group, Variable, variable

CURVE = {"content": "friction", "stiffness": "own", "force_ratio": 194.0}


def group(attributes: dict[str, Any], **variables: Variable) -> Group:
    made = Group(variables)
    made.attributes.update(attributes)
    return made


def values(data: Any, *dims: str, units: str = "", **attributes: str) -> Variable:
    return variable(" ".join(dims), data, units, **attributes)


def accelerance(magnitude: Any) -> Variable:
    """Of a phase of 3, 4, 5."""
    z = np.asarray(magnitude, float)
    return values(np.stack([0.6 * z, 0.8 * z], -1), "frequency", "part", units="(m/s2)/N")


def friction(f: Any, **more: Variable) -> Group:
    """A curve of two points on each face.

    The third frequency is the first peak, where the last point slides most.
    """
    n = len(f)
    state = np.tile([1.0, 0.0, 0.0], (n, 4, 1))
    state[2:, 3] = [0.5, 0.3, 0.2]
    energy = np.zeros((n, 4))
    energy[2] = [0.0, 1.0, 0.0, 4.0]
    return group(
        CURVE,
        frequency=values(f, "frequency", units="Hz"),
        accelerance_right=accelerance(np.full(n, 5.0)),
        accelerance_left=accelerance(np.full(n, 2.0)),
        peak_frequency_right=values([f[2]], "peak_right", units="Hz"),
        peak_accelerance_right=values([5.0], "peak_right", units="(m/s2)/N"),
        state=values(state, "frequency", "contact_point", "state"),
        energy=values(energy, "frequency", "contact_point", units="N mm"),
        power=values(np.full((n, 4), 1e-3), "frequency", "contact_point", units="W"),
        peak=values([1, 2], "peak"),
        peak_index=values([2, 0], "peak"),
        share=values(
            np.stack([state[:, :2].mean(axis=1), state[:, 2:].mean(axis=1)], axis=1),
            "frequency",
            "side",
            "state",
        ),
        loop_peak=values([1, 2], "loop"),
        loop_side=values([1, 0], "loop"),
        loop_along=values([-0.0, 3.0], "loop", units="mm"),
        loop_up=values([3.75, 0.0], "loop", units="mm"),
        loop_energy=values([1.5e-4, 0.0], "loop", units="N mm"),
        loop_displacement=values([[0.0, 1e-3], [0.0, 0.0]], "loop", "sample", units="mm"),
        loop_traction=values([[1.0, 2.0], [0.0, 0.0]], "loop", "sample", units="N"),
        **more,
    )


@pytest.fixture
def arrays() -> dict[str, Group]:
    f = np.linspace(290.0, 300.0, 4)
    own = {"stiffness": "own"}
    zero, four = accelerance(np.zeros(4)), accelerance(np.full(4, 4.0))
    return {
        "points own": group(
            {"content": "points"} | own,
            face=values([0, 0, 1, 1], "contact_point"),
            along=values([0.0, 3.0, 0.0, 3.0], "contact_point", units="mm"),
            up=values([0.0, 1.0, 0.0, 1.0], "contact_point", units="mm"),
        ),
        "linear own": group(
            {"content": "linear"} | own,
            frequency=values(f, "frequency", units="Hz"),
            damping=values(0.005),
            accelerance_free_right=four,
            accelerance_free_left=zero,
            accelerance_stuck_right=four,
            accelerance_stuck_left=four,
        ),
        "friction own, F_C per F_E 194": friction(f),
    }


def made(arrays: dict[str, Group]) -> dict[tuple[str, str], Chart]:
    return {(c.title, c.case): c for c in forced.ANALYSIS.charts(arrays, {})}


def test_responses_show_limits_curves_and_peaks(arrays: dict[str, Group]) -> None:
    charts = made(arrays)
    right, left = (
        charts["Frequency response", f"{blade} blade, stiffness own"] for blade in ("right", "left")
    )
    assert [(t.label, t.style, t.closed) for t in right.traces] == [
        ("free", "dashed", True),
        ("stuck", "dashdot", True),
        ("F_C/F_E 194", "line", False),
    ]
    # A blade at rest has no curve.
    assert [t.label for t in left.traces] == ["stuck", "F_C/F_E 194"]
    assert right.traces[2].y == pytest.approx([5.0] * 4)
    assert [(m.y, m.text) for m in right.marks] == [(5.0, f"{290.0 + 20.0 / 3.0:.1f} Hz")]
    assert (right.x.low, right.x.high, right.detail) == (290.0, 300.0, "damping 0.5 %")
    assert right.y.label == "accelerance, (m/s²)/N" and right.y.log


def test_what_is_unstable_is_dotted_in_the_colour_of_its_ratio(arrays: dict[str, Group]) -> None:
    """Parts touch: each goes on to its neighbour of the other."""
    stable = values([1, 1, 0, 0], "frequency")
    turned = friction([290.0, 300.0, 295.0, 292.0], stable=stable)
    first = friction(np.linspace(290.0, 300.0, 4))
    first.attributes = CURVE | {"force_ratio": 600.0}
    arrays["friction own, F_C per F_E 194"] = turned
    charts = made({"first": first} | arrays)
    found = {
        t.label: (t.style, t.colour, np.isfinite(t.y).tolist(), t.entry)
        for t in charts["Frequency response", "right blade, stiffness own"].traces
        if not t.closed
    }
    assert found == {
        "F_C/F_E 600": ("line", 0, [True] * 4, "F_C/F_E 600"),
        "F_C/F_E 194": ("line", 1, [True, True, True, False], "F_C/F_E 194"),
        "F_C/F_E 194, unstable": ("dotted", 1, [False, True, True, True], "F_C/F_E 194"),
    }


def test_shares_are_stacked_to_the_whole(arrays: dict[str, Group]) -> None:
    chart = made(arrays)["Contact state", "own, F_C/F_E 194, right face"]
    assert [a.state for a in chart.areas] == ["stick", "slip", "lift-off"]
    assert [a.high[3] - a.low[3] for a in chart.areas] == pytest.approx([75.0, 15.0, 10.0])
    assert chart.areas[0].low == pytest.approx(0.0) and chart.areas[2].high == pytest.approx(100.0)
    assert (chart.x.label, chart.x.ticks) == ("frequency, Hz", ())


def test_a_path_that_turns_back_is_drawn_along_its_points(arrays: dict[str, Group]) -> None:
    arrays["friction own, F_C per F_E 194"] = friction([290.0, 300.0, 295.0, 297.5])
    chart = made(arrays)["Contact state", "own, F_C/F_E 194, right face"]
    assert chart.areas[0].x.tolist() == [0.0, 1.0, 2.0, 3.0]
    assert chart.x.label == "frequency along the path, Hz"
    assert [text for _, text in chart.x.ticks] == [
        "290.0",
        "296.0",
        "299.0",
        "296.0",
        "296.0",
        "297.5",
    ]


def test_contact_map_shows_the_points_of_a_face_at_the_peak_that_slides(
    arrays: dict[str, Group],
) -> None:
    right = "own, F_C/F_E 194, at peak 1, right face"
    maps = [key for key in made(arrays) if key[0].startswith("Contact points at the peak")]
    assert maps == [
        (f"Contact points at the peak: {state}", right) for state in ("slip", "lift-off")
    ], "the other face sticks"
    arrays["friction own, F_C per F_E 194"]["state"].data[2, 1] = [0.75, 0.25, 0.0]
    charts = made(arrays)
    slip, lift = (charts[key].scatters[0] for key in maps)
    assert (slip.x.tolist(), slip.y.tolist()) == ([0.0, 3.0], [0.0, 1.0])
    assert (slip.value[1], lift.value[1]) == (30.0, 20.0)
    assert slip.size.tolist() == lift.size.tolist() == [0.0, 1.0]
    # Sizes are those of the larger loss on the other face, where nothing lifts off.
    left = "own, F_C/F_E 194, at peak 1, left face"
    mine = [chart for chart in charts.values() if chart.scatters and chart.case == left]
    assert [chart.title for chart in mine] == ["Contact points at the peak: slip"]
    assert mine[0].scatters[0].size.tolist() == [0.0, 0.25]
    assert charts[maps[0]].detail == "296.7 Hz"


def test_loops_are_closed_and_say_where_they_are(arrays: dict[str, Group]) -> None:
    charts = made(arrays)
    chart = charts["Hysteresis", "own, F_C/F_E 194, at peak 1"]
    assert [t.label for t in chart.traces] == ["right, y 0.0, up 3.8 mm: 0.00015 N mm"]
    assert (chart.traces[0].x.tolist(), chart.traces[0].y.tolist()) == (
        [0.0, 1.0, 0.0],
        [1.0, 2.0, 1.0],
    )
    # At the second peak nothing slides.
    assert [c.case for c in charts.values() if c.title == "Hysteresis"] == [chart.case]


def test_a_peak_of_the_sweeps_is_drawn_from_the_march_alone(arrays: dict[str, Group]) -> None:
    del arrays["friction own, F_C per F_E 194"]
    f = [297.2]
    march = friction([0.0, 0.0, *f])
    for name in ("state", "energy", "power", "share"):
        data = march[name]
        march[name] = values(data.data[2:], *data.dims, units=data.units)
    march |= {
        "frequency": values(f, "frequency", units="Hz"),
        "peak": values([1], "peak", modes="in phase"),
        "peak_index": values([0], "peak"),
    }
    march.attributes = CURVE | {"content": "marched peaks", "choice": "sweep up"}
    drawn = forced.ANALYSIS.charts(arrays | {"march": march}, {})
    at = "time integration, sweep up, 297.2 Hz"
    peak = "own, F_C/F_E 194, at peak"
    told = {(c.figure, c.case): c.detail for c in drawn if c.detail and c.figure != "response"}
    assert told == {
        ("contact_map", f"{peak} 1, in phase, right face"): at,
        ("hysteresis", f"{peak} 1, in phase"): at,
    }
    # over frequency a sweep has no states of points
    assert "contact_state" not in {c.figure for c in drawn}


def test_the_page_opens_on_a_curve_on_which_something_slips(arrays: dict[str, Group]) -> None:
    stuck = friction(np.linspace(290.0, 300.0, 4))
    stuck["state"] = values(
        np.tile([1.0, 0.0, 0.0], (4, 4, 1)), "frequency", "contact_point", "state"
    )
    stuck.attributes = CURVE | {"force_ratio": 2000.0}
    found = forced.ANALYSIS.charts({"stuck": stuck} | arrays, {})
    first = {c.title: c for c in reversed(found)}
    assert first["Contact state"].case.startswith("own, F_C/F_E 194")
    # colours stay those of the order in the scene
    traces = {t.label: t for t in first["Frequency response"].traces}
    assert [traces[f"F_C/F_E {r}"].colour for r in (2000, 194)] == [0, 1]
    both = forced.ANALYSIS.headline(
        [
            {"name": name, "case_fields": {"force_ratio": ratio, **more}, "value": value}
            for ratio, slip in ((2000.0, 0.0), (194.0, 3.0))
            for name, value, more in (
                ("peak_1_frequency", 300.0, {}),
                ("contact_slip", slip, {"peak": 1}),
            )
        ]
    )
    assert [one["case_fields"]["force_ratio"] for one in both] == [194.0]


def test_charts_of_the_contact_open_on_the_lowest_ratio_that_slips(
    arrays: dict[str, Group],
) -> None:
    """194 slips; 600, first in the scene, slips too; 100 does not move."""
    more, stuck = (friction(np.linspace(290.0, 300.0, 4)) for _ in range(2))
    stuck["state"] = values(
        np.tile([1.0, 0.0, 0.0], (4, 4, 1)), "frequency", "contact_point", "state"
    )
    more.attributes, stuck.attributes = CURVE | {"force_ratio": 600.0}, CURVE | {"force_ratio": 100}
    found = forced.ANALYSIS.charts({"more": more, "stuck": stuck} | arrays, {})
    first = {c.title: c for c in reversed(found)}
    for title in ("Contact state", "Hysteresis"):
        assert first[title].case.startswith("own, F_C/F_E 194"), title
    cases = [c.case for c in found if c.title == "Contact state"]
    sides = ("left", "right")
    assert cases == [f"own, F_C/F_E {ratio}, {side} face" for ratio in (194, 600) for side in sides]


def test_where_nothing_slides_the_first_curve_stands_for_all(arrays: dict[str, Group]) -> None:
    first = arrays["friction own, F_C per F_E 194"]
    first["state"] = values(
        np.tile([1.0, 0.0, 0.0], (4, 4, 1)), "frequency", "contact_point", "state"
    )
    again = friction(np.linspace(290.0, 300.0, 4))
    again["state"], again.attributes = first["state"], CURVE | {"force_ratio": 600.0}
    charts = made(arrays | {"again": again})
    for title, n in (("Contact state", 2), ("Contact points at the peak", 0), ("Hysteresis", 1)):
        cases = [c.case for c in charts.values() if c.title == title]
        assert len(cases) == n and all(case.startswith("own, F_C/F_E 194") for case in cases), title


def test_performance_shows_the_highest_peak_single_modes_limits_and_the_best() -> None:
    point = ("ratio",)
    heights = {"1_accelerance_right": ("in phase", [9.0, np.nan, 7.0])}
    heights["2_accelerance_right"] = ("out of phase", [np.nan, 5.0, 8.0])
    heights["3_accelerance_right"] = ("in phase 2", [1.0, np.nan, np.nan])
    heights["1_accelerance_left"] = ("in phase", [10.0, 6.0, 6.0])
    scalars = {"free_peak": 300.0, "stuck_peak": 180.0}
    scalars |= {"best_ratio": 20.0, "best_accelerance": 6.0}
    group_ = group(
        {"content": "performance", "stiffness": "own"},
        ratio=values([2.0, 20.0, 200.0], *point),
        highest_accelerance=values([10.0, 6.0, 8.0], *point),
        **{f"peak_{k}": values(v, *point, mode=mode) for k, (mode, v) in heights.items()},
        **{k: values(v) for k, v in scalars.items()},
    )
    (chart,) = forced.ANALYSIS.charts({"a": group_}, {})
    found = {(t.label, t.style): (t.x.tolist(), t.y.tolist()) for t in chart.traces}
    assert found == {
        ("highest of all", "line"): ([2.0, 20.0, 200.0], [10.0, 6.0, 8.0]),
        ("right blade, in phase", "both"): ([2.0, 200.0], [9.0, 7.0]),
        ("right blade, out of phase", "both"): ([20.0, 200.0], [5.0, 8.0]),
        ("free", "dashed"): ([2.0, 200.0], [300.0, 300.0]),
        ("stuck", "dashdot"): ([2.0, 200.0], [180.0, 180.0]),
        ("best, F_C/F_E 20", "star"): ([20.0], [6.0]),
    }
    assert (chart.x.log, chart.y.log, chart.figure) == (True, True, "performance")


# ---------------------------------------------------------------- modal analysis


def test_modal_charts_show_magnitudes_and_peaks() -> None:
    f = np.linspace(1.0, 3.0, 5)
    free = group(
        {"content": "response", "kind": "free"},
        frequency=values(f, "frequency", units="Hz"),
        accelerance_right=accelerance(f),
        accelerance_left=accelerance(np.zeros(5)),
        damping=values(0.005),
        peak_frequency_right=values([2.5], "peak_right", units="Hz"),
        peak_accelerance_right=values([314.0], "peak_right"),
    )
    (response,) = modal.ANALYSIS.charts({"a": free}, {})
    np.testing.assert_allclose(response.traces[0].y, f, rtol=1e-14)
    assert response.y.label == "accelerance, (m/s²)/N"
    # The left blade hears nothing.
    assert (response.case, response.detail) == ("right blade", "damping 0.5 %")
    assert [m.text for m in response.marks] == ["2.50 Hz\n314"]
