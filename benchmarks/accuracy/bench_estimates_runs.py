"""How far the errors that runs print of their main numbers are from the true ones.

Every static and modal scene at two settings, with the estimates a run makes by default, against the
closed form or a far finer mesh. The numbers of a setting stay in estimates.csv until it is run
again; ``python benchmarks/accuracy/bench_estimates_runs.py hertz rig`` runs these scenes alone. The
figure estimates.png shows all of them, and the peaks of responses that ``estimates_forced`` left in
results/.
"""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

import upd
from upd.plot.chart import Axis, Chart, Trace
from upd.plot.matplotlib import write_sheets

PICTURE = Path(__file__).parent / "estimates.png"
POINTS = PICTURE.with_suffix(".csv")
FORCED = Path(__file__).parents[1] / "results" / "accuracy-estimates_forced.csv"
#: shares in per cent that are wanted, and how many times the true error an estimate may be
BOUNDED, NEAR, TIMES = 95.0, 66.7, 5.0
Row = dict[str, Any]
Values = Mapping[tuple[str, str], float]


@dataclass(frozen=True)
class Judged:
    """A number of a run: scene, setting, name and case, estimated and true relative error."""

    scene: str
    setting: str
    name: str
    estimated: float
    true: float

    @property
    def bounded(self) -> bool:
        """Whether the estimate is not below the true error."""
        return self.estimated >= self.true

    @property
    def near(self) -> bool:
        """Whether it is at most five times the true error."""
        return self.estimated <= TIMES * self.true


@dataclass(frozen=True)
class Setting:
    """A scene at one setting: overrides, the numbers that are judged, and where the truth is from.

    Attributes
    ----------
    truth
        Overrides of the finer run; None: the closed forms beside the numbers.
    """

    scene: str
    name: str
    overrides: Mapping[str, Any]
    numbers: tuple[str, ...]
    truth: Mapping[str, Any] | None = None


_ALONE = {"left_out.solve": "no"}
_HERTZ = (
    "max_pressure",
    "radius_moment",
    "mean_pressure",
    "approach_contact",
    "K_N_tangent",
    "K_T_initial",
    "tangential_displacement",
    "stick_radius",
    "cycle_energy",
)
_FLAT = ("K_N_*", "K_T?_*", "approach*", "law_k_*")
# Not the largest pressure, which has no limit at the edge of a flat face.
_SEATED = (
    "highest_face_N",
    "*_K_*",
    "contact_area",
    "damper_*",
    "seating_loss",
    "friction_energy",
    "moved_stiffness",
)
_WEDGE = {**_ALONE, "want": ["normal", "stiffness", "contact_law"], "loads.normal": ["155 N"]}
_PADS = {**_ALONE, "want": ["normal", "stiffness", "contact_law"], "loads.normal": ["303 N"]}
_RIG = {**_ALONE, "want": ["free", "glued"], "modes.arrangements": ["symmetric"]}


def _divisions(slope: int, along: int) -> dict[str, Any]:
    return {"geometry.divisions": slope, "geometry.divisions_long": along}


def _faces(patch: str, slope: int, along: int) -> dict[str, Any]:
    return {f"geometry.{patch}_along_slope": slope, f"geometry.{patch}_along_y": along}


# Twice the load steps; bodies and faces as fine as 12 GB take: of the wedge's bodies four times the
# elements along an edge and 64 x 24 on a face, of the pads' three times and 54 x 24 on a pad.
_SHORT = {**_ALONE, "seating.steps": 40, "seating.cycle_steps": 16, "moved.steps": 16}
_FINE_SEATED_WEDGE = {**_SHORT, **_faces("patch", 6, 16), "geometry.refine": 4}
_FINE_SEATED_PADS = {
    **_SHORT,
    **_faces("pad", 8, 18),
    "geometry.face_along_z": 3,
    "geometry.refine": 3,
}
_COARSE_SEATED_PADS = {**_ALONE, **_faces("pad", 8, 18), "geometry.face_along_z": 3}
# 20 nodes: K_N of the wedge is lower by 0.4 % than with 8 on twice the divisions.
_FINE_WEDGE = {**_WEDGE, **_divisions(12, 34), "mesh.element": "hex20"}
# Thin elements under the wires too: without them K_N of a pad is 1.8 % above its limit.
_FINE_PADS = {
    **_PADS,
    **_divisions(8, 36),
    "geometry.first_layer": 0.5,
    "geometry.bottom_layer": 1.0,
    "mesh.element": "hex20",
}
_FINE_RIG = {**_RIG, "geometry.refine": 2.0}

