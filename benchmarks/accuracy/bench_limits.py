"""What the forced response of both ready rigs must keep to: limits, scaling, energy, rest, and what
more harmonics, samples and modes change.

Springs: stiffness printed in the thesis, faces worn in under F_C. Whole faces: every matching node,
worn in, 8-node solids.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import upd

# The benchmarks are no package: what they share is found by its folder.
sys.path.append(str(Path(__file__).parents[1]))
from rig_response import Rig, accelerance, rig

from upd.analyses import make_plan
from upd.analyses.forced import measures
from upd.analyses.forced.curves import stuck_modes_of
from upd.analyses.forced.interface_model import (
    by_coulomb,
    make_interface_model,
    make_springs,
    worn_start,
)
from upd.analyses.forced.model import preloaded, respond
from upd.analyses.forced.plan import MARCH_SAMPLES
from upd.analyses.forced.statics import static_state
from upd.analyses.measured import CurvePeak
from upd.analyses.seated.bodies import make_bodies
from upd.analyses.seated.interface import make_interface
from upd.hbm import FrequencyResponse
from upd.hbm.faces.march import InterfaceMarch
from upd.hbm.faces.state import InterfaceModel, InterfaceState
from upd.hbm.faces.sweep import SteadyPoint, settle
from upd.hbm.springs.peak import climb
from upd.scene import load_scene

Row = dict[str, Any]
RIGS = ("symmetric", "asymmetric")
RATIOS = (600.0, 194.0)
RIGHT = 1
#: Hz between the two peaks of each rig
BETWEEN = {"symmetric": 427.0, "asymmetric": 416.0}
#: Hz at which points slip and open at F_C/F_E 600 and 194, one motion
MOVING = {"symmetric": {600.0: 403.0, 194.0: 448.0}, "asymmetric": {600.0: 403.0, 194.0: 433.0}}
#: N: F_C of a damper that nothing presses; on whole faces, which scale alike
SMALL = 1e-6
#: stuck, as good as
LARGE = 1e6
SCALE = 7.0
WHOLE = [
    "contact.model=interface",
    "contact.static=frictionless",
    "mesh.element=hex8i",
    'want=["response"]',
    "balance.method=march",
]
MODES = (5, 14)
#: fixed-interface modes of the ready scenes
READY = 10
#: a peak climbed to is the one on the path within this share of its height
NEAR = 0.02
PERIODS = 50


def run() -> Iterator[Row]:
    """Each number with its target."""
    for name in RIGS:
        built = rig(f"{name}-response")
        yield from harmonics(name, built)
        yield from samples(name, built)
        yield from modes(name, built)
        yield from scaled(name, built)
        yield from energy(name, built)
        yield from still(f"{name}, springs", *springs_at_rest(built))
        yield from whole_faces(name)


def told(name: str, case: str, value: float, unit: str, target: float | None, note: str) -> Row:
    """A row with whether its target is met."""
    word = "" if target is None else "met" if abs(value) <= target else "MISSED"
    return {
        "name": name,
        "case": case,
        "value": float(value),
        "unit": unit,
        "target": target,
        "note": "; ".join(part for part in (word, note) if part),
    }


# -- springs, by the balance -----------------------------------------------------------------------


def curve(built: Rig, ratio: float, **changes: Any) -> FrequencyResponse:
    """The right blade's curve along the ready scene's sweep, 0.5 Hz apart."""
    e = built.plan.scene.excitation
    frequencies = np.arange(e.start, e.stop + 0.25, 0.5)
    force = built.plan.scene.damper.centrifugal / ratio
    return respond(built.plan, built.model, force, frequencies, **changes)


def peaks(name: str, built: Rig, answer: FrequencyResponse, ratio: float) -> dict[str, CurvePeak]:
    """In phase and out of phase: Hz and (m/s2)/N of the highest maximum below and above the valley
    between them, climbed to, so that the points of the path do not move it.
    """
    force, row = built.plan.scene.damper.centrifugal / ratio, built.model.row("right")
    H = np.abs(measures.accelerance(answer, row, force))
    found = measures.path_maxima(answer.frequency, H)
    low = [p for p in found if p.frequency < BETWEEN[name]]
    high = [p for p in found if p.frequency >= BETWEEN[name]]
    out = {}
    for words, group in (("in phase", low), ("out of phase", high)):
        if group:
            best = max(group, key=lambda p: p.height)
            x, f = answer.x[best.sample], float(answer.frequency[best.sample])
            top = climb(answer.balance, row, x, f)
            height = accelerance(top.frequency, top.amplitude, force)
            near = abs(height / best.height - 1.0) < NEAR
            out[words] = (
                best._replace(frequency=top.frequency, height=height)
                if top.found and near
                else best
            )
    return out


def compared(
    name: str,
    built: Rig,
    what: str,
    case: str,
    ratio: float,
    answers: tuple[FrequencyResponse, FrequencyResponse],
    targets: tuple[float | None, float | None],
) -> Iterator[Row]:
    """Height and frequency of both peaks of the first answer against the second."""
    one, other = (peaks(name, built, a, ratio) for a in answers)
    for words in ("in phase", "out of phase"):
        where = f"{name}, F_C/F_E {ratio:g}, {words}, {case}"
        if words not in one or words not in other:
            why = "; ".join(a.message for a in answers if not a.arrived)
            yield {"name": f"{what}_peak", "case": where, "note": f"not reached: {why}"}
            continue
        a, b = one[words], other[words]
        ends = "; ".join(f"stopped: {x.message}" for x in answers if not x.arrived)
        note = f"{a.height:.4g} and {b.height:.4g} (m/s2)/N"
        note = "; ".join(part for part in (note, ends) if part)
        off = 100.0 * (a.height / b.height - 1.0)
        yield told(f"{what}_peak", where, off, "%", targets[0], note)
        off = 100.0 * (a.frequency / b.frequency - 1.0)
        note = f"{a.frequency:.3f} and {b.frequency:.3f} Hz"
        yield told(f"{what}_frequency", where, off, "%", targets[1], note)


def harmonics(name: str, built: Rig) -> Iterator[Row]:
    """3 against 5."""
    for ratio in RATIOS:
        answers = {h: curve(built, ratio, harmonics=range(h + 1)) for h in (3, 5)}
        yield from compared(
            name, built, "harmonics", "3 / 5", ratio, (answers[3], answers[5]), (0.5, 0.1)
        )


def samples(name: str, built: Rig) -> Iterator[Row]:
    """64, and what the ready scene takes, against 256."""
    for ratio in RATIOS:
        answers = {n: curve(built, ratio, samples=n) for n in (64, 128, 256)}
        for n in (64, 128):
            case = f"{n} / 256"
            yield from compared(
                name, built, "samples", case, ratio, (answers[n], answers[256]), (0.05, 0.05)
            )


def modes(name: str, built: Rig) -> Iterator[Row]:
    """Fixed-interface modes a blade: stuck frequencies."""
    found = {}
    for count in (MODES[0], READY, MODES[1]):
        fresh = replace(built.bodies, reduced={})
        one = rig(f"{name}-response", fresh, reduction__modes=count)
        stuck = measures.mode_shapes(one.model, 1000.0).modes
        found[count] = {m.in_phase: m.frequency for m in reversed(stuck)}
    many = found.pop(MODES[1])
    for count, few in found.items():
        for in_phase, words in ((True, "in phase"), (False, "out of phase")):
            off = 100.0 * (few[in_phase] / many[in_phase] - 1.0)
            note = f"{few[in_phase]:.4f} and {many[in_phase]:.4f} Hz, fixed-interface modes"
            case = f"{name}, springs, stuck {words}, {count} / {MODES[1]} modes a blade"
            yield told("modes_frequency", case, off, "%", 0.02, note)


# -- scaling, energy, rest -------------------------------------------------------------------------


def settled(
    model: InterfaceModel, f: float, force: float, at: InterfaceState, tolerance: float = 1e-4
) -> SteadyPoint:
    """The march from a state, which it overwrites."""
    march = InterfaceMarch(model, f, [force], MARCH_SAMPLES, by_coulomb)
    return settle(march, at, tolerance, 2000)


def springs_at_rest(built: Rig) -> tuple[InterfaceModel, InterfaceState]:
    """The march's model and its static state."""
    springs = make_springs(built.plan, built.model)
    return springs.march, springs.at_rest()


