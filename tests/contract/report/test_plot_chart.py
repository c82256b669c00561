"""Every part of a chart is drawn by both backends, at its place.

Labels, titles and sheets keep to their room.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text

from tests.pictures import png_size
from upd.plot.chart import (
    STATES,
    Area,
    Axis,
    Band,
    Chart,
    Map,
    Mark,
    Scatter,
    Style,
    Trace,
)
from upd.plot.matplotlib import draw, write_sheets
from upd.plot.plotly import figure
from upd.plot.style import (
    CLOSED,
    COLOURS,
    LIMIT,
    MEASURED,
    OUTLINE,
    SHARE_COLOURS,
    labelled,
    legend_names,
    sides,
    with_room,
)
from upd.plot.work_precision import work_precision_charts
from upd.report.run_page import overlaid

X, Y = Axis("x", "mm"), Axis("y", "N")
T = np.array([0.0, 1.0, 2.0])
CURVE = Trace("a", T, np.array([1.0, 4.0, 2.0]))


def write_sheet(charts: Sequence[Chart], path: Path) -> list[Path]:
    return write_sheets([replace(chart, figure=path.stem) for chart in charts], path.parent)


def drawn(chart: Chart) -> Axes:
    """The chart on axes that have been drawn once."""
    sheet = Figure(figsize=chart.size)
    FigureCanvasAgg(sheet)
    ax = draw(chart, sheet.add_subplot())
    sheet.canvas.draw()
    return ax


def numbers(packed: Any) -> np.ndarray[Any, Any]:
    """The array plotly reads."""
    if isinstance(packed, list):
        return np.array(packed, float)
    flat = np.frombuffer(base64.b64decode(packed["bdata"]), f"<{packed['dtype']}")
    return flat.reshape([int(n) for n in packed["shape"].split(",")]) if "shape" in packed else flat


def named(chart: Chart, name: str) -> dict[str, Any]:
    """plotly's only trace of that name."""
    (found,) = (t for t in figure(chart)["data"] if t["name"] == name)
    return dict(found)


def entries(ax: Axes) -> list[str]:
    """Texts of the legend."""
    legend = ax.get_legend()
    return [] if legend is None else [text.get_text() for text in legend.get_texts()]


# ---------------------------------------------------------------- curves


@pytest.mark.parametrize(
    ("style", "line", "marker", "dash", "symbol"),
    [
        ("line", "-", "None", "solid", None),
        ("dashed", "--", "None", "dash", None),
        ("dotted", ":", "None", "dot", None),
        ("dashdot", "-.", "None", "dashdot", None),
        ("points", "None", "o", None, "circle"),
        ("both", "-", "o", "solid", "circle"),
        ("open points", "None", "o", None, "circle-open"),
        ("crosses", "None", "x", None, "x-thin"),
        ("star", "None", "*", None, "star"),
    ],
)
def test_styles_of_curves(
    style: Style, line: str, marker: str, dash: str | None, symbol: str | None
) -> None:
    chart = Chart("t", X, Y, (replace(CURVE, style=style, colour=1),))
    (made,) = drawn(chart).get_lines()
    assert (made.get_linestyle(), str(made.get_marker())) == (line, marker)
    assert made.get_color() == COLOURS[1] and np.array_equal(
        made.get_xydata(), np.column_stack([T, CURVE.y])
    )
    assert (made.get_markerfacecolor() == "white") == (style == "open points")
    trace = named(chart, "a")
    assert (
        numbers(trace["x"]).tolist() == T.tolist()
        and numbers(trace["y"]).tolist() == CURVE.y.tolist()
    )
    assert ("lines" in trace["mode"]) == (dash is not None) and ("markers" in trace["mode"]) == (
        symbol is not None
    )
    assert dash is None or trace["line"]["dash"] == dash
    assert symbol is None or trace["marker"].get("symbol", "circle") == symbol


