"""K and M written and read back: Matrix Market, Harwell-Boeing, npz.

Files as another program writes them; damaged ones.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import hb_write
from scipy.sparse import csc_array, csr_array

from upd.errors import InputError
from upd.fem import Material, box_mesh, mass, stiffness
from upd.matrices import (
    DofMap,
    Matrices,
    checked,
    read_dof_map,
    read_matrices,
    read_matrix,
    write_dof_map,
    write_matrices,
    write_matrix,
)

STEEL = Material(200e3, 0.3)


def model():
    """K, M and the dof map of a clamped block."""
    mesh = box_mesh(np.linspace(0, 3, 4), np.linspace(0, 2, 3), [0, 1.0])
    free = np.setdiff1d(
        np.arange(3 * mesh.n_node), (3 * mesh.nodes["x0"][:, None] + np.arange(3)).ravel()
    )
    K, M = (csr_array(A[free][:, free]) for A in (stiffness(mesh, STEEL), mass(mesh, STEEL)))
    return Matrices(K, M, DofMap.of_dofs(free))


@pytest.mark.parametrize("ending", [".mtx", ".hb", ".matrix", ".npz"])
def test_every_bit_comes_back(tmp_path, ending):
    given = model()
    paths = write_matrices(tmp_path, given, ending=ending, name="block")
    assert [p.name for p in paths] == [f"block.K{ending}", f"block.M{ending}", "block.mapping"]
    found = read_matrices(*paths)
    assert (found.K != given.K).nnz == 0
    assert (found.M != given.M).nnz == 0
    np.testing.assert_array_equal(found.dofs.dofs(), given.dofs.dofs())


# The lower triangle of [[4, -1.5, 0], [-1.5, 5, -2], [0, -2, 6]] as Ansys' HBMAT lays it out: type
# RSA, one number per line, exponents with D, a right-hand side.
ANSYS = """\
Stiffness matrix from file.full                                         STIFF
            17             4             5             5             3
RSA                        3             3             5             0
(1I14)          (1I14)          (1D25.15)           (1D25.15)
F                          1             0
             1
             3
             5
             6
             1
             2
             2
             3
             3
    0.400000000000000D+01
   -0.150000000000000D+01
    0.500000000000000D+01
   -0.200000000000000D+01
    0.600000000000000D+01
    0.100000000000000D+01
    0.000000000000000D+00
    0.000000000000000D+00
