"""Run a scene: plan, solve, check, and leave a run folder behind."""

from __future__ import annotations

import logging
import platform
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from importlib import import_module, metadata
from pathlib import Path
from typing import Any

from upd import __version__
from upd.analyses import Analysis, analysis_of, make_plan
from upd.errors import ConvergenceError, InputError, UpdError
from upd.linalg.select import memory_left
from upd.plan import AnyPlan
from upd.progress import Listener, Stages, silent
from upd.results import Check, Row, RunResult, write_netcdf, write_summary, write_text
from upd.scene import AnyScene, ForcedScene, RigScene, Scene, load_scene
from upd.study.accuracy import Estimates, choose, predicted_plan

log = logging.getLogger("upd")


def run(
    scene: AnyScene | str | Path | Mapping[str, Any],
    *,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    out: str | Path | None = None,
    report: bool = True,
    progress: Listener = silent,
) -> RunResult:
    """Run ``scene`` (a Scene, a ready name, a .toml path or a mapping) and return its result.

    out      : run folder to write (made when missing); None writes nothing.
    report   : leave report.html in the run folder, made last and from what lies there.
    progress : called at the beginning and the end of every stage.

    Raises InputError for a bad scene (nothing is written) and ConvergenceError when a solver or a self-check fails: the run folder then
    holds the log and what converged.
    """
    if isinstance(scene, (Scene, RigScene, ForcedScene)):
        if overrides:
            raise InputError("overrides: the scene is loaded already; give them to load_scene")
        loaded: AnyScene = scene
    else:
        loaded = load_scene(scene, overrides)
    return _run_scene(loaded, None if out is None else Path(out), progress, report=report)


def _run_scene(scene: AnyScene, out: Path | None, progress: Listener, *, report: bool) -> RunResult:
    analysis = analysis_of(scene)
    by_accuracy = isinstance(scene, Scene) and scene.mesh.accuracy is not None
    plan: AnyPlan[Any] = predicted_plan(scene) if by_accuracy else make_plan(scene)  # type: ignore[arg-type]
    refuse_oversize(plan)
    folder = None if out is None else _make_folder(out, analysis, scene)
    handler = _log_to(folder)
    log.info("versions: %s", ", ".join(f"{name} {version}" for name, version in versions().items()))
    stages = Stages(progress)
    if folder is not None:
        # matplotlib takes a while to import: meanwhile the solver computes.
        threading.Thread(target=import_module, args=(f"{analysis.__name__}.plots",), daemon=True).start()
    try:
        return _run(analysis, scene, plan, stages, folder)
    finally:
        if folder is not None and report:
            _write_report(folder, stages)
        if handler is not None:
            log.removeHandler(handler)
            handler.close()


def _write_report(folder: Path, stages: Stages) -> None:
    # Templates and charts are slow to import: only when a page is made.
    from upd.report import write_report

    try:
        with stages("report", str(folder / "report.html")):
            write_report(folder)
    except Exception:
        # The numbers are on disk: a page that fails must not hide how the run itself ended.
        log.exception("report.html was not written")


def versions() -> dict[str, str]:
    """Versions of what computes: Python, this package and the libraries under it."""
    out = {"upd": __version__, "python": platform.python_version()}
    for package in _VERSIONED:
        with suppress(metadata.PackageNotFoundError):
            out[package] = metadata.version(package)
    return out


def _run(analysis: Analysis, scene: AnyScene, plan: AnyPlan[Any], stages: Stages, folder: Path | None) -> RunResult:
    estimates: Estimates = {}
    try:
        if isinstance(scene, Scene) and scene.mesh.accuracy is not None:
            level, estimates = choose(scene, lambda p: _level(analysis, p, stages))
            plan, solution = level.plan, level.solved
        else:
            solution = analysis.solve(plan, stages)
    except UpdError as error:
        log.error("failed: %s", error)
        if folder is not None:
            _leave(analysis, plan, error.partial, stages, folder, f"failed: {error}")
        raise
    except BaseException as error:
        log.exception("stopped")
        if folder is not None:
            _leave(analysis, plan, getattr(error, "partial", None), stages, folder, f"stopped: {type(error).__name__}")
        raise
    checks = analysis.check_solution(solution)
    failed = [c for c in checks if not c.passed and c.fatal]
    status = "ok" if not failed else "failed: " + "; ".join(_complaint(c) for c in failed)
    result = _leave(analysis, plan, solution, stages, folder, status, checks, estimates)
    if failed:
        log.error(status)
        failure = _failure(analysis, failed)
        failure.result = result
        raise failure
    return result


def refuse_oversize(plan: AnyPlan[Any]) -> None:
    """Raise InputError when the plan needs far more memory than there is: better now than after an hour."""
    limit = plan.scene.solver.memory or memory_left()
    if plan.memory_bytes > 2.0 * limit:
        mesh = ", ".join(f"{name} {plan.parameters[name]}" for name in ("divisions", "refine") if name in plan.parameters)
        raise InputError(
            f"the mesh needs about {plan.memory_bytes / 1e9:.3g} GB ({mesh}), there are {limit / 1e9:.3g} GB: use a coarser mesh "
            "(geometry.divisions or geometry.refine), a patch sized from the load, loads nearer to each other, or ask for less accuracy"
        )


