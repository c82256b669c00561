"""Size and place of the wedge's contact that explain the printed K_N, K_T and 340 Hz at once.

The contact is a rectangle of squares, 34 to 12 as printed, of one size, anywhere on the slope. K_N
and K_T are those of its contact analysis with both bodies, spread evenly over it in the rig, whose
stuck in-phase mode is the 340 Hz. How well the printed numbers are known is not printed: K_N and
K_T are taken to be known to 10 %, the frequency to 1 Hz.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import upd
from upd.fitting import Fit
from upd.reference.printed import THESIS_CONTACT_STIFFNESS, THESIS_FREQUENCIES

#: half-widths of the printed numbers
STIFFNESS, FREQUENCY = "10 %", "1 Hz"
#: squares of 0.5 mm, 8 mm below the tip, to begin with
LENGTH, WIDTH, OFFSET = "6 mm", "17 mm", "5 mm"
#: two bands of the damper are held, both within the width of the contact; nothing beside it
ALONE = {"geometry.band": "4 mm", "left_out.solve": "no", "accuracy": "unknown"}
SIZE = "geometry.patch_length+geometry.patch_width=x0.8:x1.6"
PLACE = "geometry.patch_offset=2 mm:10 mm"


def fitted(progress: Any = None) -> Fit:
    """The fit."""
    printed = THESIS_CONTACT_STIFFNESS["symmetric"]
    (at,) = THESIS_FREQUENCIES["experiment_symmetric"]
    with tempfile.TemporaryDirectory() as folder:
        contact = Path(folder) / "wedge.toml"
        patch = {"geometry.patch_length": LENGTH, "geometry.patch_width": WIDTH}
        patch["geometry.patch_offset"] = OFFSET
        own = upd.load_scene("symmetric", {**patch, **ALONE})
        contact.write_text(own.text, "utf-8")
        scene = upd.load_scene(
            "symmetric-response",
            {
                **patch,
                "contact.stiffness": ["own"],
                "stiffness.own.scene": str(contact),
                "stiffness.own.bodies": "both",
                "contact.static": "frictionless",
                "left_out.solve": "no",
            },
        )
        to = (
            f"K_N={printed['K_N']:g} N/mm +- {STIFFNESS},K_T={printed['K_T']:g} N/mm +- "
            f"{STIFFNESS},stuck_in_phase={at:g} Hz +- {FREQUENCY}"
        )
        more = {} if progress is None else {"progress": progress}
        return upd.fit(scene, to, [SIZE, PLACE], starts=1, **more)


def run() -> Iterator[dict[str, Any]]:
    """Rows of the table."""
    found = fitted()
    for k, one in enumerate(found.parameters):
        half = None if found.known.error is None else float(found.known.error[k])
        for path in one.paths:
            value = found.value(path)
            told = "" if half is None else f"{value / math.exp(half):.4g} to "
            told += "" if half is None else f"{value * math.exp(half):.4g} mm, first order"
            yield {
                "name": "fit_patch",
                "case": path,
                "value": value,
                "unit": "mm",
                "note": f"{found.status}; {told}",
            }
    for i, target in enumerate(found.targets):
        yield {
            "name": "fit_patch_number",
            "case": target.name,
            "value": float(found.numbers[i]),
            "unit": target.unit,
            "reference": target.value,
            "note": f"{(found.numbers[i] - target.value) / target.scale:+.2f} half-widths",
        }


if __name__ == "__main__":
    print(fitted(lambda stage, told, seconds: print(stage, told, seconds, flush=True)))
