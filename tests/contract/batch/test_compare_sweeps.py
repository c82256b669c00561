"""`upd report A B` of two sweeps: the same points side by side, whatever their order."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from upd.cli import main
from upd.errors import InputError
from upd.report import write_comparison
from upd.report.compare_sweeps import compared
from upd.report.sweep_folder import read_sweep


def folder(
    path: Path, radii: list[str], frictions: list[float], values: list[Any], **more: Any
) -> Path:
    """A sweep folder over radius and friction with one followed number per point."""
    path.mkdir()
    points = [
        {
            "values": [value],
            "status": "ok" if value is not None else "failed",
            "reason": "" if value is not None else "patch rim <b>",
            "warnings": [],
            "seconds": 1.0,
        }
        for value in values
    ]
    data = {
        "scene": "hertz",
        "title": "Loads",
        "axes": [
            {"path": "geometry.radius", "unit": "mm", "values": radii},
            {"path": "contact.friction", "unit": "", "values": frictions},
        ],
        "followed": [{"name": "max_pressure", "case": "F=200 N", "unit": "MPa"}],
        "plan": {},
        "cost": {"this_call_s": 1.0, "peak_rss_mb": 1.0, "stages_s": {}},
        "points": points,
        "text": "",
    }
    (path / "sweep.json").write_text(json.dumps(data | more), encoding="utf-8")
    return path


@pytest.fixture
def two(tmp_path: Path) -> tuple[Path, Path]:
    one = folder(tmp_path / "one", ["4 mm", "5 mm"], [0.3, 0.4], [1.0, 2.0, 3.0, 4.0])
    # other order of the radii, one more of them, one point failed
    other = folder(
        tmp_path / "two", ["5 mm", "4 mm", "6 mm"], [0.3, 0.4], [3.3, None, 1.1, 2.0, 9.0, 9.5]
    )
    return one, other


def test_points_meet_by_the_values_of_their_parameters(two: tuple[Path, Path]) -> None:
    (number,) = compared([read_sweep(path) for path in two])
    assert (number.name, number.case, number.unit) == ("max_pressure", "F=200 N", "MPa")
    rows = {row.point: row for row in number.rows}
    assert rows["4", "0.3"].values == (1.0, 1.1)
    assert rows["4", "0.3"].spread == pytest.approx(0.1)
    assert rows["4", "0.4"].values == (2.0, 2.0)
    assert rows["5", "0.3"].values == (3.0, 3.3)
    assert rows["5", "0.4"].values == (4.0, None)
    assert rows["5", "0.4"].why == ("", "patch rim <b>")
    assert rows["5", "0.4"].spread is None
    assert rows["6", "0.3"].values == (None, 9.0)
    assert rows["6", "0.3"].why[0] == "no such point"
    assert len(rows) == 6


def test_axes_may_stand_in_another_order(two: tuple[Path, Path], tmp_path: Path) -> None:
    data = json.loads((two[0] / "sweep.json").read_text(encoding="utf-8"))
    data["axes"].reverse()
    data["points"] = [data["points"][k] for k in (0, 2, 1, 3)]
    turned = tmp_path / "turned"
    turned.mkdir()
    (turned / "sweep.json").write_text(json.dumps(data), encoding="utf-8")
    (number,) = compared([read_sweep(two[0]), read_sweep(turned)])
    assert all(row.values[0] == row.values[1] for row in number.rows)


def test_page_and_table_of_the_command(two: tuple[Path, Path], tmp_path: Path) -> None:
    page = tmp_path / "ab.html"
    with pytest.raises(SystemExit) as end:
        main(["report", str(two[0]), str(two[1]), "--out", str(page)])
    assert end.value.code == 0
    html = page.read_text(encoding="utf-8")
    assert "Comparison of the sweeps one and two" in html
    assert "patch rim &lt;b&gt;" in html
    assert "+10.00" in html
    with page.with_suffix(".csv").open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    assert head == [
        *("number", "case", "unit", "geometry.radius [mm]", "contact.friction"),
        *("one", "two", "largest difference"),
    ]
    assert rows[0][:7] == ["max_pressure", "F=200 N", "MPa", "4", "0.3", "1.0", "1.1"]


def test_what_cannot_be_compared_is_told(two: tuple[Path, Path], tmp_path: Path) -> None:
    data = json.loads((two[0] / "sweep.json").read_text(encoding="utf-8"))
    data["axes"][1]["path"] = "loads.normal"
    strange = tmp_path / "strange"
    strange.mkdir()
    (strange / "sweep.json").write_text(json.dumps(data), encoding="utf-8")
    page = tmp_path / "ab.html"
    with pytest.raises(InputError, match="vary different parameters"):
        write_comparison([two[0], strange], page)
    with pytest.raises(InputError, match="duplicated"):
        write_comparison([two[0], two[0]], page)
    with pytest.raises(InputError, match="two sweeps or more"):
        write_comparison([two[0]], page)
    with pytest.raises(InputError, match="folders of one kind"):
        write_comparison([two[0], tmp_path], page)
    with pytest.raises(InputError, match=r"ends in \.html"):
        write_comparison(two, tmp_path / "ab.txt")
    assert not page.exists()
