"""What is read from an answer: accelerance, peaks, states, loops, damper motion.

Peaks are told apart by the mode that moves, not by their order in frequency. The number of a peak
is that of a stuck mode of both blades with the damper: 1 is the lowest in which the tips move in
phase, 2 the lowest out of phase, 3 and 4 the next of each. It stays the mode's own where two peaks
cross as a parameter changes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import linear_sum_assignment

from upd.analyses.forced.model import Model
from upd.analyses.measured import CurvePeak
from upd.dynamics.peaks import find_peaks
from upd.hbm import FrequencyResponse
from upd.hbm.core.fourier import to_complex
from upd.hbm.springs.balance import Balance
from upd.mesh import IntArray
from upd.scene.forced_contact import SIDES, Side

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
#: mm to m
_M = 1e-3
#: peaks lower than this part of the highest are not reported
PEAKS_ABOVE = 0.1


@dataclass(frozen=True)
class StuckMode:
    """A mode that moves the tips along x with all points closed and sticking.

    Its natural frequency in Hz, whether the tips move in phase, its number and words.
    """

    frequency: float
    in_phase: bool
    number: int
    words: str


@dataclass(frozen=True)
class Loop:
    """One cycle of a contact point along its main sliding direction.

    Displacement mm, traction N, limit mu N in N, all (n,).
    """

    point: int
    displacement: Array
    traction: Array
    limit: Array
    energy: float


def accelerance(
    answer: FrequencyResponse, row: Array, force: float, harmonic: int | None = None
) -> ComplexArray:
    """One harmonic of the acceleration along an output, per newton of F_E.

    Parameters
    ----------
    answer
        Path of n points.
    row
        (n_dof,) output: the displacement is row @ q, mm.
    force
        F_E, N.
    harmonic
        Its number; the lowest that is excited when None.

    Returns
    -------
    ComplexArray
        (n,) along the path, (m/s2)/N.
    """
    k = harmonic
    if k is None:
        excited = np.flatnonzero(np.any(answer.balance.dynamic != 0.0, axis=1))
        k = int(answer.harmonics.dynamic[excited[0]])
    j = answer.harmonics.place(k)
    u = to_complex(np.einsum("i,nis->ns", row, answer.coefficients), answer.harmonics)[:, j]
    return accelerance_of(u, answer.frequency, k, force)


def accelerance_at(
    model: Model, b: Balance, x: Array, frequency: Array, force: float
) -> dict[Side, ComplexArray]:
    """(k,) (m/s2)/N of both blades in the lowest harmonic that is excited, at solved points.

    Parameters
    ----------
    x, frequency
        (k, n_unknown) unknowns of the problem, (k,) Hz.
    force
        F_E, N.
    """
    k, h = model.excitation.lowest, b.harmonics
    forces = np.array([b.force(one) for one in x]).reshape(len(x), len(b.Psi), h.size)
    rigid = np.array([b.split(one)[1] for one in x])
    q = b.displacement(2.0 * np.pi * frequency, forces, rigid)
    moved = to_complex(q, h)[..., h.place(k)]
    return {s: accelerance_of(moved @ model.row(s), frequency, k, force) for s in SIDES}


def accelerance_of(
    moved: ComplexArray, frequency: Array, harmonic: int, force: float
) -> ComplexArray:
    """(n,) (m/s2)/N of F_E, from the amplitudes (n,) mm of a harmonic at frequencies (n,) in Hz."""
    return np.asarray(-((2.0 * np.pi * harmonic * frequency) ** 2) * _M / force * moved)


def path_maxima(
    frequency: Array, magnitude: Array, above: float = PEAKS_ABOVE, *, between: bool = True
) -> list[CurvePeak]:
    """All local maxima along a path that may turn back, in its order.

    Parameters
    ----------
    frequency, magnitude
        (n,) along the path, Hz and any unit.
    above
        Maxima lower than this part of the highest are left out.
    between
        Whether they may lie between points: not in a sweep, whose motion may jump between two.
    """
    f, a = np.asarray(frequency), np.asarray(magnitude)
    if len(f) < 3:
        return []
    out = []
    for i in np.flatnonzero((a[1:-1] > a[:-2]) & (a[1:-1] >= a[2:])) + 1:
        if a[i] < above * a.max():
            continue
        part = slice(i - 1, i + 2)
        sense = 1 if f[i + 1] > f[i] else -1
        if between and (f[i + 1] - f[i]) * (f[i] - f[i - 1]) > 0.0:
            found = find_peaks(f[part][::sense], a[part][::sense])
            if len(found.frequency):
                out.append(CurvePeak(float(found.frequency[0]), float(found.height[0]), int(i)))
                continue
        out.append(CurvePeak(float(f[i]), float(a[i]), int(i)))
    return out


def loops(answer: FrequencyResponse, i: int, count: int) -> list[Loop]:
    """Hysteresis loops at a point of a path, as `largest_loops`; empty without friction."""
    b, x = answer.balance, answer.x[i]
    if not b.contacts.tangents:
        return []
    motion = b.split(x)[0] @ b.E.T
    return largest_loops(
        answer.energy[i], motion[:, 1:], b.period(x).force, b.contacts.law.mu, count
    )


def largest_loops(
    loss: Array, motion: Array, force: Array, friction: Array, count: int
) -> list[Loop]:
    """Hysteresis loops of the contact points that lose most, each along its main sliding direction.

    Parameters
    ----------
    loss
        (n_point,) per cycle, N mm.
    motion, force
        (n_point, tangents, n) mm along a cycle, and (n_point, 1 + tangents, n) N.
    friction
        (n_point,) mu.
    count
        Loops at most; of points that lose the same, as mirror images do, one.

    Returns
    -------
    list of Loop
        The largest loss first.
    """
    order, out = np.argsort(-loss), []
    falling = loss[order]
    rounding = np.sqrt(np.finfo(float).eps) * falling[0]
    own = np.append(True, np.diff(falling) < -rounding) & (falling >= rounding)
    for p in order[own][:count]:
        w = motion[p] - motion[p].mean(axis=1, keepdims=True)
        main = np.linalg.svd(w, full_matrices=False)[0][:, 0]
        main *= np.sign(main[np.argmax(np.abs(main))])
        limit = friction[p] * force[p, 0]
        out.append(Loop(int(p), main @ motion[p], main @ force[p, 1:], limit, float(loss[p])))
    return out


def in_faces(position: Array, face: IntArray, frames: Iterable[Array]) -> tuple[Array, Array]:
    """Points in the frames of their faces.

    Parameters
    ----------
    position, face
        (n, 3) mm, and (n,) index into SIDES.
    frames
        (3, 3) of each face.

    Returns
    -------
    along, up
        (n,) along the damper, and up the slope from the lowest point of the face, mm.
    """
    along, up = np.zeros(len(face)), np.zeros(len(face))
    for k, frame in enumerate(frames):
        on = face == k
        local = position[on] @ frame.T
        along[on], up[on] = local[:, 1], local[:, 2] - local[:, 2].min()
    return along, up


def damper_motion(answer: FrequencyResponse, model: Model) -> tuple[Array, Array]:
    """Motion of the damper's six dofs along the path.

    Returns
    -------
    static, amplitude
        (n, 6) mean, and amplitude of the lowest harmonic that is excited, mm and rad.
    """
    h, found = answer.harmonics, answer.coefficients
    q = np.zeros((len(found), 6, h.size))
    q[:, list(model.damper.kept)] = found[:, -model.damper.n_dof :]
    first = h.offset + 2 * h.place(model.excitation.lowest)
    static = q[:, :, 0] if h.static else np.zeros(q.shape[:2])
    return static.copy(), np.hypot(q[:, :, first], q[:, :, first + 1])


def residual_error(answer: FrequencyResponse) -> float:
    """Largest misfit along the path of the balance itself, evaluated again, relative.

    The contact condition w - u + G f(w) = 0 against its largest terms, and the contact forces kept
    against those of the law at w.
    """
    b, worst = answer.balance, 0.0
    for f, x, kept in zip(answer.frequency, answer.x, answer.contact_force, strict=True):
        off = np.abs(b.force(x) - kept).max()
        forces = off / max(float(np.abs(kept).max()), np.finfo(float).tiny)
        worst = max(worst, b.misfit(x, float(2.0 * np.pi * f)), float(forces))
    return worst


def face_shares(state: Array, face: IntArray, weight: Array) -> Array:
    """Shares of the cycle that each face sticks, slips and is open.

    Parameters
    ----------
    state
        (..., n_point, 3) of its points or nodes.
    face, weight
        (n_point,) index into SIDES; stiffness or area.

    Returns
    -------
    Array
        (..., 2, 3).
    """
    share = [
        np.einsum("...pc,p->...c", state[..., on, :], weight[on] / weight[on].sum())
        for on in (face == k for k in range(len(SIDES)))
    ]
    return np.stack(share, axis=-2)


# -- peaks by their modes --------------------------------------------------------------------------


#: share of the motion above which a mode has more than all others together
MAJORITY = 0.5
#: modes up to so many times the highest frequency of a sweep are found in it
CANDIDATES = 2.0


@dataclass(frozen=True)
class ModeShapes:
    """Stuck modes that move the tips along x.

    Attributes
    ----------
    M
        (n, n) of both blades and the damper, t.
    shape
        (n, m) orthonormal in M.
    modes
        What each is.
    """

    M: Array
    shape: Array
    modes: list[StuckMode]


def mode_shapes(model: Model, below: float, stiffness: Array | None = None) -> ModeShapes:
    """The stuck modes along x below ``below`` Hz, of the blades with the damper on its springs.

    Parameters
    ----------
    stiffness
        (n, n) of their dofs, in place of that with every point sticking.
    """
    M, _, K, _ = model.linear(stuck=True)
    values, shapes = eigh(K if stiffness is None else stiffness, M)
    tips = np.array([model.row(side) @ shapes for side in SIDES])
    return modes_of_tips(M, np.sqrt(np.maximum(values, 0.0)) / (2 * np.pi), shapes, tips, below)


def modes_of_tips(
    M: Array, frequency: Array, shapes: Array, tips: Array, below: float
) -> ModeShapes:
    """Modes (n, k) below ``below`` Hz that move both tips (2, k) along x, numbered by their
    phase.
    """
    # a mode across the blades does not move their probes along x: the size of a whole tip motion is
    # that of the modes below; far above, shapes of hardly any mass move more
    size = np.abs(tips).max(axis=0)
    low = frequency < below
    column = np.flatnonzero(low & (size > PEAKS_ABOVE * size[low].max(initial=0.0)))
    count, modes = {True: 0, False: 0}, []
    for j in column:
        in_phase = bool(tips[0, j] * tips[1, j] > 0.0)
        count[in_phase] += 1
        k, kind = count[in_phase], "in phase" if in_phase else "out of phase"
        words = kind + (f" {k}" if k > 1 else "")
        modes.append(StuckMode(float(frequency[j]), in_phase, 2 * k - in_phase, words))
    return ModeShapes(M, shapes[:, column], modes)


def motion_shares(M: Array, motion: ComplexArray, shape: Array) -> Array:
    """Modal assurance criterion, mass-weighted, of motions and modes.

    MAC = |phi^T M z|^2 / ((phi^T M phi) (z^H M z)). With modes orthonormal in M it is the share of
    the mode in the kinetic energy of the harmonic z, and the shares of all modes sum to 1.

    Parameters
    ----------
    M
        (n, n) mass.
    motion
        (n_peak, n) complex amplitudes z.
    shape
        (n, n_mode) modes phi.

    Returns
    -------
    Array
        (n_peak, n_mode), 0 to 1.

    References
    ----------
    R. J. Allemang, The modal assurance criterion - twenty years of use and abuse, Sound and
    Vibration 37 (2003), eq. 1, with M as weight.
    """
    MZ = motion @ M
    energy = np.einsum("pi,pi->p", motion.conj(), MZ).real
    modal = np.einsum("ij,ik,kj->j", shape, M, shape)
    return np.asarray(np.abs(MZ @ shape) ** 2 / (energy[:, None] * modal))


def tell_apart(share: Array, height: Array) -> dict[int, int]:
    """Which maximum of a curve is the peak of which mode.

    A mode that has more than half of the motion at a maximum has more than all others together:
    the maximum is its own, and the highest of its own is its peak. Maxima in which no mode has so
    much go to the modes left over, by the assignment with the largest sum of MAC.

    Parameters
    ----------
    share
        (n_maximum, n_mode) MAC.
    height
        (n_maximum,).

    Returns
    -------
    dict
        Mode -> maximum, each at most once.
    """
    own = share > MAJORITY
    found = {
        int(mode): int(max(np.flatnonzero(own[:, mode]), key=lambda k: height[k]))
        for mode in np.flatnonzero(own.any(axis=0))
    }
    unclear = np.flatnonzero(~own.any(axis=1))
    left = np.array([mode for mode in range(share.shape[1]) if mode not in found], int)
    rows, columns = linear_sum_assignment(share[np.ix_(unclear, left)], maximize=True)
    return found | {int(left[j]): int(unclear[i]) for i, j in zip(rows, columns, strict=True)}


def numbered_peaks(
    model: Model, answer: FrequencyResponse, height: Array, stop: float
) -> list[CurvePeak]:
    """Peaks of a path by the numbers of their modes.

    Parameters
    ----------
    model
        Of the rig.
    answer
        The path.
    height
        (n,) what has peaks along it.
    stop
        End of the sweep, Hz.
    """
    maxima = path_maxima(answer.frequency, height)
    if not maxima:
        return []
    k, at = answer.harmonics.place(model.excitation.lowest), [one.sample for one in maxima]
    motion = to_complex(answer.coefficients[at], answer.harmonics)[..., k]
    if not answer.arrived:
        # where a path turns round it has a maximum that is no resonance
        on = in_quadrature(model, motion)
        maxima, motion = [one for one, keep in zip(maxima, on, strict=True) if keep], motion[on]
    return numbered(mode_shapes(model, CANDIDATES * stop), maxima, motion)


def numbered(
    modes: ModeShapes, maxima: Sequence[CurvePeak], motion: ComplexArray
) -> list[CurvePeak]:
    """Peaks by the number of their mode.

    Parameters
    ----------
    maxima
        Of a curve.
    motion
        (n_maximum, n) complex amplitude of all dofs at each.
    """
    if not maxima:
        return []
    share = motion_shares(modes.M, motion, modes.shape)
    found = tell_apart(share, np.array([one.height for one in maxima]))
    named = [
        maxima[i]._replace(number=mode.number, mode=mode.words, mac=float(share[i, j]))
        for j, i in found.items()
        for mode in (modes.modes[j],)
    ]
    return sorted(named, key=lambda peak: peak.number)


def in_quadrature(model: Model, motion: ComplexArray) -> NDArray[np.bool_]:
    """Whether motions lie within the half-power band of a resonance.

    The displacement that the forces do work on, f^H z. Of one mode it is
    |phi^T f|^2 / (w_r^2 - w^2 + 2 i zeta w_r w): out of phase with the force by 90 degrees at the
    resonance, and by 45 and 135, where real and imaginary part are equal, at half its power.

    Parameters
    ----------
    motion
        (m, n) amplitudes of all dofs.

    Returns
    -------
    NDArray
        (m,) of bool.

    References
    ----------
    D. J. Ewins, Modal Testing: Theory, Practice and Application, 2nd ed. (2000), 4.2.
    """
    driven = motion[:, : len(model.force)] @ model.force.conj()
    return np.asarray(np.abs(driven.imag) >= np.abs(driven.real))
