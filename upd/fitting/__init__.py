"""Which inputs: those of a scene that give wanted numbers, and what these leave unknown.

`fit` is what a user calls; `FitResponses` what is aimed at with its derivatives, `Residuals` and
`knowledge` the misfit that is least, and what is known of the inputs.
"""

from upd.fitting.answer import Fit
from upd.fitting.residuals import Knowledge, Residuals, knowledge
from upd.fitting.responses import FitResponses
from upd.fitting.search import fit
from upd.fitting.targets import CurveTarget, Targets, read_parameters, read_targets

__all__ = [
    "CurveTarget",
    "Fit",
    "FitResponses",
    "Knowledge",
    "Residuals",
    "Targets",
    "fit",
    "knowledge",
    "read_parameters",
    "read_targets",
]
