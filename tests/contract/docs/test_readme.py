"""The README's Python example prints what the README says, and no placeholder is left."""

import re
from pathlib import Path

import pytest

README = Path(__file__).resolve().parents[3] / "README.md"


def test_no_placeholders_and_pictures_exist() -> None:
    text = README.read_text(encoding="utf-8")
    assert "@@" not in text
    for picture in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", text):
        assert (README.parent / picture).is_file(), picture


def test_example_prints_its_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    code = re.search(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    assert code is not None
    promised = re.findall(r"print\(.*\)\s*# (.+)", code[1])
    exec(compile(code[1], "README.md", "exec"), {})
    assert capsys.readouterr().out.split("\n")[:-1] == promised


def test_tables_are_those_of_a_run() -> None:
    import upd

    rows = {(r.name, r.case): r for r in upd.run("hertz").rows}
    text = README.read_text(encoding="utf-8")
    for label, name in (("maximum pressure", "max_pressure"), ("approach, raw", "approach"), ("K_T / K_N", "K_T_over_K_N")):
        for case in ("F=50 N", "F=200 N"):
            line = next(line for line in text.splitlines() if line.startswith(f"| {label} | {case} |"))
            printed = float(line.split("|")[3].split()[0])
            assert printed == pytest.approx(rows[name, case].value, rel=1e-4)


def test_damper_numbers_are_those_of_a_run() -> None:
    import upd

    text = README.read_text(encoding="utf-8")
    for scene in ("symmetric", "asymmetric"):
        result = upd.run(scene, overrides={"want": ["normal", "stiffness"]})
        for begins, names in (("K_N, damper held", ["K_N_secant_raw"]), ("K_T along", ["K_Tx_initial_raw", "K_Ty_initial_raw"])):
            line = next(row for row in text.splitlines() if row.startswith(f"| {begins}") and f"| {scene} |" in row)
            printed = [float(v) for v in line.split("|")[3].replace("N/mm", "").split("/")]
            assert printed == pytest.approx([result.value(name) for name in names], rel=5e-3)


def test_rig_numbers_are_those_of_a_run() -> None:
    import upd

    text = README.read_text(encoding="utf-8")
    result = upd.run("rig", overrides={"want": ["free", "glued"], "modes.arrangements": ["symmetric"]})
    for kind in ("free", "glued"):
        for k in range(1, 5):
            line = next(row for row in text.splitlines() if row.startswith(f"| {kind} {k}, "))
            row = next(r for r in result.rows if r.name == f"f{k}_{kind}")
            computed, thesis = (float(cell) for cell in line.split("|")[2:4])
            assert computed == pytest.approx(row.value, rel=5e-5)
            assert thesis == row.reference
            assert row.error is not None
            assert abs(row.error) < 5e-3
