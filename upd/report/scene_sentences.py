"""A scene in sentences, from its file and the size of its model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

_RECIPES = {
    "sphere_block": "A half-sphere pressed on a block",
    "wedge_platform": "A wedge-shaped damper on one blade platform",
    "pads_platform": "An asymmetric damper with two raised pads on one blade platform",
    "blade_rig": "A rig of two blades on their bases",
}
_EQUILIBRIA = {
    "opposing": "the equilibrium with friction opposing F_C",
    "frictionless": "the equilibrium without friction",
    "reversed": "the equilibrium with friction reversed, along F_C",
}
_SYMMETRY = {
    "quarter": "a quarter of the model, two mirror planes",
    "half": "half of the model, one mirror plane",
    "full": "the whole model",
}


def sentences(summary: Mapping[str, Any]) -> list[str]:
    """What is simulated, of what, under which loads, and how large the model is."""
    scene = summary["scene_file"]
    made = [
        _geometry(scene),
        _materials(scene),
        _contact(scene),
        _loads(scene),
        _dynamics(scene),
        _seating(scene),
        _model(summary),
    ]
    return [text for text in made if text]


def _geometry(scene: Mapping[str, Any]) -> str:
    table = scene.get("geometry", {})
    recipe = str(table.get("recipe", ""))
    known = _RECIPES.get(recipe, f"Geometry of the recipe {recipe}" if recipe else "")
    lengths = [
        f"{key.replace('_', ' ')} {value}"
        for key, value in table.items()
        if isinstance(value, str) and value[:1].isdigit()
    ]
    return f"{known}{': ' + ', '.join(lengths) if lengths else ''}." if known else ""


def _materials(scene: Mapping[str, Any]) -> str:
    tables = scene.get("materials") or (
        {"all bodies": scene["material"]} if "material" in scene else {}
    )
    told = {name: _material(table) for name, table in tables.items() if isinstance(table, Mapping)}
    if not told:
        return ""
    if len(set(told.values())) == 1:
        return f"{_listed(list(told)).capitalize()}: {next(iter(told.values()))}."
    return "; ".join(f"{name}: {text}" for name, text in told.items()) + "."


def _material(table: Mapping[str, Any]) -> str:
    parts = [f"E = {table['E']}"] if "E" in table else []
    parts += [f"ν = {table['nu']}"] if "nu" in table else []
    parts += [f"density {table['density']}"] if "density" in table else []
    parts += [f"yield stress {table['yield_stress']}"] if "yield_stress" in table else []
    return ", ".join(parts)


def _contact(scene: Mapping[str, Any]) -> str:
    friction = scene.get("contact", {}).get("friction")
    if friction is None:
        return ""
    return f"Coulomb friction, µ = {friction}." if friction else "No friction."


def _loads(scene: Mapping[str, Any]) -> str:
    loads = scene.get("loads", {})
    parts = []
    parts += _centrifugal(loads, "centrifugal force")
    if loads.get("normal"):
        parts.append(
            f"normal force from {_listed([_EQUILIBRIA.get(v, str(v)) for v in loads['normal']])}"
        )
    if loads.get("tangential"):
        parts.append(f"tangential force {_listed([f'{v:g}' for v in loads['tangential']])} of µN")
    if any(d != 0 for d in loads.get("directions", [])):
        parts.append(f"along {_listed([str(d) for d in loads['directions']])}")
    text = ", ".join(parts).replace(
        "normal force from ", "normal force " if _plain(loads) else "normal force from "
    )
    return f"{text[0].upper()}{text[1:]}." if text else ""


def _centrifugal(table: Mapping[str, Any], name: str) -> list[str]:
    """The centrifugal force as it was given: in newtons, or by radius and speed."""
    if "speed" in table and "radius" in table:
        mass = f"mass {table['mass']}, " if "mass" in table else ""
        return [f"{name} of {mass}radius {table['radius']}, speed {table['speed']}"]
    equals = " =" if name.endswith("F_C") else ""
    return [f"{name}{equals} {table['centrifugal']}"] if "centrifugal" in table else []


def _plain(loads: Mapping[str, Any]) -> bool:
    return not any(v in _EQUILIBRIA for v in loads.get("normal", []))


def _dynamics(scene: Mapping[str, Any]) -> str:
    parts = []
    modes, response = (
        scene.get("modes", {}),
        scene.get("response", {}) | scene.get("excitation", {}),
    )
    parts += _centrifugal(scene.get("damper", {}), "centrifugal force on the damper F_C")
    if response.get("force"):
        parts.append(f"F_E = {_listed([str(v) for v in response['force']])}")
    elif response.get("centrifugal_to_force"):
        parts.append(f"F_C/F_E = {_listed([f'{v:g}' for v in response['centrifugal_to_force']])}")
    if "excitation" in scene:
        parts.append(f"excited at mid-core by {_forces(scene['excitation'].get('forces', []))}")
    if "below" in modes:
        parts.append(f"modes below {modes['below']}")
    if modes.get("arrangements"):
        parts.append(f"damper {_listed([str(a) for a in modes['arrangements']])}")
    if "start" in response and "stop" in response:
        parts.append(f"response from {response['start']} to {response['stop']}")
    if "damping" in response:
        parts.append(f"damping ratio {response['damping']}")
    text = ", ".join(parts)
    return f"{text[0].upper()}{text[1:]}." if text else ""


def _forces(given: Sequence[Mapping[str, Any]]) -> str:
    """Forces as the file has them; F_E on the right blade without any."""
    told = []
    for one in given or [{}]:
        amplitude = one.get("amplitude", 1.0)
        words = "F_E" if amplitude == 1.0 else f"{amplitude} F_E"
        words += f" at {one['phase']}" if "phase" in one else ""
        words += f" on the {one.get('blade', 'right')} blade"
        told.append(words + (f" in harmonic {one['harmonic']}" if "harmonic" in one else ""))
    return _listed(told)


def _seating(scene: Mapping[str, Any]) -> str:
    """How a damper is seated, and how a blade is moved then."""
    seating, moved = scene.get("seating", {}), scene.get("moved", {})
    if not seating:
        return ""
    # as the file has it: a number or per cent
    text = f"F_C raised from nothing, lowered to {seating.get('lowest')} of it and raised again"
    if "moved" in scene.get("want", []):
        ways = _listed([str(one) for one in moved.get("directions", [])])
        text += f"; then the right blade moved by {moved.get('amplitude')} along {ways}"
    return f"{text}."


def _model(summary: Mapping[str, Any]) -> str:
    size = summary["size"]
    dofs, pairs = sum(size.get("n_dof", {}).values()), size.get("n_pairs")
    element = summary["scene_file"].get("mesh", {}).get("element", "")
    symmetry = _SYMMETRY.get(str(size.get("symmetry")), f"symmetry {size.get('symmetry')}")
    contact = f", {pairs} contact pairs" if pairs else ""
    return (
        f"Solved on {symmetry}: {f'{dofs:,}'.replace(',', ' ')} degrees of "
        f"freedom{contact}{', elements ' + element if element else ''}."
    )


def _listed(items: Sequence[str]) -> str:
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}"
