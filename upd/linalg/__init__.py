"""Sparse linear algebra: factors, Schur complements, multigrid, modes.

Each is a function that returns an array, a result of arrays, or a function.
"""

from upd.linalg.amg import amg_solve as amg_solve
from upd.linalg.amg import compliance_amg as compliance_amg
from upd.linalg.common import Condensed as Condensed
from upd.linalg.common import Factor as Factor
from upd.linalg.eigen import Eigenproblem as Eigenproblem
from upd.linalg.eigen import modes as modes
from upd.linalg.eigen_checks import Modes as Modes
from upd.linalg.pardiso import factorise_pardiso as factorise_pardiso
from upd.linalg.pardiso import schur_pardiso as schur_pardiso
from upd.linalg.schur import factorise as factorise
from upd.linalg.schur import schur_complement as schur_complement
from upd.linalg.select import Choice as Choice
from upd.linalg.select import Prediction as Prediction
from upd.linalg.select import available as available
from upd.linalg.select import choose as choose
from upd.linalg.select import predict as predict
from upd.linalg.superlu import factorise_superlu as factorise_superlu
from upd.linalg.superlu import schur_superlu as schur_superlu
