"""Charts of a sample: how often every number came out where, beside its first-order band."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from upd.labels import unit_label
from upd.plot.chart import Area, Array, Axis, Band, Chart, Trace
from upd.plot.matplotlib import MOST_PANELS
from upd.plot.sweep_charts import SAMPLE_FIGURE
from upd.results.quantities import number_label
from upd.results.sampled import SampledNumber


def sample_charts(numbers: Sequence[SampledNumber], values: Sequence[Array]) -> list[Chart]:
    """A histogram of every number that the inputs move.

    Parameters
    ----------
    numbers
        What the sample makes of them.
    values
        (1 + n,) of each in its unit, the first with every input at its value; NaN where there is
        none.
    """
    drawn = [(one, v[1:][np.isfinite(v[1:])]) for one, v in zip(numbers, values, strict=True)]
    return [_chart(one, mine) for one, mine in drawn if len(mine) and np.ptp(mine)][:MOST_PANELS]


def _chart(one: SampledNumber, drawn: Array) -> Chart:
    """Points in bins as wide as Freedman and Diaconis or Sturges have them."""
    counts, edges = np.histogram(drawn, bins="auto")
    x, y = np.repeat(edges, 2), np.concatenate([[0], np.repeat(counts, 2), [0]]).astype(float)
    bands: list[Band] = []
    if one.nominal is not None and one.first_order is not None:
        half = abs(one.nominal) * one.first_order
        bands.append(Band("first order", "x", one.nominal - half, one.nominal + half, colour=1))
    if one.nominal is not None and one.band is not None and one.mean is not None:
        half = abs(one.nominal) * one.band
        bands.append(Band("band of the sample", "x", one.mean - half, one.mean + half, -1, True))
    nominal = []
    if one.nominal is not None:
        line = np.array([one.nominal, one.nominal]), np.array([0.0, float(counts.max())])
        nominal.append(Trace("inputs as given", *line, outline=True))
    return Chart(
        number_label(one.name),
        Axis(number_label(one.name), unit_label(one.unit)),
        Axis("points", low=0.0),
        (Trace("sampled", x, y), *nominal),
        areas=(Area("", x, np.zeros(len(x)), y),),
        bands=tuple(bands),
        case=one.case,
        figure=SAMPLE_FIGURE,
        note=one.verdict,
        size=(5.2, 3.9),
        heading="What the sample makes of every number",
    )
