"""The march of both ready rigs on springs against an explicit integration of the full modal model,
and the balance against the march, at F_C/F_E 600 and 194.

Stiffness printed in the thesis, faces worn in under F_C, static state of the ready scenes. The
explicit march (`benchmarks/explicit_march.py`) has all modes of the reduced blades, central
differences far below the fastest, springs with Jenkins sliders of its own; it begins where the
march has settled, and at a peak from rest too, which tells whether there is one motion. What
differs is taken apart by more steps, by more modes that swing instead of following statically, and
where it is too much by half of the explicit step; beside it stands what a run would tell of it from
twice the steps.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

# The benchmarks are no package: what they share is found by its folder.
sys.path.append(str(Path(__file__).parents[1]))
from explicit_march import STEP, ExplicitMarch, explicit_march
from rig_response import Rig, rig

from upd.analyses.forced.interface_model import (
    SpringMarch,
    by_coulomb,
    make_springs,
    spring_march,
    state_at,
)
from upd.analyses.forced.model import respond
from upd.analyses.forced.plan import MARCH_SAMPLES
from upd.hbm.faces.march import InterfaceMarch
from upd.hbm.faces.state import InterfaceState
from upd.hbm.faces.sweep import SteadyPoint, settle

Row = dict[str, Any]
RIGHT = 1
#: per cent: march against explicit march; balance against march, by F_C/F_E
EXPLICIT, BALANCE = 0.2, {600.0: 0.5, 194.0: 0.3}
#: rig -> F_C/F_E -> Hz at which points slip or open: flanks and tops of both peaks
CHECKED = {
    "symmetric": {600.0: (400.0, 403.0, 406.0, 451.0), 194.0: (397.0, 400.0, 448.0, 451.0, 457.0)},
    "asymmetric": {600.0: (397.0, 403.0, 406.0, 433.0), 194.0: (400.0, 433.0, 436.0, 442.0)},
}
#: the same for the balance: at 194 flanks of peaks only, away from where sweeps up and down differ
FLANKS = {
    "symmetric": {600.0: (400.0, 403.0, 406.0, 451.0), 194.0: (388.0, 451.0, 454.0, 457.0, 460.0)},
    "asymmetric": {600.0: (397.0, 403.0, 406.0, 433.0), 194.0: (385.0, 427.0, 436.0, 439.0)},
}
#: Hz at which the explicit march begins from rest too
PEAK = {"symmetric": {600.0: 403.0, 194.0: 448.0}, "asymmetric": {600.0: 403.0, 194.0: 433.0}}
#: what the march is refined to
STEPS, MODES = (256, 512, 1024, 2048), 30
HARMONICS = (3, 5, 9)
TOLERANCE, MOST = 1e-4, 2000


def run() -> Iterator[Row]:
    """Differences in per cent of the right blade's accelerance."""
    for name, checked in CHECKED.items():
        built = rig(f"{name}-response")
        full = explicit_march(built.model, built.plan.scene.excitation.damping)
        yield from stability(name, full)
        for ratio, frequencies in checked.items():
            for f in frequencies:
                yield from explicitly(name, built, full, ratio, f)
            yield from balanced(name, built, ratio)


def stability(name: str, full: ExplicitMarch) -> Iterator[Row]:
    """The explicit march with half of its step."""
    force, f = 350.0 / 600.0, 403.0
    one, other = (
        abs(full.steady(f, force, full.at_rest(), step=step)[0][RIGHT])
        for step in (STEP, 0.5 * STEP)
    )
    yield {
        "name": "explicit_march_step",
        "case": f"{name}, F_C/F_E 600, {f:g} Hz",
        "value": 100.0 * (one / other - 1.0),
        "unit": "%",
        "note": f"twice as many steps; {len(full.omega)} unknowns, fastest "
        f"{full.fastest / 2e3 / np.pi:.0f} kHz",
    }


def settled(
    springs: SpringMarch, f: float, force: float, at: InterfaceState, steps: int = MARCH_SAMPLES
) -> SteadyPoint:
    """The march from a state, which it overwrites."""
    return settle(InterfaceMarch(springs.march, f, [force], steps, by_coulomb), at, TOLERANCE, MOST)


