"""K, M and C of another finite-element code, read from files, in a forced response with friction.

Upd/scenes/examples/own_matrices.py.
"""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

from upd import hbm
from upd.errors import InputError
from upd.fem.assembly import modal_damping
from upd.matrices import Matrices, write_dof_map, write_matrices, write_matrix
from upd.own_matrices import Joint, forced_response

Array = np.ndarray[Any, np.dtype[np.float64]]

#: the script a user copies
EXAMPLE = Path(hbm.__file__).parents[1] / "scenes" / "examples" / "own_matrices.py"
_names = runpy.run_path(str(EXAMPLE))
two_blades, main = _names["two_blades"], _names["main"]
ELEMENTS, FREQUENCIES, RUBBING, TIP = (
    _names[name] for name in ("ELEMENTS", "FREQUENCIES", "RUBBING", "TIP")
)
ASKED: dict[str, Any] = _names["ASKED"]


def test_script_prints_what_the_friction_takes_off(capsys: pytest.CaptureFixture[str]) -> None:
    """Its numbers are those of the same system without files, names or maps."""
    main()
    model = two_blades()
    answer = in_memory(model, damping_of(model))
    tip = np.eye(model.K.shape[0])[2 * (ELEMENTS - 1)]
    free = 1e3 * answer.free(tip, np.linspace(FREQUENCIES[0], FREQUENCIES[-1], 2001)).max()
    frequency, peak = answer.peak(tip)
    assert (
        capsys.readouterr().out
        == f"tip: {free:.0f} um free, {1e3 * peak:.0f} um at {frequency:.1f} Hz with the "
        "damper (complete)\n"
    )


