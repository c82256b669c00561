"""Random parameters of the ready recipes: each set ends in a sound mesh or in one clear error.

Used by a benchmark with many sets and by a test with few.
"""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from importlib import import_module
from typing import Any

import numpy as np

from upd.errors import InputError, MeshError
from upd.fem import Material, mass_properties
from upd.mesh import Mesh
from upd.mesh.checks import check_pairs, scaled_jacobian
from upd.mesh.recipes import LEAST_JACOBIAN, parameters

UNIT = Material(E=1.0, nu=0.3, rho=1.0)
#: what a parameter is never
WRONG: tuple[Any, ...] = (0, -1.0, math.nan, math.inf, "5 mm", None, True)
#: numbers of elements that keep a mesh small; the others vary about their defaults
FEW: Mapping[str, Mapping[str, tuple[int, int]]] = {
    "sphere_block": {"divisions": (2, 8)},
    "wedge_platform": {"divisions": (1, 5), "divisions_long": (2, 8)},
    "pads_platform": {"divisions": (1, 4), "divisions_long": (1, 4)},
    "blade_rig": {},
    "sector": {"disk_layers": (1, 6), "blade_layers": (1, 6), "axial": (1, 4)},
}
#: sets of a mesh, whole and by cut, that analyses rely on
SETS: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "sphere_block": {
        "sphere": ("contact", "distant", "axis"),
        "block": ("contact", "distant", "axis"),
    },
    "wedge_platform": {
        "damper": (
            "contact",
            "distant",
            "distant_bands",
            "distant_base",
            "distant_wires",
            "distant_opposite_leg",
            "distant_point",
        ),
        "platform": ("contact", "distant", "distant_opposite", "distant_sides"),
    },
    "pads_platform": {
        "damper": ("contact", "contact_right", "distant", "distant_wires", "distant_bottom"),
        "platform": ("contact", "contact_right", "distant", "distant_opposite", "distant_sides"),
    },
    "blade_rig": {
        "left": ("clamped", "patch", "force", "accelerometer"),
        "right": ("clamped", "patch", "force", "accelerometer"),
        "damper": ("left_patch", "right_patch"),
        "rig": ("clamped", "left_patch", "right_patch", "left", "right", "damper", "left_force"),
    },
    "sector": {
        "sector": ("low", "high", "clamped", "contact_left", "contact_right", "tip", "blade_tip")
    },
}
_CUT = {"half": {"sphere_block": "plane_y"}, "quarter": {"sphere_block": "plane_x"}}
#: most hexahedra of a set that is meshed; finer ones are drawn again
MOST = 2500


@dataclass(frozen=True)
class Outcome:
    """One set of parameters: "sound", "refused", or what is wrong."""

    recipe: str
    given: Mapping[str, Any]
    verdict: str


def sweep(recipe: str, count: int, seed: int, most: int = MOST) -> Iterator[Outcome]:
    """``count`` sets of parameters and what became of each."""
    rng, module = random.Random(seed), import_module(f"geometry.{recipe}")
    done = 0
    while done < count:
        given = draw(recipe, rng)
        verdict = _verdict(recipe, module, given, most)
        if verdict:
            done += 1
            yield Outcome(recipe, given, verdict)


def draw(recipe: str, rng: random.Random) -> dict[str, Any]:
    """A random set: a few dimensions near their defaults, now and then far off or plain wrong."""
    known = {f.name: f for f in fields(parameters(recipe)) if f.init}
    lengths = [name for name, f in known.items() if "bounds" in f.metadata and not _whole(f)]
    given: dict[str, Any] = {}
    for name in rng.sample(lengths, rng.randint(1, min(8, len(lengths)))):
        spread = 2.5 if rng.random() < 0.08 else 0.3
        usual = known[name].default or 0.2
        given[name] = usual * math.exp(rng.uniform(-spread, spread))
    for name, f in known.items():
        choices, few = f.metadata.get("choices"), FEW[recipe].get(name)
        if choices:
            given[name] = rng.choice(choices)
        elif few:
            given[name] = rng.randint(*few)
            given[name] += f.metadata["bounds"].even * (given[name] % 2)
        elif _whole(f) and name != "refine" and rng.random() < 0.3:
            given[name] = rng.randint(1, 2 * f.default)
    if rng.random() < 0.04:
        given[rng.choice(list(known))] = rng.choice(WRONG)
    return given


def _whole(f: Any) -> bool:
    return isinstance(f.default, int)


def _verdict(recipe: str, module: Any, given: Mapping[str, Any], most: int) -> str:
    try:
        params = parameters(recipe)(**given)
    except InputError as error:
        return _refusal(recipe, str(error))
    except Exception as error:  # any other is what the sweep looks for
        return f"raw {type(error).__name__}: {error}"
    counted = module.count(params)
    if sum(body["hexes"] for body in counted.values()) > most:
        return ""
    try:
        meshes = module.build(params)
        pairs = check_pairs(meshes)
    except MeshError as error:
        return f"MeshError: {error}"
    except Exception as error:
        return f"raw {type(error).__name__}: {error}"
    expected = {"none": 0, "glued": 0, "free": 2}.get(getattr(params, "damper", ""), 1)
    expected *= len(meshes) > 1
    problems = [] if len(pairs) >= expected else [f"{len(pairs)} facing sets"]
    volumes = VOLUMES[recipe](params)
    for body, mesh in meshes.items():
        problems += [f"{body}: {p}" for p in _problems(recipe, params, body, mesh, counted[body])]
        volume, exact = mass_properties(mesh, UNIT).volume, volumes.get(body)
        if exact is not None and abs(volume / (exact * _share(params)) - 1.0) > 1e-9:
            problems.append(
                f"{body}: volume {volume:.12g}, closed form {exact * _share(params):.12g}"
            )
    return "; ".join(problems) or "sound"


