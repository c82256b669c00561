"""Run a scene: plan, solve, check, and leave a run folder behind."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from importlib import import_module
from pathlib import Path
from typing import Any

from upd.analyses import analysis_of, make_plan
from upd.analyses.base import Analysis, Plan
from upd.cache.files import write_text
from upd.cache.folders import OwnFolder, own_folder
from upd.cache.sources import versions
from upd.errors import ConvergenceError, InputError, UpdError, disk_fault, one_line
from upd.labels import check_words
from upd.progress import Listener, Stages, forget_peak, silent
from upd.report import write_report
from upd.report.folder import check_replaceable, is_run_file, sealed
from upd.report.notebook import RunResult, write_curves, write_figures
from upd.results import Check, Estimates, Result, write_netcdf
from upd.results.check import FAILED, OK, WARNED, status_of, worst_check
from upd.results.netcdf import DIGEST, file_digest
from upd.results.number import InputParts, with_estimates
from upd.scene import AnyScene, as_scene
from upd.scene.keys import scene_as_run
from upd.vary.inputs import input_parts

log = logging.getLogger("upd")


def run(
    scene: AnyScene | str | Path | Mapping[str, Any],
    *,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    out: str | Path | None = None,
    numbered: bool = False,
    report: bool = True,
    progress: Listener = silent,
) -> RunResult:
    """Run a scene and return its result.

    Parameters
    ----------
    scene
        A loaded scene, a ready name, a .toml path or a mapping.
    overrides
        "path=value" texts, or a mapping path -> value.
    out
        Run folder to write; None writes nothing. It is written beside its place under a name of
        its own and moved there whole at the end. An earlier run's folder is replaced whole.
    numbered
        Take ``out``-2, ``out``-3 and so on when ``out`` is there or another run is writing it.
    report
        Leave report.html in the run folder, made last and from what lies there.
    progress
        Called at the beginning and the end of every stage.

    Raises
    ------
    InputError
        For a bad scene, and a folder that another run is writing or that holds other things than a
        run: nothing is written.
    ConvergenceError
        When a solver or a self-check fails: the run folder then holds the log and what converged.
    UpdError
        When the disk does not take the numbers or their arrays.
    """
    loaded = as_scene(scene, overrides)
    plan = make_plan(loaded)
    plan.refuse_oversize()
    forget_peak()
    stages = Stages(progress)
    packages = "versions: " + ", ".join(f"{name} {one}" for name, one in versions().items())
    if out is None:
        log.info(packages)
        return _solved(plan, stages, None)
    own, handler = _begin(Path(out), numbered, loaded)
    if own.replaces:
        progress("folder", f"replaces the earlier run in {own.place}", 0.0)
    log.info(packages)
    # matplotlib takes a while to import: meanwhile the solver computes.
    threading.Thread(target=import_module, args=("upd.plot.matplotlib",), daemon=True).start()
    try:
        result = _solved(plan, stages, own)
        if report:
            result = _leave_report(own, result, stages)
    except BaseException as error:
        if report:
            _leave_report(own, None, stages)
        complete = isinstance(error, UpdError) and error.result is not None
        if own.replaces and not (complete and (own.path / "result.nc").exists()):
            # Half a run takes the place of none that was whole.
            stays = own.step_aside()
            progress("folder", f"the earlier run in {stays} stays; this one: {own.place}", 0.0)
        place = _end(own, handler)
        if isinstance(error, UpdError):
            error.folder = place
            if error.result is not None:
                error.result = replace(error.result, folder=place)
        raise
    return replace(result, folder=_end(own, handler))


def _leave_report(own: OwnFolder, result: Any, stages: Stages) -> Any:
    """Write the page; the result, with the fault when there is none."""
    try:
        with stages("report", str(own.place / "report.html")):
            write_report(own.path)
    except Exception as error:
        # The numbers are on disk: a page that fails must not hide how the run itself ended.
        log.exception("report.html was not written")
        if result is not None:
            result = _with_fault(result, f"report.html not written ({one_line(error)})", own.path)
    return result


def _with_fault(result: RunResult, fault: str, folder: Path) -> RunResult:
    """The result with a fault of its pictures in its status, in summary.json too where the disk
    takes it.
    """
    status = f"{WARNED}: {fault}" if result.status == OK else f"{result.status}; {fault}"
    result = replace(result, status=status, faults=(*result.faults, fault))
    with suppress(OSError):
        _write_summary(result, folder)
    return result


def _solved(plan: Plan[Any], stages: Stages, own: OwnFolder | None) -> RunResult:
    """Solve and check; the result, with what the run folder then holds.

    An error leaves what converged in the folder.
    """
    analysis = analysis_of(plan.scene)
    try:
        solution = analysis.solve(plan, stages)
    except BaseException as error:
        if isinstance(error, UpdError):
            log.error("failed: %s", error)
            status = f"failed: {error}"
        else:
            log.exception("stopped")
            status = f"stopped: {type(error).__name__}"
        if own is not None:
            partial, estimates = (getattr(error, name, None) for name in ("partial", "estimates"))
            result = _collected(plan, partial, status, (), estimates or {}, stages)
            _leave(own, result, plan, partial, stages)
        raise
    with stages("self-checks"):
        checks = analysis.check_solution(solution)
    failed = [c for c in checks if not c.passed and c.fatal]
    result, fault = _collected(solution.plan, solution, "", checks, None, stages), ""
    if own is not None:
        result, fault = _leave(own, result, plan, solution, stages)
    if result.outcome != FAILED:
        return result
    log.error(result.status)
    kind: type[UpdError] = UpdError if fault else ConvergenceError
    text = fault or result.status.removeprefix("failed: ")
    if failed and not fault:
        kind = InputError if all(c.name in analysis.input_checks for c in failed) else kind
        text = "\n".join(["self-check failed", *(c.sentence for c in failed)])
    failure = kind(text)
    failure.result = result
    raise failure


def _collected(
    plan: Plan[Any],
    solution: Any,
    status: str,
    checks: Sequence[Check],
    estimates: Estimates | None,
    stages: Stages,
) -> RunResult:
    """The result of a run.

    Parameters
    ----------
    solution
        None where nothing converged.
    status
        "" derives it from checks and results.
    estimates
        Errors of the numbers of a run that failed; None: they are estimated.
    """
    analysis = analysis_of(plan.scene)
    with stages("numbers"):
        arrays = analysis.arrays(solution) if solution is not None else {}
        made = analysis.make_results(solution) if solution is not None else ()
    results = tuple(map(_reached, made))
    errors: Estimates = estimates or {}
    inputs: InputParts = {}
    if estimates is None:
        if solution.plan.scene.estimates:
            errors = analysis.estimate(solution, results, stages)
        inputs = input_parts(analysis, solution, results, stages)
    results = with_estimates(results, errors, inputs)
    return RunResult(
        scene=plan.scene.name,
        title=plan.scene.title,
        status=status or status_of(checks, results),
        results=results,
        effects=tuple(_effects(plan, checks)),
        checks=tuple(checks),
        size=_size(analysis, plan, solution)
        | {"analysis": analysis.name, "mesh": dict(plan.parameters), "solver": dict(plan.solver)},
        arrays=arrays,
        scene_text=scene_as_run(plan.scene),
        cost=stages.cost(),
    )


def _leave(
    own: OwnFolder, result: RunResult, plan: Plan[Any], solution: Any, stages: Stages
) -> tuple[RunResult, str]:
    """Write the run folder, numbers first and pictures last.

    Returns
    -------
    RunResult, str
        The result, and what the disk did not take of numbers, arrays and meshes; "" when all is
        there. Pictures that are missing stand in the status.
    """
    folder, place = own.path, own.place
    result = replace(result, folder=place)
    try:
        _write_summary(result, folder)
        if solution is not None:
            with stages("files", str(place)):
                write_netcdf(folder / "result.nc", result.arrays)
                write_curves(result.arrays, folder)
                analysis_of(plan.scene).write_files(solution, folder)
    except (OSError, UpdError) as error:
        if disk_fault(error) is None:
            raise
        fault = (
            f"the run folder {place} cannot be written to the end ({one_line(error)}): make room "
            "and run the scene again"
        )
        if (folder / "summary.json").is_file():
            fault += "; the numbers are in summary.json there"
        result = replace(result, status=f"{FAILED}: {fault}")
        with suppress(OSError):
            _write_summary(result, folder)
        return result, fault
    if solution is None:
        return result, ""
    try:
        with stages("figures", str(place)):
            write_figures(result, folder)
    except Exception as error:
        log.exception("figures were not written")
        result = _with_fault(result, f"figures not written ({one_line(error)})", folder)
    result = replace(result, cost=stages.cost())
    with suppress(OSError):
        # The one written first has all but the seconds of the files.
        _write_summary(result, folder)
    return result, ""


def _reached(one: Result) -> Result:
    """The number; one that is not finite is withheld: nothing that looks like a value stands."""
    if one.withheld or math.isfinite(one.value):
        return one
    return replace(one, value=math.nan, withheld=f"it came out as {one.value}, which is no number")


def _write_summary(result: RunResult, folder: Path) -> None:
    arrays = folder / "result.nc"
    digest = {DIGEST: file_digest(arrays)} if arrays.is_file() else {}
    write_text(folder / "summary.json", sealed(result.summary() | digest))


def _effects(plan: Plan[Any], checks: Sequence[Check]) -> list[dict[str, Any]]:
    entries = [c.as_dict() for c in checks]
    out = []
    for effect in plan.effects:
        mine = [c for c in entries if effect.check and c["name"] == effect.check]
        verdict = ""
        if not effect.on and effect.applies and not mine:
            verdict = "not measured" if plan.scene.left_out.solves else "not solved again"
        if mine:
            worst = worst_check(mine)
            verdict = f"{worst['verdict']}: {check_words(worst)}"
        out.append(asdict(effect) | {"switch": list(effect.switch), "verdict": verdict})
    return out


def _size(analysis: Analysis, plan: Plan[Any], solution: Any) -> dict[str, Any]:
    size: dict[str, Any] = {"symmetry": plan.symmetry, "n_dof": {}, "n_hex": {}, "n_pairs": None}
    for body, count in plan.size.items():
        size["n_dof"][body] = 3 * count["nodes"]
        size["n_hex"][body] = count["hexes"]
    return size if solution is None else size | analysis.sizes(solution)


def _begin(place: Path, numbered: bool, scene: AnyScene) -> tuple[OwnFolder, logging.Handler]:
    """Take a folder, write the scene and open the log."""
    own = None
    try:
        own = own_folder(place, check=check_replaceable, ours=is_run_file, number=numbered)
        write_text(own.path / "scene.toml", scene_as_run(scene))
        handler = logging.FileHandler(own.path / "run.log", mode="w", encoding="utf-8")
    except OSError as error:
        if own is not None:
            place = own.place
            own.drop()
        raise InputError(
            f"the run folder {place} cannot be written ({one_line(error)}): choose another with "
            "--out"
        ) from None
    # on a full disk it loses lines without a word: the run itself reports its disk
    handler.handleError = lambda record: None  # type: ignore[method-assign]
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)-7s %(name)s: %(message)s"))
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    return own, handler


def _end(own: OwnFolder, handler: logging.Handler) -> Path:
    """Close the log and put the folder into its place."""
    log.removeHandler(handler)
    with suppress(OSError):
        handler.close()
    return own.move_in()
