"""Forced response with friction contacts of matrices from another finite-element code.

K, M and, if there is one, C come as files (see `upd.matrices`) or as arrays. A dof is the number of
its row from 0, or (node, "UX") where the map of the dofs is given too; a motion is a dof, or
several with their weights: {(12, "UX"): 1.0, (98, "UX"): -1.0} is how far node 12 moves towards +x
from node 98.

    >>> from upd.matrices.response import Joint, forced_response
    >>> answer = forced_response(                                               # doctest: +SKIP
    ...     "blades.K.mtx", "blades.M.mtx", dofs="blades.mapping", zeta=0.005,
    ...     joints=[Joint(closing={(12, "UX"): 1.0, (98, "UX"): -1.0},
    ...                   sliding=[{(12, "UY"): 1.0, (98, "UY"): -1.0}],
    ...                   k_n=1e5, k_t=8e4, mu=0.5, preload=100.0)],
    ...     force={(5, "UY"): 10.0}, watch={"tip": (7, "UY")},
    ...     frequencies=np.linspace(80.0, 120.0, 81),
    ... )
    >>> answer.peak("tip")                                                      # doctest: +SKIP

Units are those of the matrices: N/mm and t give mm, N and Hz.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import LinAlgError, eigh
from scipy.sparse import csr_array

from upd import hbm
from upd.errors import InputError
from upd.fem.assembly import modal_damping
from upd.hbm.springs.modal import modal
from upd.matrices.files import (
    COMPONENTS,
    DofMap,
    Matrices,
    check_sizes,
    checked,
    read_dof_map,
    read_matrix,
)
from upd.reduction import ReducedModel, craig_bampton

FloatArray = NDArray[np.float64]
Dof = int | tuple[int, str]
Motion = Dof | Mapping[Any, float]

#: dofs up to which the matrices are taken whole: harmonic balance needs all their modes once
MOST_DENSE = 600
#: modes of the reduction reach this many times beyond the highest frequency of interest
_BEYOND = 10.0
#: watched motions whose peaks are printed
_MOST_NAMED = 7
_UNHELD = (
    "friction alone holds row {}: where its joints slip nothing sets its mean place and nothing "
    "balances a static force on it; give it a stiffness in K"
)


@dataclass(frozen=True)
class Joint:
    """One contact point: N = max(0, preload + k_n (closing - gap)), friction up to mu N.

    Attributes
    ----------
    closing
        Motion that presses it together.
    sliding
        None, one or two motions along the surface.
    k_n
        Stiffness along the normal, N/mm, >= 0.
    k_t
        Stiffness along the surface, N/mm, > 0; needed where mu > 0 and there is a sliding motion.
    mu
        Coefficient of friction, >= 0.
    preload
        N.
    gap
        mm.
    """

    closing: Motion
    sliding: Sequence[Motion] = ()
    k_n: float = 0.0
    k_t: float | None = None
    mu: float = 0.0
    preload: float = 0.0
    gap: float = 0.0


@dataclass(frozen=True)
class OwnResponse:
    """Forced response of external matrices at the watched motions.

    Attributes
    ----------
    response : upd.hbm.FrequencyResponse
        Path, status, states, energy.
    watched : mapping
        Name -> row (n,) on the dofs of the response.
    reduced : ReducedModel or None
        The reduced model when the matrices were too large to be taken whole.
    """

    response: hbm.FrequencyResponse
    watched: Mapping[str, FloatArray]
    reduced: ReducedModel | None = None

    def __repr__(self) -> str:
        peaks = [
            f"  {name}: {height:.5g} mm at {f:.5g} Hz"
            for name, (f, height) in ((n, self.peak(n)) for n in list(self.watched)[:_MOST_NAMED])
            if len(self.frequency)
        ]
        more = len(self.watched) - len(peaks)
        return "\n".join([repr(self.response), *peaks, *([f"  and {more} more"] if more else [])])

    @property
    def frequency(self) -> FloatArray:
        """(n,) Hz along the path."""
        return self.response.frequency

    @property
    def status(self) -> str:
        """ "complete", or what it lacks: see `upd.hbm.FrequencyResponse` and its message."""
        return self.response.status

    def amplitude(self, name: str, harmonic: int | None = None) -> FloatArray:
        """Amplitude (n,) mm of a harmonic of a watched motion, the lowest kept above 0 by default.

        Raises InputError for an unknown name or a harmonic that is not kept.
        """
        return self.response.amplitude(self._row(name), harmonic)

    def free(
        self, name: str, frequencies: ArrayLike | None = None, harmonic: int | None = None
    ) -> FloatArray:
        """The same without joints, at the path's or at other frequencies in Hz."""
        return self.response.free(self._row(name), frequencies, harmonic)

    def stuck(
        self, name: str, frequencies: ArrayLike | None = None, harmonic: int | None = None
    ) -> FloatArray:
        """The same with every joint closed, and sticking where it has friction."""
        return self.response.stuck(self._row(name), frequencies, harmonic)

    def peak(self, name: str, harmonic: int | None = None) -> tuple[float, float]:
        """Frequency in Hz and amplitude in mm of the highest point of that harmonic."""
        return self.response.peak(self._row(name), harmonic)

    def _row(self, name: str) -> FloatArray:
        if name not in self.watched:
            raise InputError(f"no watched motion {name!r}; there are {', '.join(self.watched)}")
        return self.watched[name]


