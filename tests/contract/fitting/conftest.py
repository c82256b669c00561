"""The rig of all fits: reduced in seconds, contact points in one column, one harmonic."""

from __future__ import annotations

from typing import Any

import pytest
from rigs import LINES

_SMALL = {
    **LINES,
    "mesh.element": "hex8i",
    "geometry.refine": 0.5,
    "contact.stiffness": ["thesis"],
    "contact.columns": 1,
    "contact.static": "frictionless",
    "reduction.modes": 4,
    "balance.harmonics": 1,
    "excitation.points": 30,
    "accuracy": "unknown",
    "left_out.solve": "no",
    "want": ["response"],
}


@pytest.fixture(scope="session")
def small() -> dict[str, Any]:
    """Its keys over `asymmetric-response`."""
    return dict(_SMALL)
