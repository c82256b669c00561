"""The scene of a forced response.

Two blades, the rigid damper between them, friction, harmonic balance over frequency.
"""

from __future__ import annotations

import cmath
import math
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from upd.scene import quantities as q
from upd.scene.base import (
    DamperChoice,
    MeshChoice,
    RigBase,
    repeated,
    rig_problems,
    unreachable_accuracy,
)
from upd.scene.forced_contact import GAUSS, SIDES, FrictionChoice, Side, StiffnessChoice
from upd.scene.measured import (
    FROM_MEASURED,
    UNTIL_READ,
    FittedMode,
    MeasuredChoice,
    fitted_modes,
    measured_problems,
)
from upd.scene.rotation import with_damper

#: Outputs a forced response can give.
FORCED_WANTS = (
    "response",
    "contact_state",
    "hysteresis",
    "damper_motion",
    "performance",
    "nonlinear_modes",
    "inputs",
    "band",
)
ForcedWant = Annotated[str, q.one_of(FORCED_WANTS), q.Example('"response"', '"contact_state"')]
#: the analysis these scenes ask for
FORCED = "forced response"

Array = NDArray[np.float64]

#: outputs that both models of the contact give
WHOLE_FACES_WANTS = ("response", "contact_state", "hysteresis", "damper_motion")
#: of these, what is read of whole faces from sweeps alone
MARCHED_WANTS = ("hysteresis", "damper_motion")


#: highest harmonic of a force and of the balance
MOST_HARMONICS = 31
HarmonicNumber = Annotated[
    int, q.must(lambda v: 1 <= v <= MOST_HARMONICS, "is no harmonic, 1 to 31", "1 to 31")
]
Samples = Annotated[
    Any,
    q.must(
        lambda v: v == "auto" or (q.is_whole(v) and v >= 8),
        'is no number of samples; give 8 or more per period, or "auto"',
        ">= 8, or auto",
    ),
]


@dataclass(frozen=True)
class BladeReduction:
    """Reduction of the blades.

    Attributes
    ----------
    modes
        Fixed-interface modes kept per blade beside contact points, force and accelerometers. Cost:
        small, a mode is a dof of the reduced model.
    """

    modes: Annotated[int, q.not_negative] = 10


@dataclass(frozen=True)
class HarmonicForce:
    """A force along x at mid-core of a blade, a F_E cos(k 2 pi f t + phase).

    Attributes
    ----------
    blade
        Where it acts.
    amplitude
        a, relative to F_E.
    phase
        Of the force; 0 deg pushes along +x at t = 0, on either blade.
    harmonic
        k, its frequency as a multiple of that of the sweep.
    """

    blade: Side = "right"
    amplitude: q.Ratio = 1.0
    phase: q.Phase = 0.0
    harmonic: HarmonicNumber = 1


@dataclass(frozen=True)
class ExcitationChoice:
    """Harmonic forces at mid-core of the blades, swept between two frequencies.

    Attributes
    ----------
    forces
        What excites, each with its blade ("right" or "left"), its amplitude relative to F_E, its
        phase, and its harmonic of the frequency; those of one blade and harmonic add up. Answers
        are accelerations in the lowest harmonic, per newton of F_E. Cost: none of a second place;
        harmonics above the first need as many of the balance.
    centrifugal_to_force
        F_C/F_E, one curve each, or "from force". Cost: every curve is followed; the lower the
        ratio, the more slip and the more points.
    force
        F_E itself, one curve each, instead of the ratios.
    start, stop
        Lowest and highest frequency.
    points
        Points of a curve before it is refined where it bends. Cost: seconds grow in proportion.
    damping
        Modal damping ratio of the blades without damper; or "measured": of every mode its own,
        fitted to the measured free curves, beyond their band that of the nearest.
    """

    centrifugal_to_force: q.Ratios = (194.0,)
    force: tuple[q.Force, ...] = ()
    start: q.Frequency = 280.0
    stop: q.Frequency = 500.0
    points: Annotated[int, q.at_least(10)] = 400
    damping: Annotated[q.Share, q.or_from(FROM_MEASURED, UNTIL_READ)] = 0.005
    forces: Annotated[
        tuple[HarmonicForce, ...],
        q.FILLED,
        q.Example('[{ blade = "left", amplitude = 0.5, phase = "180 deg" }]'),
    ] = (HarmonicForce(),)