def test_outlines_are_black_and_closed_forms_grey() -> None:
    chart = Chart("t", X, Y, (replace(CURVE, outline=True), replace(CURVE, label="b", closed=True)))
    assert [line.get_color() for line in drawn(chart).get_lines()] == [OUTLINE, CLOSED]
    assert [named(chart, name)["line"]["color"] for name in "ab"] == [OUTLINE, CLOSED]
    assert named(chart, "a")["hoverinfo"] == "skip"


# ---------------------------------------------------------------- marks


def test_words_stand_beside_marks_that_have_room() -> None:
    def told(*marks: Mark, log: bool = False) -> list[bool]:
        axes = Axis("f", low=100.0, high=200.0), Axis("y", low=1.0, high=1e4, log=log)
        return labelled(Chart("t", *axes, marks=marks)).tolist()

    # The higher of two neighbours has them; one far along either axis has its own.
    near = (Mark(150.0, 9000.0, "a"), Mark(155.0, 9100.0, "b"))
    assert told(*near) == [False, True]
    assert told(*near, Mark(180.0, 9000.0, "c"), Mark(150.0, 5000.0, "d")) == [
        False,
        True,
        True,
        True,
    ]
    # On a logarithmic axis 5000 is as near as 8000 on a linear one.
    assert told(*near, Mark(150.0, 5000.0, "d"), log=True) == [False, True, False]
    # Not without words, nor outside the axes.
    assert told(Mark(150.0, 5.0, ""), Mark(99.0, 5.0, "a"), Mark(150.0, -1.0, "b")) == [False] * 3


def test_words_at_the_ends_of_x_stand_inwards() -> None:
    marks = tuple(Mark(x, 1.0, "a") for x in (100.0, 150.0, 199.0))
    chart = Chart("t", Axis("f", low=100.0, high=200.0), Y, marks=marks)
    assert sides(chart) == ["right", "center", "left"]


@pytest.mark.parametrize("log", [False, True])
def test_the_highest_words_have_room(log: bool) -> None:
    chart = Chart("t", X, replace(Y, log=log), (CURVE,), marks=(Mark(1.0, 4.0, "a"),))
    end = with_room(chart).y.high
    assert end is not None and 4.0 < end < (8.0 if log else 5.0)
    # An end that is asked for stays, and nothing is done without words.
    for same in (replace(chart, y=replace(Y, high=4.5)), replace(chart, marks=())):
        assert with_room(same) is same


def _crowd() -> Chart:
    """A response with a crowd of close peaks, at both ends of the abscissa too."""
    f = np.linspace(280.0, 500.0, 400)
    peaks = ((281.0, 300.0), (335.0, 180.0), (337.7, 185.0), (340.0, 170.0), (499.0, 150.0))
    traces = tuple(
        Trace(f"F_C/F_E {k}", f, 1.0 + height / (1.0 + (f - at) ** 2), colour=k)
        for k, (at, height) in enumerate(peaks)
    )
    marks = tuple(
        Mark(at, height, f"{at:.1f} Hz\n{height:.0f}", k) for k, (at, height) in enumerate(peaks)
    )
    bands = (Band("measured", "x", 338.0, 342.0), Band("limit", "y", 200.0, 200.0, dashed=True))
    return Chart(
        "Frequency response",
        replace(X, low=280.0, high=500.0),
        replace(Y, log=True),
        traces,
        marks=marks,
        bands=bands,
        figure="response",
    )


def written_figure(charts: list[Chart], folder: Path) -> Figure:
    """The figure of a sheet as it is written."""
    kept: list[Figure] = []
    save = Figure.savefig
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", lambda s, *a, **k: kept.append(s) or save(s, *a, **k))
        write_sheet(charts, folder / "a.png")
    (made,) = kept
    return made


