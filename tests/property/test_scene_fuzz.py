"""Scenes with a few values changed at random, planned and run: no traceback, no hang, JSON that any
reader takes, and no "ok" where a number that was asked for is missing.

The seed is fixed; toy sizes, without figures.
"""

from __future__ import annotations

import copy
import json
import math
import random
import signal
import tomllib
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from upd import load_scene, make_plan, run
from upd.errors import UpdError
from upd.results.check import OK
from upd.scene import ready_scenes

SEED = 20240
#: longest of a plan and of a run, s; no toy takes a tenth of it
PLAN_S, RUN_S = 20, 120
#: plans larger than these are not run
MOST_NODES, MOST_STEPS = 3000, 400
CONTACT = {
    "mesh.element": "hex8",
    "loads.tangential": [0.5],
    "loads.curve_points": 2,
    "loads.cycle_steps": 100,
    "left_out.solve": "no",
}
FLAT = CONTACT | {
    "geometry.divisions": 4,
    "geometry.divisions_long": 4,
    "law.rows": 2,
    "law.columns": 2,
    "loads.normal": ["opposing"],
}
DYNAMIC = {"mesh.element": "hex8", "left_out.solve": "no"}
RESPONSE = DYNAMIC | {
    "reduction.modes": 2,
    "contact.rows": 1,
    "contact.columns": 1,
    "contact.stiffness": ["thesis"],
    "excitation.centrifugal_to_force": [2000.0],
    "excitation.points": 10,
    "balance.harmonics": 1,
    "want": ["response"],
}
#: ready scene -> what makes it a toy, and how often it is drawn
TOYS: Mapping[str, tuple[Mapping[str, Any], int]] = {
    "hertz": (
        CONTACT
        | {"geometry.divisions": 4, "geometry.patch": "auto", "loads.normal": ["50 N", "200 N"]},
        15,
    ),
    "symmetric": (FLAT, 3),
    "asymmetric": (FLAT | {"want": ["normal", "stiffness", "tangential"]}, 1),
    "rig": (
        DYNAMIC | {"modes.arrangements": ["symmetric"], "response.points": 20, "want": ["free"]},
        1,
    ),
    "symmetric-response": (RESPONSE, 1),
    "asymmetric-response": (RESPONSE, 1),
}
#: output -> numbers of which each case it is asked for has at least one; with "mu" only where there
#: is friction
NUMBERS: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "curved contact": {
        "normal": ("approach", "max_pressure", "contact_area"),
        "stiffness": ("K_N_tangent_raw", "K_N_secant_raw"),
        "body_compression": ("approach_finite_body",),
        "tangential mu": ("stick_radius", "tangential_displacement_raw"),
        "cycle mu": ("cycle_energy",),
    },
    "flat contact": {
        "normal": ("approach", "max_pressure", "contact_area"),
        "stiffness": ("K_N_tangent_raw", "K_N_secant_raw"),
        "tangential mu": ("stick_share", "displacement"),
        "cycle mu": ("cycle_energy",),
        "worn_zones": ("pressure_peaks",),
        "contact_law": ("law_k_n", "law_points"),
    },
    "rig": {
        "free": ("f1_free",),
        "glued": ("f1_glued",),
        "reduction": ("f1_reduced",),
        "response": ("peak_frequency", "peak_accelerance"),
    },
    "forced response": {"response": ("peak_1_frequency", "peak_1_accelerance")},
}
WORDS = ("", "auto", "all", "two", "none", "x", "5 furlong", "nan", "[", "\u00b5", "0 N", "1e-6 N")
FACTORS = (0.0, 1e-9, 1e-6, 1e-3, 0.1, 0.5, 0.9, 1.1, 2.0, 3.0, 10.0, 1e3, 1e6, 1e12, -1.0)


def toy(name: str) -> dict[str, Any]:
    """Tables of the ready scene as a toy."""
    data = tomllib.loads(ready_scenes()[name].read_text(encoding="utf-8"))
    for path, value in TOYS[name][0].items():
        *parents, last = path.split(".")
        node = data
        for key in parents:
            node = node.setdefault(key, {})
        node[last] = copy.deepcopy(value)
    return data


def places(node: Any) -> Iterator[tuple[Any, Any]]:
    """Every container with a key of it."""
    for key in node if isinstance(node, dict) else range(len(node)):
        yield node, key
        if isinstance(node[key], (dict, list)):
            yield from places(node[key])


def other(value: Any, draw: random.Random) -> Any:
    """A value in place of ``value``."""
    if draw.random() < 0.12:
        return draw.choice([*WORDS, 0, 1, -3, 2.5, 7, [], {}, [1, "a"], True])
    if isinstance(value, (bool, dict)):
        return draw.choice([{}, 1, "a"])
    if isinstance(value, int):
        return draw.choice([0, 1, 2, 3, 4, 5, value + 1, max(1, value - 1), 2 * value])
    if isinstance(value, float):
        return value * draw.choice(FACTORS)
    if isinstance(value, list):
        more = [other(one, draw) for one in value[:1]]
        return draw.choice([value[::-1], value + value[:1], value[:1], value + more])
    number, _, unit = str(value).partition(" ")
    try:
        return f"{float(number) * draw.choice(FACTORS):.6g} {unit}".strip()
    except ValueError:
        return draw.choice(WORDS)


