"""What varies in a contact: its mesh, coarser for the errors of its numbers and finer for a wanted
accuracy, and loads near a curved contact's own, which move its edge between the nodes; in
convergence studies meshes, elements, solvers, load steps, accuracies, the patch of a curved
contact, and what moves the stiffness of a flat one.

Of a curved contact the meshes of an accuracy are sized from the load. Those of a flat one have
elements of 20 nodes. At the edges of flat faces pressure grows without a limit, so a stiffness
converges with order 1 in the end on any element; but what 8 nodes leave of bodies and of the bands
that hold them is larger for long: K_N of the ready wedge is 4.421e6 N/mm on 8 divisions of 20 nodes
(7 s), 4.455e6 on 16 of 8 nodes (12 s), about 4.40e6 in the limit.

A damper that wires press along narrow bands across its length (`pads_platform`) needs elements as
short along it as the bands, and as thin under them as at the contact, but longer ones across: of
K_N of a ready pad (about 7.91e5 N/mm in the limit) 18 x 8 elements leave 1.0 %, of which 36 x 8
take 0.5; 28 x 6 leave 0.8 % on fewer dofs. Its levels have twice as many elements along the contact
to those across as the scene has, half as thick as they are long, so that the layers of the pads are
in proportion too. With sizes that grow from the contact to the wires, what those leave falls in no
order beside what the contact leaves.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Plan
from upd.analyses.contact.plan import (
    ContactPlan,
    auto_patch,
    hertz_radius,
    is_curved,
    make_plan,
    refined_growth,
)
from upd.analyses.contact.results import make_results
from upd.analyses.contact.solution import ContactSolution, NormalCase
from upd.analyses.contact.solve import solve_normal, solve_plan, solve_tangential
from upd.analyses.cost import NODES
from upd.errors import InputError, UpdError
from upd.linalg import select
from upd.mesh import recipes
from upd.progress import Stages
from upd.results import Case
from upd.scene import Scene
from upd.scene.contact import Loads
from upd.vary.curves import points_table
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
from upd.vary.orders import RADIUS, Samples
from upd.vary.outcome import SolvedPoint, matching, without_failed
from upd.vary.solve import MESH
from upd.vary.variation import (
    ALONE,
    COARSER,
    Key,
    LevelChoice,
    Levels,
    Overrides,
    Problem,
    Variation,
    of_geometry,
)
from upd.vary.wanted import plan_wanted

#: fewest divisions of a level
FEWEST = 4
_COARSEST = f"the mesh cannot be made coarser: give geometry.divisions, {FEWEST + 2} or more"
#: outputs that a level need not give: no number of them is estimated, and they cost
_SPARED = ("fields", "curve")
#: parameters of a recipe that the load may size
SIZED_BY_LOAD = ("patch", "core_depth")
#: Numbers that one accuracy for all is asked of, of a curved contact: those of the normal contact.
#: The others carry their estimate beside them; a slip annulus thinner than an element converges
#: late and would multiply the cost of every run.
CURVED_GOVERNING = ("radius_moment", "max_pressure", "mean_pressure", "approach")
#: Nodes along the contact radius of the smallest load, level by level (ratio about sqrt 2).
_NODES = (3.0, 4.2, 6.0, 8.5, 12.0, 17.0, 24.0)
#: Growth of neighbouring elements (when the scene gives none) on a level with that many nodes along
#: the radius.
_GROWTH, _GROWTH_AT = 1.5, 6.0
#: And of a flat one: stiffnesses. The pressure at the edges of flat faces
#: grows under refinement without a limit.
FLAT_GOVERNING = ("K_N_secant_raw", "K_Tx_initial_raw", "K_Ty_initial_raw", "K_*_per_pad")
#: shares of the scene's divisions, ratio about sqrt 2
_SHARES = (0.35, 0.5, 0.71, 1.0, 1.41, 2.0, 2.83, 4.0)
#: likewise where wires press, nearer to each other: with half the elements along each edge a level
#: takes a fifteenth of the seconds, and only four show whether an order holds
_SHARES_OF_WIRES = (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0)
#: levels a plan predicts: the third is the first that shows an order
_PREDICTED = 3
#: thickness of the elements under wires and at the contact, where wires press
_UNDER_WIRES, _AT_CONTACT = 1.0, 0.5
#: element of the levels of a scene with one of 8 nodes
_ELEMENT: Final = "hex20"
#: places of the edge, in spacings from its own. What an edge between nodes leaves is periodic in it
#: with one spacing (a sphere's deviations correlate by 0.3 to 0.7 one spacing on, by -0.3 to -0.7
#: half of one): two places a period are the fewest that show it (Nyquist), whole spacings alone
#: show one phase of it and bound 3 of 4. Over how many periods is a matter of cost: one each way
#: bounds as well and overrates more, further ones overrate little less (``benchmarks/run.py
#: accuracy/estimates``)
PLACES = np.array([-2.0, -1.5, -1.0, -0.5, 0.5, 1.0, 1.5, 2.0])
#: most steps of a neighbour's cycle, the fewest there are: its energy is the same but for rounding
_FEWEST_STEPS = 8


def level_geometry(
    parameters: Mapping[str, Any], divisions: int, *, step: int = 2, per_edge: int = 1
) -> dict[str, Any]:
    """Parameters of the recipe that change with the divisions of its contact.

    Parameters
    ----------
    parameters
        Of the plan.
    divisions
        Of the level, even.
    step
        Of the numbers of elements along the contact: 2 for recipes that take even ones only.
    per_edge
        Spacings of nodes along the edge of an element, over those of the plan.

    Returns
    -------
    dict
        "divisions", and "divisions_long" and "growth" of recipes that have them: elements along
        the contact in proportion, the far mesh refined with it.
    """
    usual = int(parameters["divisions"])
    out: dict[str, Any] = {"divisions": divisions}
    if "divisions_long" in parameters:
        long = divisions * int(parameters["divisions_long"]) / (step * usual)
        out["divisions_long"] = step * max(1, round(long))
    if "growth" in parameters:
        ratio = usual / (per_edge * divisions)
        out["growth"] = round(refined_growth(float(parameters["growth"]), ratio), 4)
    return out


def coarser_divisions(plan: ContactPlan, ratios: Sequence[float]) -> list[int]:
    """Divisions of the levels about so many times coarser, each different from the others.

    Even ones about the middle of a curved contact. Where the coarsest would have too few, the
    levels stand closer together.
    """
    usual = plan.parameters.get("divisions")
    if not isinstance(usual, int) or usual <= FEWEST:
        return []
    step = 2 if is_curved(plan.scene) else 1
    first, last = min(ratios), min(max(ratios), usual / FEWEST)
    found: list[int] = []
    for ratio in np.geomspace(first, max(first, last), len(ratios)):
        n = max(FEWEST, step * round(usual / ratio / step))
        if n < min((usual, *found)):
            found.append(n)
    return found


def size_of(parameters: Mapping[str, Any]) -> float:
    """Size of the contact's elements in mm but for a factor, of both directions the geometric
    mean: over the edge that is divided, or 1 of a recipe that names none.
    """
    edges = ("patch", "patch_length", "pad_length")
    edge = next((float(parameters[n]) for n in edges if n in parameters), 1.0)
    counts = [float(parameters[n]) for n in ("divisions", "divisions_long") if n in parameters]
    return float(edge * np.prod(counts) ** (-1.0 / len(counts)))


def _on_mesh(
    source: str, plan: Plan[Any], geometry: Mapping[str, Any], *extra: tuple[str, Any]
) -> Variation:
    """The plan's scene with a mesh of other divisions."""
    known = {**plan.parameters, **geometry}
    counts = (str(known[n]) for n in ("divisions_long", "divisions") if n in known)
    label = " x ".join(counts) + " divisions"
    return Variation(source, label, (*of_geometry(geometry), *extra), size_of(known))


