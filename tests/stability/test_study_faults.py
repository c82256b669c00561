"""Studies under faults: the same engine as sweeps, so the same promises.

No point lost, none solved twice, the same numbers anywhere.
"""

from __future__ import annotations

import errno
import json
import os
from multiprocessing import active_children
from pathlib import Path
from typing import Any

import pytest

from upd import load_scene
from upd.batch import store as point_store
from upd.batch.engine import ATTEMPTS, Progress, Workers
from upd.batch.studies import Study, plan_study, run_study, study
from upd.errors import InputError, UpdError
from upd.vary.ladder import StudyReport
from upd.vary.variation import Variation

pytestmark = pytest.mark.usefixtures("without_pictures")

TINY = {
    "geometry.divisions": 8,
    "want": ["normal"],
    "loads.normal": ["200 N"],
    "geometry.core_depth": 0.2,
    "left_out.solve": "no",
}
LEVELS = (6, 8, 10)

RECIPE = """
import os, signal
from pathlib import Path
from geometry import sphere_block

CLOSED_FORM = sphere_block.CLOSED_FORM
count = sphere_block.count


def build(params: sphere_block.SphereBlock):
    once, mended = Path({once!r}), Path({mended!r})
    if params.divisions > 11 and not mended.exists() or params.divisions > 9 and not once.exists():
        once.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return sphere_block.build(params)
"""


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("UPD_CACHE", str(tmp_path / "cache"))


def numbers(folder: Path) -> list[dict[str, Any]]:
    """Points and curves of study.json without what nobody can repeat: seconds and memory."""
    written = json.loads((folder / "study.json").read_text(encoding="utf-8"))
    taken = ("seconds", "memory_mb", "stages")
    # As text: nan is not equal to itself.
    return [
        {k: str(v) for k, v in entry.items() if k not in taken}
        for entry in (*written["points"], *written["curves"])
    ]


@pytest.fixture(scope="module")
def quiet(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    """The numbers when nothing happens, solved in this process with one thread."""
    folder = tmp_path_factory.mktemp("quiet")
    study("hertz", "mesh", levels=LEVELS, overrides=TINY, out=folder, workers=0, threads=1)
    return numbers(folder)


@pytest.mark.parametrize(
    "who",
    [
        pytest.param({"workers": 1}, id="fresh", marks=pytest.mark.full),
        pytest.param({"workers": 2}, id="side by side"),
    ],
)
def test_ladder_gives_the_same_numbers_whoever_solves_it(
    tmp_path: Path, quiet: list[dict[str, Any]], who: dict[str, Any]
) -> None:
    found = study(
        "hertz", "mesh", levels=LEVELS, overrides=TINY, out=tmp_path / "s", threads=1, **who
    )
    assert numbers(tmp_path / "s") == quiet
    processes = {one.outcome.where for one in found.solved}
    assert f":{os.getpid()}" not in {where[where.index(":") :] for where in processes}
    assert len(processes) == len(LEVELS)
    # nothing is taken from other points: a study measures
    assert not any(one.outcome.shared for one in found.solved)
    assert found.solved[0].outcome.memory_mb > 50.0
    assert not active_children()


@pytest.mark.parametrize(
    "who",
    [
        # of every day: `test_sweep_faults`, on the same engine
        pytest.param({"workers": 1}, id="fresh", marks=pytest.mark.full),
    ],
)
def test_points_that_kill_their_workers(tmp_path: Path, who: dict[str, Any]) -> None:
    """Killed once: run again.

    Killed always: a point with its reason, tried again by the next call.
    """
    recipe = tmp_path / "deadly.py"
    recipe.write_text(
        RECIPE.format(once=str(tmp_path / "once"), mended=str(tmp_path / "mended")),
        encoding="utf-8",
    )
    scene = {**TINY, "geometry.recipe": str(recipe)}
    found = study(
        "hertz", "mesh", levels=(8, 10, 12), overrides=scene, out=tmp_path / "s", threads=1, **who
    )
    assert (tmp_path / "once").exists()
    assert [bool(one.outcome.failure) for one in found.solved] == [False, False, True]
    assert f"killed {ATTEMPTS} times" in found.solved[2].outcome.failure
    assert f"killed {ATTEMPTS} times" in (tmp_path / "s" / "study.md").read_text(encoding="utf-8")
    assert len(list((tmp_path / "s" / "points").iterdir())) == 2
    (tmp_path / "mended").touch()
    again = study(
        "hertz",
        "mesh",
        levels=(8, 10, 12),
        overrides=scene,
        out=tmp_path / "s",
        workers=0,
        threads=1,
    )
    assert again.kept == (0, 1)
    assert not any(one.outcome.failure for one in again.solved)


def test_two_studies_in_one_folder_are_refused(tmp_path: Path) -> None:
    pytest.importorskip("fcntl")
    refused = []

    def second(progress: Progress) -> None:
        with pytest.raises(
            InputError, match=r"another study is running in .* choose another folder with --out"
        ):
            study("hertz", "mesh", levels=(6, 8), overrides=TINY, out=tmp_path, workers=0)
        refused.append(progress)

    study("hertz", "mesh", levels=(6, 8), overrides=TINY, out=tmp_path, workers=0, watch=second)
    assert refused


def test_folder_that_cannot_be_written_is_refused_before_anything_is_solved(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=r"the study folder .* cannot be written.*--out"):
        study("hertz", "mesh", levels=(6, 8), overrides=TINY, out=tmp_path / "file", workers=0)
    assert (tmp_path / "file").read_text(encoding="utf-8") == "mine"


def test_disk_full_in_mid_study_is_one_clear_error_and_keeps_what_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[str] = []
    real = point_store.write_text

    def full(path: Path, text: str) -> None:
        if path.suffix == ".json" and written:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(path, text)
        written.extend([path.name] if path.suffix == ".json" else [])

    with monkeypatch.context() as patch:
        patch.setattr(point_store, "write_text", full)
        with pytest.raises(
            UpdError, match=r"No space left on device.*finished points are kept.*the same study"
        ):
            study("hertz", "mesh", levels=(6, 8), overrides=TINY, out=tmp_path, workers=0)
    assert [path.name for path in (tmp_path / "points").iterdir()] == written
    assert study("hertz", "mesh", levels=(6, 8), overrides=TINY, out=tmp_path, workers=0).kept == (
        0,
    )


#: a study of one's own: points that fail in other ways than an analysis does
ODD = Study(
    "odd",
    (
        Variation("odd", "unknown key", (("contact.fricton", 0.3),)),
        Variation("odd", "as given", ()),
    ),
    lambda solved: StudyReport((), True),
)


def test_a_point_the_scene_does_not_allow_is_a_row_and_not_the_end(tmp_path: Path) -> None:
    scene = load_scene("hertz", TINY)
    found = run_study(scene, ODD, tmp_path, workers=Workers(0, 1))
    assert "did you mean 'friction'" in found.solved[0].outcome.failure
    assert found.solved[1].outcome.failure == ""
    assert run_study(scene, ODD, tmp_path, workers=Workers(0, 1)).kept == (0, 1)


def test_other_code_solves_its_own_points(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Points of other sources are not found.

    a worker with other sources ends the study instead of mixing numbers.
    """
    from upd.batch import studies

    scene = load_scene("hertz", TINY)
    planned = plan_study(scene, "mesh", (6, 8))
    run_study(scene, planned, tmp_path, workers=Workers(0, 1))
    monkeypatch.setattr(studies, "source_digest", lambda recipe: "0" * 64)
    with pytest.raises(InputError, match="different codes"):
        run_study(scene, planned, tmp_path, workers=Workers(0, 1))
