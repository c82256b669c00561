"""What the checks of a forced response say of a march without a period."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from upd.analyses.forced import checks
from upd.analyses.forced.curves import ForcedCurve
from upd.analyses.forced.results import make_results
from upd.analyses.forced.solution import ForcedSolution, TimeMarch
from upd.hbm import SteadyState
from upd.hbm.fourier import harmonics
from upd.results import Case

CASE = Case(stiffness="own", force_ratio=60.0)


def marched(status: str) -> TimeMarch:
    """A march that hits the harmonic balance to the last digit."""
    coefficients = np.array([[0.0, 1.0, 0.0]])
    nothing = np.zeros((1, 1, 4))
    steady = SteadyState(coefficients, nothing, nothing, 2000, 0.1, status, f"{status} after 2000")
    answer = SimpleNamespace(harmonics=harmonics((0, 1)))
    curve: Any = SimpleNamespace(case=CASE, stiffness="own", force=1.0, answer=answer)
    height = 1e-3 * (2 * np.pi * 300.0) ** 2
    return TimeMarch(curve, 300.0, height, steady)


def solution(march: TimeMarch) -> Any:
    model = SimpleNamespace(row=lambda side: np.ones(1), excitation=SimpleNamespace(lowest=1))
    return SimpleNamespace(
        models={"own": model},
        marches=[march],
        faces={},
        sweeps=[],
        balanced=[],
        band=[],
        effects={},
        linear={},
        curves=[],
        performances={},
        plan=SimpleNamespace(
            scene=SimpleNamespace(measured={}, excitation=SimpleNamespace(damping=0.005))
        ),
    )


@pytest.mark.parametrize(
    ("status", "verdict"), [("periodic", "passed"), ("period limit", "warning")]
)
def test_only_a_periodic_march_verifies_a_number(
    status: str, verdict: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found: ForcedSolution = solution(marched(status))
    check = checks._march(found, found.marches[0])
    assert (check.verdict == "warning") == (verdict == "warning")
    assert check.passed == (verdict == "passed")
    results = import_results(monkeypatch)
    names = [result.name for result in results(found)]
    assert ("time_march_accelerance" in names) == (status == "periodic")
    assert status in check.remedy


def import_results(monkeypatch: pytest.MonkeyPatch) -> Any:
    """`make_results` without the numbers of models."""
    monkeypatch.setattr("upd.analyses.forced.results._model_results", lambda name, model: [])
    return make_results


def test_points_that_are_not_periodic_are_counted() -> None:
    answer: Any = SimpleNamespace(
        periodic=np.array([True, False, True, False]), frequency=np.arange(4.0), arrived=True
    )
    curve = ForcedCurve("own", 60.0, 1.0, {}, {}, {}, answer, 0.0)
    check = checks._path(curve)
    assert check.value == 2
    assert not check.passed
    assert "at 2 points" in check.remedy
