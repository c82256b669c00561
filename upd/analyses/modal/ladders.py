"""What a convergence study of free vibration varies; how frequencies depend on dimensions.

d ln f / d ln p come from the modes of the rig as given and the matrices of slightly changed ones,
without another eigenvalue problem. Of (K - lambda M) phi = 0 with phi' M phi = 1,

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
from upd.errors import InputError, UpdError
from upd.fem import Material, mass, stiffness
from upd.linalg.eigen import RESIDUAL_LIMIT
from upd.linalg.parallel import in_parallel
from upd.linalg.select import threads
from upd.mesh import Mesh, recipes
from upd.progress import Stages
from upd.results.answer_table import AnswerTable
from upd.scene import ModalScene
from upd.scene.base import LeftOut
from upd.vary.ladder import Asked, Ladder, StudyReport, counts, no_levels, refinements
from upd.vary.outcome import SolvedPoint
from upd.vary.variation import Overrides, Variation

Array = NDArray[np.float64]
#: K and M
Matrices = tuple[csr_array, csr_array]

#: Relative step to both sides. The error of the difference goes with its square (measured for the
#: core's length: 1.6e-4 at 1e-3), that of the rounding of phi' K phi with its inverse (1e-9 of
#: lambda: K's largest eigenvalue is 1e7 times the first).
STEP = 1e-4


#: numbers a ladder follows beside those the analysis names first
_NUMBERS = ("f?_free", "f?_glued", "f?_reduced", "response_below", "response_above")
#: elements beside each other, and refinements that are affordable
_ELEMENTS, _REFINE = ("hex8", "hex8i", "hex20", "hex27"), (1, 2, 3)
MODES_ONLY: Overrides = (("want", ["free", "glued"]), ("modes.arrangements", ["symmetric"]))
_REDUCED: Overrides = (
    ("want", ["free", "reduction", "response"]),
    ("modes.arrangements", ["symmetric"]),
)


#: dimension -> parameters that move together
DIMENSIONS: dict[str, tuple[str, ...]] = {
    "shank_length": ("shank_length",),
    "shank_tx": ("shank_tx",),
    "core_length": ("core_length",),
    "core_tx": ("core_tx",),
    "core_wy": ("core_wy",),
    "platform_height": ("platform_height",),
    "width of shank and platform": ("shank_wy", "platform_wy"),
}


def _meshes(scene: ModalScene, asked: Asked, *, all_elements: bool) -> Iterator[Variation]:
    """geometry.refine with the scene's element, or with all four: quadratic ones to refine 2."""
    for element in _ELEMENTS if all_elements else (scene.mesh.element,):
        most = 2 if element == "hex27" or (all_elements and element == "hex20") else 3
        for refine in refinements(asked) or _REFINE[:most]:
            overrides = (*MODES_ONLY, ("geometry.refine", refine), ("mesh.element", element))
            yield Variation(element, f"refine {refine:g}", overrides, 1.0 / refine)


def frequency_derivatives(
    scene: ModalScene,
) -> tuple[dict[str, float], dict[str, dict[str, float] | str]]:
    """Natural frequencies in Hz, and d ln f / d ln p of each of them for every dimension.

    A dimension without derivatives has the reason in their place. Raises UpdError when the rig as
    given has no modes.
    """
    sets = free_and_glued(scene)
    frequencies = {
        f"f{k + 1}_{one.kind}": mode.frequency for one in sets for k, mode in enumerate(one.modes)
    }
    table: dict[str, dict[str, float] | str] = {}
    for dimension, names in DIMENSIONS.items():
        try:
            table[dimension] = log_derivatives(scene, sets, names)
        except UpdError as error:
            table[dimension] = str(error)
    return frequencies, table


def _no_variations(scene: ModalScene, asked: Asked) -> tuple[Variation, ...]:
    """One set of modes is enough for all dimensions.

    Raises InputError for levels, and when the recipe has other dimensions.
    """
    no_levels(asked, "the dimensions are those of the rig, each by itself")
    missing = [
        name for names in DIMENSIONS.values() for name in names if name not in scene.geometry
    ]
    if missing:
        raise InputError(f"--vary dimensions: the recipe has no parameter {', '.join(missing)}")
    return ()


def _dimension_report(
    scene: ModalScene, solved: Sequence[SolvedPoint], names: Sequence[str]
) -> StudyReport:
    """A row for the frequencies in Hz, then one for each dimension."""
    del solved, names
    frequencies, derivatives = frequency_derivatives(scene)
    rows: list[tuple[str, ...]] = [
        ("as given, Hz", *(f"{f:.2f}" for f in frequencies.values())),
        *(
            (dimension, found, *[""] * (len(frequencies) - 1))
            if isinstance(found, str)
            else (dimension, *(f"{found[name]:+.3f}" for name in frequencies))
            for dimension, found in derivatives.items()
        ),
    ]
    heads = ("dimension", *(f"# {name.replace('_', ' ')}" for name in frequencies))
    table = AnswerTable("d ln f / d ln p", heads, tuple(rows))
    any_found = any(not isinstance(found, str) for found in derivatives.values())
    return StudyReport((table,), any_found)


def free_and_glued(scene: ModalScene) -> list[ModeSet]:
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
    scene: ModalScene, sets: Sequence[ModeSet], names: Sequence[str], step: float = STEP
) -> dict[str, float]:
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
        Name of the frequency as a run has it (f1_free) -> derivative.

    Raises
    ------
    InputError
        When the step changes the number of elements.
    """
    out: dict[str, float] = {}
    for found in sets:
        below, above = (_scaled_meshes(scene, found, names, 1.0 + sign * step) for sign in (-1, 1))
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
            out[f"f{k + 1}_{found.kind}"] = rates[id(mode)] / width
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


def _scaled_meshes(
    scene: ModalScene, found: ModeSet, names: Sequence[str], factor: float
) -> Mapping[str, Mesh]:
    """Body -> mesh with the dimensions ``factor`` times as large."""
    symmetry = make_plan(scene).symmetry
    chosen = parameters(scene, found.arrangement, found.kind, symmetry)
    changed = {name: factor * float(chosen[name]) for name in names}
    return recipes.build_mesh(scene.recipe, chosen | changed)[0]


def _matrices(scene: ModalScene, mesh: Mesh) -> Matrices:
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


_MODES = counts(
    "modes",
    "{} modes a blade",
    "reduction.modes",
    (0, 1, 2, 5, 10, 20, 40),
    0,
    _REDUCED,
    offset=1,
)
LADDERS: Mapping[str, Ladder] = {
    "mesh": Ladder(partial(_meshes, all_elements=False), _NUMBERS),
    "element": Ladder(partial(_meshes, all_elements=True), _NUMBERS),
    "modes": Ladder(_MODES, _NUMBERS),
    "dimensions": Ladder(
        _no_variations, report=_dimension_report, title=lambda scene, vary: "d ln f / d ln p"
    ),
}
