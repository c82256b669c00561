"""One page per run that opens anywhere."""

from __future__ import annotations

from pathlib import Path

__all__ = ["write_report"]


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
