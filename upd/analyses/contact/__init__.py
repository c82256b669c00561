"""The contact of two bodies: a sphere or other curved body pressed and sheared on another, Hertz's
and Mindlin's problem, and a damper's flat faces on its platform, with the contact points of a
dynamic model. Which one it is the recipe declares.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from upd.analyses.base import Analysis
from upd.analyses.contact import charts, checks, left_out, output, results
from upd.analyses.contact.bodies import needs
from upd.analyses.contact.varied import (
    FLAT_WANTED,
    PROBLEM,
    WANTED,
    coarsened,
)
from upd.plot.chart import Chart
from upd.results import Arrays
from upd.vary import errors
from upd.vary.solve import plan_with_estimates
from upd.vary.wanted import Wanted, plan_wanted

#: arrays, summary -> charts
Charts = Callable[[Arrays, Mapping[str, Any]], list[Chart]]
_INPUT_CHECKS = (
    "patch rim",
    "Dundurs beta",
    "slope in the contact",
)


def _analysis(
    name: str, wanted: Wanted, headline: tuple[str, ...], make_charts: Charts, *, last: bool
) -> Analysis:
    """``last``: whether the main numbers are those of the last load, not of the first."""
    return Analysis(
        name=name,
        headline_names=headline,
        input_checks=_INPUT_CHECKS,
        make_plan=partial(plan_wanted, wanted, partial(plan_with_estimates, PROBLEM)),
        needs=needs,
        solve=partial(left_out.solve, wanted),
        make_results=results.make_results,
        check_solution=checks.check_solution,
        arrays=output.arrays,
        sizes=output.sizes,
        write_files=output.write_files,
        charts=make_charts,
        headline=partial(results.pick, names=headline, last=last),
        estimate=partial(errors.estimate, PROBLEM),
        verdict_names=() if last else ("K_N_per_pad", "K_N_secant_raw", "approach"),
        coarsened=coarsened,
    )


#: by the names that run folders have of them
ANALYSES = {
    one.name: one
    for one in (
        _analysis("hertz", WANTED, results.CURVED_HEADLINE, charts.curved_charts, last=True),
        _analysis("flat", FLAT_WANTED, results.FLAT_HEADLINE, charts.flat_charts, last=False),
    )
}

__all__ = ["ANALYSES"]
