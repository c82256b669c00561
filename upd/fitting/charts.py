"""Charts of a fit: how each parameter moves the targets, and the sets that fit equally well."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from upd.fitting.fitted_inputs import FittedCurve, FittedInputs
from upd.fitting.profile import Profile
from upd.fitting.tables import family_profile
from upd.plot.chart import Axis, Band, Chart, Trace

FIGURE = "fit"
_SIZE = (6.4, 4.6)
#: reach of the tangents where curves would need new blades, in ln(factor)
_REACH = 0.05


def fit_charts(found: FittedInputs) -> list[Chart]:
    """Measured curves, the family where there is one, and what each parameter does to the
    targets.

    Parameters
    ----------
    found : FittedInputs
        Of the fit.
    """
    charts: list[Chart] = []
    family = family_profile(found)
    if family is not None and len(found.parameters) > 1:
        charts.append(_family(found, family))
    charts = [_over(one, k) for k, one in enumerate(found.measured)] + charts
    if found.targets:
        charts += [_moves(found, k) for k in range(len(found.parameters))]
    return [replace(chart, figure=FIGURE, size=_SIZE) for chart in charts]


def _over(one: FittedCurve, k: int) -> Chart:
    """A measured curve and the fitted one."""
    of = one.target.curve
    blade = f"{of.blade} blade"
    return Chart(
        f"{one.target.name}: {blade}"
        + (f", {one.target.state}" if one.target.state not in one.target.name else ""),
        Axis("frequency", "Hz"),
        Axis("accelerance", "(m/s2)/N", log=True),
        traces=(
            Trace("measured", of.frequency, of.magnitude, "points", k),
            Trace("fitted", of.frequency, np.abs(one.computed), "line", k),
        ),
    )


def _axis(found: FittedInputs, k: int) -> Axis:
    one = found.parameters[k]
    # the name of a table stands once: a second line would lie on the legend
    table = one.paths[0].rpartition(".")[0] + "."
    more = (path.removeprefix(table) for path in one.paths[1:])
    return Axis(" + ".join((one.paths[0], *more)), one.unit, log=True)


def _values(found: FittedInputs, k: int, z: np.ndarray) -> np.ndarray:
    return np.asarray(found.parameters[k].values[0] * np.exp(z))


def _family(found: FittedInputs, one: Profile) -> Chart:
    k = one.parameter
    x = _values(found, k, one.z[:, k])
    others = [j for j in range(len(found.parameters)) if j != k]
    best = found.answers[0]
    return Chart(
        f"{found.source.name}: sets that fit equally well",
        _axis(found, k),
        Axis("factor of the scene's value", log=True),
        traces=(
            *(
                Trace(found.parameters[j].name, x, np.exp(one.z[:, j]), "line", colour)
                for colour, j in enumerate(others)
            ),
            *(
                Trace(
                    f"the one written, {found.parameters[j].name}",
                    _values(found, k, best[k : k + 1]),
                    np.exp(best[j : j + 1]),
                    "star",
                    colour,
                    entry="the one written",
                )
                for colour, j in enumerate(others)
            ),
        ),
        note="Along these lines no target changes by more than it is known.",
    )


def _moves(found: FittedInputs, k: int) -> Chart:
    z = float(found.answers[0][k])
    if found.curves:
        at, numbers = found.curves[k][:, 0], found.curves[k][:, 1:]
    else:
        at = z + np.array([-_REACH, _REACH])
        numbers = found.numbers + (at - z)[:, None] * found.slopes[:, k]
    x = _values(found, k, at)
    here = _values(found, k, np.array([z]))
    return Chart(
        f"What {found.parameters[k].name} does",
        _axis(found, k),
        Axis("number over its target, less 1", "%"),
        traces=tuple(
            Trace(one.name, x, 100.0 * (numbers[:, i] / one.value - 1.0), "line", i)
            for i, one in enumerate(found.targets)
        ),
        bands=(Band("fitted", "x", float(here[0]), float(here[0]), dashed=True),),
        note="" if found.curves else "To first order.",
    )