SETTINGS = (
    Setting("hertz", "as shipped", _ALONE, _HERTZ),
    Setting("hertz", "28 divisions", {**_ALONE, "geometry.divisions": 28}, _HERTZ),
    Setting("symmetric", "8 divisions", {**_WEDGE, **_divisions(8, 22)}, _FLAT, _FINE_WEDGE),
    Setting("symmetric", "6 divisions", {**_WEDGE, **_divisions(6, 18)}, _FLAT, _FINE_WEDGE),
    Setting("asymmetric", "8 divisions", {**_PADS, **_divisions(8, 18)}, _FLAT, _FINE_PADS),
    Setting("asymmetric", "6 divisions", {**_PADS, **_divisions(6, 14)}, _FLAT, _FINE_PADS),
    Setting("rig", "as shipped", _RIG, ("f?_free", "f?_glued"), _FINE_RIG),
    Setting("rig", "hex8i", {**_RIG, "mesh.element": "hex8i"}, ("f?_free", "f?_glued"), _FINE_RIG),
    Setting("symmetric-seated", "as shipped", _ALONE, _SEATED, _FINE_SEATED_WEDGE),
    Setting(
        "symmetric-seated",
        "16 x 6 elements a face",
        {**_ALONE, **_faces("patch", 6, 16)},
        _SEATED,
        _FINE_SEATED_WEDGE,
    ),
    Setting("asymmetric-seated", "as shipped", _ALONE, _SEATED, _FINE_SEATED_PADS),
    Setting(
        "asymmetric-seated",
        "18 x 8 elements a pad",
        _COARSE_SEATED_PADS,
        _SEATED,
        _FINE_SEATED_PADS,
    ),
)


def judged(setting: Setting, truth: Callable[[str, Mapping[str, Any]], Values]) -> Iterator[Judged]:
    """The numbers of a setting whose truth is known."""
    exact = None if setting.truth is None else truth(setting.scene, setting.truth)
    for row in upd.run(setting.scene, overrides=setting.overrides).results:
        if not any(fnmatchcase(row.name, one) for one in setting.numbers):
            continue
        if exact is None:
            true = abs(row.error) if row.error is not None and row.exact else math.nan
        else:
            fine = exact.get((row.name, row.case.label), math.nan)
            true = abs(row.value / fine - 1.0) if fine else math.nan
        if row.estimated_error is not None and math.isfinite(true):
            name = f"{row.name} {row.case.label}".rstrip()
            yield Judged(setting.scene, setting.name, name, row.estimated_error, true)


def run(scenes: Sequence[str] = ()) -> Iterator[Row]:
    """Rows of the benchmark, of some scenes or all; leaves the numbers and the figure."""
    known: dict[str, Values] = {}

    def truth(scene: str, overrides: Mapping[str, Any]) -> Values:
        key = f"{scene} {sorted(overrides.items(), key=str)}"
        if key not in known:
            found = upd.run(scene, overrides={**overrides, "accuracy": "unknown"})
            known[key] = {(r.name, r.case.label): r.value for r in found.results}
        return known[key]

    every = stored()
    for setting in SETTINGS:
        if scenes and setting.scene not in scenes:
            continue
        mine = list(judged(setting, truth))
        others = [o for o in every if (o.scene, o.setting) != (setting.scene, setting.name)]
        every = [*others, *mine]
        store(every)
        yield from rows(f"{setting.scene}, {setting.name}", mine)
    yield from rows("all", every)
    drawn = replace(chart([*every, *responses()]), figure=PICTURE.stem)
    write_sheets([drawn], PICTURE.parent)


