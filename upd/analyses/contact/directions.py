"""Directions of tangential loads: degrees from the patch's x, the component they run along, their names."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.plan import ACROSS, ALONG

Array = NDArray[np.float64]


def component(direction: float) -> int | None:
    """The component a tangential load runs along, or None for one between the axes."""
    return {0.0: ALONG, 90.0: ACROSS}.get(direction % 180.0)


def axis_of(direction: float) -> int:
    """The component of a direction that runs along an axis."""
    found = component(direction)
    assert found is not None
    return found


def direction_name(direction: float) -> str:
    """x, y or the angle."""
    return {0.0: "x", 90.0: "y"}.get(direction % 360.0, f"{direction:g}deg")


def unit_vector(direction: float, components: Sequence[int]) -> Array:
    """(n_component,) of the unit vector along ``direction`` in degrees."""
    radians = np.radians(direction)
    return np.asarray(np.array([np.cos(radians), np.sin(radians)])[list(components)])