def _level(analysis: Analysis, plan: AnyPlan[Any], stages: Stages) -> tuple[Any, tuple[Row, ...], float]:
    """One level of the accuracy ladder: solution, rows and seconds."""
    before = stages.elapsed()
    refuse_oversize(plan)
    with stages("accuracy ladder", f"{plan.parameters['divisions']} divisions on {plan.parameters['patch']:.3g} mm"):
        solution = analysis.solve(plan, Stages())
    return solution, tuple(analysis.make_rows(solution)), stages.elapsed() - before


def _failure(analysis: Analysis, failed: list[Check]) -> UpdError:
    text = "\n".join(_complaint(c) for c in failed)
    kind = InputError if all(c.name in analysis.USERS_FAULTS for c in failed) else ConvergenceError
    return kind(f"self-check failed\n{text}")


def _complaint(check: Check) -> str:
    case = f" ({check.case})" if check.case else ""
    return f"{check.name}{case}: {check.says} = {check.value:.3g}, limit {check.limit:.3g}; {check.remedy}"


def _leave(
    analysis: Analysis,
    plan: AnyPlan[Any],
    solution: Any,
    stages: Stages,
    folder: Path | None,
    status: str,
    checks: Sequence[Check] = (),
    estimates: Estimates | None = None,
) -> RunResult:
    """Collect the result and write the run folder."""
    rows = [_with_estimate(r, estimates or {}) for r in (analysis.make_rows(solution) if solution is not None else [])]
    arrays = analysis.arrays(solution) if solution is not None else {}
    if folder is not None and solution is not None:
        with stages("files", str(folder)):
            write_netcdf(folder / "result.nc", arrays)
            analysis.write_files(solution, folder)
    result = RunResult(
        scene=plan.scene.name,
        title=plan.scene.title,
        status=status,
        rows=tuple(rows),
        effects=tuple(_effects(plan, checks)),
        checks=tuple(checks),
        size=_size(analysis, plan, solution)
        | {"analysis": analysis.__name__.rpartition(".")[2], "mesh": dict(plan.parameters), "solver": dict(plan.solver)},
        cost=stages.cost(),
        arrays=arrays,
        folder=folder,
        scene_text=plan.scene.text,
    )
    if folder is not None:
        write_summary(result, folder)
    return result


def _with_estimate(row: Row, estimates: Estimates) -> Row:
    found = estimates.get((row.name, row.case))
    return row if found is None else replace(row, estimated_error=found[0], half_error_cost_s=found[1])


def _effects(plan: AnyPlan[Any], checks: Sequence[Check]) -> list[dict[str, Any]]:
    out = []
    for effect in plan.effects:
        mine = [c for c in checks if effect.check and c.name == effect.check]
        verdict = "" if effect.on or not effect.check else ("not reached" if not mine else "")
        if mine:
            worst = max(mine, key=lambda c: (not c.passed, c.value))
            verdict = f"{worst.verdict}: {worst.says} = {worst.value:.3g} (limit {worst.limit:.3g})"
        out.append({"name": effect.name, "on": effect.on, "why": effect.why, "check": effect.check, "verdict": verdict})
    return out


def _size(analysis: Analysis, plan: AnyPlan[Any], solution: Any) -> dict[str, Any]:
    size: dict[str, Any] = {"symmetry": plan.symmetry, "n_dof": {}, "n_hex": {}, "n_pairs": None}
    for body, count in plan.size.items():
        size["n_dof"][body] = 3 * count["nodes"]
        size["n_hex"][body] = count["hexes"]
    return size if solution is None else size | analysis.pairs(solution)


def _make_folder(folder: Path, analysis: Analysis, scene: AnyScene) -> Path:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # Nothing of an earlier run in the same folder may be taken for this one's.
        for old in (*_OUTPUTS, *(f"{name}.png" for name in analysis.FIGURES)):
            (folder / old).unlink(missing_ok=True)
        for old_file in [f for pattern in _NUMBERED for f in folder.glob(pattern)]:
            old_file.unlink()
        write_text(folder / "scene.toml", scene.text)
    except OSError as error:
        raise InputError(f"the run folder {folder} cannot be written ({error.strerror}): choose another with --out") from None
    return folder


#: What a run may write, whatever its analysis.
_OUTPUTS = ("summary.json", "result.nc", "mesh.vtu", "fields.vtu", "report.html")
#: packages whose version a run writes into its log
_VERSIONED = ("numpy", "scipy", "scikit-fem", "gmsh", "pypardiso")
_NUMBERED = ("reduced_*.nc", "modes_*.vtu")


def _log_to(folder: Path | None) -> logging.Handler | None:
    if folder is None:
        return None
    handler = logging.FileHandler(folder / "run.log", mode="w", encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)-7s %(name)s: %(message)s"))
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    return handler
