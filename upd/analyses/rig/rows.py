"""Solution of a rig -> the flat list of numbers, beside the frequencies printed in the thesis."""

from __future__ import annotations

from upd.analyses.rig.solve import ModeSet, Reduction, Response, Solution
from upd.reference import THESIS_FREQUENCIES
from upd.results import Row

#: (arrangement, kind) -> key and table of the thesis; the glued table is for the symmetric arrangement only
_TABLES = {
    ("symmetric", "free"): ("free_symmetric", "thesis, Table IV"),
    ("asymmetric", "free"): ("free_asymmetric", "thesis, Table IV"),
    ("symmetric", "glued"): ("glued_symmetric", "thesis, Table V"),
}


def make_rows(solution: Solution) -> list[Row]:
    """All rows of a run."""
    rows = [row for found in solution.sets for row in _frequencies(found)]
    if solution.reductions:
        rows += _reduction_rows(solution.reductions)
    if solution.response is not None:
        rows += _response_rows(solution.response)
    return rows


def _frequencies(found: ModeSet) -> list[Row]:
    key, table = _TABLES.get((found.arrangement, found.kind), ("", ""))
    printed = THESIS_FREQUENCIES.get(key, ())
    case = f"{found.kind}, {found.arrangement}"
    rows = []
    for k, mode in enumerate(found.modes):
        reference = printed[k] if k < len(printed) else None
        rows.append(Row(f"f{k + 1}_{found.kind}", case, mode.frequency, "Hz", reference, table if reference else "", exact=False))
    return rows


def _reduction_rows(reductions: list[Reduction]) -> list[Row]:
    """Frequencies of the reduced blades against the full ones, lowest first."""
    pairs = sorted((float(full), float(f)) for r in reductions for full, f in zip(r.full, r.frequency, strict=True))
    case = "Craig-Bampton"
    rows = [Row("reduction_modes", case, float(sum(r.model.n_modes for r in reductions)), "")]
    rows += [Row("reduction_boundary", case, float(sum(r.model.n_boundary for r in reductions)), "dofs")]
    return rows + [Row(f"f{k + 1}_reduced", case, f, "Hz", full, "full model") for k, (full, f) in enumerate(pairs)]


def _response_rows(response: Response) -> list[Row]:
    case = "free, right blade"
    rows = [Row("damping", case, 100.0 * response.damping, "%")]
    if response.peak is not None:
        at, height = response.peak
        alone = response.participation / (2.0 * response.damping)
        rows += [
            Row("peak_frequency", case, at, "Hz"),
            Row("peak_accelerance", case, height, "(m/s2)/N", alone, "phi phi / (2 zeta), one mode"),
            Row("participation", case, response.participation, "1/kg"),
        ]
        if response.half_power == response.half_power:
            rows.append(Row("half_power_damping", case, 100.0 * response.half_power, "%", 100.0 * response.damping, "damping given"))
    for (part, (reduced, full)), name in zip(response.against_full.items(), ("below", "above"), strict=False):
        rows.append(Row(f"response_{name}", f"right blade, undamped, {part:g} f1", reduced, "(m/s2)/N", full, "full model, direct"))
    return rows