@pytest.mark.parametrize("log", [False, True])
def test_labels_and_legends_of_a_sheet_cover_nothing(log: bool, tmp_path: Path) -> None:
    crowd = replace(_crowd(), y=replace(Y, log=log))
    names = [f"F_C/F_E 2000, static reversed, sweep {k}" for k in range(30)]
    many = tuple(replace(crowd.traces[0], label=name) for name in names)
    charts = [crowd, replace(crowd, traces=many), _map(), crowd]
    sheet = written_figure(charts, tmp_path)
    sheet.draw_without_rendering()
    axes = [ax for ax in sheet.axes if ax.get_title()]
    assert len(axes) == len(charts)
    for chart, ax in zip(charts, axes, strict=True):
        labels = [t for t in ax.texts if t.get_text() in {m.text for m in chart.marks}]
        assert len(labels) == int(labelled(chart).sum())
        boxes = [Text.get_window_extent(label) for label in labels]
        frame = ax.get_window_extent()
        assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k]), "labels"
        assert all(frame.x0 - 1 <= b.x0 and b.x1 <= frame.x1 + 1 for b in boxes), "beside"
        assert all(b.y1 <= frame.y1 for b in boxes), "above"
        if (legend := ax.get_legend()) is not None:
            told = legend.get_window_extent()
            around = [ax.xaxis.label.get_window_extent(), ax.title.get_window_extent(), frame]
            around += [t.get_window_extent() for t in ax.get_xticklabels()]
            around += [other.title.get_window_extent() for other in axes]
            around += [a.get_tightbbox() for a in sheet.axes if a.get_label() == "<colorbar>"]
            assert not any(told.overlaps(box) for box in around), "the legend covers something"
            assert sheet.bbox.x0 <= told.x0 and told.x1 <= sheet.bbox.x1, "the legend is cut"
            assert sheet.bbox.y0 <= told.y0
            place = sheet.bbox.width * sheet.bbox.height / len(charts)
            assert told.width * told.height <= 0.25 * place, "the legend takes the drawing"


def test_a_long_legend_says_how_many_entries_are_left_out() -> None:
    names = [f"F_C/F_E 2000, static reversed, sweep {k}" for k in range(60)]
    chart = Chart("t", X, Y, tuple(replace(CURVE, label=name) for name in names))
    told = entries(drawn(chart))
    assert told[:-1] == names[: len(told) - 1]
    assert told[-1] == f"and {61 - len(told)} more"


def test_marks_are_points_with_words() -> None:
    marks = (
        Mark(1.0, 4.0, "1.0 Hz", 1),
        Mark(1.01, 3.8, "1.0 Hz", 1),
        Mark(0.0, 1.0, "0 < 1", closed=True),
    )
    chart = Chart("t", X, Y, (CURVE,), marks=marks)
    ax = drawn(chart)
    assert [tuple(line.get_xydata()[0]) for line in ax.get_lines()[1:]] == [
        (m.x, m.y) for m in marks
    ]
    assert [(text.get_text(), text.get_color()) for text in ax.texts] == [
        ("1.0 Hz", COLOURS[1]),
        ("0 < 1", CLOSED),
    ]
    box = ax.get_window_extent()
    for text in ax.texts:
        extent = text.get_window_extent()
        assert box.x0 <= extent.x0 and extent.x1 <= box.x1 and extent.y1 <= box.y1, (
            "a label reaches out of the drawing"
        )
    made = figure(chart)
    first, second = (t for t in made["data"] if t["mode"] == "markers+text")
    assert (first["customdata"], first["marker"]["color"]) == (["1.0 Hz", "1.0 Hz"], COLOURS[1])
    assert numbers(first["x"]) == pytest.approx([1.0, 1.01]) and numbers(
        first["y"]
    ) == pytest.approx([4.0, 3.8])
    assert first["text"] == ["1.0 Hz", ""] and first["textposition"] == ["top center"] * 2
    assert second["customdata"] == second["text"] == ["0 &lt; 1"]
    assert second["textposition"] == ["top right"]


# ---------------------------------------------------------------- bands and areas


