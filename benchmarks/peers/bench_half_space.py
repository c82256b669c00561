"""Hertz contact on an elastic half-space.

ContactMechanics (FFT, free boundaries), our half-space, the finite elements.

All three see the sphere's exact gap on one lattice of 25 um and no penetration; the reference
column is Hertz's closed form. ContactMechanics is used when it is installed and is no dependency of
upd.
"""

from __future__ import annotations

import importlib
import importlib.util
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses import make_plan
from upd.analyses.contact.bodies import prepare
from upd.analyses.contact.plan import NORMAL
from upd.contact import normal_contact
from upd.contact.patch import Patch, make_patch, measure
from upd.errors import UpdError
from upd.progress import Stages
from upd.reference import contact_modulus, half_space_compliance, hertz_sphere, sphere_gap
from upd.scene import load_scene

Row = dict[str, Any]
Array = NDArray[np.float64]

RADIUS, E, NU = 5.0, 200e3, 0.3
LOADS = (50.0, 200.0)
#: mm
EDGE, SPACING = 1.0, 0.025
#: quantity -> unit, factor from mm, N, MPa
QUANTITIES = {"max_pressure": ("MPa", 1.0), "radius_moment": ("um", 1e3), "approach": ("um", 1e3)}
#: relative; two solvers of one discrete problem
SAME = 1e-6
MISSING = "ContactMechanics is not installed (it is optional): pip install ContactMechanics"


@dataclass(frozen=True)
class Answer:
    """What one code says of one load: MPa, mm, mm."""

    max_pressure: float
    radius_moment: float
    approach: float


#: one answer per load, and the seconds of all together
Answers = tuple[list[Answer], float]


class PeerError(UpdError):
    """The peer's solver did not converge."""


def lattice() -> tuple[Patch, Array]:
    """The square patch as a lattice with equal cells, and the sphere's gap (n, n) in mm."""
    n = round(EDGE / SPACING) + 1
    line = SPACING * (np.arange(n) - (n - 1) / 2)
    x, y = (v.ravel() for v in np.meshgrid(line, line, indexing="ij"))
    patch = make_patch(np.column_stack([x, y]), np.full(n * n, SPACING**2), (False, False))
    return patch, sphere_gap(np.hypot(x, y), RADIUS).reshape(n, n)


def _answer(patch: Patch, force: Array, approach: float) -> Answer:
    found = measure(patch, force)
    return Answer(found.max_pressure, found.radius_moment, approach)


def ours() -> Answers:
    """Our half-space: Boussinesq's compliance of square cells, dense, and the active set."""
    patch, gap = lattice()
    begin = time.perf_counter()
    n = len(gap)
    C = 2.0 * half_space_compliance(n, n, SPACING, SPACING, E, NU)
    found = [normal_contact(C, gap.ravel(), load=load) for load in LOADS]
    seconds = time.perf_counter() - begin
    return [_answer(patch, r.force.reshape(n, n), r.approach) for r in found], seconds


def contact_mechanics() -> Answers:
    """ContactMechanics: the same cells convolved by FFT, and constrained conjugate gradients."""
    peer = importlib.import_module("ContactMechanics")
    topography = importlib.import_module("SurfaceTopography").Topography
    patch, gap = lattice()
    n = len(gap)
    size = (n * SPACING, n * SPACING)
    begin = time.perf_counter()
    surface = topography(-gap, physical_sizes=size)
    substrate = peer.FreeFFTElasticHalfSpace(
        (n, n), young=contact_modulus(E, NU, E, NU), physical_sizes=size, check_boundaries=True
    )
    system = peer.make_system(substrate=substrate, surface=surface)
    answers = []
    for load in LOADS:
        # 1e-10 mm is 1e-8 of the approach.
        found = system.minimize_proxy(external_force=load, pentol=1e-10)
        if not found.success:
            raise PeerError(f"ContactMechanics at {load:g} N: {found.message}")
        answers.append(_answer(patch, np.asarray(found.jac, float)[:n, :n], float(found.offset)))
    return answers, time.perf_counter() - begin


def finite_elements() -> Answers:
    """The shipped scene: half-sphere on a block with 25 um at the contact, quarter model."""
    plan = make_plan(load_scene("hertz", {"want": ["normal"]}))
    begin = time.perf_counter()
    model = prepare(plan, Stages())
    C = model.compliance(NORMAL)
    found = [normal_contact(C, model.gap, load=load / plan.copies) for load in LOADS]
    seconds = time.perf_counter() - begin
    return [
        _answer(model.patch, model.patch.whole(r.force, extensive=True), r.approach) for r in found
    ], seconds


def _difference(answers: list[Answer], others: list[Answer]) -> float:
    return max(
        abs(float(getattr(a, q) / getattr(b, q)) - 1.0)
        for a, b in zip(answers, others, strict=True)
        for q in QUANTITIES
    )


def run() -> list[Row]:
    """Rows of the benchmark.

    Without ContactMechanics our half-space stands alone and one row says so.
    """
    codes: dict[str, tuple[Callable[[], Answers], str]] = {
        "upd half-space": (ours, ""),
        "upd finite elements": (
            finite_elements,
            "to the held far faces of finite bodies, not to infinity",
        ),
    }
    rows: list[Row] = []
    if importlib.util.find_spec("ContactMechanics") is None:
        rows.append({"name": "contact_mechanics", "case": "skipped", "note": MISSING})
    else:
        codes = {"ContactMechanics": (contact_mechanics, ""), **codes}
    closed = [hertz_sphere(load, RADIUS, contact_modulus(E, NU, E, NU)) for load in LOADS]
    expected = [Answer(h.max_pressure, h.radius, h.approach) for h in closed]
    solved: dict[str, Answers] = {}
    for code, (solve, _) in codes.items():
        try:
            solved[code] = solve()
        except PeerError as error:
            rows.append({"name": "contact_mechanics", "case": "failed", "note": str(error)})
    for quantity, (unit, factor) in QUANTITIES.items():
        for k, load in enumerate(LOADS):
            for code, (answers, _) in solved.items():
                value, hertz = getattr(answers[k], quantity), getattr(expected[k], quantity)
                note = f"{100.0 * (value / hertz - 1.0):+.2f} % from Hertz"
                if quantity == "approach" and codes[code][1]:
                    note += "; " + codes[code][1]
                case = f"F={load:g} N, {code}"
                target = f"{factor * hertz:.5g} (Hertz)"
                row = {
                    "name": f"track_{quantity}",
                    "case": case,
                    "value": factor * value,
                    "unit": unit,
                }
                rows.append({**row, "target": target, "note": note})
    if "ContactMechanics" in solved:
        worst = _difference(solved["upd half-space"][0], solved["ContactMechanics"][0])
        case = "upd half-space against ContactMechanics"
        rows.append(
            {
                "name": "track_same_answer",
                "case": case,
                "value": worst,
                "unit": "",
                "target": SAME,
                "note": "largest of all above",
            }
        )
    for code, (_, seconds) in solved.items():
        rows.append(
            {
                "name": "time_normal_contact",
                "case": f"{len(LOADS)} loads, {code}",
                "value": seconds,
                "unit": "s",
            }
        )
    return rows


if __name__ == "__main__":
    for row in run():
        print(row)
