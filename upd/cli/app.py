"""Command line: thin. Every command is a call a Python user can make."""

from __future__ import annotations

import logging
import os
import sys
from dataclasses import asdict, dataclass, replace
from inspect import getdoc, signature
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import App, Parameter

from upd import __version__
from upd.cache.folders import numbered
from upd.cli import terminal
from upd.cli.terminal import SetOption, run_progress, warn
from upd.errors import InputError, UpdError

OK, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 3

app = App(
    name="upd",
    help=(
        "Finite elements, contact and friction for underplatform dampers.\n\n"
        "Exit codes of every command: 0 done, with or without warnings (points of a sweep or study "
        "that failed are such); 1 a solver or a self-check failed, no point of a sweep or study "
        "was solved, or the disk is too full for the numbers (figures or page of a run or sweep "
        "that it does not take are a warning); 2 bad input; 3 interrupted."
    ),
    version=__version__,
    # switches have no --no-... unless they say so
    default_parameter=Parameter(negative=()),
    result_action="return_value",
    suppress_keyboard_interrupt=False,
)


@Parameter(name="*")
@dataclass(frozen=True)
class WhoSolves:
    """Who solves the points of a sweep or study.

    Parameters
    ----------
    workers
        Processes side by side. Of a sweep by default as many as cores and memory allow; of a study
        one, a fresh process for every point: more than one blurs what a point costs.
    threads
        Threads of each process, on which the last digits of numbers depend. Of a sweep by default
        one; of a study all there are, divided by the workers.
    cluster
        Of a Dask scheduler, tcp://host:port; needs updampers[cluster].
    """

    workers: int | None = None
    threads: int | None = None
    cluster: str = ""


_ANYBODY = WhoSolves()


def _loaded(scene: str, set: SetOption) -> Any:
    # slow to import
    from upd.scene import load_scene

    return load_scene(scene, set or [])


@app.command
def run(
    scene: str,
    *,
    set: SetOption = None,
    out: Path | None = None,
    report: Annotated[bool, Parameter(negative="--no-report")] = True,
    full: bool = False,
) -> None:
    """Solve a scene, print the answer and write the run folder.

    Parameters
    ----------
    scene
        Ready name (see `upd scenes`) or path of a .toml file.
    out
        Run folder; by default runs/NAME, or runs/NAME-2 and so on when that exists.
    report
        Write report.html, one page to look at and pass on, into the run folder.
    full
        Print every number, effect and self-check, and the seconds of each stage.
    """
    from upd.cli.tables import print_lines
    from upd.runner import run as run_scene

    loaded = _loaded(scene, set)
    try:
        with run_progress(stages=full) as live:
            result = run_scene(
                loaded,
                out=out or Path("runs") / loaded.name,
                numbered=out is None,
                report=report,
                progress=live,
            )
    except UpdError as error:
        if error.folder is not None and error.result is None:
            terminal.errors.print(f"The log and what converged are in {error.folder}")
        if error.folder is None or error.result is None:
            raise
        print_lines(terminal.console, error.result.answer(terminal.console.width, full=full))
        if report and not (error.folder / "report.html").exists():
            terminal.console.print(f"Report: not written, see {error.folder / 'run.log'}")
        raise
    # faults of pictures are printed once, beside the answer
    shown = replace(result, faults=())
    print_lines(terminal.console, shown.answer(terminal.console.width, full=full))
    for fault in result.faults:
        warn(fault, "yellow")


@app.command
def plan(scene: str, *, set: SetOption = None) -> None:
    """Show what will be simulated, dofs, memory and seconds; nothing is solved.

    Also what is omitted, and why.
    """
    from upd.analyses import make_plan
    from upd.cli.tables import print_plan

    loaded = _loaded(scene, set)
    print_plan(terminal.console, make_plan(loaded))


