"""What `upd mesh` does and prints: parameters with bounds, contact pairs, worst elements, files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from upd.analyses.meshing import MeshRequest
from upd.cache.files import whole_file
from upd.errors import InputError
from upd.labels import number
from upd.mesh import FloatArray, Mesh, recipes
from upd.mesh.export import ENDINGS, write_mesh
from upd.mesh.fields import RecipeParameter, table
from upd.mesh.pairing import Pairs, check_pairs
from upd.mesh.quality import centre_of, quality
from upd.progress import Listener, Stages

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
        if path.suffix.lower() not in ENDINGS:
            raise InputError(
                f"{path}: the ending {path.suffix!r} is not known; use one of {', '.join(ENDINGS)}"
            )
    return list(given)


def picture_file(given: Path | None) -> None:
    """Raise InputError for a picture that is no .png."""
    if given is not None and given.suffix.lower() != ".png":
        raise InputError(f"--picture {given}: the ending {given.suffix!r} is not known; use .png")


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
    with stages("pairs and shapes", ", ".join(meshes)):
        pairs, shapes = check_pairs(meshes), _shapes(meshes)
    for path in files:
        for part, bodies in _parts(path, meshes, split=split).items():
            with stages("write", str(part)):
                write_mesh(bodies, part)
    if picture is not None:
        with stages("picture", str(picture)):
            _draw(request, meshes, picture)
    console.print(_configuration(request, cached))
    console.print(shapes)
    console.print(_pairs(pairs, meshes))
    return meshes


def _parts(
    path: Path, meshes: Mapping[str, Mesh], *, split: bool
) -> dict[Path, Mapping[str, Mesh]]:
    """Files and the bodies in each."""
    if not split:
        return {path: meshes}
    return {
        path.with_name(f"{path.stem}-{body}{path.suffix}"): {body: mesh}
        for body, mesh in meshes.items()
    }


def _draw(request: MeshRequest, meshes: Mapping[str, Mesh], path: Path) -> None:
    # matplotlib takes a while to import
    from upd.plot.mesh_picture import draw_meshes

    try:
        with whole_file(path) as temporary:
            draw_meshes(meshes, request.name).savefig(temporary, format="png")
    except OSError as error:
        raise InputError(
            f"{path}: cannot be written ({error.strerror or error}); choose another place"
        ) from error


def _configuration(request: MeshRequest, cached: bool) -> str:
    """The parameters that differ from the recipe's defaults, in a line."""
    changed = [
        f"{p.name} {_value(p, p.value)}"
        for p in table(request.parameters)
        if p.default is not None and p.value != p.default
    ]
    told = ", ".join(changed) if changed else "all parameters at their defaults"
    note = " (mesh from the cache)" if cached else ""
    return escape(f"{request.recipe}{note}: {told}; --list shows all with their bounds")


def _shapes(meshes: Mapping[str, Mesh]) -> Table:
    """Sizes and worst elements of the bodies."""
    out = Table(
        box=SIMPLE_HEAD,
        title="Bodies and their worst elements",
        title_justify="left",
        title_style="bold",
        padding=(0, 1, 0, 0),
    )
    out.add_column("body")
    for head in ("nodes", "hexahedra"):
        out.add_column(head, justify="right")
    out.add_column("worst of")
    out.add_column("value", justify="right")
    out.add_column("at x, y, z, mm")
    for name, mesh in meshes.items():
        found = quality(mesh)
        sizes = escape(name), f"{mesh.n_node}", f"{mesh.n_hex}"
        worst = _place(centre_of(mesh, found.worst))
        out.add_row(*sizes, "scaled Jacobian", f"{found.min:.3f}", worst)
        longest = _place(centre_of(mesh, found.longest))
        out.add_row("", "", "", "aspect ratio", f"{found.aspect:.1f}", longest)
    return out


def _place(point: FloatArray) -> str:
    return ", ".join(f"{x + 0.0:.3g}" for x in point)


def _pairs(pairs: Sequence[Pairs], meshes: Mapping[str, Mesh]) -> str | Table:
    """Pairs of contact nodes and how well they face each other."""
    if not pairs:
        glued = [
            f"{key} {len(nodes)} nodes"
            for mesh in meshes.values()
            for key, nodes in mesh.nodes.items()
            if len(meshes) == 1 and key.endswith("_patch")
        ]
        return f"Glued in one body: {', '.join(glued)}" if glued else "No bodies touch"
    out = Table(
        box=SIMPLE_HEAD,
        title="Pairs of contact nodes",
        title_justify="left",
        title_style="bold",
        padding=(0, 1, 0, 0),
    )
    for head in ("bodies", "node sets"):
        out.add_column(head)
    for head in ("pairs", "largest offset, mm", "largest gap, mm"):
        out.add_column(head, justify="right")
    for p in pairs:
        sets = p.sets[0] if p.sets[0] == p.sets[1] else f"{p.sets[0]}, {p.sets[1]}"
        cells = (f"{p.bodies[0]}, {p.bodies[1]}", sets, f"{p.count}")
        out.add_row(*map(escape, cells), number(p.offset), number(p.gap))
    return out


def print_parameters(console: Console, request: MeshRequest) -> None:
    """The table of a recipe's parameters: unit, default, bounds, and the bounds that the others
    leave.
    """
    rows = table(request.parameters)
    changed = any(p.value != p.default for p in rows)
    out = Table(
        box=SIMPLE_HEAD,
        title=escape(f"Parameters of {request.recipe}"),
        title_justify="left",
        title_style="bold",
        padding=(0, 1, 0, 0),
    )
    heads = [
        "parameter",
        "default",
        *(["now"] if changed else []),
        "unit",
        "bounds",
        "others allow",
    ]
    for head in heads:
        out.add_column(head, overflow="fold", no_wrap=head == "parameter")
    for p in rows:
        now = [f"[bold]{escape(_value(p, p.value, unit=False))}[/]" if p.value != p.default else ""]
        out.add_row(
            p.name,
            escape("" if p.default is None else _value(p, p.default, unit=False)),
            *(now if changed else []),
            p.unit,
            p.bounds,
            p.here,
        )
    console.print(out)
    console.print(
        "others allow: between which values the recipe's own checks pass while the other "
        "parameters stay as they are.",
        style="dim",
    )


def _value(p: RecipeParameter, value: Any, *, unit: bool = True) -> str:
    told = f"{value:g}" if isinstance(value, float) else str(value)
    return f"{told} {p.unit}" if unit and p.unit else told
