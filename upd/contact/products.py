"""Contact of bodies whose compliance is evaluated by products: learned where the answer needs it.

Every contact solver of this package takes a dense compliance. Bodies of
`upd.reduction.learned.LearnedCompliance` have one that is exact on the forces it was shown; so a
problem is solved with it, its answer is shown to both bodies, and it is solved again, until all
forces of the answer are known. What then comes out solves the problem with the exact compliance:
the forces that are known give C_m f = C f and so the same gaps, and signs and products of forces
and gaps, which are the rest of the conditions, are those of the dense problem. It ends, as every
answer that is not yet known adds a direction.

How far an answer f is from the exact one f*. With C_m f = C f + delta, f solves the problem with
the gaps h + delta. For two gap vectors the conditions of both answers give (f - f*)' C (f - f*) <=
-(f - f*)' delta (the complementary products are not negative), so by Cauchy

    |f - f*|_C <= |delta|_{C^-1},

and with |C_1 + C_2| at least as compliant as either body |delta_1 + delta_2|_{C^-1} <=
sqrt(|delta_1|^2_{C_1^-1} + |delta_2|^2_{C_2^-1}), the infimal convolution of two quadratic forms.
The approach d at a given load F has d F = f' (h + C f), hence |d - d*| <= 2 max(|f|_C, |f*|_C)
|delta|_{C^-1} / F. Both need no more than the errors in energy of the products, see
`upd.linalg.schur`.

What the bodies start from (`half_space_start`) decides how many products are needed, never what
comes out.

References
----------
.. [1] K. L. Johnson, Contact Mechanics (1985), sections 3.2, 3.6 and 5.9 (the half-space).
.. [2] J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), section 4.2
   (monotone dependence on the data).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from upd.contact.model import Body, ContactModel
from upd.errors import ConvergenceError
from upd.linalg.common import EPS, log
from upd.reduction.learned import LearnedCompliance
from upd.reference.half_space import cerruti_rectangle, love_rectangle

Array = NDArray[np.float64]
Answer = TypeVar("Answer")

#: Largest share of a force that no product has shown, of forces whose own error counts, and of
#: those that only give a stiffness e' C^-1 e, whose error is of second order.
KNOWN, KNOWN_STIFFNESS = 1e-10, 1e-6


def half_space_start(
    points: Array,
    components: Sequence[int],
    mirror: Mapping[int, Sequence[int]],
    E: float,
    nu: float,
) -> Array:
    """Compliance of a half-space at contact points, as a start for a body's own.

    Forces act evenly on squares around the points that do not overlap, and on their mirror images;
    normal and tangential directions are not coupled. For points whose half-space is not positive
    definite, its diagonal.

    Parameters
    ----------
    points : (n, 2) or (n, 3) ndarray
        mm.
    components : sequence of int
        0, 1, 2 for x, y, z, in the order of the rows.
    mirror : mapping
        Axis of a mirror plane through the origin (0 for x = 0) -> components it holds, which are
        odd about it.
    E, nu : float
        MPa and Poisson's ratio.

    Returns
    -------
    (n * len(components), n * len(components)) ndarray
        mm/N, symmetric positive definite.
    """
    x, y = points[:, 0], points[:, 1]
    n, width = len(x), _least_distance(x, y)
    half, unit = 0.5 * width, width**-2

    def kernel(component: int, dx: Array, dy: Array) -> tuple[Array, Array]:
        if component == 2:
            return love_rectangle(dx, dy, half, half, unit, E, nu), np.zeros(0)
        u, v = (dx, dy) if component == 0 else (dy, dx)
        return cerruti_rectangle(u, v, half, half, unit, E, nu)

    images = [((1.0, 1.0), np.ones(3))]
    for axis, held in mirror.items():
        odd = np.ones(3)
        odd[list(held)] = -1.0
        flip = (-1.0, 1.0) if axis == 0 else (1.0, -1.0)
        images += [((s[0] * flip[0], s[1] * flip[1]), sign * odd) for s, sign in images]
    blocks = {(a, b): np.zeros((n, n)) for a in components for b in components}
    for flip, sign in images:
        dx, dy = x[:, None] - flip[0] * x, y[:, None] - flip[1] * y
        for a in components:
            along, across = kernel(a, dx, dy)
            blocks[a, a] += sign[a] * along
            for b in components:
                if b != a and 2 not in (a, b):
                    blocks[b, a] += sign[a] * across
    C = np.block([[blocks[a, b] for b in components] for a in components])
    C = 0.5 * (C + C.T)
    if lapack.dpotrf(C, lower=1)[1] == 0:
        return np.asarray(C)
    log.info("start of %d points: the half-space is not positive definite", n)
    return np.diag(np.diagonal(C))


def _least_distance(x: Array, y: Array) -> float:
    """Between neighbours on lines of points, along x or y."""
    steps = [np.diff(np.unique(v)) for v in (x, y)]
    extents = max(float(np.ptp(v)) for v in (x, y))
    # coordinates that differ by rounding are one line
    apart = np.concatenate([step[step > np.sqrt(EPS) * extents] for step in steps])
    return float(apart.min()) if apart.size else 1.0


def learners(
    model: ContactModel, components: Sequence[int]
) -> list[tuple[Body, LearnedCompliance]]:
    """The bodies whose compliance for these components is learned, with it."""
    return [
        (body, found)
        for body in (model.upper, model.lower)
        for family, (found, _) in body.condensed.items()
        if set(components) <= set(family) and isinstance(found, LearnedCompliance)
    ]


def _spread(model: ContactModel, body: Body, components: Sequence[int], force: Array) -> Array:
    """Forces (n_component n, ...) at the multipliers as those at the body's kept dofs."""
    family = next(f for f in body.condensed if set(components) <= set(f))
    n = len(body.contact)
    out = np.zeros((len(family) * n, *force.shape[1:]))
    parts = force.reshape(len(components), -1, *force.shape[1:])
    for component, part in zip(components, parts, strict=True):
        k = family.index(component)
        out[k * n : (k + 1) * n] = model.nodal(part)
    return out


