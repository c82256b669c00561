"""Forced responses against closed forms, the public blade-damper-blade problem, time integration,
and stuck frequencies of the rig.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.performance import peaks_at
from upd.analyses.forced.plan import grid
from upd.hbm import FrequencyResponse, contacts, frequency_response
from upd.hbm.fourier import analysis, harmonics, synthesis
from upd.hbm.friction import harmonic_force
from upd.hbm.march import steady_state
from upd.hbm.response import parabola
from upd.reference.den_hartog import den_hartog_amplitude
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
MARCHED, HIGHEST, RATIO, MARCH_TARGET = (350.0, 402.0, 433.0), (1, 5, 9, 15), 194.0, 0.5
#: solid blades, rigid damper, distributed springs, an independent model of the reconstructed rig:
#: rows of contact nodes -> in Hz, tips in phase and out of phase
SYMMETRIC: dict[str, tuple[Any, float, float]] = {
    "full face": ("all", 406.3, 450.0),
    "rows 1-2": ([1, 2], 339.0, 440.9),
    "rows 0-1": ([0, 1], 327.7, 434.9),
}
#: the same for one row of nodes, which row is not said
ONE_ROW, ROWS = (294.0, 445.5), 5
ASYMMETRIC = (410.9, 432.8)
#: a lower patch, whole face: length up the slope and place below the tip in mm, width (None: all)
PATCHES = [
    (length, offset, width)
    for length, width in ((6.0, None), (6.0, 17.0))
    for offset in (1.5, 5.0, 8.0)
]
#: F_C/F_E -> peaks of the right blade in phase and out of phase, Hz and (m/s2)/N, frictionless
#: static state, an independent program on the reconstructed rig (asymmetric at 194 in phase: its
#: time integration); without the one that folds
FRICTION: dict[str, dict[float, tuple[tuple[float, float] | None, ...]]] = {
    "asymmetric": {
        2000.0: ((404.2, 179.0), (432.8, 220.0)),
        600.0: ((401.6, 157.0), (432.8, 220.0)),
        194.0: ((397.5, 74.4), None),
    },
    "symmetric": {
        2000.0: ((404.5, 205.0), (450.6, 193.0)),
        600.0: ((399.5, 201.0), (450.6, 193.0)),
        194.0: ((393.0, 80.0), (446.2, 178.0)),
    },
}
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
    given = {"harmonics": (1,), "samples": 1024} | options
    return frequency_response(
        [[1.0]],
        [[0.0]],
        [[1.0]],
        slider,
        harmonic_force=[load],
        frequencies=np.asarray(w) * HZ,
        **given,
    )  # type: ignore[arg-type]


def jenkins() -> Iterator[Row]:
    """First harmonic of the element, its resonance, the best friction limit."""
    h, limit = harmonics((1,)), 0.3
    for samples in (256, 4096, 8192):
        E, Q = synthesis(h, samples), analysis(h, samples)
        law = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=K_T, mu=1.0, preload=limit).law
        worst = 0.0
        for amplitude in limit / K_T * np.array([1.1, 2.0, 5.0, 50.0]):
            found = harmonic_force(law, np.array([[[0.0, 0.0], [amplitude, 0.0]]]), E, Q).force[
                0, 1
            ]
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
    ends: dict[float, list[float]] = {f: [] for f in MARCHED}
    for highest in HIGHEST:
        one = curve(built, RATIO, highest, np.unique(np.concatenate([grid(built.plan), MARCHED])))
        found = one.answer
        yield {
            "name": "curve_seconds",
            "case": f"asymmetric rig, hex20, F_C/F_E {RATIO:g}, harmonics 0 to {highest}",
            "value": one.seconds,
            "unit": "s",
        }
        at = [
            (f, int(i))
            for f in MARCHED
            for i in np.flatnonzero(np.isclose(found.frequency, f, rtol=1e-9, atol=0.0))
        ]
        top = measures.peak_index(found, built.model.row("right"))
        for f, i in [*at, (float(found.frequency[top]), top)]:
            case = (
                f"asymmetric rig, hex20, F_C/F_E {RATIO:g}, harmonics 0 to {highest}, {f:.5g} "
                f"Hz{', highest point' * (i == top)}"
            )
            line, end = marched(built, found, i, case)
            ends.setdefault(f, []).append(end)
            yield line
        for f in set(MARCHED) - {f for f, _ in at}:
            yield {
                "name": "error_against_march",
                "case": f"harmonics 0 to {highest}, {f:g} Hz",
                "note": f"not reached: {found.message}",
            }
    for f in MARCHED:
        told = f"between the marches from the answers with {', '.join(map(str, HIGHEST))} harmonics"
        spread = 100.0 * (max(ends[f]) / min(ends[f]) - 1.0) if ends[f] else float("nan")
        yield {
            "name": "spread_march",
            "case": f"asymmetric rig, {f:g} Hz",
            "value": spread,
            "unit": "%",
            "note": told,
        }


def marched(built: Rig, found: FrequencyResponse, i: int, case: str) -> tuple[Row, float]:
    """Point i of the path against the march from it, and the march's accelerance."""
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
    return row("error_against_march", case, height, theirs, MARCH_TARGET, told), theirs