@pytest.mark.parametrize("axis", ["x", "y"])
def test_bands(axis: Any) -> None:
    bands = (
        Band("line", axis, 3.0, 3.0),
        Band("span", axis, 5.0, 6.0, colour=2),
        Band("limit", axis, 8.0, 8.0, dashed=True),
    )
    chart = Chart("t", X, Y, (CURVE,), bands=bands)
    ax = drawn(chart)
    at = 0 if axis == "x" else 1
    wide, limit = (line for line in ax.get_lines() if line.get_label() in ("line", "limit"))
    assert (np.array(wide.get_data())[at].tolist(), wide.get_color(), limit.get_linestyle()) == (
        [3.0, 3.0],
        MEASURED,
        "--",
    )
    (span,) = ax.patches
    extent = span.get_path().get_extents(span.get_patch_transform())
    assert (
        (extent.x0, extent.x1)[::1] == (5.0, 6.0)
        if axis == "x"
        else (extent.y0, extent.y1) == (5.0, 6.0)
    )
    assert entries(ax) == ["a", "line", "span", "limit"]
    shapes = figure(chart)["layout"]["shapes"]
    assert [(s["type"], s[f"{axis}0"], s[f"{axis}1"]) for s in shapes] == [
        ("line", 3.0, 3.0),
        ("rect", 5.0, 6.0),
        ("line", 8.0, 8.0),
    ]
    assert all(s[f"{'y' if axis == 'x' else 'x'}ref"] == "paper" for s in shapes)
    assert shapes[1]["fillcolor"] == COLOURS[2] and shapes[2]["line"]["color"] == LIMIT
    entry = named(chart, "limit")
    assert entry["showlegend"] and entry[axis] == [8.0, 8.0], "the axis must reach to the band"


def test_areas_lie_between_their_curves() -> None:
    low, high = np.array([0.0, 1.0, 0.0]), np.array([2.0, 5.0, 4.0])
    chart = Chart("t", X, Y, areas=(Area("answers", T, low, high, 1),))
    ax = drawn(chart)
    (area,) = ax.collections
    corners = area.get_paths()[0].vertices
    assert {tuple(c) for c in corners} >= {*zip(T, low, strict=True), *zip(T, high, strict=True)}
    assert to_hex(area.get_facecolor()[0]) == COLOURS[1] and entries(ax) == ["answers"]
    lower, upper = figure(chart)["data"]
    assert upper["fill"] == "tonexty" and not lower["showlegend"]
    assert (
        numbers(lower["y"]).tolist() == low.tolist()
        and numbers(upper["y"]).tolist() == high.tolist()
    )
    assert numbers(upper["customdata"]).tolist() == (high - low).tolist()


def test_states_have_their_colours() -> None:
    bottom = np.zeros(3)
    for state, last in zip(("stick", "slip", "lift-off"), (30.0, 60.0, 100.0), strict=True):
        chart = Chart("t", X, Y, areas=(Area(state, T, bottom, bottom + last, state=state),))
        area = drawn(chart).collections[0]
        assert to_hex(area.get_facecolor()[0]) == SHARE_COLOURS[state] and area.get_alpha() == 1.0
        assert named(chart, state)["fillcolor"] == SHARE_COLOURS[state]


# ---------------------------------------------------------------- coloured points


def test_scattered_points_have_colours_and_areas() -> None:
    points = Scatter(
        T, T**2, np.array([5.0, 7.0, 9.0]), np.array([0.0, 0.5, 1.0]), Axis("preload", "N")
    )
    chart = Chart("t", X, Y, scatters=(points,))
    ax = drawn(chart)
    (made,) = ax.collections
    assert made.get_offsets().tolist() == [[0.0, 0.0], [1.0, 1.0], [2.0, 4.0]]
    assert made.get_array().tolist() == [5.0, 7.0, 9.0] and made.get_clim() == (5.0, 9.0)
    assert (np.diff(made.get_sizes()) > 0.0).all()
    assert [other.get_ylabel() for other in ax.figure.axes] == ["y, N", "preload, N"]
    (trace,) = figure(chart)["data"]
    assert (
        numbers(trace["marker"]["color"]).tolist() == [5.0, 7.0, 9.0]
        and trace["marker"]["colorbar"]["title"]["text"] == "preload, N"
    )
    assert (np.diff(numbers(trace["marker"]["size"])) > 0.0).all() and (
        trace["marker"]["cmin"],
        trace["marker"]["cmax"],
    ) == (5.0, 9.0)


