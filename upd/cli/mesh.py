"""What `upd mesh` does and prints: parameters with bounds, contact pairs, worst elements, files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from upd.analyses.meshing import MeshRequest
from upd.cache.files import placed_file
from upd.cli.tables import print_table
from upd.cli.terminal import check_ending
from upd.errors import InputError
from upd.labels import number
from upd.mesh import Mesh, recipes
from upd.mesh.checks import Pairs, check_pairs, edge_ratio, scaled_jacobian
from upd.mesh.export import ENDINGS, write_mesh
from upd.plot.answer_table import AnswerTable
from upd.progress import Listener, Stages
from upd.reduction.cyclic import Sector
from upd.scene.keys import recipe_keys

#: nodes per hexahedron that a .inp file can hold
_ABAQUS = (8, 20)


def mesh_files(given: Sequence[Path], folder: Path, request: MeshRequest) -> list[Path]:
    """The files to write: those given, or one of every format in a folder of its own.

    Raises InputError for an ending that is not known, before anything is meshed.
    """
    if not given:
        nodes = getattr(request.parameters, "element_nodes", 8)
        endings = [e for e in ENDINGS if e != ".inp" or nodes in _ABAQUS]
        try:
            folder.mkdir(parents=True)
        except OSError as error:
            raise InputError(
                f"{folder}: cannot be made ({error.strerror or error}); name a file with -o"
            ) from error
        return [folder / f"{request.name}{ending}" for ending in endings]
    for path in given:
        check_ending(path, "--output", *ENDINGS)
    return list(given)


def regenerate(
    console: Console,
    request: MeshRequest,
    files: Sequence[Path],
    picture: Path | None,
    listener: Listener,
    *,
    split: bool = False,
) -> dict[str, Mesh]:
    """Mesh, look at the shapes, write files and picture, print what came out."""
    stages = Stages(listener)
    size = ""
    if not recipes.counted_by_mesh(request.recipe):
        counted = recipes.count(request.recipe, request.given).values()
        size = f", {sum(body['hexes'] for body in counted)} hexahedra"
    with stages("mesh", f"{request.recipe}{size}"):
        meshes, cached = recipes.build_mesh(request.recipe, request.given)
    with stages("pairs", ", ".join(meshes)):
        pairs = check_pairs(meshes)
    for path in files:
        parts: dict[Path, Mapping[str, Mesh]] = {path: meshes}
        if split:
            named = ((f"{path.stem}-{body}{path.suffix}", body) for body in meshes)
            parts = {path.with_name(name): {body: meshes[body]} for name, body in named}
        for part, bodies in parts.items():
            with stages("write", str(part)):
                write_mesh(bodies, part)
    if picture is not None:
        # matplotlib takes a while to import
        from upd.plot.pictures import draw_meshes

        with stages("picture", str(picture)), placed_file(picture) as temporary:
            draw_meshes(meshes, request.name).savefig(temporary, format="png")
    console.print(_configuration(request, cached))
    _print_shapes(console, meshes)
    _print_pairs(console, pairs, meshes, request.parameters)
    return meshes


def _configuration(request: MeshRequest, cached: bool) -> str:
    """The parameters that differ from the recipe's defaults, in a line."""
    changed = [
        f"{key.name} {key.value}".replace('"', "")
        for key in recipe_keys(request.recipe, request.parameters)
        if key.given and key.default != "must be given"
    ]
    text = ", ".join(changed) if changed else "all parameters at their defaults"
    note = " (mesh from the cache)" if cached else ""
    return f"{request.recipe}{note}: {text}; --list shows all with their bounds"


def _print_shapes(console: Console, meshes: Mapping[str, Mesh]) -> None:
    """Sizes and worst elements of the bodies."""
    rows = []
    for name, mesh in meshes.items():
        sizes = name, f"{mesh.n_node}", f"{mesh.n_hex}"
        jacobian, ratio = scaled_jacobian(mesh), edge_ratio(mesh)
        for row, measure, value, worst in (
            (sizes, "scaled Jacobian", f"{jacobian.min():.3f}", jacobian.argmin()),
            (("", "", ""), "aspect ratio", f"{ratio.max():.1f}", ratio.argmax()),
        ):
            centre = mesh.points[mesh.hexes[worst, :8]].mean(axis=0)
            place = ", ".join(f"{x + 0.0:.3g}" for x in centre)
            rows.append((*row, measure, value, place))
    heads = ("body", "#nodes", "#hexahedra", "worst of", "#value", "at x, y, z, mm")
    print_table(console, AnswerTable("Bodies and their worst elements", heads, tuple(rows)))


def _print_pairs(
    console: Console, pairs: Sequence[Pairs], meshes: Mapping[str, Mesh], params: Any
) -> None:
    """Pairs of contact nodes, or of the faces of a sector, and how well they match."""
    sectors = getattr(params, "n_sectors", 0)
    if sectors:
        for name, mesh in meshes.items():
            found = Sector.of(mesh, sectors)
            console.print(
                f"{name}: {len(found.low)} nodes of low and high match under rotation by "
                f"2 pi/{sectors}, largest offset {number(found.offset, 'mm')}"
            )
        return
    if not pairs:
        glued = [
            f"{key} {len(nodes)} nodes"
            for mesh in meshes.values()
            for key, nodes in mesh.nodes.items()
            if len(meshes) == 1 and key.endswith("_patch")
        ]
        console.print(f"Glued in one body: {', '.join(glued)}" if glued else "No bodies touch")
        return
    rows = tuple(
        (
            ", ".join(p.bodies),
            ", ".join(dict.fromkeys(p.sets)),
            f"{p.count}",
            number(p.offset),
            number(p.gap),
        )
        for p in pairs
    )
    heads = ("bodies", "node sets", "#pairs", "#largest offset, mm", "#largest gap, mm")
    print_table(console, AnswerTable("Pairs of contact nodes", heads, rows))
