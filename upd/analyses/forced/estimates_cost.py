"""What the error estimates of a response cost."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

from upd.analyses.cost import NODES, CostModel, arrays_s, calls_s
from upd.scene import ForcedScene
from upd.scene.forced_contact import GAUSS

#: element of the companion mesh of quadratic ones, and what fewer elements off the contact leave
#: of linear ones
_COMPANION: Literal["hex8i"] = "hex8i"
_FEWER = 0.35
#: Newton steps of a peak climbed to on every level, more harmonics counted as what they cost
_CLIMB = 480.0
#: periods of a peak of a sweep marched again on every level
_PERIODS = 3.5e3
#: peaks of a curve, of both blades
_PEAKS = 4.0
#: companions of a contact stiffness, and the seconds of the linear limits of each
_MODELS, _LIMITS_S = 5.0, 0.2


def estimate_seconds(
    scene: ForcedScene,
    size: Mapping[str, Mapping[str, int]],
    workers: int,
    step_s: float,
    period_s: float,
    swept: float,
) -> float:
    """Seconds of the companions and of the peaks on them.

    Parameters
    ----------
    size
        Body -> numbers of nodes, elements and contact nodes.
    workers
        Bodies worked on side by side.
    step_s
        Of a Newton step of the run.
    period_s
        Of a period of a march.
    swept
        Curves that sweeps tell; the balance tells the others.
    """
    stiffnesses = len(scene.stiffnesses)
    curves = float(stiffnesses * len(scene.excitation.centrifugal_to_force))
    companion = CostModel(_companion(scene))
    times = 0.25 if NODES[scene.mesh.element] > 8 else _FEWER
    for body in ("left", "right"):
        hexes, nodes, contact = (size[body][key] for key in ("hexes", "nodes", "contact"))
        few = (hexes, round(times * nodes))
        if times == _FEWER:
            few = (round(times * hexes), round(times * nodes))
        companion.dynamic_body(*few)
        reduced(companion, scene, body, f"{body}, companion", (*few, contact))
    companion.seconds += calls_s(_MODELS * _LIMITS_S * stiffnesses)
    companion.seconds += _PEAKS * _CLIMB * step_s * (curves - swept)
    companion.shared += arrays_s(_PEAKS * _PERIODS * period_s * swept)
    return companion.total(workers)


def reduced(
    cost: CostModel, scene: ForcedScene, body: str, task: str, size: tuple[int, int, int]
) -> None:
    """A blade reduced to its contact points, 2 probes and some modes.

    Parameters
    ----------
    cost
        Where it is added.
    body, task
        The blade, and what the task is called.
    size
        Hexahedra, nodes, and contact nodes.
    """
    hexes, nodes, contact = size
    modes = scene.reduction.modes
    if scene.contact.rule == GAUSS:
        rows, columns = scene.contact.lines("left" if body == "left" else "right")
        cost.attached(task, hexes, nodes, 3 * rows * columns + 2, modes)
    else:
        cost.reduction(task, hexes, nodes, 3 * (contact + 2), modes)


def _companion(scene: ForcedScene) -> ForcedScene:
    if NODES[scene.mesh.element] == 8:
        return scene
    return replace(scene, mesh=replace(scene.mesh, element=_COMPANION))


def reduction_seconds(
    scene: ForcedScene, size: Mapping[str, Mapping[str, int]], workers: int, finer: float = 1.0
) -> float:
    """Seconds of blades and their reduction, with elements so many times smaller."""
    cost, times = CostModel(scene), finer**3
    for body in ("left", "right"):
        count = size[body]
        hexes, nodes = round(times * count["hexes"]), round(times * count["nodes"])
        cost.dynamic_body(hexes, nodes)
        reduced(cost, scene, body, f"{body}, reduction", (hexes, nodes, count["contact"]))
    return cost.total(workers)