# ---------------------------------------------------------------- maps


def _map(**more: Any) -> Chart:
    z = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 12.0]])
    return Chart(
        "t", X, Y, maps=(Map(T, np.array([0.0, 1.0]), z, Axis("pressure", "MPa"), **more),)
    )


def _mesh(ax: Axes) -> QuadMesh:
    (found,) = (c for c in ax.collections if isinstance(c, QuadMesh))
    return found


@pytest.mark.parametrize(
    ("more", "ends"),
    [
        ({}, (0.0, 12.0)),
        ({"low": None}, (1.0, 12.0)),
        ({"top": 10.0}, (0.0, 10.0)),
        ({"low": 2.0, "top": 10.0}, (2.0, 10.0)),
    ],
)
def test_ends_of_a_colour_scale(more: dict[str, Any], ends: tuple[float, float]) -> None:
    mesh = _mesh(drawn(_map(**more)))
    assert mesh.get_clim() == ends and np.asarray(mesh.get_array()).ravel().tolist() == [
        1.0,
        3.0,
        5.0,
        2.0,
        4.0,
        12.0,
    ]
    (trace,) = figure(_map(**more))["data"]
    assert (trace["zmin"], trace["zmax"], trace["showscale"]) == (*ends, True)
    assert numbers(trace["z"]).tolist() == [[1.0, 3.0, 5.0], [2.0, 4.0, 12.0]]


def test_maps_of_one_chart_share_a_scale() -> None:
    chart = _map()
    both = replace(
        chart,
        maps=(replace(chart.maps[0], z=chart.maps[0].z / 4.0), replace(chart.maps[0], x=T + 5.0)),
    )
    assert {c.get_clim() for c in drawn(both).collections if isinstance(c, QuadMesh)} == {
        (0.0, 12.0)
    }
    assert [(t["zmax"], t["showscale"]) for t in figure(both)["data"]] == [
        (12.0, True),
        (12.0, False),
    ]


def test_maps_of_states() -> None:
    chart = Chart(
        "t",
        X,
        Y,
        maps=(
            Map(T, T[:2], np.array([[0.0, 1.0], [2.0, np.nan], [2.0, 2.0]]), Axis("state"), STATES),
        ),
    )
    ax = drawn(chart)
    assert [to_hex(c) for c in _mesh(ax).get_cmap().colors] == [SHARE_COLOURS[s] for s in STATES]
    (legend,) = (artist for artist in ax.get_children() if isinstance(artist, Legend))
    assert [t.get_text() for t in legend.get_texts()] == list(STATES)
    colours = [to_hex(patch.get_facecolor()) for patch in legend.get_patches()]
    assert colours == [SHARE_COLOURS[s] for s in STATES]
    (trace,) = figure(chart)["data"]
    assert trace["text"] == [["open", "stick", "stick"], ["slip", "", "stick"]] and trace[
        "colorbar"
    ]["ticktext"] == list(STATES)


# ---------------------------------------------------------------- axes and legends


def test_ends_and_words_of_axes() -> None:
    chart = Chart(
        "t",
        Axis("x", low=0.5, ticks=((0.0, "no"), (1.0, "yes"), (2.0, "no"))),
        Axis("y", low=-1.0, high=9.0),
        (CURVE,),
    )
    ax = drawn(chart)
    assert ax.get_xlim()[0] == 0.5 and ax.get_xlim()[1] >= 2.0 and ax.get_ylim() == (-1.0, 9.0)
    assert [t.get_text() for t in ax.get_xticklabels()] == [
        "no",
        "yes",
        "no",
    ] and ax.get_xticks().tolist() == [0.0, 1.0, 2.0]
    layout = figure(chart)["layout"]
    assert (layout["xaxis"]["range"], layout["yaxis"]["range"]) == (
        [0.5, pytest.approx(2.075)],
        [-1.0, 9.0],
    )
    assert (layout["xaxis"]["tickvals"], layout["xaxis"]["ticktext"]) == (
        [0.0, 1.0, 2.0],
        ["no", "yes", "no"],
    )