def bare(scene: Scene) -> Overrides:
    """Overrides without what costs and shows no number; of a cycle no more steps than usual,
    which only its drawing needs.
    """
    steps = min(scene.loads.cycle_steps, Loads.cycle_steps)
    want = tuple(w for w in scene.want if w not in _SPARED) or scene.want
    return (("loads.cycle_steps", steps), ("want", want), *ALONE)


def coarsened(plan: ContactPlan) -> Overrides:
    """What makes scenes into the level with half the divisions of the plan.

    A patch that the load may size follows the contact from one end of an input to the other, so
    that the same nodes touch: a tangent stiffness changes as the contact does, not by whole nodes.
    """
    half = coarser_divisions(plan, (2.0,))
    geometry = level_geometry(plan.parameters, half[0]) if half else {}
    names = SIZED_BY_LOAD if plan.scene.sphere_radius is not None else ()
    sized = {name: "auto" for name in names if name in plan.scene.geometry}
    return (*bare(plan.scene), *of_geometry(sized | geometry))


def levels(plan: ContactPlan) -> Levels:
    """The coarser meshes that the errors of the plan's numbers are estimated with.

    None for a recipe without divisions.
    """
    # Neighbouring loads show on half the divisions what the dearest level would.
    ratios = COARSER[1:] if has_neighbours(plan.scene) else COARSER
    made = [
        _on_mesh(MESH, plan, level_geometry(plan.parameters, n))
        for n in coarser_divisions(plan, ratios)
    ]
    own = size_of(plan.parameters) if made else 1.0
    return {MESH: [replace(one, size=one.size / own) for one in made] or _COARSEST}


