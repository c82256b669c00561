"""The scene of a rig: natural frequencies, reduction and linear response of two blades on their
bases.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from upd.scene.base import (
    STRICT,
    LeftOut,
    MaterialData,
    MeshChoice,
    RecipeScene,
    SolverChoice,
    known_output,
)
from upd.scene.measured import FROM_MEASURED, UNTIL_READ, MeasuredChoice, measured_problems
from upd.scene.quantities import (
    FILLED,
    Accuracy,
    Example,
    Frequency,
    Geometry,
    Name,
    Noted,
    Share,
    Uncertainty,
    at_least,
    not_negative,
    or_from,
    positive,
)
from upd.scene.rig import rig_problems

#: Outputs a rig scene can ask for, and what each one is.
MODAL_WANTS = {
    "free": "modes of the two blades without a damper",
    "glued": "modes with the damper glued between the platforms",
    "reduction": "Craig-Bampton models of both blades, checked against the full ones",
    "response": "linear frequency response at both accelerometers",
    "pictures": "pictures of the mode shapes, and the shapes as VTU",
    "matrices": "reduced K and M as Matrix Market files with the map of their dofs",
}


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

    __pydantic_config__ = STRICT
    below: Frequency = 1100.0
    arrangements: Annotated[tuple[Literal["symmetric", "asymmetric"], ...], FILLED] = ("symmetric",)


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

    __pydantic_config__ = STRICT
    modes: Annotated[int, not_negative] | None = None
    below: Frequency | None = None
    error: Share | None = None

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

    __pydantic_config__ = STRICT
    start: Frequency = 200.0
    stop: Frequency = 600.0
    points: Annotated[int, at_least(10)] = 2000
    damping: Annotated[Share, or_from(FROM_MEASURED, UNTIL_READ)] = 0.005
    peak: Annotated[float, positive, Noted("(m/s2)/N"), Example.of("120.0")] | None = None


@dataclass(frozen=True)
class ModalScene(RecipeScene):
    """One simulation of the rig.

    ``geometry`` holds the recipe's name under "recipe" and its parameters beside it, in mm.

    Attributes
    ----------
    name
        Of the run folder.
    title
        Heading of the page.
    want
        Outputs; all else follows from them. Cost: upd plan shows what each brings with it.
    geometry
        The recipe and its parameters.
    material
        Of blades, bases and damper.
    measured
        Measured responses by name, beside the computed one: "free" of the right blade, "stuck" of
        both with the damper glued.
    accuracy
        Largest estimated error wanted, of all main numbers or of some by their names: the run
        chooses the cheapest levels that reach it. "unknown" leaves all errors unknown; when none,
        they are estimated on the scene's own levels. Cost: the companions of an estimate take up to
        a third of the run; half the error of a mesh takes about eight times the elements.
    """

    __pydantic_config__ = STRICT
    name: Name
    want: Annotated[
        tuple[Annotated[str, known_output(MODAL_WANTS), Example.of('"free"', '"glued"')], ...],
        FILLED,
    ]
    geometry: Geometry
    material: MaterialData
    title: str = ""
    mesh: MeshChoice = field(default_factory=lambda: MeshChoice(element="hex20"))
    modes: ModesChoice = field(default_factory=ModesChoice)
    reduction: ReductionChoice = field(default_factory=ReductionChoice)
    response: ResponseChoice = field(default_factory=ResponseChoice)
    measured: Mapping[Name, MeasuredChoice] = field(default_factory=dict)
    solver: SolverChoice = field(default_factory=SolverChoice)
    left_out: LeftOut = field(default_factory=LeftOut)
    accuracy: Accuracy = None
    text: str = field(default="", repr=False)
    uncertain: Mapping[str, Uncertainty] = field(default_factory=dict, repr=False)


def modal_problems(scene: ModalScene) -> list[str]:
    """What does not fit together."""
    problems = []
    if not scene.response.start < scene.response.stop:
        problems.append(
            f"response.start: {scene.response.start:g} Hz is not below response.stop, "
            f"{scene.response.stop:g} Hz"
        )
    if scene.wants("response") and scene.modes.below < scene.response.stop:
        problems.append(
            f"modes.below: {scene.modes.below:g} Hz is below response.stop, "
            f"{scene.response.stop:g} Hz; the response needs its modes"
        )
    if scene.measured and not scene.wants("response"):
        problems.append('measured: nothing is computed beside it; add "response" to want')
    problems += measured_problems(scene.measured)
    problems += [
        f"measured.{name}: centrifugal_to_force: a rig has no friction; give state, or make it a "
        'forced response (analysis = "forced response")'
        for name, one in scene.measured.items()
        if one.centrifugal_to_force is not None
    ]
    problems += rig_problems(
        scene.mesh,
        scene.solver,
        None,
        of="a rig",
        instead="geometry.refine, and see upd study SCENE --vary mesh",
    )
    if len(set(scene.modes.arrangements)) < len(scene.modes.arrangements):
        problems.append("modes.arrangements: one is duplicated")
    given = [
        name for name in ("modes", "below", "error") if getattr(scene.reduction, name) is not None
    ]
    if len(given) > 1:
        problems.append(
            f"reduction: {' and '.join(given)} are given; give one of modes, below, error"
        )
    needs = [w for w in ("matrices",) if w in scene.want and "reduction" not in scene.want]
    return problems + [f'want: {w!r} needs "reduction" too' for w in needs]
