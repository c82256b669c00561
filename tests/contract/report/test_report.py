"""report.html: one file, nothing fetched, everything escaped, numbers with units.

Charts that agree with their closed forms.
"""

from __future__ import annotations

import base64
import gzip
import json
import re
import shutil
from copy import deepcopy
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upd import run
from upd.cli import main
from upd.errors import InputError
from upd.labels import number, percent, unit_label
from upd.plot.chart import Chart
from upd.plot.plotly import figure, pack
from upd.reference import mindlin
from upd.report import write_report
from upd.report.folder import RunFolder, read_run
from upd.report.page import fitting
from upd.report.run_page import (
    differences,
    numbers,
    overlaid,
    run_surfaces,
    write_comparison,
)
from upd.report.tables import all_numbers, analysis_charts, filled, main_numbers, warnings
from upd.results.check import worst_checks
from upd.results.quantities import number_label

TITLE = 'Hertz <script>alert("x")</script> & </script><!-- "quoted"'
MU, F = 0.6, 200.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("runs") / "hertz"
    overrides = [
        f"title={json.dumps(TITLE)}",
        "geometry.divisions=16",
        'loads.normal=["200 N"]',
        "loads.tangential=[0.5, 0.9]",
    ]
    run("hertz", overrides=overrides, out=path)
    return path