def stored() -> list[Judged]:
    """The numbers of the last run of every setting."""
    if not POINTS.is_file():
        return []
    with POINTS.open(newline="", encoding="utf-8") as file:
        return [
            Judged(*row[:3], float(row[3]), float(row[4]))
            for k, row in enumerate(csv.reader(file))
            if k
        ]


def store(every: Iterable[Judged]) -> None:
    """Keep the numbers, a row each: fractions."""
    with POINTS.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("scene", "setting", "number", "estimated", "true"))
        for one in sorted(every, key=lambda o: (o.scene, o.setting)):
            errors = (f"{one.estimated:.4g}", f"{one.true:.4g}")
            writer.writerow((one.scene, one.setting, one.name, *errors))


def responses() -> list[Judged]:
    """Peaks of responses: their bounds, and the errors with which notes begin, in per cent."""
    if not FORCED.is_file():
        return []
    with FORCED.open(newline="", encoding="utf-8") as file:
        return [
            Judged("responses", row["case"], row["name"], said / 100.0, true / 100.0)
            for row in csv.DictReader(file)
            for said, true in [(float(row["value"]), float(row["note"].split()[1]))]
        ]


def rows(case: str, mine: list[Judged]) -> Iterator[Row]:
    """Shares of numbers that are bounded, and not overrated."""
    if not mine:
        return
    ratio = np.median([one.estimated / one.true for one in mine if one.true > 0.0])
    worst = min(mine, key=lambda one: one.estimated / one.true if one.true else math.inf)
    told = f"{len(mine)} numbers, median {ratio:.2g} times the error"
    if not worst.bounded:
        told += f"; {worst.name}: {worst.estimated:.2%} said, {worst.true:.2%} true"
    shares = (
        ("share_bounded", [one.bounded for one in mine], f">= {BOUNDED:g}", told),
        ("share_within_5_times", [one.near for one in mine], f">= {NEAR:g}", ""),
    )
    for name, holds, target, note in shares:
        yield {
            "name": name,
            "case": case,
            "value": 100.0 * float(np.mean(holds)),
            "unit": "%",
            "target": target,
            "note": note,
        }


def chart(every: list[Judged]) -> Chart:
    """Estimated over true error, a colour per scene; equality and five times it as lines.

    Errors of zero stand at the lower end.
    """
    x, y = (100.0 * np.array([getattr(o, name) for o in every]) for name in ("true", "estimated"))
    ends = decades(np.concatenate([x, y]))
    x, y = np.maximum(x, ends[0]), np.maximum(y, ends[0])
    scenes = list(dict.fromkeys(one.scene for one in every))
    of = np.array([scenes.index(one.scene) for one in every])
    points = [Trace(scene, x[of == k], y[of == k], "points", k) for k, scene in enumerate(scenes)]
    lines = [
        Trace("as estimated", ends, ends, closed=True),
        Trace("five times the true error", ends, TIMES * ends, "dashed", closed=True),
    ]
    return Chart(
        "Estimated and true errors of main numbers",
        Axis("true error", "%", log=True, low=ends[0], high=ends[1]),
        Axis("estimated error", "%", log=True, low=ends[0], high=ends[1]),
        (*lines, *points),
        columns=1,
        size=(7.0, 5.6),
    )


def decades(percent: np.ndarray[Any, np.dtype[np.float64]]) -> np.ndarray[Any, Any]:
    """Ends of whole decades that hold all values above zero."""
    logs = np.log10(percent[percent > 0.0])
    return np.asarray(10.0 ** np.array([np.floor(logs.min()), np.ceil(logs.max())]))


if __name__ == "__main__":
    for row in run(sys.argv[1:]):
        print(row, flush=True)