class ResponseOptions(TypedDict, total=False):
    """What `forced_response` may be given besides; the last ones go to
    `upd.hbm.frequency_response`.
    """

    C: Any
    zeta: ArrayLike | None
    dofs: DofMap | Path | str | None
    static_force: Mapping[Any, float] | None
    modes: int | None
    harmonics: Iterable[int]
    samples: int | None
    start: Any
    slider: ArrayLike | None
    sweep_down: bool
    fast_exits: bool
    settings: Any


def forced_response(
    K: Any,
    M: Any,
    *,
    joints: Sequence[Joint],
    force: Mapping[Any, complex],
    watch: Mapping[str, Motion],
    frequencies: ArrayLike,
    **options: Unpack[ResponseOptions],
) -> OwnResponse:
    """Free, stuck and nonlinear forced response of K and M with friction joints, by multi-harmonic
    balance.

    Parameters
    ----------
    K, M : file or (n, n) array_like or sparse array
        Matrix Market, Harwell-Boeing or npz files, or symmetric arrays; N/mm and t.
    joints
        Contact points.
    force
        dof -> complex amplitude in N of F exp(i w t).
    watch
        Name -> motion whose amplitude is asked for.
    frequencies : (n_f,) array_like
        Hz.
    C : file or (n, n) array_like or sparse array, optional
        Viscous damping, N s/mm; or
    zeta : float or (n,) array_like, optional
        Damping ratio of every mode without joints, one or one per mode, instead of C.
    dofs
        Map of the dofs, or its file; rows are numbered from 0 without it.
    static_force
        dof -> N, constant.
    modes
        Fixed-interface modes kept beside the dofs of joints, forces and watched motions (Craig,
        Bampton). None: the matrices are taken whole up to 600 dofs unless rounding blurs their low
        modes, and else reduced to the modes below ten times the highest harmonic of interest.
    harmonics
        Harmonics of the balance, (0, 1) by default.
    options
        C, zeta, dofs, static_force, modes and harmonics, as above; further arguments of
        `upd.hbm.frequency_response` (samples, start, sweep_down, ...).

    Returns
    -------
    OwnResponse

    Raises
    ------
    InputError
        For unreadable or unfit matrices, unknown dofs and bad numbers, all problems at once.
    """
    problems: list[str] = []
    settings: dict[str, Any] = dict(options)
    C, zeta, dofs, static_force, modes = (
        settings.pop(name, None) for name in ("C", "zeta", "dofs", "static_force", "modes")
    )
    harmonics = settings.pop("harmonics", (0, 1))
    own = {name: settings.pop(name) for name in ("samples", "start", "slider") if name in settings}
    K, M, known, damping = _read(K, M, C, zeta, dofs)
    n = K.shape[0]
    orders = hbm.harmonics(harmonics).numbers
    f = np.atleast_1d(np.asarray(frequencies, dtype=float))
    rows = _Rows(known, n, problems)
    closing = [rows.motion("joint", j.closing) for j in joints]
    sliding = _sliding(joints, rows, problems)
    constant = rows.motion("static_force", static_force or {})
    harmonic = rows.motion("force", force)
    watched = [rows.motion(f"watch {name!r}", motion) for name, motion in watch.items()]
    problems += [] if joints else ["joints: give at least one"]
    problems += [] if watch else ["watch: name at least one motion"]
    problems += [
        f"joint {number}: k_t is missing; to fix it: give its stiffness along the sliding motion, "
        "N/mm, or mu = 0"
        for number, j in enumerate(joints)
        if j.k_t is None and j.mu > 0 and len(j.sliding)
    ]
    if problems:
        raise InputError("forced_response: " + "; ".join(problems))
    _refuse_fixed(K, M)
    below = _BEYOND * max(orders) * float(f.max(initial=0.0))
    reduced = _reduced(K, M, rows.used, modes, below, whole=damping is not None)
    Kd, Md = (K.toarray(), M.toarray()) if reduced is None else (reduced.K, reduced.M)
    if count := _blurred(Kd, Md):
        raise InputError(
            f"forced_response: {count} elastic modes lie so far below the highest one that "
            "rounding blurs them; "
            "reduce with fewer modes (modes=), or leave out dofs that are far stiffer than the rest"
        )
    at = np.eye(n)[rows.used] if reduced is None else reduced.at(rows.used)
    points = _contacts(joints, rows.matrix(closing) @ at, [rows.matrix(s) @ at for s in sliding])
    answer = hbm.frequency_response(
        hbm.System(
            (Md, _damping(Kd, Md, damping, zeta, reduced), Kd),
            points,
            static_force=(rows.matrix([constant]) @ at)[0],
            harmonics=orders,
            **own,
        ),
        harmonic_force=(rows.matrix([harmonic], complex) @ at)[0],
        frequencies=f,
        **settings,
    )
    if answer.status == "stopped":
        free = np.linalg.norm(at @ _held_by_friction(Kd, joints, rows.matrix(closing) @ at), axis=1)
        if free.any():
            why = _UNHELD.format(int(rows.used[free.argmax()]))
            answer = replace(answer, message=f"{answer.message}; {why}")
    return OwnResponse(answer, dict(zip(watch, rows.matrix(watched) @ at, strict=True)), reduced)


