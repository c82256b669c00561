"""The four READMEs: links and pictures exist, Python examples print what they promise, and the
tables are those of a run.
"""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

import upd
from upd.cli import main
from upd.errors import InputError

pytestmark = pytest.mark.estimated

ROOT = Path(__file__).resolve().parents[3]
NAMES = ("README.md", "benchmarks/README.md", "geometry/README.md", "upd/scenes/README.md")
TEXT = {name: (ROOT / name).read_text(encoding="utf-8") for name in NAMES}
README, MEASURED, GEOMETRY, SCENES = TEXT.values()
#: Python examples of all documents
EXAMPLES = [
    (name, code)
    for name, text in TEXT.items()
    for code in re.findall(r"```python\n(.*?)```", text, re.DOTALL)
]
#: label in the sphere's table -> number of the run
SPHERE = {
    "maximum pressure": "max_pressure",
    "mean pressure": "mean_pressure",
    "contact radius (second moment)": "radius_moment",
    "approach, raw": "approach",
    "approach, bulk compliance removed": "approach_contact",
    "K_N tangent, bulk compliance removed": "K_N_tangent",
    "K_T initial, bulk compliance removed": "K_T_initial",
    "stick radius": "stick_radius",
    "tangential displacement, bulk compliance removed": "tangential_displacement",
    "energy per cycle": "cycle_energy",
}


def table(text: str, head: str) -> list[list[str]]:
    """Cells of the only table whose first line begins with ``head``."""
    lines = text.splitlines()
    (begin,) = [k for k, line in enumerate(lines) if line.startswith(head)]
    rows = []
    for line in lines[begin + 2 :]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows


def measured(benchmark: str, name: str, case: str) -> str:
    """Note of the only row with this name and case in a benchmark's results."""
    file = ROOT / "benchmarks" / "results" / f"{benchmark}.csv"
    rows = csv.DictReader(file.read_text(encoding="utf-8").splitlines())
    (note,) = [row["note"] for row in rows if (row["name"], row["case"]) == (name, case)]
    return note


def plain(line: str) -> str:
    """A printed line without the rules of its table."""
    return " ".join(re.sub(r"[│┃|]", " ", line).split())


