"""Forced response of the two-blade rig for the benchmarks.

Bodies and reduced models built once, then one curve after another.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from upd.analyses.forced.model import Model, make_model, respond
from upd.analyses.forced.plan import ForcedPlan, grid, make_plan
from upd.analyses.forced.statics import face_laws
from upd.analyses.seated.bodies import Bodies, make_bodies
from upd.hbm import FrequencyResponse
from upd.progress import Stages
from upd.scene import ForcedScene, load_scene


@dataclass(frozen=True)
class Rig:
    """Plan, bodies and reduced model of one scene with the printed contact stiffness."""

    plan: ForcedPlan
    bodies: Bodies
    model: Model

    @property
    def size(self) -> str:
        """Points and unknowns in words."""
        points = self.model.contacts
        images = " (each with its mirror image)" if self.model.damper.n_dof < 6 else ""
        return (
            f"{points.n_point} points{images}, {points.tangents} sliding "
            f"direction{'s' * (points.tangents > 1)}"
        )


@dataclass(frozen=True)
class Curve:
    """One curve: answer, seconds, and its highest peak in Hz and (m/s2)/N: climbed to, so that the
    grid does not move it.
    """

    answer: FrequencyResponse
    seconds: float
    frequency: float
    height: float

    @property
    def told(self) -> str:
        """Points, status, how far the path came, and peak in words."""
        f, end = (
            self.answer.frequency,
            ""
            if self.complete
            else f" between {self.answer.frequency.min():.1f} and "
            f"{self.answer.frequency.max():.1f} Hz",
        )
        return (
            f"{len(f)} points, {self.answer.status}{end}; peak {self.height:.4g} (m/s2)/N at "
            f"{self.frequency:.2f} Hz"
        )

    @property
    def complete(self) -> bool:
        """Whether the path reached the end of the sweep."""
        return self.answer.status == "complete"


def rig(name: str, bodies: Bodies | None = None, **changes: Any) -> Rig:
    """The rig of a ready scene with some settings changed (``contact__rows=...``), without friction
    at rest where no other static state is among them.

    Bodies made before are used again.
    """
    settings = {
        "contact.stiffness": ["thesis"],
        "contact.static": "frictionless",
        **{key.replace("__", "."): value for key, value in changes.items()},
    }
    scene = load_scene(name, settings)
    assert isinstance(scene, ForcedScene)
    plan = make_plan(scene)
    bodies = bodies or make_bodies(plan)
    return Rig(
        plan, bodies, make_model(plan, bodies, face_laws(scene.stiffnesses["thesis"], Stages()))
    )


#: contact points on all lines of nodes, on the coarse mesh of the recipe
LINES: dict[str, Any] = {
    "geometry.across": 2,
    "geometry.base_columns": 3,
    "geometry.shank_layers": 3,
    "geometry.platform_layers": 3,
    "geometry.core_layers": 4,
    "contact.rule": "lines",
    "contact.rows": "all",
    "excitation.points": 400,
}


def on_lines(name: str, bodies: Bodies | None = None, **changes: Any) -> Rig:
    """As `rig`, with its contact points on lines of nodes."""
    columns = 3 if name.startswith("symmetric") else 2
    return rig(name, bodies, **{**LINES, "contact.columns": columns, **changes})


def curve(rig: Rig, ratio: float, highest: int, frequencies: Any = None, **changes: Any) -> Curve:
    """The right blade's curve under F_E = F_C / ratio with the harmonics 0 to `highest`."""
    force = rig.plan.scene.damper.centrifugal / ratio
    begin = time.perf_counter()
    answer = respond(
        rig.plan,
        rig.model,
        force,
        grid(rig.plan) if frequencies is None else frequencies,
        harmonics=range(highest + 1),
        **changes,
    )
    seconds = time.perf_counter() - begin
    frequency, amplitude = answer.peak(rig.model.row("right"))
    return Curve(answer, seconds, frequency, accelerance(frequency, amplitude, force))


def accelerance(frequency: float, amplitude: float, force: float) -> float:
    """(m/s2)/N of a displacement amplitude in mm at a frequency in Hz under a force in N."""
    return float(1e-3 * (2.0 * np.pi * frequency) ** 2 * amplitude / force)
