"""Numbers that every contact of two bodies has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

from upd.analyses.contact.loading import LoadPath
from upd.plot.chart import Entry
from upd.results import Case, Result

UM = 1e3
_MOST, _FEWEST = 8, 5
_RAW = "_raw"


def shear_stiffness(case: Case, load: float, displacement: float, tangent: float) -> list[Result]:
    """Tangent stiffness in N/mm under a tangential load in N, and the secant where there is a
    load.
    """
    out = [Result("K_T_tangent_raw", case, tangent, "N/mm")]
    if load > 0.0:
        out.append(Result("K_T_secant_raw", case, load / displacement, "N/mm"))
    return out


def stick_area(case: Case, value: float, unit: str) -> Result:
    """Tributary area of the nodes that stick."""
    return Result("stick_area", case, value, unit, source="tributary areas of the nodes that stick")


def located_results(
    results: Sequence[Result], case: Case, resolution: float, unit: str
) -> list[Result]:
    """The numbers, those of a located edge saying so, and what the lattice leaves open of the
    area.
    """
    named = {
        "contact_area": "edge located between nodes",
        "mean_pressure": "load over the located area",
        "contact_area_nodes": "tributary areas of the nodes in contact",
    }
    return [
        *(replace(r, source=r.source or named.get(r.name, "")) for r in results),
        Result(
            "contact_area_resolution",
            case,
            resolution,
            unit,
            source="half the area of the cells that the edge crosses",
        ),
    ]


def cycle_energy(path: LoadPath, reference: float | None = None, source: str = "") -> Result:
    """Energy a cycle dissipates."""
    return Result("cycle_energy", path.case, path.slip_work, "mJ", reference, source)


def pick(results: Sequence[Entry], names: Sequence[str], *, last: bool = False) -> list[Entry]:
    """At most eight numbers, one per name of ``names`` (shell patterns) that there is, in their
    order.

    Where few are found, the same numbers with the bulk compliance of the bodies in them ("..._raw")
    fill up.

    Parameters
    ----------
    last
        Of the last case that has the number, not of the first.
    """
    order = list(reversed(results)) if last else list(results)
    found = [_first(order, name) for name in names]
    if sum(entry is not None for entry in found) < _FEWEST:
        found = [
            entry or _first(order, name + _RAW) for name, entry in zip(names, found, strict=True)
        ]
    return [entry for entry in found if entry is not None][:_MOST]


def _first(results: Sequence[Entry], name: str) -> Entry | None:
    return next((entry for entry in results if fnmatchcase(entry["name"], name)), None)