@app.command
def mesh(
    scene: str,
    *,
    output: Annotated[list[Path] | None, Parameter(alias="-o")] = None,
    set: SetOption = None,
    split: bool = False,
    picture: Path | None = None,
    no_picture: bool = False,
    list: bool = False,
) -> None:
    """Mesh a recipe or a scene, as .msh, .vtu and .inp for other programs, with a picture.

    The whole model. Prints contact pairs, and the worst elements with their places.

    Parameters
    ----------
    scene
        Ready recipe (sphere_block, wedge_platform, pads_platform, blade_rig), a .py recipe of your
        own, or a scene.
    output
        File to write: .msh, .vtu or .inp, by its ending; may be repeated; by default all three in
        runs/mesh-NAME.
    split
        One file per body, FILE-BODY.msh and so on.
    picture
        File of the picture (.png); by default beside the first output.
    no_picture
        Draw none.
    list
        Show the parameters with unit, default and bounds, and stop: nothing is meshed.
    """
    from upd.analyses.meshing import mesh_request
    from upd.cli.describe import print_keys
    from upd.cli.mesh import mesh_files, regenerate
    from upd.scene.keys import recipe_keys

    request = mesh_request(scene, set or [])
    if list:
        keys = recipe_keys(request.recipe, request.parameters)
        print_keys(terminal.console, f"Parameters of {request.recipe}", keys, "")
        return
    terminal.check_ending(picture, "--picture", ".png")
    place = Path("runs") / f"mesh-{request.name}"
    free = next(folder for folder in numbered(place) if not folder.exists())
    files = mesh_files(output or [], free, request)
    drawn = None if no_picture else picture or files[0].with_suffix(".png")
    with run_progress() as live:
        regenerate(terminal.console, request, files, drawn, live, split=split)


@app.command
def study(
    scene: str,
    *,
    vary: str = "mesh",
    levels: Annotated[list[float] | None, Parameter(consume_multiple=True)] = None,
    at: str | None = None,
    set: SetOption = None,
    out: Path | None = None,
    who: WhoSolves = _ANYBODY,
) -> int:
    """Show what accuracy costs in seconds and memory, or what parameters move.

    Run a ladder, fit the convergence rate, write table and work-precision figure.

    Kill it at any moment; called again with the same folder it runs only what is missing. A point
    that fails is a row with its reason.

    Parameters
    ----------
    vary
        What is varied. mesh: every scene. element: all but bladed disks. steps: load steps (coupled
        contacts, seated dampers) or time steps a period (forced responses: sweeps up and down).
        modes: rigs and forced responses, those kept in the reduction. harmonics, samples, contacts
        (points of the springs), contact (springs, then both faces node by node): forced responses;
        harmonics of bladed disks too. accuracy, solver: contacts. patch: curved contacts.
        parameters (one at a time): flat contacts. dimensions (d ln f / d ln p): rigs.
    levels
        Levels of a ladder, coarse to fine: divisions of the patch (mesh, element and solver of
        contacts), refinements (of rigs and forced responses: 0.5 1 2), shares of the elements along
        edges (bladed disks: 0.5 1), elements up a face (contact: 4 8 12 are 60, 198 and 468 nodes
        of the symmetric rig, 3 6 9 are 60, 196 and 460 of the asymmetric one; without, two that
        take minutes), errors in per cent (accuracy: 5 2 1), harmonics and so on.
    at
        The load that is studied: F_C/F_E of a forced response (--at 194; without, the scene's
        lowest), the normal force of a contact (--at "200 N"; without, all of the scene's), F_C of
        a seated damper.
    out
        Study folder; by default runs/study-NAME-VARY, with the load of --at.
    """
    from upd.batch.studies import plan_study, run_study, scene_at, study_workers
    from upd.cli.batch import print_study, print_study_plan
    from upd.labels import file_name

    loaded = scene_at(_loaded(scene, set), at)
    load = "" if at is None else f"-at-{file_name(at)}"
    with run_progress() as live:
        live("planning", "the points", None)
        planned = plan_study(loaded, vary, tuple(levels) if levels else None)
        workers = study_workers(loaded, planned, **asdict(who))
    print_study_plan(terminal.console, f"{loaded.title or loaded.name}, {vary}", planned, workers)
    folder = out or Path("runs") / f"study-{loaded.name}-{vary}{load}"
    with terminal.batch_progress() as watch:
        result = run_study(loaded, planned, folder, workers=workers, watch=watch)
    print_study(terminal.console, result)
    return OK if result.report.found else FAILED


