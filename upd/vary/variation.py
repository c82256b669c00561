"""One scene with one thing changed, what was found on it, and what an analysis can vary."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from upd.progress import Stages
from upd.results import Case, Estimates, Result
from upd.scene.quantities import UNKNOWN
from upd.vary.orders import Samples

Key = tuple[str, Case]
#: paths of a scene, and their values in the unit inside: ("geometry.divisions", 8)
Overrides = tuple[tuple[str, Any], ...]
#: without what is solved again, and without errors and input bands of its own
ALONE: Overrides = (("left_out.solve", "no"), ("accuracy", UNKNOWN), ("uncertain", {}))
#: power of the elements along an edge that the seconds of a level grow with where its mesh is not
#: known: a direct solver's on a solid, n^2 of n = N^3
POWER = 6.0
#: element sizes of coarser levels over those of the run
COARSER = (2.0**0.5, 2.0, 2.0**1.5)


def of_geometry(parameters: Mapping[str, Any]) -> Overrides:
    """What sets these parameters of the recipe."""
    return tuple((f"geometry.{name}", value) for name, value in parameters.items())


@dataclass(frozen=True)
class Variation:
    """One scene with one thing changed.

    Attributes
    ----------
    source
        Of the error that it shows: "mesh".
    label
        What it is, in words: "8 x 22 divisions".
    overrides
        What changes in the scene.
    size
        Of its elements or steps over that of the run: above 1 it is coarser.
    """

    source: str
    label: str
    overrides: Overrides = ()
    size: float = math.nan


#: the run itself
RUN = Variation("", "the run", size=1.0)


@dataclass(frozen=True)
class SolvedVariation:
    """A variation that was solved, or why it was not.

    Attributes
    ----------
    seconds
        Measured.
    samples
        The numbers at neighbouring loads, where it has them.
    reason
        Why it was not solved, with its label.
    """

    variation: Variation
    numbers: Sequence[Result] = ()
    seconds: float = 0.0
    samples: Samples = field(default_factory=dict)
    reason: str = ""

    @cached_property
    def values(self) -> dict[Key, float]:
        """Those of the numbers that were reached."""
        return {(r.name, r.case): r.value for r in self.numbers if not r.withheld}


#: source of error -> its variations, the finest of coarser ones first, or why there are none
Levels = Mapping[str, Sequence[Variation] | str]


@dataclass(frozen=True)
class LevelChoice:
    """What sets the level of one source of error where an accuracy is wanted.

    Attributes
    ----------
    source
        As `upd.results.ErrorPart` names it.
    name, words
        In words: "modes kept"; of a level, with {} for it.
    levels
        Cheap to expensive; None is that of the scene itself.
    overrides
        scene, level -> what sets it.
    """

    source: str
    name: str
    words: str
    levels: Sequence[Any]
    overrides: Callable[[Any, Any], Overrides]

    @property
    def labels(self) -> list[str]:
        """Of its levels."""
        return ["of the scene" if n is None else self.words.format(n) for n in self.levels]

    def at(self, scene: Any, k: int) -> Overrides:
        """What sets a level of the scene."""
        level = self.levels[k]
        return () if level is None else self.overrides(scene, level)


@dataclass(frozen=True)
class Problem:
    """What an analysis gives to have its scenes solved, varied, and brought to an accuracy.

    Attributes
    ----------
    make_plan
        scene -> its plan, without the cost of variations.
    solve, make_results
        plan, stages -> solution, a dataclass with its plan; its numbers.
    bare
        scene -> overrides without what costs and shows no number.
    levels
        plan -> the variations that its errors are estimated with.
    finer
        plan, source, factor -> overrides with elements or steps so many times smaller.
    sample
        solution -> its numbers at neighbouring loads; None where those show nothing.
    corrected
        solution, numbers of the run, the parts found -> the parts, with those that are known
        otherwise: all of a solution that has its levels itself.
    choices
        scene -> what may be chosen of it to reach an accuracy.
    governing
        scene -> names of accuracies -> numbers they are asked of, as shell patterns; one accuracy
        for all is asked of all of them. Other names stand for themselves.
    level_of
        plan -> its level, with the size of its elements in any unit.
    varies_lowest
        Whether the usual variations show the errors of the lowest level, not only another level.
    trial
        scene -> the scene with nothing but the numbers that govern.
    predicted
        How many of the lowest levels a plan predicts, the last for the whole run; 0: the lowest,
        then the scene's own.
    """

    make_plan: Callable[[Any], Any]
    solve: Callable[[Any, Stages], Any]
    make_results: Callable[[Any], Sequence[Result]]
    bare: Callable[[Any], Overrides] = lambda scene: ALONE
    levels: Callable[[Any], Levels] = lambda plan: {}
    finer: Callable[[Any, str, float], Overrides] = lambda plan, source, factor: ()
    sample: Callable[[Any], Samples] | None = None
    corrected: Callable[[Any, Sequence[Result], Estimates], Estimates] = lambda s, r, found: found
    choices: Callable[[Any], Sequence[LevelChoice]] = lambda scene: ()
    governing: Callable[[Any], Mapping[str, str]] = lambda scene: {}
    level_of: Callable[[Any], Variation] = lambda plan: RUN
    varies_lowest: bool = False
    trial: Callable[[Any], Any] = lambda scene: scene
    predicted: int = 0
