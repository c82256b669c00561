"""The wheel: what it installs, and that it runs elsewhere, without the checkout."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.full

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps"]
    subprocess.run([*pip, "-w", str(folder), str(ROOT)], check=True)
    (file,) = folder.glob("*.whl")
    return file


def test_it_installs_one_package(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    tops = {name.partition("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"upd"}
    for needed in (
        "upd/geometry/sphere_block.py",
        "upd/scenes/hertz.toml",
        "upd/scenes/examples/own_damper.py",
        "upd/report/parts/page.html.j2",
        "upd/py.typed",
    ):
        assert needed in names
    assert not any("__pycache__" in name or name.startswith("upd/manual") for name in names)


@pytest.mark.parametrize("version", ["3.11", "3.12", "3.13"])
def test_it_runs_elsewhere(wheel: Path, tmp_path: Path, version: str) -> None:
    """In a fresh environment, from another folder: a scene, a recipe of one's own, the doctor."""
    python = shutil.which(f"python{version}")
    if python is None or subprocess.run([python, "-V"], check=False).returncode:
        pytest.skip(f"Python {version} is not installed")
    subprocess.run([python, "-m", "venv", tmp_path / "env"], check=True)
    bin_ = tmp_path / "env" / "bin"
    pins = ROOT / ".constraints.txt"
    subprocess.run([bin_ / "pip", "install", "-q", "-c", pins, wheel], check=True)
    work = tmp_path / "work"
    work.mkdir()
    examples = ROOT / "upd" / "scenes" / "examples"
    for name in ("own_damper.toml", "own_damper.py"):
        (work / name).write_bytes((examples / name).read_bytes())
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL"))}
    clean = kept | {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    for command in (["run", "hertz"], ["run", "own_damper.toml"], ["doctor"]):
        found = subprocess.run(
            [bin_ / "upd", *command], cwd=work, env=clean, capture_output=True, text=True
        )
        assert found.returncode == 0, found.stderr
    assert (work / "runs" / "hertz" / "report.html").is_file()
