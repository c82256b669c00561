"""Journals of long searches: read again as far as they go, removed at the end."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from upd.cache.arrays import Journal


def test_a_journal_cut_short_is_read_as_far_as_it_goes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("UPD_CACHE", str(tmp_path))
    first = Journal("fit-a")
    first.keep([[0.1, 1.0 / 3.0], math.nan])
    with first.path.open("a", encoding="utf-8") as file:
        file.write("[[0.3")
    ((numbers, unknown),) = Journal("fit-a").lines
    assert numbers == [0.1, 1.0 / 3.0]
    assert math.isnan(unknown)
    first.done()
    assert not Journal("fit-a").lines
    assert not list(tmp_path.iterdir())


def test_a_journal_that_cannot_be_read_or_kept_costs_no_more_than_its_lines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("UPD_CACHE", str(tmp_path / "file"))
    Journal("fit-a").keep([1.0])
    assert "not kept" in caplog.text
    monkeypatch.setenv("UPD_CACHE", str(tmp_path))
    (tmp_path / "fit-a.jsonl").write_bytes(b"\xff\xfe")
    assert not Journal("fit-a").lines
    assert "cannot be read" in caplog.text
