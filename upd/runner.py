"""Run a scene: plan, solve, check, and leave a run folder behind."""

from __future__ import annotations

import json
import logging
import threading
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from upd.analyses import analysis_of, make_plan
from upd.analyses.base import Analysis, Plan, refuse_oversize
from upd.cache.files import write_text
from upd.cache.sources import versions
from upd.errors import ConvergenceError, InputError, UpdError
from upd.labels import check_words
from upd.progress import Listener, Stages, silent
from upd.report import write_report
from upd.report.figures import FIGURES, write_figures
from upd.report.notebook import RunResult
from upd.results import FAILED, Check, status_of, worst_check, write_netcdf
from upd.scene import AnyScene, as_scene

log = logging.getLogger("upd")


def run(
    scene: AnyScene | str | Path | Mapping[str, Any],
    *,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    out: str | Path | None = None,
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
        Run folder to write (made when missing); None writes nothing.
    report
        Leave report.html in the run folder, made last and from what lies there.
    progress
        Called at the beginning and the end of every stage.

    Raises
    ------
    InputError
        For a bad scene: nothing is written.
    ConvergenceError
        When a solver or a self-check fails: the run folder then holds the log and what converged.
    """
    loaded = as_scene(scene, overrides)
    analysis = analysis_of(loaded)
    plan = make_plan(loaded)
    refuse_oversize(plan)
    folder = None if out is None else _make_folder(Path(out), loaded)
    handler = _log_to(folder)
    log.info("versions: %s", ", ".join(f"{name} {version}" for name, version in versions().items()))
    stages = Stages(progress)
    if folder is not None:
        # matplotlib takes a while to import: meanwhile the solver computes.
        threading.Thread(
            target=import_module, args=("upd.plot.matplotlib_parts",), daemon=True
        ).start()
    try:
        return _run(analysis, plan, stages, folder)
    finally:
        if folder is not None and report:
            _leave_report(folder, stages)
        if handler is not None:
            log.removeHandler(handler)
            handler.close()


def _leave_report(folder: Path, stages: Stages) -> None:
    try:
        with stages("report", str(folder / "report.html")):
            write_report(folder)
    except Exception:
        # The numbers are on disk: a page that fails must not hide how the run itself ended.
        log.exception("report.html was not written")


def _run(analysis: Analysis, plan: Plan[Any], stages: Stages, folder: Path | None) -> RunResult:
    try:
        solution = analysis.solve(plan, stages)
    except UpdError as error:
        log.error("failed: %s", error)
        if folder is not None:
            _leave(analysis, plan, error.partial, stages, folder, f"failed: {error}")
        raise
    except BaseException as error:
        log.exception("stopped")
        if folder is not None:
            _leave(
                analysis,
                plan,
                getattr(error, "partial", None),
                stages,
                folder,
                f"stopped: {type(error).__name__}",
            )
        raise
    checks = analysis.check_solution(solution)
    failed = [c for c in checks if not c.passed and c.fatal]
    result = _leave(analysis, solution.plan, solution, stages, folder, "", checks)
    if result.outcome == FAILED:
        log.error(result.status)
        failure = (
            _failure(analysis, failed)
            if failed
            else ConvergenceError(result.status.removeprefix("failed: "))
        )
        failure.result = result
        raise failure
    return result


def _failure(analysis: Analysis, failed: list[Check]) -> UpdError:
    text = "\n".join(c.sentence for c in failed)
    kind = InputError if all(c.name in analysis.input_checks for c in failed) else ConvergenceError
    return kind(f"self-check failed\n{text}")


def _leave(
    analysis: Analysis,
    plan: Plan[Any],
    solution: Any,
    stages: Stages,
    folder: Path | None,
    status: str,
    checks: Sequence[Check] = (),
) -> RunResult:
    """Collect the result and write the run folder; an empty status is derived from checks and
    results.
    """
    arrays = analysis.arrays(solution) if solution is not None else {}
    results = tuple(analysis.make_results(solution) if solution is not None else ())
    result = RunResult(
        scene=plan.scene.name,
        title=plan.scene.title,
        status=status or status_of(checks, results),
        results=results,
        effects=tuple(_effects(plan, checks)),
        checks=tuple(checks),
        size=_size(analysis, plan, solution)
        | {"analysis": analysis.name, "mesh": dict(plan.parameters), "solver": dict(plan.solver)},
        arrays=arrays,
        folder=folder,
        scene_text=plan.scene.text,
    )
    if folder is not None and solution is not None:
        with stages("files", str(folder)):
            write_netcdf(folder / "result.nc", arrays)
            analysis.write_files(solution, folder)
            write_figures(result, folder)
    result = result.with_cost(stages.cost())
    if folder is not None:
        write_text(
            folder / "summary.json", json.dumps(result.summary(), indent=1, default=_plain) + "\n"
        )
    return result


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"{type(value).__name__} in a summary")


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
        out.append(
            {
                "name": effect.name,
                "on": effect.on,
                "applies": effect.applies,
                "why": effect.why,
                "check": effect.check,
                "switch": list(effect.switch),
                "verdict": verdict,
            }
        )
    return out


def _size(analysis: Analysis, plan: Plan[Any], solution: Any) -> dict[str, Any]:
    size: dict[str, Any] = {"symmetry": plan.symmetry, "n_dof": {}, "n_hex": {}, "n_pairs": None}
    for body, count in plan.size.items():
        size["n_dof"][body] = 3 * count["nodes"]
        size["n_hex"][body] = count["hexes"]
    return size if solution is None else size | analysis.sizes(solution)


def _make_folder(folder: Path, scene: AnyScene) -> Path:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # Nothing of an earlier run in the same folder may be taken for this one's.
        for pattern in _OUTPUTS:
            for old in list(folder.glob(pattern)):
                old.unlink(missing_ok=True)
        write_text(folder / "scene.toml", scene.text)
    except OSError as error:
        raise InputError(
            f"the run folder {folder} cannot be written ({error.strerror}): choose another "
            "with --out"
        ) from None
    return folder


#: What a run may write, whatever its analysis.
_OUTPUTS = (
    *(
        "summary.json",
        "result.nc",
        "mesh.vtu",
        "fields.vtu",
        "report.html",
        "reduced_*.nc",
        "modes_*.vtu",
    ),
    *(f"{name}.png" for name in FIGURES),
)


def _log_to(folder: Path | None) -> logging.Handler | None:
    if folder is None:
        return None
    handler = logging.FileHandler(folder / "run.log", mode="w", encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)-7s %(name)s: %(message)s"))
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    return handler
