"""Contact by products against the condensed bodies, and the bounds of its errors."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

import upd
from upd.analyses import make_plan as make_any_plan
from upd.analyses.contact.bodies import prepare
from upd.analyses.contact.plan import NORMAL, make_plan
from upd.contact.model import ContactModel
from upd.contact.normal import NormalContact, normal_contact
from upd.contact.products import (
    KNOWN,
    KNOWN_STIFFNESS,
    energy_error,
    half_space_start,
    settled,
    unknown,
)
from upd.errors import ConvergenceError, InputError
from upd.linalg.common import AT_ONCE
from upd.linalg.select import choose_route, contact_routes
from upd.progress import Stages
from upd.reduction.learned import LearnedCompliance
from upd.reference import half_space_compliance
from upd.report.notebook import RunResult
from upd.scene import load_scene

SMALL: Mapping[str, Any] = {
    "geometry.patch": "auto",
    "geometry.divisions": 12,
    "geometry.growth": 1.6,
    "loads.normal": ["50 N", "200 N"],
    "accuracy": "unknown",
    "left_out.solve": "no",
}
WAYS = {
    "condensed": {"solver.route": "condensed"},
    "superlu": {"solver.route": "products", "solver.name": "superlu"},
    "amg": {"solver.route": "products", "solver.name": "amg"},
}


def model(way: str, **more: Any) -> ContactModel:
    scene = load_scene("hertz", {**SMALL, "want": ["normal"], **WAYS[way], **more})
    return prepare(make_plan(scene), Stages())


@lru_cache
def condensed() -> ContactModel:
    return model("condensed")


def run(way: str, **more: Any) -> RunResult:
    return upd.run("hertz", overrides={**SMALL, **WAYS[way], **more})


def by_products(mine: ContactModel, **control: float) -> NormalContact:
    """Contact of bodies that learn."""

    def forces(answer: NormalContact) -> list[tuple[np.ndarray, float]]:
        rates = [] if answer.rates is None else [(answer.rates, KNOWN_STIFFNESS)]
        return [(answer.force, KNOWN), *rates]

    def solve() -> NormalContact:
        return normal_contact(mine.compliance(NORMAL), mine.gap, **control)

    return settled(mine, (NORMAL,), solve, forces)


@pytest.mark.parametrize("way", ["superlu", "amg"])
@pytest.mark.parametrize("control", [{"load": 50.0}, {"approach": 0.004}])
def test_forces_gaps_and_approach_are_those_of_the_condensed_bodies(
    way: str, control: dict[str, float]
) -> None:
    dense, mine = condensed(), model(way)
    exact = normal_contact(dense.compliance(NORMAL), dense.gap, **control)
    found = by_products(mine, **control)
    np.testing.assert_array_equal(found.contact, exact.contact)
    largest = exact.force.max()
    np.testing.assert_allclose(found.force, exact.force, rtol=0.0, atol=1e-8 * largest)
    np.testing.assert_allclose(found.gap, exact.gap, rtol=0.0, atol=1e-8 * exact.approach)
    assert found.approach == pytest.approx(exact.approach, rel=1e-9)
    assert found.stiffness == pytest.approx(exact.stiffness, rel=1e-9)
    for body in (mine.upper, mine.lower):
        learned = body.condensed[(NORMAL,)][0]
        assert learned is not None and learned.products < 20 < len(exact.force)


def test_the_bound_holds_where_products_are_rough() -> None:
    dense, mine = condensed(), model("amg")
    exact = normal_contact(dense.compliance(NORMAL), dense.gap, load=50.0)
    C = dense.compliance(NORMAL)
    for accuracy in (1e-3, 1e-5):
        for body in (mine.upper, mine.lower):
            (only,) = body.condensed
            old, free = body.condensed[only]
            assert isinstance(old, LearnedCompliance)
            new = LearnedCompliance(
                old.body_solver, old.n_dof, old.kept, old.start, accuracy=accuracy
            )
            body.condensed[only] = (new, free)
        found = by_products(mine, load=50.0)
        apart = found.force - exact.force
        true = float(np.sqrt(apart @ C @ apart / (exact.force @ C @ exact.force)))
        bound = energy_error(mine, (NORMAL,), found.force)
        assert true <= bound < 100.0 * accuracy
        # the approach at a load, see upd.contact.products
        energy = float(np.sqrt(found.force @ C @ found.force))
        assert abs(found.approach - exact.approach) <= 2.0 * bound * energy**2 / 50.0


def test_all_products_make_the_dense_compliance() -> None:
    dense, mine = condensed(), model("superlu")
    body = mine.upper
    learned = body.condensed[(NORMAL,)][0]
    assert learned is not None
    exact = dense.upper.compliance(NORMAL)
    for force in np.eye(len(exact)):
        C = learned.compliance()
        assert np.linalg.eigvalsh(C)[0] > 0.0
        learned.learn(force)
    np.testing.assert_allclose(learned.compliance(), exact, rtol=0.0, atol=1e-11 * exact.max())
    # nothing is left to learn
    count = learned.products
    learned.learn(np.ones(len(exact)))
    assert learned.products == count


@pytest.mark.parametrize("way", ["superlu", "amg"])
def test_several_forces_are_learned_at_once(way: str) -> None:
    dense, mine = condensed(), model(way)
    learned = mine.lower.condensed[(NORMAL,)][0]
    assert learned is not None
    exact = dense.lower.compliance(NORMAL)
    forces = np.random.default_rng(4).random((len(exact), 11))
    forces[:, 10] = forces[:, 0] + 1e-6 * forces[:, 1]
    learned.learn(forces, 1e-3)
    assert learned.products == AT_ONCE
    learned.learn(forces, 1e-3)
    # the last is known to a millionth from the first
    assert learned.products == 10 and (learned.unknown(forces) < 1e-3).all()
    found = learned.compliance() @ forces[:, :10]
    np.testing.assert_allclose(found, exact @ forces[:, :10], rtol=0.0, atol=1e-8 * found.max())


def test_fields_are_sums_of_known_ones() -> None:
    dense, mine = condensed(), model("amg")
    found = by_products(mine, load=50.0)
    for name in ("upper", "lower"):
        body, exact = getattr(mine, name), getattr(dense, name)
        learned = body.condensed[(NORMAL,)][0]
        assert learned is not None
        count = learned.products
        u = body.displacement(NORMAL, mine.nodal(found.force))
        assert learned.products == count
        v = exact.displacement(NORMAL, mine.nodal(found.force))
        np.testing.assert_allclose(u, v, rtol=0.0, atol=1e-8 * np.abs(v).max())


@pytest.mark.parametrize("way", ["superlu", "amg"])
def test_every_number_and_check_of_a_run_is_the_same(way: str) -> None:
    more = {
        "want": ["normal", "stiffness", "curve", "body_compression", "tangential", "cycle"],
        "loads.cycle_steps": 40,
        "loads.curve_points": 4,
    }
    dense, mine = run("condensed", **more), run(way, **more)
    assert [(r.name, r.case) for r in mine.rows] == [(r.name, r.case) for r in dense.rows]
    for a, b in zip(mine.rows, dense.rows, strict=True):
        assert a.value == pytest.approx(b.value, rel=1e-8, abs=1e-12), a.name
    failed = [c.name for c in mine.checks if not c.passed and c.fatal]
    assert not failed
    bounds = [c.value for c in mine.checks if c.name == "products"]
    assert bounds and max(bounds) < 1e-8
    others = [c.name for c in mine.checks if c.name != "products"]
    assert others == [c.name for c in dense.checks]


def test_nearly_incompressible_bodies_take_more_iterations_and_say_so() -> None:
    more = {
        "want": ["normal"],
        "materials.sphere.nu": 0.499,
        "materials.block.nu": 0.499,
        "loads.normal": ["200 N"],
    }
    dense, mine = run("condensed", **more), run("amg", **more)
    for a, b in zip(mine.rows, dense.rows, strict=True):
        assert a.value == pytest.approx(b.value, rel=1e-8), a.name
    (told,) = [c.says for c in mine.checks if c.name == "products"]
    said = r"of \d+ to (\d+) iterations, [\d.]+ in the mean \(amg\)"
    counts = [int(n) for n in re.findall(said, told)]
    assert len(counts) == 2 and min(counts) > 100


def test_two_directions_of_slip() -> None:
    more = {
        "want": ["normal", "tangential"],
        "contact.directions": 2,
        "geometry.divisions": 10,
        "loads.normal": ["200 N"],
    }
    dense, mine = run("condensed", **more), run("superlu", **more)
    for a, b in zip(mine.rows, dense.rows, strict=True):
        assert a.value == pytest.approx(b.value, rel=1e-8, abs=1e-12), a.name


def test_quarter_start_is_the_whole_half_space_under_mirrored_forces() -> None:
    n, h, E, nu = 4, 0.1, 2e5, 0.3
    X, Y = np.meshgrid(h * np.arange(n), h * np.arange(n), indexing="ij")
    points = np.column_stack([X.ravel(), Y.ravel()])
    for component, name, held in ((2, "normal", {0: (0,), 1: (1,)}), (0, "tangential", {1: (1,)})):
        mirror = held if component == 2 else {0: (1, 2), 1: (1,)}
        C = half_space_start(points, (component,), mirror, E, nu)
        m = 2 * n - 1
        whole = half_space_compliance(m, m, h, h, E, nu, component=name)  # type: ignore[arg-type]
        force = np.random.default_rng(1).random((n, n))
        full = np.zeros((m, m))
        for i in range(m):
            for j in range(m):
                a, b = abs(i - n + 1), abs(j - n + 1)
                full[i, j] = force[a, b] * (1 + (a == 0)) * (1 + (b == 0))
        u = (whole @ full.T.ravel()).reshape(m, m).T[n - 1 :, n - 1 :]
        np.testing.assert_allclose(C @ force.ravel(), u.ravel(), rtol=1e-12)


@pytest.mark.parametrize("ratio", [1.0, 4.0, 0.1])
def test_start_is_definite_on_any_lattice(ratio: float) -> None:
    graded = np.concatenate([[0.0], np.cumsum(0.1 * 1.3 ** np.arange(6.0))])
    for x, y in ((0.1 * np.arange(7.0), 0.1 * ratio * np.arange(7.0)), (graded, ratio * graded)):
        X, Y = (v.ravel() for v in np.meshgrid(x, y, indexing="ij"))
        points = np.column_stack([X, Y])
        for components, mirror in (((2,), {0: (0,), 1: (1,)}), ((0, 1), {})):
            C = half_space_start(points, components, mirror, 2e5, 0.3)
            assert np.linalg.eigvalsh(C)[0] > 0.0
            # no diagonal raised: the farthest points see a point load, the nearest more than that
            apart = float(np.hypot(*(points[-1] - points[0])))
            if not mirror and components == (2,):
                assert C[0, -1] == pytest.approx((1 - 0.3**2) / (np.pi * 2e5 * apart), rel=1e-2)
            assert np.abs(C - np.diag(np.diagonal(C))).max() > 0.1 * np.diagonal(C).max()


def test_a_body_that_learns_nothing_more_is_told() -> None:
    mine = model("superlu")
    force = np.random.default_rng(2).random(len(mine.gap))
    settled(mine, (NORMAL,), lambda: force, lambda f: [(f[:, None], 1e-10)])
    assert unknown(mine, (NORMAL,), force[:, None]).max() < 1e-10
    with pytest.raises(ConvergenceError, match="rounding holds them"):
        settled(mine, (NORMAL,), lambda: force, lambda f: [(f[:, None], 1e-30)])


def test_route_follows_the_predicted_cost() -> None:
    small = contact_routes(30_000, 441, 12)
    assert choose_route(small, 12).name == small[0].name
    large = contact_routes(1_500_000, 3600, 12)
    names = [way.name for way in large]
    assert len(names) == 3 and names[1].startswith("products by ") and names[2].endswith("amg")
    taken = choose_route(large, 12, memory_limit_bytes=8e9)
    assert taken.name == "products by amg" and taken.cost.bytes < 8e9
    assert choose_route(large, 12, route="condensed", memory_limit_bytes=8e9).name == names[0]
    assert choose_route(small, 12, route="products").name.startswith("products by ")
    with pytest.raises(InputError, match="Unknown route"):
        choose_route(small, 12, route="dense")


def test_bodies_that_fit_one_by_one_only_are_seen_by_multigrid() -> None:
    """Each body's factors would fit into 8 GB, all four into 22."""
    large = {"geometry.divisions": 76, "geometry.growth": 1.1, "accuracy": "unknown"}
    plan = make_any_plan(load_scene("hertz", {**large, "solver.memory": "8 GB"}))
    assert plan.memory_bytes < 8e9
    assert {way.partition(":")[0] for way in plan.solver.values()} == {"products by amg"}


@pytest.mark.parametrize(
    ("name", "more"), [("symmetric", {}), ("hertz", {"contact.coupling": "coupled"})]
)
def test_products_are_refused_where_they_do_not_serve(name: str, more: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"solver\.route"):
        make_any_plan(load_scene(name, {"solver.route": "products", **more}))


def test_iterations_hardly_grow_with_the_mesh() -> None:
    """From 7 to 51 thousand dofs, by less than is wanted from 50 thousand to 3 million."""
    found = []
    for divisions, growth in ((14, 1.8), (28, 1.32)):
        changes = {
            "want": ["normal"],
            "loads.normal": ["200 N"],
            "geometry.divisions": divisions,
            "geometry.growth": growth,
        }
        result = upd.run("hertz", overrides={**SMALL, **WAYS["amg"], **changes})
        (check,) = (c for c in result.checks if c.name == "products")
        found.append([float(n) for n in re.findall(r"([\d.]+) in the mean", check.says)])
    for few, many in zip(*found, strict=True):
        assert many < 1.3 * few
