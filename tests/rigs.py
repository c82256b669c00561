"""The rigs of the tests: coarser than the ready scenes', contact points on lines of nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Iterable

    from upd.analyses.forced.interface_model import SpringMarch
    from upd.analyses.forced.model import Model
    from upd.hbm import FrequencyResponse
    from upd.hbm.faces.state import InterfaceState
    from upd.results import Result

Array = NDArray[np.float64]
#: keys over a ready response
LINES: dict[str, Any] = {
    "geometry.across": 2,
    "geometry.base_columns": 3,
    "geometry.shank_layers": 3,
    "geometry.platform_layers": 3,
    "geometry.core_layers": 4,
    "contact.rule": "lines",
    "contact.rows": "all",
    "contact.columns": 3,
}
#: unit -> those that some analyses have in its place
_OTHER_UNITS = {"mm2": ("um2",), "mrad": ("urad",)}
#: the same as overrides
SET_LINES = tuple(f"{key}={value}" for key, value in LINES.items())
#: "symmetric-response" with a few points and one tangent a point
FEW_POINTS = (
    *SET_LINES,
    "mesh.element=hex8i",
    "contact.static=frictionless",
    'contact.stiffness=["thesis"]',
    "contact.rows=[1, 2]",
    "contact.columns=2",
    'contact.directions="one"',
    "reduction.modes=4",
)


def state_of(
    springs: SpringMarch, model: Model, answer: FrequencyResponse, i: int, force: float
) -> InterfaceState:
    """Where the motion at a point of a path stands at t = 0."""
    from upd.analyses.forced.interface_model import state_at

    f = float(answer.frequency[i])
    return state_at(springs, model, answer.balance, answer.x[i], f, force)


def stuck_motion(model: Model, f: Array) -> NDArray[np.complex128]:
    """(m, n) amplitudes of all dofs at (m,) Hz with every point stuck, mm per newton of F_E, by the
    whole matrices.
    """
    M, C, K, _ = model.linear(stuck=True)
    force = np.concatenate([model.force, np.zeros(len(M) - len(model.force))])
    omega = 2.0 * np.pi * model.excitation.lowest * f
    return np.array([np.linalg.solve(K + 1j * w * C - w**2 * M, force) for w in omega])


def undeclared(results: Iterable[Result]) -> list[str]:
    """Names that are not one declared number's, and those with a unit that it has not."""
    from upd.results.quantities import DECLARED, quantity_of

    found = []
    for one in results:
        name = one.name.removeprefix("left_")
        alike = [
            q for q in DECLARED.values() if name in (q.name, q.named(q.number_of(name) or "-"))
        ]
        exact = [q for q in alike if q.name == name]
        quantity, _ = quantity_of(one.name)
        units = {quantity.unit, *_OTHER_UNITS.get(quantity.unit, ())}
        if len(exact or alike) != 1 or one.unit not in units:
            found.append(f"{one.name}, {one.unit}")
    return found
