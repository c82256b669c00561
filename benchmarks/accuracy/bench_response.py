"""Forced responses against closed forms, the public blade-damper-blade problem, time integration,
and stuck frequencies of the rig.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.plan import grid
from upd.hbm import FrequencyResponse, System, contacts, frequency_response
from upd.hbm.core.fourier import analysis, harmonics, synthesis
from upd.hbm.springs.points import march
from upd.hbm.springs.response import parabola
from upd.hbm.springs.time_integration import steady_state
from upd.reference import den_hartog_amplitude
from upd.reference.friction import (
    jenkins_harmonic,
    jenkins_optimum,
    jenkins_optimum_frequency,
    jenkins_peak,
    jenkins_peak_frequency,
)

# The benchmarks are no package: what they share is found by its folder.
sys.path.append(str(Path(__file__).parents[1]))
import blade_damper_blade as public
from rig_response import Rig, accelerance, curve, on_lines, rig

Row = dict[str, Any]
F, K_T = 0.2, 0.6
HZ = 1.0 / (2.0 * np.pi)
#: frequencies in Hz of the time march; harmonics of the balance; F_C/F_E; largest difference in per
#: cent
MARCHED, HIGHEST, RATIO, MARCH_TARGET = (350.0, 402.0, 433.0), 9, 194.0, 0.5
#: a lower patch: length up the slope, and places below the tip, in mm
LENGTH, OFFSETS = 6.0, (1.5, 5.0, 8.0)
#: Hz, measured with the symmetric damper; of which mode the thesis does not say
MEASURED = 340.0


def row(name: str, case: str, value: float, exact: float, target: float | None, note: str) -> Row:
    """Difference from the reference in per cent, with both numbers in words."""
    told = f"{value:.6g} against {exact:.6g} {note}"
    return {
        "name": name,
        "case": case,
        "value": 100.0 * (value / exact - 1.0),
        "unit": "%",
        "target": target,
        "note": told,
    }


def oscillator(
    limit: float, w: Any, *, k_t: float = K_T, load: float = F, **options: Any
) -> FrequencyResponse:
    """Undamped mass and spring of one on a Jenkins element with the friction limit in N; w in
    rad/s.
    """
    slider = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=k_t, mu=1.0, preload=limit)
    given: dict[str, Any] = {"harmonics": (1,), "samples": 1024} | options
    return frequency_response(
        System(([[1.0]], [[0.0]], [[1.0]]), slider, **given),
        harmonic_force=[load],
        frequencies=np.asarray(w) * HZ,
    )


def jenkins() -> Iterator[Row]:
    """First harmonic of the element, its resonance, the best friction limit."""
    h, limit = harmonics((1,)), 0.3
    for samples in (256, 4096, 8192):
        E, Q = synthesis(h, samples), analysis(h, samples)
        law = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=K_T, mu=1.0, preload=limit).law
        worst = 0.0
        for amplitude in limit / K_T * np.array([1.1, 2.0, 5.0, 50.0]):
            motion = np.array([[[0.0, 0.0], [amplitude, 0.0]]]) @ E.T
            found = march(law, motion, E).coefficients(Q)[0, 1]
            exact = jenkins_harmonic(amplitude, K_T, 1.0, limit)
            worst = max(worst, float(np.abs(found - exact).max() / np.hypot(*exact)))
        case = f"Jenkins element, {samples} samples"
        yield {
            "name": "error_jenkins_harmonic",
            "case": case,
            "value": 100 * worst,
            "unit": "%",
            "target": 1e-4,
            "note": "worst of four amplitudes, 1.1 to 50 times that of first slip",
        }
    limit = 0.8 * np.pi * F / 2
    w = jenkins_peak_frequency(limit, F, 1.0, 1.0, K_T)
    f, peak = oscillator(limit, np.linspace(0.9 * w, 1.1 * w, 401)).peak([1.0])
    yield row(
        "error_jenkins_peak",
        "oscillator, 1 harmonic, 0.8 of the best limit",
        peak,
        float(jenkins_peak(limit, F, K_T)),
        0.1,
        "mm",
    )
    yield row("error_jenkins_peak_frequency", "the same", f, float(w) * HZ, 0.1, "Hz")
    best, amplitude = jenkins_optimum(F, K_T)
    w = jenkins_optimum_frequency(1.0, 1.0, K_T)
    limits = float(best) * np.array([0.95, 1.0, 1.05])
    peaks = np.array(
        [oscillator(v, np.linspace(0.9 * w, 1.1 * w, 201)).peak([1.0])[1] for v in limits]
    )
    where, least = parabola(limits, -peaks)
    yield row(
        "error_optimum_amplitude",
        "best friction limit, one dof",
        -least,
        float(amplitude),
        0.1,
        "mm, pi F/k_t",
    )
    yield row(
        "error_optimum_limit",
        "the same, parabola through three limits 5 % apart",
        where,
        float(best),
        1.0,
        "N, pi F/2",
    )


def den_hartog() -> Iterator[Row]:
    """Rigid friction: a slider spring a million times as stiff."""
    for highest in (15, 63):
        for g in (0.8, 1.3):
            answer = oscillator(
                0.3, [g], k_t=1e6, load=1.0, harmonics=range(1, highest + 1, 2), samples=8192
            )
            x = answer.balance.E @ answer.coefficients[0, 0]
            case = f"Den Hartog, w/w_n = {g:g}, mu N/F = 0.3, odd harmonics to {highest}"
            yield row(
                "error_den_hartog",
                case,
                float(x.max()),
                float(den_hartog_amplitude(g, 0.3)),
                0.1,
                "x_0 k/F",
            )


def public_problem() -> Iterator[Row]:
    """Peak and four points with 15 harmonics and 256 samples.

    The band of answers at 160 Hz; energy balance.
    """
    grid = np.unique(
        np.concatenate(
            [np.linspace(*public.SWEEP, 91), np.linspace(162, 164, 41), list(public.POINTS)]
        )
    )
    begin = time.perf_counter()
    answer = public.response(grid, 15, 256)
    seconds = time.perf_counter() - begin
    case, told = (
        "blade-damper-blade, harmonics 0 to 15, 256 samples",
        f"m; {len(answer.frequency)} points, {answer.status}",
    )
    f, peak = answer.peak(public.Y2)
    yield row("error_peak", case, peak, public.PEAK[1], 0.1, told)
    yield {"name": "curve_seconds", "case": case, "value": seconds, "unit": "s"}
    yield {
        "name": "error_peak_frequency",
        "case": case,
        "value": f - public.PEAK[0],
        "unit": "Hz",
        "target": 0.05,
        "note": f"{f:.3f} Hz",
    }
    amplitude = answer.amplitude(public.Y2)
    for at, exact in public.POINTS.items():
        i = int(np.argmin(np.abs(answer.frequency - at)))
        yield row("error_point", f"{case}, {at:g} Hz", float(amplitude[i]), exact, 0.2, "m")
    # one point sticks over the whole cycle at 160 Hz and remembers its start: the answer is a band
    for start in ("lower", "upper"):
        value = float(
            public.response([145.0, 155.0, 160.0], 15, 256, start=start).amplitude(public.Y2)[-1]
        )
        told = "m; one end of the band of answers"
        yield row(
            "band_point",
            f"{case}, 160 Hz, sliders start {start}",
            value,
            public.POINTS[160.0],
            None,
            told,
        )
    worst = float(np.abs(answer.energy_balance).max())
    yield {
        "name": "error_energy_balance",
        "case": case,
        "value": worst,
        "target": 1e-9,
        "note": "largest along the path, of the work",
    }


def time_march() -> Iterator[Row]:
    """Harmonic balance against the same law integrated in time from its answer, on the asymmetric
    rig, every lattice node with the same spring.
    """
    built = on_lines("asymmetric-response", contact__share="equal")
    one = curve(built, RATIO, HIGHEST, np.unique(np.concatenate([grid(built.plan), MARCHED])))
    found = one.answer
    case = f"asymmetric rig, hex20, F_C/F_E {RATIO:g}, harmonics 0 to {HIGHEST}"
    yield {"name": "curve_seconds", "case": case, "value": one.seconds, "unit": "s"}
    top = measures.peak_index(found, built.model.row("right"))
    for f in MARCHED:
        at = np.flatnonzero(np.isclose(found.frequency, f, rtol=1e-9, atol=0.0))
        if not len(at):
            note = f"not reached: {found.message}"
            yield {"name": "error_against_march", "case": f"{case}, {f:g} Hz", "note": note}
        for i in at:
            yield marched(built, found, int(i), f"{case}, {f:.5g} Hz")
    yield marched(built, found, top, f"{case}, {found.frequency[top]:.5g} Hz, highest point")


def marched(built: Rig, found: FrequencyResponse, i: int, case: str) -> Row:
    """Point i of the path against the march from it."""
    f, out = float(found.frequency[i]), built.model.row("right")
    steady = steady_state(found.balance, f, found.x[i])
    force = built.plan.scene.damper.centrifugal / RATIO
    height, theirs = (
        accelerance(f, v, force) for v in (float(found.amplitude(out)[i]), steady.amplitude(out))
    )
    stick, slip, lift = 100.0 * found.state[i].mean(axis=0)
    told = (
        "all stick, linear"
        if found.linear[i]
        else f"stick {stick:.0f}, slip {slip:.0f}, lift-off {lift:.0f} %"
    )
    told = f"(m/s2)/N; march {steady.status}, {steady.periods} periods of 1024 steps; {told}"
    return row("error_against_march", case, height, theirs, MARCH_TARGET, told)


def stuck_frequencies() -> Iterator[Row]:
    """All points stuck: the rig on contact springs of the printed stiffness."""
    yield from shipped("asymmetric rig, as shipped", "asymmetric-response")
    yield from shipped("symmetric rig, as shipped", "symmetric-response")
    for offset in OFFSETS:
        yield from shipped(
            f"symmetric rig, patch 42.5 x {LENGTH:g} mm, {offset:g} mm below the tip",
            "symmetric-response",
            geometry__patch_length=f"{LENGTH} mm",
            geometry__patch_offset=f"{offset} mm",
        )


def shipped(case: str, name: str, **changes: Any) -> Iterator[Row]:
    """Both modes of a ready scene."""
    found = stuck_pair(rig(name, **changes))
    for in_phase, words in ((True, "in phase"), (False, "out of phase")):
        yield {
            "name": "track_stuck_frequency",
            "case": f"{case}, tips {words}",
            "value": found.get(in_phase, float("nan")),
            "unit": "Hz",
            "note": f"measured {MEASURED:g} Hz" * (in_phase and name == "symmetric-response"),
        }


def stuck_pair(built: Rig) -> dict[bool, float]:
    """Frequencies in Hz of the lowest modes across, by whether the tips move in phase."""
    return {
        m.in_phase: m.frequency for m in reversed(measures.mode_shapes(built.model, 1000.0).modes)
    }


def run() -> list[Row]:
    """All rows."""
    return [
        *jenkins(),
        *den_hartog(),
        *public_problem(),
        *stuck_frequencies(),
        *time_march(),
    ]


if __name__ == "__main__":
    for line in run():
        print(line)
