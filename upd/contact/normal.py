"""Frictionless normal contact of two condensed bodies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import lapack

from upd.contact.checks import (
    Problems,
    compliance_matrix,
    few_threads,
    node_mask,
    numbers,
    one_load,
)
from upd.contact.qp import FREE, LOWER, BoxQP, FloatArray, Method, State
from upd.labels import Shown

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, repr=False)
class NormalContact(Shown):
    """Answer of one normal contact problem with n nodes.

    Attributes
    ----------
    force : (n,) ndarray
        Nodal forces [N], >= 0.
    gap : (n,) ndarray
        Deformed gap [mm], >= 0.
    contact : (n,) ndarray of bool
        Nodes that carry force.
    approach : float
        Approach of the bodies d [mm].
    stiffness : float
        dF/d approach [N/mm] with the contact set held, e' C_AA^-1 e.
    iterations : int
        Factorisations.
    method : {"active set", "fallback"}
        Method that finished.
    status : {"converged", "no load", "no contact"}
    message : str
        One sentence.
    unclipped : (n,) ndarray
        Nodal forces before rounding below zero was clipped [N]: for checks.
    rates : (n,) ndarray or None
        Change of the forces with the approach at the contact set [N/mm], whose sum is the
        stiffness; None where another solver found the answer.
    """

    force: FloatArray
    gap: FloatArray
    contact: BoolArray
    approach: float
    stiffness: float
    iterations: int
    method: Method
    status: str
    message: str
    unclipped: FloatArray
    rates: FloatArray | None = None

    @property
    def load(self) -> float:
        """Sum of the nodal forces [N]."""
        return float(self.force.sum())


def normal_contact(
    compliance: ArrayLike,
    gap: ArrayLike,
    *,
    load: float | None = None,
    approach: float | None = None,
    start: ArrayLike | None = None,
) -> NormalContact:
    """Contact forces of two elastic bodies at a given load or a given approach.

    Find f >= 0 with g = h + C f - d e >= 0 and f.g = 0, where d is given (approach) or e'f = F is
    given (load).

    Parameters
    ----------
    compliance : (n, n) array_like
        Sum of both bodies' compliance at the contact nodes [mm/N], symmetric positive definite.
    gap : (n,) array_like
        Gap before loading [mm].
    load : float, optional
        Load F [N], >= 0. Give exactly one of `load` and `approach`.
    approach : float, optional
        Approach d [mm].
    start : (n,) array_like of bool, optional
        A guess of the contact set (that of a neighbouring load).

    Returns
    -------
    NormalContact

    Raises
    ------
    InputError
        For bad input; all problems are named.
    ConvergenceError
        When no method reaches the tolerance: an unconverged answer is never returned.

    References
    ----------
    K. L. Johnson, Contact Mechanics (1985), section 5.9; M. Hintermueller, K. Ito and K. Kunisch,
    SIAM J. Optim. 13 (2002) 865.

    Examples
    --------
    Three nodes, the third one 0.4 um apart: it stays open under 50 N.

    >>> import numpy as np
    >>> from upd.contact import normal_contact
    >>> C = 1e-5 * np.array([[2.0, 1.0, 0.5], [1.0, 2.0, 1.0], [0.5, 1.0, 2.0]])
    >>> result = normal_contact(C, gap=[0.0, 0.0, 4e-4], load=50.0)
    >>> result.status
    'converged'
    >>> result.force.round(6).tolist()
    [25.0, 25.0, 0.0]
    >>> result.contact.tolist()
    [True, True, False]
    >>> round(1e3 * result.approach, 6)  # um
    0.75
    """
    with few_threads(gap):
        problems = Problems("normal contact")
        problems.add((load is None) == (approach is None), "give exactly one of load and approach.")
        solver = _NormalSolver(problems, compliance, gap)
        mask = node_mask(problems, start, solver.n)
        name, given = ("load", load) if load is not None else ("approach", approach)
        target = one_load(problems, name, given)
        problems.raise_any()
        if load is not None:
            return solver.at_load(target, mask)
        return solver.at_approach(target, mask)


def normal_curve(
    compliance: ArrayLike, gap: ArrayLike, loads: Sequence[float] | FloatArray
) -> list[NormalContact]:
    """Contact at several loads, each started from the contact set of the one before.

    Parameters
    ----------
    compliance : (n, n) array_like
        Sum of both bodies' compliance [mm/N], as in `normal_contact`.
    gap : (n,) array_like
        Gap before loading [mm].
    loads : (k,) array_like
        Loads [N], >= 0, solved in the order given.

    Returns
    -------
    list of NormalContact
        One per load.

    Raises
    ------
    InputError, ConvergenceError
        As in `normal_contact`.
    """
    with few_threads(gap):
        problems = Problems("normal curve")
        solver = _NormalSolver(problems, compliance, gap)
        values = numbers(problems, "loads", loads, ("k",), (0,))
        if values is not None:
            one_load(problems, "load", float(values.min(initial=0.0)))
        problems.raise_any()
        assert values is not None
        curve: list[NormalContact] = []
        mask: BoolArray | None = None
        for value in values:
            curve.append(solver.at_load(float(value), mask))
            mask = curve[-1].contact
        return curve


class _NormalSolver:
    """Checked compliance and gap, ready for many loads."""

    def __init__(self, problems: Problems, compliance: ArrayLike, gap: ArrayLike) -> None:
        C, self.factor = compliance_matrix(problems, compliance)
        h = numbers(problems, "gap", gap, ("n" if C is None else len(C),))
        if C is not None:
            self.qp = BoxQP(C)
        self.gap = np.zeros(0) if h is None else h
        self.n = self.gap.size
        # Measured from the closest pair of nodes, so that a common offset of all gaps costs no
        # digits.
        self.closest = float(self.gap.min(initial=np.inf))
        self.h = self.gap - self.closest if self.n else self.gap
        self.lower, self.upper = np.zeros(self.n), np.full(self.n, np.inf)

    def at_load(self, load: float, start: BoolArray | None) -> NormalContact:
        """Contact at the load [N]."""
        if load == 0:
            message = (
                "The load is zero: the bodies touch without force at the smallest gap, "
                f"approach {self.closest:g} mm."
            )
            return apart(self.gap, self.closest, "no load", message)
        if start is None or not start.any():
            # The contact set of an elastic foundation as stiff as the whole patch pressed flat: too
            # large rather than too small, free of units.
            unit = lapack.dpotrs(self.factor, np.ones(self.n), lower=1)[0]
            foundation, order = float(unit.sum()) / self.n, np.sort(self.h)
            # Load carried when the foundation reaches each gap in turn.
            before = np.concatenate(([0.0], np.cumsum(order)[:-1]))
            carried = foundation * (np.arange(self.n) * order - before)
            start = self.h <= order[max(int(np.searchsorted(carried, load)), 1) - 1]
        return self._solve(np.asarray(start), load=load)

    def at_approach(self, approach: float, start: BoolArray | None) -> NormalContact:
        """Contact at the approach [mm]."""
        if approach <= self.closest:
            message = (
                f"The approach {approach:g} mm does not exceed the smallest gap "
                f"{self.closest:g} mm: no contact, no force."
            )
            return apart(self.gap, approach, "no contact", message)
        depth = approach - self.closest
        return self._solve(start if start is not None else self.h < depth, motion=depth)

    def _solve(
        self,
        mask: BoolArray,
        *,
        load: float | None = None,
        motion: float | None = None,
    ) -> NormalContact:
        state: State = np.where(mask, FREE, LOWER).astype(np.int8)
        answer = self.qp.solve(
            self.h, self.lower, self.upper, load=load, motion=motion, state=state
        )
        contact = answer.state == FREE
        message = (
            f"{int(contact.sum())} of {self.n} nodes in contact after {answer.iterations} "
            f"steps of the {answer.method}."
        )
        return NormalContact(
            force=answer.x,
            gap=np.maximum(answer.residual, 0.0),
            contact=contact,
            approach=float(answer.motion[0]) + self.closest,
            stiffness=float(answer.stiffness[0, 0]),
            iterations=answer.iterations,
            method=answer.method,
            status="converged",
            message=message,
            unclipped=answer.unclipped,
            rates=answer.rates[:, 0],
        )


def apart(gap: FloatArray, approach: float, status: str, message: str) -> NormalContact:
    """No node carries a force.

    Parameters
    ----------
    gap : (n,) ndarray
        Before loading [mm].
    approach : float
        mm.
    status, message : str
        As of `NormalContact`.
    """
    none, n = np.zeros(gap.size), gap.size
    return NormalContact(
        none,
        np.maximum(gap - approach, 0.0),
        np.zeros(n, dtype=bool),
        approach,
        0.0,
        0,
        "active set",
        status,
        message,
        none.copy(),
    )
