"""One page per run that opens anywhere.

`write_report` for a run folder, `write_comparison` for several side by side.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from upd.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["write_comparison", "write_report"]


def write_report(folder: str | Path) -> Path:
    """Write report.html into a run or sweep folder, from what lies in it; returns its path.

    Raises InputError when ``folder`` is neither or cannot be written.
    """
    # Templates, netCDF and matplotlib are slow to import: only when a page is made.
    if (Path(folder) / "sweep.json").is_file():
        from upd.report.sweep_page import write_sweep_report

        return write_sweep_report(Path(folder))
    from upd.report.run_page import write_run_report

    return write_run_report(Path(folder))


def write_comparison(folders: Sequence[str | Path], path: str | Path) -> Path:
    """Write one page that shows several runs side by side to ``path`` (.html); returns it.

    Raises InputError when a folder is no run, there are fewer than two, or the place cannot be
    written.
    """
    if any((Path(folder) / "sweep.json").is_file() for folder in folders):
        raise InputError("a comparison is of runs: give each sweep's folder by itself")
    from upd.report.run_page import write_comparison as write

    return write(folders, path)