def explicitly(name: str, built: Rig, full: ExplicitMarch, ratio: float, f: float) -> Iterator[Row]:
    """The march's steady motion, and what the explicit march makes of it."""
    force = built.plan.scene.damper.centrifugal / ratio
    springs = make_springs(built.plan, built.model)
    state = springs.at_rest()
    point = settled(springs, f, force, state)
    mine = abs(point.harmonics[0, RIGHT])
    found, periods, change = full.steady(f, force, full.at(springs, state, force))
    truth = abs(found[RIGHT])
    fresh = ""
    if f == PEAK[name][ratio]:
        other = abs(full.steady(f, force, full.at_rest())[0][RIGHT])
        fresh = f"explicit from rest {100 * (other / truth - 1):+.3f}, "
    height = 1e-3 * (2.0 * np.pi * f) ** 2 * truth / force
    share = ", ".join(
        f"{100 * part:.1f} % {word}"
        for part, word in zip(point.last.counts, ("open", "stick", "slip"), strict=True)
    )
    into, damped, rubbed = point.last.energy
    off = float(100.0 * (mine / truth - 1.0))
    missed = abs(off) > EXPLICIT
    steps = STEPS if missed else STEPS[-1:]
    finer = [("steps", n, against(springs, f, force, truth, n, state)) for n in steps]
    closer = ""
    if missed:
        found, *_ = full.steady(f, force, full.at(springs, state, force), step=0.5 * STEP)
        change = (1.0 + finer[0][2] / 100.0) / (1.0 + off / 100.0)
        closer = (
            f"explicit with half its step {100 * (abs(found[RIGHT]) / truth - 1):+.4f}, "
            f"{steps[0]} steps change it by {100 * (change - 1):+.2f} %; "
        )
    more = spring_march(built.model, built.plan.scene.excitation.damping, MODES, 1)
    same = with_more_modes(full, springs, more, state, force)
    finer += [
        (f"steps and {MODES} modes", n, against(more, f, force, truth, n, same))
        for n in (MARCH_SAMPLES, STEPS[-1])
    ]
    told = ", ".join(f"{n} {words} {part:+.3f}" for words, n, part in finer)
    yield {
        "name": "march_against_explicit",
        "case": f"{name}, F_C/F_E {ratio:g}, {f:g} Hz, {MARCH_SAMPLES} steps, "
        f"{len(springs.march.frequency)} modes",
        "value": off,
        "unit": "%",
        "target": EXPLICIT,
        "note": f"{met(off, EXPLICIT)}; {height:.2f} (m/s2)/N, {share}; "
        f"{told}; {closer}{fresh}explicit after {periods} periods changes by "
        f"{100 * change:.1e} %; energy left {100 * (1 - (damped + rubbed) / into):.2f} %"
        + ("" if point.settled else "; march not settled"),
    }


def against(
    springs: SpringMarch, f: float, force: float, truth: float, steps: int, at: InterfaceState
) -> float:
    """Per cent of a finer march."""
    point = settled(springs, f, force, at.copy(), steps)
    return float(100.0 * (abs(point.harmonics[0, RIGHT]) / truth - 1.0))


def with_more_modes(
    full: ExplicitMarch,
    springs: SpringMarch,
    more: SpringMarch,
    state: InterfaceState,
    force: float,
) -> InterfaceState:
    """The same motion, forces and slips for a march of more modes; those begin where they would
    stand still.
    """
    march, m = more.march, len(more.march.frequency)
    y, v, _ = full.at(springs, state, force)
    turn = more.modes @ full.shapes[:, :m]
    held = march.shapes.T @ more.rest.T.ravel()
    return replace(
        state.copy(),
        q=turn @ y[:m] + held / march.omega**2,
        v=turn @ v[:m],
        p=march.shapes.T @ state.f + march.places[:, 0] * force,
        held=held,
    )


def met(value: float, target: float) -> str:
    """In a word."""
    return "met" if abs(value) <= target else "MISSED"


def balanced(name: str, built: Rig, ratio: float) -> Iterator[Row]:
    """The balance against the march that begins in its own motion, residual slips included: what
    truncation and step do; beside it the march that comes from rest: what another past does.
    """
    plan, model = built.plan, built.model
    force, asked = plan.scene.damper.centrifugal / ratio, FLANKS[name][ratio]
    springs = make_springs(plan, model)
    e = plan.scene.excitation
    grid = np.unique(np.concatenate([np.linspace(e.start, e.stop, 111), asked]))
    answers = {h: respond(plan, model, force, grid, harmonics=range(h + 1)) for h in HARMONICS}
    for f in asked:
        fresh = abs(settled(springs, f, force, springs.at_rest()).harmonics[0, RIGHT])
        off, rest, why = {}, {}, ""
        for h, answer in answers.items():
            at = np.flatnonzero(np.isclose(answer.frequency, f, rtol=1e-9, atol=0.0))
            if not len(at):
                why = f"; {h} harmonics: not reached, {answer.message}"
                continue
            i = int(at[0])
            here = float(answer.amplitude(model.row("right"))[i])
            state = state_at(springs, model, answer.balance, answer.x[i], f, force)
            one = settled(springs, f, force, state)
            there = abs(one.harmonics[0, RIGHT])
            off[h] = float(100.0 * (here / there - 1.0))
            rest[h] = float(100.0 * (there / fresh - 1.0))
        case = f"{name}, F_C/F_E {ratio:g}, {f:g} Hz"
        if HARMONICS[0] not in off:
            yield {"name": "balance_against_march", "case": case, "note": why.strip("; ")}
            continue
        first = off[HARMONICS[0]]
        more = ", ".join(f"{h} harmonics {v:+.3f}" for h, v in off.items())
        yield {
            "name": "balance_against_march",
            "case": f"{case}, {HARMONICS[0]} harmonics",
            "value": first,
            "unit": "%",
            "target": BALANCE[ratio],
            "note": f"{met(first, BALANCE[ratio])}; {more}{why}",
        }
        yield {
            "name": "residual_state",
            "case": case,
            "value": rest[HARMONICS[0]],
            "unit": "%",
            "note": "march from the balance's own residual slips over the march from rest",
        }


if __name__ == "__main__":
    for line in run():
        print(line, flush=True)
