"""Natural frequencies and mode shapes, K x = lambda M x, from the bottom of the spectrum.

Shift-invert Lanczos [1]_ with the shift below the spectrum, so that K - sigma M stays positive
definite and the Cholesky factor of statics serves. Small models are solved densely.

References
----------
.. [1] T. Ericsson, A. Ruhe, Math. Comp. 35 (1980) 1251.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigh

from upd.errors import ConvergenceError, InputError
from upd.labels import Shown
from upd.linalg.common import EPS, Factor, FloatArray, checked_vectors, is_free, log
from upd.linalg.eigen_checks import Modes, checked_mass, finished, ritz
from upd.linalg.inertia import about_how_many, count_modes
from upd.linalg.lanczos import BLOCK, MAX_BLOCKS, Operator, block_lanczos
from upd.linalg.schur import factorise
from upd.linalg.select import memory_left
from upd.linalg.symmetric import Matrix, checked, combined, whole

#: Up to here the dense eigenproblem takes less time than it takes to set up another.
DENSE = 500
#: Up to here a dense eigenproblem is affordable when a good part of the spectrum is wanted.
DENSE_MANY = 4000
#: Largest ||K x - lambda M x|| / ||lambda M x||; the eigenvalue's error goes with its square.
RESIDUAL_LIMIT = 1e-6
#: Modes asked for first when only a frequency limit is given.
_FIRST_GUESS = 12
#: Modes from which on those below the limit are counted before more are sought.
_MANY = 4 * _FIRST_GUESS
#: How often the guessed shift of a floating body may be bettered, and the blocks that show where it
#: should be.
_SHIFTS, _PROBE_BLOCKS = 5, 6
#: Smallest part of the shift that these blocks can distinguish from zero in an eigenvalue.
_SEEN = 1e-4
#: Of |A x - theta x| / theta in Lanczos, and in the search for what it missed, with so many vectors
#: at a time.
_TOLERANCE, _CHECK_TOLERANCE, _CHECK_BLOCK = 1e-8, 1e-2, 4

_SEARCH = "a random search, no count: no factor gave the inertia"

SOLVERS = ("auto", "dense", "pardiso", "superlu")


def modes(
    K: Any,
    M: Any,
    *,
    count: int | None = None,
    below_hz: float | None = None,
    sigma: float | None = None,
    solver: str = "auto",
    residual_limit: float = RESIDUAL_LIMIT,
    stiffness_size: ArrayLike | None = None,
) -> Modes:
    """Lowest natural frequencies and mode shapes of K x = lambda M x.

    Dofs without mass are allowed: every vector comes out of K - sigma M, whose massless rows make
    them follow the others statically. That none is missing, equal frequencies included, is counted
    (`upd.linalg.inertia`); where no factor gives a count, a Lanczos run on what the found modes
    leave must end above the last of them (see `Modes.shown`).

    Parameters
    ----------
    K : (n, n) Symmetric, sparse array or array_like
        Stiffness, N/mm, symmetric.
    M : (n, n) Symmetric, sparse array or array_like
        Mass, t, symmetric positive semi-definite.
    count : int, optional
        How many modes; with `below_hz` too, whichever ends first.
    below_hz : float, optional
        All modes up to this frequency, Hz.
    sigma : float, optional
        Shift in (rad/s)^2, below the first eigenvalue. None: 0, and for a body that floats minus
        its first elastic eigenvalue (estimated; sigma = 0 would factorise a singular matrix and
        return wrong modes that look converged).
    solver : {"auto", "dense", "pardiso", "superlu"}
    residual_limit : float
        Largest ||K x - lambda M x|| / ||lambda M x|| of every elastic mode; the rounding of K x is
        allowed beyond it.
    stiffness_size : (n,) array_like, optional
        Stiffness whose rounding K carries, where that is not its diagonal (a condensed K: that of
        the full one), N/mm.

    Returns
    -------
    Modes
        Frequencies in Hz, shapes with X'MX = 1.

    Raises
    ------
    InputError
        For bad arguments, and for more modes than dofs with mass.
    ConvergenceError
        For a mode beyond the limit (its `partial` holds the modes) and for a massless part that
        floats.

    Examples
    --------
    Two masses of 1 kg on two springs of 4 kN/mm, clamped at one end.

    >>> import numpy as np
    >>> from upd.linalg import modes
    >>> K = 4e3 * np.array([[2.0, -1.0], [-1.0, 1.0]])
    >>> M = 1e-3 * np.eye(2)
    >>> found = modes(K, M, count=2)
    >>> found.frequency.round(2).tolist()
    [196.73, 515.04]
    >>> (found.shapes[1] / found.shapes[0]).round(4).tolist()
    [1.618, -0.618]
    >>> found.message
    'All modes wanted, none missed.'
    """
    problem = Eigenproblem(K, M, sigma, solver, stiffness_size)
    return problem.modes(count=count, below_hz=below_hz, residual_limit=residual_limit)


@dataclass(frozen=True)
class _Inverse:
    """(K - sigma M)^-1 by a factor; placed: the shift is none that was guessed."""

    factor: Factor
    sigma: float
    placed: bool = False


@dataclass(repr=False)
class Eigenproblem(Shown):
    """K x = lambda M x with its factor kept from one question to the next.

    Parameters
    ----------
    K, M, sigma, solver, stiffness_size
        As for `modes`.
    alone : bool, default False
        The factor that modes are counted by takes the place of the first, whatever the memory.

    Attributes
    ----------
    n_massive : int
        Number of dofs with mass.
    """

    K: Any
    M: Any
    sigma: float | None = None
    solver: str = "auto"
    stiffness_size: ArrayLike | None = None
    alone: bool = False
    n_massive: int = field(init=False)
    _size: FloatArray = field(init=False, repr=False)
    _inverse: list[_Inverse] = field(default_factory=list, repr=False)

    def __post_init__(self) -> None:
        if self.solver == "amg":
            raise InputError(
                'Solver "amg" has no factor, and modes need one: choose "pardiso" or "superlu".'
            )
        if self.solver not in SOLVERS:
            raise InputError(
                f"Unknown solver {self.solver!r} for modes: choose one of {', '.join(SOLVERS)}."
            )
        if self.sigma is not None and not np.isfinite(self.sigma):
            raise InputError(
                f"sigma = {self.sigma}: give a finite shift in (rad/s)^2, zero or below "
                "for a body that floats."
            )
        self.K = checked(self.K)
        self.M = checked_mass(self.M, self.n)
        self._size = (
            self.K.diagonal()
            if self.stiffness_size is None
            else checked_vectors(self.stiffness_size, self.n, "stiffness size")
        )
        self.n_massive = int(np.count_nonzero(self.M.diagonal()))

    @property
    def n(self) -> int:
        """Number of dofs."""
        return int(self.K.shape[0])

    def modes(
        self,
        *,
        count: int | None = None,
        below_hz: float | None = None,
        residual_limit: float = RESIDUAL_LIMIT,
    ) -> Modes:
        """Lowest modes.

        Parameters
        ----------
        count, below_hz, residual_limit
            As for the function `modes`.

        Returns
        -------
        Modes

        Raises
        ------
        InputError, ConvergenceError
            As for the function `modes`.
        """
        _check_wanted(count, below_hz, residual_limit, self.n_massive)
        begin = perf_counter()
        most = self.n_massive if count is None else count
        wanted = min(most, _FIRST_GUESS) if below_hz is not None else most
        while True:
            found = self._lowest(wanted)
            # What lies above the wanted ones is not known to be complete.
            if (
                below_hz is None
                or wanted >= most
                or found.frequency[:wanted].max(initial=0.0) > below_hz
            ):
                break
            there = self._below(found, below_hz) if wanted == _MANY else 0
            wanted = min(most, max(2 * wanted, there + 1))
        found = self._complete(found, wanted, below_hz)
        keep = _kept(found, wanted, below_hz)
        log.info(
            "modes: %d of %d dofs by %s in %.2f s",
            keep,
            self.n,
            found.solver,
            perf_counter() - begin,
        )
        return finished(self.K, self.M, found, keep, residual_limit, perf_counter() - begin)

    def displacements(self, loads: FloatArray) -> FloatArray:
        """Of (n, k) loads, by the factor of K that the modes are sought with.

        Parameters
        ----------
        loads
            N.

        Returns
        -------
        (n, k) ndarray
            mm.

        Raises
        ------
        ConvergenceError
            When the body floats.
        InputError
            For a shift other than 0: its factor is not that of K.
        """
        if self.sigma != 0.0:
            raise InputError(f"sigma = {self.sigma}: displacements take the factor of K, sigma = 0")
        return self._factor().factor(loads)

    def _lowest(self, count: int) -> Modes:
        """At least `count` lowest modes, not yet checked: Lanczos for some more, or all of them.

        Raises InputError before memory runs out: needed are a basis of three vectors per mode, or
        three dense matrices.
        """
        dense = self.solver == "dense" or 3 * count > self.n_massive
        need = 24.0 * self.n * (self.n if dense else count)
        if need > memory_left():
            raise InputError(
                f"{count} modes of {self.n} dofs need {need / 1e9:.1f} GB: ask for fewer "
                "modes, or a lower frequency limit."
            )
        small = self.n <= DENSE or (self.n <= DENSE_MANY and 4 * count >= self.n)
        asked = min(self.n_massive, count + 2 + count // 8)
        if (
            self.solver == "dense"
            or (self.solver == "auto" and small)
            or 2 * asked > self.n_massive
        ):
            return self._dense(count)
        return self.some_modes(self._placed(self._factor(), asked), asked, MAX_BLOCKS)

    def _below(self, found: Modes, below_hz: float) -> int:
        """About how many modes lie below the limit.

        Raises InputError where they are more than a mesh describes: beyond a third of the dofs the
        waves are as short as the elements.
        """
        if found.solver == "dense":
            return 0
        self._make_room()
        there = about_how_many(self.K, self.M, (2.0 * np.pi * below_hz) ** 2, found.solver)
        if 3 * there > self.n_massive:
            raise InputError(
                f"{there} modes of {self.n} dofs lie below {below_hz:g} Hz, more than the mesh "
                "describes: check the units of density and E, or give a lower frequency limit."
            )
        return there

    def _dense(self, count: int) -> Modes:
        """All modes by LAPACK from M x = theta (K - sigma M) x.

        The matrix on the right is definite even where M is not.
        """
        sigma = self.sigma if self.sigma is not None else -_scale(self.K, self.M)
        A = whole(combined(self.K, -sigma, self.M))
        try:
            theta, X = eigh(whole(self.M).toarray(), A.toarray(), driver="gvd")
        except np.linalg.LinAlgError as error:
            raise _not_definite(sigma) from error
        # A singular matrix can pass LAPACK's test by rounding: the softest motion shows it.
        v = X[:, -1]
        if is_free(v, float(v @ (A @ v) / (v @ (A.diagonal() * v)))):
            raise _not_definite(sigma)
        X = X[:, -count:][:, theta[-count:] > self.n * EPS * theta[-1]]
        return ritz(self.K, self.M, X, "dense", sigma, self._size)

    def _placed(self, inverse: _Inverse, count: int) -> _Inverse:
        """The factor, its guessed shift moved to where a few blocks show the spectrum to begin."""
        for _ in range(0 if inverse.placed else _SHIFTS):
            sigma = _better_shift(self.some_modes(inverse, count, _PROBE_BLOCKS), inverse.sigma)
            if sigma == inverse.sigma:
                break
            inverse = _Inverse(self._shifted(sigma), sigma)
        self._inverse[:] = [replace(inverse, placed=True)]
        return self._inverse[0]

    def some_modes(self, inverse: _Inverse, count: int, max_blocks: int) -> Modes:
        """Modes of one Lanczos run."""
        X = self._krylov(inverse, count, None, 0, _TOLERANCE, max_blocks)
        # One inverse more: it takes out what high modes are left in the vectors and sets massless
        # dofs to where they rest.
        X = inverse.factor(self.M @ X)
        return ritz(self.K, self.M, X, inverse.factor.solver, inverse.sigma, self._size)

    def _complete(self, found: Modes, wanted: int, below_hz: float | None) -> Modes:
        """With what the run missed: as many modes below a shift as the inertia there counts.

        Where there is no count, a search.
        """
        if found.solver == "dense":
            return found
        limit = 0.0 if below_hz is None else (2.0 * np.pi * below_hz) ** 2
        # With a limit only the modes below it are wanted, or as many as were asked for.
        keep = _kept(found, wanted, below_hz)
        self._make_room()
        limit = limit if keep < wanted else 0.0
        count = count_modes(self.K, self.M, found, keep, limit, found.solver)
        if count is None:
            return self._searched(self._factor(), found, wanted)
        frequency = np.sqrt(count.sigma) / (2.0 * np.pi)
        shown = f"{count.below} counted below {frequency:.6g} Hz, by the inertia of L D L'"
        # Each pass adds at least one mode where one is missing.
        for step in range(1, count.missed(found) + 1):
            if count.missed(found) <= 0:
                break
            found = self._more(self._factor(), found, _CHECK_BLOCK, step, _TOLERANCE)
        return found.with_proof(shown, abs(count.missed(found)))

    def _make_room(self) -> None:
        """A second factor stands beside the first where both fit with as much to spare for another
        problem solved at the same time, else in its place.
        """
        if self._inverse and (self.alone or 2 * self._inverse[0].factor.peak_bytes > memory_left()):
            self._inverse.clear()

    def _searched(self, inverse: _Inverse, found: Modes, count: int) -> Modes:
        """With what the run missed, searched M-orthogonally to the modes found.

        Until nothing turns up below the last one wanted.
        """
        # Each pass adds at least one mode, so this ends; more passes than modes wanted mean that
        # something is wrong.
        for step in range(1, count + 2):
            # What turns up above the wanted modes was not missed; what turns up below pushes the
            # last one down.
            before = found.eigenvalue[:count]
            after = self._more(inverse, found, 1, step, _CHECK_TOLERANCE).eigenvalue[:count]
            near = 1e-6 * abs(found.sigma)
            if len(before) == len(after) and np.allclose(after, before, rtol=1e-6, atol=near):
                return found.with_proof(_SEARCH, 0)
            found = self._more(inverse, found, _CHECK_BLOCK, step, _TOLERANCE)
        return found.with_proof(_SEARCH, 1)

    def _more(
        self, inverse: _Inverse, found: Modes, count: int, seed: int, tolerance: float
    ) -> Modes:
        """The modes found and `count` others."""
        extra = self._krylov(inverse, count, found, seed, tolerance)
        both = np.hstack([found.shapes, inverse.factor(self.M @ extra)])
        return ritz(self.K, self.M, both, found.solver, found.sigma, self._size)

    def _factor(self) -> _Inverse:
        """The factor for the shift asked for.

        By default of K, and where that is singular of K plus a little M.
        """
        if self._inverse:
            return self._inverse[0]
        sigma = 0.0 if self.sigma is None else self.sigma
        try:
            factor = self._shifted(sigma)
        except ConvergenceError:
            if self.sigma is not None:
                raise _not_definite(sigma) from None
            sigma = -_scale(self.K, self.M)
            log.info("modes: the body floats, shift %.3g (rad/s)^2", sigma)
            try:
                factor = self._shifted(sigma)
            except ConvergenceError as error:
                raise _not_definite(sigma) from error
        self._inverse.append(_Inverse(factor, sigma, placed=self.sigma is not None or sigma == 0.0))
        return self._inverse[0]

    def _shifted(self, sigma: float) -> Factor:
        solver = "auto" if self.solver == "dense" else self.solver
        return factorise(
            self.K if sigma == 0.0 else combined(self.K, -sigma, self.M), solver=solver
        )

    def _krylov(
        self,
        inverse: _Inverse,
        count: int,
        found: Modes | None,
        seed: int,
        tolerance: float,
        max_blocks: int = MAX_BLOCKS,
    ) -> FloatArray:
        """Vectors (n, count) of the largest theta of theta x = (K - sigma M)^-1 M x.

        M-orthogonal to the modes found.
        """
        solve: Operator = inverse.factor
        block = min(BLOCK if found is None else _CHECK_BLOCK, self.n_massive)
        start = solve(self.M @ np.random.default_rng(seed).standard_normal((self.n, block)))
        if found is not None:
            # without the part in the modes found, after the inverse
            X, MX = found.shapes, self.M @ found.shapes

            def solve(b: FloatArray) -> FloatArray:
                x = inverse.factor(b)
                return np.asarray(x - X @ (MX.T @ x))

            for _ in range(2):
                start = start - X @ (MX.T @ start)
        made = block_lanczos(solve, self.M, start, count, tolerance, max_blocks)
        log.info(
            "block Lanczos: %d vectors in %d blocks of %d, sigma %.3g",
            count,
            made.blocks,
            block,
            inverse.sigma,
        )
        return made.X


def _better_shift(found: Modes, sigma: float) -> float:
    """A shift near the first elastic eigenvalue, in place of a first guess that is not good.

    One far from the spectrum crowds the wanted end of it, one too near to zero leaves the factor
    nearly singular. The modes need not have converged: a rigid motion taken for an elastic mode
    gives a shift too near to zero, which the next look corrects.
    """
    # Eigenvalues are found as sigma + 1 / theta: what is far below the shift is not distinct from a
    # rigid motion.
    seen = found.eigenvalue[found.eigenvalue > _SEEN * abs(sigma)]
    if not seen.size:
        return _SEEN * sigma if found.n_rigid < len(found.frequency) else sigma
    first = float(seen[0])
    return sigma if -10.0 * first <= sigma <= -0.01 * first else -first


def _kept(found: Modes, wanted: int, below_hz: float | None) -> int:
    """How many of the modes found are answered with."""
    if below_hz is None:
        return wanted
    return int(np.searchsorted(found.frequency[:wanted], below_hz, side="right"))


def _scale(K: Matrix, M: Matrix) -> float:
    """First guess of the smallest elastic eigenvalue of a compact body of n dofs, (rad/s)^2.

    trace K / trace M is of the size (c / h)^2, wave speed c and element size h; the lowest elastic
    one is about (c / L)^2, L ~ h n^(1/3).
    """
    n = K.shape[0]
    return float(K.diagonal().sum() / M.diagonal().sum() * float(n) ** (-2.0 / 3.0))


def _not_definite(sigma: float) -> ConvergenceError:
    return ConvergenceError(
        f"K - sigma M with sigma = {sigma:.3g} (rad/s)^2 is not positive definite: a part "
        "of the body floats, or sigma is above the first "
        "eigenvalue. Leave sigma out, or give one below zero; hold massless parts."
    )


def _check_wanted(
    count: int | None, below_hz: float | None, residual_limit: float, n_massive: int
) -> None:
    errors = []
    if count is None and below_hz is None:
        errors.append("give count, below_hz or both")
    if count is not None and count < 1:
        errors.append(f"count = {count}: ask for at least one mode")
    if count is not None and count > n_massive:
        errors.append(
            f"count = {count}: the model has {n_massive} dofs with mass and no more modes; "
            "ask for at most that many"
        )
    if below_hz is not None and not below_hz > 0.0:
        errors.append(f"below_hz = {below_hz}: give a positive frequency in Hz")
    if not 0.0 < residual_limit < 1.0:
        errors.append(f"residual_limit = {residual_limit}: give a number between 0 and 1")
    if errors:
        raise InputError("Modes: " + "; ".join(errors) + ".")
