"""Printed values beside the numbers of a run, for every analysis alike."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from upd.reference.printed import Lookup
from upd.results import Result


def with_printed(results: Iterable[Result], printed: Lookup) -> list[Result]:
    """The results with what was printed of them.

    A result with a reference of its own gets the relative difference of the printed value from it;
    another is compared with the printed value itself, which it need not converge to.

    Parameters
    ----------
    printed
        Printed values of the scene, from `upd.reference.printed_values`.
    """
    return [_with_printed(result, printed) for result in results]


def _with_printed(result: Result, printed: Lookup) -> Result:
    found = printed(result.name, result.case.given())
    # Several values have no order that could be the run's.
    if len(found) != 1:
        return result
    if result.reference is None:
        return replace(result, reference=found[0].value, source=found[0].source, exact=False)
    return replace(result, printed_error=found[0].value / result.reference - 1.0)
