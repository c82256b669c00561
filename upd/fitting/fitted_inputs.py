"""What a fit found: answers, numbers, and what is known of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upd.fitting.first_order import Knowledge
from upd.fitting.next_measurement import FurtherMeasurement
from upd.fitting.parameters import VariedInput
from upd.fitting.profile import Profile
from upd.fitting.residuals import Start
from upd.fitting.solver import Status
from upd.fitting.targets import CurveTarget, FitTarget
from upd.fitting.weights import CurveNoise
from upd.scene import ForcedScene

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FittedCurve:
    """A measured curve and the fitted one.

    Attributes
    ----------
    target : CurveTarget
        What was measured.
    noise : CurveNoise
        How well it is taken to be known.
    computed : ndarray
        (n,) of the first answer, complex or magnitudes, (m/s2)/N.
    """

    target: CurveTarget
    noise: CurveNoise
    computed: NDArray[np.complex128]

    @property
    def off(self) -> float:
        """Root of the mean square of the differences, over that of the measured values."""
        H = self.target.curve.accelerance
        computed = self.computed if self.target.curve.is_complex else np.abs(self.computed)
        return float(np.linalg.norm(computed - H) / np.linalg.norm(H))


@dataclass(frozen=True)
class FittedInputs:
    """What a fit found, as numbers.

    Attributes
    ----------
    source : ForcedScene
        The scene that was varied.
    stiffness : str
        Name of the contact stiffness that the numbers are of.
    targets : tuple of FitTarget
        Numbers that were to come out.
    measured : tuple of FittedCurve
        Measured curves that were, with what came out.
    parameters : tuple of VariedInput
        What was varied.
    status : str
        "found"; "several": answers apart from each other; "family": the targets leave a direction
        of the parameters unknown; "not reached": the nearest.
    answers : list of ndarray
        (n,) ln(factor) of every answer, the one nearest to the scene first; of a family, some of
        its members.
    numbers : ndarray
        (m,) of the first answer, in the units of the targets that are numbers.
    slopes : ndarray
        (m, n) their derivatives by ln(factor).
    known : Knowledge
        What the targets tell, to first order.
    profiles : tuple of Profile
        Sets that fit as well, by the parameter moved; only of those that were traced.
    curves : tuple of ndarray
        (k, 1 + m) for every parameter: its ln(factor), and the numbers as it moves alone; empty
        where an evaluation takes seconds.
    further : tuple of FurtherMeasurement
        What measurements that were not made would tell, the most telling first.
    starts : list of Start
        Where every start ended, the best first.
    directions : str
        contact.directions that the fitted scene has to name; "" where its own word does.
    exact : tuple of bool
        Which parameters have exact derivatives.
    evaluations : int
        Solved models.
    seconds : float
        Of the fit.
    """

    source: ForcedScene
    stiffness: str
    targets: tuple[FitTarget, ...]
    measured: tuple[FittedCurve, ...]
    parameters: tuple[VariedInput, ...]
    status: Status
    answers: list[Array]
    numbers: Array
    slopes: Array
    known: Knowledge
    profiles: tuple[Profile, ...]
    curves: tuple[Array, ...]
    further: tuple[FurtherMeasurement, ...]
    starts: list[Start]
    directions: str
    exact: tuple[bool, ...]
    evaluations: int
    seconds: float

    def is_traced(self, k: int) -> bool:
        """Whether there is a profile of a parameter, by its number."""
        return any(one.parameter == k for one in self.profiles)

    @property
    def widths(self) -> bool:
        """Whether targets have half-widths: then there are intervals."""
        return bool(self.measured) or self.targets[0].half_width is not None
