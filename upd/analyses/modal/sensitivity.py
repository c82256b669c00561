"""Derivatives of natural frequencies by a rig's dimensions, without another eigenvalue problem.

Of (K - lambda M) phi = 0 with phi' M phi = 1,

    dlambda/dp = phi' (dK/dp - lambda dM/dp) phi,

where K and M change with the places of the nodes alone: both are assembled on two meshes with the
same elements, a little below and a little above the dimension. Of modes with the same frequency it
is the eigenvalues of the matrix of their shapes.

References
----------
.. [1] R. L. Fox, M. P. Kapoor, AIAA J. 6 (1968) 2426.
.. [2] I. C. Lancaster, Numer. Math. 6 (1964) 377 (equal eigenvalues).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse import csr_array

from upd.analyses.modal.plan import make_plan, parameters
from upd.analyses.modal.solve import ModeSet, RigMode, solve
from upd.errors import InputError
from upd.fem import Material, mass, stiffness
from upd.linalg.eigen import RESIDUAL_LIMIT
from upd.linalg.parallel import in_parallel
from upd.linalg.select import threads
from upd.mesh import Mesh, recipes
from upd.progress import Stages
from upd.results import Case
from upd.scene import RigScene
from upd.scene.base import LeftOut

Array = NDArray[np.float64]
#: K and M
Matrices = tuple[csr_array, csr_array]

#: Relative step to both sides. The error of the difference goes with its square (measured for the
#: core's length: 1.6e-4 at 1e-3), that of the rounding of phi' K phi with its inverse (1e-9 of
#: lambda: K's largest eigenvalue is 1e7 times the first).
STEP = 1e-4


def free_and_glued(scene: RigScene) -> list[ModeSet]:
    """Modes of the scene's first arrangement, blades alone and with the damper glued between them.

    Raises
    ------
    UpdError
        As `solve` does.
    """
    asked = replace(
        scene,
        want=("free", "glued"),
        modes=replace(scene.modes, arrangements=scene.modes.arrangements[:1]),
        left_out=LeftOut(solve="no"),
    )
    return solve(make_plan(asked), Stages()).sets


def log_derivatives(
    scene: RigScene, sets: Sequence[ModeSet], names: Sequence[str], step: float = STEP
) -> dict[tuple[str, Case], float]:
    """d ln f / d ln p of every mode, by dimensions that grow together.

    Parameters
    ----------
    sets
        Of `free_and_glued`.
    names
        Parameters of the recipe, lengths in mm.
    step
        Relative, to both sides.

    Returns
    -------
    dict
        Name of the frequency as a run has it (f1_free), and its case -> derivative.

    Raises
    ------
    InputError
        When the step changes the number of elements.
    """
    out: dict[tuple[str, Case], float] = {}
    for found in sets:
        below, above = (_meshes(scene, found, names, 1.0 + sign * step) for sign in (-1, 1))
        groups = list(_groups(found.modes))
        sides = {}
        for body in {group[0].body.name: group[0].body for group in groups}.values():
            for mesh in (below[body.name], above[body.name]):
                _same_elements(body.mesh, mesh, names)
            sides[body.name] = (below[body.name], above[body.name])
        jobs = [partial(_matrices, scene, mesh) for pair in sides.values() for mesh in pair]
        matrices = iter(in_parallel(jobs, threads()))
        made = {name: (next(matrices), next(matrices)) for name in sides}
        width = float(np.log((1.0 + step) / (1.0 - step)))
        rates = {
            id(mode): rate
            for group in groups
            for mode, rate in zip(
                group,
                frequency_changes(
                    np.column_stack([m.shape.ravel() for m in group]),
                    float(np.mean([(2.0 * np.pi * m.frequency) ** 2 for m in group])),
                    *made[group[0].body.name],
                ),
                strict=True,
            )
        }
        for k, mode in enumerate(found.modes):
            out[f"f{k + 1}_{found.kind}", found.case] = rates[id(mode)] / width
    return out


def frequency_changes(shapes: Array, eigenvalue: float, below: Matrices, above: Matrices) -> Array:
    """Relative change of frequencies from one pair of matrices to another near by, first order.

    Parameters
    ----------
    shapes
        (n, m) of the modes that have one eigenvalue, mostly of one mode.
    eigenvalue
        (rad/s)^2.
    below, above
        K and M, each (n, n), on both sides of those the shapes belong to.

    Returns
    -------
    Array
        (m,) rising.
    """
    (K0, M0), (K1, M1) = (
        tuple(shapes.T @ (A @ shapes) for A in matrices) for matrices in (below, above)
    )
    change = eigh(K1 - K0 - eigenvalue * (M1 - M0), 0.5 * (M0 + M1), eigvals_only=True)
    return np.asarray(change / (2.0 * eigenvalue))


def _groups(modes: Sequence[RigMode]) -> Iterator[list[RigMode]]:
    """Modes of one body and mirror family that have the same frequency as far as their residual
    shows, rising.
    """
    for key in dict.fromkeys((m.body.name, m.family) for m in modes):
        group: list[RigMode] = []
        for mode in modes:
            if (mode.body.name, mode.family) != key:
                continue
            if group and mode.frequency > (1.0 + RESIDUAL_LIMIT) * group[-1].frequency:
                yield group
                group = []
            group.append(mode)
        yield group


def _meshes(
    scene: RigScene, found: ModeSet, names: Sequence[str], factor: float
) -> Mapping[str, Mesh]:
    """Body -> mesh with the dimensions ``factor`` times as large."""
    symmetry = make_plan(scene).symmetry
    chosen = parameters(scene, found.arrangement, found.kind, symmetry)
    changed = {name: factor * float(chosen[name]) for name in names}
    return recipes.build_mesh(scene.recipe, chosen | changed)[0]


def _matrices(scene: RigScene, mesh: Mesh) -> Matrices:
    """K and M of all dofs."""
    material = Material(scene.material.E, scene.material.nu, scene.material.density)
    return stiffness(mesh, material, scene.mesh.element), mass(mesh, material)


def _same_elements(given: Mesh, changed: Mesh, names: Sequence[str]) -> None:
    if not np.array_equal(given.hexes, changed.hexes):
        raise InputError(
            f"{', '.join(names)}: a step of the dimension changes the elements of the mesh, which "
            "has no derivative there; to fix it: give another value of the dimension or of "
            "geometry.refine"
        )
