"""Reduction of a body to the dofs that matter."""

from __future__ import annotations

from upd.reduction.guyan import Condensed, condense, guyan_mass

__all__ = ["Condensed", "condense", "guyan_mass"]
