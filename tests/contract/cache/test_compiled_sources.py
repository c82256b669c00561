"""What is kept compiled belongs to the sources it was made of, those of other modules included."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from upd.hbm.faces import step as interface_step
from upd.linalg import compiled as room
from upd.linalg.compiled import sources_digest

ROOT = Path(room.__file__).parents[2]
LOOPS = "upd/hbm/faces/period.py"


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ("upd/hbm/faces/period.py", True),
        ("upd/hbm/faces/kept.py", True),
        # two imports away
        ("upd/linalg/compiled.py", True),
        ("upd/hbm/springs/balance.py", False),
    ],
)
def test_a_change_where_loops_come_from_is_told(changed: str, told: bool, tmp_path: Path) -> None:
    for package in ("hbm", "linalg"):
        shutil.copytree(ROOT / "upd" / package, tmp_path / "upd" / package)
    before = sources_digest(tmp_path / LOOPS, tmp_path)
    assert before == sources_digest(ROOT / LOOPS, ROOT)
    with (tmp_path / changed).open("a") as file:
        file.write("# another\n")
    assert (sources_digest(tmp_path / LOOPS, tmp_path) != before) == told


def test_compiled_functions_lie_in_the_folder_of_their_sources(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    folder = room.folder_of.__wrapped__(interface_step.__name__)
    digest = sources_digest(Path(interface_step.__file__), ROOT)[:16]
    assert folder is not None and folder.name == f"step-{digest}"
    assert str(folder) in str(interface_step.judge.stats.cache_path)


def test_a_module_may_lie_outside_the_package(tmp_path: Path) -> None:
    own = tmp_path / "own.py"
    own.write_text("from upd.hbm.faces.step import judge\n")
    before = sources_digest(own, ROOT)
    own.write_text("from upd.hbm.faces.period import touch\n")
    assert sources_digest(own, ROOT) != before


def test_folders_of_older_sources_are_removed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(room, "_ROOT", tmp_path)
    file = tmp_path / "upd" / "one.py"
    file.parent.mkdir()
    file.write_text("import numpy\n")
    monkeypatch.setattr(interface_step, "__file__", str(file))
    first = room.folder_of.__wrapped__(interface_step.__name__)
    other = first.parent / "one_more-0123456789abcdef"
    other.mkdir()
    file.write_text("import numpy as np\n")
    second = room.folder_of.__wrapped__(interface_step.__name__)
    assert first != second and not first.exists() and second.is_dir() and other.is_dir()
