"""What a convergence study of a curved contact varies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from upd.analyses.base import Plan
from upd.analyses.contact import ladders
from upd.analyses.contact.varied import CURVED_GOVERNING
from upd.vary.ladder import Ladder, even
from upd.vary.variation import Variation

#: divisions across the patch
_DIVISIONS = (12, 16, 20, 28, 40, 56)
#: in per cent: 3 % takes 7 GB on the ready sphere, 2 % 24 GB
_ACCURACIES = (40.0, 10.0, 3.0)


def _patches(plan: Plan[Any], levels: Sequence[int]) -> Iterator[Variation]:
    """The edge of the patch at constant node spacing."""
    del levels
    patch, divisions = float(plan.parameters["patch"]), int(plan.parameters["divisions"])
    for factor in (0.6, 0.8, 1.0, 1.3, 1.6):
        n = even(factor * divisions)
        edge = patch * n / divisions
        overrides = (("geometry.patch", f"{edge!r} mm"), ("geometry.divisions", n))
        yield Variation("patch", f"{edge:.3g} mm", overrides, patch / divisions)


LADDERS: Mapping[str, Ladder] = {
    **ladders.ladders(lambda plan: _DIVISIONS, CURVED_GOVERNING, _ACCURACIES),
    "patch": ladders.on_meshes(lambda plan: _DIVISIONS, _patches),
}
