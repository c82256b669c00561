"""A gmsh session, transfinite blocks in it, and the grading of their edges."""

from __future__ import annotations

import ctypes
import logging
import math
import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import ModuleType

import numpy as np
from scipy.optimize import brentq

from geometry.blocks.hexahedron import Grid, compacted, local_order, structured
from upd.errors import InputError, MeshError
from upd.mesh import FloatArray

log = logging.getLogger(__name__)

DEBIAN_PACKAGES = (
    "libglu1-mesa libgl1 libxrender1 libxcursor1 libxfixes3 libxext6 libxft2 libfontconfig1 "
    "libxinerama1 libgomp1"
)

# gmsh is one global machine per process
_lock = threading.RLock()

_OPTIONS = {
    "General.Terminal": 0,
    "Mesh.LcIntegrationPrecision": 1e-12,
    # middle nodes half-way between corners; the recipe bends them afterwards, inside the volume too
    "Mesh.SecondOrderLinear": 1,
    "Mesh.RecombineAll": 1,
    "Mesh.SecondOrderIncomplete": 0,
    "Mesh.SwitchElementTags": 0,
}


def import_gmsh() -> ModuleType:
    """The gmsh module.

    Raises
    ------
    MeshError
        Naming the missing Debian packages when its shared libraries do not load.
    """
    try:
        import gmsh
    except ImportError as problem:
        raise MeshError(f"gmsh is not installed ({problem}): pip install gmsh") from problem
    except OSError as problem:
        raise MeshError(
            f"gmsh cannot be loaded ({problem}): install its shared libraries, on Debian "
            f"apt-get install {DEBIAN_PACKAGES}"
        ) from problem
    module: ModuleType = gmsh
    return module


@contextmanager
def _broken_pipes_stay_errors() -> Iterator[None]:
    """gmsh gives SIGPIPE its default action: a closed pipe would then end the process silently,
    where Python ignores the signal and raises BrokenPipeError. Through the C API, as Python's own
    function works in the main thread only.
    """
    if not hasattr(signal, "SIGPIPE"):
        yield
        return
    get, put = ctypes.pythonapi.PyOS_getsig, ctypes.pythonapi.PyOS_setsig
    get.restype = ctypes.c_void_p
    put.restype, put.argtypes = ctypes.c_void_p, (ctypes.c_int, ctypes.c_void_p)
    action = get(int(signal.SIGPIPE))
    try:
        yield
    finally:
        put(int(signal.SIGPIPE), action)


@contextmanager
def session(name: str) -> Iterator[ModuleType]:
    """A fresh gmsh model.

    Whatever happens, gmsh is finalised (or, if the caller had it running, left as it was).

    Parameters
    ----------
    name : str
        Of the model.

    Yields
    ------
    module
        gmsh.
    """
    with _lock:
        gmsh = import_gmsh()
        running = bool(gmsh.isInitialized())
        if not running:
            # no user's ~/.gmshrc, no signal handler: Ctrl-C stays Python's, and other threads may
            # mesh
            with _broken_pipes_stay_errors():
                gmsh.initialize(argv=["upd"], readConfigFiles=False, interruptible=False)
        before = {option: gmsh.option.getNumber(option) for option in _OPTIONS}
        current = gmsh.model.getCurrent() if running else ""
        try:
            for option, value in _OPTIONS.items():
                gmsh.option.setNumber(option, value)
            gmsh.model.add(name)
            yield gmsh
        finally:
            if running:
                gmsh.model.remove()
                gmsh.model.setCurrent(current)
                for option, value in before.items():
                    gmsh.option.setNumber(option, value)
            else:
                gmsh.finalize()


def count_for(length: float, first: float, growth: float) -> int:
    """Least number of elements on a length with growing sizes.

    Parameters
    ----------
    length : float
        mm.
    first : float
        Largest size of the first element, mm.
    growth : float
        Largest ratio > 1 of an element to the one before.

    Returns
    -------
    int
    """
    return max(
        1, math.ceil(round(math.log1p(length * (growth - 1.0) / first) / math.log(growth), 9))
    )


def ratio_for(length: float, first: float, count: int) -> float:
    """Ratio r >= 1 of neighbouring sizes with first (1 + r + ... + r^(count-1)) = length.

    Parameters
    ----------
    length, first : float
        mm.
    count : int
        Number of elements.

    Returns
    -------
    float
        1 when `first` exceeds an equal share.
    """
    if count == 1 or count * first >= length:
        return 1.0

    def excess(ratio: float) -> float:
        return float(first * np.sum(ratio ** np.arange(count)) - length)

    return float(brentq(excess, 1.0, (length / first) ** (1.0 / (count - 1)), xtol=1e-14))


def graded(count: int, ratio: float) -> FloatArray:
    """Positions 0 ... 1 of count + 1 points whose distances grow by a ratio.

    Parameters
    ----------
    count : int
    ratio : float

    Returns
    -------
    (count + 1,) ndarray
    """
    sizes = ratio ** np.arange(count)
    positions: FloatArray = np.concatenate([[0.0], np.cumsum(sizes)]) / np.sum(sizes)
    return positions


