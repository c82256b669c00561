"""Draw benchmarks/accuracy/in_phase_static.png.

What explains the first mode that the thesis measured with the asymmetric damper: its in-phase peak
at F_C/F_E 194 by stepped sine up and down, over T/N of either face before vibration, for several
stiffnesses of the vertical left face along itself, with faces worn in under F_C; and with faces
that fit without load, in the state that they find. Prints the numbers (two minutes).

./run.sh python benchmarks/static_states.py
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

# The benchmarks are no package: what they share is found by its folder.
sys.path.append(str(Path(__file__).parent))
from rig_response import Rig, rig

from upd.analyses.forced import measures
from upd.analyses.forced.interface_model import by_coulomb
from upd.analyses.forced.march_modes import stuck_modes_of
from upd.analyses.forced.model import Model, preloaded
from upd.analyses.forced.plan import MARCH_SAMPLES
from upd.analyses.forced.solution import CANDIDATES
from upd.analyses.forced.statics import static_state
from upd.analyses.forced.sweeps import make_springs, march_sweep, spread, swept
from upd.errors import InputError
from upd.hbm.interface_march import InterfaceMarch
from upd.hbm.interface_state import resting
from upd.scene.forced_contact import SIDES

mpl.use("Agg")
from matplotlib import pyplot as plt

PICTURE = Path(__file__).parent / "accuracy" / "in_phase_static.png"
SCENE, RATIO = "asymmetric-response", 194.0
#: Hz, measured in the thesis -> which mode
MEASURED = {377.0: "first", 440.0: "second"}
#: N/mm of the left face along itself -> colour; the first is the ready scene's
LEFT_KT = {1e6: "#1f5fa8", 3e5: "#d98200", 1e5: "#c0392b"}
#: T/N of one face while the other has none
RIGHT = (-0.6, -0.4, -0.2, 0.0, 0.1, 0.2, 0.3, 0.4, 0.45, 0.5, 0.57)
LEFT = (-0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6)
#: Hz between which the in-phase peak is swept
SWEPT = (280.0, 425.0)
#: steps in which F_C is raised on faces that fit without load, and periods at each
RAISED, PERIODS = 20, 40


@dataclass(frozen=True)
class Peak:
    """The right blade's in-phase peak, up and down: Hz and (m/s2)/N; N and T of both faces, N.

    Unsettled: share of the frequencies at which no motion repeated.
    """

    frequency: NDArray[np.float64]
    height: NDArray[np.float64]
    N: NDArray[np.float64]
    T: NDArray[np.float64]
    unsettled: float


def in_phase(built: Rig, model: Model, start: Any, N: Any, T: Any) -> Peak:
    """The peak by sweeps up from a state, and down from where that ends."""
    march, force = (
        make_springs(built.plan, model).march,
        built.plan.scene.damper.centrifugal / RATIO,
    )
    modes = stuck_modes_of(march, CANDIDATES * built.plan.scene.excitation.stop)
    state, found, missed, grid = start, [], [], spread(*SWEPT)
    for way, f in (("up", grid), ("down", grid[::-1])):
        one = march_sweep(march, f, force, state)
        state = one.state
        curve = swept("", RATIO, force, way, one, modes)  # type: ignore[arg-type]
        peaks = [p for p in curve.peaks["right"] if p.number == 1]
        # no peak where the curve only rises to an end of the range
        found.append((peaks[0].frequency, peaks[0].height) if peaks else (np.nan, np.nan))
        missed.append(1.0 - one.settled.mean())
    both = np.array(found)
    return Peak(both[:, 0], both[:, 1], np.asarray(N), np.asarray(T), float(np.mean(missed)))


def worn(built: Rig, left: float, right: float) -> Peak | None:
    """Faces worn in under F_C with these T/N; None where such a state does not exist."""
    try:
        state = static_state(built.plan, built.bodies, {"left": left, "right": right})
        model = preloaded(built.model, state)
        start = make_springs(built.plan, model).at_rest()
    except InputError as error:
        print(f"T/N {left:g} and {right:g}: {error}")
        return None
    return in_phase(built, model, start, state.N, state.T)


def unloaded(built: Rig) -> Peak:
    """Faces that fit without load, F_C raised from nothing so slowly that nothing swings."""
    march = make_springs(built.plan, built.model).march
    n, still = march.n, np.zeros(len(march.load))
    bare = replace(march, load=still)
    state = resting(bare, np.zeros((n, 3)), np.zeros((n, 2)), march.gap, still)
    for k in range(1, RAISED + 1):
        raised = replace(march, load=k / RAISED * march.load)
        one = InterfaceMarch(raised, SWEPT[0], [0.0], MARCH_SAMPLES, by_coulomb)
        for _ in range(PERIODS):
            one.period(state)
        state.held[:] = state.p
    f = state.f.reshape(3, n)
    N, T = ([float(f[k][built.model.face == side].sum()) for side in (0, 1)] for k in (0, 2))
    return in_phase(built, built.model, state, N, T)


def told(peak: Peak) -> str:
    """In words."""
    f, h = peak.frequency, peak.height
    return (
        f"up {f[0]:.1f} Hz {h[0]:.1f}, down {f[1]:.1f} Hz {h[1]:.1f} (m/s2)/N; "
        f"left N {peak.N[0]:.1f} T {peak.T[0]:.1f}, right N {peak.N[1]:.1f} T {peak.T[1]:.1f} N; "
        f"not settled {100 * peak.unsettled:.0f} %"
    )


@dataclass(frozen=True)
class Family:
    """Peaks of one stiffness of the left face: face whose T/N varies -> T/N and peak; the stuck
    modes in phase and out of phase, Hz; the peak of faces that fit without load.
    """

    k_t: float
    stuck: tuple[float, float]
    worn: dict[str, list[tuple[float, Peak]]]
    unloaded: Peak


def stuck(built: Rig) -> tuple[float, float]:
    """Hz of the lowest modes in phase and out of phase with every point stuck."""
    modes = [m for m in measures.stuck_modes(built.model, 1000.0) if m.axis == "x"]
    first, second = (
        next(m.frequency for m in modes if m.in_phase == phase) for phase in (True, False)
    )
    return first, second


def swept_worn(built: Rig) -> dict[str, list[tuple[float, Peak]]]:
    """Which face's T/N varies -> T/N and peak."""
    out: dict[str, list[tuple[float, Peak]]] = {}
    for side, ratios in (("right", RIGHT), ("left", LEFT)):
        out[side] = []
        for ratio in ratios:
            peak = worn(built, *((0.0, ratio) if side == "right" else (ratio, 0.0)))
            if peak is not None:
                print(f"  {side} T/N {ratio:g}: {told(peak)}", flush=True)
                out[side].append((ratio, peak))
    return out