@dataclass(frozen=True)
class BalanceChoice:
    """Harmonic balance, or time integration in its place.

    Attributes
    ----------
    method
        "balance": harmonic balance along the curve, each peak confirmed by time integration;
        "march": sweeps up and down by time integration, as in an experiment. Cost: a sweep takes
        about a second for every three frequencies.
    harmonics
        The highest. Cost: unknowns grow with 2 harmonics + 1, seconds faster.
    samples
        Of the contact force per period, and time steps of a sweep in a period; "auto" takes what
        the harmonics need, and 128 steps. Cost: seconds grow in proportion where points slip.
    slider
        Start position of the sliders, within what friction allows.
    """

    method: Literal["balance", "march"] = "balance"
    harmonics: HarmonicNumber = 7
    samples: Samples = "auto"
    slider: Literal["zero", "static", "mid", "upper", "lower"] = "zero"


@dataclass(frozen=True)
class PerformanceChoice:
    """F_C/F_E of the performance curve, evenly spread on a logarithmic axis.

    Attributes
    ----------
    lowest, highest
        First and last F_C/F_E.
    points
        F_C/F_E of the curve; two more are solved beside the best. Cost: a whole curve each.
    """

    lowest: q.Ratio = 5.0
    highest: q.Ratio = 1000.0
    points: Annotated[int, q.at_least(3)] = 12


