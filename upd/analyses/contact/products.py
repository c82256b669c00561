"""A curved contact by products: the forces of all its loads are shown to the bodies before the
loads are solved for the record.

Nothing is learned afterwards, so that every result and every check of a run sees one compliance.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.loading import cycle_shares, load_history, tangential_compliance
from upd.analyses.contact.plan import NORMAL, ContactPlan, unit_vector
from upd.contact.model import ContactModel
from upd.contact.normal import NormalContact, normal_curve
from upd.contact.products import (
    KNOWN,
    KNOWN_STIFFNESS,
    energy_error,
    learning,
    normal_contact_by_products,
    settled,
)
from upd.contact.tangential import TangentialPath, tangential_contact, tangential_path
from upd.contact.tangential_step import TangentialContact
from upd.results import Case, Check

Array = NDArray[np.float64]


def show_normal(model: ContactModel, loads: Sequence[float]) -> None:
    """Show both bodies the forces of every normal load in N on the model.

    Raises ConvergenceError where a product does not converge.
    """
    if not learns(model):
        return
    mask = None
    for load in sorted(loads, reverse=True):
        mask = normal_contact_by_products(model, load=load, start=mask).contact

    def all_loads() -> list[NormalContact]:
        return normal_curve(model.compliance(NORMAL), model.gap, sorted(loads))

    def forces(answers: list[NormalContact]) -> Iterable[tuple[Array, float]]:
        yield np.column_stack([one.force for one in answers]), KNOWN

    settled(model, (NORMAL,), all_loads, forces)


def show_tangential(
    plan: ContactPlan, model: ContactModel, normal: Sequence[Array], directions: tuple[int, ...]
) -> None:
    """Show both bodies the tractions of every tangential load and cycle after the normal forces
    (n,) in N of each load.

    Raises ConvergenceError where a product does not converge.
    """
    if not learns(model):
        return
    # Twice: what one load teaches changes the answers of the others within the tolerance.
    for _ in range(2):
        for force in normal:
            _show_after(plan, model, force, directions)


def _show_after(
    plan: ContactPlan, model: ContactModel, force: Array, directions: tuple[int, ...]
) -> None:
    scene, unit = plan.scene, unit_vector(0.0, directions)
    limit = scene.contact.friction * force
    loaded = np.flatnonzero(limit > 0.0)
    if not loaded.size:
        return
    total, n, d = float(limit.sum()), len(force), len(directions)
    at = np.concatenate([loaded + k * n for k in range(d)])

    def whole(tractions: Array) -> Array:
        """Tractions (n_loaded d, m) at the loaded nodes on all nodes."""
        out = np.zeros((n * d, tractions.shape[1]))
        out[at] = tractions
        return out

    along = np.zeros(n * d)
    along[:n] = limit

    def compliance() -> Array:
        return tangential_compliance(model, directions, loaded)

    def stuck() -> Array:
        C = compliance()
        first = np.arange(len(C)) < len(loaded)
        e = np.linalg.solve(C, first.astype(float))
        return np.column_stack([whole(e[:, None])[:, 0], along])

    def both(columns: Array) -> Iterable[tuple[Array, float]]:
        yield columns[:, :1], KNOWN_STIFFNESS
        yield columns[:, 1:], KNOWN

    settled(model, directions, stuck, both)
    for ratio in scene.loads.tangential if scene.wants("tangential") else ():

        def single(ratio: float = ratio) -> TangentialContact:
            load = ratio * total * unit
            return tangential_contact(
                compliance(), limit[loaded], load=load if d == 2 else float(load[0])
            )

        def of(found: TangentialContact) -> Iterable[tuple[Array, float]]:
            yield whole(found.force[:, None]), KNOWN
            if found.rates is not None:
                yield whole(found.rates), KNOWN_STIFFNESS

        settled(model, directions, single, of)
    if scene.wants("cycle"):
        values = scene.loads.cycle_amplitude * cycle_shares(scene.loads.cycle_steps)[0]
        loads = load_history(total * values, unit)

        def cycle() -> TangentialPath:
            return tangential_path(compliance(), limit[loaded], loads=loads)

        settled(model, directions, cycle, lambda path: [(whole(path.force.T), KNOWN)])


def learns(model: ContactModel) -> bool:
    """Whether a body's compliance is learned."""
    bodies = (model.upper, model.lower)
    return any(learning(b, family) is not None for b in bodies for family in b.condensed)


def product_checks(
    model: ContactModel, case: Case, components: Sequence[int], force: Array
) -> list[Check]:
    """The bound of the error that products leave in the forces (n_component n,) of a case."""
    found = [
        one for b in (model.upper, model.lower) if (one := learning(b, components)) is not None
    ]
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


__all__ = ["learns", "product_checks", "show_normal", "show_tangential"]
