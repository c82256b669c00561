"""One path of a forced response: along the sweep, or in a narrow band around a peak."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.linear_peaks import finer, linear_modes
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.solution import PeakAgain
from upd.hbm import FrequencyResponse, Settings, frequency_response, harmonics
from upd.hbm.assembled import assembled
from upd.hbm.balance import Balance
from upd.hbm.fourier import sample_count

#: half width of the band around a peak in which it is followed again, as a share of its frequency,
#: and the points in it
BAND, BAND_POINTS = 0.02, 15
#: points in which it is looked for in the whole sweep
SWEEP_POINTS = 60
#: points a path may have: so many where points slip and stick, however few frequencies are asked
#: for, or so many per frequency
LEAST_POINTS, MOST_POINTS = 1800, 4
#: start positions of the sliders
STARTS = ("zero", "static", "mid", "upper", "lower")


def grid(plan: ForcedPlan) -> Array:
    """Frequencies of the sweep in Hz, those of the time march among them."""
    e = plan.scene.excitation
    return np.unique(
        np.concatenate([np.linspace(e.start, e.stop, e.points), plan.scene.balance.time_march])
    )


def fine_grid(plan: ForcedPlan, model: Model, force: float) -> Array:
    """Frequencies of the sweep in Hz, and finer ones around stuck modes where they are too coarse
    for these.

    Parameters
    ----------
    plan, model
        Of the rig.
    force
        F_E, N.
    """
    k = model.excitation.lowest
    problem = balance_of(plan, model, force, (0, *model.excitation.harmonics))
    modes, width = linear_modes(problem, True)
    return finer(grid(plan), modes / k, width / k)


def path_settings(points: int) -> Settings:
    """How far a path along so many frequencies may go."""
    return Settings(most_points=max(LEAST_POINTS, MOST_POINTS * points))


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
    problem = assembled(
        model.M,
        model.C,
        model.K,
        model.contacts,
        model.harmonic_force(force),
        model.static,
        joined_to=(model.damper, model.damper_rows),
        samples=samples or (None if b.samples == "auto" else b.samples),
        start=b.slider,
        slider=slider,
    )
    return problem(harmonics(numbers))


def balance_with(
    plan: ForcedPlan, model: Model, force: float, old: Balance, highest: int
) -> Balance:
    """The run's own problem with more harmonics: on the scene's samples, or on as many as these
    need where those cannot carry them.

    Parameters
    ----------
    force
        Excitation, N.
    old
        The problem of the run.
    highest
        The highest harmonic.
    """
    numbers, given = range(highest + 1), plan.scene.balance.samples
    carry = given == "auto" or int(given) > 2 * highest
    samples = None if carry else sample_count(harmonics(numbers))
    return balance_like(plan, model, force, old, numbers, samples)


def balance_like(
    plan: ForcedPlan,
    model: Model,
    force: float,
    old: Balance,
    numbers: Sequence[int],
    samples: int | None,
) -> Balance:
    """The run's own problem with other harmonics or samples.

    Parameters
    ----------
    old
        The problem of the run, from whose static state sliders start where the scene says so.
    force, numbers, samples
        As of `balance_of`.
    """
    b = balance_of(plan, model, force, numbers, samples)
    return b.with_sliders("static", old.slider) if old.start == "static" else b


def peak_again(
    plan: ForcedPlan, model: Model, force: float, at: float | None, choice: str, **changes: Any
) -> PeakAgain:
    """The right blade's highest peak near a frequency, followed with one choice changed.

    Parameters
    ----------
    force
        Excitation, N.
    at
        Hz, the middle of the band; None for the whole sweep.
    choice
        In words.
    **changes
        As `respond` takes them.
    """
    begin = time.perf_counter()
    e = plan.scene.excitation
    band = (
        np.linspace(e.start, e.stop, SWEEP_POINTS)
        if at is None
        else np.linspace((1 - BAND) * at, (1 + BAND) * at, BAND_POINTS)
    )
    found = respond(plan, model, force, band, **changes)
    took = time.perf_counter() - begin
    H = np.abs(measures.accelerance(found, model.row("right"), force))
    peaks = measures.path_peaks(found.frequency, H)
    f, height = max(peaks, key=lambda p: p.height)[:2] if peaks else (float("nan"), float("nan"))
    left_out = float(found.truncation.max(initial=0.0))
    return PeakAgain(choice, f, height, left_out, found.status, took)
