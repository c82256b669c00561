"""One path of a forced response: along the sweep, or in a narrow band around a peak."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.plan import ForcedPlan
from upd.hbm import FrequencyResponse, Settings, frequency_response, harmonics
from upd.hbm.springs.balance import Balance, assembled

#: half width of the band around a peak in which it is looked for, as a share of its frequency, and
#: the points in it
BAND, BAND_POINTS = 0.02, 15
#: points in which it is looked for in the whole sweep
SWEEP_POINTS = 60
#: points a path may have: so many where points slip and stick, however few frequencies are asked
#: for, or so many per frequency
LEAST_POINTS, MOST_POINTS = 1800, 4
#: steps of a path whose tops are climbed to afterwards: half the points of the usual ones, and tops
#: between them that differ by 0.2 % in height
LONG_STEPS = Settings(angle=0.7, kink_step=0.1, wanted_iterations=8)


def path_settings(points: int) -> Settings:
    """How far a path along so many frequencies may go."""
    return replace(LONG_STEPS, most_points=max(LEAST_POINTS, MOST_POINTS * points))


def respond(
    plan: ForcedPlan, model: Model, force: float, frequencies: Array, **changes: Any
) -> FrequencyResponse:
    """The harmonic balance of one model along the frequencies.

    Parameters
    ----------
    force
        Excitation, N.
    frequencies
        (n,) Hz.
    **changes
        Replace the scene's harmonics, samples, start of the sliders, or settings of the path.
    """
    b = plan.scene.balance
    usual: dict[str, Any] = {
        "harmonics": plan.scene.harmonic_numbers,
        "samples": None if b.samples == "auto" else b.samples,
        "start": b.slider,
        "slider": model.slider,
        "settings": path_settings(len(frequencies)),
    }
    return frequency_response(
        model.M,
        model.C,
        model.K,
        model.contacts,
        harmonic_force=model.harmonic_force(force),
        static_force=model.static,
        frequencies=frequencies,
        damper=model.damper,
        damper_rows=model.damper_rows,
        **(usual | changes),
    )


def balance_of(
    plan: ForcedPlan,
    model: Model,
    force: float,
    numbers: Sequence[int],
    samples: int | None = None,
) -> Balance:
    """The problem that `respond` follows, with these harmonics.

    Parameters
    ----------
    force
        Excitation, N.
    numbers
        Of the harmonics.
    samples
        Per period; those of the scene when None.
    """
    b = plan.scene.balance
    given = model.slider
    slider = None
    if given is not None:
        slider = np.zeros((len(given), 2))
        slider[:, : given.shape[1]] = given
    return assembled(
        model.M,
        model.C,
        model.K,
        model.contacts,
        model.harmonic_force(force),
        model.static,
        harmonics(numbers),
        joined_to=(model.damper, model.damper_rows),
        samples=samples or (None if b.samples == "auto" else b.samples),
        start=b.slider,
        slider=slider,
    )


@contextmanager
def quiet() -> Iterator[None]:
    """Warnings of single paths are not the run's: its checks measure the peaks."""
    solver = logging.getLogger("upd.hbm")
    level = solver.level
    solver.setLevel(logging.ERROR)
    try:
        yield
    finally:
        solver.setLevel(level)
