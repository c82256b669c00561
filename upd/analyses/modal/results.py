"""ModalSolution -> the flat list of numbers, beside the frequencies printed for the rig."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple

import numpy as np

from upd.analyses.measured import FREE, Computed, measured_results
from upd.analyses.modal.solve import ModalSolution, ModeSet, ReducedBlade, RigResponse
from upd.analyses.printed import printed_of, with_printed
from upd.dynamics import find_peaks
from upd.measured.compare import on_path
from upd.plot.chart import Entry
from upd.results import Case, Result, withheld
from upd.scene.measured import MeasuredChoice

#: the numbers that matter, most important first (shell patterns): terminal, page, notebook, tables
#: of sweeps and studies
HEADLINE = (
    "f?_free",
    "f?_glued",
    "f?_reduced",
    "peak_frequency",
    "peak_accelerance",
    "half_power_damping",
)
#: how many of each an engineer asks for first
_FEW = 2


class ResponsePeak(NamedTuple):
    """A peak of a computed response: its number from the lowest, Hz, (m/s2)/N."""

    number: int
    frequency: float
    height: float
    mode: str = ""


REDUCED = Case(name="Craig-Bampton")


def headline(results: Sequence[Entry]) -> list[Entry]:
    """Lowest frequencies of the first arrangement, free, glued and reduced, and the peak of the
    response.
    """
    first: dict[str, Entry] = {}
    for entry in results:
        first.setdefault(entry["name"], entry)
    return [
        entry
        for one in HEADLINE
        for entry in [first[name] for name in first if fnmatchcase(name, one)][:_FEW]
    ]


def make_results(solution: ModalSolution) -> list[Result]:
    """All numbers of a run."""
    results = [one for found in solution.sets for one in mode_results(solution, found)]
    if solution.reductions:
        results += _reduction_results(solution.reductions)
    if solution.response is not None:
        results += _response_results(solution.response)
        results += _beside_measured(solution, solution.response)
    return results


def mode_results(solution: ModalSolution, found: ModeSet) -> list[Result]:
    """Frequencies of one configuration, lowest first, with what was printed of them."""
    if not found.modes:
        below = solution.plan.scene.modes.below
        reason = f"no mode lies below modes.below = {below:g} Hz; raise it"
        return [withheld(f"f1_{found.kind}", found.case, "Hz", reason)]
    modes = [
        Result(f"f{k + 1}_{found.kind}", found.case, mode.frequency, "Hz", exact=False)
        for k, mode in enumerate(found.modes)
    ]
    return with_printed(modes, printed_of(solution.plan.scene))


def reduced_frequencies(reductions: Sequence[ReducedBlade]) -> list[tuple[float, float]]:
    """Frequencies in Hz of the full blades and of the reduced ones beside them, lowest first."""
    return sorted(
        (float(full), float(f))
        for r in reductions
        for full, f in zip(r.full, r.frequency, strict=True)
    )


def _reduction_results(reductions: Sequence[ReducedBlade]) -> list[Result]:
    results = [
        Result("reduction_modes", REDUCED, float(sum(r.model.n_modes for r in reductions)), "")
    ]
    results += [
        Result(
            "reduction_boundary",
            REDUCED,
            float(sum(r.model.n_boundary for r in reductions)),
            "dofs",
        )
    ]
    pairs = enumerate(reduced_frequencies(reductions))
    return results + [
        Result(f"f{k + 1}_reduced", REDUCED, f, "Hz", full, "full model") for k, (full, f) in pairs
    ]


def _response_results(response: RigResponse) -> list[Result]:
    case = Case(kind="free", blade="right")
    results = [Result("damping", case, 100.0 * response.damping, "%")]
    if response.peak is None:
        reason = (
            "the free right blade has no mode between response.start and response.stop; widen them"
        )
        results += [
            withheld("peak_frequency", case, "Hz", reason),
            withheld("peak_accelerance", case, "(m/s2)/N", reason),
        ]
    else:
        at, height = response.peak
        alone = response.participation / (2.0 * response.damping)
        results += [
            Result("peak_frequency", case, at, "Hz"),
            Result(
                "peak_accelerance", case, height, "(m/s2)/N", alone, "phi phi / (2 zeta), one mode"
            ),
            Result("participation", case, response.participation, "1/kg"),
        ]
        if response.half_power == response.half_power:
            results.append(
                Result(
                    "half_power_damping",
                    case,
                    100.0 * response.half_power,
                    "%",
                    100.0 * response.damping,
                    "damping given",
                )
            )
    for (part, (reduced, full)), name in zip(
        response.against_full.items(), ("below", "above"), strict=False
    ):
        at_part = Case(blade="right", name="undamped", part=part)
        results.append(
            Result(f"response_{name}", at_part, reduced, "(m/s2)/N", full, "full model, direct")
        )
    return results


def _beside_measured(solution: ModalSolution, response: RigResponse) -> list[Result]:
    """The measured curves beside the free and the glued response."""

    def computed(choice: MeasuredChoice) -> list[Computed]:
        curves = response.accelerance.get("free" if choice.state == FREE else "glued", {})
        H, f = curves.get(choice.blade), response.frequency
        if H is None or not H.any():
            return []
        found = find_peaks(f, np.abs(H))
        peaks = [
            ResponsePeak(k, float(at), float(height))
            for k, (at, height) in enumerate(zip(found.frequency, found.height, strict=True), 1)
        ]
        case = Case(kind=choice.state or "", blade=choice.blade)
        band = (float(f[0]), float(f[-1]))
        return [Computed(case, band, lambda at: on_path(at, f, H), peaks)]

    def missing(choice: MeasuredChoice) -> str:
        if choice.state == FREE:
            return f"the {choice.blade} blade is at rest without the damper"
        return 'the run has no response with the damper glued; add "glued" to want'

    return measured_results(solution.plan.scene.measured, computed, missing, response.damping)
