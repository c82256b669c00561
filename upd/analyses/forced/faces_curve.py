"""Curves of whole faces by harmonic balance.

Blades in frequency, damper and contact in time, see `upd.hbm.interface_balance`: every node of both
faces with its past, as a sweep from the static state at rising frequency.
"""

from __future__ import annotations

import numpy as np

from upd.analyses.forced.curves import FacesCurve, WholeFaces
from upd.analyses.forced.excitation import ComplexArray, excitation_of
from upd.analyses.forced.faces_cost import SAMPLES, blade_harmonics
from upd.analyses.forced.interface_model import by_coulomb
from upd.analyses.forced.march_modes import stuck_modes_of
from upd.analyses.forced.measures import PEAKS_ABOVE, PathPeak, path_maxima
from upd.analyses.forced.mode_peaks import CANDIDATES, ModePeak, ModeShapes, numbered
from upd.analyses.forced.model import Array
from upd.analyses.forced.paths import grid
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.solution import ForcedSolution
from upd.analyses.forced.sweeps import both_ways
from upd.hbm.interface_balance import InterfaceResponse, interface_response
from upd.progress import Stages
from upd.scene.forced_contact import SIDES


def solve_faces(solution: ForcedSolution, name: str, stages: Stages) -> None:
    """The curves at every F_C/F_E, by harmonic balance or by sweeps.

    Parameters
    ----------
    solution
        With the faces; curves are added to it.
    name
        Of the contact.
    """
    scene, faces = solution.plan.scene, solution.faces[name]
    for ratio in scene.excitation.centrifugal_to_force:
        words = f"{name}, F_C/F_E {ratio:g}: {faces.of.n} nodes"
        if scene.balance.method == "march":
            with stages("sweeps", f"{words}, up and down"):
                found = both_ways(solution.plan, name, ratio, faces.march, faces.start)
                solution.sweeps += found
        else:
            with stages("friction", words):
                solution.balanced.append(balance_curve(solution.plan, name, faces, ratio))


def balance_curve(plan: ForcedPlan, name: str, faces: WholeFaces, ratio: float) -> FacesCurve:
    """The balance from the static state along the sweep, rising.

    Parameters
    ----------
    name
        Of the contact.
    ratio
        F_C/F_E.
    """
    b, force = plan.scene.balance, plan.scene.damper.centrifugal / ratio
    excitation = excitation_of(plan.scene.excitation)
    found = interface_response(
        faces.march,
        grid(plan),
        force * excitation.drive,
        faces.start,
        harmonics=blade_harmonics(plan.scene),
        samples=SAMPLES if b.samples == "auto" else b.samples,
        fallback=by_coulomb,
    )
    read = found.amplitude[:, excitation.lowest]
    scale = -((2.0 * np.pi * excitation.lowest * found.frequency) ** 2) * 1e-3 / force
    H = {side: scale * read[:, k] for k, side in enumerate(SIDES)}
    modes = stuck_modes_of(faces.march, CANDIDATES * plan.scene.excitation.stop)
    peaks = {side: _peaks(found, np.abs(H[side]), read, modes) for side in SIDES}
    return FacesCurve(name, ratio, force, found, H, peaks)


def _peaks(
    found: InterfaceResponse, size: Array, read: ComplexArray, modes: ModeShapes
) -> tuple[ModePeak, ...]:
    if not len(size):
        return ()
    maxima = _maxima(found, size)
    at = np.array([one.sample for one in maxima], int)
    return tuple(numbered(modes, maxima, read[at, len(SIDES) :]))


def _maxima(found: InterfaceResponse, size: Array) -> list[PathPeak]:
    """Local maxima of a curve; none is read across a jump, and a stretch may be highest where one
    ends it.
    """
    out, begin, frequency = [], 0, found.frequency
    for end in (*(i + 1 for i in found.jumps), len(size)):
        f, a = frequency[begin:end], size[begin:end]
        out += [one._replace(sample=one.sample + begin) for one in path_maxima(f, a, 0.0)]
        for i, inner, jumped in ((0, 1, begin > 0), (len(a) - 1, len(a) - 2, end < len(size))):
            if jumped and (len(a) == 1 or a[i] > a[inner]):
                out.append(PathPeak(float(f[i]), float(a[i]), begin + i))
        begin = end
    return [one for one in out if one.height >= PEAKS_ABOVE * size.max()]
