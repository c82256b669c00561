"""What a forced response leaves behind.

Curves, linear limits, contact points, states, energies, loops, peaks over F_C/F_E.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curve_arrays import (
    FRICTION,
    LINEAR,
    MARCHED,
    MEASURED,
    PERFORMANCE,
    POINTS,
    SWEEP,
    Variables,
    faces_friction,
    friction_arrays,
    linear_arrays,
    marched_arrays,
    peaks_by_sweep,
    performance_arrays,
    shares_by_face,
    swept_arrays,
)
from upd.analyses.forced.curve_results import measured_peaks
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.solution import ForcedSolution
from upd.analyses.forced.sweeps import faces_places
from upd.analyses.measured import measured_arrays
from upd.mesh import IntArray
from upd.results import ArrayGroup, Case, variable


def sizes(solution: ForcedSolution) -> dict[str, int]:
    """Contact points of the first stiffness, or nodes of whole faces."""
    points = [m.contacts.n_point for m in solution.models.values()]
    return {"n_pairs": next(iter(points + [f.of.n for f in solution.faces.values()]), 0)}


def arrays(solution: ForcedSolution) -> dict[str, ArrayGroup]:
    """Arrays for result.nc.

    Returns
    -------
    dict
        Group -> variable -> (dimensions, array, attributes). Contents: "points" and "linear" of
        every stiffness, "friction" of every curve, "sweep" and "marched peaks" of every sweep (the
        latter what the contact does at its peaks), "performance", the "measured" peaks, and every
        "measured curve".
    """
    out: dict[str, ArrayGroup] = {}
    scene = solution.plan.scene

    def add(content: str, case: Case | str, variables: Variables) -> None:
        """A group of a case, or of a stiffness."""
        mine = case if isinstance(case, Case) else Case(stiffness=case)
        out[f"{content} {case}"] = ArrayGroup(variables, content=content, case=mine)

    for name, model in solution.models.items():
        add(POINTS, name, _points(model))
    for name in solution.faces if scene.wants("contact_state") else ():
        add(POINTS, name, _nodes(solution, name))
    for name, linear in solution.linear.items():
        add(LINEAR, name, linear_arrays(solution, linear))
    for curve in (c for c in solution.curves if not c.empty):
        add(FRICTION, curve.case, friction_arrays(solution, curve))
    for path in (c for c in solution.balanced if not c.empty):
        whole = faces_friction(path, solution.marked_points(path))
        if scene.wants("contact_state"):
            places = faces_places(solution, path.stiffness)
            whole["share"] = shares_by_face(whole["state"][1], places)
        add(FRICTION, path.case, whole)
    for one in (s for s in solution.sweeps if len(s.frequency)):
        add(SWEEP, one.case, swept_arrays(one, excitation_of(scene.excitation)))
    for one, marched in peaks_by_sweep(solution.marched):
        add(MARCHED, one.case, marched_arrays(solution, marched))
    for name, performance in solution.performances.items():
        add(PERFORMANCE, name, performance_arrays(performance))
    out |= measured_arrays(scene.measured) if out else {}
    measured = measured_peaks(solution.plan)
    if measured and out:
        source = ", ".join(dict.fromkeys(one.source for one in measured))
        frequency = variable("peak", [one.value for one in measured], "Hz", source=source)
        out["measured peaks"] = ArrayGroup({"frequency": frequency}, content=MEASURED)
    return out


def _points(model: Model) -> Variables:
    law, at = model.contacts.law, "contact_point"
    return _places(model.position, model.face, *measures.place(model)) | {
        "k_n": variable(at, law.k_n, "N/mm"),
        "k_t": variable(at, law.k_t, "N/mm"),
        "static_force": variable(
            f"{at} static_component",
            np.column_stack([law.preload, model.traction]),
            "N",
            "before vibration: normal force, then tractions",
        ),
    }


def _nodes(solution: ForcedSolution, name: str) -> Variables:
    """Nodes of whole faces, in the variables of contact points without springs."""
    of, places = solution.faces[name].of, faces_places(solution, name)
    area = {"area": variable("contact_point", places.weight, "mm2")}
    return _places(of.position, places.face, places.along, places.up) | area


def _places(position: Array, face: IntArray, along: Array, up: Array) -> Variables:
    """Where contact points lie: in space, and in the frames of their faces."""
    at, low = "contact_point", "place up the slope, from the lowest point of the face"
    return {
        "position": variable(f"{at} component", position, "mm"),
        "face": variable(at, face, flag_meanings="left right"),
        "along": variable(at, along, "mm", "place along the damper"),
        "up": variable(at, up, "mm", low),
    }


def write_files(solution: ForcedSolution, folder: Path) -> None:
    """Nothing beside the arrays: every figure is drawn from them."""
    del solution, folder
