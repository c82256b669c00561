"""Contact on the condensed bodies equals contact on the full model, solved by another route.

One sparse saddle-point system per set.
"""

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import spsolve

from upd import load_scene, make_plan
from upd.analyses.contact.plan import NORMAL
from upd.analyses.contact.solve import solve_plan as solve
from upd.linalg.symmetric import whole
from upd.progress import Stages


def full_model_contact(solution, load):
    """Forces and approach from the whole stiffness matrices.

    Unknowns are all displacements, the contact forces and the approach.
    """
    plan, model = solution.plan, solution.model
    n = len(model.gap)
    blocks, columns, offset = [], [], 0
    for body in (model.upper, model.lower):
        free = body.condensed[next(c for c in body.condensed if NORMAL in c)][1]
        blocks.append(whole(body.K.submatrix(free)))
        place = np.searchsorted(free, 3 * body.contact + NORMAL)
        columns.append((offset + place, body.side))
        offset += len(free)
    B = sparse.lil_array((n, offset))
    for place, side in columns:
        B[np.arange(n), place] = float(side)
    K, B = sparse.block_diag(blocks, format="csr"), B.tocsr()
    active = model.gap < np.quantile(model.gap, 0.2)
    for _ in range(50):
        rows = np.flatnonzero(active)
        m = len(rows)
        G = B[rows]
        one = sparse.csr_array(np.ones((m, 1)))
        # K u = G' f;  G u + h - d = 0;  sum f = load
        A = sparse.block_array(
            [[K, -G.T, None], [G, None, -one], [None, one.T, None]], format="csc"
        )
        rhs = np.concatenate([np.zeros(offset), -model.gap[rows], [load / plan.copies]])
        x = spsolve(A, rhs)
        force = np.zeros(n)
        force[rows] = x[offset : offset + m]
        gap = model.gap + B @ x[:offset] - x[-1]
        new = (active & (force > 0.0)) | (~active & (gap < 0.0))
        if np.array_equal(new, active):
            return force, gap, x[-1]
        active = new
    raise AssertionError("the full model's set did not settle")


@pytest.mark.parametrize("element", ["hex8i", "hex8"])
def test_normal_contact(element: str) -> None:
    scene = load_scene(
        "hertz",
        [
            "geometry.divisions=8",
            f"mesh.element={element}",
            'want=["normal"]',
            'loads.normal=["200 N"]',
        ],
    )
    solution = solve(make_plan(scene), Stages())
    force, gap, approach = full_model_contact(solution, 200.0)
    ours = solution.normal[0].solution
    assert approach == pytest.approx(ours.approach, rel=1e-9)
    assert np.allclose(force, ours.force, rtol=0.0, atol=1e-8 * force.max())
    assert np.allclose(gap, ours.gap, rtol=0.0, atol=1e-8 * abs(approach))


def test_tangential_stiffness_of_the_stuck_contact() -> None:
    scene = load_scene(
        "hertz",
        [
            "geometry.divisions=8",
            'want=["stiffness", "tangential"]',
            'loads.normal=["200 N"]',
            "loads.tangential=[0.3]",
        ],
    )
    solution = solve(make_plan(scene), Stages())
    plan, model = solution.plan, solution.model
    loaded = np.flatnonzero(solution.normal[0].solution.force > 0.0)
    total = 0.0
    offset, blocks, columns = 0, [], []
    for body in (model.upper, model.lower):
        free = body.condensed[next(c for c in body.condensed if 0 in c)][1]
        blocks.append(whole(body.K.submatrix(free)))
        columns.append((offset + np.searchsorted(free, 3 * body.contact[loaded]), body.side))
        offset += len(free)
    B = sparse.lil_array((len(loaded), offset))
    for place, side in columns:
        B[np.arange(len(loaded)), place] = float(side)
    K, B = sparse.block_diag(blocks, format="csr"), B.tocsr()
    # Unit relative motion of the distant sets with every loaded node stuck.
    A = sparse.block_array([[K, -B.T], [B, None]], format="csc")
    x = spsolve(A, np.concatenate([np.zeros(offset), np.ones(len(loaded))]))
    total = plan.copies * x[offset:].sum()
    assert solution.normal[0].stuck[0.0][0] == pytest.approx(total, rel=1e-8)