def slug(heading: str) -> str:
    """Anchor of a heading on a page."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


@pytest.fixture(scope="module")
def sphere(
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[str, dict[tuple[str, str], dict[str, Any]]]:
    """What `upd run hertz` prints, and its numbers by name and case."""
    folder = tmp_path_factory.mktemp("readme") / "hertz"
    printed = io.StringIO()
    wide = Console(file=printed, highlight=False, width=120)
    with pytest.MonkeyPatch.context() as patch, pytest.raises(SystemExit) as end:
        patch.setattr("upd.cli.terminal.console", wide)
        patch.setattr("upd.runner.write_figures", lambda *_: [])
        main(["run", "hertz", "--out", str(folder)])
    assert end.value.code == 0
    assert (folder / "report.html").is_file()
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    return printed.getvalue(), {(r["name"], r["case"]): r for r in summary["results"]}


def test_readme_is_short() -> None:
    lines = README.splitlines()
    assert len(lines) <= 120
    assert [line for line in lines if len(line) > 120 and not line.startswith(("|", "!["))] == []


@pytest.mark.parametrize("name", NAMES)
def test_no_placeholders_and_links_lead_somewhere(name: str) -> None:
    text = TEXT[name]
    assert not re.search(r"@@|TODO|FIXME|\?\?", text)
    targets = re.findall(r"\]\(([^)\s]+)\)", text)
    assert targets
    for target in targets:
        if target.startswith("http"):
            continue
        path, _, anchor = target.partition("#")
        found = (ROOT / name).parent / path if path else ROOT / name
        assert found.is_file(), target
        if anchor:
            assert anchor in [
                slug(h)
                for h in re.findall(r"^#+ (.+)$", found.read_text(encoding="utf-8"), re.MULTILINE)
            ], target


@pytest.mark.parametrize("name", NAMES)
def test_paths_named_in_the_text_exist(name: str) -> None:
    for path in re.findall(
        r"(?:python |`|/)((?:benchmarks|upd|tests|geometry)/[\w/.-]+\.(?:py|toml|png|md))",
        TEXT[name],
    ):
        assert (ROOT / path).is_file(), path


@pytest.mark.parametrize(("name", "code"), EXAMPLES)
def test_example_prints_its_numbers(
    name: str, code: str, capsys: pytest.CaptureFixture[str]
) -> None:
    promised = re.findall(r"print\(.*\)\s*# (.+)", code)
    assert promised
    exec(compile(code, name, "exec"), {})
    assert capsys.readouterr().out.split("\n")[:-1] == promised


def test_the_readme_has_an_example() -> None:
    assert "README.md" in [name for name, _ in EXAMPLES]


def test_headlines_are_printed(sphere: tuple[str, dict[tuple[str, str], dict[str, Any]]]) -> None:
    (shown,) = re.findall(r"```text\n(.*?)```", README, re.DOTALL)
    printed = {plain(line) for line in sphere[0].splitlines()}
    assert shown.strip()
    for line in shown.strip().splitlines():
        assert plain(line) in printed


def test_sphere_table_is_that_of_a_run(
    sphere: tuple[str, dict[tuple[str, str], dict[str, Any]]],
) -> None:
    rows = table(MEASURED, "| number | case | computed | closed form |")
    assert {row[0] for row in rows} == set(SPHERE)
    for label, case, computed, exact, difference, thesis in rows:
        run = sphere[1][SPHERE[label], case]
        assert float(computed.split()[0]) == pytest.approx(run["value"], rel=1e-4)
        assert computed.split()[1:] == ([run["unit"]] if run["unit"] else [])
        assert float(exact) == pytest.approx(run["reference"], rel=1e-4)
        assert float(difference.rstrip(" %")) == pytest.approx(100.0 * run["error"], abs=0.006)
        assert (thesis == "") == (run.get("thesis_error") is None)


def test_validation_table(sphere: tuple[str, dict[tuple[str, str], dict[str, Any]]]) -> None:
    """The sphere's rows are those of a run, the others those that were measured.

    Every error follows from its two numbers.
    """
    rows = table(README, "| quantity | ours | source |")
    assert len(rows) == 7
    pressure, displacement, mode, force, seated, peak, march = rows
    numbers = r"-?\d+(?:\.\d+)?(?:e-?\d+)?"
    for row, key in (
        (pressure, ("max_pressure", "F=200 N")),
        (displacement, ("tangential_displacement", "F=200 N T/muN=0.75")),
    ):
        run = sphere[1][key]
        assert float(row[1].split()[0]) == pytest.approx(run["value"], rel=1e-4)
        assert float(row[3].rstrip(" %")) == pytest.approx(100.0 * run["error"], abs=0.006)
    assert mode[1].removesuffix(" Hz") == table(MEASURED, "| mode | computed, Hz |")[2][1]
    assert f"same frequencies on the same mesh to {mode[3]} (C3D20" in " ".join(MEASURED.split())
    ours, theirs = force[1], force[2].split(": ")[1]
    assert f"ours {ours}, CalculiX {theirs} in the limit" in measured(
        "peers-calculix",
        "track_calculix_force",
        "hex8 against C3D8, 12 divisions, surface to surface",
    )
    lowered = measured(
        "peers-calculix_seated",
        "track_calculix_seated_N",
        "hex8 against C3D8, friction 0.6, lowered to 175 N",
    )
    theirs = seated[2].split(": ")[1].removesuffix(" N")
    assert f"ours {seated[1].removesuffix(' N')}, " in lowered
    assert f"CalculiX {theirs}, " in lowered
    theirs = peak[2].split(": ")[1].removesuffix(" m")
    assert (
        f"{peak[1]} at 162.995 Hz with 15 harmonics and 256 samples, printed {theirs}"
        in " ".join(MEASURED.split())
    )
    case = "asymmetric rig, hex20, F_C/F_E 194, harmonics 0 to 9, 402 Hz"
    line = measured("accuracy-response", "error_against_march", case)
    ours_march, march_value = re.findall(rf"({numbers}) against ({numbers})", line)[0]
    assert float(march[1]) == pytest.approx(float(ours_march), rel=1e-5)
    assert float(march[2].split(": ")[1]) == pytest.approx(float(march_value), rel=1e-5)
    for row in (pressure, displacement, force, seated, peak, march):
        a, b = (float(re.findall(numbers, cell.split(": ")[-1])[0]) for cell in row[1:3])
        assert 100.0 * (a / b - 1.0) == pytest.approx(float(row[3].rstrip(" %")), abs=0.008)


#: numbers alone: errors and effects left out are in the runs of other tests
ALONE = {"accuracy": "unknown", "left_out.solve": "no"}


def test_damper_numbers_are_those_of_a_run() -> None:
    for scene in ("symmetric", "asymmetric"):
        first = {"want": ["normal", "stiffness"], "loads.normal": ["opposing"]}
        result = upd.run(scene, overrides=ALONE | first)
        for begins, names in (
            ("K_N, damper held", {"symmetric": ["K_N_secant_raw"], "asymmetric": ["K_N_per_pad"]}),
            (
                "K_T along",
                {
                    "symmetric": ["K_Tx_initial_raw", "K_Ty_initial_raw"],
                    "asymmetric": ["K_Tx_per_pad", "K_Ty_per_pad"],
                },
            ),
        ):
            line = next(
                row
                for row in MEASURED.splitlines()
                if row.startswith(f"| {begins}") and f"| {scene} |" in row
            )
            printed = [float(v) for v in line.split("|")[3].replace("N/mm", "").split("/")]
            ours = [result.value(name) for name in names[scene]]
            assert printed == pytest.approx(ours, rel=5e-3)


def test_rig_numbers_are_those_of_a_run() -> None:
    only = {"want": ["free", "glued"], "modes.arrangements": ["symmetric"]}
    result = upd.run("rig", overrides=ALONE | only)
    rows = table(MEASURED, "| mode | computed, Hz |")
    assert len(rows) == 6
    for mode, computed, thesis, *_ in rows:
        kind, k = mode.split(",")[0].split()
        row = next(r for r in result.rows if r.name == f"f{k}_{kind}")
        assert float(computed) == pytest.approx(row.value, rel=5e-5)
        assert float(thesis) == row.reference
        assert row.error is not None
        assert abs(row.error) < 5e-3


def test_outputs_are_those_the_scenes_know() -> None:
    """An unknown output is answered with the known ones.

    The table names every one of them and no other.
    """
    rows = table(SCENES, "| analysis | output | what it is |")
    contacts = {"contact", "curved contact", "flat contact"}
    for scene, kinds in (
        ("hertz", contacts),
        ("rig", {"rig"}),
        ("symmetric-response", {"forced response"}),
    ):
        with pytest.raises(InputError) as caught:
            upd.load_scene(scene, {"want": ["zzzz"]})
        known = str(caught.value).split("write one of ")[1].split("\n")[0].split(", ")
        assert [output.strip("`") for kind, output, _ in rows if kind in kinds] == known


def test_dimensions_of_the_rig_are_the_recipes() -> None:
    """What the text says was tuned is what the recipe has."""
    from geometry.blade_rig_params import BladeRig

    rig = BladeRig()
    told = " ".join(GEOMETRY.split())
    number = r"([\d.]*\d)"
    words = ("shank length", "mm and thickness", "core length", "thickness", "width")
    found = re.search(
        ", ".join(rf"{w} {number} to {number}" for w in words).replace(", mm", " mm"), told
    )
    assert found is not None
    assert [float(v) for v in found.groups()[1::2]] == [
        rig.shank_length,
        rig.shank_tx,
        rig.core_length,
        rig.core_tx,
        rig.core_wy,
    ]
