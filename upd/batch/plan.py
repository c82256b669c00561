"""What a sweep will do before it does it: its points, which of them are missing, what they share,
how many may run side by side.

A grid: axes from texts like ``contact.friction=0.1:0.6:6`` and the full factorial of their values.
A sample of a scene's uncertain inputs: points drawn between the limits of all of them.

A Latin hypercube: every input has one point in each of n slices of its interval, evenly drawn there
and in an order of its own.

References
----------
M. D. McKay, R. J. Beckman, W. J. Conover (1979), A comparison of three methods for selecting values
of input variables, Technometrics 21, 239-245.
"""

from __future__ import annotations

import itertools
import math
import re
import tomllib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray
from scipy.stats import qmc

from upd.analyses import analysis_of, make_plan
from upd.analyses.base import Needs, Plan
from upd.batch.engine import Workers, check_who, fitting
from upd.batch.point import Task, load_point
from upd.batch.store import PointStore
from upd.cache.arrays import cache_limit
from upd.cache.sources import source_digest
from upd.errors import InputError
from upd.plot.sweep_charts import Parameter, told_apart
from upd.scene import AnyScene
from upd.scene.quantities import Uncertainty
from upd.scene.toml import put_back, value_of
from upd.units import number_and_unit, unit_inside
from upd.vary.outcome import Outcome

Array = NDArray[np.float64]

#: More points than this are refused: their files alone would fill a disk.
MOST_POINTS = 200_000
_FORMS = "write path=first:last:count, path=first:last:count:log or path=value,value,..."


#: one point of a grid: its place along every axis
Place = tuple[int, ...]


def parse_axes(texts: Sequence[str], scene: Mapping[str, Any]) -> tuple[Parameter, ...]:
    """Axes of ``--vary`` texts; numbers without a unit take that of the scene's own value.

    Raises InputError with all problems.
    """
    axes, problems = [], []
    for text in texts:
        try:
            axes.append(_axis(text, scene))
        except InputError as error:
            problems.append(str(error))
    paths = [axis.path for axis in axes]
    problems += [
        f"--vary {path}: is duplicated" for path in sorted({p for p in paths if paths.count(p) > 1})
    ]
    if not texts:
        problems.append(f"--vary: is missing; {_FORMS}")
    if problems:
        raise InputError("\n".join(problems))
    count = math.prod(len(axis.values) for axis in axes)
    if count > MOST_POINTS:
        raise InputError(
            f"--vary: the grid has {count} points, more than {MOST_POINTS}: give fewer values"
        )
    return tuple(axes)


def places(axes: Sequence[Parameter]) -> list[Place]:
    """Full factorial of the axes, the last one fastest."""
    return list(itertools.product(*(range(len(axis.values)) for axis in axes)))


def settings(axes: Sequence[Parameter], place: Place) -> dict[str, Any]:
    """Path -> value of one point."""
    return {axis.path: axis.setting(k) for axis, k in zip(axes, place, strict=True)}


def _axis(text: str, scene: Mapping[str, Any]) -> Parameter:
    path, sep, given = text.partition("=")
    path, given = path.strip(), given.strip()
    if not sep or not path or not given:
        raise InputError(f"--vary {text!r}: {_FORMS}")
    parts = [part.strip() for part in given.split(":")]
    ends = [end for end in map(number_and_unit, parts[:2]) if end is not None]
    now: Any = scene
    for key in path.split("."):
        now = now.get(key) if isinstance(now, Mapping) else None
    wrapped = isinstance(now, list)
    mine = number_and_unit(str(now[0] if wrapped and now else now))
    own = "" if mine is None else mine[1]
    if len(ends) == 2:
        values = _range(path, parts, ends, own)
    else:
        listed = [part.strip() for part in given.split(",")]
        if not all(listed):
            raise InputError(f"--vary {given!r}: a value between the commas is missing")
        values = [_with_unit(value_of(part), own) for part in listed]
    if len(set(map(str, values))) < len(values):
        raise InputError(f"--vary {path}: a value is duplicated")
    return Parameter(path, tuple(values), wrapped)


def _range(
    path: str, parts: Sequence[str], ends: Sequence[tuple[float, str]], own: str
) -> list[Any]:
    """Evenly spaced values, or in equal ratios with a fourth part "log"."""
    if not re.fullmatch(r"0*[1-9]\d*(:log)?", ":".join(parts[2:])):
        raise InputError(f"--vary {path}={':'.join(parts)}: {_FORMS}")
    logarithmic = len(parts) == 4
    (first, unit_a), (last, unit_b) = ends
    if unit_a and unit_b and unit_a != unit_b:
        raise InputError(
            f"--vary {path}: the range begins in {unit_a} and ends in {unit_b}; give both "
            "in one unit"
        )
    count, unit = int(parts[2]), unit_a or unit_b or own
    if logarithmic and not (first > 0.0 and last > 0.0):
        raise InputError(
            f"--vary {path}: equal ratios need positive ends, {first:g} and {last:g} are given"
        )
    if count > MOST_POINTS:
        raise InputError(f"--vary {path}: {count} values are more than {MOST_POINTS}")
    spaced = np.geomspace(first, last, count) if logarithmic else np.linspace(first, last, count)
    # 0.30000000000000004 is no value a user meant.
    numbers = [float(f"{v:.12g}") for v in spaced]
    whole = "." not in parts[0] + parts[1] and all(v.is_integer() for v in numbers)
    return [_with_unit(int(v) if whole else v, unit) for v in numbers]


