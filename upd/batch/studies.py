"""Studies of a scene: which there are for its analysis, and how one is run."""

from __future__ import annotations

import math
import time
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from upd.analyses import analysis_of
from upd.batch import contact_ladders, response_ladders, rig_ladders, whole_faces
from upd.batch.dask import check_address
from upd.batch.engine import Watcher, Workers, check_numbers, fitting, run_points
from upd.batch.ladder import Ladder, Levels, Study, StudyReport
from upd.batch.parameter_study import PARAMETERS
from upd.batch.store import PointStore
from upd.batch.study_point import SolvedPoint
from upd.cache.sources import source_digest
from upd.errors import InputError
from upd.linalg import select
from upd.scene import AnyScene, load_scene
from upd.units import parse_quantity

#: analysis -> what can be varied
STUDIES: Mapping[str, Mapping[str, Ladder]] = {
    "hertz": contact_ladders.CURVED,
    "flat": {**contact_ladders.FLAT, **PARAMETERS},
    "modal": rig_ladders.MODAL,
    "forced": {**response_ladders.FORCED, **whole_faces.CONTACT},
    "seated": rig_ladders.SEATED,
}
#: analysis -> its scenes in words
_KINDS = {
    "hertz": "a curved contact",
    "flat": "a flat contact",
    "modal": "free vibration",
    "forced": "a forced response",
    "seated": "a seated damper",
}
#: variation -> what a scene that does not offer it lacks
_NOTHING = {
    "harmonics": "no harmonics",
    "samples": "no samples of a period",
    "modes": "no reduction to modes",
    "contacts": "no contact points on springs",
    "contact": "no springs to compare with whole faces",
    "steps": "no load steps or time steps",
    "accuracy": "no mesh that follows from an accuracy",
    "solver": "no choice of solvers to compare",
    "patch": "no patch whose edge is chosen",
    "parameters": "no list of things to move one at a time",
    "dimensions": "no derivatives of frequencies with respect to dimensions",
}
#: analyses of contacts, and the variation that has a meaning for them only where normal and
#: tangential contact are coupled
_CONTACTS, _COUPLED = ("hertz", "flat"), "steps"


@dataclass(frozen=True)
class StudyResult:
    """A finished study.

    Attributes
    ----------
    solved
        Its points with what they gave.
    kept
        Numbers of the points an earlier call had solved.
    seconds
        Of this call.
    """

    study: Study
    solved: tuple[SolvedPoint, ...]
    report: StudyReport
    files: tuple[Path, ...]
    kept: tuple[int, ...]
    seconds: float


def study(
    scene: str | Path | Mapping[str, Any],
    vary: str = "mesh",
    *,
    levels: Sequence[float] | None = None,
    at: float | str | None = None,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    out: str | Path,
    workers: int = 1,
    threads: int | None = None,
    cluster: str = "",
    watch: Watcher | None = None,
) -> StudyResult:
    """Run a study of ``scene``: a ladder of meshes or models, a parameter study, or sensitivities.

    Parameters
    ----------
    vary
        What is varied, one of `variations`.
    levels
        Levels of a ladder, coarse to fine; None for the usual ones.
    at
        The load that is studied: F_C/F_E of a forced response (None: the scene's lowest), the
        normal force of a contact (None: all of the scene's) or F_C of a seated damper, in N or as
        text with a unit.
    out
        Folder; called again with the same one, only missing points run.
    workers
        Points side by side, each in a fresh process; 0: one after the other in this process. With
        more than one, seconds and memory bandwidth are shared: fine for numbers, not for what
        accuracy costs. A script that has any needs ``if __name__ == "__main__":``.
    threads
        Threads of each; None: all there are, divided by the workers; 1 on a cluster.
    cluster
        "local:4" or "tcp://host:port" for Dask.
    watch
        Called with an `upd.batch.engine.Progress`.

    Raises
    ------
    InputError, UpdError
        As `scene_at`, `plan_study` and `run_study` do.

    Examples
    --------
    >>> import upd
    >>> found = upd.study("hertz", "mesh", levels=[8, 12, 16], out="runs/study")    # doctest: +SKIP
    >>> found.solved[0].values["max_pressure", "F=50 N"]                            # doctest: +SKIP
    """
    loaded = scene_at(load_scene(scene, overrides), at)
    planned = plan_study(loaded, vary, None if levels is None else tuple(levels))
    who = study_workers(loaded, planned, workers, threads, cluster)
    return run_study(loaded, planned, Path(out), workers=who, watch=watch)


def variations(scene: Any) -> Mapping[str, Ladder]:
    """What can be varied in the scene."""
    analysis = analysis_of(scene).name
    offered = STUDIES[analysis]
    if analysis in _CONTACTS and not scene.coupled:
        return {vary: ladder for vary, ladder in offered.items() if vary != _COUPLED}
    return offered


