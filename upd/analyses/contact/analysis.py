"""What is asked of the contact of two bodies: its analyses, curved and flat."""

from __future__ import annotations

from functools import partial

from upd.analyses.base import Analysis
from upd.analyses.contact import charts, checks, output, results
from upd.analyses.contact.bodies import needs
from upd.analyses.contact.solve import solve_left_out
from upd.analyses.contact.varied import LADDERS, PROBLEM, coarsened

_INPUT_CHECKS = (
    "patch rim",
    "Dundurs beta",
    "slope in the contact",
)


def _analysis(name: str, headline: tuple[str, ...], *, curved: bool) -> Analysis:
    """The main numbers of a curved contact are those of its last load, of flat faces the first."""
    return Analysis(
        name=name,
        headline_names=headline,
        input_checks=_INPUT_CHECKS,
        problem=PROBLEM,
        needs=needs,
        check_solution=checks.check_solution,
        arrays=output.arrays,
        sizes=lambda solution: {"n_pairs": len(solution.model.gap)},
        write_files=output.write_files,
        charts=partial(charts.contact_charts, curved=curved),
        headline=partial(results.pick, names=headline, last=curved),
        ladders=LADDERS,
        verdict_names=() if curved else ("K_N_per_pad", "K_N_secant_raw", "approach"),
        solve_left_out=solve_left_out,
        coarsened=coarsened,
    )


#: by the names that run folders have of them
ANALYSES = {
    one.name: one
    for one in (
        _analysis("hertz", results.CURVED_HEADLINE, curved=True),
        _analysis("flat", results.FLAT_HEADLINE, curved=False),
    )
}
