"""Whether a body yields under a contact: von Mises stress against its yield stress.

Off for a body whose material has no yield_stress. The contact itself stays elastic: the check shows
where that ends.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.closed_forms import closed_form_traction, hertz_of
from upd.analyses.contact.faces import lattices, tractions
from upd.analyses.contact.solution import ContactSolution
from upd.contact.model import Body, ContactModel
from upd.contact.subsurface import MostStressed, most_stressed, partial_slip_ratio
from upd.reference import HertzPoint, hertz_yield_load, hertz_yield_point
from upd.results import Case, Check
from upd.scene import Scene

Array = NDArray[np.float64]

_REMEDY = (
    "the body yields before this load, and the contact is then larger and its pressure lower than "
    "computed: lower the load, take a harder material or a larger contact"
)


def limited(scene: Scene, model: ContactModel) -> Iterator[tuple[Body, float, float]]:
    """Bodies with a yield stress: body, its yield stress in MPa and Poisson ratio."""
    for body in (model.upper, model.lower):
        material = scene.materials[body.name]
        if material.yield_stress is not None:
            yield body, material.yield_stress, material.nu


def _hertz_checks(
    scene: Scene,
    model: ContactModel,
    case: Case,
    hertz: HertzPoint[float],
    radius: float,
    modulus: float,
) -> list[Check]:
    """Of a sphere under a normal load alone: the closed form, friction left out.

    Parameters
    ----------
    hertz
        Closed form of the load.
    radius, modulus
        Of the sphere in mm, and E* in MPa.
    """
    out = []
    for body, limit, nu in limited(scene, model):
        worst = hertz_yield_point(nu)
        stress = worst.ratio * hertz.max_pressure
        begins = hertz_yield_load(limit, nu, radius, modulus)
        text = (
            f"largest von Mises stress / yield stress of {body.name}, Hertz without friction: "
            f"{stress:.4g} MPa at depth {worst.depth * hertz.radius:.3g} mm; yields from "
            f"{begins:.4g} N"
        )
        out.append(_check(case, body.name, stress / limit, text))
    return out


def _partial_slip_checks(
    scene: Scene, model: ContactModel, case: Case, hertz: HertzPoint[float]
) -> list[Check]:
    """Of a sphere of the block's material under a tangential load along one direction: Hertz's
    pressure with Cattaneo's traction.
    """
    out = []
    for body, limit, nu in limited(scene, model):
        assert case.ratio is not None
        ratio = partial_slip_ratio(scene.contact.friction, case.ratio, nu)
        # friction never relieves the most stressed place
        stress = max(ratio, hertz_yield_point(nu).ratio) * hertz.max_pressure
        text = (
            f"largest von Mises stress / yield stress of {body.name}, Hertz's pressure and "
            f"Cattaneo's traction on a half-space: {stress:.4g} MPa"
        )
        out.append(_check(case, body.name, stress / limit, text))
    return out


def _half_space_checks(
    scene: Scene,
    model: ContactModel,
    case: Case,
    faces: Mapping[str, tuple[Array, Array, Sequence[Array]]],
) -> list[Check]:
    """Of any contact: computed pressures and tractions on half-spaces, the worst of its patches.

    What the lattice leaves open is added to the stress.

    Parameters
    ----------
    faces
        Name of the patch -> its lattice lines in mm, and nodal pressure and, under a tangential
        load, tractions on the lower body along x and y, MPa.
    """
    out = []
    for body, limit, nu in limited(scene, model):
        # the upper body feels the tractions the other way round
        sign = -1.0 if body is model.upper else 1.0
        found: list[MostStressed] = [
            most_stressed(x, y, [p, *(sign * t for t in tractions)], nu)
            for x, y, (p, *tractions) in faces.values()
        ]
        worst = max(found, key=lambda one: one.value)
        sheared = any(len(fields) > 1 for _, _, fields in faces.values())
        text = (
            f"largest von Mises stress / yield stress of {body.name}, computed pressure"
            f"{' and friction' if sheared else ', no friction,'} on a half-space: "
            f"{worst.value:.4g} MPa at depth {worst.place[2]:.3g} mm, "
            f"and {100.0 * worst.resolution:.2g} % that the lattice leaves open"
        )
        value = worst.value * (1.0 + worst.resolution) / limit
        out.append(_check(case, body.name, value, text))
    return out


def _check(case: Case, body: str, value: float, text: str) -> Check:
    return Check("onset of yield", replace(case, body=body), value, 1.0, text, _REMEDY, fatal=False)


def yield_checks(solution: ContactSolution) -> list[Check]:
    """Of the bodies whose yield stress is given: by a closed form where there is one."""
    scene, model = solution.plan.scene, solution.model
    if not any(limited(scene, model)):
        return []
    pressure, faces, checks = model.multipliers.pressure, lattices(solution), []
    for case in (c for c in solution.normal if c.force > 0.0):
        hertz = hertz_of(solution, case.force)
        if hertz is not None and scene.sphere_radius is not None:
            radius, modulus = scene.sphere_radius, solution.modulus
            checks += _hertz_checks(scene, model, case.case, hertz, radius, modulus)
            continue
        normal = pressure(case.solution.force)
        fields = {k.name: k.even([normal]) for k in faces}
        checks += _half_space_checks(scene, model, case.case, fields)
    for t in solution.tangential:
        hertz = hertz_of(solution, t.normal.force)
        if hertz is not None and closed_form_traction(solution, t) is not None:
            checks += _partial_slip_checks(scene, model, t.case, hertz)
            continue
        normal = pressure(np.maximum(t.pressed, 0.0))
        shear = np.zeros((2, len(normal)))
        shear[list(t.nodes.components)] = tractions(solution, t)
        fields = {k.name: k.even([normal, *shear]) for k in faces}
        checks += _half_space_checks(scene, model, t.case, fields)
    return checks
