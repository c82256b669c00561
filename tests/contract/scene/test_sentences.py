"""What a user reads about a bad value: never pydantic's own words, always what to write instead."""

from __future__ import annotations

import re
import typing
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from datetime import date
from typing import Any

import pytest

from upd.errors import InputError
from upd.scene import ForcedScene, RigScene, Scene, SeatedScene, load_scene
from upd.scene.toml import value_of

SCENES: dict[str, Any] = {
    "hertz": Scene,
    "rig": RigScene,
    "symmetric-response": ForcedScene,
    "symmetric-seated": SeatedScene,
}
#: a value of every kind, most of them wrong at most keys
BAD: tuple[Any, ...] = (
    3,
    -1.5,
    10**400,
    float("nan"),
    float("inf"),
    True,
    None,
    "x",
    "",
    "[50 N, 200 N]",
    "12.5 mm",
    b"\xff",
    date(1979, 5, 27),
    [],
    [3],
    ["x", "y", "z"],
    [[]],
    {},
    {"a": 1},
    object(),
)
#: how pydantic begins its sentences, and words of Python that say nothing to a user
RAW = re.compile(
    r"Input should|Field required|[Uu]nable to|Unexpected|Value error|valid (?:tuple|string|"
    r"integer|number|dictionary|mapping)|instance of|validation error"
)


def places(cls: Any, prefix: str = "") -> Iterator[tuple[type, str, str]]:
    """Class, name and path of all keys of a scene's class, with names of our own where its tables
    have free ones.
    """
    hints = typing.get_type_hints(cls)
    for f in fields(cls):
        if f.name == "text":
            continue
        path, kind = f"{prefix}{f.name}", hints[f.name]
        # a key of a class that another one inherits from is the same in both
        owner = next(
            c for c in reversed(cls.__mro__) if f.name in getattr(c, "__annotations__", {})
        )
        yield owner, f.name, path
        inside = [k for k in (kind, *typing.get_args(kind)) if is_dataclass(k)]
        if inside:
            free = typing.get_origin(kind) is Mapping
            yield from places(inside[0], f"{path}.{'thesis.' if free else ''}")


def every_place() -> dict[str, list[str]]:
    """Paths by scene; a key of a table that several scenes share stands with the first of them."""
    out: dict[str, list[str]] = {name: [] for name in SCENES}
    seen = set()
    for name, cls in SCENES.items():
        for owner, key, path in places(cls):
            if (owner, key) not in seen:
                out[name].append(path)
            seen.add((owner, key))
    return out


PLACES = every_place()


def problems(name: str, path: str, value: Any) -> list[str]:
    try:
        load_scene(name, {path: value})
    except InputError as error:
        return str(error).splitlines()
    return []


def example_in(line: str, path: str) -> str | None:
    """What the sentence about a key asks for."""
    place, _, told = line.strip().partition(": ")
    found = re.search(r"; write (?:for example|one of) (.+?)(?:, (?:quotes|without).*)?$", told)
    if place != path or found is None:
        return None
    return found[1].split(", ")[0] if "one of" in found[0] else found[1]


@pytest.mark.parametrize("name", PLACES)
def test_no_sentence_is_raw_and_what_it_asks_for_is_taken(name: str) -> None:
    for path in PLACES[name]:
        taken: set[str | None] = {None}
        for value in BAD:
            for line in problems(name, path, value):
                assert not RAW.search(line), line
                example = example_in(line, path)
                if example not in taken:
                    taken.add(example)
                    after = problems(name, path, value_of(example))
                    again = [b for b in after if b.strip().startswith(f"{path}: ")]
                    assert not [b for b in again if "; write " in b], (value, line, after)


@pytest.mark.parametrize(
    ("name", "override", "told"),
    [
        ("hertz", "loads.normal=50 N", """'50 N' is no list; write for example ["50 N\""""),
        ("hertz", "loads.normal=[50 N, 200 N]", """["50 N", "200 N"], quotes included"""),
        ("hertz", "want=normal", """write for example ["normal", "stiffness"], quotes included"""),
        ("hertz", "mesh.element=hex9", 'did you mean "hex8"?; write one of "hex8", "hex8i"'),
        ("hertz", "contact.directions=3", "3 is none of its values; write one of 1, 2"),
        ("hertz", "contact=3", "is no table; write for example { friction = 0.3 }"),
        ("hertz", "materials.sphere=3", """{ E = "200 GPa", nu = 0.3 }"""),
        ("hertz", "loads.cycle_steps=many", "is no whole number; write for example 12, without"),
        ("hertz", "loads.cycle_steps=20.5", "20.5 is no whole number; write for example 12"),
        ("hertz", 'contact.load_point=["1 mm"]', """[1]: is missing; write ["5 mm", "5 mm"]"""),
        ("hertz", 'contact.load_point=["1 mm", "2 mm", "3 mm"]', """has 3 values; write ["5"""),
        ("hertz", "title=3", "3 is no text; write for example"),
        ("hertz", "contact.distant=x", """is no table; write for example { damper = "wires" }"""),
        ("hertz", "contact.distant.block=3", """is no text; write for example "wires\""""),
        ("hertz", "geometry=3", """is no table; write for example { recipe = "sphere_block\""""),
        ("rig", "response.peak=high", "is no number; write for example 120.0, without quotes"),
        ("rig", "response.peak=nan", "is no finite number; write for example 120.0"),
        ("rig", "modes.arrangements=symmetric", """["symmetric", "asymmetric"], quotes included"""),
        ("symmetric-response", "analysis=modes", 'write one of "forced response", "seated damper"'),
        ("symmetric-response", "contact.stiffness=thesis", """write for example ["thesis"]"""),
        ("symmetric-response", 'stiffness.own.left={K_N="1 N/mm"}', """add for example K_T ="""),
        ("symmetric-response", "excitation.centrifugal_to_force=194", "write for example [60.0"),
    ],
)  # fmt: skip
def test_each_kind_of_value_has_its_sentence(name: str, override: str, told: str) -> None:
    with pytest.raises(InputError) as caught:
        load_scene(name, [override])
    assert told in str(caught.value)
