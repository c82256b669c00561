"""Fits of contact stiffness: made-up targets, and the two measured frequencies of a thesis.

`python benchmarks/accuracy/bench_fit.py` prints the fits of the measured ones in words.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

import upd
from upd.fitting import Fit, FitResponses, Residuals, read_parameters, read_targets
from upd.fitting.answer import interval

RIGHT, LEFT = "stiffness.thesis.right", "stiffness.thesis.left"
BOTH = f"{RIGHT}.K_N+{RIGHT}.K_T"
THREE = (f"{RIGHT}.K_N", f"{RIGHT}.K_T", f"{LEFT}.K_T")
MODES = "stuck_in_phase={} Hz{w},stuck_out_of_phase={} Hz{w}"
#: both measurements within half-widths
FAMILY = MODES.format(377.0, 440.2, w=" +- 0.5 Hz")
#: frequencies wanted, what is varied, and the factors printed for another reconstruction
MEASURED = (
    ((377.0, 440.5), (BOTH, f"{LEFT}.K_T"), (2.485, 0.070)),
    ((377.0, 439.8), (f"{RIGHT}.K_T", f"{LEFT}.K_T"), (2.80, 0.081)),
)


def _scene() -> Any:
    return upd.load_scene("asymmetric-response", {"contact.stiffness": ["thesis"]})


def _responses(scene: Any, vary: tuple[str, ...]) -> FitResponses:
    return FitResponses(scene, read_targets(MODES.format(1, 1, w="")), read_parameters(scene, vary))


def made_up(scene: Any) -> Iterator[dict[str, Any]]:
    """Targets computed from known parameters, and how near the fit comes to these."""
    for vary, factors in (
        ((f"{RIGHT}.K_T=x0.2:x10", f"{LEFT}.K_T=x0.01:x10"), (0.4, 0.07)),
        ((f"{BOTH}=x0.2:x10", f"{LEFT}.K_T=x0.01:x10"), (2.485, 0.07)),
    ):
        responses = _responses(scene, vary)
        numbers, _ = responses.at(np.log(factors))
        begin = time.perf_counter()
        responses.at(1.01 * np.log(factors))
        took = time.perf_counter() - begin
        found = upd.fit(scene, MODES.format(*(repr(float(v)) for v in numbers), w=""), vary)
        case = f"{vary[0].partition('=')[0]} x {factors[0]:g}, left K_T x {factors[1]:g}"
        yield {
            "name": "fit_error",
            "case": case,
            "value": float(np.abs(np.exp(found.answers[0]) / factors - 1.0).max()),
            "unit": "",
            "reference": 1e-6,
            "note": f"{found.status}; {found.evaluations} models",
        }
        yield {
            "name": "fit_evaluation",
            "case": case,
            "value": 1e3 * took,
            "unit": "ms",
            "note": "numbers and derivatives",
        }


def measured(scene: Any) -> Iterator[tuple[tuple[float, ...], Fit]]:
    """Fits to two measured frequencies, with the factors printed before."""
    for wanted, vary, printed in MEASURED:
        yield printed, upd.fit(scene, MODES.format(*wanted, w=""), vary)


def family(scene: Any) -> Fit:
    """Three stiffnesses from two frequencies."""
    return upd.fit(scene, FAMILY, THREE)


def members(scene: Any, fits: Sequence[Fit]) -> Iterator[dict[str, Any]]:
    """Whether the fits of two measurements are members of one family of three stiffnesses: how far
    both are from its targets, and the sets between them, the right K_N moved from the one to the
    other and both K_T fitted.
    """
    residuals = Residuals(FitResponses(scene, read_targets(FAMILY), read_parameters(scene, THREE)))
    ends = []
    for found, ((f_in, f_out), *_) in zip(fits, MEASURED, strict=True):
        paths = [path for one in found.parameters for path in one.paths]
        moved = dict(zip(paths, _logs(found), strict=True))
        ends.append(np.array([moved.get(path, 0.0) for path in THREE]))
        yield {
            "name": "family_member",
            "case": f"{f_in:g} / {f_out:g} Hz, factors "
            + ", ".join(f"{v:.4g}" for v in np.exp(ends[-1])),
            "value": float((residuals(ends[-1]) ** 2).sum()),
            "unit": "",
            "reference": 1.0,
            "note": "squares of the distances in half-widths; a member below 1",
        }
    here, worst = ends[0], 0.0
    for K_N in np.linspace(ends[0][0], ends[1][0], 17):
        begin = residuals.inside(here)
        begin[0] = K_N
        one = residuals.solve(begin, held=0)
        here, worst = one.end, max(worst, one.misfit)
    yield {
        "name": "family_between",
        "case": f"right K_N x {np.exp(ends[0][0]):.4g} to x {np.exp(ends[1][0]):.4g}",
        "value": worst,
        "unit": "",
        "reference": 1.0,
        "note": "largest misfit of 17 sets between both; at the last right K_T "
        f"x {np.exp(here[1]):.4g}, left x {np.exp(here[2]):.4g}",
    }


def _logs(found: Fit) -> list[float]:
    """ln(factor) of every input of a fit's answer."""
    pairs = zip(found.parameters, found.answers[0], strict=True)
    return [float(z) for one, z in pairs for _ in one.paths]


def run() -> Iterator[dict[str, Any]]:
    """Rows of the table."""
    scene = _scene()
    yield from made_up(scene)
    fits = []
    for (wanted, vary, _), (printed, found) in zip(MEASURED, measured(scene), strict=True):
        fits.append(found)
        case = f"{wanted[0]:g} / {wanted[1]:g} Hz"
        for k, path in enumerate(vary):
            yield {
                "name": "fitted_factor",
                "case": f"{case}, {path}",
                "value": float(np.exp(found.answers[0][k])),
                "unit": "",
                "reference": printed[k],
                "note": f"{found.status}; target: another reconstruction's",
            }
        there = _responses(scene, vary).at(np.log(printed))[0]
        for name, value, f in zip(("in", "out of"), there, wanted, strict=True):
            yield {
                "name": f"stuck, {name} phase",
                "case": f"{case}, with the other reconstruction's factors",
                "value": round(float(value), 2),
                "unit": "Hz",
                "reference": f,
            }
    yield from members(scene, fits)
    found = family(scene)
    for k, one in enumerate(found.parameters):
        low, high = np.exp(interval(found, k))
        yield {
            "name": "family_span",
            "case": f"377 / 440.2 Hz +- 0.5 Hz, {one.paths[0]}",
            "value": high / low,
            "unit": "",
            "note": f"{found.status}; factors {low:.3g} to {high:.3g}",
        }


if __name__ == "__main__":
    for _, fitted in measured(_scene()):
        print(fitted)
    print(family(_scene()))
    for line in run():
        print(line)
