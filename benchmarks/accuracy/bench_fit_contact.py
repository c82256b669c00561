"""Contact parameters of both dampers from synthetic curves: recovered without noise, and within
their own stated intervals with noise.

The data of each damper are a stuck curve and one at an F_C/F_E at which points slip, complex, right
blade, of the model itself. Noise is a part of the value, independent from point to point, and not
told to the fit, which estimates it. Every repeat is begun at the answer without noise.
`python benchmarks/accuracy/bench_fit_contact.py 100 0.02` counts the symmetric damper alone, at one
F_C/F_E and noise (a quarter of an hour).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import beta

import upd
from upd.fitting import CurveTarget, FitResponses, Residuals, Targets, knowledge, read_parameters
from upd.fitting.residuals import KEPT, Start, is_bent, misfit_rises
from upd.fitting.search import search, settled
from upd.measured import MeasuredCurve

RIGHT, LEFT = "stiffness.thesis.right", "stiffness.thesis.left"
REPEATS, NOISE = 200, (0.004, 0.02)
#: accuracy asked for without noise, and probability of the intervals
EXACT, PROBABILITY = 1e-3, 0.95
SCENE: Mapping[str, Any] = {
    "contact.stiffness": ["thesis"],
    # in closed form: friction then needs no seating of the faces
    "contact.static": "frictionless",
    "balance.harmonics": 3,
    "accuracy": "unknown",
    "left_out.solve": "no",
}


@dataclass(frozen=True)
class Damper:
    """A ready response, what is fitted, and the factors that made its data."""

    scene: str
    vary: tuple[str, ...]
    factors: tuple[float, ...]
    ratio: float
    frequencies: np.ndarray


WEDGE = ("stiffness.thesis.K_N", "stiffness.thesis.K_T", "contact.friction")
DAMPERS = (
    Damper(
        "asymmetric-response",
        (f"{RIGHT}.K_N", f"{RIGHT}.K_T", f"{LEFT}.K_T", "contact.friction"),
        (1.5, 2.0, 0.1, 0.8),
        194.0,
        np.linspace(300.0, 480.0, 37),
    ),
    Damper(
        "symmetric-response",
        WEDGE,
        (0.6, 0.7, 1.2),
        194.0,
        # about both peaks: elsewhere all points stick, and nothing tells the friction
        np.linspace(370.0, 460.0, 19),
    ),
    Damper("symmetric-response", WEDGE, (0.6, 0.7, 1.2), 100.0, np.linspace(300.0, 480.0, 37)),
)


def prepared(damper: Damper) -> FitResponses:
    """The responses with data without noise."""
    scene = upd.load_scene(damper.scene, SCENE)
    f, ones = damper.frequencies, np.ones(len(damper.frequencies), complex)
    blank = [
        CurveTarget("stuck", MeasuredCurve(f, ones, state="stuck")),
        CurveTarget("damped", MeasuredCurve(f, ones, force_ratio=damper.ratio)),
    ]
    made = FitResponses(scene, Targets((), tuple(blank)), read_parameters(scene, damper.vary))
    parts = made.value(np.log(damper.factors)).reshape(2, 2, -1)
    made.targets = Targets(
        (), tuple(_valued(b, H) for b, H in zip(blank, _complex(parts), strict=True))
    )
    return made


def _complex(parts: np.ndarray) -> np.ndarray:
    return np.asarray(parts[:, 0] + 1j * parts[:, 1])


def _valued(target: CurveTarget, H: np.ndarray) -> CurveTarget:
    return CurveTarget(target.name, replace(target.curve, accelerance=H))


def with_noise(exact: Targets, noise: float, rng: np.random.Generator) -> Targets:
    """The same curves with independent errors of both parts."""
    out = []
    for one in exact.curves:
        H = one.curve.accelerance
        error = rng.standard_normal(len(H)) + 1j * rng.standard_normal(len(H))
        out.append(_valued(one, H + noise * np.abs(H) * error))
    return Targets((), tuple(out))


def binomial_interval(hits: int, of: int) -> tuple[float, float]:
    """95 % interval of a share by Clopper and Pearson (1934)."""
    low = float(beta.ppf(0.025, hits, of - hits + 1)) if hits else 0.0
    high = float(beta.ppf(0.975, hits + 1, of - hits)) if hits < of else 1.0
    return low, high


def recovered(damper: Damper, made: FitResponses) -> Iterator[dict[str, Any]]:
    """Without noise, from two starts: the scene itself and another one."""
    residuals = Residuals(made)
    found = settled(residuals, search(residuals, 2, lambda *_: None))
    for k, path in enumerate(damper.vary):
        yield {
            "name": "fit_contact_error",
            "case": f"{damper.scene}, F_C/F_E {damper.ratio:g}, {path} x {damper.factors[k]:g}, "
            "no noise",
            "value": float(abs(np.exp(found[0].end[k]) / damper.factors[k] - 1.0)),
            "unit": "",
            "reference": EXACT,
            "note": f"{made.made} models",
        }


def coverage(
    damper: Damper, made: FitResponses, noise: float, repeats: int = REPEATS
) -> Iterator[dict[str, Any]]:
    """How often the true parameters lie within the intervals: to first order, by profiles, and as a
    fit states them by default, by the profile where first order is not to be trusted.
    """
    exact, true = made.targets, np.log(damper.factors)
    rng = np.random.default_rng(17)
    inside = np.zeros((3, repeats, len(true)), bool)
    bent = np.zeros((repeats, len(true)), bool)
    half = np.zeros((repeats, len(true)))
    for i in range(repeats):
        made.targets = with_noise(exact, noise, rng)
        residuals = Residuals(made)
        best = settled(residuals, [Start(true, true, np.inf)])[0]
        known = knowledge(residuals, best.end)
        if known.error is None:
            continue
        rises = misfit_rises(residuals, known, best.end, residuals.low, residuals.high)
        bent[i], half[i] = [is_bent(one, KEPT) for one in rises], known.error
        inside[0, i] = np.abs(best.end - true) <= known.error
        inside[1, i] = [_within(residuals, best, true, k) for k in range(len(true))]
        inside[2, i] = np.where(bent[i], inside[1, i], inside[0, i])
    made.targets = exact
    for name, hit in zip(("first order", "profile", "as told"), inside, strict=True):
        for k, path in enumerate(damper.vary):
            hits = int(hit[:, k].sum())
            low, high = binomial_interval(hits, repeats)
            yield {
                "name": "fit_contact_coverage",
                "case": f"{damper.scene}, F_C/F_E {damper.ratio:g}, {path}, {100 * noise:g} % "
                f"noise, {name}",
                "value": hits / repeats,
                "unit": "",
                "reference": PROBABILITY,
                "note": f"{hits} of {repeats}; 95 % interval of the share {low:.3f} to "
                f"{high:.3f}; half-width {100 * float(np.median(half[:, k])):.2g} %; "
                f"{int(bent[:, k].sum())} by the profile where told",
            }


def _within(residuals: Residuals, best: Start, true: np.ndarray, k: int) -> bool:
    """Whether a true value lies in its profile interval: with it held and the others fitted the
    squares rise by no more than one half-width's.
    """
    begin = residuals.inside(best.end)
    begin[k] = true[k]
    return residuals.solve(begin, held=k).misfit - best.misfit <= 1.0


def run() -> Iterator[dict[str, Any]]:
    """Rows of the table."""
    for damper in DAMPERS:
        made = prepared(damper)
        yield from recovered(damper, made)
        for noise in NOISE:
            yield from coverage(damper, made, noise)


def main(names: Sequence[str]) -> None:
    """Print rows: of all, or of such as "100 0.02", F_C/F_E and noise of the symmetric damper."""
    if not names:
        for line in run():
            print(line, flush=True)
        return
    ratio, noise = map(float, names)
    damper = next(one for one in DAMPERS if one.vary == WEDGE and one.ratio == ratio)
    for line in coverage(damper, prepared(damper), noise):
        print(line, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