def scaled(name: str, built: Rig) -> Iterator[Row]:
    """F_C and F_E times 7: balance and march."""
    scene = built.plan.scene
    more = replace(
        scene, damper=replace(scene.damper, centrifugal=SCALE * scene.damper.centrifugal)
    )
    plan = replace(built.plan, scene=more)
    damper = replace(built.model.damper, centrifugal=SCALE * built.model.damper.centrifugal)
    state = static_state(plan, built.bodies)
    many = Rig(plan, built.bodies, preloaded(replace(built.model, damper=damper), state))
    for ratio in RATIOS:
        f = MOVING[name][ratio]
        force = scene.damper.centrifugal / ratio
        grid = np.linspace(f - 30.0, f, 61)
        one, other = (
            respond(b.plan, b.model, s * force, grid).amplitude(b.model.row("right"))
            for b, s in ((built, 1.0), (many, SCALE))
        )
        k = min(len(one), len(other))
        off = np.abs(other[:k] / one[:k] / SCALE - 1.0)
        case = f"{name}, springs, F_C/F_E {ratio:g}, loads times {SCALE:g}"
        same = "" if len(one) == len(other) else f"; {len(one)} and {len(other)} points"
        note = f"balance, largest of {k} points to {f:g} Hz{same}"
        yield told("scaling", case, float(off.max()), "", 1e-9, note)
        a, b = (
            settled(m, f, s * force, at).harmonics[0, RIGHT]
            for (m, at), s in ((springs_at_rest(built), 1.0), (springs_at_rest(many), SCALE))
        )
        yield told("scaling", case, abs(b / a / SCALE - 1.0), "", 1e-9, f"march, {f:g} Hz")


