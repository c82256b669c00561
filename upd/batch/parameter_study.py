"""What moves the stiffness of a flat contact: one parameter of the scene at a time, each beside the scene as given."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from upd.analyses.contact.plan import ContactPlan
from upd.analyses.contact.results import printed_of
from upd.batch.ladder import Outcome, Point
from upd.cache.files import write_text
from upd.errors import InputError
from upd.mesh import recipes
from upd.scene import Scene

#: numbers of the table, in its order
FOLLOWED = ("K_N_secant_raw", "K_N_damper_alone", "K_N_platform_alone", "K_Tx_initial_raw", "K_Ty_initial_raw")

Settings = tuple[tuple[str, Any], ...]


def setup_points(scene: Scene, plan: ContactPlan) -> list[Point]:
    """The scene as given, then with one parameter changed at a time: block, distant sets, tilt, friction, element.

    Raises InputError when the scene is no flat contact.
    """
    if recipes.analysis(scene.recipe) != "flat contact":
        raise InputError(f"--vary setup: is for flat contacts (symmetric, asymmetric); {scene.name} is none")
    return [Point("setup", label, settings, 1.0) for label, settings in _setups(scene, plan)]


def _setups(scene: Scene, plan: ContactPlan) -> Iterable[tuple[str, Settings]]:
    p = plan.parameters
    yield "as given", ()
    for factor in (0.25, 0.5, 1.5) if "margin" in p else ():
        yield f"block margin {factor * p['margin']:g} mm", (("geometry.margin", f"{factor * p['margin']!r} mm"),)
    for factor in (0.25, 0.5, 1.5) if "thickness" in p else ():
        yield f"block thickness {factor * p['thickness']:g} mm", (("geometry.thickness", f"{factor * p['thickness']!r} mm"),)
    for body, names in _distant_sets(scene, plan).items():
        for name in names:
            if scene.contact.distant.get(body) != name:
                yield f"{body} held at {name}", ((f"contact.distant.{body}", name),)
    other = "free" if scene.contact.tilt == "held" else "held"
    yield f"tilt {other}", (("contact.tilt", other),)
    # The normal force goes with the friction when it comes from an equilibrium.
    for mu in (m for m in (0.3, 1.0) if m != scene.contact.friction):
        yield f"mu = {mu:g}", (("contact.friction", mu),)
    # hex27 on the same lattice has eight times the nodes.
    for element in ("hex8", "hex8i"):
        if scene.mesh.element != element:
            yield f"element {element}", (("mesh.element", element),)
    if "band" in p:
        yield f"bands {0.2 * p['band']:g} mm wide", (("geometry.band", f"{0.2 * p['band']!r} mm"),)


def _distant_sets(scene: Scene, plan: ContactPlan) -> dict[str, list[str]]:
    """Names of the sets that may be held, body by body; sets of a single node leave the body free to turn and are left out."""
    meshes, _ = recipes.build_mesh(scene.recipe, plan.parameters)
    return {
        body: [name.removeprefix("distant_") for name, nodes in mesh.nodes.items() if name.startswith("distant_") and len(nodes) > 2]
        for body, mesh in meshes.items()
    }


def setup_table(scene: Scene, outcomes: Iterable[Outcome]) -> list[tuple[str, dict[str, float], str]]:
    """(label, number -> value of the first normal load, failure) of every setup, then what was printed of the geometry."""
    out = []
    for o in outcomes:
        first: dict[str, float] = {}
        for key, value in o.values.items():
            first.setdefault(key.split("|")[0], value)
        out.append((o.label, {name: first[name] for name in FOLLOWED if name in first}, o.failure.split(";")[0][:60]))
    lookup = printed_of(scene)
    printed = {name: found[0] for name in FOLLOWED if (found := lookup(name, {}))}
    if printed:
        source = next(iter(printed.values())).source
        out.append((f"{source} (one K_T)", {name: one.value for name, one in printed.items()}, ""))
    return out


def write_setups(folder: Path, scene: Scene, outcomes: Iterable[Outcome]) -> Path:
    """Write the table as study.md into ``folder``; returns its path."""
    rows = setup_table(scene, outcomes)
    names = [name for name in FOLLOWED if any(name in values for _, values, _ in rows)]
    lines = [
        f"# {scene.title or scene.name}: what moves the stiffness, N/mm",
        "",
        f"| setup | {' | '.join(names)} |",
        f"|---|{'---:|' * len(names)}",
    ]
    for label, values, failure in rows:
        cells = [f"{values[n]:.4g}" if n in values else "" for n in names]
        lines.append(f"| {label} | {' | '.join(cells)} |" if not failure else f"| {label} | {failure} |{' |' * (len(names) - 1)}")
    write_text(folder / "study.md", "\n".join(lines) + "\n")
    return folder / "study.md"
