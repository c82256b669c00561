"""What every analysis is asked, and what it answers.

Its plan (effects, size, cost), its solution, its numbers, checks, arrays, charts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any, Generic, Self, TypeVar

from upd.analyses.cost import CostModel, memory_limit
from upd.cache.sources import key_of
from upd.errors import InputError
from upd.labels import number
from upd.mesh import recipes
from upd.plot.answer_table import AnswerTable
from upd.plot.chart import Chart, Entry
from upd.progress import Stages
from upd.reference.printed import Lookup, printed_values
from upd.results import Arrays, Case, Check, Estimates, Group, Result
from upd.results.quantities import number_label
from upd.scene import AnyScene, load_scene, ready_scenes
from upd.scene.base import LeftOut
from upd.vary import errors
from upd.vary.ladder import Ladder
from upd.vary.variation import Overrides, Problem
from upd.vary.wanted import plan_wanted, solve_wanted

#: names of the effect with the levels that a run chose; the second is that of older folders
CHOSEN_BY_ACCURACY = ("levels chosen by accuracy", "mesh chosen by accuracy")
#: how many names of a pattern an engineer asks for first
_FEW = 2
#: symmetry -> how many copies of the model make the whole
COPIES = {"full": 1, "half": 2, "quarter": 4}


@dataclass(frozen=True)
class Effect:
    """One effect of the model.

    Simulated or left out, why, and the name of the check made after the solve.

    Attributes
    ----------
    check
        Of an effect left out: solves a number again with the effect and prints its change. Of a
        simulated one: a check that belongs to it.
    switch
        Overrides of the scene, "path=value", that simulate an effect left out.
    applies
        False where the scene's question has no such effect, so that leaving it out means nothing.
    """

    name: str
    on: bool
    why: str
    check: str = ""
    switch: tuple[str, ...] = ()
    applies: bool = True

    @classmethod
    def either(cls, name: str, on: bool, why: str, off: str, **more: Any) -> Effect:
        """An effect with why it is simulated, or why not: it then means nothing."""
        return cls(name, on, why if on else off, **{"applies": on, **more})

    @property
    def word(self) -> str:
        """yes, no, or n/a where it does not apply."""
        return "yes" if self.on else "no" if self.applies else "n/a"


@dataclass(frozen=True)
class Resolved:
    """A number of the run solved again with an effect that the run leaves out.

    Attributes
    ----------
    effect
        Name of the effect's check.
    quantity, case
        The result it is about.
    without, included
        The number without the effect and with it, at one level; NaN when that was not solved.
    remedy
        What to do when it matters.
    over
        What the change is a part of, in place of the number without the effect; with its name.
    """

    effect: str
    quantity: str
    case: Case
    without: float
    included: float
    unit: str
    remedy: str = ""
    over: tuple[float, str] | None = None

    def check(self, limits: LeftOut, remedy: str = "") -> Check:
        """Its check against the scene's limits; ``remedy`` where it has none of its own."""
        without, included, note = self.without, self.included, ""
        change = abs(included / without - 1.0) if without else math.inf
        if self.over is not None:
            whole, name = self.over
            change = abs(included - without) / whole if whole else math.inf
            note = f" (part of the {name})"
        after = number(included, self.unit) if math.isfinite(included) else "a value not found"
        return Check(
            self.effect,
            self.case,
            change,
            limits.limit(self.unit),
            f"change of {number_label(self.quantity)}, {number(without)} to {after}{note}",
            self.remedy or remedy,
            fatal=False,
            quantity=self.quantity,
            without=float(without),
            included=float(included),
        )


def conditions(
    case: Case, remedy: str, *rows: tuple[str, float, float, str], fatal: bool = True
) -> list[Check]:
    """Self-checks of a case with one remedy: name, value, limit and what is compared."""
    return [
        Check(name, case, float(value), limit, what, remedy, fatal=fatal)
        for name, value, limit, what in rows
    ]


@contextmanager
def keeping(solution: object) -> Iterator[None]:
    """What converged so far is the ``partial`` of an error."""
    try:
        yield
    except BaseException as error:
        error.partial = solution  # type: ignore[attr-defined]
        raise


