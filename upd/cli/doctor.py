"""What this machine offers: versions, BLAS, threads, linear solver, gmsh's libraries."""

from __future__ import annotations

import os
import platform
from importlib import metadata

from upd import __version__
from upd.errors import UpdError
from upd.linalg import select
from upd.mesh import recipes

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


def examine() -> list[tuple[str, str, bool]]:
    """Rows (what, found, fine) about this installation."""
    rows = [
        ("upd", __version__, True),
        ("python", f"{platform.python_version()} on {platform.platform()}", True),
        ("processors", f"{os.cpu_count()} ({_processor()})", True),
        ("memory", f"{_memory_gb():.1f} GB", True),
    ]
    for package in _PACKAGES:
        try:
            rows.append((package, metadata.version(package), True))
        except metadata.PackageNotFoundError:
            optional = package in ("pypardiso", "mkl")
            rows.append(
                (
                    package,
                    'not installed: pip install "upd[mkl]" makes the direct solver more '
                    "than ten times faster"
                    if optional
                    else "missing",
                    optional,
                )
            )
    found = select.available()
    rows += [(name, str(value), True) for name, value in found.items()]
    try:
        rows.append(("gmsh libraries", recipes.gmsh_version(), True))
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
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as f:  # noqa: PTH123
            for line in f:
                if line.startswith("model name"):
                    return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _memory_gb() -> float:
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    except (ValueError, OSError, AttributeError):
        return float("nan")
