"""Which surfaces a run shows in three dimensions, and how much of them a page has room for."""

from __future__ import annotations

import logging

from upd.plot.surface import Surface, n_bytes, packed, read_surface, with_fields
from upd.plot.surface_picture import picture
from upd.report.folder import RunFolder

__all__ = ["Surface", "fitting", "packed", "picture", "run_surfaces"]

log = logging.getLogger("upd.report")


def run_surfaces(run: RunFolder) -> list[Surface]:
    """Surfaces of the run's VTU files: fields of a contact, else modes, else the bare mesh."""
    contact = [f for f in (run.path / "fields.vtu", run.path / "mesh.vtu") if f.exists()][:1]
    files = contact or sorted(
        run.path.glob("modes_*.vtu"), key=lambda f: ("glued" not in f.stem, "asymmetric" in f.stem)
    )
    out = []
    for file in files:
        try:
            out.append(
                read_surface(
                    file,
                    _names(run, file.stem),
                    file.stem.removeprefix("modes_").replace("_", ", "),
                )
            )
        except (OSError, ValueError, KeyError) as problem:
            log.warning("%s: no three-dimensional view (%s)", file.name, problem)
    return out


def _names(run: RunFolder, stem: str) -> list[str]:
    """Bodies in the order of their numbers in the file."""
    names = list(
        dict.fromkeys(key.partition(",")[0] for key in run.summary["size"].get("n_dof", {}))
    )
    if "glued" in stem:
        return [n for n in names if n not in ("left", "right")] or names
    return names


def fitting(surfaces: list[Surface], room: int) -> tuple[list[Surface], list[str]]:
    """Surfaces that fit into ``room`` bytes, with as many of their fields as fit, and what had to
    be left out, in words.
    """
    shown, left_out = [], []
    for surface in surfaces:
        n = len(surface.fields)
        while n > 0 and n_bytes(with_fields(surface, n)) > room:
            n -= 1
        part = with_fields(surface, n)
        if n_bytes(part) > room:
            left_out.append(f"{surface.label}: too large for this page")
            continue
        left_out += [f"{f.label}: too large for this page" for f in surface.fields[n:]]
        room -= n_bytes(part)
        shown.append(part)
    return shown, left_out