def _refusal(recipe: str, told: str) -> str:
    """ "refused" when every line begins with parameters of the recipe and says something."""
    known = {f.name for f in fields(parameters(recipe))}
    for line in told.splitlines():
        names, _, rest = line.partition(": ")
        if not set(re.split(r", ", names)) <= known or len(rest) < 10:
            return f"unclear error: {line}"
    lines = told.splitlines()
    return "refused" if len(lines) == len(set(lines)) else f"said twice: {told}"


def _problems(
    recipe: str, params: Any, body: str, mesh: Mesh, counted: Mapping[str, int]
) -> Iterator[str]:
    shape = scaled_jacobian(mesh)
    if not shape.min() > LEAST_JACOBIAN:
        x, y, z = mesh.points[mesh.hexes[shape.argmin()]].mean(axis=0)
        yield f"scaled Jacobian {shape.min():.3g} at ({x:.4g}, {y:.4g}, {z:.4g})"
    if (counted["nodes"], counted["hexes"]) != (mesh.n_node, mesh.n_hex):
        yield f"counted {dict(counted)}, made {mesh.n_node} nodes, {mesh.n_hex} hexahedra"
    if not np.array_equal(np.unique(mesh.hexes), np.arange(mesh.n_node)):
        yield "nodes without an element"
    # blades whose bases stand side by side touch there without being one
    parts = [mesh.nodes[part] for part in ("left", "right", "damper")] if body == "rig" else [...]
    if any(len(np.unique(p, axis=0)) != len(p) for p in (mesh.points[part] for part in parts)):
        yield "a node twice"
    wanted = list(SETS[recipe][body])
    if getattr(params, "symmetry", "full") != "full":
        plane = "plane_y" if recipe == "blade_rig" else "plane_x"
        wanted.append(_CUT.get(params.symmetry, {}).get(recipe, plane))
    missing = [name for name in wanted if not len(mesh.nodes.get(name, ()))]
    if missing:
        yield f"no nodes in {', '.join(missing)}"


def _share(params: Any) -> float:
    return {"full": 1.0, "half": 0.5, "quarter": 0.25}[getattr(params, "symmetry", "full")]


def _sphere_block(p: Any) -> dict[str, float]:
    # of the half-sphere the mesh is an approximation
    return {"block": p.block**3}


def _wedge(p: Any) -> dict[str, float]:
    top = p.base - 2.0 * p.height / math.tan(math.radians(p.angle))
    box = (p.length + 2 * p.margin) * (p.patch_length + 2 * p.margin) * p.thickness
    return {"damper": p.height * (p.base + top) / 2.0 * p.length, "platform": box}


def _pads(p: Any) -> dict[str, float]:
    fall = 1.0 / math.tan(math.radians(p.angle_a)) - math.tan(math.radians(p.angle_b - 90.0))
    length = 2.0 * p.pad_width + p.pad_gap
    section = p.cut * (2.0 * p.ab - p.cut * fall) / 2.0
    pads = p.pad_width * p.pad_length * (2.0 * p.step - p.pad_offset)
    box = (length + 2 * p.margin) * (p.pad_length + 2 * p.margin) * p.thickness
    return {"damper": section * length + pads, "platform": box}


def _rig(p: Any) -> dict[str, float]:
    def side(reach: float, angle: float) -> float:
        wide = reach - p.shank_tx / 2.0
        return wide * p.platform_height - wide**2 * math.tan(math.radians(angle)) / 2.0

    plain = p.base_x * p.base_y * p.base_height + p.core_length * p.core_tx * p.core_wy
    plain += p.shank_length * p.shank_tx * p.shank_wy
    front = p.shank_tx * p.platform_height + side(p.front_halfwidth, p.front_angle)
    blades = {
        name: plain + (front + side(p.rear_halfwidth, angle)) * p.platform_wy
        for name, angle in (("left", 0.0), ("right", p.rear_angle_right))
    }
    if p.arrangement == "symmetric":
        top = p.damper_base - 2.0 * p.damper_height / math.tan(math.radians(p.front_angle))
        damper = (p.damper_base + top) / 2.0 * p.damper_height * p.platform_wy
    else:
        fall = math.tan(math.radians(p.rear_angle_right))
        fall -= math.tan(math.radians(p.damper_angle_left - 90.0))
        damper = p.damper_cut * (2.0 * p.damper_left - p.damper_cut * fall) / 2.0 * p.platform_wy
        damper += p.pad_width * (p.platform_wy - p.pad_gap) * p.pad_step
    return {**blades, "damper": damper, "rig": sum(blades.values()) + damper}


#: recipe -> volumes of the whole bodies in mm3, where a closed form is known
VOLUMES: Mapping[str, Callable[[Any], dict[str, float]]] = {
    "sphere_block": _sphere_block,
    "wedge_platform": _wedge,
    "pads_platform": _pads,
    "blade_rig": _rig,
    # arcs are parabolas or chords between nodes: no closed form of what is meshed
    "sector": lambda p: {},
}
