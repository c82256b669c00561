"""What a run of a forced response leaves behind: curves, states, energies, loops, points, figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.model import SIDES, Model
from upd.analyses.forced.solve import Case, ForcedSolution, Linear

Variables = dict[str, Any]
#: loops kept in result.nc and drawn
N_LOOPS = 4


def sizes(solution: ForcedSolution) -> dict[str, int]:
    """Contact points of the first stiffness."""
    return {"n_pairs": next((m.contacts.n_point for m in solution.models.values()), 0)}


def arrays(solution: ForcedSolution) -> dict[str, dict[str, Any]]:
    """Arrays for result.nc: case -> name -> (dimensions, array, attributes)."""
    out: dict[str, dict[str, Any]] = {}
    for name, model in solution.models.items():
        out[f"points {name}"] = _points(model)
        if name in solution.linear:
            out[f"linear {name}"] = _linear(solution.linear[name])
    for case in solution.cases:
        if not case.empty:
            out[f"friction {case.label}"] = _case(solution, case)
    for name, curve in solution.performances.items():
        for branch in curve.branches:
            out[f"performance {name}, {branch.name}"] = {
                "ratio": (("point",), branch.ratio, {"units": "1", "long_name": "F_C/F_E", "message": branch.message}),
                "peak_frequency": (("point",), branch.frequency, {"units": "Hz"}),
                "peak_accelerance": (("point",), branch.height, {"units": "(m/s2)/N"}),
                "lift": (("point",), branch.lift, {"units": "1", "long_name": "share of points and cycle lifted off"}),
            }
    return out


def _points(model: Model) -> Variables:
    law = model.contacts.law
    return {
        "position": (("contact_point", "component"), model.position, {"units": "mm"}),
        "face": (("contact_point",), model.face, {"flag_meanings": "left right"}),
        "k_n": (("contact_point",), law.k_n, {"units": "N/mm"}),
        "k_t": (("contact_point",), law.k_t, {"units": "N/mm"}),
    }


def _complex(H: Any) -> tuple[tuple[str, str], Any, dict[str, str]]:
    return (("frequency", "part"), np.stack([H.real, H.imag], axis=-1), {"units": "(m/s2)/N", "part": "real imaginary"})


def _linear(linear: Linear) -> Variables:
    out: Variables = {"frequency": (("frequency",), linear.frequency, {"units": "Hz"})}
    for kind, curves in (("free", linear.free), ("stuck", linear.stuck)):
        out |= {f"accelerance_{kind}_{side}": _complex(curves[side]) for side in SIDES}
    x = [m for m in linear.modes if m.axis == "x"]
    return out | {"stuck_mode": (("mode",), np.array([m.frequency for m in x]), {"units": "Hz"})}


def _case(solution: ForcedSolution, case: Case) -> Variables:
    answer = case.answer
    fp = ("frequency", "contact_point")
    out: Variables = {
        "frequency": (("frequency",), answer.frequency, {"units": "Hz", "status": answer.status, "message": answer.message}),
        "excitation_force": ((), np.array(case.force), {"units": "N"}),
        **{f"accelerance_{side}": _complex(case.accelerance[side]) for side in SIDES},
        "state": ((*fp, "state"), answer.state, {"units": "1", "state": "stick slip lift, shares of the cycle"}),
        "energy": (fp, answer.energy, {"units": "N mm", "long_name": "friction loss per cycle"}),
        "power": (fp, measures.power(answer), {"units": "W"}),
        "truncation": (("frequency",), answer.truncation, {"units": "1"}),
        "aliasing": (("frequency",), answer.aliasing, {"units": "1"}),
        "energy_balance": (("frequency",), answer.energy_balance, {"units": "1"}),
        "damper": (
            ("frequency", "damper_dof", "coefficient"),
            solution.models[case.stiffness].damper_dofs(answer.coefficients),
            {"units": "mm, rad", "coefficient": "a0 a1 b1 ..."},
        ),
    }
    peaks = measures.at_peaks(answer, case.accelerance["right"]) if solution.plan.scene.wants("hysteresis") else []
    found = [(answer.frequency[i], one) for _, i in peaks for one in measures.loops(answer, i, N_LOOPS)]
    if found:
        loops = [one for _, one in found]
        out |= {
            "loop_frequency": (("loop",), np.array([f for f, _ in found]), {"units": "Hz", "long_name": "the peak each loop belongs to"}),
            "loop_point": (("loop",), np.array([one.point for one in loops]), {"long_name": "contact point of each loop"}),
            "loop_displacement": (("loop", "sample"), np.array([one.displacement for one in loops]), {"units": "mm"}),
            "loop_traction": (("loop", "sample"), np.array([one.traction for one in loops]), {"units": "N"}),
            "loop_limit": (("loop", "sample"), np.array([one.limit for one in loops]), {"units": "N"}),
        }
    return out


def write_files(solution: ForcedSolution, folder: Path) -> None:
    """Figures into the run folder."""
    # matplotlib is slow to import: only when files are wanted.
    from upd.analyses.forced.plots import save_figures

    save_figures(solution, folder)
