"""What is asked of the contact of two bodies: its analyses, curved and flat."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from upd.analyses.base import Analysis
from upd.analyses.contact import charts, checks, output, results
from upd.analyses.contact.bodies import needs
from upd.analyses.contact.solve import solve_left_out
from upd.analyses.contact.varied import LADDERS, PROBLEM, coarsened
from upd.plot.chart import Chart
from upd.results import Arrays

#: arrays, summary -> charts
Charts = Callable[[Arrays, Mapping[str, Any]], list[Chart]]
_INPUT_CHECKS = (
    "patch rim",
    "Dundurs beta",
    "slope in the contact",
)


def _analysis(name: str, headline: tuple[str, ...], make_charts: Charts, *, last: bool) -> Analysis:
    """``last``: whether the main numbers are those of the last load, not of the first."""
    return Analysis(
        name=name,
        headline_names=headline,
        input_checks=_INPUT_CHECKS,
        problem=PROBLEM,
        needs=needs,
        check_solution=checks.check_solution,
        arrays=output.arrays,
        sizes=output.sizes,
        write_files=output.write_files,
        charts=make_charts,
        headline=partial(results.pick, names=headline, last=last),
        ladders=LADDERS,
        verdict_names=() if last else ("K_N_per_pad", "K_N_secant_raw", "approach"),
        solve_left_out=solve_left_out,
        coarsened=coarsened,
    )


#: by the names that run folders have of them
ANALYSES = {
    one.name: one
    for one in (
        _analysis("hertz", results.CURVED_HEADLINE, charts.curved_charts, last=True),
        _analysis("flat", results.FLAT_HEADLINE, charts.flat_charts, last=False),
    )
}