def test_logarithmic_axes() -> None:
    chart = Chart(
        "t",
        Axis("x", log=True, low=1.0, high=100.0),
        Axis("y", log=True),
        (Trace("a", T, np.array([0.0, -1.0, 0.0])),),
    )
    ax = drawn(chart)
    assert ax.get_xscale() == "log" and ax.get_xlim() == (1.0, 100.0)
    assert ax.get_yscale() == "linear", "nothing positive to draw"
    layout = figure(chart)["layout"]
    assert (
        layout["xaxis"]["type"] == "log"
        and layout["xaxis"]["range"] == [0.0, 2.0]
        and "type" not in layout["yaxis"]
    )


def test_legends_tell_every_part_once() -> None:
    twice = (CURVE, replace(CURVE, label="b", entry="a"), replace(CURVE, label="c"))
    chart = Chart(
        "t", X, Y, twice, bands=(Band("limit", "y", 1.0, 1.0),), areas=(Area("all", T, T, T + 1.0),)
    )
    assert legend_names(chart) == ["a", "c", "all", "limit"] == entries(drawn(chart))
    assert sorted(t["name"] for t in figure(chart)["data"] if t["showlegend"]) == [
        "a",
        "all",
        "c",
        "limit",
    ]


def test_a_single_curve_that_the_title_names_has_no_legend() -> None:
    assert legend_names(Chart("t", X, Y, (replace(CURVE, label="F=50 N"),), case="F=50 N")) == []
    assert legend_names(Chart("t", X, Y, (replace(CURVE, label="computed"),), case="F=50 N")) == [
        "computed"
    ]


def test_text_is_text() -> None:
    """No mathematics in matplotlib, no markup and no templates in plotly."""
    evil = "<b>$x$ %{y} 5 %"
    every = Chart(
        evil,
        Axis(evil, evil),
        Axis(evil, evil, ticks=((0.0, evil),)),
        (replace(CURVE, label=evil),),
        case=evil,
        marks=(Mark(1.0, 1.0, evil),),
        bands=(Band(evil, "x", 1.0, 1.0),),
        areas=(Area(evil, T, T, T),),
        scatters=(Scatter(T, T, T, T, Axis(evil, evil)),),
    )
    drawn(every)
    made = figure(every)
    assert "<b>" not in json.dumps(made, allow_nan=False)
    assert not any("%{y} 5" in t["hovertemplate"] for t in made["data"] if t.get("hovertemplate"))


# ---------------------------------------------------------------- every chart, and plotly's own
# opinion


@pytest.fixture
def every() -> list[Chart]:
    """A chart with each part."""
    marks, bands = (
        (Mark(1.0, 4.0, "1 Hz"),),
        (Band("limit", "y", 2.0, 2.0, dashed=True), Band("range", "x", 0.5, 1.0)),
    )
    areas = (Area("stick", T, 0.0 * T, T, state="stick"), Area("free", T, T, T + 1.0))
    points = Scatter(T, T, T, T / 2.0, Axis("preload", "N"))
    return [
        Chart(
            "Curves",
            X,
            Y,
            (CURVE, replace(CURVE, label="b", style="open points")),
            marks=marks,
            bands=bands,
            areas=areas,
        ),
        Chart("Points", X, Y, scatters=(points,), equal=True),
        _map(),
    ]


def test_plotly_knows_every_key(every: list[Chart]) -> None:
    graph_objects = pytest.importorskip("plotly.graph_objects")
    for chart in every:
        made = figure(chart)
        graph_objects.Figure(made["data"], made["layout"])


# ---------------------------------------------------------------- sheets


LONG = (
    "A rather long title of a chart that tells what was measured, where, and how it was computed, "
)


