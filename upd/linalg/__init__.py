"""Sparse linear algebra: factors, Schur complements, multigrid, modes.

Each is a function that returns an array, a result of arrays, or a function.
"""

from __future__ import annotations

from upd.linalg.amg import amg_solve, compliance_amg
from upd.linalg.common import Condensation, Factor
from upd.linalg.eigen import Eigenproblem, modes
from upd.linalg.eigen_checks import Modes
from upd.linalg.pardiso import factorise_pardiso, schur_pardiso
from upd.linalg.schur import factorise, schur_complement
from upd.linalg.select import Choice, Prediction, available, choose, predict
from upd.linalg.superlu import factorise_superlu, schur_superlu

__all__ = [
    "Choice",
    "Condensation",
    "Eigenproblem",
    "Factor",
    "Modes",
    "Prediction",
    "amg_solve",
    "available",
    "choose",
    "compliance_amg",
    "factorise",
    "factorise_pardiso",
    "factorise_superlu",
    "modes",
    "predict",
    "schur_complement",
    "schur_pardiso",
    "schur_superlu",
]
