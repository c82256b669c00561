"""report.html of a sweep.

One file, nothing fetched, all told and escaped, made again from the folder, never the end of a
sweep.
"""

from __future__ import annotations

import base64
import errno
import gzip
import json
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upd.batch.plan import parse_axes, places
from upd.batch.sweeps import draw, sweep
from upd.batch.table import csv_text, make_columns
from upd.cli import main
from upd.errors import InputError
from upd.plot.sweep_charts import sweep_charts
from upd.report import sweep_page, write_report
from upd.report.run_page import write_comparison
from upd.report.sweep_page import MOST_ROWS, grouped, read_sweep, sweep_sections, verdict
from upd.results import Case, Result
from upd.vary.outcome import Outcome

EVIL = '</script><script>alert("x")</script>'
TINY = {"title": EVIL, "geometry.divisions": 8, "want": ["normal"], "geometry.core_depth": 0.2}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three loads; the last one reaches the rim of the patch and fails."""
    path = tmp_path_factory.mktemp("sweeps") / "loads"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("UPD_CACHE", str(tmp_path_factory.mktemp("cache")))
        found = sweep(
            "hertz",
            ["loads.normal=40 N,60 N,5000 N"],
            overrides=TINY,
            out=path,
            workers=0,
            follow=["max_pressure", "radius_*"],
        )
    assert path / "report.html" in found.files
    return path


@pytest.fixture(scope="module")
def html(folder: Path) -> str:
    return (folder / "report.html").read_text("utf-8")


class _Page(HTMLParser):
    """Addresses a browser would fetch, number of elements, text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.elements: dict[str, int] = {}
        self.text = ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements[tag] = self.elements.get(tag, 0) + 1
        self.addresses += [
            value or ""
            for key, value in attrs
            if key in ("src", "href", "srcset", "data", "action", "poster")
        ]

    def handle_data(self, data: str) -> None:
        self.text += data


def _made(path: Path, axes: dict[str, list[Any]], reasons: dict[int, str] | None = None) -> Path:
    """A sweep folder with one followed number: the point's number."""
    n = int(np.prod([len(values) for values in axes.values()]))
    points = [
        {
            "values": [None if k in (reasons or {}) else float(k)],
            "status": "ok",
            "reason": "",
            "warnings": [],
            "seconds": 0.5,
        }
        for k in range(n)
    ]
    for k, reason in (reasons or {}).items():
        points[k] |= {"status": "failed", "reason": reason}
    data = {
        "scene": "made",
        "title": "Made",
        "version": "1.2.3",
        "axes": [
            {"path": name, "unit": "N" if "N" in str(values[0]) else "", "values": values}
            for name, values in axes.items()
        ],
        "followed": [{"name": "approach", "case": "", "unit": "um"}],
        "plan": {"points": n, "kept": 0, "workers": 2, "threads": 1, "notes": []},
        "cost": {
            "this_call_s": 1.0,
            "points_s": 0.5 * n,
            "stages_s": {"mesh": 0.25 * n},
            "peak_rss_mb": 100.0,
        },
        "points": points,
        "text": 'name = "made"\n',
    }
    path.mkdir(exist_ok=True)
    (path / "sweep.json").write_text(json.dumps(data), "utf-8")
    return path


def test_page_fetches_nothing_and_escapes_everything(html: str) -> None:
    assert len(html.encode()) < 2_000_000, "a page without a view in three dimensions"
    page = _Page(html)
    assert page.addresses and all(address.startswith("data:") for address in page.addresses)
    # Data, plotly, the page's own: nothing of the scene runs.
    assert page.elements["script"] == 3
    assert "<script>alert" not in html
    assert EVIL in page.text
    assert page.elements["img"] >= 1, "a figure that needs no script"


def test_page_tells_grid_verdict_reason_table_cost_versions_scene(folder: Path, html: str) -> None:
    text, data = _Page(html).text, json.loads((folder / "sweep.json").read_text("utf-8"))
    assert "40, 60, 5000 N" in text
    assert "2 of 3 points done, 1 failed" in text
    assert data["points"][2]["reason"] in text
    assert f"{data['points'][0]['values'][0]:.5g}" in text
    assert "table.csv" in text
    assert "s per point" in text
    assert data["text"] in text
    for package, version in data["versions"].items():
        assert f"{package} {version}" in text
    assert _Page(html[html.index("<h2>Table") : html.index("<h2>Cost")]).elements["tr"] == 4