@app.command
def sweep(
    scene: str,
    *,
    vary: list[str] | None = None,
    sample: Annotated[list[int] | None, Parameter(consume_multiple=True)] = None,
    who: WhoSolves = _ANYBODY,
    set: SetOption = None,
    out: Path | None = None,
    follow: str = "",
    plan_only: bool = False,
) -> int:
    """Run a grid of parameters, or a sample of uncertain inputs, on many cores.

    Table, netCDF file with named axes, figures, report.html.

    Kill it at any moment; called again with the same folder it runs only what is missing. A point
    that fails is a row with its reason.

    Parameters
    ----------
    vary
        path=first:last:count[:log] or path=value,value,...; repeat for a grid.
    sample
        Points drawn evenly from the limits of all inputs with a half-width (0.6 +- 0.1), in place
        of --vary: a check of the bands by the inputs, which runs give to first order. After it the
        seed of the draw, --sample 64 3; without, that of the sample in the folder, else 0.
    out
        Sweep folder; by default runs/sweep-NAME, or runs/sample-NAME.
    follow
        Names of the numbers for table and figures, with commas between; * stands for any letters.
    plan_only
        Show what the points share and stop.
    """
    from upd.batch.plan import plan_sweep
    from upd.batch.store import PointStore
    from upd.batch.sweeps import run_sweep
    from upd.cli.batch import print_sweep, print_sweep_plan

    loaded = _loaded(scene, set)
    count, seed, *_ = [*(sample or []), None, None]
    kind = "sweep" if count is None else "sample"
    folder = out or Path("runs") / f"{kind}-{loaded.name}"
    if not plan_only:
        PointStore(folder, "sweep").check()
    with run_progress() as live:
        live("planning", "what the points share", None)
        planned = plan_sweep(loaded, vary or (), folder, sample=count, seed=seed, **asdict(who))
    print_sweep_plan(terminal.console, planned)
    if plan_only:
        return OK
    names = [name.strip() for name in follow.split(",") if name.strip()]
    with terminal.batch_progress() as watch:
        result = run_sweep(planned, folder, follow=names, watch=watch)
    print_sweep(terminal.console, result)
    for fault in result.faults:
        warn(fault, "yellow")
    return OK if len(result.failed) < len(result.outcomes) else FAILED


@app.command
def design(
    scene: str,
    *,
    minimise: Literal["peak", "acceleration"] | None = None,
    over: list[str] | None = None,
    for_: Annotated[list[str] | None, Parameter(name="--for")] = None,
    set: SetOption = None,
    out: Path | None = None,
) -> None:
    """Show whether a damper jams, lifts off or tilts; find the one with the lowest peak.

    In closed form, before any dynamics; with --minimise, the damper whose worst resonance peak is
    lowest. Maps of its angles and friction with the damper marked, and the limits of the forces on
    both faces under F_C: design.png, summary.json and report.html. Of a choice choice.png instead.
    Kill a choice at any moment: called again it continues from the peaks it has.

    Parameters
    ----------
    scene
        Ready name or .toml file of a forced response or a seated damper.
    minimise
        peak: the highest accelerance of the right blade within the scene's band, per newton of F_E;
        acceleration: the highest acceleration.
    over
        What is chosen, path=low:high; may be repeated: one input that sets F_C
        (damper.centrifugal=50:2000; radius or speed where the scene gives them), and others
        (geometry.front_angle=30:60), each of which multiplies the cost.
    for_
        What the damper has to stand, path=low:high; may be repeated: excitation.force=0.5:5, and
        other inputs (contact.friction=0.3:0.7), all of whose corners count.
    out
        Folder; by default runs/design-NAME, or runs/choice-NAME.
    """
    from upd.sizing import BestDamper, DamperDesign
    from upd.sizing import design as design_damper

    loaded = _loaded(scene, set)
    if minimise is None and (over or for_):
        raise InputError("--over and --for belong to a choice: add --minimise peak")
    found: DamperDesign | BestDamper
    if minimise is None:
        found = design_damper(loaded)
    else:
        with run_progress() as live:
            found = design_damper(
                loaded, minimise=minimise, over=over or [], for_=for_ or [], progress=live
            )
    terminal.console.print(found.table(), soft_wrap=True)
    folder = out or Path("runs") / f"{found.figure}-{loaded.name}"
    found.write(folder)
    terminal.console.print(f"Report: {folder / 'report.html'}", soft_wrap=True)
    terminal.console.print(f"Figure: {folder / f'{found.figure}.png'}", soft_wrap=True)


