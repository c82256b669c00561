"""The analyses a scene can call for. Each is a package with the same functions; the scene or its recipe says which one it needs."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol, cast

from upd import recipes
from upd.plan import AnyPlan
from upd.progress import Stages
from upd.results import Check, Row
from upd.scene import AnyScene, ForcedScene

#: what a recipe declares as its ANALYSIS -> package
_PACKAGES = {"curved contact": "curved", "flat contact": "flat", "rig": "rig", "forced response": "forced"}


class Analysis(Protocol):
    """What the runner asks of an analysis; ``solution`` is whatever its own ``solve`` returns."""

    __name__: str
    #: Self-checks whose failure is a fault of the input.
    USERS_FAULTS: Sequence[str]
    #: Figures a run may leave, without their ending.
    FIGURES: Sequence[str]

    def make_plan(self, scene: Any) -> AnyPlan[Any]:
        """What is simulated and left out, size and cost; raises InputError."""

    def solve(self, plan: AnyPlan[Any], stages: Stages) -> Any:
        """Everything the plan calls for; an UpdError carries what converged as ``partial``."""

    def make_rows(self, solution: Any) -> list[Row]:
        """The numbers of a run."""

    def check_solution(self, solution: Any) -> list[Check]:
        """The self-checks of a run."""

    def arrays(self, solution: Any) -> dict[str, dict[str, Any]]:
        """Arrays for result.nc: case -> name -> (dimensions, array, attributes)."""

    def pairs(self, solution: Any) -> dict[str, int]:
        """Sizes known after the solve."""

    def write_files(self, solution: Any, folder: Path) -> None:
        """Figures, meshes and fields into the run folder."""


def analysis_of(scene: AnyScene) -> Analysis:
    """The analysis that the scene names, or its recipe declares."""
    name = scene.analysis if isinstance(scene, ForcedScene) else recipes.analysis(scene.recipe)
    return cast(Analysis, import_module(f"upd.analyses.{_PACKAGES[name]}"))


def make_plan(scene: AnyScene) -> AnyPlan[Any]:
    """Derive the plan of ``scene``: what will be simulated, what is left out and why, size and cost. Raises InputError."""
    return analysis_of(scene).make_plan(scene)