def mutated(name: str, draw: random.Random) -> dict[str, Any]:
    """The toy with one to three values changed or left out."""
    data = toy(name)
    for _ in range(draw.choice([1, 1, 2, 3])):
        node, key = draw.choice(
            [p for p in places(data) if p[1] not in ("recipe", "analysis", "name", "solve")]
        )
        if isinstance(node, dict) and draw.random() < 0.08:
            del node[key]
        else:
            node[key] = other(node[key], draw)
    return data


@contextmanager
def within(seconds: int, data: Any) -> Iterator[None]:
    """The block, or a failure that shows the scene when it takes longer."""

    def hangs(*_: object) -> None:
        pytest.fail(f"hangs for more than {seconds} s: {data}")

    before = signal.signal(signal.SIGALRM, hangs)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def planned(data: dict[str, Any]) -> tuple[Any, Any] | None:
    """Scene and plan; None when it is refused, with one of our own errors."""
    try:
        with within(PLAN_S, data):
            scene = load_scene(data)
            return scene, make_plan(scene)
    except UpdError as error:
        assert str(error).strip(), data
    except Exception as error:
        raise AssertionError(f"{type(error).__name__}: {error}\n{data}") from error
    return None


def runnable(scene: Any, plan: Any) -> bool:
    """Whether the run stays a toy."""
    loads = getattr(scene, "loads", None)
    steps = 0 if loads is None else loads.cycle_steps + len(loads.normal) * loads.curve_points
    for table, key in (("response", "points"), ("excitation", "points"), ("balance", "harmonics")):
        value = getattr(getattr(scene, table, None), key, 0)
        steps += value * 40 if key == "harmonics" and isinstance(value, int) else 0
        steps += value if key == "points" else 0
    nodes = sum(size["nodes"] for size in plan.size.values())
    return nodes <= MOST_NODES and steps <= MOST_STEPS


def strict(text: str) -> dict[str, Any]:
    """JSON as the standard has it: no NaN, no Infinity."""

    def refuse(word: str) -> float:
        raise AssertionError(f"{word} in summary.json")

    found: dict[str, Any] = json.loads(text, parse_constant=refuse)
    return found


def missing(scene: Any, summary: Mapping[str, Any]) -> list[str]:
    """Outputs of the scene of which the summary has no number and tells no reason."""
    friction = not hasattr(scene, "loads") or scene.contact.friction > 0.0
    if "tangential" in scene.want and not getattr(scene.loads, "tangential", ()):
        friction = False
    names = {r["name"] for r in summary["results"]}
    out = []
    for key, wanted in NUMBERS[scene.analysis].items():
        output, _, needs = key.partition(" ")
        told = output.replace("_", " ") in summary["status"]
        if output in scene.want and (friction or not needs) and not told:
            out += [f"{output}: {name}" for name in wanted if name not in names]
    out += [r["name"] for r in summary["results"] if r["value"] is None and not r.get("withheld")]
    if summary["status"] == OK:
        out += [r["name"] for r in summary["results"] if r["value"] is None]
    return out


def examine(data: dict[str, Any], scene: Any, out: Path) -> str:
    """Run it; the word of how it ended."""
    try:
        with within(RUN_S, data), warnings.catch_warnings():
            warnings.simplefilter("error")
            result = run(scene, out=out, report=False)
    except UpdError as error:
        assert str(error).strip(), data
        if (out / "summary.json").exists():
            assert strict((out / "summary.json").read_text("utf-8"))["status"] != OK, data
        return "failed"
    except Exception as error:
        raise AssertionError(f"{type(error).__name__}: {error}\n{data}") from error
    summary = strict((out / "summary.json").read_text("utf-8"))
    assert not missing(scene, summary), f"{missing(scene, summary)}\n{summary['status']}\n{data}"
    assert all(r["value"] is None or math.isfinite(r["value"]) for r in summary["results"]), data
    return result.outcome


def fuzz(plans: int, runs: int, dynamic: int, seed: int, folder: Path) -> dict[str, int]:
    """Plan at least so many scenes, run so many of those that were not refused, at most so many of
    these rigs and responses, which take longest.
    """
    draw = random.Random(seed)
    names = [name for name, (_, often) in TOYS.items() for _ in range(often)]
    count = {"refused": 0, "planned": 0, "run": 0, "dynamic": 0}
    k = -1
    while k < plans or count["run"] < runs:
        k += 1
        data = mutated(draw.choice(names), draw)
        found = planned(copy.deepcopy(data))
        count["refused" if found is None else "planned"] += 1
        slow = found is not None and not hasattr(found[0], "loads")
        if slow and count["dynamic"] >= dynamic:
            continue
        if found is not None and count["run"] < runs and runnable(*found):
            count["dynamic"] += slow
            word = examine(data, found[0], folder / str(k))
            count["run"] += 1
            count[word] = count.get(word, 0) + 1
    return count


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[Path]]:
    """Figures take longer than a toy: the tests of charts draw them."""

    def none(*_: object) -> list[Path]:
        return []

    monkeypatch.setattr("upd.runner.write_figures", none)
    return none


@pytest.mark.usefixtures("no_figures")
def test_mutated_scenes_are_answered_or_refused(tmp_path: Path) -> None:
    count = fuzz(150, 15, 2, SEED, tmp_path)
    assert count["refused"] + count["planned"] >= 150
    assert count["run"] == 15, count
    # The set is worth nothing when all of it is refused, or nothing is.
    assert count["refused"] > 30 and count.get("ok", 0) > 2, count


@pytest.mark.full
def test_many_mutated_scenes_are_answered_or_refused(tmp_path: Path) -> None:
    """With figures."""
    assert fuzz(2000, 400, 400, SEED + 1, tmp_path)["run"] == 400
