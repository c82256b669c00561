"""Reduction of a body to the dofs that matter."""

from __future__ import annotations

from upd.reduction.component_modes import (
    AttachedModel,
    ErrorTarget,
    attachment_modes,
    craig_bampton,
    frequency_error,
)
from upd.reduction.guyan import condense
from upd.reduction.mean_held import condense_held_in_mean
from upd.reduction.reduced import ReducedModel

__all__ = [
    "AttachedModel",
    "ErrorTarget",
    "ReducedModel",
    "attachment_modes",
    "condense",
    "condense_held_in_mean",
    "craig_bampton",
    "frequency_error",
]
