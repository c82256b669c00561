"""From a plan to the contact model.

Both bodies meshed, assembled and condensed on their contact nodes; displacements inside them, and
what these show of a sphere on a plane: what each body adds to the approach and to the tangential
displacement, and the error of its mesh.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Needs
from upd.analyses.contact.plan import (
    ALONG,
    COMPONENTS,
    NORMAL,
    ContactPlan,
    family_label,
    require_contact_sets,
)
from upd.analyses.contact.solution import ContactSolution, NormalCase
from upd.cache.arrays import active
from upd.cache.sources import key_of, source_digest
from upd.contact import bulk
from upd.contact.model import Body, ContactModel, free_dofs, make_contact_model
from upd.contact.products import (
    energy_error,
    half_space_start,
    learners,
)
from upd.errors import MeshError
from upd.fem import Material, rigid_body_modes, stiffness
from upd.linalg.common import Condensed
from upd.linalg.multigrid import MultigridSolver
from upd.linalg.parallel import in_parallel
from upd.linalg.schur import DirectSolver
from upd.linalg.select import PRODUCTS
from upd.linalg.symmetric import Symmetric, submatrix_of
from upd.mesh import Mesh, recipes
from upd.mesh.hexmesh import upper_and_lower
from upd.progress import Stages
from upd.reduction.guyan import condense, require_held, stored_condensation
from upd.reduction.learned import LearnedCompliance
from upd.reduction.mean_held import condense_held_in_mean, motions_left
from upd.results import Case, Check

Array = NDArray[np.float64]
# Steps of a lattice are equal up to the rounding of a mesher.
_EVEN = 1e-6


def prepare(plan: ContactPlan, stages: Stages, kind: str = "contact") -> ContactModel:
    """Mesh both bodies, assemble K, condense on the contact nodes. Returns the contact model.

    Inside a sweep the model of the point before, or condensations kept on disk, are taken when they
    are the same; one model of each ``kind`` is kept.
    """
    store = active()
    if store is None:
        return _prepared(plan, stages, plan.workers)
    return store.remembered(
        kind,
        needs(plan, store.threads).model,
        partial(_prepared, plan, stages, min(plan.workers, store.threads)),
    )


def condensation_key(
    plan: ContactPlan, body: str, components: tuple[int, ...], threads: int
) -> str:
    """Hash of all that one body's condensation for one family of loads depends on, rounding
    included.
    """
    scene, material = plan.scene, plan.scene.materials[body]
    return key_of(
        {
            "mesh": mesh_key(plan),
            "body": body,
            "held": scene.contact.distant.get(body),
            "E": material.E,
            "nu": material.nu,
            "element": scene.mesh.element,
            "family": [components, plan.families[components]],
            "solver": _solver(plan, body, components),
            "threads": threads,
        }
    )


def needs(plan: ContactPlan, threads: int) -> Needs:
    """What a point of a sweep with this plan needs, and may share with others."""
    own, *others = (
        {condensation_key(one, body, f, threads) for body in one.size for f in one.families}
        for one in (plan, plan.companion)
        if one is not None
    )
    inside, memory = plan.effect("internal displacement"), plan.scene.solver.memory
    model = key_of({"parts": sorted(own), "memory": memory, "factors": inside})
    return Needs(model, mesh_key(plan), frozenset(own.union(*others)), inside)


def mesh_key(plan: ContactPlan) -> str:
    """Hash of all that the meshes depend on."""
    code = source_digest(plan.scene.recipe)
    return key_of({"recipe": plan.scene.recipe, "parameters": dict(plan.parameters), "code": code})


def _solver(plan: ContactPlan, body: str, components: tuple[int, ...]) -> str:
    return plan.solver[f"{body}, {family_label(components)}"].partition(":")[0]


def _prepared(plan: ContactPlan, stages: Stages, workers: int) -> ContactModel:
    scene = plan.scene
    with stages("mesh", scene.recipe):
        meshes, _ = recipes.build_mesh(scene.recipe, plan.parameters)
    require_contact_sets(scene, meshes, plan.families)
    sides = dict(zip(upper_and_lower(meshes), (1, -1), strict=True))
    with stages("assembly", ", ".join(f"{name}: {meshes[name].n_hex} hexahedra" for name in sides)):
        made = [partial(_body, plan, meshes[name], name, side) for name, side in sides.items()]
        upper, lower = in_parallel(made, workers)
    jobs = [(body, components) for components in plan.families for body in (upper, lower)]
    sizes = ", ".join(f"{name} {3 * meshes[name].n_node} dofs" for name in sides)
    with stages("condensation", f"{sizes}; {' and '.join(map(family_label, plan.families))}"):
        condensed = in_parallel([partial(_condensation, plan, *job) for job in jobs], workers)
        for (body, components), one in zip(jobs, condensed, strict=True):
            body.condensed[components] = one
    return make_contact_model(upper, lower, (0 in plan.mirrors, 1 in plan.mirrors))


def _body(plan: ContactPlan, mesh: Mesh, name: str, side: int) -> Body:
    """One body, with the distant set the scene chose."""
    chosen = plan.scene.contact.distant.get(name)
    if chosen is not None:
        own = f"distant_{chosen}"
        weights = {key: w for key, w in mesh.weights.items() if key != "distant"}
        if own in weights:
            weights["distant"] = weights[own]
        mesh = replace(mesh, nodes={**mesh.nodes, "distant": mesh.nodes[own]}, weights=weights)
    data = plan.scene.materials[name]
    material = Material(data.E, data.nu, data.density)
    K = Symmetric.of(stiffness(mesh, material, plan.scene.mesh.element))
    return Body(name, mesh, K, side)


def _condensation(
    plan: ContactPlan, body: Body, components: tuple[int, ...]
) -> tuple[Condensed | LearnedCompliance, NDArray[np.int64]]:
    """One body condensed for one family of loads, or ready for products, and its free dofs."""
    mesh, solver, store = body.mesh, plan.scene.solver, active()
    free = free_dofs(mesh, plan.families[components])
    kept = np.searchsorted(
        free, np.concatenate([3 * mesh.nodes["contact"] + c for c in components])
    )
    name = _solver(plan, body.name, components)
    if name.startswith(PRODUCTS):
        return _by_products(plan, body, components, free, kept, name.removeprefix(PRODUCTS)), free
    with_factor = plan.effect("internal displacement")

    def make() -> Condensed:
        K, modes = submatrix_of(body.K, free), rigid_body_modes(mesh.points)
        own = mesh.weights.get("distant")
        if own is None:
            held = partial(condense, K, kept, rigid_modes=modes[free])
        else:
            weights = np.zeros((mesh.n_node, 3))
            weights[mesh.nodes["distant"]] = own[:, None]
            left = motions_left(modes, np.setdiff1d(np.arange(len(modes)), free))
            held = partial(condense_held_in_mean, K, kept, weights.ravel()[free], left[free])
        return held(
            solver=solver.name,
            layout=free,
            points=mesh.points,
            keep_factor=with_factor,
            memory_limit_bytes=solver.memory,
        )

    if store is None:
        condensed = make()
    else:
        key = condensation_key(plan, body.name, components, store.threads)
        condensed = stored_condensation(store, key, make, solver=name, with_factor=with_factor)
    condensed.compliance()
    return condensed, free


def _by_products(
    plan: ContactPlan,
    body: Body,
    components: tuple[int, ...],
    free: NDArray[np.int64],
    kept: NDArray[np.int64],
    name: str,
) -> LearnedCompliance:
    """One body whose compliance is learned from products with the solver ``name``."""
    mesh, data = body.mesh, plan.scene.materials[body.name]
    K, modes = submatrix_of(body.K, free), rigid_body_modes(mesh.points)[free]
    require_held(K, modes)
    held = {"xyz".index(plane[-1]): odd for plane, odd in plan.families[components].items()}
    solver = (
        MultigridSolver(K, modes, layout=free, points=mesh.points)
        if name == "amg"
        else DirectSolver(K, name)
    )
    start = half_space_start(mesh.points[body.contact], components, held, data.E, data.nu)
    return LearnedCompliance(solver, len(free), kept, start)


def pressed(
    model: ContactModel, force: Array, copies: int
) -> tuple[dict[str, Array], dict[str, float]]:
    """Both bodies under the normal forces (n,) in N of the model's contact points, or under all
    three components (n, 3) of them.

    Returns
    -------
    displacement, reaction
        Body -> (n_node, 3) mm, and body -> normal reaction of its distant set in N on the whole
        body.
    """
    columns = {NORMAL: force} if force.ndim == 1 else dict(zip(COMPONENTS, force.T, strict=True))
    nodal = {component: model.nodal(forces) for component, forces in columns.items()}
    displacement, reaction = {}, {}
    for body in (model.upper, model.lower):
        u = sum(
            (body.displacement(c, body.side * forces) for c, forces in nodal.items()),
            np.zeros((body.mesh.n_node, 3)),
        )
        displacement[body.name] = u
        reaction[body.name] = -body.side * copies * body.reaction(u, NORMAL)
    return displacement, reaction


# -- bodies by products ----------------------------------------------------------------------------


def product_checks(
    model: ContactModel, case: Case, components: Sequence[int], force: Array
) -> list[Check]:
    """The bound of the error that products leave in the forces (n_component n,) of a case."""
    found = [one for _, one in learners(model, components)]
    if not found or not force.any():
        return []
    products = ", ".join(
        f"{one.products} products of {min(one.iterations)} to {max(one.iterations)} iterations, "
        f"{np.mean(one.iterations):.3g} in the mean ({one.solver})"
        for one in found
        if one.iterations
    )
    return [
        Check(
            "products",
            case,
            energy_error(model, components, force),
            1e-8,
            f"bound of |f - exact| / |f| in energy, by the products with K; {products}",
            'set solver.route = "condensed", or report the mesh',
        )
    ]


# -- displacements inside --------------------------------------------------------------------------


def solve_inside(solution: ContactSolution) -> None:
    """Displacements inside the bodies under every normal load, with the shares of both bodies where
    they have an axis.
    """
    sphere = solution.plan.scene.sphere_radius is not None
    model, copies = solution.model, solution.plan.copies
    for case in solution.normal:
        forces = case.solution.force if case.coupled is None else case.coupled.force[-1]
        case.displacement, case.reaction = pressed(model, forces, copies)
        if sphere and case.force > 0.0:
            # without friction it goes with the load
            frictionless = case.displacement
            if case.coupled is not None:
                frictionless = pressed(model, case.solution.force, copies)[0]
            _add_shares(solution, case, frictionless)


def _add_shares(
    solution: ContactSolution, case: NormalCase, displacement: Mapping[str, Array]
) -> None:
    """What each body adds to the approach and, per N, to the tangential displacement, with the
    error of its mesh; nothing where one is not known.
    """
    model, scene = solution.model, solution.plan.scene
    force, mu = model.patch.whole(case.solution.force, extensive=True), scene.contact.friction
    # full slip t = mu f: the bodies' far field knows the total force only
    sliding = model.nodal(mu * case.solution.force)
    for body in (model.upper, model.lower):
        data = scene.materials[body.name]
        place = model.patch, case.measures.radius_moment, data.E, data.nu
        try:
            case.shares[body.name] = bulk.body_share(body, displacement[body.name], force, *place)
            if solution.plan.effect("friction"):
                u = body.displacement(ALONG, sliding)
                finite = bulk.finite_body_share(body, u, mu * force, *place, tangential=True)
                case.shear_shares[body.name] = finite / (mu * float(force.sum()))
        except MeshError as error:
            # The numbers with the bulk compliance removed are left out, the others stand.
            solution.no_shares = f"{body.name}: {error}"
            case.shares, case.shear_shares = {}, {}
            return
    case.mesh_error = _mesh_error(solution, case, displacement)


def _mesh_error(
    solution: ContactSolution, case: NormalCase, displacement: Mapping[str, Array]
) -> tuple[float, float] | None:
    """Error of the approach in mm by the mesh near the contact and far from it; None for a lattice
    that is not even.

    The approach is dU/dF of the energy U = min (f' C f / 2 + h' f), so an error dC of the
    compliance moves it by f' dC f / F to first order, whatever it does to the forces. The whole of
    it is the mean displacement of both bodies at the contact minus that of the half-spaces under
    the same pressures and of the finite bodies' share; the far part shows along the axis, and the
    near part is the rest. The near part is counted in full: it goes with (h / a)^2 and a with
    F^(1/3), so that half of it reaches dU/dF.
    """
    model, patch = solution.model, solution.model.patch
    if patch.quads is not None:
        return None
    steps = [np.diff(lines) for lines in (patch.X, patch.Y)]
    if max(float(np.ptp(step) / step.mean()) for step in steps) > _EVEN:
        return None
    nodal = model.nodal(case.solution.force)
    force = patch.whole(case.solution.force, extensive=True)
    whole = far = 0.0
    for body in (model.upper, model.lower):
        u, share = displacement[body.name], case.shares[body.name]
        data = solution.plan.scene.materials[body.name]
        mean = body.side * float(nodal @ u[body.contact, 2]) / float(nodal.sum())
        whole += mean - share.finite_body - bulk.half_space_mean(patch, force, data.E, data.nu)
        far += share.fitted - share.finite_body
    return whole - far, far
