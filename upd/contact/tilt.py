"""Frictionless normal contact of a body that may also tilt.

The approach d and two small rotations theta follow from the load and its line:

    f >= 0,   g = h + C f - d e - T theta >= 0,   f.g = 0,   e'f = F,   T'f = M,

with the arms T of the nodes: the box QP of `upd.contact.qp` with the rigid motions B = [e T].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull

from upd.contact.checks import (
    EPS,
    Problems,
    compliance_matrix,
    few_threads,
    node_mask,
    numbers,
    one_load,
)
from upd.contact.normal import NormalContact, apart
from upd.contact.qp import FREE, HALF_THE_DIGITS, LOWER, BoxQP, FloatArray
from upd.labels import Shown
from upd.linalg.least_distance import least_distance


@dataclass(frozen=True, repr=False)
class TiltedContact(Shown):
    """Answer of one contact problem with free tilt.

    Attributes
    ----------
    normal : NormalContact
        Forces, gaps and contact set; its approach [mm] is that of the point the arms are measured
        from, its stiffness e' C_AA^-1 e [N/mm] has the tilt held.
    tilt : (2,) ndarray
        theta [rad]; the approach at arms (x, y) is d + theta_0 x + theta_1 y.
    moment : (2,) ndarray
        T'f - M [N mm], what rounding left of the balance.
    status : {"converged", "no load", "tilt not unique"}
        "tilt not unique": fewer than three nodes off one line carry the load, and nothing resists a
        further tilt as long as no gap closes.
    message : str
        One sentence.
    stiffness : (3, 3) ndarray
        Of (F, M) by (d, theta) with the contact set held [N/mm, N, N mm]; singular when the tilt is
        not unique.
    """

    normal: NormalContact
    tilt: FloatArray
    moment: FloatArray
    status: str
    message: str
    stiffness: FloatArray

    @property
    def free_stiffness(self) -> float:
        """dF/dd [N/mm] with the moment held, the tilt free and the contact set held.

        At most `normal.stiffness`.
        """
        K = self.stiffness
        return float(
            K[0, 0]
            - K[0, 1:] @ np.linalg.pinv(K[1:, 1:], rcond=HALF_THE_DIGITS, hermitian=True) @ K[1:, 0]
        )


def tilted_contact(
    compliance: ArrayLike,
    gap: ArrayLike,
    arms: ArrayLike,
    *,
    load: float,
    moment: ArrayLike = (0.0, 0.0),
    start: ArrayLike | None = None,
    free: tuple[bool, bool] = (True, True),
) -> TiltedContact:
    """Contact of two elastic bodies, one of which may tilt, at a given load and moment.

    Over an edge or a corner of the patch only its nodes can carry the load; of the tilts that open
    all others the least is given.

    Parameters
    ----------
    compliance : (n, n) array_like
        Sum of both bodies' compliance [mm/N], symmetric positive definite.
    gap : (n,) array_like
        Gap before loading [mm].
    arms : (n, 2) array_like
        Places of the nodes [mm] from the point where the load line meets the contact plane.
    load : float
        Load F [N], >= 0.
    moment : (2,) array_like
        Moment M about that point [N mm], sum of force times arm.
    start : (n,) array_like of bool, optional
        A guess of the contact set.
    free : tuple of two bool
        Which of theta_0, theta_1 are free; the other is held at zero, as on the half of a
        contact that is mirrored about arms x = 0.

    Returns
    -------
    TiltedContact

    Raises
    ------
    InputError
        For bad input (all problems are named), and for a load line outside the convex hull of the
        nodes: the body tips over.
    ConvergenceError
        When no method reaches rounding.

    References
    ----------
    M. Hintermueller, K. Ito and K. Kunisch, SIAM J. Optim. 13 (2002) 865; least distance problem:
    C. L. Lawson and R. J. Hanson, Solving Least Squares Problems (1974), chapter 23.

    Examples
    --------
    Three nodes carry what statics demands, and the body leans to the side of the load:

    >>> import numpy as np
    >>> from upd.contact import tilted_contact
    >>> C = 1e-5 * np.array([[2.0, 1.0, 0.5], [1.0, 2.0, 1.0], [0.5, 1.0, 2.0]])
    >>> arms = [[-1.0, -1.0], [2.0, -1.0], [-1.0, 2.0]]
    >>> result = tilted_contact(C, np.zeros(3), arms, load=90.0, moment=[30.0, 0.0])
    >>> result.normal.force.round(6).tolist()
    [20.0, 40.0, 30.0]
    >>> (1e3 * result.tilt).round(6).tolist()  # mrad
    [0.116667, 0.05]
    """
    with few_threads(gap):
        problems = Problems("contact with tilt")
        C, _ = compliance_matrix(problems, compliance)
        n = "n" if C is None else len(C)
        h, T = numbers(problems, "gap", gap, (n,)), numbers(problems, "arms", arms, (n, 2))
        F, M = one_load(problems, "load", load), numbers(problems, "moment", moment, (2,))
        given = None if C is None else node_mask(problems, start, len(C))
        problems.raise_any()
        assert C is not None and h is not None and T is not None and M is not None
        mask = np.ones(len(C), dtype=bool) if given is None or not given.any() else given
        if not all(free):
            # An arm of zero: the held tilt moves nothing and no moment resists it.
            T = T * np.array(free, dtype=float)
            problems.add(
                bool(M[~np.array(free)].any()), "moment: a held tilt has none; give zero there."
            )
        tilts = np.eye(2)[:, np.array(free)]
        sides = _sides(problems, T, tilts)
        if F == 0.0:
            return _unloaded(problems, h, M)
        face = _supporting_face(problems, sides, T, M / F, tilts)
        problems.raise_any()
        return _solve(C, h, T, F, M, mask, face, sum(free))


def _unloaded(problems: Problems, h: FloatArray, M: FloatArray) -> TiltedContact:
    """Bodies that touch without force."""
    problems.add(
        bool(M.any()),
        f"moment is {M} N mm under no load: nothing can carry it, give a load or no moment.",
    )
    problems.raise_any()
    approach, none = float(h.min()), np.zeros(2)
    message = (
        "The load is zero: the bodies touch without force and without tilt at the smallest gap, "
        f"approach {approach:g} mm."
    )
    normal = apart(h, approach, "no load", message)
    return TiltedContact(normal, none, none, "no load", message, np.zeros((3, 3)))


#: part of the hull under the load line: its nodes, the directions (2, k) in which they can balance
#: a moment, k = 2, 1 or 0, and the other ones
_Face = tuple[NDArray[np.intp], FloatArray, FloatArray]


def _sides(problems: Problems, T: FloatArray, tilts: FloatArray) -> FloatArray:
    """Sides (k, 3) of what a load line must not leave: outward normals and offsets.

    With both tilts free the sides of the nodes' convex hull, with one its two ends. A problem when
    the nodes lie on one line: a moment across it would meet no resistance.
    """
    if tilts.shape[1] == 2:
        spread = np.linalg.svd(T - T.mean(axis=0), compute_uv=False)
        flat = len(T) < 3 or not spread[1] > HALF_THE_DIGITS * spread[0]
        if problems.add(
            flat,
            f"arms: the {len(T)} nodes lie on one line, about which nothing resists a tilt: "
            "add nodes beside it, or hold the tilt (normal_contact).",
        ):
            problems.raise_any()
        return np.asarray(ConvexHull(T).equations, np.float64)
    ends = np.column_stack([tilts, -tilts]).T
    return np.column_stack([ends, -(T @ ends.T).max(axis=0)])


def _supporting_face(
    problems: Problems, sides: FloatArray, T: FloatArray, point: FloatArray, tilts: FloatArray
) -> _Face:
    """Smallest side that holds the load point; a problem when it stands outside."""
    tolerance = (len(T) + 10) * EPS * float(np.abs(T).max() + np.abs(point).max())
    beyond = sides[:, :2] @ point + sides[:, 2]
    if len(beyond) and beyond.max() > tolerance:
        side = sides[beyond.argmax()]
        on = T[np.abs(T @ side[:2] + side[2]) <= tolerance]
        along = on @ np.array([-side[1], side[0]])
        ends = on[[along.argmin(), along.argmax()]]
        problems.add(
            True,
            f"the load line meets the contact plane at arms ({point[0]:.6g}, {point[1]:.6g}) mm, "
            f"{beyond.max():.3g} mm outside the nodes, beyond their side from ({ends[0, 0]:.6g}, "
            f"{ends[0, 1]:.6g}) to ({ends[1, 0]:.6g}, {ends[1, 1]:.6g}): the body tips over. "
            "Move the load line inside, enlarge the patch, or hold the tilt (normal_contact).",
        )
    sides = sides[beyond >= -tolerance]
    nodes = np.flatnonzero((np.abs(T @ sides[:, :2].T + sides[:, 2]) <= tolerance).all(axis=1))
    if not len(sides):
        return nodes, tilts, np.zeros((2, 0))
    if np.ptp(T[nodes], axis=0).max(initial=0.0) <= tolerance:
        return nodes, np.zeros((2, 0)), tilts
    normal = sides[0, :2]
    return nodes, np.array([[-normal[1]], [normal[0]]]), normal[:, None]


def _solve(
    C: FloatArray,
    h: FloatArray,
    T: FloatArray,
    F: float,
    M: FloatArray,
    mask: NDArray[np.bool_],
    face: _Face,
    n_free: int,
) -> TiltedContact:
    """Tilt along the face from its own nodes, then the least tilt across it.

    The least tilt that opens all other nodes.
    """
    n, closest, (S, along, across) = h.size, float(h.min()), face
    # About the load point every moment is zero; gaps count from the closest pair, so that a common
    # offset costs no digits.
    arms, gap = T - M / F, h - closest
    whole = len(S) == n
    rigid = arms[S] @ along
    size = np.abs(rigid).max(axis=0)
    qp = BoxQP(C if whole else C[np.ix_(S, S)], np.column_stack([np.ones(len(S)), rigid / size]))
    load, none = np.zeros(1 + len(size)), np.zeros(len(S))
    load[0] = F
    start = np.where(mask[S] | (not mask[S].any()), FREE, LOWER).astype(np.int8)
    answer = qp.solve(gap[S], none, none + np.inf, load=load, state=start)
    approach = float(answer.motion[0])
    force, unclipped, contact = np.zeros(n), np.zeros(n), np.zeros(n, dtype=bool)
    force[S], unclipped[S], contact[S] = answer.x, answer.unclipped, answer.state == FREE
    tilt = along @ (answer.motion[1:] / size)
    residual = np.zeros(n)
    if not whole:
        residual = gap + C @ force - approach - arms @ tilt
        off = np.setdiff1d(np.arange(n), S)
        more = _least_opening(arms[off] @ across, residual[off])
        tilt, residual = tilt + across @ more, residual - arms @ across @ more
    residual[S] = answer.residual
    # the nodes that carry lie on the face: its rigid motions are theirs, about the load point
    turned = np.eye(1 + len(size), 3)
    turned[0, 1:], turned[1:, 1:] = M / F, size[:, None] * along.T
    K = turned.T @ answer.stiffness @ turned
    unique = bool(
        np.linalg.matrix_rank(T[contact] - T[contact].mean(axis=0), tol=HALF_THE_DIGITS * np.ptp(T))
        == n_free
    )
    message = (
        f"{int(contact.sum())} of {n} nodes in contact after {answer.iterations} steps of the "
        f"{answer.method}."
    )
    normal = NormalContact(
        force=force,
        gap=np.where(contact, 0.0, np.maximum(residual, 0.0)),
        contact=contact,
        approach=approach + closest - float(M @ tilt) / F,
        stiffness=float(K[0, 0]),
        iterations=answer.iterations,
        method=answer.method,
        status="converged",
        message=message,
        unclipped=unclipped,
    )
    if not unique:
        message += (
            " They lie on one line, so that a further tilt about it meets no resistance as "
            "long as no gap closes."
        )
    status = "converged" if unique else "tilt not unique"
    return TiltedContact(normal, tilt, T.T @ force - M, status, message, K)


def _least_opening(arms: FloatArray, gap: FloatArray) -> FloatArray:
    """Smallest z with gap - arms z >= 0.

    The least distance problem of Lawson and Hanson, chapter 23.
    """
    scale = float(np.abs(gap).max()) or 1.0
    size = float(np.abs(arms).max())
    found = least_distance(-arms / size, -gap / scale)
    assert found is not None, "the nodes are off the face, so that some tilt opens them"
    return np.asarray(found[0] * scale / size)