def governing(scene: Scene) -> dict[str, str]:
    """Names of the numbers (shell patterns) that one accuracy for all is asked of."""
    names = CURVED_GOVERNING if is_curved(scene) else FLAT_GOVERNING
    return {name: name for name in names}


def choices(scene: Scene) -> list[LevelChoice]:
    """The meshes that an accuracy chooses from."""
    if is_curved(scene):
        words = "with {:g} nodes along the radius"
        return [LevelChoice(MESH, "mesh", words, _NODES, _curved_level)]
    found = _flat_levels(scene)
    return [LevelChoice(MESH, "mesh", "{} divisions", list(found), lambda _, n: found[n])]


def _curved_level(scene: Scene, nodes: float) -> Overrides:
    """Patch and divisions with so many nodes along the radius.

    A patch sized from the largest load, no larger than the scene's, spacing from the smallest.
    """
    patch = auto_patch(scene)
    radius = hertz_radius(scene, min(F for F in scene.loads.forces if F > 0.0))
    if scene.geometry.get("patch", "auto") != "auto":
        patch = min(patch, float(scene.geometry["patch"]))
    divisions = 2 * math.ceil(0.5 * patch / radius * nodes)
    if NODES[scene.mesh.element] > 8:
        divisions = 2 * math.ceil(divisions / 4)
    geometry: dict[str, Any] = {"patch": patch, "divisions": max(4, divisions)}
    if recipes.has_parameter(scene.recipe, "growth"):
        # The far mesh is refined with the patch.
        usual, ratio = float(scene.geometry.get("growth", _GROWTH)), _GROWTH_AT / nodes
        geometry["growth"] = round(refined_growth(usual, ratio), 4)
    return of_geometry(geometry)


def _flat_levels(scene: Scene) -> dict[int, Overrides]:
    """Divisions -> what gives the scene a share of its own, and more."""
    if not isinstance(scene.geometry.get("divisions"), int):
        raise InputError(
            f"accuracy: the recipe {scene.recipe!r} has no divisions to choose; leave it out"
        )
    element = _ELEMENT if scene.mesh.element in ("hex8", "hex8i") else scene.mesh.element
    wires, geometry = recipes.has_parameter(scene.recipe, "bottom_layer"), scene.geometry
    if wires:
        # half of its divisions across, and thin elements under the wires
        under = geometry.get("bottom_layer")
        geometry = {
            **geometry,
            "divisions": 2 * max(1, round(0.25 * geometry["divisions"])),
            "bottom_layer": _UNDER_WIRES if under is None else under,
            "first_layer": min(_AT_CONTACT, geometry["first_layer"]),
        }
    usual, fewest = geometry["divisions"], 2 if wires else FEWEST
    shares = _SHARES_OF_WIRES if wires else _SHARES
    found: dict[int, Overrides] = {}
    for n in (max(fewest, 2 * round(0.5 * share * usual)) for share in shares):
        own = level_geometry(geometry, n, step=1 if wires else 2)
        found[n] = (("mesh.element", element), ("geometry", {**geometry, **own}))
    return found


