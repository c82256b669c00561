"""The rigs of the tests: coarser than the ready scenes', contact points on lines of nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from upd.analyses.forced.model import Model
    from upd.analyses.forced.spring_march import SpringMarch
    from upd.hbm import FrequencyResponse
    from upd.hbm.interface_state import InterfaceState

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
#: the same as overrides
SET_LINES = tuple(f"{key}={value}" for key, value in LINES.items())


def state_of(
    springs: SpringMarch, model: Model, answer: FrequencyResponse, i: int, force: float
) -> InterfaceState:
    """Where the motion at a point of a path stands at t = 0."""
    from upd.analyses.forced.spring_march import state_at

    f = float(answer.frequency[i])
    return state_at(springs, model, answer.balance, answer.x[i], f, force)