def _with_unit(value: Any, unit: str) -> Any:
    plain = isinstance(value, (int, float)) and not isinstance(value, bool)
    return f"{value!r} {unit}" if plain and unit else value


# -- a sample of a scene's uncertain inputs --------------------------------------------------------


@dataclass(frozen=True)
class Sample:
    """Points drawn from the limits of a scene's inputs.

    Attributes
    ----------
    seed
        Of the draw.
    inputs
        Those known within limits.
    shifts
        (1 + n, n_input) half-widths from their values: zeros, then the n points drawn.
    """

    seed: int
    inputs: tuple[Uncertainty, ...]
    shifts: Array

    @property
    def count(self) -> int:
        """Points drawn."""
        return len(self.shifts) - 1

    def as_dict(self) -> dict[str, Any]:
        """What identifies the sample, for the sweep folder."""
        return {
            "count": self.count,
            "seed": self.seed,
            "inputs": {one.path: one.given for one in self.inputs},
        }


def draw_sample(scene: AnyScene, count: int, seed: int) -> Sample:
    """Draw ``count`` points from the limits of the scene's uncertain inputs.

    Raises
    ------
    InputError
        Where no input is known within limits, and for a number of points or a seed that is none.
    """
    inputs = tuple(scene.uncertain.values())
    # a plane through the numbers has a height and a slope for every input: fewer points always
    # lie on one, and tell nothing of what the first order leaves
    least, problems = len(inputs) + 2, []
    if not inputs:
        problems.append(
            f"--sample {count}: the scene knows all its inputs exactly; to fix it: write what "
            'is known of them, for example --set contact.friction="0.6 +- 0.1"'
        )
    elif not least <= count <= MOST_POINTS:
        known = "1 input" if len(inputs) == 1 else f"{len(inputs)} inputs"
        problems.append(
            f"--sample {count}: {known} known within limits need {least} points or more, at most "
            f"{MOST_POINTS}; some tens tell a band to a tenth"
        )
    if seed < 0:
        problems.append(f"seed {seed}: give 0 or a larger whole number")
    if problems:
        raise InputError("\n".join(problems))
    drawn = qmc.LatinHypercube(len(inputs), rng=np.random.default_rng(seed)).random(count)
    return Sample(seed, inputs, np.vstack([np.zeros(len(inputs)), 2.0 * drawn - 1.0]))


def sample_points(scene: AnyScene, sample: Sample) -> tuple[tuple[Parameter, ...], list[str]]:
    """A parameter for every input, with its values at all points in the unit inside; the scenes of
    all points as TOML: first as given with its half-widths, whose run gives the first-order bands,
    then with the values drawn alone.
    """
    axes = []
    for one, shifts in zip(sample.inputs, sample.shifts.T, strict=True):
        unit = unit_inside(one.kind)
        numbers = tuple(float(one.value + shift * one.half_width) for shift in shifts)
        values = tuple(f"{number!r} {unit}" for number in numbers) if unit else numbers
        axes.append(Parameter(one.path, values))
    texts = []
    for k in range(len(sample.shifts)):
        data = tomllib.loads(scene.text)
        for one, axis in zip(sample.inputs, axes, strict=True):
            data = put_back(data, one.steps, axis.values[k] if k else one.given)
        texts.append(tomli_w.dumps(data))
    return tuple(axes), texts


# -- the plan --------------------------------------------------------------------------------------

_FACTORS = (
    "displacements inside the bodies are asked for: their factor is not kept on disk, each worker "
    "makes it once a model"
)


@dataclass(frozen=True)
class SweepPlan:
    """A sweep before it runs.

    Attributes
    ----------
    tasks
        One per point of the grid, in its order.
    kept
        Outcomes of earlier calls.
    refused
        Points the scene does not allow.
    groups
        Missing point -> what it shares with others (model of the two bodies; meshes).
    meshes, condensations
        How many different ones the missing points need.
    memory_bytes
        Of the largest point.
    seconds
        Missing point -> seconds predicted for it.
    workers
        Who solves them.
    notes
        What a user should know of sharing and workers.
    sample
        The points are drawn from the scene's uncertain inputs; None for a grid.
    """

    scene: AnyScene
    axes: tuple[Parameter, ...]
    places: tuple[Place, ...]
    tasks: tuple[Task, ...]
    kept: dict[int, Outcome]
    refused: dict[int, Outcome]
    groups: dict[int, str]
    meshes: int
    condensations: int
    memory_bytes: float
    seconds: dict[int, float]
    workers: Workers
    notes: tuple[str, ...]
    sample: Sample | None = None

    def label(self, number: int) -> str:
        """Values of a point in words: friction 0.3, centrifugal 350 N."""
        if self.sample is not None:
            return f"point {number} of {self.sample.count}" if number else "inputs as given"
        return ", ".join(
            axis.with_unit(k) for axis, k in zip(self.axes, self.places[number], strict=True)
        )