@dataclass(frozen=True, kw_only=True)
class ForcedScene(RigBase):
    """One forced response.

    Attributes
    ----------
    want
        Outputs: "response", free, stuck and nonlinear accelerance of both blades over frequency;
        "contact_state", which points stick, slip or lift off, over frequency and at the peak;
        "hysteresis", loops of the points that dissipate most, energy and power of every point;
        "damper_motion", the damper's translations and rotations at the peak, static part included;
        "performance", peaks of both blades against F_C/F_E, the best one marked; "nonlinear_modes",
        frequency and damping of the modes in phase and out of phase over their amplitude; "inputs",
        what the peaks depend on most: stiffness, patch, friction, static state, fit; "band", every
        peak over the static states and the start positions of the sliders. Cost: upd plan shows
        what each brings with it.
    analysis
        What distinguishes this scene from one of the rig's modes.
    stiffness
        Contact stiffnesses by name.
    measured
        Measured responses by name.
    """

    only: ClassVar[tuple[str, ...]] = (
        "damper",
        "excitation",
        "balance",
        "performance",
        "stiffness",
    )

    analysis: Literal["forced response"]
    want: Annotated[tuple[ForcedWant, ...], q.FILLED]
    stiffness: Annotated[
        Mapping[q.Name, StiffnessChoice],
        q.FILLED,
        q.Example('{ own = { K_N = "1e6 N/mm", K_T = "5e5 N/mm" } }'),
    ]
    mesh: MeshChoice = field(default_factory=lambda: MeshChoice(element="hex20"))
    reduction: BladeReduction = field(default_factory=BladeReduction)
    damper: DamperChoice = field(default_factory=DamperChoice)
    contact: FrictionChoice = field(default_factory=FrictionChoice)
    excitation: ExcitationChoice = field(default_factory=ExcitationChoice)
    balance: BalanceChoice = field(default_factory=BalanceChoice)
    performance: PerformanceChoice = field(default_factory=PerformanceChoice)
    measured: Mapping[q.Name, MeasuredChoice] = field(default_factory=dict)
    fitted: tuple[FittedMode, ...] = field(default=(), repr=False)

    def modal_damping(self, frequency: Array, share: Array) -> Array:
        """Damping ratios (m,) of modes of the blades without damper.

        A mode takes the ratio of the fitted mode next to it in frequency (by ratio), of each blade
        by the share of the modal mass that moves there; a blade that was not measured takes the
        other's.

        Parameters
        ----------
        frequency
            (m,) Hz.
        share
            (m, 2) of the left and of the right blade in the modal mass.
        """
        if not self.fitted:
            return np.full(len(frequency), self.excitation.damping)
        f = np.maximum(frequency, np.finfo(float).tiny)
        ratios = np.zeros_like(share)
        for k, side in enumerate(SIDES):
            mine = [one for one in self.fitted if one[0] == side] or self.fitted
            known, zeta = (np.array([one[i] for one in mine]) for i in (1, 2))
            nearest = np.abs(np.log(f)[:, None] - np.log(known)).argmin(axis=1)
            ratios[:, k] = zeta[nearest]
        return np.asarray((share * ratios).sum(axis=1) / share.sum(axis=1))

    @property
    def stiffnesses(self) -> dict[str, StiffnessChoice]:
        """The contact stiffnesses to run, by name."""
        return {name: self.stiffness[name] for name in self.contact.stiffness or self.stiffness}

    @property
    def harmonic_numbers(self) -> range:
        """Harmonics of the balance, the static one included."""
        return range(self.balance.harmonics + 1)

    def derived(self, data: Mapping[str, Any]) -> ForcedScene:
        """With F_C, density of the damper, force ratios and damping as numbers."""
        e, problems = self.excitation, []
        wanted = data.get("excitation", {}).get("centrifugal_to_force")
        if e.force and wanted not in (None, q.FROM_FORCE):
            problems.append(
                "excitation: force and centrifugal_to_force are both given; give one, or "
                f'centrifugal_to_force = "{q.FROM_FORCE}"'
            )
        if wanted == q.FROM_FORCE and not e.force:
            problems.append(
                f'excitation.centrifugal_to_force: "{q.FROM_FORCE}" needs excitation.force'
            )
        if 0.0 in e.force:
            problems.append("excitation.force: 0 N excites nothing; give a positive force")
        changed: ForcedScene = with_damper(self, data, problems)
        fitted, ratio = fitted_modes(self.measured, data, "excitation")
        if fitted:
            changed, e = replace(changed, fitted=fitted), replace(e, damping=ratio)
        ratios = tuple(changed.damper.centrifugal / force for force in e.force)
        e = replace(e, centrifugal_to_force=ratios or e.centrifugal_to_force)
        return replace(changed, excitation=e)

    def problems(self) -> Iterator[str]:
        """What does not fit together."""
        e, b, known = self.excitation, self.balance, ", ".join(self.stiffness)
        springs = self.contact.model == "springs"
        yield from repeated("excitation.centrifugal_to_force", e.centrifugal_to_force)
        if not e.start < e.stop:
            yield f"excitation.start: {e.start:g} Hz is not below excitation.stop, {e.stop:g} Hz"
        if self.damper.centrifugal <= 0.0:
            yield (
                "damper.centrifugal: 0 N leaves the damper loose and the excitation F_C / ratio "
                "without size; give a positive force"
            )
        excited = max(one.harmonic for one in e.forces)
        highest = max(b.harmonics, excited)
        if b.samples != "auto" and b.samples <= 2 * highest:
            yield (
                f"balance.samples: {b.samples} cannot carry harmonic {highest}; take more than "
                f"{2 * highest}"
            )
        if not combined_forces(e):
            yield "excitation.forces: cancel each other; give forces that excite something"
        elif (springs or b.method == "balance") and b.harmonics < excited:
            yield (
                f"balance.harmonics: {b.harmonics} do not carry the force in harmonic "
                f"{excited}; write {excited} or more"
            )
        if self.performance.lowest >= self.performance.highest:
            yield "performance.lowest: is not below performance.highest"
        for name in self.contact.stiffness:
            if name not in self.stiffness:
                yield f"contact.stiffness: there is no table [stiffness.{name}]; known: {known}"
        yield from (_springs_problems if springs else _whole_faces_problems)(self)
        yield from rig_problems(self)
        yield from measured_problems(self.measured)
        yield from _static_problems(self)
        for name, s in self.stiffness.items():
            yield from _stiffness_problems(f"stiffness.{name}", s, self.arrangement)


def combined_forces(e: ExcitationChoice) -> dict[tuple[Side, int], complex]:
    """Complex amplitudes over F_E by blade and harmonic, those of one place and harmonic added;
    what cancels to rounding is omitted.
    """
    parts: dict[tuple[Side, int], list[complex]] = {}
    for one in e.forces:
        amplitude = cmath.rect(one.amplitude, math.radians(one.phase))
        parts.setdefault((one.blade, one.harmonic), []).append(amplitude)
    return {
        at: sum(values)
        for at, values in parts.items()
        if abs(sum(values)) > math.sqrt(sys.float_info.epsilon) * sum(map(abs, values))
    }


