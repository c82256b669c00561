"""Damped response of a bladed disk to an engine order: seconds per point over the sectors.

Sectors of 60 dofs with a wedge on 2 x 3 points in every gap, which slides up and down its faces,
three harmonics; the engine order grows with N so that the waves have the same phase from sector to
sector. Processor time on one thread.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from upd.hbm import (
    FrequencyResponse,
    System,
    contact_rows,
    contacts,
    nodal_diameters,
    rigid_damper,
    travelling_wave_response,
)

SIZE, POINTS, HARMONICS = 60, 3, range(4)
FREQUENCIES = np.linspace(90.0, 110.0, 41)


def response(n_sectors: int) -> FrequencyResponse:
    """N sectors under the engine order N/4."""
    rng, order = np.random.default_rng(1), n_sectors // 4
    w = 2.0 * np.pi * 100.0 * np.linspace(1.0, 40.0, SIZE)
    shapes = np.linalg.qr(rng.normal(size=(SIZE, SIZE)))[0]
    K, follows = shapes * w**2 @ shapes.T, 2e3 * np.outer(shapes[0], shapes[1])
    disk = {}
    for d in nodal_diameters(n_sectors, order, HARMONICS):
        turned = follows * np.exp(2j * np.pi * d / n_sectors)
        wave = K + turned + turned.conj().T
        wave = wave.real if 2 * d % n_sectors == 0 else wave
        disk[d] = np.eye(SIZE), 1e-5 * wave, wave
    damper = rigid_damper(0.05, [0.5] * 3, [0, 0, 0], [0, 0, 1.0], kept=(0, 2, 4))
    frames = [[[c, 0, 0.8], [-0.8, 0, c]] for c in (-0.6, 0.6) for _ in range(POINTS)]
    places = [[c, y, z] for c in (-1, 1) for y, z in ((-3, -1), (0, 0), (3, 1))]
    rows = np.zeros((2 * POINTS, 2, 2 * SIZE))
    for side in range(2):
        part = slice(side * POINTS, (side + 1) * POINTS)
        motion = rng.normal(size=(3, SIZE)) / SIZE**0.5
        rows[part, :, side * SIZE : (side + 1) * SIZE] = -np.array(frames)[part] @ motion
    points = contacts(rows[:, 0], np.swapaxes(rows[:, 1:], 0, 1), k_n=4e4, k_t=3e4, mu=0.3)
    return travelling_wave_response(
        System(
            disk,
            points,
            harmonics=HARMONICS,
            damper=damper,
            damper_rows=contact_rows(damper, places, frames),
            start="frictionless",
        ),
        n_sectors=n_sectors,
        engine_order=order,
        harmonic_force=0.2 * rng.normal(size=SIZE),
        frequencies=FREQUENCIES,
    )


def run() -> Iterator[dict[str, Any]]:
    """A row for each N, the shortest of five turns; the first call compiles and is not counted."""
    answer = response(12)
    spent: dict[int, list[float]] = {12: [], 24: [], 96: []}
    for n in 5 * list(spent):
        begin = time.process_time()
        answer = response(n)
        spent[n].append((time.process_time() - begin) / len(answer.frequency))
    for n, each in spent.items():
        yield {
            "name": "seconds per point",
            "case": f"{n} sectors",
            "value": min(each),
            "unit": "s",
            "target": min(spent[12]),
            "note": f"{answer.x.shape[1]} unknowns; target: that of 12 sectors",
        }
