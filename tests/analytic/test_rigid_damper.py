"""A rigid damper between two faces: closed forms against linear programmes that know only balance
and friction.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import linprog

from upd.contact.rigid_damper import (
    SLIDINGS,
    DamperSection,
    FaceSection,
    Sliding,
    admissible_forces,
    eccentricity,
    equilibrium,
    face_forces,
    forces,
    friction_limits,
    jams,
    lifted,
    moment_share,
)
from upd.errors import InputError

ANGLES = st.floats(3.0, 90.0)
FRICTIONS = st.floats(0.02, 1.5)
#: within this of a limit of friction, in deg, a linear programme tells neither side
NEAR = 0.02


def directions(left: float, right: float) -> np.ndarray:
    """(2, 2, 2) by face: unit normal into the blade and unit vector up the slope, x and z."""
    a, b = math.radians(left), math.radians(right)
    return np.array(
        [
            [[-math.sin(a), math.cos(a)], [math.cos(a), math.sin(a)]],
            [[math.sin(b), math.cos(b)], [-math.cos(b), math.sin(b)]],
        ]
    )


def force_limits(left: float, right: float, mu: float) -> np.ndarray:
    """N and T of each face, least and greatest, whatever the moments."""
    damper = DamperSection(FaceSection(left, (-5.0, 1.0), 5.0), FaceSection(right, (5.0, 4.0), 5.0))
    return admissible_forces(damper, mu, tilting=False).limits


def programme(
    frames: np.ndarray,
    mu: float,
    objective: list[float],
    load: float = 1.0,
    bounds: list[tuple[float | None, float | None]] | None = None,
    ends: list[np.ndarray] | None = None,
) -> Any:
    """Least objective of (N, T of left, N, T of right), with ``ends`` of the faces of the normal
    forces at both their ends instead of N: balance, |T| <= mu N, pressing.
    """
    if ends is None:
        columns = [frames[k][j] for k in range(2) for j in range(2)]
        A = np.array(columns).T
        friction = np.array(
            [[-mu, s, 0, 0] for s in (1, -1)] + [[0, 0, -mu, s] for s in (1, -1)], float
        )
        target = [0.0, load]
        given_bounds = bounds or [(0, None), (None, None), (0, None), (None, None)]
    else:
        # N at the lower end, N at the upper end, T, of each face; forces and moment about G
        columns = []
        for k in range(2):
            for r, v in (
                (ends[k][0], frames[k][0]),
                (ends[k][1], frames[k][0]),
                (ends[k][0], frames[k][1]),
            ):
                columns.append([*v, r[0] * v[1] - r[1] * v[0]])
        A = np.array(columns).T
        friction = np.array(
            [[-mu, -mu, s, 0, 0, 0] for s in (1, -1)] + [[0, 0, 0, -mu, -mu, s] for s in (1, -1)]
        )
        target = [0.0, load, 0.0]
        given_bounds = [(0, None), (0, None), (None, None)] * 2
        o = objective
        objective = [o[0], o[0], o[1], o[2], o[2], o[3]]
    asked = {
        "A_ub": friction,
        "b_ub": np.zeros(4),
        "A_eq": A,
        "b_eq": target,
        "bounds": given_bounds,
    }
    found = linprog(objective, **asked)
    # presolving calls infeasible what has no bounded optimum either: with nothing to minimise, an
    # answer shows which
    if found.status == 2 and linprog(np.zeros(len(objective)), **asked).status == 0:
        found.status = 3
    return found


def away_from_limits(left: float, right: float, mu: float) -> bool:
    phi = math.degrees(math.atan(mu))
    rest = (left - phi, right - phi, left + right + 2 * phi - 180, left + right + phi - 180)
    return min(map(abs, rest)) > NEAR and left + right < 180 - NEAR


def limit_of(found: Any, sign: float) -> float:
    assert found.status in (0, 2, 3), found.message
    return (
        sign * found.fun
        if found.status == 0
        else sign * -math.inf
        if found.status == 3
        else math.nan
    )


@given(ANGLES, ANGLES, FRICTIONS)
def test_force_limits_against_linear_programmes(left: float, right: float, mu: float) -> None:
    assume(away_from_limits(left, right, mu))
    frames = directions(left, right)
    N, T = force_limits(left, right, mu)
    for k, (letter, face, end) in enumerate(itertools.product("NT", (0, 1), (0, 1))):
        objective, sign = [0.0] * 4, 1.0 - 2.0 * end
        objective[2 * face + "NT".index(letter)] = sign
        exact = (N if letter == "N" else T)[face, end]
        assert exact == pytest.approx(
            limit_of(programme(frames, mu, objective), sign), rel=1e-6, abs=1e-8
        ), (k, letter, face, end)


@given(ANGLES, ANGLES, FRICTIONS)
def test_limits_of_friction_against_linear_programmes(left: float, right: float, mu: float) -> None:
    """Empty faces with N = 0 asked for; jams as forces without F_C."""
    assume(away_from_limits(left, right, mu))
    frames, limits = directions(left, right), friction_limits(left, right)
    free, none = (None, None), (0, 0)
    press = (0, None)
    for face, limit in enumerate((limits.left_lifts, limits.right_lifts)):
        bounds = [press, free, press, free]
        bounds[2 * face], bounds[2 * face + 1] = none, none
        holds = programme(frames, mu, [0.0] * 4, bounds=bounds).status == 0
        assert holds == (mu >= limit)
    pressed = programme(frames, mu, [0.0] * 4, load=0.0, bounds=[(1, 1), free, press, free])
    assert (pressed.status == 0) == (mu >= limits.jams) == bool(jams(left, right, mu))


@st.composite
def sections(draw: st.DrawFn) -> DamperSection:
    def face(side: float) -> FaceSection:
        x, z = draw(st.floats(1.0, 12.0)), draw(st.floats(-8.0, 8.0))
        return FaceSection(draw(ANGLES), (side * x, z), draw(st.floats(0.5, 8.0)))

    return DamperSection(face(-1.0), face(1.0))


def ends_of(damper: DamperSection) -> list[np.ndarray]:
    frames = directions(damper.left.angle, damper.right.angle)
    return [
        np.array([np.array(face.middle) + s * face.half_length * frames[k][1] for s in (-1, 1)])
        for k, face in enumerate(damper.faces)
    ]


@given(sections(), FRICTIONS)
def test_forces_within_the_faces_against_linear_programmes(
    damper: DamperSection, mu: float
) -> None:
    """The programme knows two ends of each face that may press, and the moments about G."""
    left, right = damper.left.angle, damper.right.angle
    assume(away_from_limits(left, right, mu))
    frames, ends = directions(left, right), ends_of(damper)
    found = admissible_forces(damper, mu).limits
    for letter, face, end in itertools.product((0, 1), (0, 1), (0, 1)):
        objective, sign = [0.0] * 4, 1.0 - 2.0 * end
        objective[2 * face + letter] = sign
        known = limit_of(programme(frames, mu, objective, ends=ends), sign)
        # where a programme's tolerance decides whether there is an answer, it is large
        if math.isfinite(known) and abs(known) > 1e3:
            continue
        assert found[letter, face, end] == pytest.approx(known, rel=1e-5, abs=1e-6, nan_ok=True)


@given(sections(), FRICTIONS)
def test_without_moments_the_cone_jams_where_the_angles_do(
    damper: DamperSection, mu: float
) -> None:
    left, right = damper.left.angle, damper.right.angle
    assume(away_from_limits(left, right, mu))
    found = admissible_forces(damper, mu, tilting=False)
    assert found.jams == bool(jams(left, right, mu))


@given(sections(), st.floats(-0.9, 0.9), st.floats(-0.9, 0.9))
def test_eccentricity_is_the_least_common_one(damper: DamperSection, t: float, s: float) -> None:
    """Faces of ``eccentricity`` times their length just hold those forces, shorter ones do not."""
    N, share = eccentricity(damper, t, s)
    assume(np.isfinite(N).all() and N.min() > 1e-3 and N.max() < 1e3 and 1e-3 < share < 1e3)
    frames = directions(damper.left.angle, damper.right.angle)
    T = N * [t, s]
    for scale, holds in ((1.001, True), (0.999, False)):
        shorter = DamperSection(
            *(
                FaceSection(f.angle, f.middle, float(scale * share) * f.half_length)
                for f in damper.faces
            )
        )
        ends = ends_of(shorter)
        force = [N[k] * frames[k][0] + T[k] * frames[k][1] for k in (0, 1)]
        reach = [sorted(e[0] * force[k][1] - e[1] * force[k][0] for e in ends[k]) for k in (0, 1)]
        low, high = (reach[0][j] + reach[1][j] for j in (0, 1))
        assert (low <= 0.0 <= high) == holds


@given(ANGLES, ANGLES, FRICTIONS, st.sampled_from(("opposing", "frictionless", "reversed")))
def test_named_static_states_lie_within_the_limits(
    left: float, right: float, mu: float, state: str
) -> None:
    try:
        known = equilibrium(left, right, 1.0, mu, state)
    except InputError as error:
        assert "jams" in str(error)
        assert jams(left, right, mu)
        return
    N, T = force_limits(left, right, mu)
    for face, (n, t) in enumerate(
        (
            (known.normal_left, known.tangential_left),
            (known.normal_right, known.tangential_right),
        )
    ):
        slack = 1e-9 * max(1.0, abs(n))
        assert N[face, 0] - slack <= n <= N[face, 1] + slack
        assert T[face, 0] - slack <= t <= T[face, 1] + slack


def modes(left: float, right: float, mu: float, w: tuple[float, float]) -> set[tuple[str, str]]:
    """Contact modes of a quasi-static rigid damper, right blade moving by w: open, or closed with
    what its sliding makes of friction; enumerated, motion and forces each a linear programme.
    """
    frames, out = directions(left, right), set()
    blade = np.array([[0.0, 0.0], w])
    free, press = (None, None), (0, None)
    for pair in itertools.product(("open", "stick", "up", "down"), repeat=2):
        equal, equal_b, less, less_b = [], [], [], []
        f_equal, f_less, bounds = [], [], []
        for k, mode in enumerate(pair):
            n, u = frames[k]
            # relative velocity (v - w) . n = 0 closed, < 0 opens; . u > 0 slides up
            if mode == "open":
                less.append(n), less_b.append(blade[k] @ n - 1e-6)
                bounds += [(0, 0), (0, 0)]
                continue
            equal.append(n), equal_b.append(blade[k] @ n)
            bounds += [press, free]
            row = np.zeros(4)
            row[2 * k], row[2 * k + 1] = -mu, 1.0
            if mode == "stick":
                equal.append(u), equal_b.append(blade[k] @ u)
                flipped = row.copy()
                flipped[2 * k + 1] = -1.0
                f_less += [row, flipped]
            else:
                s = 1.0 if mode == "up" else -1.0
                less.append(-s * u), less_b.append(-s * blade[k] @ u - 1e-6)
                slides = row.copy()
                slides[2 * k] = -s * mu
                f_equal.append(slides)
        moves = linprog(
            [0.0, 0.0],
            A_ub=np.array(less) if less else None,
            b_ub=less_b or None,
            A_eq=np.array(equal) if equal else None,
            b_eq=equal_b or None,
            bounds=[free, free],
        )
        balance = np.array([frames[k][j] for k in range(2) for j in range(2)]).T
        holds = linprog(
            [0.0] * 4,
            A_ub=np.array(f_less) if f_less else None,
            b_ub=np.zeros(len(f_less)) if f_less else None,
            A_eq=np.array([*balance, *f_equal]),
            b_eq=[0.0, 1.0, *np.zeros(len(f_equal))],
            bounds=bounds,
        )
        if moves.status == 0 and holds.status == 0:
            out.add(pair)
    return out


@pytest.mark.parametrize("motion", SLIDINGS, ids=lambda m: m.name)
@pytest.mark.parametrize(
    ("left", "right", "mu"),
    [
        (45.0, 45.0, 0.6),
        (45.0, 45.0, 1.2),
        (88.0, 30.0, 0.5),
        (88.0, 30.0, 0.62),
        (70.0, 20.0, 0.5),
        (20.0, 70.0, 0.5),
        (20.0, 25.0, 0.7),
        (60.0, 60.0, 0.7),
    ],
)
def test_motions_against_enumerated_contact_modes(
    left: float, right: float, mu: float, motion: Sliding
) -> None:
    found = modes(left, right, mu, (motion.across, motion.up))
    word = {1: "up", -1: "down"}
    sliding = (word[motion.left], word[motion.right])
    lift = lifted(left, right, mu, motion)
    jammed = motion.name == "platforms approach" and bool(jams(left, right, mu))
    N = forces(left, right, motion.left * mu, motion.right * mu)
    # a jam is a motion that no bounded forces go with
    assert (not found) == jammed
    assert (sliding in found) == bool(np.isfinite(N).all())
    for face, side in enumerate(("left", "right")):
        assert (side in lift) == any(pair[face] == "open" for pair in found)
    assert not lift or min(left, right) <= math.degrees(math.atan(mu))


def test_lengths_of_sliding_keep_both_faces_touching() -> None:
    left, right = 80.0, 35.0
    frames = directions(left, right)
    for motion in SLIDINGS:
        s, t = motion.lengths(left, right)
        w = np.array([motion.across, motion.up])
        assert s * frames[0][1] == pytest.approx(w + t * frames[1][1], abs=1e-14)
        assert (np.sign(s), np.sign(t)) == (motion.left, motion.right)


def test_without_friction_one_state() -> None:
    N, T = force_limits(60.0, 30.0, 0.0)
    exact = face_forces(60.0, 30.0, 1.0, 0.0)
    assert pytest.approx(np.array([[exact.normal_left] * 2, [exact.normal_right] * 2])) == N
    assert np.abs(T).max() < 1e-15
    damper = DamperSection(FaceSection(60.0, (-5.0, 1.0), 5.0), FaceSection(30.0, (5.0, 4.0), 5.0))
    assert admissible_forces(damper, 0.0).limits == pytest.approx(np.array([N, T]), abs=1e-12)
    assert np.isnan(force_limits(90.0, 90.0, 0.0)[0]).all()


def test_little_friction_closes_the_limits_linearly() -> None:
    """The width of the limits over mu goes to a constant as mu goes to nothing."""
    widths = [np.diff(force_limits(60.0, 30.0, mu)[0])[:, 0] / mu for mu in (1e-3, 1e-6)]
    assert widths[0] == pytest.approx(widths[1], rel=2e-3)


def test_symmetric_wedge_in_closed_form() -> None:
    """N between F_C / (2 (cos a + mu sin a)) and F_C / (2 (cos a - mu sin a)); both limits of
    friction at tan 45 deg.
    """
    N, _ = force_limits(45.0, 45.0, 0.6)
    opposing, with_it = (math.sqrt(0.5) / (1.0 + 0.6 * s) for s in (1, -1))
    found = forces(45.0, 45.0, 0.6, 0.6)[0], forces(45.0, 45.0, -0.6, -0.6)[0]
    assert found == pytest.approx((opposing, with_it))
    # friction up one face and down the other unloads it further
    assert N[0, 0] < 0.9 * opposing
    assert N[0, 1] == pytest.approx(with_it)
    limits = friction_limits(45.0, 45.0)
    assert (limits.jams, limits.left_lifts, limits.right_lifts) == pytest.approx((1.0, 1.0, 1.0))


def test_upright_face_never_holds_alone() -> None:
    limits = friction_limits(90.0, 30.0)
    assert limits.right_lifts == math.inf
    assert limits.left_lifts == pytest.approx(math.tan(math.pi / 6.0))
    assert limits.jams == pytest.approx(math.tan(math.pi / 6.0))
    assert limits.lowest == min(limits.jams, limits.left_lifts)


def test_angles_out_of_range_are_refused_together() -> None:
    with pytest.raises(InputError, match=r"left face: 0 deg[^\0]*right face: 91 deg"):
        friction_limits(0.0, 91.0)


def test_a_damper_that_nothing_holds_has_no_limits() -> None:
    """Both contacts far to one side of F_C: it turns, whatever the friction."""
    off = DamperSection(FaceSection(45.0, (20.0, 0.0), 1.0), FaceSection(45.0, (30.0, 0.0), 1.0))
    found = admissible_forces(off, 0.3)
    assert not len(found.corners)
    assert np.isnan(found.limits).all()


def test_moment_share_of_forces_at_the_ends_is_one() -> None:
    damper = DamperSection(FaceSection(45.0, (-5.0, 5.0), 2.0), FaceSection(45.0, (5.0, 5.0), 2.0))
    corners = admissible_forces(damper, 5.0).corners
    shares = np.array([moment_share(damper, found) for found in corners])
    assert shares.max() <= 1.0 + 1e-9