def _read(
    K: Any, M: Any, C: Any, zeta: ArrayLike | None, dofs: DofMap | Path | str | None
) -> tuple[csr_array, csr_array, DofMap | None, csr_array | None]:
    """K, M and the map, C or None. Raises InputError when they do not fit."""
    if (C is None) == (zeta is None):
        raise InputError(
            "forced_response: give the damping once, as the matrix C or as the ratio zeta"
        )
    found = dofs if dofs is None or isinstance(dofs, DofMap) else read_dof_map(dofs)
    K, M = _matrix(K, "K"), _matrix(M, "M")
    check_sizes(Matrices(K, M, found))
    damping = None if C is None else _matrix(C, "C")
    if damping is not None and damping.shape != K.shape:
        raise InputError(
            f"Matrices: C is {damping.shape}, K is {K.shape}: write both from one "
            "model with one set of constraints."
        )
    return K, M, found, damping


def _matrix(A: Any, name: str) -> csr_array:
    if isinstance(A, (str, Path)):
        return read_matrix(A)
    return checked(A if hasattr(A, "tocsr") else np.asarray(A), name)


@dataclass
class _Rows:
    """Rows of the matrices that joints, forces and watched motions use.

    Unknown ones are messages in ``problems``.
    """

    dofs: DofMap | None
    n: int
    problems: list[str]
    seen: set[int] = field(default_factory=set)

    @property
    def used(self) -> NDArray[np.int64]:
        """All rows used so far, in their order."""
        return np.array(sorted(self.seen), dtype=np.int64)

    def motion(self, place: str, motion: Motion | Mapping[Any, Any]) -> dict[int, Any]:
        """Row -> weight."""
        pairs = motion.items() if isinstance(motion, Mapping) else [(motion, 1.0)]
        out: dict[int, Any] = {}
        for dof, weight in pairs:
            try:
                row = self._row(dof)
            except InputError as error:
                self.problems.append(f"{place}: {error}")
                continue
            if not np.isfinite(weight):
                self.problems.append(
                    f"{place}: {dof!r} has the weight {weight!r}; give a finite number"
                )
            out[row] = out.get(row, 0.0) + weight
        self.seen |= set(out)
        return out

    def _row(self, dof: Any) -> int:
        if isinstance(dof, tuple) and len(dof) == 2:
            if self.dofs is None:
                raise InputError(
                    f"{dof!r} names a node, but no map of the dofs is given; give dofs=, "
                    "or the number of the row"
                )
            if isinstance(dof[1], str) and dof[1] not in COMPONENTS:
                raise InputError(
                    f"{dof!r} has no component {dof[1]!r}; there are {', '.join(COMPONENTS)}"
                )
            return self.dofs.find(*dof)
        if isinstance(dof, bool) or not isinstance(dof, (int, np.integer)):
            raise InputError(f"{dof!r} is not a dof; give the number of its row, or (node, 'UX')")
        if not 0 <= dof < self.n:
            raise InputError(
                f"row {dof} is not there; the matrices have the rows 0 to {self.n - 1}"
            )
        return int(dof)

    def matrix(self, motions: Sequence[Mapping[int, Any]], kind: type = float) -> NDArray[Any]:
        """Weights (len(motions), len(used))."""
        place = {row: k for k, row in enumerate(self.used)}
        out: NDArray[Any] = np.zeros((len(motions), len(place)), dtype=kind)
        for line, motion in zip(out, motions, strict=True):
            for row, weight in motion.items():
                line[place[row]] = weight
        return out