def energy(name: str, built: Rig) -> Iterator[Row]:
    """Work of the excitation less what damping and friction take, over it."""
    for ratio in RATIOS:
        case = f"{name}, springs, F_C/F_E {ratio:g}"
        answer = curve(built, ratio)
        worst = float(np.abs(answer.energy_balance).max())
        yield told(
            "energy", case, worst, "", 1e-9, f"balance, largest along {len(answer.x)} points"
        )


def still(case: str, model: InterfaceModel, at: InterfaceState) -> Iterator[Row]:
    """No dynamic load for 50 periods: largest change of a contact force, over the largest."""
    before = at.f.copy()
    march = InterfaceMarch(model, 400.0, [0.0], MARCH_SAMPLES, by_coulomb)
    worst = 0.0
    for _ in range(PERIODS):
        march.period(at)
        worst = max(worst, float(np.abs(at.f - before).max() / np.abs(before).max()))
    yield told("rest", f"{case}, {PERIODS} periods without load", worst, "", 1e-9, "")


# -- whole faces -----------------------------------------------------------------------------------


def whole_faces(name: str) -> Iterator[Row]:
    """Glued and free limits, rest, scaling and modes of worn faces, node by node."""
    plan: Any = make_plan(load_scene(f"{name}-response", WHOLE))
    bodies = make_bodies(plan)
    of = make_interface(plan, bodies)
    F, mu = plan.scene.damper.centrifugal, plan.scene.contact.friction

    def made(centrifugal: float, n_modes: int = MODES[0]) -> tuple[InterfaceModel, InterfaceState]:
        options: dict[str, Any] = {
            "damping": plan.scene.excitation.damping,
            "kept_modes": (n_modes, 0.0),
        }
        model = make_interface_model(
            plan, bodies, of, friction=mu, centrifugal=centrifugal, **options
        )
        return worn_start(model, of, centrifugal)

    model, rest = made(F)
    case = f"{name}, whole faces, {of.n} nodes"
    yield from still(case, model, rest.copy())
    glued = glued_frequencies(name)
    found = {}
    for count in MODES:
        stuck = stuck_modes_of(made(F, count)[0], 1000.0)
        found[count] = {m.in_phase: m.frequency for m in reversed(stuck.modes)}
    for in_phase, words in ((True, "in phase"), (False, "out of phase")):
        mine, many = found[MODES[0]][in_phase], found[MODES[1]][in_phase]
        off = 100.0 * (mine / many - 1.0)
        where = f"{case}, stuck {words}, {MODES[0]} / {MODES[1]} modes a blade"
        yield told("modes_frequency", where, off, "%", 0.02, f"{mine:.4f} and {many:.4f} Hz")
        off = 100.0 * (mine / glued[in_phase] - 1.0)
        note = f"{mine:.3f} Hz; modes of the glued rig, whole matrices, same mesh: "
        note += f"{glued[in_phase]:.3f} Hz"
        yield told("glued_frequency", f"{case}, stuck {words}", off, "%", 0.1, note)
        for f in (0.99 * mine, mine, 1.01 * mine):
            at, force = rest.copy(), F / LARGE
            one = settled(model, f, force, at)
            linear = model.linear_response([f], [force], stuck=True)[0, RIGHT]
            off = 100.0 * (abs(one.harmonics[0, RIGHT]) / abs(linear) - 1.0)
            note = (
                f"march against the glued linear answer; sticking {100 * one.last.counts[1]:.0f} %"
            )
            where = f"{case}, F_C/F_E {LARGE:g}, {f:.2f} Hz"
            yield told("glued_accelerance", where, off, "%", 0.1, note)
    loose, start = made(SMALL)
    for f in (290.0, 305.0):
        one = settled(loose, f, 1.0, start.copy())
        linear = loose.linear_response([f], [1.0], stuck=False)[0, RIGHT]
        off = 100.0 * (abs(one.harmonics[0, RIGHT]) / abs(linear) - 1.0)
        where = f"{case}, F_C/F_E {SMALL:g}, {f:g} Hz"
        yield told("free_accelerance", where, off, "%", 0.1, "march against the free blade")
    f, force = found[MODES[0]][False], F / RATIOS[0]
    big, at = made(SCALE * F)
    a = settled(model, f, force, rest.copy())
    b = settled(big, f, SCALE * force, at)
    off = abs(b.harmonics[0, RIGHT] / a.harmonics[0, RIGHT] / SCALE - 1.0)
    share = ", ".join(f"{100 * p:.1f} %" for p in a.last.counts)
    where = f"{case}, F_C/F_E {RATIOS[0]:g}, loads times {SCALE:g}"
    yield told("scaling", where, off, "", 1e-9, f"march, {f:.1f} Hz; open, stick, slip {share}")


def glued_frequencies(name: str) -> dict[bool, float]:
    """Hz of the rig with the damper glued between the platforms, by whether the tips move in
    phase: whole matrices of all bodies.
    """
    changes = {"mesh.element": "hex8i", "want": ["glued"], "modes.arrangements": [name]}
    result = upd.run("rig", overrides=changes)
    first, second = sorted(r.value for r in result.rows if r.name in ("f1_glued", "f2_glued"))
    return {True: first, False: second}


if __name__ == "__main__":
    for line in run():
        print(line, flush=True)
