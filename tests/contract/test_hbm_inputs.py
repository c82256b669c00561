"""What the harmonic balance refuses, and what it says when an answer is not what it looks like."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_array

from upd.errors import InputError
from upd.hbm import (
    FrequencyResponse,
    System,
    contact_rows,
    contacts,
    frequency_response,
    harmonics,
    rigid_damper,
)

HZ = 1 / (2 * np.pi)
JENKINS = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=1.0, mu=1.0, preload=0.5)


def oscillator(**options: Any) -> FrequencyResponse:
    given: dict[str, Any] = {"harmonic_force": [0.3], "frequencies": [0.18]} | options
    matrices: Any = [given.pop(name, value) for name, value in _MATRICES.items()]
    names = ("static_force", "damper", "damper_rows", "harmonics", "samples", "start", "slider")
    own = {name: given.pop(name) for name in names if name in given}
    return frequency_response(System(matrices, given.pop("contacts", JENKINS), **own), **given)


_MATRICES: dict[str, Any] = {"M": [[1.0]], "C": [[0.02]], "K": [[1.0]]}


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"static_force": [50.0], "harmonics": (1, 3)}, r"static_force.*harmonics = \(0, 1, 3\)"),
        ({"harmonics": 5}, r"range\(6\)"),
        ({"harmonics": (0.5, 1)}, "whole numbers"),
        ({"harmonics": "many"}, "no set of whole numbers"),
        ({"harmonics": (0, 2)}, r"acts in 1, .*harmonics = \(0, 1, 2\)"),
        ({"start": "middle"}, "zero, frictionless, static, mid, upper, lower"),
        ({"K": csr_array(np.eye(1))}, r"K\.toarray\(\)"),
        ({"harmonic_force": {}}, "harmonic_force is empty"),
    ],
)
def test_bad_input_is_refused_with_its_remedy(change: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        oscillator(**change)


def test_centrifugal_force_needs_harmonic_0() -> None:
    damper = rigid_damper(1.0, [1.0, 1.0, 1.0], [0.0] * 3, [0.0, 0.0, 10.0], kept=(2,))
    rows = contact_rows(damper, [[0.0] * 3], [[[0.0, 0.0, 1.0]]])
    points = contacts([[-1.0]], k_n=2.0, mu=0.0)
    changes = {"contacts": points, "damper": damper, "damper_rows": rows}
    with pytest.raises(InputError, match=r"centrifugal force.*harmonic 0"):
        oscillator(harmonics=(1,), **changes)
    assert oscillator(harmonics=(0, 1), **changes).status == "complete"


def test_a_missing_harmonic_is_told() -> None:
    answer = oscillator(harmonics=(1, 3))
    for ask in (answer.amplitude, answer.peak):
        with pytest.raises(InputError, match="harmonic 2 is not among those kept above 0, 1, 3"):
            ask([1.0], harmonic=2)
    for ask in (answer.free, answer.stuck):
        with pytest.raises(InputError, match="harmonic 2"):
            ask([1.0], [0.18], 2)
    with pytest.raises(InputError, match=r"row has shape \(2,\)"):
        answer.amplitude([1.0, 0.0])


def test_stiffness_of_what_slides_is_asked_for() -> None:
    with pytest.raises(InputError, match="k_t is missing"):
        contacts([[0.0]], [[1.0]], k_n=0.0, mu=0.3, preload=1.0)
    for points in (
        contacts([[0.0]], [[1.0]], k_n=0.0, mu=0.0, preload=1.0),
        contacts([[1.0]], k_n=1.0, mu=0.3, preload=1.0),
    ):
        assert oscillator(contacts=points).status == "complete"


def test_excitation_of_a_higher_harmonic_alone() -> None:
    # at half the frequency, with twice the samples, it is the first one of the usual oscillator
    w = np.linspace(0.8, 1.6, 41) * HZ
    usual = oscillator(harmonics=(1, 3), frequencies=w, samples=512)
    second = oscillator(
        harmonics=(2, 6), harmonic_force={2: [0.3]}, frequencies=w / 2, samples=1024
    )
    shared = [
        np.argmin(np.abs(a.frequency[:, None] - f), axis=0)
        for a, f in ((usual, w), (second, w / 2))
    ]
    np.testing.assert_allclose(
        second.amplitude([1.0])[shared[1]], usual.amplitude([1.0])[shared[0]], rtol=1e-6
    )
    np.testing.assert_allclose(second.free([1.0], w / 2), usual.free([1.0], w), rtol=1e-12)
    np.testing.assert_allclose(second.stuck([1.0], w / 2), usual.stuck([1.0], w), rtol=1e-12)
    f, height = usual.peak([1.0])
    assert second.peak([1.0]) == pytest.approx((f / 2, height), rel=1e-5)
    assert second.amplitude([1.0], 2) == pytest.approx(second.amplitude([1.0]))


def test_static_sliders_without_a_static_solution_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        import_module("upd.hbm.springs.sweep"), "static_point", lambda *a, **k: None
    )
    answer = oscillator(start="static", harmonics=(0, 1))
    assert answer.status == "stopped"
    assert "static loads" in answer.message
    assert len(answer.frequency) == 0
    with pytest.raises(InputError, match="no point"):
        answer.peak([1.0])


def test_points_that_are_not_periodic_are_counted() -> None:
    # two directions forget their start only while they slip: just above the onset of slip that
    # takes more periods than are marched
    points = contacts(
        [[0.0, 0.0]], [[[1.0, 0.0]], [[0.0, 1.0]]], k_n=0.0, k_t=1.0, mu=1.0, preload=0.5
    )
    answer = frequency_response(
        System((np.eye(2), 0.05 * np.eye(2), np.diag([1.0, 1.2])), points, harmonics=(0, 1, 2, 3)),
        harmonic_force=[0.3, 0.29j],
        frequencies=np.linspace(0.10, 0.30, 81),
    )
    assert len(answer.periodic) == len(answer.frequency)
    astray = int((~answer.periodic).sum())
    assert 0 < astray < len(answer.frequency)
    assert answer.status == "not periodic"
    assert answer.arrived
    assert f"at {astray} of {len(answer.frequency)} points" in answer.message


def test_sets_of_harmonics() -> None:
    assert harmonics(range(4)).place(3) == 2
    assert harmonics((0, 2, 5)).place() == 0
    for bad in ((), 3, "13", (1, 2.5), None):
        with pytest.raises(InputError, match="harmonics"):
            harmonics(bad)  # type: ignore[arg-type]


@pytest.mark.parametrize("mu", [0.0, 0.5])
def test_damping_that_feeds_energy_is_refused(mu: float) -> None:
    joint = contacts([[0.0, 0.0]], [[1.0, 0.0]], k_n=0.0, k_t=1.0, mu=mu, preload=1.0)
    for C in (-0.05 * np.eye(2), [[0.05, 0.2], [0.2, 0.05]]):
        with pytest.raises(InputError, match="C feeds energy into a motion"):
            frequency_response(
                System((np.eye(2), C, np.eye(2)), joint),
                harmonic_force=[1.0, 0.0],
                frequencies=[0.1, 0.2],
            )


def test_no_damping_at_a_resonance_is_refused() -> None:
    joint = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=3.0, mu=1.0, preload=1e9)
    with pytest.raises(InputError, match="no damping at a resonance of the sticking contacts"):
        frequency_response(
            System(([[1.0]], [[0.0]], [[1.0]]), joint),
            harmonic_force=[1.0],
            frequencies=[2.0 / (2.0 * np.pi)],
        )
