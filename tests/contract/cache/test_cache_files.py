"""Files appear whole or not at all, nothing is left beside them, and locks hold between
processes.
"""

from __future__ import annotations

import multiprocessing
from pathlib import Path

import pytest

from upd.cache.files import locked, whole_file, whole_files, write_text
from upd.results import Group, read_netcdf, variable, write_netcdf


class StopError(Exception):
    pass


def test_a_file_that_fails_half_way_leaves_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    write_text(path, "old")
    with pytest.raises(StopError), whole_file(path) as temporary:
        temporary.write_text("half of the ne")
        raise StopError
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_in_writing_is_not_seen_under_its_name(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    with whole_file(path) as temporary:
        temporary.write_text("new")
        assert not path.exists()
        assert temporary.suffix == ".txt"
    assert path.read_text() == "new"


def test_arrays_that_cannot_be_written_leave_the_old_ones(tmp_path: Path) -> None:
    path = tmp_path / "result.nc"
    write_netcdf(path, {"a": Group({"x": variable("n", [1.0])})})
    with pytest.raises(TypeError):
        write_netcdf(path, {"a": Group({"x": variable("n", [2.0]), "y": variable("", object())})})
    assert read_netcdf(path)["a"]["x"].data.tolist() == [1.0]
    assert list(tmp_path.iterdir()) == [path]


def test_several_files_come_together_or_not_at_all(tmp_path: Path) -> None:
    folder = tmp_path / "new"
    with pytest.raises(StopError), whole_files(folder) as stage:
        (stage / "a").write_text("a")
        raise StopError
    assert not folder.exists()
    folder.mkdir()
    (folder / "a").write_text("old")
    (folder / "b").mkdir()  # a folder in the way of the second file
    with pytest.raises(OSError, match="b"), whole_files(folder) as stage:
        (stage / "a").write_text("new")
        (stage / "b").write_text("new")
    assert (folder / "a").read_text() == "old"
    assert sorted(f.name for f in folder.iterdir()) == ["a", "b"]


def _try(path: str, answer: multiprocessing.Queue) -> None:  # type: ignore[type-arg]
    try:
        with locked(Path(path), wait=False):
            answer.put("held")
    except BlockingIOError:
        answer.put("refused")


def test_a_lock_holds_against_another_process_and_ends(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")

    def other() -> str:
        answer = context.Queue()
        process = context.Process(target=_try, args=(str(tmp_path / "x" / ".lock"), answer))
        process.start()
        found: str = answer.get(timeout=60)
        process.join()
        return found

    with locked(tmp_path / "x" / ".lock"):
        assert other() == "refused"
    assert other() == "held"
