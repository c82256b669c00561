"""K and M in and out: Matrix Market (.mtx), Harwell-Boeing (.hb, .matrix, ... as Ansys HBMAT writes
it), .npz; with the map of the dofs.
"""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.io import hb_write, mminfo, mmread, mmwrite
from scipy.sparse import csc_array, csr_array, diags_array, load_npz, save_npz, tril

from upd.errors import InputError
from upd.labels import Shown
from upd.mesh import IntArray

_Reader = Callable[[Path], Any]
#: of a path, a matrix and its title
_Writer = Callable[[Path, csr_array, str], object]

COMPONENTS = ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")
_HARWELL_BOEING = (".hb", ".rsa", ".rua", ".matrix", ".hbmat")
#: comments at the begin of a Matrix Market file, and numbers that scipy reads as others
_HEAD = re.compile(rb"(?:[ \t]*(?:%[^\n]*)?\n)*")
_OTHER_NUMBER = re.compile(rb"[0-9.][dD][-+0-9]|,")
_HEADER = "! Matrix Eqn      Node      DOF"


@dataclass(frozen=True, repr=False)
class DofMap(Shown):
    """What each row of the matrices is.

    Attributes
    ----------
    node : (n,) int ndarray
        Node numbers, in whatever numbering the matrices came with.
    component : (n,) int ndarray
        0 to 5 for UX, UY, UZ, ROTX, ROTY, ROTZ.
    """

    node: IntArray
    component: IntArray

    @classmethod
    def of_dofs(cls, dofs: ArrayLike) -> DofMap:
        """From numbers 3 * node + component (n,)."""
        numbers = np.asarray(dofs, dtype=np.int64)
        return cls(numbers // 3, numbers % 3)

    def dofs(self) -> IntArray:
        """3 * node + component (n,). Raises InputError for a rotation."""
        if (self.component > 2).any():
            raise InputError(
                "The map names rotations: solids have three displacements per node; leave "
                "shells and beams out."
            )
        out: IntArray = 3 * self.node + self.component
        return out

    def find(self, node: int, component: str | int) -> int:
        """Row of one node's component ("UX" or 0).

        Raises InputError when it is not there (a fixed dof, another numbering).
        """
        number = COMPONENTS.index(component) if isinstance(component, str) else component
        rows = np.flatnonzero((self.node == node) & (self.component == number))
        if len(rows) != 1:
            raise InputError(
                f"Node {node} {COMPONENTS[number]} is not in the map: it is fixed, or the "
                "nodes are numbered otherwise."
            )
        return int(rows[0])


@dataclass(frozen=True, repr=False)
class Matrices(Shown):
    """Stiffness and mass of a model.

    Attributes
    ----------
    K : (n, n) csr_array
        Symmetric, in the unit of its source, N/mm here.
    M : (n, n) csr_array or None
        Symmetric, t here.
    dofs : DofMap or None
        What each row is.
    """

    K: csr_array
    M: csr_array | None = None
    dofs: DofMap | None = None


def write_matrix(path: Path | str, A: Any, *, title: str = "upd") -> Path:
    """Write a symmetric matrix; values keep all digits.

    Parameters
    ----------
    path
        Its ending chooses Matrix Market (.mtx), .npz or Harwell-Boeing (.hb, .rsa, .rua, .matrix,
        .hbmat).
    A : (n, n) array_like or sparse array
    title
        A comment in Matrix Market files.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        For another ending, a matrix that is not square, finite and symmetric, or a folder that is
        not there.
    """
    path = Path(path)
    matrix = checked(A, str(path))
    write = _format(path)[1]
    with _readable(path, "written"):
        write(path, matrix, title)
    return path


def read_matrix(path: Path | str) -> csr_array:
    """Read a real symmetric matrix.

    Parameters
    ----------
    path
        Formats as for `write_matrix`.

    Returns
    -------
    (n, n) csr_array
        Both triangles.

    Raises
    ------
    InputError
        For a file that is not there, is damaged, or holds another kind of matrix.
    """
    path = Path(path)
    read = _format(path)[0]
    with _readable(path, "read"):
        found = read(path)
    return checked(found, str(path))


def write_matrices(
    folder: Path | str, matrices: Matrices, *, ending: str = ".mtx", name: str = "model"
) -> list[Path]:
    """Write K, M and the map of the dofs into a folder as name.K, name.M (+ ending) and
    name.mapping.

    Parameters
    ----------
    folder
        Must exist.
    matrices : Matrices
    ending
        Format of the matrices, as for `write_matrix`.
    name
        Of the model.

    Returns
    -------
    list of Path

    Raises
    ------
    InputError
        As `write_matrix` does, and when K, M and the map differ in size.
    """
    check_sizes(matrices)
    folder = Path(folder)
    paths = [
        write_matrix(folder / f"{name}.K{ending}", matrices.K, title=f"{name} stiffness, N/mm")
    ]
    if matrices.M is not None:
        paths.append(
            write_matrix(folder / f"{name}.M{ending}", matrices.M, title=f"{name} mass, t")
        )
    if matrices.dofs is not None:
        paths.append(write_dof_map(folder / f"{name}.mapping", matrices.dofs))
    return paths


def read_matrices(
    K: Path | str, M: Path | str | None = None, dofs: Path | str | None = None
) -> Matrices:
    """Read K, and M and the map of the dofs if given.

    Raises InputError as `read_matrix` does, and when they differ in size.
    """
    found = Matrices(
        read_matrix(K),
        None if M is None else read_matrix(M),
        None if dofs is None else read_dof_map(dofs),
    )
    check_sizes(found)
    return found


def write_dof_map(path: Path | str, dofs: DofMap) -> Path:
    """Write the map as text.

    Equation from 1, node, component, as Ansys writes its .mapping file.
    """
    path = Path(path)
    lines = [
        f"{i:12d}{node:12d}   {COMPONENTS[c]}"
        for i, (node, c) in enumerate(zip(dofs.node, dofs.component, strict=True), 1)
    ]
    with _readable(path, "written"):
        path.write_text("\n".join([_HEADER, *lines]) + "\n", encoding="ascii")
    return path


def read_dof_map(path: Path | str) -> DofMap:
    """Read lines of equation, node, component (UX, UY, UZ, ROTX, ROTY, ROTZ), in any order.

    Other lines are headings.

    Raises InputError for an unknown component, a missing or repeated equation, or no line at all.
    """
    path = Path(path)
    with _readable(path, "read"):
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    rows = [
        words
        for words in map(str.split, lines)
        if len(words) == 3 and words[0].isdigit() and words[1].isdigit()
    ]
    unknown = sorted({words[2] for words in rows} - set(COMPONENTS))
    if unknown or not rows:
        problem = (
            f"components {', '.join(unknown)}"
            if unknown
            else "no line with equation, node and component"
        )
        raise InputError(
            f"{path}: {problem}; give lines such as '12  345  UX' with {', '.join(COMPONENTS)}."
        )
    equation = np.array([int(words[0]) for words in rows])
    if not np.array_equal(np.sort(equation), np.arange(1, len(rows) + 1)):
        raise InputError(
            f"{path}: the equations are not 1 to {len(rows)}, each once: the file is cut "
            "or has lines twice."
        )
    order = np.argsort(equation)
    node, component = (
        np.array([int(words[1]) for words in rows]),
        np.array([COMPONENTS.index(words[2]) for words in rows]),
    )
    return DofMap(node[order], component[order])


def check_sizes(found: Matrices) -> None:
    """Raise InputError, with all that does not fit, unless K, M and the map are of one model."""
    n = found.K.shape[0]
    problems = []
    if found.M is not None and found.M.shape != (n, n):
        problems.append(
            f"M is {found.M.shape}, K is {(n, n)}: write both from one model with one set "
            "of constraints"
        )
    if found.dofs is not None and len(found.dofs.node) != n:
        problems.append(
            f"the map has {len(found.dofs.node)} dofs, K has {n}: take the map written "
            "with this matrix"
        )
    if found.dofs is not None and len(np.unique(6 * found.dofs.node + found.dofs.component)) != len(
        found.dofs.node
    ):
        problems.append("the map names a dof twice")
    if problems:
        raise InputError("Matrices: " + "; ".join(problems) + ".")


def checked(A: Any, name: str) -> csr_array:
    """The matrix as CSR, when it is square, real, finite, and symmetric to the digits a text file
    keeps.

    Parameters
    ----------
    A : (n, n) array_like or sparse array
    name
        For messages.

    Returns
    -------
    (n, n) csr_array

    Raises
    ------
    InputError
        For any other matrix.
    """
    if len(np.shape(A)) != 2 or A.shape[0] != A.shape[1] or A.shape[0] == 0:
        raise InputError(f"{name}: the matrix is {np.shape(A)}; K and M are square.")
    if np.issubdtype(A.dtype, np.complexfloating):
        raise InputError(
            f"{name}: the matrix is complex; give its real part, and its damping as zeta, half "
            "the loss factor."
        )
    matrix = csr_array(A, dtype=np.float64)
    matrix.sum_duplicates()
    matrix.sort_indices()
    if not np.isfinite(matrix.data).all():
        raise InputError(f"{name}: the matrix has entries that are not finite.")
    skew, size = abs(matrix - matrix.T), float(abs(matrix).max())
    # Ansys and others round to about eight digits at worst; what is less symmetric is not a
    # stiffness or mass.
    if float(skew.max()) > 1e-7 * size:
        i, j = (int(k) for k in np.unravel_index(skew.argmax(), skew.shape))
        rows, columns = matrix.nonzero()
        if (rows >= columns).all() or (rows <= columns).all():
            raise InputError(
                f"{name}: the matrix has entries in one triangle only; give both, for example "
                "A + A.T - diag(A), or write its file as symmetric."
            )
        raise InputError(
            f"{name}: the matrix is not symmetric, A - A' is {float(skew.max()):.2e} in "
            f"({i}, {j}), max|A| is {size:.2e}."
        )
    return csr_array(0.5 * (matrix + matrix.T)) if skew.nnz else matrix


def _write_market(path: Path, A: csr_array, title: str) -> None:
    # a file object: mmwrite adds its own ending to a name
    with path.open("wb") as file:
        mmwrite(file, A.tocoo(), comment=title, field="real", precision=17, symmetry="symmetric")


def _read_market(path: Path) -> Any:
    """A Matrix Market file, read by its name: of a file object scipy ends the process when it is
    damaged, and it reads D exponents and decimal commas as other numbers.
    """
    content = path.read_bytes()
    if content.startswith(BOM_UTF8):
        # some editors begin a file with a mark of its encoding
        with TemporaryDirectory() as folder:
            plain = Path(folder) / "plain.mtx"
            plain.write_bytes(content.removeprefix(BOM_UTF8))
            return _read_market(plain)
    rows, columns, entries, layout, field, _ = mminfo(path)
    if field == "pattern":
        raise ValueError('it is a "pattern" file: places without values')
    # an entry takes two characters, and every row of K and M has one
    least = entries if layout == "coordinate" else rows * columns // 2
    if 2 * max(least, rows, columns) > len(content) + 2:
        raise ValueError(f"{rows} x {columns} with {entries} entries do not fit in its size")
    found = _OTHER_NUMBER.search(content, _HEAD.match(content).end())  # type: ignore[union-attr]
    if found:
        line = content.count(b"\n", 0, found.start()) + 1
        raise ValueError(f"line {line} has a D exponent or a comma: write numbers as -1.5e+04")
    return mmread(path, spmatrix=False)


def _format(path: Path) -> tuple[_Reader, _Writer]:
    """What reads and writes files of an ending. Raises InputError for one that is not known."""
    ending = path.suffix.lower()
    if ending == ".mtx":
        return _read_market, _write_market
    if ending == ".npz":
        return load_npz, lambda p, A, _: save_npz(p, A)
    if ending in _HARWELL_BOEING:
        return _read_harwell_boeing, lambda p, A, _: hb_write(p, csc_array(A))
    raise InputError(
        f"{path}: matrices are .mtx (Matrix Market), .npz or Harwell-Boeing "
        f"({', '.join(_HARWELL_BOEING)})."
    )


@contextmanager
def _readable(path: Path, verb: str) -> Iterator[None]:
    """Whatever a reader or writer raises for a bad file, as an InputError that names the file."""
    try:
        yield
    except (OSError, ValueError, KeyError, IndexError, EOFError, ArithmeticError) as error:
        raise InputError(
            f"{path} cannot be {verb}: {error or type(error).__name__}. Check the path and "
            "that the file is whole."
        ) from error


# -- Harwell-Boeing --------------------------------------------------------------------------------


def _read_harwell_boeing(path: Path) -> csr_array:
    """Read a matrix, symmetric ones included, which scipy's reader refuses; a right-hand side is
    passed over.

    Ansys' HBMAT writes type RSA: the lower triangle by columns, one number per line, exponents with
    D, right-hand side at the end.

    Parameters
    ----------
    path
        Harwell-Boeing file, type RSA or RUA.

    Returns
    -------
    (m, n) csr_array
        Both triangles of a symmetric one.

    Raises
    ------
    ValueError
        For a file that is none, or a complex, pattern or elemental matrix.

    References
    ----------
    I. S. Duff, R. G. Grimes, J. G. Lewis, Users' Guide for the Harwell-Boeing Sparse Matrix
    Collection, TR/PA/92/86 (1992).
    """
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        head = [file.readline().rstrip("\r\n") for _ in range(4)]
        symmetric, (m, n, nnz), lines, widths = _header(head)
        right = lines.pop()
        # A line for the right-hand side's own format follows when there is one.
        if right > 0:
            file.readline()
        sections = [[file.readline() for _ in range(count)] for count in lines]
        rest = sum(1 for line in file if line.strip())
    if rest < right:
        raise ValueError(
            f"{rest} lines of the right-hand side are left, {right} are announced: lines are "
            "missing"
        )
    *places, values = (
        _numbers(*one) for one in zip(sections, widths, (n + 1, nnz, nnz), strict=True)
    )
    pointers, rows = (one.astype(np.int64) - 1 for one in places)
    if (
        len(pointers) != n + 1
        or len(rows) != nnz
        or len(values) != nnz
        or pointers[0] != 0
        or pointers[-1] != nnz
    ):
        raise ValueError(
            f"{len(pointers)} pointers, {len(rows)} row numbers, {len(values)} values do "
            f"not fit {nnz} entries of {(m, n)}"
        )
    if (np.diff(pointers) < 0).any() or rows.min(initial=0) < 0 or rows.max(initial=0) >= m:
        raise ValueError("pointers that fall, or row numbers outside the matrix")
    A = csc_array((values, rows, pointers), shape=(m, n))
    A.sum_duplicates()
    if symmetric:
        # Either triangle may be stored; its mirror image less the diagonal completes it.
        both = tril(A, -1).nnz and tril(A.T, -1).nnz
        if not both:
            A = csc_array(A + A.T - diags_array(A.diagonal()))
    return csr_array(A)


def _header(head: list[str]) -> tuple[bool, list[int], list[int], list[int]]:
    """Of the first four lines: whether the matrix is symmetric; its rows, columns and entries;
    lines of each section, then of the right-hand side; characters per number of each section.
    """
    counts = [int(word) for word in head[1].split()]
    words = head[2].split()
    if len(counts) < 4 or len(words) < 4 or not re.fullmatch(r"[A-Za-z]{3}", words[0]):
        raise ValueError("the header is not that of a Harwell-Boeing file")
    kind = words[0].upper()
    if kind[0] != "R" or kind[1] not in "SU" or kind[2] != "A":
        raise ValueError(
            f"type {kind}: only real, assembled, symmetric or unsymmetric ones (RSA, RUA) "
            "are stiffness or mass matrices"
        )
    formats = re.findall(r"\(([^()]*)\)", head[3])
    widths = [
        int(found.group(1))
        for one in formats[:3]
        if (found := re.search(r"[IEDFG](\d+)", one.upper()))
    ]
    if len(widths) != 3:
        raise ValueError(
            f"formats {head[3].strip()!r}: three of the kind (8I10) or (3E25.16) are expected"
        )
    return kind[1] == "S", [int(word) for word in words[1:4]], [*counts[1:], 0][:4], widths


def _numbers(lines: list[str], width: int, count: int) -> NDArray[np.float64]:
    """`count` numbers from some lines.

    Where they touch, cut at their fixed width (which some writers do not keep to otherwise).
    """
    words = "".join(lines).split()
    if len(words) != count:
        stripped = [line.rstrip() for line in lines]
        words = " ".join(
            line[k : k + width] for line in stripped for k in range(0, len(line), width)
        ).split()
    return np.array([word.replace("D", "E").replace("d", "e") for word in words], dtype=np.float64)