@pytest.mark.parametrize(
    ("title", "case"),
    [("Short", "thesis"), (LONG, ""), (LONG, LONG), ("Short", 2 * LONG), (6 * LONG, 6 * LONG)],
)
@pytest.mark.parametrize("columns", [2, 4])
def test_titles_do_not_run_into_the_neighbour(
    title: str, case: str, columns: int, tmp_path: Path
) -> None:
    charts = [
        Chart(
            title,
            X,
            Y,
            (CURVE,),
            case=case,
            columns=columns,
            size=(3.6, 3.6) if columns == 4 else (5.6, 4.4),
        )
    ] * (2 * columns)
    made = written_figure([*charts[1:], replace(charts[0], maps=_map().maps, traces=())], tmp_path)
    axes = [ax for ax in made.axes if ax.get_title()]
    boxes = [ax.title.get_window_extent() for ax in axes]
    whole = made.bbox
    assert len(boxes) == 2 * columns
    assert all(whole.x0 <= b.x0 and b.x1 <= whole.x1 and b.y1 <= whole.y1 for b in boxes), (
        "a title is cut"
    )
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k]), "titles overlap"
    below = [ax.xaxis.label.get_window_extent() for ax in axes[:columns]]
    assert not any(a.overlaps(b) for a in boxes[columns:] for b in below), (
        "a title covers the axis above it"
    )
    assert all(ax.get_title().count("\n") <= 1 for ax in axes)


def test_sheets_hold_what_stands_on_them(tmp_path: Path) -> None:
    chart = Chart("t", X, Y, (CURVE,), figure="one", columns=3, size=(3.0, 2.0))
    charts = [
        chart,
        replace(chart, sheet=False),
        *[chart] * 3,
        replace(chart, figure="two"),
        replace(chart, figure=""),
        replace(chart, figure="none", sheet=False),
    ]
    made = write_sheets(charts, tmp_path)
    assert (
        [p.name for p in made]
        == ["one.png", "two.png"]
        == sorted(p.name for p in tmp_path.iterdir())
    )
    # Four panels in rows of three; one alone.
    assert [png_size(p.read_bytes()) for p in made] == [(3 * 390, 2 * 260), (390, 260)]
    made[0].write_text("mine")
    assert write_sheets(charts, tmp_path, keep=True) == [] and made[0].read_text() == "mine"
    assert write_sheets(charts[:1], tmp_path) == made[:1] and made[0].read_bytes().startswith(
        b"\x89PNG"
    )


def test_wide_maps_leave_no_empty_place(tmp_path: Path) -> None:
    wide = Chart(
        "t",
        X,
        Y,
        maps=(Map(np.arange(40.0), np.arange(8.0), np.ones((40, 8)), Axis("p"), top=2.0),),
        equal=True,
    )
    (path,) = write_sheet([wide] * 2, tmp_path / "wide.png")
    (mixed,) = write_sheet([wide, replace(wide, maps=(), traces=(CURVE,))], tmp_path / "mixed.png")
    assert png_size(path.read_bytes())[1] < 400 < png_size(mixed.read_bytes())[1] == 572


def test_a_sheet_has_at_most_24_panels(tmp_path: Path) -> None:
    (path,) = write_sheet(
        [Chart("t", X, Y, (CURVE,), columns=6, size=(2.5, 2.2))] * 30, tmp_path / "many.png"
    )
    assert png_size(path.read_bytes()) == (6 * 325, 4 * 286)


def test_a_sheet_that_fails_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.png"
    path.write_text("old")

    def full(*_: object, **__: object) -> None:
        raise OSError("no space left")

    monkeypatch.setattr(Figure, "savefig", full)
    with pytest.raises(OSError, match="no space"):
        write_sheet([Chart("t", X, Y, (CURVE,))], path)
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


# ---------------------------------------------------------------- comparisons and studies