"""
FULL = np.array([[4, -1.5, 0], [-1.5, 5, -2], [0, -2, 6]])


def test_symmetric_storage_as_another_program_writes_it(tmp_path):
    path = tmp_path / "file.matrix"
    path.write_text(ANSYS)
    np.testing.assert_array_equal(read_matrix(path).toarray(), FULL)
    # The other triangle, and both: they are told apart.
    upper = ANSYS.replace(
        "             3\n             5\n             6\n",
        "             2\n             4\n             6\n",
        1,
    )
    upper = upper.replace(
        "             1\n             2\n             2\n             3\n             3\n    0.4",
        "@    0.4",
    )
    upper = upper.replace(
        "@", "             1\n             1\n             2\n             2\n             3\n"
    )
    path.write_text(upper)
    np.testing.assert_array_equal(read_matrix(path).toarray(), FULL)


def test_numbers_that_touch_and_scipy_own_files(tmp_path):
    path = tmp_path / "touching.hb"
    lines = ANSYS.splitlines()
    head = lines[:5]
    head[1] = "             5             1             1             3             0"
    head[3] = "(4I3)           (5I1)           (2E12.4)"
    values = ["  4.0000E+00 -1.5000E+00", "  5.0000E+00 -2.0000E+00", "  6.0000E+00"]
    path.write_text("\n".join([*head[:4], "  1  3  5  6", "12233", *values]) + "\n")
    np.testing.assert_array_equal(read_matrix(path).toarray(), FULL)
    hb_write(tmp_path / "scipy.rua", csc_array(FULL))
    np.testing.assert_array_equal(read_matrix(tmp_path / "scipy.rua").toarray(), FULL)


def test_mapping_file_of_another_program(tmp_path):
    path = tmp_path / "file.mapping"
    path.write_text(
        "  Matrix Eqn    Node      DOF\n    2    17   UZ\n    1    17   UX\n    3    40   ROTY\n"
    )
    found = read_dof_map(path)
    np.testing.assert_array_equal(found.node, [17, 17, 40])
    np.testing.assert_array_equal(found.component, [0, 2, 4])
    assert found.find(17, "UZ") == 1
    assert found.find(40, 4) == 2
    with pytest.raises(InputError, match="rotations"):
        found.dofs()
    with pytest.raises(InputError, match="Node 17 UY"):
        found.find(17, "UY")
    again = read_dof_map(write_dof_map(tmp_path / "again.mapping", found))
    np.testing.assert_array_equal(again.component, found.component)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("RSA", "CSA", "type CSA"),
        ("RSA", "RSE", "type RSE"),
        ("(1I14)          (1I14)          (1D25.15)", "free", "formats"),
        ("             5             3\n", "             x             3\n", "cannot be read"),
        (
            "             3             3             5",
            "             3             3             6",
            "do not fit",
        ),
        ("    0.500000000000000D+01\n", "", "cannot be read"),
        ("    0.500000000000000D+01\n", "    0.5000000x0000000D+01\n", "cannot be read"),
        ("             6\n             1\n", "             6\n             9\n", "outside"),
        ("RSA", "RUA", "one triangle only"),
        ("0.400000000000000D+01", "NaN", "not finite"),
    ],
)
def test_damaged_files_are_told(tmp_path, old, new, message):
    assert old in ANSYS
    path = tmp_path / "file.matrix"
    path.write_text(ANSYS.replace(old, new, 1))
    with pytest.raises(InputError, match=message) as caught:
        read_matrix(path)
    assert "file.matrix" in str(caught.value)


def test_faults_of_names_sizes_and_maps(tmp_path):
    given = model()
    with pytest.raises(InputError, match="Matrix Market"):
        write_matrix(tmp_path / "K.txt", given.K)
    with pytest.raises(InputError, match="cannot be read"):
        read_matrix(tmp_path / "absent.mtx")
    with pytest.raises(InputError, match="cannot be written"):
        write_matrix(tmp_path / "nowhere" / "K.mtx", given.K)
    with pytest.raises(InputError, match="square"):
        write_matrix(tmp_path / "K.mtx", given.K[:3])
    with pytest.raises(InputError, match="complex"):
        write_matrix(tmp_path / "K.mtx", 1j * given.K)
    (tmp_path / "bad.mtx").write_text(
        "%%MatrixMarket matrix coordinate real symmetric\n3 3 2\n1 1\n"
    )
    (tmp_path / "bad.npz").write_bytes(b"no zip")
    for name in ("bad.mtx", "bad.npz"):
        with pytest.raises(InputError, match="cannot be read"):
            read_matrix(tmp_path / name)
    small = DofMap.of_dofs(np.arange(4))
    with pytest.raises(InputError, match=r"M is .*; the map has 4") as caught:
        write_matrices(tmp_path, Matrices(given.K, given.M[:5][:, :5], small))
    assert "Matrices" in str(caught.value)
    twice = DofMap(np.zeros_like(given.dofs.node), np.zeros_like(given.dofs.component))
    with pytest.raises(InputError, match="twice"):
        write_matrices(tmp_path, Matrices(given.K, None, twice))
    mapping = tmp_path / "bad.mapping"
    for text, message in (
        ("1 2 TEMP\n", "TEMP"),
        ("nothing\n", "no line"),
        ("1 2 UX\n3 2 UY\n", "1 to 2"),
        ("1 2 UX\n1 2 UX\n", "1 to 2"),
    ):
        mapping.write_text(text)
        with pytest.raises(InputError, match=message):
            read_dof_map(mapping)


@pytest.mark.parametrize("ending", [".mtx", ".hb"])
def test_text_files_of_windows_editors_load(ending: str, tmp_path: Path) -> None:
    matrix = csr_array(np.array([[2.0, -1.0], [-1.0, 3.0]]))
    written = write_matrix(tmp_path / f"a{ending}", matrix)
    text = written.read_bytes().replace(b"\n", b"\r\n")
    written.write_bytes(b"\xef\xbb\xbf" + text)
    assert (read_matrix(written) != matrix).nnz == 0
    map_file = write_dof_map(tmp_path / "a.mapping", DofMap.of_dofs([0, 4]))
    # Without its heading, so that the mark stands before a number.
    lines = map_file.read_bytes().split(b"\n", 1)[1].lstrip().replace(b"\n", b"\r\n")
    map_file.write_bytes(b"\xef\xbb\xbf" + lines)
    assert list(read_dof_map(map_file).dofs()) == [0, 4]


_BANNER = "%%MatrixMarket matrix coordinate real symmetric\n% from another program, 2D\n2 2 3\n"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (_BANNER + "1 1 2.0D+04\n2 1 -1.0D+04\n2 2 2.0D+04\n", "line 4 has a D exponent"),
        (
            _BANNER + "1 1 20000,0\n2 1 -10000,0\n2 2 20000,0\n",
            "line 4 has a D exponent or a comma",
        ),
        (
            "%%MatrixMarket matrix coordinate pattern symmetric\n2 2 3\n1 1\n2 1\n2 2\n",
            "places without values",
        ),
        ("1,1, 1,1, 2.0e+04\n2,1, 1,1, -1.0e+04\n2,1, 2,1, 1.0e+04\n", "banner"),
        (_BANNER.replace("2 2 3", "2147483648 2147483648 3") + "1 1 1.0\n", "do not fit"),
        (_BANNER.replace("2 2 3", "2 2 300000000000") + "1 1 1.0\n", "do not fit"),
        ("\x00\x01\x02", "cannot be read"),
        ("", "cannot be read"),
    ],
)
def test_matrix_market_files_that_would_be_another_matrix(
    text: str, says: str, tmp_path: Path
) -> None:
    """Some of these ended the process, others were read without a word."""
    path = tmp_path / "K.mtx"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="cannot be read") as caught:
        read_matrix(path)
    assert says in str(caught.value)


def test_one_triangle_of_a_matrix_is_named() -> None:
    triangle = csr_array([[2.0, -1.0], [0.0, 2.0]])
    with pytest.raises(InputError, match="K: the matrix has entries in one triangle only"):
        checked(triangle, "K")
