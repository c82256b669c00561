"""What was printed and measured of the rig, for the numbers and pictures beside it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from upd.analyses import printed
from upd.analyses.forced.plan import ForcedPlan
from upd.reference.printed import Lookup, Printed

#: name under which measured peaks are printed: which of a run's peaks each is stands nowhere
MEASURED_PEAK = "peak_frequency"


def printed_of(plan: ForcedPlan) -> Lookup:
    """What was printed of the rig, and of the damper in it under the loads of the ready scene."""
    scene, look_up = plan.scene, printed.printed_of(plan.scene)
    ready = printed.ready_scene(scene)
    damped = ready is not None and (
        (scene.damper.centrifugal, scene.damper.density, scene.contact.friction)
        == (ready.damper.centrifugal, ready.damper.density, ready.contact.friction)
    )
    ratios = (None, *(ready.excitation.centrifugal_to_force if damped else ()))

    def under_load(name: str, case: Mapping[str, Any]) -> tuple[Printed, ...]:
        free = case.get("kind") == "free"
        same = damped and case.get("force_ratio") in ratios
        return look_up(name, case) if free or same else ()

    return under_load


def measured_peaks(plan: ForcedPlan) -> tuple[Printed, ...]:
    """Peaks in Hz measured with the damper."""
    return printed_of(plan)(MEASURED_PEAK, {})