def finer(plan: ContactPlan, source: str, factor: float) -> Overrides:
    """A mesh with elements so many times smaller."""
    del source
    usual = plan.parameters.get("divisions", 1)
    divisions = 2 * max(1, round(0.5 * factor * int(usual)))
    return of_geometry(level_geometry({"divisions": usual, **plan.parameters}, divisions))


# -- neighbouring loads ----------------------------------------------------------------------------


def has_neighbours(scene: Scene) -> bool:
    """Whether neighbouring loads are cheap: not where the pressure follows the shear, as every load
    then is the end of a march.
    """
    return is_curved(scene) and not scene.coupled and max(scene.loads.forces) > 0


def neighbours(touching: int) -> list[float]:
    """Logarithms of neighbouring loads over a load.

    Parameters
    ----------
    touching
        Nodes in contact, N: its radius is sqrt(N / pi) spacings. Neighbours have a radius of one at
        least.
    """
    if touching <= np.pi:
        return []
    spacing = float(np.sqrt(np.pi / touching))
    steps: NDArray[np.float64] = np.sign(PLACES) * np.log1p(np.abs(PLACES) * spacing) / RADIUS
    return [float(t) for t in steps if np.exp(RADIUS * t) >= spacing]


def sample(solution: ContactSolution) -> Samples:
    """The numbers of every loaded case at neighbouring loads.

    They move the contact's edge by up to one spacing of the lattice each way, on the same condensed
    bodies. What the finite bodies add to a displacement is taken in proportion to the load: it
    knows the total force only. A load whose contact reaches the rim of the patch is omitted.

    Returns
    -------
    Samples
        Empty where a neighbour is not cheap.
    """
    if not has_neighbours(solution.plan.scene):
        return {}
    found: dict[tuple[str, Case], list[tuple[float, float]]] = {
        (r.name, r.case): [(0.0, r.value)]
        for r in make_results(solution, misfits=False)
        if not r.withheld and r.case.load
    }
    for case in solution.normal:
        touching = int(np.count_nonzero(solution.model.patch.whole(case.solution.force) > 0.0))
        for t in neighbours(touching) if case.force > 0.0 else ():
            for name, of, value in _values(solution, case, case.force * float(np.exp(t))):
                key = name, replace(of, load=case.force)
                if key in found:
                    found[key].append((t, value))
    return {key: np.array(rows) for key, rows in found.items()}


def _values(
    solution: ContactSolution, case: NormalCase, load: float
) -> list[tuple[str, Case, float]]:
    """The numbers at a load near the case's; none where it is too large for the patch."""
    plan, loads = solution.plan, solution.plan.scene.loads
    loads = replace(loads, normal=(load,), cycle_steps=min(loads.cycle_steps, _FEWEST_STEPS))
    inside = "internal displacement"
    effects = tuple(replace(e, on=e.on and e.name != inside) for e in plan.effects)
    want = tuple(w for w in plan.scene.want if w not in _SPARED)
    plan = replace(plan, scene=replace(plan.scene, want=want, loads=loads), effects=effects)
    near = ContactSolution(plan, solution.model)
    try:
        solve_normal(near, Stages())
        (one,) = near.normal
        if near.rim_nodes(one):
            return []
        one.shares = {body: s.over(case.force / load) for body, s in case.shares.items()}
        one.shear_shares = case.shear_shares
        if near.plan.effect("friction"):
            solve_tangential(near, Stages())
        return [
            (r.name, r.case, r.value) for r in make_results(near, misfits=False) if not r.withheld
        ]
    except UpdError:
        # The load itself was solved: a neighbour that is not is a sample less.
        return []


