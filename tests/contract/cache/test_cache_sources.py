"""One digest of the sources: a change of any of them, of a recipe or of a library makes another."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from upd.cache import sources

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("copy")
    for package in ("upd", "geometry"):
        shutil.copytree(
            ROOT / package, root / package, ignore=shutil.ignore_patterns("__pycache__")
        )
    return root


#: without what was read before
fresh_digest = sources.digest_of.__wrapped__


def test_every_source_counts(copy: Path) -> None:
    files = sorted(
        file for package in ("upd", "geometry") for file in (copy / package).rglob("*.py")
    )
    before = fresh_digest(copy)
    # every file is read in one way: some of them show it
    for file in files[:: len(files) // 12]:
        text = file.read_bytes()
        file.write_bytes(text + b"\n")
        assert fresh_digest(copy) != before, file
        file.write_bytes(text)
    assert fresh_digest(copy) == before


def test_a_new_or_renamed_source_counts(copy: Path) -> None:
    before = fresh_digest(copy)
    other = copy / "upd" / "fem" / "another.py"
    (copy / "upd" / "fem" / "inertia.py").rename(other)
    assert fresh_digest(copy) != before
    other.rename(copy / "upd" / "fem" / "inertia.py")


def test_recipe_and_libraries_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recipe = tmp_path / "mine.py"
    recipe.write_text("a = 1\n")
    before, ready = sources.source_digest(str(recipe)), sources.source_digest("sphere_block")
    assert before != ready
    recipe.write_text("a = 2\n")
    assert sources.source_digest(str(recipe)) != before
    # read once per process: a fresh look, and none of it left behind
    monkeypatch.setattr(sources, "library_versions", sources.library_versions.__wrapped__)
    assert sources.source_digest("sphere_block") == ready
    monkeypatch.setattr(sources, "version_of", lambda _: "0.0")
    assert sources.source_digest("sphere_block") != ready
