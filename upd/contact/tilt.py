"""Frictionless normal contact of a body that may also tilt.

The approach and two small rotations follow from the load and its line:

    f >= 0,   g = h + C f - d e - T theta >= 0,   f.g = 0,   e'f = F,   T'f = M.

For a fixed tilt this is `normal_contact` at the load F; its energy
phi(theta) = min 1/2 f'C f + (h - T theta)'f over {f >= 0, e'f = F} is concave, so the tilt
minimises the convex psi(theta) = -phi(theta) - M'theta, which is quadratic as long as the contact
set A stays:

    gradient r = T'f - M,   Hessian H = T'(B - B e e'B / e'B e) T,   B = C_AA^-1.

Newton's method with these two, a line search on the monotone slope r.p, and an exact inner solve
ends within a handful of steps: once A is that of the answer, one step is exact (J. Sun, Math.
Program. 76 (1997) 451). A larger set is stiffer, so H of all nodes bounds every H: it sets the
step along tilts that A does not resist. What Newton leaves is solved as a least distance problem,
which is proven to end.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh, lapack, qr, solve_triangular
from scipy.optimize import nnls
from scipy.spatial import ConvexHull

from upd.contact.checks import EPS, Problems, compliance_matrix, numbers, unit_response
from upd.contact.normal import NormalContact
from upd.contact.qp import FREE, LOWER, BoxQP, BoxSolution, FloatArray, Method, State
from upd.contact.threads import few_threads
from upd.errors import ConvergenceError

log = logging.getLogger(__name__)

#: a Newton iteration that works takes 2 to 8 steps
NEWTON_STEPS = 40
_SEARCH_STEPS = 60
#: half of the digits: below this share of the full resistance a tilt counts as not resisted, and
#: rounding may end the iteration
_HALF_THE_DIGITS = float(np.sqrt(EPS))


@dataclass(frozen=True)
class TiltedContact:
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
    steps : int
        Newton steps.
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
    steps: int
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
            - K[0, 1:]
            @ np.linalg.pinv(K[1:, 1:], rcond=_HALF_THE_DIGITS, hermitian=True)
            @ K[1:, 0]
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
    J. Sun, Math. Program. 76 (1997) 451; least distance problem: C. L. Lawson and R. J. Hanson,
    Solving Least Squares Problems (1974), chapter 23.

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
        C, h, T, M = (
            compliance_matrix(problems, compliance),
            numbers(problems, "gap", gap),
            numbers(problems, "arms", arms),
            np.zeros(2),
        )
        F, given = numbers(problems, "load", load), numbers(problems, "moment", moment)
        if F is not None and not problems.add(
            F.size != 1, f"load must be one number, it has {F.size} values."
        ):
            problems.add(
                bool(F < 0),
                f"load is {float(F):g} N: the bodies cannot pull on each other, give a load >= 0.",
            )
        if given is not None and not problems.add(
            given.shape != (2,), f"moment has shape {given.shape}: it must be (2,)."
        ):
            M = given
        if C is not None:
            unit_response(problems, C)
            _check_shapes(problems, len(C), h, T, start)
        problems.raise_any()
        assert C is not None and h is not None and T is not None and F is not None
        mask = (
            np.ones(len(C), dtype=bool) if start is None or not np.any(start) else np.asarray(start)
        )
        hull = None
        if all(free):
            hull = _hull(problems, T)
        else:
            # An arm of zero: the held tilt moves nothing and no moment resists it.
            T = T * np.array(free, dtype=float)
            problems.add(
                bool(M[~np.array(free)].any()), "moment: a held tilt has none; give zero there."
            )
        if float(F) == 0.0:
            problems.add(
                bool(M.any()),
                f"moment is {M} N mm under no load: nothing can carry it, give a load or "
                "no moment.",
            )
            problems.raise_any()
            return _unloaded(h)
        face = (
            _supporting_face(problems, hull, T, M / float(F))
            if hull is not None
            else _supporting_end(problems, T, M / float(F), free)
        )
        problems.raise_any()
        assert face is not None
        return _solve(C, h, T, float(F), M, mask, face, sum(free))


def _check_shapes(
    problems: Problems, n: int, h: FloatArray | None, T: FloatArray | None, start: ArrayLike | None
) -> None:
    problems.add(
        h is not None and h.shape != (n,),
        f"gap has shape {None if h is None else h.shape}: the compliance needs ({n},).",
    )
    problems.add(
        T is not None and T.shape != (n, 2),
        f"arms has shape {None if T is None else T.shape}: the compliance needs ({n}, 2).",
    )
    if start is not None:
        mask = np.asarray(start)
        problems.add(
            mask.dtype != bool or mask.shape != (n,),
            f"start must be a bool mask of shape ({n},), one per node.",
        )


@dataclass(frozen=True)
class _Face:
    """Part of the hull under the load line.

    Its nodes, and the directions (2, k) in which they can balance a moment, k = 2, 1 or 0; `across`
    are the other ones.
    """

    nodes: NDArray[np.intp]
    along: FloatArray
    across: FloatArray


def _hull(problems: Problems, T: FloatArray) -> ConvexHull | None:
    """Convex hull of the nodes; a problem when they stand on one line.

    A moment across that line would meet no resistance.
    """
    spread = np.linalg.svd(T - T.mean(axis=0), compute_uv=False)
    flat = len(T) < 3 or not spread[1] > _HALF_THE_DIGITS * spread[0]
    if problems.add(
        flat,
        f"arms: the {len(T)} nodes stand on one line, about which nothing resists a tilt: "
        "add nodes beside it, or hold the tilt (normal_contact).",
    ):
        problems.raise_any()
    return ConvexHull(T)


def _supporting_face(
    problems: Problems, hull: ConvexHull, T: FloatArray, point: FloatArray
) -> _Face | None:
    """Smallest side of the hull that holds the load point; a problem when it stands outside."""
    tolerance = (len(T) + 10) * EPS * float(np.abs(T).max() + np.abs(point).max())
    beyond = hull.equations[:, :2] @ point + hull.equations[:, 2]
    worst = int(np.argmax(beyond))
    ends = T[hull.simplices[worst]]
    if problems.add(
        bool(beyond[worst] > tolerance),
        f"the load line meets the contact plane at arms ({point[0]:.6g}, {point[1]:.6g}) "
        f"mm, {beyond[worst]:.3g} mm outside the nodes, "
        f"beyond their side from ({ends[0, 0]:.6g}, {ends[0, 1]:.6g}) to "
        f"({ends[1, 0]:.6g}, {ends[1, 1]:.6g}): the body tips over. "
        "Move the load line inside, enlarge the patch, or hold the tilt (normal_contact).",
    ):
        return None
    sides = hull.equations[beyond >= -tolerance]
    nodes = np.flatnonzero((np.abs(T @ sides[:, :2].T + sides[:, 2]) <= tolerance).all(axis=1))
    if not len(sides):
        return _Face(nodes, np.eye(2), np.zeros((2, 0)))
    if np.ptp(T[nodes], axis=0).max() <= tolerance:
        return _Face(nodes, np.zeros((2, 0)), np.eye(2))
    normal = sides[0, :2]
    return _Face(nodes, np.array([[-normal[1]], [normal[0]]]), normal[:, None])


def _supporting_end(
    problems: Problems, T: FloatArray, point: FloatArray, free: tuple[bool, bool]
) -> _Face | None:
    """The same with one free tilt: all nodes, or those at the end under the load point."""
    everything, tilts = np.arange(len(T)), np.eye(2)[:, np.array(free)]
    if not any(free):
        return _Face(everything, tilts, tilts)
    arms, at = (T @ tilts).ravel(), float((point @ tilts).item())
    tolerance = (len(T) + 10) * EPS * float(np.abs(arms).max() + abs(at))
    low, high = float(arms.min()), float(arms.max())
    if problems.add(
        not low - tolerance <= at <= high + tolerance,
        f"the load line meets the contact plane at the arm {at:.6g} mm, outside the nodes from "
        f"{low:.6g} to {high:.6g}: the body tips over. "
        "Move the load line inside, enlarge the patch, or hold the tilt (normal_contact).",
    ):
        return None
    end = np.flatnonzero(np.abs(arms - (low if at - low <= high - at else high)) <= tolerance)
    if low + tolerance < at < high - tolerance:
        return _Face(everything, tilts, np.zeros((2, 0)))
    return _Face(end, np.zeros((2, 0)), tilts)


def _unloaded(h: FloatArray) -> TiltedContact:
    none, approach = np.zeros(h.size, dtype=bool), float(h.min())
    message = (
        "The load is zero: the bodies touch without force and without tilt at the smallest "
        f"gap, approach {approach:g} mm."
    )
    normal = NormalContact(
        np.zeros(h.size),
        h - approach,
        none,
        approach,
        0.0,
        0,
        "active set",
        "no load",
        message,
        np.zeros(h.size),
    )
    return TiltedContact(normal, np.zeros(2), np.zeros(2), 0, "no load", message, np.zeros((3, 3)))


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
    n, S, closest = h.size, face.nodes, float(h.min())
    # About the load point every moment is zero; gaps count from the closest pair, so that a common
    # offset costs no digits.
    arms, gap = T - M / F, h - closest
    whole = len(S) == n
    inner = _Tilt(C if whole else C[np.ix_(S, S)], gap[S], arms[S] @ face.along, F)
    at, steps, used, method = inner.minimise(mask[S])
    force, unclipped, contact = np.zeros(n), np.zeros(n), np.zeros(n, dtype=bool)
    force[S], unclipped[S], contact[S] = (
        at.answer.x,
        at.answer.unclipped,
        at.answer.state == FREE,
    )
    tilt = face.along @ at.theta
    residual = np.zeros(n)
    if not whole:
        residual = gap + C @ force - at.answer.shift - arms @ tilt
        off = np.setdiff1d(np.arange(n), S)
        more = _least_opening(arms[off] @ face.across, residual[off])
        tilt, residual = tilt + face.across @ more, residual - arms @ face.across @ more
    residual[S] = at.answer.residual
    K = _stiffness(C, contact, T)
    unique = bool(
        np.linalg.matrix_rank(
            T[contact] - T[contact].mean(axis=0), tol=_HALF_THE_DIGITS * np.ptp(T)
        )
        == n_free
    )
    message = (
        f"{int(contact.sum())} of {n} nodes in contact after {steps} Newton steps ({used} "
        f"factorisations, {method})."
    )
    normal = NormalContact(
        force=force,
        gap=np.where(contact, 0.0, np.maximum(residual, 0.0)),
        contact=contact,
        approach=at.answer.shift + closest - float(M @ tilt) / F,
        stiffness=float(K[0, 0]),
        iterations=used,
        method=method,
        status="converged",
        message=message,
        unclipped=unclipped,
    )
    if not unique:
        message += (
            " They stand on one line, so that a further tilt about it meets no resistance as "
            "long as no gap closes."
        )
    status = "converged" if unique else "tilt not unique"
    return TiltedContact(normal, tilt, T.T @ force - M, steps, status, message, K)


def _stiffness(C: FloatArray, contact: NDArray[np.bool_], T: FloatArray) -> FloatArray:
    """E' C_AA^-1 E of the nodes in contact, E = [e T]: stiffness of (approach, tilt)."""
    E = np.column_stack([np.ones(int(contact.sum())), T[contact]])
    index = np.flatnonzero(contact)
    factor, info = lapack.dpotrf(C[np.ix_(index, index)].T, lower=1)
    if info != 0:
        raise ConvergenceError(
            f"compliance of the {index.size} nodes in contact is not positive definite to "
            "working precision."
        )
    half = solve_triangular(factor, E, lower=True, check_finite=False)
    return np.asarray(half.T @ half)


