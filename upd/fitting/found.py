"""What a fit found: answers, numbers, and what is known of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upd.fitting.parameters import VariedInput
from upd.fitting.solver import Knowledge, Profile, Start, Status
from upd.fitting.targets import FitTarget
from upd.scene import ForcedScene

Array = NDArray[np.float64]


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
        What was to come out.
    parameters : tuple of VariedInput
        What was varied.
    status : str
        "found"; "several": answers apart from each other; "family": the targets leave a direction
        of the parameters unknown; "not reached": the nearest.
    answers : list of ndarray
        (n,) ln(factor) of every answer, the one nearest to the scene first; of a family, some of
        its members.
    numbers : ndarray
        (m,) of the first answer, in the targets' units.
    slopes : ndarray
        (m, n) their derivatives by ln(factor).
    known : Knowledge
        What the targets tell, to first order.
    profiles : tuple of Profile
        Sets that fit as well, by the parameter moved; empty where not traced.
    curves : tuple of ndarray
        (k, 1 + m) for every parameter: its ln(factor), and the numbers as it moves alone; empty
        where an evaluation takes seconds.
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
    parameters: tuple[VariedInput, ...]
    status: Status
    answers: list[Array]
    numbers: Array
    slopes: Array
    known: Knowledge
    profiles: tuple[Profile, ...]
    curves: tuple[Array, ...]
    starts: list[Start]
    directions: str
    exact: tuple[bool, ...]
    evaluations: int
    seconds: float
