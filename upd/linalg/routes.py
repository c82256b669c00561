"""How a contact sees its bodies: condensed onto the contact dofs, or by products with a factor or
with multigrid; what each is predicted to cost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from upd.errors import InputError
from upd.linalg.select import (
    PRODUCTS,
    Choice,
    Prediction,
    Solid,
    choose,
    has_pardiso,
    memory_left,
    predict,
)

#: solutions with K that a first load takes, and each further load of any kind (what is known serves
#: them too); counted on the ready scene: 6 for one load, 22 for 18, 22 for 8 tangential loads and
#: two cycles
FIRST, EACH = 6, 1
#: "auto" condenses unless that takes so many times as long as the fastest other route: the last
#: digits of a run do not change for less
WORTH = 2.0
# Two triangular solutions of a product with a factor: the second refines it.
_SOLUTIONS = 2
# Bytes of the field of a product, per dof.
_FIELD = 8.0


@dataclass(frozen=True)
class Route:
    """One way and its predicted cost.

    Attributes
    ----------
    name : str
        A solver that condenses, or "products by " and a solver.
    cost : Prediction
    why : str
        Why this solver, or for how many products.
    """

    name: str
    cost: Prediction
    why: str


def predict_products(
    n_dof: int, solver: str, products: int, solid: Solid | None = None
) -> Prediction:
    """Memory and time of so many products with the compliance of a body.

    Parameters
    ----------
    n_dof : int
    solver : {"pardiso", "superlu", "amg"}
    products : int
    solid : Solid, optional

    Returns
    -------
    Prediction
    """
    fields = _FIELD * n_dof * products
    if solver == "amg":
        columns = predict(n_dof, products, solver, solid)
        return replace(columns, bytes=columns.bytes + fields)
    factor = predict(n_dof, 0, solver, solid)
    return replace(
        factor,
        bytes=factor.bytes + fields,
        seconds=factor.seconds + _SOLUTIONS * products * factor.substitution(),
    )


def contact_routes(
    n_dof: int,
    n_kept: int,
    products: int,
    *,
    solver: str = "auto",
    memory_limit_bytes: float | None = None,
    solid: Solid | None = None,
) -> list[Route]:
    """The ways open to a solver's name, the condensing one first.

    Parameters
    ----------
    n_dof, n_kept, products : int
    solver : {"auto", "pardiso", "superlu", "amg"}
    memory_limit_bytes : float, optional
        For the choice among the solvers that condense; None: what the machine has left.
    solid : Solid, optional

    Returns
    -------
    list of Route
    """
    taken = choose(n_dof, n_kept, solver=solver, memory_limit_bytes=memory_limit_bytes, solid=solid)
    dense = taken.name
    cost = predict(n_dof, n_kept, dense, solid)
    found = [Route(dense, cost, taken.why)]
    direct = "pardiso" if has_pardiso() else "superlu"
    for name in (direct, "amg") if solver == "auto" else (solver,):
        cost = predict_products(n_dof, name, products, solid)
        found.append(Route(PRODUCTS + name, cost, f"{products} products"))
    return found


def choose_route(
    ways: Sequence[Route],
    products: int,
    *,
    route: str = "auto",
    memory_limit_bytes: float | None = None,
) -> tuple[Choice, Prediction]:
    """The way to take, and its cost.

    Parameters
    ----------
    ways : sequence of Route
        From `contact_routes`.
    products : int
        What they were predicted for.
    route : {"auto", "condensed", "products"}
    memory_limit_bytes : float, optional
        None: what the machine has left.

    Returns
    -------
    Choice, Prediction
        The name is that of a `Route`.

    Raises
    ------
    InputError
        For an unknown route.
    """
    if route not in ("auto", "condensed", "products"):
        raise InputError(f'Unknown route {route!r}: choose "auto", "condensed" or "products".')
    limit = memory_limit_bytes if memory_limit_bytes is not None else memory_left()
    dense, *others = ways
    fit = [one for one in others if one.cost.bytes <= limit]
    best = min(fit, key=lambda one: one.cost.seconds, default=None)
    if route == "condensed":
        return Choice(dense.name, dense.why), dense.cost
    if route == "auto":
        affordable = dense.cost.bytes <= limit
        if affordable and (best is None or dense.cost.seconds <= WORTH * best.cost.seconds):
            return Choice(dense.name, dense.why), dense.cost
    taken = best if best is not None else min(others, key=lambda one: one.cost.bytes)
    why = (
        f"about {taken.cost.seconds:.2g} s and {taken.cost.bytes / 1e9:.2g} GB for {products} "
        f"products, {dense.cost.seconds:.2g} s and {dense.cost.bytes / 1e9:.2g} GB condensed"
    )
    return Choice(taken.name, why), taken.cost