def _least_opening(arms: FloatArray, gap: FloatArray) -> FloatArray:
    """Smallest z with gap - arms z >= 0.

    The least distance problem of Lawson and Hanson, chapter 23.
    """
    scale = float(np.abs(gap).max()) or 1.0
    rows = np.vstack([-arms.T / np.abs(arms).max(), -gap / scale])
    z = _least_distance(rows)[0]
    return np.asarray(z * scale / np.abs(arms).max())


def _least_distance(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """min |y| with G y >= w for rows = [G'; w']: y and the multipliers.

    It ends after finitely many exchanges.
    """
    unit = np.zeros(len(rows))
    unit[-1] = 1.0
    try:
        u = nnls(rows, unit, maxiter=30 * (rows.shape[1] + 10))[0]
    except RuntimeError as problem:
        raise ConvergenceError(
            f"contact with tilt: the least distance problem found no answer ({problem})."
        ) from None
    r = rows @ u - unit
    return -r[:-1] / r[-1], -u / r[-1]


@dataclass(frozen=True)
class _Point:
    """One tilt: the contact there, r = T'f and psi with the rounding level of psi."""

    theta: FloatArray
    answer: BoxSolution
    r: FloatArray
    psi: float
    noise: float


class _Tilt:
    """Minimiser of psi for k tilts, the load F and no moment.

    The load point is strictly inside the hull of T (n, k).
    """

    def __init__(self, C: FloatArray, h: FloatArray, T: FloatArray, F: float) -> None:
        self.C, self.h, self.T, self.F = C, h, T, F
        self.n, self.k = T.shape
        self.qp = BoxQP(C)
        self.lower, self.upper = np.zeros(self.n), np.full(self.n, np.inf)
        self.scale = np.abs(T).max(axis=0) * F
        self.used = 0

    def minimise(self, mask: NDArray[np.bool_]) -> tuple[_Point, int, int, Method]:
        """Best tilt, Newton steps, factorisations and the method that finished."""
        state: State = (
            np.where(mask, FREE, LOWER).astype(np.int8)
            if mask.any()
            else np.full(self.n, FREE, dtype=np.int8)
        )
        at, method = self._at(self._first(state), state), "active set"
        steps, done = 0, self._balanced(at)
        full = self._hessian(np.ones(self.n, dtype=bool)) if not done else np.zeros(0)
        while not done and steps < NEWTON_STEPS:
            new = self._step(at, full)
            steps += 1
            if new is None:
                break
            stalled = self._size(new) > self._size(at) / 2
            at = (
                min(at, new, key=self._size)
                if stalled and self._size(at) <= _HALF_THE_DIGITS
                else new
            )
            done = self._balanced(at) or (stalled and self._size(at) <= _HALF_THE_DIGITS)
        if not done:
            log.info(
                "Newton's method for the tilt stopped after %d steps; the least distance "
                "problem takes over",
                steps,
            )
            at, method = self._fallback(), "fallback"
        return (
            at,
            steps,
            self.used,
            "fallback" if method == "fallback" or at.answer.method == "fallback" else "active set",
        )

    def _at(self, theta: FloatArray, state: State) -> _Point:
        q = self.h - self.T @ theta
        answer = self.qp.solve(q, self.lower, self.upper, total=self.F, state=state)
        self.used += answer.iterations
        f = answer.x
        psi = -(answer.shift * self.F + float(q @ f)) / 2
        noise = (self.n + 10) * EPS * (abs(answer.shift) * self.F + float(np.abs(q) @ f))
        return _Point(theta, answer, self.T.T @ f, psi, noise)

    def _size(self, at: _Point) -> float:
        return float(np.max(np.abs(at.r) / self.scale, initial=0.0))

    def _balanced(self, at: _Point) -> bool:
        return bool(self._size(at) <= 4 * (self.n + 10) * EPS)

    def _first(self, state: State) -> FloatArray:
        """Tilt of the bodies glued on the guessed set: exact when nothing opens.

        Zero when the set resists no tilt.
        """
        free = state == FREE
        E = np.column_stack([np.ones(self.n), self.T])[free]
        if not self.k or np.linalg.matrix_rank(E - E.mean(axis=0)) < self.k:
            return np.zeros(self.k)
        BE = self._held(free, E)
        b = np.zeros(self.k + 1)
        b[0] = self.F
        return np.asarray(np.linalg.solve(E.T @ BE, b + BE.T @ self.h[free])[1:])

    def _held(self, free: NDArray[np.bool_], E: FloatArray) -> FloatArray:
        """C_AA^-1 E."""
        index = np.flatnonzero(free)
        _, X, info = lapack.dposv(self.C[np.ix_(index, index)].T, E, lower=1)
        if info != 0:
            raise ConvergenceError(
                f"compliance of the {index.size} nodes in the set is not positive definite "
                "to working precision."
            )
        return np.asarray(X)

    def _hessian(self, free: NDArray[np.bool_]) -> FloatArray:
        E = np.column_stack([np.ones(int(free.sum())), self.T[free]])
        K = E.T @ self._held(free, E)
        return np.asarray(K[1:, 1:] - np.outer(K[1:, 0], K[0, 1:]) / K[0, 0])

    def _step(self, at: _Point, full: FloatArray) -> _Point | None:
        """Newton step.

        Along tilts that the set does not resist, the resistance of all nodes stands in.
        """
        H = self._hessian(at.answer.state == FREE)
        share, V = eigh((H + H.T) / 2, (full + full.T) / 2)
        share = np.where(share > _HALF_THE_DIGITS, share, 1.0)
        return self._search(at, -V @ ((V.T @ at.r) / share))

    def _search(self, at: _Point, p: FloatArray) -> _Point | None:
        """Point on the line where psi has dropped and its slope has halved.

        None when rounding leaves none.
        """
        slope = float(at.r @ p)
        low, high, slope_low, slope_high, alpha = 0.0, np.inf, slope, np.inf, 1.0
        near = at
        for _ in range(_SEARCH_STEPS):
            new = self._at(at.theta + alpha * p, near.answer.state)
            now = float(new.r @ p)
            dropped = new.psi <= at.psi + at.noise + new.noise
            if (abs(now) <= -slope / 2 and dropped) or self._balanced(new):
                return new
            if now < 0:
                low, slope_low, near = alpha, now, new
            else:
                high, slope_high = alpha, now
            # Regula falsi, kept off the ends so that the bracket shrinks.
            inside = float(np.clip(slope_low / (slope_low - slope_high), 0.1, 0.9))
            alpha = 2 * low if np.isinf(high) else low + (high - low) * inside
        return None

    def _fallback(self) -> _Point:
        """Least distance form of the whole problem.

        f = f0 + Z z with E'Z = 0, |R z - c| least under f >= 0.
        """
        E = np.column_stack([np.ones(self.n), self.T / self.scale * self.F])
        b = np.zeros(self.k + 1)
        b[0] = self.F
        Q, R = qr(E)
        f0, Z = (
            Q[:, : self.k + 1] @ solve_triangular(R[: self.k + 1], b, trans=1),
            Q[:, self.k + 1 :],
        )
        L = np.linalg.cholesky(self.C)
        N, R = qr(L.T @ Z, mode="economic")
        c = -N.T @ (L.T @ f0 + solve_triangular(L, self.h, lower=True))
        G = solve_triangular(R, Z.T, trans=1, lower=False).T
        w = -(f0 + G @ c)
        size, unit = float(np.linalg.norm(G, axis=1).max()), float(np.abs(w).max())
        y, u = _least_distance(np.vstack([G.T / size, w / unit]))
        f = np.maximum(G @ (y * unit / size) - w, 0.0)
        g = u * unit / size**2
        theta = np.linalg.lstsq(E, self.C @ f + self.h - g, rcond=None)[0][1:] / self.scale * self.F
        state: State = np.where(f > 0, FREE, LOWER).astype(np.int8)
        at = self._at(theta, state)
        if self._size(at) > _HALF_THE_DIGITS:
            raise ConvergenceError(
                f"contact with tilt of {self.n} nodes: {self._size(at):.1e} of the moment "
                "is left unbalanced by the last method. "
                "Look for nearly dependent rows in the compliance matrix."
            )
        return at
