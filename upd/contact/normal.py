"""Frictionless normal contact of two condensed bodies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.contact.checks import Faults, compliance_matrix, numbers, unit_response
from upd.contact.qp import FREE, LOWER, BoxQP, FloatArray, Method, State
from upd.contact.threads import few_threads

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class NormalContact:
    """Answer of one normal contact problem.

    force (n,) >= 0 [N]; gap (n,) deformed gap >= 0 [mm]; contact (n,) nodes that carry force; approach [mm]; stiffness dF/d approach
    [N/mm] with the contact set held, e' C_AA^-1 e; iterations (factorisations); method that finished, "active set" or "fallback";
    status "converged", "no load" or "no contact"; message, one sentence.
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
    max_iter: int | None = None,
) -> NormalContact:
    """Contact forces of two elastic bodies at a given load or a given approach.

    Find f >= 0 with g = h + C f - d e >= 0 and f.g = 0, where d is given (approach) or e'f = F is given (load).

    compliance (n, n) [mm/N], sum of both bodies, symmetric positive definite; gap (n,) [mm] before loading; load [N]; approach [mm];
    start (n,) bool, a guess of the contact set (that of a neighbouring load); max_iter, largest number of factorisations.
    InputError names every fault of the input; ConvergenceError when no method reaches the tolerance, never an unconverged answer.
    Source: Johnson, Contact Mechanics (1985), section 5.9; Hintermueller, Ito and Kunisch, SIAM J. Optim. 13 (2002) 865.
    """
    with few_threads(gap):
        faults = Faults("normal contact")
        faults.add((load is None) == (approach is None), "give exactly one of load and approach.")
        solver = _Solver(faults, compliance, gap)
        mask = None
        if start is not None:
            mask = np.asarray(start)
            faults.add(mask.dtype != bool or mask.shape != (solver.n,), f"start must be a bool mask of shape ({solver.n},), one per node.")
        faults.add(max_iter is not None and max_iter < 1, f"max_iter is {max_iter}: it must be at least 1.")
        target = _scalar(faults, "load", load) if load is not None else _scalar(faults, "approach", approach)
        _check_load(faults, load if load is not None else 0.0)
        faults.raise_any()
        if load is not None:
            return solver.at_load(target, mask, max_iter)
        return solver.at_approach(target, mask, max_iter)


def normal_curve(compliance: ArrayLike, gap: ArrayLike, loads: Sequence[float] | FloatArray) -> list[NormalContact]:
    """Contact at each of `loads` [N], in the order given, each started from the contact set of the one before.

    compliance (n, n) [mm/N]; gap (n,) [mm]. Errors as `normal_contact`.
    """
    with few_threads(gap):
        faults = Faults("normal curve")
        solver = _Solver(faults, compliance, gap)
        values = numbers(faults, "loads", np.asarray(loads))
        if values is not None and not faults.add(values.ndim != 1, f"loads has shape {values.shape}: it must be one-dimensional."):
            _check_load(faults, float(values.min(initial=0.0)))
        faults.raise_any()
        assert values is not None
        curve: list[NormalContact] = []
        mask: BoolArray | None = None
        for value in values:
            curve.append(solver.at_load(float(value), mask, None))
            mask = curve[-1].contact
        return curve


def _scalar(faults: Faults, name: str, value: float | None) -> float:
    array = numbers(faults, name, np.asarray(0.0 if value is None else value))
    if array is None or faults.add(array.size != 1, f"{name} must be one number, it has {array.size} values."):
        return 0.0
    return float(array.reshape(()))


def _check_load(faults: Faults, load: float) -> None:
    value = np.asarray(load)
    if value.size == 1 and value.dtype.kind in "fiu":
        faults.add(bool(value < 0), f"load is {float(value):g} N: the bodies cannot pull on each other, give a load >= 0.")


class _Solver:
    """Checked compliance and gap, ready for many loads."""

    def __init__(self, faults: Faults, compliance: ArrayLike, gap: ArrayLike) -> None:
        C = compliance_matrix(faults, compliance)
        h = numbers(faults, "gap", gap)
        if C is not None:
            self.unit = unit_response(faults, C)
            self.qp = BoxQP(C)
        if h is not None:
            faults.add(h.ndim != 1 or h.size == 0, f"gap has shape {h.shape}: it must be (n,), one value per contact node.")
            faults.add(
                C is not None and h.ndim == 1 and len(C) != h.size,
                f"compliance has {0 if C is None else len(C)} rows and gap {h.size} values: both need one per contact node.",
            )
        self.gap = np.zeros(0) if h is None else h
        self.n = self.gap.size
        # Measured from the closest pair of nodes, so that a common offset of all gaps costs no digits.
        self.closest = float(self.gap.min(initial=np.inf))
        self.h = self.gap - self.closest if self.n else self.gap
        self.lower, self.upper = np.zeros(self.n), np.full(self.n, np.inf)

    def at_load(self, load: float, start: BoolArray | None, max_iter: int | None) -> NormalContact:
        """Contact at the load [N]."""
        if load == 0:
            message = f"The load is zero: the bodies touch without force at the smallest gap, approach {self.closest:g} mm."
            return self._apart(self.closest, "no load", message)
        mask = start if start is not None and start.any() else self._winkler(load)
        return self._solve(mask, max_iter, total=load)

    def at_approach(self, approach: float, start: BoolArray | None, max_iter: int | None) -> NormalContact:
        """Contact at the approach [mm]."""
        if approach <= self.closest:
            message = f"The approach {approach:g} mm does not exceed the smallest gap {self.closest:g} mm: no contact, no force."
            return self._apart(approach, "no contact", message)
        depth = approach - self.closest
        return self._solve(start if start is not None else self.h < depth, max_iter, shift=depth)

    def _solve(self, mask: BoolArray, max_iter: int | None, *, total: float | None = None, shift: float | None = None) -> NormalContact:
        state: State = np.where(mask, FREE, LOWER).astype(np.int8)
        answer = self.qp.solve(self.h, self.lower, self.upper, total=total, shift=shift, state=state, max_iter=max_iter)
        contact = answer.state == FREE
        message = f"{int(contact.sum())} of {self.n} nodes in contact after {answer.iterations} steps of the {answer.method}."
        return NormalContact(
            force=answer.x,
            gap=np.maximum(answer.residual, 0.0),
            contact=contact,
            approach=answer.shift + self.closest,
            stiffness=answer.stiffness,
            iterations=answer.iterations,
            method=answer.method,
            status="converged",
            message=message,
        )

    def _apart(self, approach: float, status: str, message: str) -> NormalContact:
        gap = np.maximum(self.gap - approach, 0.0)
        return NormalContact(np.zeros(self.n), gap, np.zeros(self.n, dtype=bool), approach, 0.0, 0, "active set", status, message)

    def _winkler(self, load: float) -> BoolArray:
        """Contact set of an elastic foundation as stiff as the whole patch pressed flat: too large rather than too small, free of units."""
        foundation = float(self.unit.sum()) / self.n
        order = np.sort(self.h)
        # Load carried when the foundation reaches each gap in turn.
        carried = foundation * (np.arange(self.n) * order - np.concatenate(([0.0], np.cumsum(order)[:-1])))
        count = int(np.searchsorted(carried, load))
        return np.asarray(self.h <= order[max(count, 1) - 1])
