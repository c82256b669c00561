"""What a convergence study of a flat contact varies, and what moves its stiffness: one parameter
of the scene at a time, each beside the scene as given.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from upd.analyses import analysis_of
from upd.analyses.base import Plan
from upd.analyses.contact import ladders
from upd.analyses.contact.varied import FLAT_GOVERNING
from upd.analyses.flat.results import printed_of
from upd.mesh import recipes
from upd.results.quantities import number_label
from upd.scene import Scene
from upd.vary.ladder import Asked, Ladder, StudyReport, even, no_levels
from upd.vary.outcome import SolvedPoint, without_failed
from upd.vary.tables import make_table
from upd.vary.variation import Overrides, Variation

#: shares of the scene's divisions: spacing from twice to half of it
_SHARES = (0.5, 0.67, 1.0, 1.34, 1.67)
#: in per cent
_ACCURACIES = (20.0, 10.0, 5.0)
#: numbers of the table, in its order
STIFFNESSES = (
    "K_N_secant_raw",
    "K_N_damper_alone",
    "K_N_platform_alone",
    "K_Tx_initial_raw",
    "K_Ty_initial_raw",
)

#: the same of one pad, shown instead where the contact is two pads
PER_PAD = {
    "K_N_secant_raw": "K_N_per_pad",
    "K_Tx_initial_raw": "K_Tx_per_pad",
    "K_Ty_initial_raw": "K_Ty_per_pad",
}
_NAMES = (*STIFFNESSES, *PER_PAD.values())
#: patches smaller than the scene's: where it is made of squares, their edge goes with it
_PATCHES = (0.8, 0.6, 0.4)
#: lengths of the wedge's patch with the bands over it, and of its damper
_WEDGE_PATCH = ("patch_length", "patch_width", "band")
_WEDGE = ("base", "height", "length", "patch_offset", "wire_position", "wire_width")

#: what a row is of, number -> value, why it failed
Row = tuple[str, dict[str, float], str]


def _usual(plan: Plan[Any]) -> Sequence[int]:
    usual = int(plan.parameters["divisions"])
    return tuple(dict.fromkeys(even(share * usual) for share in _SHARES))


def parameter_points(scene: Scene, asked: Asked = None) -> list[Variation]:
    """The scene as given, then with one parameter changed at a time.

    Block, patch, distant sets, tilt, friction, element. Raises InputError for levels, and when the
    scene leaves the mesh to an accuracy.
    """
    no_levels(asked, "a parameter study changes one parameter at a time")
    return [
        Variation("parameters", label, overrides, 1.0)
        for label, overrides in _setups(scene, analysis_of(scene).make_plan(scene))
    ]


def _setups(scene: Scene, plan: Plan[Any]) -> Iterable[tuple[str, Overrides]]:
    p = plan.parameters
    yield "as given", ()
    for name in ("margin", "thickness"):
        for factor in (0.25, 0.5, 1.5) if name in p else ():
            yield f"block {name} {factor * p[name]:g} mm", _lengths({name: factor * p[name]})
    yield from _patches(scene.recipe, p)
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
        yield f"bands {0.2 * p['band']:g} mm wide", _lengths({"band": 0.2 * p["band"]})


def _patches(recipe: str, parameters: Mapping[str, Any]) -> Iterable[tuple[str, Overrides]]:
    """Smaller patches on the same damper, a lower one, and the damper smaller with its patch."""
    p = recipes.made(recipe, parameters)
    if hasattr(p, "patch_width") and hasattr(p, "band"):
        length = p.patch_length
        sizes = {"patch_length": length, "patch_width": p.width, "band": p.band}
        for k in _PATCHES:
            smaller = {name: k * sizes[name] for name in _WEDGE_PATCH}
            yield _patch_label(k * p.width, k * length), _lengths(smaller)
        k = _PATCHES[-1]
        yield _patch_label(p.width, k * length), _lengths({"patch_length": k * length})
        whole = sizes | {name: getattr(p, name) for name in _WEDGE}
        yield (
            f"{_patch_label(k * p.width, k * length)}, damper {k:g} times as large",
            _lengths({name: k * value for name, value in whole.items()}),
        )
    elif hasattr(p, "pad_gap") and hasattr(p, "pad_length"):
        for k in _PATCHES:
            # the damper keeps its length
            gap = p.pad_gap + 2.0 * (1.0 - k) * p.pad_width
            smaller = {"pad_length": k * p.pad_length, "pad_width": k * p.pad_width, "pad_gap": gap}
            yield f"pads {k * p.pad_width:g} x {k * p.pad_length:g} mm", _lengths(smaller)


def _patch_label(width: float, length: float) -> str:
    return f"patch {width:g} x {length:g} mm"


def _lengths(values: Mapping[str, float]) -> Overrides:
    return tuple((f"geometry.{name}", f"{value!r} mm") for name, value in values.items())


def _distant_sets(scene: Scene, plan: Plan[Any]) -> dict[str, list[str]]:
    """Names of the sets that may be held, body by body.

    Sets of a single node leave the body free to turn and are left out.
    """
    meshes, _ = recipes.build_mesh(scene.recipe, plan.parameters)
    return {
        body: [
            name.removeprefix("distant_")
            for name, nodes in mesh.nodes.items()
            if name.startswith("distant_") and len(nodes) > 2
        ]
        for body, mesh in meshes.items()
    }


def parameter_rows(scene: Scene, solved: Iterable[SolvedPoint]) -> list[Row]:
    """Stiffnesses at the first normal load of every point, then the printed ones where the geometry
    has been published.
    """
    out = []
    for one in solved:
        first: dict[str, float] = {}
        for (name, _), value in one.values.items():
            first.setdefault(name, value)
        found = {name: first[name] for name in _NAMES if name in first}
        out.append((one.point.label, found, one.outcome.failure.split(";")[0][:60]))
    return [*out, *_printed_rows(scene)]


def _printed_rows(scene: Scene) -> list[Row]:
    look_up = printed_of(scene)
    printed = {name: found[0] for name in _NAMES if len(found := look_up(name, {})) == 1}
    sources = dict.fromkeys(one.source for one in printed.values())
    out = []
    for source in sources:
        values = {name: one.value for name, one in printed.items() if one.source == source}
        along, across = (
            values.get(f"K_T{axis}_initial_raw", values.get(f"K_T{axis}_per_pad")) for axis in "xy"
        )
        out.append(
            (f"{source} (one K_T)" if along is not None and along == across else source, values, "")
        )
    return out


def _report(scene: Scene, solved: Sequence[SolvedPoint], names: Sequence[str]) -> StudyReport:
    """Stiffnesses of every point, a row each."""
    del names
    rows = parameter_rows(scene, solved)
    there = {name for _, values, _ in rows for name in values}
    wanted = [PER_PAD[n] if PER_PAD.get(n) in there else n for n in STIFFNESSES]
    shown = [name for name in wanted if name in there]

    def cell(name: str, row: Row) -> str:
        _, values, failure = row
        if failure:
            return failure if name == shown[0] else ""
        return f"{1e-6 * values[name]:.4g}" if name in values else ""

    columns = ((number_label(name), "r", partial(cell, name)) for name in shown)
    setup = ("setup", "l", lambda row: str(row[0]))
    table = make_table("What moves the stiffness, 1e6 N/mm", (setup, *columns), rows)
    return StudyReport((table,), bool(without_failed(solved)))


LADDERS: Mapping[str, Ladder] = {
    **ladders.ladders(_usual, FLAT_GOVERNING, _ACCURACIES),
    "parameters": Ladder(
        parameter_points, report=_report, title=lambda scene, vary: "what moves the stiffness"
    ),
}
