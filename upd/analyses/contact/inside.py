"""Displacements inside the bodies under the contact forces, and the reactions of what holds them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.plan import NORMAL
from upd.contact.model import ContactModel

Array = NDArray[np.float64]


def pressed(model: ContactModel, force: Array, copies: int) -> tuple[dict[str, Array], dict[str, float]]:
    """Both bodies under the normal forces (n,) in N of the model's contact points.

    Returns
    -------
    displacement, reaction
        Body -> (n_node, 3) mm, and body -> normal reaction of its distant set in N on the whole body.
    """
    nodal = model.nodal(force)
    displacement, reaction = {}, {}
    for body in (model.upper, model.lower):
        u = body.displacement(NORMAL, body.side * nodal)
        displacement[body.name] = u
        reaction[body.name] = -body.side * copies * body.reaction(u, NORMAL)
    return displacement, reaction
