"""ModalSolution of a rig -> the flat list of numbers, beside the frequencies printed in the thesis."""

from __future__ import annotations

from upd.analyses.modal.solve import ModalSolution, ModeSet, Reduction, Response
from upd.reference import THESIS_FREQUENCIES
from upd.results import Result

#: (arrangement, kind) -> key and table of the thesis; the glued table is for the symmetric arrangement only
_TABLES = {
    ("symmetric", "free"): ("free_symmetric", "thesis, Table IV"),
    ("asymmetric", "free"): ("free_asymmetric", "thesis, Table IV"),
    ("symmetric", "glued"): ("glued_symmetric", "thesis, Table V"),
}


#: the numbers that matter, most important first (shell patterns)
HEADLINE = ("f?_free", "f?_glued", "f?_reduced")


def make_results(solution: ModalSolution) -> list[Result]:
    """All rows of a run."""
    rows = [row for found in solution.sets for row in _frequencies(found)]
    if solution.reductions:
        rows += _reduction_rows(solution.reductions)
    if solution.response is not None:
        rows += _response_rows(solution.response)
    return rows


def _frequencies(found: ModeSet) -> list[Result]:
    key, table = _TABLES.get((found.arrangement, found.kind), ("", ""))
    printed = THESIS_FREQUENCIES.get(key, ())
    case = f"{found.kind}, {found.arrangement}"
    rows = []
    for k, mode in enumerate(found.modes):
        reference = printed[k] if k < len(printed) else None
        rows.append(Result(f"f{k + 1}_{found.kind}", case, mode.frequency, "Hz", reference, table if reference else "", exact=False))
    return rows


def _reduction_rows(reductions: list[Reduction]) -> list[Result]:
    """Frequencies of the reduced blades against the full ones, lowest first."""
    pairs = sorted((float(full), float(f)) for r in reductions for full, f in zip(r.full, r.frequency, strict=True))
    case = "Craig-Bampton"
    rows = [Result("reduction_modes", case, float(sum(r.model.n_modes for r in reductions)), "")]
    rows += [Result("reduction_boundary", case, float(sum(r.model.n_boundary for r in reductions)), "dofs")]
    return rows + [Result(f"f{k + 1}_reduced", case, f, "Hz", full, "full model") for k, (full, f) in enumerate(pairs)]


def _response_rows(response: Response) -> list[Result]:
    case = "free, right blade"
    rows = [Result("damping", case, 100.0 * response.damping, "%")]
    if response.peak is not None:
        at, height = response.peak
        alone = response.participation / (2.0 * response.damping)
        rows += [
            Result("peak_frequency", case, at, "Hz"),
            Result("peak_accelerance", case, height, "(m/s2)/N", alone, "phi phi / (2 zeta), one mode"),
            Result("participation", case, response.participation, "1/kg"),
        ]
        if response.half_power == response.half_power:
            rows.append(Result("half_power_damping", case, 100.0 * response.half_power, "%", 100.0 * response.damping, "damping given"))
    for (part, (reduced, full)), name in zip(response.against_full.items(), ("below", "above"), strict=False):
        rows.append(Result(f"response_{name}", f"right blade, undamped, {part:g} f1", reduced, "(m/s2)/N", full, "full model, direct"))
    return rows
