"""How often the estimated error bounds the true one.

Synthetic sequences of order 0.7 to 3 whose limit is known, six ladders of meshes and of samples
whose limit is a closed form or a finer level of another kind, and made-up numbers that scatter with
the place of a contact's edge, by how many neighbouring loads each level is sampled at.
"""

from __future__ import annotations

import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import upd
from upd import load_scene
from upd.analyses.contact.neighbours import PLACES
from upd.batch.studies import plan_study
from upd.hbm import contacts
from upd.hbm.fourier import analysis, harmonics, synthesis
from upd.hbm.friction import harmonic_force
from upd.reference.friction import jenkins_harmonic
from upd.vary.orders import estimate_error
from upd.vary.scatter import sampled_error

Array = NDArray[np.float64]

SEED, COUNT, WANTED = 20060, 4000, 95.0
#: places of a contact's edge that neighbouring loads move it to, in spacings from its own
SAMPLED: Mapping[str, Sequence[float]] = {
    "half a spacing each way": (-0.5, 0.5),
    "half spacings to 1 each way": (-1.0, -0.5, 0.5, 1.0),
    "the run's: half spacings to 2 each way": tuple(PLACES),
    "half spacings to 3 each way": tuple(k / 2 for k in range(-6, 7) if k),
    "quarters to 2 each way": tuple(k / 4 for k in range(-8, 9) if k),
    "whole spacings to 2 each way": (-2.0, -1.0, 1.0, 2.0),
}


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


def scattering(places: Sequence[float], seed: int = SEED, count: int = 400) -> list[float]:
    """Estimate over true error of made-up numbers of a curved contact, sampled at loads that move
    its edge to these places, in spacings from its own.

    q = F^(1/3) exp(C x^p + s x^(3/2) sin(2 pi / x + phase)) with x = h / a on three levels of h, h
    sqrt 8 and 2 h; p 1 or 2, 5 to 12 spacings in the radius of the finest, whose C x^p is up to 1 %
    either way and whose scatter up to 1 %.
    """
    g, out, sizes = np.random.default_rng(seed), [], (1.0, 2.0, 2.0**1.5)
    for _ in range(count):
        p, share, wave = float(g.choice([1.0, 2.0])), g.uniform(-0.01, 0.01), g.uniform(0.0, 0.01)
        phase, radius = g.uniform(0.0, 2.0 * np.pi), g.uniform(5.0, 12.0)
        samples = []
        for size in sizes:
            edge = radius / size + np.array([0.0, *places])
            x = radius / edge[edge >= 1.0]
            t = -3.0 * np.log(x / size)
            log_q = (
                t / 3.0 + share * x**p + wave * x**1.5 * np.sin(2.0 * np.pi * radius / x + phase)
            )
            samples.append(np.column_stack([t, np.exp(log_q)]))
        fine = float(samples[0][0, 1])
        out.append(sampled_error(sizes, samples).error / (abs(fine - 1.0) / fine))
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
    return np.array([s.point.size for s in found.solved]), values, keys


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


def flat(scene: str, held: Mapping[str, Any], levels: Sequence[int], fine: int) -> Ladder:
    """Stiffnesses against those of a finer mesh of 20-node hexahedra."""
    names = ("K_N_secant_raw", "K_Tx_initial_raw", "K_Ty_initial_raw")
    h, values, keys = _followed(scene, "mesh", levels, {**_FLAT, **held}, names)
    planned = plan_study(load_scene(scene, {**_FLAT, **held}), "mesh", (levels[-1], fine))
    settings = {**dict(planned.points[-1].overrides), "mesh.element": "hex20"}
    limits = _against(scene, {**_FLAT, **held, **settings}, keys)
    return Ladder(f"{scene}, mesh", f"hex20, {fine} divisions", h, values, limits)


def rig(levels: Sequence[int]) -> Ladder:
    """Free frequencies of 8-node hexahedra, which lock, against 27-node ones."""
    names = ("f1_free", "f3_free")
    only = {"want": ["free"], "modes.arrangements": ["symmetric"]}
    h, values, keys = _followed("rig", "mesh", levels, {**only, "mesh.element": "hex8"}, names)
    limits = _against("rig", {**only, "mesh.element": "hex27"}, keys)
    return Ladder("rig, mesh, hex8", "hex27", h, values, limits)


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
                harmonic_force(law, motion, synthesis(h, n), analysis(h, n)).force[0, 1]
                for n in samples
            ]
        )
        exact = jenkins_harmonic(amplitude, stiffness, 1.0, limit)
        for k, part in enumerate(("cosine", "sine")):
            name = f"{part}, {times:g} times first slip"
            values[name], limits[name] = found[:, k], float(exact[k])
    sizes = 1.0 / np.array(samples, float)
    return Ladder("Jenkins element, samples", "closed form", sizes, values, limits)


#: name -> maker of a ladder, so that one that fails does not take the others with it
LADDERS: Mapping[str, Callable[[], Ladder]] = {
    "hertz, hex8i": lambda: hertz("hex8i", (8, 12, 16, 20, 28, 40)),
    "hertz, hex20": lambda: hertz("hex20", (8, 12, 16, 20)),
    "symmetric": lambda: flat("symmetric", {"contact.distant.damper": "base"}, (4, 6, 8, 12), 12),
    "asymmetric": lambda: flat("asymmetric", {}, (6, 8, 12, 16), 16),
    "rig": lambda: rig((1, 2, 3)),
    "jenkins": lambda: jenkins((32, 64, 128, 256, 512)),
}


def run() -> Iterator[dict[str, Any]]:
    """Rows of the benchmark."""
    for kind, ratios in sorted(shares(synthetic()).items()):
        yield _row(f"synthetic, seed {SEED}, {kind}", ratios, "")
    every: list[float] = []
    for make in LADDERS.values():
        ladder = make()
        every += ladder.ratios()
        yield _row(ladder.what, ladder.ratios(), f"against {ladder.reference}; ")
    yield _row("six ladders", every, "")
    for places, where in SAMPLED.items():
        ratios = scattering(where)
        near = 100.0 * float(np.mean(np.array(ratios) <= 5.0))
        told = f"{len(where)} neighbouring loads a level, {near:.0f} % within five times; "
        yield _row(f"edge between nodes, {places}", ratios, told)


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