def first_numbers(results: Sequence[Entry], names: Sequence[str]) -> list[Entry]:
    """The numbers an engineer asks for first, those of one case side by side.

    Of every name those of the first case where it is not zero, on all its sides.

    Parameters
    ----------
    results
        As in summary.json.
    names
        Most important first; of a shell pattern the first two that there are.
    """
    first: dict[str, Entry] = {}
    for entry in sorted(results, key=lambda entry: not entry["value"]):
        first.setdefault(entry["name"], entry)
    found = [name for one in names for name in [n for n in first if fnmatchcase(n, one)][:_FEW]]
    rank, both = {name: k for k, name in enumerate(found)}, {"side": ""}
    mine = [
        entry
        for entry in results
        if entry["name"] in rank
        and entry["case_fields"] | both == first[entry["name"]]["case_fields"] | both
    ]
    order = list(dict.fromkeys(entry["case"] for entry in mine))
    least = {case: min(rank[e["name"]] for e in mine if e["case"] == case) for case in order}
    return sorted(mine, key=lambda e: (least[e["case"]], order.index(e["case"]), rank[e["name"]]))


S = TypeVar("S", bound=AnyScene)


@dataclass(frozen=True)
class Plan(Generic[S]):
    """Everything decided before the first number is computed.

    Attributes
    ----------
    parameters
        Go to the recipe as they are.
    size
        Body -> numbers of "nodes", "hexes" and "contact" nodes.
    solver
        "body, task" -> linear solver and why.
    seconds, memory_bytes
        Predicted for the whole run.
    workers
        Bodies worked on side by side.
    asked
        The scene as asked for, where that leaves the levels to an accuracy.
    estimate_seconds
        Of ``seconds``, those of the companions that errors are estimated with.
    input_seconds
        Of ``seconds``, those of what inputs known within limits do to the numbers.
    files_seconds
        Of ``seconds``, those of figures, files and page.
    """

    scene: S
    parameters: Mapping[str, Any]
    symmetry: str
    effects: tuple[Effect, ...]
    size: Mapping[str, Mapping[str, int]]
    solver: Mapping[str, str]
    seconds: float
    memory_bytes: float
    workers: int
    asked: S | None = field(default=None, kw_only=True)
    estimate_seconds: float = field(default=0.0, kw_only=True)
    input_seconds: float = field(default=0.0, kw_only=True)
    files_seconds: float = field(default=0.0, kw_only=True)

    @property
    def copies(self) -> int:
        """Copies of the model that make the whole."""
        return COPIES[self.symmetry]

    @property
    def solve_seconds(self) -> float:
        """Predicted seconds without figures, files and page."""
        return self.seconds - self.files_seconds

    def effect(self, name: str) -> bool:
        """True when the effect is simulated."""
        return next(e.on for e in self.effects if e.name == name)

    def chosen_by_accuracy(self, why: str) -> Self:
        """The plan with the effect that its levels were chosen, and how."""
        return replace(self, effects=(*self.effects, Effect(CHOSEN_BY_ACCURACY[0], True, why)))

    def refuse_oversize(self) -> None:
        """Raise InputError when the plan needs more memory than there is.

        Better now than after an hour, killed without a word by the system.
        """
        limit = memory_limit(self.scene)
        if self.memory_bytes > limit:
            raise InputError(
                f"the mesh needs about {self.memory_bytes / 1e9:.3g} GB, there are "
                f"{limit / 1e9:.3g} GB{fitting(self, limit)}: use a coarser mesh "
                "(geometry.divisions or geometry.refine), a patch sized from the load, loads "
                "nearer to each other, ask for less accuracy, or close other programs"
            )

    @classmethod
    def of(
        cls,
        cost: CostModel,
        symmetry: str,
        parameters: Mapping[str, Any],
        effects: Iterable[Effect],
        needs: tuple[float, int],
        files_seconds: float,
        **more: Any,
    ) -> Self:
        """The plan of a scene with what it costs; ``needs``: bytes and workers."""
        scene: Any = cost.scene
        memory, workers = needs
        return cls(
            scene,
            parameters,
            symmetry,
            tuple(effects),
            cost.size,
            cost.solver,
            cost.total(workers) + files_seconds,
            memory,
            workers,
            files_seconds=files_seconds,
            **more,
        )