def plan_sweep(
    scene: AnyScene,
    vary: Sequence[str],
    folder: Path,
    *,
    sample: int | None = None,
    seed: int | None = None,
    workers: int | None = None,
    threads: int | None = None,
    cluster: str = "",
) -> SweepPlan:
    """Plan the full factorial of ``vary``, or a sample of the scene's uncertain inputs.

    Parameters
    ----------
    vary
        Texts path=first:last:count or path=value,value.
    folder
        May hold earlier points.
    sample
        Points drawn from the limits of the uncertain inputs, in place of ``vary``.
    seed
        Of the draw; None: that of the sample in the folder, else 0.
    workers
        Processes side by side, at most as threads allow; None: as many as cores and memory allow;
        0: this process.
    threads
        Of each; None: 1.
    cluster
        "tcp://host:port".

    Raises
    ------
    InputError
        For a bad grid or sample, for both together, and when the scene allows none of the points.
    """
    threads = 1 if threads is None else threads
    check_who(workers, threads, cluster)
    store = PointStore(folder, "sweep")
    drawn = _drawn(scene, vary, store, sample, seed)
    if drawn is None:
        axes = parse_axes(vary, tomllib.loads(scene.text))
        grid = tuple(places(axes))
        points = [(scene.text, settings(axes, place)) for place in grid]
    else:
        axes, texts = sample_points(scene, drawn)
        # the k-th value of every input together, point by point
        grid = tuple((k,) * len(axes) for k in range(len(drawn.shifts)))
        points = [(text, {}) for text in texts]
    code = source_digest(scene.recipe)
    limit = cache_limit()
    tasks = tuple(
        Task(text, changed, threads, limit, scene.recipe, code) for text, changed in points
    )
    kept = store.finished(tasks)
    needs, refused = point_needs(tasks, kept)
    if len(refused) == len(grid):
        raise InputError(
            f"no point of the {'grid' if drawn is None else 'sample'} can be run. The first: "
            f"{refused[0].failure.removeprefix('InputError: ')}"
        )
    memory = max((one.memory_bytes for _, one in needs.values()), default=0.0)
    many, notes = fitting(workers, threads, len(needs), memory)
    shared = [one for one, _ in needs.values()]
    return SweepPlan(
        scene=scene,
        axes=told_apart(axes),
        places=grid,
        tasks=tasks,
        kept=kept,
        refused=refused,
        groups={number: one.model for number, (one, _) in needs.items()},
        meshes=len({one.mesh for one in shared}),
        condensations=len(frozenset().union(*(one.condensations for one in shared))),
        memory_bytes=memory,
        seconds={number: one.seconds for number, (_, one) in needs.items()},
        workers=Workers(many, threads, cluster),
        notes=(*notes, *([_FACTORS] if any(one.factors for one in shared) else [])),
        sample=drawn,
    )


def _drawn(
    scene: AnyScene, vary: Sequence[str], store: PointStore, count: int | None, seed: int | None
) -> Sample | None:
    """The sample that is asked for; None for a grid."""
    if count is None:
        if seed is not None:
            raise InputError(f"seed {seed}: is for a sample; give its number of points too")
        return None
    if vary:
        raise InputError(
            f"--sample {count}, --vary {vary[0]}: a sample draws the scene's uncertain inputs, a "
            "grid goes through values that are given; to fix it: give one of both (--set fixes "
            "a value in a sample)"
        )
    return draw_sample(scene, count, store.kept_seed() if seed is None else seed)


def point_needs(
    tasks: Sequence[Task], kept: Collection[int] = ()
) -> tuple[dict[int, tuple[Needs, Plan[Any]]], dict[int, Outcome]]:
    """What every missing point shares with others and its plan, and the points that the scene does
    not allow.
    """
    needs: dict[int, tuple[Needs, Plan[Any]]] = {}
    refused: dict[int, Outcome] = {}
    for number, task in enumerate(tasks):
        if number in kept:
            continue
        try:
            scene = load_point(task)
            plan = make_plan(scene)
            shared = analysis_of(scene).needs(plan, task.threads)
        except InputError as error:
            refused[number] = Outcome(failure=" ".join(f"InputError: {error}".split()))
        else:
            needs[number] = shared, plan
    return needs, refused
