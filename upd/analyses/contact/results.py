"""ContactSolution -> the flat list of numbers, each beside its closed form and what was printed of
it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses import base
from upd.analyses.contact.plan import direction_name, normal_loads
from upd.analyses.contact.solution import ContactSolution, NormalCase, References, TangentialCase
from upd.contact.law import ContactLaw, contact_points
from upd.contact.patch import consistent_average
from upd.mesh import recipes
from upd.plot.chart import Entry
from upd.reference.printed import Lookup, Printed
from upd.results import Case, ErrorPart, Result, with_parts
from upd.results import quantities as q
from upd.results.quantities import Quantity
from upd.scene import Scene

Array = NDArray[np.float64]
# How errors were estimated.
_BETTI = "Betti's theorem: displacements less those of half-spaces and of the bodies' share"
# Sources of numbers of a contact whose edge is located between nodes.
_LOCATED: References = {
    q.CONTACT_AREA.name: (None, "edge located between nodes"),
    q.MEAN_PRESSURE.name: (None, "load over the located area"),
    q.CONTACT_AREA_NODES.name: (None, "tributary areas of the nodes in contact"),
}
# Of a sum of three.
_ROUNDING = 4.0 * float(np.finfo(float).eps)

#: the numbers of a curved contact that matter, most important first
CURVED_HEADLINE = (
    "max_pressure",
    "radius_moment",
    "approach_contact",
    "K_N_tangent",
    "K_T_initial",
    "tangential_displacement",
    "stick_radius",
    "cycle_energy",
    "approach",
    "mean_pressure",
)
#: and of a flat one, whose largest pressure, at its edges, has no limit
FLAT_HEADLINE = (
    "F_N",
    "mean_pressure",
    "closed_share",
    "approach",
    "K_N_per_pad",
    "K_Tx_per_pad",
    "K_Ty_per_pad",
    "K_N_secant_raw",
    "K_Tx_initial_raw",
    "K_Ty_initial_raw",
    "K_N_tangent_raw",
    "law_k_n",
    "cycle_energy",
)
_MOST, _FEWEST = 8, 5
_RAW = "_raw"


def pick(results: Sequence[Entry], names: Sequence[str], *, last: bool = False) -> list[Entry]:
    """At most eight numbers, one per name of ``names`` that there is, in their order.

    Where few are found, the same numbers with the bulk compliance of the bodies in them ("..._raw")
    fill up.

    Parameters
    ----------
    last
        Of the last case that has the number, not of the first.
    """
    first: dict[str, Entry] = {}
    for entry in reversed(results) if last else results:
        first.setdefault(entry["name"], entry)
    few = sum(name in first for name in names) < _FEWEST
    found = [name if name in first or not few else name + _RAW for name in names]
    return [first[name] for name in found if name in first][:_MOST]


def make_results(solution: ContactSolution, *, misfits: bool = True) -> list[Result]:
    """All numbers of a run, case by case; without the ``misfits`` of tractions from their closed
    form where these would cost more than the contact.
    """
    scene, out = solution.plan.scene, []
    for state, balance in filter(None, normal_loads(scene).values()):
        at = Case(name="equilibrium", friction=state)
        out += [
            q.F_N.of(balance.normal_right, at),
            q.F_T.of(balance.tangential_right, at),
            q.F_N_OTHER_FACE.of(balance.normal_left, at),
        ]
    for case in solution.normal:
        known = solution.normal_references(case)
        out += _normal(solution, case, known)
        if scene.wants("stiffness") and case.force > 0.0:
            out += _stiffness(solution, case, known)
        if scene.wants("worn_zones"):
            out += _worn_zones(solution, case)
        if scene.wants("contact_law"):
            out += _law(solution, case)
        for t in (t for t in solution.tangential if t.normal is case):
            out += _tangential(solution, t, misfits=misfits)
        for path in (p for p in solution.paths if p.cycle and p.case.load == case.force):
            out += _beside(path.case, known, (q.CYCLE_ENERGY, path.slip_work))
    return base.with_printed(out, printed_of(scene))


def printed_of(scene: Scene) -> Lookup:
    """What was printed of the scene's bodies.

    Of a case with a normal load only where that is, to the newton it is printed with, a load of the
    ready scene; tables of closed forms print their loads themselves.
    """
    look_up, ready = base.printed_of(scene), base.ready_scene(scene)
    if ready is None or recipes.closed_form(scene.recipe):
        return look_up
    loads = {round(load) for load in normal_loads(ready)}

    def under_load(name: str, case: Mapping[str, Any]) -> tuple[Printed, ...]:
        load = case.get("load")
        return look_up(name, case) if load is None or round(load) in loads else ()

    return under_load


def _beside(case: Case, known: References, *rows: tuple[Quantity, float]) -> list[Result]:
    """Numbers of a case beside their closed forms, where they have one."""
    return [one.of(value, case, *known.get(one.name, (None, ""))) for one, value in rows]


def _area(solution: ContactSolution, area: Quantity) -> Quantity:
    """In um2 for a curved contact, in mm2 for flat faces."""
    return area.in_unit("um2") if solution.curved else area


# -- normal loads ----------------------------------------------------------------------------------


def _normal(solution: ContactSolution, case: NormalCase, known: References) -> list[Result]:
    m, at = case.measures, case.case
    resolution, out = m.area_resolution, list[Result]()
    if solution.curved:
        radii = m.radius_moment, m.radius_area, m.radius_outermost
        names = q.RADIUS_MOMENT, q.RADIUS_AREA, q.RADIUS_OUTERMOST
        out += _beside(at, known, *zip(names, radii, strict=True))
    out += _approach(case, known)
    rows = [
        (_area(solution, q.CONTACT_AREA), m.area),
        (_area(solution, q.CONTACT_AREA_NODES), m.area_nodes),
        (q.MAX_PRESSURE, m.max_pressure),
        (q.MEAN_PRESSURE, m.mean_pressure),
    ]
    if resolution is not None:
        rows.append((_area(solution, q.CONTACT_AREA_RESOLUTION), resolution))
    if solution.plan.effect("friction"):
        stick = solution.area_of(case.stick)
        rows.append((_area(solution, q.STICK_AREA), stick))
    out += _beside(at, known if resolution is None else _LOCATED, *rows)
    if not solution.curved:
        return out + _of_faces(solution, case)
    hertz = solution.hertz_of(case.force)
    if hertz is not None:
        out.append(q.CLOSED_FORM_ERROR.of(hertz.approach**2 / hertz.radius**2, at))
    return out


def _of_faces(solution: ContactSolution, case: NormalCase) -> list[Result]:
    """Share of the faces in contact, and tilts."""
    at = case.case
    whole = sum(float(k.area().sum()) for k in solution.lattices.values())
    out = [q.CLOSED_SHARE.of(100.0 * case.measures.area_nodes / whole, at)]
    if case.tilt is not None:
        out += [q.TILT_ABOUT_Y.of(case.tilt[0], at), q.TILT_ABOUT_X.of(case.tilt[1], at)]
    return out


def _approach(case: NormalCase, known: References) -> list[Result]:
    """The approach, less the bodies' share, that share, and within depth 3a; with the estimated
    error where one mesh shows it.
    """
    approach, bodies = case.solution.approach, case.finite_body
    rows = [(q.APPROACH, approach)]
    if case.shares:
        rows += [(q.APPROACH_CONTACT, approach - bodies), (q.APPROACH_FINITE_BODY, bodies)]
        rows.append((q.APPROACH_WITHIN_3A, _within_3a(case)))
    out = _beside(case.case, known, *rows)
    if case.mesh_error is not None:
        # raw, and with the bulk compliance removed: one mesh's error is in both
        for k, one in enumerate(out[:2]):
            near, far = (abs(e) * q.APPROACH.scale / abs(one.value) for e in case.mesh_error)
            parts = (
                ErrorPart("mesh at the contact", near, _BETTI),
                ErrorPart("mesh far away", far, _BETTI),
            )
            out[k] = with_parts(one, parts)
    return out


def _within_3a(case: NormalCase) -> float:
    """Approach within depth 3a, mm."""
    return case.solution.approach - sum(share.compression for share in case.shares.values())


# -- stiffness -------------------------------------------------------------------------------------


def _stiffness(solution: ContactSolution, case: NormalCase, known: References) -> list[Result]:
    # A secant counts from where the faces touch first; a gap that is left at the apex of a curved
    # body is the lattice's, an overlap is the file's.
    touch = float(solution.model.gap.min())
    touch = min(0.0, touch) if solution.curved else touch
    at, secant = case.case, case.force / (case.solution.approach - touch)
    raw = (q.K_N_TANGENT_RAW, case.stiffness), (q.K_N_SECANT_RAW, secant)
    out = _beside(at, known, *raw)
    if not solution.curved:
        return out + _stiffness_of_faces(solution, case, touch)
    bodies = case.finite_body / case.force
    K_N, rows = 1.0 / (1.0 / case.stiffness - bodies), list[tuple[Quantity, float]]()
    if case.shares:
        # Of the approach within 3a, 1.5 F / d as F goes with d^1.5, what the thesis takes for the
        # contact's (its section 6.5): 23 % of a half-space's displacement lies beyond 3a, so it is
        # 30 % above K_N by Hertz itself. On the coarsest meshes nothing is left within 3a.
        within = _within_3a(case)
        if within > _ROUNDING * case.solution.approach:
            rows.append((q.K_N_TANGENT_3A, 1.5 * case.force / within))
        rows += [(q.K_N_TANGENT, K_N), (q.K_N_SECANT, 1.0 / (1.0 / secant - bodies))]
    stuck = next((total for total, _ in case.stuck.values()), None)
    if stuck is not None and known:
        rows.append((q.K_T_INITIAL_RAW, stuck))
        if case.shear_shares:
            K_T = 1.0 / (1.0 / stuck - case.finite_body_shear)
            rows += [(q.K_T_INITIAL, K_T), (q.K_T_OVER_K_N, K_T / K_N)]
    return out + _beside(at, known, *rows)


def _stiffness_of_faces(solution: ContactSolution, case: NormalCase, touch: float) -> list[Result]:
    """Each body alone, along each direction; and of one pad where several share
    the contact: the total over their number.

    That is each pad's own when they carry equal forces; otherwise their mean.
    """
    at, n = case.case, len(solution.lattices)
    out = [
        q.K_N_ALONE.of(case.force / (one.solution.approach - touch), at, n=body)
        for body, one in case.alone.items()
    ]
    pads = [q.K_N_PER_PAD.of(case.force / (case.solution.approach - touch) / n, at)]
    for direction, (total, of) in case.stuck.items():
        way = direction_name(direction)
        out.append(q.K_T_ALL_STUCK.of(total, at, n=way))
        out += [q.K_T_ALONE.of(value, at, n=f"{way}_{body}") for body, value in of.items()]
        pads.append(q.K_T_PER_PAD.of(total / n, at, n=way))
    return out + pads if n > 1 else out


# -- of flat faces ---------------------------------------------------------------------------------


def _worn_zones(solution: ContactSolution, case: NormalCase) -> list[Result]:
    """Where the pressure peaks, report axes in mm: middle at half height of each peak of the force
    per length, centre of force across it.

    The outermost columns are left out: the edge of a flat punch has a peak of its own on any mesh.
    A peak stands out by a tenth of the largest value. Without lattice lines there is no force per
    length: no peak is sought, and none is counted.
    """
    # slow to import: only where it is called
    from scipy.signal import find_peaks, peak_widths

    faces = solution.lattices.values()
    if case.force <= 0.0 or not all(k.quads is None for k in faces):
        return []
    found: list[Array] = []
    for lattice in faces:
        force = lattice.whole(case.solution.force, extensive=True)[1:-1]
        # normal force per length along x, N/mm: over the length each column stands for
        X, lengths = lattice.X[1:-1], lattice.area().sum(axis=1)[1:-1] / np.ptp(lattice.Y)
        p = force.sum(axis=1) / lengths
        tops, _ = find_peaks(p, prominence=0.1 * float(p.max(initial=0.0)), plateau_size=1)
        _, _, left, right = peak_widths(p, tops, rel_height=0.5)
        places = np.arange(len(X))
        for begin, end in zip(left, right, strict=True):
            inside = (places >= begin) & (places <= end)
            middle, across = np.interp([begin, end], places, X).mean(), force[inside].sum(axis=0)
            found.append(np.array([middle, across @ lattice.Y / across.sum()]) - solution.corner)
    out = [q.PRESSURE_PEAKS.of(len(found), case.case)]
    for i, (x, y) in enumerate(found):
        out.append(q.PRESSURE_PEAK_X.of(x, case.case, n=i + 1))
        out.append(q.PRESSURE_PEAK_Y.of(y, case.case, n=i + 1))
    return out


def _law(solution: ContactSolution, case: NormalCase) -> list[Result]:
    law, at = contact_law(solution, case), case.case
    if law is None:
        return []
    return [
        q.LAW_POINTS.of(law.n_point, at),
        q.LAW_K_N.of(law.k_n.sum(), at),
        *(q.LAW_K_T.of(law.k_t[:, i].sum(), at, n=axis) for i, axis in enumerate("xy")),
        q.LAW_PRELOAD.of(law.preload.sum(), at),
    ]


# -- contact points of a dynamic model -------------------------------------------------------------


def contact_law(solution: ContactSolution, case: NormalCase) -> ContactLaw | None:
    """Contact points of a dynamic model, contact axes, from the fields after one normal load.

    None under no load.
    """
    choice, upper = solution.plan.scene.law, solution.model.upper.name
    force, both = case.solution.force, solution.plan.scene.law.bodies == "both"
    if case.force == 0.0 or not force.any():
        return None

    def sheared(direction: float) -> float:
        """Of the model, N/mm."""
        ways = [stuck for d, stuck in case.stuck.items() if d % 180.0 == direction]
        totals = [total if both else of[upper] for total, of in ways]
        return totals[0] / solution.plan.copies if totals else 0.0

    # Shared out like the pressure, which pushes everywhere; stiffness fields may pull at single
    # nodes, which no spring can. The total is that with the tilt held: the tilt is the dynamic
    # body's own.
    faces = list(solution.lattices.values())
    share = np.concatenate([k.whole(force / force.sum(), extensive=True).ravel() for k in faces])
    answer = case if both else case.alone[upper]
    points = [k.points() for k in faces]
    ends = np.cumsum([len(one) for one in points])
    return contact_points(
        np.vstack(points),
        np.concatenate([k.area().ravel() for k in faces]),
        share * force.sum(),
        share * answer.solution.stiffness,
        np.outer(share, [sheared(0.0), sheared(90.0)]),
        (choice.rows, choice.columns),
        choice.weight,
        np.split(np.arange(ends[-1]), ends[:-1]),
    )


# -- tangential loads ------------------------------------------------------------------------------


def _tangential(solution: ContactSolution, t: TangentialCase, *, misfits: bool) -> Iterable[Result]:
    area = solution.area_of(t.stick)
    if solution.curved:
        known = solution.shear_references(t)
        rows = [(q.STICK_RADIUS, float(np.sqrt(area / np.pi))), (q.SHEAR_RAW, t.displacement)]
        if t.normal.shear_shares:
            bodies = t.load * t.normal.finite_body_shear
            rows.append((q.SHEAR, t.displacement - bodies))
        yield from _beside(t.case, known, *rows)
        yield from _misfits(solution, t) if misfits else ()
    else:
        yield q.TANGENTIAL_LOAD.of(t.load, t.case)
        yield q.DISPLACEMENT.of(t.displacement, t.case)
        yield q.STICK_SHARE.of(t.stick.sum() / max(1, (t.pressed > 0.0).sum()), t.case)
    yield _area(solution, q.STICK_AREA).of(area, t.case)
    yield q.K_T_TANGENT_RAW.of(t.stiffness, t.case)
    if t.load > 0.0:
        yield q.K_T_SECANT_RAW.of(t.load / t.displacement, t.case)


def _misfits(solution: ContactSolution, t: TangentialCase) -> list[Result]:
    """Root mean square difference of the traction from Cattaneo and Mindlin's, where they have a
    closed form, over that of the closed form.
    """
    closed = solution.closed_form_traction(t)
    if closed is None or solution.model.patch.quads is not None:
        return []
    patch = solution.model.patch
    area, theirs = patch.area(), consistent_average(patch, closed)
    traction = solution.tractions(t)[0]
    misfit = np.sqrt((area * (patch.whole(traction) - theirs) ** 2).sum())
    size = float(np.sqrt((area * theirs**2).sum()))
    # without size the contact lies between the nodes
    return [q.MISFIT.of(misfit / size, t.case, source="Cattaneo-Mindlin")] if size > 0.0 else []
