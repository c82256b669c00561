"""Newton's method for points of the balance by whole faces, in planes across its curve."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upd.errors import ConvergenceError
from upd.hbm.core.factors import Border, KeptFactors
from upd.hbm.core.newton import Settings
from upd.hbm.faces.equations import InterfaceEquations
from upd.hbm.faces.newton import InterfaceEvaluation, slips_for_good
from upd.hbm.faces.state import FloatArray
from upd.hbm.faces.step import SOLVED

#: share of the step before that a step by updated factors may have. A derivative costs about four
#: residuals and its step leaves some hundredths, the fifth root of which this is; it weighs costs
SHRINKS = 0.5


class PlaneSteps:
    """Corrections in a plane, by factors of the point itself or of another one.

    Those that learn are updated by every step. With B the factors' matrix, s the steps taken so far
    and r the residual,

        z = -B^-1 r,   z += s_{k+1} (s_k . z) / |s_k|^2 for every step but the last,
        s_{n+1} = z / (1 - s_n . z / |s_n|^2)

    (Broyden). The others, Newton's own, are by a few directions of the derivative at the point.

    Parameters
    ----------
    known : InterfaceEvaluation
        With its factors. Their border may be another plane's where they learn: a share of its
        tangent leads into the plane.
    normal : (u + 1,) ndarray
        Across the plane, a unit vector in units of D.
    D : (u,) ndarray
        Units of the unknowns here.
    learns : bool
        Whether they lead on from the next point.
    """

    def __init__(
        self, known: InterfaceEvaluation, normal: FloatArray, D: FloatArray, learns: bool
    ) -> None:
        self.known, self.normal, self.learns = known, normal, learns
        self.steps: list[FloatArray] = []
        self.units, self.along = np.ones(len(D) + 1), normal
        if learns:
            self.units = np.append(known.D / D, 1.0)
            along = self.units * known.factors.solve(np.zeros(len(D)), 1.0)
            self.along = along / float(normal @ along)

    def updated(self, found: InterfaceEvaluation, last: float) -> FloatArray | None:
        """The step that was learned, at a point with the same unknowns and the same form of the
        equations; None where it is not much shorter than the last one.
        """
        alike = len(self.known.D) == len(found.x) and np.array_equal(found.good, self.known.good)
        step = self.next(found.residual) if self.learns and alike else None
        shrinks = step is not None and float(np.linalg.norm(step)) <= SHRINKS * last
        return step if shrinks else None

    def next(self, residual: FloatArray) -> FloatArray:
        """The step from the residual where the last one led to.

        Parameters
        ----------
        residual : (u,) ndarray

        Returns
        -------
        (u + 1,) ndarray
            In units of D, exactly in the plane; not finite where there is none.
        """
        z = self.units * self.known.factors.solve(-residual, 0.0)
        z -= self.along * float(self.normal @ z)
        steps = self.steps
        if steps:
            sizes = [float(one @ one) for one in steps]
            for k in range(len(steps) - 1):
                z = z + steps[k + 1] * (float(steps[k] @ z) / sizes[k])
            with np.errstate(divide="ignore", invalid="ignore"):
                z = z / (1.0 - np.float64(steps[-1] @ z) / sizes[-1])
        if self.learns:
            steps.append(z)
        return z


#: share of the correction before, two of which in a row end a correction: at it twelve would not
#: take a step of the curve to the tolerance; it weighs costs against those of a shorter step
WAVERS = 0.6
#: unknowns from which on few directions are cheaper than a derivative. It only weighs costs
MANY = 300

#: share of the step before that one of Newton's has at most where it starts close enough to the
#: answer: such steps are no reason for a shorter one along the curve (P. Deuflhard, Newton Methods
#: for Nonlinear Problems, 2004, 2.1: contraction 1/4 keeps the iteration in its tube)
FAST = 0.25


@dataclass(frozen=True)
class InterfacePlace:
    """Where a curve stands.

    Attributes
    ----------
    x : (u,) ndarray
        Unknowns, solved.
    p : float
        Hz.
    tangent : (u + 1,) ndarray
        Onwards, scaled.
    step : float
        The next one.
    iterations : int
        Derivatives formed.
    known : InterfaceEvaluation
        With the factors there.
    mobile : (n,) ndarray of bool
        Nodes whose slips are among the unknowns.
    """

    x: FloatArray
    p: float
    tangent: FloatArray
    step: float
    iterations: int
    known: InterfaceEvaluation
    mobile: NDArray[np.bool_]


class InterfaceCorrector:
    """Newton's method for the equations.

    Parameters
    ----------
    equations : InterfaceEquations
    settings : Settings
    p_scale : float
        Size of the frequency [Hz].
    """

    def __init__(self, equations: InterfaceEquations, settings: Settings, p_scale: float) -> None:
        self.equations, self.settings, self.p_scale = equations, settings, p_scale
        self.kept = KeptFactors()

    def correct(
        self,
        x: FloatArray,
        p: float,
        normal: FloatArray,
        D: FloatArray,
        past: FloatArray,
        known: InterfaceEvaluation | None = None,
    ) -> InterfacePlace | None:
        """Newton's method in the plane across `normal` through a point; None where it fails.

        The steps are whole ones. The factors at hand, of the point before or of an earlier step,
        serve for further ones with Broyden's updates as long as these shrink fast. A node that has
        left the place of its past to come to the verge of slipping, and is sent back beyond that
        place, stays there.

        Parameters
        ----------
        x : (u,) ndarray
            Guess.
        p : float
            Its frequency.
        normal : (u + 1,) ndarray
            In scaled coordinates.
        D : (u,) ndarray
            Units of the unknowns.
        past : (2 n,) ndarray
            Slips at the point before.
        known : InterfaceEvaluation, optional
            A point near by with its factors, from which shorter steps can be taken where this one
            fails.
        """
        e, s = self.equations, self.settings
        count, sizes, near = 0, [np.inf, np.inf], known is not None
        steps: PlaneSteps | None = None
        if known is not None and len(known.D) == len(D) < MANY:
            steps = PlaneSteps(known, normal, D, True)
        while True:
            try:
                period = e.march(x, 2.0 * np.pi * p)
            except ConvergenceError:
                return None
            if (period.moving & ~e.mobile).any():
                # slips of more nodes are unknowns from now on
                x, D, normal = self._with_more(period.moving, x, D, normal)
                steps = None
                continue
            found = InterfaceEvaluation(e, x, period, past)
            step = None if steps is None else steps.updated(found, sizes[-1])
            if steps is None or step is None:
                if count == 0:
                    sizes = [np.inf, np.inf]
                known = self.factors_at(found, normal, D)
                if known is None:
                    return None
                steps = PlaneSteps(known, normal, D, len(D) < MANY)
                step = steps.next(found.residual)
                # steps in few directions cost little where they converge fast
                fast = not steps.learns and float(np.linalg.norm(step)) <= FAST * sizes[-1]
                count += count == 0 or not fast
                if count > s.iterations:
                    return None
            sizes.append(float(np.linalg.norm(step)))
            # nodes that change their states to and fro: a shorter step separates them
            wavers = all(sizes[k] > WAVERS * sizes[k - 1] for k in (-1, -2))
            # Newton's own that grow near a known point: there is a shorter step to be taken
            grows = near and not steps.learns and not sizes[-1] < sizes[-2]
            if wavers or grows or not sizes[-1] < sizes[-3]:
                return None
            x, p = x + step[:-1] * D, p + float(step[-1]) * self.p_scale
            if self._stay(x, found, past):
                # the step taken is not the one that was asked for
                steps = PlaneSteps(steps.known, normal, D, len(D) < MANY)
            if float(np.abs(step).max()) * len(step) ** 0.5 <= s.tolerance:
                # the way on is that of the answer, not of the point whose factors led to it
                if steps.known is not found and self.factors_at(found, normal, D) is None:
                    return None
                tangent = found.factors.tangent()
                return InterfacePlace(x, p, tangent, 0.0, count + 1, found, e.mobile)

    def widened(self, at: InterfacePlace) -> InterfacePlace:
        """The same place with the unknowns that there are now."""
        e = self.equations
        places = e.places_of(at.mobile)
        tangent = np.append(e.widened(at.tangent[:-1], places, 0.0), at.tangent[-1])
        return replace(at, x=e.widened(at.x, places), tangent=tangent, mobile=e.mobile)

    def scale(self, x: FloatArray) -> FloatArray:
        """Sizes of the unknowns.

        The largest coefficient of the motion is one, so is the mean displacement. The damper's
        state and the slips are measured by the motion of the faces, and all of either together.

        Parameters
        ----------
        x : (u,) ndarray

        Returns
        -------
        (u,) ndarray
        """
        e = self.equations
        q, rigid, _ = e.split(x)
        still = float(np.abs(q[0]).max(initial=0.0))
        # samples are solved to a share of their forces: a motion smaller than that, as the
        # tolerance magnifies it, is not resolved to its own size
        least = np.abs(e.drive @ e.model.places.T / e.model.omega**2).max()
        least = max(float(least), SOLVED / self.settings.tolerance * still)
        moving = max(float(np.abs(q[1:]).max()), least)
        size = np.full(q.shape, moving)
        size[0] = max(moving, still)
        shapes = e.model.shapes
        face = max(float(np.abs(shapes @ q[1:].T).max()), least * float(np.abs(shapes).max()))
        reach = np.abs(e.model.columns).max(axis=0)
        damper = np.tile(face * rigid.size**0.5 / reach, 3)
        return np.concatenate(
            [
                size.ravel(),
                damper,
                np.full(len(e.tangents), face * (2.0 * e.model.n) ** 0.5),
            ]
        )

    def _with_more(
        self, moving: NDArray[np.bool_], x: FloatArray, D: FloatArray, normal: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Unknowns, their units and a direction with the slips of more nodes among the unknowns."""
        e = self.equations
        places = e.let_move(moving)
        more = e.widened(x, places)
        units = self.scale(more)
        units[places] = D
        return more, units, np.append(e.widened(normal[:-1], places, 0.0), normal[-1])

    def factors_at(
        self, found: InterfaceEvaluation, normal: FloatArray, D: FloatArray
    ) -> InterfaceEvaluation | None:
        """A point with factors of its derivative; None where it has none, or is singular."""
        if not found.linear.fine:
            return None
        many = len(D) >= MANY
        by_w = found.in_direction(np.zeros(len(D)), 1.0) if many else found.derivative[:, -1]
        border = Border(2.0 * np.pi * by_w, D, self.p_scale, normal)
        found.D = D
        if many:
            product = partial(found.in_direction, dw=0.0)
            found.factors = self.kept.near(product, found.factored, border, len(D))
        else:
            found.factors = found.factored(border)
        return None if found.factors.singular else found

    def _stay(self, x: FloatArray, found: InterfaceEvaluation, past: FloatArray) -> bool:
        """Put back nodes that slip for good and are sent back beyond the place of their past.

        Parameters
        ----------
        x : (u,) ndarray
            Unknowns after a step; overwritten.
        found : InterfaceEvaluation
            The point before it.
        past : (2 n,) ndarray
            Slips at the point before on the curve.

        Returns
        -------
        bool
            Whether there are such.
        """
        e, period, mine = self.equations, found.period, self.equations.tangents - found.e.model.n
        moved, slip = (values[e.others :].reshape(2, -1) for values in (x, found.x))
        before, after = (slips[mine].reshape(2, -1) for slips in (past, period.slip))
        way = np.where(slip != before, slip, after) - before
        moving = period.moving[e.mobile]
        for_good = slips_for_good(e, period)[:, e.mobile].any(axis=0) | ~moving
        back = (((moved - before) * way).sum(axis=0) <= 0.0) & for_good
        moved[:, back] = before[:, back]
        return bool(back.any())
