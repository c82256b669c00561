"""Corrections of the balance by whole faces from a derivative that is formed seldom.

A derivative costs as much as several residuals, and there is a kink wherever a sample of a node
changes its state, so that Newton's method with a new one at every step hardly gains on an old one
that learns from the steps: Broyden's.

With many unknowns even less has to be formed. The derivative in one direction costs a small part of
a residual, and factors of an earlier derivative leave so little to do that a step of Newton's
method takes a few directions (`upd.hbm.core.kept_factors`); it then costs less than a residual, and
learning from steps gains nothing.

References
----------
C. T. Kelley, Iterative Methods for Linear and Nonlinear Equations (1995), 7.3 (`brsol`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from upd.hbm.core.newton import BorderedFactors, bordered_factors
from upd.hbm.faces.newton import InterfaceEvaluation
from upd.hbm.faces.state import FloatArray

#: share of the step before that a step by updated factors may have. A derivative costs about four
#: residuals and its step leaves some hundredths, the fifth root of which this is; it weighs costs
SHRINKS = 0.5


@dataclass(frozen=True)
class KnownFactors:
    """Factors of the bordered derivative at a point.

    Attributes
    ----------
    factors : BorderedFactors
    D : (u,) ndarray
        Units of the unknowns in which they are scaled.
    of : InterfaceEvaluation
        The point.
    """

    factors: BorderedFactors
    D: FloatArray
    of: InterfaceEvaluation

    def suits(self, found: InterfaceEvaluation) -> bool:
        """Whether the equations of another point have the same unknowns and the same form."""
        return len(self.D) == len(found.x) and found.like(self.of)


class PlaneMatrix:
    """The bordered derivative at a point, direction by direction (`upd.hbm.core.kept_factors`).

    Parameters
    ----------
    of : InterfaceEvaluation
    normal : (u + 1,) ndarray
        The border, in units of D.
    D : (u,) ndarray
        Units of the unknowns.
    p_scale : float
        Unit of the frequency [Hz].
    """

    def __init__(
        self, of: InterfaceEvaluation, normal: FloatArray, D: FloatArray, p_scale: float
    ) -> None:
        self.of, self.normal, self.D, self.p_scale = of, normal, D, p_scale

    @property
    def sizes(self) -> FloatArray:
        """(u + 1,) units of the unknowns and of the frequency."""
        return np.append(self.D, self.p_scale)

    def product(self, z: FloatArray) -> FloatArray:
        """What scaled unknowns (u + 1,) give: the equations (u,), and the border."""
        faster = 2.0 * np.pi * self.p_scale * float(z[-1])
        return np.append(self.of.in_direction(z[:-1] * self.D, faster), self.normal @ z)

    def factored(self) -> BorderedFactors:
        """Its factors."""
        J, by_p = self.of.jacobian, 2.0 * np.pi * self.of.by_w
        return bordered_factors(J, by_p, self.D, self.p_scale, self.normal)


class NewtonSteps:
    """A correction in a plane, by a few directions of the derivative at the point itself.

    Parameters
    ----------
    known : KnownFactors
        Of the point, with the plane for its border.
    normal : (u + 1,) ndarray
        Across the plane, a unit vector in units of D.
    """

    #: whether they lead on from the next point
    learns = False

    def __init__(self, known: KnownFactors, normal: FloatArray) -> None:
        self.known, self.normal = known, normal

    def next(self, residual: FloatArray) -> FloatArray:
        """The step from a residual (u,), in units of D (u + 1,), exactly in the plane."""
        z = self.known.factors.solve(-residual, 0.0)
        return np.asarray(z - self.normal * float(self.normal @ z))


class BroydenSteps:
    """Corrections in a plane, by factors of another point that are updated by every step.

    With B the factors' matrix, s the steps taken so far and r the residual,

        z = -B^-1 r,   z += s_{k+1} (s_k . z) / |s_k|^2 for every step but the last,
        s_{n+1} = z / (1 - s_n . z / |s_n|^2).

    Parameters
    ----------
    known : KnownFactors
        The border of their matrix may be another plane's: a share of its tangent leads into the
        plane.
    normal : (u + 1,) ndarray
        Across the plane, in units of D.
    D : (u,) ndarray
        Units of the unknowns here.
    """

    learns = True

    def __init__(self, known: KnownFactors, normal: FloatArray, D: FloatArray) -> None:
        self.known, self.normal = known, normal
        self.units = np.append(known.D / D, 1.0)
        along = self.units * known.factors.solve(np.zeros(len(D)), 1.0)
        self.along = along / float(normal @ along)
        self.steps: list[FloatArray] = []

    def next(self, residual: FloatArray) -> FloatArray:
        """The step from the residual where the last one led to.

        Parameters
        ----------
        residual : (u,) ndarray

        Returns
        -------
        (u + 1,) ndarray
            In units of D; not finite where there is none.
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
        steps.append(z)
        return z
