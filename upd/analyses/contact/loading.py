"""Tangential loads after a normal load.

Compliance of the loaded nodes, force over displacement, the closed loop of a cycle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.plan import ContactPlan
from upd.contact.model import Body, ContactModel
from upd.contact.tangential import TangentialPath, tangential_path
from upd.contact.tangential_step import TangentialHistory
from upd.results import Case

Array = NDArray[np.float64]

#: Relative step of load on both sides of a load over which a slope of the force-approach curve is
#: taken; the curvature of Hertz's F ~ d^(3/2) makes it 0.074 LOAD_STEP^2 too soft.
LOAD_STEP = 0.1


def contact_points_of(model: ContactModel) -> Array:
    """(n, 3) the contact nodes that carry forces, in contact axes, mm."""
    points: Array = model.lower.mesh.points[model.lower.contact[model.multipliers.nodes]]
    return points


def load_point(plan: ContactPlan, model: ContactModel) -> Array:
    """(2,) where the load line meets the contact plane, contact axes in mm."""
    upper = model.upper
    if plan.scene.contact.load_point is not None:
        low: Array = contact_points_of(model)[:, :2].min(axis=0)
        return np.asarray(low + np.array(plan.scene.contact.load_point))
    nodes = upper.mesh.points[upper.mesh.nodes["distant"], :2]
    weights = upper.mesh.weights.get("distant")
    # Middle of the set's extent: its nodes need not be evenly spread. Weights say where it is.
    middle = (
        0.5 * (nodes.min(axis=0) + nodes.max(axis=0))
        if weights is None
        else np.asarray(weights @ nodes / weights.sum())
    )
    return np.asarray(middle if 0 not in plan.mirrors else middle * np.array([0.0, 1.0]))


def tilt_arms(plan: ContactPlan, model: ContactModel, *, held: bool | None = None) -> Array:
    """(n, k) mm from the load line to the nodes, for the k free tilts.

    ``held``: in place of the scene's choice.
    """
    if plan.scene.contact.tilt != "free" if held is None else held:
        return np.zeros((len(model.gap), 0))
    return contact_points_of(model)[:, :2] - load_point(plan, model)


@dataclass(frozen=True)
class LoadPath:
    """Tangential force over displacement after one normal load, of the whole contact.

    Attributes
    ----------
    case, normal
        Its own case, and that of the normal load.
    load, displacement
        (n_step,) N and mm along the load, from zero on.
    cycle
        First loading to +T*, then the closed loop +T* -> -T* -> +T*; otherwise first loading only.
    slip_work, loop_area
        N mm over the closed loop.
    """

    case: Case
    normal: Case
    load: Array
    displacement: Array
    cycle: bool = False
    slip_work: float = 0.0
    loop_area: float = 0.0


@dataclass(frozen=True)
class Sheared:
    """What a tangential load step left at the n loaded nodes, unprocessed: for checks.

    Vectors are (n,), or (2 n,) with x dofs first.

    Attributes
    ----------
    components
        Of the load, one per n entries of a vector.
    loaded
        (n,) contact nodes that carry a normal force.
    limit
        (n,) mu times the normal force, N.
    force
        Tractions in N, before they were brought inside their limits.
    before
        Slip before the step, mm.
    displacement, load
        (1 or 2,) mm, and N on the model.
    stick
        (n,) which nodes stick.
    terms
        Size of what ``before`` was summed from where that is more than a slip, mm.
    """

    components: tuple[int, ...]
    loaded: NDArray[np.int64]
    limit: Array
    force: Array
    before: Array
    displacement: Array
    load: Array
    stick: NDArray[np.bool_]
    terms: Array | float = 0.0


def tangential_compliance(
    model: ContactModel,
    components: Sequence[int],
    loaded: NDArray[np.int64],
    body: Body | None = None,
) -> Array:
    """Compliance of the loaded nodes, (n, n) or (2n, 2n) mm/N with x dofs first, of both bodies or
    of one.
    """
    pick = np.ix_(loaded, loaded)

    def one(i: int, j: int) -> Array:
        return (model.compliance(i, j) if body is None else model.body_compliance(body, i, j))[pick]

    return np.block([[one(i, j) for j in components] for i in components])


def load_history(values: Array, unit: Array) -> Array:
    """(n_step,) loads along one component, or (n_step, 2) along ``unit`` (2,)."""
    return np.outer(values, unit) if len(unit) == 2 else values


def along(path: TangentialPath, unit: Array, copies: int) -> tuple[Array, Array]:
    """Load of the whole contact in N and displacement in mm along ``unit`` (1 or 2,), from zero
    on.
    """
    load, moved = (
        np.asarray(v).reshape(len(path.load), len(unit)) @ unit
        for v in (path.load, path.displacement)
    )
    return np.concatenate([[0.0], copies * load]), np.concatenate([[0.0], moved])


def cycle_shares(steps: int) -> tuple[Array, int]:
    """Loads of a cycle over its peak, and how many of them are the first loading."""
    quarter = max(2, steps // 5)
    half = (steps - quarter) // 2
    legs: list[Any] = [
        np.linspace(0.0, 1.0, quarter + 1),
        np.linspace(1.0, -1.0, half + 1),
        np.linspace(-1.0, 1.0, half + 1),
    ]
    return np.concatenate([leg[1:] for leg in legs]), quarter


def closed_loop(
    case: Case,
    normal: Case,
    compliance: Array,
    limit: Array,
    *,
    peak: float,
    steps: int,
    unit: Array,
    copies: int,
    history: TangentialHistory | None = None,
) -> LoadPath:
    """First loading to ``peak``, then the closed loop +peak -> -peak -> +peak.

    Parameters
    ----------
    compliance, limit
        Of the loaded nodes: (n, n) or (2n, 2n) mm/N, and (n,) mu times the normal force in N.
    peak
        N on the model.
    steps
        Load steps in all, about a fifth of them on the first loading.
    unit
        (1 or 2,) direction of the load.
    copies
        Of the model in the whole contact.
    history
        Before the first step; None starts from no slip.
    """
    shares, quarter = cycle_shares(steps)
    path = tangential_path(
        compliance, limit, loads=load_history(peak * shares, unit), history=history
    )
    T, d = along(path, unit, copies)
    area = abs(float(np.trapezoid(T[quarter:], d[quarter:])))
    return LoadPath(
        case, normal, T, d, True, copies * float(np.sum(path.slip_work[quarter:])), area
    )
