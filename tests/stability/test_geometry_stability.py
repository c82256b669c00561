"""Meshes stay sound over the range of parameters, gmsh is left as it was found, and a failure does
not spoil the next mesh.
"""

from __future__ import annotations

import builtins
import signal
import threading
from typing import Any

import numpy as np
import pytest

from geometry import blocks
from geometry.blocks import hexahedron
from geometry.sphere_block import SphereBlock, build
from upd.errors import MeshError
from upd.mesh import Mesh
from upd.mesh.checks import scaled_jacobian

TINY: dict[str, Any] = {"divisions": 4, "growth": 2.0}


@pytest.mark.parametrize(
    ("element_nodes", "divisions", "growth"),
    [
        (8, 4, 1.4),
        (8, 10, 1.2),
        (8, 10, 2.0),
        (8, 40, 1.4),
        (20, 4, 1.2),
        (20, 4, 2.0),
        (20, 10, 1.4),
        (27, 4, 1.4),
        (27, 10, 2.0),
    ],
)
@pytest.mark.parametrize("patch", [1e-3, 1e-2, 0.1, 1.0, 2.0, 4.2])
def test_scaled_jacobian_over_the_range(
    element_nodes: int, patch: float, divisions: int, growth: float
) -> None:
    params = SphereBlock(
        patch=patch,
        divisions=divisions,
        element_nodes=element_nodes,
        growth=growth,
        symmetry="quarter",
    )
    for name, mesh in build(params).items():
        assert scaled_jacobian(mesh).min() > 0.1, (name, params)


@pytest.mark.parametrize("core_depth", [0.3, 0.6, 1.0])
@pytest.mark.parametrize(("radius", "block"), [(1.0, 10.0), (5.0, 3.0), (500.0, 20.0)])
def test_scaled_jacobian_for_other_bodies(core_depth: float, radius: float, block: float) -> None:
    params = SphereBlock(
        radius=radius,
        block=block,
        patch=0.5,
        core_depth=core_depth,
        divisions=20,
        symmetry="quarter",
    )
    for name, mesh in build(params).items():
        assert scaled_jacobian(mesh).min() > 0.1, (name, params)


def test_finest_and_steepest_patch_with_bent_edges() -> None:
    """The shift of the patch edge onto its lattice is as large as the elements there.

    It must not crush the first ring.
    """
    params = SphereBlock(patch=4.2, divisions=80, element_nodes=20, symmetry="quarter")
    assert scaled_jacobian(build(params)["sphere"]).min() > 0.1


@pytest.mark.full
@pytest.mark.parametrize(
    ("symmetry", "patch", "element_nodes"),
    [
        ("quarter", 1e-3, 8),
        ("quarter", 1e-3, 20),
        ("quarter", 1.0, 27),
        ("quarter", 4.2, 27),
        ("half", 1.0, 20),
        ("full", 2.0, 8),
    ],
)
def test_finest_patch(symmetry: Any, patch: float, element_nodes: int) -> None:
    for mesh in build(
        SphereBlock(patch=patch, divisions=80, symmetry=symmetry, element_nodes=element_nodes)
    ).values():
        assert scaled_jacobian(mesh).min() > 0.1


def test_ctrl_c_stays_with_python() -> None:
    before = signal.getsignal(signal.SIGINT)
    seen = []
    with blocks.session("test"):
        seen.append(signal.getsignal(signal.SIGINT))
    assert [*seen, signal.getsignal(signal.SIGINT)] == [before, before]


def test_meshing_in_threads() -> None:
    made: list[Mesh] = []
    threads = [
        threading.Thread(target=lambda: made.append(build(SphereBlock(**TINY))["sphere"]))
        for _ in range(3)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(made) == 3
    assert all(np.array_equal(mesh.points, made[0].points) for mesh in made)


def test_gmsh_of_the_caller_is_left_as_it_was() -> None:
    gmsh = blocks.import_gmsh()
    gmsh.initialize(argv=["test"], readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.RecombineAll", 0)
        gmsh.model.add("mine")
        gmsh.model.geo.addPoint(0.0, 0.0, 0.0, tag=7)
        gmsh.model.geo.synchronize()
        build(SphereBlock(**TINY))
        assert gmsh.isInitialized()
        assert gmsh.model.getCurrent() == "mine"
        assert gmsh.model.getEntities(0) == [(0, 7)]
        assert gmsh.option.getNumber("Mesh.RecombineAll") == 0
    finally:
        gmsh.finalize()


def test_a_failed_mesh_does_not_spoil_the_next() -> None:
    def failing() -> None:
        with blocks.session("bad") as gmsh:
            bad = blocks.Blocks(gmsh)
            for k, corner in enumerate(hexahedron.REFERENCE[:8]):
                bad.point(str(k), corner)
            sides = [(k, (k + 1) % 4) for k in range(4)]
            sides += [(a + 4, b + 4) for a, b in sides] + [(k, k + 4) for k in range(4)]
            for a, b in sides:
                bad.curve(str(a), str(b), 3 if (a, b) == (4, 5) else 2)  # opposite edges disagree
            bad.volume("broken", [str(k) for k in range(8)])
            bad.mesh(8)

    good = build(SphereBlock(**TINY))["block"]
    with pytest.raises(MeshError, match="broken"):
        failing()
    assert not blocks.import_gmsh().isInitialized()
    assert np.array_equal(build(SphereBlock(**TINY))["block"].points, good.points)


@pytest.mark.parametrize(
    ("fault", "word"),
    [
        (OSError("libGLU.so.1: cannot open"), "libglu1-mesa"),
        (ImportError("no gmsh"), "pip install"),
    ],
)
def test_missing_libraries_are_named(
    monkeypatch: pytest.MonkeyPatch, fault: Exception, word: str
) -> None:
    real = builtins.__import__

    def refuse(name: str, *args: Any, **kwargs: Any) -> Any:
        if name == "gmsh":
            raise fault
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(MeshError, match=word):
        build(SphereBlock(**TINY))


@pytest.mark.parametrize("first", [1e-6, 1e-3, 0.1])
@pytest.mark.parametrize("growth", [1.05, 1.4, 2.0])
def test_grading_fits_its_length(first: float, growth: float) -> None:
    n = blocks.count_for(1.0, first, growth)
    ratio = blocks.ratio_for(1.0, first, n)
    assert 1.0 <= ratio <= growth * (1.0 + 1e-12)
    assert first * np.sum(ratio ** np.arange(n)) == pytest.approx(1.0, rel=1e-9)
    assert n == 1 or first * np.sum(growth ** np.arange(n - 1)) < 1.0, (
        "one element fewer would not do"
    )
    positions = blocks.graded(n, ratio)
    assert (positions[0], positions[-1]) == (0.0, pytest.approx(1.0, rel=1e-14))
    assert positions[1] == pytest.approx(first, rel=1e-9)


def test_scrambled_hexahedra_are_noticed() -> None:
    cube = hexahedron.Grid(np.arange(27).reshape(3, 3, 3), 8).hexes()
    assert np.array_equal(hexahedron.structured(cube, (2, 2, 2)).hexes(), cube)
    with pytest.raises(MeshError, match="lattice order"):
        hexahedron.structured(cube[::-1], (2, 2, 2))
    with pytest.raises(MeshError, match="hexahedron"):
        hexahedron.local_order(np.zeros((8, 3)))