# -- what does not fit together --------------------------------------------------------------------


def _springs_problems(scene: ForcedScene) -> Iterator[str]:
    """What springs have not: partly worn faces, Gauss points at lines."""
    c, gauss = scene.contact, scene.contact.rule == GAUSS
    if c.worn not in (0.0, 1.0):
        yield (
            f"contact.fit: {c.worn:g} is for whole faces; springs fit loaded or unloaded: write "
            'one of these, or contact.model = "interface"'
        )
    if scene.wants("nonlinear_modes") and not c.friction:
        yield "contact.friction: 0 leaves no point that sticks, for nonlinear modes; give friction"
    if gauss and c.share != "area":
        yield 'contact.share: Gauss points have their own shares; write "area"'
    if gauss and not all(isinstance(one, int) for side in SIDES for one in c.lines(side)):
        yield 'contact.rule: "gauss" needs numbers of points, for example rows = 4 and columns = 2'


def _whole_faces_problems(scene: ForcedScene) -> Iterator[str]:
    """What whole faces have not, or by time integration alone."""
    # they have no estimates that could prove an accuracy
    yield from unreachable_accuracy(scene, "a forced response", "geometry.refine")
    others = [one for one in scene.want if one not in WHOLE_FACES_WANTS]
    integrated = [one for one in scene.want if one in MARCHED_WANTS]
    if scene.mesh.element not in ("hex8", "hex8i"):
        yield (
            f"mesh.element: {scene.mesh.element} has nodes that do not carry the contact alike; "
            'contact.model = "interface" needs "hex8i"'
        )
    if others:
        known = ", ".join(WHOLE_FACES_WANTS)
        yield f'want: contact.model = "interface" has no {", ".join(others)}; take of {known}'
    if integrated and scene.balance.method == "balance":
        which = ", ".join(integrated)
        yield f'want: {which} of whole faces: from sweeps alone, write balance.method = "march"'


def _static_problems(scene: ForcedScene) -> Iterator[str]:
    """Ratios of one face and forces of the other, more than friction, faces that pull."""
    given, mu = scene.contact.static, scene.contact.friction
    ratios = [] if isinstance(given, str) else [isinstance(given[side], float) for side in SIDES]
    if len(set(ratios)) > 1:
        yield (
            "contact.static: T/N of one face and forces of the other; give both faces alike: the "
            "ratios of both, or N and T of both"
        )
    for side in SIDES if len(set(ratios)) == 1 else ():
        one = given[side]
        if isinstance(one, float):
            if abs(one) > mu:
                yield (
                    f"contact.static.{side}: |T/N| = {abs(one):g} is beyond friction, {mu:g}; give "
                    "at most that"
                )
        elif one["N"] < 0.0:
            yield (
                f"contact.static.{side}: N = {one['N']:g} N pulls; a contact carries only pressure"
            )


def _stiffness_problems(where: str, s: StiffnessChoice, arrangement: str) -> Iterator[str]:
    """What of totals and contact analysis does not go together."""
    if (s.K_N is None) != (s.K_T is None):
        missing = "K_N" if s.K_N is None else "K_T"
        yield f"{where}: K_N and K_T come together; add {missing}"
        return
    without = [side for side in SIDES if s.face(side) is None]
    if s.scene is not None and s.run is not None:
        yield f"{where}: scene and run are both given; give one"
    if s.from_contact and s.K_N is not None:
        yield (
            f"{where}: K_N and K_T beside a contact analysis; give one of them, or left = "
            "{ K_N = ..., K_T = ... } for one face"
        )
    if not s.from_contact and without:
        yield (
            f"{where}: no stiffness for the {' and the '.join(without)} face; give K_N and K_T, or "
            "scene, or run"
        )
    if s.from_contact and arrangement == "asymmetric" and s.left is None:
        yield (
            f"{where}: a contact analysis gives the pads on the right; the left face needs left = "
            "{ K_N = ..., K_T = ... }"
        )
