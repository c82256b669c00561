"""Loads near a curved contact's own, which move its edge between the nodes: which, their plan and
cost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.plan import ContactPlan, add_loads, is_curved
from upd.analyses.cost import CostModel
from upd.scene import Scene
from upd.vary.scatter import RADIUS

#: places of the edge, in spacings from its own. What an edge between nodes leaves is periodic in it
#: with one spacing (a sphere's deviations correlate by 0.3 to 0.7 one spacing on, by -0.3 to -0.7
#: half of one): two places a period are the fewest that show it (Nyquist), whole spacings alone
#: show one phase of it and bound 3 of 4. Over how many periods is a matter of cost: one each way
#: bounds as well and overrates more, further ones overrate little less (``benchmarks/run.py
#: accuracy/estimates``)
PLACES = np.array([-2.0, -1.5, -1.0, -0.5, 0.5, 1.0, 1.5, 2.0])
#: most steps of a neighbour's cycle, the fewest there are: its energy is the same but for rounding
_STEPS = 8
#: effects of a run that its neighbours go without
_SPARED = ("internal displacement", "load curve")


def has_neighbours(scene: Scene) -> bool:
    """Whether neighbouring loads are cheap: not where the pressure follows the shear, as every load
    then is the end of a march.
    """
    return is_curved(scene) and not scene.coupled and max(scene.loads.forces) > 0


def neighbours(touching: int) -> list[float]:
    """Logarithms of neighbouring loads over a load.

    Parameters
    ----------
    touching
        Nodes in contact, N: its radius is sqrt(N / pi) spacings. Neighbours have a radius of one at
        least.
    """
    if touching <= np.pi:
        return []
    spacing = float(np.sqrt(np.pi / touching))
    steps: NDArray[np.float64] = np.sign(PLACES) * np.log1p(np.abs(PLACES) * spacing) / RADIUS
    return [float(t) for t in steps if np.exp(RADIUS * t) >= spacing]


def plan_at(plan: ContactPlan, loads: Sequence[float]) -> ContactPlan:
    """The plan with other loads in N, without what they go without, cycles in fewer steps."""
    own = plan.scene.loads
    near = replace(own, normal=tuple(loads), cycle_steps=min(own.cycle_steps, _STEPS))
    scene = replace(plan.scene, loads=near)
    effects = tuple(replace(e, on=False) if e.name in _SPARED else e for e in plan.effects)
    return replace(plan, scene=scene, effects=effects)


def neighbours_seconds(plan: ContactPlan) -> float:
    """Predicted for the neighbours of all loads."""
    if not has_neighbours(plan.scene):
        return 0.0
    near = plan_at(plan, [F for F in plan.scene.loads.forces if F > 0.0] * len(PLACES))
    cost = CostModel(near.scene)
    add_loads(cost, near.scene, near.size, near.effects, 0.0)
    return cost.seconds
