"""Accuracies that are asked of whole runs: reached or not, by how many levels, at what cost.

Every case asks for an accuracy and lets the run choose. The row shows the levels, and of every
round the largest estimate of the numbers that were asked for over what was wanted of them. A
response is then solved again with every level raised by one and 13 harmonics, as far as the memory
goes, for the true error, of numbers that were given up too. ``python
benchmarks/accuracy/bench_wanted_accuracy.py asymmetric`` runs the last accuracy of these responses
alone, and ``own`` behind it with that contact stiffness of the scene.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import upd
from upd.analyses.base import CHOSEN_BY_ACCURACY
from upd.analyses.forced.results import make_results
from upd.analyses.forced.solve import solve
from upd.analyses.forced.varied import PROBLEM, estimate
from upd.errors import ConvergenceError, InputError, UpdError
from upd.progress import Stages
from upd.scene import AnyScene, load_scene
from upd.vary.wanted import Levels, LevelSearch, plan_wanted, shares_of, solve_wanted

Row = dict[str, Any]
#: at this F_C/F_E most slips
AT_194: Mapping[str, Any] = {
    "want": ["response"],
    "left_out.solve": "no",
    "excitation.centrifugal_to_force": [194],
    "balance.method": "balance",
    "solver.memory": "11 GB",
}
#: scene, its changes, accuracies from coarse to the one that is wanted of it
RUNS: tuple[tuple[str, Mapping[str, Any], tuple[Any, ...]], ...] = (
    ("rig", {"want": ["free"], "left_out.solve": "no"}, ("3 %", "1 %")),
    ("hertz", {}, ("1 %",)),
    ("symmetric", {}, ({"K_N_secant_raw": "1 %"},)),
    ("asymmetric", {}, ({"K_N_per_pad": "1 %"},)),
)
RESPONSES = ("symmetric", "asymmetric")
STIFFNESSES = ("thesis", "own")
WANTED = ({"peak_frequency": "5 %", "peak": "30 %"}, {"peak_frequency": "0.2 %", "peak": "5 %"})


def run() -> Iterator[Row]:
    """A row for every accuracy; for responses one for each true error."""
    for name, changes, accuracies in RUNS:
        for accuracy in accuracies:
            yield _run(name, {**changes, "accuracy": accuracy})
    for name in RESPONSES:
        for wanted in WANTED:
            yield from _response(name, wanted)


def _told(accuracy: Any) -> str:
    if isinstance(accuracy, Mapping):
        return ", ".join(f"{name} {value}" for name, value in accuracy.items())
    return str(accuracy)


def _run(name: str, changes: Mapping[str, Any]) -> Row:
    begin = time.process_time()
    row: Row = {"name": f"accuracy of {name}", "case": _told(changes["accuracy"]), "unit": "s"}
    try:
        found = upd.run(name, overrides=dict(changes))
    except UpdError as error:
        return {**row, "value": time.process_time() - begin, "note": f"missed: {error}"}
    why = next((e["why"] for e in found.effects if "chosen by accuracy" in e["name"]), "")
    return {**row, "value": time.process_time() - begin, "note": f"reached: {why}"}


def _asked(name: str, wanted: Mapping[str, str], stiffness: str) -> AnyScene:
    changes = {**AT_194, "contact.stiffness": [stiffness], "accuracy": dict(wanted)}
    return load_scene(f"{name}-response", changes)


def _response(
    name: str, wanted: Mapping[str, str], stiffness: str = STIFFNESSES[0]
) -> Iterator[Row]:
    asked = _asked(name, wanted, stiffness)
    search, begin = LevelSearch(PROBLEM, asked), time.process_time()
    row: Row = {"name": f"accuracy of {name}-response", "case": _told(wanted), "unit": "s"}
    try:
        solution, _ = solve_wanted(PROBLEM, plan_wanted(PROBLEM, asked), Stages())
        (effect,) = (e for e in solution.plan.effects if e.name in CHOSEN_BY_ACCURACY)
        told = f"reached: {effect.why}"
    except ConvergenceError as error:
        # what it did reach is compared as well
        solution, told = error.partial, f"missed: {error}"
    yield {**row, "value": time.process_time() - begin, "note": told}
    numbers = make_results(solution)
    found = estimate(solution, numbers)
    wanted_shares = shares_of(found, search.accuracies)
    yield from _left(name, numbers, wanted_shares)
    levels = _levels(search, solution)
    fine = _finer(search, levels)
    if fine is None:
        return
    # its bodies are the memory of the finer ones
    del solution
    plan = search.trial(fine)
    plan = replace(plan, scene=replace(plan.scene, accuracy="unknown"))
    begin = time.process_time()
    truth = {(r.name, r.case): r.value for r in make_results(solve(plan, Stages()))}
    took, own = time.process_time() - begin, {(r.name, r.case): r.value for r in numbers}
    for key, shares in wanted_shares.items():
        bound, share = sum(part.error for part in found[key]), sum(shares.values())
        if key in truth:
            yield {
                "name": f"{key[0]}, {name}",
                "case": key[1].label,
                "value": 100.0 * abs(truth[key] / own[key] - 1.0),
                "unit": "%",
                "target": f"<= {100.0 * bound:.2g}",
                "note": f"{share:.2g} of what is wanted; true error against {search.text(fine)} "
                f"({took:.0f} s)",
            }


def _left(
    name: str, numbers: Iterable[Any], shares: Mapping[Any, Mapping[str, float]]
) -> Iterator[Row]:
    """The numbers, with what every source leaves in shares of what is wanted."""
    for one in numbers:
        if (one.name, one.case) not in shares:
            continue
        parts = shares[one.name, one.case]
        told = ", ".join(f"{source} {share:.2f}" for source, share in parts.items())
        yield {
            "name": f"{one.name}, {name}",
            "case": one.case.label,
            "value": one.value,
            "unit": one.unit,
            "note": f"{sum(parts.values()):.2f} of what is wanted: {told}",
        }


def _levels(search: LevelSearch, solution: Any) -> Levels:
    """Those of a solution: the levels whose scene is its own."""
    scene, trial = solution.plan.scene, search.wanted.trial
    return next(
        levels
        for levels in _all(search)
        for mine in (search.scene(levels),)
        if scene in (mine, trial(mine))
    )


def _all(search: LevelSearch) -> Iterator[Levels]:
    def rest(k: int) -> Iterator[Levels]:
        if k == len(search.choices):
            yield ()
            return
        for level in range(len(search.choices[k].labels)):
            for others in rest(k + 1):
                yield (level, *others)

    return rest(0)


def _finer(search: LevelSearch, levels: Levels) -> Levels | None:
    """Every level raised by one, harmonics to the highest; the mesh as it is where the finer one
    does not fit the memory.
    """
    tops = [len(one.labels) - 1 for one in search.choices]
    names = [one.name for one in search.choices]
    fine = [min(k + 1, top) for k, top in zip(levels, tops, strict=True)]
    fine[names.index("harmonics")] = tops[names.index("harmonics")]
    for _ in range(2):
        try:
            search.wanted.refuse(search.planned(tuple(fine)))
        except InputError:
            fine[names.index("mesh")] = levels[names.index("mesh")]
        else:
            return tuple(fine)
    return None


if __name__ == "__main__":
    words = [word for word in sys.argv[1:] if word in RESPONSES]
    stiffness = next((word for word in sys.argv[1:] if word in STIFFNESSES), STIFFNESSES[0])
    for one in words:
        for row in _response(one, WANTED[-1], stiffness):
            print(row, flush=True)
