"""What a convergence study of a contact varies: meshes, elements, solvers, load steps, accuracies,
the patch of a curved contact, and what moves the stiffness of a flat one: one parameter of the
scene at a time, each beside the scene as given.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from upd.analyses import analysis_of
from upd.analyses.base import Plan
from upd.analyses.contact.plan import is_curved, refined_growth
from upd.analyses.contact.results import printed_of
from upd.analyses.contact.varied import governing
from upd.linalg import select
from upd.mesh import recipes
from upd.results.quantities import number_label
from upd.scene import Scene
from upd.vary.ladder import (
    Asked,
    Ladder,
    StudyReport,
    accuracy_report,
    chosen_levels,
    counts,
    even,
    finest_report,
    no_levels,
    whole_levels,
)
from upd.vary.outcome import SolvedPoint, without_failed
from upd.vary.tables import make_table
from upd.vary.variation import Overrides, Variation

#: numbers a ladder follows beside those the analysis names first
_NUMBERS = (
    "mean_pressure",
    "approach",
    "tangential_displacement",
    "K_N_secant_raw",
    "K_Tx_initial_raw",
    "K_Ty_initial_raw",
    "approach_damper",
    "approach_platform",
    "law_k_n",
    "cycle_energy",
)
_ELEMENTS = ("hex8", "hex8i", "hex20", "hex27")
#: element -> finest divisions: quadratic elements cost several times as much for the same patch
_FINEST = {"hex20": 28, "hex27": 20}
#: solver -> how many of the levels it can afford
_AFFORDABLE: Mapping[str, int | None] = {"pardiso": None, "superlu": 4, "amg": 3}
#: names a recipe gives to the edge that is divided
_EDGES = ("patch", "patch_length", "pad_length")
_ACCURACY_NOTES = (
    "estimated: by the run itself, a bound; true: against the closed form, where a number has one",
    "the accuracy is asked of these numbers alone; where one mesh reaches two accuracies, both "
    "levels are that mesh",
)

#: usual divisions across the patch of a curved contact; shares of a flat scene's own: spacing from
#: twice to half of it
_DIVISIONS, _SHARES = (12, 16, 20, 28, 40, 56), (0.5, 0.67, 1.0, 1.34, 1.67)
#: usual accuracies in per cent, of a curved contact (3 % takes 7 GB on the ready sphere, 2 % 24 GB)
#: and of a flat one
_ACCURACIES, _FLAT_ACCURACIES = (40.0, 10.0, 3.0), (20.0, 10.0, 5.0)
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
_SMALLER = (0.8, 0.6, 0.4)
#: lengths of the wedge's patch with the bands over it, and of its damper
_WEDGE_PATCH = ("patch_length", "patch_width", "band")
_WEDGE = ("base", "height", "length", "patch_offset", "wire_position", "wire_width")

#: what a row is of, number -> value, why it failed
Row = tuple[str, dict[str, float], str]
#: plan, divisions across the patch -> variations
Maker = Callable[[Plan[Any], Sequence[int]], Iterable[Variation]]


def _on_meshes(make: Maker, applies: Callable[[Scene], bool] = lambda scene: True) -> Ladder:
    """Variations on meshes of so many divisions across the patch: even numbers."""

    def variations(scene: Scene, asked: Asked) -> Iterable[Variation]:
        plan = analysis_of(scene).make_plan(scene)
        divisions = whole_levels(asked, 4, "even numbers of divisions", step=2) or _usual(plan)
        return dict.fromkeys(make(plan, divisions))

    return Ladder(variations, _NUMBERS, applies=applies)


def _usual(plan: Plan[Any]) -> Sequence[int]:
    if is_curved(plan.scene):
        return _DIVISIONS
    usual = int(plan.parameters["divisions"])
    return tuple(dict.fromkeys(even(share * usual) for share in _SHARES))


def _meshes(plan: Plan[Any], levels: Sequence[int]) -> list[Variation]:
    element = plan.scene.mesh.element
    return [_on_mesh(element, element, n, plan) for n in levels]


def _elements(plan: Plan[Any], levels: Sequence[int]) -> list[Variation]:
    chosen = [(e, max(4, 2 * (n // 4)) if e == "hex27" else n) for e in _ELEMENTS for n in levels]
    return [_on_mesh(e, e, n, plan) for e, n in chosen if n <= _FINEST.get(e, n)]


def _solvers(plan: Plan[Any], levels: Sequence[int]) -> list[Variation]:
    known = [s for s in _AFFORDABLE if s != "pardiso" or select.has_pardiso()]
    return [
        _on_mesh(s, plan.scene.mesh.element, n, plan, ("solver.name", s))
        for s in known
        for n in levels[: _AFFORDABLE[s]]
    ]


def _on_mesh(
    source: str, element: str, divisions: int, plan: Plan[Any], *extra: tuple[str, Any]
) -> Variation:
    given = plan.parameters
    patch, usual = float(next(given[e] for e in _EDGES if e in given)), int(given["divisions"])
    nodes = 2 * divisions if element in ("hex20", "hex27") else divisions
    overrides: Overrides = (("geometry.divisions", divisions), ("mesh.element", element), *extra)
    long = divisions
    if "divisions_long" in given:
        long = 2 * max(1, round(divisions * int(given["divisions_long"]) / (2 * usual)))
        overrides += (("geometry.divisions_long", long),)
    if "growth" in given:
        growth = refined_growth(float(given["growth"]), usual / nodes)
        overrides += (("geometry.growth", round(growth, 4)),)
    return Variation(source, f"{long} x {divisions}", overrides, patch / divisions)


def _patches(plan: Plan[Any], levels: Sequence[int]) -> Iterator[Variation]:
    """The edge of the patch at constant node spacing."""
    del levels
    patch, divisions = float(plan.parameters["patch"]), int(plan.parameters["divisions"])
    for factor in (0.6, 0.8, 1.0, 1.3, 1.6):
        n = even(factor * divisions)
        edge = patch * n / divisions
        overrides = (("geometry.patch", f"{edge!r} mm"), ("geometry.divisions", n))
        yield Variation("patch", f"{edge:.3g} mm", overrides, patch / divisions)


def _accuracies(scene: Scene, asked: Asked) -> list[Variation]:
    """The scene at one accuracy after the other."""
    usual = _ACCURACIES if is_curved(scene) else _FLAT_ACCURACIES
    words = "errors in per cent, between 0 and 100, for example --levels 5 2 1"
    wanted = (
        usual if asked is None else chosen_levels(asked, lambda p: 0.0 < p < 100.0, words)[::-1]
    )
    return [
        Variation("accuracy", f"{p:g} %", (("accuracy", p / 100.0),), p / 100.0) for p in wanted
    ]


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
    yield from _smaller_patches(scene.recipe, p)
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


def _smaller_patches(recipe: str, parameters: Mapping[str, Any]) -> Iterable[tuple[str, Overrides]]:
    """Smaller patches on the same damper, a lower one, and the damper smaller with its patch."""
    p = recipes.made(recipe, parameters)
    if hasattr(p, "patch_width") and hasattr(p, "band"):
        length = p.patch_length
        sizes = {"patch_length": length, "patch_width": p.width, "band": p.band}
        for k in _SMALLER:
            smaller = {name: k * sizes[name] for name in _WEDGE_PATCH}
            yield _patch_label(k * p.width, k * length), _lengths(smaller)
        k = _SMALLER[-1]
        yield _patch_label(p.width, k * length), _lengths({"patch_length": k * length})
        whole = sizes | {name: getattr(p, name) for name in _WEDGE}
        yield (
            f"{_patch_label(k * p.width, k * length)}, damper {k:g} times as large",
            _lengths({name: k * value for name, value in whole.items()}),
        )
    elif hasattr(p, "pad_gap") and hasattr(p, "pad_length"):
        for k in _SMALLER:
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


#: without coupling not even the cycle's energy depends on its load steps
_STEPS = counts(
    "steps",
    "{} load steps",
    "loads.cycle_steps",
    (10, 20, 40, 80, 160),
    8,
    (("want", ["cycle"]), ("left_out.solve", "no")),
)

LADDERS: Mapping[str, Ladder] = {
    "mesh": _on_meshes(_meshes),
    "element": _on_meshes(_elements),
    "solver": _on_meshes(_solvers),
    "steps": Ladder(_STEPS, _NUMBERS, finest_report, applies=lambda scene: scene.coupled),
    "accuracy": Ladder(
        _accuracies,
        report=lambda scene, solved, names: accuracy_report(scene, solved, governing(scene)),
        notes=lambda scene: _ACCURACY_NOTES,
    ),
    "patch": _on_meshes(_patches, is_curved),
    "parameters": Ladder(
        parameter_points,
        report=_report,
        title=lambda scene, vary: "what moves the stiffness",
        applies=lambda scene: not is_curved(scene),
    ),
}