def stuck_frequencies() -> Iterator[Row]:
    """All points stuck: the rig on contact springs of the printed stiffness.

    The asymmetric one with the same spring at every node, as when the two models were compared.
    """
    bodies = None
    for name, (rows, *exact) in SYMMETRIC.items():
        built = on_lines("symmetric-response", bodies, contact__rows=rows)
        bodies = built.bodies
        yield from stuck(built, f"symmetric rig, {name}", exact)
    for line in range(ROWS):
        built = on_lines("symmetric-response", bodies, contact__rows=[line])
        yield from stuck(
            built,
            f"symmetric rig, one row, number {line} from below",
            ONE_ROW,
            "Hz; the reference does not say which row",
        )
    built = on_lines("asymmetric-response", contact__share="equal")
    yield from stuck(built, "asymmetric rig", ASYMMETRIC)
    yield from shipped("asymmetric rig, as shipped", "asymmetric-response")
    yield from shipped("symmetric rig, as shipped", "symmetric-response")
    for length, offset, width in PATCHES:
        across = {} if width is None else {"geometry__patch_width": f"{width} mm"}
        case = f"symmetric rig, patch {42.5 if width is None else width:g} x {length:g} mm"
        yield from shipped(
            f"{case}, {offset:g} mm below the tip",
            "symmetric-response",
            geometry__patch_length=f"{length} mm",
            geometry__patch_offset=f"{offset} mm",
            **across,
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
        m.in_phase: m.frequency
        for m in reversed(measures.stuck_modes(built.model, 1000.0))
        if m.axis == "x"
    }


def stuck(built: Rig, case: str, exact: Sequence[float], note: str = "Hz") -> Iterator[Row]:
    """Both modes beside the independent model."""
    found = stuck_pair(built)
    for in_phase, reference, words in zip(
        (True, False), exact, ("in phase", "out of phase"), strict=True
    ):
        yield row(
            "error_stuck_frequency",
            f"{case}, tips {words}",
            found.get(in_phase, float("nan")),
            reference,
            1.0,
            note,
        )


def with_friction() -> Iterator[Row]:
    """Peaks on the mesh and the contact points of the independent program: every line of nodes."""
    for name, curves in FRICTION.items():
        built = on_lines(f"{name}-response")
        for ratio, exact in curves.items():
            peaks = peaks_at(built.plan, built.model, ratio, 7).peaks
            for number, reference in enumerate(exact, 1):
                found = [p for p in peaks if p.blade == "right" and p.number == number]
                case = f"{name} rig, F_C/F_E {ratio:g}, {('in', 'out of')[number - 1]} phase"
                for p in found if reference is not None else ():
                    assert reference is not None
                    f, height = reference
                    yield row("error_peak_frequency", case, p.frequency, f, 1.0, "Hz")
                    yield row("error_peak_height", case, p.height, height, 1.0, "(m/s2)/N")


def run() -> list[Row]:
    """All rows."""
    return [
        *jenkins(),
        *den_hartog(),
        *public_problem(),
        *stuck_frequencies(),
        *with_friction(),
        *time_march(),
    ]


if __name__ == "__main__":
    for line in run():
        print(line)