@dataclass(frozen=True)
class Needs:
    """What a point of a sweep needs and may share with others.

    Attributes
    ----------
    model, mesh
        Keys of the largest thing two points may share in memory, and of their meshes.
    condensations
        Keys of the condensations kept on disk.
    factors
        Whether displacements inside the bodies are asked for: their factor is not kept on disk.
    """

    model: str
    mesh: str
    condensations: frozenset[str] = frozenset()
    factors: bool = False


def rig_needs(plan: Plan[Any], threads: int, *choices: str) -> Needs:
    """What a point of a sweep of rigs needs, and may share; its model has choices of the scene."""
    del threads
    scene = plan.scene
    mesh = {"recipe": scene.recipe, "parameters": dict(plan.parameters)}
    model = {choice: getattr(scene, choice) for choice in ("mesh", "material", *choices)}
    return Needs(key_of(mesh | model), key_of(mesh))


@dataclass(frozen=True)
class Analysis:
    """What one kind of scene is answered with; ``solution`` is whatever its own ``solve`` returns.

    Attributes
    ----------
    name
        As run folders name it.
    headline_names
        The numbers an engineer asks for first, most important first (shell patterns): for the
        terminal, the page, tables of sweeps and ladders.
    input_checks
        Self-checks whose failure is an error of the input.
    problem
        Its plan, solution and numbers; how its scenes are varied.
    needs
        plan, threads -> what a point of a sweep with this plan needs, and may share.
    check_solution
        solution -> the self-checks of a run.
    arrays
        solution -> groups of arrays for result.nc.
    sizes
        solution -> sizes known after the solve.
    write_files
        solution, run folder: meshes, fields and other files, charts aside.
    charts
        arrays, summary -> all charts of a run, from the content of its folder alone, the most
        important first.
    headline
        results as in summary.json -> the 5 to 8 an engineer asks for first.
    ladders
        What a convergence study can vary, by name.
    answer
        results as in summary.json -> the tables that are the answer, the most important first;
        None where the terminal lists ``headline`` instead.
    verdict_names
        Names of the number that stands beside the outcome, the first that was reached; the first of
        ``headline`` when none.
    solve_left_out
        solution, stages: adds numbers solved again with effects that a run leaves out; None where
        it has them already.
    coarsened
        plan as run -> what makes a scene into its cheap level: the numbers that inputs change are
        solved on it again.
    """

    name: str
    headline_names: tuple[str, ...]
    problem: Problem
    needs: Callable[[Any, int], Needs]
    check_solution: Callable[[Any], list[Check]]
    arrays: Callable[[Any], dict[str, Group]]
    charts: Callable[[Arrays, Mapping[str, Any]], list[Chart]]
    headline: Callable[[Sequence[Entry]], list[Entry]]
    ladders: Mapping[str, Ladder]
    input_checks: tuple[str, ...] = ()
    sizes: Callable[[Any], dict[str, int]] = lambda solution: {}
    write_files: Callable[[Any, Path], None] = lambda solution, folder: None
    answer: Callable[[Sequence[Entry]], list[AnswerTable]] | None = None
    verdict_names: tuple[str, ...] = ()
    solve_left_out: Callable[[Any, Stages], None] | None = None
    coarsened: Callable[[Any], Overrides] = lambda plan: ()

    def make_plan(self, scene: AnyScene) -> Plan[Any]:
        """What is simulated and left out, size and cost.

        Raises InputError when parts of the scene do not fit together.
        """
        plan: Plan[Any] = plan_wanted(self.problem, scene)
        return plan

    def solve(self, plan: Plan[Any], stages: Stages) -> Any:
        """Everything the plan calls for, with the plan as run.

        An UpdError carries what converged as ``partial``.
        """
        solution, found = solve_wanted(self.problem, plan, stages)
        # a solution that has its levels itself finds them again
        if found is not None and hasattr(solution, "estimates"):
            solution = replace(solution, estimates=found)
        if self.solve_left_out is not None:
            with keeping(solution):
                self.solve_left_out(solution, stages)
        return solution

    def estimate(self, solution: Any, results: Sequence[Result], stages: Stages) -> Estimates:
        """The parts of the errors of a run's numbers."""
        return errors.estimate(self.problem, solution, results, stages)

    def is_main(self, one: Result) -> bool:
        """Whether it is a number an engineer asks for first."""
        return not one.withheld and any(fnmatchcase(one.name, p) for p in self.headline_names)

    def make_results(self, solution: Any) -> Sequence[Result]:
        """The numbers of a run."""
        return self.problem.make_results(solution)


