"""Which inputs: those of a scene that give wanted numbers, and what these leave unknown.

`fit` is what a user calls; `LinearResponses` the numbers with their derivatives, `Residuals` and
`knowledge` what is sought and what is told of it.
"""

from upd.fitting.answer import Fit, fit
from upd.fitting.parameters import VariedInput, read_parameters
from upd.fitting.responses import LinearResponses
from upd.fitting.solver import Knowledge, Profile, Residuals, knowledge
from upd.fitting.targets import FitTarget, read_targets

__all__ = [
    "Fit",
    "FitTarget",
    "Knowledge",
    "LinearResponses",
    "Profile",
    "Residuals",
    "VariedInput",
    "fit",
    "knowledge",
    "read_parameters",
    "read_targets",
]
