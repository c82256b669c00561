"""A sample of a scene's uncertain inputs: points drawn between the limits of all of them.

A Latin hypercube: every input has one point in each of n slices of its interval, evenly drawn there
and in an order of its own.

References
----------
M. D. McKay, R. J. Beckman, W. J. Conover (1979), A comparison of three methods for selecting values
of input variables, Technometrics 21, 239-245.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from scipy.stats import qmc

from upd.batch.grid import MOST_POINTS, GridAxis, Place
from upd.batch.store import GRID
from upd.batch.table import Column
from upd.errors import InputError
from upd.results.sampled import Array, SampledNumber, sampled_number
from upd.scene import AnyScene
from upd.scene.quantities import Uncertainty
from upd.scene.toml import put_back
from upd.units import unit_inside


@dataclass(frozen=True)
class Sample:
    """Points drawn from the limits of a scene's inputs.

    Attributes
    ----------
    seed
        Of the draw.
    inputs
        Those known within limits.
    shifts
        (1 + n, n_input) half-widths from their values: zeros, then the n points drawn.
    """

    seed: int
    inputs: tuple[Uncertainty, ...]
    shifts: Array

    @property
    def count(self) -> int:
        """Points drawn."""
        return len(self.shifts) - 1

    def as_dict(self) -> dict[str, Any]:
        """What identifies the sample, for the sweep folder."""
        return {
            "count": self.count,
            "seed": self.seed,
            "inputs": {one.path: one.given for one in self.inputs},
        }


def draw_sample(scene: AnyScene, count: int, seed: int) -> Sample:
    """Draw ``count`` points from the limits of the scene's uncertain inputs.

    Raises
    ------
    InputError
        Where no input is known within limits, and for a number of points or a seed that is none.
    """
    inputs = tuple(scene.uncertain.values())
    # a plane through the numbers has a height and a slope for every input: fewer points always
    # lie on one, and tell nothing of what the first order leaves
    least, problems = len(inputs) + 2, []
    if not inputs:
        problems.append(
            f"--sample {count}: the scene knows all its inputs exactly; to fix it: write what "
            'is known of them, for example --set contact.friction="0.6 +- 0.1"'
        )
    elif not least <= count <= MOST_POINTS:
        known = "1 input" if len(inputs) == 1 else f"{len(inputs)} inputs"
        problems.append(
            f"--sample {count}: {known} known within limits need {least} points or more, at most "
            f"{MOST_POINTS}; some tens tell a band to a tenth"
        )
    if seed < 0:
        problems.append(f"--seed {seed}: give 0 or a larger whole number")
    if problems:
        raise InputError("\n".join(problems))
    drawn = qmc.LatinHypercube(len(inputs), rng=np.random.default_rng(seed)).random(count)
    return Sample(seed, inputs, np.vstack([np.zeros(len(inputs)), 2.0 * drawn - 1.0]))


def kept_seed(folder: Path) -> int:
    """The seed of the sample that the sweep folder holds; 0 where it holds none."""
    try:
        return int(json.loads((folder / GRID).read_text(encoding="utf-8"))["sample"]["seed"])
    except (OSError, ValueError, TypeError, KeyError):
        return 0


def sample_axes(sample: Sample) -> tuple[GridAxis, ...]:
    """A parameter for every input, with its values at all points in the unit inside."""
    out = []
    for one, shifts in zip(sample.inputs, sample.shifts.T, strict=True):
        unit = unit_inside(one.kind)
        numbers = tuple(float(one.value + shift * one.half_width) for shift in shifts)
        values = tuple(f"{number!r} {unit}" for number in numbers) if unit else numbers
        out.append(GridAxis(one.path, values, numbers, unit))
    return tuple(out)


def sample_places(sample: Sample) -> tuple[Place, ...]:
    """The k-th value of every input together, point by point."""
    return tuple((k,) * len(sample.inputs) for k in range(len(sample.shifts)))


def sample_texts(scene: AnyScene, sample: Sample, axes: Sequence[GridAxis]) -> list[str]:
    """The scenes of all points as TOML: first as given with its half-widths, whose run gives the
    first-order bands; then with the values drawn alone.
    """
    out = []
    for k in range(len(sample.shifts)):
        data = tomllib.loads(scene.text)
        for one, axis in zip(sample.inputs, axes, strict=True):
            data = put_back(data, one.steps, axis.values[k] if k else one.given)
        out.append(tomli_w.dumps(data))
    return out


def sampled_numbers(sample: Sample, columns: Sequence[Column]) -> tuple[SampledNumber, ...]:
    """What the sample makes of every followed number."""
    paths = [one.path for one in sample.inputs]
    return tuple(
        sampled_number(c.name, c.case, c.unit, c.values, sample.shifts, paths, c.inputs)
        for c in columns
    )