def _sliding(
    joints: Sequence[Joint], rows: _Rows, problems: list[str]
) -> list[list[dict[int, Any]]]:
    """Sliding motions, direction by direction."""
    counts = sorted({len(j.sliding) for j in joints})
    if len(counts) > 1 or (counts and counts[0] > 2):
        problems.append(
            f"joints: have {' and '.join(map(str, counts))} sliding motions; give all the "
            "same number, 0, 1 or 2"
        )
        return []
    return [
        [rows.motion("joint", j.sliding[k]) for j in joints]
        for k in range(counts[0] if counts else 0)
    ]


def _contacts(
    joints: Sequence[Joint], closing: FloatArray, sliding: Sequence[FloatArray]
) -> hbm.Contacts:
    numbers = {
        name: [float(getattr(j, name)) for j in joints] for name in ("k_n", "mu", "preload", "gap")
    }
    # nothing reads the stiffness of a joint that cannot stick
    k_t = [1.0 if j.k_t is None else float(j.k_t) for j in joints]
    return hbm.contacts(closing, np.array(sliding), k_t=k_t, **numbers)


def _reduced(
    K: csr_array,
    M: csr_array,
    boundary: NDArray[np.int64],
    modes: int | None,
    below_hz: float,
    *,
    whole: bool,
) -> ReducedModel | None:
    """The reduced model, or None when the matrices can be taken whole.

    Whole: keep the basis everywhere.
    """
    if modes is None and K.shape[0] <= MOST_DENSE and not _blurred(K.toarray(), M.toarray()):
        return None
    size: dict[str, Any] = {"below_hz": below_hz} if modes is None else {"n_modes": modes}
    return craig_bampton(K, M, boundary, rows=None if whole else boundary, **size)


def _blurred(K: FloatArray, M: FloatArray) -> int:
    """Modes with stiffness that harmonic balance would take for rigid.

    So far below the highest one that rounding blurs them.
    """
    try:
        values = eigh(K, M, eigvals_only=True)
    except LinAlgError:
        raise InputError(
            "M is not positive definite: a dof has no mass; leave massless dofs out, or "
            "reduce with modes="
        ) from None
    rounding = len(values) * float(np.finfo(float).eps) * float(np.abs(values).max())
    return int((modal(M, np.zeros_like(K), K).rigid & (values > rounding)).sum())


def _held_by_friction(K: FloatArray, joints: Sequence[Joint], closing: FloatArray) -> FloatArray:
    """Orthonormal motions (n, m) without stiffness of the bodies and of pressed joints."""
    pressed = K + (closing.T * [j.k_n for j in joints]) @ closing
    values, motions = eigh(pressed)
    rounding = len(values) * float(np.finfo(float).eps) * float(np.abs(values).max())
    return np.asarray(motions[:, values <= rounding])


def _refuse_fixed(K: csr_array, M: csr_array) -> None:
    """Refuse what other programs leave of dofs that do not move: entries on the diagonal beside
    which rounding loses the others, and rows without mass and without stiffness of their own,
    Lagrange multipliers.
    """
    diagonal = K.diagonal()
    order = np.argsort(diagonal)
    order = order[diagonal[order] > 0.0]
    jumps = np.flatnonzero(diagonal[order][1:] * np.finfo(float).eps > diagonal[order][:-1])
    fixed = order[jumps[0] + 1 :] if len(jumps) else order[:0]
    if len(fixed):
        raise InputError(
            f"forced_response: K has {diagonal[fixed[0]]:.3g} on the diagonal of "
            f"{len(fixed)} dofs, the first {int(fixed.min())}, a penalty beside which rounding "
            "loses the rest; leave these dofs out of K, M and C: they do not move"
        )
    mass, stiffness = (abs(A).sum(axis=1) for A in (M, K))
    found = np.flatnonzero((mass == 0.0) & (diagonal == 0.0) & (stiffness > 0.0))
    if len(found):
        raise InputError(
            f"forced_response: {len(found)} rows, the first {found[0]}, have no mass and a zero on "
            "the diagonal of K, as Lagrange multipliers have: leaving them out would drop their "
            "constraints; export the matrices with the constraints eliminated"
        )


def _damping(
    K: FloatArray,
    M: FloatArray,
    C: csr_array | None,
    zeta: ArrayLike | None,
    reduced: ReducedModel | None,
) -> FloatArray:
    """C on the coordinates of K and M: given, or from the ratios of their modes."""
    if C is not None:
        return C.toarray() if reduced is None else np.asarray(reduced.basis.T @ (C @ reduced.basis))
    values, shapes = eigh(K, M)
    # Rounding may put a rigid motion below zero.
    return modal_damping(
        M, shapes, np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi), () if zeta is None else zeta
    )
