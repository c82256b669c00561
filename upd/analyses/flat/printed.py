"""Printed values of a damper on its platform, under the loads they were printed of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from upd.analyses import printed
from upd.analyses.contact.scene_plan import normal_loads
from upd.reference.printed import Lookup, Printed
from upd.scene import Scene


def printed_of(scene: Scene) -> Lookup:
    """What was printed of the scene's bodies.

    Of a case with a normal load only where that is, to the newton it is printed with, a load of the
    ready scene.
    """
    look_up, ready = printed.printed_of(scene), printed.ready_scene(scene)
    if ready is None:
        return look_up
    loads = {round(load.force) for load in normal_loads(ready)}

    def under_load(name: str, case: Mapping[str, Any]) -> tuple[Printed, ...]:
        load = case.get("load")
        return look_up(name, case) if load is None or round(load) in loads else ()

    return under_load