def test_a_comparison_overlays_every_part(every: list[Chart]) -> None:
    one = [replace(c, title=f"{c.title} {k}") for k, c in enumerate(every)]
    curves = replace(one[0], areas=one[0].areas[1:])
    other = replace(curves, bands=(*curves.bands, Band("more", "y", 9.0, 9.0)))
    (both,) = overlaid([[curves], [other]], ["left", "right"])
    assert [m.colour for m in both.marks] == [0, 1] and [a.label for a in both.areas] == [
        "left: free",
        "right: free",
    ]
    assert [b.label for b in both.bands] == ["limit", "range", "more"], (
        "a limit that both have is drawn once"
    )
    for chart in one:
        pair = overlaid([[chart], [chart]], ["left", "right"])
        assert [c.title for c in pair] == [f"{chart.title}: left", f"{chart.title}: right"], (
            "what fills its place stands beside the other"
        )


def test_a_comparison_shares_the_scales_of_coloured_points() -> None:
    chart = Chart("t", X, Y, scatters=(Scatter(T, T, T, T, Axis("preload", "N")),))
    wide = replace(chart, scatters=(replace(chart.scatters[0], value=10.0 * T),))
    assert {
        (s.axis.low, s.axis.high)
        for c in overlaid([[chart], [wide]], ["a", "b"])
        for s in c.scatters
    } == {(0.0, 20.0)}


def test_work_precision_is_one_description() -> None:
    shared = {
        "case": "F=50 N",
        "against": "reference",
        "thesis_error": -0.07,
        "seconds": (1.0, 2.0),
        "memory_mb": (100.0, 300.0),
    }
    curves = [
        {"curve": "hex8", "name": "max_pressure", "error": (-0.1, 0.01), "order": 2.04, **shared},
        {
            "curve": "hex20",
            "name": "max_pressure",
            "error": (0.2, 0.02),
            "order": float("nan"),
            **shared,
        },
        {"curve": "hex8", "name": "F_N", "error": (0.0, 0.0), "order": 0.0, **shared},
    ]
    seconds, memory = work_precision_charts(curves)
    assert [t.label for t in seconds.traces] == ["hex8 (order 2.0)", "hex20"]
    np.testing.assert_allclose(seconds.traces[0].y, [10.0, 1.0])
    assert memory.traces[1].x.tolist() == [100.0, 300.0] and memory.x.label == "peak memory, MB"
    assert seconds.x.log and seconds.y.log and seconds.y.label == "|error|, %"
    assert (seconds.bands[0].label, seconds.bands[0].dashed) == (
        "thesis (7.0 %)",
        True,
    ) and seconds.bands[0].low == pytest.approx(7.0)
    assert seconds.case == "maximum pressure, F=50 N" and seconds.figure == "work_precision"


def test_levels_are_drawn_from_the_cheapest_on() -> None:
    curve = {
        "curve": "c",
        "name": "max_pressure",
        "case": "F=1 N",
        "against": "r",
        "order": None,
        "labels": ("8", "12", "16"),
        "error": (0.1, 0.02, 0.01),
        "seconds": (1.0, 3.0, 2.0),
        "memory_mb": (1.0, 2.0, 3.0),
    }
    seconds, memory = work_precision_charts([curve])
    assert seconds.traces[0].x.tolist() == [1.0, 2.0, 3.0]
    np.testing.assert_allclose(seconds.traces[0].y, [10.0, 1.0, 2.0])
    assert [mark.text for mark in seconds.marks] == ["8", "16", "12"]
    assert memory.traces[0].x.tolist() == [1.0, 2.0, 3.0]


def test_a_study_shows_its_first_numbers_over_seconds() -> None:
    curves = [
        {
            "curve": "c",
            "name": f"n{k}",
            "case": f"F={F} N",
            "against": "r",
            "error": (0.1,),
            "seconds": (1.0,),
            "memory_mb": (1.0,),
            "order": None,
        }
        for k in range(6)
        for F in (1, 2, 3)
    ]
    charts = work_precision_charts(curves)
    assert len(charts) == 36
    assert [(c.x.name, c.case) for c in charts if c.sheet] == [
        ("seconds", f"n{k}, F=3 N") for k in range(3)
    ]
    assert {c.columns for c in charts} == {3}
