"""What a choice of damper may vary, and over what its peaks count: ranges of a scene's inputs; the
peaks of its rigs over F_C/F_E, of whole curves by harmonic balance.

Curves are kept on disk as they are solved: called again, a choice continues.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from upd.analyses import make_plan
from upd.analyses.forced.curves import point_limit
from upd.analyses.forced.model import make_model
from upd.analyses.forced.performance import peaks_at
from upd.analyses.forced.plan import ForcedPlan, grid
from upd.analyses.forced.statics import face_laws, static_state
from upd.analyses.seated.bodies import Bodies, bodies_key, make_bodies
from upd.cache.arrays import Journal
from upd.cache.sources import key_of, source_digest
from upd.errors import InputError
from upd.linalg.parallel import threads_for
from upd.plot.answer_table import Rounded
from upd.progress import Stages
from upd.scene import ForcedScene
from upd.scene.forced import FORCED
from upd.scene.keys import scalar_input, scene_keys
from upd.scene.ranges import (
    InputProblems,
    check_ends,
    input_text,
    one_model,
    read_range,
    with_values,
)
from upd.sizing.worst_peak import Peaks, PeaksOver
from upd.units import unit_inside

FORCE, CENTRIFUGAL = "excitation.force", "damper.centrifugal"
#: inputs that set F_C = m r w^2 and nothing else, and the power of F_C in them
TURNING = {"damper.radius": 1.0, "damper.speed": 2.0}


@dataclass(frozen=True)
class InputRange:
    """A range of one input.

    Attributes
    ----------
    path : str
        In the scene.
    kind : str
        Of its quantity, as in `upd.units.UNITS`.
    low, high : float
        In the unit inside.
    nominal : float
        What the scene has.
    """

    path: str
    kind: str
    low: float
    high: float
    nominal: float

    @property
    def unit(self) -> str:
        """Inside."""
        return unit_inside(self.kind)

    @property
    def only_centrifugal(self) -> bool:
        """Whether it changes F_C and nothing else."""
        return self.path == CENTRIFUGAL or self.path in TURNING

    def text(self, value: float) -> Any:
        """A value as a scene takes it."""
        return input_text(value, self.kind)

    def shown(self, value: float) -> str:
        """A value with its unit, four digits of it."""
        return str(self.text(float(f"{value:.4g}")))

    def cell(self, value: float) -> str:
        """A value as a table has it."""
        return Rounded(value, text=self.shown(value))

    def centrifugal(self, value: float, scene: ForcedScene) -> float:
        """F_C [N] with a value of an input that changes F_C and nothing else."""
        if self.path == CENTRIFUGAL:
            return value
        power = TURNING[self.path]
        return float(scene.damper.centrifugal * (value / self.nominal) ** power)

    def value_at(self, centrifugal: float, scene: ForcedScene) -> float:
        """The value of such an input with F_C [N]."""
        if self.path == CENTRIFUGAL:
            return centrifugal
        share = (centrifugal / scene.damper.centrifugal) ** (1.0 / TURNING[self.path])
        return float(self.nominal * share)


@dataclass(frozen=True)
class Ranges:
    """What is chosen, and over what its peaks count.

    Attributes
    ----------
    scene : ForcedScene
        With its nominal values.
    over, during : tuple of InputRange
        Chosen; counted over.
    """

    scene: ForcedScene
    over: tuple[InputRange, ...]
    during: tuple[InputRange, ...]

    @property
    def pressing(self) -> InputRange | None:
        """What sets F_C alone, of those chosen."""
        return next((one for one in self.over if one.only_centrifugal), None)

    @property
    def shapes(self) -> tuple[InputRange, ...]:
        """What else is chosen."""
        return tuple(one for one in self.over if not one.only_centrifugal)

    @property
    def unsure(self) -> tuple[InputRange, ...]:
        """What peaks count over beside F_E."""
        return tuple(one for one in self.during if one.path != FORCE)

    @property
    def forces(self) -> tuple[float, float]:
        """F_E [N]: the least and the largest."""
        given = next((one for one in self.during if one.path == FORCE), None)
        if given is not None:
            return given.low, given.high
        return self.nominal_forces

    @property
    def nominal_forces(self) -> tuple[float, float]:
        """F_E [N] of the scene."""
        own = forces_of(self.scene)
        return min(own), max(own)


def forces_of(scene: ForcedScene) -> list[float]:
    """F_E [N] of every curve."""
    return [scene.damper.centrifugal / r for r in scene.excitation.centrifugal_to_force]


def read_ranges(
    scene: ForcedScene,
    over: str | Sequence[str] | Mapping[str, str],
    during: str | Sequence[str] | Mapping[str, str],
) -> Ranges:
    """Ranges from texts PATH=low:high.

    Parameters
    ----------
    scene
        Whose inputs they are.
    over, during
        One text for each, or path -> "low:high". Ends are quantities, "50 N", or numbers in the
        unit inside.

    Raises
    ------
    InputError
        With everything that is wrong with them.
    """
    if getattr(scene, "analysis", "") != FORCED:
        raise InputError("a choice of damper needs a forced response; the scene is none")
    problems = InputProblems("ranges")
    read: list[list[InputRange]] = []
    for word, given in (("over", over), ("for", during)):
        found: list[InputRange] = []
        for text in _texts(given):
            path, _, ends = (part.strip() for part in text.partition("="))
            with problems.of(f"{word} {path}"):
                found.append(_range(scene, path, ends))
        read.append(found)
    chosen, counted = read
    if not chosen and not problems.lines:
        problems.lines.append(f"over: nothing to choose; write for example {CENTRIFUGAL}=50:2000")
    problems.twice([one.path for one in (*chosen, *counted)])
    if any(one.path == FORCE for one in chosen):
        problems.lines.append(f"over {FORCE}: excitation is not chosen; give it after for")
    pressing = [one.path for one in chosen if one.only_centrifugal]
    if len(pressing) > 1:
        problems.lines.append(
            f"over {', '.join(pressing)}: each sets F_C alone; give one, set the others"
        )
    problems.lines += [
        f"for {one.path}: scales F_C; peaks depend on F_C/F_E: widen excitation.force by the same "
        "factor instead"
        for one in counted
        if one.only_centrifugal
    ]
    problems.check()
    return Ranges(scene, tuple(chosen), tuple(counted))


def _texts(given: str | Sequence[str] | Mapping[str, str]) -> list[str]:
    if isinstance(given, str):
        return [given] if given else []
    if isinstance(given, Mapping):
        return [f"{path}={ends}" for path, ends in given.items()]
    return list(given)


def _range(scene: ForcedScene, path: str, ends: str) -> InputRange:
    if path == FORCE:
        own = forces_of(scene)
        kind, nominal = "force", math.exp(sum(map(math.log, own)) / len(own))
    elif path == CENTRIFUGAL:
        if scene.damper.speed is not None:
            raise InputError("follows from mass, radius and speed here; choose one of those")
        kind, nominal = "force", scene.damper.centrifugal
    else:
        keys = {key.path: key for key in scene_keys(scene)}
        kind, nominal = scalar_input(scene, keys, path, (CENTRIFUGAL, FORCE))
    low, high = read_range(ends, kind, nominal)
    found = InputRange(path, kind, low, high, nominal)
    if path not in (FORCE, CENTRIFUGAL):
        check_ends(
            lambda value: with_values(scene, {path: found.text(value)}),
            (low, high),
            kind,
            "give another range",
        )
    return found


# -- peaks of a rig over F_C/F_E -------------------------------------------------------------------


def bare(scene: ForcedScene, stiffness: str) -> ForcedScene:
    """What peaks over F_C/F_E need of a scene: one stiffness, nothing estimated or solved again.

    Raises
    ------
    InputError
        With everything for which peaks are no functions of F_C/F_E.
    """
    more = []
    if not scene.contact.loaded:
        more.append(
            "contact.fit: with gaps at rest peaks do not depend on F_C/F_E alone; set "
            'contact.fit="loaded"'
        )
    if scene.balance.method == "march":
        more.append('balance.method: peaks are those of harmonic balance; set "balance"')
    return replace(one_model(scene, stiffness, "a choice", more=more), want=("response",))


def rig_peaks(
    scene: ForcedScene,
    ends: tuple[float, float],
    bodies: dict[str, Bodies],
    stages: Stages,
    report: Callable[[str], None],
) -> PeaksOver:
    """The peaks of one rig.

    Parameters
    ----------
    scene
        As `bare` makes it.
    ends
        F_C/F_E that may be asked for.
    bodies
        Text of what blades and damper are -> them: re-used.
    stages
        Of the whole.
    report
        Called with words before every solution.
    """
    (stiffness,) = scene.contact.stiffness
    plan: ForcedPlan = make_plan(scene)
    key, e = bodies_key(plan), scene.excitation
    if key not in bodies:
        with stages("blades", "mesh and assembly"):
            bodies[key] = make_bodies(plan)
    with stages("blades", "static state and reduction"):
        laws = face_laws(scene.stiffnesses[stiffness], stages)
        state = static_state(plan, bodies[key], stages=stages)
        model = make_model(plan, bodies[key], laws, state)
    with threads_for(len(model.M)):
        stuck = point_limit(plan, model, True).peaks("right", grid(plan))
    if not stuck:
        raise InputError(
            f"no stuck peak of the right blade between {e.start:g} and {e.stop:g} Hz; to fix it: "
            "widen excitation.start and stop"
        )

    def curve_at(s: float) -> Peaks | None:
        """Peaks of the right blade at one F_C/F_E; None where no curve arrives."""
        ratio = math.exp(s)
        report(f"whole curve, F_C/F_E {ratio:.4g}")
        found = peaks_at(plan, model, ratio)
        if not found.arrived:
            return None
        return {
            one.mode or f"peak {one.number}": (one.frequency, math.log(one.height))
            for one in found.peaks
            if one.blade == "right"
        }

    kept = Journal(f"choice-{_key(scene)[:32]}")
    low, high = map(math.log, ends)
    return PeaksOver(curve_at, low, high, kept=kept)


def _key(scene: ForcedScene) -> str:
    """Of all that the peaks depend on."""
    excitation = replace(scene.excitation, force=(), centrifugal_to_force=())
    one = replace(scene, text="", name="", title="", excitation=excitation)
    return key_of({"scene": repr(one), "sources": source_digest(scene.recipe)})