def fitting(plan: Plan[Any], limit: float) -> str:
    """How many dofs would fit about: entries of a factor go with dofs^(4/3), all else with dofs
    (`upd.linalg.select`).

    Parameters
    ----------
    plan : Plan
        Needs more than the limit.
    limit : float
        Bytes.

    Returns
    -------
    str
        In brackets, after a blank.
    """
    dofs = 3 * sum(count["nodes"] for count in plan.size.values())
    factors = any(not why.partition(":")[0].endswith("amg") for why in plan.solver.values())
    fit = dofs * (limit / plan.memory_bytes) ** (0.75 if factors else 1.0)
    return f" (about {fit:.2g} dofs fit, these are {dofs:.2g})"


# -- printed values beside the numbers of a run ----------------------------------------------------


#: parameters of a recipe that say how it is meshed or which part is, not how its bodies are
_NOT_OF_THE_BODIES = ("symmetry", "element_nodes", "arrangement", "damper")


def printed_of(scene: AnyScene) -> Lookup:
    """What was printed of the scene's bodies.

    Dimensions that no table prints are those of the ready scene: where the scene's bodies are
    others, in size or material, nothing was printed of them. Mesh and solver do not matter.
    """
    geometry = {**scene.geometry, "arrangement": getattr(scene, "arrangement", "")}
    look_up = printed_values(scene.recipe, geometry, scene.body_materials.values())
    if recipes.closed_form(scene.recipe):
        # its tables print their bodies themselves
        return look_up
    ready = ready_scene(scene)
    same = ready is not None and (
        _bodies(scene) == _bodies(ready) and _elastic(scene) == _elastic(ready)
    )
    return look_up if same else lambda name, case: ()


def ready_scene(scene: AnyScene) -> Any:
    """The ready scene of the same kind, recipe and arrangement; None when there is none."""
    return _ready().get(_kind(scene))


@cache
def _ready() -> dict[tuple[str, str, str], AnyScene]:
    """The ready scenes, by kind, recipe and arrangement."""
    return {_kind(scene): scene for scene in map(load_scene, ready_scenes())}


def _kind(scene: AnyScene) -> tuple[str, str, str]:
    return type(scene).__name__, scene.recipe, getattr(scene, "arrangement", "")


def _elastic(scene: AnyScene) -> dict[str, tuple[float, ...]]:
    """Constants of every body that its numbers depend on: density counts where things move."""
    return {
        body: (m.E, m.nu, m.density) if scene.moves else (m.E, m.nu)
        for body, m in scene.body_materials.items()
    }


def _bodies(scene: AnyScene) -> dict[str, Any]:
    """Lengths, angles and named choices of the recipe's parameters."""
    given = {
        key: value
        for key, value in scene.geometry.items()
        if key not in ("recipe", "damper") and value != "auto"
    }
    arrangement = getattr(scene, "arrangement", "")
    if arrangement:
        given["arrangement"] = arrangement
    made = recipes.made(scene.recipe, given)
    return {
        f.name: getattr(made, f.name)
        for f in fields(made)
        if f.name not in _NOT_OF_THE_BODIES
        and (f.metadata.get("quantity") is not None or "choices" in f.metadata)
    }


def with_printed(results: Iterable[Result], printed: Lookup) -> list[Result]:
    """The results with what was printed of them.

    A result with a reference of its own gets the relative difference of the printed value from it;
    another is compared with the printed value itself, which it need not converge to.

    Parameters
    ----------
    printed
        Printed values of the scene, from `printed_of`.
    """
    out = list(results)
    for k, one in enumerate(out):
        found = printed(one.name, one.case.given())
        # Several values have no order that could be the run's.
        for value, source in found if len(found) == 1 else ():
            if one.reference is None:
                out[k] = replace(one, reference=value, source=source, exact=False)
            else:
                out[k] = replace(one, printed_error=value / one.reference - 1.0)
    return out
