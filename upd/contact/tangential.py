"""Coulomb friction between two condensed bodies at frozen normal forces, with the slip history."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.contact.checks import Problems, few_threads
from upd.contact.qp import FloatArray, State
from upd.contact.tangential_step import TangentialContact, TangentialHistory, TangentialSolver
from upd.labels import Shown

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, repr=False)
class TangentialPath(Shown):
    """Answers of a load history of k steps.

    Attributes
    ----------
    displacement, load : (k,) or (k, 2) ndarray
        Rigid displacement [mm] and load [N].
    force, slip : (k, n) or (k, 2 n) ndarray
        Tractions [N] and accumulated slip [mm].
    state : (k, n) ndarray of int
        0 stick, +1 or -1 slip, 0 without normal force.
    slip_work : (k,) ndarray
        Work dissipated per step [N mm].
    stiffness : (k,) or (k, 2, 2) ndarray
        dT/dd [N/mm].
    iterations : (k,) ndarray of int
        Steps of the solver.
    fallbacks : int
        Number of load steps that the fallback had to finish.
    status : {"converged", "gross slip", "no friction"}
        "gross slip" when some step slips everywhere.
    message : str
        One sentence.
    history : TangentialHistory
        After the last step.
    unclipped : (k, n) or (k, 2 n) ndarray
        Tractions before they were brought inside their limits [N]: for checks.
    """

    displacement: FloatArray
    load: FloatArray
    force: FloatArray
    slip: FloatArray
    state: State
    slip_work: FloatArray
    stiffness: FloatArray
    iterations: NDArray[np.int_]
    fallbacks: int
    status: str
    message: str
    history: TangentialHistory
    unclipped: FloatArray

    def loop_area(self, first: int = 0) -> float:
        """Work of the load over the path, by the trapezoidal rule.

        Parameters
        ----------
        first : int
            Step the path is taken from; over a closed loop the work is the dissipated energy.

        Returns
        -------
        float
            Work [N mm].
        """
        middle = (self.load[first + 1 :] + self.load[first:-1]) / 2
        return float((middle * np.diff(self.displacement[first:], axis=0)).sum())


def tangential_contact(
    compliance: ArrayLike,
    limit: ArrayLike,
    *,
    load: ArrayLike | None = None,
    displacement: ArrayLike | None = None,
    history: TangentialHistory | None = None,
) -> TangentialContact:
    """Friction tractions for one load step at frozen normal forces.

    Slip w = d - C t. A node sticks, w = w_prev, or slips with |t| = limit and w - w_prev = lambda
    t, lambda >= 0: the minimum of 1/2 t'C t - (d - w_prev)'t over |t_i| <= limit_i, with the rigid
    displacement d given or found from the load e't = T.

    Parameters
    ----------
    compliance : (n, n) or (2 n, 2 n) array_like
        Compliance [mm/N], symmetric positive definite: (n, n) for one direction, (2 n, 2 n) for two
        with dofs [x_0 .. x_{n-1}, y_0 .. y_{n-1}].
    limit : (n,) array_like
        Friction limits [N]: mu times the normal force, >= 0.
    load : float or (2,) array_like, optional
        Load T [N]. Give exactly one of `load` and `displacement`.
    displacement : float or (2,) array_like, optional
        Rigid displacement d [mm].
    history : TangentialHistory, optional
        Of the step before; None starts from no slip and full stick.

    Returns
    -------
    TangentialContact

    Raises
    ------
    InputError
        For bad input, and for gross slip (a load not below the sum of the limits); all problems are
        named.
    ConvergenceError
        When no method reaches the tolerance.

    References
    ----------
    K. L. Johnson, Contact Mechanics (1985), section 7.2; S. Hueeber, G. Stadler and
    B. I. Wohlmuth, SIAM J. Sci. Comput. 30 (2008) 572.

    Examples
    --------
    The two outer nodes of three slip under 9 N, the middle one takes the rest:

    >>> import numpy as np
    >>> from upd.contact import tangential_contact
    >>> C = 1e-5 * np.array([[2.0, 1.0, 0.5], [1.0, 2.0, 1.0], [0.5, 1.0, 2.0]])
    >>> result = tangential_contact(C, limit=[3.0, 6.0, 3.0], load=9.0)
    >>> result.force.round(6).tolist()
    [3.0, 3.0, 3.0]
    >>> result.slipping.tolist()
    [True, False, True]
    >>> round(1e3 * result.displacement, 6)  # um
    0.12
    """
    with few_threads(compliance):
        problems = Problems("tangential contact")
        solver = TangentialSolver(problems, compliance, limit)
        values = solver.targets(problems, load, displacement, steps=False)
        start = solver.start(problems, history)
        problems.raise_any()
        return solver.step(values, load is not None, start)


def tangential_path(
    compliance: ArrayLike,
    limit: ArrayLike,
    *,
    loads: ArrayLike | None = None,
    displacements: ArrayLike | None = None,
    history: TangentialHistory | None = None,
) -> TangentialPath:
    """March a load history, each step from the slip and the states of the one before.

    Parameters
    ----------
    compliance : (n, n) or (2 n, 2 n) array_like
        Compliance [mm/N], as in `tangential_contact`.
    limit : (n,) array_like
        Friction limits [N].
    loads : (k,) or (k, 2) array_like, optional
        Loads [N]. Give exactly one of `loads` and `displacements`.
    displacements : (k,) or (k, 2) array_like, optional
        Rigid displacements [mm].
    history : TangentialHistory, optional
        Of the step before the first; None starts from no slip and full stick.

    Returns
    -------
    TangentialPath

    Raises
    ------
    InputError, ConvergenceError
        As in `tangential_contact`.

    Examples
    --------
    A full cycle of the load: the loop area is the work dissipated by slip.

    >>> import numpy as np
    >>> from upd.contact import tangential_path
    >>> C = 1e-5 * np.array([[2.0, 1.0, 0.5], [1.0, 2.0, 1.0], [0.5, 1.0, 2.0]])
    >>> path = tangential_path(C, limit=[3.0, 6.0, 3.0], loads=[9.0, -9.0, 9.0])
    >>> path.state.tolist()
    [[1, 0, 1], [-1, 0, -1], [1, 0, 1]]
    >>> (1e3 * path.displacement).round(6).tolist()  # um
    [0.12, -0.12, 0.12]
    >>> bool(np.all(path.slip_work > 0))
    True
    """
    with few_threads(compliance):
        problems = Problems("tangential path")
        solver = TangentialSolver(problems, compliance, limit)
        values = solver.targets(problems, loads, displacements, steps=True)
        at = solver.start(problems, history)
        problems.raise_any()
        steps: list[TangentialContact] = []
        for value in values:
            steps.append(solver.step(value, loads is not None, at))
            at = steps[-1].history
    bad = [step for step in steps if step.status != "converged"]
    return TangentialPath(
        displacement=np.array([step.displacement for step in steps]),
        load=np.array([step.load for step in steps]),
        force=np.array([step.force for step in steps]),
        slip=np.array([step.slip for step in steps]),
        state=np.array([step.history.state for step in steps]),
        slip_work=np.array([step.slip_work for step in steps]),
        stiffness=np.array([step.stiffness for step in steps]),
        iterations=np.array([step.iterations for step in steps]),
        fallbacks=sum(step.method == "fallback" for step in steps),
        status=bad[0].status if bad else "converged",
        message=f"{len(steps)} load steps solved."
        + (f" {len(bad)} of them: {bad[0].message}" if bad else ""),
        history=at,
        unclipped=np.array([step.unclipped for step in steps]),
    )