PROBLEM = Problem(
    make_plan,
    solve_plan,
    make_results,
    bare,
    levels,
    finer,
    sample,
    choices=choices,
    governing=governing,
    level_of=lambda plan: _on_mesh(MESH, plan, {}),
    predicted=_PREDICTED,
)


# -- convergence studies --------------------------------------------------------------------------

#: numbers a ladder follows beside those the analysis names first
_NUMBERS = (
    "mean_pressure",
    "approach",
    "tangential_displacement",
    "K_N_secant_raw",
    "K_Tx_initial_raw",
    "K_Ty_initial_raw",
    "law_k_n",
    "cycle_energy",
)
#: element -> finest divisions: quadratic elements cost several times as much for the same patch
_FINEST = {"hex8": math.inf, "hex8i": math.inf, "hex20": 28, "hex27": 20}
#: solver -> how many of the levels it can afford
_AFFORDABLE: Mapping[str, int | None] = {"pardiso": None, "superlu": 4, "amg": 3}
_ACCURACY_NOTES = (
    "estimated: by the run itself, a bound; true: against the closed form, where a number has one",
    "the accuracy is asked of these numbers alone; where one mesh reaches two accuracies, both "
    "levels are that mesh",
)
#: usual divisions across the patch of a curved contact; shares of a flat scene's own: spacing from
#: twice to half of it
_DIVISIONS, _STUDY_SHARES = (12, 16, 20, 28, 40, 56), (0.5, 0.67, 1.0, 1.34, 1.67)
#: usual accuracies in per cent, of a curved contact (3 % takes 7 GB on the ready sphere, 2 % 24 GB)
#: and of a flat one
_ACCURACIES, _FLAT_ACCURACIES = (40.0, 10.0, 3.0), (20.0, 10.0, 5.0)
#: numbers of the table of what moves the stiffness, of one pad where the contact is two
_STIFFNESSES = ("K_N_secant_raw", "K_N_*_alone", "K_Tx_initial_raw", "K_Ty_initial_raw")
_PER_PAD = ("K_N_per_pad", "K_N_*_alone", "K_Tx_per_pad", "K_Ty_per_pad")
#: lengths of a recipe, and times of them that are tried
_FACTORS = {
    **dict.fromkeys(("margin", "thickness"), (0.25, 0.5, 1.5)),
    **dict.fromkeys(("patch_length", "patch_width", "pad_length"), (0.8, 0.6, 0.4)),
    "band": (0.2,),
}

#: plan, divisions across the patch -> variations
Maker = Callable[[Plan[Any], Sequence[int]], Iterable[Variation]]


def _on_meshes(make: Maker, applies: Callable[[Scene], bool] = lambda scene: True) -> Ladder:
    """Variations on meshes of so many divisions across the patch: even numbers."""

    def variations(scene: Scene, asked: Asked) -> Iterable[Variation]:
        plan = plan_wanted(PROBLEM, scene)
        divisions: Sequence[int] = whole_levels(asked, 4, "even numbers of divisions", step=2)
        if not divisions and is_curved(scene):
            divisions = _DIVISIONS
        elif not divisions:
            usual = int(plan.parameters["divisions"])
            divisions = tuple(dict.fromkeys(even(share * usual) for share in _STUDY_SHARES))
        return dict.fromkeys(make(plan, divisions))

    return Ladder(variations, _NUMBERS, applies=applies)


def _meshes(plan: Plan[Any], levels: Sequence[int]) -> list[Variation]:
    element = plan.scene.mesh.element
    return [_studied(element, element, n, plan) for n in levels]