@pytest.fixture(scope="module")
def damper(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("runs") / "symmetric"
    overrides = [
        "geometry.divisions=4",
        "geometry.divisions_long=10",
        "law.rows=2",
        "law.columns=2",
        "loads.tangential=[0.5]",
    ]
    run("symmetric", overrides=overrides, out=path, report=False)
    return path


@pytest.fixture(scope="module")
def hertz(folder: Path) -> RunFolder:
    return read_run(folder)


def _charts(folder: RunFolder) -> list[Chart]:
    return analysis_charts(folder.arrays, folder.summary)


def _chart(folder: RunFolder, title: str) -> Chart:
    return next(c for c in _charts(folder) if c.title == title)


class _Page(HTMLParser):
    """Attributes that make a browser fetch something, text, and the kinds of elements."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.elements: dict[str, int] = {}
        self.text: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements[tag] = self.elements.get(tag, 0) + 1
        self.addresses += [
            value or ""
            for key, value in attrs
            if key in ("src", "href", "srcset", "data", "action", "poster")
        ]

    def handle_data(self, data: str) -> None:
        self.text.append(data)


@pytest.fixture(scope="module")
def html(folder: Path) -> str:
    return (folder / "report.html").read_text("utf-8")


def unpacked(html: str, name: str) -> str:
    """Text of a packed element, which cannot end the element it stands in."""
    found = re.search(rf'id="{name}">([^<\r\0]*)</script>', html)
    assert found
    letters = np.array([ord(letter) & 127 for letter in found[1]], np.uint8)
    bits = np.unpackbits(letters[:, None], axis=1)[:, 1:].ravel()
    return gzip.decompress(np.packbits(bits[: bits.size // 8 * 8]).tobytes()).decode()


# ---------------------------------------------------------------- the page

#: bytes of a page at most
LIMIT_BYTES = 6_000_000


def test_page_is_one_small_file_that_fetches_nothing(folder: Path, html: str) -> None:
    assert (folder / "report.html").stat().st_size < LIMIT_BYTES
    page = _Page(html)
    assert page.addresses and all(address.startswith(("data:", "#")) for address in page.addresses)
    style = html[html.index("<style>") : html.index("</style>")]
    assert "@import" not in style and "url(" not in style
    # Data, plotly once, the page's own: nothing else runs.
    assert page.elements["script"] == 3
    assert "plotly.js v" not in html and unpacked(html, "plotly").count("plotly.js v") == 1


def test_text_of_the_scene_is_escaped(html: str) -> None:
    assert "<script>alert" not in html
    assert TITLE in _Page(html).text
    assert set(json.loads(unpacked(html, "page-data"))) == {"panels", "surfaces"}


def test_every_number_has_its_unit(folder: Path, html: str) -> None:
    rows = json.loads((folder / "summary.json").read_text())["results"]
    for row in (r for r in rows if r["unit"] and r["value"] is not None):
        assert f"{number(row['value'])} {unit_label(row['unit'])}<" in html, row


@pytest.mark.parametrize(
    "heading",
    [
        "Main numbers",
        "Figures",
        "What was simulated, what was left out",
        "Self-checks",
        "Cost and mesh",
        "Scene file",
    ],
)
def test_page_has_all_its_parts(html: str, heading: str) -> None:
    assert f"{heading}</h" in html


def test_page_tells_versions_checks_and_the_scene(hertz: RunFolder, html: str) -> None:
    began = hertz.log[0]["time"].partition(",")[0]
    assert f"Run folder hertz, run on {began}. Versions: " in html
    versions = {one.split()[0] for one in html.partition("Versions: ")[2].split(", ")}
    assert {"upd", "python", "numpy", "scipy", "scikit-fem", "gmsh"} <= versions
    text = "".join(_Page(html).text)
    shown = text.replace("mu", "µ")
    for check in worst_checks(hertz.summary["checks"]):
        # the page sets the index of a symbol lower
        says = re.sub(r"\b([KFT])_([A-Za-z]{1,2})\b", r"\1\2", check["says"]).replace("mu", "µ")
        assert says in shown
    assert hertz.scene in text


def test_headlines_are_five_to_eight_numbers(hertz: RunFolder, damper: Path) -> None:
    for found in (hertz, read_run(damper)):
        rows = main_numbers(found.summary["size"], found.summary["results"])
        assert 5 <= len(rows) <= 8
        assert len({r["name"] for r in rows}) == len(rows)


def test_a_run_of_an_unknown_analysis_has_numbers_and_no_charts(hertz: RunFolder) -> None:
    other = hertz.summary | {"size": {"analysis": "other"}}
    assert analysis_charts(hertz.arrays, other) == []
    assert main_numbers(other["size"], other["results"])[0]["reference"] is not None


def test_arrays_of_another_version_are_refused(hertz: RunFolder) -> None:
    other = deepcopy(dict(hertz.arrays))
    for group in other.values():
        if "traction" in group:
            del group["traction"]
    with pytest.raises(InputError, match="not those that this version of upd draws"):
        analysis_charts(other, hertz.summary)


# ---------------------------------------------------------------- charts against closed forms


def test_hertz_curve_is_the_closed_form(hertz: RunFolder) -> None:
    chart = _chart(hertz, "Pressure along y = 0")
    (closed,) = (t for t in chart.traces if t.label == "Hertz")
    a, p0 = (
        next(r["reference"] for r in hertz.summary["results"] if r["name"] == n)
        for n in ("radius_moment", "max_pressure")
    )
    np.testing.assert_allclose(
        closed.y, p0 * np.sqrt(np.maximum(1.0 - (closed.x / a) ** 2, 0.0)), atol=1e-7 * p0
    )
    # The load under the closed form is the scene's: 2/3 p0 pi a^2.
    assert 2.0 / 3.0 * p0 * np.pi * (1e-3 * a) ** 2 == pytest.approx(F, rel=1e-12)


def test_traction_curves_are_cattaneo_and_mindlins(hertz: RunFolder) -> None:
    chart = _chart(hertz, "Tangential traction along y = 0")
    a = 1e-3 * next(
        r["reference"] for r in hertz.summary["results"] if r["name"] == "radius_moment"
    )
    for ratio in (0.5, 0.9):
        trace = next(t for t in chart.traces if t.label == f"T/µN={ratio:g}, Cattaneo-Mindlin")
        c = float(mindlin.stick_radius(ratio * MU * F, MU, F, a))
        expected = mindlin.traction(1e-3 * np.abs(trace.x), a, c, MU, F)
        np.testing.assert_allclose(trace.y, expected, atol=1e-6 * float(expected.max()))


def _area(x: np.ndarray[Any, Any], y: np.ndarray[Any, Any]) -> float:
    """Area of a closed polygon."""
    return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))


def test_hysteresis_loop_has_the_closed_forms_area(hertz: RunFolder) -> None:
    chart = _chart(hertz, "Hysteresis")
    row = next(r for r in hertz.summary["results"] if r["name"] == "cycle_energy")
    ours, closed = chart.traces
    down, up = np.split(np.column_stack([closed.x, closed.y])[np.isfinite(closed.x)], 2)
    loop = np.vstack([down, up])
    # A polygon of 151 points for each branch; um N is 1e-3 mJ.
    assert 1e-3 * _area(*loop.T) == pytest.approx(row["reference"], rel=2e-3)
    last = len(ours.x) - len(ours.x) * 4 // 5
    assert 1e-3 * _area(ours.x[last:], ours.y[last:]) == pytest.approx(row["value"], rel=2e-2)


def test_state_map_shows_what_the_run_counted(hertz: RunFolder) -> None:
    chart = next(
        c for c in _charts(hertz) if c.title == "Stick and slip" and c.case.endswith("0.5")
    )
    group = hertz.arrays["F=200 N T per muN=0.5"]
    assert int((chart.maps[0].z == 2).sum()) == int(group["stick"].data.sum())
    closed = hertz.arrays["F=200 N"]["contact"].data > 0
    assert int((chart.maps[0].z > 0).sum()) == int(closed.sum())


def test_labels_cannot_carry_markup() -> None:
    chart = replace(_simple_chart(), title="t")
    hostile = replace(chart, traces=(replace(chart.traces[0], label="<a href='http://x'>y</a>"),))
    assert "<a" not in json.dumps(figure(hostile))


def _simple_chart() -> Chart:
    from upd.plot.chart import Axis, Trace

    return Chart(
        "t", Axis("x", "mm"), Axis("y", "N"), (Trace("a", np.arange(2.0), np.arange(2.0)),)
    )


# ---------------------------------------------------------------- the surface


def read(packed: dict[str, str]) -> np.ndarray[Any, Any]:
    """The array that the script reads."""
    return np.frombuffer(base64.b64decode(packed["bdata"]), f"<{packed['dtype']}")


def _volume(points: np.ndarray[Any, Any], triangles: np.ndarray[Any, Any]) -> float:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def test_surface_is_closed_and_looks_outwards(hertz: RunFolder) -> None:
    surface = run_surfaces(hertz)[0]
    bodies = {
        b["name"]: (read(b["points"]).reshape(3, -1).T, read(b["triangles"]).reshape(3, -1).T)
        for b in surface["bodies"]
    }
    # A quarter of a block of (10 mm)^3.
    assert _volume(*bodies["block"]) == pytest.approx(250.0, rel=1e-6)
    for _, triangles in bodies.values():
        edges = np.sort(np.vstack([triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_fields_are_left_out_when_there_is_no_room(
    hertz: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    surface = run_surfaces(hertz)[0]
    assert [f["quantity"] for f in surface["fields"]] == ["pressure", "displacement"]
    bare = surface | {"fields": surface["fields"][:1]}
    monkeypatch.setattr(
        "upd.report.page.MOST_LETTERS", len(json.dumps(bare, separators=(",", ":")))
    )
    shown, left_out = fitting([surface])
    assert len(shown[0]["fields"]) == 1 and left_out == [
        f"{surface['fields'][1]['label']}: too large for this page"
    ]
    monkeypatch.setattr("upd.report.page.MOST_LETTERS", 10)
    assert fitting([surface]) == ([], [f"{surface['label']}: too large for this page"])


@pytest.mark.parametrize(
    ("values", "kind"), [([0, 255], "u1"), ([0, 256], "u2"), ([0, 65536], "u4")]
)
def test_integers_are_packed_as_small_as_they_are(values: list[int], kind: str) -> None:
    made = pack(np.array(values))
    assert made["dtype"] == kind
    assert np.frombuffer(base64.b64decode(made["bdata"]), f"<{kind}").tolist() == values


# ---------------------------------------------------------------- several runs


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("more") / "hertz"
    overrides = [
        'title="plain"',
        "geometry.divisions=12",
        'loads.normal=["200 N"]',
        "loads.tangential=[0.5, 0.9]",
    ]
    run("hertz", overrides=overrides, out=path, report=False)
    return path


def test_comparison_shows_both_runs_and_their_difference(
    folder: Path, other: Path, tmp_path: Path
) -> None:
    path = tmp_path / "both.html"
    with pytest.raises(SystemExit) as stop:
        main(["report", str(folder), str(other), "--out", str(path)])
    assert stop.value.code == 0
    assert path.stat().st_size < LIMIT_BYTES
    html = path.read_text("utf-8")
    assert "<script>alert" not in html and all(a.startswith("data:") for a in _Page(html).addresses)
    text = " ".join(" ".join(_Page(html).text).split())
    assert "geometry.divisions 16 12" in text and "geometry.radius" not in text
    for run_folder in (folder, other):
        row = next(
            r for r in read_run(run_folder).summary["results"] if r["name"] == "max_pressure"
        )
        assert number(row["value"]) in html


def test_rows_hold_one_value_per_run(hertz: RunFolder, other: Path) -> None:
    results = [hertz.summary["results"], read_run(other).summary["results"][:3]]
    main, others = numbers(results, ["a", "b"], {(r["name"], r["case"]) for r in results[0][:2]})
    assert [row[0] for row in (*main.rows, *others.rows)] == [
        number_label(r["name"]) for r in results[0]
    ]
    assert main.columns[:5] == ("number", "case", "# a", "# b", "# largest difference from a")
    assert [bool(row[3]) for row in others.rows] == [True] + [False] * (len(others.rows) - 1)
    assert main.rows[0][4] == percent(results[1][0]["value"] / results[0][0]["value"] - 1.0)


def test_charts_lie_over_each_other(hertz: RunFolder, other: Path) -> None:
    both = overlaid([_charts(hertz), _charts(read_run(other))], ["one", "two"])
    curve = next(c for c in both if c.title == "Force over approach")
    assert {(t.colour, t.entry) for t in curve.traces} == {(0, "one"), (1, "two")}
    assert [t["showlegend"] for t in figure(curve)["data"]].count(True) == 2
    maps = [c for c in both if c.title.startswith("Contact pressure")]
    assert [c.title for c in maps] == ["Contact pressure: one", "Contact pressure: two"]
    assert maps[0].maps[0].top == maps[1].maps[0].top


def test_names_tell_runs_apart(folder: Path, other: Path, tmp_path: Path) -> None:
    page = write_comparison([folder, other], tmp_path / "both.html").read_text("utf-8")
    first, second = (f"{path.parent.name}/hertz" for path in (folder, other))
    assert first != second and f"Comparison of {first} and {second}" in page
    with pytest.raises(InputError, match="duplicated"):
        write_comparison([folder, folder], tmp_path / "both.html")


def test_only_entries_that_differ_are_shown() -> None:
    assert differences([{"t": {"a": 1}, "b": [1, 2]}, {"t": {"a": 1}, "b": [1, 3], "c": 4}]) == (
        ("b[1]", "2", "3"),
        ("c", "–", "4"),
    )


# ---------------------------------------------------------------- broken folders, command line


@pytest.fixture
def copy(folder: Path, tmp_path: Path) -> Path:
    path = tmp_path / "copy"
    shutil.copytree(folder, path)
    for name in ("report.html", "fields.vtu", "mesh.vtu"):
        (path / name).unlink()
    return path


@pytest.mark.parametrize(
    "name", ["result.nc", "scene.toml", "run.log", "fields.vtu", "pressure.png"]
)
@pytest.mark.parametrize("content", [None, b"\x00\xff broken"], ids=["missing", "broken"])
def test_a_page_is_made_from_what_is_left(copy: Path, name: str, content: bytes | None) -> None:
    (copy / name).unlink(missing_ok=True)
    if content is not None:
        (copy / name).write_bytes(content)
    html = write_report(copy).read_text("utf-8")
    assert "Main numbers" in html
    if name != "fields.vtu" and (name != "pressure.png" or content):
        assert f"<li>{name}: " in html


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (None, "no run folder"),
        ("{", "not JSON"),
        ("[]", "not JSON of a run"),
        ('{"scene": "x"}', "damaged in title, status"),
    ],
)
def test_a_bad_summary_is_an_input_error(copy: Path, content: str | None, told: str) -> None:
    (copy / "summary.json").unlink()
    if content is not None:
        (copy / "summary.json").write_text(content)
    with pytest.raises(InputError, match=told):
        write_report(copy)
    assert not (copy / "report.html").exists()


def test_command_makes_a_page_or_says_what_is_wrong(
    copy: Path, other: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as done:
        main(["report", str(copy)])
    assert done.value.code == 0 and (copy / "report.html").exists()
    capsys.readouterr()
    for arguments, told in (
        (["report", str(tmp_path)], "no run folder"),
        (["report", str(copy), "--out", "x.html"], "--out"),
        (["report", str(copy), str(other), "--out", str(tmp_path / "c.pdf")], "ends in .html"),
    ):
        with pytest.raises(SystemExit) as stop:
            main(arguments)
        assert stop.value.code == 2
        assert told in capsys.readouterr().err


def test_verdict_and_estimated_errors_come_from_the_summary(copy: Path) -> None:
    summary = json.loads((copy / "summary.json").read_text())
    row = next(r for r in summary["results"] if r["name"] == "max_pressure")
    row |= {"estimated_error": 0.0123}
    summary["status"] = "failed: patch rim: 52 nodes; enlarge the patch"
    del summary["sha256"]
    (copy / "summary.json").write_text(json.dumps(summary))
    with (copy / "run.log").open("a") as log:
        log.write(
            "2026-01-01 00:00:00,000 ERROR   upd: failed: patch rim: 52 nodes; enlarge the patch\n"
        )
        log.write("2026-01-01 00:00:00,000 WARNING upd.hbm: harmonics missing\n")
        log.write("2026-01-01 00:00:00,000 WARNING upd.cache: no room\n")
    html = write_report(copy).read_text("utf-8")
    assert "<strong>Failed.</strong> patch rim: 52 nodes; enlarge the patch" in html
    assert ">1.2 %<" in html
    # Told once, as the verdict.
    assert html.count("enlarge the patch") == 1
    assert "<li>No room</li>" in html
    # What the balance warns of stands among the checks.
    assert "harmonics missing" not in html


def test_a_run_without_a_page_leaves_none(other: Path) -> None:
    assert not (other / "report.html").exists()
    assert (other / "summary.json").exists()


def test_a_page_that_fails_does_not_hide_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> Path:
        raise RuntimeError("no room")

    monkeypatch.setattr("upd.runner.write_report", broken)
    result = run(
        "hertz", overrides=["geometry.divisions=12", 'want=["normal"]'], out=tmp_path / "r"
    )
    told = "resolution (F=50 N; F=200 N); report.html not written (no room)"
    assert result.status == f"ok with warnings: {told}"
    assert "report.html was not written" in (tmp_path / "r" / "run.log").read_text()


def test_columns_that_are_empty_in_every_row_are_left_out() -> None:
    table = filled("t", {"a": ["1", "2"], "b": ["", ""], "c": ["", "x"]})
    assert table.columns == ("a", "c") and table.rows == (("1", ""), ("2", "x"))
    bare = {"name": "f", "case": "", "value": 1.0, "unit": "", "reference": None, "source": ""}
    (table,) = all_numbers([bare, bare])
    assert table.columns == ("number", "# value")
    (table,) = all_numbers([bare, bare | {"reference": 2.0, "source": "x"}])
    assert table.columns == ("number", "# value", "# reference", "source")


def _check(name: str, case: str, value: float, **more: Any) -> dict[str, Any]:
    """An entry of summary.json."""
    return {
        "name": name,
        "case": case,
        "value": value,
        "limit": 0.01,
        "says": "motion left out",
        "remedy": "take more",
        "verdict": "warning",
    } | more


def test_a_warning_of_several_cases_stands_once() -> None:
    checks = [
        _check("truncation", "F=1 N", 0.02),
        _check("truncation", "F=2 N", 0.05),
        _check("truncation", "F=3 N", 0.05),
        _check("truncation", "F=4 N", 0.005, verdict="passed"),
        _check("coupling", "", 0.5, remedy=""),
    ]
    assert warnings(checks, []) == [
        "Truncation (F=2 N; F=1 N; F=3 N): motion left out = 0.05 (limit 0.01). Take more.",
        "Coupling: motion left out = 0.5 (limit 0.01).",
    ]


def test_numbers_lost_for_one_reason_stand_in_one_sentence() -> None:
    row = {"value": None, "unit": "", "reference": None, "case": "thesis", "withheld": "it is lost"}
    rows = [row | {"name": name} for name in ("approach", "max_pressure")]
    rows += [row | {"name": "approach", "case": "own", "withheld": "no room"}]
    assert warnings([], rows) == [
        "Approach, raw; maximum pressure (thesis): not reached, it is lost.",
        "Approach, raw (own): not reached, no room.",
    ]


def test_no_warning_stands_twice_on_a_page(copy: Path) -> None:
    """Not in a table of numbers, effects or checks what the list of warnings says."""
    summary = json.loads((copy / "summary.json").read_text())
    row = summary["results"][0]
    row |= {"value": None, "withheld": "the path ended at 330 Hz", "error": None}
    check = summary["checks"][0]
    check |= {"verdict": "warning", "remedy": "enlarge it", "value": 0.25, "limit": 0.05}
    summary["effects"][0] |= {"verdict": f"warning: {check['says']} = 0.25 (limit 0.05)"}
    del summary["sha256"]
    (copy / "summary.json").write_text(json.dumps(summary))
    text = " ".join(" ".join(_Page(write_report(copy).read_text("utf-8")).text).split())
    for told in ("the path ended at 330 Hz", "Enlarge it.", "= 0.25 (limit 0.05)"):
        assert text.count(told) == 1, told


def _empty_columns(html: str) -> list[str]:
    """Names of columns of a page whose cells are empty, or a dash, in every row."""
    found = []
    for table in re.findall(r"<table.*?</table>", html, re.DOTALL):
        head = re.findall(r"<th[^>]*>(.*?)</th>", table.partition("</thead>")[0], re.DOTALL)
        rows = [
            re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row, re.DOTALL)
            for row in re.findall(r"<tr>.*?</tr>", table.partition("<tbody>")[2], re.DOTALL)
        ]
        found += [
            name
            for k, name in enumerate(head)
            if all(re.sub(r"<[^>]*>", "", row[k]).strip() in ("", "–", "none") for row in rows)
        ]
    return found


def test_no_table_has_an_empty_column(
    copy: Path, html: str, folder: Path, other: Path, tmp_path: Path
) -> None:
    assert not _empty_columns(html)
    summary = json.loads((copy / "summary.json").read_text())
    for entry in (*summary["results"], *summary["checks"]):
        entry["case"] = ""
    for row in summary["results"]:
        row |= {"reference": None, "source": "", "error": None}
    for effect in summary["effects"]:
        effect["verdict"] = ""
    del summary["sha256"]
    (copy / "summary.json").write_text(json.dumps(summary))
    assert not _empty_columns(write_report(copy).read_text("utf-8"))
    for pair in ((folder, other), (copy, other)):
        both = write_comparison(pair, tmp_path / "both.html").read_text("utf-8")
        assert not _empty_columns(both)