def plan_study(scene: AnyScene, vary: str, levels: Levels = None) -> Study:
    """The study of one variation.

    Raises InputError when the scene's analysis has none of that name, and for levels that are none.
    """
    offered = variations(scene)
    if vary not in offered:
        analysis = analysis_of(scene).name
        why = _NOTHING.get(vary, "")
        if analysis in _CONTACTS and vary == _COUPLED:
            why = 'no number that load steps change, unless contact.coupling = "coupled"'
        reason = f"; {_KINDS[analysis]} has {why}" if why else ""
        raise InputError(f"--vary {vary}: choose one of {', '.join(offered)}{reason}")
    return offered[vary].study(scene, vary, levels)


def study_workers(
    scene: AnyScene, planned: Study, workers: int = 1, threads: int | None = None, cluster: str = ""
) -> Workers:
    """Who solves the points.

    By default one fresh process after the other with all threads, so that seconds and memory can be
    compared.

    Parameters
    ----------
    workers, threads, cluster
        As for `study`.

    Raises
    ------
    InputError
        For numbers this machine cannot have, and an address that is none.
    """
    if cluster:
        check_address(cluster)
    alone = workers < 2 and not cluster
    shared = 1 if cluster else max(1, select.threads() // max(workers, 1))
    each = shared if threads is None else threads
    check_numbers(workers, each)
    if threads is None and alone:
        # What a single run takes.
        each = 0
    many = (
        workers
        if alone or cluster
        else fitting(workers, each, len(planned.points), _largest(scene, planned))[0]
    )
    return Workers(many, each, cluster, fresh=True)


def _largest(scene: AnyScene, planned: Study) -> float:
    """Bytes of the largest point."""
    data = tomllib.loads(scene.text)
    found = [0.0]
    for point in planned.points:
        try:
            one = load_scene(data, dict(point.settings))
            found.append(analysis_of(one).make_plan(one).memory_bytes)
        except InputError:
            # It will say so itself, as a point that fails.
            continue
    return max(found)


def run_study(
    scene: AnyScene,
    planned: Study,
    folder: Path,
    *,
    workers: Workers | None = None,
    watch: Watcher | None = None,
) -> StudyResult:
    """Solve the points that ``folder`` does not hold yet, and leave the study's tables and figures
    there.

    A point that fails is a point with its reason. Kill the study at any moment: finished points are
    kept.

    Parameters
    ----------
    workers
        From `study_workers`; None: one fresh process after the other.

    Raises
    ------
    InputError
        Folder, cluster.
    UpdError
        Disk full, cluster gone: what was there stays.
    """
    begin = time.perf_counter()
    who = Workers(threads=0, fresh=True) if workers is None else workers
    store = PointStore(folder, "study")
    code = source_digest(scene.recipe)
    points = tuple(planned.points)
    tasks = [point.task(scene, who.threads, code) for point in points]
    with store.sole():
        known = store.finished(tasks)
        outcomes = run_points(
            tasks,
            store,
            who,
            known=known,
            label=lambda k: f"{points[k].curve} {points[k].label}",
            watch=watch,
        )
        solved = tuple(
            SolvedPoint(point, outcome) for point, outcome in zip(points, outcomes, strict=True)
        )
        report = planned.present(solved)
        with store.writing():
            files = planned.write(folder, solved, report)
    return StudyResult(
        planned, solved, report, tuple(files), tuple(sorted(known)), time.perf_counter() - begin
    )


def scene_at(scene: AnyScene, at: float | str | None) -> AnyScene:
    """The scene at one load.

    Parameters
    ----------
    at
        F_C/F_E of a forced response; the normal force of a contact, or F_C of a seated damper: N
        as a number, or text with a unit. None: the scene as it is.

    Raises
    ------
    InputError
        For what is no such load, a scene without one, and one that does not take it.
    """
    if at is None:
        return scene
    analysis = analysis_of(scene).name
    if analysis == "modal":
        raise InputError(
            f"--at {at}: free vibration has no load to choose; leave it out, or study a forced "
            "response"
        )
    settings = _ratio(scene, at) if analysis == "forced" else _force(analysis, at)
    try:
        changed: AnyScene = load_scene(tomllib.loads(scene.text), settings)
    except InputError as problem:
        raise InputError(f"--at {at}: the scene does not take it: {problem}") from None
    return changed


def _ratio(scene: Any, at: float | str) -> dict[str, Any]:
    try:
        ratio = float(at)
    except ValueError:
        ratio = math.nan
    if not 0.0 < ratio < math.inf:
        raise InputError(
            f"--at {at}: a forced response is studied at one F_C/F_E; write a positive number "
            "without a unit, for example --at 194"
        )
    return {
        "excitation.centrifugal_to_force": [ratio],
        **({"excitation.force": []} if scene.excitation.force else {}),
    }


def _force(analysis: str, at: float | str) -> dict[str, Any]:
    try:
        force = float(at)
    except ValueError:
        try:
            force = float(parse_quantity(at, "force"))
        except InputError:
            force = math.nan
    if not 0.0 < force < math.inf:
        of = "F_C of a seated damper" if analysis == "seated" else "the normal force of a contact"
        raise InputError(
            f'--at {at}: chooses {of}; write a positive force, for example --at "200 N"'
        )
    text = f"{force!r} N"
    return {"damper.centrifugal": text} if analysis == "seated" else {"loads.normal": [text]}