def test_hover_curves_are_the_numbers_of_the_table(folder: Path, html: str) -> None:
    found = re.search(r'id="page-data">([^<]*)</script>', html)
    assert found
    # seven bits a letter
    letters = np.array([ord(letter) & 127 for letter in found[1]], np.uint8)
    bits = np.unpackbits(letters[:, None], axis=1)[:, 1:].ravel()
    page = json.loads(gzip.decompress(np.packbits(bits[: bits.size // 8 * 8]).tobytes()))
    (trace,) = page["panels"]["sweep"][0]["charts"][0]["figure"]["data"]
    x, y = (np.frombuffer(base64.b64decode(trace[key]["bdata"]), "<f4") for key in "xy")
    table = read_sweep(folder).columns[0].values
    assert np.isnan(table[2])
    # Single precision on the page; the last point failed, so the axis ends before it.
    np.testing.assert_array_equal(x, [40.0, 60.0])
    np.testing.assert_allclose(y, table[:2], rtol=2.0**-23)


def test_failed_points_are_gaps_and_end_no_axis(tmp_path: Path) -> None:
    made = read_sweep(
        _made(
            tmp_path / "gaps",
            {"F": ["1 N", "2 N", "3 N", "4 N", "5 N"]},
            {0: "no", 2: "no", 4: "no"},
        )
    )
    (chart,) = sweep_charts(made.axes, made.columns)
    np.testing.assert_array_equal(chart.traces[0].x, [2.0, 3.0, 4.0])
    np.testing.assert_array_equal(chart.traces[0].y, [1.0, np.nan, 3.0])


def test_report_command_makes_it_again(
    folder: Path, html: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "report.html").unlink()
    with pytest.raises(SystemExit) as ended:
        main(["report", str(folder)])
    assert not ended.value.code
    assert "report.html" in capsys.readouterr().out
    assert (folder / "report.html").read_text("utf-8") == html


def test_long_table_is_cut_and_says_so(tmp_path: Path) -> None:
    text = write_report(_made(tmp_path / "long", {"a.b": list(range(MOST_ROWS + 7))})).read_text(
        "utf-8"
    )
    page = _Page(text[text.index("<h2>Table") : text.index("<h2>Cost")])
    assert page.elements["tr"] == MOST_ROWS + 1
    assert f"The first {MOST_ROWS} of {MOST_ROWS + 7} points" in page.text
    assert "tall" in text[text.index("<h2>Table") : text.index("<h2>Cost")]


def test_two_parameters_give_one_curve_per_value_of_the_shorter(tmp_path: Path) -> None:
    made = read_sweep(
        _made(
            tmp_path / "two",
            {"contact.friction": [0.3, 0.1, 0.2], "mesh.element": ["hex8", "hex20"]},
        )
    )
    (chart,) = sweep_charts(made.axes, made.columns)
    assert [t.label for t in chart.traces] == ["element hex8", "element hex20"]
    np.testing.assert_array_equal(chart.traces[0].x, [0.1, 0.2, 0.3])
    # Points 0..5, the element fastest.
    np.testing.assert_array_equal(chart.traces[1].y, [3.0, 5.0, 1.0])
    assert chart.y.label == "approach, raw, µm"


def test_two_parameters_with_numbers_give_a_map_and_curves(tmp_path: Path) -> None:
    made = read_sweep(
        _made(
            tmp_path / "map",
            {"contact.friction": [0.3, 0.1, 0.2], "loads.normal": ["4 N", "2 N"]},
            {5: "no"},
        )
    )
    over, curves = sweep_charts(made.axes, made.columns)
    (m,) = over.maps
    assert over.sheet and m.x.tolist() == [0.1, 0.2, 0.3] and m.y.tolist() == [2.0, 4.0]
    # Points 0..5, the load fastest; the friction 0.2 with 2 N failed.
    np.testing.assert_array_equal(m.z, [[3.0, 2.0], [np.nan, 4.0], [1.0, 0.0]])
    assert not curves.sheet, "the sheet has the map, the page both"
    assert [t.label for t in curves.traces] == ["normal 4 N", "normal 2 N"]
    np.testing.assert_array_equal(curves.traces[0].y, [2.0, 4.0, 0.0])


def test_words_are_ticks(tmp_path: Path) -> None:
    folder = _made(tmp_path / "words", {"e": ["a", "b"]})
    made = read_sweep(folder)
    (chart,) = sweep_charts(made.axes, made.columns)
    assert chart.x.ticks == ((0, "a"), (1, "b")) and chart.traces[0].style == "points"
    assert "page-data" in write_report(folder).read_text("utf-8")


def test_more_parameters_give_a_curve_per_combination_of_the_others(tmp_path: Path) -> None:
    folder = _made(tmp_path / "many", {"a": [1, 2, 3], "b": [1, 2], "e": ["x", "y"]})
    made = read_sweep(folder)
    (chart,) = sweep_charts(made.axes, made.columns)
    assert chart.figure == "sweep" and not chart.maps
    assert [t.label for t in chart.traces] == ["b 1, e x", "b 1, e y", "b 2, e x", "b 2, e y"]
    np.testing.assert_array_equal(chart.traces[1].y, [1.0, 5.0, 9.0])
    np.testing.assert_array_equal(chart.traces[2].y, [2.0, 6.0, 10.0])
    (page_chart,) = (c for one in sweep_sections(read_sweep(folder)) for c in one.charts)
    assert page_chart.heading == "Followed numbers over a and b and e"


def test_one_value_everywhere_is_told(tmp_path: Path) -> None:
    made = read_sweep(_made(tmp_path / "same", {"a": [1, 2], "b": [1, 2]}))
    over = sweep_charts(made.axes, [replace(made.columns[0], values=np.full(4, 3.5))])[0]
    assert over.case == "3.5 µm everywhere"
    varying = replace(made.columns[0], values=np.arange(4.0))
    flat = replace(varying, values=np.full(4, 3.5))
    first, last = sweep_charts(made.axes, [flat, varying])[:2]
    assert "everywhere" not in first.case and "everywhere" in last.case


def test_a_grid_of_one_point_still_has_a_page(tmp_path: Path) -> None:
    made = _made(tmp_path / "s", {"a": [1]})
    assert "left no figures" in write_report(made).read_text("utf-8")


def test_all_failed(tmp_path: Path) -> None:
    made = _made(tmp_path / "s", {"F": ["1 N", "2 N"]}, {0: "no <b>luck</b>", 1: "no <b>luck</b>"})
    text = write_report(made).read_text("utf-8")
    assert "0 of 2 points done, 2 failed." in text
    assert "no &lt;b&gt;luck" in text and "no <b>luck" not in text


def test_parameters_of_one_last_word_have_titles_of_their_own(tmp_path: Path) -> None:
    axes = {"a.left.K_T": [1, 2], "a.right.K_T": [3, 4], "friction": [0.1, 0.2]}
    folder = _made(tmp_path / "s", axes)
    made = read_sweep(folder)
    assert [axis.short for axis in made.axes] == ["left K T", "right K T", "friction"]
    html = write_report(folder).read_text("utf-8")
    head = html[html.index("<h2>Table") :].partition("</thead>")[0]
    assert "left K T" in head and "right K T" in head


def test_reasons_are_told_once_with_their_points(tmp_path: Path) -> None:
    made = read_sweep(_made(tmp_path / "s", {"F": [f"{k} N" for k in range(12)]}))
    table = grouped("t", made, [["rare"] if k == 0 else ["often"] for k in range(12)])
    assert [row[:2] for row in table.rows] == [("often", "11"), ("rare", "1")]
    assert table.rows[0][2].endswith("F 8 N; and 3 more") and table.rows[1][2] == "F 0 N"


@pytest.mark.parametrize(
    ("failed", "warned", "kind"),
    [(0, 0, "passed"), (0, 1, "warning"), (1, 0, "warning"), (3, 0, "failed")],
)
def test_verdict(failed: int, warned: int, kind: str) -> None:
    points = [
        {"status": "failed" if k < failed else "ok", "warnings": ["w"] * (k < warned)}
        for k in range(3)
    ]
    assert verdict(points)[0] == kind


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({"cost": None}, "damaged in cost"),
        ({"points": [], "sha256": "1"}, "not as upd sweep wrote it"),
    ],
)
def test_damaged_sweep_is_told(tmp_path: Path, more: dict[str, Any], told: str) -> None:
    made = _made(tmp_path / "s", {"a": [1, 2]})
    whole = json.loads((made / "sweep.json").read_text("utf-8"))
    changed = {key: value for key, value in (whole | more).items() if value is not None}
    (made / "sweep.json").write_text(json.dumps(changed), "utf-8")
    with pytest.raises(InputError, match=told):
        write_report(made)
    assert not (made / "report.html").exists()


def test_no_json_and_comparison_are_refused(tmp_path: Path) -> None:
    made = _made(tmp_path / "s", {"a": [1, 2]})
    with pytest.raises(InputError, match="a comparison is of runs"):
        write_comparison([made, made], tmp_path / "c.html")
    (made / "sweep.json").write_text("{")
    with pytest.raises(InputError, match="is not JSON"):
        write_report(made)


def test_a_disk_full_at_the_pictures_leaves_the_numbers_of_a_sweep(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("upd.batch.sweeps.draw", full)
    monkeypatch.setattr(sweep_page, "write_sweep_report", full)
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    words = [
        word for key, value in TINY.items() for word in ("--set", f"{key}={json.dumps(value)}")
    ]
    vary = ["--vary", "loads.normal=40 N,60 N,5000 N"]
    with pytest.raises(SystemExit) as end:
        main(["sweep", "hertz", *vary, *words, "--out", str(copy), "--workers", "0"])
    assert end.value.code == 0
    told = capsys.readouterr()
    assert told.err.splitlines() == [
        "upd: figures not written (No space left on device)",
        "upd: report.html not written (No space left on device)",
    ]
    assert (copy / "table.csv").exists()
    assert not list(copy.glob("*.png")), "those of the call before show other numbers"


def test_pictures_of_the_user_stay_in_the_folder_and_off_the_page(
    folder: Path, tmp_path: Path
) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    shutil.copy(copy / "sweep.png", copy / "sweep-notes.png")
    (copy / "sweep_photo.png").write_bytes(b"a photograph")
    sweep("hertz", ["loads.normal=40 N,60 N,5000 N"], overrides=TINY, out=copy, workers=0)
    assert (copy / "sweep-notes.png").read_bytes() == (folder / "sweep.png").read_bytes()
    assert (copy / "sweep_photo.png").read_bytes() == b"a photograph"
    html = (copy / "report.html").read_text("utf-8")
    assert html.count("<figure") == 1 and "a photograph" not in html


def test_a_page_that_fails_is_logged_and_the_sweep_ends_well(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def broken(where: object) -> Path:
        raise RuntimeError(f"no page for {where}")

    monkeypatch.setattr(sweep_page, "write_sweep_report", broken)
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    found = sweep("hertz", ["loads.normal=40 N,60 N,5000 N"], overrides=TINY, out=copy, workers=0)
    assert found.failed == [2]
    assert (copy / "table.csv").exists()
    assert not (copy / "report.html").exists(), "a page of an earlier call would show other numbers"
    assert copy / "report.html" not in found.files
    assert "report.html not written" in caplog.text


def test_a_number_without_a_value_at_any_point_has_no_column(tmp_path: Path) -> None:
    folder = _made(tmp_path / "made", {"loads.normal": ["10 N", "20 N"]})
    data = json.loads((folder / "sweep.json").read_text())
    data["followed"].append({"name": "max_pressure", "case": "", "unit": "MPa"})
    for point in data["points"]:
        point["values"].append(None)
    data.pop("sha256", None)
    (folder / "sweep.json").write_text(json.dumps(data))
    html = write_report(folder).read_text("utf-8")
    head = html[html.index("<h2>Table") :].partition("</thead>")[0]
    assert "approach" in head and "maximum pressure" not in head
    assert "reason or warnings" not in head, "no point failed or warned"
    assert "Without a value at every point: maximum pressure." in html


def test_figures_of_one_two_and_three_parameters(tmp_path: Path) -> None:
    for vary in (
        ["a=1:3:3"],
        ["a=1:3:3", "b=1:2:2"],
        ["a=1:3:3", "b=x,y"],
        ["a=1:3:3", "b=1:2:2", "c=x,y"],
        ["b=x,y"],
    ):
        axes = parse_axes(vary, {})
        grid = places(axes)
        outcomes = [
            Outcome((Result("p", Case(), float(k), "N"), Result("flat", Case(), 1.0, "N")))
            if k
            else Outcome(failure="no")
            for k in range(len(grid))
        ]
        columns = make_columns(outcomes, ["*"])
        written = draw(tmp_path, axes, columns)
        assert len(written) == 1
        assert sorted(tmp_path.glob("*.png")) == sorted(written), (
            "figures of the grid before are gone"
        )
        assert all(path.stat().st_size > 5_000 for path in written)
        assert csv_text(axes, grid, outcomes, columns).count("\n") == len(grid) + 1