@app.command
def fit(
    scene: str,
    *,
    to: str,
    vary: Annotated[list[str], Parameter(consume_multiple=True)],
    set: SetOption = None,
    starts: int | None = None,
    out: Path | None = None,
) -> int:
    """Find inputs of a forced response that give measured numbers or curves.

    Reports what these leave unknown: directions, how far each input may move while the others still
    fit, and which further measurement would narrow that. Writes the scene with the fitted values,
    figure, numbers and report.html. Ends with 1 when the targets are not reached; the files then
    hold the nearest. Kill it at any moment; called again it continues.

    Parameters
    ----------
    to
        Targets with commas between: numbers "stuck_in_phase=377 Hz +- 0.5 Hz" (also
        free_peak_1_frequency, stuck_left_peak_2_accelerance, K_N and the like), peaks with friction
        at an F_C/F_E "peak_1_frequency@194=335 Hz +- 1 Hz", measured curves "stuck=curve.csv +- 2
        %", "left_194=curve.csv", "measured" for all of the scene's. Half-widths for all numbers or
        for none; of curves without, the noise is estimated.
    vary
        path, path=low:high (quantities, or factors x0.1:x10), or path+path for one factor of
        several; may be repeated.
    starts
        Of the search; by default 8 where only contact stiffnesses move, 4 with friction, 2 where
        new blades are made.
    out
        Folder; by default runs/fit-NAME.
    """
    from upd.fitting import fit as fit_inputs

    with run_progress() as live:
        loaded = _loaded(scene, set)
        folder = out or Path("runs") / f"fit-{loaded.name}"
        found = fit_inputs(loaded, to, vary, starts=starts, out=folder, progress=live)
        for line in (
            found.table(),
            f"Scene: {folder / found.scene.name}.toml",
            f"Figure: {folder / 'fit.png'}",
            f"Report: {folder / 'report.html'}",
        ):
            terminal.console.print(line, soft_wrap=True)
    return OK if found.status != "not reached" else FAILED


@app.command
def report(runs: list[Path], *, out: Path | None = None) -> None:
    """Make the page of a run or a sweep again; of several runs, a comparison.

    Parameters
    ----------
    runs
        Folders of runs, or one folder of a sweep.
    out
        File of the comparison; by default comparison.html beside the first run folder.
    """
    from upd.report import write_report
    from upd.report.run_page import write_comparison

    if len(runs) == 1:
        if out is not None:
            raise InputError(
                "--out is for comparisons: the page of one run is report.html in its folder"
            )
        terminal.console.print(f"Report: {write_report(runs[0])}")
        return
    page = write_comparison(runs, out or runs[0].resolve().parent / "comparison.html")
    terminal.console.print(f"Comparison: {page}")


