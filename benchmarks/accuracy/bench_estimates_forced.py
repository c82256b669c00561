"""Estimated bounds against true errors of every reported peak of both ready responses.

The truth is the finest level that two cores reach in minutes: half of the size of all elements,
sixteen rows of contact points for seven, eleven harmonics for seven, twenty modes a blade for ten.
A name or two (``asymmetric-response``) runs these alone.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import Any

import upd

Row = dict[str, Any]
SCENES = ("asymmetric-response", "symmetric-response")
#: largest bounds wanted, in per cent
WANTED = {"frequency": 1.5, "accelerance": 10.0}
ALONE = ("want=['response']", "left_out.solve=no")
FINEST = (
    *ALONE,
    "accuracy=unknown",
    "geometry.refine=2",
    "contact.rows=16",
    "balance.harmonics=11",
    "reduction.modes=20",
)


def run(names: Sequence[str] = SCENES) -> Iterator[Row]:
    """Rows of every scene."""
    for name in names:
        own, finest = upd.run(name, overrides=ALONE), upd.run(name, overrides=FINEST)
        fine = {(one["name"], str(one["case"])): one for one in finest.summary()["results"]}
        for one in own.summary()["results"]:
            kind = one["name"].split("_")[-1]
            key = one["name"], str(one["case"])
            if kind not in WANTED or one.get("estimated_error") is None or key not in fine:
                continue
            true = abs(one["value"] / fine[key]["value"] - 1.0)
            bound = one["estimated_error"]
            yield {
                "name": f"bound_{kind}",
                "case": f"{name}, {one['case']}, {one['name']}",
                "value": 100.0 * bound,
                "unit": "%",
                "target": WANTED[kind],
                "note": f"true {100.0 * true:.2g} %: {'holds' if true <= bound else 'MISSED'}; "
                f"{one['value']:.5g}, finest {fine[key]['value']:.5g} {one['unit']}",
            }


if __name__ == "__main__":
    for row in run(sys.argv[1:] or SCENES):
        print(f"{row['value']:8.3g} % (at most {row['target']:g}) {row['case']}: {row['note']}")
