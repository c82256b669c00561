"""How often the estimated error bounds the true one.

Synthetic sequences of order 0.7 to 3 whose limit is known, and six ladders of meshes and of samples
whose limit is a closed form or a finer level of another kind.
"""

from __future__ import annotations

import tempfile
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import upd
from upd.analyses.convergence import estimate_error
from upd.reference import jenkins_harmonic

Array = NDArray[np.float64]

SEED, COUNT, WANTED = 20060, 4000, 95.0


@dataclass(frozen=True)
class Sequence_:
    """Levels of a made-up number: sizes and values, coarse to fine, and the limit."""

    order: float
    h: Array
    values: Array
    limit: float = 1.0


def synthetic(seed: int = SEED, count: int = COUNT) -> Iterator[Sequence_]:
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
        yield Sequence_(p, h, q + noise * g.uniform(-1.0, 1.0, n))


def shares(found: Iterator[Sequence_]) -> dict[str, list[float]]:
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


def _followed(
    scene: str,
    vary: str,
    levels: Sequence[int],
    overrides: Mapping[str, Any],
    names: Sequence[str],
) -> tuple[Array, dict[str, Array], list[Any]]:
    with tempfile.TemporaryDirectory() as folder:
        found = upd.study(
            scene, vary, levels=levels, overrides=overrides, out=Path(folder), workers=0
        )
    keys = [k for k in found.solved[0].values if k[0] in names]
    values = {f"{k[0]}, {k[1].label}": np.array([s.values[k] for s in found.solved]) for k in keys}
    return np.array([s.point.h for s in found.solved]), values, keys


def _against(scene: str, overrides: Mapping[str, Any], keys: Sequence[Any]) -> dict[str, float]:
    result = upd.run(scene, overrides=overrides)
    found = {(r.name, r.case): r.value for r in result.rows}
    return {f"{k[0]}, {k[1].label}": found[k] for k in keys}


_HERTZ = {"want": ["normal"], "geometry.patch": "auto", "loads.normal": ["200 N"]}
_FLAT = {"want": ["normal", "stiffness"], "loads.normal": ["100 N"]}


def hertz(element: str, levels: Sequence[int]) -> Ladder:
    """Radius and pressures against Hertz; closed form."""
    names = ("radius_moment", "max_pressure", "mean_pressure")
    overrides = {**_HERTZ, "mesh.element": element}
    h, values, keys = _followed("hertz", "mesh", levels, overrides, names)
    rows = {(r.name, r.case): r.reference for r in upd.run("hertz", overrides=_HERTZ).rows}
    limits = {f"{k[0]}, {k[1].label}": float(rows[k] or 0.0) for k in keys}
    return Ladder(f"hertz, mesh, {element}", "Hertz", h, values, limits)


def flat(scene: str, held: str, levels: Sequence[int], fine: Mapping[str, Any]) -> Ladder:
    """Stiffnesses against those of a finer mesh of 20-node hexahedra."""
    names = ("K_N_secant_raw", "K_Tx_initial_raw", "K_Ty_initial_raw")
    overrides = {**_FLAT, "contact.distant.damper": held}
    h, values, keys = _followed(scene, "mesh", levels, overrides, names)
    limits = _against(scene, {**overrides, **fine}, keys)
    return Ladder(f"{scene}, mesh", "finer mesh of hex20", h, values, limits)


def rig(levels: Sequence[int]) -> Ladder:
    """Free frequencies of hex8i against 20-node hexahedra, which have a quarter of their error."""
    names = ("f1_free", "f3_free")
    only = {"want": ["free"], "modes.arrangements": ["symmetric"]}
    h, values, keys = _followed("rig", "mesh", levels, {**only, "mesh.element": "hex8"}, names)
    limits = _against("rig", {**only, "mesh.element": "hex20"}, keys)
    return Ladder("rig, mesh, hex8", "hex20", h, values, limits)


def jenkins(samples: Sequence[int]) -> Ladder:
    """First harmonic of a Jenkins element over the samples of a period; closed form."""
    from upd.hbm.friction import march  # noqa: F401

    raise NotImplementedError


if __name__ == "__main__":
    for kind, ratios in sorted(shares(synthetic()).items()):
        print(kind, len(ratios), f"{bounded(ratios):.1f} %, median {np.median(ratios):.1f}")
