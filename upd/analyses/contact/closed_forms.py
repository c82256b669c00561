"""What Hertz, Cattaneo and Mindlin have for the loads of a sphere on a plane."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.solution import ContactSolution, TangentialCase
from upd.reference import (
    HertzPoint,
    hertz_axial_displacement,
    hertz_sphere,
    mindlin,
    tangential_compliance_modulus,
)

Array = NDArray[np.float64]


def hertz_of(solution: ContactSolution, load: float) -> HertzPoint[float] | None:
    """Closed form of a normal load in N, or None when the scene has none."""
    radius = solution.plan.scene.sphere_radius
    return None if radius is None or load <= 0.0 else hertz_sphere(load, radius, solution.modulus)


def shear_compliance(solution: ContactSolution) -> float:
    """C = (2 - nu1)/G1 + (2 - nu2)/G2 in 1/MPa."""
    m1, m2 = (
        solution.plan.scene.materials[b.name] for b in (solution.model.upper, solution.model.lower)
    )
    return tangential_compliance_modulus(m1.E, m1.nu, m2.E, m2.nu)


def stick_radius(solution: ContactSolution, case: TangentialCase) -> float | None:
    """Cattaneo and Mindlin's radius of the stick zone in mm, or None when the scene has no closed
    form.
    """
    hertz = hertz_of(solution, case.normal.force)
    mu = solution.plan.scene.contact.friction
    return (
        None
        if hertz is None
        else float(mindlin.stick_radius(case.load, mu, case.normal.force, hertz.radius))
    )


def closed_form_traction(
    solution: ContactSolution, case: TangentialCase
) -> Callable[[Array], Array] | None:
    """Cattaneo and Mindlin's traction in MPa over the distance from the centre in mm, or None."""
    hertz, c = hertz_of(solution, case.normal.force), stick_radius(solution, case)
    if hertz is None or c is None or case.load <= 0.0:
        return None
    mu, N = solution.plan.scene.contact.friction, case.normal.force
    return lambda r: mindlin.traction(r, hertz.radius, c, mu, N)


def beyond_3a(solution: ContactSolution, load: float) -> dict[str, float]:
    """Displacement of each half-space at depth 3a under a normal load in N: body -> mm, empty
    without a closed form.
    """
    hertz, model = hertz_of(solution, load), solution.model
    if hertz is None:
        return {}
    out = {}
    for name in (model.upper.name, model.lower.name):
        data = solution.plan.scene.materials[name]
        a, p0 = hertz.radius, hertz.max_pressure
        out[name] = float(hertz_axial_displacement(3.0 * a, a, p0, data.E, data.nu))
    return out


def loop_energy(solution: ContactSolution, load: float) -> float | None:
    """Mindlin and Deresiewicz's energy of a cycle after a normal load in N, N mm, or None."""
    hertz, scene = hertz_of(solution, load), solution.plan.scene
    if hertz is None:
        return None
    amplitude, mu = scene.loads.cycle_amplitude, scene.contact.friction
    C = shear_compliance(solution)
    return float(mindlin.cycle_energy(amplitude, mu, load, hertz.radius, C))