def _elements(plan: Plan[Any], levels: Sequence[int]) -> list[Variation]:
    chosen = ((e, max(4, 2 * (n // 4)) if e == "hex27" else n) for e in _FINEST for n in levels)
    return [_studied(e, e, n, plan) for e, n in chosen if n <= _FINEST[e]]


def _solvers(plan: Plan[Any], levels: Sequence[int]) -> list[Variation]:
    return [
        _studied(solver, plan.scene.mesh.element, n, plan, ("solver.name", solver))
        for solver, most in _AFFORDABLE.items()
        if solver != "pardiso" or select.has_pardiso()
        for n in levels[:most]
    ]


def _studied(
    source: str, element: str, divisions: int, plan: Plan[Any], *extra: tuple[str, Any]
) -> Variation:
    per_edge = 2 if NODES[element] > 8 else 1
    own = level_geometry(plan.parameters, divisions, per_edge=per_edge)
    return _on_mesh(source, plan, own, ("mesh.element", element), *extra)


def _patches(plan: Plan[Any], levels: Sequence[int]) -> Iterator[Variation]:
    """The edge of the patch at constant node spacing."""
    del levels
    patch, divisions = float(plan.parameters["patch"]), int(plan.parameters["divisions"])
    for factor in (0.6, 0.8, 1.0, 1.3, 1.6):
        n = even(factor * divisions)
        edge = patch * n / divisions
        overrides = (*_lengths({"patch": edge}), ("geometry.divisions", n))
        yield Variation("patch", f"{edge:.3g} mm", overrides, patch / divisions)


def _accuracies(scene: Scene, asked: Asked) -> list[Variation]:
    """The scene at one accuracy after the other."""
    wanted: Sequence[float] = _ACCURACIES if is_curved(scene) else _FLAT_ACCURACIES
    if asked is not None:
        words = "errors in per cent, between 0 and 100, for example --levels 5 2 1"
        wanted = chosen_levels(asked, lambda p: 0.0 < p < 100.0, words)[::-1]
    return [
        Variation("accuracy", f"{p:g} %", (("accuracy", p / 100.0),), p / 100.0) for p in wanted
    ]


def parameter_points(scene: Scene, asked: Asked = None) -> list[Variation]:
    """The scene as given, then with one parameter changed at a time.

    Lengths of block and patch, distant sets, tilt, friction. Raises InputError for levels, and when
    the scene leaves the mesh to an accuracy.
    """
    no_levels(asked, "a parameter study changes one parameter at a time")
    plan, found = plan_wanted(PROBLEM, scene), list[tuple[str, Overrides]]([("as given", ())])
    for name, factors in _FACTORS.items():
        length = plan.parameters.get(name)
        for value in (factor * length for factor in factors if isinstance(length, float)):
            found.append((f"{name} {value:g} mm", _lengths({name: value})))
    for body, mesh in recipes.build_mesh(scene.recipe, plan.parameters)[0].items():
        for key, nodes in mesh.nodes.items():
            name = key.removeprefix("distant_")
            # fewer than three nodes leave a body free to turn
            if name not in (key, scene.contact.distant.get(body)) and len(nodes) > 2:
                found.append((f"{body} held at {name}", ((f"contact.distant.{body}", name),)))
    other = "free" if scene.contact.tilt == "held" else "held"
    found.append((f"tilt {other}", (("contact.tilt", other),)))
    # The normal force goes with the friction when it comes from an equilibrium.
    others = (mu for mu in (0.3, 1.0) if mu != scene.contact.friction)
    found += [(f"mu = {mu:g}", (("contact.friction", mu),)) for mu in others]
    return [Variation("parameters", label, overrides, 1.0) for label, overrides in found]


def _lengths(values: Mapping[str, float]) -> Overrides:
    return of_geometry({name: f"{value!r} mm" for name, value in values.items()})


def _stiffnesses(scene: object, solved: Sequence[SolvedPoint], names: Sequence[str]) -> StudyReport:
    """Stiffnesses of every point at its first normal load."""
    del scene, names
    first: dict[str, Key] = {}
    for key in matching(solved, _PER_PAD if matching(solved, _PER_PAD[:1]) else _STIFFNESSES):
        first.setdefault(key[0], key)
    table = points_table(solved, list(first.values()))
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
        report=lambda scene, solved, names: accuracy_report(scene, solved, [*governing(scene)]),
        notes=lambda scene: _ACCURACY_NOTES,
    ),
    "patch": _on_meshes(_patches, is_curved),
    "parameters": Ladder(
        parameter_points,
        report=_stiffnesses,
        title=lambda scene, vary: "what moves the stiffness",
        applies=lambda scene: not is_curved(scene),
    ),
}
