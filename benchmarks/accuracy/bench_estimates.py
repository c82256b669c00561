"""How often the estimated error bounds the true one.

Synthetic sequences of order 0.7 to 3 whose limit is known, and a ladder of samples whose limit is a
closed form.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.hbm import contacts
from upd.hbm.core.fourier import analysis, harmonics, synthesis
from upd.hbm.springs.points import march
from upd.reference.friction import jenkins_harmonic
from upd.vary.orders import estimate_error

Array = NDArray[np.float64]

SEED, COUNT, WANTED = 20060, 4000, 95.0


@dataclass(frozen=True)
class MadeUp:
    """Levels of a made-up number: sizes and values, coarse to fine, and the limit."""

    order: float
    h: Array
    values: Array
    limit: float = 1.0


def synthetic(seed: int = SEED, count: int = COUNT) -> Iterator[MadeUp]:
    """The published set.

    q = 1 +- 0.2 (h^p + D h^(p + m)), two to six levels from h = 1; p even in 0.7 to 3, D in -0.5 to
    0.5 and m in 0.5 to 2: up to half of the coarsest level's error is of another order. Ratios of
    sizes: sqrt 2, 3/2 or 2 throughout, or every one its own between 1.3 and 2. Noise of 0, 1 or 5 %
    of the finest level's error on every level.
    """
    g = np.random.default_rng(seed)
    for _ in range(count):
        p, n = g.uniform(0.7, 3.0), int(g.integers(2, 7))
        own = g.uniform(1.3, 2.0, 6)
        ratios = own if g.random() < 0.5 else np.full(6, g.choice([np.sqrt(2.0), 1.5, 2.0]))
        h = np.concatenate([[1.0], 1.0 / np.cumprod(ratios)])[:n]
        second, more = g.uniform(-0.5, 0.5), g.uniform(0.5, 2.0)
        q = 1.0 + 0.2 * g.choice([-1.0, 1.0]) * (h**p + second * h ** (p + more))
        noise = g.choice([0.0, 0.01, 0.05]) * abs(q[-1] - 1.0)
        yield MadeUp(p, h, q + noise * g.uniform(-1.0, 1.0, n))


def shares(found: Iterable[MadeUp]) -> dict[str, list[float]]:
    """Kind of sequence -> estimate over true error, one per sequence."""
    out: dict[str, list[float]] = defaultdict(list)
    for one in found:
        fine = float(one.values[-1])
        estimate = estimate_error(one.h, one.values)
        ratio = estimate.error / (abs(fine - one.limit) / abs(fine))
        out["all"].append(ratio)
        out[f"{len(one.h)} levels"].append(ratio)
        out[f"order {np.floor(one.order):.0f} to {np.floor(one.order) + 1:.0f}"].append(ratio)
    return out


def bounded(ratios: Sequence[float]) -> float:
    """Share in per cent of estimates that are not below the true error."""
    return 100.0 * float(np.mean(np.array(ratios) >= 1.0))


@dataclass(frozen=True)
class Ladder:
    """Sizes, and every number on every level with what it should be."""

    what: str
    reference: str
    h: Array
    values: Mapping[str, Array]
    limits: Mapping[str, float]

    def ratios(self) -> list[float]:
        """Estimate over true error of every number on every level that has a coarser one."""
        out = []
        for name, q in self.values.items():
            for n in range(2, len(q) + 1):
                found = estimate_error(self.h[:n], q[:n])
                true = abs(q[n - 1] - self.limits[name]) / abs(q[n - 1])
                out.append(found.error / true if true else float("inf"))
        return out


def jenkins(samples: Sequence[int]) -> Ladder:
    """First harmonic of a Jenkins element over the samples of a period; closed form."""
    limit, stiffness, h = 0.3, 0.6, harmonics((1,))
    law = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=stiffness, mu=1.0, preload=limit).law
    values, limits = {}, {}
    for times in (1.1, 2.0, 5.0, 50.0):
        amplitude = times * limit / stiffness
        motion = np.array([[[0.0, 0.0], [amplitude, 0.0]]])
        found = np.array(
            [
                (march(law, motion @ E.T, E).coefficients(analysis(h, len(E))))[0, 1]
                for E in (synthesis(h, n) for n in samples)
            ]
        )
        exact = jenkins_harmonic(amplitude, stiffness, 1.0, limit)
        for k, part in enumerate(("cosine", "sine")):
            name = f"{part}, {times:g} times first slip"
            values[name], limits[name] = found[:, k], float(exact[k])
    sizes = 1.0 / np.array(samples, float)
    return Ladder("Jenkins element, samples", "closed form", sizes, values, limits)


def run() -> Iterator[dict[str, Any]]:
    """Rows of the benchmark."""
    for kind, ratios in sorted(shares(synthetic()).items()):
        yield _row(f"synthetic, seed {SEED}, {kind}", ratios, "")
    ladder = jenkins((32, 64, 128, 256, 512))
    yield _row(ladder.what, ladder.ratios(), f"against {ladder.reference}; ")


def _row(case: str, ratios: Sequence[float], note: str) -> dict[str, Any]:
    return {
        "name": "share_bounded",
        "case": case,
        "value": bounded(ratios),
        "unit": "%",
        "target": f"{WANTED:g}",
        "note": f"{note}{len(ratios)} estimates, median {np.median(ratios):.2g} times the error",
    }


if __name__ == "__main__":
    for row in run():
        print(row, flush=True)
