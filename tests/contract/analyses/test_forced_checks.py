"""What the checks of a forced response say of points that are not periodic."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from upd.analyses.forced import checks
from upd.analyses.forced.curves import ForcedCurve


def test_points_that_are_not_periodic_are_counted() -> None:
    answer: Any = SimpleNamespace(
        periodic=np.array([True, False, True, False]), frequency=np.arange(4.0), status="complete"
    )
    curve = ForcedCurve("own", 60.0, 1.0, {}, {}, {}, answer, 0.0)
    check = checks.path_check(curve)
    assert check.value == 2
    assert not check.passed
    assert "at 2 points" in check.remedy