def in_memory(model: Matrices, C: Array) -> hbm.FrequencyResponse:
    """The same without files, names or maps."""
    n = model.K.shape[0]
    slide = np.zeros((1, n))
    slide[0, 14], slide[0, 2 * ELEMENTS + 14] = 1.0, -1.0
    push = np.zeros(n)
    push[2 * (ELEMENTS // 2 - 1)] = 20.0
    points = hbm.contacts(np.zeros((1, n)), slide, k_n=0.0, k_t=600.0, mu=0.4, preload=20.0)
    return hbm.frequency_response(
        hbm.System((model.M, C, model.K), points, harmonics=(1, 3)),
        harmonic_force=push,
        frequencies=FREQUENCIES,
    )


def damping_of(model: Matrices) -> Array:
    values, shapes = eigh(model.K, model.M)
    return modal_damping(model.M, shapes, np.sqrt(values) / (2 * np.pi), 0.005)


@pytest.mark.parametrize("ending", [".mtx", ".hb", ".npz"])
def test_files_give_what_the_arrays_give(ending: str, tmp_path: Path) -> None:
    model = two_blades()
    K, M, dofs = write_matrices(tmp_path, model, ending=ending, name="blades")
    C = write_matrix(tmp_path / f"blades.C{ending}", damping_of(model))
    answer = forced_response(K, M, C=C, dofs=dofs, **ASKED)
    theirs = in_memory(model, damping_of(model))
    tip = np.eye(model.K.shape[0])[2 * (ELEMENTS - 1)]
    assert answer.status == theirs.status == "complete"
    assert answer.reduced is None
    for ours, expected in (
        (answer.free("tip", FREQUENCIES), theirs.free(tip, FREQUENCIES)),
        (answer.stuck("tip", FREQUENCIES), theirs.stuck(tip, FREQUENCIES)),
        (answer.frequency, theirs.frequency),
        (answer.amplitude("tip"), theirs.amplitude(tip)),
    ):
        np.testing.assert_allclose(ours, expected, rtol=1e-12)
    # It rubs: neither free nor stuck.
    lost = answer.response.energy.max()
    assert lost > 0.0
    assert answer.peak("tip")[1] < 0.7 * answer.free("tip", np.linspace(320.0, 430.0, 2001)).max()


def test_ratio_instead_of_a_matrix() -> None:
    model = two_blades()
    a = forced_response(model.K, model.M, zeta=0.005, dofs=model.dofs, **ASKED)
    b = forced_response(model.K, model.M, C=damping_of(model), dofs=model.dofs, **ASKED)
    np.testing.assert_allclose(a.amplitude("gap"), b.amplitude("gap"), rtol=1e-9)


def test_large_matrices_are_reduced() -> None:
    """Four times finer beams need no reduction but may have one.

    Modes to three times the third harmonic keep five digits.
    """
    model = two_blades(4 * ELEMENTS)
    same = {
        "joints": [
            Joint(
                closing={},
                sliding=[{(32, "UX"): 1.0, (132, "UX"): -1.0}],
                k_t=600.0,
                mu=0.4,
                preload=20.0,
            )
        ],
        "force": {(24, "UX"): 4.0},
        "watch": {"tip": (48, "UX")},
        "frequencies": FREQUENCIES,
        "harmonics": (1, 3),
    }
    C = damping_of(model)
    whole = forced_response(model.K, model.M, C=C, dofs=model.dofs, **same)
    small = forced_response(model.K, model.M, C=C, dofs=model.dofs, modes=12, **same)
    assert whole.reduced is None
    assert small.reduced is not None
    assert small.reduced.n == 4 + 12
    assert small.peak("tip") == pytest.approx(whole.peak("tip"), rel=1e-5)
    coarse = forced_response(model.K, model.M, C=C, dofs=model.dofs, modes=2, **same)
    assert abs(coarse.peak("tip")[0] / whole.peak("tip")[0] - 1.0) > abs(
        small.peak("tip")[0] / whole.peak("tip")[0] - 1.0
    )


def two_meshes(n: int, stiff: float = 0.0) -> tuple[np.ndarray, np.ndarray, dict[str, object]]:
    """K, M and what is asked of two blades of n elements.

    `stiff` times the largest stiffness is added at the root's neighbour.
    """
    model, rows = two_blades(n), (2 * n // 3 - 1, n + 2 * n // 3 - 1, n // 2 - 1, n - 1)
    a, b, push, tip = (2 * row for row in rows)
    K = np.array(model.K.toarray() if hasattr(model.K, "toarray") else model.K)
    K[0, 0] += stiff * np.abs(K).max()
    joint = Joint(closing={}, sliding=[{a: 1.0, b: -1.0}], k_t=600.0, mu=0.4, preload=20.0)
    return (
        K,
        model.M,
        {
            "joints": [joint],
            "force": {push: 4.0},
            "watch": {"tip": tip},
            "frequencies": FREQUENCIES,
        },
    )


def test_fine_meshes_keep_their_low_modes() -> None:
    """96 elements a blade: the highest eigenvalue is 3e10 times the lowest."""
    (K, M, fine), (K2, M2, coarse) = two_meshes(96), two_meshes(48)
    answers = [
        forced_response(K, M, zeta=0.005, **fine),
        forced_response(K2, M2, zeta=0.005, **coarse),
    ]
    assert [a.reduced for a in answers] == [None, None]
    assert answers[0].peak("tip") == pytest.approx(answers[1].peak("tip"), rel=1e-3)


def test_low_modes_that_rounding_blurs_are_reduced() -> None:
    """A spring 1e6 times as stiff as all others.

    Whole matrices would lose the lowest modes in the rounding of the highest.
    """
    K, M, asked = two_meshes(96, 1e6)
    found = forced_response(K, M, zeta=0.005, **asked)
    assert found.reduced is not None
    # modes left out begin at ten times the frequency: their inertia matters by (1/10)^2
    assert found.peak("tip") == pytest.approx(
        forced_response(K, M, zeta=0.005, modes=100, **asked).peak("tip"), rel=1e-2
    )


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"zeta": None}, "give the damping once"),
        ({"C": np.eye(4 * ELEMENTS)}, "give the damping once"),
        ({"zeta": None, "C": np.eye(3)}, "C is \\(3, 3\\)"),
        ({"zeta": -0.1}, "not negative"),
        ({"M": np.eye(3)}, "M is \\(3, 3\\)"),
        ({"M": np.zeros((4 * ELEMENTS, 4 * ELEMENTS))}, "no mass"),
        ({"joints": []}, "at least one"),
        ({"joints": [Joint({}, [0]), Joint({}, [])]}, "same number"),
        ({"joints": [Joint(closing=(77, "UX"))]}, "joint: Node 77 UX is not in the map"),
        ({"joints": [Joint({}, [RUBBING], mu=-1.0)]}, "mu must be >= 0"),
        ({"joints": [Joint({}, [RUBBING], mu=0.4, preload=1.0)]}, "joint 0: k_t is missing"),
        ({"harmonics": 5}, r"range\(6\)"),
        ({"harmonics": "many"}, "no set of whole numbers"),
        ({"start": "middle"}, "zero, frictionless, static, mid"),
        ({"force": {(1, "UP"): 1.0}}, "no component 'UP'"),
        ({"force": {999: 1.0}}, "row 999 is not there"),
        ({"force": {TIP: float("nan")}}, "finite"),
        ({"force": {"tip": 1.0}}, "is not a dof"),
        ({"dofs": None}, "no map of the dofs"),
        ({"watch": {}}, "at least one motion"),
        ({"frequencies": []}, "frequencies must be"),
    ],
)
def test_faults_are_told(change: dict[str, Any], told: str) -> None:
    model = two_blades()
    given = {"K": model.K, "M": model.M, "dofs": model.dofs, "zeta": 0.005, **ASKED, **change}
    with pytest.raises(InputError, match=told):
        forced_response(**given)


def test_joint_without_friction_needs_no_tangential_stiffness() -> None:
    model = two_blades()
    given = {"K": model.K, "M": model.M, "dofs": model.dofs, "zeta": 0.005, **ASKED}
    slick, stiff = (
        forced_response(**given | {"joints": [Joint({}, [RUBBING], k_t=k_t, preload=20.0)]})
        for k_t in (None, 600.0)
    )
    for answer in (slick, stiff):
        np.testing.assert_allclose(answer.amplitude("tip"), answer.free("tip"), rtol=1e-9)
        np.testing.assert_allclose(answer.stuck("tip"), answer.free("tip"), rtol=1e-9)