@app.command
def scenes() -> None:
    """List the ready scenes."""
    from upd.cli.tables import print_table
    from upd.plot.answer_table import AnswerTable
    from upd.scene import load_scene, ready_scenes

    loaded = map(load_scene, ready_scenes())
    rows = tuple((one.name, one.title, ", ".join(one.want)) for one in loaded)
    heads = ("scene", "what it is", "outputs")
    print_table(terminal.console, AnswerTable("Ready scenes", heads, rows))


@app.command
def describe(
    what: str, key: str = "", *, set: SetOption = None, drawing: Path | None = None
) -> None:
    """Explain every key of a scene or recipe: meaning, unit, bounds and effect on cost.

    Parameters
    ----------
    what
        Scene (ready name or .toml file) or recipe (ready name or .py file).
    key
        One key (contact.friction, or friction) or a table (contact); by default all.
    drawing
        Write a drawing of the geometry with its dimensions, to this .png file.
    """
    from upd.cli.describe import described, print_keys, write_drawing

    title, keys = described(what, set or [])
    print_keys(terminal.console, title, keys, key)
    if drawing is not None:
        terminal.console.print(f"Drawing: {write_drawing(what, set or [], drawing)}")


@app.command
def new(scene: str, file: Path) -> None:
    """Write a copy of a scene to edit: every key with what it means.

    Parameters
    ----------
    scene
        Ready name or .toml file; or an example, which is copied as it is: own_damper.toml,
        own_damper.py, own_wedge.toml, own_pads.toml, own_sphere.toml, damped_response.toml,
        own_matrices.py.
    file
        The new file; the name of a .toml file becomes the scene's.
    """
    from upd.cli.describe import write_new

    terminal.console.print(f"Written: {write_new(scene, file)}")


@app.command
def doctor() -> int:
    """Show versions, threads, the linear solver and the libraries gmsh needs."""
    from upd.cli.doctor import examine
    from upd.cli.tables import print_table
    from upd.report.tables import filled

    found = examine()
    columns = {
        "what": [what for what, *_ in found],
        "found": [words for _, words, _ in found],
        "status": ["" if fine else "faulty" for *_, fine in found],
    }
    print_table(terminal.console, filled("This machine", columns))
    return OK if all(fine for *_, fine in found) else FAILED


def command_table() -> list[tuple[str, str]]:
    """Every command as it is called, with what it needs, and what it does in a sentence."""
    rows = []
    for name in (name for name in app if not name.startswith("-")):
        function: Any = app[name].default_command
        words = ["upd", name]
        for one in signature(function).parameters.values():
            required, value = one.default is one.empty, one.name.upper()
            if one.kind is one.POSITIONAL_OR_KEYWORD:
                words.append(value if required else f"[{value}]")
            elif required:
                words.append(f"--{one.name} {value}")
        rows.append((" ".join(words), str(getdoc(function)).partition("\n")[0]))
    return rows


def _shown(record: logging.LogRecord) -> bool:
    """What a user should see before anything else, on stderr too: warnings of recipes."""
    if record.levelno >= logging.WARNING:
        warn(record.getMessage())
    return True


def main(arguments: list[str] | None = None) -> None:
    """Entry point. Exit codes: 0 done, 1 failed, 2 bad input, 3 interrupted."""
    # figures are files: the environment of a notebook may name a backend that is not here
    os.environ["MPLBACKEND"] = "agg"
    logging.getLogger("upd").addHandler(logging.NullHandler())
    logging.getLogger("upd.mesh.recipe_modules").addFilter(_shown)
    try:
        code = app(arguments if arguments is not None else sys.argv[1:])
    except UpdError as error:
        warn(error, "red")
        # A run that was solved and failed a self-check failed, whatever the remedy is.
        sys.exit(BAD_INPUT if isinstance(error, InputError) and not error.result else FAILED)
    except KeyboardInterrupt:
        warn("interrupted")
        sys.exit(INTERRUPTED)
    sys.exit(code if isinstance(code, int) else OK)