class Blocks:
    """Hexahedral blocks glued at shared corners, edges and faces, all named by their corner points.

    First every corner by `point`, then every edge by `curve`, then every block by `volume`, then
    once `mesh`.

    Parameters
    ----------
    gmsh : module
        From `session`.
    """

    def __init__(self, gmsh: ModuleType) -> None:
        self._gmsh = gmsh
        self._points: dict[str, int] = {}
        self._curves: dict[tuple[str, str], tuple[int, int]] = {}
        self._surfaces: dict[frozenset[str], int] = {}
        self._volumes: dict[str, tuple[int, tuple[int, int, int]]] = {}

    def point(self, name: str, position: Sequence[float] | FloatArray) -> None:
        """Corner `name` at `position` (3,) in mm."""
        self._points[name] = self._gmsh.model.geo.addPoint(*[float(x) for x in position])

    def curve(
        self,
        start: str,
        end: str,
        count: int,
        *,
        ratio: float = 1.0,
        both: bool = False,
        centre: str | None = None,
    ) -> None:
        """Straight edge, or arc about a point, cut into elements.

        Parameters
        ----------
        start, end : str
            Corners.
        count : int
            Number of elements.
        ratio : float, default 1
            By which their sizes grow from start to end.
        both : bool, default False
            They grow from both ends to the middle, which has as many of them as one by one would
            give; sizes are a parabola of the place.
        centre : str, optional
            The point an arc goes about.
        """
        geo = self._gmsh.model.geo
        ends = self._points[start], self._points[end]
        tag = (
            geo.addLine(*ends)
            if centre is None
            else geo.addCircleArc(ends[0], self._points[centre], ends[1])
        )
        last = ratio ** ((count - 1) // 2)
        if both and last != 1.0:
            geo.mesh.setTransfiniteCurve(tag, count + 1, "Bump", 1.0 / last)
        else:
            geo.mesh.setTransfiniteCurve(tag, count + 1, "Progression", 1.0 if both else ratio)
        self._curves[start, end] = (tag, count)
        self._curves[end, start] = (-tag, count)

    def volume(self, name: str, corners: Sequence[str]) -> None:
        """Block between eight corners.

        Parameters
        ----------
        name : str
        corners : sequence of 8 str
            In VTK order (bottom ring, top ring); i runs from corner 0 to 1, j from 0 to 3, k from 0
            to 4.
        """
        rings = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
        geo = self._gmsh.model.geo
        surfaces = [self._surface([corners[a] for a in ring]) for ring in rings]
        tag = geo.addVolume([geo.addSurfaceLoop(surfaces)])
        geo.mesh.setTransfiniteVolume(tag, [self._points[corner] for corner in corners])
        i, j, k = (self._curves[corners[0], corners[a]][1] for a in (1, 3, 4))
        self._volumes[name] = (tag, (i, j, k))

    def _surface(self, ring: Sequence[str]) -> int:
        key = frozenset(ring)
        if key not in self._surfaces:
            geo = self._gmsh.model.geo
            edges = [self._curves[a, b][0] for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)]
            tag = geo.addSurfaceFilling([geo.addCurveLoop(edges)])
            geo.mesh.setTransfiniteSurface(
                tag, cornerTags=[self._points[corner] for corner in ring]
            )
            geo.mesh.setRecombine(2, tag)
            self._surfaces[key] = tag
        return self._surfaces[key]

    def mesh(self, element_nodes: int) -> tuple[FloatArray, dict[str, Grid]]:
        """Mesh all blocks.

        Parameters
        ----------
        element_nodes : {8, 20, 27}
            Nodes per hexahedron.

        Returns
        -------
        points : (n, 3) ndarray
            mm.
        grids : dict of str to Grid
            The lattice of every block.

        Raises
        ------
        MeshError
            When gmsh fails, or makes other elements than asked for.
        """
        gmsh = self._gmsh
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", int(element_nodes == 20))
        try:
            gmsh.model.geo.synchronize()
            gmsh.model.mesh.generate(3)
            if element_nodes != 8:
                gmsh.model.mesh.setOrder(2)
        except Exception as problem:  # gmsh raises nothing narrower
            raise MeshError(
                f"gmsh could not mesh the blocks {', '.join(self._volumes)}: {problem}. "
                "Change the parameters slightly"
            ) from problem
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        points = np.zeros((int(tags.max()) + 1, 3))
        points[tags] = np.asarray(coordinates).reshape(-1, 3)
        grids = {name: self._grid(name, element_nodes) for name in self._volumes}
        points, renumbered = compacted(points, grids.values())
        return points, dict(zip(grids, renumbered, strict=True))

    def _grid(self, name: str, element_nodes: int) -> Grid:
        mesh = self._gmsh.model.mesh
        volume, count = self._volumes[name]
        kind = mesh.getElementType(
            "Hexahedron", 1 if element_nodes == 8 else 2, element_nodes == 20
        )
        _, connectivity = mesh.getElementsByType(kind, volume)
        hexes = np.asarray(connectivity, dtype=np.int64).reshape(-1, element_nodes)
        types, _, _ = mesh.getElements(3, volume)
        if list(types) != [kind] or len(hexes) != math.prod(count):
            raise MeshError(
                f"block {name}: gmsh made {len(hexes)} hexahedra instead of "
                f"{math.prod(count)}. Change the parameters slightly"
            )
        local = np.asarray(mesh.getElementProperties(kind)[4]).reshape(-1, 3)
        return structured(hexes[:, local_order(local)], count)


def require(problems: Sequence[str]) -> None:
    """Raise one InputError with all errors, one per line; nothing when there are none."""
    if problems:
        raise InputError("\n".join(problems))