def unknown(model: ContactModel, components: Sequence[int], force: Array) -> Array:
    """Largest shares of forces at the multipliers that a body's products have not shown.

    Parameters
    ----------
    model : ContactModel
    components : sequence of int
        Of the forces.
    force : (n_component n, m) ndarray
        N, column by column.

    Returns
    -------
    (m,) ndarray
        Zero for condensed bodies.
    """
    shares = [
        found.unknown(_spread(model, body, components, force))
        for body, found in learners(model, components)
    ]
    return np.asarray(np.max([np.zeros(force.shape[1]), *shares], axis=0))


def energy_error(model: ContactModel, components: Sequence[int], force: Array) -> float:
    """Bound of the relative error in energy |f - f*|_C / |f|_C of a settled answer.

    Parameters
    ----------
    model : ContactModel
    components : sequence of int
        Of the forces.
    force : (n_component n,) ndarray
        f, N at the multipliers.

    Returns
    -------
    float
        From the products of both bodies alone; zero for condensed ones.
    """
    squares, energy = 0.0, 0.0
    for body, found in learners(model, components):
        f = _spread(model, body, components, force)
        own = float(f @ (found.compliance() @ f))
        energy += own
        squares += found.error(f) ** 2 * own
    return float(np.sqrt(squares / energy)) if energy > 0.0 else 0.0


def settled(
    model: ContactModel,
    components: Sequence[int],
    solve: Callable[[], Answer],
    forces: Callable[[Answer], Iterable[tuple[Array, float]]],
) -> Answer:
    """An answer all of whose forces are known to the bodies.

    Parameters
    ----------
    model : ContactModel
    components : sequence of int
        Of the forces.
    solve : callable
        Solves the dense problem with the model's present compliance.
    forces : callable
        Of an answer: columns of forces (n_component n, m), and the largest share of them that may
        be unknown (`KNOWN`, `KNOWN_STIFFNESS`).

    Returns
    -------
    Answer
        That of `solve`; for condensed bodies the first.

    Raises
    ------
    ConvergenceError
        Where a body does not learn any more and forces are still unknown.
    """
    learns, last = learners(model, components), np.inf
    while True:
        answer = solve()
        if not learns:
            return answer
        wanted = [(columns.reshape(len(columns), -1), limit) for columns, limit in forces(answer)]
        F = np.column_stack([columns for columns, _ in wanted])
        limits = np.concatenate([np.full(one.shape[1], limit) for one, limit in wanted])
        over = unknown(model, components, F) / limits
        share = float(over.max(initial=0.0))
        if not share > 1.0:
            return answer
        before = sum(one.products for _, one in learns)
        for body, one in learns:
            one.learn(_spread(model, body, components, F[:, over > 1.0]), limits[over > 1.0])
        if sum(one.products for _, one in learns) == before:
            raise ConvergenceError(
                f"contact by products: {before} products do not settle the forces, of which "
                f"{share * KNOWN:.1e} are unknown, {last * KNOWN:.1e} before the last product: "
                "rounding holds them. Look for nearly coincident contact nodes, or set "
                'solver.route = "condensed".'
            )
        last = share
        log.info("contact by products: %d products, %.1e unknown", before, share * KNOWN)
