"""The scene of a rig: natural frequencies, reduction and linear response of two blades on their
bases.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar, Literal

from upd.scene import quantities as q
from upd.scene.base import MeshChoice, RigBase, repeated, rig_problems
from upd.scene.measured import (
    FROM_MEASURED,
    UNTIL_READ,
    MeasuredChoice,
    fitted_modes,
    measured_problems,
)

#: Outputs a rig scene can ask for.
MODAL_WANTS = ("free", "glued", "reduction", "response", "pictures", "matrices")
ModalWant = Annotated[str, q.one_of(MODAL_WANTS), q.Example('"free"', '"glued"')]


@dataclass(frozen=True)
class ModesChoice:
    """Modes below a frequency, for one or both arrangements of the platforms.

    Attributes
    ----------
    below
        All modes below it are found. Cost: a factorisation per shift, more of them for many modes.
    arrangements
        Which sides of the platforms face each other. Cost: each is meshed and solved.
    """

    below: q.Frequency = 1100.0
    arrangements: Annotated[tuple[Literal["symmetric", "asymmetric"], ...], q.FILLED] = (
        "symmetric",
    )


@dataclass(frozen=True)
class ReductionChoice:
    """Fixed-interface modes kept per blade, beside all patch, force and accelerometer dofs.

    Attributes
    ----------
    modes
        Their number; 10 when neither below nor error is given. Cost: small, a mode is a dof of
        the reduced model.
    below
        All of them below a frequency, instead of their number.
    error
        As few as bring the blade's own frequencies below modes.below within this relative
        error, instead of their number. Cost: the blade's own modes are found as well.
    """

    modes: Annotated[int, q.not_negative] | None = None
    below: q.Frequency | None = None
    error: q.Share | None = None

    @property
    def words(self) -> str:
        """What is kept, in words."""
        if self.below is not None:
            return f"modes below {self.below:g} Hz"
        return (
            f"modes for an error of {100.0 * self.error:g} %"
            if self.error is not None
            else f"{self.count} modes"
        )

    @property
    def count(self) -> int:
        """Number of modes when nothing else is given."""
        return 10 if self.modes is None else self.modes


@dataclass(frozen=True)
class ResponseChoice:
    """Linear frequency response between two frequencies.

    Attributes
    ----------
    start, stop
        Lowest and highest frequency.
    points
        Frequencies of the response. Cost: small, the model is reduced.
    damping
        Modal damping ratio of all modes; or "measured": that of the highest peak of the measured
        free curves.
    peak
        Free peak accelerance that the damping ratio is tuned to instead, (m/s2)/N.
    """

    start: q.Frequency = 200.0
    stop: q.Frequency = 600.0
    points: Annotated[int, q.at_least(10)] = 2000
    damping: Annotated[q.Share, q.or_from(FROM_MEASURED, UNTIL_READ)] = 0.005
    peak: Annotated[float, q.positive, q.Example("120.0", kind="(m/s2)/N")] | None = None


@dataclass(frozen=True, kw_only=True)
class ModalScene(RigBase):
    """Natural frequencies, reduction and linear response of the rig.

    Attributes
    ----------
    want
        Outputs: "free", modes of the two blades without a damper; "glued", modes with the damper
        glued between the platforms; "reduction", Craig-Bampton models of both blades, checked
        against the full ones; "response", linear frequency response at both accelerometers;
        "pictures", pictures of the mode shapes, and the shapes as VTU; "matrices", reduced K and M
        as Matrix Market files with the map of their dofs. Cost: upd plan shows what each brings
        with it.
    measured
        Measured responses by name, beside the computed one: "free" of the right blade, "stuck" of
        both with the damper glued.
    """

    analysis: ClassVar[str] = "rig"

    want: Annotated[tuple[ModalWant, ...], q.FILLED]
    mesh: MeshChoice = field(default_factory=lambda: MeshChoice(element="hex20"))
    modes: ModesChoice = field(default_factory=ModesChoice)
    reduction: ReductionChoice = field(default_factory=ReductionChoice)
    response: ResponseChoice = field(default_factory=ResponseChoice)
    measured: Mapping[q.Name, MeasuredChoice] = field(default_factory=dict)

    def derived(self, data: Mapping[str, Any]) -> ModalScene:
        """With damping from measured curves."""
        fitted, ratio = fitted_modes(self.measured, data, "response")
        return replace(self, response=replace(self.response, damping=ratio)) if fitted else self

    def problems(self) -> Iterator[str]:
        """What does not fit together."""
        response, below = self.response, self.modes.below
        given = [
            name
            for name in ("modes", "below", "error")
            if getattr(self.reduction, name) is not None
        ]
        yield from repeated("modes.arrangements", self.modes.arrangements)
        yield from measured_problems(self.measured)
        yield from rig_problems(self)
        stop = f"response.stop, {response.stop:g} Hz"
        if not response.start < response.stop:
            yield f"response.start: {response.start:g} Hz is not below {stop}"
        if self.wants("response") and below < response.stop:
            yield f"modes.below: {below:g} Hz is below {stop}; the response needs its modes"
        if self.measured and not self.wants("response"):
            yield 'measured: nothing is computed beside it; add "response" to want'
        for name, one in self.measured.items():
            if one.centrifugal_to_force is not None:
                yield (
                    f"measured.{name}: centrifugal_to_force: a rig has no friction; give state, or "
                    'make it a forced response (analysis = "forced response")'
                )
        if len(given) > 1:
            yield f"reduction: {' and '.join(given)} are given; give one of modes, below, error"
        if self.wants("matrices") and not self.wants("reduction"):
            yield "want: 'matrices' needs \"reduction\" too"
