"""What this machine offers: versions, BLAS, threads, linear solver, gmsh's libraries."""

from __future__ import annotations

import os
import platform
from contextlib import suppress
from importlib import metadata
from pathlib import Path

from upd import __version__
from upd.errors import UpdError
from upd.linalg import select
from upd.linalg.compiled import kept_in
from upd.mesh.recipe_modules import geometry_module

_PACKAGES = (
    "numpy",
    "scipy",
    "scikit-fem",
    "gmsh",
    "meshio",
    "pyamg",
    "pypardiso",
    "mkl",
    "h5netcdf",
    "matplotlib",
)
_NO_MKL = 'not installed: pip install "upd[mkl]" makes the direct solver more than ten times faster'
_NOT_KEPT = "compiled again at every start: set NUMBA_CACHE_DIR to a folder that can be written"


def examine() -> list[tuple[str, str, bool]]:
    """Rows (what, found, fine) about this installation."""
    rows = [
        ("upd", __version__, True),
        ("python", f"{platform.python_version()} on {platform.platform()}", True),
        ("processors", f"{os.cpu_count()} ({_processor()})", True),
        ("memory", f"{_memory_gb():.1f} GB", True),
    ]
    for package in _PACKAGES:
        optional = package in ("pypardiso", "mkl")
        try:
            rows.append((package, metadata.version(package), True))
        except metadata.PackageNotFoundError:
            rows.append((package, _NO_MKL if optional else "missing", optional))
    rows += [(name, str(value), True) for name, value in select.available().items()]
    kept = kept_in("upd.linalg.smoothers")
    rows.append(("compiled functions", f"kept in {kept.parent}" if kept else _NOT_KEPT, bool(kept)))
    try:
        # loaded with its shared libraries: the error names what is missing
        gmsh = geometry_module("blocks").import_gmsh()
        rows.append(("gmsh libraries", gmsh.__version__, True))
    except UpdError as error:
        rows.append(("gmsh libraries", str(error), False))
    return rows


def machine() -> str:
    """One line about the machine, for benchmark tables."""
    return (
        f"{_processor()}, {os.cpu_count()} cores, {_memory_gb():.0f} GB, Python "
        f"{platform.python_version()}, {platform.system()}"
    )


def _processor() -> str:
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def _memory_gb() -> float:
    with suppress(ValueError, OSError, AttributeError):
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    return float("nan")
