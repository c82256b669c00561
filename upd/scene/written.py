"""A loaded scene written as a file again, with every value it has."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from itertools import groupby
from textwrap import wrap
from typing import Any

from upd.scene.keys import SceneKey, scene_keys
from upd.scene.toml import toml_key, toml_value
from upd.scene.uncertain import put_back

_WIDTH = 100


def scene_as_run(scene: Any) -> str:
    """The scene with every value, those that its file does not give marked "default".

    Reads back as the same scene.
    """
    head = '# The scene as run: every value. Those marked "default" were not given.\n'
    return head + _written(scene, _given(scene), commented=False)


def scene_to_start_from(scene: Any, name: str) -> str:
    """The scene under another name, each key with its meaning, unit, bounds and effect on cost."""
    head = (
        f'# Begun as a copy of {scene.name}. Lines marked "default" may be left out.\n'
        "# A quantity carries its unit; in brackets: the unit of the bounds, and the bounds.\n\n"
    )
    return head + _written(scene, _given(scene) | {"name": name}, commented=True)


def _given(scene: Any) -> dict[str, Any]:
    """The scene's data with everything that its file gives."""
    data = tomllib.loads(scene.text)
    for one in scene.uncertain.values():
        data = put_back(data, one.steps, one.given)
    return data


def _written(scene: Any, given: Mapping[str, Any], *, commented: bool) -> str:
    lines: list[str] = []
    for tables, keys in groupby(scene_keys(scene), key=lambda k: k.steps[:-1]):
        if tables:
            lines += ["", f"[{'.'.join(map(toml_key, tables))}]"]
        for key in keys:
            if commented:
                lines += ["", *comment(key)]
            lines.append(_line(key, given))
    return "\n".join(lines).lstrip("\n") + "\n"


def comment(key: SceneKey) -> list[str]:
    """What a key means, in lines of a file."""
    facts = "; ".join(fact for fact in (key.unit, key.bounds) if fact)
    # a sign and its number stay on one line
    facts = re.sub(r"([<>]=?) ", "\\1\u00a0", facts)
    text = " ".join(
        part
        for part in (
            key.meaning,
            f"({facts})" if facts else "",
            "" if key.cost == "none" else f"Cost: {key.cost}.",
        )
        if part
    )
    lines = wrap(text, _WIDTH, initial_indent="# ", subsequent_indent="# ")
    return [line.replace("\u00a0", " ") for line in lines]


def _line(key: SceneKey, given: Mapping[str, Any]) -> str:
    name = toml_key(key.name)
    if key.given:
        value: Any = given
        for step in key.steps:
            value = value[step]
        return f"{name} = {toml_value(value)}"
    if key.value != key.default:
        # put in for a word like "from speed", or worked out of another key
        return f"# {name} = {key.value}    # follows from other keys"
    # what no file can give: nothing, or a default of a recipe of one's own that is no value of TOML
    if key.value == "none" or not key.writable:
        return f"# {name} = {key.value}    # default"
    return f"{name} = {key.value}    # default"
