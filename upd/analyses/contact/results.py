"""Numbers that every contact of two bodies has."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase

from upd.plot.chart import Entry
from upd.results import Case, Result
from upd.results import quantities as q

#: sources of numbers of a contact whose edge is located between nodes
LOCATED = {
    q.CONTACT_AREA.name: "edge located between nodes",
    q.MEAN_PRESSURE.name: "load over the located area",
    q.CONTACT_AREA_NODES.name: "tributary areas of the nodes in contact",
}
_MOST, _FEWEST = 8, 5
_RAW = "_raw"


def shear_stiffness(case: Case, load: float, displacement: float, tangent: float) -> list[Result]:
    """Tangent stiffness in N/mm under a tangential load in N, and the secant where there is a
    load.
    """
    out = [q.K_T_TANGENT_RAW.of(tangent, case)]
    if load > 0.0:
        out.append(q.K_T_SECANT_RAW.of(load / displacement, case))
    return out


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
