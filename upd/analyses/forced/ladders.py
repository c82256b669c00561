"""What a convergence study of a forced response varies: harmonics, samples, time steps, modes kept,
contact points, meshes.

All at the scene's first stiffness and lowest F_C/F_E.

A contact point at a node of its own would never converge over meshes: the displacement under a
point force grows with every refinement. On the ladders of meshes the points are Gauss points, mean
motions that no mesh changes.

The ladder of the contact runs springs on points, the cheap model, then both faces node by node,
with elastic bodies and no springs: what each costs, where its peaks lie, and how far these are from
the finest mesh of the faces.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

from upd.analyses.forced.interface_model import INTERFACE
from upd.analyses.seated.varied import PATCH
from upd.errors import InputError
from upd.mesh import recipes
from upd.scene import ForcedScene
from upd.scene.forced_contact import GAUSS
from upd.vary.ladder import (
    Asked,
    Ladder,
    StudyReport,
    chosen_levels,
    counts,
    even,
    finest_report,
    refinements,
    whole_levels,
)
from upd.vary.outcome import SolvedPoint
from upd.vary.variation import Overrides, Variation, of_geometry

#: numbers a ladder follows beside those the analysis names first: where the model changes, the
#: stuck frequencies
_NUMBERS = ("peak_?_frequency", "peak_?_accelerance", "stuck_in_phase", "stuck_out_of_phase")
#: element -> refinements beside each other: one more of linear elements, which cost less
_REFINE: Mapping[str, tuple[float, ...]] = {
    "hex8": (0.5, 1, 2, 3),
    "hex8i": (0.5, 1, 2, 3),
    "hex20": (0.5, 1, 2),
    "hex27": (0.5, 1),
}
#: rows of Gauss points on the ladder of contact points, and on every mesh of a scene that has
#: lattice lines
_ROWS, _ON_MESHES = (2, 3, 5, 7, 10), 4


def _gauss(rows: int) -> Overrides:
    """So many rows of two Gauss points on each face."""
    return (
        ("contact.rule", GAUSS),
        ("contact.share", "area"),
        *((f"contact.{face}rows", rows) for face in ("", "left.", "right.")),
        *((f"contact.{face}columns", 2) for face in ("", "left.", "right.")),
    )


def _base(scene: ForcedScene, method: str = "balance") -> Overrides:
    """One stiffness, and one path of the balance or the sweeps alone."""
    return (
        *at_ratio(scene),
        ("contact.stiffness", [next(iter(scene.stiffnesses))]),
        ("balance.method", method),
    )


def _contact_points(scene: ForcedScene, asked: Asked) -> list[Variation]:
    return [
        Variation("contacts", f"{n} x 2 Gauss points", (*_base(scene), *_gauss(n)), 1.0 / n)
        for n in whole_levels(asked, 1) or _ROWS
    ]


def response_meshes(scene: ForcedScene, asked: Asked, *, vary: str = "mesh") -> Iterator[Variation]:
    """geometry.refine, with the scene's element ("mesh") or all that carry the contact ("element").

    Raises InputError for levels that are none, and for a recipe without ``refine``.
    """
    if not recipes.has_parameter(scene.recipe, "refine"):
        raise InputError(
            f"--vary {vary}: the recipe has no parameter refine, by which its bodies are divided; "
            "to fix it: give it one, or run the scene with meshes of your own"
        )
    whole_faces = scene.contact.model != "springs"
    known = NODE_BY_NODE if whole_faces else tuple(_REFINE)
    refined = refinements(asked)
    # Gauss points do not hang on the mesh
    keeps = whole_faces or scene.contact.rule == GAUSS
    base = (*_base(scene), *(() if keeps else _gauss(_ON_MESHES)))
    for element in (scene.mesh.element,) if vary == "mesh" else known:
        for refine in refined or _usual(scene, element):
            overrides = (*base, ("geometry.refine", refine), ("mesh.element", element))
            yield Variation(element, f"refine {refine:g}", overrides, 1.0 / refine)


def _usual(scene: ForcedScene, element: str) -> tuple[float, ...]:
    """The usual refinements; whole ones where the recipe takes no others."""
    default = recipes.parameters(scene.recipe).__dataclass_fields__["refine"].default
    return tuple(n for n in _REFINE[element] if n >= 1 or not isinstance(default, int))


def _notes(scene: ForcedScene) -> Iterator[str]:
    """What the levels set in the scene."""
    if scene.contact.model == "springs" and scene.contact.rule != GAUSS:
        yield (
            "every level: 4 x 2 Gauss points on each face, which do not hang on the mesh (what the "
            "choice of points does: --vary contacts)"
        )


# -- springs and whole faces -----------------------------------------------------------------------


#: meshes of both faces: 60, 198 and 468 nodes of the symmetric damper's half (the last has the
#: thesis's elements), 60, 196 and 460 of the asymmetric one's
_MESHES: Mapping[str, Mapping[int, tuple[int, ...]]] = {
    "symmetric": {4: (10,), 8: (20,), 12: (34,)},
    "asymmetric": {3: (6, 3), 6: (12, 6), 9: (20, 9)},
}
#: the levels run unless others are asked for: 60 and 126 nodes, 60 and 95
_USUAL = {"symmetric": (4, 6), "asymmetric": (3, 4)}
#: elements whose faces of four nodes carry a contact node by node; the first stands in for others
NODE_BY_NODE = ("hex8i", "hex8")
#: source of the levels on springs
SPRINGS = "springs"


def at_ratio(scene: ForcedScene) -> Overrides:
    """What every level of a response sets: the lowest F_C/F_E, where most slips.

    At a load under which every point sticks no level differs from another.
    """
    return (
        ("want", ["response"]),
        ("left_out.solve", "no"),
        ("excitation.centrifugal_to_force", [min(scene.excitation.centrifugal_to_force)]),
        *([("excitation.force", [])] if scene.excitation.force else []),
    )


def whole_faces_points(scene: ForcedScene, asked: Asked = None) -> list[Variation]:
    """One level for each stiffness of the springs, one for each mesh of both faces.

    Parameters
    ----------
    asked
        Elements up the patch or pad, those along it in proportion; None for the usual ones.

    Raises
    ------
    InputError
        For levels that are none, and for a rig whose faces are not divided by these parameters.
    """
    base = at_ratio(scene)
    made = []
    for name in scene.stiffnesses:
        overrides = (*base, ("contact.model", SPRINGS), ("contact.stiffness", [name]))
        made.append(Variation(SPRINGS, name, overrides, 1.0))
    for mesh in _meshes(scene, asked):
        slope, along = list(mesh.values())[:2]
        overrides = (*base, *_of_faces(scene), *of_geometry(mesh))
        made.append(Variation(INTERFACE, f"{slope} x {along}", overrides, 1.0))
    return made


def _of_faces(scene: ForcedScene) -> Overrides:
    """What a contact by whole faces asks of the scene."""
    mine = scene.mesh.element
    return (
        ("contact.model", INTERFACE),
        ("mesh.element", mine if mine in NODE_BY_NODE else NODE_BY_NODE[0]),
        ("balance.method", "balance"),
    )


def _meshes(scene: ForcedScene, asked: Asked) -> Iterator[dict[str, int]]:
    """Parameter -> elements, of every level: up the face first, then along it."""
    known = _MESHES[scene.arrangement]
    chosen = chosen_levels(
        asked or _USUAL[scene.arrangement],
        lambda n: float(n).is_integer() and n >= 2,
        "whole numbers of elements up a face, 2 or more",
        least=1,
    )
    slope, others = PATCH[scene.arrangement]
    missing = [key for key in (slope, *others) if key not in scene.geometry]
    if missing:
        raise InputError(
            f"--vary contact: the recipe has no {' and no '.join(missing)}, by which it divides "
            "the faces; to fix it: run the scene with meshes of your own"
        )
    most = max(known)
    for n in map(int, chosen):
        counts = known.get(n) or tuple(even(n * one / most) for one in known[most])
        yield {slope: n} | dict(zip(others, counts, strict=True))


def _contact_notes(scene: ForcedScene) -> Iterator[str]:
    """What the levels set in the scene."""
    ratio, span = min(scene.excitation.centrifugal_to_force), scene.excitation
    yield f"every level: F_C/F_E {ratio:g} alone, {span.start:g} to {span.stop:g} Hz"
    changes = ((key, value) for key, value in _of_faces(scene) if isinstance(value, str))
    settings = ", ".join(f'{key} = "{value}"' for key, value in changes)
    yield f"interface, elements up x along a face: {settings}"
    yield "springs: method, points and mesh as in the scene"


def _contact_report(
    scene: ForcedScene, solved: Sequence[SolvedPoint], names: Sequence[str]
) -> StudyReport:
    """Numbers of every level and their changes from the finest faces, whatever the contact is
    called.
    """

    def nameless(one: SolvedPoint) -> SolvedPoint:
        results = (replace(r, case=replace(r.case, stiffness="")) for r in one.outcome.results)
        return replace(one, outcome=replace(one.outcome, results=tuple(results)))

    return finest_report(scene, [nameless(one) for one in solved], names)


def _titled(words: str) -> Callable[[ForcedScene, str], str]:
    """Titles with the load of a ladder."""

    def title(scene: ForcedScene, vary: str) -> str:
        return f"{words.format(vary)}, F_C/F_E {min(scene.excitation.centrifugal_to_force):g}"

    return title


_title = _titled("what accuracy costs, {}")
_march = partial(_base, method="march")
_on_levels = partial(Ladder, follow=_NUMBERS, report=finest_report, title=_title)
_on_meshes = partial(Ladder, follow=_NUMBERS, notes=_notes, title=_title)
_counts = partial(counts, base=_base, offset=1)

LADDERS: Mapping[str, Ladder] = {
    "mesh": _on_meshes(response_meshes),
    "element": _on_meshes(partial(response_meshes, vary="element")),
    "harmonics": _on_levels(
        _counts("harmonics", "to harmonic {}", "balance.harmonics", (1, 3, 5, 7), 1)
    ),
    "samples": _on_levels(
        _counts("samples", "{} samples", "balance.samples", (32, 64, 128, 256, 512), 8)
    ),
    # What sweeps up and down reach is what time steps change.
    "steps": _on_levels(
        _counts("steps", "{} steps a period", "balance.samples", (32, 64, 128, 256), 8, base=_march)
    ),
    "modes": _on_levels(
        _counts("modes", "{} modes a blade", "reduction.modes", (0, 2, 5, 10, 20, 40), 0)
    ),
    "contacts": _on_levels(_contact_points),
    "contact": Ladder(
        whole_faces_points,
        _NUMBERS,
        _contact_report,
        _contact_notes,
        _titled("springs and whole faces"),
    ),
}