def families() -> Iterator[Family]:
    """Sweep and print."""
    bodies = None
    for k_t in LEFT_KT:
        left = {"K_N": "1e6 N/mm", "K_T": f"{k_t:g} N/mm"}
        built = rig(SCENE, bodies, stiffness__thesis__left=left)
        bodies, linear = built.bodies, stuck(built)
        print(f"left K_T {k_t:g} N/mm, stuck {linear[0]:.1f} and {linear[1]:.1f} Hz", flush=True)
        found = swept_worn(built)
        fresh = rig(SCENE, bodies, stiffness__thesis__left=left, contact__fit="unloaded")
        peak = unloaded(fresh)
        print(f"  unloaded: {told(peak)}", flush=True)
        yield Family(k_t, linear, found, peak)


def draw(found: Iterable[Family], picture: Path) -> None:
    """Both panels."""
    fig, axes = plt.subplots(1, 2, figsize=(10.0, 4.8), sharey=True, layout="constrained")
    axis = dict(zip(("right", "left"), axes, strict=True))
    for one in found:
        color = LEFT_KT[one.k_t]
        label = f"left $K_T$ {one.k_t:.0e} N/mm".replace("e+0", "e")
        for side, points in one.worn.items():
            ax, x = axis[side], [ratio for ratio, _ in points]
            f = np.array([p.frequency for _, p in points])
            ax.fill_between(x, f.min(axis=1), f.max(axis=1), color=color, alpha=0.18, lw=0)
            ax.plot(x, f[:, 0], "^-", color=color, ms=4, lw=1.4, label=f"{label}, sweep up")
            ax.plot(x, f[:, 1], "v--", color=color, ms=4, lw=1.0, label=f"{label}, down")
            ax.axhline(one.stuck[0], color=color, lw=0.8, ls=":")
        for side, N, T in zip(SIDES, one.unloaded.N, one.unloaded.T, strict=True):
            if N > 0.0:
                x, f = [T / N] * 2, one.unloaded.frequency
                axis[side].plot(x, f, "s", mfc="none", color=color, ms=7)
    for side, ax in axis.items():
        other = "left" if side == "right" else "right"
        for f, words in MEASURED.items():
            ax.axhline(f, color="black", lw=1.2)
            ax.annotate(
                f"thesis, {words} mode: {f:g} Hz",
                (0.02, f),
                (0, 3),
                xycoords=("axes fraction", "data"),
                textcoords="offset points",
                fontsize=8,
            )
        ax.set(xlabel=f"T/N of the {side} face before vibration ({other}: 0)", ylim=(284.0, 450.0))
        ax.grid(True, color="#dddddd", lw=0.6)
    axes[0].set_ylabel("in-phase peak of the right blade, Hz")
    axes[0].plot([], [], "s", mfc="none", color="black", label="faces that fit without load")
    axes[0].plot([], [], ":", color="black", lw=0.8, label="everything stuck")
    axes[0].legend(fontsize=7.5, loc="lower left")
    fig.suptitle("Asymmetric damper, $F_C/F_E$ = 194: the first peak over the state at rest")
    fig.savefig(picture, dpi=110)
    plt.close(fig)


def main(picture: Path = PICTURE) -> None:
    """Sweep, print and draw."""
    draw(list(families()), picture)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
