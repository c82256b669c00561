"""Compiled functions whose files are damaged, or cannot be written, are compiled again."""

from __future__ import annotations

import errno
import importlib.util
import os
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest
from numba.core.caching import FunctionCache, IndexDataCacheFile

from upd.linalg import compiled as room

SOURCE = """
from upd.linalg.compiled import compiled

@compiled
def twice(x):
    return x + x
"""


@pytest.fixture
def load(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], ModuleType]:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kept"))
    monkeypatch.setattr("numba.config.CACHE_DIR", str(tmp_path / "kept"))
    room.warn_not_kept.cache_clear()
    file = tmp_path / "own_loops.py"
    file.write_text(SOURCE)

    def fresh() -> ModuleType:
        spec = importlib.util.spec_from_file_location("own_loops", file)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    return fresh


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
@pytest.mark.parametrize("content", [b"", b"\x80\x05damaged", b"not pickled"])
def test_a_damaged_file_is_replaced(
    suffix: str, content: bytes, load: Callable[[], ModuleType], tmp_path: Path
) -> None:
    assert load().twice(2.0) == 4.0
    again = load()
    assert again.twice(2.0) == 4.0 and sum(again.twice.stats.cache_hits.values()) == 1
    [file] = (tmp_path / "kept").rglob(f"*{suffix}")
    file.write_bytes(content)
    mended = load()
    assert mended.twice(2.0) == 4.0 and not mended.twice.stats.cache_hits
    again = load()
    assert again.twice(2.0) == 4.0 and sum(again.twice.stats.cache_hits.values()) == 1


def test_a_full_disk_stops_nothing(
    load: Callable[[], ModuleType],
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(IndexDataCacheFile, "save", full)
    module = load()
    assert module.twice(2.0) == 4.0 and module.twice(2) == 4
    [record] = caplog.records
    assert "No space left on device" in record.message and "NUMBA_CACHE_DIR" in record.message


def test_no_folder_at_all_stops_nothing(
    load: Callable[[], ModuleType],
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    def nowhere(*_: object) -> None:
        raise RuntimeError("cannot cache function: no locator available")

    monkeypatch.setattr(FunctionCache, "__init__", nowhere)
    assert room.kept_in("own_loops") is None
    assert load().twice(2.0) == 4.0
    assert load().twice(2.0) == 4.0
    [record] = caplog.records
    assert "NUMBA_CACHE_DIR" in record.message