def test_all_faults_at_once_and_unknown_names() -> None:
    model = two_blades()
    with pytest.raises(InputError) as caught:
        forced_response(
            model.K,
            model.M,
            zeta=0.005,
            dofs=model.dofs,
            **{**ASKED, "force": {999: 1.0}, "watch": {"a": 888}},
        )
    assert "999" in str(caught.value)
    assert "888" in str(caught.value)
    answer = forced_response(model.K, model.M, zeta=0.005, dofs=model.dofs, **ASKED)
    with pytest.raises(InputError, match="there are tip, gap"):
        answer.amplitude("top")


def test_map_file(tmp_path: Path) -> None:
    model = two_blades()
    assert model.dofs is not None
    path = write_dof_map(tmp_path / "blades.mapping", model.dofs)
    by_file, by_map = (
        forced_response(model.K, model.M, zeta=0.005, dofs=dofs, **ASKED)
        for dofs in (path, model.dofs)
    )
    np.testing.assert_array_equal(by_file.amplitude("tip"), by_map.amplitude("tip"))


def chain_with(penalty: float) -> Any:
    """A chain of four masses, its fixed end kept in K with a penalty on the diagonal."""
    k, n = 1e4, 4
    K = np.zeros((5, 5))
    K[1:, 1:] = k * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    K[0, 0], K[-1, -1] = penalty, k
    return forced_response(
        K,
        1e-3 * np.eye(5),
        C=np.diag([0.0, 0.1, 0.1, 0.1, 0.1]),
        joints=[Joint(closing={}, sliding=[4], k_t=1e3, mu=0.5, preload=1e6)],
        force={1: 1.0},
        watch={"tip": 4},
        frequencies=[150.0],
    )


@pytest.mark.parametrize("penalty", [1e8, 1e12, 1e16])
def test_fixed_dofs_on_the_diagonal_do_not_move(penalty: float) -> None:
    assert chain_with(penalty).amplitude("tip")[0] == pytest.approx(1.833e-4, rel=1e-3)


@pytest.mark.parametrize("penalty", [1e20, 1e26, 1e36])
def test_penalties_beside_which_rounding_loses_the_rest_are_refused(penalty: float) -> None:
    with pytest.raises(InputError, match="on the diagonal of 1 dofs, the first 0, a penalty"):
        chain_with(penalty)


def test_rows_of_lagrange_multipliers_are_named() -> None:
    K = np.array(
        [[2.0, -1.0, 0.0, 1.0], [-1.0, 2.0, 0.0, 0.0], [0, 0, 1.0, -1.0], [1.0, 0, -1.0, 0]]
    )
    with pytest.raises(InputError, match=r"1 rows, the first 3, have no mass .* constraints"):
        forced_response(
            K,
            np.diag([1.0, 1.0, 1.0, 0.0]),
            joints=[Joint(closing=1, sliding=[], k_n=1.0, k_t=1.0, mu=0.0)],
            force={0: 1.0},
            watch={"a": 0},
            frequencies=[0.1],
            zeta=0.01,
        )


def test_an_answer_prints_on_ten_lines() -> None:
    model = two_blades()
    many = {f"dof {k}": k for k in range(12)}
    answer = forced_response(
        model.K, model.M, zeta=0.005, dofs=model.dofs, **(ASKED | {"watch": many})
    )
    for text in (repr(answer), repr(answer.response)):
        assert len(text.splitlines()) <= 10
        assert f"{len(answer.frequency)} points" in text
    frequency, height = answer.peak("dof 0")
    assert f"dof 0: {height:.5g} mm at {frequency:.5g} Hz" in repr(answer)
    assert "and 5 more" in repr(answer)


def test_a_dof_that_friction_alone_holds_is_named_where_the_path_stops() -> None:
    def stopped_with(stiffness: float) -> str:
        return forced_response(
            np.diag([1.0, stiffness]),
            0.1 * np.eye(2),
            C=0.02 * np.eye(2),
            joints=[Joint(closing={}, sliding=[{0: 1.0, 1: -1.0}], k_t=3.0, mu=0.5, preload=1.0)],
            force={0: 0.3},
            static_force={1: 0.2},
            watch={"x": 0},
            frequencies=np.linspace(0.2, 0.8, 20),
        ).response.message

    assert "friction alone holds row 1: where its joints slip" in stopped_with(0.0)
    assert "friction alone" not in stopped_with(0.3)


def test_complex_stiffness_asks_for_a_damping_ratio() -> None:
    with pytest.raises(InputError, match="complex; give its real part, and its damping as zeta"):
        forced_response(
            [[1.0 + 0.1j]], [[1.0]], joints=[], force={}, watch={}, frequencies=[1.0], zeta=0.01
        )
